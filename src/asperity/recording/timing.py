"""A column of times: what rate it states, and where samples are missing."""

from datetime import datetime
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


class Clock:
    """The times of a table, or the first of them."""

    def __init__(self, file: str, column: str, unit: str | None) -> None:
        self.file, self.column, self.unit = file, column, unit
        self.times = np.empty(0)

    def tick(self, times: Field) -> None:
        """Take in times."""
        self.times = np.concatenate([self.times, times[np.isfinite(times)]])

    def facts(self) -> dict[str, Any]:
        """Rate and its source as a channel takes them; a hint where the column names no unit of time."""
        if self.times.size < 3:
            return {}
        steps = np.diff(self.times)
        step = float(np.median(steps))
        if not np.isfinite(step) or step <= 0.0:
            return {"rate_hint": f" (its column {self.column!r} does not rise)"}
        rounding = 1e-4
        if np.max(np.abs(steps - step)) < 0.5 * step:  # no gap: the whole column tells the mean step
            number = np.arange(self.times.size)
            slope, start = np.polyfit(number, self.times, 1)
            stray = float(np.max(np.abs(self.times - (start + slope * number))))
            if stray < _EVEN * step:
                step = float(slope)
                rounding = 2.0 * stray / (step * self.times.size) + 1e-12
        scale = 1.0 if self.unit is None and self.column == "seconds" else time_scale(self.unit or "")
        if scale is None:
            if self.unit is None:
                hint = f" (its column {self.column!r} names no unit; were it seconds, {1.0 / step:.6g} Hz)"
            else:
                hint = f" (its column {self.column!r} is in {self.unit!r}, which is no unit of time)"
            return {"rate_hint": hint}
        rate = 1.0 / (step * scale)
        return {"rate_hz": whole_rate(rate, rounding), "rate_source": f"file (column {self.column!r})"}


def from_stamps(stamps: list[datetime]) -> Field:
    """Seconds since the first of several time stamps."""
    return np.array([(stamp - stamps[0]).total_seconds() for stamp in stamps])
