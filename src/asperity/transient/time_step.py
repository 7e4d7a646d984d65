"""One time step of a contact, with the squeeze term of the oil.

Following the oil, dx/dt = u, the wedge and the squeeze term of Reynolds' equation are one
derivative, d(ρh)/dt + u d(ρh)/dx = D(ρh)/Dt. A time step of one cell follows the oil from cell to
cell, by the backward difference (3 m_i^n - 4 m_(i-1)^(n-1) + m_(i-2)^(n-2))/(2 Δt): second order,
without numerical diffusion, and identical to the steady wedge where nothing moves. Other time steps
discretise time and wedge separately.
"""

import time
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from asperity.contact.conditions import ContactConditions
from asperity.core.arrays import Field
from asperity.ehl import ContactSolution, ContactState, Oil, Options, Scales, solve_contact
from asperity.ehl.models.mixed import MixedBalance, Pressures, evaluate
from asperity.ehl.models.single_pressure import Balance, Problem
from asperity.ehl.models.transient_term import TransientTerm
from asperity.ehl.newton.single_pressure import Step
from asperity.ehl.outcome import CONSERVING, MIXED, TWO_PRESSURES, SolveStrategy
from asperity.ehl.problem_setup import contact_problem
from asperity.ehl.strategies.grid_continuation import Search
from asperity.ehl.strategies.mixed_search import MixedSearch
from asperity.ehl.strategies.oil_state import pressures_of
from asperity.ehl.strategies.one_grid import FROM_NEIGHBOUR
from asperity.lubricant import Lubricant
from asperity.solution.state import state_of
from asperity.surface import MovingSurfaces, Surface

Memory = Mapping[str, np.ndarray]

_LOWERED = ("lowered_first", "lowered_second")


@dataclass(frozen=True, kw_only=True)
class Snapshot:
    """Contact at one time of a transient simulation.

    `number` of the step (0 is the start) and its `time` [s]; `solution` and `state` as for a steady
    contact, with the squeeze term in the oil balance; `flow_power` [W] is the viscous dissipation
    of the pressure-driven flow where a film separates the bodies (sliding dissipation is in the
    friction), `elastic_energy` [J] half the sum of pressure times deflection (up to a constant for
    a line contact); both for the whole contact. `flattened` [m] is the mean plastic flattening of
    both rough tracks together since the start, and `track_sq` [m] the root sum square of their Sq.
    `memory` holds all that the next step needs.
    """

    number: int
    time: float
    solution: ContactSolution
    state: ContactState
    flow_power: float
    elastic_energy: float
    flattened: float
    track_sq: float
    memory: Memory

    @property
    def rolling_friction(self) -> dict[str, float]:
        """Rolling friction that dissipates the power of the pressure-driven flow, by key.

        On moving roughness the pressure also works on slopes, on which the sum of (h/2) dp/dx has
        no bearing; over time the work on both bodies is what the flow dissipates.
        """
        conditions, power = self.solution.conditions, self.flow_power
        force = power / (2.0 * conditions.entrainment_speed)
        return {
            "rolling_friction_power_w": power,
            "rolling_friction_force_n": force,
            "rolling_friction_coefficient": force / conditions.load,
        }


class StepLength(NamedTuple):
    """Length of a time step [s], in which the oil travels `cells`.

    It is followed if they are whole. `ratio` is that of the length to the step before, and `moved`
    are the cells by which roughness moves, None for those of its speed.
    """

    seconds: float
    cells: float
    ratio: float = 1.0
    moved: int | None = None


class TransientContact:
    """A contact of constant conditions, and its time step."""

    def __init__(
        self,
        conditions: ContactConditions,
        lubricant: Lubricant,
        surfaces: MovingSurfaces,
        options: Options,
        length: StepLength,
        *,
        viscosity_factor: Field | None = None,
        flattening: bool = False,
    ) -> None:
        self.conditions, self.lubricant, self.surfaces = conditions, lubricant, surfaces
        self.options, self.flattening = options, flattening
        self.viscosity_factor = viscosity_factor
        self.scales = Scales.from_conditions(conditions, lubricant)
        seconds, cells, self.ratio, moved = length
        self.length = seconds * conditions.entrainment_speed / self.scales.length
        self.one_line = surfaces.uniform and conditions.endless
        rough = any(surfaces.rough)
        # shares of the bodies in the flattening
        self.shares = [float(is_rough) / max(sum(surfaces.rough), 1) for is_rough in surfaces.rough]
        # smooth bodies: the accurate wedge
        self.strategy = SolveStrategy.SECOND_ORDER if rough else SolveStrategy.COARSE_TO_FINE
        self.follows_oil = rough and (
            cells.is_integer() if self.options.model in TWO_PRESSURES else cells == 1.0
        )
        self.cells = int(cells) if self.follows_oil else 0  # that oil travels in a step
        self.moved = _cells_moved(surfaces, seconds) if moved is None else moved

    def start(self, surface: Surface, *, steady: bool) -> Snapshot:
        """Return the snapshot at time 0, from a steady contact (`steady`) or from rest."""
        oil = self.lubricant if steady else None
        solution = solve_contact(
            self.conditions,
            oil,
            surface,
            options=self.options,
            viscosity_factor=self.viscosity_factor,
            strict=False,
        )
        solution = replace(solution, lubricant=self.lubricant)
        approach = solution.rigid_approach / self.scales.gap
        pressure = solution.pressure / self.scales.pressure
        problem = self._problem(surface, None)
        unknowns = Pressures(np.zeros_like(pressure), pressure, approach)
        if solution.oil is not None:
            unknowns = pressures_of(solution, problem, self.scales)
        balance = self._balance(problem, unknowns)
        if not steady:  # cells in dry contact get the contact film
            gap = np.maximum(solution.gap, self.options.contact_film)
            zero = np.zeros_like(solution.gap)
            solution = replace(solution, gap=gap)
            if self.options.model in TWO_PRESSURES:
                full = Oil(content=np.ones_like(zero), pressure=zero, growth=zero)
                solution = replace(solution, oil=full)
        memory = {} if not steady else {"content_before": balance.content}
        return self._snapshot(0, 0.0, solution, balance, approach, memory, self.surfaces)

    def step(
        self, number: int, memory: Memory, time_s: float, surface: Surface | None = None
    ) -> Snapshot:
        """Return the snapshot one time step later, with the `surface` that passes at its time."""
        began = time.perf_counter()
        surfaces = self.surfaces
        if self.flattening:
            surfaces = surfaces.lowered(memory["lowered_first"], memory["lowered_second"])
        surface = surface or surfaces.composite_at(time_s)
        full_problem = self._problem(surface, self._past(memory))
        problem = _on_one_line(full_problem) if self.one_line else full_problem
        search, step, strategy = self._search(problem, self._initial_guess(memory, problem))
        solution = search.solution(
            step,
            surface,
            self.conditions,
            self.lubricant,
            seconds=time.perf_counter() - began,
            strategy=strategy,
        )
        solution = replace(solution, viscosity_factor=self.viscosity_factor)
        balance = step.balance
        if self.one_line:
            across = full_problem.cells[1]
            unknowns = Pressures(
                np.repeat(balance.oil_pressure, across, axis=1),
                np.repeat(balance.pressure, across, axis=1),
                step.approach,
            )
            balance = self._balance(full_problem, unknowns)
        carried_memory = {"content_before": memory["content"]}
        carried_memory |= {name: memory[name] for name in _LOWERED if self.flattening}
        return self._snapshot(
            number, time_s, solution, balance, step.approach, carried_memory, surfaces
        )

    def _initial_guess(self, memory: Memory, problem: Problem) -> Pressures:
        """Return the initial guess: the last pressures in place, or moved with the roughness.

        Asperities carry their contacts, cavities and trapped oil along, and Newton's method would
        move their borders by only a cell or two per iteration; the macroscopic pressure stays in
        place. The guess with the smaller residual is used.
        """
        (nx, lines) = problem.cells
        approach = float(memory["approach"])
        starts = []
        for cells in dict.fromkeys((self.moved, 0)):
            previous = np.clip(np.arange(nx) - cells, 0, nx - 1)
            oil, pressure = (memory[name][previous, :lines] for name in ("oil", "pressure"))
            starts.append(Pressures(oil, pressure, approach))
        return min(starts, key=lambda start: self._balance(problem, start).residual_rms)

    def _search(self, problem: Problem, unknowns: Pressures) -> tuple[Search, Step, SolveStrategy]:
        """Solve a step; return the search, its last iterate and the strategy used."""
        if self.options.model in TWO_PRESSURES:
            mixed = MixedSearch(self.options, self.scales.gap, None)
            step = mixed.first_converged(FROM_NEIGHBOUR, problem, unknowns)
            return mixed, step, SolveStrategy.COARSE_TO_FINE
        search = Search(self.options, self.scales.gap, None)
        # if Newton's method fails: at fixed approach, found by bracketing
        for fixed in (False, True):
            step = search.solve_levels([problem], unknowns.total, unknowns.approach, fixed=fixed)
            if search.converged(self.options.tolerance):
                break
        return search, step, SolveStrategy.FIXED_APPROACH if fixed else SolveStrategy.COARSE_TO_FINE

    def _balance(self, problem: Problem, unknowns: Pressures) -> Balance | MixedBalance:
        if self.options.model in TWO_PRESSURES:
            return evaluate(problem, unknowns, second_order=True)
        return problem.evaluate(unknowns.total, unknowns.approach)

    def _problem(self, surface: Surface, past: TransientTerm | None) -> Problem:
        steady_problem = contact_problem(
            self.conditions,
            self.lubricant,
            surface,
            self.options,
            self.viscosity_factor,
            strategy=self.strategy,
        )
        return replace(steady_problem, past=past)

    def _past(self, memory: Memory) -> TransientTerm:
        content, model = memory["content"], self.options.model
        if self.follows_oil and model == MIXED:
            return self._past_along_the_path(memory)
        rate, source = 1.0, -content
        if "content_before" in memory and model != CONSERVING:
            ratio = self.ratio  # of unequal steps; 1.5, 0.5 and 2 for equal ones
            rate = (1.0 + 2.0 * ratio) / (1.0 + ratio)
            before = ratio**2 / (1.0 + ratio) * memory["content_before"]
            source = before - (1.0 + ratio) * content
        if not self.follows_oil:
            return TransientTerm(rate / self.length, source / self.length, lagrangian=False)
        if model == CONSERVING:
            source[: self.cells], source[self.cells :] = 0.0, -content[: -self.cells]
        elif rate == 1.0:  # no earlier flow after a start from rest
            source[2:] = -content[1:-1]
        else:
            source[2:] = 0.5 * memory["content_before"][:-2] - 2.0 * content[1:-1]
        return TransientTerm(
            rate / self.length, source / self.length, lagrangian=True, cells=self.cells
        )

    def _past_along_the_path(self, memory: Memory) -> TransientTerm:
        """Return the derivative along the oil's path: first order, corrected to the second."""
        upstream, limiter_correction = (
            _carried(memory[name], self.cells) for name in ("content", "leant")
        )
        limiter_correction[:2] = 0.0
        source = -upstream
        source[:2] = -memory["content"][:2]
        return TransientTerm(
            1.0 / self.length, source / self.length, True, upstream, limiter_correction
        )

    def _snapshot(
        self,
        number: int,
        time_s: float,
        solution: ContactSolution,
        balance: Balance | MixedBalance,
        approach: float,
        carried_memory: Memory,
        surfaces: MovingSurfaces,
    ) -> Snapshot:
        memory = {
            **carried_memory,
            "number": np.array(number),
            "pressure": balance.pressure,
            "oil": _oil(balance),
            "approach": np.array(approach),
            "content": balance.content,
        }
        if isinstance(balance, MixedBalance):
            memory["leant"] = balance.limiter_correction
        flow, elastic = _powers(balance)
        grid = solution.grid
        conditions = self.conditions
        area = self.scales.length**2 * (
            1.0 if conditions.length is None else conditions.length / grid.extent[1]
        )
        energy = self.scales.pressure * self.scales.gap * area
        flattened = 0.0
        if self.flattening:
            overlap = _overlap(balance) * self.scales.gap * solution.convergence.converged
            tracks = self._lowered(overlap, carried_memory, time_s)
            flattened = sum(float(track.mean()) for track in tracks.values())
            memory |= tracks
        return Snapshot(
            number=number,
            time=time_s,
            solution=solution,
            state=state_of(solution, balance),
            flow_power=flow * energy * conditions.entrainment_speed / self.scales.length,
            elastic_energy=elastic * energy,
            flattened=flattened,
            track_sq=float(np.hypot(surfaces.first.sq, surfaces.second.sq)),
            memory=memory,
        )

    def _lowered(self, overlap: Field, memory: Memory, time_s: float) -> dict[str, Field]:
        """Return how far both tracks are lowered, after another overlap [m] in the contact."""
        return {
            name: memory.get(name, 0.0)
            + self.surfaces.project_on_track(index, self.shares[index] * overlap, time_s)
            for index, name in enumerate(_LOWERED)
        }


def _cells_moved(surfaces: MovingSurfaces, seconds: float) -> int:
    """Return the number of cells that roughness moves per step (mean of the rough bodies)."""
    speeds = [speed for speed, rough in zip(surfaces.speeds, surfaces.rough, strict=True) if rough]
    return round(sum(speeds) / max(len(speeds), 1) * seconds / surfaces.grid.spacing[0])


def _carried(field: Field, cells: int) -> Field:
    """Return a field carried downstream by whole cells; the first cell's value follows it."""
    return field[np.maximum(np.arange(len(field)) - cells, 0)]


def _oil(balance: Balance | MixedBalance) -> Field:
    """Return the unknown of the oil."""
    return balance.unknowns.oil if isinstance(balance, MixedBalance) else balance.pressure


def _overlap(balance: Balance | MixedBalance) -> Field:
    """Return the overlap that the pressure cap permits, dimensionless."""
    depth = np.maximum(balance.problem.contact_gap - balance.gap, 0.0)
    return np.where(balance.yielded, depth, 0.0)


def _on_one_line(problem: Problem) -> Problem:
    """Return a problem uniform along y on one line of cells of the same total width."""
    past = problem.past
    (dx, dy) = problem.spacing
    return replace(
        problem,
        roughness=problem.roughness[:, :1],
        spacing=(dx, problem.cells[1] * dy),
        past=None if past is None else past.on_one_line,
    )


def _powers(balance: Balance | MixedBalance) -> tuple[float, float]:
    """Return ∫ ε |grad P|² over faces between separated cells, and the elastic energy ½ ∫ P V."""
    problem = balance.problem
    pressure = balance.oil_pressure
    faces = balance.faces
    separated = balance.parted
    assert faces is not None
    dx, dy = problem.spacing
    along = faces.east[:-1] * np.diff(pressure, axis=0) ** 2 * (separated[:-1] & separated[1:])
    across = (
        faces.north
        * (np.roll(pressure, -1, axis=1) - pressure) ** 2
        * (separated & np.roll(separated, -1, axis=1))
    )
    boundary = 2.0 * (
        faces.inlet * pressure[0] ** 2 * separated[0]
        + faces.east[-1] * pressure[-1] ** 2 * separated[-1]
    )
    flow = float((along.sum() + boundary.sum()) / dx**2 + across.sum() / dy**2) * dx * dy
    total = balance.pressure
    return flow, 0.5 * float((total * problem.deflection(total)).sum()) * dx * dy
