"""The benchmark: contacts with certified values, and any solver held against them.

Cases are plain files, made by `benchmark/certify.py`; what is drawn of the rows is left to
`asperity.report`.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
