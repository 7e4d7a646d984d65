"""Ratings by standards and closed forms: bearing life, micropitting, flash temperature, fatigue."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
