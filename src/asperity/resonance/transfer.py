"""Transfer from the contact to the sensor, common to all recordings of a series.

A power of frequency for the excitation of the line, and a smooth curve for the structure.
`separation` fits it; docs/theory/indicators.md has the equations.
"""

from functools import lru_cache
from typing import NamedTuple

import numpy as np
import scipy

from asperity.core.arrays import Field

SPLINES = 48  # cubic, across the band
DEGREE = 3
POWER_STD = 2.0  # prior standard deviation of the power of frequency
LEVEL_INFORMATION = (
    1e-2  # prior information of the splines' level, which the heights of the lines absorb
)
CACHED_FROM = 32  # frequencies: those of a series' blocks are needed in every step


class Transfer(NamedTuple):
    """Transfer T(f): ln T is linear in `coefficients` of ln f and of splines from `low` to `high`.

    `low` and `high` in Hz; constant beyond them. Without coefficients T = 1.
    """

    low: float = 0.0
    high: float = 0.0
    coefficients: Field = np.zeros(0)

    @property
    def spacing_hz(self) -> float:
        """Spacing of the splines [Hz]; slower changes are followed."""
        return (self.high - self.low) / (SPLINES - DEGREE)

    def columns(self, frequency_hz: Field) -> Field:
        """Return the columns that multiply the coefficients, (frequencies, coefficients)."""
        if not self.coefficients.size:
            return np.zeros((frequency_hz.size, 0))
        if frequency_hz.size < CACHED_FROM:
            return _columns(self.low, self.high, frequency_hz)
        return _cached_columns(self.low, self.high, frequency_hz.tobytes())

    def steepness(self, frequency_hz: Field) -> Field:
        """Return d ln T / d ln f, (frequencies,)."""
        if not self.coefficients.size:
            return np.zeros(frequency_hz.size)
        inside = np.clip(frequency_hz, self.low, self.high)
        bend_slope = _slopes(self.low, self.high)(inside) @ self.coefficients[1:]
        return np.asarray(
            self.coefficients[0] + np.where(inside == frequency_hz, frequency_hz * bend_slope, 0.0)
        )

    def stiffness(self, step_std: float) -> Field:
        """Return the prior information (coefficients, coefficients).

        `step_std` is the prior standard deviation of the difference of neighbouring splines.
        """
        count = self.coefficients.size
        if not count:
            return np.zeros((0, 0))
        information = np.diag([POWER_STD**-2, *[LEVEL_INFORMATION] * (count - 1)])
        information[1:, 1:] += differences(count - 1).T @ differences(count - 1) / step_std**2
        return information


def unit_transfer(low: float, high: float) -> Transfer:
    """Return T = 1 that is free to bend between two frequencies, as initial guess."""
    return Transfer(low, high, np.zeros(1 + SPLINES))


def differences(count: int) -> Field:
    """Return the matrix of differences of neighbouring splines, (count - 1, count)."""
    return np.diff(np.eye(count), axis=0)


@lru_cache(maxsize=4)
def _splines(low: float, high: float) -> scipy.interpolate.BSpline:
    inner = np.linspace(low, high, SPLINES - DEGREE + 1)
    knots = np.concatenate([[low] * DEGREE, inner, [high] * DEGREE])
    return scipy.interpolate.BSpline(knots, np.eye(SPLINES), DEGREE)


@lru_cache(maxsize=4)
def _slopes(low: float, high: float) -> scipy.interpolate.BSpline:
    return _splines(low, high).derivative()


def _columns(low: float, high: float, frequency_hz: Field) -> Field:
    return np.column_stack(
        [np.log(frequency_hz), _splines(low, high)(np.clip(frequency_hz, low, high))]
    )


@lru_cache(maxsize=8)
def _cached_columns(low: float, high: float, frequencies: bytes) -> Field:
    columns = _columns(low, high, np.frombuffer(frequencies))
    columns.flags.writeable = False
    return columns
