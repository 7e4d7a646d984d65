"""A warm-up known by its shape: CRF and level go to where they stay by one exponential, from the first recording on.

Oil that warms thins the film, and both follow it; wear moves CRF by a rise that bends, or a level
that grows. Where oil temperature is stated it is a condition instead, and tells more
(`regressors`).
"""

from typing import NamedTuple

import numpy as np

from asperity.core.arrays import Field

FEWEST = 10  # places
LEAST, MOST = 0.01, 0.3  # of CRF, that a warm-up changes it by
LEAST_LEVEL = 0.1  # of the logarithm of the level: 0.9 dB
# BIC by which one exponential for both is to be better than anything else, and than none for either
SURE = 10.0
LENGTHS = 40
LATELY = 3  # recordings
SETTLED = 2.5  # lengths that the series has to cover
TINY = 1e-24  # of a row's squares: what rounding leaves of one that the columns hold already


class WarmUp(NamedTuple):
    """By how much CRF (relative) and the logarithm of the level change in all, and how long 63 % of that takes.

    `left` is how far both lie beside that now, the median of the last three.
    """

    crf: float
    level: float
    length: float
    left: tuple[float, float]


def warm_up(x: Field, crf: Field, level: Field) -> WarmUp | None:
    """A warm-up in CRF over its usual value and ln level, both of shape (recordings,), nan unknown; None for none."""
    known = np.isfinite(crf) & np.isfinite(level)
    at, both = x[known], (crf[known], level[known])
    if at.size < FEWEST or not at[-1] > at[0]:
        return None
    at = (at - at[0]) / (at[-1] - at[0])
    constant = np.ones((1, at.size))
    lengths = np.geomspace(1.0 / at.size, 1.0 / SETTLED, LENGTHS)
    left = np.exp(-at / lengths[:, None])
    costs = np.array([_costs(constant, left, one) for one in both])
    best = int(np.argmin(costs.sum(axis=0)))
    price = float(np.log(at.size))
    warm = (
        costs[:, best] + np.array([1.5, 1.5]) * price
    )  # an amplitude each, and the length between them
    rivals = []
    for one in both:
        sticks = (
            _costs(np.vstack([constant, at]), np.maximum(at - at[2:-2, None], 0.0), one)
            + 3.0 * price
        )
        straight = _cost(np.vstack([constant, at]), one) + price
        rivals.append(min(_cost(constant, one), straight, float(sticks.min())))
    alone = np.array([_cost(constant, one) for one in both])
    sure = sum(rivals) - warm.sum() > SURE and bool(np.all(alone - warm > SURE))
    columns = np.vstack([constant, left[best]])
    fits = [_fit(columns, one) for one in both]
    crf_by, level_by = -fits[0][1] / float(np.median(both[0])), -fits[1][1]
    beside = [
        float(np.median((one - fit @ columns)[-LATELY:]))
        for one, fit in zip(both, fits, strict=True)
    ]
    if not sure or not LEAST <= crf_by <= MOST or abs(level_by) < LEAST_LEVEL:
        return None
    return WarmUp(
        float(crf_by),
        float(level_by),
        float(lengths[best] * np.ptp(x[known])),
        (beside[0], beside[1]),
    )


def _fit(columns: Field, values: Field) -> Field:
    return np.asarray(np.linalg.lstsq(columns.T, values, rcond=None)[0])


def _costs(columns: Field, rows: Field, values: Field) -> Field:
    """`_cost` of the columns beside each row: what a row adds to them is taken off by itself."""
    basis = np.linalg.qr(columns.T)[0]
    off = values - basis @ (basis.T @ values)
    beside = rows - (rows @ basis) @ basis.T
    beside -= (
        beside @ basis
    ) @ basis.T  # once more: what is left may be small beside what was taken out
    own = np.sum(beside**2, axis=1)
    shares = np.where(
        own > TINY * np.sum(rows**2, axis=1), (beside @ off) / np.maximum(own, 1e-300), 0.0
    )
    left = np.sum((off - shares[:, None] * beside) ** 2, axis=1)
    return np.asarray(values.size * np.log(np.maximum(left, 1e-300)))


def _cost(columns: Field, values: Field) -> float:
    """Twice the -ln likelihood at the likeliest scatter, but for a constant."""
    off = values - _fit(columns, values) @ columns
    return float(values.size * np.log(max(float(off @ off), 1e-300)))
