"""Newton's method on a single-pressure problem.

Semismooth (each cell is linearised in its active equation), inexact (GMRES to a tenth), with step
limits per cell and for the approach.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import count
from typing import NamedTuple

import numpy as np

from asperity.core.arrays import Field
from asperity.ehl.controls import KRYLOV, RESIDUALS, STEP_LIMITS
from asperity.ehl.linear_solvers.gmres import Operator, gmres
from asperity.ehl.linear_solvers.single_pressure import Linear
from asperity.ehl.models.mixed import MixedBalance
from asperity.ehl.models.single_pressure import Balance, Problem
from asperity.ehl.newton.step_limit import ApproachLimit, StepLimit


class Damping(NamedTuple):
    """Damping factor of the steps, and the inverse of a pseudo-time step (cells of oil travel)."""

    share: float
    storing: float


# Used in turn when the iteration stagnates: pseudo-transient continuation (Kelley and Keyes, SIAM
# J. Numer. Anal. 35 (1998)) where waves travel with the oil, damping where cells alternate.
DAMPINGS = (
    Damping(1.0, 0.0),
    Damping(1.0, 0.5),
    Damping(0.5, 0.0),
    Damping(1.0, 2.0),
    Damping(0.5, 0.5),
    Damping(1.0, 8.0),
    Damping(0.25, 0.0),
    Damping(0.5, 2.0),
)


@dataclass(frozen=True, slots=True)
class Step:
    """Result of a Newton step: its balance, and the mean relative change of pressure requested."""

    number: int
    balance: Balance | MixedBalance
    approach: float
    change: float


def newton(
    problem: Problem, pressure: Field, approach: float, *, fixed: bool = False
) -> Iterator[Step]:
    """Yield the initial guess and then the result of each Newton step.

    At `fixed` approach the load is free.
    """
    mean_pressure = problem.mean_pressure
    limit = StepLimit(pressure, initial=STEP_LIMITS.max_pressure_step, bound_reversals=False)
    film = float(problem.evaluate(pressure, approach).gap.min())
    approach_limit = ApproachLimit(problem.roughness, film)
    lowest = np.inf
    stagnation = 0
    attempt = 0
    change = np.inf
    for number in count():
        balance = problem.evaluate(pressure, approach)
        yield Step(number, balance, approach, change)
        damping = DAMPINGS[attempt % len(DAMPINGS)]
        storing = (
            damping.storing
            / problem.spacing[0]
            * min(1.0, balance.residual_rms / RESIDUALS.initial_guess)
        )
        d_pressure, d_approach = newton_step(balance, storing=storing, fixed=fixed)
        change = float(np.mean(np.abs(d_pressure)) / mean_pressure)
        stagnation += 1
        if balance.residual_rms < lowest:
            lowest = balance.residual_rms
            stagnation = 0
        elif stagnation == STEP_LIMITS.stagnation_iterations:
            lowest, stagnation, attempt = balance.residual_rms, 0, attempt + 1
        limited = limit(d_pressure, pressure)
        pressure = np.clip(pressure + damping.share * limited, 0.0, problem.p_cap)
        approach += damping.share * approach_limit(d_approach)


def newton_step(
    balance: Balance, *, storing: float = 0.0, fixed: bool = False
) -> tuple[Field, float]:
    """Return the change of pressure and approach that solves the linearised equations to a tenth.

    Includes the load, unless the approach is `fixed`.
    """
    unknown = balance.unknown
    linear = Linear(balance, storing=storing)
    known_change = np.where(unknown, 0.0, -balance.residual)
    rows = -balance.residual - linear.product(known_change.astype(linear.dtype), 0.0)
    rhs = np.where(unknown, rows, 0.0).astype(linear.dtype)
    if fixed:
        d_pressure = _solved(
            lambda vector: linear.product(vector.reshape(linear.cells), 0.0).ravel(),
            lambda vector: linear(vector.reshape(linear.cells)).ravel(),
            rhs.ravel(),
        )
        return known_change + d_pressure.reshape(linear.cells), 0.0
    system = _LoadedEquations(linear)
    missing = system.load_missing(known_change)
    if system.load_response == 0.0:  # all cells ruptured or capped: only the approach can change it
        d_approach = -STEP_LIMITS.max_pressure_step * float(np.sign(missing))
        return known_change, d_approach / balance.rows.contact_scale
    last = linear.dtype(system.weight * missing)
    solved = _solved(system.product, system.precondition, np.append(rhs.ravel(), last))
    return known_change + solved[:-1].reshape(linear.cells), float(solved[-1])


class _LoadedEquations:
    """Linearised equations, and last the load, in the pressures and last the approach."""

    def __init__(self, linear: Linear) -> None:
        self.linear, self.problem, self.cells = linear, linear.balance.problem, linear.cells
        self.weight = 1.0 / np.sqrt(linear.unknown.size)
        zero = linear.dtype(0.0)
        by_approach = linear.product(np.zeros(self.cells, linear.dtype), 1.0)
        self.by_approach = np.where(linear.unknown, by_approach, zero)
        self.response = linear(self.by_approach)
        self.load_response = float(self.problem.sum_over_cells(self.response))

    def load_missing(self, known_change: Field) -> np.floating:
        """Return the load that known changes of pressure leave to the unknown ones."""
        problem = self.problem
        (dx, dy) = self.problem.spacing
        missing = -self.linear.balance.load_error * problem.load / (dx * dy)
        return missing - problem.sum_over_cells(known_change)

    def product(self, vector: Field) -> Field:
        """Apply the equations."""
        d_pressure = vector[:-1].reshape(self.cells)
        d_approach = float(vector[-1])
        rows = self.linear.product(d_pressure, 0.0)
        real = self.linear.dtype
        if d_approach:
            rows += real(d_approach) * self.by_approach
        return np.append(rows.ravel(), real(self.weight * self.problem.sum_over_cells(d_pressure)))

    def precondition(self, rows: Field) -> Field:
        """Apply the approximate inverse."""
        d_pressure = self.linear(rows[:-1].reshape(self.cells))
        excess = self.problem.sum_over_cells(d_pressure) - rows[-1] / self.weight
        d_approach = self.linear.dtype(excess / self.load_response)
        return np.append((d_pressure - d_approach * self.response).ravel(), d_approach)


def _solved(product: Operator, precondition: Operator, rhs: Field) -> Field:
    """Solve by GMRES."""
    return gmres(
        product,
        precondition,
        rhs,
        tolerance=KRYLOV.tolerance,
        max_steps=KRYLOV.max_steps,
    )
