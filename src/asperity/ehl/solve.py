"""From conditions, oil and surface to a solved contact: coarse to fine, and the decision when to stop."""

import time
from collections.abc import Callable, Iterator

import numpy as np

from asperity.arrays import Field
from asperity.conditions import ContactConditions
from asperity.ehl.iterate import Step, newton
from asperity.ehl.problem import Problem
from asperity.ehl.scales import Scales
from asperity.ehl.solution import ContactSolution, Convergence, Iteration, Options, Status
from asperity.errors import BadInput, NotConverged
from asperity.lubricant import Lubricant
from asperity.surface.model import Surface

Progress = Callable[[Iteration], None]

FEWEST_COARSE_CELLS = 48
COARSE_TOLERANCE = 1e-3  # a coarse solution only has to be a good start
MOST_COARSE_ITERATIONS = 40


def solve_contact(
    conditions: ContactConditions,
    lubricant: Lubricant | None,
    surface: Surface,
    *,
    options: Options | None = None,
    start: ContactSolution | None = None,
    strict: bool = True,
    progress: Progress | None = None,
) -> ContactSolution:
    """Solve the rough, lubricated line contact on the surface's grid.

    Parameters
    ----------
    conditions, surface : the contact and its composite roughness; the surface's grid is the grid that is solved
    lubricant : the oil; None for a dry contact
    options : tolerances; `Options()` unless given
    start : a neighbouring solution on a grid of the same cells to start from (other load, speed or roughness)
    strict : raise when the tolerance is not met; otherwise return the unfinished state
    progress : called after every Newton step

    Raises
    ------
    BadInput
        for a geometry that cannot be solved yet or a grid that does not hold the contact.
    NotConverged
        when strict and the tolerance was not met; carries the unfinished solution.
    """
    options = options or Options()
    began = time.perf_counter()
    scales = Scales.of(conditions, lubricant)
    _check_grid(conditions, surface, scales)
    finest = contact_problem(conditions, lubricant, surface, options)
    history: list[Iteration] = []

    def watched(problem: Problem, steps: Iterator[Step]) -> Iterator[Step]:
        for step in steps:
            balance = step.balance
            iteration = Iteration(
                problem.cells, step.number, balance.residual_rms, abs(balance.load_error), step.change
            )
            history.append(iteration)
            if progress:
                progress(iteration)
            yield step

    def level(problem: Problem, pressure: Field, approach: float, tolerance: float, most: int) -> Step:
        for step in watched(problem, newton(problem, pressure, approach)):
            if _settled(history[-1], tolerance) or step.number >= most or not np.isfinite(step.change):
                return step
        raise AssertionError("newton never ends by itself")

    if start is None:
        levels = [finest]
        while _can_halve(levels[-1].cells):
            levels.append(levels[-1].coarsened())
        pressure, approach = first_guess(levels[-1], conditions, lubricant, scales)
        for problem in levels[:0:-1]:
            most = min(options.max_iterations, MOST_COARSE_ITERATIONS)
            step = level(problem, pressure, approach, max(COARSE_TOLERANCE, options.tolerance), most)
            pressure, approach = np.kron(step.balance.pressure, np.ones((2, 2))), step.approach
    else:
        pressure, approach = _warm_start(start, surface, scales)
    step = level(finest, pressure, approach, options.tolerance, options.max_iterations)

    if _settled(history[-1], options.tolerance):
        status = Status.CONVERGED
    elif np.isfinite(step.change):
        status = Status.OUT_OF_ITERATIONS
    else:
        status = Status.STALLED
    balance = step.balance
    solution = ContactSolution(
        conditions=conditions,
        lubricant=lubricant,
        surface=surface,
        options=options,
        pressure=balance.pressure * scales.pressure,
        gap=np.maximum(balance.gap, 0.0 if lubricant is None else finest.contact_gap) * scales.gap,
        in_contact=balance.in_contact & (balance.pressure > 0.0),
        rigid_approach=step.approach * scales.gap,
        convergence=Convergence(status, tuple(history), options.tolerance, time.perf_counter() - began),
    )
    if strict and status is not Status.CONVERGED:
        raise NotConverged(solution, f"contact not solved: {solution.convergence.explain()}")
    return solution


def contact_problem(
    conditions: ContactConditions, lubricant: Lubricant | None, surface: Surface, options: Options
) -> Problem:
    """The dimensionless problem on the surface's own grid."""
    scales = Scales.of(conditions, lubricant)
    grid = surface.grid
    dx, dy = grid.spacing
    x = grid.x / scales.length
    width = grid.extent[1] / scales.length
    return Problem(
        undeformed=(x**2 / 2.0)[:, None] - surface.heights / scales.gap,
        lower=grid.lower[0] / scales.length,
        spacing=(dx / scales.length, dy / scales.length),
        load=np.pi / 2.0 * width,
        p_cap=np.inf if conditions.hardness is None else conditions.hardness / scales.pressure,
        contact_gap=options.contact_film / scales.gap if lubricant else 0.0,
        speed=scales.speed,
        p_scale=scales.pressure,
        lubricant=lubricant,
    )


def first_guess(
    problem: Problem, conditions: ContactConditions, lubricant: Lubricant | None, scales: Scales
) -> tuple[Field, float]:
    """Hertz pressure, with the bodies as far apart as the film of a smooth contact holds them."""
    profile = np.sqrt(np.maximum(1.0 - problem.x**2, 0.0))
    pressure = np.repeat(np.minimum(profile, problem.p_cap)[:, None], problem.cells[1], axis=1)
    film = dowson_higginson_film(conditions, lubricant) / scales.gap if lubricant else 0.0
    smooth = (problem.x**2 / 2.0)[:, None] + problem.deflection(pressure)
    return pressure, film - float(np.min(smooth))


def dowson_higginson_film(conditions: ContactConditions, lubricant: Lubricant) -> float:
    """Least film of a smooth line contact [m]: H = 2.65 G^0.54 U^0.7 W^-0.13. Source: Dowson (1968)."""
    radius, modulus = conditions.radius_along_rolling, conditions.pair.effective_modulus
    alpha = float(lubricant.viscosity.log_slope(np.zeros(1))[0])
    speed = lubricant.viscosity.eta0 * conditions.entrainment_speed / (modulus * radius)
    load = conditions.line_load / (modulus * radius)
    return float(2.65 * (alpha * modulus) ** 0.54 * speed**0.7 * load**-0.13 * radius)


def _settled(last: Iteration, tolerance: float) -> bool:
    return last.residual < tolerance and last.load_error < tolerance and last.change < tolerance


def _can_halve(cells: tuple[int, int]) -> bool:
    return all(n % 2 == 0 and n // 2 >= FEWEST_COARSE_CELLS for n in cells)


def _warm_start(start: ContactSolution, surface: Surface, scales: Scales) -> tuple[Field, float]:
    if start.grid.cells != surface.grid.cells:
        raise BadInput(f"start has {start.grid.cells} cells, the surface {surface.grid.cells}; solve without start")
    return start.pressure / scales.pressure, start.rigid_approach / scales.gap


def _check_grid(conditions: ContactConditions, surface: Surface, scales: Scales) -> None:
    if conditions.geometry != "line":
        raise BadInput(f"geometry {conditions.geometry!r} cannot be solved yet; line contacts can")
    grid = surface.grid
    if grid.periodic != (False, True):
        raise BadInput(
            f"a line contact needs a grid periodic in y only, got periodic={grid.periodic}; use (False, True)"
        )
    if grid.lower[0] > -1.2 * scales.length or grid.upper[0] < 1.2 * scales.length:
        raise BadInput(
            f"grid from {grid.lower[0] * 1e6:.4g} to {grid.upper[0] * 1e6:.4g} um along x must reach at least "
            f"1.2 Hertz half-widths ({1.2 * scales.length * 1e6:.4g} um) to both sides; widen it"
        )
    if grid.spacing[0] > 0.25 * scales.length:
        raise BadInput(
            f"cells of {grid.spacing[0] * 1e6:.3g} um along x leave fewer than 8 across the contact of "
            f"{2.0 * scales.length * 1e6:.3g} um; use more cells"
        )
