"""Johnson translation of standard normal heights to a given skewness and kurtosis.

SU: sinh(z/d + s) for heavy tails, SB: 1/(1 + exp(s - z/d)) for light ones; together they cover all
possible pairs of moments. The curve is mirrored for negative skewness.
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
    """Return heights and their shares, whose moments equal the sample's to about 1e-4."""
    shares, edges = np.histogram(heights, bins=_BINS)
    return (edges[1:] + edges[:-1]) / 2.0, shares / heights.size


def fit(
    z: Field, shares: Field, skewness: float, kurtosis: float
) -> tuple[Curve, tuple[float, float]]:
    """Fit the translation of heights z with these shares; return the curve and its moments."""
    sign = -1.0 if skewness < 0.0 else 1.0
    z, target = sign * z, np.array([abs(skewness), kurtosis])
    with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
        heavy, light = (_fit_family(family, z, shares, target) for family in (_su, _sb))
        family, (_, spread, shift) = (_su, heavy) if heavy[0] <= light[0] else (_sb, light)
        moments = _moments(family(z, spread, shift), shares)

    def curve(heights: Field) -> Field:
        return np.asarray(sign * family(sign * heights, spread, shift))

    return curve, (sign * float(moments[0]), float(moments[1]))


def _fit_family(
    family: Callable[[Field, float, float], Field], z: Field, shares: Field, target: Field
) -> tuple[float, float, float]:
    """Return cost, spread and shift of the best curve: a grid search, then least squares."""

    def residuals(parameters: Field) -> Field:
        moments = _moments(family(z, float(np.exp(parameters[0])), float(parameters[1])), shares)
        return np.asarray(
            np.nan_to_num((moments - target) / np.array([1.0, target[1]]), nan=1e3, posinf=1e3)
        )

    trials = [
        np.array([d, s]) for d in np.linspace(-1.5, 3.5, 11) for s in np.linspace(0.0, 5.0, 9)
    ]
    start = min(trials, key=lambda parameters: float(np.sum(residuals(parameters) ** 2)))
    best = scipy.optimize.least_squares(residuals, start, bounds=([-3.0, -1.0], [6.0, 20.0]))
    return float(best.cost), float(np.exp(best.x[0])), float(best.x[1])


@cache
def stretch(skewness: float, kurtosis: float) -> float:
    """Return the factor on Gaussian correlation lengths that compensates for the translation.

    The translated heights have the autocorrelation sum c_n^2 rho^n / sum c_n^2 with the Hermite
    coefficients c_n of the curve; it falls to 1/e at the lengths before stretching.
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
    """Return skewness and kurtosis."""
    deviation = heights - np.sum(shares * heights)
    variance = np.sum(shares * deviation**2)
    return np.array(
        [np.sum(shares * deviation**3) / variance**1.5, np.sum(shares * deviation**4) / variance**2]
    )
