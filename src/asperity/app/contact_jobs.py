"""What worker processes do for the page: contacts coarsely and in full, reports; what is refused comes back as told.

A worker asks between steps of the solver whether its answer is still wanted, and stops where a
newer one is.
"""

import hashlib
import itertools
import math
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, NamedTuple

import numpy as np
from threadpoolctl import threadpool_limits

from asperity.app.contact_result import Answer, answer_of, coarse_answer
from asperity.app.settings import require_few
from asperity.case import Case
from asperity.contact.grid import Grid
from asperity.core.errors import AsperityError, BadInput
from asperity.core.processes import set_up_worker
from asperity.ehl import ContactSolution, Iteration, solve_contact
from asperity.paper import papers_case
from asperity.results import Run, load_run, solve_case
from asperity.surface import Surface

ReportWriter = Callable[
    [Sequence[Run], Path], Path
]  # `asperity.report.write_report`, which the command line hands in

COARSE = 64 * 64  # cells, at most, of a coarse answer
COARSER = 32 * 32  # cells, at most, where those are not solved in the steps that they are given
COARSE_TOLERANCE, WARM_STEPS, COLD_STEPS, COARSER_STEPS = 1e-2, 14, 40, 150
ALIKE = 0.9  # correlation with the roughness before, from which on its solution is the nearer start
LONGEST_S = 60.0  # that a contact is worked on


class Superseded(NamedTuple):
    """An answer that nobody waits for any more."""


class Refused(NamedTuple):
    """What could not be done, in a sentence."""

    sentence: str


class Ticket(NamedTuple):
    """Who asks, and how often it has asked: a later number makes this one superfluous; a slot below 0 is nobody's."""

    slot: int
    number: int


class _Unwanted(Exception):
    """Raised between two steps of the solver, where nobody waits for its answer."""


class _TooLong(Exception):
    """Raised between two steps of the solver, where it has taken longer than anybody waits."""


class _TooMany(Exception):
    """Raised between two steps of the solver, where it has taken as many as it was given."""


@dataclass(frozen=True)
class Coarse:
    """A coarse answer, and the solution that the next one starts from; neither where it could not be had in time."""

    answer: Answer | None
    solution: ContactSolution | None


_newest: Any = None  # the latest number of every slot, shared with the page's process


def set_up(newest: Any) -> None:
    """Begin as a worker of the page: one thread, ends with its parent, hears what is no longer wanted."""
    global _newest
    set_up_worker()
    _newest = newest
    threadpool_limits(1)


def _hook(ticket: Ticket, seconds: float, steps: float = math.inf) -> Callable[[Iteration], None]:
    """What the solver calls after every step."""
    end, taken = time.monotonic() + seconds, itertools.count(1)

    def asked(step: Iteration) -> None:  # noqa: ARG001 - only that there was one
        if next(taken) > steps:
            raise _TooMany
        if _newest is not None and ticket.slot >= 0 and _newest[ticket.slot] != ticket.number:
            raise _Unwanted
        if time.monotonic() > end:
            raise _TooLong

    return asked


def told(work: Callable[..., Any], *arguments: Any) -> Any:
    """What a piece of work gives; what it refuses comes back as a sentence, as not every error can travel."""
    try:
        return work(*arguments)
    except _Unwanted:
        return Superseded()
    except _TooLong:
        spent = f"The contact was given up after {LONGEST_S:.0f} s without a solution"
        return Refused(f"{spent}; asperity solve takes as long as it needs.")
    except AsperityError as refusal:
        return Refused(f"{str(refusal).rstrip('.')}.")
    except (ArithmeticError, np.linalg.LinAlgError) as failure:
        return Refused(
            f"The values lie too far from any contact to be reckoned with ({failure}); turn them back."
        )
    except MemoryError:
        return Refused("There is not memory enough for that; ask for less.")


def warm() -> float:
    """Solve a small contact, so that everything is loaded and compiled; the seconds that it took."""
    began = time.perf_counter()
    small = papers_case().with_overrides(
        {"grid.cells": [64, 64], "surface.correlation_length": "40 um"}
    )
    answer_of(solve_case(small, strict=False), 0.0)
    return time.perf_counter() - began


def solve_fully(ticket: Ticket, case: Case) -> Answer:
    """The contact on the case's own grid, with its error bars."""
    began = time.perf_counter()
    require_few(case.source, case.grid.cells)
    run = solve_case(case, strict=False, progress=_hook(ticket, LONGEST_S))
    return answer_of(run, time.perf_counter() - began)


def solve_coarsely(ticket: Ticket, case: Case, start: ContactSolution | None) -> Coarse:
    """The same contact on fewer cells, from the coarse solution before; nothing where the grid is so coarse itself.

    An attempt that takes more than its steps makes room for the next: without a start, then on
    fewer cells still.
    """
    began = time.perf_counter()
    require_few(case.source, case.grid.cells)
    whole = case.surface()
    surface, coarser = _coarser(whole, COARSE), _coarser(whole, COARSER)
    attempts: list[tuple[Surface | None, ContactSolution | None, int]]
    attempts = [(surface, None, COLD_STEPS), (coarser, None, COARSER_STEPS)]
    if start is not None and surface is not None and _alike(start.surface, surface):
        attempts.insert(0, (surface, start, WARM_STEPS))
    for cells, beginning, steps in attempts:
        if surface is None or cells is None:
            continue
        solution = _attempt(ticket, case, cells, beginning, steps)
        if solution is not None:
            return Coarse(coarse_answer(solution, case.text, time.perf_counter() - began), solution)
    return Coarse(None, None)


def _attempt(
    ticket: Ticket, case: Case, surface: Surface, start: ContactSolution | None, steps: int
) -> ContactSolution | None:
    """A coarse solution in at most so many steps of the solver; None where that, or so few cells, are not enough."""
    try:
        solution = solve_contact(
            case.conditions,
            case.lubricant,
            surface,
            options=replace(case.options, tolerance=max(COARSE_TOLERANCE, case.options.tolerance)),
            start=start,
            strict=False,
            progress=_hook(ticket, LONGEST_S, steps),
        )
    except (
        _TooMany,
        BadInput,
    ):  # what the contact is refused for on its own cells is said when it is solved on them
        return None
    return solution if solution.convergence.converged else None


def _alike(before: Surface, surface: Surface) -> bool:
    """Whether two surfaces have their hills in the same places, so that the contact before is near."""
    if before.grid.cells != surface.grid.cells:
        return False
    if before.sq == 0.0 or surface.sq == 0.0:
        return before.sq == surface.sq
    return bool(np.corrcoef(before.heights.ravel(), surface.heights.ravel())[0, 1] > ALIKE)


def _coarser(surface: Surface, most: int) -> Surface | None:
    """The surface on cells put together two by two until there are few, each with their mean, as the solver does it."""
    grid, together = surface.grid, 1
    nx, ny = grid.cells
    while (nx // together) * (ny // together) > most and nx % (2 * together) == ny % (
        2 * together
    ) == 0:
        together *= 2
    if together == 1:
        return None
    cells = (nx // together, ny // together)
    heights = surface.heights.reshape(cells[0], together, cells[1], together).mean(axis=(1, 3))
    return Surface(
        np.ascontiguousarray(heights), Grid(cells, grid.lower, grid.upper, periodic=grid.periodic)
    )


def open_run(path: Path) -> tuple[Case, Answer]:
    """A kept run: its case, with the roughness that was solved, and what the page shows of it."""
    run = load_run(path)
    return run.case, answer_of(run, run.solution.convergence.seconds)


def make_report(ticket: Ticket, case: Case, write: ReportWriter) -> str:
    """The page that `write` makes of the contact, as text."""
    run = solve_case(case, strict=False, progress=_hook(ticket, LONGEST_S))
    with TemporaryDirectory() as folder:
        return write([run], Path(folder) / "report.html").read_text("utf-8")


def open_surface(ticket: Ticket, case: Case, path: Path) -> tuple[Case, str, tuple[str, ...]]:  # noqa: ARG001
    """The case with a dropped surface in place of its own, what it is held by, and what was done to it."""
    moved = replace(case, folder=path.parent, stored=None, stored_notes=())
    changed = moved.with_overrides({"surface": {"file": path.name}})
    require_few(changed.source, changed.grid.cells)
    with path.open("rb") as file:
        digest = hashlib.file_digest(file, "sha256")
    digest.update(changed.text.encode())
    return (
        changed,
        digest.hexdigest()[:32],
        (f"Measured surface {path.name}:", *changed.surface_notes),
    )
