from .model import Body as Body
from .model import Change as Change
from .model import Mechanism as Mechanism
from .model import Passage as Passage
from .model import Patch as Patch
