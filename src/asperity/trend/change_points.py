"""Bayesian fits of a broken stick, smooth curves, a straight line and a constant to one series.

`stages` interprets them as wear; docs/theory/indicators.md has the equations.
"""

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
import scipy

from asperity.core.arrays import Field

FEWEST_STAGE_POINTS = 7  # distinct x: three on either side of a break, and one degree of freedom
MOST_POINTS = 240  # longer series are averaged in groups of neighbours
BREAK_POINTS = 161
SCATTER_POINTS = 15
CURVE_POINTS = 48
SLOPE_ITERATIONS = 6  # of the weights, which depend on the slope where x has errors
CORRELATIONS = (0.0, 0.4, 0.65, 0.85)  # between the scatter of neighbouring points
CORRELATION_PRIOR = np.array([0.7, 0.1, 0.1, 0.1])
STICK, CONSTANT = "broken stick", "no change"


class SeriesPoints(NamedTuple):
    """Means over the repeats at each distinct x, in ascending order; shape (points,)."""

    x: Field
    x_std: Field
    y: Field
    variance: Field  # of y, from the errors given and the scatter of repeats


class _Candidate(NamedTuple):
    """Model with one nonlinear parameter k (break or length) on a grid, linear in the others.

    `model(k, points)` returns the expected columns at the points, errors in x included, (grid,
    points, linear parameters), and their derivatives with respect to x.
    """

    name: str
    bends: Field
    model: Callable[[Field, SeriesPoints], tuple[Field, Field]]
    parameters: int


class ModelFit(NamedTuple):
    """Log likelihoods over the grid of bends and scatters, and the fitted linear parameters.

    Scatters vary in size and correlation, correlation first.
    """

    best: Field  # (grid,), greatest log likelihood over the scatters
    marginal: Field  # (grid, scatters)
    linear: Field  # (grid, scatters, linear parameters)


class ModelComparison(NamedTuple):
    """All candidates fitted to one series; `scatter` is that of the best, in the series' unit."""

    points: SeriesPoints
    breaks: Field
    fits: dict[str, ModelFit]
    bic: dict[str, float]
    scatter: float


def common_breaks(series: Sequence[SeriesPoints]) -> Field:
    """Return possible common breaks, from the third to the third-last point of every series."""
    low = max(points.x[2] for points in series)
    high = min(points.x[-3] for points in series)
    return np.linspace(low, high, BREAK_POINTS)


def compare_models(points: SeriesPoints, breaks: Field) -> ModelComparison:
    """Fit every candidate to the points."""
    candidates = _candidates(points, breaks)
    scatters = _scatters(points)
    fits = {candidate.name: _fit(candidate, points, scatters) for candidate in candidates}
    bic = {
        candidate.name: -2.0 * float(np.max(fits[candidate.name].best))
        + (candidate.parameters + 1) * float(np.log(points.x.size))
        for candidate in candidates
    }
    best = fits[min(bic, key=lambda name: bic[name])]
    scatter = float(scatters[int(np.argmax(np.max(best.marginal, axis=0))) % scatters.size])
    return ModelComparison(points=points, breaks=breaks, fits=fits, bic=bic, scatter=scatter)


def averaged_points(x: Field, y: Field, y_std: Field, x_std: Field) -> SeriesPoints:
    """Average repeats; their pooled scatter is used where it exceeds the stated deviations."""
    if x.size == 0:
        return SeriesPoints(x, x_std, y, y)
    distinct, index = np.unique(x, return_inverse=True)
    if distinct.size > MOST_POINTS:  # neighbours in groups of equal number
        index = index * MOST_POINTS // distinct.size
    count = np.bincount(index).astype(float)

    def mean(values: Field) -> Field:
        return np.asarray(np.bincount(index, values) / count)

    means, centre = mean(y), mean(x)
    variance = mean(y_std**2)
    degrees = y.size - count.size
    if degrees > 0:
        excess = (
            float(np.sum((y - means[index]) ** 2)) / degrees
            - float(np.sum(variance * (count - 1.0))) / degrees
        )
        variance = variance + max(excess, 0.0)
    return SeriesPoints(centre, mean(x_std), means, variance / count)


def _scatters(points: SeriesPoints) -> Field:
    """Return the grid of standard deviations beyond the stated errors."""
    span = max(float(np.ptp(points.y)), 1e-6 * float(np.max(np.abs(points.y))), 1e-9)
    return np.concatenate([[span * 1e-4], span * np.geomspace(2e-3, 0.7, SCATTER_POINTS - 1)])


def _candidates(points: SeriesPoints, breaks: Field) -> list[_Candidate]:
    x = points.x
    lengths = np.ptp(x) * np.geomspace(0.05, 5.0, CURVE_POINTS)
    none = np.zeros(1)
    return [
        _Candidate(STICK, breaks, _stick, 4),
        _Candidate("saturating exponential", lengths, _exponential, 4),
        _Candidate("saturating hyperbola", lengths, _hyperbola, 4),
        _Candidate("straight line", none, _line, 2),
        _Candidate(CONSTANT, none, _constant, 1),
    ]


def _with_constant(column: Field, slope: Field) -> tuple[Field, Field]:
    """Return a constant and one column, and their derivatives with respect to x."""
    return np.stack([np.ones_like(column), column], axis=-1), np.stack(
        [np.zeros_like(slope), slope], axis=-1
    )


def _stick(k: Field, points: SeriesPoints) -> tuple[Field, Field]:
    """Return 1, x and the expected hinge max(x - k, 0) over the error s of x.

    E[max(x - k, 0)] = (x - k) Φ(z) + s φ(z), z = (x - k)/s.
    """
    distance = points.x[None, :] - k[:, None]
    blur = np.maximum(points.x_std, 1e-12)[None, :]
    z = distance / blur
    probability_beyond = scipy.special.ndtr(z)  # P(true x > k), shape (breaks, points)
    expected_hinge = distance * probability_beyond + blur * np.exp(
        -0.5 * np.minimum(z**2, 1400.0)
    ) / np.sqrt(2.0 * np.pi)
    straight = np.broadcast_to(points.x - points.x[0], probability_beyond.shape)
    constant = np.ones_like(probability_beyond)
    return np.stack([constant, straight, expected_hinge], axis=-1), np.stack(
        [np.zeros_like(probability_beyond), constant, probability_beyond], axis=-1
    )


def _exponential(k: Field, points: SeriesPoints) -> tuple[Field, Field]:
    curve = np.exp(-(points.x - points.x[0])[None, :] / k[:, None])
    return _with_constant(curve, -curve / k[:, None])


def _hyperbola(k: Field, points: SeriesPoints) -> tuple[Field, Field]:
    curve = 1.0 / (1.0 + (points.x - points.x[0])[None, :] / k[:, None])
    return _with_constant(curve, -(curve**2) / k[:, None])


def _line(_: Field, points: SeriesPoints) -> tuple[Field, Field]:
    return _with_constant((points.x - points.x[0])[None], np.ones_like(points.x)[None])


def _constant(_: Field, points: SeriesPoints) -> tuple[Field, Field]:
    return np.ones((1, points.x.size, 1)), np.zeros((1, points.x.size, 1))


def _fit(candidate: _Candidate, points: SeriesPoints, scatters: Field) -> ModelFit:
    """Fit by weighted least squares at every bend and scatter.

    The error of x counts through the local slope, which is iterated.
    """
    columns, slopes = candidate.model(
        candidate.bends, points
    )  # (bends, points, linear), the first of them a constant
    mean = float(np.mean(points.y))
    products = _products(columns, points.y - mean)
    variance = np.tile(
        points.variance + scatters[:, None] ** 2, (len(CORRELATIONS), 1)
    )  # (scatters, points)
    correlation = np.repeat(CORRELATIONS, scatters.size)
    precision = _precision(variance, correlation)
    linear, squares, determinant = _least_squares(precision, products, columns.shape[-1])
    for _ in range(SLOPE_ITERATIONS if np.any(points.x_std > 0.0) else 0):
        steepness = linear @ np.swapaxes(slopes, 1, 2)
        precision = _precision(variance + (steepness * points.x_std) ** 2, correlation)
        linear, squares, determinant = _least_squares(precision, products, columns.shape[-1])
    likelihood = np.log(np.repeat(CORRELATION_PRIOR, scatters.size)) - 0.5 * (
        squares + precision.log_determinant
    )
    linear[..., 0] += mean
    return ModelFit(np.max(likelihood, axis=1), likelihood - 0.5 * determinant, linear)


class _Precision(NamedTuple):
    """Inverse covariance of first-order autocorrelated scatter, and -ln of its determinant with 2π.

    It is tridiagonal: `own` is the diagonal, `next` the one that couples a point with the previous
    one, (..., scatters, points) each.
    """

    own: Field
    next: Field
    log_determinant: Field


def _precision(variance: Field, correlation: Field) -> _Precision:
    """Return the precision for variances (..., scatters, points) and correlations (scatters,)."""
    innovation = 1.0 - correlation[:, None] ** 2
    inside = np.ones(variance.shape[-1])
    inside[[0, -1]] = 0.0
    own = (1.0 + correlation[:, None] ** 2 * inside) / innovation / variance
    following = (
        -correlation[:, None] / innovation / np.sqrt(variance * _shifted(variance, first=np.inf))
    )
    of_memory = (variance.shape[-1] - 1) * np.log(innovation[:, 0])
    return _Precision(own, following, np.sum(np.log(2.0 * np.pi * variance), axis=-1) + of_memory)


def _shifted(values: Field, first: float = 0.0) -> Field:
    """Return each point's predecessor along the last axis."""
    shifted = np.roll(values, 1, axis=-1)
    shifted[..., 0] = first
    return shifted


def _products(columns: Field, y: Field) -> Field:
    """Return products of all pairs of columns and y, (bends, pairs, 2 points).

    The first half holds products at one point, the second those across to the previous point.
    """
    bends, points, size = columns.shape
    columns_and_y = np.concatenate(
        [np.moveaxis(columns, 2, 0), np.broadcast_to(y, (1, bends, points))]
    )
    shifted = _shifted(columns_and_y)
    pairs = [*zip(*np.triu_indices(size + 1), strict=True)]
    products = np.empty((bends, len(pairs), 2 * points))
    for number, (first, second) in enumerate(pairs):
        np.multiply(columns_and_y[first], columns_and_y[second], out=products[:, number, :points])
        products[:, number, points:] = (
            columns_and_y[first] * shifted[second] + columns_and_y[second] * shifted[first]
        )
    return products


def _least_squares(precision: _Precision, products: Field, size: int) -> tuple[Field, Field, Field]:
    """Solve for `size` columns: coefficients, squared residual, ln det of the information.

    Coefficients have shape (bends, scatters, linear). All normal equations are eliminated at once,
    y's row last: LAPACK would take thousands of such small systems one by one.
    """
    rows = _normal_equations(precision, products, size)
    for i in range(size):
        for j in range(i + 1, size + 1):
            rows[j, i + 1 :] -= rows[j, i] / rows[i, i] * rows[i, i + 1 :]
    linear = np.empty((*rows.shape[2:], size))
    for i in reversed(range(size)):
        solved_terms = sum(
            (rows[i, j] * linear[..., j] for j in range(i + 1, size)),
            start=np.zeros(rows.shape[2:]),
        )
        linear[..., i] = (rows[i, size] - solved_terms) / rows[i, i]
    diagonal = np.arange(size)
    return linear, rows[size, size], np.sum(np.log(rows[diagonal, diagonal]), axis=0)


def _normal_equations(precision: _Precision, products: Field, size: int) -> Field:
    """Return the symmetric equations of columns and y, (size + 1, size + 1, bends, scatters)."""
    equations = products @ np.swapaxes(
        np.concatenate([precision.own, precision.next], axis=-1), -1, -2
    )
    rows = np.empty((size + 1, size + 1, equations.shape[0], equations.shape[2]))
    for number, (first, second) in enumerate(zip(*np.triu_indices(size + 1), strict=True)):
        rows[first, second] = rows[second, first] = equations[:, number]
    diagonal = np.arange(size)
    rows[diagonal, diagonal] += 1e-12 * np.sum(rows[diagonal, diagonal], axis=0)
    return rows


def sudden_bend(x: Field, crfa: Field, x_std: Field, breaks: Field) -> Field:
    """Return ln P(ln CRFA | break), up to a constant: a hinge over a parabola.

    Smooth growth of CRFA carries no information about the break.
    """
    finite = np.isfinite(crfa) & (crfa > 0.0)
    points = averaged_points(
        x[finite], np.log(crfa[finite]), np.zeros(int(np.sum(finite))), x_std[finite]
    )
    if points.x.size < FEWEST_STAGE_POINTS:
        return np.zeros(breaks.size)

    def model(k: Field, points: SeriesPoints) -> tuple[Field, Field]:
        stick, sloped = _stick(k, points)
        x = stick[..., 1:2]
        return np.concatenate([stick, x**2], axis=-1), np.concatenate([sloped, 2.0 * x], axis=-1)

    candidate = _Candidate("ln CRFA", breaks, model, 5)
    return log_sum(_fit(candidate, points, _scatters(points)).marginal)


def probability_beyond_break(x: Field, x_std: Field, breaks: Field, density: Field) -> Field:
    """Return the probability that each recording's true x lies beyond the break."""
    blur = np.maximum(x_std, 1e-12)
    return np.asarray(scipy.special.ndtr((x[:, None] - breaks[None, :]) / blur[:, None]) @ density)


def log_sum(marginal: Field) -> Field:
    """Return the log of the likelihood summed over scatters (log-spaced but for the first)."""
    top = np.max(marginal, axis=1, keepdims=True)
    return np.asarray(np.log(np.sum(np.exp(marginal - top), axis=1)) + top[:, 0])


def quantiles(
    breaks: Field, density: Field, shares: tuple[float, float, float]
) -> tuple[float, float, float]:
    """Return the breaks below which these shares of the density lie."""
    cumulative = np.concatenate([[0.0], np.cumsum(density)])
    step = breaks[1] - breaks[0]
    edges = np.concatenate([breaks - step / 2.0, [breaks[-1] + step / 2.0]])
    low, means, high = np.interp(shares, cumulative, edges)
    return float(low), float(means), float(high)
