"""What is known of a quantity before any recording, as a standard normal number.

Every prior is a map from such a number z, so that samplers and proposals need to know one
distribution only.
"""

import math
from dataclasses import dataclass

import numpy as np
from scipy.special import ndtr, ndtri

from asperity.case import to_si
from asperity.core.arrays import Field
from asperity.study import ParameterRange

REACH = 3.5  # standard deviations of a stated value that its range goes to
END = 1e-6  # share of a range from its ends, where a normal number is infinite


@dataclass(frozen=True, slots=True)
class Unknown:
    """A quantity that is not known: its key in the catalogue, its range, and what is known of it within.

    Parameters
    ----------
    key : in the catalogue of quantities, such as "sq_m"
    range : case key and ends; without `std`, every share of the way is as probable as any other
    mean, std : of a stated value, in the range's unit; normal, or lognormal where that would reach 0
    """

    key: str
    range: ParameterRange
    mean: float = math.nan
    std: float = math.nan

    @classmethod
    def stated(
        cls, key: str, case_key: str, mean: float, std: float, unit: str, reason: str = ""
    ) -> "Unknown":
        """A value with its standard deviation."""
        if mean - REACH * std > 0.0 or mean <= 0.0:
            low, high = mean - REACH * std, mean + REACH * std
        else:
            width = REACH * math.sqrt(math.log1p((std / mean) ** 2))
            low, high = mean * math.exp(-width), mean * math.exp(width)
        return cls(key, ParameterRange(case_key, low, high, unit, reason), mean, std)

    @property
    def bounded(self) -> bool:
        """Whether its range is all that is known."""
        return math.isnan(self.std)

    def in_unit(self, z: Field) -> Field:
        """Values at z in the range's unit; any shape."""
        low, high = self.range.low, self.range.high
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
        """The z at which its value lies so far along its range: the inverse of `share`, within the range."""
        share = np.clip(share, END, 1.0 - END)
        if self.bounded:
            return np.asarray(ndtri(share))
        low, high = self.range.low, self.range.high
        value = low * (high / low) ** share if self.range.log else low + share * (high - low)
        if self.mean - REACH * self.std > 0.0 or self.mean <= 0.0:
            return np.asarray((value - self.mean) / self.std)
        return np.asarray(np.log(value / self.mean) * REACH / math.log(high / self.mean))

    def value(self, z: Field) -> Field:
        """Values at z, SI."""
        return self.to_si(self.in_unit(z))

    def to_si(self, values: Field) -> Field:
        """Values of the range's unit in SI."""
        zero, one = (si(number, self.range.unit) for number in (0.0, 1.0))
        return np.asarray(zero + (one - zero) * values)

    def from_si(self, values: Field | float) -> Field:
        """Values in SI in the range's unit."""
        zero, one = (si(number, self.range.unit) for number in (0.0, 1.0))
        return np.asarray((np.asarray(values) - zero) / (one - zero))

    def share(self, z: Field) -> Field:
        """How far along its range, 0 to 1, the values at z lie: what an emulator is asked by."""
        return share_of(self.range, self.in_unit(z))


def share_of(entry: ParameterRange, values: Field) -> Field:
    """`ParameterRange.share` of many values, in the range's unit."""
    if entry.log:
        return np.asarray(np.log(values / entry.low) / math.log(entry.high / entry.low))
    return np.asarray((values - entry.low) / (entry.high - entry.low))


def si(number: float, unit: str) -> float:
    """A number with a unit of a case file, in SI."""
    return float(to_si(f"{number!r} {unit}")) if unit else number
