"""One recording of a series, as it was heard on one sensor or on several at one time, and these in words."""

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from typing import Any

import numpy as np

from asperity.core.arrays import finite_or_none
from asperity.core.quantities import quantity
from asperity.monitoring.operating_point import Operating
from asperity.monitoring.reading import Reading
from asperity.rating import ZONES, severity_zone
from asperity.resonance import SENSORS_DISAGREE, CleanSpectrum, Resonance
from asperity.trend import AlarmState

MISSED = 3  # recordings without one of the sensors, from which on that is said
NAMED = {
    "depths": "depth",
    "lines": "line",
    "bands": "band",
}  # of a row: several numbers, each by its own name
STATED = tuple(one.name for one in fields(Operating))


@dataclass(frozen=True, slots=True, kw_only=True)
class OnSensor:
    """What one of several sensors says of a recording: `alone` by itself, None where it has no usable spectrum.

    `hears` says whether it hears the line that is the contact's.
    """

    reading: Reading
    alone: Resonance | None
    hears: bool

    def row(self) -> dict[str, Any]:
        """Its part of the recording's line."""
        quality, alone = self.reading.quality, self.alone
        return {
            "file": self.reading.file,
            "hears": self.hears,
            "crf_hz": None if alone is None else finite_or_none(alone.crf_hz),
            "crf_std_hz": None if alone is None else finite_or_none(alone.crf_std_hz),
            "crfa": None if alone is None else finite_or_none(alone.crfa),
            "rms": None if quality is None else finite_or_none(quality.rms),
            "kurtosis": None if quality is None else finite_or_none(quality.kurtosis),
            "reason": self.reading.reason or ("" if alone is None else alone.reason),
        }


@dataclass(frozen=True, slots=True, kw_only=True)
class TrackedRecording:
    """One recording of a series; of several sensors what they heard at one time.

    `resonance` is not found, with its reason, for a recording that could not be used. `clr` and
    its 90 % interval are the contact model's reading of the CRF, nan without one. `damping_reason`
    says why the width of its line is no damping ratio that can be followed; empty where it is one.
    `crf_reference_hz` and `damping_reference` are CRF and damping ratio as they would be at the
    load, speed and temperature of the first recordings. `label` is the stage's name; `state` the
    alarm's after it. Of several sensors `on_sensors` has what each says, by name, and `reading`
    and `file` are those of the first whose spectrum counts. `remounted` names the sensor, empty of
    the only one, that hears through another structure from this recording on.
    """

    file: str
    x: float
    x_std: float
    reading: Reading
    clean: CleanSpectrum | None
    resonance: Resonance
    damping_reason: str = ""
    operating: Operating = field(default_factory=Operating)
    crf_reference_hz: float = np.nan
    damping_reference: float = np.nan
    clr: float = np.nan
    clr_interval: tuple[float, float] = (np.nan, np.nan)
    severe_probability: float = np.nan
    label: str = "none"
    state: AlarmState = "none"
    on_sensors: Mapping[str, OnSensor] = field(default_factory=dict)
    remounted: str | None = None

    @property
    def readings(self) -> dict[str, Reading]:
        """What was read of it, by sensor."""
        return {name: one.reading for name, one in self.on_sensors.items()} or {
            self.reading.sensor: self.reading
        }

    @property
    def files(self) -> list[str]:
        """Files that hold it, its own first."""
        return [*dict.fromkeys([self.file, *(reading.file for reading in self.readings.values())])]

    def moved(self, to: Mapping[str, str]) -> "TrackedRecording":
        """The same, its files by other names."""
        heard = {
            name: replace(one, reading=replace(one.reading, file=to[one.reading.file]))
            for name, one in self.on_sensors.items()
        }
        reading = replace(self.reading, file=to[self.reading.file])
        return replace(self, file=to[self.file], reading=reading, on_sensors=heard)

    @property
    def dead(self) -> bool:
        """Whether no sensor hears anything."""
        qualities = [one.quality for one in self.readings.values() if one.quality is not None]
        return bool(qualities) and all(one.dead for one in qualities)

    @property
    def damping(self) -> tuple[float, float]:
        """Damping ratio of its line and the standard deviation of that; nan where it is not determined."""
        if self.damping_reason:
            return np.nan, np.nan
        return self.resonance.damping_ratio, self.resonance.damping_ratio_std

    @property
    def zone(self) -> str | None:
        """Its zone of ISO 20816-3, A to D; None without a machine class, an acceleration, or a long enough record."""
        reading = self._gravest
        if "machine_class" not in reading.facts or not np.isfinite(reading.velocity):
            return None
        return severity_zone(reading.velocity, reading.facts["machine_class"][0])

    @property
    def _gravest(self) -> Reading:
        """What the sensor of the greatest velocity heard."""
        known = [one for one in self.readings.values() if np.isfinite(one.velocity)]
        return max(known, key=lambda one: one.velocity, default=self.reading)

    def severity(self) -> str:
        """Its velocity and zone in words, or why they are not determined."""
        reading, zone = self._gravest, self.zone
        velocity = reading.velocity
        if not np.isfinite(velocity):
            return "velocity not determined: it takes an acceleration of known unit, at 2.5 kHz or more for 3.2 s or more"
        on = f" on {reading.sensor}" if self.on_sensors else ""
        said = f"velocity {quantity('velocity_rms').text(velocity)} rms, 10 to 1000 Hz{on}"
        if zone is None:
            return f"{said}; zone of ISO 20816-3 not determined: no machine_class is stated beside the recording"
        return f"{said}: zone {zone} of ISO 20816-3 ({reading.facts['machine_class'][0]}), {ZONES[zone]}"

    def row(self) -> dict[str, Any]:
        """Its line of the table, by the names of `asperity track --json`; None where there is nothing."""
        resonance, damping, read = self.resonance, self.damping, self._read(self.reading)
        return {
            "file": read["file"],
            "x": read["x"],
            "x_std": finite_or_none(self.x_std),
            "crf_hz": finite_or_none(resonance.crf_hz),
            "crf_std_hz": finite_or_none(resonance.crf_std_hz),
            "crf_shared_std_hz": finite_or_none(resonance.crf_shared_std)
            if resonance.found
            else None,
            "crfa": finite_or_none(resonance.crfa),
            "crfa_std": finite_or_none(resonance.crfa_std),
            "damping_ratio": finite_or_none(damping[0]),
            "damping_std": finite_or_none(damping[1]),
            "damping_reason": self.damping_reason,
            "found": resonance.found,
            "reason": resonance.reason,
            "clr": finite_or_none(self.clr),
            "clr_low": finite_or_none(self.clr_interval[0]),
            "clr_high": finite_or_none(self.clr_interval[1]),
            "severe_probability": finite_or_none(self.severe_probability),
            "label": self.label,
            "state": self.state,
            **read,
            "zone": self.zone,
            "crf_reference_hz": finite_or_none(self.crf_reference_hz),
            **{name: getattr(self.operating, name) for name in STATED},
            "sensors": {name: one.row() for name, one in self.on_sensors.items()},
        }

    def row_on(self, sensor: str, row: Mapping[str, Any]) -> dict[str, Any]:
        """Its line of the table, `row`, as one of its sensors has it."""
        return {**row, **self._read(self.readings[sensor])}

    def _read(self, reading: Reading) -> dict[str, Any]:
        """What a line has of the reading itself."""
        quality = reading.quality
        return {
            "file": reading.file,
            "x": None if reading.refused else finite_or_none(self.x),
            "started": reading.started or None,
            "rate_hz": finite_or_none(reading.rate_hz),
            "unit": reading.unit or None,
            "duration_s": None if quality is None else quality.duration_s,
            **{
                name: None if quality is None else finite_or_none(getattr(quality, name))
                for name in ("rms", "crest", "kurtosis")
            },
            "velocity_rms": finite_or_none(reading.velocity),
            **{
                name: {key: finite_or_none(value) for key, value in getattr(reading, name).items()}
                for name in NAMED
            },
            "remarks": "; ".join(quality.remarks) if quality is not None else "",
        }


def heard_in_words(recordings: Sequence[TrackedRecording]) -> str:
    """On which of several sensors the line was heard, where they disagree, and who is silent; empty of one sensor."""
    names = list(dict.fromkeys(name for one in recordings for name in one.on_sensors))
    if not names:
        return ""
    heard = Counter(
        " and ".join(
            name for name in names if name in one.on_sensors and one.on_sensors[name].hears
        )
        for one in recordings
        if one.resonance.found
    )
    said = [f"on {who} in {count}" for who, count in heard.most_common()]
    sentence = (
        f"The line was heard {', '.join(said)}."
        if said
        else "No line was heard as one by two sensors."
    )
    apart = sum(one.resonance.reason.startswith(SENSORS_DISAGREE) for one in recordings)
    if apart:
        sentence += f" The sensors disagree in {apart}: that is no single claim."
    for name in names:
        silent = [
            one.on_sensors[name].reading.reason
            for one in recordings
            if name in one.on_sensors
            and not one.on_sensors[name].reading.usable
            and any(other.reading.usable for other in one.on_sensors.values())
        ]
        if silent:
            there = sum(name in one.on_sensors for one in recordings)
            sentence += f" Sensor {name} is of no use in {len(silent)} of {there}: {silent[-1]}."
        if len(recordings) >= MISSED and all(
            name not in one.on_sensors for one in recordings[-MISSED:]
        ):
            sentence += f" Of sensor {name} nothing has come with the last {MISSED} recordings."
    return sentence
