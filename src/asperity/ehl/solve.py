"""From conditions, oil and surface to a solved contact, by the model that the options name."""

import time
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from asperity.contact.conditions import ContactConditions
from asperity.contact.grid import Grid
from asperity.core.arrays import Field
from asperity.core.errors import BadInput, NotConverged
from asperity.ehl.contact_solution import ContactSolution
from asperity.ehl.controls import GRID_CONTINUATION
from asperity.ehl.film_formulas import central_film
from asperity.ehl.models.elastic_dry import elastic_contact
from asperity.ehl.models.single_pressure import Problem
from asperity.ehl.newton.single_pressure import Step, newton
from asperity.ehl.outcome import ATTEMPTS, PAPER, Options
from asperity.ehl.problem_setup import contact_problem, first_guess, reduced_problem, usable_levels
from asperity.ehl.scales import Scales
from asperity.ehl.strategies.grid_continuation import Progress, Search
from asperity.ehl.strategies.mixed_search import solve_mixed
from asperity.lubricant import Lubricant, require_liquid
from asperity.surface import Surface

RIGID = 30.0  # half-widths on which a film bears, from where rollers are refused


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
        for a grid that does not hold the contact or repeats along the wrong axis, factors that do not fit it, a load
        beyond what the hardness bears on it, or an oil whose viscosity is no number at Hertz's pressure.
    NotConverged
        when strict and the tolerance was not met; carries the unfinished solution.
    """
    options = options or Options()
    _check_grid(conditions, lubricant, surface)
    if lubricant is not None:
        require_liquid(lubricant.viscosity, conditions.hertz.p_max)
    if viscosity_factor is not None:
        _check_factor(viscosity_factor, surface)
    solve = SOLVERS[
        options.model if lubricant else PAPER
    ]  # without oil there is one pressure, and nothing to lose
    solution = solve(
        conditions,
        lubricant,
        surface,
        options=options,
        start=start,
        viscosity_factor=viscosity_factor,
        progress=progress,
    )
    if strict and not solution.convergence.converged:
        raise NotConverged(solution, f"contact not solved: {solution.convergence.explain()}")
    return solution


def solve_unified(
    conditions: ContactConditions,
    lubricant: Lubricant | None,
    surface: Surface,
    *,
    options: Options,
    start: ContactSolution | None = None,
    viscosity_factor: Field | None = None,
    progress: Progress | None = None,
) -> ContactSolution:
    """Solve the contact with one pressure for oil and asperities, or dry; as `solve_contact`, which calls this."""
    began = time.perf_counter()
    scales = Scales.from_conditions(conditions, lubricant)
    whole = contact_problem(conditions, lubricant, surface, options, viscosity_factor)
    finest = reduced_problem(whole)
    elastic = lubricant is None and conditions.hardness is None
    search = (ElasticSearch if elastic else Search)(options, scales.gap, progress)
    if start is None:
        levels = usable_levels(finest, conditions, lubricant)
        guess = first_guess(levels[-1], conditions, lubricant, scales)
    else:
        levels = [finest]
        guess = _warm_start(start, finest, scales)
    for attempt in ATTEMPTS:
        if attempt == ATTEMPTS[1]:
            if not finest.accurate:
                continue
            levels = [replace(level, accurate=False) for level in levels]
        step = search.solve_levels(levels, *guess, fixed=attempt == ATTEMPTS[2])
        if search.converged(options.tolerance):
            break
    return search.solution(
        step,
        surface,
        conditions,
        lubricant,
        seconds=time.perf_counter() - began,
        attempt=attempt,
        start=start,
        viscosity_factor=viscosity_factor,
    )


class ElasticSearch(Search):
    """Dry elastic bodies coarse to fine; a step of Newton's on the finest grid says whether it is solved."""

    def solve_levels(
        self, levels: Sequence[Problem], pressure: Field, approach: float, *, fixed: bool
    ) -> Step:
        """Solve on grid after grid; by Newton's steps alone where the bodies are `fixed`."""
        if fixed:
            return super().solve_levels(levels, pressure, approach, fixed=True)
        options, start = self.options, pressure
        self.figures, self.smooth, self.cell = (
            [],
            not np.any(levels[0].roughness),
            levels[0].spacing[0],
        )
        for problem in reversed(levels):
            finest = problem is levels[0]
            tolerance = (
                options.tolerance
                if finest
                else max(GRID_CONTINUATION.coarse_tolerance, options.tolerance)
            )
            if problem.cells != pressure.shape:
                pressure = problem.interpolate(pressure)
            pressure, dry_approach, converged = elastic_contact(
                problem, pressure, GRID_CONTINUATION.elastic_tolerance * tolerance
            )
            if not converged:
                return super().solve_levels(levels, start, approach, fixed=False)
            step = self.run(
                problem,
                newton(problem, pressure, dry_approach),
                tolerance,
                options.max_iterations if finest else 0,
            )
            self.figures.append(self._figures(step))
        return step


SOLVERS = {
    "unified": solve_unified,
    "paper": solve_unified,
    "mixed": solve_mixed,
    "conserving": solve_mixed,
}


def _warm_start(start: ContactSolution, problem: Problem, scales: Scales) -> tuple[Field, float]:
    pressure, cells = start.pressure / scales.pressure, problem.all_cells
    if cells[1] == 1:
        pressure = pressure.mean(axis=1, keepdims=True)
    if pressure.shape != cells:
        raise BadInput(
            f"start has {start.grid.cells} cells, the surface {cells}; solve without start"
        )
    return np.ascontiguousarray(pressure[:, : problem.cells[1]]), start.rigid_approach / scales.gap


def _check_factor(factor: Field, surface: Surface) -> None:
    if factor.shape != surface.grid.cells or not np.all((factor > 0.0) & (factor < np.inf)):
        raise BadInput(
            f"viscosity_factor must be positive on the surface's {surface.grid.cells} cells, "
            f"got shape {factor.shape} from {np.min(factor):g} to {np.max(factor):g}"
        )


def _check_grid(
    conditions: ContactConditions, lubricant: Lubricant | None, surface: Surface
) -> None:
    grid, line = surface.grid, conditions.endless
    if grid.periodic != (False, line):
        which = "an elliptic" if conditions.geometry == "elliptic" else f"a {conditions.geometry}"
        raise BadInput(
            f"{which} contact needs a grid with periodic=(False, {line}), got periodic={grid.periodic}"
        )
    a, b = conditions.hertz.half_widths
    if conditions.geometry == "roller":
        if lubricant is not None:
            _check_weight(conditions, lubricant)
        _check_ends(conditions, grid)
    for axis, index, half in [("x", 0, a)] if conditions.long else [("x", 0, a), ("y", 1, b)]:
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
    _check_cap(conditions, grid)


def _check_cap(conditions: ContactConditions, grid: Grid) -> None:
    """BadInput where the whole grid at the pressure cap bears less than the load."""
    if conditions.hardness is None:
        return
    x, y = grid.extent
    most = conditions.hardness * x * (conditions.line_length if conditions.endless else y)
    if most <= conditions.load:
        raise BadInput(
            f"at a hardness of {conditions.hardness / 1e9:.3g} GPa this grid bears {most:.3g} N at the most, and the "
            f"load is {conditions.load:.4g} N; lower the load, check the hardness, or widen the grid"
        )


def _check_weight(conditions: ContactConditions, lubricant: Lubricant) -> None:
    """A roller must be pressed so that it deforms: the solver counts in Hertz's half-widths."""
    film = central_film(conditions, lubricant)
    wide = float(
        np.sqrt(film * conditions.radius_along_rolling)
    )  # where a rigid roller's pressure is
    if wide > RIGID * conditions.hertz.half_widths[0]:
        raise BadInput(
            f"the roller's load of {conditions.load:.3g} N floats on a film of {film * 1e6:.3g} um, which bears it on "
            f"{wide * 1e6:.3g} um where Hertz's half-width is {conditions.hertz.half_widths[0] * 1e6:.3g} um: the "
            "bodies stay rigid, and no elastic contact is solved; raise the load, or lower the speed"
        )


def _check_ends(conditions: ContactConditions, grid: Grid) -> None:
    """A roller's grid has to hold what is loaded of its length, or all of it and a line of cells beyond."""
    half, (low, high) = conditions.end, conditions.sliced_load.ends
    if (wide := 2.0 * conditions.hertz.half_widths[0]) > conditions.line_length:
        raise BadInput(
            f"the roller's {conditions.line_length * 1e3:.3g} mm are shorter than its contact is wide, "
            f"{wide * 1e3:.3g} mm under {conditions.load:.4g} N: it has no length to share a load along; lower the "
            'load, or take geometry = "elliptic"'
        )
    middle, reach = 0.5 * (low + high), 0.55 * (high - low)
    wanted = max(middle - reach, -half), min(middle + reach, half)
    if grid.y[0] > wanted[0] or grid.y[-1] < wanted[1]:
        raise BadInput(
            f"the outermost cells along y lie at {grid.y[0] * 1e3:.4g} and {grid.y[-1] * 1e3:.4g} mm, and the roller's "
            f"load reaches from {wanted[0] * 1e3:.4g} to {wanted[1] * 1e3:.4g} mm; widen the grid"
        )
    if grid.spacing[1] > (high - low) / 16.0:
        raise BadInput(
            f"cells of {grid.spacing[1] * 1e6:.3g} um along y leave fewer than 16 on the loaded length of "
            f"{(high - low) * 1e3:.3g} mm; use more cells"
        )
