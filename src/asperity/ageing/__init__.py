"""A case let wear over hours: its jumps taken and kept, what they come to, recordings of it at any moment."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
