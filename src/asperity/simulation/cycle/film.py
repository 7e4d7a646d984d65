"""Film of the smooth bodies over a cycle, in time, with steady films beside it."""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np

from asperity.contact.conditions import ContactConditions
from asperity.contact.cycle import OperatingCycle
from asperity.contact.grid import Grid
from asperity.core.arrays import Field
from asperity.core.errors import AsperityError, BadInput
from asperity.ehl import Options, auto_grid, solve_contact
from asperity.lubricant import Lubricant
from asperity.surface import MovingSurfaces, flat_surface
from asperity.transient import Snapshot, cycle_contact

# change of the film that a time step may leave unforeseen; with a quarter of it, which is half of
# the step, the minimum film moves by less than 2 %
FILM_TOLERANCE = 5e-4
GRID_SAMPLES = 24  # instants whose grids are combined
SLOW = 0.05  # of the largest entrainment speed, below which an instant does not decide the grid
MAX_LINE_CELLS, MAX_CELLS = 720, 12_000  # of a line contact along x; of others
CLOSED = 0.01  # relative difference of films one period apart, at which a cycle has settled
MAX_PERIODS = 3
EQUAL = 1e-9  # of the period, below which two times are the same
MAX_OUTPUTS = 400  # times at which the film is stored


@dataclass(frozen=True)
class SmoothContact:
    """Smooth contact over a cycle, with the settings of its solution.

    `start` as of `cycle_contact`, for a cycle that does not repeat; `outputs` are the times of the
    result [s], by default those of the cycle's table, at most 400; `film_tolerance` of a time step;
    `measure` returns further numbers of an output.
    """

    cycle: OperatingCycle
    contact: ContactConditions
    lubricant: Lubricant
    start: str | float = "steady"
    outputs: Field | None = None
    options: Options | None = None
    film_tolerance: float = FILM_TOLERANCE
    measure: Callable[[Snapshot], Mapping[str, float]] | None = None


@dataclass(frozen=True)
class FilmCourse:
    """Smooth contact over a cycle: films [m] and pressures [Pa] at `times` [s], (n,).

    `measured` are further numbers of a `measure`, by key. `load_error` is the largest relative one.
    `steps` time steps were computed, `failed` of them did not converge, `periods` cycles passed
    until the film repeated; `closure` is the change of the minimum film over the last of them,
    relative, None for a cycle that does not repeat.
    """

    times: Field
    h_central: Field
    h_min: Field
    p_max: Field
    measured: Mapping[str, Field]
    load_error: float
    steps: int
    failed: int
    periods: int
    closure: float | None
    grid: Grid

    def interpolated(self, name: str, times: Field) -> Field:
        """Return one of the fields at other times, interpolated."""
        values: Field = np.interp(times, self.times, getattr(self, name))
        return values


def cycle_grid(cycle: OperatingCycle, contact: ContactConditions, lubricant: Lubricant) -> Grid:
    """Return a grid for the smooth contact at every instant of a cycle.

    It extends over the automatic grids of instants that entrain oil, with the cells of the finest
    one as far as their number allows, and is symmetric along x where oil turns round.
    """
    grids = [auto_grid(conditions, lubricant) for conditions in _entraining(cycle, contact)]
    every = (cycle.conditions(float(time), contact) for time in cycle.times)
    widest = max(conditions.hertz.half_widths[0] for conditions in every)
    low, high = _range_x(grids, widest, symmetric=cycle.reverses)
    nx = (high - low) / min(grid.spacing[0] for grid in grids)
    if contact.endless:
        first = grids[0]
        cells = _even(min(nx, MAX_LINE_CELLS)), first.cells[1]
        return replace(
            first, cells=cells, lower=(low, first.lower[1]), upper=(high, first.upper[1])
        )
    front, back = min(grid.lower[1] for grid in grids), max(grid.upper[1] for grid in grids)
    ny = (back - front) / min(grid.spacing[1] for grid in grids)
    fewer = min(1.0, math.sqrt(MAX_CELLS / (nx * ny)))
    cells = _even(fewer * nx), _even(fewer * ny)
    return Grid(cells, (low, front), (high, back), periodic=(False, False))


def _range_x(grids: list[Grid], widest: float, *, symmetric: bool) -> tuple[float, float]:
    """Return the ends along x [m] of grids and of the widest contact."""
    low = min(*(grid.lower[0] for grid in grids), -2.0 * widest)
    high = max(*(grid.upper[0] for grid in grids), 1.5 * widest)
    if symmetric:
        reach = max(-low, high)
        return -reach, reach
    return low, high


def _even(count: float) -> int:
    return 2 * math.ceil(0.5 * count)


def _entraining(cycle: OperatingCycle, contact: ContactConditions) -> list[ContactConditions]:
    """Return the conditions of instants that entrain oil fast enough to decide a grid."""
    rows = np.asarray(cycle.times, float)
    peaks = rows[[np.argmax(cycle.loads), np.argmin(cycle.loads), np.argmin(cycle.radii)]]
    spread = (
        np.linspace(
            0.0,
            cycle.period,
            GRID_SAMPLES + 1,
        ),
        cycle.even_times(GRID_SAMPLES),
    )
    times = np.unique(np.concatenate([*spread, peaks]))
    speeds = np.array([abs(cycle.state(float(time)).entrainment_speed) for time in times])
    if not speeds.any():
        raise BadInput("the cycle entrains no oil at any time; correct its speeds")
    fast = times[speeds > SLOW * speeds.max()]
    return [cycle.conditions(float(time), contact) for time in fast]


def half_the_cells(grid: Grid) -> Grid:
    """Return the same grid with half as many cells along x, and along y where y is not periodic."""
    nx, ny = grid.cells
    return replace(grid, cells=(nx // 2, ny if grid.periodic[1] else ny // 2))


def smooth_surfaces(grid: Grid) -> MovingSurfaces:
    """Return smooth bodies on a grid."""
    flat = flat_surface(grid)
    return MovingSurfaces(flat, flat, (0.0, 0.0), grid)


def film_course(
    smooth: SmoothContact,
    *,
    grid: Grid | None = None,
    progress: Callable[[float], None] | None = None,
) -> FilmCourse:
    """Solve the smooth contact over a cycle in time.

    A cycle that repeats begins where oil is entrained fastest, and is repeated until the film does.

    Parameters
    ----------
    smooth : contact and cycle
    grid : default `cycle_grid`
    progress : called after each step with the share of a period done

    Raises
    ------
    BadInput
        as `cycle_contact`.
    """
    grid = grid or cycle_grid(smooth.cycle, smooth.contact, smooth.lubricant)
    record, repeats = _Record(smooth), smooth.cycle.repeats
    for snapshot in cycle_contact(
        smooth.cycle,
        smooth.contact,
        smooth.lubricant,
        smooth_surfaces(grid),
        record.times,
        start="steady" if repeats else smooth.start,
        film_tolerance=smooth.film_tolerance,
        options=smooth.options,
    ):
        record.add(snapshot)
        if progress is not None:
            progress((snapshot.time - record.begin) / smooth.cycle.period)
        if record.settled:
            break
    return record.course(grid)


class _Record:
    """Films at the outputs of a cycle, over as many periods as it takes to repeat."""

    def __init__(self, smooth: SmoothContact) -> None:
        self.smooth, self.cycle = smooth, smooth.cycle
        outputs = default_outputs(self.cycle) if smooth.outputs is None else smooth.outputs
        self.begin = 0.0
        if self.cycle.repeats:
            self.begin = max(
                map(float, outputs), key=lambda time: abs(self.cycle.state(time).entrainment_speed)
            )
            outputs = outputs[outputs < self.cycle.period * (1.0 - EQUAL)]
        later = [time for time in outputs if time > self.begin]
        earlier = [time + self.cycle.period for time in outputs if time <= self.begin]
        self.of_period = np.array([*later, *(earlier if self.cycle.repeats else [])])
        periods = np.arange(MAX_PERIODS if self.cycle.repeats else 1)
        following = (self.of_period + self.cycle.period * periods[:, None]).ravel()
        self.times = np.concatenate([[self.begin], following])
        self.due = {*self.times.tolist()}
        self.rows: dict[float, dict[str, float]] = {}
        self.load_error, self.steps, self.failed = 0.0, 0, 0
        self.periods, self.settled = 1, False
        self.closure: float | None = None

    def add(self, snapshot: Snapshot) -> None:
        """Add a time step."""
        state, time, measure = snapshot.state, snapshot.time, self.smooth.measure
        self.steps += 1
        self.failed += not snapshot.solution.convergence.converged
        self.load_error = max(self.load_error, abs(state.load_error))
        if time not in self.due:
            return
        films = {"h_central": state.h_central, "h_min": state.h_min, "p_max": state.p_max}
        self.rows[time] = {**films, **({} if measure is None else measure(snapshot))}
        if self.cycle.repeats and time == self._end(self.periods):
            before = self.begin if self.periods == 1 else self._end(self.periods - 1)
            change = self.rows[time]["h_min"] / self.rows[before]["h_min"] - 1.0
            self.closure = abs(change)
            self.settled = self.periods == MAX_PERIODS or self.closure <= CLOSED
            self.periods += not self.settled

    def course(self, grid: Grid) -> FilmCourse:
        """Return the films of the last period in the order of time, both ends included."""
        last = (self.periods - 1) * self.cycle.period if self.cycle.repeats else 0.0
        kept = {time: self.rows[time + last] for time in self.of_period.tolist()}
        if not self.cycle.repeats and self.begin in self.rows:
            kept[self.begin] = self.rows[self.begin]
        period = self.cycle.period if self.cycle.repeats else math.inf
        rows = sorted(((time % period, row) for time, row in kept.items()), key=lambda row: row[0])
        if self.cycle.repeats:
            rows.append((rows[0][0] + period, rows[0][1]))
        columns = {name: np.array([row[name] for _, row in rows]) for name in rows[0][1]}
        return FilmCourse(
            times=np.array([time for time, _ in rows]),
            h_central=columns.pop("h_central"),
            h_min=columns.pop("h_min"),
            p_max=columns.pop("p_max"),
            measured=columns,
            load_error=self.load_error,
            steps=self.steps,
            failed=self.failed,
            periods=self.periods,
            closure=self.closure,
            grid=grid,
        )

    def _end(self, periods: int) -> float:
        """Return the last output of some periods."""
        return float(self.times[periods * len(self.of_period)])


def merged(*times: Field, period: float) -> Field:
    """Return times in order, without those that are equal but for rounding."""
    union = np.unique(np.concatenate(times))
    distinct: Field = union[np.diff(union, prepend=-np.inf) > EQUAL * period]
    return distinct


def default_outputs(cycle: OperatingCycle) -> Field:
    """Return the times of a cycle's table, or evenly chosen ones if they are many."""
    times = np.asarray(cycle.times, float)
    return times if len(times) <= MAX_OUTPUTS else cycle.even_times(MAX_OUTPUTS - 1)


def steady_films(smooth: SmoothContact, grid: Grid, times: Field) -> list[tuple[float, float]]:
    """Return central and minimum film [m] of the steady smooth contact; nan where there is none."""
    films, surface = [], flat_surface(grid)
    for time in times:
        try:
            solution = solve_contact(
                smooth.cycle.conditions(float(time), smooth.contact),
                smooth.lubricant,
                surface,
                options=smooth.options,
            )
        except AsperityError:  # no entrainment, or not converged
            films.append((math.nan, math.nan))
            continue
        centre = int(np.argmin(np.abs(grid.x)))
        films.append((float(solution.gap[centre, grid.cells[1] // 2]), float(solution.gap.min())))
    return films
