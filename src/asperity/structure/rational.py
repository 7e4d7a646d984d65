"""Rational fit of a measured frequency response, with relative errors.

The adaptive Antoulas-Anderson algorithm (Y. Nakatsukasa, O. Sète and L. N. Trefethen, SIAM J. Sci.
Comput. 40 (2018) A1494) with every row relative to the measured value. SciPy's errors are relative
to the largest value: antiresonances, which decide where a structure's modes lie with a contact,
would drown in the noise of resonances.
"""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import scipy
from numpy.typing import ArrayLike

from asperity.core.arrays import Field

MAX_TERMS = 40
NOISE_FACTOR = 5.0  # of the error at which the fit stops, on the scatter of neighbouring values
EXACT = 1e-9  # relative error for values without noise
Complex = npt.NDArray[np.complex128]


@dataclass(frozen=True, eq=False)
class RationalFit:
    """Barycentric rational function through `values` at `support`, shape (m,) each."""

    support: Field
    values: Complex
    weights: Complex

    def __call__(self, frequency: complex) -> complex:
        """Return the value at a complex frequency between the supports."""
        terms = self.weights / (frequency - self.support)
        return complex(terms @ self.values / terms.sum())

    def slope(self, frequency: complex) -> complex:
        """Return the derivative over frequency."""
        terms = self.weights / (frequency - self.support)
        changes = (self(frequency) - self.values) / (frequency - self.support)
        return complex(terms @ changes / terms.sum())

    def roots_of(self, values: ArrayLike) -> Complex:
        """Return the zeros of the function with other `values` (m,) at the same supports."""
        count = len(self.support)
        arrow = np.zeros((count + 1, count + 1), dtype=complex)
        arrow[0, 1:] = self.weights * np.asarray(values)
        arrow[1:, 0] = 1.0
        arrow[1:, 1:] = np.diag(self.support)
        unit = np.eye(count + 1)
        unit[0, 0] = 0.0
        roots = scipy.linalg.eigvals(arrow, unit)
        return np.asarray(roots[np.isfinite(roots)])


def rational_fit(frequencies: ArrayLike, values: ArrayLike) -> RationalFit:
    """Fit values at real frequencies (n,) down to their scatter, with at most 40 terms."""
    x, y = np.asarray(frequencies, dtype=float), np.asarray(values, dtype=complex)
    tolerance = max(NOISE_FACTOR * _scatter(y), EXACT)
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
        weights, fitted[free] = _weights(x[free], y[free], x[support], y[support])
        fitted[support] = y[support]
    return RationalFit(x[support], y[support], weights)


def _weights(x: Field, y: Complex, support: Field, values: Complex) -> tuple[Complex, Complex]:
    """Return the weights of least relative error at `x`, and the fitted values there."""
    cauchy = 1.0 / (x[:, None] - support)
    loewner = (y[:, None] - values) * cauchy / np.abs(y)[:, None]
    weights = np.linalg.svd(loewner, full_matrices=False)[2][-1].conj()
    return weights, cauchy @ (weights * values) / (cauchy @ weights)


def _scatter(values: Complex) -> float:
    """Return the relative standard deviation of values about a smooth course."""
    if values.size < 9:
        return 0.0
    fourth = np.abs(np.diff(values, 4)) / np.abs(values[2:-2])
    return float(np.median(fourth) / np.sqrt(70.0))  # of independent errors: 1, 4, 6, 4, 1
