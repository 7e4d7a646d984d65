"""Figures and HTML reports; they show stored results and compute nothing new."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
