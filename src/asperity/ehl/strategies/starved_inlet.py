"""Starved contacts: an initial guess with an emptied inlet, and time steps to the steady film."""

from dataclasses import replace

import numpy as np

from asperity.ehl.contact_solution import ContactSolution
from asperity.ehl.controls import MARCHING, MENISCUS, RESIDUALS, SEARCH
from asperity.ehl.inlet_layer import InletLayer
from asperity.ehl.models.mixed import Pressures, evaluate
from asperity.ehl.models.single_pressure import Problem
from asperity.ehl.newton.single_pressure import Step
from asperity.ehl.strategies.mixed_search import MixedSearch
from asperity.ehl.strategies.oil_state import unknowns_of
from asperity.ehl.strategies.one_grid import FROM_NEIGHBOUR, implicit_step


def emptied_inlet(flooded: ContactSolution, layer: InletLayer) -> ContactSolution:
    """Return a flooded contact without pressure where the gap ahead is far wider than the layer."""
    assert flooded.oil is not None
    thickness, gap = layer.thickness_at(flooded.grid.y)[None, :], flooded.gap
    central = gap[np.argmin(np.abs(flooded.grid.x)), gap.shape[1] // 2]
    front = np.maximum(MENISCUS.front * thickness, MENISCUS.front_film * central)
    empty = (gap > front) & (flooded.grid.x[:, None] < 0.0)
    content = np.where(empty, thickness / gap, flooded.oil.content)
    oil = replace(flooded.oil, content=content, pressure=np.where(empty, 0.0, flooded.oil.pressure))
    return replace(flooded, pressure=np.where(empty, 0.0, flooded.pressure), oil=oil)


def passes_less(flooded: ContactSolution, layer: InletLayer) -> bool:
    """Return whether a flooded contact passes less oil than a layer brings everywhere."""
    assert flooded.oil is not None
    passed = flooded.oil.content[-1] * flooded.gap[-1]  # at ambient pressure
    return bool(np.all(passed <= layer.thickness_at(flooded.grid.y)))


def march_to_steady(search: MixedSearch, problem: Problem, unknowns: Pressures) -> Step:
    """Take time steps until the meniscus ahead of the contact is stationary.

    A steady Newton step moves the meniscus by one cell at most, and far from the solution it
    oscillates. A time step moves it as far as the oil travels. It is solved until its mass
    imbalance is a small share of the imbalance of the steady equations before it.
    """
    length, tolerance = MENISCUS.first_length, search.options.tolerance
    robust = replace(problem, exact=False)
    balance = evaluate(robust, unknowns, second_order=False)
    steps_allowed = min(MARCHING.max_newton_steps, search.options.max_iterations)
    stationary = False
    for _ in range(MARCHING.max_steps):
        stepped = replace(robust, past=implicit_step(problem, length, balance.content))
        search.max_imbalance = MENISCUS.forcing * max(balance.imbalance, SEARCH.max_imbalance)
        step = search.steps(stepped, balance.unknowns, RESIDUALS.coarse_grid, steps_allowed)
        if search.converged(RESIDUALS.coarse_grid):
            balance = evaluate(robust, unknowns_of(step), second_order=False)
            length *= _growth(step.number)
            stationary = balance.imbalance < SEARCH.max_imbalance and search.converged(tolerance)
        else:
            length *= 0.25
        if stationary or length < MENISCUS.first_length:
            break
    search.max_imbalance = np.inf
    if stationary and not problem.exact:  # a steady step would move the meniscus again
        step = search.run(robust, iter([replace(step, number=0, balance=balance)]), tolerance, 0)
        if search.converged(tolerance):
            return step
    return search.first_converged(FROM_NEIGHBOUR, problem, balance.unknowns)


def _growth(steps: int) -> float:
    """Return the ratio of the next time step to one that needed a number of Newton steps."""
    return 2.0 if steps <= 3 else 1.2 if steps <= 6 else 1.0 if steps <= 8 else 0.5
