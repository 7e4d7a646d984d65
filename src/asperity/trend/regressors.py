"""What load, speed and temperature explain of an indicator, learned from how both change from recording to recording.

Which conditions there are, and how much of each an indicator may follow, is said by
`asperity.monitoring`.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import scipy

from asperity.core.arrays import Field

BASELINE = 8  # recordings whose median the conditions are counted from
WORTH = 0.1  # of the least change: a condition that can explain no more of it is left out
WIDTH = 0.25  # of the span of a coefficient, which it may still be off by


@dataclass(frozen=True, slots=True, kw_only=True)
class Condition:
    """A condition that an indicator may follow: indicator = course + coefficient times `values`.

    Parameters
    ----------
    name : such as "load"
    values : shape (recordings,), such as the logarithm of the load; nan where it is not known
    low, high : what the coefficient may be, by the contact's physics
    shown, unit : the same as a person reads it, such as the load in N
    """

    name: str
    values: Field
    low: float
    high: float
    shown: Field
    unit: str


class Explained(NamedTuple):
    """What conditions explain of an indicator.

    `effect` is to be taken off, shape (recordings,), 0 at the baseline, nan where a condition is
    not stated. `rows` are the conditions that count, counted from the baseline, (conditions,
    recordings); `widths` by how much their `coefficients` may still be off; `scatter` is the
    deviation of a recording.
    """

    effect: Field
    rows: Field
    widths: Field
    coefficients: Field
    names: tuple[str, ...]
    scatter: float


NOTHING_EXPLAINED = Explained(np.zeros(1), np.zeros((0, 1)), np.zeros(0), np.zeros(0), (), 0.0)


def explained(values: Field, conditions: Sequence[Condition], *, least: float) -> Explained:
    """What conditions explain: bounded least squares on the differences of one recording to the next.

    Differences beside their mean, because wear and a condition may both drift: what goes slowly
    says little of either.

    Parameters
    ----------
    values : the indicator, shape (recordings,); nan where there is none
    conditions : of the same recordings
    least : the change of it that is worth acting on
    """
    known = np.isfinite(values)
    for one in conditions:
        known = known & np.isfinite(one.values)
    if known.sum() < 3:
        return NOTHING_EXPLAINED
    counted = [
        one
        for one in conditions
        if max(-one.low, one.high) * np.ptp(one.values[known]) > WORTH * least
    ]
    if not counted:
        return NOTHING_EXPLAINED
    rows = np.array([one.values - np.median(one.values[known][:BASELINE]) for one in counted])
    low, high = (np.array([getattr(one, end) for one in counted]) for end in ("low", "high"))
    change, along = np.diff(values[known]), np.diff(rows[:, known], axis=1)
    change, along = change - change.mean(), along - along.mean(axis=1, keepdims=True)
    size = np.maximum(
        np.abs(along).max(axis=1), 1e-12
    )  # of one scale, so that the solver sees all of them
    fitted = scipy.optimize.lsq_linear((along / size[:, None]).T, change, (low * size, high * size))
    coefficients = fitted.x / size
    left = change - coefficients @ along
    scatter = float(np.sqrt(np.mean(left**2) / 2.0))  # of a difference twice that of one
    effect = coefficients @ rows  # nan where a condition is not stated
    names = tuple(one.name for one in counted)
    return Explained(effect, rows, WIDTH * (high - low), coefficients, names, scatter)
