"""What is the paper's: its case, every number it prints, its table, its rig."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
