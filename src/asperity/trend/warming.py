"""Detection of a warm-up: CRF and level follow one exponential from the first recording on.

Warming oil thins the film, which changes both; wear moves CRF by a rise that bends, or a level that
grows. A stated oil temperature is a condition instead and decides better (`regressors`).
"""

from typing import NamedTuple

import numpy as np

from asperity.core.arrays import Field

FEWEST_POINTS = 10
LEAST_CRF_CHANGE, MOST_CRF_CHANGE = 0.01, 0.3  # relative, of a warm-up
LEAST_LEVEL_CHANGE = 0.1  # of the logarithm of the level: 0.9 dB
# one common exponential must beat every other model by this BIC, and a constant for each indicator
BIC_REQUIRED = 10.0
TIME_CONSTANTS = 40  # grid points
LATEST_RECORDINGS = 3
TIME_CONSTANTS_COVERED = 2.5  # the series is at least so many time constants long
# relative squares of a row below which it lies in the span of the other columns, up to rounding
TINY = 1e-24


class WarmUp(NamedTuple):
    """Total change of CRF (relative) and of the logarithm of the level, and their time constant.

    `residual` is how far both now deviate from the exponential, the median of the last three.
    """

    crf: float
    level: float
    time_constant: float
    residual: tuple[float, float]


def warm_up(x: Field, crf: Field, level: Field) -> WarmUp | None:
    """Return the warm-up in CRF (over its usual value) and ln level, or None.

    `crf` and `level` have shape (recordings,); nan where not known.
    """
    finite = np.isfinite(crf) & np.isfinite(level)
    t = x[finite]
    indicators = (crf[finite], level[finite])
    if t.size < FEWEST_POINTS or not t[-1] > t[0]:
        return None
    t = (t - t[0]) / (t[-1] - t[0])
    time_constant, decay, costs = _best_exponential(t, indicators)
    if not _is_significant(t, indicators, costs):
        return None
    columns = np.vstack([np.ones(t.size), decay])
    fits = [_fit(columns, values) for values in indicators]
    crf_change = -fits[0][1] / float(np.median(indicators[0]))
    level_change = -fits[1][1]
    if not LEAST_CRF_CHANGE <= crf_change <= MOST_CRF_CHANGE:
        return None
    if abs(level_change) < LEAST_LEVEL_CHANGE:
        return None
    residual = [
        float(np.median((values - fit @ columns)[-LATEST_RECORDINGS:]))
        for values, fit in zip(indicators, fits, strict=True)
    ]
    return WarmUp(
        float(crf_change),
        float(level_change),
        float(time_constant * np.ptp(x[finite])),
        (residual[0], residual[1]),
    )


def _best_exponential(t: Field, indicators: tuple[Field, Field]) -> tuple[float, Field, Field]:
    """Return time constant and decay that fit both indicators best, and the cost of each."""
    time_constants = np.geomspace(1.0 / t.size, 1.0 / TIME_CONSTANTS_COVERED, TIME_CONSTANTS)
    decays = np.exp(-t / time_constants[:, None])
    costs = np.array([_costs(np.ones((1, t.size)), decays, values) for values in indicators])
    best = int(np.argmin(costs.sum(axis=0)))
    return float(time_constants[best]), decays[best], costs[:, best]


def _is_significant(t: Field, indicators: tuple[Field, Field], costs: Field) -> bool:
    """Return whether a common exponential of these costs beats all other models by BIC."""
    penalty = float(np.log(t.size))  # BIC per parameter
    # an amplitude for each, and half of the common time constant
    exponential = costs + np.array([1.5, 1.5]) * penalty
    constant = np.ones((1, t.size))
    line = np.vstack([constant, t])
    unchanged = np.array([_cost(constant, values) for values in indicators])
    rivals = []
    for values, flat in zip(indicators, unchanged, strict=True):
        sticks = _costs(line, np.maximum(t - t[2:-2, None], 0.0), values) + 3.0 * penalty
        straight = _cost(line, values) + penalty
        rivals.append(min(float(flat), straight, float(sticks.min())))
    return sum(rivals) - exponential.sum() > BIC_REQUIRED and bool(
        np.all(unchanged - exponential > BIC_REQUIRED)
    )


def _fit(columns: Field, values: Field) -> Field:
    return np.asarray(np.linalg.lstsq(columns.T, values, rcond=None)[0])


def _costs(columns: Field, rows: Field, values: Field) -> Field:
    """Return `_cost` of the columns with each row added, by projection on the columns."""
    basis = np.linalg.qr(columns.T)[0]
    error = values - basis @ (basis.T @ values)
    new = rows - (rows @ basis) @ basis.T
    # projected twice: the remainder may be small against what was removed
    new -= (new @ basis) @ basis.T
    squares = np.sum(new**2, axis=1)
    coefficients = np.where(
        squares > TINY * np.sum(rows**2, axis=1), (new @ error) / np.maximum(squares, 1e-300), 0.0
    )
    residual = np.sum((error - coefficients[:, None] * new) ** 2, axis=1)
    return np.asarray(values.size * np.log(np.maximum(residual, 1e-300)))


def _cost(columns: Field, values: Field) -> float:
    """Return -2 ln likelihood at the maximum-likelihood scatter, up to a constant."""
    error = values - _fit(columns, values) @ columns
    return float(values.size * np.log(max(float(error @ error), 1e-300)))
