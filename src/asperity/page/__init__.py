"""The live page: a contact whose knobs are turned; recordings, studies and histories looked at."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
