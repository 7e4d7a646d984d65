from .history import WearHistory as WearHistory
from .rows import of_body as of_body
from .run import WearProgress as WearProgress
from .run import run_wear as run_wear
from .store import is_wear as is_wear
from .store import load_wear as load_wear
