"""What vibration spectra say about wear: contact-resonance indicators, their series, stages and alarms."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
