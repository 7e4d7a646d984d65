"""A series of recordings as visits: what was heard at each time, at which operating points."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from asperity.errors import BadInput
from asperity.inference.observations import Heard, Observation, Point, points_of

FEWEST, MOST = 4, 60  # visits; neighbours of more are taken together
CHANNELS = ("crf", "damping", "crfa")


class Sound(NamedTuple):
    """A logarithm heard: when (0 the first visit, 1 the last), in which channel, at which place, how surely."""

    at: float
    visit: int
    channel: str
    place: int
    heard: Heard


@dataclass(frozen=True)
class Series:
    """Visits to one machine.

    Parameters
    ----------
    x : when each visit was, in the series' own unit (hours)
    places : operating points that were run, without what was heard there
    sounds : all that was heard, in order
    """

    x: tuple[float, ...]
    places: tuple[Point, ...]
    sounds: tuple[Sound, ...]

    @property
    def span(self) -> float:
        """From the first visit to the last."""
        return self.x[-1] - self.x[0]

    @property
    def usual(self) -> int:
        """The place that was heard most often."""
        counts = np.bincount([sound.place for sound in self.sounds if sound.channel == "crf"])
        return int(np.argmax(counts))


def series_of(observations: Sequence[Observation]) -> Series:
    """Recordings by their x.

    Raises
    ------
    BadInput
        where one has no x, or there are fewer than four visits.
    """
    for one in observations:
        if not math.isfinite(one.x):
            raise BadInput(f"{one.name or 'a recording'} has no place in time; give a column x (hours) in --table")
    times = sorted({one.x for one in observations})
    if len(times) < FEWEST:
        raise BadInput(
            f"a forecast takes resonances of {FEWEST} recordings at different times or more, got {len(times)}; leave "
            "--forecast out, or record again"
        )
    groups = np.array_split(np.array(times), min(MOST, len(times)))
    x = tuple(float(group.mean()) for group in groups)
    places: dict[tuple[float, float, float | None], int] = {}
    sounds = []
    for visit, group in enumerate(groups):
        own = [one for one in observations if group[0] <= one.x <= group[-1]]
        for point in points_of(own):
            place = places.setdefault((point.load_n, point.entrainment_m_s, point.temperature_k), len(places))
            at = (x[visit] - x[0]) / (x[-1] - x[0])
            sounds += [
                Sound(at, visit, channel, place, heard)
                for channel in CHANNELS
                if not math.isnan((heard := getattr(point, channel)).value)
            ]
    return Series(x, tuple(Point(*place) for place in places), tuple(sounds))
