"""Global sensitivity of CAR, CLR, CRF, CRFA and the knee of CRF to quantities of a case.

Samples and indices come from SALib (Morris' elementary effects, Sobol's variances), contacts from
the solver. The surface is a factor too: a uniform variable selects the realisation. `ranges`
defines the ranges of the factors.
"""

import math
from collections.abc import Callable, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass
from itertools import product
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pandas

from asperity.case import Case
from asperity.core.arrays import Field
from asperity.core.errors import AsperityError, BadInput, require_choice, require_positive
from asperity.study.evaluate import DONE
from asperity.study.execute import StudyProgress, run_study
from asperity.study.full_film import is_full_film, with_full_film_limits
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
from asperity.study.result import StudyResult
from asperity.study.sensitivity_indices import (
    FEWEST_BLOCKS,
    SIZES,
    SampleDesign,
    SensitivityMethod,
    indices,
    sample_design,
)
from asperity.study.sensitivity_result import RANKED_BY, Sensitivity, SensitivityOutcome
from asperity.trend import FEWEST_STAGE_POINTS, split_stages

SQ_LEVELS = (0.5e-6, 1e-6, 2.5e-6, 4e-6)  # Sq at which the paper's curves are read [m]
CURVE_LEVELS = 8  # levels of Sq from the smallest to the largest, for the knee
SEED_FACTOR = "seed"  # name of the factor that selects the surface
OUTCOME_COLUMNS = ("outcome", "quantity", "sq_m")  # columns of `effects` that identify an outcome
RESERVED = {
    "surface.sq": "it is the axis of the curves; give sq",
    "surface.seed": "the surface is already a factor",
    "vibration.seed": "it follows the surface, which is already a factor",
    "grid.cells": "they follow the domain; give cells",
}


@dataclass(frozen=True, slots=True, kw_only=True)
class SensitivitySettings:
    """Settings of a sensitivity analysis.

    Parameters
    ----------
    vary : ranges, or their texts (`parse_range`); by default those that the paper leaves open and
        the case has
    method : "morris", elementary effects; "sobol", variance shares, at many times the cost
    size : trajectories of Morris, base samples of Sobol (a power of two); by default 12 and 64.
        A study has size x (factors + 1), or size x (factors + 2), points, each with all levels
    sq : roughness at which the curves are read [m]
    levels : roughness levels from the smallest to the largest of `sq`, for the knee of CRF; no
        knee below 7 levels
    cells : along each axis of the widest domain; a moved end of the domain keeps the cell size.
        None: the case's own
    seeds : surfaces averaged at each point
    sample_seed : random seed of sample and surfaces
    """

    vary: Sequence[ParameterRange | str] | None = None
    method: SensitivityMethod = "morris"
    size: int | None = None
    sq: Sequence[float] = SQ_LEVELS
    levels: int = CURVE_LEVELS
    cells: int | None = 128
    seeds: int = 1
    sample_seed: int = 0

    def ranges(self, case: Case) -> tuple[ParameterRange, ...]:
        """Return the ranges to vary; BadInput for one that the case refuses."""
        if self.vary is None:
            ranges = open_ranges(case)
        else:
            ranges = tuple(parse_range(r) if isinstance(r, str) else r for r in self.vary)
        require_ranges(case, ranges, RESERVED)
        return ranges


def sensitivity(
    case: Case,
    *,
    settings: SensitivitySettings | None = None,
    out: str | Path | None = None,
    executor: Executor | None = None,
    workers: int | None = None,
    progress: Callable[[StudyProgress], None] | None = None,
) -> Sensitivity:
    """Rank the factors that affect the curves over Sq, with standing roughness.

    Parameters
    ----------
    case : the contact, with roughness whose `surface.sq` can be set
    settings : factors, method, sample size, levels, grid and seeds; None: the defaults
    out : folder to store the study in and resume from
    executor, workers, progress : see `run_study`

    Raises
    ------
    BadInput
        for a range or setting that cannot be used, or without SALib.
    AsperityError
        if contacts failed in all blocks of the sample but one.
    """
    settings = settings or SensitivitySettings()
    method = settings.method
    require_choice("method", method, SIZES)
    if settings.seeds < 1:
        raise BadInput(f"seeds must be 1 or more, got {settings.seeds}")
    case = at_cells(case, settings.cells)
    if stated_value(case, "surface.kind") == "flat":
        raise BadInput(f"{case.source}: surface is flat and has no Sq to vary; choose a rough one")
    curve = _curve_levels(settings.sq, settings.levels)
    ranges = settings.ranges(case)
    seeded = [key for key in SEED_KEYS if stated_value(case, key) is not None]
    factors = (*(entry.key for entry in ranges), *([SEED_FACTOR] if seeded else []))
    sample = sample_design(
        method, len(factors), settings.size or SIZES[method], settings.sample_seed
    )
    design = _Design(
        case, ranges, tuple(seeded), sample, curve, settings.seeds, settings.sample_seed
    )
    design.require_solvable()
    result = run_study(
        design.plan(), out=out, executor=executor, workers=workers, progress=progress
    )
    return _analyse(design, factors, result, settings.sq)


# The study
# ----------------------------------------------------------------------


def _curve_levels(sq: Sequence[float], levels: int) -> tuple[float, ...]:
    """Return every Sq to solve at [m]: those requested and evenly spaced ones between the ends."""
    if not sq:
        raise BadInput("sensitivity needs at least one Sq, got none")
    for value in sq:
        require_positive("Sq", value, "m")
    if levels < 0:
        raise BadInput(f"levels must be 0 or more, got {levels}")
    spaced = np.linspace(min(sq), max(sq), levels) if len(sq) > 1 and levels > 1 else np.empty(0)
    return tuple(sorted({float(f"{value:.6g}") for value in (*sq, *spaced)}))


class _Design(NamedTuple):
    """The contacts to solve: every level and surface at every point of the sample."""

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
                seeds = self._realisation_seeds(number, float(shares[-1]), surface)
                points.append({**chosen, "surface.sq": f"{1e6 * level:g} um", **seeds})
        return plan_points(self.case, points)

    def require_solvable(self) -> None:
        """Raise BadInput if the case refuses points in too many blocks of the sample."""
        refused: dict[int, str] = {}
        for number, shares in enumerate(self.sample.shares):
            if number // self.sample.block not in refused:
                try:
                    chosen = overrides_at(self.case, self.ranges, shares[: len(self.ranges)])
                    self.case.with_written(chosen).surface()
                except BadInput as refusal:
                    refused[number // self.sample.block] = str(refusal)
        if len(self.sample.shares) // self.sample.block - len(refused) < FEWEST_BLOCKS:
            ranges = ", ".join(map(str, self.ranges))
            raise BadInput(
                f"{len(refused)} blocks of the sample hold contacts that cannot be solved, "
                f"the first: {next(iter(refused.values()))}; narrow the ranges ({ranges[:200]})"
            )

    def _realisation_seeds(self, number: int, share: float, surface: int) -> dict[str, int]:
        """Return the seeds that a share of the seed factor's range represents.

        Sobol's shares are all different. Morris has four, so each trajectory draws four surfaces
        of its own: a step along the seed changes to an independent surface.
        """
        trajectory = number // self.sample.block if self.sample.method == "morris" else 0
        entropy = np.random.SeedSequence(
            [self.sample_seed, trajectory, round(share * 2**31), surface]
        )
        drawn = zip(SEED_KEYS, entropy.generate_state(len(SEED_KEYS)), strict=True)
        return {key: int(word) for key, word in drawn if key in self.seeded}


def _analyse(
    design: _Design, factors: tuple[str, ...], result: StudyResult, sq: Sequence[float]
) -> Sensitivity:
    sample, curve = design.sample, design.curve
    shape = (len(sample.shares), len(curve), design.seeds)
    curves, full_film_share = _curves(result, shape)
    outcomes, columns = _outcomes(curves, sq, curve)
    names = [*factors, *(outcome.name for outcome in outcomes)]
    values = pandas.DataFrame(dict(zip(names, [*sample.shares.T, *columns], strict=True)))
    complete = np.isfinite(columns).reshape(len(columns), -1, sample.block).all(axis=2)
    if complete.sum(axis=1).min() < FEWEST_BLOCKS:
        first = f"; the first: {result.failures['reason'].iloc[0]}" if result.failed else ""
        raise AsperityError(
            f"too many contacts failed to rank the factors{first}; narrow the ranges"
        )
    return Sensitivity(
        case=design.case,
        method=sample.method,
        ranges=design.ranges,
        factors=factors,
        outcomes=tuple(outcomes),
        effects=_effects(sample, factors, outcomes, columns),
        values=values,
        left_out=int(np.count_nonzero(~complete.all(axis=0))) * sample.block,
        distinct=_distinct(curves, curve),
        full_film_share=full_film_share,
        result=result,
    )


def _effects(
    sample: SampleDesign,
    factors: tuple[str, ...],
    outcomes: Sequence[SensitivityOutcome],
    columns: Sequence[Field],
) -> pandas.DataFrame:
    """Return the measures of each factor's effect on each outcome, and its share of their sum."""
    effects = []
    for outcome, column in zip(outcomes, columns, strict=True):
        measures = indices(sample, column)
        ranked = np.maximum(measures[RANKED_BY[sample.method]], 0.0)
        total = float(np.sum(ranked))
        labels = dict(zip(OUTCOME_COLUMNS, outcome, strict=True))
        for i, factor in enumerate(factors):
            effects.append(
                {
                    **labels,
                    "factor": factor,
                    **{name: float(measure[i]) for name, measure in measures.items()},
                    "share": float(ranked[i]) / total if total > 0.0 else 0.0,
                }
            )
    return pandas.DataFrame(effects)


def _curves(result: StudyResult, shape: tuple[int, int, int]) -> tuple[dict[str, Field], float]:
    """Return quantities over (points, levels), nan for failures, and the share in full film."""
    if result.failed == len(result.table):
        raise AsperityError(
            f"no contact could be solved; the first: {result.failures['reason'].iloc[0]}"
        )
    table = result.table.set_index("number").reindex(range(math.prod(shape)))
    done = (table["status"] == DONE).to_numpy()

    def surface_mean(values: Field) -> Field:
        return np.asarray(np.where(done, values, np.nan).reshape(shape).mean(axis=2))

    def column(name: str) -> Field:
        return table[name].to_numpy(dtype=float, na_value=np.nan)

    curves = {name: surface_mean(column(name)) for name in ("car", "clr")}
    if "full_load_crf_hz" not in table:
        return curves, math.nan
    filled = with_full_film_limits(table)
    crfa = filled["crfa"].to_numpy(dtype=float)
    curves["crf_hz"] = surface_mean(filled["crf_hz"].to_numpy(dtype=float))
    if np.nanmax(crfa, initial=0.0) > 0.0:
        curves["log10_crfa"] = surface_mean(
            np.log10(np.where(crfa == 0.0, np.nanmin(crfa[crfa > 0.0]), crfa))
        )
    return curves, float(np.mean(is_full_film(table)[done]))


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
    """Return the break of the least-squares broken line through (x, y); nan if any y is not finite.

    A break is returned for every curve; `split_stages` decides whether it is significant.
    """
    if not np.isfinite(y).all():
        return math.nan
    breaks = np.linspace(x[1], x[-2], 201)
    residuals = [
        np.linalg.lstsq(
            np.stack([np.ones_like(x), x - x[0], np.maximum(x - split, 0.0)], axis=1),
            y,
            rcond=None,
        )[1].sum()
        for split in breaks
    ]
    return float(breaks[int(np.argmin(residuals))])


def _distinct(curves: dict[str, Field], curve: Sequence[float]) -> float:
    if "crf_hz" not in curves or len(curve) < FEWEST_STAGE_POINTS:
        return math.nan
    crfs = [crf for crf in curves["crf_hz"] if np.isfinite(crf).all()]
    return float(np.mean([split_stages(curve, crf).found for crf in crfs])) if crfs else math.nan
