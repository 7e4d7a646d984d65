"""A case let move: the steps of a model of the moving contact, read off and kept; nothing is solved here."""

import math
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import NamedTuple

from threadpoolctl import threadpool_limits

from asperity.case import Case
from asperity.core.errors import BadInput, NotConverged
from asperity.core.limits import require_affordable
from asperity.simulation.motion.history import History, steps_a_pass
from asperity.simulation.motion.rows import Row, step_row
from asperity.simulation.motion.store import open_keeper
from asperity.surface import MovingSurfaces
from asperity.transient import Snapshot, Steps, moving_contact

MODELS: dict[str, Steps] = {  # by the case's `model`
    "mixed": moving_contact,
    "unified": moving_contact,
    "paper": moving_contact,
    "conserving": moving_contact,
}
STEP_S, ROW_BYTES = 1e-5, 2000.0  # what a step takes: time a cell, memory


class HistoryProgress(NamedTuple):
    """How far a history is: the step just taken, of how many, and its row."""

    number: int
    steps: int
    row: Row


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
    """Let a case's roughness move.

    Parameters
    ----------
    case : with a [motion], or the defaults of one
    steps : the number of the last step; the case's unless given
    passes : in place of `steps`, how often the rough surface runs its whole track (of two, the slower one)
    out : folder to keep the history in, and to go on from where it holds the same case's; None keeps it in memory
    every : keep maps of every so many steps; about 40 in all unless given
    strict : stop at the first step that does not converge; else mark it and go on
    progress : called after every step

    Raises
    ------
    BadInput
        for a dry contact, heat that is fed back, no steps, or a folder that holds something else.
    NotConverged
        if `strict`; its `solution` is the history, the bad step the last of it.
    """
    surfaces, model = _moving_parts(case)
    last = _last_step(case, surfaces, steps, passes)
    began = time.perf_counter()
    # sums over several threads depend on their number, and vectors this short are slower for it
    with open_keeper(case, surfaces, last, out, every) as keeper, threadpool_limits(1):
        before = len(keeper.rows)
        if last > keeper.last:
            taken: Iterator[Snapshot] = model(
                case.conditions,
                case.lubricant,
                surfaces,
                start=case.motion.start,
                resume=keeper.memory,
                time_step=case.motion.time_step,
                flattening=case.motion.flattening,
                options=case.options,
            )
            for snapshot in taken:
                row = step_row(snapshot, case, keeper.rows[-1] if keeper.rows else None)
                bad = strict and not row["converged"]
                keeper.keep(snapshot, row, bad=bad)
                if progress is not None:
                    progress(HistoryProgress(snapshot.number, last, row))
                if bad or snapshot.number >= last:
                    break
        history = keeper.history(time.perf_counter() - began, len(keeper.rows) - before)
    if strict and history.failed:
        where = f"step {history.failed[0]} of {last} did not converge"
        raise NotConverged(
            history, f"{where}; what came before it is good, strict=False marks it and goes on"
        )
    return history


def _moving_parts(case: Case) -> tuple[MovingSurfaces, Steps]:
    if case.lubricant is None:
        raise BadInput(f"{case.source}: a dry contact has no history; give it a [lubricant]")
    if case.thermal.feedback:
        raise BadInput(f"{case.source}: motion knows no warm film; set thermal.feedback=false")
    name: str = case.contents.model
    if name not in MODELS:
        raise BadInput(
            f"{case.source}: model {name} has no steps in time; take one of {', '.join(MODELS)}"
        )
    return case.moving_surfaces(), MODELS[name]


def _last_step(
    case: Case, surfaces: MovingSurfaces, steps: int | None, passes: float | None
) -> int:
    if passes is None:
        wanted = case.motion.steps if steps is None else steps
    elif steps is not None:
        raise BadInput(f"both steps ({steps}) and passes ({passes:g}) are given; leave one out")
    else:
        exact = passes * steps_a_pass(case, surfaces)
        if not 0.0 < exact < math.inf:
            raise BadInput(
                f"passes must be positive, of a rough surface that moves, got {passes:g}; give steps"
            )
        wanted = math.ceil(exact - 1e-9)
    if wanted < 1:
        raise BadInput(f"steps must be at least 1, got {wanted}")
    nx, ny = case.grid.cells
    seconds = STEP_S * nx * ny * float(wanted)
    require_affordable(
        f"a history of {float(wanted):.10g} steps",
        memory=ROW_BYTES * float(wanted),
        seconds=seconds,
    )
    return wanted
