"""Calibration of a case's free quantities to anchors of its wear curve.

Least squares (scipy) starts from the best points of a Latin hypercube. The objective is slightly
rough because a changed domain or correlation length draws a new surface, so slopes are taken over
a tenth of each range and their scatter over seeds is removed from the information.
docs/theory/calibration.md has the equations.
"""

from collections.abc import Callable, Sequence
from concurrent.futures import Executor
from contextlib import nullcontext
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas

from asperity.case import Case, split_amount
from asperity.core.arrays import Field
from asperity.core.errors import BadInput, require_positive
from asperity.paper import PAPER_ANCHORS, SPLIT_ANCHOR, Anchor, compare_with_anchors
from asperity.study.anchor_misfit import CHECK_SEEDS, EDGE, MisfitSolver, least_misfit
from asperity.study.calibration_result import LEARNT_FROM, CalibratedParameter, Calibration
from asperity.study.curve import SQ_KEY, WearCurve
from asperity.study.execute import StudyProgress, run_study, study_executor
from asperity.study.plan import StudyPlan
from asperity.study.ranges import (
    OPEN_RANGES,
    STANDING,
    ParameterRange,
    at_cells,
    open_ranges,
    overrides_at,
    parse_range,
    require_ranges,
    stated_value,
)
from asperity.study.result import StudyResult
from asperity.study.sensitivities import PRIOR_VARIANCE, MisfitSlopes

FREE = OPEN_RANGES[:4]  # they control CAR and CLR: cap, correlation length, alpha, inlet
SLOPE_SEEDS = 2  # the final slopes use this many times the surfaces of the fit
SAME_LEVEL = 0.02  # relative difference below which two levels of Sq are solved as one
RESERVED = {
    SQ_KEY: "the anchors set the roughness",
    "surface.seed": "the result should not depend on one surface; give seeds",
    "vibration.seed": "the result should not depend on one record; give seeds",
    "grid.cells": "they follow the domain; give cells",
}


@dataclass(frozen=True, slots=True, kw_only=True)
class CalibrationSettings:
    """Settings of a calibration.

    Parameters
    ----------
    free : ranges to search, or their texts (`parse_range`); by default those of pressure cap,
        correlation length, pressure-viscosity coefficient and inlet that the case has
    levels : roughnesses to solve at [m]; by default those of the anchors
    cells : along each axis of the widest domain; None: the case's own
    seeds : surfaces per level, the same in every evaluation
    screened : parameter sets of the Latin hypercube
    starts : number of the best sets that least squares starts from
    sample_seed : random seed of the hypercube
    """

    free: Sequence[ParameterRange | str] | None = None
    levels: Sequence[float] | None = None
    cells: int | None = 128
    seeds: int = 3
    screened: int = 32
    starts: int = 2
    sample_seed: int = 0

    def ranges(self, case: Case) -> tuple[ParameterRange, ...]:
        """Return the ranges to search; BadInput for one that the case refuses."""
        if self.free is None:
            ranges = open_ranges(case, FREE)
        else:
            ranges = tuple(parse_range(r) if isinstance(r, str) else r for r in self.free)
        require_ranges(case, ranges, RESERVED)
        return ranges


def calibrate(
    case: Case,
    anchors: Sequence[Anchor] = PAPER_ANCHORS,
    *,
    settings: CalibrationSettings | None = None,
    out: str | Path | None = None,
    executor: Executor | None = None,
    workers: int | None = None,
    progress: Callable[[StudyProgress], None] | None = None,
) -> Calibration:
    """Fit free quantities of a case so that its wear curve meets anchors, with standing roughness.

    The misfit is the sum over the `fitted` anchors of (miss/tolerance)^2, on means over surfaces.

    Parameters
    ----------
    case : the contact; quantities that are not free keep their values
    anchors : values that the curve should meet
    settings : free ranges, levels, grid, seeds and search effort; None: the defaults
    out : folder that stores every evaluation; a second call resumes from it
    executor, workers, progress : see `run_study`

    Raises
    ------
    BadInput
        for a range, anchor or setting that cannot be used.
    AsperityError
        if no parameter set can be solved.
    """
    settings = settings or CalibrationSettings()
    original, case = case, at_cells(case, settings.cells)
    ranges = settings.ranges(case)
    targets = _fitted_anchors(case, anchors)
    sq = _levels(targets, settings.levels)
    for name in ("seeds", "screened", "starts"):
        if getattr(settings, name) < 1:
            raise BadInput(f"{name} must be 1 or more, got {getattr(settings, name)}")
    with nullcontext(executor) if executor is not None else study_executor(workers) as pool:

        def run(plan: StudyPlan, folder: str) -> StudyResult:
            path = None if out is None else Path(out) / folder
            return run_study(plan, out=path, executor=pool, progress=progress)

        solver = MisfitSolver(case, ranges, targets, sq, settings.seeds, run)
        best = least_misfit(solver, settings.screened, settings.starts, settings.sample_seed)
        slopes = MisfitSlopes.from_differences(solver, best, SLOPE_SEEDS * settings.seeds)
        calibrated = _calibrated(original, ranges, best)
        check = solver.check(calibrated)
    return _result(original, calibrated, anchors, solver, best, slopes, check)


def _result(
    original: Case,
    calibrated: Case,
    anchors: Sequence[Anchor],
    solver: MisfitSolver,
    best: Field,
    slopes: MisfitSlopes,
    check: WearCurve,
) -> Calibration:
    ranges, targets = solver.ranges, solver.targets
    curve = solver.curve(best)
    start_curve = solver.curve(None)
    covariance, scale = slopes.covariance(len(targets) - len(ranges))
    deviations = np.sqrt(np.diag(covariance))
    return Calibration(
        case=solver.case,
        calibrated=calibrated,
        anchors=tuple(anchors),
        parameters=tuple(_parameters(original, ranges, best, deviations)),
        correlation=covariance / np.outer(deviations, deviations),
        directions=tuple(slopes.directions(scale)),
        trade_offs=tuple(slopes.trade_offs(best, targets)),
        start=_compared(start_curve, anchors),
        fit=_compared(curve, anchors),
        check=_compared(check, anchors),
        start_misfit=solver.misfit(None),
        misfit=solver.misfit(best),
        evaluations=len(solver.solved),
        cases=solver.cases,
        failed=solver.failed,
        seconds=solver.seconds,
        start_curve=start_curve,
        curve=curve,
        check_curve=check,
    )


def _fitted_anchors(case: Case, anchors: Sequence[Anchor]) -> tuple[Anchor, ...]:
    targets = tuple(anchor for anchor in anchors if anchor.fitted)
    if not targets:
        raise BadInput("calibration needs a fitted anchor, got none; remove fitted = false")
    for anchor in targets:
        if anchor.quantity == SPLIT_ANCHOR:
            raise BadInput(
                f"anchor {anchor.name!r} is a split, which varies in steps; set fitted = false"
            )
        if case.vibration is None and anchor.quantity.startswith("crf"):
            raise BadInput(
                f"{case.source}: anchor {anchor.name!r} needs a vibration; add [vibration]"
            )
    return targets


def _levels(targets: Sequence[Anchor], levels: Sequence[float] | None) -> tuple[float, ...]:
    """Return the roughnesses to solve at [m]: as given, or the anchors' with close ones merged."""
    anchored = sorted(
        {sq for anchor in targets for sq in (anchor.sq, anchor.since) if sq is not None}
    )
    if levels is not None:
        chosen = sorted({require_positive("level", level, "m") for level in levels})
        if (
            not chosen
            or chosen[0] > anchored[0] * (1 + 1e-9)
            or chosen[-1] < anchored[-1] * (1 - 1e-9)
        ):
            raise BadInput(
                f"levels must span the anchors' Sq from {1e6 * anchored[0]:g} to "
                f"{1e6 * anchored[-1]:g} um, "
                f"got {', '.join(f'{1e6 * level:g}' for level in chosen) or 'none'}"
            )
        return tuple(chosen)
    merged = [anchored[-1]]
    for level in reversed(anchored[:-1]):
        if level < merged[-1] * (1.0 - SAME_LEVEL):
            merged.append(level)
    merged[-1] = anchored[0]
    return tuple(sorted(merged))


def _calibrated(case: Case, ranges: Sequence[ParameterRange], best: Field) -> Case:
    """Return the case with the fitted values, its own cells and a [study] of its wear curve."""
    overrides = {**overrides_at(case, ranges, best), **STANDING}
    overrides.pop("grid.cells", None)
    if case.contents.study is None:
        overrides["study"] = {
            "sq": {"from": "0.5 um", "to": "4 um", "step": "0.1 um"},
            "seeds": CHECK_SEEDS,
        }
    return case.with_written(overrides)


def _parameters(
    case: Case, ranges: Sequence[ParameterRange], best: Field, deviations: Field
) -> list[CalibratedParameter]:
    parameters = []
    for entry, share, std in zip(ranges, best, deviations, strict=True):
        learnt = float(1.0 - std**2 / PRIOR_VARIANCE)
        limits = (share - std, share + std) if learnt >= LEARNT_FROM else (0.0, 1.0)
        low, high = (entry.value(min(max(end, 0.0), 1.0)) for end in limits)
        parameters.append(
            CalibratedParameter(
                range=entry,
                start=_start(case, entry),
                value=entry.value(float(share)),
                low=low,
                high=high,
                std_share=float(std),
                learnt=learnt,
                at_end=not EDGE < share < 1.0 - EDGE,
            )
        )
    return parameters


def _start(case: Case, entry: ParameterRange) -> float | None:
    """Return the case's own value in the range's unit; the first entry of a pair."""
    value = stated_value(case, entry.key)
    value = value[0] if isinstance(value, list) else value
    return None if value is None else float(split_amount(value, entry.unit)[0])


def _compared(curve: WearCurve, anchors: Sequence[Anchor]) -> pandas.DataFrame:
    """Compare the curve with the fitted anchors and those within its levels."""
    covered = [a for a in anchors if a.sq is not None and np.isfinite(a.evaluate(curve)[0])]
    return compare_with_anchors(
        curve, [*covered, *(a for a in anchors if a.fitted and a not in covered)]
    )
