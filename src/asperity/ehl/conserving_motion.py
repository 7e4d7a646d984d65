"""A contact in time that loses no oil: rough surfaces that run through it, step after step along the way of the oil.

m_i^n - m_(i-1)^(n-1) = Δt div(Poiseuille)^n with Δt = Δx/u: what the oil carries along, and the gap that closes or
opens around it, is exact, only what pressure drives is of first order in time. Where nothing moves it is the
snapshot's own balance. The load is held at every step. As `asperity.ehl.motion`, whose histories these are too.
"""

import time
from collections.abc import Iterator
from dataclasses import replace
from itertools import count
from typing import NamedTuple

import numpy as np

from asperity.arrays import Field
from asperity.conditions import ContactConditions
from asperity.ehl.conserving import Earlier, OilBalance, Unknowns, evaluate
from asperity.ehl.conserving_iterate import OilStep
from asperity.ehl.conserving_solve import Climb, require_conserving, unknowns_of
from asperity.ehl.motion import Memory, Snapshot, step_seconds
from asperity.ehl.outcome import CONSERVING, UNIFIED, Options, Start
from asperity.ehl.posing import contact_problem
from asperity.ehl.problem import Problem
from asperity.ehl.scales import Scales
from asperity.ehl.search import Progress
from asperity.ehl.solution import ContactSolution, Oil
from asperity.ehl.solve import solve_contact
from asperity.ehl.state import state_of
from asperity.errors import BadInput
from asperity.lubricant import Lubricant
from asperity.surface import MovingSurfaces

SHORTEST_WAY = 1.0 / 64.0  # of a step: the least that the contact is led on by where a whole step leads nowhere


class Moment(NamedTuple):
    """All that the next step needs: unknowns, the oil that each cell holds, and what the step to here began with.

    `roughness` is dimensionless, of the composite surface; all (nx, ny).
    """

    unknowns: Unknowns
    content: Field
    content_before: Field
    roughness: Field


def advance(climb: Climb, problem: Problem, before: Moment) -> tuple[OilStep, Moment]:
    """The contact one step of Δx/u later; `climb.settled` tells whether its equations are met.

    Parameters
    ----------
    climb : whose options and record are used
    problem : the contact as the roughness lies after the step
    before : where it was
    """
    climb.steps_left, tolerance = climb.options.max_iterations, climb.options.tolerance
    unknowns, done, way = before.unknowns, 0.0, 1.0
    while True:
        reached = min(1.0, done + way)
        led = replace(problem, roughness=before.roughness + reached * (problem.roughness - before.roughness))
        content = before.content_before + reached * (before.content - before.content_before)
        earlier = Earlier(content, 1.0 / problem.spacing[0], followed=True)
        step = climb.finish(led, unknowns, tolerance, earlier)
        if climb.settled:
            done, unknowns = reached, step.balance.unknowns
            if done == 1.0:
                break
        else:  # lead the contact on from what it was: the same equations, changed little by little
            way *= 0.5
        if way < SHORTEST_WAY or climb.steps_left <= 0:
            climb.settled = False
            break
    if not climb.settled:  # as far as a whole step gets, so that what is left of it is that of the step
        step = climb.finish(problem, unknowns, tolerance, Earlier(before.content, earlier.rate, followed=True))
    balance = step.balance
    return step, Moment(balance.unknowns, balance.flow.content, before.content, problem.roughness)


def moving_conserving_contact(
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
    """Yield the contact at time 0 and then after each step, for as long as anybody asks; as `moving_contact`.

    A step that does not converge is yielded as it is, marked in `solution.convergence`, and the next goes on from it.

    Raises
    ------
    BadInput
        for a step of other than one cell, flattening, or a contact that `solve_contact` refuses.
    NotConverged
        if there is no snapshot to start from.
    """
    require_conserving(conditions, lubricant)
    if time_step != 1.0:
        raise BadInput(f'model "conserving" follows the oil from cell to cell: time step must be 1, got {time_step:g}')
    if flattening:
        raise BadInput('model "conserving" does not remember what it flattens; take flattening out, or model "unified"')
    if start not in ("steady", "stationary"):
        raise BadInput(f"start must be steady or stationary, got {start!r}")
    options = replace(options or Options(), model=CONSERVING)
    run = _Run(conditions, lubricant, surfaces, options, progress)
    if resume is None:
        first = run.start(standing=start == "steady")
        yield first
        resume = first.memory
    for number in count(int(resume["number"]) + 1):
        snapshot = run.step(number, resume)
        yield snapshot
        resume = snapshot.memory


class _Run:
    """What stays the same from step to step, and how one is taken."""

    def __init__(
        self,
        conditions: ContactConditions,
        lubricant: Lubricant,
        surfaces: MovingSurfaces,
        options: Options,
        progress: Progress | None,
    ) -> None:
        self.conditions, self.lubricant, self.surfaces = conditions, lubricant, surfaces
        self.options, self.progress = options, progress
        self.scales = Scales.of(conditions, lubricant)
        self.seconds = step_seconds(conditions, surfaces, 1.0)

    def problem(self, number: int) -> Problem:
        """The contact as the surfaces lie after `number` steps."""
        surface = self.surfaces.at(number * self.seconds)
        return contact_problem(self.conditions, self.lubricant, surface, self.options)

    def start(self, *, standing: bool) -> Snapshot:
        """Time 0, from a contact that has always been as it is, or from one at rest whose gaps are full of oil."""
        surface, problem = self.surfaces.at(0.0), self.problem(0)
        if standing:
            solution = solve_contact(
                self.conditions, self.lubricant, surface, options=self.options, progress=self.progress
            )
            balance = evaluate(problem, unknowns_of(solution, problem, self.scales))
        else:
            dry = replace(self.options, model=UNIFIED)
            solution = solve_contact(self.conditions, None, surface, options=dry, progress=self.progress)
            pressure, nothing = solution.pressure / self.scales.pressure, np.zeros_like(solution.pressure)
            balance = evaluate(problem, Unknowns(nothing, pressure, solution.rigid_approach / self.scales.gap))
            solution = replace(
                solution,
                lubricant=self.lubricant,
                options=self.options,
                gap=balance.flow.height * self.scales.gap,
                in_contact=balance.in_contact,
                oil=Oil(content=np.ones_like(nothing), pressure=nothing, growth=nothing),
            )
        content = balance.flow.content
        moment = Moment(balance.unknowns, content, content, problem.roughness)
        return self._snapshot(0, solution, balance, moment)

    def step(self, number: int, memory: Memory) -> Snapshot:
        """The contact a step later."""
        began = time.perf_counter()
        before = Moment(
            Unknowns(memory["fluid"], memory["pressure"], float(memory["approach"])),
            memory["content"],
            memory["content_before"],
            self.problem(number - 1).roughness,
        )
        climb = Climb(self.options, self.scales, self.progress)
        step, after = advance(climb, self.problem(number), before)
        solution = climb.solution(
            step.balance,
            self.conditions,
            self.lubricant,
            self.surfaces.at(number * self.seconds),
            seconds=time.perf_counter() - began,
        )
        return self._snapshot(number, solution, step.balance, after)

    def _snapshot(self, number: int, solution: ContactSolution, balance: OilBalance, moment: Moment) -> Snapshot:
        fluid, pressure, approach = moment.unknowns
        flow, elastic = _powers(balance)
        conditions, scales, grid = self.conditions, self.scales, solution.grid
        area = scales.length**2 * (1.0 if conditions.length is None else conditions.length / grid.extent[1])
        energy = scales.pressure * scales.gap * area
        return Snapshot(
            number=number,
            time=number * self.seconds,
            solution=solution,
            state=state_of(solution, balance),
            flow_power=flow * energy * conditions.entrainment_speed / scales.length,
            elastic_energy=elastic * energy,
            flattened=0.0,
            track_sq=float(np.hypot(self.surfaces.first.sq, self.surfaces.second.sq)),
            memory={
                "number": np.array(number),
                "fluid": fluid,
                "pressure": pressure,
                "approach": np.array(approach),
                "content": moment.content,
                "content_before": moment.content_before,
            },
        )


def _powers(balance: OilBalance) -> tuple[float, float]:
    """∫ ε |grad P_f|² and the elastic energy ½ ∫ P V."""
    problem, flow, pressure = balance.problem, balance.flow, balance.unknowns.pressure
    dx, dy = problem.spacing
    oil, eps = flow.pressure, flow.mobility
    along = (eps[1:] + eps[:-1]) / 2.0 * np.diff(oil, axis=0) ** 2
    across = (eps + np.roll(eps, -1, axis=1)) / 2.0 * (np.roll(oil, -1, axis=1) - oil) ** 2
    ends = (eps[[0, -1]] + flow.ambient) * oil[[0, -1]] ** 2
    driven = float((along.sum() + ends.sum()) / dx**2 + across.sum() / dy**2) * dx * dy
    return driven, 0.5 * float((pressure * problem.deflection(pressure)).sum()) * dx * dy
