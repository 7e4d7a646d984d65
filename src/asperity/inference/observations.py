"""What a recording says: a resonance with its deviations, and under which load and speed it was made."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from asperity.core.arrays import Field
from asperity.core.errors import BadInput, require_positive

LEAST_STD = 1e-4  # relative, of a frequency: no machine is steadier
LOST = math.nan
ALIKE = np.array(
    [0.03, 0.03, 1.5]
)  # load and speed, relative, and temperature [K], that are as good as one place


@dataclass(frozen=True, slots=True, kw_only=True)
class Observation:
    """A recording's contact resonance and its operating point.

    Parameters
    ----------
    load_n, entrainment_m_s : load [N] and entrainment speed [m/s] of the contact
    temperature_k : of the oil [K]; None: as the case has it
    crf_hz, crf_std_hz : frequency of the resonance and its standard deviation [Hz]
    crfa, crfa_std : its height [(m/s^2)^2/Hz]; nan where it is not comparable
    damping_ratio, damping_std : its width; nan where it is not determined
    crf_shared_std_hz : part of `crf_std_hz` that all recordings at its operating point have in common
    name, x : what it is called, and where it stands in a series (hours)
    """

    load_n: float
    entrainment_m_s: float
    crf_hz: float
    crf_std_hz: float
    temperature_k: float | None = None
    crfa: float = LOST
    crfa_std: float = LOST
    damping_ratio: float = LOST
    damping_std: float = LOST
    crf_shared_std_hz: float = 0.0
    name: str = ""
    x: float = LOST

    def __post_init__(self) -> None:
        what = f"{self.name}: " if self.name else ""
        require_positive(f"{what}load_n", self.load_n, "N")
        require_positive(f"{what}entrainment_m_s", self.entrainment_m_s, "m/s")
        require_positive(f"{what}crf_hz", self.crf_hz, "Hz")
        require_positive(f"{what}crf_std_hz", self.crf_std_hz, "Hz")
        for name, value, std in (
            ("crfa", self.crfa, self.crfa_std),
            ("damping_ratio", self.damping_ratio, self.damping_std),
        ):
            if not math.isnan(value):
                require_positive(f"{what}{name}", value)
                require_positive(f"{what}standard deviation of {name}", std)
        if not 0.0 <= self.crf_shared_std_hz <= self.crf_std_hz * (1.0 + 1e-9):
            raise BadInput(
                f"{what}crf_shared_std_hz is a part of crf_std_hz, {self.crf_std_hz:g} Hz, got "
                f"{self.crf_shared_std_hz:g} Hz"
            )
        if self.temperature_k is not None:
            require_positive(f"{what}temperature_k", self.temperature_k, "K")

    @property
    def place(self) -> tuple[float, float, float | None]:
        """Its operating point."""
        return self.load_n, self.entrainment_m_s, self.temperature_k


@dataclass(frozen=True, slots=True)
class LogMeasurement:
    """A logarithm that was measured at an operating point, and its standard deviation; nan where it was not."""

    value: float = math.nan
    std: float = math.nan


@dataclass(frozen=True, slots=True)
class OperatingPoint:
    """An operating point, and what its recordings say together."""

    load_n: float
    entrainment_m_s: float
    temperature_k: float | None = None
    crf: LogMeasurement = field(default_factory=LogMeasurement)
    damping: LogMeasurement = field(default_factory=LogMeasurement)
    crfa: LogMeasurement = field(default_factory=LogMeasurement)
    names: tuple[str, ...] = ()


def operating_points(observations: Sequence[Observation]) -> tuple[OperatingPoint, ...]:
    """Recordings by their operating points, in order: those of one point are repeats of one thing.

    Raises
    ------
    BadInput
        where only some of them say how warm the oil was.
    """
    require_temperatures(observations)
    groups: dict[tuple[float, float, float | None], list[Observation]] = {}
    for one in observations:
        groups.setdefault(one.place, []).append(one)
    return tuple(
        OperatingPoint(
            *place,
            crf=_together(
                [(one.crf_hz, one.crf_std_hz, one.crf_shared_std_hz) for one in group], LEAST_STD
            ),
            damping=_together([(one.damping_ratio, one.damping_std, 0.0) for one in group]),
            crfa=_together([(one.crfa, one.crfa_std, 0.0) for one in group]),
            names=tuple(one.name for one in group),
        )
        for place, group in groups.items()
    )


def conditions(point: OperatingPoint) -> Field:
    """Logarithms of load and speed, and temperature [K]."""
    return np.array(
        [math.log(point.load_n), math.log(point.entrainment_m_s), point.temperature_k or 0.0]
    )


def point_similarity(points: Sequence[OperatingPoint]) -> Field:
    """How far what is a point's own is the others' too, as a correlation, (points, points): 1 at one place."""
    at = np.array([conditions(point) for point in points]) / ALIKE
    return np.asarray(np.exp(-0.5 * np.sum((at[:, None] - at) ** 2, axis=-1)))


def require_temperatures(observations: Sequence[Observation]) -> None:
    """BadInput where only some of them say how warm the oil was."""
    if len({one.temperature_k is None for one in observations}) > 1:
        raise BadInput(
            "some recordings have a temperature and some have none; give it of all, or of none"
        )


def _together(heard: Sequence[tuple[float, float, float]], least: float = 0.0) -> LogMeasurement:
    """The logarithm that repeats measure, of values, deviations, and what of these is common to all of them.

    Their weighted mean, and no surer of it than their scatter lets them be, nor than what they
    have in common.
    """
    known = np.array(
        [
            (
                math.log(value),
                max(math.sqrt(max(std**2 - common**2, 0.0)) / value, least),
                common / value,
            )
            for value, std, common in heard
            if not math.isnan(value)
        ]
    )
    if not len(known):
        return LogMeasurement()
    values, stds, common = known.T
    weights = stds**-2.0 / np.sum(stds**-2.0)
    mean = float(weights @ values)
    std = float(np.sum(stds**-2.0) ** -0.5)
    if len(known) > 1:
        scatter = float(np.sqrt(np.sum((values - mean) ** 2) / (len(known) - 1) / len(known)))
        std = max(std, scatter)
    return LogMeasurement(mean, math.hypot(std, float(weights @ common)))
