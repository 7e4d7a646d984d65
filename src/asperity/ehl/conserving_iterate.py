"""Newton's method on the conserving contact: better and better unknowns, for as long as anybody asks.

State by state, inexact, and limited cell by cell: a cell about to change its state is put on the border first, one
that turns back takes shorter steps.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import count

import numpy as np

from asperity.ehl.conserving import FREE, Earlier, OilBalance, Unknowns, evaluate
from asperity.ehl.conserving_linear import newton_step
from asperity.ehl.limit import StepLimit
from asperity.ehl.problem import Problem
from asperity.kernels.conserving import FULL, PLATEAU, RUPTURED

LEAST_CONTENT = 0.2  # share of its content that a ruptured cell keeps in one step
FURTHEST_APPROACH = 0.3  # of a^2/R, or of the roughness where that is more
BESIDE = 1e-9  # how far beyond a border a cell is put to belong to the other side


@dataclass(frozen=True, slots=True)
class OilStep:
    """Where a Newton step led: its balance, and the mean relative change of total stress it had asked for."""

    number: int
    balance: OilBalance
    change: float

    @property
    def left(self) -> float:
        """Residual and load error together."""
        return self.balance.residual_rms + abs(self.balance.load_error)


def newton(problem: Problem, unknowns: Unknowns, earlier: Earlier | None = None) -> Iterator[OilStep]:
    """Yield the start and then where each Newton step leads."""
    wanted_mean = problem.load / (unknowns.pressure.size * problem.spacing[0] * problem.spacing[1])
    fluid, pressure = (StepLimit(np.zeros_like(unknowns.fluid)) for _ in range(2))
    furthest = most = FURTHEST_APPROACH * max(1.0, float(np.std(problem.roughness)))
    approach_before, change = 0.0, np.inf
    for number in count():
        balance = evaluate(problem, unknowns, earlier)
        yield OilStep(number, balance, change)
        step = newton_step(balance)
        change = float(np.mean(np.abs(step.pressure)) / wanted_mean)
        closed = (balance.contact_state != FREE) & (balance.fluid_state == FULL)
        d_fluid = fluid.limited(
            step.fluid,
            np.abs(unknowns.fluid),
            # oil shut in by closed bodies presses until it lifts them
            np.where(closed, unknowns.pressure - unknowns.fluid + BESIDE, 0.0),
        )
        d_pressure = pressure.limited(step.pressure, unknowns.pressure, 0.0)
        turned_back = step.approach * approach_before < 0.0 and abs(step.approach) > 0.5 * furthest
        furthest = 0.5 * furthest if turned_back else min(1.2 * furthest, most)
        approach_before = step.approach
        d_approach = float(np.clip(step.approach, -furthest, furthest))
        unknowns = _moved(balance, Unknowns(d_fluid, d_pressure, d_approach))


def _moved(balance: OilBalance, step: Unknowns) -> Unknowns:
    """The unknowns after a step; cells that would cross a border between states stop there, on its other side."""
    cap, state, before = balance.problem.p_cap, balance.fluid_state, balance.unknowns
    ruptured, full, plateau = (state == code for code in (RUPTURED, FULL, PLATEAU))
    fluid = before.fluid + step.fluid
    fluid = np.where(ruptured, np.maximum(fluid, LEAST_CONTENT * (1.0 + before.fluid) - 1.0), fluid)
    fluid = np.where(ruptured & (fluid >= 0.0), 0.0, fluid)
    fluid = np.where(full & (fluid < 0.0), -BESIDE, fluid)
    fluid = np.where(full & (fluid > cap), cap * (1.0 + BESIDE), fluid)
    fluid = np.where(plateau & (fluid <= cap), cap * (1.0 - BESIDE), fluid)
    pressure = np.clip(before.pressure + step.pressure, 0.0, cap)
    pressure = np.where(balance.contact_state == FREE, np.clip(fluid, 0.0, cap), pressure)
    return Unknowns(fluid, pressure, before.approach + step.approach)
