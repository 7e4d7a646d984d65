"""The conserving contact solved: coarse to fine from the unified solution, and what is tried where that fails."""

import time
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from asperity.arrays import Field
from asperity.conditions import ContactConditions
from asperity.ehl.conserving import Earlier, OilBalance, Unknowns, evaluate
from asperity.ehl.conserving_iterate import OilStep, newton
from asperity.ehl.outcome import ATTEMPTS, Convergence, Figures, GridError, Iteration, Options, SolveStatus
from asperity.ehl.posing import contact_problem, first_guess, grid_levels, on_one_line
from asperity.ehl.problem import Problem
from asperity.ehl.scales import Scales
from asperity.ehl.search import COARSE_TOLERANCE, Progress, Search, figures, grid_error
from asperity.ehl.solution import ContactSolution, Oil
from asperity.ehl.transfer import interpolated
from asperity.errors import BadInput
from asperity.lubricant import Lubricant
from asperity.surface import Surface

BALANCED = 1e-6  # oil that cells may lose and gain, in sum, over the throughflow
MISSING = 0.3  # share of oil that ruptured cells of a unified solution are taken to miss
# ways to the solution on the coarsest grid, the second where the first leads nowhere
WAYS = (ATTEMPTS[0], "with roughness that grew from little")
FIRST_ROUGHNESS = 0.25  # share of the roughness that the second way begins with ...
LEAST_GROWTH = 2e-3  # ... and the least step it takes
GROWN_TOLERANCE = 1e-3
PATIENCE = 8  # Newton steps without progress before they are given up ...
PROGRESS = 0.8
HOPELESS = 20.0  # ... at once if the residual is that many times the best (above BAD)
BAD = 0.1
FIRST_RATE, PROLONGED_RATE = 1.0, 0.3  # inverse of the first time step, in cells: from afar, and from a coarser grid
LEAST_RATE, MOST_RATE = 1e-2, 1e3
EASY_IN_TIME = 8  # Newton steps
TIME_TOLERANCE = 1e-3
NEAR = 0.2  # residual from which Newton's own steps are tried again ...
OFTEN = 5  # ... as after so many time steps


def solve_conserving(
    conditions: ContactConditions,
    lubricant: Lubricant | None,
    surface: Surface,
    *,
    options: Options,
    start: ContactSolution | None = None,
    viscosity_factor: Field | None = None,
    progress: Progress | None = None,
) -> ContactSolution:
    """Solve the rough, lubricated line contact with no oil lost; as `solve_contact`, which calls this.

    Raises
    ------
    BadInput
        for a dry contact, or one that does not repeat across rolling.
    """
    began = time.perf_counter()
    require_conserving(conditions, lubricant)
    scales = Scales.of(conditions, lubricant)
    whole = contact_problem(conditions, lubricant, surface, options, viscosity_factor)
    finest = on_one_line(whole) if whole.uniform else whole
    climb = Climb(options, scales, progress)
    if start is None:
        for way in WAYS:
            step = climb.up(grid_levels(finest), conditions, lubricant, grow=way == WAYS[1])
            if climb.settled:
                break
    else:
        way, step = WAYS[0], climb.settle(finest, unknowns_of(start, finest, scales), options.tolerance)
    discretisation = climb.discretisation_error if start is None else start.convergence.discretisation_error
    return climb.solution(
        step.balance,
        conditions,
        lubricant,
        surface,
        seconds=time.perf_counter() - began,
        attempt=way,
        discretisation=discretisation,
        viscosity_factor=viscosity_factor,
    )


def require_conserving(conditions: ContactConditions, lubricant: Lubricant | None) -> None:
    """Refuse what the conserving model does not cover."""
    if lubricant is None:
        raise BadInput('model "conserving" is about oil, got a dry contact; take model "unified" or name a lubricant')
    if conditions.geometry != "line":
        raise BadInput(f'model "conserving" solves line contacts, got geometry {conditions.geometry}; take "unified"')


def unknowns_of(solution: ContactSolution, problem: Problem, scales: Scales) -> Unknowns:
    """The unknowns of a solution of the unified or the conserving model, on the grid of `problem`."""
    pressure = solution.pressure / scales.pressure
    if pressure.shape != problem.cells:
        raise BadInput(f"start has {solution.grid.cells} cells, the surface {problem.cells}; solve without start")
    approach = solution.rigid_approach / scales.gap
    if solution.oil is None:
        return _from_unified(pressure, approach, problem)
    compliance = problem.deflection.near[0] - problem.deflection.near[3]
    oil, growth = solution.oil, solution.oil.growth / scales.gap
    fluid = np.where(oil.content < 1.0, oil.content - 1.0, oil.pressure / scales.pressure)
    return Unknowns(np.where(growth > 0.0, problem.p_cap + growth / compliance, fluid), pressure, approach)


def _from_unified(pressure: Field, approach: float, problem: Problem) -> Unknowns:
    return Unknowns(np.where(pressure > 0.0, np.minimum(pressure, problem.p_cap), -MISSING), pressure, approach)


def _prolonged(unknowns: Unknowns, cells: tuple[int, int]) -> Unknowns:
    """The unknowns on a finer grid: pressures and missing oil each interpolated, who is ruptured taken from above."""
    fluid, pressure, approach = unknowns
    (nx, ny), (coarse_x, coarse_y) = cells, fluid.shape
    above = fluid[np.arange(nx) * coarse_x // nx][:, np.arange(ny) * coarse_y // ny]
    full, missing = interpolated(np.maximum(fluid, 0.0), cells), interpolated(np.minimum(fluid, 0.0), cells)
    return Unknowns(np.where(above < 0.0, np.minimum(missing, -1e-6), full), interpolated(pressure, cells), approach)


class Climb:
    """The way to the solution, all Newton steps of it on record."""

    def __init__(self, options: Options, scales: Scales, progress: Progress | None) -> None:
        self.options, self.scales, self.progress = options, scales, progress
        self.history: list[Iteration] = []
        self.figures: list[Figures] = []
        self.iteration_error: Figures | None = None
        self.settled = False
        self.steps_left = 0
        self.cell = 0.0  # of the finest grid along x, in half-widths

    @property
    def discretisation_error(self) -> GridError | None:
        """From the last grids; see `grid_error`."""
        return grid_error(self.figures, smooth=False, cell=self.cell)

    def up(
        self, levels: Sequence[Problem], conditions: ContactConditions, lubricant: Lubricant | None, *, grow: bool
    ) -> OilStep:
        """Solve on grid after grid, from the last, coarsest one to the first."""
        self.figures, self.cell = [], levels[0].spacing[0]
        for problem in reversed(levels):
            coarsest, finest = problem is levels[-1], problem is levels[0]
            tolerance = self.options.tolerance if finest else max(COARSE_TOLERANCE, self.options.tolerance)
            if coarsest:
                share = FIRST_ROUGHNESS if grow else 1.0
                unknowns = self._unified(_with_roughness(problem, share), conditions, lubricant)
                if grow:
                    unknowns = self._grown(problem, unknowns)
                step = self.settle(problem, unknowns, tolerance, rate=FIRST_RATE, in_time_first=not grow)
            else:
                unknowns = _prolonged(step.balance.unknowns, problem.cells)
                step = self.settle(problem, unknowns, tolerance, rate=PROLONGED_RATE)
            self.figures.append(self._figures(step))
        return step

    def _unified(self, problem: Problem, conditions: ContactConditions, lubricant: Lubricant | None) -> Unknowns:
        """Where the unified model, which need not be exact, leaves the coarsest grid."""
        search = Search(replace(self.options, tolerance=COARSE_TOLERANCE), self.scales.gap, self.progress)
        step = search.climb([problem], *first_guess(problem, conditions, lubricant, self.scales), held=False)
        self.history += search.history
        return _from_unified(step.balance.pressure, step.approach, problem)

    def _grown(self, problem: Problem, unknowns: Unknowns) -> Unknowns:
        """Close to the solution, by steps in roughness."""
        share = growth = FIRST_ROUGHNESS
        unknowns = self.settle(_with_roughness(problem, share), unknowns, GROWN_TOLERANCE).balance.unknowns
        going = self.settled
        while going and share + growth < 1.0:
            self.steps_left = self.options.max_iterations
            step = self.run(_with_roughness(problem, share + growth), unknowns, GROWN_TOLERANCE)
            if step.left < GROWN_TOLERANCE:
                share, unknowns = share + growth, step.balance.unknowns
                growth *= 1.5 if step.number < PATIENCE else 1.0
            else:
                growth *= 0.4
                going = growth > LEAST_GROWTH
        return unknowns

    def settle(
        self,
        problem: Problem,
        unknowns: Unknowns,
        tolerance: float,
        *,
        rate: float = PROLONGED_RATE,
        in_time_first: bool = False,
    ) -> OilStep:
        """Solve on one grid: by Newton's steps, and where they lead nowhere by time steps of the oil in between."""
        self.steps_left, self.settled = self.options.max_iterations, False
        if not in_time_first:
            step = self.finish(problem, unknowns, tolerance)
        taken, per_cell = 0, 1.0 / problem.spacing[0]
        while not self.settled and self.steps_left > 0 and rate < MOST_RATE:
            now = evaluate(problem, unknowns).flow.content
            step = self.run(problem, unknowns, TIME_TOLERANCE, Earlier(now, rate * per_cell, followed=False))
            if step.left >= TIME_TOLERANCE:
                rate *= 4.0
                continue
            taken, unknowns = taken + 1, step.balance.unknowns
            rate /= 3.0 if step.number < EASY_IN_TIME else 1.5
            left = evaluate(problem, unknowns).residual_rms
            if left < NEAR or rate < LEAST_RATE or taken % OFTEN == 0:
                step = self.finish(problem, unknowns, tolerance)
        return step

    def finish(self, problem: Problem, unknowns: Unknowns, tolerance: float, earlier: Earlier | None = None) -> OilStep:
        """Newton's steps until residual, load, change and the balance of all oil are met, or they lead nowhere."""
        step = self.run(problem, unknowns, tolerance, earlier, closely=True)
        self.settled = self._met(step, tolerance, closely=True)
        return step

    def run(
        self,
        problem: Problem,
        unknowns: Unknowns,
        tolerance: float,
        earlier: Earlier | None = None,
        *,
        closely: bool = False,
    ) -> OilStep:
        """Newton's steps until residual and load are met, `closely` more than that, or they lead nowhere."""
        best, idle, before = np.inf, 0, None
        for step in newton(problem, unknowns, earlier):
            self._record(problem, step)
            idle += 1
            if step.left < PROGRESS * best:
                best, idle = step.left, 0
            hopeless = not np.isfinite(step.left) or step.left > HOPELESS * max(best, BAD)
            if self._met(step, tolerance, closely=closely) or hopeless or idle == PATIENCE:
                break
            if step.number >= self.steps_left:
                break
            before = step
        self.steps_left -= step.number
        if before is not None:
            self.iteration_error = self._figures(step).off(self._figures(before))
        return step

    @staticmethod
    def _met(step: OilStep, tolerance: float, *, closely: bool) -> bool:
        if not closely:
            return step.left < tolerance
        balance = step.balance
        worst = max(balance.residual_rms, abs(balance.load_error), step.change)
        return worst < tolerance and balance.imbalance < BALANCED

    def _figures(self, step: OilStep) -> Figures:
        balance = step.balance
        pressure, touching = balance.unknowns.pressure, balance.in_contact
        return figures(balance.problem, pressure, touching, balance.flow.height, self.scales.gap)

    def _record(self, problem: Problem, step: OilStep) -> None:
        balance = step.balance
        iteration = Iteration(problem.cells, step.number, balance.residual_rms, abs(balance.load_error), step.change)
        self.history.append(iteration)
        if self.progress:
            self.progress(iteration)

    def solution(
        self,
        balance: OilBalance,
        conditions: ContactConditions,
        lubricant: Lubricant | None,
        surface: Surface,
        *,
        seconds: float,
        attempt: str = ATTEMPTS[0],
        discretisation: GridError | None = None,
        viscosity_factor: Field | None = None,
    ) -> ContactSolution:
        """Where the way ended, in SI on the surface's grid, whether it was solved on one line of it or on all."""
        scales, lines = self.scales, surface.grid.cells[1] // balance.problem.cells[1]
        fluid, pressure, approach = balance.unknowns

        def whole(field: Field, scale: float = 1.0) -> Field:
            return np.repeat(field * scale, lines, axis=1)

        return ContactSolution(
            conditions=conditions,
            lubricant=lubricant,
            surface=surface,
            options=self.options,
            pressure=whole(pressure, scales.pressure),
            gap=whole(balance.flow.height, scales.gap),
            in_contact=np.repeat(balance.in_contact, lines, axis=1),
            rigid_approach=approach * scales.gap,
            convergence=Convergence(
                status=SolveStatus.CONVERGED if self.settled else SolveStatus.OUT_OF_ITERATIONS,
                history=tuple(self.history),
                tolerance=self.options.tolerance,
                seconds=seconds,
                attempt=attempt,
                iteration_error=self.iteration_error,
                discretisation_error=discretisation,
            ),
            viscosity_factor=viscosity_factor,
            oil=Oil(
                content=whole(1.0 + np.minimum(fluid, 0.0)),
                pressure=whole(balance.flow.pressure, scales.pressure),
                growth=whole(balance.growth, scales.gap),
            ),
        )


def _with_roughness(problem: Problem, share: float) -> Problem:
    return replace(problem, roughness=share * problem.roughness)
