"""A column of times: what rate it states, and where samples are missing."""

from typing import Any

import numpy as np

from asperity.arrays import Field
from asperity.recording.common import whole_rate
from asperity.recording.units import time_scale

TIME_NAMES = {"t", "time", "times", "zeit", "temps", "timestamp", "timestamps", "elapsed", "elapsed time", "seconds",
              "time stamp", "x_time"}  # fmt: skip
_EVEN = 0.05  # of a step, by which times may stray from an even grid before they count as uneven


def is_time(name: str) -> bool:
    """Whether a column of that name holds times."""
    return name.strip().lower() in TIME_NAMES


def timed(column: str, unit: str | None, times: Field) -> dict[str, Any]:
    """Rate and its source as a channel takes them, of a column of times; a hint where it names no unit of time."""
    times = times[np.isfinite(times)]
    if times.size < 3:
        return {}
    steps = np.diff(times)
    step = float(np.median(steps))
    if not np.isfinite(step) or step <= 0.0:
        return {"rate_hint": f" (its column {column!r} does not rise)"}
    rounding = 1e-4
    if np.max(np.abs(steps - step)) < 0.5 * step:  # no gap: the whole column tells the mean step
        number = np.arange(times.size)
        slope, start = np.polyfit(number, times, 1)
        stray = float(np.max(np.abs(times - (start + slope * number))))
        if stray < _EVEN * step:
            step = float(slope)
            rounding = 2.0 * stray / (step * times.size) + 1e-12
    scale = 1.0 if unit is None and column == "seconds" else time_scale(unit or "")
    if scale is not None:
        rate = whole_rate(1.0 / (step * scale), rounding)
        return {"rate_hz": rate, "rate_source": f"file (column {column!r})"}
    if unit is None:
        return {"rate_hint": f" (its column {column!r} names no unit; were it seconds, {1.0 / step:.6g} Hz)"}
    return {"rate_hint": f" (its column {column!r} is in {unit!r}, which is no unit of time)"}
