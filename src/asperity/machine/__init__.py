"""Machine elements: what bearings, gears, discs and cams are made of becomes the list of their contacts; no film."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
