"""The quantities of a case that best meet what is known of its wear curve: found on the real solver, with the cost.

Least squares of scipy from the best of a Latin hypercube. The objective is a little rough (a moved
domain or correlation length draws the surface anew), so slopes are taken over a tenth of each
range, and what seeds alone do to them is taken out before anything is called determined.
docs/theory/calibration.md has the equations.
"""

from collections.abc import Callable, Sequence
from concurrent.futures import Executor
from contextlib import nullcontext
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
from asperity.study.execute import StudyProgress, study_executor
from asperity.study.ranges import (
    OPEN_RANGES,
    ParameterRange,
    at_cells,
    open_ranges,
    overrides_at,
    parse_range,
    require_ranges,
    stated_value,
)
from asperity.study.sensitivities import PRIOR_VARIANCE, MisfitSlopes

FREE = OPEN_RANGES[:4]  # what decides CAR and CLR: cap, correlation length, alpha, inlet
CELLS, SEEDS, SCREENED, STARTS = 128, 3, 32, 2
SLOPE_SEEDS = 2  # times as many surfaces for the slopes at the end as for the fit
SAME_LEVEL = 0.02  # Sq nearer than this to another are solved once
RESERVED = {
    SQ_KEY: "anchors are at roughnesses of their own",
    "surface.seed": "what is found should not hang on one surface; give seeds",
    "vibration.seed": "what is found should not hang on one record; give seeds",
    "grid.cells": "they go with the domain; give cells",
}


def calibrate(
    case: Case,
    anchors: Sequence[Anchor] = PAPER_ANCHORS,
    *,
    free: Sequence[ParameterRange | str] | None = None,
    levels: Sequence[float] | None = None,
    cells: int | None = CELLS,
    seeds: int = SEEDS,
    screened: int = SCREENED,
    starts: int = STARTS,
    sample_seed: int = 0,
    out: str | Path | None = None,
    executor: Executor | None = None,
    workers: int | None = None,
    progress: Callable[[StudyProgress], None] | None = None,
) -> Calibration:
    """Find the values of free quantities with which a case's wear curve best meets anchors.

    The misfit is the sum over the anchors that are `fitted` of (miss/tolerance)^2, on means over
    `seeds` surfaces that are the same in every evaluation.

    Parameters
    ----------
    case : the contact; what is not free stays as it is
    anchors : what the curve should meet
    free : ranges to search, or their texts (`parse_range`); by default pressure cap, correlation length,
        pressure-viscosity coefficient and inlet, as far as the case has them
    levels : roughnesses to solve at [m]; by default the anchors' own
    cells : along each axis of the widest domain; None: the case's own
    seeds : surfaces a level
    screened : parameter sets of the Latin hypercube that the starts are chosen from
    starts : how many of the best least squares starts from
    sample_seed : of the hypercube
    out : folder that keeps every evaluation, so that a second call goes on where the first was stopped
    executor, workers, progress : see `run_study`

    Raises
    ------
    BadInput
        for a range, anchor or setting that cannot be used.
    AsperityError
        if no parameter set can be solved.
    """
    given, case = case, at_cells(case, cells)
    wanted = (
        FREE if free is None else tuple(parse_range(r) if isinstance(r, str) else r for r in free)
    )
    ranges = open_ranges(case, wanted) if free is None else wanted
    require_ranges(case, ranges, RESERVED)
    aimed = _aimed_at(case, anchors)
    sq = _levels(aimed, levels)
    for name, count in (("seeds", seeds), ("screened", screened), ("starts", starts)):
        if count < 1:
            raise BadInput(f"{name} must be 1 or more, got {count}")
    with nullcontext(executor) if executor is not None else study_executor(workers) as pool:
        solver = MisfitSolver(
            case, ranges, aimed, sq, seeds, None if out is None else Path(out), pool, progress
        )
        best = least_misfit(solver, screened, starts, sample_seed)
        slopes = MisfitSlopes.at(solver, best, SLOPE_SEEDS * seeds)
        calibrated = _calibrated(given, ranges, best)
        check = solver.checked(calibrated)
    return _result(given, calibrated, anchors, solver, best, slopes, check)


def _result(
    given: Case,
    calibrated: Case,
    anchors: Sequence[Anchor],
    solver: MisfitSolver,
    best: Field,
    slopes: MisfitSlopes,
    check: WearCurve,
) -> Calibration:
    ranges, aimed = solver.ranges, solver.aimed
    curve, start_curve = solver.curve(best), solver.curve(None)
    covariance, scale = slopes.covariance(len(aimed) - len(ranges))
    deviations = np.sqrt(np.diag(covariance))
    return Calibration(
        case=solver.case,
        calibrated=calibrated,
        anchors=tuple(anchors),
        parameters=tuple(_parameters(given, ranges, best, deviations)),
        correlation=covariance / np.outer(deviations, deviations),
        directions=tuple(slopes.directions(scale)),
        trade_offs=tuple(slopes.trade_offs(best, aimed)),
        start=_compared(start_curve, anchors),
        fit=_compared(curve, anchors),
        check=_compared(check, anchors),
        start_misfit=solver.misfit(None),
        misfit=solver.misfit(best),
        evaluations=len(solver.known),
        cases=solver.cases,
        failed=solver.failed,
        seconds=solver.seconds,
        start_curve=start_curve,
        curve=curve,
        check_curve=check,
    )


def _aimed_at(case: Case, anchors: Sequence[Anchor]) -> tuple[Anchor, ...]:
    aimed = tuple(anchor for anchor in anchors if anchor.fitted)
    if not aimed:
        raise BadInput("calibration needs an anchor to aim at, got none; leave out fitted = false")
    for anchor in aimed:
        if anchor.quantity == SPLIT_ANCHOR:
            raise BadInput(
                f"anchor {anchor.name!r} is a split, which moves in jumps; set fitted = false for it"
            )
        if case.vibration is None and anchor.quantity.startswith("crf"):
            raise BadInput(
                f"{case.source}: anchor {anchor.name!r} needs a vibration; add [vibration]"
            )
    return aimed


def _levels(aimed: Sequence[Anchor], levels: Sequence[float] | None) -> tuple[float, ...]:
    """Roughnesses to solve at [m]: those given, or the anchors', of near ones the outer."""
    anchored = sorted(
        {sq for anchor in aimed for sq in (anchor.sq, anchor.since) if sq is not None}
    )
    if levels is not None:
        chosen = sorted({require_positive("level", level, "m") for level in levels})
        if (
            not chosen
            or chosen[0] > anchored[0] * (1 + 1e-9)
            or chosen[-1] < anchored[-1] * (1 - 1e-9)
        ):
            raise BadInput(
                f"levels must span the anchors' Sq from {1e6 * anchored[0]:g} to {1e6 * anchored[-1]:g} um, "
                f"got {', '.join(f'{1e6 * level:g}' for level in chosen) or 'none'}"
            )
        return tuple(chosen)
    kept = [anchored[-1]]
    for level in reversed(anchored[:-1]):
        if level < kept[-1] * (1.0 - SAME_LEVEL):
            kept.append(level)
    kept[-1] = anchored[0]
    return tuple(sorted(kept))


def _calibrated(case: Case, ranges: Sequence[ParameterRange], best: Field) -> Case:
    """The case with what was found, on its own cells, and a study of its wear curve where it has none."""
    overrides = overrides_at(case, ranges, best)
    overrides.pop("grid.cells", None)
    if case.contents.study is None:
        overrides["study"] = {
            "sq": {"from": "0.5 um", "to": "4 um", "step": "0.1 um"},
            "seeds": CHECK_SEEDS,
        }
    return case.with_overrides(overrides)


def _parameters(
    case: Case, ranges: Sequence[ParameterRange], best: Field, deviations: Field
) -> list[CalibratedParameter]:
    parameters = []
    for entry, share, std in zip(ranges, best, deviations, strict=True):
        learnt = float(1.0 - std**2 / PRIOR_VARIANCE)
        reach = (share - std, share + std) if learnt >= LEARNT_FROM else (0.0, 1.0)
        low, high = (entry.value(min(max(end, 0.0), 1.0)) for end in reach)
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
    """What the case itself has, in the range's unit; of a pair in which both are free as one, the first."""
    value = stated_value(case, entry.key)
    value = value[0] if isinstance(value, list) else value
    return None if value is None else float(split_amount(value, entry.unit)[0])


def _compared(curve: WearCurve, anchors: Sequence[Anchor]) -> pandas.DataFrame:
    """The anchors that the curve's levels can tell."""
    reached = [a for a in anchors if a.sq is not None and np.isfinite(a.evaluate(curve)[0])]
    return compare_with_anchors(
        curve, [*reached, *(a for a in anchors if a.fitted and a not in reached)]
    )
