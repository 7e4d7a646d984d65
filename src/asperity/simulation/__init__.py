"""Simulation in time: moving roughness and wear, stored in a resumable folder."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
