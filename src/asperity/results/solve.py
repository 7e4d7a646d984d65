"""The main job: a case solved, on one surface or several of its kind, and read back from its file."""

import json
from collections.abc import Callable, Iterator
from concurrent.futures import BrokenExecutor, ProcessPoolExecutor, as_completed
from dataclasses import replace
from multiprocessing import get_context
from pathlib import Path
from typing import NamedTuple

from threadpoolctl import threadpool_limits

from asperity import ehl
from asperity.case import Case, load_case
from asperity.core.errors import AsperityError, BadInput, NotConverged, UnreadableFile
from asperity.core.processes import cores, set_up_worker
from asperity.core.storage import version_notes
from asperity.coupling import require_sampling
from asperity.results.run import RUN_GROUPS, Run, run_of
from asperity.results.surface_spread import Row
from asperity.solution import load_solution, solve_thermal_contact
from asperity.surface import Surface

WORTH_PROCESSES_S = 8.0  # of work, below which starting processes takes longer than they save

SurfaceProgress = Callable[[int, int], None]


def solve_case(
    case: Case,
    *,
    surface: Surface | None = None,
    surfaces: int | None = 1,
    workers: int = 1,
    progress: Callable[[ehl.Iteration], None] | None = None,
    surface_progress: SurfaceProgress | None = None,
    strict: bool = True,
    groups: tuple[str, ...] = RUN_GROUPS,
) -> Run:
    """Solve a case, and work out its vibration.

    Parameters
    ----------
    case : what to solve
    surface : composite roughness on the case's grid, in place of the case's own
    surfaces : how many surfaces of the case's kind to solve, with later seeds or at other places of a measured map;
        None: as many as the case's [solver] says or, if it does not, as `Case.surface_count` finds worth the wait. One
        where a `surface` is given, or the case has only one
    workers : processes for the surfaces after the first, where they are worth starting; 1 starts none
    progress : called after every step of the solver, of those that work in this process
    surface_progress : called with the surfaces that are done, and all of them
    strict : raise when the solver stops before its tolerance on the first surface; else the run says so. Others that
        fail are left out, and the run's notes say so
    groups : of the catalogue of quantities, whose numbers are worked out on every surface

    Raises
    ------
    BadInput
        for a surface that does not fit the case's grid, or cannot be made or read; more surfaces than a map holds.
    NotConverged
        if `strict`; its `solution` is the unfinished contact.
    AsperityError
        if worker processes cannot start.
    """
    if surface is not None:
        if surface.grid != case.grid:
            grids = f"got {surface.grid} where the case has {case.grid}"
            raise BadInput(f"surface must lie on the case's grid, {grids}; make it on case.grid")
        case = replace(case, stored=surface)
        surfaces = 1
    count = case.surface_count(surfaces)
    run = _first(case, progress, strict, groups)
    if count == 1 or not run.solution.convergence.converged:
        return run
    kind = [case.on_surface(number) for number in range(1, count)]
    rows: dict[int, Row] = {}
    failures: dict[int, str] = {}
    seconds = run.solution.convergence.seconds
    spread_out = workers > 1 and seconds * len(kind) > WORTH_PROCESSES_S
    outcomes = _in_processes(kind, groups, workers) if spread_out else _here(kind, groups, progress)
    for done, outcome in enumerate(outcomes, 1):
        if outcome.row is None:
            failures[outcome.number] = outcome.reason
        else:
            rows[outcome.number] = outcome.row
        if surface_progress is not None:
            surface_progress(done + 1, count)
    others = [rows[number] for number in sorted(rows)]
    left_out = [
        f"Surface {number + 1} of {count} was left out of means and intervals: {failures[number]}."
        for number in sorted(failures)
    ]
    notes = [*json.loads(run.solution.attributes["notes"]), *left_out]
    kept = {**run.solution.attributes, "notes": json.dumps(notes), "surfaces": json.dumps(others)}
    return run_of(
        case, replace(run.solution, attributes=kept), notes, others, run.vibration, groups
    )


def _first(
    case: Case,
    progress: Callable[[ehl.Iteration], None] | None,
    strict: bool,
    groups: tuple[str, ...],
) -> Run:
    """A case on its own surface."""
    roughness = case.surface()
    if case.vibration is not None:
        with case.naming("vibration"):
            require_sampling(
                case.conditions, case.vibration, roughness.sq
            )  # before the time a solution takes
    notes = (*case.surface_notes, *case.notes)
    kept = {"case": case.text, "notes": json.dumps(notes)}
    try:
        solution = solve_thermal_contact(
            case.conditions,
            case.lubricant,
            roughness,
            boundary_friction=case.boundary_friction,
            thermal=case.thermal,
            options=case.options,
            progress=progress,
            strict=strict,
        )
    except NotConverged as unfinished:
        raise NotConverged(replace(unfinished.solution, attributes=kept), str(unfinished)) from None
    return run_of(case, replace(solution, attributes=kept), notes, groups=groups)


class _Outcome(NamedTuple):
    """What became of a further surface: its numbers, or why there are none."""

    number: int
    row: Row | None
    reason: str = ""


def _outcome(
    number: int,
    case: Case,
    groups: tuple[str, ...],
    progress: Callable[[ehl.Iteration], None] | None = None,
) -> _Outcome:
    """One thread does the algebra: two would sum in another order, and processes are to change nothing."""
    try:
        with threadpool_limits(1):
            run = _first(case, progress, strict=True, groups=groups)
            return _Outcome(number, {**run.own_scalars, **run.crucial})
    except AsperityError as refusal:
        return _Outcome(number, None, str(refusal).rstrip("."))


def _here(
    kind: list[Case], groups: tuple[str, ...], progress: Callable[[ehl.Iteration], None] | None
) -> Iterator[_Outcome]:
    for number, case in enumerate(kind, 1):
        yield _outcome(number, case, groups, progress)


def _in_processes(kind: list[Case], groups: tuple[str, ...], workers: int) -> Iterator[_Outcome]:
    pool = ProcessPoolExecutor(
        min(workers, cores(), len(kind)), get_context("spawn"), set_up_worker
    )
    try:
        submitted = [
            pool.submit(_outcome, number, case, groups) for number, case in enumerate(kind, 1)
        ]
        for future in as_completed(submitted):
            yield future.result()
    except BrokenExecutor:
        raise AsperityError(
            "a worker process could not start or died, for want of memory perhaps; solve with fewer surfaces, or with "
            'workers=1 where the calling script is not a file with its calls under if __name__ == "__main__":'
        ) from None
    finally:
        pool.shutdown(wait=False, cancel_futures=True)


def load_run(path: str | Path) -> Run:
    """Read a run back: its fields as they were solved, everything else worked out from them anew.

    The numbers of further surfaces than the first are kept as they were.

    Raises
    ------
    UnreadableFile
        if the file is missing, damaged, or holds no case.
    """
    path = Path(path)
    solution = load_solution(path)
    try:
        text, notes = solution.attributes["case"], tuple(json.loads(solution.attributes["notes"]))
        others = json.loads(solution.attributes.get("surfaces", "[]"))
    except (KeyError, ValueError):
        alone = f"{path} holds a solution without its case"
        raise UnreadableFile(f"{alone}; save the run (Run.save), not its solution alone") from None
    case = load_case(text, folder=path.parent, name=str(path), stored=solution.surface)
    if (case.conditions, case.grid) != (solution.conditions, solution.grid) or (
        case.lubricant != solution.lubricant or case.options != solution.options
    ):
        raise UnreadableFile(
            f"{path} holds a case that is not the one solved in it; solve its case again"
        )
    case = replace(case, stored_notes=tuple(note for note in notes if note not in case.notes))
    return run_of(case, solution, (*version_notes(solution.versions), *notes), others)
