"""Rough contact around an instant of a cycle: roughness moves through it, step by step.

Each instant has its own grid. The simulation begins some passages of the Hertz zone earlier, so
that the film forgets its start, and ends after the time over which numbers are averaged.
"""

import math
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import NamedTuple

import numpy as np
from threadpoolctl import threadpool_limits

from asperity.case import Case
from asperity.contact.conditions import ContactConditions
from asperity.contact.cycle import OperatingCycle, conditions_of
from asperity.core.arrays import Field
from asperity.core.errors import AsperityError
from asperity.ehl import Options, half_as_many
from asperity.solution import flash_temperature, friction
from asperity.surface import MovingSurfaces
from asperity.transient import Snapshot, cycle_contact

LEAD = 2.0  # passages of the Hertz zone before the numbers are averaged
AVERAGED = 2.0  # half-widths of the oil's path over which they are, about the instant
AVERAGED_TIME = 0.01  # of the period, to either side, at most
CELLS = 2.0  # that the oil travels in a step that follows it, and roughness relative to it, at most
SLIDING_CELLS = 1.0  # that roughness moves relative to the oil in other steps
STEPS_PER_PERIOD = 200  # at least, if the whole cycle were computed like this
WHOLE = 1e-9  # of a cell: a path of whole cells
MAX_STEPS = 80  # of a simulation before its instant
SLOW = 0.02  # of the largest entrainment speed; slower instants have the grid of this one
COARSE_CELLS = 8.0  # in a half-width, to find the time before an instant
SAMPLES = 41  # of that time, to find its widest contact
MARGIN = 1.1  # on the cells of a contact that narrows
STEP_TOLERANCE = 1e-2  # as of other running contacts
MAX_FAILED = 0.25  # share of averaged steps that may miss it
TRACK_LENGTHS = 4  # of a generated track, in lengths of the domain

KEYS = ("clr", "car", "h_min_m", "h_mean_m", "p_max_pa", "friction_coefficient")


class InstantJob(NamedTuple):
    """Simulation of one instant: on a surface of the case, with half of the cells if `coarse`."""

    case: Case
    cycle: OperatingCycle
    time: float
    surface: int
    coarse: bool
    start: str


class InstantRow(NamedTuple):
    """Means about an instant by key, `steps` computed and `failed`, or the `reason` for none."""

    numbers: dict[str, float]
    steps: int
    failed: int
    reason: str = ""


def case_at(case: Case, cycle: OperatingCycle, time: float) -> tuple[Case, float]:
    """Return the case with a grid for an instant and the time before, and its narrowing.

    Load and radius are those of the widest contact in that time; the narrowing is its width over
    that of the narrowest. The speed is that of the instant, or a fiftieth of the largest.
    """
    half_width = conditions_at(case, cycle, time).hertz.half_widths[0]
    window = window_times(cycle, time, half_width / COARSE_CELLS, half_width)
    samples = np.linspace(window[0], window[-1], SAMPLES)
    passing = [conditions_at(case, cycle, float(moment)) for moment in samples]
    widths = [conditions.hertz.half_widths[0] for conditions in passing]
    widest = passing[int(np.argmax(widths))]
    speeds = np.abs(np.asarray(cycle.speeds, float).mean(axis=1))
    radius = widest.radius
    instant_case = case.with_overrides(
        {
            "contact.load": widest.load,
            "contact.radius": [*radius] if isinstance(radius, tuple) else radius,
            "contact.entrainment_speed": max(
                abs(cycle.state(time).entrainment_speed), SLOW * float(speeds.max())
            ),
            "contact.slip": 0.0,
        }
    )
    return instant_case, max(widths) / min(widths)


def conditions_at(case: Case, cycle: OperatingCycle, time: float) -> ContactConditions:
    """Return load and radius of an instant, with the speeds of the case."""
    return conditions_of(
        cycle.state(time),
        case.conditions,
        case.conditions.surface_speeds,
    )


def window_times(
    cycle: OperatingCycle,
    time: float,
    spacing: float,
    half_width: float,
    first: float = -math.inf,
) -> Field:
    """Return the times of the steps around an instant, which is one of them.

    The oil travels two cells or one in a step, or roughness one cell relative to it, and no step
    is longer than 1/200 of the period. Before the `first` time [s] there are none; outside a cycle
    that does not repeat, conditions are those of its ends.
    """
    after = 0.5 * AVERAGED * half_width
    lead = 2.0 * LEAD * half_width + after
    before = [
        earlier
        for earlier in _walk(
            cycle,
            time,
            spacing,
            lead,
            -1.0,
        )
        if earlier > first
    ]
    starts = [first] if first > -math.inf and (not before or before[-1] > first) else []
    if starts == [time]:
        starts = []
    later = _walk(cycle, time, spacing, after, 1.0)
    return np.array([*starts, *before[::-1], time, *later])


def _walk(
    cycle: OperatingCycle, time: float, spacing: float, path: float, direction: float
) -> list[float]:
    """Return the times of steps from an instant, until the oil has travelled a path [m]."""
    times, travelled, now = list[float](), 0.0, time
    while travelled < path and len(times) < MAX_STEPS:
        step = _step(cycle, now, spacing, direction)
        then = now + direction * step
        travelled += abs(_paths(cycle, now, then)[0])
        times.append(then)
        now = then
    return times


def _step(cycle: OperatingCycle, time: float, spacing: float, direction: float) -> float:
    """Return the length of a step [s], of whole cells of the oil's path where it may be."""
    longest = cycle.period / STEPS_PER_PERIOD

    def within(length: float, cells: float, sliding_cells: float) -> bool:
        oil, slid = _paths(cycle, time, time + direction * length)
        return abs(oil) <= cells * spacing and 0.5 * abs(slid) <= sliding_cells * spacing

    for cells in (CELLS, 1.0):
        length = _longest(
            partial(
                within,
                cells=cells,
                sliding_cells=CELLS,
            ),
            longest,
        )
        oil, _ = _paths(cycle, time, time + direction * length)
        if abs(abs(oil) / spacing - cells) < WHOLE:
            return length
    return _longest(
        partial(
            within,
            cells=1.0,
            sliding_cells=SLIDING_CELLS,
        ),
        longest,
    )


def _longest(allowed: Callable[[float], bool], longest: float) -> float:
    """Return the longest allowed length up to a limit, by bisection."""
    if allowed(longest):
        return longest
    low, high = 0.0, longest
    for _ in range(60):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if allowed(middle) else (low, middle)
    return low


def _paths(cycle: OperatingCycle, begin: float, end: float) -> tuple[float, float]:
    """Return the path of the oil and that of the bodies relative to each other [m]."""
    before, after = cycle.travelled(begin), cycle.travelled(end)
    first, second = after[0] - before[0], after[1] - before[1]
    return 0.5 * (first + second), first - second


def solve_instant(job: InstantJob) -> InstantRow:
    """Simulate the rough contact around an instant, and return its means."""
    try:
        with threadpool_limits(1):
            return _solve(job)
    except AsperityError as error:
        return InstantRow({}, 0, 0, str(error))


def _solve(job: InstantJob) -> InstantRow:
    cycle, time = job.cycle, job.time
    case, narrowing = case_at(job.case.on_surface(job.surface), cycle, time)
    surfaces = instant_surfaces(case, cycle, narrowing, coarse=job.coarse)
    half_width = case.conditions.hertz.half_widths[0]
    first = _first_time(job)
    times = window_times(
        cycle,
        time,
        surfaces.grid.spacing[0],
        half_width,
        first,
    )
    assert case.lubricant is not None
    start, options = _start(job, float(times[0])), _step_options(case)
    snapshots = cycle_contact(
        cycle, case.conditions, case.lubricant, surfaces, times, start=start, options=options
    )
    averaged, failed = dict[float, Snapshot](), 0
    for snapshot in snapshots:
        if _is_averaged(cycle, time, snapshot.time, half_width):
            averaged[snapshot.time] = snapshot
            failed += not snapshot.solution.convergence.converged
    last = averaged[time]
    if failed > MAX_FAILED * len(averaged):
        return InstantRow(
            {},
            len(times),
            failed,
            last.solution.convergence.explain(),
        )
    numbers = _means(case, [*averaged.values()])
    if not job.coarse and job.surface == 0:
        numbers["flash_temperature_max_k"] = _flash(case, last)
    return InstantRow(numbers, len(times), failed)


def _means(case: Case, snapshots: list[Snapshot]) -> dict[str, float]:
    """Return the means of all numbers over some steps."""
    rows = [_numbers(case, snapshot) for snapshot in snapshots]
    return {key: float(np.mean([row[key] for row in rows])) for key in rows[0]}


def _step_options(case: Case) -> Options:
    """Return the settings of a time step."""
    return replace(case.options, tolerance=max(case.options.tolerance, STEP_TOLERANCE))


def _is_averaged(cycle: OperatingCycle, time: float, other: float, half_width: float) -> bool:
    """Return True for the instant, and for times whose numbers are averaged with it."""
    if other == time:
        return True
    path = abs(_paths(cycle, time, other)[0])
    soon = abs(other - time) <= AVERAGED_TIME * cycle.period
    return soon and path <= 0.5 * AVERAGED * half_width * (1.0 + WHOLE)


def instant_surfaces(
    case: Case, cycle: OperatingCycle, narrowing: float, *, coarse: bool
) -> MovingSurfaces:
    """Return the roughness on the running contact's grid, symmetric along x if oil turns round.

    There are more cells along x for a contact that is narrower at times.
    """
    if cycle.reverses:
        half_width = case.conditions.hertz.half_widths[0]
        reach = max(map(abs, (case.grid.lower[0], case.grid.upper[0]))) / half_width
        case = case.with_overrides({"grid.x": [-reach, reach]})
    nx, ny = case.running_cells()
    finest = case.grid.cells[0] - case.grid.cells[0] % 2
    cells = min(2 * math.ceil(0.5 * MARGIN * narrowing * nx), finest), ny
    if coarse:
        cells = half_as_many(case.conditions, case.grid, cells) or cells
    return case.moving_surfaces(TRACK_LENGTHS).on_cells(cells)


def _first_time(job: InstantJob) -> float:
    """Return the time before which there are no steps [s]."""
    return 0.0 if job.start == "stationary" and not job.cycle.repeats else -math.inf


def _start(job: InstantJob, begin: float) -> str:
    """Return how a simulation starts: steady, but at rest where nothing is entrained."""
    if begin == 0.0 and not job.cycle.repeats:
        return job.start
    return "stationary" if job.cycle.state(begin).entrainment_speed == 0.0 else "steady"


def _numbers(case: Case, snapshot: Snapshot) -> dict[str, float]:
    """Return the numbers of a step by key."""
    state = snapshot.state
    rubbing = friction(
        snapshot.solution, boundary_friction=case.boundary_friction, thermal=case.thermal
    )
    values = (state.clr, state.car, state.h_min, state.h_mean, state.p_max, rubbing.coefficient)
    below = math.hypot(rubbing.oil_below, rubbing.heat_below)
    return {
        **dict(zip(KEYS, values, strict=True)),
        "friction_below": below,
        "friction_above": rubbing.oil_above,
    }


def _flash(case: Case, snapshot: Snapshot) -> float:
    """Return the maximum flash temperature at an instant [K], nan if it cannot be computed."""
    if snapshot.solution.conditions.sliding_speed == 0.0:
        return 0.0
    try:
        return flash_temperature(snapshot.solution, thermal=case.thermal).max_k
    except AsperityError:
        return math.nan
