"""A mass on a contact spring over a moving profile, and what passes under it. Knows nothing of oil."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
