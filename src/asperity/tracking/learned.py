"""What a series has shown so far, so that a further recording is judged beside it instead of all of them anew.

Resonances and cleaned spectra are kept at hand by file; what all recordings share is learned again as the series grows.
"""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields
from io import BytesIO
from typing import Any, NamedTuple

import numpy as np

from asperity.errors import UnreadableFile
from asperity.kept import sealed, unsealed
from asperity.signals import Spectrum
from asperity.wear import AlarmState, CleanSpectrum, Resonance, Shared, learn_series, remove_lines

WHOLE = 32  # recordings up to which all are separated together each time
GROWTH = 0.25  # of a longer series, after which what all recordings share is learned anew


class Before(NamedTuple):
    """What was said before: states by file, and why an alarm stands, by what."""

    states: Mapping[str, AlarmState]
    reason: str = ""
    raised_by: str = ""


@dataclass
class Learned:
    """The memory of one watched series; empty at first."""

    shared: Shared | None = None
    since: int = 0  # recordings heard since
    cleaned: dict[str, tuple[Spectrum, CleanSpectrum]] = field(default_factory=dict)
    found: dict[str, Resonance] = field(default_factory=dict)

    def clean(self, file: str, spectrum: Spectrum, shaft_hz: Sequence[float] | None) -> CleanSpectrum:
        """A spectrum without its tones, worked out once."""
        held = self.cleaned.get(file)
        highest = spectrum.frequency_hz[-1]
        if held is None or held[0].density is not spectrum.density or held[0].frequency_hz[-1] != highest:
            held = self.cleaned[file] = (spectrum, remove_lines(spectrum, shaft_hz=shaft_hz))
            self.found.pop(file, None)
        return held[1]

    def resonances(
        self, files: Sequence[str], cleaned: Sequence[CleanSpectrum], band_hz: tuple[float, float]
    ) -> list[Resonance]:
        """One a recording, by the joint separation."""
        for gone in set(self.cleaned) - set(files):
            self.cleaned.pop(gone)
            self.found.pop(gone, None)
        shared = self.shared
        new = [number for number, file in enumerate(files) if file not in self.found]
        held = len(files) - len(new)
        aged = len(files) <= WHOLE or self.since + (len(new) if held else 0) > GROWTH * len(files)
        if shared is None or aged or shared.band_hz != band_hz or not shared.fits(cleaned[0].spectrum):
            spectra, kept = [clean.spectrum for clean in cleaned], [clean.kept for clean in cleaned]
            every, self.shared = learn_series(spectra, band_hz=band_hz, kept=kept)
            self.since, self.found = 0, dict(zip(files, every, strict=True))
        elif new:
            beside = [cleaned[number] for number in new]
            lines = shared.resonances([clean.spectrum for clean in beside], [clean.kept for clean in beside])
            self.found |= {files[number]: line for number, line in zip(new, lines, strict=True)}
            self.since += len(new) if held else 0
        return [self.found[file] for file in files]


def learned_bytes(shared: Shared) -> bytes:
    """What all recordings share, as bytes, to be read by `learned_from`."""
    arrays: dict[str, Any] = {}
    told: dict[str, Any] = {}
    for one in fields(Shared):
        value = getattr(shared, one.name)
        (arrays if isinstance(value, np.ndarray) else told)[one.name] = value
    packed = BytesIO()
    np.savez(packed, told=np.array(json.dumps(told)), **arrays)
    return sealed(packed.getvalue())


def learned_from(content: bytes, since: int) -> Learned:
    """What `learned_bytes` made, `since` recordings ago; nothing, where that is damaged: it is learned anew."""
    try:
        with np.load(BytesIO(unsealed(content, "what was learned", "it is learned anew"))) as stored:
            told = json.loads(str(stored["told"]))
            arrays = {name: stored[name] for name in stored.files if name != "told"}
    except UnreadableFile:
        return Learned()
    if {*told, *arrays} != {one.name for one in fields(Shared)}:  # of another version
        return Learned()
    band, reach = (told.pop(name) for name in ("band_hz", "reach"))
    return Learned(Shared(band_hz=(band[0], band[1]), reach=(reach[0], reach[1]), **told, **arrays), since)
