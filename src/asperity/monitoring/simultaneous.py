"""Matching of recordings of several sensors: made at one time, or at one stated x."""

from collections.abc import Mapping, Sequence
from datetime import datetime, timedelta
from itertools import pairwise
from math import inf, isfinite
from typing import NamedTuple

SECONDS: Mapping[str, float] = {"s": 1.0, "min": 60.0, "h": 3600.0, "d": 86400.0}
# of the least distance between recordings of one sensor: rounding of equal x
ROUNDING = 1e-3


class TimedRecording(NamedTuple):
    """A recording to be matched by time; `time` is None if its start is unknown."""

    file: str
    sensor: str
    time: datetime | None
    duration_s: float


class PlacedRecording(NamedTuple):
    """A recording with stated x; `sensor` is empty if unknown."""

    sensor: str
    x: float
    duration_s: float


class Slot(NamedTuple):
    """Slot of a recording; recordings with equal slots are simultaneous.

    `x` in hours since the first recording or as stated, `number` of the slot there; `alone` is not
    0 for a recording that cannot be matched.
    """

    x: float
    number: int
    alone: int = 0


def match_times(recordings: Sequence[TimedRecording]) -> list[Slot]:
    """Match recordings of different sensors by time.

    Recordings match if they begin at one time or overlap by half of the shorter. A recording
    without a time, of which nothing could be read, has the x of the one before and no match.
    """
    timed = sorted(
        (recording.time, index, recording)
        for index, recording in enumerate(recordings)
        if recording.time is not None
    )
    slots: dict[int, Slot] = {}
    sensors: set[str] = set()
    first = start = stop = timed[0][0] if timed else datetime.min
    number = -1
    for time, index, recording in timed:
        duration_s = recording.duration_s if isfinite(recording.duration_s) else 0.0
        end = time + timedelta(seconds=duration_s)
        overlap = min(stop, end) - time
        shorter = min(stop - start, end - time)
        together = time == start or (time < stop and 2 * overlap >= shorter)
        if number < 0 or not together or recording.sensor in sensors:
            start, stop, sensors, number = time, end, set(), number + 1
        sensors.add(recording.sensor)
        slots[index] = Slot((start - first).total_seconds() / 3600.0, number)
    before = Slot(0.0, -1)
    for index in range(len(recordings)):
        before = slots.setdefault(index, before._replace(alone=index + 1))
    return [slots[index] for index in range(len(recordings))]


def match_places(recordings: Sequence[PlacedRecording], x_name: str) -> list[Slot]:
    """Match recordings of different sensors by x, the n-th of one with the n-th of another.

    Two x are equal within a recording's duration if `x_name` ends in a unit of time, otherwise
    within rounding. A recording of an unknown sensor has no match.
    """
    tolerance = _tolerance(recordings, x_name)
    common_x = dict[float, float]()
    start = -inf
    for x in sorted({recording.x for recording in recordings}):
        start = start if x - start <= tolerance else x
        common_x[x] = start
    counts: dict[tuple[str, float], int] = {}
    slots = []
    for number, recording in enumerate(recordings, 1):
        x = common_x[recording.x]
        if not recording.sensor:
            slots.append(Slot(x, 0, alone=number))
            continue
        turn = counts.setdefault((recording.sensor, x), 0)
        counts[recording.sensor, x] += 1
        slots.append(Slot(x, turn))
    return slots


def _tolerance(recordings: Sequence[PlacedRecording], x_name: str) -> float:
    """Return the largest difference of two equal x."""
    by_sensor: dict[str, set[float]] = {}
    for recording in recordings:
        if recording.sensor:
            by_sensor.setdefault(recording.sensor, set()).add(recording.x)
    least = min(
        (after - before for xs in by_sensor.values() for before, after in pairwise(sorted(xs))),
        default=0.0,
    )
    name, _, unit = x_name.rpartition("_")
    if not name or unit not in SECONDS:
        return ROUNDING * least
    durations = (recording.duration_s for recording in recordings)
    longest = max((duration for duration in durations if isfinite(duration)), default=0.0)
    return min(longest / SECONDS[unit], 0.5 * least)
