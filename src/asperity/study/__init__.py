"""Sweeps of a case: what is varied, where it is computed, what is kept, and what the paper's anchors say to it.

`plan` says which cases there are, `evaluate` turns one into a row, `store` keeps rows through any
crash, `execute` spreads cases over processes or machines. On these stand `curve` (the paper's Figs
7 and 8), `sensitivity` and `calibration`.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
