from .contact_result import Answer as Answer
from .contact_result import Sound as Sound
from .contact_result import Tile as Tile
from .opening import Opened as Opened
from .opening import open_page as open_page
from .server import serve_page as serve_page
