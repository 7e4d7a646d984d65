"""Newton's method on a mixed-EHL problem: better and better pressures, for as long as anybody asks.

Semismooth (each cell is linearised by the equation that decides it), inexact (GMRES to a tenth), and limited cell by
cell: a cell that turns back takes shorter steps, so that a few undecided ones cannot keep all others waiting. The
approach of the bodies is limited the same way.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import count

import numpy as np

from asperity.arrays import Field
from asperity.ehl.krylov import gmres
from asperity.ehl.problem import Balance, Preconditioner, Problem

LONGEST_STEP = 0.5  # of p_h, in one cell and one Newton step ...
LONGEST_SHARE = 0.3  # ... or this share of the cell's own pressure: sharp elastic asperities reach 100 p_h
FURTHEST_APPROACH = 0.3  # of a^2/R, or of the roughness where that is more: what a capped contact answers is not linear
PATIENCE = 8  # steps without progress before all of them are halved
FORCING = 0.1
MOST_KRYLOV_STEPS = 60
COARSE_CELLS = 64  # across the grid that the preconditioner factors


@dataclass(frozen=True, slots=True)
class Step:
    """One Newton step: the balance it started from, and the mean relative change of pressure it asks for."""

    number: int
    balance: Balance
    approach: float
    change: float


def newton(problem: Problem, pressure: Field, approach: float, *, held: bool = False) -> Iterator[Step]:
    """Yield each Newton step's starting point and the change it asks for, then take the step.

    With the bodies `held` at their approach the load is whatever it becomes.
    """
    wanted_mean = problem.load / (pressure.size * problem.spacing[0] * problem.spacing[1])
    longest: Field = np.full_like(pressure, LONGEST_STEP)
    before: Field = np.zeros_like(pressure)
    furthest = most = FURTHEST_APPROACH * max(1.0, float(np.std(problem.roughness)))
    approach_before = 0.0
    lowest, idle, share = np.inf, 0, 1.0
    for number in count(1):
        balance = problem.evaluate(pressure, approach)
        d_pressure, d_approach = newton_step(balance, held=held)
        yield Step(number, balance, approach, float(np.mean(np.abs(d_pressure)) / wanted_mean))
        idle += 1
        if balance.residual_rms < 0.9 * lowest:
            lowest, idle, share = balance.residual_rms, 0, min(1.0, 1.2 * share)
        elif idle == PATIENCE:  # round in circles: go a shorter way
            lowest, idle, share = balance.residual_rms, 0, max(0.1, 0.5 * share)
        turned_back = (d_pressure * before < 0.0) & (np.abs(d_pressure) > longest)
        most_now = np.maximum(LONGEST_STEP, LONGEST_SHARE * pressure)
        longest = np.where(turned_back, 0.5 * longest, np.minimum(1.5 * longest, most_now))
        before = d_pressure
        pressure = np.clip(pressure + share * np.clip(d_pressure, -longest, longest), 0.0, problem.p_cap)
        turned_back_bodies = d_approach * approach_before < 0.0 and abs(d_approach) > 0.5 * furthest
        furthest = 0.5 * furthest if turned_back_bodies else min(1.2 * furthest, most)
        approach_before = d_approach
        approach += share * float(np.clip(d_approach, -furthest, furthest))


def newton_step(balance: Balance, *, held: bool = False) -> tuple[Field, float]:
    """Change of pressure and approach that meets every linearised equation and, unless `held`, the load, to a tenth."""
    problem = balance.problem
    cells = problem.cells
    unknown = balance.unknown
    known_change = np.where(unknown, 0.0, -balance.residual)
    block = max(1, -(-max(cells) // COARSE_CELLS), 2 if min(cells) >= 32 else 1)
    inverse = Preconditioner(balance, block)

    wanted = np.where(unknown, -balance.residual - balance.product(known_change, 0.0), 0.0)
    if held:
        d_pressure = _solve_held(balance, inverse, wanted)
        return known_change + d_pressure, 0.0

    # unknowns: the pressure changes and, last, the approach; last equation: they make up the missing load
    weight = 1.0 / np.sqrt(unknown.size)
    missing = -balance.load_error * problem.load / (problem.spacing[0] * problem.spacing[1]) - known_change.sum()
    response = np.where(unknown, balance.product(np.zeros(cells), 1.0), 0.0)
    answer = inverse(response)
    total = float(answer.sum())
    if total == 0.0:  # every cell is ruptured or capped: only the distance of the bodies can change the load
        return known_change, -LONGEST_STEP * float(np.sign(missing)) / balance.rows.contact_scale

    def product(vector: Field) -> Field:
        d_pressure = vector[:-1].reshape(cells)
        rows = balance.product(d_pressure, float(vector[-1]))
        rows[~unknown] = 0.0
        return np.append(rows.ravel(), weight * d_pressure.sum())

    def precondition(vector: Field) -> Field:
        d_pressure = inverse(vector[:-1].reshape(cells))
        d_approach = (d_pressure.sum() - vector[-1] / weight) / total
        return np.append((d_pressure - d_approach * answer).ravel(), d_approach)

    solved = gmres(
        product,
        precondition,
        np.append(wanted.ravel(), weight * missing),
        tolerance=FORCING,
        most_steps=MOST_KRYLOV_STEPS,
    )
    return known_change + solved[:-1].reshape(cells), float(solved[-1])


def _solve_held(balance: Balance, inverse: Preconditioner, wanted: Field) -> Field:
    cells, unknown = balance.problem.cells, balance.unknown

    def product(vector: Field) -> Field:
        rows = balance.product(vector.reshape(cells), 0.0)
        rows[~unknown] = 0.0
        return rows.ravel()

    solved = gmres(
        product,
        lambda vector: inverse(vector.reshape(cells)).ravel(),
        wanted.ravel(),
        tolerance=FORCING,
        most_steps=MOST_KRYLOV_STEPS,
    )
    return solved.reshape(cells)
