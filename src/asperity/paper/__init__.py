"""The paper of Xu et al. (2025): its case, published numbers, Table 1 and simulated rig."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
