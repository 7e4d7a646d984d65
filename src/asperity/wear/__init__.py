"""What vibration spectra say about wear: contact-resonance indicators, their series, stages and alarms."""

from asperity.wear.indicators import INDICATOR_METHODS, Resonance, contact_resonance, no_resonance
from asperity.wear.lines import CleanSpectrum, Line, remove_lines
from asperity.wear.series import series_resonances
from asperity.wear.stages import Stages, split_stages
from asperity.wear.trend import Alarm, Facts, LoadShare, alarm, consistency, load_share

__all__ = [
    "INDICATOR_METHODS",
    "Alarm",
    "CleanSpectrum",
    "Facts",
    "Line",
    "LoadShare",
    "Resonance",
    "Stages",
    "alarm",
    "consistency",
    "contact_resonance",
    "load_share",
    "no_resonance",
    "remove_lines",
    "series_resonances",
    "split_stages",
]
