"""Newton's method on the mixed contact: better and better pressures, for as long as anybody asks."""

from collections.abc import Iterator
from itertools import count

import numpy as np

from asperity.ehl.iterate import Step
from asperity.ehl.limit import StepLimit
from asperity.ehl.mixed import FREE, Pressures, evaluate
from asperity.ehl.mixed_linear import newton_step
from asperity.ehl.problem import Problem

WHOLE, PATIENCE = 24, 8  # so many whole steps; then, by turns, so many halves and wholes, lest cells flip to and fro
FURTHEST_APPROACH = 0.3  # of a^2/R, or of the roughness where that is more


def newton(problem: Problem, unknowns: Pressures, *, second_order: bool) -> Iterator[Step]:
    """Yield the start and then where each Newton step leads.

    A closed cell whose oil would come to bear more than the total takes the total for its oil's pressure, and is free
    in the next step: the oil lifts the bodies apart.
    """
    wanted_mean = problem.load / (unknowns.total.size * problem.spacing[0] * problem.spacing[1])
    oil_limit, limit = (StepLimit(np.zeros_like(unknowns.total)) for _ in range(2))
    furthest = most = FURTHEST_APPROACH * max(1.0, float(np.std(problem.roughness)))
    approach_before, change, freed = 0.0, np.inf, None
    for number in count():
        balance = evaluate(problem, unknowns, second_order=second_order, freed=freed)
        unknowns = balance.unknowns
        yield Step(number, balance, unknowns.approach, change)
        step = newton_step(balance)
        change = float(np.mean(np.abs(step.total)) / wanted_mean)
        share = 0.5 if number >= WHOLE and number // PATIENCE % 2 else 1.0
        free = balance.solid == FREE
        oil = np.clip(unknowns.oil + share * oil_limit.limited(step.oil, unknowns.oil, 0.0), 0.0, problem.p_cap)
        total = np.clip(unknowns.total + share * limit.limited(step.total, unknowns.total, 0.0), 0.0, problem.p_cap)
        total = np.where(free, oil, total)
        freed = ~free & (oil > total)
        turned_back = step.approach * approach_before < 0.0 and abs(step.approach) > 0.5 * furthest
        furthest = 0.5 * furthest if turned_back else min(1.2 * furthest, most)
        approach_before = step.approach
        approach = unknowns.approach + share * float(np.clip(step.approach, -furthest, furthest))
        unknowns = Pressures(np.where(freed, total, oil), total, approach)
