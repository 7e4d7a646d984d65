"""Which of the quantities that are left open moves CAR, CLR, CRF and CRFA most, and where the trend's knee lies.

Samples and indices are SALib's (Morris' elementary effects, Sobol's variances), contacts the real
solver's. The surface is a factor too: a uniform variable that picks the realisation. What the
ranges are is `ranges`' business.
"""

import math
from collections.abc import Callable, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass
from itertools import product
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pandas

from asperity.case import Case
from asperity.core.arrays import Field
from asperity.core.errors import AsperityError, BadInput, require_choice, require_positive
from asperity.core.quantities import quantity
from asperity.study.calibration_result import as_json
from asperity.study.evaluate import DONE
from asperity.study.execute import StudyProgress, StudyResult, run_study
from asperity.study.full_film import silent, with_silence
from asperity.study.plan import SEED_KEYS, StudyPlan, plan_points
from asperity.study.ranges import (
    ParameterRange,
    at_cells,
    open_ranges,
    overrides_at,
    parse_range,
    require_ranges,
    stated_value,
)
from asperity.study.sensitivity_indices import (
    FEWEST_BLOCKS,
    SIZES,
    SampleDesign,
    SensitivityMethod,
    indices,
    sample_design,
)
from asperity.trend import FEWEST_STAGE_POINTS, split_stages

SQ_LEVELS = (0.5e-6, 1e-6, 2.5e-6, 4e-6)  # where the paper's curves are read [m]
CURVE_LEVELS = 8  # Sq from the smallest to the largest, for the knee
CELLS = 128
SEED_FACTOR = "seed"  # the factor's name
RANKED_BY: dict[SensitivityMethod, str] = {"morris": "mu_star", "sobol": "st"}
ABOUT = ("outcome", "quantity", "sq_m")  # columns of `effects` that say which outcome
FACTOR_KEYS = ("key", "low", "high", "unit", "log", "reason")
RESERVED = {
    "surface.sq": "it is what the curves run along; give sq",
    "surface.seed": "the surface is a factor by itself",
    "vibration.seed": "it goes with the surface, which is a factor by itself",
    "grid.cells": "they go with the domain; give cells",
}


class SensitivityOutcome(NamedTuple):
    """A number that a point of the design gives: a quantity at one Sq [m], or of the whole curve (Sq is nan)."""

    name: str
    quantity: str
    sq: float


@dataclass(frozen=True)
class Sensitivity:
    """What moves a wear study's curves, and how much.

    Parameters
    ----------
    case, method : what was asked, and how
    ranges : of the factors, in order; the surface's seed comes after them where the case has one
    factors : names, the seed's included
    outcomes : what was looked at
    effects : a row an outcome and factor. Morris: `mu_star`, the mean size of the effect of crossing the whole range,
        in the outcome's unit, `mu` with its sign, `sigma` its standard deviation over the other factors' places,
        `mu_star_conf`. Sobol: `s1`, the share of the outcome's variance that the factor has alone, `st` with all its
        interactions, `s1_conf`, `st_conf`. Intervals are half-widths at 95 %. `share`: of all factors' mu_star or st
    values : a row a point: each factor's share of its range, then every outcome
    left_out : points of blocks in which a contact failed
    distinct : share of the points whose curve has a distinct stage by `split_stages`; nan where it was not asked
    silent : share of contacts with a film too full to resonate, whose CRF counts as that of a load share of 1 %,
        and whose CRFA as the lowest found
    result : the study behind it
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
    silent: float
    result: StudyResult

    @property
    def measure(self) -> str:
        """The column of `effects` that ranks factors."""
        return RANKED_BY[self.method]

    def ranking(self, outcome: str) -> pandas.DataFrame:
        """The rows of `effects` of one outcome, the factor that moves it most first."""
        rows = self.effects[self.effects["outcome"] == outcome]
        return rows.sort_values(self.measure, ascending=False, kind="stable", ignore_index=True)

    def spread(self, outcome: str) -> tuple[float, float]:
        """5th and 95th percentile of an outcome over the sample."""
        low, high = np.nanpercentile(self.values[outcome], (5.0, 95.0))
        return float(low), float(high)

    def overall(self) -> "pandas.Series[float]":
        """Mean share of each factor over the outcomes that move at all, the largest first."""
        moved = self.effects.groupby("outcome")["share"].transform("sum") > 0.0
        shares = (
            (self.effects[moved] if moved.any() else self.effects)
            .groupby("factor", sort=False)["share"]
            .mean()
        )
        return shares.sort_values(ascending=False, kind="stable")

    def verdict(self) -> str:
        """How far the curves can be trusted, in a sentence or two."""
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
                mover = f"most by {first['factor']}" if first["share"] > 0.0 else "by none of them"
                span = f"from {low:.0f} to {high:.0f} {entry.display}"
                parts.append(f"{entry.symbol} at Sq {1e6 * widest.sq:g} um {span} (moved {mover})")
        order = self.overall()
        ranked = ", ".join(f"{name} {100 * share:.0f} %" for name, share in order.items())
        return (
            f"Over the ranges (5 to 95 % of {len(self.values)} points): {'; '.join(parts)}. "
            f"Mean share of what moves them: {ranked}."
        )

    def scalars(self) -> dict[str, Any]:
        """What `asperity sensitivity --json` prints; SI, None where there is none."""
        ends = {outcome.name: self.spread(outcome.name) for outcome in self.outcomes}
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
            "silent": self.silent,
            "distinct": as_json(self.distinct),
            "seconds": self.result.seconds,
            "outcomes": [
                {
                    "outcome": outcome.name,
                    "quantity": outcome.quantity,
                    "sq_m": as_json(outcome.sq),
                    "p05": ends[outcome.name][0],
                    "p95": ends[outcome.name][1],
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


def sensitivity(
    case: Case,
    *,
    vary: Sequence[ParameterRange | str] | None = None,
    method: SensitivityMethod = "morris",
    size: int | None = None,
    sq: Sequence[float] = SQ_LEVELS,
    levels: int = CURVE_LEVELS,
    cells: int | None = CELLS,
    seeds: int = 1,
    sample_seed: int = 0,
    out: str | Path | None = None,
    executor: Executor | None = None,
    workers: int | None = None,
    progress: Callable[[StudyProgress], None] | None = None,
) -> Sensitivity:
    """Find what moves the curves over Sq most.

    Parameters
    ----------
    case : the contact, with roughness whose `surface.sq` can be set
    vary : ranges, or their texts (`parse_range`); by default those that the paper leaves open and the case has
    method : "morris", elementary effects; "sobol", shares of variance, at many times the cost
    size : trajectories of Morris, base samples of Sobol (a power of two); by default 12 and 64. A study has
        size x (factors + 1), or size x (factors + 2), points, each with all levels
    sq : roughness at which the curves are read [m]
    levels : roughness levels from the least to the largest of `sq`, for the knee of CRF; below 7 no knee is looked for
    cells : along each axis of the widest domain; a moved end of the domain takes its cells along, so that their size
        stays. None: the case's own
    seeds : surfaces that each point is the mean of; 1 is what a single surface can tell
    sample_seed : of sample and surfaces
    out : folder that keeps the study and goes on from it
    executor, workers, progress : see `run_study`

    Raises
    ------
    BadInput
        for a range or setting that cannot be used, or without SALib.
    AsperityError
        if contacts failed in all blocks of the sample but one.
    """
    require_choice("method", method, SIZES)
    if seeds < 1:
        raise BadInput(f"seeds must be 1 or more, got {seeds}")
    case = at_cells(case, cells)
    if stated_value(case, "surface.kind") == "flat":
        raise BadInput(f"{case.source}: surface is flat and has no Sq to vary; take a rough one")
    curve = _curve_levels(sq, levels)
    ranges = (
        open_ranges(case)
        if vary is None
        else tuple(parse_range(r) if isinstance(r, str) else r for r in vary)
    )
    require_ranges(case, ranges, RESERVED)
    seeded = [key for key in SEED_KEYS if stated_value(case, key) is not None]
    factors = (*(entry.key for entry in ranges), *([SEED_FACTOR] if seeded else []))
    design = sample_design(method, len(factors), size or SIZES[method], sample_seed)
    study = _Design(case, ranges, tuple(seeded), design, curve, seeds, sample_seed)
    study.require_solvable()
    result = run_study(study.plan(), out=out, executor=executor, workers=workers, progress=progress)
    return _analysed(study, factors, result, sq)


# The study
# -----------------------------------------------------------------------------------------------------------


def _curve_levels(sq: Sequence[float], levels: int) -> tuple[float, ...]:
    """Every Sq to solve at [m]: those asked for, and evenly spaced ones between the ends."""
    if not sq:
        raise BadInput("sensitivity needs at least one Sq to look at, got none")
    for value in sq:
        require_positive("Sq", value, "m")
    if levels < 0:
        raise BadInput(f"levels must be 0 or more, got {levels}")
    between = np.linspace(min(sq), max(sq), levels) if len(sq) > 1 and levels > 1 else np.empty(0)
    return tuple(sorted({float(f"{value:.6g}") for value in (*sq, *between)}))


class _Design(NamedTuple):
    """What is solved: every level of the curve with every surface, at every point of the sample."""

    case: Case
    ranges: tuple[ParameterRange, ...]
    seeded: tuple[str, ...]
    sample: SampleDesign
    curve: tuple[float, ...]
    seeds: int
    sample_seed: int

    def plan(self) -> StudyPlan:
        points = []
        for number, shares in enumerate(self.sample.shares):
            chosen = overrides_at(self.case, self.ranges, shares[: len(self.ranges)])
            for level, surface in product(self.curve, range(self.seeds)):
                drawn = self._drawn(number, float(shares[-1]), surface)
                points.append({**chosen, "surface.sq": f"{1e6 * level:g} um", **drawn})
        return plan_points(self.case, points)

    def require_solvable(self) -> None:
        """Refuse, before anything is solved, ranges of which the case refuses so many points that nothing is left."""
        refused: dict[int, str] = {}
        for number, shares in enumerate(self.sample.shares):
            if number // self.sample.block not in refused:
                try:
                    chosen = overrides_at(self.case, self.ranges, shares[: len(self.ranges)])
                    self.case.with_overrides(chosen).surface()
                except BadInput as refusal:
                    refused[number // self.sample.block] = str(refusal)
        if len(self.sample.shares) // self.sample.block - len(refused) < FEWEST_BLOCKS:
            ranges = ", ".join(map(str, self.ranges))
            raise BadInput(
                f"{len(refused)} blocks of the sample hold contacts that cannot be solved, the first: "
                f"{next(iter(refused.values()))}; narrow the ranges ({ranges[:200]})"
            )

    def _drawn(self, number: int, share: float, surface: int) -> dict[str, int]:
        """The realisation that a share of the seed's range stands for.

        Sobol's shares are all different. Morris' are four, so each trajectory has four
        realisations of its own: its step along the seed is a change of surface drawn anew.
        """
        trajectory = number // self.sample.block if self.sample.method == "morris" else 0
        words = np.random.SeedSequence(
            [self.sample_seed, trajectory, round(share * 2**31), surface]
        )
        drawn = zip(SEED_KEYS, words.generate_state(len(SEED_KEYS)), strict=True)
        return {key: int(word) for key, word in drawn if key in self.seeded}


def _analysed(
    study: _Design, factors: tuple[str, ...], result: StudyResult, sq: Sequence[float]
) -> Sensitivity:
    design, curve = study.sample, study.curve
    shape = (len(design.shares), len(curve), study.seeds)
    curves, silent_share = _curves(result, shape)
    outcomes, columns = _outcomes(curves, sq, curve)
    names = [*factors, *(outcome.name for outcome in outcomes)]
    values = pandas.DataFrame(dict(zip(names, [*design.shares.T, *columns], strict=True)))
    whole = np.isfinite(columns).reshape(len(columns), -1, design.block).all(axis=2)
    if whole.sum(axis=1).min() < FEWEST_BLOCKS:
        first = f"; the first: {result.failures['reason'].iloc[0]}" if result.failed else ""
        raise AsperityError(
            f"too many contacts failed to say what moves the curves{first}; narrow the ranges"
        )
    effects = []
    for outcome, column in zip(outcomes, columns, strict=True):
        measures = indices(design, column)
        ranked = np.maximum(measures[RANKED_BY[design.method]], 0.0)
        total = float(np.sum(ranked))
        about = dict(zip(ABOUT, outcome, strict=True))
        for i, factor in enumerate(factors):
            each = {name: float(measure[i]) for name, measure in measures.items()}
            effects.append(
                {
                    **about,
                    "factor": factor,
                    **each,
                    "share": float(ranked[i]) / total if total > 0.0 else 0.0,
                }
            )
    return Sensitivity(
        case=study.case,
        method=design.method,
        ranges=study.ranges,
        factors=factors,
        outcomes=tuple(outcomes),
        effects=pandas.DataFrame(effects),
        values=values,
        left_out=int(np.count_nonzero(~whole.all(axis=0))) * design.block,
        distinct=_distinct(curves, curve),
        silent=silent_share,
        result=result,
    )


def _curves(result: StudyResult, shape: tuple[int, int, int]) -> tuple[dict[str, Field], float]:
    """Quantities over (points, levels), means over surfaces, nan where one failed; the share in full film."""
    if result.failed == len(result.table):
        raise AsperityError(
            f"no contact could be solved; the first: {result.failures['reason'].iloc[0]}"
        )
    table = result.table.set_index("number").reindex(range(math.prod(shape)))
    done = (table["status"] == DONE).to_numpy()

    def over(values: Field) -> Field:
        return np.asarray(np.where(done, values, np.nan).reshape(shape).mean(axis=2))

    def column(name: str) -> Field:
        return table[name].to_numpy(dtype=float, na_value=np.nan)

    curves = {name: over(column(name)) for name in ("car", "clr")}
    if "full_load_crf_hz" not in table:
        return curves, math.nan
    filled = with_silence(table)
    crfa = filled["crfa"].to_numpy(dtype=float)
    curves["crf_hz"] = over(filled["crf_hz"].to_numpy(dtype=float))
    if np.nanmax(crfa, initial=0.0) > 0.0:
        curves["log10_crfa"] = over(
            np.log10(np.where(crfa == 0.0, np.nanmin(crfa[crfa > 0.0]), crfa))
        )
    return curves, float(np.mean(silent(table)[done]))


def _outcomes(
    curves: dict[str, Field], sq: Sequence[float], curve: Sequence[float]
) -> tuple[list[SensitivityOutcome], list[Field]]:
    outcomes, columns = [], []
    for key, values in curves.items():
        for level in sq:
            outcomes.append(SensitivityOutcome(f"{key} at {1e6 * level:g} um", key, level))
            columns.append(values[:, curve.index(float(f"{level:.6g}"))])
    if "crf_hz" in curves and len(curve) >= FEWEST_STAGE_POINTS:
        outcomes.append(SensitivityOutcome("knee", "knee_m", math.nan))
        columns.append(np.array([knee(np.array(curve), crf) for crf in curves["crf_hz"]]))
    return outcomes, columns


def knee(x: Field, y: Field) -> float:
    """Where the least-squares broken line through (x, y) bends, whether or not the points call for a bend; nan for nan.

    `split_stages` says whether there is a stage. This is the place that it would have, for curves
    with one and without.
    """
    if not np.isfinite(y).all():
        return math.nan
    breaks = np.linspace(x[1], x[-2], 201)
    left = [
        np.linalg.lstsq(
            np.stack([np.ones_like(x), x - x[0], np.maximum(x - at, 0.0)], axis=1), y, rcond=None
        )[1].sum()
        for at in breaks
    ]
    return float(breaks[int(np.argmin(left))])


def _distinct(curves: dict[str, Field], curve: Sequence[float]) -> float:
    if "crf_hz" not in curves or len(curve) < FEWEST_STAGE_POINTS:
        return math.nan
    whole = [crf for crf in curves["crf_hz"] if np.isfinite(crf).all()]
    return float(np.mean([split_stages(curve, crf).found for crf in whole])) if whole else math.nan
