"""Result of a sensitivity analysis: effects of factors on outcomes, and the sample."""

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
import pandas

from asperity.case import Case
from asperity.core.quantities import quantity
from asperity.study.calibration_result import as_json
from asperity.study.ranges import ParameterRange
from asperity.study.result import StudyResult
from asperity.study.sensitivity_indices import SensitivityMethod

RANKED_BY: dict[SensitivityMethod, str] = {"morris": "mu_star", "sobol": "st"}
FACTOR_KEYS = ("key", "low", "high", "unit", "log", "reason")


class SensitivityOutcome(NamedTuple):
    """An outcome of the design: a quantity at one Sq [m], or of the whole curve (Sq is nan)."""

    name: str
    quantity: str
    sq: float


@dataclass(frozen=True)
class Sensitivity:
    """Sensitivity of a wear study's curves to the factors varied.

    Parameters
    ----------
    case, method : the case studied and the method used
    ranges : of the factors, in order; the seed of the surface follows if the case has one
    factors : their names, including the seed
    outcomes : the outcomes evaluated
    effects : one row per outcome and factor. Morris: `mu_star`, mean absolute effect of crossing
        the whole range, in the outcome's unit; `mu`, the signed mean; `sigma`, its standard
        deviation over the positions of the other factors; `mu_star_conf`. Sobol: `s1`, first-order
        share of the outcome's variance; `st`, total share with interactions; `s1_conf`, `st_conf`.
        Intervals are half-widths at 95 %. `share`: fraction of the sum of mu_star or st
    values : one row per point: each factor's share of its range, then every outcome
    left_out : number of points in blocks with a failed contact
    distinct : fraction of points whose curve has a distinct stage by `split_stages`; nan if not
        evaluated
    full_film_share : fraction of contacts in full film, without a resonance: their CRF counts as
        that of a CLR of 1 %, their CRFA as the lowest found
    result : the underlying study
    """

    case: Case
    method: SensitivityMethod
    ranges: tuple[ParameterRange, ...]
    factors: tuple[str, ...]
    outcomes: tuple[SensitivityOutcome, ...]
    effects: pandas.DataFrame
    values: pandas.DataFrame
    left_out: int
    distinct: float
    full_film_share: float
    result: StudyResult

    @property
    def measure(self) -> str:
        """Name of the column of `effects` that ranks factors."""
        return RANKED_BY[self.method]

    def ranking(self, outcome: str) -> pandas.DataFrame:
        """Return the rows of `effects` of one outcome, the most influential factor first."""
        rows = self.effects[self.effects["outcome"] == outcome]
        return rows.sort_values(self.measure, ascending=False, kind="stable", ignore_index=True)

    def spread(self, outcome: str) -> tuple[float, float]:
        """Return the 5th and 95th percentile of an outcome over the sample."""
        low, high = np.nanpercentile(self.values[outcome], (5.0, 95.0))
        return float(low), float(high)

    def overall(self) -> "pandas.Series[float]":
        """Return the mean share of each factor over the outcomes that vary, the largest first."""
        varies = self.effects.groupby("outcome")["share"].transform("sum") > 0.0
        shares = (
            (self.effects[varies] if varies.any() else self.effects)
            .groupby("factor", sort=False)["share"]
            .mean()
        )
        return shares.sort_values(ascending=False, kind="stable")

    def verdict(self) -> str:
        """Return the ranges of CAR, CLR and CRF and the shares of the factors."""
        parts = []
        for entry in map(quantity, ("car", "clr", "crf_hz")):
            outcomes = [outcome for outcome in self.outcomes if outcome.quantity == entry.key]
            if outcomes:
                widest = max(
                    outcomes,
                    key=lambda outcome: float(np.subtract(*self.spread(outcome.name)[::-1])),
                )
                low, high = (entry.factor * end for end in self.spread(widest.name))
                first = self.ranking(widest.name).iloc[0]
                cause = first["factor"] if first["share"] > 0.0 else "none of them"
                span = f"from {low:.0f} to {high:.0f} {entry.display}"
                parts.append(
                    f"{entry.symbol} at Sq {1e6 * widest.sq:g} um {span} (main factor: {cause})"
                )
        order = self.overall()
        ranked = ", ".join(f"{name} {100 * share:.0f} %" for name, share in order.items())
        return (
            f"Over the ranges (5 to 95 % of {len(self.values)} points): {'; '.join(parts)}. "
            f"Mean share of each factor: {ranked}."
        )

    def scalars(self) -> dict[str, Any]:
        """Return the JSON output of `asperity sensitivity`, in SI units."""
        intervals = {outcome.name: self.spread(outcome.name) for outcome in self.outcomes}
        return {
            "verdict": self.verdict(),
            "method": self.method,
            "factors": [
                {name: getattr(entry, name) for name in FACTOR_KEYS} for entry in self.ranges
            ],
            "points": len(self.values),
            "cases": len(self.result.plan.cases),
            "failed": self.result.failed,
            "left_out": self.left_out,
            "silent": self.full_film_share,
            "distinct": as_json(self.distinct),
            "seconds": self.result.seconds,
            "outcomes": [
                {
                    "outcome": outcome.name,
                    "quantity": outcome.quantity,
                    "sq_m": as_json(outcome.sq),
                    "p05": intervals[outcome.name][0],
                    "p95": intervals[outcome.name][1],
                    "effects": [
                        {key: as_json(value) for key, value in row.items()}
                        for row in self.ranking(outcome.name)
                        .drop(columns=["outcome", "quantity", "sq_m"])
                        .to_dict("records")
                    ],
                }
                for outcome in self.outcomes
            ],
        }
