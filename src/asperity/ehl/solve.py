"""From conditions, oil and surface to a solved contact: coarse to fine, and the decision when to stop."""

import time
from collections.abc import Callable, Iterator

import numpy as np

from asperity.arrays import Field
from asperity.conditions import ContactConditions
from asperity.ehl.iterate import Step, newton
from asperity.ehl.problem import Form, Problem
from asperity.ehl.scales import Scales
from asperity.ehl.solution import ContactSolution, Convergence, Iteration, Options, Status
from asperity.errors import BadInput, NotConverged
from asperity.lubricant import Lubricant
from asperity.surface.model import Surface

Progress = Callable[[Iteration], None]

FEWEST_COARSE_CELLS = 48
COARSE_TOLERANCE = 1e-3  # a coarse solution only has to be a good start
MOST_COARSE_ITERATIONS = 40
MOST_POSITIONS = 20
FAR_OFF = 0.1  # a coarse solution that misses by more is no start at all


def solve_contact(
    conditions: ContactConditions,
    lubricant: Lubricant | None,
    surface: Surface,
    *,
    options: Options | None = None,
    start: ContactSolution | None = None,
    viscosity_factor: Field | None = None,
    strict: bool = True,
    progress: Progress | None = None,
) -> ContactSolution:
    """Solve the rough, lubricated contact on the surface's grid.

    Parameters
    ----------
    conditions, surface : the contact and its composite roughness; the surface's grid is the grid that is solved
    lubricant : the oil; None for a dry contact
    options : tolerances; `Options()` unless given
    start : a neighbouring solution on a grid of the same cells to start from (other load, speed or roughness)
    viscosity_factor : local over isothermal viscosity, shape (nx, ny), where the film is not at ambient temperature
    strict : raise when the tolerance is not met; otherwise return the unfinished state
    progress : called after every Newton step

    Raises
    ------
    BadInput
        for a grid that does not hold the contact or repeats along the wrong axis, or factors that do not fit it.
    NotConverged
        when strict and the tolerance was not met; carries the unfinished solution.
    """
    options = options or Options()
    began = time.perf_counter()
    scales = Scales.of(conditions, lubricant)
    _check_grid(conditions, surface)
    if viscosity_factor is not None:
        _check_factor(viscosity_factor, surface)
    finest = contact_problem(conditions, lubricant, surface, options, viscosity_factor)
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

    def held(problem: Problem, pressure: Field, approach: float) -> Iterator[Step]:
        return watched(problem, newton(problem, pressure, approach, held=True))

    def level(problem: Problem, pressure: Field, approach: float, tolerance: float, most: int) -> Step:
        for step in watched(problem, newton(problem, pressure, approach)):
            if _settled(history[-1], tolerance) or step.number >= most or _lost(step):
                return step
        raise AssertionError("newton never ends by itself")

    if start is None:
        levels = [finest]
        while _can_halve(levels[-1].cells):
            levels.append(levels[-1].coarsened())
        pressure, approach = first_guess(levels[-1], conditions, lubricant, scales)
        most, tolerance = min(options.max_iterations, MOST_COARSE_ITERATIONS), max(COARSE_TOLERANCE, options.tolerance)
        for problem in levels[:0:-1]:
            step = level(problem, pressure, approach, tolerance, most)
            if problem is levels[-1] and most == MOST_COARSE_ITERATIONS and not _settled(history[-1], FAR_OFF):
                # a capped contact answers its approach too unevenly for Newton: hold the bodies, search from outside
                guess = first_guess(problem, conditions, lubricant, scales)
                found = find_approach(problem, *guess, held)
                if _settled(history[-1], FAR_OFF):
                    step = found
            pressure, approach = refined(step.balance.pressure), step.approach
    else:
        pressure, approach = _warm_start(start, surface, scales)
    step = level(finest, pressure, approach, options.tolerance, options.max_iterations)

    if _settled(history[-1], options.tolerance):
        status = Status.CONVERGED
    else:
        status = Status.STALLED if _lost(step) else Status.OUT_OF_ITERATIONS
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
        viscosity_factor=viscosity_factor,
    )
    if strict and status is not Status.CONVERGED:
        raise NotConverged(solution, f"contact not solved: {solution.convergence.explain()}")
    return solution


def contact_problem(
    conditions: ContactConditions,
    lubricant: Lubricant | None,
    surface: Surface,
    options: Options,
    viscosity_factor: Field | None = None,
) -> Problem:
    """The dimensionless problem on the surface's own grid."""
    scales = Scales.of(conditions, lubricant)
    grid, line = surface.grid, conditions.geometry == "line"
    (dx, dy), (left, front) = grid.spacing, grid.lower
    load = conditions.line_load * grid.extent[1] if line else conditions.load
    radius, modulus = conditions.radius_along_rolling, conditions.pair.effective_modulus
    return Problem(
        form=Form(
            flatness=0.0 if line else radius / conditions.radius_across_rolling,
            compliance=2.0 * scales.pressure * radius / (np.pi * modulus * scales.length),
            aspect=np.inf if line else conditions.hertz.half_widths[1] / scales.length,
            periodic=line,
        ),
        roughness=surface.heights / scales.gap,
        lower=(left / scales.length, front / scales.length),
        spacing=(dx / scales.length, dy / scales.length),
        load=load / (scales.pressure * scales.length**2),
        p_cap=np.inf if conditions.hardness is None else conditions.hardness / scales.pressure,
        contact_gap=options.contact_film / scales.gap if lubricant else 0.0,
        speed=scales.speed,
        sliding=conditions.sliding_speed / scales.gap,
        p_scale=scales.pressure,
        lubricant=lubricant,
        viscosity_factor=viscosity_factor,
    )


def first_guess(
    problem: Problem, conditions: ContactConditions, lubricant: Lubricant | None, scales: Scales
) -> tuple[Field, float]:
    """Hertz pressure, with the bodies as far apart as the film of a smooth contact holds them."""
    across = problem.y / problem.form.aspect
    pressure = np.sqrt(np.maximum(1.0 - (problem.x**2)[:, None] - across**2, 0.0))
    pressure = np.minimum(pressure, problem.p_cap)
    film = smooth_film(conditions, lubricant) / scales.gap if lubricant else 0.0
    smooth = problem.form.gap(problem.x, problem.y) + problem.deflection(pressure)
    return pressure, film - float(np.min(smooth))


def smooth_film(conditions: ContactConditions, lubricant: Lubricant) -> float:
    """Least film of the smooth contact [m] by the usual fits.

    Line: H = 2.65 G^0.54 U^0.7 W^-0.13, Dowson (1968). Point and elliptic: H = 3.63 U^0.68 G^0.49 W^-0.073
    (1 - exp(-0.68 k)), k the axis ratio across over along rolling, Hamrock and Dowson (1977).
    """
    radius, modulus = conditions.radius_along_rolling, conditions.pair.effective_modulus
    material = float(lubricant.viscosity.log_slope(np.zeros(1))[0]) * modulus
    speed = lubricant.viscosity.eta0 * conditions.entrainment_speed / (modulus * radius)
    if conditions.geometry == "line":
        load = conditions.line_load / (modulus * radius)
        return float(2.65 * material**0.54 * speed**0.7 * load**-0.13 * radius)
    a, b = conditions.hertz.half_widths
    load = conditions.load / (modulus * radius**2)
    side_leakage = 1.0 - np.exp(-0.68 * b / a)
    return float(3.63 * speed**0.68 * material**0.49 * load**-0.073 * side_leakage * radius)


def find_approach(
    problem: Problem, pressure: Field, approach: float, steps: Callable[[Problem, Field, float], Iterator[Step]]
) -> Step:
    """The contact held at approach after approach until it carries the load: slower, but each problem is a simple one.

    The load falls as the bodies part; the approach is bracketed, then found by false position.
    """
    roughness = float(np.std(problem.roughness))
    approach += 2.0 * roughness
    stride = max(0.5, 0.5 * roughness)
    near: tuple[float, float] | None = None  # approach and load error of the nearest position that carries too much ...
    apart: tuple[float, float] | None = None  # ... and of the farthest that carries too little
    for _ in range(MOST_POSITIONS):
        for step in steps(problem, pressure, approach):
            settled = step.balance.residual_rms < COARSE_TOLERANCE and step.change < COARSE_TOLERANCE
            if settled or step.number >= MOST_COARSE_ITERATIONS or _lost(step):
                break
        pressure, error = step.balance.pressure, step.balance.load_error
        if settled and abs(error) < COARSE_TOLERANCE:
            break
        if error > 0.0:
            near = approach, error
        else:
            apart = approach, error
        if near is not None and apart is not None:
            share = min(max(near[1] / (near[1] - apart[1]), 0.1), 0.9)
            approach = near[0] + share * (apart[0] - near[0])
        else:
            approach += stride if error > 0.0 else -stride
            stride *= 1.5
    return step


def refined(pressure: Field) -> Field:
    """A cell-centred field on twice as many cells each way, bilinear; y wraps round, x ends level."""
    ends = np.concatenate([pressure[:1], pressure, pressure[-1:]])
    along = np.empty((2 * pressure.shape[0], pressure.shape[1]))
    along[0::2] = 0.75 * pressure + 0.25 * ends[:-2]
    along[1::2] = 0.75 * pressure + 0.25 * ends[2:]
    fine = np.empty((along.shape[0], 2 * along.shape[1]))
    fine[:, 0::2] = 0.75 * along + 0.25 * np.roll(along, 1, axis=1)
    fine[:, 1::2] = 0.75 * along + 0.25 * np.roll(along, -1, axis=1)
    return fine


def _settled(last: Iteration, tolerance: float) -> bool:
    return last.residual < tolerance and last.load_error < tolerance and last.change < tolerance


def _lost(step: Step) -> bool:
    return step.number > 0 and not np.isfinite(step.change)


def _can_halve(cells: tuple[int, int]) -> bool:
    return all(n % 2 == 0 and n // 2 >= FEWEST_COARSE_CELLS for n in cells)


def _warm_start(start: ContactSolution, surface: Surface, scales: Scales) -> tuple[Field, float]:
    if start.grid.cells != surface.grid.cells:
        raise BadInput(f"start has {start.grid.cells} cells, the surface {surface.grid.cells}; solve without start")
    return start.pressure / scales.pressure, start.rigid_approach / scales.gap


def _check_factor(factor: Field, surface: Surface) -> None:
    if factor.shape != surface.grid.cells or not np.all((factor > 0.0) & (factor < np.inf)):
        raise BadInput(
            f"viscosity_factor must be positive on the surface's {surface.grid.cells} cells, "
            f"got shape {factor.shape} from {np.min(factor):g} to {np.max(factor):g}"
        )


def _check_grid(conditions: ContactConditions, surface: Surface) -> None:
    grid, line = surface.grid, conditions.geometry == "line"
    if grid.periodic != (False, line):
        raise BadInput(
            f"a {conditions.geometry} contact needs a grid with periodic=(False, {line}), got periodic={grid.periodic}"
        )
    a, b = conditions.hertz.half_widths
    for axis, index, half in [("x", 0, a)] if line else [("x", 0, a), ("y", 1, b)]:
        low, high, spacing = grid.lower[index], grid.upper[index], grid.spacing[index]
        if low > -1.2 * half or high < 1.2 * half:
            raise BadInput(
                f"grid from {low * 1e6:.4g} to {high * 1e6:.4g} um along {axis} must reach at least "
                f"1.2 Hertz half-widths ({1.2 * half * 1e6:.4g} um) to both sides; widen it"
            )
        if spacing > 0.25 * half:
            raise BadInput(
                f"cells of {spacing * 1e6:.3g} um along {axis} leave fewer than 8 across the contact of "
                f"{2.0 * half * 1e6:.3g} um; use more cells"
            )
