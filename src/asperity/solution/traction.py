"""Friction of a solved contact: oil shear stress in the film, f_b p on touching cells.

A film's shear stress on its surfaces is τ ± (h/2) dp/dx. τ, at mid-film, is that of sliding at the
rate Δu/h and acts on the bodies in opposite directions. The second part, of the pressure gradient,
follows from the balance of forces across the film for any oil and acts on both bodies alike: its
sum is the rolling friction. The heat contains the first part only.
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

    `coefficient` is shear force over load; its parts are `asperity_part` (touching cells) and
    `oil_part` (all others). `shear` [Pa], shape (nx, ny), acts on body 1 along rolling (the
    opposite on body 2): negative if body 1 is the faster one. `shear_force` [N] is its sum over the
    whole contact, for a line contact over its length; `power` [W] is the heat generated, |shear
    force| times sliding speed. All these are zero in pure rolling.

    `rolling_force` [N] is the sum of (h/2) dp/dx over the film, which opposes the motion of each
    body (per body; negative: it drives them), `rolling_coefficient` this force over load, and
    `rolling_power` [W] its power on both bodies, 2 u times the force with the mean speed u.
    """

    coefficient: float
    asperity_part: float
    oil_part: float
    shear: Field
    shear_force: float
    power: float
    boundary_friction: float
    rolling_force: float
    rolling_coefficient: float
    rolling_power: float


def friction(
    solution: ContactSolution,
    *,
    boundary_friction: float = BOUNDARY_FRICTION,
    thermal: Thermal | None = None,
    film_temperature: Field | None = None,
) -> Friction:
    """Compute the friction of a solved contact.

    Parameters
    ----------
    boundary_friction : f_b, shear stress over pressure on touching cells; default the paper's 0.15
    thermal : ambient temperature and viscosity-temperature law; default `Thermal()`
    film_temperature : mean over the film's thickness, (nx, ny) [K]; default ambient, with the
        viscosity of the solution

    Raises
    ------
    BadInput
        for a boundary friction outside 0 to 2, or temperatures of another shape than the grid.
    """
    _check(solution, boundary_friction, film_temperature)
    thermal = thermal or Thermal()
    conditions = solution.conditions
    sliding = conditions.surface_speeds[0] - conditions.surface_speeds[1]
    stress: Field = np.zeros(solution.grid.cells)
    if sliding != 0.0:
        stress = _oil_stress(solution, thermal, film_temperature)
        stress[solution.in_contact] = boundary_friction * solution.pressure[solution.in_contact]
    pressure_sum = float(solution.pressure.sum())
    asperity_part = float(stress[solution.in_contact].sum()) / pressure_sum
    oil_part = float(stress[~solution.in_contact].sum()) / pressure_sum
    force = (asperity_part + oil_part) * conditions.load
    rolling = _rolling_coefficient(solution)
    return Friction(
        coefficient=asperity_part + oil_part,
        asperity_part=asperity_part,
        oil_part=oil_part,
        shear=-np.sign(sliding) * stress,
        shear_force=-float(np.sign(sliding)) * force,
        power=force * abs(sliding),
        boundary_friction=boundary_friction,
        rolling_force=rolling * conditions.load,
        rolling_coefficient=rolling,
        rolling_power=2.0 * rolling * conditions.load * conditions.entrainment_speed,
    )


def warm_factor(solution: ContactSolution, thermal: Thermal, film_temperature: Field) -> Field:
    """Return viscosity at film temperature over that at ambient, per cell, (nx, ny)."""
    if solution.lubricant is None:
        raise BadInput("a dry contact has no viscosity; switch thermal feedback off")
    cold = solution.lubricant.viscosity(solution.pressure)
    return thermal.warmth.factor(cold, film_temperature, thermal.ambient)


def _check(
    solution: ContactSolution, boundary_friction: float, film_temperature: Field | None
) -> None:
    """Raise BadInput for input that `friction` refuses."""
    if not 0.0 <= boundary_friction <= 2.0:
        raise BadInput(
            f"boundary friction must be between 0 and 2, got {boundary_friction:g}; typical of "
            "steel in oil is 0.15"
        )
    cells = solution.grid.cells
    if film_temperature is not None and film_temperature.shape != cells:
        raise BadInput(
            f"film_temperature must have the grid's shape {cells}, got {film_temperature.shape}"
        )


def _oil_stress(
    solution: ContactSolution, thermal: Thermal, film_temperature: Field | None
) -> Field:
    """Return the shear stress of the oil [Pa], not negative; zero where the oil is cavitated."""
    oil = solution.lubricant
    conditions = solution.conditions
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


def _rolling_coefficient(solution: ContactSolution) -> float:
    """Return the sum of (h/2) dp/dx over the film, per load, with the pressure of the oil.

    It is evaluated on the faces between two cells without contact and at the ends of the grid,
    where the oil is at ambient pressure.
    """
    if solution.lubricant is None:
        return 0.0
    ends = ((1, 1), (0, 0))
    pressure = np.pad(solution.pressure if solution.oil is None else solution.oil.pressure, ends)
    gap = np.pad(solution.gap, ends, mode="edge")
    film = np.pad(~solution.in_contact, ends, mode="edge")
    half_gap = 0.25 * (gap[1:] + gap[:-1]) * (film[1:] & film[:-1])
    weight = float(solution.pressure.sum()) * solution.grid.spacing[0]
    return float((half_gap * np.diff(pressure, axis=0)).sum()) / weight
