"""Johnson's curves: turn a standard normal height into one of wanted skewness and kurtosis.

SU: sinh(z/d + s) for heavy tails, SB: 1/(1 + exp(s - z/d)) for light ones; between them they reach
every pair of moments that a distribution can have. Mirrored for negative skewness.
"""

from collections.abc import Callable
from functools import cache

import numpy as np
import scipy

from asperity.core.arrays import Field

Curve = Callable[[Field], Field]
_BINS = 512
_MOMENTS = 40  # terms of the polynomial of correlations


def _su(z: Field, spread: float, shift: float) -> Field:
    return np.asarray(np.sinh(z / spread + shift) / np.cosh(shift))


def _sb(z: Field, spread: float, shift: float) -> Field:
    return np.asarray(1.0 / (1.0 + np.exp(shift - z / spread)))


def histogram(heights: Field) -> tuple[Field, Field]:
    """Heights and their shares: a stand-in for a large sample that has its moments to about 1e-4."""
    shares, edges = np.histogram(heights, bins=_BINS)
    return (edges[1:] + edges[:-1]) / 2.0, shares / heights.size


def fit(
    z: Field, shares: Field, skewness: float, kurtosis: float
) -> tuple[Curve, tuple[float, float]]:
    """The curve that gives heights z with those shares the two moments, and the moments it gives."""
    side = -1.0 if skewness < 0.0 else 1.0
    z, wanted = side * z, np.array([abs(skewness), kurtosis])
    with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
        heavy, light = (_nearest(family, z, shares, wanted) for family in (_su, _sb))
        family, (_, spread, shift) = (_su, heavy) if heavy[0] <= light[0] else (_sb, light)
        reached = _moments(family(z, spread, shift), shares)

    def curve(heights: Field) -> Field:
        return np.asarray(side * family(side * heights, spread, shift))

    return curve, (side * float(reached[0]), float(reached[1]))


def _nearest(
    family: Callable[[Field, float, float], Field], z: Field, shares: Field, wanted: Field
) -> tuple[float, float, float]:
    """Misfit, spread and shift of the family's best curve: the best of a coarse net, refined."""

    def misfit(parameters: Field) -> Field:
        reached = _moments(family(z, float(np.exp(parameters[0])), float(parameters[1])), shares)
        return np.asarray(
            np.nan_to_num((reached - wanted) / np.array([1.0, wanted[1]]), nan=1e3, posinf=1e3)
        )

    net = [np.array([d, s]) for d in np.linspace(-1.5, 3.5, 11) for s in np.linspace(0.0, 5.0, 9)]
    start = min(net, key=lambda parameters: float(np.sum(misfit(parameters) ** 2)))
    nearest = scipy.optimize.least_squares(misfit, start, bounds=([-3.0, -1.0], [6.0, 20.0]))
    return float(nearest.cost), float(np.exp(nearest.x[0])), float(nearest.x[1])


@cache
def stretch(skewness: float, kurtosis: float) -> float:
    """How much longer the Gaussian autocorrelation must be, for the translated one to fall to 1/e where it would.

    The translated heights correlate as sum c_n^2 rho^n / sum c_n^2, c_n the curve's Hermite
    coefficients.
    """
    nodes, weights = np.polynomial.hermite_e.hermegauss(120)
    weights = weights / weights.sum()
    z = np.linspace(-6.0, 6.0, _BINS)
    shares = np.exp(-(z**2) / 2.0)
    curve, _ = fit(z, shares / shares.sum(), skewness, kurtosis)
    heights = curve(np.clip(nodes, -8.0, 8.0))
    polynomials = [np.ones_like(nodes), nodes]  # normalised: E[p_m p_n] = 1 for m = n, else 0
    for n in range(1, _MOMENTS):
        polynomials.append(
            (nodes * polynomials[n] - np.sqrt(n) * polynomials[n - 1]) / np.sqrt(n + 1.0)
        )
    powers = np.array([np.sum(weights * heights * p) ** 2 for p in polynomials[1:]])
    powers /= powers.sum()
    orders = np.arange(1, powers.size + 1)
    rho = float(
        scipy.optimize.brentq(lambda r: float(np.sum(powers * r**orders)) - np.exp(-1.0), 1e-6, 1.0)
    )
    return float(1.0 / np.sqrt(-np.log(rho)))


def _moments(heights: Field, shares: Field) -> Field:
    """Skewness and kurtosis."""
    off = heights - np.sum(shares * heights)
    variance = np.sum(shares * off**2)
    return np.array(
        [np.sum(shares * off**3) / variance**1.5, np.sum(shares * off**4) / variance**2]
    )
