"""Bayesian inference of a contact's state from recordings, forecasts, and experiment design."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
