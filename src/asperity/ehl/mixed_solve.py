"""The contact with two pressures solved: from the dry contact, or coarse to fine from Hertz's pressure."""

import time
from dataclasses import replace

import numpy as np

from asperity.arrays import Field
from asperity.conditions import ContactConditions
from asperity.ehl.dry import dry_contact
from asperity.ehl.iterate import Step
from asperity.ehl.mixed import MixedBalance, Pressures
from asperity.ehl.mixed_iterate import newton
from asperity.ehl.outcome import ATTEMPTS, Options
from asperity.ehl.posing import contact_problem, first_guess, grid_levels, on_one_line, smooth_film
from asperity.ehl.problem import Problem
from asperity.ehl.scales import Scales
from asperity.ehl.search import COARSE_TOLERANCE, MOST_COARSE_ITERATIONS, Progress, Search
from asperity.ehl.solution import ContactSolution, Oil
from asperity.ehl.transfer import interpolated
from asperity.errors import BadInput
from asperity.lubricant import Lubricant
from asperity.surface import Surface

CLIMB, FROM_DRY = ATTEMPTS[0], "from the dry contact"
MOST_BESIDE = 60  # Newton steps on the coarser grid that only tells the error
MOST_ROUGHLY = 80
THIN = 1.0  # film ratio below which the dry contact is the nearer start


def solve_mixed(
    conditions: ContactConditions,
    lubricant: Lubricant | None,
    surface: Surface,
    *,
    options: Options,
    start: ContactSolution | None = None,
    viscosity_factor: Field | None = None,
    progress: Progress | None = None,
) -> ContactSolution:
    """Solve the contact with a pressure each for oil and asperities; as `solve_contact`, which calls this.

    Raises
    ------
    BadInput
        for a dry contact.
    """
    began = time.perf_counter()
    if lubricant is None:
        raise BadInput('model "mixed" is about oil, got a dry contact; take model "unified" or name a lubricant')
    scales = Scales.of(conditions, lubricant)
    whole = contact_problem(conditions, lubricant, surface, options, viscosity_factor)
    whole = replace(whole, accurate=False)
    finest = on_one_line(whole) if whole.uniform else whole
    search = MixedSearch(options, scales.gap, progress)
    if start is not None:
        way, step = CLIMB, search.finish(finest, pressures_of(start, finest, scales))
    else:
        ways = [FROM_DRY, CLIMB] if smooth_film(conditions, lubricant) < THIN * surface.sq else [CLIMB, FROM_DRY]
        for way in ways:
            if way == CLIMB:
                guess = first_guess(grid_levels(finest)[-1], conditions, lubricant, scales)
                step = search.climb_from(finest, *guess)
            else:
                step = search.from_dry(finest)
            if search.settled(options.tolerance):
                search.coarser(finest)
                break
    solution = search.solution(
        step,
        surface,
        conditions,
        lubricant,
        seconds=time.perf_counter() - began,
        attempt=way,
        discretisation=search.discretisation_error if start is None else start.convergence.discretisation_error,
        viscosity_factor=viscosity_factor,
    )
    return replace(solution, oil=_oil(step, surface, scales))


class MixedSearch(Search):
    """The ways to the solution, all steps of them on record."""

    def finish(self, problem: Problem, unknowns: Pressures) -> Step:
        """On the finest grid: with the first-order wedge until that is met roughly, then with the second-order one."""
        tolerance, most = self.options.tolerance, self.options.max_iterations
        roughly = max(COARSE_TOLERANCE, tolerance)
        step = self.run(problem, newton(problem, unknowns, second_order=False), roughly, min(most, MOST_ROUGHLY))
        self.by_first_order, self.cell = self._figures(step), problem.spacing[0]
        return self.run(problem, newton(problem, _reached(step), second_order=True), tolerance, most)

    def climb_from(self, finest: Problem, pressure: Field, approach: float) -> Step:
        """Coarse to fine from Hertz's pressure, all of it the oil's."""
        self.figures, self.smooth = [], not np.any(finest.roughness)
        unknowns = Pressures(pressure, pressure, approach)
        for problem in reversed(grid_levels(finest)):
            if problem.cells != unknowns.total.shape:
                total = interpolated(unknowns.total, problem.cells)
                unknowns = Pressures(
                    np.minimum(interpolated(unknowns.oil, problem.cells), total), total, unknowns.approach
                )
            if problem is finest:
                step = self.finish(problem, unknowns)
            else:
                steps = newton(problem, unknowns, second_order=False)
                step = self.run(problem, steps, max(COARSE_TOLERANCE, self.options.tolerance), MOST_COARSE_ITERATIONS)
            unknowns = _reached(step)
            self.figures.append(self._figures(step))
        return step

    def from_dry(self, finest: Problem) -> Step:
        """From bodies that carry all the load themselves."""
        self.figures, self.smooth = [], False
        across = finest.y / finest.form.aspect
        pressure = np.sqrt(np.maximum(1.0 - (finest.x**2)[:, None] - across**2, 0.0))
        total, approach, _ = dry_contact(replace(finest, lubricant=None, contact_gap=0.0), pressure)
        step = self.finish(finest, Pressures(np.zeros_like(total), total, approach + finest.contact_gap))
        self.figures.append(self._figures(step))
        return step

    def coarser(self, finest: Problem) -> None:
        """Solve the next coarser grid from dry, for what the cells' size may have done; nothing if that fails."""
        levels = grid_levels(finest)
        if len(levels) == 1 or len(self.figures) != 1:
            return
        beside = MixedSearch(replace(self.options, max_iterations=MOST_BESIDE), self.gap_scale, self.progress)
        beside.from_dry(levels[1])
        self.history = [*beside.history, *self.history]
        if beside.settled(self.options.tolerance):
            self.figures = [*beside.figures, *self.figures]


def pressures_of(solution: ContactSolution, problem: Problem, scales: Scales) -> Pressures:
    """The unknowns of a solution of any model, on the grid of `problem`."""
    total = solution.pressure / scales.pressure
    oil = total if solution.oil is None else solution.oil.pressure / scales.pressure
    if problem.cells[1] == 1:
        total, oil = (field.mean(axis=1, keepdims=True) for field in (total, oil))
    if total.shape != problem.cells:
        raise BadInput(f"start has {solution.grid.cells} cells, the surface {problem.cells}; solve without start")
    return Pressures(oil, total, solution.rigid_approach / scales.gap)


def _reached(step: Step) -> Pressures:
    assert isinstance(step.balance, MixedBalance)
    return step.balance.unknowns


def _oil(step: Step, surface: Surface, scales: Scales) -> Oil:
    oil = _reached(step).oil
    whole = np.repeat(oil, surface.grid.cells[1] // oil.shape[1], axis=1) * scales.pressure
    return Oil(content=np.ones_like(whole), pressure=whole, growth=np.zeros_like(whole))
