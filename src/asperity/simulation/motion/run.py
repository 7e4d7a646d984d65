"""Simulation of a moving contact: the steps of a model, recorded as a history."""

import math
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import NamedTuple

from threadpoolctl import threadpool_limits

from asperity.case import Case
from asperity.core.arrays import Field, usual_float_errors
from asperity.core.errors import BadInput, NotConverged
from asperity.core.limits import require_affordable
from asperity.core.notebook import notebook_progress
from asperity.simulation.motion.history import History, steps_a_pass
from asperity.simulation.motion.rows import Row, step_row
from asperity.simulation.motion.store import open_recorder
from asperity.solution import inlet_viscosity_factor
from asperity.surface import MovingSurfaces
from asperity.transient import Snapshot, Steps, moving_contact

MODELS: dict[str, Steps] = {  # by the case's `model`
    "mixed": moving_contact,
    "unified": moving_contact,
    "paper": moving_contact,
    "conserving": moving_contact,
}
STEP_S, ROW_BYTES = 1e-5, 2000.0  # cost of a step: time per cell [s], memory [B]


def _ignore(state: "HistoryProgress") -> None:
    """Report no progress."""


def _progress_text(state: "HistoryProgress") -> tuple[float, str]:
    return state.number / max(state.steps, 1), f"step {state.number} of {state.steps}"


class HistoryProgress(NamedTuple):
    """Progress of a history: number of the last step, number of steps, and its row."""

    number: int
    steps: int
    row: Row


@usual_float_errors
def run_history(
    case: Case,
    *,
    steps: int | None = None,
    passes: float | None = None,
    out: Path | None = None,
    every: int | None = None,
    strict: bool = True,
    progress: Callable[[HistoryProgress], None] | None = None,
) -> History:
    """Simulate the moving roughness of a case.

    Parameters
    ----------
    case : with a [motion], or its defaults
    steps : number of the last step; by default the case's
    passes : instead of `steps`, passes of the rough surface's track (of two, the slower one's)
    out : folder for the history; resumes it if it holds the same case's; None keeps it in memory
    every : keep maps every so many steps; by default about 40 in all
    strict : stop at the first step that does not converge; else mark it and continue
    progress : called after every step

    Raises
    ------
    BadInput
        for a dry contact, thermal feedback, no steps, or a folder with other contents.
    NotConverged
        if `strict`; its `solution` is the history, which ends with the failed step.
    """
    surfaces, model = _moving_parts(case)
    last = _last_step(case, surfaces, steps, passes)
    began = time.perf_counter()
    report = progress or notebook_progress("Motion", _progress_text) or _ignore
    # sums over several threads depend on their number, and vectors this short run slower on them
    with open_recorder(case, surfaces, last, out, every) as recorder, threadpool_limits(1):
        before = len(recorder.rows)
        if last > recorder.last:
            snapshots: Iterator[Snapshot] = model(
                case.conditions,
                case.lubricant,
                surfaces,
                start=recorder.memory or case.motion.start,
                time_step=case.motion.time_step,
                flattening=case.motion.flattening,
                options=case.options,
                viscosity_factor=_inlet(case, surfaces),
            )
            for snapshot in snapshots:
                row = step_row(snapshot, case, recorder.rows[-1] if recorder.rows else None)
                failed = strict and not row["converged"]
                recorder.record(snapshot, row, failed=failed)
                report(HistoryProgress(snapshot.number, last, row))
                if failed or snapshot.number >= last:
                    break
        history = recorder.history(time.perf_counter() - began, len(recorder.rows) - before)
    if strict:
        _require_converged(history, last)
    return history


def _inlet(case: Case, surfaces: MovingSurfaces) -> Field | None:
    """Return the viscosity factor of inlet shear heating, if it is computed."""
    return inlet_viscosity_factor(case.conditions, case.lubricant, surfaces.grid, case.thermal)


def _require_converged(history: History, last: int) -> None:
    """Raise NotConverged for a history with a failed step."""
    if history.failed:
        where = f"step {history.failed[0]} of {last} did not converge"
        raise NotConverged(
            history, f"{where}; earlier steps are valid, strict=False marks it and continues"
        )


def _moving_parts(case: Case) -> tuple[MovingSurfaces, Steps]:
    if case.lubricant is None:
        raise BadInput(f"{case.source}: a dry contact has no history; add a [lubricant]")
    if case.thermal.feedback:
        raise BadInput(
            f"{case.source}: motion does not support thermal feedback; set thermal.feedback=false"
        )
    name: str = case.contents.model
    if name not in MODELS:
        raise BadInput(
            f"{case.source}: model {name} has no time steps; choose one of {', '.join(MODELS)}"
        )
    return case.moving_surfaces(), MODELS[name]


def _last_step(
    case: Case, surfaces: MovingSurfaces, steps: int | None, passes: float | None
) -> int:
    if passes is None:
        count = case.motion.steps if steps is None else steps
    elif steps is not None:
        raise BadInput(f"both steps ({steps}) and passes ({passes:g}) are given; leave one out")
    else:
        exact = passes * steps_a_pass(case, surfaces)
        if not 0.0 < exact < math.inf:
            raise BadInput(
                f"passes must be positive and need a moving rough surface, got {passes:g}; state "
                "steps instead"
            )
        count = math.ceil(exact - 1e-9)
    if count < 1:
        raise BadInput(f"steps must be at least 1, got {count}")
    nx, ny = case.grid.cells
    seconds = STEP_S * nx * ny * float(count)
    require_affordable(
        f"a history of {float(count):.10g} steps",
        memory=ROW_BYTES * float(count),
        seconds=seconds,
    )
    return count
