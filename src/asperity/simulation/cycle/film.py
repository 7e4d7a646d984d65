"""Film of the smooth bodies over a cycle, in time, with steady films beside it."""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np

from asperity.contact.conditions import ContactConditions
from asperity.contact.cycle import OperatingCycle
from asperity.contact.grid import Grid
from asperity.core.arrays import Field
from asperity.core.errors import AsperityError
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
MAX_OUTPUTS = 400  # times at which the film is stored


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

    def at(self, name: str, times: Field) -> Field:
        """Return one of the fields at other times, interpolated."""
        values: Field = np.interp(times, self.times, getattr(self, name))
        return values


def cycle_grid(cycle: OperatingCycle, contact: ContactConditions, lubricant: Lubricant) -> Grid:
    """Return a grid for the smooth contact at every instant of a cycle.

    It extends over the automatic grids of instants that entrain oil, with the cells of the finest
    one as far as their number allows, and is symmetric along x where oil turns round.
    """
    times = np.linspace(0.0, cycle.period, GRID_SAMPLES + 1)
    instants = [cycle.at(float(time)) for time in times]
    speeds = np.array([abs(instant.entrainment_speed) for instant in instants])
    fast = [time for time, speed in zip(times, speeds, strict=True) if speed > SLOW * speeds.max()]
    grids = [auto_grid(cycle.conditions(float(time), contact), lubricant) for time in fast]
    heaviest = max(cycle.conditions(float(time), contact).hertz.half_widths for time in fast)
    low = min(min(grid.lower[0] for grid in grids), -2.0 * heaviest[0])
    high = max(max(grid.upper[0] for grid in grids), 1.5 * heaviest[0])
    if cycle.reverses:
        low, high = -max(-low, high), max(-low, high)
    dx = min(grid.spacing[0] for grid in grids)
    if contact.endless:
        nx = 2 * math.ceil(min((high - low) / dx, MAX_LINE_CELLS) / 2.0)
        first = grids[0]
        return Grid(
            (nx, first.cells[1]),
            (low, first.lower[1]),
            (high, first.upper[1]),
            periodic=(False, True),
        )
    front = min(grid.lower[1] for grid in grids)
    back = max(grid.upper[1] for grid in grids)
    dy = min(grid.spacing[1] for grid in grids)
    counts = (high - low) / dx, (back - front) / dy
    fewer = min(1.0, math.sqrt(MAX_CELLS / (counts[0] * counts[1])))
    nx, ny = (2 * math.ceil(fewer * count / 2.0) for count in counts)
    return Grid((nx, ny), (low, front), (high, back), periodic=(False, False))


def half_the_cells(grid: Grid) -> Grid:
    """Return the same grid with half as many cells along x, and along y where y is not periodic."""
    nx, ny = grid.cells
    return replace(grid, cells=(nx // 2, ny if grid.periodic[1] else ny // 2))


def smooth_surfaces(grid: Grid) -> MovingSurfaces:
    """Return smooth bodies on a grid."""
    flat = flat_surface(grid)
    return MovingSurfaces(flat, flat, (0.0, 0.0), grid)


def film_course(
    cycle: OperatingCycle,
    contact: ContactConditions,
    lubricant: Lubricant,
    *,
    start: str | float = "steady",
    outputs: Field | None = None,
    options: Options | None = None,
    film_tolerance: float = FILM_TOLERANCE,
    grid: Grid | None = None,
    measure: Callable[[Snapshot], Mapping[str, float]] | None = None,
    progress: Callable[[float], None] | None = None,
) -> FilmCourse:
    """Solve the smooth contact over a cycle in time.

    A cycle that repeats begins where oil is entrained fastest, and is repeated until the film does.

    Parameters
    ----------
    cycle, contact, lubricant : as `cycle_contact`
    start : as `cycle_contact`, of a cycle that does not repeat
    outputs : times of the result [s]; default: those of the cycle's table, at most 400
    options : solver settings
    film_tolerance : of a time step
    grid : default `cycle_grid`
    measure : returns further numbers of an output
    progress : called after each step with the share of a period done

    Raises
    ------
    BadInput
        as `cycle_contact`.
    """
    grid = grid or cycle_grid(cycle, contact, lubricant)
    outputs = default_outputs(cycle) if outputs is None else outputs
    begin = 0.0
    if cycle.repeats:
        begin = max(map(float, outputs), key=lambda time: abs(cycle.at(time).entrainment_speed))
        outputs = np.unique(outputs[outputs < cycle.period])
    first = [time for time in outputs if time > begin]
    wrapped = [time + cycle.period for time in outputs if time <= begin] if cycle.repeats else []
    of_period = np.array([*first, *wrapped])
    periods = MAX_PERIODS if cycle.repeats else 1
    marks = np.concatenate([of_period + number * cycle.period for number in range(periods)])
    wanted = {begin, *marks}
    rows: dict[float, dict[str, float]] = {}
    worst, steps, failed, done, closure = 0.0, 0, 0, 1, None
    for snapshot in cycle_contact(
        cycle,
        contact,
        lubricant,
        smooth_surfaces(grid),
        np.array([begin, *marks]),
        start=start if not cycle.repeats else "steady",
        film_tolerance=film_tolerance,
        options=options,
    ):
        state, time = snapshot.state, snapshot.time
        steps += 1
        failed += not snapshot.solution.convergence.converged
        worst = max(worst, abs(state.load_error))
        if time in wanted:
            films = {"h_central": state.h_central, "h_min": state.h_min, "p_max": state.p_max}
            rows[time] = {**films, **({} if measure is None else measure(snapshot))}
        if progress is not None:
            progress((time - begin) / cycle.period)
        if cycle.repeats and time == marks[done * len(of_period) - 1]:
            before = rows[begin if done == 1 else marks[(done - 1) * len(of_period) - 1]]
            closure = abs(rows[time]["h_min"] / before["h_min"] - 1.0)
            if done == periods or closure <= CLOSED:
                break
            done += 1
    last = (done - 1) * cycle.period if cycle.repeats else 0.0
    kept = {} if cycle.repeats or begin not in rows else {begin: rows[begin]}
    kept |= {time: rows[time + last] for time in of_period}
    times, columns = _in_order(kept, cycle)
    return FilmCourse(
        times=times,
        h_central=columns.pop("h_central"),
        h_min=columns.pop("h_min"),
        p_max=columns.pop("p_max"),
        measured=columns,
        load_error=worst,
        steps=steps,
        failed=failed,
        periods=done,
        closure=closure,
        grid=grid,
    )


def default_outputs(cycle: OperatingCycle) -> Field:
    """Return the times of a cycle's table, or evenly chosen ones if they are many."""
    times = np.asarray(cycle.times, float)
    return times if len(times) <= MAX_OUTPUTS else cycle.even_times(MAX_OUTPUTS - 1)


def steady_films(
    cycle: OperatingCycle,
    contact: ContactConditions,
    lubricant: Lubricant,
    grid: Grid,
    times: Field,
    options: Options | None = None,
) -> list[tuple[float, float]]:
    """Return central and minimum film [m] of the steady smooth contact; nan where there is none."""
    films, surface = [], flat_surface(grid)
    for time in times:
        try:
            solution = solve_contact(
                cycle.conditions(float(time), contact), lubricant, surface, options=options
            )
        except AsperityError:  # no entrainment, or not converged
            films.append((math.nan, math.nan))
            continue
        centre = int(np.argmin(np.abs(grid.x)))
        films.append((float(solution.gap[centre, grid.cells[1] // 2]), float(solution.gap.min())))
    return films


def _in_order(
    kept: Mapping[float, Mapping[str, float]], cycle: OperatingCycle
) -> tuple[Field, dict[str, Field]]:
    """Return times and columns of a period in the order of time, both ends included."""
    turned = {time % cycle.period if cycle.repeats else time: row for time, row in kept.items()}
    rows = sorted(turned.items(), key=lambda entry: entry[0])
    if cycle.repeats:
        rows.append((rows[0][0] + cycle.period, rows[0][1]))
    columns = {name: np.array([row[name] for _, row in rows]) for name in rows[0][1]}
    return np.array([time for time, _ in rows]), columns
