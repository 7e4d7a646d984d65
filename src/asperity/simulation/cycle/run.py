"""Solve a contact over a cycle: film in time, then the rough contact around some instants."""

import math
import time
from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import replace
from functools import partial
from multiprocessing import get_context
from typing import NamedTuple

import numpy as np
from scipy.special import stdtrit

from asperity.case import Case
from asperity.contact.cycle import OperatingCycle
from asperity.core.arrays import Field
from asperity.core.coverage import UPPER
from asperity.core.errors import AsperityError, BadInput
from asperity.core.processes import cores, set_up_worker
from asperity.simulation.cycle.film import (
    FilmCourse,
    default_outputs,
    film_course,
    half_the_cells,
    steady_films,
)
from asperity.simulation.cycle.instants import (
    InstantJob,
    InstantRow,
    case_at,
    solve_instant,
)
from asperity.simulation.cycle.result import CycleInstant, CycleResult
from asperity.solution import friction, heats_inlet
from asperity.transient import Snapshot
from asperity.wear import WearCoefficient

INSTANTS = 12  # of a cycle at which the rough contact is solved
TRACKS = 3  # surfaces at each of them
MAX_INSTANTS = 200


class CycleProgress(NamedTuple):
    """Progress: share of the smooth film done, rough contacts solved, and of how many."""

    film: float
    solved: int
    total: int


def solve_cycle(
    case: Case,
    cycle: OperatingCycle | None = None,
    *,
    instants: int | Sequence[float] | None = None,
    start: str | None = None,
    workers: int | None = None,
    progress: Callable[[CycleProgress], None] | None = None,
) -> CycleResult:
    """Solve a contact over a cycle of load, speeds and radius.

    The film of the smooth bodies is solved in time over the whole cycle, with squeeze. The rough
    contact is solved in time around some instants, with roughness that moves with its bodies.

    Parameters
    ----------
    case : bodies, oil, surfaces and wear coefficients
    cycle : default: that of the case's [cycle]
    instants : number of instants of the rough contact, between which the conditions change about
        equally, or their times [s]; default: the case's
    start : "steady" or "stationary"; default: the case's
    workers : processes for the rough contacts; default: the number of processors
    progress : called after time steps and rough contacts

    Raises
    ------
    BadInput
        without an oil or a cycle, for times outside the cycle, and as `cycle_contact`.
    """
    began = time.perf_counter()
    lubricant = case.lubricant
    if lubricant is None:
        raise BadInput(f"{case.source}: a cycle needs an oil; add [lubricant]")
    section = case.contents.cycle
    if cycle is None:
        if section is None:
            raise BadInput(f"{case.source}: there is no cycle; add [cycle]")
        with case.naming("cycle"):
            cycle = section.cycle(case.conditions, case.folder)
    start = start or ("steady" if section is None else section.start)
    if instants is None:
        instants = INSTANTS if section is None else section.instants
    times = _instant_times(cycle, instants)
    rough = case.surface().sq > 0.0
    outputs = np.unique(np.concatenate([default_outputs(cycle), times]))
    report = progress or _ignore

    solve = partial(
        film_course,
        cycle,
        case.conditions,
        lubricant,
        start=start,
        outputs=outputs,
        options=case.options,
        measure=None if rough else _friction_of(case),
        progress=lambda share: report(CycleProgress(share, 0, len(times))),
    )
    film = solve()
    coarse, unknown = None, ""
    try:
        coarse = solve(grid=half_the_cells(film.grid))
    except AsperityError as error:
        unknown = str(error)
    steady = steady_films(cycle, case.conditions, lubricant, film.grid, times, case.options)
    solved: tuple[CycleInstant, ...] = ()
    if rough:
        solved = _solve_instants(case, cycle, times, start, workers, report)
    return CycleResult(
        case=case,
        cycle=cycle,
        film=film,
        coarse=coarse,
        steady_times=times,
        steady=steady,
        instants=solved,
        wear_coefficients=_wear_coefficients(case),
        seconds=time.perf_counter() - began,
        notes=_notes(case, cycle, film, unknown, times),
    )


def _ignore(_: CycleProgress) -> None:
    """Show no progress."""


def _friction_of(case: Case) -> Callable[[Snapshot], dict[str, float]]:
    """Return a function that measures the friction of a smooth contact."""

    def measure(snapshot: Snapshot) -> dict[str, float]:
        rubbing = friction(
            snapshot.solution, boundary_friction=case.boundary_friction, thermal=case.thermal
        )
        return {"friction_coefficient": rubbing.coefficient}

    return measure


def _instant_times(cycle: OperatingCycle, instants: int | Sequence[float]) -> Field:
    """Return the times of the instants [s]; of a cycle that repeats, without its end."""
    if isinstance(instants, int):
        if not 2 <= instants <= MAX_INSTANTS:
            raise BadInput(f"instants must be 2 to {MAX_INSTANTS}, got {instants}; 12 are usual")
        steps = instants if cycle.repeats else instants - 1
        return cycle.even_times(steps)[:instants]
    times = np.unique(np.asarray(instants, float))
    if not len(times) or times[0] < 0.0 or times[-1] > cycle.period:
        raise BadInput(
            f"instants must lie between 0 and the period of {cycle.period:g} s, got "
            f"{np.array2string(times, threshold=6)}"
        )
    return times


def _wear_coefficients(case: Case) -> tuple[WearCoefficient, WearCoefficient] | None:
    """Return Archard's coefficients of both bodies that remove as much; None if not stated."""
    if case.wear is None:
        return None
    share = case.wear.law.equivalent_coefficient(1.0, case.boundary_friction)
    first, second = (replace(body, k=body.k / share) for body in case.wear.coefficients)
    return first, second


def _solve_instants(
    case: Case,
    cycle: OperatingCycle,
    times: Field,
    start: str,
    workers: int | None,
    progress: Callable[[CycleProgress], None],
) -> tuple[CycleInstant, ...]:
    """Solve the rough contact at all instants, the first surface on two grids."""
    stated = case.contents.solver.surfaces
    case = case.among_many
    tracks = case_at(case, cycle, float(times[0]))[0].surface_count(stated or TRACKS)
    jobs = [
        InstantJob(case, cycle, float(moment), number, coarse, start)
        for moment in times
        for number, coarse in [(0, False), *((number, True) for number in range(tracks))]
    ]
    rows = _run_jobs(jobs, workers, progress)
    per_instant = tracks + 1
    fallback = [
        job._replace(coarse=False)
        for job, row in zip(jobs, rows, strict=True)
        if job.coarse and row.reason and job.surface > 0
    ]
    numbers = [(job.time, job.surface) for job in fallback]
    again = dict(zip(numbers, _run_jobs(fallback, workers, progress), strict=True))
    groups = []
    for index, moment in enumerate(times):
        own = slice(index * per_instant, (index + 1) * per_instant)
        fine, *coarse = rows[own]
        further = [again.get((job.time, job.surface)) for job in jobs[own][2:]]
        groups.append(_combined(float(moment), fine, coarse, [row for row in further if row]))
    return tuple(groups)


def _run_jobs(
    jobs: list[InstantJob], workers: int | None, progress: Callable[[CycleProgress], None]
) -> list[InstantRow]:
    """Solve jobs in parallel processes, in the order of the jobs."""
    count = min(workers or cores(), len(jobs))
    if count < 2:
        rows = []
        for number, job in enumerate(jobs, 1):
            rows.append(solve_instant(job))
            progress(CycleProgress(1.0, number, len(jobs)))
        return rows
    with ProcessPoolExecutor(count, get_context("spawn"), set_up_worker) as pool:
        futures = [pool.submit(solve_instant, job) for job in jobs]
        for number, _ in enumerate(as_completed(futures), 1):
            progress(CycleProgress(1.0, number, len(jobs)))
        return [future.result() for future in futures]


def _combined(
    moment: float, fine: InstantRow, coarse: list[InstantRow], further: list[InstantRow]
) -> CycleInstant:
    """Combine the tracks of an instant.

    The mean is that of the coarse grid over all tracks, corrected by the difference of both grids
    on the first; without a coarse grid, the mean of the fine one, whose error is not determined.
    """
    if fine.reason:
        return CycleInstant(time=moment, numbers={}, half_widths={}, reason=fine.reason)
    same = not coarse[0].reason
    others = [row for row in (coarse[1:] if same else further) if not row.reason]
    numbers, half_widths = dict(fine.numbers), dict[str, float | None]()
    for key, value in fine.numbers.items():
        if key == "flash_temperature_max_k":
            continue
        change = value - coarse[0].numbers[key] if same else 0.0
        values = [row.numbers[key] + change for row in others]
        numbers[key] = float(np.mean([value, *values]))
        half_widths[key] = math.hypot(_half_width([value, *values]), change) if same else None
        if math.isinf(half_widths[key] or 0.0):
            half_widths[key] = None
    sides = numbers.pop("friction_below"), numbers.pop("friction_above")
    for key in ("clr", "car"):
        numbers[key] = min(max(numbers[key], 0.0), 1.0)
    return CycleInstant(
        time=moment,
        numbers=numbers,
        half_widths=half_widths,
        friction_sides=(max(sides[0], 0.0), max(sides[1], 0.0)),
        tracks=1 + len(others),
    )


def _half_width(values: list[float]) -> float:
    """Return the 90 % half-width of a mean; infinite for a single value."""
    count = len(values)
    if count < 2:
        return math.inf
    return float(stdtrit(count - 1, UPPER) * np.std(values, ddof=1) / math.sqrt(count))


def _notes(
    case: Case, cycle: OperatingCycle, film: FilmCourse, unknown: str, times: Field
) -> tuple[str, ...]:
    """Return notes on what the numbers include, a sentence each."""
    notes = [
        "The inlet is flooded at every instant, also after the oil has turned round, and the load "
        "is balanced without inertia."
    ]
    if film.closure is not None and film.closure > 0.01:
        notes.append(
            f"The film still changes by {100 * film.closure:.0f} % from one period to the next "
            f"after {film.periods} periods."
        )
    if unknown:
        notes.append(
            "The error of the film due to the cells is not determined on a coarser grid: "
            f"{unknown.rstrip('.')}."
        )
    if _heated(case, cycle, times):
        notes.append(
            "Inlet shear heating, which would thin the film, is left out over a cycle; solve the "
            "fastest instant with `asperity solve` to see by how much."
        )
    if case.wear is not None:
        notes.append(
            "The wear volume is Archard's, with the wear coefficient of the case and the load that "
            "asperities carry."
        )
    return (*notes, *case.surface_notes)


def _heated(case: Case, cycle: OperatingCycle, times: Field) -> bool:
    """Return True if inlet shear heating matters at an instant."""
    for moment in times:
        if cycle.at(float(moment)).entrainment_speed == 0.0:
            continue
        try:
            conditions = cycle.conditions(float(moment), case.conditions)
            if heats_inlet(conditions, case.lubricant, case.thermal):
                return True
        except AsperityError:
            continue
    return False
