from .motion import Memory as Memory
from .motion import Snapshot as Snapshot
from .motion import Steps as Steps
from .motion import moving_contact as moving_contact
from .motion import step_seconds as step_seconds
