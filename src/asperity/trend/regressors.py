"""Effect of load, speed and temperature on an indicator, fitted to recording-to-recording changes.

`asperity.monitoring` chooses the conditions and the bounds of their coefficients.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import scipy

from asperity.core.arrays import Field, Mask

BASELINE_RECORDINGS = 8  # conditions are relative to the median of these first recordings
SMALLEST_SHARE = 0.1  # of the smallest change: a condition that cannot explain more is left out
PRIOR_WIDTH = 0.25  # standard deviation of a coefficient over the span of its bounds


@dataclass(frozen=True, slots=True, kw_only=True)
class Condition:
    """Operating condition that an indicator may follow: indicator = course + c · `values`.

    Parameters
    ----------
    name : such as "load"
    values : shape (recordings,), such as the logarithm of the load; nan where not known
    low, high : physical bounds of the coefficient
    shown, unit : the condition as displayed, such as the load in N
    """

    name: str
    values: Field
    low: float
    high: float
    shown: Field
    unit: str

    def can_explain(self, finite: Mask, change: float) -> bool:
        """Return whether the condition may change the indicator by more than `change`."""
        return bool(max(-self.low, self.high) * np.ptp(self.values[finite]) > change)


class ConditionEffect(NamedTuple):
    """Part of an indicator that operating conditions explain.

    `effect` (recordings,) is to be subtracted: 0 at the baseline, nan where a condition is not
    stated. `rows` (conditions, recordings) are the conditions used, relative to the baseline;
    `widths` the remaining uncertainty of their `coefficients`; `scatter` the standard deviation of
    one recording.
    """

    effect: Field
    rows: Field
    widths: Field
    coefficients: Field
    names: tuple[str, ...]
    scatter: float


NO_CONDITION_EFFECT = ConditionEffect(
    np.zeros(1), np.zeros((0, 1)), np.zeros(0), np.zeros(0), (), 0.0
)


def fit_conditions(
    values: Field, conditions: Sequence[Condition], *, smallest_change: float
) -> ConditionEffect:
    """Fit the effect of conditions by bounded least squares on recording-to-recording differences.

    The mean difference is removed: wear and a condition may both drift, so slow changes cannot be
    attributed.

    Parameters
    ----------
    values : the indicator, shape (recordings,); nan where not determined
    conditions : of the same recordings
    smallest_change : change of the indicator worth acting on
    """
    finite = np.isfinite(values)
    for condition in conditions:
        finite = finite & np.isfinite(condition.values)
    if finite.sum() < 3:
        return NO_CONDITION_EFFECT
    smallest = SMALLEST_SHARE * smallest_change
    relevant = [condition for condition in conditions if condition.can_explain(finite, smallest)]
    if not relevant:
        return NO_CONDITION_EFFECT
    rows = np.array(
        [
            condition.values - np.median(condition.values[finite][:BASELINE_RECORDINGS])
            for condition in relevant
        ]
    )
    low = np.array([condition.low for condition in relevant])
    high = np.array([condition.high for condition in relevant])
    coefficients, scatter = _fit_differences(values[finite], rows[:, finite], low, high)
    effect = coefficients @ rows  # nan where a condition is not stated
    names = tuple(condition.name for condition in relevant)
    return ConditionEffect(effect, rows, PRIOR_WIDTH * (high - low), coefficients, names, scatter)


def _fit_differences(values: Field, rows: Field, low: Field, high: Field) -> tuple[Field, float]:
    """Return the coefficients within bounds, and the standard deviation of one recording."""
    change = np.diff(values)
    row_change = np.diff(rows, axis=1)
    change, row_change = change - change.mean(), row_change - row_change.mean(axis=1, keepdims=True)
    size = np.maximum(np.abs(row_change).max(axis=1), 1e-12)  # equal scales for the solver
    fitted = scipy.optimize.lsq_linear(
        (row_change / size[:, None]).T, change, (low * size, high * size)
    )
    coefficients = fitted.x / size
    residual = change - coefficients @ row_change
    # a difference has twice the variance
    return coefficients, float(np.sqrt(np.mean(residual**2) / 2.0))
