"""Series of recordings: read, put in order, judged, and watched as they grow."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
