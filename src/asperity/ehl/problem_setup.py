"""A contact posed as the dimensionless problem to solve: on which grids, and from which guess."""

from dataclasses import replace

import numpy as np

from asperity.contact.conditions import ContactConditions
from asperity.core.arrays import Field
from asperity.ehl.controls import GRID_CONTINUATION
from asperity.ehl.deflection import MIRROR_BETWEEN, MIRROR_THROUGH
from asperity.ehl.film_formulas import central_film, least_films
from asperity.ehl.grid_design import MIN_CELLS_SHORT_AXIS, MIN_COARSE_CELLS, inlet_length
from asperity.ehl.models.single_pressure import BodyShape, Problem
from asperity.ehl.outcome import ATTEMPTS, CONSERVING, Options
from asperity.ehl.roller_profile import RollerProfile
from asperity.ehl.scales import Scales
from asperity.lubricant import Lubricant
from asperity.surface import Surface


def contact_problem(
    conditions: ContactConditions,
    lubricant: Lubricant | None,
    surface: Surface,
    options: Options,
    viscosity_factor: Field | None = None,
    *,
    attempt: str = ATTEMPTS[0],
) -> Problem:
    """The dimensionless problem on the surface's own grid, as the attempt poses it."""
    scales = Scales.from_conditions(conditions, lubricant)
    grid, line = surface.grid, conditions.endless
    (dx, dy), (left, front) = grid.spacing, grid.lower
    load = conditions.line_load * grid.extent[1] if line else conditions.load
    radius, modulus = conditions.radius_along_rolling, conditions.pair.effective_modulus
    return Problem(
        form=BodyShape(
            flatness=radius / conditions.radius_across_rolling,
            compliance=2.0 * scales.pressure * radius / (np.pi * modulus * scales.length),
            aspect=np.inf if line else conditions.hertz.half_widths[1] / scales.length,
            periodic=line,
            roller=RollerProfile(conditions, scales.length, scales.gap)
            if conditions.geometry == "roller"
            else None,
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
        accurate=attempt == ATTEMPTS[0]
        and not np.any(surface.heights)
        and options.model != CONSERVING,
        conserve=options.model == CONSERVING and lubricant is not None,
    )


def first_guess(
    problem: Problem, conditions: ContactConditions, lubricant: Lubricant | None, scales: Scales
) -> tuple[Field, float]:
    """Hertz pressure, with the bodies as far apart as the film of a smooth contact holds them."""
    pressure = np.minimum(problem.form.hertz(problem.x, problem.y), problem.p_cap)
    film = 0.0
    if lubricant:
        film = smooth_film(conditions, lubricant) / scales.gap
        if not np.any(
            problem.roughness
        ):  # too near, smooth bodies touch where oil has to part them, and stay so
            film = max(
                film, least_films(conditions, lubricant)["isoviscous-elastic"].film / scales.gap
            )
            if (
                not conditions.long
            ):  # under Hertz's pressure the gap is even: it is that in the middle
                film = max(film, central_film(conditions, lubricant) / scales.gap)
    smooth = problem.form.gap(problem.x, problem.y) + problem.deflection(pressure)
    return pressure, film - float(np.min(smooth))


def smooth_film(conditions: ContactConditions, lubricant: Lubricant) -> float:
    """Least film of the smooth contact [m] by the fits of hard bodies and thickening oils, Dowson's and Hamrock's.

    A guess to start from, in every regime: `least_film` is the film to report.
    """
    return least_films(conditions, lubricant)["piezoviscous-elastic"].film


def grid_levels(finest: Problem) -> list[Problem]:
    """The problem on its own grid and on coarser and coarser ones."""
    levels = [finest]
    while (cells := _halved(levels[-1].all_cells)) != levels[-1].all_cells:
        levels.append(levels[-1].coarsened(cells))
    return levels


def coarser_in_all_axes(problem: Problem, finest: Problem) -> bool:
    """Whether a grid tells what the finest one's cells did: coarser along each axis of more than one, or itself."""
    several = [
        (few, many) for few, many in zip(problem.cells, finest.cells, strict=True) if many > 1
    ]
    return problem.cells == finest.cells or all(few < many for few, many in several)


def usable_levels(
    finest: Problem, conditions: ContactConditions, lubricant: Lubricant | None
) -> list[Problem]:
    """The levels of a climb; those of a smooth line contact down to the coarsest that has 2 cells across the inlet.

    On coarser ones the bodies touch, which is a worse start than Hertz's pressure. One is kept to
    tell the error.
    """
    levels = grid_levels(finest)
    if not finest.uniform or lubricant is None:
        return levels
    most = (
        inlet_length(conditions, lubricant)
        / conditions.hertz.half_widths[0]
        / GRID_CONTINUATION.min_coarse_inlet_cells
    )
    return [level for number, level in enumerate(levels) if number < 2 or level.spacing[0] <= most]


def _halved(cells: tuple[int, int]) -> tuple[int, int]:
    fewest = MIN_CELLS_SHORT_AXIS if max(cells) // 2 >= MIN_COARSE_CELLS else MIN_COARSE_CELLS
    nx, ny = ((n + 1) // 2 if n // 2 >= fewest else n for n in cells)
    return nx, ny


def reduced_problem(problem: Problem) -> Problem:
    """What tells all of a lubricated contact: one line of cells, or those on one side of Y = 0, if that will do."""
    if problem.uniform:
        return on_one_line(problem)
    return half_domain(problem) if problem.symmetric and problem.lubricant is not None else problem


def half_domain(problem: Problem) -> Problem:
    """What has a mirror at Y = 0, on the cells up to there."""
    factor, lines = problem.viscosity_factor, problem.cells[1]
    half = -(-lines // 2)
    return replace(
        problem,
        roughness=problem.roughness[:, :half],
        viscosity_factor=None if factor is None else factor[:, :half],
        mirror=MIRROR_THROUGH if lines % 2 else MIRROR_BETWEEN,
    )


def on_one_line(problem: Problem) -> Problem:
    """What does not vary along y, on one line of cells that is as wide as all."""
    factor, (dx, dy) = problem.viscosity_factor, problem.spacing
    return replace(
        problem,
        roughness=problem.roughness[:, :1],
        viscosity_factor=None if factor is None else factor[:, :1],
        spacing=(dx, problem.cells[1] * dy),
    )
