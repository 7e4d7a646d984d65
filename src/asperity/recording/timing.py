"""A column of times: what rate it states, and where samples are missing."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from asperity.core.arrays import Field
from asperity.core.errors import UnreadableFile
from asperity.recording.reader import whole_rate
from asperity.recording.units import time_scale

TIME_NAMES = {
    "t",
    "time",
    "times",
    "zeit",
    "temps",
    "timestamp",
    "timestamps",
    "elapsed",
    "elapsed time",
    "seconds",
    "time stamp",
    "x_time",
}
# of a step, by which times may stray from an even grid, beyond what their printing rounds away
_EVEN = 0.05
MOST_LOST, WORTH = (
    4,
    1 << 16,
)  # samples missing for each that is there, beyond some: more is no recording
_HALF = 1.5  # steps, between one and a gap of one sample
_DIGITS = 12
_KNOWN = sorted(  # rates [Hz] that converters have, of which the one within the doubt is taken
    {base / 2**k for base in (102400.0, 131072.0, 100e3, 96e3, 88200.0) for k in range(9)}
    | {20e3, 10e3, 40e3, 30e3}
)


def is_time(name: str) -> bool:
    """Whether a column of that name holds times."""
    return name.strip().lower() in TIME_NAMES


@dataclass(frozen=True, slots=True)
class Clock:
    """An even grid behind a column of times.

    `step` between samples and `rounding` of the printed times, in the column's unit; `doubt` is
    the relative standard deviation of the step; `even` whether the times keep to the grid, gaps
    apart.
    """

    step: float
    rounding: float
    doubt: float
    even: bool

    def strides(self, steps: Field) -> Field:
        """How many samples each step between two times is worth, 1 where none is missing."""
        return np.asarray(np.maximum(np.rint(steps / self.step), 1.0))


def clock_of(times: Field) -> Clock | None:
    """The grid on which times lie, by their whole slope: printed with few digits, single steps say little.

    None for times that do not rise, or too few.
    """
    times = times[np.isfinite(times)]
    if times.size < 3:
        return None
    steps = np.diff(times)
    rounding = _rounding(times)
    usual = float(np.median(steps))
    if not np.isfinite(usual) or usual <= 0.0:
        return None
    near = steps[(steps > 0.0) & (steps < _HALF * usual + rounding)]  # without gaps
    clock = Clock(step=float(near.mean()), rounding=rounding, doubt=0.0, even=False)
    for _ in range(2):
        number = np.concatenate([[0.0], np.cumsum(clock.strides(steps))])
        slope, start = np.polyfit(number, times, 1)
        stray = float(np.max(np.abs(times - (start + slope * number))))
        if not slope > 0.0:
            break
        even = stray < 0.6 * rounding + _EVEN * slope and _telling(slope, rounding)
        doubt = 2.0 * stray / (slope * number[-1]) if even else 1e-4
        clock = Clock(
            step=float(slope) if even else usual, rounding=rounding, doubt=doubt + 1e-12, even=even
        )
        if not even:
            break
    return clock


def _telling(step: float, rounding: float) -> bool:
    """Whether one step and two still differ when times are rounded."""
    if rounding <= _EVEN * step:
        return True
    return bool(
        np.ceil(step / rounding) * rounding
        < _HALF * step
        < np.floor(2.0 * step / rounding) * rounding
    )


def _rounding(times: Field) -> float:
    """The last decimal to which times are printed; 0 where they keep to none."""
    some = np.concatenate([times[:4096], times[-4096:]])
    for digits in range(_DIGITS):
        scaled = some * 10.0**digits
        if np.all(np.abs(scaled - np.rint(scaled)) < 1e-6 + 1e-15 * np.abs(scaled)):
            return 10.0**-digits
    return 0.0


def timed(column: str, unit: str | None, times: Field) -> dict[str, Any]:
    """Rate, its doubt and its source as a channel takes them, of a column of times; a hint where it names no unit."""
    if np.count_nonzero(np.isfinite(times)) < 3:
        return {}
    clock = clock_of(times)
    if clock is None:
        return {"rate_hint": f" (its column {column!r} does not rise)"}
    scale = 1.0 if unit is None and column == "seconds" else time_scale(unit or "")
    if scale is not None:
        rate = 1.0 / (clock.step * scale)
        whole = whole_rate(rate, clock.doubt)
        known = [one for one in _KNOWN if abs(one / rate - 1.0) <= clock.doubt]
        return {
            "rate_hz": known[0] if len(known) == 1 and whole == rate else whole,
            "rate_doubt": clock.doubt,
            "rate_source": f"file (column {column!r})",
        }
    if unit is None:
        return {
            "rate_hint": f" (its column {column!r} names no unit; were it seconds, {1.0 / clock.step:.6g} Hz)"
        }
    return {"rate_hint": f" (its column {column!r} is in {unit!r}, which is no unit of time)"}


class Filling:
    """Puts samples where their times say, gaps as NaN, while they go by in blocks; counts what is missing."""

    def __init__(self, clock: Clock) -> None:
        self.clock = clock
        self.gaps = self.missing = 0
        self.backwards = False
        self._last: float | None = None

    def spread(self, times: Field, values: Field) -> Field:
        """The block's values with its gaps and the one before it; rows without a time keep the file's order."""
        if times.size == 0 or self.backwards:
            return values
        known = np.isfinite(times)
        if not known.all():
            times = (
                np.interp(np.arange(times.size), np.flatnonzero(known), times[known])
                if known.any()
                else times
            )
        before = times[0] - self.clock.step if self._last is None else self._last
        steps = np.diff(times, prepend=before)
        self._last = float(times[-1])
        if not np.all(steps > 0.0):
            self.backwards = True
            return values
        strides = self.clock.strides(steps).astype(np.int64)
        lost = int(np.sum(strides - 1))
        if lost == 0:
            return values
        if lost > MOST_LOST * (times.size + WORTH):
            raise UnreadableFile(
                f"its times leave out {lost} samples in a block of {times.size}; split the recording at its gaps"
            )
        self.gaps += int(np.count_nonzero(strides > 1))
        self.missing += lost
        full = np.full(int(strides.sum()), np.nan)
        full[np.cumsum(strides) - 1] = values
        return full

    @property
    def note(self) -> str:
        """What was found wrong, in a sentence; empty for nothing."""
        if self.backwards:
            return "its times go back or stand still; rows were taken in the order of the file"
        several = "gap" if self.gaps == 1 else "gaps"
        return (
            f"{self.gaps} {several} in its times: {self.missing} samples are missing"
            if self.gaps
            else ""
        )
