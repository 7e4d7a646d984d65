"""What a vibration spectrum says about wear: contact-resonance indicators."""

from asperity.wear.indicators import INDICATOR_METHODS, Resonance, contact_resonance, no_resonance

__all__ = ["INDICATOR_METHODS", "Resonance", "contact_resonance", "no_resonance"]
