"""Strategies of the two-pressure models on one grid, from close guesses to distant ones."""

from collections.abc import Sequence
from dataclasses import replace
from itertools import islice

import numpy as np

from asperity.core.arrays import Field
from asperity.ehl.controls import CONTINUATION, MARCHING, RESIDUALS, SEARCH
from asperity.ehl.models.mixed import Pressures, evaluate, has_thin_film
from asperity.ehl.models.oil_advection import uses_limiter
from asperity.ehl.models.single_pressure import Problem
from asperity.ehl.models.transient_term import TransientTerm
from asperity.ehl.newton.mixed import newton
from asperity.ehl.newton.single_pressure import Step
from asperity.ehl.strategies.mixed_search import GridStrategy, Level, MixedSearch
from asperity.ehl.strategies.oil_state import load_share_of, unknowns_of


class ExactFaces(GridStrategy):
    """Exact face mobilities, from the guess or from the solution with arithmetic means.

    Newton's method needs a close initial guess on exact faces, and the solution with arithmetic
    means is one: from there it takes 5 to 50 steps.
    """

    def applies(self, problem: Problem, _guess: Pressures) -> bool:
        """Return True for exact faces."""
        return problem.exact

    def solve(self, search: MixedSearch, problem: Problem, guess: Pressures, _level: Level) -> Step:
        """Solve from the guess; if that fails, with arithmetic means first."""
        step = solve_exact(search, problem, guess, search.options.tolerance)
        if search.converged(search.options.tolerance):
            return step
        robust = replace(problem, exact=False)
        step = search.first_converged(FROM_NEIGHBOUR, robust, guess)
        return solve_again(search, [(robust, unknowns_of(step))])


class SecondOrder(GridStrategy):
    """Second-order wedge at once, from a neighbouring solution."""

    def solve(self, search: MixedSearch, problem: Problem, guess: Pressures, level: Level) -> Step:
        """Solve in few steps."""
        tolerance, max_steps = self.target(search, problem, level)
        max_steps = min(CONTINUATION.max_iterations, max_steps)
        return search.steps(problem, guess, tolerance, max_steps, second_order=True)


class SecondOrderFromCoarse(SecondOrder):
    """Second-order wedge at once, from a coarser grid's solution.

    The effect of the order on the results then follows from steps back to first order.
    """

    def applies(self, problem: Problem, _guess: Pressures) -> bool:
        """Return True for a wedge that has a limiter."""
        return uses_limiter(problem)

    def solve(self, search: MixedSearch, problem: Problem, guess: Pressures, level: Level) -> Step:
        """Solve in few steps, unless these diverge."""
        tolerance, max_steps = self.target(search, problem, level)
        max_steps = min(CONTINUATION.max_iterations, max_steps)
        step = search.steps(
            problem, guess, tolerance, max_steps, second_order=True, divergence=RESIDUALS.divergence
        )
        if search.converged(tolerance) and not level.coarse and not search.is_guess:
            search.by_first_order = search.figures_of(back_to_first_order(problem, step))
        return step


class RefilledCavities(GridStrategy):
    """Conserved oil from refilled cavities, without time steps, which would close a thin film."""

    def applies(self, problem: Problem, guess: Pressures) -> bool:
        """Return True for a thin film of conserved oil."""
        return problem.conserve and has_thin_film(evaluate(problem, guess, second_order=False))

    def solve(self, search: MixedSearch, problem: Problem, guess: Pressures, _level: Level) -> Step:
        """Solve with refilled cavities roughly, then with conserved oil."""
        refilled, start = _refilled(problem, guess)
        few = CONTINUATION.max_iterations
        step = search.steps(refilled, start, RESIDUALS.coarse_grid, few)
        return search.steps(problem, unknowns_of(step), search.options.tolerance, few)


class FromAfar(GridStrategy):
    """From a distant guess: time steps first, then the steady contact.

    The wedge is first order until a coarse tolerance is met, then second; where oil is conserved,
    first order throughout.
    """

    def coarse_tolerance(self, problem: Problem) -> float:
        """Return the tolerance on a coarser grid."""
        return RESIDUALS.coarse_grid if problem.accurate else 0.5 * RESIDUALS.rough_solution

    def solve(self, search: MixedSearch, problem: Problem, guess: Pressures, level: Level) -> Step:
        """Solve in time steps, then steadily.

        If time steps fail, the last resort for conserved oil is the contact with refilled cavities,
        and then the steady contact directly.
        """
        tolerance, max_steps = self.target(search, problem, level)
        if problem.conserve or not problem.accurate:
            step = march_in_time(search, problem, guess, level.length)
            if not search.converged(MARCHING.tolerance) and not level.last:
                return step
            if not search.converged(MARCHING.tolerance) and problem.conserve:
                step = _march_from_refilled(search, problem, guess, level.length)
            guess = unknowns_of(step) if search.converged(MARCHING.tolerance) else guess
        if problem.accurate and problem.form.roller is not None:
            max_steps = min(max_steps, CONTINUATION.max_iterations)
        if not uses_limiter(problem):
            return search.steps(problem, guess, tolerance, max_steps)
        step = self._first_order(search, problem, guess, level.length, max_steps, tolerance)
        if not search.converged(RESIDUALS.initial_guess):
            return step
        search.by_first_order = search.figures_of(step)
        return search.steps(problem, unknowns_of(step), tolerance, max_steps, second_order=True)

    def _first_order(
        self,
        search: MixedSearch,
        problem: Problem,
        guess: Pressures,
        length: float,
        max_steps: int,
        tolerance: float,
    ) -> Step:
        """Solve roughly with the first-order wedge; retry from more accurate time steps."""
        max_steps = min(max_steps, SEARCH.max_long_iterations)
        roughly = max(RESIDUALS.rough_solution, tolerance)
        step = search.steps(problem, guess, roughly, max_steps, divergence=RESIDUALS.divergence)
        if search.converged(roughly):
            return step
        step = march_in_time(search, problem, guess, length, tolerance=RESIDUALS.rough_solution)
        return search.steps(problem, unknowns_of(step), roughly, max_steps)


class CoarseGuess(GridStrategy):
    """Rough solution of a coarser grid, as a guess for the next finer one; oil is not conserved."""

    def solve(self, search: MixedSearch, problem: Problem, guess: Pressures, level: Level) -> Step:
        """Solve with the first-order wedge."""
        tolerance, _ = self.target(search, problem, level)
        refilling = replace(problem, conserve=False)
        return search.steps(refilling, guess, tolerance, CONTINUATION.max_iterations)


FROM_NEIGHBOUR = (ExactFaces(), SecondOrder(), FromAfar())
FROM_COARSE = (RefilledCavities(), SecondOrderFromCoarse(), FromAfar())
FROM_AFAR = (FromAfar(),)
AS_GUESS = (CoarseGuess(),)


def solve_again(search: MixedSearch, solved: Sequence[tuple[Problem, Pressures]]) -> Step:
    """Solve the contact again on exact faces, on every grid that is `solved`, coarse to fine.

    Where heat thins the oil a hundredfold from cell to cell this may fail; then the solution with
    arithmetic means is kept.
    """
    search.figures, search.by_first_order = [], None
    for problem, guess in solved:
        exact, last = replace(problem, exact=True), problem is solved[-1][0]
        tolerance = search.options.tolerance
        tolerance = tolerance if last else max(RESIDUALS.coarse_grid, tolerance)
        step = solve_exact(search, exact, guess, tolerance)
        if last or search.converged(tolerance):
            search.keep(exact, step)
        else:
            search.figures = []
    if search.converged(tolerance):
        search.by_first_order = search.figures_of(back_to_first_order(exact, step))
    elif problem.viscosity_factor is not None:
        search.arithmetic = True
        return search.first_converged(FROM_NEIGHBOUR, problem, guess)
    return step


def solve_exact(
    search: MixedSearch, problem: Problem, unknowns: Pressures, tolerance: float
) -> Step:
    """Solve exact faces by shared steps on the second-order wedge, or by cell through the first."""
    max_steps = min(SEARCH.max_long_iterations, search.options.max_iterations)
    few, last = max_steps, search.options.max_iterations
    if problem.past is not None:
        few, last = min(CONTINUATION.max_iterations, max_steps), max_steps
    step = search.steps(problem, unknowns, tolerance, few, second_order=True)
    if search.converged(tolerance):
        return step
    roughly = max(RESIDUALS.rough_solution, tolerance)
    step = search.steps(problem, unknowns, roughly, max_steps, shared=False)
    return search.steps(
        problem, unknowns_of(step), tolerance, last, second_order=True, shared=False
    )


def back_to_first_order(problem: Problem, step: Step) -> Step:
    """Step from the second-order wedge's solution towards the first-order one.

    It ends when a coarse tolerance is met, or steps no longer change the load share.
    """
    back, shares = step, [load_share_of(step)]
    for back in islice(
        newton(problem, unknowns_of(step), second_order=False),
        CONTINUATION.max_iterations + 1,
    ):
        if back.number > 0:
            shares.append(load_share_of(back))
            change, total_change = (abs(shares[-1] - shares[index]) for index in (-2, 0))
            if (
                back.balance.residual_rms < RESIDUALS.rough_solution
                or change < SEARCH.backward_tolerance * total_change
            ):
                break
    return back


def march_in_time(
    search: MixedSearch,
    problem: Problem,
    unknowns: Pressures,
    first: float,
    *,
    tolerance: float = MARCHING.tolerance,
) -> Step:
    """Approach the steady contact in growing time steps, each from the last result.

    A step starts with the oil present and has little to change: if Newton does not converge, the
    step was too long. From a guess with too little information on the oil no step is short enough.
    """
    length = first
    content = evaluate(problem, unknowns, second_order=False).content
    max_steps = min(MARCHING.max_newton_steps, search.options.max_iterations)
    for _ in range(MARCHING.max_steps):
        stepped = replace(problem, past=implicit_step(problem, length, content))
        step = search.steps(stepped, unknowns, tolerance, max_steps)
        if search.converged(tolerance):
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


def implicit_step(problem: Problem, length: float, content: Field) -> TransientTerm:
    """Add an implicit time step to the problem, with the oil present at its start."""
    past = (
        TransientTerm(0.0, np.zeros_like(content), lagrangian=False)
        if problem.past is None
        else problem.past
    )
    return replace(past, rate=past.rate + 1.0 / length, source=past.source - content / length)


def _march_from_refilled(
    search: MixedSearch, problem: Problem, unknowns: Pressures, length: float
) -> Step:
    """Solve for conserved oil from the contact with refilled cavities, in time steps."""
    refilled, start = _refilled(problem, unknowns)
    step = march_in_time(search, refilled, start, length)
    return (
        march_in_time(search, problem, unknowns_of(step), length)
        if search.converged(MARCHING.tolerance)
        else step
    )


def _refilled(problem: Problem, unknowns: Pressures) -> tuple[Problem, Pressures]:
    """Return the problem with refilled cavities, and its initial guess from conserved oil."""
    oil = np.clip(unknowns.oil, 0.0, problem.p_cap)
    return replace(problem, conserve=False), Pressures(oil, unknowns.total, unknowns.approach)
