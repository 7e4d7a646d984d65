from .history import Frame as Frame
from .history import History as History
from .history import HistoryProgress as HistoryProgress
from .history import is_history as is_history
from .history import load_history as load_history
from .history import run_history as run_history
from .vibration import HistoryVibration as HistoryVibration
from .vibration import history_vibration as history_vibration
