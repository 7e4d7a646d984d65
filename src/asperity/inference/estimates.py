"""Posterior estimates: median, interval and information gain over the prior."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

import numpy as np

from asperity.core.arrays import Field
from asperity.core.coverage import QUANTILES
from asperity.core.documents import JsonObject

BINS = 20  # equally probable bins of the prior
LEARNT_FROM_BITS = 0.5  # information gain at which an interval shrinks to about two thirds
EDGE = 0.05  # fraction of the prior counted as its end
CROWDED = (
    5.0  # ratio of posterior to prior mass at an end from which the prior limits the posterior
)


@dataclass(frozen=True, slots=True)
class Estimate:
    """Median and interval in SI, and information gain over the prior.

    `against` is "low" or "high" if that end of the prior limits the posterior.
    """

    median: float
    low: float
    high: float
    information_bits: float
    against: Literal["", "low", "high"] = ""

    @property
    def learnt(self) -> bool:
        """True if the recordings are informative; False if the prior is essentially unchanged."""
        return self.information_bits >= LEARNT_FROM_BITS

    def scalars(self) -> JsonObject:
        """Return the JSON output of the estimate."""
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
    """Estimate a quantity from posterior and prior draws of `effective` sample size."""
    low, median, high = (float(end) for end in np.quantile(values, QUANTILES))
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
    """Estimate several quantities by key, see `quantity_estimate`."""
    return {
        key: quantity_estimate(after[key], before[key], effective, bounded=key in bounded)
        for key in after
    }


def information_gain(values: Field, prior: Field, effective: float) -> float:
    """Return the Kullback-Leibler divergence of the posterior from the prior in bits, at least 0.

    Computed from a histogram with equally probable bins of the prior, minus the Miller-Madow bias
    of the sample size.
    """
    ordered = np.sort(prior)
    inner = np.quantile(ordered, np.linspace(0.0, 1.0, BINS + 1)[1:-1])
    edges: Field = np.unique(inner)
    bins = edges.size + 1
    after = np.bincount(np.searchsorted(edges, values, side="right"), minlength=bins) / len(values)
    before = np.bincount(np.searchsorted(edges, prior, side="right"), minlength=bins) / len(prior)
    occupied = after > 0.0
    divergence = float(
        np.sum(after[occupied] * np.log2(after[occupied] / np.maximum(before[occupied], 1e-12)))
    )
    bias = (int(np.count_nonzero(occupied)) - 1) / (2.0 * effective * math.log(2.0))
    return max(float(divergence - bias), 0.0)


def _against(values: Field, prior: Field) -> Literal["", "low", "high"]:
    low, high = np.quantile(prior, (EDGE, 1.0 - EDGE))
    if float(np.mean(values < low)) > CROWDED * EDGE:
        return "low"
    return "high" if float(np.mean(values > high)) > CROWDED * EDGE else ""
