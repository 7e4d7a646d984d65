"""Vibration of a mass on a contact spring over a moving profile, independent of the lubricant."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
