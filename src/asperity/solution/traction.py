"""Friction of a solved contact: the oil's shear stress where a film parts the bodies, f_b p where they touch.

The oil is sheared by sliding alone, at Δu/h: the stress at mid-film. What the pressure gradient
adds at the two surfaces (rolling resistance) is left out, as it is from the heat.
"""

from dataclasses import dataclass

import numpy as np

from asperity.core.arrays import Field
from asperity.core.errors import BadInput
from asperity.ehl import ContactSolution
from asperity.lubricant import ShearedFilm, Thermal

BOUNDARY_FRICTION = 0.15  # the paper's Table 2


@dataclass(frozen=True, kw_only=True)
class Friction:
    """Friction of a contact.

    `coefficient` shear force over load, and its parts: `asperity_part` from touching cells,
    `oil_part` from all others. `shear` [Pa], shape (nx, ny), is what body 1 feels along rolling
    (body 2 feels the opposite): negative where body 1 is the faster one. `shear_force` [N] is its
    sum over the whole contact, of a line contact over its length; `power` [W] what it turns to
    heat, |shear force| times sliding speed. In pure rolling all are zero.
    """

    coefficient: float
    asperity_part: float
    oil_part: float
    shear: Field
    shear_force: float
    power: float
    boundary_friction: float


def friction(
    solution: ContactSolution,
    *,
    boundary_friction: float = BOUNDARY_FRICTION,
    thermal: Thermal | None = None,
    film_temperature: Field | None = None,
) -> Friction:
    """Friction of a solved contact.

    Parameters
    ----------
    boundary_friction : f_b, shear stress over pressure where the bodies touch; the paper's 0.15 unless given
    thermal : ambient temperature, and how warmth thins the oil; `Thermal()` unless given
    film_temperature : mean over the film's thickness, (nx, ny) [K]; ambient unless given, and the oil is then as
        viscous as it was solved

    Raises
    ------
    BadInput
        for a boundary friction outside 0 to 2, or temperatures that do not lie on the grid.
    """
    if not 0.0 <= boundary_friction <= 2.0:
        raise BadInput(
            f"boundary friction must lie between 0 and 2, got {boundary_friction:g}; steel in oil has 0.15"
        )
    thermal = thermal or Thermal()
    conditions, grid = solution.conditions, solution.grid
    if film_temperature is not None and film_temperature.shape != grid.cells:
        raise BadInput(
            f"film_temperature must have the grid's {grid.cells} cells, got {film_temperature.shape}"
        )
    sliding = conditions.surface_speeds[0] - conditions.surface_speeds[1]
    stress: Field = np.zeros(grid.cells)
    if sliding != 0.0:
        stress = _oil_stress(solution, thermal, film_temperature)
        stress[solution.in_contact] = boundary_friction * solution.pressure[solution.in_contact]
    borne = float(solution.pressure.sum())
    touching = float(stress[solution.in_contact].sum()) / borne
    parted = float(stress[~solution.in_contact].sum()) / borne
    force = (touching + parted) * conditions.load
    return Friction(
        coefficient=touching + parted,
        asperity_part=touching,
        oil_part=parted,
        shear=-np.sign(sliding) * stress,
        shear_force=-float(np.sign(sliding)) * force,
        power=force * abs(sliding),
        boundary_friction=boundary_friction,
    )


def warm_factor(solution: ContactSolution, thermal: Thermal, film_temperature: Field) -> Field:
    """Viscosity at the film's temperature over that at ambient, each cell at its pressure, shape (nx, ny)."""
    if solution.lubricant is None:
        raise BadInput("a dry contact has no viscosity; leave the feedback of heat out")
    cold = solution.lubricant.viscosity(solution.pressure)
    return thermal.warmth.factor(cold, film_temperature, thermal.ambient)


def _oil_stress(
    solution: ContactSolution, thermal: Thermal, film_temperature: Field | None
) -> Field:
    """Shear stress of the oil [Pa], not negative; nothing where it has ruptured."""
    oil, conditions = solution.lubricant, solution.conditions
    if oil is None:
        return np.zeros(solution.grid.cells)
    viscosity = oil.viscosity(solution.pressure)
    if film_temperature is not None:
        viscosity = viscosity * warm_factor(solution, thermal, film_temperature)
    elif solution.viscosity_factor is not None:
        viscosity = viscosity * solution.viscosity_factor
    ambient: Field = np.full(solution.grid.cells, thermal.ambient)
    film = ShearedFilm(
        rate=conditions.sliding_speed / solution.gap,
        viscosity=viscosity,
        pressure=solution.pressure,
        temperature=ambient if film_temperature is None else film_temperature,
        transit=solution.grid.spacing[0] / conditions.entrainment_speed,
    )
    return np.where(solution.cavitated, 0.0, oil.friction(film))
