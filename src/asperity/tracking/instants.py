"""Recordings of several sensors that were made at one time, told by when they began and how long they are."""

from collections.abc import Sequence
from datetime import datetime, timedelta
from math import isfinite
from typing import NamedTuple


class Heard(NamedTuple):
    """A recording as far as it takes to lay it beside others; `time` is None where nobody can say when it began."""

    file: str
    sensor: str
    time: datetime | None
    duration_s: float


class Stand(NamedTuple):
    """Where a recording stands: hours since the first, and which of the recordings there it is one with."""

    x: float
    number: int
    alone: int = 0


def by_time(recordings: Sequence[Heard]) -> list[Stand]:
    """Where each stands: what overlaps in time on different sensors is one.

    Who has no time, as nothing could be read of it, stands alone at the place of the one before.
    """
    timed = sorted((one.time, place, one) for place, one in enumerate(recordings) if one.time is not None)
    stands: dict[int, Stand] = {}
    taken: set[str] = set()
    number, began, until = -1, datetime.min, datetime.min
    for time, place, one in timed:
        if number < 0 or time >= until or one.sensor in taken:
            began, taken, number = time, set(), number + 1
            until = time + timedelta(seconds=one.duration_s if isfinite(one.duration_s) else 0.0)
        taken.add(one.sensor)
        stands[place] = Stand((began - timed[0][0]).total_seconds() / 3600.0, number)
    before = Stand(0.0, -1)
    for place in range(len(recordings)):
        before = stands.setdefault(place, before._replace(alone=place + 1))
    return [stands[place] for place in range(len(recordings))]
