"""Solve a contact over a cycle: film in time, then the rough contact around some instants."""

import math
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import replace
from multiprocessing import get_context
from typing import NamedTuple, TypeVar

import numpy as np
from scipy.special import stdtrit

from asperity.case import Case
from asperity.contact.cycle import OperatingCycle
from asperity.core.arrays import Field
from asperity.core.coverage import UPPER
from asperity.core.errors import AsperityError, BadInput
from asperity.core.processes import cores, set_up_worker
from asperity.simulation.cycle.film import (
    CLOSED,
    FilmCourse,
    SmoothContact,
    default_outputs,
    film_course,
    half_the_cells,
    merged,
    steady_films,
)
from asperity.simulation.cycle.instants import InstantJob, InstantRow, case_at, solve_instant
from asperity.simulation.cycle.result import CycleInstant, CycleResult
from asperity.solution import friction, heats_inlet
from asperity.transient import Snapshot
from asperity.wear import FilmDefect, WearCoefficient

T = TypeVar("T")

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
    cycle, start, instants = _stated(case, cycle, start, instants)
    times = _instant_times(cycle, instants)
    report = progress or _ignore
    films = _solve_films(case, cycle, start, times, report)
    solved: tuple[CycleInstant, ...] = ()
    if case.surface().sq > 0.0:
        solved = _solve_instants(
            case,
            cycle,
            times,
            start,
            _Pool(workers, report),
        )
    return CycleResult(
        case=case,
        cycle=cycle,
        film=films.fine,
        coarse=films.coarse,
        steady_times=times,
        steady=films.steady,
        steady_thinnest=films.steady_thinnest,
        instants=solved,
        wear_coefficients=_wear_coefficients(case),
        seconds=time.perf_counter() - began,
        notes=_notes(case, cycle, films, times),
    )


def _stated(
    case: Case,
    cycle: OperatingCycle | None,
    start: str | None,
    instants: int | Sequence[float] | None,
) -> tuple[OperatingCycle, str, int | Sequence[float]]:
    """Return the cycle, its start and its instants, those of the case where they are omitted."""
    section = case.contents.cycle
    if case.lubricant is None:
        raise BadInput(f"{case.source}: a cycle needs an oil; add [lubricant]")
    if cycle is None:
        if section is None:
            raise BadInput(f"{case.source}: there is no cycle; add [cycle]")
        with case.naming("cycle"):
            cycle = section.cycle(case.conditions, case.folder)
    if section is not None:
        return cycle, start or section.start, section.instants if instants is None else instants
    return cycle, start or "steady", INSTANTS if instants is None else instants


class _Films(NamedTuple):
    """Smooth films on two grids, steady ones at the instants and at the thinnest film.

    The `reason` states why there is none on the coarse grid.
    """

    fine: FilmCourse
    coarse: FilmCourse | None
    steady: list[tuple[float, float]]
    steady_thinnest: float
    reason: str


def _solve_films(
    case: Case,
    cycle: OperatingCycle,
    start: str,
    times: Field,
    report: Callable[[CycleProgress], None],
) -> _Films:
    """Solve the film of the smooth bodies in time on two grids, and the steady one."""
    assert case.lubricant is not None
    rough = case.surface().sq > 0.0
    smooth = SmoothContact(
        cycle,
        case.conditions,
        case.lubricant,
        start=start,
        outputs=merged(default_outputs(cycle), times, period=cycle.period),
        options=case.options,
        measure=None if rough else _friction_of(case),
    )

    def progress(share: float) -> None:
        report(CycleProgress(share, 0, len(times)))

    with case.naming("cycle"):
        fine = film_course(smooth, progress=progress)
    coarse, reason = None, ""
    try:
        coarse = film_course(
            smooth,
            grid=half_the_cells(fine.grid),
            progress=progress,
        )
    except AsperityError as error:
        reason = str(error)
    thinnest = fine.times[[int(np.argmin(fine.h_min))]]
    steady = steady_films(smooth, fine.grid, np.concatenate([times, thinnest]))
    return _Films(fine, coarse, steady[:-1], steady[-1][1], reason)


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
    """Return Archard's coefficients of both bodies that remove as much; None if there are none."""
    if case.wear is None or isinstance(case.wear.law, FilmDefect):
        return None
    share = case.wear.law.equivalent_coefficient(1.0, case.boundary_friction)
    first, second = (replace(body, k=body.k / share) for body in case.wear.coefficients)
    return first, second


class _Pool:
    """Processes that solve jobs, with progress."""

    def __init__(self, workers: int | None, progress: Callable[[CycleProgress], None]) -> None:
        self.workers, self.progress = workers or cores(), progress

    def rows(self, jobs: list[InstantJob]) -> list[InstantRow]:
        """Solve jobs, and return their rows in the order of the jobs."""
        count = min(self.workers, len(jobs))
        if count < 2:
            return [*self._shown(map(solve_instant, jobs), len(jobs))]
        with ProcessPoolExecutor(
            count,
            get_context("spawn"),
            set_up_worker,
        ) as pool:
            futures = [pool.submit(solve_instant, job) for job in jobs]
            for _ in self._shown(as_completed(futures), len(jobs)):
                pass
            return [future.result() for future in futures]

    def _shown(self, items: Iterable[T], total: int) -> Iterator[T]:
        for number, item in enumerate(items, 1):
            self.progress(CycleProgress(1.0, number, total))
            yield item


def _solve_instants(
    case: Case, cycle: OperatingCycle, times: Field, start: str, pool: _Pool
) -> tuple[CycleInstant, ...]:
    """Solve the rough contact at all instants: the first surface on two grids, others on one."""
    stated, case = case.contents.solver.surfaces, case.among_many
    tracks = case_at(
        case,
        cycle,
        float(times[0]),
    )[0].surface_count(stated or TRACKS)
    fine = [
        InstantJob(
            case,
            cycle,
            float(moment),
            0,
            False,
            start,
        )
        for moment in times
    ]
    coarse = [job._replace(surface=number, coarse=True) for job in fine for number in range(tracks)]
    rows = pool.rows([*fine, *coarse])
    by_job = {
        (job.time, job.surface, job.coarse): row
        for job, row in zip([*fine, *coarse], rows, strict=True)
    }
    # further surfaces that a coarse grid does not resolve, on the fine one
    again = [
        job._replace(coarse=False)
        for job in coarse
        if job.surface and by_job[job.time, 0, True].reason
    ]
    for job, row in zip(again, pool.rows(again), strict=True):
        by_job[job.time, job.surface, False] = row
    return tuple(
        _combined(
            job.time,
            by_job[job.time, 0, False],
            [by_job[job.time, number, True] for number in range(tracks)],
            [by_job[other.time, other.surface, False] for other in again if other.time == job.time],
        )
        for job in fine
    )


def _combined(
    moment: float, fine: InstantRow, coarse: list[InstantRow], further: list[InstantRow]
) -> CycleInstant:
    """Combine the tracks of an instant.

    The mean is that of the coarse grid over all tracks, corrected by the difference of both grids
    on the first; without a coarse grid, the mean of the fine one, whose error is not determined.
    """
    if fine.reason:
        return CycleInstant(
            time=moment,
            numbers={},
            half_widths={},
            reason=fine.reason,
        )
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
    """Return the half-width of a mean; infinite for a single value."""
    count = len(values)
    if count < 2:
        return math.inf
    return float(stdtrit(count - 1, UPPER) * np.std(values, ddof=1) / math.sqrt(count))


def _notes(case: Case, cycle: OperatingCycle, films: _Films, times: Field) -> tuple[str, ...]:
    """Return notes on what the numbers include, a sentence each."""
    notes = [
        "The inlet is flooded at every instant, also after the oil has turned round, and the load "
        "is balanced without inertia."
    ]
    film = films.fine
    if film.closure is not None and film.closure > CLOSED:
        notes.append(
            f"The film still changes by {100 * film.closure:.0f} % from one period to the next "
            f"after {film.periods} periods."
        )
    if films.reason:
        notes.append(
            "The error of the film due to the cells is not determined on a coarser grid: "
            f"{films.reason.rstrip('.')}."
        )
    if _heated(case, cycle, times):
        notes.append(
            "Inlet shear heating, which would thin the film, is left out over a cycle; solve the "
            "fastest instant with `asperity solve` to see by how much."
        )
    if case.wear is not None and _wear_coefficients(case) is None:
        notes.append(
            'The wear of a cycle is not determined with the law "film-defect", whose share of bare '
            "metal depends on temperature; use archard or energy."
        )
    elif case.wear is not None:
        notes.append(
            "The wear volume is Archard's, with the wear coefficient of the case and the load that "
            "asperities carry."
        )
    return (*notes, *case.surface_notes)


def _heated(case: Case, cycle: OperatingCycle, times: Field) -> bool:
    """Return True if inlet shear heating matters at an instant."""
    for moment in times:
        if cycle.state(float(moment)).entrainment_speed == 0.0:
            continue
        try:
            conditions = cycle.conditions(float(moment), case.conditions)
            if heats_inlet(conditions, case.lubricant, case.thermal):
                return True
        except AsperityError:
            continue
    return False
