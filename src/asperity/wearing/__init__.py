"""What wears and roughens the surfaces of a contact: laws, mechanisms, and jumps over many over-rollings."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
