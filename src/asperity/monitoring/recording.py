"""One recording of a series, on one sensor or on several at one time."""

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields, replace

import numpy as np

from asperity.core.arrays import finite_or_none
from asperity.core.documents import JsonObject
from asperity.core.quantities import quantity
from asperity.monitoring.operating_point import OperatingPoint
from asperity.monitoring.reading import Reading
from asperity.rating import ZONES, severity_zone
from asperity.resonance import SENSORS_DISAGREE, CleanSpectrum, Resonance
from asperity.trend import AlarmState

MISSING_RECORDINGS = 3  # last recordings without a sensor from which this is reported
# fields of a row with several numbers by name, and the prefix of their columns
NAMED = {"depths": "depth", "lines": "line", "bands": "band"}
STATED = tuple(entry.name for entry in fields(OperatingPoint))


@dataclass(frozen=True, slots=True, kw_only=True)
class OnSensor:
    """Result of one of several sensors for a recording.

    `alone` is the resonance of this sensor by itself, None without a usable spectrum; `detects` is
    true if the sensor detects the contact's line.
    """

    reading: Reading
    alone: Resonance | None
    detects: bool

    def row(self) -> JsonObject:
        """Return its part of the recording's row."""
        quality = self.reading.quality
        alone = self.alone
        return {
            "file": self.reading.file,
            "detects": self.detects,
            "crf_hz": None if alone is None else finite_or_none(alone.crf_hz),
            "crf_std_hz": None if alone is None else finite_or_none(alone.crf_std_hz),
            "crfa": None if alone is None else finite_or_none(alone.crfa),
            "rms": None if quality is None else finite_or_none(quality.rms),
            "kurtosis": None if quality is None else finite_or_none(quality.kurtosis),
            "reason": self.reading.reason or ("" if alone is None else alone.reason),
        }


@dataclass(frozen=True, slots=True, kw_only=True)
class TrackedRecording:
    """One recording of a series, on one sensor or simultaneously on several.

    `resonance` states the reason if none was found or the recording is not usable. `clr` and its
    interval follow from CRF by the contact model, nan without one. `damping_reason` states why
    the width of the line is not a damping ratio; empty if it is. `crf_reference_hz` and
    `damping_reference` are reduced to load, speed and temperature of the first recordings. `label`
    is the stage, `state` the alarm's state after this recording. With several sensors `on_sensors`
    has the result of each by name, and `reading` and `file` belong to the first usable one.
    `remounted` names the sensor (empty for a single one) whose mounting changed at this recording.
    """

    file: str
    x: float
    x_std: float
    reading: Reading
    clean: CleanSpectrum | None
    resonance: Resonance
    damping_reason: str = ""
    operating: OperatingPoint = field(default_factory=OperatingPoint)
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
        """Readings by sensor."""
        return {name: on_sensor.reading for name, on_sensor in self.on_sensors.items()} or {
            self.reading.sensor: self.reading
        }

    @property
    def files(self) -> list[str]:
        """Its files, `file` first."""
        return [*dict.fromkeys([self.file, *(reading.file for reading in self.readings.values())])]

    def with_files(self, names: Mapping[str, str]) -> "TrackedRecording":
        """Return the recording with other names of its files."""
        on_sensors = {
            name: replace(
                on_sensor,
                reading=replace(on_sensor.reading, file=names[on_sensor.reading.file]),
            )
            for name, on_sensor in self.on_sensors.items()
        }
        reading = replace(self.reading, file=names[self.reading.file])
        return replace(self, file=names[self.file], reading=reading, on_sensors=on_sensors)

    @property
    def dead(self) -> bool:
        """True if all sensors are dead."""
        qualities = [
            reading.quality for reading in self.readings.values() if reading.quality is not None
        ]
        return bool(qualities) and all(quality.dead for quality in qualities)

    @property
    def damping(self) -> tuple[float, float]:
        """Damping ratio and its standard deviation; nan if not determined."""
        if self.damping_reason:
            return np.nan, np.nan
        return self.resonance.damping_ratio, self.resonance.damping_ratio_std

    @property
    def zone(self) -> str | None:
        """Zone A to D of ISO 20816-3; None without machine class or velocity."""
        reading = self._most_severe
        if "machine_class" not in reading.facts or not np.isfinite(reading.velocity):
            return None
        return severity_zone(reading.velocity, reading.facts["machine_class"][0])

    @property
    def _most_severe(self) -> Reading:
        """Reading with the highest velocity."""
        measured = [reading for reading in self.readings.values() if np.isfinite(reading.velocity)]
        return max(measured, key=lambda reading: reading.velocity, default=self.reading)

    def severity(self) -> str:
        """Return velocity and zone as text, or why they are not determined."""
        reading = self._most_severe
        zone = self.zone
        velocity = reading.velocity
        if not np.isfinite(velocity):
            return (
                "velocity not determined: it needs an acceleration or velocity in a known "
                "unit, sampled at 2 kHz or more for 3.2 s or more"
            )
        on = f" on {reading.sensor}" if self.on_sensors else ""
        level = f"velocity {quantity('velocity_rms').text(velocity)} rms, 10 to 1000 Hz{on}"
        if zone is None:
            return (
                f"{level}; zone of ISO 20816-3 not determined: the sidecar states no machine_class"
            )
        machine_class = reading.facts["machine_class"][0]
        return f"{level}: zone {zone} of ISO 20816-3 ({machine_class}), {ZONES[zone]}"

    def row(self) -> JsonObject:
        """Return its row of the table, as in `asperity track --json`; None for missing values."""
        resonance = self.resonance
        damping = self.damping
        read = self._reading_row(self.reading)
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
            "sensors": {name: on_sensor.row() for name, on_sensor in self.on_sensors.items()},
        }

    def row_on(self, sensor: str, row: JsonObject) -> JsonObject:
        """Return its row with the values of one of its sensors."""
        return {**row, **self._reading_row(self.readings[sensor])}

    def _reading_row(self, reading: Reading) -> JsonObject:
        """Return the part of a row that depends on the reading."""
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


def sensor_summary(recordings: Sequence[TrackedRecording]) -> str:
    """Return which sensors detect the line, disagree or fail; empty for a single sensor."""
    names = list(dict.fromkeys(name for recording in recordings for name in recording.on_sensors))
    if not names:
        return ""
    counts = Counter(
        " and ".join(
            name
            for name in names
            if name in recording.on_sensors and recording.on_sensors[name].detects
        )
        for recording in recordings
        if recording.resonance.found
    )
    detections = [f"on {sensors} in {count}" for sensors, count in counts.most_common()]
    sentences = [
        f"The line was detected {', '.join(detections)}."
        if detections
        else "No line was detected on two sensors."
    ]
    apart = sum(recording.resonance.reason.startswith(SENSORS_DISAGREE) for recording in recordings)
    if apart:
        sentences.append(f"The sensors disagree in {apart}; no line is claimed there.")
    for name in names:
        sentences += _sensor_faults(recordings, name)
    return " ".join(sentences)


def _sensor_faults(recordings: Sequence[TrackedRecording], name: str) -> list[str]:
    """Return sentences on a sensor that is unusable where others are not, or delivers nothing."""
    sentences = []
    recorded = [recording for recording in recordings if name in recording.on_sensors]
    reasons = [
        recording.on_sensors[name].reading.reason
        for recording in recorded
        if not recording.on_sensors[name].reading.usable
        and any(other.reading.usable for other in recording.on_sensors.values())
    ]
    if reasons:
        sentences.append(
            f"Sensor {name} is not usable in {len(reasons)} of {len(recorded)}: {reasons[-1]}."
        )
    if len(recordings) >= MISSING_RECORDINGS and all(
        name not in recording.on_sensors for recording in recordings[-MISSING_RECORDINGS:]
    ):
        sentences.append(
            f"Sensor {name} has delivered nothing with the last {MISSING_RECORDINGS} recordings."
        )
    return sentences
