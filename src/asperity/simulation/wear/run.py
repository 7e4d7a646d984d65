"""A case let wear for hours: contacts solved, jumps taken, each kept; nothing is solved here."""

import math
import time
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

from asperity.case import Case
from asperity.core.errors import AsperityError, BadInput, NotConverged, require_positive
from asperity.core.limits import require_affordable
from asperity.simulation.wear.contact import Crew, FailedPosition, SolvedPosition, crew
from asperity.simulation.wear.frames import WearFrame
from asperity.simulation.wear.history import HOUR, WearHistory
from asperity.simulation.wear.jump import BODIES, WearingContact
from asperity.simulation.wear.rows import Row, body_column, contact_row, roughness
from asperity.simulation.wear.state import WearState
from asperity.simulation.wear.store import Keeper, open_keeper
from asperity.surface import MovingSurfaces
from asperity.wear import TrackPosition, combined_roughness, longest_jump

CELL_S = 2e-5  # that a position takes, a cell
SAME = 1e-12  # of a time, by which two are one

At = list[tuple[TrackPosition, SolvedPosition]]


class WearProgress(NamedTuple):
    """How far a wear history is: hours, of how many, and the row of the jump that was just looked at."""

    hours: float
    of_hours: float
    row: Row


def run_wear(
    case: Case,
    *,
    hours: float,
    surfaces: MovingSurfaces | None = None,
    out: Path | None = None,
    workers: int = 1,
    progress: Callable[[WearProgress], None] | None = None,
) -> WearHistory:
    """Let a case wear.

    Parameters
    ----------
    case : with a [wear]; its [motion] says which body is rough, and how long the tracks are
    hours : of running
    surfaces : both bodies' tracks, in place of the case's own
    out : folder to keep the history in, and to go on from where it holds the same case's; None keeps it in memory
    workers : processes that solve positions of the tracks at once; they change no number
    progress : called before every jump, and at the end

    Raises
    ------
    BadInput
        for a case without [wear], hours that are not positive, fewer than the folder holds, a folder that holds
        something else, or wear that is too fast for its jumps to come to an end.
    NotConverged
        where more than half of a jump's positions could not be solved.
    AsperityError
        where the worn contact has grown to the edge of its grid, or worker processes cannot start.
    """
    if case.wear is None:
        raise BadInput(
            f"{case.source}: wear is left out; add [wear] with k, the wear coefficient of each body"
        )
    end = require_positive("hours of wear", hours, "h") * HOUR
    ageing = WearingContact(case, case.wear, surfaces or case.moving_surfaces())
    _require_affordable(ageing, end)
    began = time.perf_counter()
    with open_keeper(ageing, out) as keeper, crew(ageing.solver, workers) as solve:
        computed = _go_on(ageing, keeper, solve, end, progress)
        return keeper.history(time.perf_counter() - began, computed)


def _go_on(
    ageing: WearingContact,
    keeper: Keeper,
    solve: Crew,
    end: float,
    progress: Callable[[WearProgress], None] | None,
) -> int:
    """Jump to the end, from where the history is; the number of jumps taken."""
    if keeper.end is not None and abs(keeper.end.worn.time - end) <= SAME * end:
        return 0
    held = max(keeper.worn.time, 0.0 if keeper.end is None else keeper.end.worn.time)
    if held >= end * (1.0 - SAME):
        raise BadInput(
            f"{keeper.folder} holds {held / HOUR:.6g} h of wear, got {end / HOUR:.6g} h; ask for as many "
            "or more, or name a new folder"
        )
    worn, at_end, computed = keeper.worn, False, 0
    while True:
        at, row = look(ageing, worn, solve)
        frame = WearFrame.of(worn.number, worn.time / HOUR, at)
        if not at_end:
            keeper.take(row, frame)
        if progress is not None:
            progress(WearProgress(worn.time / HOUR, end / HOUR, row))
        if at_end:
            keeper.finish(worn, row, frame)
            return computed
        seconds = ageing.seconds(worn, at)
        at_end = worn.time + seconds >= end * (1.0 - SAME)
        if at_end:
            seconds = end - worn.time
        worn = ageing.jumped(worn, at, seconds)
        computed += 1
        if not at_end:
            keeper.keep(worn)


def look(ageing: WearingContact, worn: WearState, solve: Crew) -> tuple[At, Row]:
    """The contact as it is now, at every position of the jump, and its row."""
    surfaces, places = ageing.worn_surfaces(worn), ageing.positions(worn)
    outcomes = solve([combined_roughness(surfaces, place) for place in places])
    at = [
        (place, one)
        for place, one in zip(places, outcomes, strict=True)
        if isinstance(one, SolvedPosition)
    ]
    failures = [one.reason for one in outcomes if isinstance(one, FailedPosition)]
    if len(at) < max(1, (len(places) + 1) // 2):
        when = f"after {worn.time / HOUR:.4g} h"
        remedy = "raise solver.tolerance or solver.max_iterations"
        if len(places) == 1:  # there is no other to take the mean of
            remedy += ", or let the rough body be the one that moves (motion.rough, or a slip of the other sign)"
        raise NotConverged(
            None,
            f"{len(failures)} of {len(places)} contacts could not be solved {when}: {failures[0]}; {remedy}",
        )
    if any(one.at_edge for _, one in at):
        raise AsperityError(
            f"the contact has grown as wide as its grid after {worn.time / HOUR:.4g} h; state a wider grid.y, in "
            "half-widths"
        )
    return at, _row(ageing, worn, at, len(failures))


def _row(ageing: WearingContact, worn: WearState, at: At, failed: int) -> Row:
    rough = roughness(ageing.levelled(worn))
    row: Row = {"jump": worn.number, "hours": worn.time / HOUR}
    for body in BODIES:
        depth, track = worn.worn[body] - worn.changed[body], ageing.track(worn, body)
        row |= {
            body_column("overrollings", body): worn.time * ageing.overrolling[body],
            body_column("worn_depth_m", body): float(depth[track].mean()),
            body_column("worn_depth_max_m", body): float(depth.max()),
            body_column("worn_volume_m3", body): ageing.volume(depth, body),
            body_column("flattened_m", body): float(worn.flattened[body][track].mean()),
        }
    row |= rough
    row |= contact_row(ageing.case, [one for _, one in at], float(rough["sq_m"]))
    return row | {
        "jump_seconds": worn.seconds,
        "jump_error": worn.error,
        "failed": failed,
        **worn.facts,
    }


def _require_affordable(ageing: WearingContact, end: float) -> None:
    """Refuse wear so fast that its shortest waves ask for more jumps than anybody can wait for."""
    nothing, grid = (ageing.surfaces.first.heights * 0.0,) * 2, ageing.case.grid
    modulus = ageing.case.conditions.pair.reduced_modulus
    longest = longest_jump(
        ageing.exposures(), nothing, 1.0, ageing.model.decay, grid.spacing, modulus
    )
    jumps = 1.0 if math.isinf(longest) else max(1.0, end / longest)
    require_affordable(
        f"wear of {end / HOUR:.6g} h in {jumps:.4g} jumps",
        memory=3000.0 * jumps,
        seconds=CELL_S * grid.cells[0] * grid.cells[1] * ageing.patches * jumps,
    )
