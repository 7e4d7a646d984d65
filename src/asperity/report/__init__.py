"""What people look at: figures and the one-page report. Nothing is computed here that is not in a run."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
