"""A contact in time: rough surfaces that run through it and the oil that they squeeze, step after step.

Along the way of the oil, dx/dt = u, the wedge and the squeeze term of Reynolds' equation are one
derivative, d(ρh)/dt + u d(ρh)/dx = D(ρh)/Dt. A step of one cell follows the oil from cell to cell,
by the backward difference (3 m_i^n - 4 m_(i-1)^(n-1) + m_(i-2)^(n-2))/(2 Δt): second order,
nothing is smeared, and where nothing moves it is the snapshot's own wedge. Steps of other lengths
difference time and wedge apart. Steps are yielded; keeping them, and deciding when to stop, is
left to others (`asperity.history`).
"""

import time
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from itertools import count
from typing import Any

import numpy as np

from asperity.contact.conditions import ContactConditions
from asperity.core.arrays import Field
from asperity.core.errors import BadInput, require_positive
from asperity.ehl import (
    LONGEST_STEP,
    ContactSolution,
    ContactState,
    Oil,
    Options,
    Scales,
    Start,
    solve_contact,
)
from asperity.ehl.models.mixed import MixedBalance, Pressures, evaluate
from asperity.ehl.models.single_pressure import Balance, Past, Problem
from asperity.ehl.newton.single_pressure import Step
from asperity.ehl.outcome import ATTEMPTS, CONSERVING, MIXED, TWO_PRESSURES
from asperity.ehl.problem_setup import contact_problem
from asperity.ehl.strategies.grid_continuation import Progress, Search
from asperity.ehl.strategies.mixed_search import MixedSearch, pressures_of
from asperity.lubricant import Lubricant
from asperity.solution.state import state_of
from asperity.surface import MovingSurfaces, Surface

Memory = Mapping[str, "np.ndarray[Any, Any]"]

HELD = ATTEMPTS[2]
_LOWERED = ("lowered_first", "lowered_second")


@dataclass(frozen=True, kw_only=True)
class Snapshot:
    """A contact at one time of its history.

    `number` of the step (0 is the start) and its `time` [s]; `solution` and `state` as of a
    contact that stands still, with the squeeze term in the balance of oil; `flow_power` [W] what
    the pressure-driven flow of the oil turns to heat where a film parts the bodies (the rest is
    friction's), `elastic_energy` [J] half of the sum of pressure times deflection, of a line
    contact up to a constant; both of the whole contact. `flattened` [m] is how far the tracks of
    the rough surfaces have been pressed down on average since the start, both together, and
    `track_sq` [m] the root of their Sq squared and added. `memory` is all that the next step needs
    to know.
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


Steps = Callable[
    ..., Iterator[Snapshot]
]  # what a model of a moving contact is to whoever keeps its history


def moving_contact(
    conditions: ContactConditions,
    lubricant: Lubricant,
    surfaces: MovingSurfaces,
    *,
    start: Start = "steady",
    resume: Memory | None = None,
    time_step: float = 1.0,
    flattening: bool = False,
    options: Options | None = None,
    progress: Progress | None = None,
) -> Iterator[Snapshot]:
    """Yield the contact at time 0 and then after each step, for as long as anybody asks.

    Parameters
    ----------
    conditions, lubricant : the contact and its oil; the load is held at every step
    surfaces : both bodies' roughness, and how fast it moves
    start : "steady" from the snapshot, in which the oil has always flowed and the roughness stood still; "stationary"
        from rest, bodies pressed together dry and every gap full of oil
    resume : `memory` of an earlier snapshot, to go on from; that snapshot is not yielded again
    time_step : over the time that the oil takes from cell to cell; 1 follows the oil along its way
    flattening : remember where the cap has let the bodies overlap: the rough surface (both, by halves, where both are
        rough) is lower there by as much when it comes again
    options : tolerances of every step; `Options()` unless given
    progress : called after every Newton step

    A step that does not converge is yielded as it is, marked in `solution.convergence`, and the
    next goes on from it.

    Raises
    ------
    BadInput
        for a time step that is not positive or longer than 8 cells, a start that is none, and what `solve_contact`
        refuses.
    NotConverged
        if there is no snapshot to start from.
    """
    require_positive("time step", time_step, "cells")
    if time_step > LONGEST_STEP:
        raise BadInput(
            f"time step must be at most {LONGEST_STEP:g} cells, got {time_step:g}; 1 follows the oil"
        )
    if start not in ("steady", "stationary"):
        raise BadInput(f"start must be steady or stationary, got {start!r}")
    contact = _Contact(
        conditions, lubricant, surfaces, options or Options(), time_step, flattening, progress
    )
    if resume is None:
        first = contact.start(standing=start == "steady")
        yield first
        resume = first.memory
    for number in count(int(resume["number"]) + 1):
        snapshot = contact.step(number, resume)
        yield snapshot
        resume = snapshot.memory


def step_seconds(
    conditions: ContactConditions, surfaces: MovingSurfaces, time_step: float
) -> float:
    """Length of a step [s] of `time_step` times the time from cell to cell."""
    return time_step * surfaces.grid.spacing[0] / conditions.entrainment_speed


class _Contact:
    """What stays the same from step to step, and how one is taken."""

    def __init__(
        self,
        conditions: ContactConditions,
        lubricant: Lubricant,
        surfaces: MovingSurfaces,
        options: Options,
        time_step: float,
        flattening: bool,
        progress: Progress | None,
    ) -> None:
        self.conditions, self.lubricant, self.surfaces = conditions, lubricant, surfaces
        self.options, self.flattening, self.progress = options, flattening, progress
        self.scales = Scales.of(conditions, lubricant)
        self.seconds = step_seconds(conditions, surfaces, time_step)
        self.length = self.seconds * conditions.entrainment_speed / self.scales.length
        self.one_line = surfaces.uniform and conditions.endless
        rough = any(surfaces.rough)
        self.shares = [
            float(one) / max(sum(surfaces.rough), 1) for one in surfaces.rough
        ]  # of what is flattened
        self.attempt = ATTEMPTS[1] if rough else ATTEMPTS[0]  # on smooth bodies, the accurate wedge
        self.followed = rough and time_step == 1.0
        self.moved = _cells_moved(surfaces, self.seconds)

    def start(self, *, standing: bool) -> Snapshot:
        """Time 0, from a contact that has always been as it is, or from one at rest."""
        surface = self.surfaces.composite_at(0.0)
        oil = self.lubricant if standing else None
        solution = solve_contact(
            self.conditions, oil, surface, options=self.options, progress=self.progress
        )
        solution = replace(solution, lubricant=self.lubricant)
        approach = solution.rigid_approach / self.scales.gap
        pressure, problem = solution.pressure / self.scales.pressure, self._problem(surface, None)
        unknowns = Pressures(np.zeros_like(pressure), pressure, approach)
        if solution.oil is not None:
            unknowns = pressures_of(solution, problem, self.scales)
        balance = self._balance(problem, unknowns)
        if not standing:  # what was touching dry has the contact film between
            gap, nothing = (
                np.maximum(solution.gap, self.options.contact_film),
                np.zeros_like(solution.gap),
            )
            solution = replace(solution, gap=gap)
            if self.options.model in TWO_PRESSURES:
                full = Oil(content=np.ones_like(nothing), pressure=nothing, growth=nothing)
                solution = replace(solution, oil=full)
        memory = {} if not standing else {"content_before": balance.content}
        return self._snapshot(0, solution, balance, approach, memory, self.surfaces)

    def step(self, number: int, memory: Memory) -> Snapshot:
        """The contact a step later."""
        began = time.perf_counter()
        surfaces = self.surfaces
        if self.flattening:
            surfaces = surfaces.lowered(memory["lowered_first"], memory["lowered_second"])
        surface = surfaces.composite_at(number * self.seconds)
        whole = self._problem(surface, self._past(memory))
        problem = _on_one_line(whole) if self.one_line else whole
        search, step, attempt = self._search(problem, self._carried(memory, problem))
        solution = search.solution(
            step,
            surface,
            self.conditions,
            self.lubricant,
            seconds=time.perf_counter() - began,
            attempt=attempt,
        )
        balance = step.balance
        if self.one_line:
            across = whole.cells[1]
            unknowns = Pressures(
                np.repeat(balance.oil_pressure, across, axis=1),
                np.repeat(balance.pressure, across, axis=1),
                step.approach,
            )
            balance = self._balance(whole, unknowns)
        kept = {"content_before": memory["content"]}
        kept |= {name: memory[name] for name in _LOWERED if self.flattening}
        return self._snapshot(number, solution, balance, step.approach, kept, surfaces)

    def _carried(self, memory: Memory, problem: Problem) -> Pressures:
        """Where a step begins: what stood in each cell a step before, or it gone on with the roughness by whole cells.

        Asperities take their contacts, cavities and shut-in oil with them, and Newton's steps
        would move each border of these by a cell or two at a time; the smooth bodies' own pressure
        stays. What leaves less is the start.
        """
        (nx, lines), approach = problem.cells, float(memory["approach"])
        starts = []
        for cells in dict.fromkeys((self.moved, 0)):
            before = np.clip(np.arange(nx) - cells, 0, nx - 1)
            oil, pressure = (memory[name][before, :lines] for name in ("oil", "pressure"))
            starts.append(Pressures(oil, pressure, approach))
        return min(starts, key=lambda start: self._balance(problem, start).residual_rms)

    def _search(self, problem: Problem, unknowns: Pressures) -> tuple[Search, Step, str]:
        """The step's way to its solution, and by which attempt."""
        if self.options.model in TWO_PRESSURES:
            mixed = MixedSearch(self.options, self.scales.gap, self.progress)
            return mixed, mixed.go_on(problem, unknowns), ATTEMPTS[0]
        search = Search(self.options, self.scales.gap, self.progress)
        for held in (
            False,
            True,
        ):  # where Newton's steps lead nowhere, the bodies are held and their distance searched
            step = search.climb([problem], unknowns.total, unknowns.approach, held=held)
            if search.settled(self.options.tolerance):
                break
        return search, step, HELD if held else ATTEMPTS[0]

    def _balance(self, problem: Problem, unknowns: Pressures) -> Balance | MixedBalance:
        if self.options.model in TWO_PRESSURES:
            return evaluate(problem, unknowns, second_order=True)
        return problem.evaluate(unknowns.total, unknowns.approach)

    def _problem(self, surface: Surface, past: Past | None) -> Problem:
        posed = contact_problem(
            self.conditions, self.lubricant, surface, self.options, attempt=self.attempt
        )
        return replace(posed, past=past)

    def _past(self, memory: Memory) -> Past:
        content = memory["content"]
        leans = self.options.model == MIXED and self.followed
        first_order = leans or self.options.model == CONSERVING
        if "content_before" in memory and not first_order:
            before, rate, once, twice = memory["content_before"], 1.5, -2.0, 0.5
        else:  # first order: a start from rest has no time before it that flowed, and what leans back does so in space
            before, rate, once, twice = content, 1.0, -1.0, 0.0
        source = once * content + twice * before
        if not self.followed:
            return Past(rate / self.length, source / self.length, self.followed)
        if self.options.model == CONSERVING:
            source[0], source[1:] = 0.0, -content[:-1]
            return Past(rate / self.length, source / self.length, self.followed)
        source[2:] = once * content[1:-1] + twice * before[:-2]
        past = Past(rate / self.length, source / self.length, self.followed)
        if not leans:
            return past
        upstream, leant = (
            np.concatenate([memory[name][:1], memory[name][:-1]]) for name in ("content", "leant")
        )
        leant[:2] = 0.0
        return replace(past, upstream=upstream, leant=leant)

    def _snapshot(
        self,
        number: int,
        solution: ContactSolution,
        balance: Balance | MixedBalance,
        approach: float,
        kept: dict[str, Any],
        surfaces: MovingSurfaces,
    ) -> Snapshot:
        when = number * self.seconds
        memory = kept | {
            "number": np.array(number),
            "pressure": balance.pressure,
            "oil": _oil(balance),
            "approach": np.array(approach),
            "content": balance.content,
        }
        if isinstance(balance, MixedBalance):
            memory["leant"] = balance.leant
        flow, elastic = _powers(balance)
        grid, conditions = solution.grid, self.conditions
        area = self.scales.length**2 * (
            1.0 if conditions.length is None else conditions.length / grid.extent[1]
        )
        energy = self.scales.pressure * self.scales.gap * area
        flattened, track_sq = 0.0, float(np.hypot(surfaces.first.sq, surfaces.second.sq))
        if self.flattening:
            overlap = _overlap(balance) * self.scales.gap * solution.convergence.converged
            for index, name in enumerate(_LOWERED):
                share = self.shares[index] * overlap
                before = kept.get(name, 0.0)
                memory[name] = before + self.surfaces.project_on_track(index, share, when)
                flattened += float(memory[name].mean())
        return Snapshot(
            number=number,
            time=when,
            solution=solution,
            state=state_of(solution, balance),
            flow_power=flow * energy * conditions.entrainment_speed / self.scales.length,
            elastic_energy=elastic * energy,
            flattened=flattened,
            track_sq=track_sq,
            memory=memory,
        )


def _cells_moved(surfaces: MovingSurfaces, seconds: float) -> int:
    """How many cells roughness goes in a step, the mean of both bodies' where both are rough."""
    speeds = [speed for speed, rough in zip(surfaces.speeds, surfaces.rough, strict=True) if rough]
    return round(sum(speeds) / max(len(speeds), 1) * seconds / surfaces.grid.spacing[0])


def _oil(balance: Balance | MixedBalance) -> Field:
    """The oil's unknown."""
    return balance.unknowns.oil if isinstance(balance, MixedBalance) else balance.pressure


def _overlap(balance: Balance | MixedBalance) -> Field:
    """How deep the cap has let the bodies overlap, dimensionless."""
    depth = np.maximum(balance.problem.contact_gap - balance.gap, 0.0)
    return np.where(balance.yielded, depth, 0.0)


def _on_one_line(problem: Problem) -> Problem:
    """What does not vary along y, on one line of cells that is as wide as all."""
    past, (dx, dy) = problem.past, problem.spacing
    return replace(
        problem,
        roughness=problem.roughness[:, :1],
        spacing=(dx, problem.cells[1] * dy),
        past=None if past is None else past.on_one_line,
    )


def _powers(balance: Balance | MixedBalance) -> tuple[float, float]:
    """∫ ε |grad P|² where a film parts the bodies on both sides of a face, and the elastic energy ½ ∫ P V."""
    problem, pressure, faces, parted = (
        balance.problem,
        balance.oil_pressure,
        balance.faces,
        balance.parted,
    )
    assert faces is not None
    dx, dy = problem.spacing
    along = faces.east[:-1] * np.diff(pressure, axis=0) ** 2 * (parted[:-1] & parted[1:])
    across = (
        faces.north
        * (np.roll(pressure, -1, axis=1) - pressure) ** 2
        * (parted & np.roll(parted, -1, axis=1))
    )
    ends = 2.0 * (
        faces.inlet * pressure[0] ** 2 * parted[0] + faces.east[-1] * pressure[-1] ** 2 * parted[-1]
    )
    flow = float((along.sum() + ends.sum()) / dx**2 + across.sum() / dy**2) * dx * dy
    total = balance.pressure
    return flow, 0.5 * float((total * problem.deflection(total)).sum()) * dx * dy
