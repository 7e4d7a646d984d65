"""Solution strategies of the two-pressure models: from the dry contact, or coarse to fine."""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from asperity.contact.conditions import ContactConditions
from asperity.core.arrays import Field
from asperity.ehl.contact_solution import ContactSolution
from asperity.ehl.controls import CONTINUATION, MARCHING, RESIDUALS, SEARCH
from asperity.ehl.models.mixed import MixedBalance, Pressures, evaluate, has_thin_film
from asperity.ehl.models.oil_advection import uses_limiter
from asperity.ehl.models.single_pressure import Problem
from asperity.ehl.models.transient_term import TransientTerm
from asperity.ehl.newton.mixed import newton
from asperity.ehl.newton.single_pressure import Step
from asperity.ehl.outcome import SolveStrategy
from asperity.ehl.problem_setup import coarser_in_all_axes, grid_levels
from asperity.ehl.scales import Scales
from asperity.ehl.strategies.exact_faces import ExactFaceSearch, back_to_first_order
from asperity.ehl.strategies.initial_guess import (
    DryAndLubricated,
    dry_start,
    level_guess,
    roller_start,
)
from asperity.ehl.strategies.oil_state import oil_of, unknowns_of
from asperity.lubricant import Lubricant
from asperity.surface import Surface


class MixedSearch(ExactFaceSearch):
    """Strategies of the two-pressure models, with all steps on record."""

    imbalance = 0.0  # of the last step, where oil is conserved
    max_imbalance = np.inf  # largest one allowed, at any tolerance

    def converged(self, tolerance: float, *, check_load: bool = True) -> bool:
        """Return True if the last step met the tolerance; if last, with conserved oil balanced."""
        closely = tolerance <= self.options.tolerance
        allowed = max(SEARCH.max_imbalance, SEARCH.imbalance_to_tolerance * tolerance)
        return super().converged(tolerance, check_load=check_load) and (
            self.imbalance <= min(self.max_imbalance, allowed if closely else np.inf)
        )

    def solution(
        self,
        step: Step,
        surface: Surface,
        conditions: ContactConditions,
        lubricant: Lubricant | None,
        *,
        seconds: float,
        strategy: SolveStrategy = SolveStrategy.COARSE_TO_FINE,
        start: ContactSolution | None = None,
    ) -> ContactSolution:
        """Return the result of the search with the state of the oil."""
        solution = super().solution(
            step, surface, conditions, lubricant, seconds=seconds, strategy=strategy, start=start
        )
        scales = Scales.from_conditions(conditions, lubricant)
        return replace(solution, oil=oil_of(step, surface, scales))

    def solve_by(
        self,
        strategy: SolveStrategy,
        levels: Sequence[Problem],
        guess: Callable[[Problem], tuple[Field, float]],
    ) -> Step:
        """Solve by one of the strategies on the first of the levels."""
        self.cell, self.by_first_order = levels[0].spacing[0], None  # not an earlier strategy's
        if strategy == SolveStrategy.FROM_DRY:
            return self.from_dry(levels)
        step = self.coarse_to_fine(levels, guess)
        # sharp ends need the robust strategy
        sharp_ends = levels[0].form.roller is not None and strategy == SolveStrategy.COARSE_TO_FINE
        # smooth bodies: oil and asperities never share a cell
        single_pressure_suffices = self.smooth and not sharp_ends
        if single_pressure_suffices and not self.converged(self.options.tolerance):
            step = self.from_single_pressure(levels, guess)
        return step

    def from_single_pressure(
        self, levels: Sequence[Problem], guess: Callable[[Problem], tuple[Field, float]]
    ) -> Step:
        """Solve from the solution of the single-pressure model."""
        finest = levels[0]
        for fixed in (False, True):
            step = self.solve_levels(levels, *guess(levels[-1]), fixed=fixed)
            if self.converged(self.options.tolerance):
                break
        self.figures = self.figures[:-1]
        step = self.continue_from(
            finest, Pressures(step.balance.pressure, step.balance.pressure, step.approach)
        )
        self.figures.append(self.figures_of(step))
        return step

    def continue_from(self, problem: Problem, unknowns: Pressures) -> Step:
        """Solve from a neighbouring solution: second order first, then as from a distant guess."""
        if problem.exact:
            step = self.solve_exact(problem, unknowns, self.options.tolerance)
            if self.converged(self.options.tolerance):
                return step
            robust = replace(problem, exact=False)
            step = self.continue_from(robust, unknowns)
            return self.solve_again([(robust, step)])
        max_steps = min(self.options.max_iterations, CONTINUATION.max_iterations)
        step = self.run(
            problem, newton(problem, unknowns, second_order=True), self.options.tolerance, max_steps
        )
        return (
            step
            if self.converged(self.options.tolerance)
            else self.solve_from_afar(problem, unknowns)
        )

    def solve_from_coarse(
        self, problem: Problem, unknowns: Pressures, *, coarse: bool = False, last: bool = True
    ) -> Step:
        """Solve from a coarser grid's solution: second order first, then as from a distant guess.

        The effect of the order on the results then follows from steps back to first order.
        """
        tolerance, max_steps = self.targets(problem, coarse=coarse, from_coarse=True)
        if problem.conserve and has_thin_film(evaluate(problem, unknowns, second_order=False)):
            step = self.from_refilled_cavities_directly(problem, unknowns)
            if self.converged(tolerance):
                return step
        if uses_limiter(problem):
            step = self.run(
                problem,
                newton(problem, unknowns, second_order=True),
                tolerance,
                min(CONTINUATION.max_iterations, max_steps),
                divergence=RESIDUALS.divergence,
            )
            if self.converged(tolerance):
                if not coarse and not self.is_guess:
                    self.by_first_order = self.figures_of(back_to_first_order(problem, step))
                return step
        return self.solve_from_afar(problem, unknowns, coarse=coarse, last=last)

    def refine_third_order(self, problem: Problem, step: Step) -> tuple[SolveStrategy, Step]:
        """Refine a robust solution of smooth bodies with the third-order wedge.

        Returns strategy and step, those of the robust solution if this fails.
        """
        history = list(self.history)
        figures = list(self.figures)
        error = self.iteration_error
        better = self.run(
            problem,
            newton(problem, unknowns_of(step), second_order=False),
            self.options.tolerance,
            CONTINUATION.max_iterations,
        )
        if self.converged(self.options.tolerance):
            self.figures[-1] = self.figures_of(better)
            return SolveStrategy.COARSE_TO_FINE, better
        self.history, self.figures, self.iteration_error = history, figures, error
        return SolveStrategy.SECOND_ORDER, step

    def solve_from_afar(
        self,
        problem: Problem,
        unknowns: Pressures,
        *,
        coarse: bool = False,
        length: float = 1.0,
        last: bool = True,
    ) -> Step:
        """Solve from a distant guess: time steps first, then the steady contact.

        The first time step is `length` half-widths long. The wedge is first order until a coarse
        tolerance is met, then second; where oil is conserved, first order throughout. If time steps
        fail, the `last` resort for conserved oil is the contact with refilled cavities, and then
        the steady contact directly.
        """
        tolerance, max_steps = self.targets(problem, coarse=coarse)
        if problem.conserve or not problem.accurate:
            step = self.march_in_time(problem, unknowns, length)
            if not self.converged(MARCHING.tolerance) and not last:
                return step
            if not self.converged(MARCHING.tolerance) and problem.conserve:
                step = self.from_refilled_cavities(problem, unknowns, length)
            unknowns = unknowns_of(step) if self.converged(MARCHING.tolerance) else unknowns
        if problem.accurate and problem.form.roller is not None:
            max_steps = min(max_steps, CONTINUATION.max_iterations)
        if not uses_limiter(problem):
            return self.run(
                problem, newton(problem, unknowns, second_order=False), tolerance, max_steps
            )
        step = self._solve_first_order(
            problem, unknowns, length, min(max_steps, SEARCH.max_long_iterations), tolerance
        )
        if not self.converged(RESIDUALS.initial_guess):
            return step
        self.by_first_order = self.figures_of(step)
        return self.run(
            problem, newton(problem, unknowns_of(step), second_order=True), tolerance, max_steps
        )

    def _solve_first_order(
        self, problem: Problem, unknowns: Pressures, length: float, max_steps: int, tolerance: float
    ) -> Step:
        """Solve roughly with the first-order wedge; retry from more accurate time steps."""
        roughly = max(RESIDUALS.rough_solution, tolerance)
        steps = newton(problem, unknowns, second_order=False)
        step = self.run(problem, steps, roughly, max_steps, divergence=RESIDUALS.divergence)
        if self.converged(roughly):
            return step
        step = self.march_in_time(problem, unknowns, length, tolerance=RESIDUALS.rough_solution)
        steps = newton(problem, unknowns_of(step), second_order=False)
        return self.run(problem, steps, roughly, max_steps)

    def march_in_time(
        self,
        problem: Problem,
        unknowns: Pressures,
        first: float,
        *,
        tolerance: float = MARCHING.tolerance,
    ) -> Step:
        """Approach the steady contact in growing time steps, each from the last result.

        A step starts with the oil present and has little to change: if Newton does not converge,
        the step was too long. From a guess with too little information on the oil no step is short
        enough.
        """
        length = first
        content = evaluate(problem, unknowns, second_order=False).content
        max_steps = min(MARCHING.max_newton_steps, self.options.max_iterations)
        for _ in range(MARCHING.max_steps):
            stepped = replace(problem, past=implicit_step(problem, length, content))
            steps = newton(stepped, unknowns, second_order=False)
            step = self.run(stepped, steps, tolerance, max_steps)
            if self.converged(tolerance):
                unknowns = unknowns_of(step)
                content = step.balance.content
                if length >= MARCHING.final_length:
                    break
                length *= 3.0 if step.number <= 2 else 2.0 if step.number <= 4 else 1.2
            elif length < MARCHING.min_length * first:
                break
            else:  # residuals of earlier steps may cause cycles: a closer tolerance
                length, tolerance = 0.25 * length, min(tolerance, RESIDUALS.rough_solution)
        return step

    def from_refilled_cavities(self, problem: Problem, unknowns: Pressures, length: float) -> Step:
        """Solve for conserved oil from the contact with refilled cavities, in time steps."""
        refilled, start = _refilled(problem, unknowns)
        step = self.march_in_time(refilled, start, length)
        return (
            self.march_in_time(problem, unknowns_of(step), length)
            if self.converged(MARCHING.tolerance)
            else step
        )

    def from_refilled_cavities_directly(self, problem: Problem, unknowns: Pressures) -> Step:
        """Solve for conserved oil from refilled cavities, without time steps: they close films."""
        refilled, start = _refilled(problem, unknowns)
        steps = newton(refilled, start, second_order=False)
        roughly = RESIDUALS.coarse_grid
        step = self.run(refilled, steps, roughly, CONTINUATION.max_iterations)
        steps = newton(problem, unknowns_of(step), second_order=False)
        return self.run(problem, steps, self.options.tolerance, CONTINUATION.max_iterations)

    def coarse_to_fine(
        self, levels: Sequence[Problem], guess: Callable[[Problem], tuple[Field, float]]
    ) -> Step:
        """Solve coarse to fine from Hertz pressure, carried by the oil.

        Restarts from there after a grid that does not converge.
        """
        self.figures, self.smooth = [], not np.any(levels[0].roughness)
        unknowns = None
        roller = levels[0].accurate and levels[0].form.roller is not None
        coarser: DryAndLubricated | None = None
        for problem in reversed(levels):
            if roller:
                dry, unknowns = roller_start(problem, coarser, *guess(problem))
            else:
                unknowns = level_guess(problem, unknowns, guess)
            if problem is levels[0]:
                step = (
                    self.solve_from_coarse(problem, unknowns)
                    if self.figures
                    else self.solve_from_afar(problem, unknowns)
                )
            else:
                step = self.solve_coarse(problem, unknowns)
            if self.smooth and not self.converged(RESIDUALS.rough_solution):
                self.figures, unknowns, coarser = [], None, None
                continue
            if problem is not levels[0] and not self.converged(RESIDUALS.rough_solution):
                self.figures = []  # an initial guess, but no solution to compare with
            elif coarser_in_all_axes(problem, levels[0]):
                self.keep(problem, step)
            unknowns = unknowns_of(step)
            coarser = DryAndLubricated(dry, unknowns) if roller else None
        if levels[0].conserve:  # coarser grids do not conserve oil
            self.figures = self.figures[-1:]
        return step

    def solve_coarse(self, problem: Problem, unknowns: Pressures) -> Step:
        """Solve roughly, as a guess for the next finer grid."""
        tolerance = max(RESIDUALS.coarse_grid, self.options.tolerance)
        steps = newton(replace(problem, conserve=False), unknowns, second_order=False)
        return self.run(problem, steps, tolerance, CONTINUATION.max_iterations)

    def from_dry(self, levels: Sequence[Problem]) -> Step:
        """Solve from the dry contact, on successive grids.

        The effect of oil on a grid is transferred to the dry contact of the next finer one.
        """
        self.figures, self.smooth = [], False
        coarser, dry = None, None
        for problem in reversed(levels):
            total, approach = dry_start(problem, dry)
            dry = Pressures(np.zeros_like(total), total, approach + problem.contact_gap)
            finest = problem is levels[0]
            start = dry if coarser is None else coarser.transfer_to(problem, dry)
            if coarser is None:
                step = self.solve_from_afar(problem, start, coarse=not finest)
            else:
                step = self.solve_from_coarse(problem, start, coarse=not finest, last=False)
            # the effect of oil on the coarser grid was no good guess
            if coarser is not None and not self.converged(RESIDUALS.initial_guess):
                step = self.solve_from_afar(
                    problem, dry, coarse=not finest, length=2.0 * problem.spacing[0]
                )
            if finest or self.converged(max(RESIDUALS.rough_solution, self.options.tolerance)):
                if coarser_in_all_axes(problem, levels[0]):
                    self.keep(problem, step)
                coarser = DryAndLubricated(dry, unknowns_of(step))
            else:
                self.figures, coarser = [], None
        return step

    def _record(self, problem: Problem, step: Step) -> None:
        """Record a step and the imbalance of conserved oil."""
        balance = step.balance
        self.imbalance = (
            balance.imbalance if isinstance(balance, MixedBalance) and problem.conserve else 0.0
        )
        super()._record(problem, step)

    def solve_coarser_grid(self, finest: Problem) -> None:
        """Solve the next coarser grid from dry, to estimate the discretisation error.

        There is no effect if that fails.
        """
        levels = grid_levels(finest)
        if len(levels) == 1 or len(self.figures) != 1 or not coarser_in_all_axes(levels[1], finest):
            return
        if not np.any(levels[1].form.hertz(levels[1].x, levels[1].y)):
            return  # no dry contact on such cells
        coarse_search = MixedSearch(
            replace(self.options, max_iterations=CONTINUATION.max_iterations),
            self.gap_scale,
            self.progress,
        )
        coarse_search.from_dry(levels[1:2])
        self.history = [*coarse_search.history, *self.history]
        if coarse_search.converged(self.options.tolerance):
            self.figures = [*coarse_search.figures, *self.figures]
            self.solved = [*coarse_search.solved, *self.solved]


def _refilled(problem: Problem, unknowns: Pressures) -> tuple[Problem, Pressures]:
    """Return the problem with refilled cavities, and its initial guess from conserved oil."""
    oil = np.clip(unknowns.oil, 0.0, problem.p_cap)
    return replace(problem, conserve=False), Pressures(oil, unknowns.total, unknowns.approach)


def implicit_step(problem: Problem, length: float, content: Field) -> TransientTerm:
    """Add an implicit time step to the problem, with the oil present at its start."""
    past = (
        TransientTerm(0.0, np.zeros_like(content), lagrangian=False)
        if problem.past is None
        else problem.past
    )
    return replace(past, rate=past.rate + 1.0 / length, source=past.source - content / length)
