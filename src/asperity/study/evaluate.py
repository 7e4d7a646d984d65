"""One case of a study to one row: solved, made to vibrate by both vibration presets, every number by its name.

Runs in worker processes: takes and gives only what can be sent, raises nothing that a case can
cause.
"""

import logging
import threading
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any, Literal, get_args

from threadpoolctl import threadpool_limits

from asperity.case import Case
from asperity.core.arrays import Field, finite_or_none
from asperity.core.errors import AsperityError
from asperity.coupling import Vibration, contact_vibration
from asperity.results import RUN_GROUPS, Run, solve_case, vibrate_case

CaseStatus = Literal["done", "not converged", "failed"]
StudyField = Literal["pressure", "gap", "in_contact", "surface_height"]
DONE, NOT_CONVERGED, FAILED = get_args(CaseStatus)
FIELDS: tuple[StudyField, ...] = get_args(StudyField)
BOTH_PRESETS = ("sound", "paper")
QUICK = tuple(
    group for group in RUN_GROUPS if group not in ("own", "virgin")
)  # they take as long as the contact
STILL = tuple(group for group in RUN_GROUPS if group not in ("heat", "stress", "resonance"))

Row = dict[str, Any]
_alone = (
    threading.Lock()
)  # the solver's work arrays are one set a process, and an executor may have threads


def evaluate_batch(
    case: Case, kind: str, batch: Sequence[Mapping[str, Any]], wanted: tuple[str, ...] = ()
) -> list[tuple[Row, dict[str, Field]]]:
    """Rows, and the fields wanted, of `case` with each of the batch's overrides.

    One thread does the algebra: two would sum in another order, and a resumed study is to be the
    same to the last bit.
    """
    with _alone, threadpool_limits(1):
        return [evaluate(case, kind, overrides, wanted) for overrides in batch]


def timed_batch(*job: Any) -> tuple[list[tuple[Row, dict[str, Field]]], float]:
    """`evaluate_batch`, and the seconds it took."""
    begun = time.perf_counter()
    return evaluate_batch(*job), time.perf_counter() - begun


def evaluate(
    case: Case, kind: str, overrides: Mapping[str, Any], wanted: tuple[str, ...] = ()
) -> tuple[Row, dict[str, Field]]:
    """The row of one case: `status`, `reason` and every scalar; a failure is a row too, and says why."""
    try:
        return EVALUATIONS[kind](case.with_overrides(overrides), wanted)
    except AsperityError as refusal:
        return {"status": FAILED, "reason": str(refusal)}, {}
    except Exception as mistake:  # ours, and no reason to lose the others
        logging.getLogger(__name__).exception("a case of a study failed: %s", overrides)
        return {"status": FAILED, "reason": f"{type(mistake).__name__}: {mistake}"}, {}


def _solved(
    case: Case, wanted: tuple[str, ...], groups: Sequence[str] = QUICK
) -> tuple[Row, dict[str, Field]]:
    run = solve_case(case, strict=False)
    row: Row = {**_status(run), **run.numbers(groups)}
    if run.vibration is not None:
        row["full_load_crf_hz"] = run.vibration.full_load_crf_hz
        row |= _both_presets(case, run)
    maps: dict[str, Any] = {
        "pressure": run.solution.pressure,
        "gap": run.solution.gap,
        "in_contact": run.solution.in_contact,
        "surface_height": run.solution.surface.heights,
    }
    return row, {name: maps[name] for name in wanted}


def _status(run: Run) -> Row:
    convergence = run.solution.convergence
    if convergence.converged:
        return {"status": DONE, "reason": ""}
    return {"status": NOT_CONVERGED, "reason": convergence.explain()}


def _over_surfaces(case: Case, _wanted: tuple[str, ...]) -> tuple[Row, dict[str, Field]]:
    """Means over the surfaces that [solver] asks for, and intervals, as `asperity solve` gives them."""
    run = solve_case(case, surfaces=None, strict=False, groups=QUICK)
    return {**_status(run), **run.scalars()}, {}


def _still(case: Case, _wanted: tuple[str, ...]) -> tuple[Row, dict[str, Field]]:
    """The contact with its own stiffness and damping where its mass resonates, and no record of a vibration."""
    run = solve_case(case.with_overrides({"vibration": "none"}), strict=False)
    return {**_status(run), **replace(run, case=case).numbers(STILL)}, {}


def _vibrated(case: Case, _wanted: tuple[str, ...]) -> tuple[Row, dict[str, Field]]:
    return {"status": DONE, "reason": "", **vibrate_case(case).scalars()}, {}


EVALUATIONS: dict[str, Callable[[Case, tuple[str, ...]], tuple[Row, dict[str, Field]]]] = {
    "solve": _solved,
    "shake": lambda case, wanted: _solved(case, wanted, RUN_GROUPS),
    "surfaces": _over_surfaces,
    "still": _still,
    "vibrate": _vibrated,
}


def _both_presets(case: Case, run: Run) -> Row:
    """CRF and CRFA of the one contact by the sound vibration preset and by the paper's."""
    row: Row = {}
    for preset in BOTH_PRESETS:
        model = case.with_overrides({"vibration.preset": preset}).vibration
        assert model is not None
        vibration: Vibration | None = run.vibration
        row[f"reason_{preset}"] = ""
        if model != case.vibration:
            try:
                vibration = contact_vibration(
                    run.state, case.conditions, model, solution=run.solution
                )
            except AsperityError as refusal:
                vibration, row[f"reason_{preset}"] = None, str(refusal)
        resonance = (
            vibration.resonance if vibration is not None and vibration.resonance.found else None
        )
        for name, unit in (("crf", "_hz"), ("crfa", ""), ("crf_std", "_hz"), ("crfa_std", "")):
            row[f"{name}_{preset}{unit}"] = finite_or_none(
                getattr(resonance, f"{name}{unit}", None)
            )
    return row
