"""Sensors of a table of overall values: dead or stuck ones."""

import numpy as np

from asperity.core.arrays import Field
from asperity.monitoring.overalls.columns import is_logarithmic
from asperity.monitoring.overalls.table import OverallValues

STUCK = 30  # last equal numbers from which a sensor that varied before counts as blind


def blind_sensors(overalls: OverallValues) -> dict[str, str]:
    """Return why the last values of a column show nothing of the machine, by name."""
    reasons = {
        name: _reason(values, logarithmic=is_logarithmic(overalls.units[name]))
        for name, values in overalls.values.items()
    }
    return {name: f"{name} {reason}" for name, reason in reasons.items() if reason}


def _reason(values: Field, *, logarithmic: bool) -> str:
    """Return why a sensor is blind, or ""."""
    (filled,) = np.nonzero(~np.isnan(values))
    last = float(values[filled[-1]])
    if np.isinf(last):
        return "is infinite in the last row"
    missing = values.size - 1 - int(filled[-1])
    if missing >= _usual_stride(filled):
        rows = "the last row" if missing == 1 else f"the last {missing} rows"
        return f"has no value in {rows}"
    if last <= 0.0 and not logarithmic:
        return "has no value above 0 in the last row"
    numbers = values[np.isfinite(values)]
    if numbers.size > 2 * STUCK and np.ptp(numbers[-STUCK:]) == 0.0 and _varies(numbers[:-STUCK]):
        return f"has not changed in the last {STUCK} rows"
    return ""


def _usual_stride(filled: np.ndarray) -> float:
    """Return the rows from one number to the next that all but a twentieth do not exceed."""
    return float(np.percentile(np.diff(filled), 95)) if filled.size > 1 else 1.0


def _varies(values: Field) -> bool:
    """Return whether at most half of the successive values are equal."""
    return bool(np.mean(np.diff(values) == 0.0) < 0.5)
