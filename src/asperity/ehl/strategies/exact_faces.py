"""Solution on face mobilities that are exact for a linear gap, from one with arithmetic means.

Newton's method needs a close initial guess on exact faces, and the solution with arithmetic means
is one: from there it takes 5 to 50 steps.
"""

from abc import abstractmethod
from collections.abc import Sequence
from dataclasses import replace
from itertools import islice

from asperity.ehl.controls import CONTINUATION, RESIDUALS, SEARCH
from asperity.ehl.models.mixed import Pressures
from asperity.ehl.models.single_pressure import Problem
from asperity.ehl.newton.mixed import newton
from asperity.ehl.newton.single_pressure import Step
from asperity.ehl.strategies.grid_continuation import Search
from asperity.ehl.strategies.oil_state import load_share_of, unknowns_of


class ExactFaceSearch(Search):
    """Search that solves again on exact faces."""

    solved: Sequence[tuple[Problem, Step]] = ()  # of the figures
    arithmetic = False  # the last step has arithmetic means in place of exact face mobilities
    is_guess = False  # the solution is only an initial guess for exact face mobilities

    @abstractmethod
    def continue_from(self, problem: Problem, unknowns: Pressures) -> Step:
        """Solve from a neighbouring solution."""

    def keep(self, problem: Problem, step: Step) -> None:
        """Keep the figures of a grid's solution, for the estimate of the discretisation error."""
        self.figures.append(self.figures_of(step))
        self.solved = [*self.solved, (problem, step)][-len(self.figures) :]

    def targets(
        self, problem: Problem, *, coarse: bool, from_coarse: bool = False
    ) -> tuple[float, int]:
        """Return tolerance and largest number of steps, for the finest or a coarser grid."""
        tolerance = self.options.tolerance
        max_steps = self.options.max_iterations
        if not coarse:
            return tolerance, max_steps
        roughly = (
            RESIDUALS.coarse_grid
            if problem.accurate or from_coarse
            else 0.5 * RESIDUALS.rough_solution
        )
        return max(roughly, tolerance), min(CONTINUATION.max_iterations, max_steps)

    def solve_again(self, solved: Sequence[tuple[Problem, Step]]) -> Step:
        """Solve the contact again on exact faces, on every grid that is `solved`, coarse to fine.

        Where heat thins the oil a hundredfold from cell to cell this may fail; then the solution
        with arithmetic means is kept.
        """
        self.figures, self.by_first_order = [], None
        for problem, kept in solved:
            exact, last = replace(problem, exact=True), problem is solved[-1][0]
            tolerance, _ = self.targets(exact, coarse=not last, from_coarse=True)
            step = self.solve_exact(exact, unknowns_of(kept), tolerance)
            if last or self.converged(tolerance):
                self.keep(exact, step)
            else:
                self.figures = []
        if self.converged(self.options.tolerance):
            self.by_first_order = self.figures_of(back_to_first_order(exact, step))
        elif problem.viscosity_factor is not None:
            self.arithmetic = True
            return self.continue_from(replace(problem, exact=False), unknowns_of(kept))
        return step

    def solve_exact(self, problem: Problem, unknowns: Pressures, tolerance: float) -> Step:
        """Solve by shared steps on the second-order wedge, or by cell through the first order."""
        max_steps = min(SEARCH.max_long_iterations, self.options.max_iterations)
        steady = problem.past is None
        first_limit = max_steps if steady else min(CONTINUATION.max_iterations, max_steps)
        steps = newton(problem, unknowns, second_order=True)
        step = self.run(problem, steps, tolerance, first_limit)
        if self.converged(tolerance):
            return step
        roughly = max(RESIDUALS.rough_solution, tolerance)
        steps = newton(problem, unknowns, second_order=False, shared=False)
        step = self.run(problem, steps, roughly, max_steps)
        steps = newton(problem, unknowns_of(step), second_order=True, shared=False)
        return self.run(problem, steps, tolerance, max_steps)


def back_to_first_order(problem: Problem, step: Step) -> Step:
    """Step from the second-order wedge's solution towards the first-order one.

    It ends when a coarse tolerance is met, or steps no longer change the load share.
    """
    previous = back = step
    for back in islice(
        newton(problem, unknowns_of(step), second_order=False),
        CONTINUATION.max_iterations + 1,
    ):
        if back.number > 0:
            change, total_change = (
                abs(load_share_of(back) - load_share_of(other)) for other in (previous, step)
            )
            if (
                back.balance.residual_rms < RESIDUALS.rough_solution
                or change < SEARCH.backward_tolerance * total_change
            ):
                break
            previous = back
    return back
