"""Priors of unknown quantities as maps from a standard normal number z.

Samplers and proposals then only deal with the standard normal distribution.
"""

import math
from dataclasses import dataclass

import numpy as np
from scipy.special import ndtr, ndtri

from asperity.case import to_si
from asperity.core.arrays import Field
from asperity.study import ParameterRange

REACH = 3.5  # half-width of the range of a stated value, in standard deviations
END = 1e-6  # distance kept from the ends of a range, where z is infinite


@dataclass(frozen=True, slots=True)
class Unknown:
    """An unknown quantity: its key, its range and its prior.

    Parameters
    ----------
    key : in the catalogue of quantities, such as "sq_m"
    range : case key and ends; without `std`, the prior is uniform in the share of the range
    mean, std : of a stated value, in the range's unit; normal, or lognormal if that would reach 0
    """

    key: str
    range: ParameterRange
    mean: float = math.nan
    std: float = math.nan

    @classmethod
    def stated(
        cls, key: str, case_key: str, mean: float, std: float, unit: str, reason: str = ""
    ) -> "Unknown":
        """Return an unknown with a stated value and standard deviation."""
        if mean - REACH * std > 0.0 or mean <= 0.0:
            low = mean - REACH * std
            high = mean + REACH * std
        else:
            width = REACH * math.sqrt(math.log1p((std / mean) ** 2))
            low = mean * math.exp(-width)
            high = mean * math.exp(width)
        return cls(key, ParameterRange(case_key, low, high, unit, reason), mean, std)

    @property
    def bounded(self) -> bool:
        """True if the prior is uniform over the range."""
        return math.isnan(self.std)

    def in_unit(self, z: Field) -> Field:
        """Return the values at z in the range's unit; any shape."""
        low = self.range.low
        high = self.range.high
        if self.bounded:
            share = ndtr(z)
            return np.asarray(
                low * (high / low) ** share if self.range.log else low + share * (high - low)
            )
        if self.mean - REACH * self.std > 0.0 or self.mean <= 0.0:
            values = self.mean + self.std * z
        else:
            values = self.mean * np.exp(z * math.log(high / self.mean) / REACH)
        return np.asarray(np.clip(values, low, high))

    def at_share(self, share: Field) -> Field:
        """Return the z of a share of the range, the inverse of `share`."""
        share = np.clip(share, END, 1.0 - END)
        if self.bounded:
            return np.asarray(ndtri(share))
        low = self.range.low
        high = self.range.high
        value = low * (high / low) ** share if self.range.log else low + share * (high - low)
        if self.mean - REACH * self.std > 0.0 or self.mean <= 0.0:
            return np.asarray((value - self.mean) / self.std)
        return np.asarray(np.log(value / self.mean) * REACH / math.log(high / self.mean))

    def value(self, z: Field) -> Field:
        """Return the values at z in SI."""
        return self.to_si(self.in_unit(z))

    def to_si(self, values: Field) -> Field:
        """Convert values from the range's unit to SI."""
        zero, unit = (si(number, self.range.unit) for number in (0.0, 1.0))
        return np.asarray(zero + (unit - zero) * values)

    def from_si(self, values: Field | float) -> Field:
        """Convert values from SI to the range's unit."""
        zero, unit = (si(number, self.range.unit) for number in (0.0, 1.0))
        return np.asarray((np.asarray(values) - zero) / (unit - zero))

    def share(self, z: Field) -> Field:
        """Return the share of the range, 0 to 1, of the values at z, the emulator's input."""
        return share_of(self.range, self.in_unit(z))


def share_of(entry: ParameterRange, values: Field) -> Field:
    """Return the shares of a range at `values` in its unit; see `ParameterRange.share`."""
    if entry.log:
        return np.asarray(np.log(values / entry.low) / math.log(entry.high / entry.low))
    return np.asarray((values - entry.low) / (entry.high - entry.low))


def si(number: float, unit: str) -> float:
    """Convert a number with a unit of a case file to SI."""
    return float(to_si(f"{number!r} {unit}")) if unit else number
