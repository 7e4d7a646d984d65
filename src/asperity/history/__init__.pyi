from .history import Frame as Frame
from .history import History as History
from .run import HistoryProgress as HistoryProgress
from .run import run_history as run_history
from .store import is_history as is_history
from .store import load_history as load_history
from .vibration import HistoryVibration as HistoryVibration
from .vibration import history_vibration as history_vibration
