"""What a calibration found: values with their open ends, directions, trade-offs, and the curves behind them."""

import math
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np
import pandas

from asperity.case import Case
from asperity.core.arrays import Field
from asperity.paper import Anchor
from asperity.study.curve import WearCurve
from asperity.study.ranges import ParameterRange

# share of a range's variance that the anchors must take away from a quantity to determine it
LEARNT_FROM = 0.5


class CalibratedParameter(NamedTuple):
    """A quantity that was free: what was found, and how well the anchors determine it.

    `low` and `high` are one standard deviation either way, the range searched counting as what was
    known before, and the whole range where the anchors do not determine the quantity; `learnt` is
    how much of the range's variance they took away, 0 nothing, 1 all.
    """

    range: ParameterRange
    start: float | None
    value: float
    low: float
    high: float
    std_share: float
    learnt: float
    at_end: bool

    @property
    def identifiable(self) -> bool:
        """Whether the anchors determine it, rather than the range."""
        return self.learnt >= LEARNT_FROM


class ParameterDirection(NamedTuple):
    """A direction in the space of shares: `weights` of the quantities, how far the anchors let it go (in ranges)."""

    weights: tuple[float, ...]
    std: float
    determined: bool


class TradeOff(NamedTuple):
    """What the others would gain if one anchor were given up: by slopes, so for small steps only.

    `misfit` of the others (sum of squared misses in tolerances) would go to `without`; `relieved`
    would gain most, its miss in tolerances going from `miss` to `miss_without`.
    """

    given_up: str
    misfit: float
    without: float
    relieved: str
    miss: float
    miss_without: float


@dataclass(frozen=True)
class Calibration:
    """What best meets the anchors, and what that leaves open.

    Parameters
    ----------
    case : as given, on the cells of the fit
    calibrated : the case with what was found, on its own cells, ready for `asperity study`
    anchors : all of them; `aimed_at` are those that decided
    parameters : of the free quantities, in order
    correlation : shape (parameters, parameters)
    directions : of the free quantities, the best determined first
    trade_offs : the dearest anchor first
    start, fit, check : as `compare_with_anchors` has it. `check` is on the case's own cells, with surfaces that the fit
        has not seen; `low` and `high` are 90 % intervals over seeds
    misfit, start_misfit : sums of squared misses in tolerances
    evaluations, cases : parameter sets tried, contacts solved or found in the folder
    failed : contacts that failed or did not converge, and were left out
    seconds : it took
    """

    case: Case
    calibrated: Case
    anchors: tuple[Anchor, ...]
    parameters: tuple[CalibratedParameter, ...]
    correlation: Field
    directions: tuple[ParameterDirection, ...]
    trade_offs: tuple[TradeOff, ...]
    start: pandas.DataFrame
    fit: pandas.DataFrame
    check: pandas.DataFrame
    start_misfit: float
    misfit: float
    evaluations: int
    cases: int
    failed: int
    seconds: float
    start_curve: WearCurve = field(repr=False)
    curve: WearCurve = field(repr=False)
    check_curve: WearCurve = field(repr=False)

    @property
    def aimed_at(self) -> tuple[Anchor, ...]:
        """The anchors that decided."""
        return tuple(anchor for anchor in self.anchors if anchor.fitted)

    @property
    def unidentifiable(self) -> tuple[str, ...]:
        """Quantities that the anchors do not determine."""
        return tuple(
            parameter.range.key for parameter in self.parameters if not parameter.identifiable
        )

    def verdict(self) -> str:
        """What was found, what it meets, what cannot be met together and what stays open."""
        aimed = {anchor.name for anchor in self.aimed_at}
        met = self.fit[self.fit["anchor"].isin(aimed)]
        missed = [
            f"{row.anchor} ({row.ours:.4g} for {row.printed:g})"
            for row in met[~met["met"]].itertuples()
        ]
        values = ", ".join(
            f"{p.range.key} {p.value:.3g} {p.range.unit}".rstrip() for p in self.parameters
        )
        sentence = f"{int(met['met'].sum())} of {len(met)} anchors are met within their tolerances with {values}"
        sentence += f"; missed: {', '.join(missed)}." if missed else "."
        if self.unidentifiable:
            sentence += f" Not determined by the anchors: {', '.join(self.unidentifiable)}."
        ends = [p.range.key for p in self.parameters if p.at_end]
        if ends:
            sentence += f" At the end of the range: {', '.join(ends)}."
        return sentence

    def scalars(self) -> dict[str, Any]:
        """What `asperity calibrate --json` prints; None where there is none."""

        def rows(table: pandas.DataFrame) -> list[dict[str, Any]]:
            return [
                {str(key): as_json(value) for key, value in row.items()}
                for row in table.to_dict("records")
            ]

        names = ("start", "value", "low", "high", "std_share", "learnt", "identifiable", "at_end")
        return {
            "verdict": self.verdict(),
            "parameters": [
                {
                    "key": p.range.key,
                    "unit": p.range.unit,
                    "searched": [p.range.low, p.range.high],
                    **{name: getattr(p, name) for name in names},
                }
                for p in self.parameters
            ],
            "correlation": self.correlation.tolist(),
            "directions": [
                {
                    "weights": dict(
                        zip((p.range.key for p in self.parameters), d.weights, strict=True)
                    ),
                    "std": as_json(d.std),
                    "determined": d.determined,
                }
                for d in self.directions
            ],
            "trade_offs": [trade._asdict() for trade in self.trade_offs],
            "misfit": self.misfit,
            "start_misfit": self.start_misfit,
            **{name: rows(getattr(self, name)) for name in ("start", "fit", "check")},
            **{name: getattr(self, name) for name in ("evaluations", "cases", "failed", "seconds")},
        }


def as_json(value: Any) -> Any:
    """A value of a table as JSON holds it: None for nan and infinity."""
    if isinstance(value, np.generic):
        value = value.item()
    return None if isinstance(value, float) and not math.isfinite(value) else value
