"""Result of a calibration: values with intervals, directions, trade-offs and wear curves."""

import math
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np
import pandas

from asperity.case import Case
from asperity.core.arrays import Field
from asperity.paper import Anchor
from asperity.study.curve import WearCurve
from asperity.study.evaluate import Row
from asperity.study.ranges import ParameterRange

LEARNT_FROM = 0.5  # fraction of prior variance removed from which on a quantity is identifiable


class CalibratedParameter(NamedTuple):
    """A calibrated quantity and its uncertainty.

    `low` and `high` are one standard deviation either side of `value` with the searched range as
    prior, or the whole range if the quantity is not identifiable; `learnt` is the fraction of the
    prior variance that the anchors remove, 0 to 1.
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
        """True if the anchors, not the range, determine the quantity."""
        return self.learnt >= LEARNT_FROM


class ParameterDirection(NamedTuple):
    """A direction in the space of shares: `weights` of the quantities, standard deviation."""

    weights: tuple[float, ...]
    std: float
    determined: bool


class TradeOff(NamedTuple):
    """Effect of dropping one anchor on the fit of the others, linearised.

    The `misfit` of the others (sum of squared residuals in tolerances) would drop to `without`;
    `relieved` would gain most, its residual changing from `miss` to `miss_without`.
    """

    given_up: str
    misfit: float
    without: float
    relieved: str
    miss: float
    miss_without: float


@dataclass(frozen=True)
class Calibration:
    """Values that best meet the anchors, and their uncertainty.

    Parameters
    ----------
    case : as given, on the cells of the fit
    calibrated : the case with the fitted values, on its own cells, ready for `asperity study`
    anchors : all of them; `aimed_at` are the fitted ones
    parameters : of the free quantities, in order
    correlation : shape (parameters, parameters)
    directions : of the free quantities, the best determined first
    trade_offs : the most costly anchor first
    start, fit, check : from `compare_with_anchors`. `check` uses the case's own cells and surfaces
        not used in the fit; `low` and `high` are intervals over seeds
    misfit, start_misfit : sums of squared residuals in tolerances
    evaluations, cases : parameter sets tried, contacts solved or read from the folder
    failed : contacts that failed or did not converge, left out
    seconds : computing time
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
        """The anchors that were fitted."""
        return tuple(anchor for anchor in self.anchors if anchor.fitted)

    @property
    def unidentifiable(self) -> tuple[str, ...]:
        """Quantities that the anchors do not determine."""
        return tuple(
            parameter.range.key for parameter in self.parameters if not parameter.identifiable
        )

    def verdict(self) -> str:
        """Return the values found, the anchors met and missed, and the undetermined quantities."""
        targets = {anchor.name for anchor in self.aimed_at}
        fitted = self.fit[self.fit["anchor"].isin(targets)]
        missed = [
            f"{row.anchor} ({row.ours:.4g} for {row.printed:g})"
            for row in fitted[~fitted["met"]].itertuples()
        ]
        values = ", ".join(
            f"{p.range.key} {p.value:.3g} {p.range.unit}".rstrip() for p in self.parameters
        )
        count = f"{int(fitted['met'].sum())} of {len(fitted)}"
        sentence = f"{count} anchors are met within their tolerances with {values}"
        sentence += f"; missed: {', '.join(missed)}." if missed else "."
        if self.unidentifiable:
            sentence += f" Not determined by the anchors: {', '.join(self.unidentifiable)}."
        at_limits = [p.range.key for p in self.parameters if p.at_end]
        if at_limits:
            sentence += f" At the end of the range: {', '.join(at_limits)}."
        return sentence

    def scalars(self) -> dict[str, Any]:
        """Return the JSON output of `asperity calibrate`."""

        def rows(table: pandas.DataFrame) -> list[Row]:
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


def as_json(value: object) -> Any:
    """Convert a table entry to JSON: None for nan and infinity."""
    if isinstance(value, np.generic):
        value = value.item()
    return None if isinstance(value, float) and not math.isfinite(value) else value
