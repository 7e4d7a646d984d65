"""Solve a contact from conditions, lubricant and surface, by the model of the options."""

import time
from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from asperity.contact.conditions import ContactConditions
from asperity.contact.grid import Grid
from asperity.core.arrays import Field, usual_float_errors
from asperity.core.errors import BadInput, NotConverged
from asperity.ehl.contact_solution import ContactSolution
from asperity.ehl.far_pressure import build_up_lengths
from asperity.ehl.film_formulas import central_film, require_thin_film
from asperity.ehl.inlet_layer import InletLayer
from asperity.ehl.models.elastic_dry import elastic_contact
from asperity.ehl.models.single_pressure import Problem
from asperity.ehl.newton.single_pressure import Step, newton
from asperity.ehl.outcome import TWO_PRESSURES, Options, SolveStrategy
from asperity.ehl.problem_setup import contact_problem, first_guess, reduced_problem, usable_levels
from asperity.ehl.scales import Scales
from asperity.ehl.strategies.cold_start import solve_cold
from asperity.ehl.strategies.grid_continuation import Progress, Search
from asperity.ehl.strategies.mixed_search import MixedSearch
from asperity.ehl.strategies.oil_state import pressures_of
from asperity.ehl.strategies.one_grid import FROM_NEIGHBOUR
from asperity.ehl.strategies.starved_inlet import emptied_inlet, march_to_steady, passes_less
from asperity.lubricant import Lubricant, require_liquid
from asperity.surface import Surface

RIGID = 30.0  # half-widths of the loaded film above which a roller is rejected as rigid


@usual_float_errors
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
    conditions, surface : the contact and its composite roughness; the surface's grid is solved
    lubricant : the lubricant; None for a dry contact
    options : tolerances and model; `Options()` by default
    start : a neighbouring solution (other load, speed or roughness) on a grid of the same cells
    viscosity_factor : local over isothermal viscosity, shape (nx, ny), of a heated film
    strict : raise when the tolerance is not met; otherwise return the unconverged solution
    progress : called after every Newton step

    Raises
    ------
    BadInput
        for a grid that does not contain the contact or is periodic along the wrong axis, factors
        that do not fit it, a load beyond the hardness times the area, or a viscosity that
        overflows at Hertz pressure.
    NotConverged
        when strict and the tolerance was not met; carries the unconverged solution.
    """
    options = options or Options()
    _check_grid(conditions, lubricant, surface)
    if lubricant is not None:
        require_liquid(lubricant.viscosity, conditions.hertz.p_max)
        require_thin_film(conditions, lubricant)
    if viscosity_factor is not None:
        _check_factor(viscosity_factor, surface)
    contact = _Contact(conditions, lubricant, surface, options, start, viscosity_factor, progress)
    if lubricant is None or options.model not in TWO_PRESSURES:
        solution = _solve_unified(contact)
    elif options.inlet_layer is None:
        solution = _solve_mixed(contact)
    else:
        solution = _solve_starved(contact, options.inlet_layer)
    if strict and not solution.convergence.converged:
        raise NotConverged(solution, f"contact not solved: {solution.convergence.explain()}")
    return solution


class _Contact(NamedTuple):
    """Contact to solve, as in `solve_contact`."""

    conditions: ContactConditions
    lubricant: Lubricant | None
    surface: Surface
    options: Options
    start: ContactSolution | None
    viscosity_factor: Field | None
    progress: Progress | None

    @property
    def scales(self) -> Scales:
        """Scales of the dimensionless problem."""
        return Scales.from_conditions(self.conditions, self.lubricant)

    @property
    def problem(self) -> Problem:
        """Smallest equivalent problem."""
        return reduced_problem(contact_problem(*self[:4], self.viscosity_factor))

    def solution(
        self, search: Search, step: Step, strategy: SolveStrategy, began: float
    ) -> ContactSolution:
        """Return the result of a search that `began` at a time of the performance counter."""
        solution = search.solution(
            step,
            self.surface,
            self.conditions,
            self.lubricant,
            seconds=time.perf_counter() - began,
            strategy=strategy,
            start=self.start,
        )
        return replace(solution, viscosity_factor=self.viscosity_factor)


def _solve_unified(contact: _Contact) -> ContactSolution:
    """Solve the single-pressure model, or a dry contact."""
    began = time.perf_counter()
    conditions, lubricant, options = contact.conditions, contact.lubricant, contact.options
    finest, scales = contact.problem, contact.scales
    elastic = lubricant is None and conditions.hardness is None
    search = (ElasticSearch if elastic else Search)(options, scales.gap, contact.progress)
    if contact.start is None:
        levels = usable_levels(finest, conditions, lubricant)
        guess = first_guess(levels[-1], conditions, lubricant, scales)
    else:
        levels = [finest]
        guess = _warm_start(contact.start, finest, scales)
    for strategy in (
        SolveStrategy.COARSE_TO_FINE,
        SolveStrategy.SECOND_ORDER,
        SolveStrategy.FIXED_APPROACH,
    ):
        if strategy == SolveStrategy.SECOND_ORDER:
            if not finest.accurate:
                continue
            levels = [replace(level, accurate=False) for level in levels]
        step = search.solve_levels(levels, *guess, fixed=strategy == SolveStrategy.FIXED_APPROACH)
        if search.converged(options.tolerance):
            break
    return contact.solution(search, step, strategy, began)


def _solve_mixed(contact: _Contact) -> ContactSolution:
    """Solve a two-pressure model."""
    began = time.perf_counter()
    start, finest, scales = contact.start, contact.problem, contact.scales
    search = MixedSearch(contact.options, scales.gap, contact.progress)
    if start is None:
        assert contact.lubricant is not None  # a dry contact has one pressure
        strategy, step = solve_cold(
            search, finest, contact.surface, contact.conditions, contact.lubricant
        )
    else:
        if start.convergence.attempt == SolveStrategy.ARITHMETIC_MEANS:
            search.arithmetic, finest = True, replace(finest, exact=False)
        strategy, unknowns = SolveStrategy.COARSE_TO_FINE, pressures_of(start, finest, scales)
        if contact.options.inlet_layer is None:
            step = search.first_converged(FROM_NEIGHBOUR, finest, unknowns)
        else:
            step = march_to_steady(search, finest, unknowns)
    if search.arithmetic:
        strategy = SolveStrategy.ARITHMETIC_MEANS
    return contact.solution(search, step, strategy, began)


def _solve_starved(contact: _Contact, layer: InletLayer) -> ContactSolution:
    """Solve a conserving contact with an inlet layer.

    The initial guess is the neighbouring solution, if there is one, and then the flooded contact
    with an emptied inlet. In a line contact no oil flows aside: if the layer is more than the
    contact passes, it is flooded.
    """
    began = time.perf_counter()
    solution = None if contact.start is None else _solve_mixed(contact)
    if solution is None or not solution.convergence.converged:
        options = replace(contact.options, inlet_layer=None)
        flooded = _solve_mixed(contact._replace(options=options, start=None))
        if contact.conditions.endless and passes_less(flooded, layer):
            return flooded
        solution = _solve_mixed(contact._replace(start=emptied_inlet(flooded, layer)))
    taken = replace(solution.convergence, seconds=time.perf_counter() - began)
    return replace(solution, convergence=taken)


class ElasticSearch(Search):
    """Solve dry elastic bodies coarse to fine, checked by a Newton step on the finest grid."""

    def solve_levels(
        self, levels: Sequence[Problem], pressure: Field, approach: float, *, fixed: bool
    ) -> Step:
        """Solve on successive grids; by Newton steps alone at `fixed` approach."""
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
            tolerance = self.level_tolerance(finest=finest)
            if problem.cells != pressure.shape:
                pressure = problem.interpolate(pressure)
            pressure, dry_approach, converged = elastic_contact(problem, pressure, tolerance)
            if not converged:
                return super().solve_levels(levels, start, approach, fixed=False)
            step = self.run(
                problem,
                newton(problem, pressure, dry_approach),
                tolerance,
                options.max_iterations if finest else 0,
            )
            self.figures.append(self.figures_of(step))
        return step


def _warm_start(start: ContactSolution, problem: Problem, scales: Scales) -> tuple[Field, float]:
    pressure = start.pressure / scales.pressure
    cells = problem.all_cells
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
            f"{which} contact needs a grid with periodic=(False, {line}), got "
            f"periodic={grid.periodic}"
        )
    a, b = conditions.hertz.half_widths
    light = (0.0, 0.0)
    if not np.any(surface.heights):
        light = build_up_lengths(conditions, lubricant)
    if conditions.geometry == "roller":
        if lubricant is not None:
            _check_weight(conditions, lubricant)
        _check_ends(conditions, grid)
    for axis, index, half in [("x", 0, a)] if conditions.long else [("x", 0, a), ("y", 1, b)]:
        low = grid.lower[index]
        high = grid.upper[index]
        spacing = grid.spacing[index]
        if low > -1.2 * half or high < 1.2 * half:
            raise BadInput(
                f"grid from {low * 1e6:.4g} to {high * 1e6:.4g} um along {axis} must reach at "
                "least "
                f"1.2 Hertz half-widths ({1.2 * half * 1e6:.4g} um) to both sides; widen it"
            )
        loaded = max(half, light[index])
        if spacing > 0.25 * loaded:
            raise BadInput(
                f"cells of {spacing * 1e6:.3g} um along {axis} are too coarse: fewer than 8 span "
                f"the {2.0 * loaded * 1e6:.3g} um contact; use more cells"
            )
    _check_cap(conditions, grid)


def _check_cap(conditions: ContactConditions, grid: Grid) -> None:
    """Raise BadInput where the whole grid at the pressure cap carries less than the load."""
    if conditions.hardness is None:
        return
    x, y = grid.extent
    max_load = conditions.hardness * x * (conditions.line_length if conditions.endless else y)
    if max_load <= conditions.load:
        raise BadInput(
            f"at a hardness of {conditions.hardness / 1e9:.3g} GPa this grid carries at most "
            f"{max_load:.3g} N, "
            f"less than the load of {conditions.load:.4g} N; lower the load, check the hardness, "
            "or "
            "widen the grid"
        )


def _check_weight(conditions: ContactConditions, lubricant: Lubricant) -> None:
    """Raise BadInput for a roller too lightly loaded to deform."""
    film = central_film(conditions, lubricant)
    # extent of a rigid roller's pressure
    wide = float(np.sqrt(film * conditions.radius_along_rolling))
    if wide > RIGID * conditions.hertz.half_widths[0]:
        raise BadInput(
            f"the roller's load of {conditions.load:.3g} N is carried by a film of "
            f"{film * 1e6:.3g} um over "
            f"{wide * 1e6:.3g} um, far wider than the Hertz half-width of "
            f"{conditions.hertz.half_widths[0] * 1e6:.3g} um: the bodies stay rigid, and only "
            "elastic "
            "contacts are solved; raise the load or lower the speed"
        )


def _check_ends(conditions: ContactConditions, grid: Grid) -> None:
    """Raise BadInput unless the grid holds a roller's loaded length."""
    half = conditions.end
    (low, high) = conditions.sliced_load.ends
    if (wide := 2.0 * conditions.hertz.half_widths[0]) > conditions.line_length:
        raise BadInput(
            f"the roller of {conditions.line_length * 1e3:.3g} mm is shorter than its contact is "
            "wide, "
            f"{wide * 1e3:.3g} mm under {conditions.load:.4g} N; lower the load, or use "
            'geometry = "elliptic"'
        )
    middle = 0.5 * (low + high)
    reach = 0.55 * (high - low)
    loaded = max(middle - reach, -half), min(middle + reach, half)
    if grid.y[0] > loaded[0] or grid.y[-1] < loaded[1]:
        raise BadInput(
            f"the grid's outermost cells along y lie at {grid.y[0] * 1e3:.4g} and "
            f"{grid.y[-1] * 1e3:.4g} mm, but the "
            f"roller is loaded from {loaded[0] * 1e3:.4g} to {loaded[1] * 1e3:.4g} mm; widen the "
            "grid"
        )
    if grid.spacing[1] > (high - low) / 16.0:
        raise BadInput(
            f"cells of {grid.spacing[1] * 1e6:.3g} um along y are too coarse: fewer than 16 span "
            f"the {(high - low) * 1e3:.3g} mm loaded length; use more cells"
        )
