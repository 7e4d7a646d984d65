"""Ratings as standards print them: bearing life, specific film, flash temperature, Dang Van; they solve nothing."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
