"""Solved cases: the contact, derived quantities, vibration of a mass on it; friction curves."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
