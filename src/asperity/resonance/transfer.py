"""What lies between the contact and the sensor: how its line is changed on the way, alike in all recordings.

A power of frequency for what excites the line, and a smooth curve for the structure that passes it
on. How far it is fitted is left to `separation`; docs/theory/indicators.md has the equations.
"""

from functools import lru_cache
from typing import NamedTuple

import numpy as np
import scipy

from asperity.core.arrays import Field

SPLINES = 48  # cubic, across the band
DEGREE = 3
STEEPEST = 2.0  # deviation of the power of frequency
LOOSE = 1e-2  # deviation 10: of what a line's own height takes up
MANY = 32  # frequencies, from which on they are a series' blocks, and asked for in every step


class Transfer(NamedTuple):
    """ln T(f) = `coefficients` times ln f and splines from `low` to `high` [Hz], level beyond; empty for T = 1."""

    low: float = 0.0
    high: float = 0.0
    coefficients: Field = np.zeros(0)

    @property
    def spacing_hz(self) -> float:
        """From spline to spline: what is slower is followed."""
        return (self.high - self.low) / (SPLINES - DEGREE)

    def columns(self, frequency_hz: Field) -> Field:
        """What the coefficients stand at, (frequencies, coefficients)."""
        if not self.coefficients.size:
            return np.zeros((frequency_hz.size, 0))
        if frequency_hz.size < MANY:
            return _columns(self.low, self.high, frequency_hz)
        return _kept_columns(self.low, self.high, frequency_hz.tobytes())

    def steepness(self, frequency_hz: Field) -> Field:
        """The power of frequency that T goes with there, (frequencies,)."""
        if not self.coefficients.size:
            return np.zeros(frequency_hz.size)
        inside = np.clip(frequency_hz, self.low, self.high)
        bent = _slopes(self.low, self.high)(inside) @ self.coefficients[1:]
        return np.asarray(
            self.coefficients[0] + np.where(inside == frequency_hz, frequency_hz * bent, 0.0)
        )

    def stiffness(self, pace: float) -> Field:
        """Information before the data, where neighbouring splines differ by `pace`; (coefficients, coefficients)."""
        count = self.coefficients.size
        if not count:
            return np.zeros((0, 0))
        found = np.diag([STEEPEST**-2, *[LOOSE] * (count - 1)])
        found[1:, 1:] += rises(count - 1).T @ rises(count - 1) / pace**2
        return found


def through(low: float, high: float) -> Transfer:
    """T = 1 for the start, free to bend between two frequencies."""
    return Transfer(low, high, np.zeros(1 + SPLINES))


def rises(count: int) -> Field:
    """From each spline to the next, (count - 1, count)."""
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
def _kept_columns(low: float, high: float, frequencies: bytes) -> Field:
    columns = _columns(low, high, np.frombuffer(frequencies))
    columns.flags.writeable = False
    return columns
