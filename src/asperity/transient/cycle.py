"""Contact over a cycle of load, speeds and radius, solved in time with the squeeze term of the oil.

The load is balanced at each instant without inertia. The grid is fixed in space, so that load and
radius may change by any factor that its cells resolve. Where oil turns round and enters from the
other side, fields are mirrored; the grid is symmetric about the centre.
"""

import itertools
import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import get_args

import numpy as np

from asperity.contact.conditions import ContactConditions
from asperity.contact.cycle import CycleState, OperatingCycle, conditions_of
from asperity.core.arrays import Field
from asperity.core.errors import BadInput, require_choice, require_positive
from asperity.ehl import MAX_CELLS_PER_TIME_STEP, Options, Scales, Start
from asperity.ehl.outcome import TWO_PRESSURES
from asperity.ehl.problem_setup import contact_problem
from asperity.lubricant import Lubricant
from asperity.surface import MovingSurfaces, Surface
from asperity.transient.time_step import Memory, Snapshot, StepLength, TransientContact

# cells that oil travels in a time step at least: without entrainment, the film is only squeezed
LEAST_CELLS = 1e-3
MAX_RATIO = 2.4  # of successive time steps, above which the second-order difference is unstable
FIRST_STEPS = 1000  # of a simulation, if all were as short as the first
MAX_REFINEMENT = 1e4  # of it in steps that are shortened
WHOLE = 1e-6  # of a cell: a path of whole cells
LEAST_SPEED = 1e-9  # [m/s] of a dry contact at rest, whose oil does not move yet

PRESSURES, GAPS = ("pressure", "oil"), ("content", "content_before", "leant", "approach")


@dataclass(frozen=True)
class CycleMemory:
    """State of a contact for its next time step: fields in the units of its conditions.

    `backwards` if x points against the positive direction of the speeds; `length` of the last step
    [s], and the whole `cells` over which oil was followed in it, nan if it was not.
    """

    fields: Memory
    conditions: ContactConditions
    backwards: bool
    length: float
    cells: float = math.nan


def cycle_contact(
    cycle: OperatingCycle,
    contact: ContactConditions,
    lubricant: Lubricant,
    surfaces: MovingSurfaces,
    times: Field,
    *,
    start: str | float = "steady",
    film_tolerance: float | None = None,
    options: Options | None = None,
) -> Iterator[Snapshot]:
    """Yield the contact at the first of some times of a cycle, and at each of the others.

    Parameters
    ----------
    cycle : load, surface speeds and radius over time
    contact : bodies and geometry; its load, speeds and radius along rolling do not matter
    lubricant : the oil, everywhere enough of it
    surfaces : roughness of both bodies at time 0 of the cycle, on the contact's grid
    times : increasing [s], (n,); of a cycle that repeats also beyond its end
    start : "steady" from the steady contact at the first time; "stationary" from dry contact, with
        all gaps full of oil; or a gap [m] between undeformed bodies that is full of oil, which is
        not yielded
    film_tolerance : relative change of the film that a step may leave unforeseen, averaged over the
        Hertz zone; steps are then added between the times, where it changes fast. None: no others
    options : solver settings of every step

    Where the oil travels whole cells in a step, it is followed from cell to cell, as roughness
    requires; other steps discretise time and wedge separately. A step that does not converge is
    yielded, marked in `solution.convergence`, and the next one starts from it.

    Raises
    ------
    BadInput
        for a grid that is not symmetric along x although oil turns round, an inlet layer, and as
        `solve_contact` at the start.
    """
    options = options or Options()
    if options.inlet_layer is not None:
        raise BadInput(
            "a cycle is solved with enough oil, got an inlet layer; leave out [inlet], or solve "
            "steady contacts"
        )
    if not np.all(np.diff(times) > 0.0):
        raise BadInput(
            "the times of a cycle's steps must increase; sort them, and leave out equal ones"
        )
    marcher = _Marcher(cycle, contact, lubricant, surfaces, options)
    if isinstance(start, str):
        require_choice("start", start, get_args(Start))
        snapshot, memory = marcher.steady_start(float(times[0]), steady=start == "steady")
        yield snapshot
    else:
        require_positive("start", start, "m")
        memory = marcher.open_start(float(times[0]), start)
    if film_tolerance is None:
        for number, (begin, end) in enumerate(itertools.pairwise(times), 1):
            snapshot, memory = marcher.step(
                number,
                memory,
                float(begin),
                float(end),
            )
            yield snapshot
    else:
        yield from _adaptive_steps(marcher, memory, times, film_tolerance)


def _adaptive_steps(
    marcher: "_Marcher", memory: CycleMemory, times: Field, tolerance: float
) -> Iterator[Snapshot]:
    """Yield all accepted steps, in each of which the film changes about as foreseen."""
    time, number, trial = float(times[0]), 1, float(times[-1] - times[0]) / FIRST_STEPS
    smallest = trial / MAX_REFINEMENT
    for target in map(float, times[1:]):
        while time < target:
            whole = target - time <= trial * (1.0 + WHOLE)
            end = target if whole else time + min(trial, 0.5 * (target - time))
            snapshot, after = marcher.step(number, memory, time, end)
            error = _unforeseen(memory, after, snapshot)
            taken = end - time
            factor = min(max(math.sqrt(tolerance / max(error, 1e-12)), 0.25), 2.0)
            failed = error > 2.0 * tolerance or not snapshot.solution.convergence.converged
            if failed and taken > smallest:
                trial = taken * min(factor, 0.5)
                continue
            trial = factor * (taken if not whole else max(taken, min(trial, taken * MAX_RATIO)))
            time, memory, number = end, after, number + 1
            yield snapshot


def _unforeseen(before: CycleMemory, after: CycleMemory, snapshot: Snapshot) -> float:
    """Return the change of the film beyond its extrapolation, over the film, in the Hertz zone."""
    if before.backwards != after.backwards or "content_before" not in after.fields:
        return 0.0
    film = after.fields["content"]
    last = after.fields["content_before"]
    foreseen = last
    if "content_last_but_one" in after.fields:
        ratio = after.length / before.length
        foreseen = last + ratio * (last - after.fields["content_last_but_one"])
    grid, (a, b) = snapshot.solution.grid, after.conditions.hertz.half_widths
    zone = np.abs(grid.x) <= a
    if not after.conditions.endless:
        inside = (grid.x[:, None] / a) ** 2 + (grid.y[None, :] / b) ** 2 <= 1.0
    else:
        inside = np.broadcast_to(zone[:, None], grid.cells)
    return float(np.abs(film - foreseen)[inside].mean() / film[inside].mean())


class _Marcher:
    """Constants of a simulation of a cycle, and its steps."""

    def __init__(
        self,
        cycle: OperatingCycle,
        contact: ContactConditions,
        lubricant: Lubricant,
        surfaces: MovingSurfaces,
        options: Options,
    ) -> None:
        self.cycle, self.contact, self.lubricant = cycle, contact, lubricant
        self.surfaces, self.options = surfaces, options
        grid = surfaces.grid
        self.spacing = grid.spacing[0]
        if cycle.reverses and abs(grid.lower[0] + grid.upper[0]) > WHOLE * self.spacing:
            raise BadInput(
                "where oil turns round, the grid must be symmetric along x, got "
                f"{1e6 * grid.lower[0]:.4g} to {1e6 * grid.upper[0]:.4g} um; use x = [-4, 4]"
            )

    def steady_start(self, time: float, *, steady: bool) -> tuple[Snapshot, CycleMemory]:
        """Return the contact at the first time, steady or dry at rest, and its memory."""
        instant = self.cycle.state(time)
        if steady and instant.entrainment_speed == 0.0:
            raise BadInput(
                "the cycle begins without entrainment, which has no steady film; use start = "
                '"stationary", or begin at another time'
            )
        backwards = instant.entrainment_speed < 0.0
        conditions = self._conditions(
            instant,
            instant.speeds,
            backwards,
            math.inf,
        )
        surface = self._surface(time, backwards)
        length = StepLength(1.0, math.nan)
        model = TransientContact(
            conditions,
            self.lubricant,
            self.surfaces,
            self.options,
            length,
        )
        snapshot = model.start(surface, steady=steady)
        memory = CycleMemory(snapshot.memory, conditions, backwards, math.inf)
        return replace(snapshot, time=time, memory={}), memory

    def open_start(self, time: float, gap: float) -> CycleMemory:
        """Return the memory of undeformed bodies at a gap [m] that is full of oil."""
        instant = self.cycle.state(time)
        backwards = instant.entrainment_speed < 0.0
        conditions = self._conditions(
            instant,
            instant.speeds,
            backwards,
            math.inf,
        )
        problem = contact_problem(
            conditions, self.lubricant, self._surface(time, backwards), self.options
        )
        shape = problem.form.gap(problem.x, problem.y) - problem.roughness
        approach = gap / Scales.from_conditions(conditions, self.lubricant).gap - np.min(shape)
        zero = np.zeros(problem.cells)
        fields = {
            "number": np.array(0),
            "pressure": zero,
            "oil": zero,
            "approach": np.array(approach),
            "content": shape + approach,
            "leant": zero,
        }
        return CycleMemory(fields, conditions, backwards, math.inf)

    def step(
        self, number: int, memory: CycleMemory, begin: float, end: float
    ) -> tuple[Snapshot, CycleMemory]:
        """Return the contact at the end of a step, and its memory."""
        instant, seconds = self.cycle.state(end), end - begin
        paths = self._paths(begin, end)
        path = 0.5 * sum(paths)
        slow = abs(path) < LEAST_CELLS * self.spacing
        backwards = memory.backwards if slow else path < 0.0
        moved = round(_mean_rough(self.surfaces, paths, backwards) / self.spacing)
        cells = self._whole(abs(path) / self.spacing)
        length = StepLength(seconds, cells, _ratio(seconds, memory.length), moved)
        speeds = instant.speeds if math.isnan(cells) else _mean_speeds(instant, path / seconds)
        conditions = self._conditions(instant, speeds, backwards, seconds)
        snapshot, after = self._solved(number, memory, conditions, length, end, backwards)
        stated = self._conditions(instant, instant.speeds, backwards, seconds)
        return _stating(snapshot, stated), after

    def _solved(
        self,
        number: int,
        memory: CycleMemory,
        conditions: ContactConditions,
        length: StepLength,
        end: float,
        backwards: bool,
    ) -> tuple[Snapshot, CycleMemory]:
        """Solve a step of some conditions and length, and return the contact and its memory."""
        fields = self._fields(memory, conditions, length, backwards)
        model = TransientContact(conditions, self.lubricant, self.surfaces, self.options, length)
        snapshot = model.step(number, fields, end, self._surface(end, backwards))
        after = dict(snapshot.memory)
        if "content_before" in fields and math.isfinite(memory.length):
            after["content_last_but_one"] = fields["content_before"]
        return snapshot, CycleMemory(after, conditions, backwards, length.seconds, length.cells)

    def _fields(
        self,
        memory: CycleMemory,
        conditions: ContactConditions,
        length: StepLength,
        backwards: bool,
    ) -> dict[str, Field]:
        """Return the fields of a memory for the next step."""
        before, after = self._scales(memory.conditions), self._scales(conditions)
        fields = _carried(memory, before, after, backwards)
        if length.ratio > MAX_RATIO:
            fields.pop("content_before", None)
        follows = length.cells == memory.cells or math.isinf(memory.length)  # at the start: any
        if not follows and "leant" in fields:  # of the last step's path
            fields["leant"] = np.zeros_like(fields["leant"])
        return fields

    def _paths(self, begin: float, end: float) -> list[float]:
        """Return the paths of both bodies in a step [m]."""
        travelled = (self.cycle.travelled(time) for time in (begin, end))
        return [after - before for before, after in zip(*travelled, strict=True)]

    def _whole(self, cells: float) -> float:
        """Return the whole cells of a path along which oil can be followed; nan otherwise."""
        whole = round(cells)
        followed = (
            1 <= whole <= MAX_CELLS_PER_TIME_STEP
            and abs(cells - whole) < WHOLE * whole
            and self.options.model in TWO_PRESSURES
            and any(self.surfaces.rough)
        )
        return float(whole) if followed else math.nan

    def _conditions(
        self, instant: CycleState, speeds: tuple[float, float], backwards: bool, length: float
    ) -> ContactConditions:
        """Return the conditions of a step; x points with the oil, which moves a little at least."""
        side = -1.0 if backwards else 1.0
        first, second = (side * speed for speed in speeds)
        lift = max(LEAST_CELLS * self.spacing / length - 0.5 * (first + second), 0.0)
        if math.isinf(length) and first + second == 0.0:
            lift = LEAST_SPEED  # at rest, where the contact is dry
        return conditions_of(
            instant,
            self.contact,
            (first + lift, second + lift),
        )

    def _scales(self, conditions: ContactConditions) -> Scales:
        return Scales.from_conditions(conditions, self.lubricant)

    def _surface(self, time: float, backwards: bool) -> Surface:
        """Return the roughness at a time, x in the direction of the oil."""
        surface = self.surfaces.composite_displaced(self.cycle.travelled(time))
        return Surface(surface.heights[::-1].copy(), surface.grid) if backwards else surface


def _ratio(seconds: float, before: float) -> float:
    """Return the length of a step over that of the step before; 1 for the first."""
    return 1.0 if math.isinf(before) else seconds / before


def _stating(snapshot: Snapshot, conditions: ContactConditions) -> Snapshot:
    """Return a snapshot with the conditions of its instant, without its memory."""
    solution = replace(snapshot.solution, conditions=conditions)
    return replace(snapshot, solution=solution, memory={})


def _mean_speeds(instant: CycleState, mean: float) -> tuple[float, float]:
    """Return the speeds of an instant [m/s], shifted to another entrainment speed."""
    shift = mean - instant.entrainment_speed
    return instant.speeds[0] + shift, instant.speeds[1] + shift


def _carried(
    memory: CycleMemory, before: Scales, after: Scales, backwards: bool
) -> dict[str, Field]:
    """Return the fields of a memory in the units of the next step, mirrored if oil turns round."""
    fields = dict(memory.fields)
    for name in fields.keys() & {*PRESSURES, *GAPS}:
        units = (before.gap, after.gap) if name in GAPS else (before.pressure, after.pressure)
        field = np.asarray(fields[name])
        if units[0] != units[1]:
            factor = units[0] / units[1]
            # the signed unknown of conserved oil is a share below zero
            field = (
                np.where(
                    field < 0.0,
                    field,
                    factor * field,
                )
                if name == "oil"
                else factor * field
            )
        fields[name] = field[::-1] if field.ndim and backwards != memory.backwards else field
    return fields


def _mean_rough(surfaces: MovingSurfaces, paths: list[float], backwards: bool) -> float:
    """Return the mean path of the rough bodies in a step [m], in the direction of x."""
    rough = [
        path
        for path, is_rough in zip(
            paths,
            surfaces.rough,
            strict=True,
        )
        if is_rough
    ]
    return (-1.0 if backwards else 1.0) * sum(rough) / max(len(rough), 1)
