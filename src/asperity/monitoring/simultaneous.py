"""Recordings of several sensors that are one: made at one time, or at one stated place."""

from collections.abc import Mapping, Sequence
from datetime import datetime, timedelta
from itertools import pairwise
from math import inf, isfinite
from typing import NamedTuple

SECONDS: Mapping[str, float] = {"s": 1.0, "min": 60.0, "h": 3600.0, "d": 86400.0}
# of the least distance between recordings of one sensor: what is nearer is one x, written twice
ROUNDED = 1e-3


class Heard(NamedTuple):
    """A recording as far as it takes to lay it beside others; `time` is None where nobody can say when it began."""

    file: str
    sensor: str
    time: datetime | None
    duration_s: float


class Placed(NamedTuple):
    """A recording whose place is stated; `sensor` is empty where nobody can say whose it is."""

    sensor: str
    x: float
    duration_s: float


class Stand(NamedTuple):
    """Where a recording stands: hours since the first, or its stated x; and with which of those there it is one."""

    x: float
    number: int
    alone: int = 0


def by_time(recordings: Sequence[Heard]) -> list[Stand]:
    """Where each stands: what overlaps on different sensors by half of the shorter, or begins at one time, is one.

    Who has no time, as nothing could be read of it, stands alone at the place of the one before.
    """
    timed = sorted(
        (one.time, place, one) for place, one in enumerate(recordings) if one.time is not None
    )
    stands: dict[int, Stand] = {}
    taken: set[str] = set()
    first = began = until = timed[0][0] if timed else datetime.min
    number = -1
    for time, place, one in timed:
        end = time + timedelta(seconds=one.duration_s if isfinite(one.duration_s) else 0.0)
        both, shorter = min(until, end) - time, min(until - began, end - time)
        together = time == began or (time < until and 2 * both >= shorter)
        if number < 0 or not together or one.sensor in taken:
            began, until, taken, number = time, end, set(), number + 1
        taken.add(one.sensor)
        stands[place] = Stand((began - first).total_seconds() / 3600.0, number)
    before = Stand(0.0, -1)
    for place in range(len(recordings)):
        before = stands.setdefault(place, before._replace(alone=place + 1))
    return [stands[place] for place in range(len(recordings))]


def by_place(recordings: Sequence[Placed], x_name: str) -> list[Stand]:
    """Where each stands: what different sensors heard at one x is one, the first with the first.

    Two x are one within a recording's length, where `x_name` ends in a unit of time, and else
    within what rounding makes of them. Whose sensor nobody knows stands alone.
    """
    near, at, began = _nearness(recordings, x_name), dict[float, float](), -inf
    for x in sorted({one.x for one in recordings}):
        began = began if x - began <= near else x
        at[x] = began
    seen: dict[tuple[str, float], int] = {}
    stands = []
    for number, one in enumerate(recordings, 1):
        x = at[one.x]
        if not one.sensor:
            stands.append(Stand(x, 0, alone=number))
            continue
        turn = seen.setdefault((one.sensor, x), 0)
        seen[one.sensor, x] += 1
        stands.append(Stand(x, turn))
    return stands


def _nearness(recordings: Sequence[Placed], x_name: str) -> float:
    """By how much two x may differ that are one."""
    own: dict[str, set[float]] = {}
    for one in recordings:
        if one.sensor:
            own.setdefault(one.sensor, set()).add(one.x)
    least = min(
        (after - before for every in own.values() for before, after in pairwise(sorted(every))),
        default=0.0,
    )
    name, _, unit = x_name.rpartition("_")
    if not name or unit not in SECONDS:
        return ROUNDED * least
    longest = max((one.duration_s for one in recordings if isfinite(one.duration_s)), default=0.0)
    return min(longest / SECONDS[unit], 0.5 * least)
