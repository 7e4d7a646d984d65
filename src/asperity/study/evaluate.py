"""Evaluation of one case of a study: solve it, compute vibrations, return one row.

Runs in worker processes: arguments and results are picklable, and a failing case returns a row
instead of raising.
"""

import logging
import threading
import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any, Literal, NamedTuple, get_args

from threadpoolctl import threadpool_limits

from asperity.case import Case
from asperity.core.arrays import Field, finite_or_none
from asperity.core.documents import Table
from asperity.core.errors import AsperityError
from asperity.coupling import Vibration, contact_vibration
from asperity.ehl import FileContents
from asperity.results import RUN_GROUPS, Run, solve_case, vibrate_case
from asperity.solution import heats_inlet

CaseStatus = Literal["done", "not converged", "failed"]
StudyField = Literal["pressure", "gap", "in_contact", "surface_height", "run"]
DONE, NOT_CONVERGED, FAILED = get_args(CaseStatus)
FIELDS: tuple[StudyField, ...] = get_args(StudyField)
RUN = "run"  # the field that is not a map: the whole run, for `load_run`
BOTH_PRESETS = ("sound", "paper")
# without the dynamic stiffness, which takes as long as the contact
QUICK = tuple(group for group in RUN_GROUPS if group not in ("own", "virgin"))
STILL = tuple(group for group in RUN_GROUPS if group not in ("heat", "stress", "resonance"))

Row = dict[str, Any]


class Evaluated(NamedTuple):
    """Row of one case, with the requested maps by name and the contents of its run."""

    row: Row
    maps: dict[str, Field] | None = None
    run: FileContents | None = None


TimedBatch = tuple[list[Evaluated], float]  # results, seconds
# the solver has one set of work arrays per process, and an executor may use threads
_solver_lock = threading.Lock()


def evaluate_batch(
    case: Case, kind: str, batch: Sequence[Table], fields: tuple[str, ...] = ()
) -> list[Evaluated]:
    """Return rows and requested fields of `case` with each of the batch's overrides.

    Linear algebra uses one thread, since the order of summation must not depend on the number of
    threads: a resumed study is bit-identical.
    """
    with _solver_lock, threadpool_limits(1):
        return [evaluate(case, kind, overrides, fields) for overrides in batch]


def timed_batch(
    case: Case, kind: str, batch: Sequence[Table], fields: tuple[str, ...] = ()
) -> TimedBatch:
    """Return the results of `evaluate_batch` and the seconds taken."""
    start = time.perf_counter()
    return evaluate_batch(case, kind, batch, fields), time.perf_counter() - start


def evaluate(case: Case, kind: str, overrides: Table, fields: tuple[str, ...] = ()) -> Evaluated:
    """Return the row of one case: `status`, `reason` and every scalar, and the requested fields."""
    try:
        return EVALUATIONS[kind](case_at(case, overrides), fields)
    except AsperityError as refusal:
        return Evaluated({"status": FAILED, "reason": str(refusal)})
    except Exception as error:  # an internal error must not lose the other cases
        logging.getLogger(__name__).exception("a case of a study failed: %s", overrides)
        return Evaluated({"status": FAILED, "reason": f"{type(error).__name__}: {error}"})


def case_at(case: Case, overrides: Table) -> Case:
    """Return the case of a study's point.

    The base case decides whether inlet shear heating matters, at all points alike: the film has a
    step where it begins.
    """
    if case.lubricant is None or case.thermal.inlet_heating is not None:
        return case.with_written(overrides).among_many
    heated = heats_inlet(case.conditions, case.lubricant, case.thermal)
    return case.with_written({"thermal.inlet_heating": heated, **overrides}).among_many


def _solve(case: Case, fields: tuple[str, ...], groups: tuple[str, ...] = QUICK) -> Evaluated:
    run = solve_case(case, strict=False, groups=groups)
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
    requested = {name: values for name, values in maps.items() if name in fields}
    return Evaluated(row, requested, _contents(run, fields))


def _contents(run: Run, fields: tuple[str, ...]) -> FileContents | None:
    return run.contents() if RUN in fields else None


def _status(run: Run) -> Row:
    if run.converged:
        return {"status": DONE, "reason": ""}
    return {"status": NOT_CONVERGED, "reason": run.convergence_text}


def _solve_surfaces(case: Case, fields: tuple[str, ...]) -> Evaluated:
    """Return means and intervals over the surfaces set in [solver], as `asperity solve` does."""
    run = solve_case(case, surfaces=None, strict=False, groups=QUICK)
    return Evaluated({**_status(run), **run.scalars()}, run=_contents(run, fields))


def _solve_dynamic(case: Case, _fields: tuple[str, ...]) -> Evaluated:
    """Solve the contact with its own dynamic stiffness and damping, without a vibration record."""
    run = solve_case(case.with_written({"vibration": "none"}), strict=False)
    return Evaluated({**_status(run), **replace(run, case=case).numbers(STILL)})


def _vibrate(case: Case, _fields: tuple[str, ...]) -> Evaluated:
    return Evaluated({"status": DONE, "reason": "", **vibrate_case(case).scalars()})


EVALUATIONS: dict[str, Callable[[Case, tuple[str, ...]], Evaluated]] = {
    "solve": _solve,
    "shake": lambda case, fields: _solve(case, fields, RUN_GROUPS),
    "surfaces": _solve_surfaces,
    "still": _solve_dynamic,
    "vibrate": _vibrate,
}


def _both_presets(case: Case, run: Run) -> Row:
    """Return CRF and CRFA of a contact for both vibration presets, "sound" and "paper"."""
    row: Row = {}
    for preset in BOTH_PRESETS:
        model = case.with_written({"vibration.preset": preset}).vibration
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
