from .answer import Answer as Answer
from .answer import Sound as Sound
from .answer import Tile as Tile
from .opening import Opened as Opened
from .opening import open_page as open_page
from .server import serve_page as serve_page
