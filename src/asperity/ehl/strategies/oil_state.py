"""Unknowns and oil state of the two-pressure models, from and to solutions."""

import numpy as np

from asperity.core.arrays import Field
from asperity.core.errors import BadInput
from asperity.ehl.contact_solution import ContactSolution, Oil
from asperity.ehl.load_shares import carried_share
from asperity.ehl.models.mixed import MixedBalance, Pressures
from asperity.ehl.models.single_pressure import Problem
from asperity.ehl.newton.single_pressure import Step
from asperity.ehl.scales import Scales
from asperity.ehl.strategies.grid_continuation import on_all_lines


def pressures_of(solution: ContactSolution, problem: Problem, scales: Scales) -> Pressures:
    """Return the unknowns of a solution of any model, on the grid of `problem`."""
    total = solution.pressure / scales.pressure
    signed = total if solution.oil is None else _signed(solution.oil, problem, scales)
    if problem.cells[1] == 1:
        total, signed = (field[:, :1] for field in (total, signed))
    if total.shape != problem.all_cells:
        raise BadInput(
            f"start has {solution.grid.cells} cells, the surface {problem.all_cells}; solve "
            "without start"
        )
    signed, total = (np.ascontiguousarray(part[:, : problem.cells[1]]) for part in (signed, total))
    return Pressures(signed, total, solution.rigid_approach / scales.gap)


def _signed(oil: Oil, problem: Problem, scales: Scales) -> Field:
    """Return the signed unknown of the oil.

    It is the missing share below 0 and the permanent opening above the cap.
    """
    if not problem.conserve:
        return oil.pressure / scales.pressure
    growth = oil.growth / scales.gap
    pressed = problem.p_cap + growth / problem.softness
    return np.where(
        oil.content < 1.0,
        oil.content - 1.0,
        np.where(growth > 0.0, pressed, oil.pressure / scales.pressure),
    )


def oil_of(step: Step, lines: int, scales: Scales) -> Oil:
    """Return the state of the oil after a Newton step in SI units, shape (nx, lines)."""
    balance = step.balance
    assert isinstance(balance, MixedBalance)
    content, pressure, growth = (
        on_all_lines(balance.problem, part, lines)
        for part in (balance.film_share, balance.oil_pressure, balance.growth)
    )
    return Oil(content=content, pressure=pressure * scales.pressure, growth=growth * scales.gap)


def unknowns_of(step: Step) -> Pressures:
    """Return oil pressure, total pressure and approach of a Newton step of the mixed model."""
    assert isinstance(step.balance, MixedBalance)
    return step.balance.unknowns


def load_share_of(step: Step) -> float:
    """Return the load share of a step."""
    return carried_share(step.balance.pressure, step.balance.in_contact)
