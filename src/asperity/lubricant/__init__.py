"""Oils: a family of laws per module, and lubricants with one law of each family."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
