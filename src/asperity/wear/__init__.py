"""Wear of the bodies: wear laws, mechanisms, and coefficients fitted to tests."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
