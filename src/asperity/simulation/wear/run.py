"""Wear simulation over hours: positions are solved, jumps taken, and each jump recorded."""

import math
import time
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

from asperity.case import Case
from asperity.core.arrays import usual_float_errors
from asperity.core.errors import AsperityError, BadInput, NotConverged, require_positive
from asperity.core.limits import require_affordable
from asperity.core.notebook import notebook_progress
from asperity.simulation.wear.contact import (
    BatchSolver,
    FailedPosition,
    SolvedPosition,
    position_solvers,
)
from asperity.simulation.wear.frames import WearFrame
from asperity.simulation.wear.history import HOUR, WearHistory
from asperity.simulation.wear.jump import WearingContact
from asperity.simulation.wear.rows import Row, body_column, contact_row, roughness
from asperity.simulation.wear.state import WearState
from asperity.simulation.wear.store import WearRecorder, open_recorder
from asperity.simulation.wear.tracks import BODIES
from asperity.surface import MovingSurfaces
from asperity.wear import TrackPosition, longest_jump, surfaces_at

CELL_S = 2e-5  # computing time of a position, per cell [s]
TIME_TOLERANCE = 1e-12  # relative, of equal times

SolvedPositions = list[tuple[TrackPosition, SolvedPosition]]


class WearProgress(NamedTuple):
    """Progress of a wear history: hours done, hours requested, and the row of the current jump."""

    hours: float
    of_hours: float
    row: Row


@usual_float_errors
def run_wear(
    case: Case,
    *,
    hours: float,
    surfaces: MovingSurfaces | None = None,
    out: Path | None = None,
    workers: int = 1,
    progress: Callable[[WearProgress], None] | None = None,
) -> WearHistory:
    """Simulate the wear of a case.

    Parameters
    ----------
    case : with a [wear]; its [motion] states which body is rough, and the length of the tracks
    hours : of running
    surfaces : both bodies' tracks, in place of the case's own
    out : folder for the history; resumes it if it holds the same case's; None keeps it in memory
    workers : processes that solve positions in parallel; results do not depend on them
    progress : called before every jump, and at the end

    Raises
    ------
    BadInput
        for a case without [wear], hours that are not positive or fewer than the folder holds, a
        folder with other contents, or wear that needs too many jumps.
    NotConverged
        if more than half of a jump's positions could not be solved.
    AsperityError
        if the worn contact has grown to the edge of its grid, or worker processes cannot start.
    """
    if case.wear is None:
        raise BadInput(
            f"{case.source}: wear is left out; add [wear] with k, the wear coefficient of each body"
        )
    end = require_positive("hours of wear", hours, "h") * HOUR
    contact = WearingContact(case, case.wear, surfaces or case.moving_surfaces())
    _require_affordable(contact, end)
    began = time.perf_counter()
    with (
        open_recorder(contact, out) as recorder,
        position_solvers(contact.solver, workers) as solve,
    ):
        progress = progress or notebook_progress(
            "Wear",
            lambda state: (
                state.hours / state.of_hours,
                f"{state.hours:.3g} of {state.of_hours:.3g} h",
            ),
        )
        computed = _advance(contact, recorder, solve, end, progress)
        return recorder.history(time.perf_counter() - began, computed)


def _advance(
    contact: WearingContact,
    recorder: WearRecorder,
    solve: BatchSolver,
    end: float,
    progress: Callable[[WearProgress], None] | None,
) -> int:
    """Advance the history to `end`; return the number of jumps computed."""
    if recorder.end is not None and abs(recorder.end.worn.time - end) <= TIME_TOLERANCE * end:
        return 0
    _require_longer(recorder, end)
    state = recorder.worn
    at_end = False
    computed = 0
    while True:
        solutions, row = solve_positions(contact, state, solve)
        frame = WearFrame.from_solutions(state.number, state.time / HOUR, solutions)
        if not at_end:
            recorder.record(row, frame)
        if progress is not None:
            progress(WearProgress(state.time / HOUR, end / HOUR, row))
        if at_end:
            recorder.finish(state, row, frame)
            return computed
        seconds = contact.seconds(state, solutions)
        at_end = state.time + seconds >= end * (1.0 - TIME_TOLERANCE)
        if at_end:
            seconds = end - state.time
        state = contact.after_jump(state, solutions, seconds)
        computed += 1
        if not at_end:
            recorder.save(state)


def _require_longer(recorder: WearRecorder, end: float) -> None:
    """Raise BadInput for fewer hours than the folder holds."""
    folder = None if recorder.files is None else recorder.files.path
    duration = max(recorder.worn.time, 0.0 if recorder.end is None else recorder.end.worn.time)
    if duration >= end * (1.0 - TIME_TOLERANCE):
        raise BadInput(
            f"{folder} holds {duration / HOUR:.6g} h of wear, got {end / HOUR:.6g} h; state at "
            "least as many hours, or name a new folder"
        )


def solve_positions(
    contact: WearingContact, state: WearState, solve: BatchSolver
) -> tuple[SolvedPositions, Row]:
    """Solve the contact at every position of the jump; return the solutions and their row."""
    surfaces = contact.worn_surfaces(state)
    positions = contact.positions(state)
    outcomes = solve([surfaces_at(surfaces, position) for position in positions])
    solutions = [
        (position, outcome)
        for position, outcome in zip(positions, outcomes, strict=True)
        if isinstance(outcome, SolvedPosition)
    ]
    failures = [outcome.reason for outcome in outcomes if isinstance(outcome, FailedPosition)]
    if len(solutions) < max(1, (len(positions) + 1) // 2):
        when = f"after {state.time / HOUR:.4g} h"
        remedy = "raise solver.tolerance or solver.max_iterations"
        if len(positions) == 1:  # a mean over other positions is not possible
            remedy += ", or make the moving body the rough one (motion.rough, or the sign of slip)"
        raise NotConverged(
            None,
            f"{len(failures)} of {len(positions)} contacts could not be solved {when}: "
            f"{failures[0]}; {remedy}",
        )
    if any(solved.at_edge for _, solved in solutions):
        raise AsperityError(
            f"the contact has grown as wide as its grid after {state.time / HOUR:.4g} h; state a "
            "wider grid.y, in half-widths"
        )
    return solutions, _row(contact, state, solutions, len(failures))


def _row(contact: WearingContact, state: WearState, solutions: SolvedPositions, failed: int) -> Row:
    rough = roughness(contact.levelled(state))
    row: Row = {"jump": state.number, "hours": state.time / HOUR}
    for body in BODIES:
        depth = state.worn[body] - state.changed[body]
        track = contact.track(state, body)
        row |= {
            body_column("overrollings", body): state.time * contact.overrolling[body],
            body_column("worn_depth_m", body): float(depth[track].mean()),
            body_column("worn_depth_max_m", body): float(depth.max()),
            body_column("worn_volume_m3", body): contact.volume(depth, body),
            body_column("wear_rate_m3_s", body): contact.booked_rate(solutions, body),
            body_column("flattened_m", body): float(state.flattened[body][track].mean()),
        }
    row |= rough
    row |= contact_row(contact.case, [solved for _, solved in solutions], float(rough["sq_m"]))
    return row | {
        "jump_seconds": state.seconds,
        "jump_error": state.error,
        "failed": failed,
        **state.facts,
    }


def _require_affordable(contact: WearingContact, end: float) -> None:
    """Refuse wear that needs too many jumps, limited by the decay of its shortest waves."""
    zero = (contact.surfaces.first.heights * 0.0,) * 2
    grid = contact.case.grid
    modulus = contact.case.conditions.pair.reduced_modulus
    longest = longest_jump(
        contact.exposures(), zero, 1.0, contact.model.decay, grid.spacing, modulus
    )
    jumps = 1.0 if math.isinf(longest) else max(1.0, end / longest)
    require_affordable(
        f"wear of {end / HOUR:.6g} h in {jumps:.4g} jumps",
        memory=3000.0 * jumps,
        seconds=CELL_S * grid.cells[0] * grid.cells[1] * contact.patches * jumps,
    )
