"""Newton's method on the mixed contact."""

from collections.abc import Iterator
from itertools import count
from typing import NamedTuple

import numpy as np

from asperity.core.arrays import Field, Mask
from asperity.ehl.controls import MIXED_NEWTON
from asperity.ehl.linear_solvers.gmres import Workspace
from asperity.ehl.linear_solvers.mixed import newton_step
from asperity.ehl.linear_solvers.single_pressure import SingularFactor
from asperity.ehl.models.mixed import MixedBalance, Pressures, evaluate
from asperity.ehl.models.single_pressure import Problem
from asperity.ehl.newton.single_pressure import Step
from asperity.ehl.newton.step_limit import ApproachLimit, StepLimit
from asperity.kernels.load_sharing import FREE
from asperity.kernels.reynolds import CAPPED


class _StepProposal(NamedTuple):
    """A balance, limited changes of all unknowns from it, and the damping factor."""

    balance: MixedBalance
    step: Pressures
    factor: float

    def apply(self, damping: float = 1.0) -> tuple[Pressures, Mask]:
        """Return the unknowns after a damped step, and the cells that then count as free."""
        problem = self.balance.problem
        (_, total, approach) = self.balance.unknowns
        factor = damping * self.factor
        free = self.balance.solid == FREE
        signed = _updated_oil(self.balance, factor * self.step.oil)
        oil = np.clip(signed, 0.0, problem.p_cap)
        total = np.where(free, oil, np.clip(total + factor * self.step.total, 0.0, problem.p_cap))
        overloaded = ~free & (oil > total)
        # a cell in deep overlap would alternate between closed and free
        freed = overloaded & (self.balance.solid != CAPPED)
        unknowns = Pressures(
            np.where(overloaded, total, signed), total, approach + factor * self.step.approach
        )
        return unknowns, freed


def newton(problem: Problem, unknowns: Pressures, *, second_order: bool) -> Iterator[Step]:
    """Yield the initial guess and then the result of each Newton step.

    After a stagnation the Jacobian omits two terms that may cause cycles: ruptured cells downstream
    of a lubricated one, and the change of the slope limiter with the gap.

    A closed cell whose oil pressure would exceed the total takes the total as its oil pressure and
    is free in the next step: the oil separates the bodies. Cells at the cap are exempt.
    """
    mean_pressure = problem.mean_pressure
    change = np.inf
    limits = _StepLimits(problem, unknowns)
    workspace = Workspace()
    lowest = np.inf
    stagnation = 0
    damping = 1.0
    stagnated = False
    balance = evaluate(problem, unknowns, second_order=second_order)
    settled_cells = np.zeros(problem.cells, dtype=bool)
    for number in count():
        approach = balance.unknowns.approach
        gap = balance.gap
        yield Step(number, balance, approach, change)
        try:
            step = newton_step(balance, None if stagnated else settled_cells, workspace)
        except SingularFactor:  # diverged
            yield Step(number + 1, balance, approach, np.inf)
            return
        change = float(np.mean(np.abs(step.total)) / mean_pressure)
        stagnation += 1
        if balance.residual_rms < MIXED_NEWTON.required_decrease * lowest:
            lowest = balance.residual_rms
            stagnation = 0
        elif stagnation == MIXED_NEWTON.stagnation_iterations:
            lowest, stagnation, damping, stagnated = balance.residual_rms, 0, 1.5 - damping, True
        proposal = _StepProposal(balance, limits(step, balance), damping)
        balance = _line_search(proposal, second_order=second_order)
        settled_cells = (
            np.abs(balance.gap - gap) < MIXED_NEWTON.settled_gap_change * problem.contact_gap
        )


class _StepLimits:
    """Step limits of oil pressure, total pressure and approach; the oil of closed cells is free."""

    def __init__(self, problem: Problem, unknowns: Pressures) -> None:
        self.oil, self.total = (StepLimit(unknowns.total) for _ in range(2))
        self.approach = ApproachLimit(problem.roughness)

    def __call__(self, step: Pressures, balance: MixedBalance) -> Pressures:
        """Return the limited step."""
        unknowns = balance.unknowns
        closed = (
            (balance.solid != FREE)
            & (balance.gap <= balance.problem.contact_gap)
            & (balance.oil_pressure == unknowns.oil)
        )
        limited = self.oil(step.oil, np.abs(unknowns.oil))
        return Pressures(
            np.where(closed | (unknowns.oil < 0.0), step.oil, limited),
            self.total(step.total, unknowns.total),
            self.approach(step.approach),
        )


def _line_search(proposal: _StepProposal, *, second_order: bool) -> MixedBalance:
    """Halve a step that increases the residual near the solution: thin films may alternate."""
    problem = proposal.balance.problem
    residual = proposal.balance.residual_rms
    damping = 1.0
    while True:
        unknowns, freed = proposal.apply(damping)
        balance = evaluate(problem, unknowns, second_order=second_order, freed=freed)
        if (
            residual >= MIXED_NEWTON.line_search_residual
            or balance.residual_rms <= MIXED_NEWTON.max_residual_growth * residual
            or damping <= MIXED_NEWTON.min_damping
        ):
            return balance
        damping *= 0.5


def _updated_oil(balance: MixedBalance, step: Field) -> Field:
    """Return the oil unknown after a step within its bounds.

    Where oil is conserved, a step leads at most to the next state.
    """
    current = balance.unknowns.oil
    cap = balance.problem.p_cap
    signed = current + step
    if balance.surplus is None:
        return np.clip(signed, 0.0, cap)
    ruptured = current < 0.0
    pressed = current > cap
    full = ~ruptured & ~pressed
    signed = np.where(
        ruptured, np.maximum(signed, MIXED_NEWTON.min_content_share * (1.0 + current) - 1.0), signed
    )
    signed = np.where(ruptured & (signed >= 0.0), 0.0, signed)
    signed = np.where(full & (signed < 0.0), -MIXED_NEWTON.state_offset, signed)
    signed = np.where(full & (signed > cap), cap * (1.0 + MIXED_NEWTON.state_offset), signed)
    return np.where(pressed & (signed <= cap), cap * (1.0 - MIXED_NEWTON.state_offset), signed)
