"""Machine structures around a contact: their modes with the contact, and its share of each."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
