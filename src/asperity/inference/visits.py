"""A series of recordings as visits: what was heard at each time, at which operating points."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from asperity.core.errors import BadInput
from asperity.inference.observations import (
    ALIKE,
    LogMeasurement,
    Observation,
    OperatingPoint,
    conditions,
    operating_points,
    require_temperatures,
)

FEWEST, MOST = 4, 60  # visits; neighbours of more are taken together
CHANNELS = ("crf", "damping", "crfa")
MOST_PLACES = 8  # more, and those further apart are taken for one
WIDER = 1.5


class SeriesMeasurement(NamedTuple):
    """A logarithm heard: when (0 the first visit, 1 the last), in which channel, at which place, how surely.

    `aside` is where it was heard less the place: logarithms of load and speed, and temperature [K].
    """

    at: float
    visit: int
    channel: str
    place: int
    heard: LogMeasurement
    aside: tuple[float, float, float] = (0.0, 0.0, 0.0)


@dataclass(frozen=True)
class VisitSeries:
    """Visits to one machine.

    Parameters
    ----------
    x : when each visit was, in the series' own unit (hours)
    places : operating points that were run, without what was heard there
    sounds : all that was heard, in order
    """

    x: tuple[float, ...]
    places: tuple[OperatingPoint, ...]
    sounds: tuple[SeriesMeasurement, ...]

    @property
    def span(self) -> float:
        """From the first visit to the last."""
        return self.x[-1] - self.x[0]

    @property
    def usual(self) -> int:
        """The place that was heard most often."""
        counts = np.bincount([sound.place for sound in self.sounds if sound.channel == "crf"])
        return int(np.argmax(counts))


def visit_series(observations: Sequence[Observation]) -> VisitSeries:
    """Recordings by their x, in whichever order they are given.

    Raises
    ------
    BadInput
        where one has no x, only some say how warm the oil was, or there are fewer than four visits.
    """
    for one in observations:
        if not math.isfinite(one.x):
            raise BadInput(
                f"{one.name or 'a recording'} has no place in time; give a column x (hours) in --table"
            )
    times = sorted({one.x for one in observations})
    if len(times) < FEWEST:
        raise BadInput(
            f"a forecast takes resonances of {FEWEST} recordings at different times or more, got {len(times)}; leave "
            "--forecast out, or record again"
        )
    require_temperatures(observations)
    observations = sorted(
        observations,
        key=lambda one: (one.x, one.load_n, one.entrainment_m_s, one.temperature_k or 0.0),
    )
    groups = np.array_split(np.array(times), min(MOST, len(times)))
    x = tuple(float(group.mean()) for group in groups)
    places = _places(operating_points(observations))
    sounds = []
    for visit, group in enumerate(groups):
        own = [one for one in observations if group[0] <= one.x <= group[-1]]
        for point in operating_points(own):
            place, aside = _nearest(point, places)
            at = (x[visit] - x[0]) / (x[-1] - x[0])
            sounds += [
                SeriesMeasurement(at, visit, channel, place, heard, aside)
                for channel in CHANNELS
                if not math.isnan((heard := getattr(point, channel)).value)
            ]
    return VisitSeries(x, places, tuple(sounds))


def _places(points: Sequence[OperatingPoint]) -> tuple[OperatingPoint, ...]:
    """Operating points, in order, those left out that lie near one that is there: each is emulated by itself."""
    near = ALIKE
    while True:
        places: list[OperatingPoint] = []
        for point in points:
            if all(np.any(np.abs(conditions(point) - conditions(one)) > near) for one in places):
                places.append(point)
        if len(places) <= MOST_PLACES:
            return tuple(
                OperatingPoint(one.load_n, one.entrainment_m_s, one.temperature_k) for one in places
            )
        near = WIDER * near


def _nearest(
    point: OperatingPoint, places: Sequence[OperatingPoint]
) -> tuple[int, tuple[float, float, float]]:
    """Which place an operating point is taken for, and by how much it is another."""
    asides = [conditions(point) - conditions(one) for one in places]
    place = int(np.argmin([np.sum((aside / ALIKE) ** 2) for aside in asides]))
    load, speed, temperature = (float(value) for value in asides[place])
    return place, (load, speed, temperature)
