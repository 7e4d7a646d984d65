"""Solving of cases, on one or several surfaces, and loading of stored runs."""

import json
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import BrokenExecutor, ProcessPoolExecutor, as_completed
from dataclasses import replace
from multiprocessing import get_context
from pathlib import Path
from typing import NamedTuple

from threadpoolctl import threadpool_limits

from asperity import ehl
from asperity.case import Case, load_case
from asperity.core.arrays import usual_float_errors
from asperity.core.errors import AsperityError, BadInput, NotConverged, UnreadableFile
from asperity.core.notebook import count_progress
from asperity.core.processes import cores, set_up_worker
from asperity.core.storage import version_notes
from asperity.coupling import Vibration, contact_vibration, require_sampling
from asperity.ehl import ContactSolution
from asperity.results.determined import Determined
from asperity.results.run import RUN_GROUPS, Run
from asperity.results.running import Running, TrackProgress, mean_state, run_tracks, running_error
from asperity.results.surface_spread import Row, total_error
from asperity.results.uncertainty_text import threshold_note
from asperity.solution import contact_state, load_solution, solution_notes, solve_thermal_contact
from asperity.surface import Surface

MIN_PARALLEL_S = 8.0  # work below which starting processes takes longer than it saves

SurfaceProgress = Callable[[int, int], None]


@usual_float_errors
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
    """Solve a case and compute its vibration.

    Parameters
    ----------
    case : case to solve
    surface : composite roughness on the case's grid, instead of the case's own
    surfaces : number of surfaces of the case's kind to solve, with consecutive seeds or at other
        places of a measured map; None: as the case's [solver] states, or else `Case.surface_count`.
        One if a `surface` is given or the case has only one
    workers : processes for the surfaces after the first, started if worthwhile; 1 starts none
    progress : called after every solver iteration in this process; for running roughness, after
        every time step
    surface_progress : called with the number of surfaces, or of time steps, done and in total
    strict : raise if the first surface does not converge; otherwise the run states it. Other
        surfaces that fail are omitted, with a note
    groups : groups of the catalogue that are evaluated on every surface

    Raises
    ------
    BadInput
        for a surface that does not fit the case's grid, or cannot be generated or read; or more
        surfaces than a map contains.
    NotConverged
        if `strict`; its `solution` is the last iterate.
    AsperityError
        if worker processes cannot start.
    """
    if surface is not None:
        if surface.grid != case.grid:
            raise BadInput(
                f"surface must be on the case's grid {case.grid}, got {surface.grid}; generate it "
                "on case.grid"
            )
        case = replace(case, stored=surface)
        surfaces = 1
    if surface_progress is None:
        items = "time steps" if case.is_running else "surfaces"
        surface_progress = count_progress("Solving", items)
    if case.is_running:
        steps = TrackProgress(progress, surface_progress)
        return _running(case, surfaces, workers, steps, strict, groups)
    count = case.surface_count(surfaces)
    run = _first(case, progress, strict, groups)
    if count == 1 or not run.solution.convergence.converged:
        return run
    return _with_further_surfaces(run, count, workers, progress, surface_progress)


def _with_further_surfaces(
    run: Run,
    count: int,
    workers: int,
    progress: Callable[[ehl.Iteration], None] | None,
    surface_progress: SurfaceProgress | None,
) -> Run:
    """Return the run with the numbers of `count` surfaces, its own included."""
    case, groups = run.case, run.groups
    further_cases = [case.on_surface(number) for number in range(1, count)]
    seconds = run.solution.convergence.seconds
    parallel = workers > 1 and seconds * len(further_cases) > MIN_PARALLEL_S
    outcomes = (
        _in_processes(further_cases, groups, workers)
        if parallel
        else _in_this_process(further_cases, groups, progress)
    )
    others, exclusions = _collect(outcomes, count, surface_progress)
    notes = [*json.loads(run.solution.attributes["notes"]), *exclusions]
    attributes = {
        **run.solution.attributes,
        "notes": json.dumps(notes),
        "surfaces": json.dumps(others),
    }
    return run_of(
        case, replace(run.solution, attributes=attributes), notes, others, run.vibration, groups
    )


def _running(
    case: Case,
    tracks: int | None,
    workers: int,
    progress: TrackProgress,
    strict: bool,
    groups: tuple[str, ...],
) -> Run:
    """Solve a case whose roughness moves: means over time of the running contact."""
    count = case.surface_count(tracks)
    _require_sampling(case)
    notes = [*case.surface_notes, *case.notes]
    attributes = {"case": case.text, "notes": json.dumps(notes), "running": json.dumps(None)}
    try:
        running, solution, remarks = run_tracks(
            case, tracks=count, workers=workers, progress=progress
        )
    except NotConverged as failure:
        solution = replace(failure.solution, attributes=attributes)
        if strict:
            raise NotConverged(solution, str(failure)) from None
        return run_of(case, solution, notes, groups=groups)
    notes += remarks
    attributes |= {"notes": json.dumps(notes), "running": running.to_json()}
    solution = replace(solution, attributes=attributes)
    run = run_of(case, solution, notes, groups=groups, running=running)
    if strict and not run.converged:
        failed = f"{running.failed} of {running.steps} time steps did not converge"
        raise NotConverged(solution, f"contact not solved: {failed}")
    return run


def _require_sampling(case: Case) -> None:
    """Check the sampling of the vibration before the solution, which takes longer."""
    if case.vibration is not None:
        with case.naming("vibration"):
            require_sampling(case.conditions, case.vibration, case.surface().sq)


def _collect(
    outcomes: Iterator["_Outcome"], count: int, surface_progress: SurfaceProgress | None
) -> tuple[list[Row], list[str]]:
    """Return the rows of further surfaces in order, and notes on those that failed."""
    rows: dict[int, Row] = {}
    failures: dict[int, str] = {}
    for finished, outcome in enumerate(outcomes, 1):
        if outcome.row.value is None:
            failures[outcome.number] = outcome.row.reason.rstrip(".")
        else:
            rows[outcome.number] = outcome.row.value
        if surface_progress is not None:
            surface_progress(finished + 1, count)
    exclusions = [
        f"Surface {number + 1} of {count} is excluded from means and intervals: {failures[number]}."
        for number in sorted(failures)
    ]
    return [rows[number] for number in sorted(rows)], exclusions


def _first(
    case: Case,
    progress: Callable[[ehl.Iteration], None] | None,
    strict: bool,
    groups: tuple[str, ...],
) -> Run:
    """Solve a case on its own surface."""
    roughness = case.surface()
    _require_sampling(case)
    notes = (*case.surface_notes, *case.notes)
    attributes = {"case": case.text, "notes": json.dumps(notes)}
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
    except NotConverged as failure:
        raise NotConverged(replace(failure.solution, attributes=attributes), str(failure)) from None
    return run_of(case, replace(solution, attributes=attributes), notes, groups=groups)


class _Outcome(NamedTuple):
    """Numbers of a further surface, if determined."""

    number: int
    row: Determined[Row]


def _outcome(
    number: int,
    case: Case,
    groups: tuple[str, ...],
    progress: Callable[[ehl.Iteration], None] | None = None,
) -> _Outcome:
    """Solve a further surface, with one thread for the algebra.

    Several threads would sum in another order, but processes must not change results.
    """

    def row() -> Row:
        run = _first(case, progress, strict=True, groups=groups)
        return {**run.own_scalars, **run.summary_row}

    with threadpool_limits(1):
        return _Outcome(number, Determined.attempt(row))


def _in_this_process(
    further_cases: list[Case],
    groups: tuple[str, ...],
    progress: Callable[[ehl.Iteration], None] | None,
) -> Iterator[_Outcome]:
    for number, case in enumerate(further_cases, 1):
        yield _outcome(number, case, groups, progress)


def _in_processes(
    further_cases: list[Case], groups: tuple[str, ...], workers: int
) -> Iterator[_Outcome]:
    pool = ProcessPoolExecutor(
        min(workers, cores(), len(further_cases)), get_context("spawn"), set_up_worker
    )
    try:
        submitted = [
            pool.submit(_outcome, number, case, groups)
            for number, case in enumerate(further_cases, 1)
        ]
        for future in as_completed(submitted):
            yield future.result()
    except BrokenExecutor:
        raise AsperityError(
            "a worker process could not start or died, possibly for lack of memory; solve fewer "
            "surfaces, or use "
            'workers=1 if the calling script does not guard its calls by if __name__ == "__main__":'
        ) from None
    finally:
        pool.shutdown(wait=False, cancel_futures=True)


def run_of(
    case: Case,
    solution: ContactSolution,
    notes: Sequence[str],
    others: Sequence[Row] = (),
    vibration: Vibration | None = None,
    groups: tuple[str, ...] = RUN_GROUPS,
    running: Running | None = None,
) -> Run:
    """Return the run of a solved case; its vibration is computed unless given.

    `others` are the numbers of further surfaces, of these `groups` of the catalogue; `running` has
    the means of a running contact of which the `solution` is a moment.
    """
    state = contact_state(solution)
    if running is not None:
        state = mean_state(state, running)
    model = case.vibration
    if model is not None and vibration is None:
        with case.naming("vibration"):
            vibration = contact_vibration(state, case.conditions, model, solution=solution)
    notes = (*notes, *solution_notes(solution, standing=running is None))
    if solution.options.model == "conserving":
        notes = (*notes, threshold_note(solution))
    if not solution.convergence.converged:
        standing = running is None and case.roughness_moves
        remedy = 'contact.roughness = "running"' if standing else "other grid.cells"
        notes = (f"Not converged: {solution.convergence.explain()}. Try {remedy}.", *notes)
    rows = tuple(others)
    run = Run(
        case=case,
        solution=solution,
        state=state,
        vibration=vibration,
        notes=notes,
        others=rows,
        groups=groups,
        running=running,
    )
    row, conditions = run.summary_row, case.conditions
    if running is None:
        error = total_error(state, (row, *others), conditions, model, vibration)
    else:
        error = running_error(state, row, running, conditions, model, vibration)
    return replace(run, state=replace(state, error=error))


def load_run(path: str | Path) -> Run:
    """Load a run: stored fields, with all derived quantities recomputed.

    The numbers of surfaces after the first are those stored.

    Raises
    ------
    UnreadableFile
        if the file is missing, damaged, or contains no case.
    """
    path = Path(path)
    solution = load_solution(path)
    try:
        text = solution.attributes["case"]
        notes = tuple(json.loads(solution.attributes["notes"]))
        others = json.loads(solution.attributes.get("surfaces", "[]"))
        moving = "running" in solution.attributes
        running = Running.from_json(solution.attributes["running"]) if moving else None
    except (KeyError, TypeError, ValueError):
        raise UnreadableFile(
            f"{path} contains a solution without its case; save the run (Run.save), not the "
            "solution"
        ) from None
    stored = None if moving else solution.surface  # tracks are generated or read again
    case = load_case(text, folder=path.parent, name=str(path), stored=stored)
    grid, options = solution.grid, case.options
    if moving:  # has its own cells and tolerance; a chosen grid would read the measurement again
        options = replace(options, tolerance=solution.options.tolerance)
    else:
        grid = case.grid
    if (case.conditions, grid) != (solution.conditions, solution.grid) or (
        case.lubricant != solution.lubricant or options != solution.options
    ):
        raise UnreadableFile(
            f"{path} contains a case that differs from its solution; solve the case again"
        )
    if not moving:
        own_notes = case.notes
        case = replace(case, stored_notes=tuple(note for note in notes if note not in own_notes))
    notes = (*version_notes(solution.versions), *notes)
    return run_of(case, solution, notes, others, running=running)
