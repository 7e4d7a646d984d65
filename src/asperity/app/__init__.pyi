from .contact_page import ReportTools as ReportTools
from .contact_result import ContactResult as ContactResult
from .contact_result import ResonanceSpectrum as ResonanceSpectrum
from .contact_result import ResultTile as ResultTile
from .opening import OpenedPage as OpenedPage
from .opening import open_page as open_page
from .serving import serve_page as serve_page
