"""Contact spectroscopy: what recordings say of a contact, with intervals, and what to run next."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
