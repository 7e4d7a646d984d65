"""Parameter studies of a case: plan, execution, storage, wear curve, sensitivity and calibration.

`plan` lists the cases, `evaluate` computes one row per case, `store` stores rows crash-safely,
`execute` distributes cases over processes or machines. `curve` (the paper's Figs 7 and 8),
`global_sensitivity` and `calibration` build on them.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
