"""A contact posed as the dimensionless problem to solve: on which grids, and from which guess."""

from dataclasses import replace

import numpy as np

from asperity.arrays import Field
from asperity.conditions import ContactConditions
from asperity.ehl.outcome import ATTEMPTS, Options
from asperity.ehl.problem import Form, Problem
from asperity.ehl.scales import Scales
from asperity.lubricant import Lubricant
from asperity.surface import Surface

FEWEST_COARSE_CELLS = 48


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
        accurate=attempt == ATTEMPTS[0] and not np.any(surface.heights),
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


def grid_levels(finest: Problem) -> list[Problem]:
    """The problem on its own grid and on coarser and coarser ones."""
    levels = [finest]
    while (cells := _halved(levels[-1].cells)) != levels[-1].cells:
        levels.append(levels[-1].coarsened(cells))
    return levels


def _halved(cells: tuple[int, int]) -> tuple[int, int]:
    nx, ny = ((n + 1) // 2 if n // 2 >= FEWEST_COARSE_CELLS else n for n in cells)
    return nx, ny


def on_one_line(problem: Problem) -> Problem:
    """What does not vary along y, on one line of cells that is as wide as all."""
    factor, (dx, dy) = problem.viscosity_factor, problem.spacing
    return replace(
        problem,
        roughness=problem.roughness[:, :1],
        viscosity_factor=None if factor is None else factor[:, :1],
        spacing=(dx, problem.cells[1] * dy),
    )
