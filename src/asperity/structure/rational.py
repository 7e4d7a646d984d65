"""Rational fit of a measured frequency response, with relative errors.

Supports are chosen by the adaptive Antoulas-Anderson algorithm (Y. Nakatsukasa, O. Sète and L. N.
Trefethen, SIAM J. Sci. Comput. 40 (2018) A1494); then numerator and denominator are fitted to all
values by least squares, iterated with the last denominator (C. Sanathanan and J. Koerner, IEEE
Trans. Autom. Control 8 (1963) 56), so that noise at the supports averages out. Errors are relative
to each value: antiresonances, which decide where a structure's modes lie with a contact, would
otherwise drown in the noise of resonances.
"""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import scipy
from numpy.typing import ArrayLike

from asperity.core.arrays import Field

MAX_TERMS = 40
NOISE_FACTOR = 5.0  # of the error at which supports suffice, on the scatter of neighbours
EXACT = 1e-9  # relative error for values without noise
LEAST_SQUARES_FROM = 1e-6  # scatter from which values are fitted, not interpolated
ROUNDS = 20  # of the least squares
Complex = npt.NDArray[np.complex128]


@dataclass(frozen=True, eq=False)
class RationalFit:
    """Rational function Σ a/(x - z) over Σ w/(x - z); supports z, a and w of shape (m,) each."""

    support: Field
    numerator: Complex
    weights: Complex

    def __call__(self, frequency: complex) -> complex:
        """Return the value at a complex frequency between the supports."""
        poles = 1.0 / (frequency - self.support)
        return complex(poles @ self.numerator / (poles @ self.weights))

    def values_at(self, frequencies: Field) -> Complex:
        """Return the values at real frequencies that are no supports, (n,)."""
        poles = 1.0 / (frequencies[:, None] - self.support)
        return np.asarray(poles @ self.numerator / (poles @ self.weights))

    def slope(self, frequency: complex) -> complex:
        """Return the derivative over frequency."""
        poles = 1.0 / (frequency - self.support)
        above, below = poles @ self.numerator, poles @ self.weights
        squared = -(poles**2)
        return complex(
            (squared @ self.numerator * below - above * (squared @ self.weights)) / below**2
        )

    def roots_with(self, factors: ArrayLike) -> Complex:
        """Return the roots of 1 + factor times the function, with a factor at each support."""
        count = len(self.support)
        arrow = np.zeros((count + 1, count + 1), dtype=complex)
        arrow[0, 1:] = self.weights + np.asarray(factors) * self.numerator
        arrow[1:, 0] = 1.0
        arrow[1:, 1:] = np.diag(self.support)
        unit = np.eye(count + 1)
        unit[0, 0] = 0.0
        roots = scipy.linalg.eigvals(arrow, unit)
        return np.asarray(roots[np.isfinite(roots)])


def rational_fit(frequencies: ArrayLike, values: ArrayLike) -> RationalFit:
    """Fit values at real frequencies (n,) down to their scatter, with at most 40 terms."""
    x, y = np.asarray(frequencies, dtype=float), np.asarray(values, dtype=complex)
    scatter = _scatter(y)
    tolerance = max(NOISE_FACTOR * scatter, EXACT)
    free = np.ones(x.size, dtype=bool)
    support: list[int] = []
    weights = np.ones(0, dtype=complex)
    fitted = np.full(x.size, y.mean())
    while len(support) < min(MAX_TERMS, x.size // 2):
        error = np.where(free, np.abs(y - fitted) / np.abs(y), 0.0)
        if support and np.sqrt(np.mean(error**2)) < tolerance:
            break
        support.append(int(np.argmax(error)))
        free[support[-1]] = False
        weights, fitted[free] = _interpolating(x[free], y[free], x[support], y[support])
        fitted[support] = y[support]
    interpolating = RationalFit(x[support], weights * y[support], weights)
    if scatter < LEAST_SQUARES_FROM:
        return interpolating
    return _least_squares(x[free], y[free], interpolating)


def _interpolating(
    x: Field, y: Complex, support: Field, values: Complex
) -> tuple[Complex, Complex]:
    """Return the weights of least relative error at `x`, and the fitted values there."""
    cauchy = 1.0 / (x[:, None] - support)
    loewner = (y[:, None] - values) * cauchy / np.abs(y)[:, None]
    weights = np.linalg.svd(loewner, full_matrices=False)[2][-1].conj()
    return weights, cauchy @ (weights * values) / (cauchy @ weights)


def _least_squares(x: Field, y: Complex, start: RationalFit) -> RationalFit:
    """Return the fit of least relative squares on the supports of another."""
    cauchy = 1.0 / (x[:, None] - start.support)
    weights = start.weights
    numerator = start.numerator
    for _ in range(ROUNDS):
        scale = 1.0 / np.abs(y * (cauchy @ weights))[:, None]
        system = np.hstack([cauchy * scale, -(y[:, None] * cauchy) * scale])
        sizes = np.linalg.norm(system, axis=0)
        solved = np.linalg.svd(system / sizes, full_matrices=False)[2][-1].conj() / sizes
        numerator, weights = np.split(solved / np.abs(solved).max(), 2)
    return RationalFit(start.support, numerator, weights)


def _scatter(values: Complex) -> float:
    """Return the relative standard deviation of values about a smooth course."""
    if values.size < 9:
        return 0.0
    fourth = np.abs(np.diff(values, 4)) / np.abs(values[2:-2])
    return float(np.median(fourth) / np.sqrt(70.0))  # of independent errors: 1, 4, 6, 4, 1
