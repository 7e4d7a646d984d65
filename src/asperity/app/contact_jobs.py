"""Jobs of worker processes: coarse and full solutions, reports, dropped surfaces.

Between solver steps a worker checks whether its job has been superseded, and stops if so. Errors
are returned as `JobFailure`.
"""

import hashlib
import itertools
import math
import time
from collections.abc import Callable, MutableSequence, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import NamedTuple

import numpy as np
from threadpoolctl import threadpool_limits

from asperity.app.contact_result import ContactResult, coarse_result, result_of_run
from asperity.app.settings import limit_cells
from asperity.case import Case, MachineCase
from asperity.contact.grid import Grid
from asperity.core.errors import AsperityError, BadInput
from asperity.core.processes import set_up_worker
from asperity.ehl import ContactSolution, Iteration, solve_contact
from asperity.paper import papers_case
from asperity.results import FrictionPoint, Run, load_run, solve_case, stribeck_curve
from asperity.surface import Surface

ReportWriter = Callable[
    [Sequence[Run], Path], Path
]  # `asperity.report.write_report`, passed in by the command line

MachineDrawer = Callable[[MachineCase], tuple[str, str, str]]
"""Draws a machine: data URI, alternative text and caption; passed in by the command line."""

COARSE_CELLS = 64 * 64  # largest number of cells of a coarse solution
COARSEST_CELLS = 32 * 32  # the same, if that one does not converge within its steps
COARSE_TOLERANCE = 1e-2
WARM_STEPS = 14
COLD_STEPS = 40
COARSEST_STEPS = 150
MIN_CORRELATION = 0.9  # of two roughnesses for a warm start
TIME_LIMIT_S = 60.0  # for one contact


class Superseded(NamedTuple):
    """Outcome of a job that a newer one has replaced."""


class JobFailure(NamedTuple):
    """Outcome of a job that failed, with a message for the user."""

    message: str


class Drawing(NamedTuple):
    """Drawing of a machine as data URI, with its alternative text and caption."""

    uri: str
    alt: str
    caption: str


class Ticket(NamedTuple):
    """Session slot and job number; a higher number in the slot supersedes the job.

    A negative slot is never superseded.
    """

    slot: int
    number: int


class _SupersededError(Exception):
    """Raised between solver steps when the job has been superseded."""


class _TimeLimitError(Exception):
    """Raised between solver steps when the time limit is exceeded."""


class _StepLimitError(Exception):
    """Raised between solver steps when the step limit is reached."""


@dataclass(frozen=True)
class CoarseResult:
    """A coarse result and its solution as warm start; both None if it did not converge in time."""

    result: ContactResult | None
    solution: ContactSolution | None


# latest job number of each slot, shared with the server process
_newest: MutableSequence[int] | None = None


def set_up(newest: MutableSequence[int]) -> None:
    """Initialise a worker process: one thread, ends with its parent, shares the job numbers."""
    global _newest
    set_up_worker()
    _newest = newest
    threadpool_limits(1)


def _progress_hook(
    ticket: Ticket, seconds: float, steps: float = math.inf
) -> Callable[[Iteration], None]:
    """Return a callback for the solver that stops it at a limit or when superseded."""
    end = time.monotonic() + seconds
    step_numbers = itertools.count(1)

    def check(step: Iteration) -> None:  # noqa: ARG001 - only its occurrence matters
        if next(step_numbers) > steps:
            raise _StepLimitError
        if _newest is not None and ticket.slot >= 0 and _newest[ticket.slot] != ticket.number:
            raise _SupersededError
        if time.monotonic() > end:
            raise _TimeLimitError

    return check


def _solve(ticket: Ticket, case: Case) -> Run:
    """Solve a case within the time limit."""
    return solve_case(case, strict=False, progress=_progress_hook(ticket, TIME_LIMIT_S))


def run_job(work: Callable[..., object], *arguments: object) -> object:
    """Run a job; return errors as `JobFailure`, because not every exception can be pickled."""
    try:
        return work(*arguments)
    except _SupersededError:
        return Superseded()
    except _TimeLimitError:
        return JobFailure(
            f"No solution within {TIME_LIMIT_S:.0f} s. Use asperity solve, which has no time limit."
        )
    except AsperityError as error:
        return JobFailure(f"{str(error).rstrip('.')}.")
    except (ArithmeticError, np.linalg.LinAlgError) as error:
        return JobFailure(f"These values cannot be solved ({error}). Undo the last change.")
    except MemoryError:
        return JobFailure("Not enough memory. Use a coarser grid.")


def warm_up() -> float:
    """Solve a small contact to load and compile everything; return the time [s]."""
    start = time.perf_counter()
    smallest = {
        "grid.cells": [32, 32],
        "surface.correlation_length": "80 um",
        "solver.running_cells": 600,
    }
    case = papers_case().with_written(smallest)
    result_of_run(solve_case(case, strict=False), 0.0)
    return time.perf_counter() - start


def solve_fully(ticket: Ticket, case: Case) -> ContactResult:
    """Solve the contact on the grid of its case, with error bars."""
    start = time.perf_counter()
    limit_cells(case.source, case.grid.cells)
    run = _solve(ticket, case)
    return result_of_run(run, time.perf_counter() - start)


def solve_at_speed(ticket: Ticket, case: Case, speed: float) -> FrictionPoint:
    """Solve the contact at another entrainment speed [m/s], as a point of its Stribeck curve."""
    limit_cells(case.source, case.grid.cells)
    curve = stribeck_curve(case, speeds=[speed], progress=_progress_hook(ticket, TIME_LIMIT_S))
    return curve.points[0]


def solve_coarsely(ticket: Ticket, case: Case, start: ContactSolution | None) -> CoarseResult:
    """Solve the contact on fewer cells; the result is empty if its own grid is as coarse.

    Attempts with a limited number of steps, in this order: warm start from `start`, cold start,
    cold start on still fewer cells.
    """
    begin = time.perf_counter()
    limit_cells(case.source, case.grid.cells)
    fine = case.surface()
    coarse = _coarsen(fine, COARSE_CELLS)
    coarsest = _coarsen(fine, COARSEST_CELLS)
    attempts: list[tuple[Surface | None, ContactSolution | None, int]]
    attempts = [(coarse, None, COLD_STEPS), (coarsest, None, COARSEST_STEPS)]
    if start is not None and coarse is not None and _are_similar(start.surface, coarse):
        attempts.insert(0, (coarse, start, WARM_STEPS))
    for surface, warm_start, steps in attempts:
        if coarse is None or surface is None:
            continue
        solution = _attempt(ticket, case, surface, warm_start, steps)
        if solution is not None:
            seconds = time.perf_counter() - begin
            result = coarse_result(solution, case.text, seconds, moving=case.is_running)
            return CoarseResult(result, solution)
    return CoarseResult(None, None)


def _attempt(
    ticket: Ticket, case: Case, surface: Surface, start: ContactSolution | None, steps: int
) -> ContactSolution | None:
    """Solve with a step limit; None if it does not converge or the grid is too coarse."""
    try:
        solution = solve_contact(
            case.conditions,
            case.lubricant,
            surface,
            options=replace(case.options, tolerance=max(COARSE_TOLERANCE, case.options.tolerance)),
            start=start,
            strict=False,
            progress=_progress_hook(ticket, TIME_LIMIT_S, steps),
        )
    except (_StepLimitError, BadInput):  # the full solution reports bad input
        return None
    return solution if solution.convergence.converged else None


def _are_similar(before: Surface, surface: Surface) -> bool:
    """Return True if two surfaces correlate enough for a warm start."""
    if before.grid.cells != surface.grid.cells:
        return False
    if before.sq == 0.0 or surface.sq == 0.0:
        return before.sq == surface.sq
    return bool(
        np.corrcoef(before.heights.ravel(), surface.heights.ravel())[0, 1] > MIN_CORRELATION
    )


def _coarsen(surface: Surface, max_cells: int) -> Surface | None:
    """Average a surface over 2 x 2 cells repeatedly until at most `max_cells` remain."""
    grid, factor = surface.grid, 1
    nx, ny = grid.cells
    while (nx // factor) * (ny // factor) > max_cells and nx % (2 * factor) == ny % (
        2 * factor
    ) == 0:
        factor *= 2
    if factor == 1:
        return None
    cells = (nx // factor, ny // factor)
    heights = surface.heights.reshape(cells[0], factor, cells[1], factor).mean(axis=(1, 3))
    return Surface(
        np.ascontiguousarray(heights), Grid(cells, grid.lower, grid.upper, periodic=grid.periodic)
    )


def open_run(path: Path) -> tuple[Case, ContactResult]:
    """Load a stored run; return its case and result."""
    run = load_run(path)
    return run.case, result_of_run(run, run.solution.convergence.seconds)


def draw_machine(ticket: Ticket, machine: MachineCase, draw: MachineDrawer) -> Drawing:  # noqa: ARG001
    """Draw a machine to scale."""
    return Drawing(*draw(machine))


def make_report(ticket: Ticket, case: Case, write: ReportWriter) -> str:
    """Solve the contact and return its HTML report."""
    run = _solve(ticket, case)
    with TemporaryDirectory() as folder:
        return write([run], Path(folder) / "report.html").read_text("utf-8")


def open_surface(ticket: Ticket, case: Case, path: Path) -> tuple[Case, str, tuple[str, ...]]:  # noqa: ARG001
    """Return the case with a dropped surface, its key, and the processing steps of the surface."""
    relocated = replace(case, folder=path.parent, stored=None, stored_notes=())
    changed = relocated.with_written({"surface": {"file": path.name}})
    limit_cells(changed.source, changed.grid.cells)
    with path.open("rb") as file:
        digest = hashlib.file_digest(file, "sha256")
    digest.update(changed.text.encode())
    return (
        changed,
        digest.hexdigest()[:32],
        (f"Measured surface {path.name}:", *changed.surface_notes),
    )
