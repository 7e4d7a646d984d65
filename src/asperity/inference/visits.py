"""A series of recordings grouped into visits: measurements by time and operating point."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from asperity.core.errors import BadInput
from asperity.inference.observations import (
    SIMILARITY_SCALES,
    LogMeasurement,
    Observation,
    ObservationPoint,
    operating_points,
    point_coordinates,
    require_temperatures,
)

MIN_VISITS, MAX_VISITS = 4, 60  # more visits are merged with their neighbours
CHANNELS = ("crf", "damping", "crfa")
MAX_POINTS = 8  # with more, points further apart are merged
WIDENING = 1.5  # factor on the merging distance


class SeriesMeasurement(NamedTuple):
    """One measured logarithm: relative time (0 first visit, 1 last), channel and operating point.

    `offset` is the actual operating point minus the nominal one: logarithms of load and speed, and
    temperature [K].
    """

    time: float
    visit: int
    channel: str
    point: int
    measured: LogMeasurement
    offset: tuple[float, float, float] = (0.0, 0.0, 0.0)


@dataclass(frozen=True)
class VisitSeries:
    """Visits to one machine.

    Parameters
    ----------
    x : time of each visit, in the series' own unit (hours)
    points : nominal operating points, without measurements
    measurements : all measurements, in order
    """

    x: tuple[float, ...]
    points: tuple[ObservationPoint, ...]
    measurements: tuple[SeriesMeasurement, ...]

    @property
    def span(self) -> float:
        """Time from the first visit to the last."""
        return self.x[-1] - self.x[0]

    @property
    def main_point(self) -> int:
        """Index of the operating point measured most often."""
        counts = np.bincount([entry.point for entry in self.measurements if entry.channel == "crf"])
        return int(np.argmax(counts))


def visit_series(observations: Sequence[Observation]) -> VisitSeries:
    """Group observations, in any order, into visits by their x.

    Raises
    ------
    BadInput
        if an observation has no x, only some have an oil temperature, or there are fewer than four
        visits.
    """
    for observation in observations:
        if not math.isfinite(observation.x):
            raise BadInput(
                f"{observation.name or 'a recording'} has no time; "
                "give a column x (hours) in `table`"
            )
    times = sorted({observation.x for observation in observations})
    if len(times) < MIN_VISITS:
        raise BadInput(
            f"a forecast needs resonances of at least {MIN_VISITS} recordings at different times, "
            f"got {len(times)}; leave --forecast out, or record again"
        )
    require_temperatures(observations)
    observations = sorted(
        observations,
        key=lambda entry: (
            entry.x,
            entry.load_n,
            entry.entrainment_m_s,
            entry.temperature_k or 0.0,
        ),
    )
    groups = np.array_split(np.array(times), min(MAX_VISITS, len(times)))
    x = tuple(float(group.mean()) for group in groups)
    nominal = _nominal_points(operating_points(observations))
    measurements = []
    for visit, group in enumerate(groups):
        members = [entry for entry in observations if group[0] <= entry.x <= group[-1]]
        for point in operating_points(members):
            index, offset = _nearest(point, nominal)
            time = (x[visit] - x[0]) / (x[-1] - x[0])
            measurements += [
                SeriesMeasurement(time, visit, channel, index, measured, offset)
                for channel in CHANNELS
                if not math.isnan((measured := getattr(point, channel)).value)
            ]
    return VisitSeries(x, nominal, tuple(measurements))


def _nominal_points(points: Sequence[ObservationPoint]) -> tuple[ObservationPoint, ...]:
    """Return operating points in order, without those close to an earlier one."""
    distance = SIMILARITY_SCALES
    while True:
        nominal: list[ObservationPoint] = []
        for point in points:
            if all(
                np.any(np.abs(point_coordinates(point) - point_coordinates(other)) > distance)
                for other in nominal
            ):
                nominal.append(point)
        if len(nominal) <= MAX_POINTS:
            return tuple(
                ObservationPoint(point.load_n, point.entrainment_m_s, point.temperature_k)
                for point in nominal
            )
        distance = WIDENING * distance


def _nearest(
    point: ObservationPoint, nominal: Sequence[ObservationPoint]
) -> tuple[int, tuple[float, float, float]]:
    """Return the index of the nearest nominal point and the offset from it."""
    offsets = [point_coordinates(point) - point_coordinates(other) for other in nominal]
    index = int(np.argmin([np.sum((offset / SIMILARITY_SCALES) ** 2) for offset in offsets]))
    load, speed, temperature = (float(value) for value in offsets[index])
    return index, (load, speed, temperature)
