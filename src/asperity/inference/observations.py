"""Observations: contact resonances with standard deviations and operating points."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from asperity.core.arrays import Field
from asperity.core.errors import BadInput, require_positive

MIN_FREQUENCY_STD = 1e-4  # relative; no machine runs more steadily
MISSING = math.nan
# differences of load and speed (relative) and temperature [K] within which points count as similar
SIMILARITY_SCALES = np.array([0.03, 0.03, 1.5])


@dataclass(frozen=True, slots=True, kw_only=True)
class Observation:
    """Measurements of a contact at an operating point: its resonance, its capacitance, or both.

    Parameters
    ----------
    load_n, entrainment_m_s : load [N] and entrainment speed [m/s] of the contact
    temperature_k : of the oil [K]; None: that of the case
    crf_hz, crf_std_hz : resonance frequency and its standard deviation [Hz]; nan if not measured
    crfa, crfa_std : height of the resonance [(m/s^2)^2/Hz]; nan if not comparable
    damping_ratio, damping_std : from the width of the resonance; nan if not determined
    crf_shared_std_hz : part of `crf_std_hz` common to all recordings at the operating point
    capacitance_f, capacitance_std_f : of the contact without the stray capacitance of its
        surroundings, and its standard deviation [F]; nan if not measured
    name, x : label, and position in a series (hours)
    """

    load_n: float
    entrainment_m_s: float
    crf_hz: float = MISSING
    crf_std_hz: float = MISSING
    temperature_k: float | None = None
    crfa: float = MISSING
    crfa_std: float = MISSING
    damping_ratio: float = MISSING
    damping_std: float = MISSING
    crf_shared_std_hz: float = 0.0
    capacitance_f: float = MISSING
    capacitance_std_f: float = MISSING
    name: str = ""
    x: float = MISSING

    def __post_init__(self) -> None:
        prefix = f"{self.name}: " if self.name else ""
        require_positive(f"{prefix}load_n", self.load_n, "N")
        require_positive(f"{prefix}entrainment_m_s", self.entrainment_m_s, "m/s")
        if math.isnan(self.capacitance_f):
            require_positive(f"{prefix}crf_hz", self.crf_hz, "Hz")
        for name, value, std in (
            ("crf_hz", self.crf_hz, self.crf_std_hz),
            ("capacitance_f", self.capacitance_f, self.capacitance_std_f),
            ("crfa", self.crfa, self.crfa_std),
            ("damping_ratio", self.damping_ratio, self.damping_std),
        ):
            if not math.isnan(value):
                require_positive(f"{prefix}{name}", value)
                require_positive(f"{prefix}standard deviation of {name}", std)
        if self.crf_shared_std_hz and not (
            0.0 <= self.crf_shared_std_hz <= self.crf_std_hz * (1.0 + 1e-9)
        ):
            raise BadInput(
                f"{prefix}crf_shared_std_hz must be at most crf_std_hz, {self.crf_std_hz:g} Hz, "
                f"got {self.crf_shared_std_hz:g} Hz"
            )
        if self.temperature_k is not None:
            require_positive(f"{prefix}temperature_k", self.temperature_k, "K")

    @property
    def conditions(self) -> tuple[float, float, float | None]:
        """Load [N], entrainment speed [m/s] and temperature [K]."""
        return self.load_n, self.entrainment_m_s, self.temperature_k


@dataclass(frozen=True, slots=True)
class LogMeasurement:
    """Logarithm of a measured quantity and its standard deviation; nan if not measured."""

    value: float = math.nan
    std: float = math.nan


@dataclass(frozen=True, slots=True)
class ObservationPoint:
    """An operating point and the combined measurements of its recordings."""

    load_n: float
    entrainment_m_s: float
    temperature_k: float | None = None
    crf: LogMeasurement = field(default_factory=LogMeasurement)
    damping: LogMeasurement = field(default_factory=LogMeasurement)
    crfa: LogMeasurement = field(default_factory=LogMeasurement)
    capacitance: LogMeasurement = field(default_factory=LogMeasurement)
    names: tuple[str, ...] = ()

    @property
    def measured(self) -> bool:
        """True if a resonance or a capacitance was measured here."""
        return not (math.isnan(self.crf.value) and math.isnan(self.capacitance.value))


def operating_points(observations: Sequence[Observation]) -> tuple[ObservationPoint, ...]:
    """Group observations by operating point, in order; repeats are combined.

    Raises
    ------
    BadInput
        if only some observations have an oil temperature.
    """
    require_temperatures(observations)
    groups: dict[tuple[float, float, float | None], list[Observation]] = {}
    for observation in observations:
        groups.setdefault(observation.conditions, []).append(observation)
    return tuple(
        ObservationPoint(
            *conditions,
            crf=_combined(
                [(entry.crf_hz, entry.crf_std_hz, entry.crf_shared_std_hz) for entry in group],
                MIN_FREQUENCY_STD,
            ),
            damping=_combined([(entry.damping_ratio, entry.damping_std, 0.0) for entry in group]),
            crfa=_combined([(entry.crfa, entry.crfa_std, 0.0) for entry in group]),
            capacitance=_combined(
                [(entry.capacitance_f, entry.capacitance_std_f, 0.0) for entry in group]
            ),
            names=tuple(entry.name for entry in group),
        )
        for conditions, group in groups.items()
    )


def point_coordinates(point: ObservationPoint) -> Field:
    """Return the logarithms of load and speed, and the temperature [K]."""
    return np.array(
        [math.log(point.load_n), math.log(point.entrainment_m_s), point.temperature_k or 0.0]
    )


def point_similarity(points: Sequence[ObservationPoint]) -> Field:
    """Return the correlation of point-specific errors, (points, points): 1 for equal conditions."""
    scaled = np.array([point_coordinates(point) for point in points]) / SIMILARITY_SCALES
    return np.asarray(np.exp(-0.5 * np.sum((scaled[:, None] - scaled) ** 2, axis=-1)))


def require_temperatures(observations: Sequence[Observation]) -> None:
    """Raise BadInput if only some observations have an oil temperature."""
    if len({observation.temperature_k is None for observation in observations}) > 1:
        raise BadInput(
            "some recordings have a temperature and some have none; give it for all or for none"
        )


def _combined(
    repeats: Sequence[tuple[float, float, float]], min_std: float = 0.0
) -> LogMeasurement:
    """Combine repeats (value, standard deviation, shared part of it) into one logarithm.

    The result is the weighted mean; its deviation is at least that of the scatter of the repeats
    and includes the shared part.
    """
    logs = np.array(
        [
            (
                math.log(value),
                max(math.sqrt(max(std**2 - common**2, 0.0)) / value, min_std),
                common / value,
            )
            for value, std, common in repeats
            if not math.isnan(value)
        ]
    )
    if not len(logs):
        return LogMeasurement()
    values, stds, common = logs.T
    weights = stds**-2.0 / np.sum(stds**-2.0)
    mean = float(weights @ values)
    std = float(np.sum(stds**-2.0) ** -0.5)
    if len(logs) > 1:
        scatter = float(np.sqrt(np.sum((values - mean) ** 2) / (len(logs) - 1) / len(logs)))
        std = max(std, scatter)
    return LogMeasurement(mean, math.hypot(std, float(weights @ common)))
