"""What a series has shown so far, so that a further recording is judged beside it instead of all of them anew.

Resonances and cleaned spectra are kept at hand by file; what all recordings share is learned again
as the series grows.
"""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields
from io import BytesIO
from math import nan
from typing import Any, NamedTuple

import numpy as np

from asperity.core.arrays import Mask
from asperity.core.errors import UnreadableFile
from asperity.core.signals import Spectrum
from asperity.core.storage import append_digest, strip_digest
from asperity.resonance import (
    Agreement,
    CleanSpectrum,
    Resonance,
    SensorLines,
    Shared,
    SharedBySensors,
    learn_sensors,
    learn_series,
    remove_lines,
)
from asperity.trend import AlarmState

WHOLE = 32  # recordings up to which all are separated together each time
GROWTH = 0.25  # of a longer series, after which what all recordings share is learned anew


class Before(NamedTuple):
    """What was said before: states by file, and why an alarm stands, by what."""

    states: Mapping[str, AlarmState]
    reason: str = ""
    raised_by: str = ""


Key = tuple[str, str]  # of a recording: its file, and the sensor that heard it


class Together(NamedTuple):
    """What sensors say of a recording: the line, who hears it, and each by itself."""

    resonance: Resonance
    detected_on: tuple[str, ...]
    alone: Mapping[str, Resonance | None]


@dataclass
class Learned:
    """The memory of one watched series, of one sensor or of several; empty at first.

    `shared` is what the recordings behind the last of `moved` share, those with which a sensor was
    moved.
    """

    shared: Shared | SharedBySensors | None = None
    since: int = 0  # recordings heard since
    moved: tuple[Key, ...] = ()
    cleaned: dict[Key, tuple[Spectrum, CleanSpectrum]] = field(default_factory=dict)
    found: dict[Key, Resonance] = field(default_factory=dict)
    together: dict[tuple[Key, ...], Together] = field(default_factory=dict)

    def clean(
        self, key: Key, spectrum: Spectrum, shaft_hz: Sequence[float] | None
    ) -> CleanSpectrum:
        """A spectrum without its tones, worked out once."""
        held = self.cleaned.get(key)
        highest = spectrum.frequency_hz[-1]
        if (
            held is None
            or held[0].density is not spectrum.density
            or held[0].frequency_hz[-1] != highest
        ):
            held = self.cleaned[key] = (spectrum, remove_lines(spectrum, shaft_hz=shaft_hz))
            self.found.pop(key, None)
            for keys in [keys for keys in self.together if key in keys]:
                self.together.pop(keys)
        return held[1]

    def resonances(
        self, keys: Sequence[Key], cleaned: Sequence[CleanSpectrum], band_hz: tuple[float, float]
    ) -> list[Resonance]:
        """One a recording of one sensor, by the joint separation."""
        self._forget_but(keys)
        self.found = {key: line for key, line in self.found.items() if key in self.cleaned}
        shared = self.shared
        new = [number for number, key in enumerate(keys) if key not in self.found]
        known = (
            isinstance(shared, Shared)
            and shared.band_hz == band_hz
            and shared.fits(cleaned[0].spectrum)
        )
        if not isinstance(shared, Shared) or not known or self._outgrown(len(keys), len(new)):
            spectra, kept = [clean.spectrum for clean in cleaned], [clean.kept for clean in cleaned]
            every, self.shared, moved = learn_series(spectra, band_hz=band_hz, kept=kept)
            self.since, self.found = 0, dict(zip(keys, every, strict=True))
            self.moved = tuple(keys[number] for number in moved)
        elif new:
            beside = [cleaned[number] for number in new]
            lines = shared.resonances(
                [clean.spectrum for clean in beside], [clean.kept for clean in beside]
            )
            self.found |= {keys[number]: line for number, line in zip(new, lines, strict=True)}
            self._grown(len(keys), len(new))
        return [self.found[key] for key in keys]

    def lines(
        self,
        keys: Sequence[tuple[Key, ...]],
        spectra: Mapping[str, Sequence[Spectrum | None]],
        kept: Mapping[str, Sequence[Mask | None]],
        band_hz: tuple[float, float],
    ) -> list[Together]:
        """One a recording of several sensors, whose keys are those of which it has spectra."""
        self._forget_but([key for every in keys for key in every])
        self.together = {
            key: line for key, line in self.together.items() if set(key) <= {*self.cleaned}
        }
        shared = self.shared
        new = [number for number, key in enumerate(keys) if key not in self.together]
        known = isinstance(shared, SharedBySensors) and shared.fits(spectra, band_hz)
        if (
            not isinstance(shared, SharedBySensors)
            or not known
            or self._outgrown(len(keys), len(new))
        ):
            told, self.shared = learn_sensors(spectra, band_hz=band_hz, kept=kept)
            self.since, self.together = 0, dict(zip(keys, _by_recording(told), strict=True))
            self.moved = tuple(
                next((key for key in keys[number] if key[1] == name), keys[number][0])
                for number, name in told.moved
            )
        elif new:
            some = {name: [every[number] for number in new] for name, every in spectra.items()}
            told = shared.lines(
                some, {name: [every[number] for number in new] for name, every in kept.items()}
            )
            self.together |= {
                keys[number]: line for number, line in zip(new, _by_recording(told), strict=True)
            }
            self._grown(len(keys), len(new))
        return [self.together[key] for key in keys]

    @property
    def lead(self) -> str:
        """The sensor whose heights a line has, as rows that were given have them; none before sensors were learned."""
        return next(iter(self.shared.by_sensor)) if isinstance(self.shared, SharedBySensors) else ""

    @property
    def common(self) -> float:
        """The share of their errors that sensors have in common; nan of one sensor, or where too little tells."""
        shares = (
            [*self.shared.agreement.common.values()]
            if isinstance(self.shared, SharedBySensors)
            else []
        )
        return sum(shares) / len(shares) if shares else nan

    def _forget_but(self, keys: Sequence[Key]) -> None:
        for gone in set(self.cleaned) - set(keys):
            self.cleaned.pop(gone)

    def _outgrown(self, count: int, new: int) -> bool:
        """Whether what all recordings share is to be learned anew."""
        return count <= WHOLE or self.since + (new if new < count else 0) > GROWTH * count

    def _grown(self, count: int, new: int) -> None:
        self.since += new if new < count else 0


def _by_recording(told: SensorLines) -> list[Together]:
    return [
        Together(
            resonance, detected_on, {name: every[number] for name, every in told.alone.items()}
        )
        for number, (resonance, detected_on) in enumerate(
            zip(told.resonances, told.detected_on, strict=True)
        )
    ]


def learned_bytes(shared: Shared | SharedBySensors) -> bytes:
    """What all recordings share, as bytes, to be read by `learned_from`."""
    arrays: dict[str, Any] = {}
    by_sensor = shared.by_sensor if isinstance(shared, SharedBySensors) else {"": shared}
    told: dict[str, Any] = {"sensors": [*by_sensor], "of": []}
    for number, one in enumerate(by_sensor.values()):
        values = {part.name: getattr(one, part.name) for part in fields(Shared)}
        arrays |= {
            f"{number} {name}": value
            for name, value in values.items()
            if isinstance(value, np.ndarray)
        }
        told["of"].append(
            {name: value for name, value in values.items() if not isinstance(value, np.ndarray)}
        )
    if isinstance(shared, SharedBySensors):
        common, wider, established = shared.agreement
        told["agreement"] = [[[*pair, share] for pair, share in common.items()], wider, established]
    packed = BytesIO()
    np.savez(packed, told=np.array(json.dumps(told)), **arrays)
    return append_digest(packed.getvalue())


def learned_from(content: bytes, since: int) -> Learned:
    """What `learned_bytes` made, `since` recordings ago; nothing, where that is damaged: it is learned anew."""
    try:
        with np.load(
            BytesIO(strip_digest(content, "what was learned", "it is learned anew"))
        ) as stored:
            told = json.loads(str(stored["told"]))
            arrays = {name: stored[name] for name in stored.files if name != "told"}
    except UnreadableFile:
        return Learned()
    by_sensor = {}
    for number, name in enumerate(told.get("sensors", [])):
        values = told["of"][number] | {
            key.split()[1]: value for key, value in arrays.items() if key.split()[0] == str(number)
        }
        if {*values} != {one.name for one in fields(Shared)}:
            return Learned()  # of another version
        values |= {name: tuple(values[name]) for name in ("band_hz", "reach")}
        by_sensor[name] = Shared(**values)
    if not by_sensor:
        return Learned()  # of another version
    first = next(iter(by_sensor.values()))
    if "agreement" not in told:
        return Learned(first, since)
    common, wider, established = told["agreement"]
    agreement = Agreement(
        {(one, other): share for one, other, share in common}, wider, tuple(established)
    )
    return Learned(
        SharedBySensors(by_sensor=by_sensor, agreement=agreement, band_hz=first.band_hz), since
    )
