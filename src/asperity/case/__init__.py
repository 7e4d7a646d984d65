"""The case file: a contact written down in TOML with units, turned into objects and back."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
