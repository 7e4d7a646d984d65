"""Newton's method on the mixed contact."""

from collections import deque
from collections.abc import Iterator
from itertools import count
from typing import NamedTuple

import numpy as np

from asperity.core.arrays import Field, Mask
from asperity.ehl.controls import MIXED_NEWTON, RESIDUALS, STEP_LIMITS
from asperity.ehl.linear_solvers.gmres import Workspace
from asperity.ehl.linear_solvers.mixed import newton_step
from asperity.ehl.linear_solvers.single_pressure import SingularFactor
from asperity.ehl.models.mixed import MixedBalance, Pressures, evaluate
from asperity.ehl.models.single_pressure import Problem
from asperity.ehl.newton.single_pressure import Step
from asperity.ehl.newton.step_limit import ApproachLimit, StepLimit
from asperity.kernels.load_sharing import FREE
from asperity.kernels.reynolds import CAPPED

EPSILON = float(np.finfo(float).eps)  # beyond a state's bound, puts a cell into the next state


class _StepProposal(NamedTuple):
    """A balance, limited changes of all unknowns from it, and their share that is taken."""

    balance: MixedBalance
    step: Pressures
    share: float

    def evaluated(self, damping: float = 1.0, *, second_order: bool) -> MixedBalance:
        """Return the balance after a damped step."""
        unknowns, freed = self.apply(damping)
        problem = self.balance.problem
        return evaluate(problem, unknowns, second_order=second_order, freed=freed)

    def apply(self, damping: float = 1.0) -> tuple[Pressures, Mask]:
        """Return the unknowns after a damped step, and the cells that then count as free."""
        problem = self.balance.problem
        (_, total, approach) = self.balance.unknowns
        share = damping * self.share
        free = self.balance.solid == FREE
        signed = _updated_oil(self.balance, share * self.step.oil)
        oil = np.clip(signed, 0.0, problem.p_cap)
        total = np.where(free, oil, np.clip(total + share * self.step.total, 0.0, problem.p_cap))
        overloaded = ~free & (oil > total)
        # a cell in deep overlap would alternate between closed and free
        freed = overloaded & (self.balance.solid != CAPPED)
        unknowns = Pressures(
            np.where(overloaded, total, signed), total, approach + share * self.step.approach
        )
        return unknowns, freed


def newton(
    problem: Problem, unknowns: Pressures, *, second_order: bool, shared: bool | None = None
) -> Iterator[Step]:
    """Yield the initial guess and then the result of each Newton step.

    After a stagnation the Jacobian omits a term that may cause cycles: ruptured cells downstream of
    a lubricated one.

    A closed cell whose oil pressure would exceed the total takes the total as its oil pressure and
    is free in the next step: the oil separates the bodies. Cells at the cap are exempt.

    Exact face mobilities are mostly too stiff for limits of single cells: all unknowns take a
    `shared` part of the step (the default there, but not where oil is conserved), such that no film
    and no pressure changes by more than a share of itself and the residual does not exceed those of
    the last steps.
    """
    shared = problem.exact and not problem.conserve if shared is None else shared
    mean_pressure, change = problem.mean_pressure, np.inf
    balance = evaluate(problem, unknowns, second_order=second_order)
    limits = _StepLimits(problem, unknowns, float(balance.gap.min()))
    watch, workspace = _ResidualWatch(), Workspace()
    for number in count():
        approach = balance.unknowns.approach
        yield Step(number, balance, approach, change)
        try:
            step = newton_step(balance, workspace, extended=not watch.stagnated)
        except SingularFactor:  # diverged
            yield Step(number + 1, balance, approach, np.inf)
            return
        change = float(np.mean(np.abs(step.total)) / mean_pressure)
        watch.add(balance.residual_rms)
        if shared:
            share = _largest_share(step, balance)
            balance = _search_below(
                watch, _StepProposal(balance, step, share), second_order=second_order
            )
        else:
            limited = limits(step, balance)
            balance = _line_search(
                _StepProposal(balance, limited, watch.damping), second_order=second_order
            )


class _ResidualWatch:
    """Residuals of the last steps; the damping changes after steps without a decrease."""

    def __init__(self) -> None:
        self.last: deque[float] = deque(maxlen=STEP_LIMITS.stagnation_iterations)
        self.lowest, self.steps, self.damping, self.stagnated = np.inf, 0, 1.0, False

    def add(self, residual: float) -> None:
        """Add the residual of a step."""
        self.steps += 1
        if residual < self.lowest:
            self.lowest, self.steps = residual, 0
        elif self.steps == STEP_LIMITS.stagnation_iterations:
            self.lowest, self.steps, self.damping = residual, 0, 1.5 - self.damping
            self.stagnated = True
        self.last.append(residual)


class _StepLimits:
    """Step limits of oil pressure, total pressure and approach; the oil of closed cells is free."""

    def __init__(self, problem: Problem, unknowns: Pressures, film: float) -> None:
        self.oil, self.total = (StepLimit(unknowns.total) for _ in range(2))
        self.approach = ApproachLimit(problem.roughness, film)

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
    residual, damping = proposal.balance.residual_rms, 1.0
    while True:
        balance = proposal.evaluated(damping, second_order=second_order)
        if (
            residual >= MIXED_NEWTON.line_search_residual
            or balance.residual_rms <= MIXED_NEWTON.max_residual_growth * residual
            or damping <= STEP_LIMITS.min_damping
        ):
            return balance
        del balance
        damping *= 0.5


def _largest_share(step: Pressures, balance: MixedBalance) -> float:
    """Return the largest share of a step at which no film and no pressure changes by too much.

    In a time step, moving asperities close the thin films in front of them.
    """
    problem, gap, free = balance.problem, balance.gap, balance.solid == FREE
    d_gap = problem.deflection(step.total) + step.approach
    film = gap if problem.past is None else gap + float(np.std(problem.roughness))
    film_decrease = np.where(free & (gap > problem.contact_gap), -d_gap / film, 0.0).max()
    pressure_change = np.max(np.abs(step.total) / np.maximum(1.0, balance.unknowns.total))
    tiny = np.finfo(float).tiny
    return min(
        1.0,
        float(MIXED_NEWTON.max_film_decrease / max(film_decrease, tiny)),
        float(MIXED_NEWTON.max_pressure_change / max(pressure_change, tiny)),
    )


def _search_below(
    watch: _ResidualWatch, proposal: _StepProposal, *, second_order: bool
) -> MixedBalance:
    """Halve a step until its residual is below the last ones; return the best step if none is.

    Near the solution the whole step is taken, unless steps stagnated: a cell that closes passes a
    higher residual.
    """
    bound = max(watch.last)
    whole = watch.last[-1] < RESIDUALS.initial_guess and not watch.stagnated
    least = 1.0 if whole else STEP_LIMITS.min_damping
    damping, best, lowest = 1.0, 1.0, None
    while True:
        balance = proposal.evaluated(damping, second_order=second_order)
        if lowest is None or balance.residual_rms < lowest:
            best, lowest = damping, balance.residual_rms
        if balance.residual_rms < bound or damping <= least:
            break
        del balance  # one of a fine grid fills a quarter of a gigabyte
        damping *= 0.5
    return balance if best == damping else proposal.evaluated(best, second_order=second_order)


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
    least = (1.0 - MIXED_NEWTON.max_film_decrease) * (1.0 + current) - 1.0
    signed = np.where(ruptured, np.maximum(signed, least), signed)
    signed = np.where(ruptured & (signed >= 0.0), 0.0, signed)
    signed = np.where(full & (signed < 0.0), -EPSILON, signed)
    signed = np.where(full & (signed > cap), cap * (1.0 + EPSILON), signed)
    return np.where(pressed & (signed <= cap), cap * (1.0 - EPSILON), signed)
