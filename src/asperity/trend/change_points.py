"""Broken stick, smooth curves, straight line and constant fitted to one series: the likelihood of each, by Bayes.

What they say of wear is left to `stages`; docs/theory/indicators.md has the equations.
"""

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
import scipy

from asperity.core.arrays import Field

FEWEST_PLACES = 7  # different x: three on either side of a break, and one to contradict
MOST_PLACES = 240  # recordings of a long watch are averaged in neighbouring groups down to so many
BREAKS, SCATTERS, CURVATURES = (
    161,
    15,
    48,
)  # grid points of break, scatter and bend of the smooth curves
ROUNDS = 6  # of weights by the slope
MEMORIES = (0.0, 0.4, 0.65, 0.85)  # correlation of neighbouring places' scatter
ALIKE = np.array(
    [0.7, 0.1, 0.1, 0.1]
)  # how likely each of them is beforehand: mostly there is none
STICK, CONSTANT = "broken stick", "no change"


class Places(NamedTuple):
    """Means over the repeats at each place, ordered; shape (places,)."""

    x: Field
    x_std: Field
    y: Field
    variance: Field  # of y, from the errors given and the scatter of repeats


class _Candidate(NamedTuple):
    """A model with its one bend parameter k (break, or length of saturation) on a grid, linear in all else.

    `model(k, places)` gives the expected columns at the places, errors in x included, (grid,
    places, linear parameters), and their derivatives by x.
    """

    name: str
    bends: Field
    model: Callable[[Field, Places], tuple[Field, Field]]
    parameters: int


class Fitted(NamedTuple):
    """Over the grid of bends and scatters: log likelihood, the same with linear parameters integrated out, those.

    Scatters are of every size and memory, by memory first.
    """

    best: Field  # (grid,), greatest log likelihood over the scatters
    marginal: Field  # (grid, scatters)
    linear: Field  # (grid, scatters, linear parameters)


class Compared(NamedTuple):
    """Candidates fitted to the places of one series; `bic` of each, `scatter` of the best in the series' unit."""

    places: Places
    breaks: Field
    fits: dict[str, Fitted]
    bic: dict[str, float]
    scatter: float


def common_breaks(series: Sequence[Places]) -> Field:
    """Where a break of all series may lie: between the third and the third last place of each."""
    low, high = max(places.x[2] for places in series), min(places.x[-3] for places in series)
    return np.linspace(low, high, BREAKS)


def compared(places: Places, breaks: Field) -> Compared:
    """Every candidate fitted to the places."""
    candidates, scatters = _candidates(places, breaks), _scatters(places)
    fits = {candidate.name: _fit(candidate, places, scatters) for candidate in candidates}
    bic = {
        candidate.name: -2.0 * float(np.max(fits[candidate.name].best))
        + (candidate.parameters + 1) * float(np.log(places.x.size))
        for candidate in candidates
    }
    best = fits[min(bic, key=lambda name: bic[name])]
    scatter = float(scatters[int(np.argmax(np.max(best.marginal, axis=0))) % scatters.size])
    return Compared(places=places, breaks=breaks, fits=fits, bic=bic, scatter=scatter)


def places_of(x: Field, y: Field, y_std: Field, x_std: Field) -> Places:
    """Repeats averaged; their own scatter, pooled, counts where it is larger than the deviations given."""
    if x.size == 0:
        return Places(x, x_std, y, y)
    at, index = np.unique(x, return_inverse=True)
    if at.size > MOST_PLACES:  # neighbours in groups of equal number
        index = index * MOST_PLACES // at.size
    count = np.bincount(index).astype(float)

    def mean(values: Field) -> Field:
        return np.asarray(np.bincount(index, values) / count)

    middle, centre = mean(y), mean(x)
    given = mean(y_std**2)
    spare = y.size - count.size
    if spare > 0:
        excess = (
            float(np.sum((y - middle[index]) ** 2)) / spare
            - float(np.sum(given * (count - 1.0))) / spare
        )
        given = given + max(excess, 0.0)
    return Places(centre, mean(x_std), middle, given / count)


def _scatters(places: Places) -> Field:
    """Grid of standard deviations, beyond the errors given, of the places about a curve."""
    span = max(float(np.ptp(places.y)), 1e-6 * float(np.max(np.abs(places.y))), 1e-9)
    return np.concatenate([[span * 1e-4], span * np.geomspace(2e-3, 0.7, SCATTERS - 1)])


def _candidates(places: Places, breaks: Field) -> list[_Candidate]:
    x = places.x
    lengths = np.ptp(x) * np.geomspace(0.05, 5.0, CURVATURES)
    none = np.zeros(1)
    return [
        _Candidate(STICK, breaks, _stick, 4),
        _Candidate("saturating exponential", lengths, _exponential, 4),
        _Candidate("saturating hyperbola", lengths, _hyperbola, 4),
        _Candidate("straight line", none, _line, 2),
        _Candidate(CONSTANT, none, _constant, 1),
    ]


def _beside_constant(column: Field, slope: Field) -> tuple[Field, Field]:
    """A constant and one column, and their derivatives by x."""
    return np.stack([np.ones_like(column), column], axis=-1), np.stack(
        [np.zeros_like(slope), slope], axis=-1
    )


def _stick(k: Field, at: Places) -> tuple[Field, Field]:
    """1, x and the hinge max(x - k, 0), in the mean over the error of x: (x - k) Φ(z) + s φ(z), z = (x - k)/s."""
    ahead = at.x[None, :] - k[:, None]
    blur = np.maximum(at.x_std, 1e-12)[None, :]
    z = ahead / blur
    over = scipy.special.ndtr(z)  # P(true x > k), shape (breaks, places)
    bent = ahead * over + blur * np.exp(-0.5 * np.minimum(z**2, 1400.0)) / np.sqrt(2.0 * np.pi)
    straight = np.broadcast_to(at.x - at.x[0], over.shape)
    one = np.ones_like(over)
    return np.stack([one, straight, bent], axis=-1), np.stack(
        [np.zeros_like(over), one, over], axis=-1
    )


def _exponential(k: Field, at: Places) -> tuple[Field, Field]:
    along = np.exp(-(at.x - at.x[0])[None, :] / k[:, None])
    return _beside_constant(along, -along / k[:, None])


def _hyperbola(k: Field, at: Places) -> tuple[Field, Field]:
    along = 1.0 / (1.0 + (at.x - at.x[0])[None, :] / k[:, None])
    return _beside_constant(along, -(along**2) / k[:, None])


def _line(_: Field, at: Places) -> tuple[Field, Field]:
    return _beside_constant((at.x - at.x[0])[None], np.ones_like(at.x)[None])


def _constant(_: Field, at: Places) -> tuple[Field, Field]:
    return np.ones((1, at.x.size, 1)), np.zeros((1, at.x.size, 1))


def _fit(candidate: _Candidate, places: Places, scatters: Field) -> Fitted:
    """Weighted least squares at every bend and scatter; the error of x counts with the slope there (iterated)."""
    columns, slopes = candidate.model(
        candidate.bends, places
    )  # (bends, places, linear), the first of them a constant
    middle = float(np.mean(places.y))
    products = _products(columns, places.y - middle)
    own = np.tile(
        places.variance + scatters[:, None] ** 2, (len(MEMORIES), 1)
    )  # (scatters, places)
    memory = np.repeat(MEMORIES, scatters.size)
    precision = _precision(own, memory)
    linear, squares, determinant = _least_squares(precision, products, columns.shape[-1])
    for _ in range(ROUNDS if np.any(places.x_std > 0.0) else 0):
        steepness = linear @ np.swapaxes(slopes, 1, 2)
        precision = _precision(own + (steepness * places.x_std) ** 2, memory)
        linear, squares, determinant = _least_squares(precision, products, columns.shape[-1])
    likelihood = np.log(np.repeat(ALIKE, scatters.size)) - 0.5 * (
        squares + precision.log_determinant
    )
    linear[..., 0] += middle
    return Fitted(np.max(likelihood, axis=1), likelihood - 0.5 * determinant, linear)


class _Precision(NamedTuple):
    """The inverse covariance of scatter that remembers the place before, and -ln of its determinant, with 2π.

    It has two diagonals: `own` and `next`, (..., scatters, places) each, the second that of a
    place and the one before.
    """

    own: Field
    next: Field
    log_determinant: Field


def _precision(variance: Field, memory: Field) -> _Precision:
    """Of scatter of a variance (..., scatters, places), each with a memory (scatters,)."""
    fresh = 1.0 - memory[:, None] ** 2
    inside = np.ones(variance.shape[-1])
    inside[[0, -1]] = 0.0
    own = (1.0 + memory[:, None] ** 2 * inside) / fresh / variance
    following = -memory[:, None] / fresh / np.sqrt(variance * _before(variance, first=np.inf))
    of_memory = (variance.shape[-1] - 1) * np.log(fresh[:, 0])
    return _Precision(own, following, np.sum(np.log(2.0 * np.pi * variance), axis=-1) + of_memory)


def _before(values: Field, first: float = 0.0) -> Field:
    """At each place what is at the one before, along the last axis."""
    shifted = np.roll(values, 1, axis=-1)
    shifted[..., 0] = first
    return shifted


def _products(columns: Field, y: Field) -> Field:
    """Of each column with each and with y, at a place and across to the one before; (bends, pairs, 2 places)."""
    bends, places, size = columns.shape
    whole = np.concatenate([np.moveaxis(columns, 2, 0), np.broadcast_to(y, (1, bends, places))])
    behind = _before(whole)
    pairs = [*zip(*np.triu_indices(size + 1), strict=True)]
    products = np.empty((bends, len(pairs), 2 * places))
    for number, (one, other) in enumerate(pairs):
        np.multiply(whole[one], whole[other], out=products[:, number, :places])
        products[:, number, places:] = whole[one] * behind[other] + whole[other] * behind[one]
    return products


def _least_squares(precision: _Precision, products: Field, size: int) -> tuple[Field, Field, Field]:
    """What `size` columns fit best (bends, scatters, linear), the squares left, ln det of their information.

    By elimination in all normal equations together, y's row the last: LAPACK takes thousands of so
    small ones in turn.
    """
    found = products @ np.swapaxes(np.concatenate([precision.own, precision.next], axis=-1), -1, -2)
    rows = np.empty((size + 1, size + 1, found.shape[0], found.shape[2]))
    for number, (one, other) in enumerate(zip(*np.triu_indices(size + 1), strict=True)):
        rows[one, other] = rows[other, one] = found[:, number]
    diagonal = np.arange(size)
    rows[diagonal, diagonal] += 1e-12 * np.sum(rows[diagonal, diagonal], axis=0)
    for i in range(size):
        for j in range(i + 1, size + 1):
            rows[j, i + 1 :] -= rows[j, i] / rows[i, i] * rows[i, i + 1 :]
    linear = np.empty((*rows.shape[2:], size))
    for i in reversed(range(size)):
        known = sum(
            (rows[i, j] * linear[..., j] for j in range(i + 1, size)),
            start=np.zeros(rows.shape[2:]),
        )
        linear[..., i] = (rows[i, size] - known) / rows[i, i]
    return linear, rows[size, size], np.sum(np.log(rows[diagonal, diagonal]), axis=0)


def sudden_bend(x: Field, crfa: Field, x_std: Field, breaks: Field) -> Field:
    """Logarithm of P(ln CRFA | break), but for a constant: a hinge over a parabola; smooth growth says nothing."""
    known = np.isfinite(crfa) & (crfa > 0.0)
    places = places_of(x[known], np.log(crfa[known]), np.zeros(int(np.sum(known))), x_std[known])
    if places.x.size < FEWEST_PLACES:
        return np.zeros(breaks.size)

    def model(k: Field, at: Places) -> tuple[Field, Field]:
        stick, sloped = _stick(k, at)
        x = stick[..., 1:2]
        return np.concatenate([stick, x**2], axis=-1), np.concatenate([sloped, 2.0 * x], axis=-1)

    candidate = _Candidate("ln CRFA", breaks, model, 5)
    return log_sum(_fit(candidate, places, _scatters(places)).marginal)


def after_break(x: Field, x_std: Field, breaks: Field, density: Field) -> Field:
    """Probability that each recording's true x lies beyond the break."""
    blur = np.maximum(x_std, 1e-12)
    return np.asarray(scipy.special.ndtr((x[:, None] - breaks[None, :]) / blur[:, None]) @ density)


def log_sum(marginal: Field) -> Field:
    """Over the scatters, all but the least of them evenly spaced in their logarithm, and their memories."""
    top = np.max(marginal, axis=1, keepdims=True)
    return np.asarray(np.log(np.sum(np.exp(marginal - top), axis=1)) + top[:, 0])


def quantiles(
    breaks: Field, density: Field, wanted: tuple[float, float, float]
) -> tuple[float, float, float]:
    """Breaks below which these shares of the density lie."""
    cumulative = np.concatenate([[0.0], np.cumsum(density)])
    step = breaks[1] - breaks[0]
    edges = np.concatenate([breaks - step / 2.0, [breaks[-1] + step / 2.0]])
    low, middle, high = np.interp(wanted, cumulative, edges)
    return float(low), float(middle), float(high)
