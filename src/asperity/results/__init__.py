"""Cases solved: the contact, what is read off it, how a mass on it vibrates; friction curves."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
