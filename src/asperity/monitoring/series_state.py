"""Memory of a series, so that a further recording is judged without separating all of them again.

Resonances and cleaned spectra are kept by file; what all recordings share is learned again as the
series grows.
"""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields
from io import BytesIO
from math import nan
from typing import Any, NamedTuple

import numpy as np

from asperity.core.arrays import Mask
from asperity.core.documents import JsonObject
from asperity.core.errors import UnreadableFile
from asperity.core.signals import Spectrum
from asperity.core.storage import CONTENT_ENTRY, append_digest, strip_digest, unpack_arrays
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

ALWAYS_RELEARNED = 32  # recordings up to which all are separated together each time
MAX_GROWTH = 0.25  # of a longer series, after which the shared part is learned again


class StoredLevels(NamedTuple):
    """Memory of the levels up to and including the recording of the file `last`, by level."""

    last: str
    monitors: Mapping[str, JsonObject]


class PreviousStates(NamedTuple):
    """States by file from previous judgements; reason and indicator of a standing alarm.

    Without `levels`, `before_gap` is the file after which recordings of a long series are missing.
    """

    states: Mapping[str, AlarmState]
    reason: str = ""
    raised_by: str = ""
    levels: StoredLevels | None = None
    before_gap: str = ""


Key = tuple[str, str]  # of a recording: file and sensor


class SensorLine(NamedTuple):
    """Line of a recording on several sensors, the sensors that detect it, and their own results."""

    resonance: Resonance
    detected_by: tuple[str, ...]
    alone: Mapping[str, Resonance | None]


@dataclass
class SeriesMemory:
    """Memory of a watched series of one or several sensors; empty at first.

    `shared` is the shared part of the recordings after the last of `moved`, those at which a
    sensor was moved.
    """

    shared: Shared | SharedBySensors | None = None
    since: int = 0  # recordings since the shared part was learned
    moved: tuple[Key, ...] = ()
    cleaned: dict[Key, tuple[Spectrum, CleanSpectrum]] = field(default_factory=dict)
    found: dict[Key, Resonance] = field(default_factory=dict)
    together: dict[tuple[Key, ...], SensorLine] = field(default_factory=dict)

    def clean(
        self, key: Key, spectrum: Spectrum, shaft_hz: Sequence[float] | None
    ) -> CleanSpectrum:
        """Return a spectrum without tones; computed once per spectrum."""
        cached = self.cleaned.get(key)
        highest = spectrum.frequency_hz[-1]
        if (
            cached is None
            or cached[0].density is not spectrum.density
            or cached[0].frequency_hz[-1] != highest
        ):
            cached = self.cleaned[key] = (spectrum, remove_lines(spectrum, shaft_hz=shaft_hz))
            self.found.pop(key, None)
            for keys in [keys for keys in self.together if key in keys]:
                self.together.pop(keys)
        return cached[1]

    def resonances(
        self, keys: Sequence[Key], cleaned: Sequence[CleanSpectrum], band_hz: tuple[float, float]
    ) -> list[Resonance]:
        """Return the resonance of each recording of one sensor, by joint separation."""
        self._keep_only(keys)
        self.found = {key: line for key, line in self.found.items() if key in self.cleaned}
        shared = self.shared
        new = [number for number, key in enumerate(keys) if key not in self.found]
        if (
            not isinstance(shared, Shared)
            or shared.band_hz != band_hz
            or not shared.fits(cleaned[0].spectrum)
            or self._must_relearn(len(keys), len(new))
        ):
            self._relearn(keys, cleaned, band_hz)
        elif new:
            added = [cleaned[number] for number in new]
            lines = shared.resonances(
                [clean.spectrum for clean in added], [clean.kept for clean in added]
            )
            self.found |= {keys[number]: line for number, line in zip(new, lines, strict=True)}
            self._count_new(len(keys), len(new))
        return [self.found[key] for key in keys]

    def _relearn(
        self, keys: Sequence[Key], cleaned: Sequence[CleanSpectrum], band_hz: tuple[float, float]
    ) -> None:
        """Learn the shared part of one sensor and the resonance of each recording."""
        spectra = [clean.spectrum for clean in cleaned]
        kept = [clean.kept for clean in cleaned]
        lines, self.shared, moved = learn_series(spectra, band_hz=band_hz, kept=kept)
        self.since, self.found = 0, dict(zip(keys, lines, strict=True))
        self.moved = tuple(keys[number] for number in moved)

    def lines(
        self,
        keys: Sequence[tuple[Key, ...]],
        spectra: Mapping[str, Sequence[Spectrum | None]],
        kept: Mapping[str, Sequence[Mask | None]],
        band_hz: tuple[float, float],
    ) -> list[SensorLine]:
        """Return the line of each recording of several sensors; `keys` are those with spectra."""
        self._keep_only([key for of_recording in keys for key in of_recording])
        self.together = {
            key: line for key, line in self.together.items() if set(key) <= {*self.cleaned}
        }
        shared = self.shared
        new = [number for number, key in enumerate(keys) if key not in self.together]
        if (
            not isinstance(shared, SharedBySensors)
            or not shared.fits(spectra, band_hz)
            or self._must_relearn(len(keys), len(new))
        ):
            self._relearn_sensors(keys, spectra, kept, band_hz)
        elif new:
            sensor_lines = shared.lines(
                {name: [series[number] for number in new] for name, series in spectra.items()},
                {name: [series[number] for number in new] for name, series in kept.items()},
            )
            self.together |= {
                keys[number]: line
                for number, line in zip(new, _by_recording(sensor_lines), strict=True)
            }
            self._count_new(len(keys), len(new))
        return [self.together[key] for key in keys]

    def _relearn_sensors(
        self,
        keys: Sequence[tuple[Key, ...]],
        spectra: Mapping[str, Sequence[Spectrum | None]],
        kept: Mapping[str, Sequence[Mask | None]],
        band_hz: tuple[float, float],
    ) -> None:
        """Learn the shared part of several sensors and the line of each recording."""
        lines, self.shared = learn_sensors(spectra, band_hz=band_hz, kept=kept)
        self.since, self.together = 0, dict(zip(keys, _by_recording(lines), strict=True))
        self.moved = tuple(
            next((key for key in keys[number] if key[1] == name), keys[number][0])
            for number, name in lines.moved
        )

    @property
    def lead(self) -> str:
        """Sensor whose amplitudes a line has, as in earlier rows; empty at first."""
        return next(iter(self.shared.by_sensor)) if isinstance(self.shared, SharedBySensors) else ""

    @property
    def common(self) -> float:
        """Share of the error that sensors have in common; nan for one sensor or too few data."""
        shares = (
            [*self.shared.agreement.common.values()]
            if isinstance(self.shared, SharedBySensors)
            else []
        )
        return sum(shares) / len(shares) if shares else nan

    def _keep_only(self, keys: Sequence[Key]) -> None:
        for key in set(self.cleaned) - set(keys):
            self.cleaned.pop(key)

    def _must_relearn(self, count: int, new: int) -> bool:
        """Tell whether the shared part has to be learned again."""
        return (
            count <= ALWAYS_RELEARNED
            or self.since + (new if new < count else 0) > MAX_GROWTH * count
        )

    def _count_new(self, count: int, new: int) -> None:
        self.since += new if new < count else 0


def _by_recording(lines: SensorLines) -> list[SensorLine]:
    return [
        SensorLine(
            resonance, detected_by, {name: series[number] for name, series in lines.alone.items()}
        )
        for number, (resonance, detected_by) in enumerate(
            zip(lines.resonances, lines.detected_on, strict=True)
        )
    ]


def pack_shared(shared: Shared | SharedBySensors) -> bytes:
    """Pack the shared part of a series as bytes for `unpack_shared`."""
    arrays: dict[str, Any] = {}
    by_sensor = shared.by_sensor if isinstance(shared, SharedBySensors) else {"": shared}
    content: dict[str, Any] = {"sensors": [*by_sensor], "of": []}
    for number, of_sensor in enumerate(by_sensor.values()):
        values = {part.name: getattr(of_sensor, part.name) for part in fields(Shared)}
        arrays |= {
            f"{number} {name}": value
            for name, value in values.items()
            if isinstance(value, np.ndarray)
        }
        content["of"].append(
            {name: value for name, value in values.items() if not isinstance(value, np.ndarray)}
        )
    if isinstance(shared, SharedBySensors):
        common, wider, established = shared.agreement
        content["agreement"] = [
            [[*pair, share] for pair, share in common.items()],
            wider,
            established,
        ]
    packed = BytesIO()
    entries: dict[str, Any] = {CONTENT_ENTRY: np.array(json.dumps(content)), **arrays}
    np.savez(packed, **entries)
    return append_digest(packed.getvalue())


def unpack_shared(content: bytes, since: int) -> SeriesMemory:
    """Unpack the result of `pack_shared`, `since` recordings old; empty if damaged."""
    try:
        name, remedy = "the memory of a series", "it is learned again"
        arrays = unpack_arrays(strip_digest(content, name, remedy), name, remedy)
        state = json.loads(str(arrays.pop(CONTENT_ENTRY)))
    except (UnreadableFile, KeyError):  # damaged, or of another version
        return SeriesMemory()
    by_sensor = {}
    for number, name in enumerate(state.get("sensors", [])):
        values = state["of"][number] | {
            key.split()[1]: value for key, value in arrays.items() if key.split()[0] == str(number)
        }
        if {*values} != {part.name for part in fields(Shared)}:
            return SeriesMemory()  # of another version
        values |= {name: tuple(values[name]) for name in ("band_hz", "reach")}
        by_sensor[name] = Shared(**values)
    if not by_sensor:
        return SeriesMemory()  # of another version
    leading = next(iter(by_sensor.values()))
    if "agreement" not in state:
        return SeriesMemory(leading, since)
    common, wider, established = state["agreement"]
    agreement = Agreement(
        {(first, second): share for first, second, share in common}, wider, tuple(established)
    )
    return SeriesMemory(
        SharedBySensors(by_sensor=by_sensor, agreement=agreement, band_hz=leading.band_hz), since
    )
