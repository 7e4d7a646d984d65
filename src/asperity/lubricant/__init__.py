"""The oil: one family of laws a file, and the lubricant made of one of each."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
