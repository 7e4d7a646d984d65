"""Setup of the dimensionless problem: grid levels and initial guess."""

import math
from dataclasses import replace

import numpy as np

from asperity.contact.conditions import ContactConditions
from asperity.core.arrays import Field
from asperity.ehl.controls import CONTINUATION
from asperity.ehl.deflection import MIRROR_BETWEEN, MIRROR_THROUGH
from asperity.ehl.far_pressure import build_up_lengths, rigid_pressure
from asperity.ehl.film_formulas import central_film, least_film, least_films
from asperity.ehl.grid_design import MIN_CELLS_SHORT_AXIS, MIN_COARSE_CELLS, inlet_length
from asperity.ehl.inlet_layer import InletLayer
from asperity.ehl.models.single_pressure import Problem
from asperity.ehl.outcome import CONSERVING, TWO_PRESSURES, Options, SolveStrategy
from asperity.ehl.roller_profile import BodyShape, RollerProfile
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
    strategy: SolveStrategy = SolveStrategy.COARSE_TO_FINE,
) -> Problem:
    """Return the dimensionless problem of a strategy on the surface's grid."""
    scales = Scales.from_conditions(conditions, lubricant)
    grid, line = surface.grid, conditions.endless
    (dx, dy) = grid.spacing
    (left, front) = grid.lower
    load = conditions.line_load * grid.extent[1] if line else conditions.load
    return Problem(
        form=_body_shape(conditions, scales),
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
        accurate=strategy == SolveStrategy.COARSE_TO_FINE
        and not np.any(surface.heights)
        and options.model != CONSERVING,
        exact=options.model in TWO_PRESSURES
        and lubricant is not None
        and strategy != SolveStrategy.ARITHMETIC_MEANS
        and bool(np.any(surface.heights)),
        conserve=options.model == CONSERVING and lubricant is not None,
        inlet_layer=_inlet_layer(options, scales),
    )


def _inlet_layer(options: Options, scales: Scales) -> InletLayer | None:
    layer = options.inlet_layer
    return None if layer is None else layer.scaled(scales.length, scales.gap)


def _body_shape(conditions: ContactConditions, scales: Scales) -> BodyShape:
    """Return the dimensionless smooth shape of both bodies."""
    radius = conditions.radius_along_rolling
    modulus = conditions.pair.effective_modulus
    half_width = np.inf if conditions.endless else conditions.hertz.half_widths[1]
    return BodyShape(
        flatness=radius / conditions.radius_across_rolling,
        compliance=2.0 * scales.pressure * radius / (np.pi * modulus * scales.length),
        aspect=half_width / scales.length,
        periodic=conditions.endless,
        roller=RollerProfile(conditions, scales.length, scales.gap)
        if conditions.geometry == "roller"
        else None,
    )


def first_guess(
    problem: Problem, conditions: ContactConditions, lubricant: Lubricant | None, scales: Scales
) -> tuple[Field, float]:
    """Return Hertz pressure and an approach that leaves the film of a smooth contact."""
    shape = problem.form.gap(problem.x, problem.y)
    pressure = np.minimum(problem.form.hertz(problem.x, problem.y), problem.p_cap)
    film = 0.0
    if lubricant:
        # too close, bodies touch where oil should separate them, and remain in contact
        film = smooth_film(conditions, lubricant) / scales.gap
        # the gap is uniform under Hertz pressure: the central film
        if not np.any(problem.roughness) and not conditions.long:
            film = max(film, central_film(conditions, lubricant) / scales.gap)
        if build_up_lengths(conditions, lubricant)[0] > 0.0 and not np.any(problem.roughness):
            film = least_film(conditions, lubricant) / scales.gap
            pressure = rigid_pressure(problem.x[:, None], film + shape - float(np.min(shape)))
            pressure *= problem.load / (
                problem.sum_over_cells(pressure) * math.prod(problem.spacing)
            )
    smooth = shape + problem.deflection(pressure)
    return pressure, film - float(np.min(smooth))


def smooth_film(conditions: ContactConditions, lubricant: Lubricant) -> float:
    """Return the minimum film [m] of a smooth elastic contact, the thicker of two fits.

    It is an initial guess in every regime; report `least_film` instead.
    """
    films = least_films(conditions, lubricant)
    return max(films[regime].film for regime in ("piezoviscous-elastic", "isoviscous-elastic"))


def grid_levels(finest: Problem) -> list[Problem]:
    """Return the problem on its own grid and on successively coarser ones."""
    levels = [finest]
    while (cells := _halved(levels[-1].all_cells)) != levels[-1].all_cells:
        levels.append(levels[-1].coarsened(cells))
    return levels


def coarser_in_all_axes(problem: Problem, finest: Problem) -> bool:
    """Return True for the finest grid and for grids that refine to it along every axis.

    Axes of one cell do not count. Only such grids estimate the discretisation error.
    """
    pairs = [
        (coarse, fine) for coarse, fine in zip(problem.cells, finest.cells, strict=True) if fine > 1
    ]
    return problem.cells == finest.cells or all(coarse < fine for coarse, fine in pairs)


def usable_levels(
    finest: Problem, conditions: ContactConditions, lubricant: Lubricant | None
) -> list[Problem]:
    """Return the levels of a coarse-to-fine solve.

    A line contact whose oil separates the bodies needs 2 cells across the inlet: on coarser grids
    the bodies touch, which is a worse initial guess than Hertz pressure. One coarser level is kept
    for the error estimate.
    """
    levels = grid_levels(finest)
    length = build_up_lengths(conditions, lubricant)[0] / conditions.hertz.half_widths[0]
    if length > 0.0 and not np.any(finest.roughness):
        return [level for level in levels if level is finest or level.spacing[0] <= length]
    if not finest.form.periodic or lubricant is None:
        return levels
    gap = Scales.from_conditions(conditions, lubricant).gap
    separation = float(np.std(finest.roughness)) * gap
    if not finest.uniform and least_film(conditions, lubricant) < separation:
        return levels
    limit = (
        inlet_length(conditions, lubricant)
        / conditions.hertz.half_widths[0]
        / CONTINUATION.min_coarse_inlet_cells
    )
    return [level for number, level in enumerate(levels) if number < 2 or level.spacing[0] <= limit]


def _halved(cells: tuple[int, int]) -> tuple[int, int]:
    fewest = MIN_CELLS_SHORT_AXIS if max(cells) // 2 >= MIN_COARSE_CELLS else MIN_COARSE_CELLS
    nx, ny = ((n + 1) // 2 if n // 2 >= fewest else n for n in cells)
    return nx, ny


def reduced_problem(problem: Problem) -> Problem:
    """Return the smallest equivalent problem: one line of cells, half the domain, or all."""
    if problem.uniform:
        return on_one_line(problem)
    return half_domain(problem) if problem.symmetric and problem.lubricant is not None else problem


def half_domain(problem: Problem) -> Problem:
    """Return a symmetric problem on the cells up to its mirror plane Y = 0."""
    factor = problem.viscosity_factor
    lines = problem.cells[1]
    half = -(-lines // 2)
    return replace(
        problem,
        roughness=problem.roughness[:, :half],
        viscosity_factor=None if factor is None else factor[:, :half],
        mirror=MIRROR_THROUGH if lines % 2 else MIRROR_BETWEEN,
    )


def on_one_line(problem: Problem) -> Problem:
    """Return a problem uniform along y on one line of cells of the full width."""
    factor = problem.viscosity_factor
    (dx, dy) = problem.spacing
    return replace(
        problem,
        roughness=problem.roughness[:, :1],
        viscosity_factor=None if factor is None else factor[:, :1],
        spacing=(dx, problem.cells[1] * dy),
    )
