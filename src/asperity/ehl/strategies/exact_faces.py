"""Solution on face mobilities that are exact for a linear gap, from one with arithmetic means.

Newton's method needs a close initial guess on exact faces, and the solution with arithmetic means
is one: from there it takes 5 to 50 steps.
"""

from collections.abc import Sequence
from dataclasses import replace
from itertools import islice
from typing import TYPE_CHECKING

from asperity.ehl.controls import SEARCH
from asperity.ehl.models.mixed import Pressures
from asperity.ehl.models.single_pressure import Problem
from asperity.ehl.newton.mixed import newton
from asperity.ehl.newton.single_pressure import Step
from asperity.ehl.strategies.oil_state import load_share_of, unknowns_of

if TYPE_CHECKING:
    from asperity.ehl.strategies.mixed_search import MixedSearch


def solve_again(search: "MixedSearch", solved: Sequence[tuple[Problem, Step]]) -> Step:
    """Solve the contact again on exact faces, on every grid that is `solved`, coarse to fine.

    Where heat thins the oil a hundredfold from cell to cell this may fail; then the solution with
    arithmetic means is kept.
    """
    search.figures, search.by_first_order = [], None
    options = search.options
    for problem, kept in solved:
        exact, last = replace(problem, exact=True), problem is solved[-1][0]
        tolerance, _ = search.targets(exact, coarse=not last, from_coarse=True)
        step = solve(search, exact, unknowns_of(kept), tolerance)
        if last or search.converged(tolerance):
            search.keep(exact, step)
        else:
            search.figures = []
    if search.converged(options.tolerance):
        search.by_first_order = search.figures_of(back_to_first_order(exact, step))
    elif problem.viscosity_factor is not None:
        search.arithmetic = True
        return search.continue_from(replace(problem, exact=False), unknowns_of(kept))
    return step


def solve(search: "MixedSearch", problem: Problem, unknowns: Pressures, tolerance: float) -> Step:
    """Solve by shared steps on the second-order wedge, or by cell through the first order."""
    max_steps = min(SEARCH.max_exact_iterations, search.options.max_iterations)
    steps = newton(problem, unknowns, second_order=True)
    step = search.run(problem, steps, tolerance, max_steps)
    if search.converged(tolerance):
        return step
    roughly = max(SEARCH.first_order_tolerance, tolerance)
    steps = newton(problem, unknowns, second_order=False, shared=False)
    step = search.run(problem, steps, roughly, max_steps)
    steps = newton(problem, unknowns_of(step), second_order=True, shared=False)
    return search.run(problem, steps, tolerance, max_steps)


def back_to_first_order(problem: Problem, step: Step) -> Step:
    """Step from the second-order wedge's solution towards the first-order one.

    It ends when a coarse tolerance is met, or steps no longer change the load share.
    """
    previous = back = step
    for back in islice(
        newton(problem, unknowns_of(step), second_order=False),
        SEARCH.max_backward_iterations + 1,
    ):
        if back.number > 0:
            change, total_change = (
                abs(load_share_of(back) - load_share_of(other)) for other in (previous, step)
            )
            if (
                back.balance.residual_rms < SEARCH.first_order_tolerance
                or change < SEARCH.backward_tolerance * total_change
            ):
                break
            previous = back
    return back
