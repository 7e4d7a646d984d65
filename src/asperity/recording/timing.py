"""Columns of times: the sampling rate that they state, and missing samples."""

from dataclasses import dataclass

import numpy as np

from asperity.core.arrays import Field
from asperity.core.errors import UnreadableFile
from asperity.recording.model import ChannelFacts
from asperity.recording.reader import rounded_rate
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
# largest deviation from an even grid, in steps, beyond the rounding of the times
_EVEN = 0.05
# most missing samples: so many for each one present, counted from so many on
LARGEST_MISSING_RATIO, MISSING_FROM = 4, 1 << 16
_GAP_THRESHOLD = 1.5  # steps: the limit between one step and a gap of one sample
_DIGITS = 12
_KNOWN = sorted(  # common rates of converters [Hz]; one within the doubt is used
    {base / 2**k for base in (102400.0, 131072.0, 100e3, 96e3, 88200.0) for k in range(9)}
    | {20e3, 10e3, 40e3, 30e3}
)


def is_time_column(name: str) -> bool:
    """Return whether a column of that name holds times."""
    return name.strip().lower() in TIME_NAMES


@dataclass(frozen=True, slots=True)
class Clock:
    """Uniform grid fitted to a column of times.

    `step` between samples and `rounding` of the printed times, in the column's unit; `doubt` is the
    relative standard deviation of the step; `even` states whether the times lie on the grid, apart
    from gaps.
    """

    step: float
    rounding: float
    doubt: float
    even: bool

    def strides(self, steps: Field) -> Field:
        """Return the number of samples per step between two times; 1 where none is missing."""
        return np.asarray(np.maximum(np.rint(steps / self.step), 1.0))


def fit_clock(times: Field) -> Clock | None:
    """Fit a grid by the slope of all times: rounded times make single steps unreliable.

    None for times that do not increase, or too few.
    """
    times = times[np.isfinite(times)]
    if times.size < 3:
        return None
    steps = np.diff(times)
    rounding = _rounding(times)
    median_step = float(np.median(steps))
    if not np.isfinite(median_step) or median_step <= 0.0:
        return None
    single_steps = steps[
        (steps > 0.0) & (steps < _GAP_THRESHOLD * median_step + rounding)
    ]  # without gaps
    clock = Clock(step=float(single_steps.mean()), rounding=rounding, doubt=0.0, even=False)
    for _ in range(2):
        number = np.concatenate([[0.0], np.cumsum(clock.strides(steps))])
        slope, start = np.polyfit(number, times, 1)
        deviation = float(np.max(np.abs(times - (start + slope * number))))
        if not slope > 0.0:
            break
        even = deviation < 0.6 * rounding + _EVEN * slope and _distinguishable(slope, rounding)
        doubt = 2.0 * deviation / (slope * number[-1]) if even else 1e-4
        clock = Clock(
            step=float(slope) if even else median_step,
            rounding=rounding,
            doubt=doubt + 1e-12,
            even=even,
        )
        if not even:
            break
    return clock


def _distinguishable(step: float, rounding: float) -> bool:
    """Return whether one step and two can be distinguished in rounded times."""
    if rounding <= _EVEN * step:
        return True
    return bool(
        np.ceil(step / rounding) * rounding
        < _GAP_THRESHOLD * step
        < np.floor(2.0 * step / rounding) * rounding
    )


def _rounding(times: Field) -> float:
    """Return the last decimal to which times are printed; 0 if there is none."""
    sample = np.concatenate([times[:4096], times[-4096:]])
    for digits in range(_DIGITS):
        scaled = sample * 10.0**digits
        if np.all(np.abs(scaled - np.rint(scaled)) < 1e-6 + 1e-15 * np.abs(scaled)):
            return 10.0**-digits
    return 0.0


def rate_from_times(column: str, unit: str | None, times: Field) -> ChannelFacts:
    """Return rate, doubt and source from a column of times; a hint if its unit is unknown."""
    if np.count_nonzero(np.isfinite(times)) < 3:
        return {}
    clock = fit_clock(times)
    if clock is None:
        return {"rate_hint": f" (its column {column!r} does not increase)"}
    scale = 1.0 if unit is None and column == "seconds" else time_scale(unit or "")
    if scale is not None:
        rate = 1.0 / (clock.step * scale)
        rounded = rounded_rate(rate, clock.doubt)
        common_rates = [common for common in _KNOWN if abs(common / rate - 1.0) <= clock.doubt]
        return {
            "rate_hz": common_rates[0] if len(common_rates) == 1 and rounded == rate else rounded,
            "rate_doubt": clock.doubt,
            "rate_source": f"file (column {column!r})",
        }
    if unit is None:
        return {
            "rate_hint": f" (its column {column!r} names no unit; in seconds: "
            f"{1.0 / clock.step:.6g} Hz)"
        }
    return {"rate_hint": f" (its column {column!r} is in {unit!r}, which is not a unit of time)"}


class GapFiller:
    """Places samples by their times, block by block, with NaN in gaps; counts missing samples."""

    def __init__(self, clock: Clock) -> None:
        self.clock = clock
        self.gaps = self.missing = 0
        self.backwards = False
        self._last: float | None = None

    def fill(self, times: Field, values: Field) -> Field:
        """Return the block's values with its gaps; rows without a time keep the file's order."""
        if times.size == 0 or self.backwards:
            return values
        common_rates = np.isfinite(times)
        if not common_rates.all():
            times = (
                np.interp(np.arange(times.size), np.flatnonzero(common_rates), times[common_rates])
                if common_rates.any()
                else times
            )
        before = times[0] - self.clock.step if self._last is None else self._last
        steps = np.diff(times, prepend=before)
        self._last = float(times[-1])
        if not np.all(steps > 0.0):
            self.backwards = True
            return values
        strides = self.clock.strides(steps).astype(np.int64)
        missing = int(np.sum(strides - 1))
        if missing == 0:
            return values
        if missing > LARGEST_MISSING_RATIO * (times.size + MISSING_FROM):
            raise UnreadableFile(
                f"{missing} samples are missing in a block of {times.size} by its times; split the "
                "recording at its gaps"
            )
        self.gaps += int(np.count_nonzero(strides > 1))
        self.missing += missing
        filled = np.full(int(strides.sum()), np.nan)
        filled[np.cumsum(strides) - 1] = values
        return filled

    @property
    def note(self) -> str:
        """Problems found, in a sentence; empty for none."""
        if self.backwards:
            return "its times do not increase; rows are used in the order of the file"
        several = "gap" if self.gaps == 1 else "gaps"
        return (
            f"{self.gaps} {several} in its times: {self.missing} samples are missing"
            if self.gaps
            else ""
        )
