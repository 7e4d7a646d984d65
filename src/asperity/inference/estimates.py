"""A quantity before and after recordings: median, 90 % interval, and how many bits were learned of it."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from asperity.core.arrays import Field

ENDS = (0.05, 0.5, 0.95)
BINS = 20  # of what was known before, equally probable
LEARNT_FROM_BITS = 0.5  # the interval is then about two thirds of what it was
EDGE = 0.05  # share of a prior at either end, and
CROWDED = 5.0  # how many times as much of the posterior must lie there to lie against the end


@dataclass(frozen=True, slots=True)
class Estimate:
    """Median and ends of the 90 % interval, SI, and what was learned against the prior.

    `against` is "low" or "high" where the posterior lies against an end of its prior, which then
    decides the interval.
    """

    median: float
    low: float
    high: float
    information_bits: float
    against: Literal["", "low", "high"] = ""

    @property
    def learnt(self) -> bool:
        """Whether recordings taught it, or it is as it was assumed."""
        return self.information_bits >= LEARNT_FROM_BITS

    def scalars(self) -> dict[str, Any]:
        """As JSON has it."""
        return {
            "median": self.median,
            "low": self.low,
            "high": self.high,
            "information_bits": self.information_bits,
            "learnt": self.learnt,
            "against": self.against,
        }


def quantity_estimate(
    values: Field, prior: Field, effective: float, *, bounded: bool = False
) -> Estimate:
    """Of equally probable draws after and before, which are worth `effective` independent ones."""
    low, median, high = (float(end) for end in np.quantile(values, ENDS))
    return Estimate(
        median,
        low,
        high,
        information_gain(values, prior, effective),
        _against(values, prior) if bounded else "",
    )


def quantity_estimates(
    after: Mapping[str, Field],
    before: Mapping[str, Field],
    effective: float,
    bounded: frozenset[str],
) -> dict[str, Estimate]:
    """`quantity_estimate` of several quantities by their keys."""
    return {
        key: quantity_estimate(after[key], before[key], effective, bounded=key in bounded)
        for key in after
    }


def information_gain(values: Field, prior: Field, effective: float) -> float:
    """Kullback and Leibler's information of the posterior over the prior, in bits; 0 where chance makes as much.

    By histogram over classes that were equally probable before, less what so few draws make of
    nothing (Miller and Madow).
    """
    ordered = np.sort(prior)
    inner = np.quantile(ordered, np.linspace(0.0, 1.0, BINS + 1)[1:-1])
    edges: Field = np.unique(inner)
    places = edges.size + 1
    after = np.bincount(np.searchsorted(edges, values, side="right"), minlength=places) / len(
        values
    )
    before = np.bincount(np.searchsorted(edges, prior, side="right"), minlength=places) / len(prior)
    told = after > 0.0
    found = float(np.sum(after[told] * np.log2(after[told] / np.maximum(before[told], 1e-12))))
    by_chance = (int(np.count_nonzero(told)) - 1) / (2.0 * effective * math.log(2.0))
    return max(float(found - by_chance), 0.0)


def _against(values: Field, prior: Field) -> Literal["", "low", "high"]:
    low, high = np.quantile(prior, (EDGE, 1.0 - EDGE))
    if float(np.mean(values < low)) > CROWDED * EDGE:
        return "low"
    return "high" if float(np.mean(values > high)) > CROWDED * EDGE else ""
