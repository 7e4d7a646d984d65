"""Friction of a solved contact: oil shear stress in the film, f_b p on touching cells.

A film's shear stress on its surfaces is τ ± (h/2) dp/dx. τ, at mid-film, is that of sliding at the
rate Δu/h and acts on the bodies in opposite directions. The second part, of the pressure gradient,
follows from the balance of forces across the film for any oil and acts on both bodies alike: its
sum is the rolling friction. The heat contains the first part only.

The friction of oil is far more uncertain than its film: at contact pressure the viscosity changes
with the exponential of the pressure-viscosity coefficient, and no data sheet states the stress at
which an oil yields. `Friction` has both as parts of an interval.
"""

import math
from dataclasses import dataclass, replace

import numpy as np

from asperity.core.arrays import Field, usual_float_errors
from asperity.core.errors import BadInput
from asperity.ehl import ContactSolution
from asperity.lubricant import EyringShear, NewtonianShear, ShearedFilm, Thermal

BOUNDARY_FRICTION = 0.15  # the paper's Table 2
# Halves of 90 % intervals, as `core.coverage` states it:
LAW_ERROR = 0.2  # of ln(eta/eta0) by Roelands' law up to 1 GPa, that of squalane (Bair 2006)
STRESS_FACTOR = 1.5  # on the stress scale of a friction law; tau0 of mineral oils: 4 to 9 MPa
TYPICAL_EYRING_STRESS = 5e6  # [Pa] at which oils deviate from Newton's law


@dataclass(frozen=True, kw_only=True)
class Friction:
    """Friction of a contact.

    `coefficient` is shear force over load; its parts are `asperity_part` (touching cells) and
    `oil_part` (all others). `shear` [Pa], shape (nx, ny), acts on body 1 along rolling (the
    opposite on body 2): negative if body 1 is the faster one. `shear_force` [N] is its sum over the
    whole contact, for a line contact over its length; `power` [W] is the heat generated, |shear
    force| times sliding speed. All these are zero in pure rolling.

    `oil_below` and `oil_above` are the error of the coefficient due to the oil: its
    pressure-viscosity coefficient, the law of its viscosity at contact pressure, and the stress
    scale of its friction law. `heat_below` is the friction that the warming of the film would
    take away where the viscosity is that of the cold oil.

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
    oil_below: float = 0.0
    oil_above: float = 0.0
    heat_below: float = 0.0


@usual_float_errors
def friction(
    solution: ContactSolution,
    *,
    boundary_friction: float = BOUNDARY_FRICTION,
    thermal: Thermal | None = None,
    film_temperature: Field | None = None,
    inlet_factor: Field | float = 1.0,
) -> Friction:
    """Compute the friction of a solved contact.

    Parameters
    ----------
    boundary_friction : f_b, shear stress over pressure on touching cells; default the paper's 0.15
    thermal : ambient temperature and viscosity-temperature law; default `Thermal()`
    film_temperature : mean over the film's thickness, (nx, ny) [K]; default ambient, with the
        viscosity of the solution
    inlet_factor : viscosity factor of inlet shear heating, beside a film temperature

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
    pressure_sum = float(solution.pressure.sum())
    below = above = 0.0
    if sliding != 0.0:
        if (film := _sheared_film(solution, thermal, film_temperature, inlet_factor)) is not None:
            stress = _oil_stress(solution, film)
            below, above = (side / pressure_sum for side in _oil_error(solution, film))
        stress[solution.in_contact] = boundary_friction * solution.pressure[solution.in_contact]
    asperity_part = float(stress[solution.in_contact].sum()) / pressure_sum
    oil_part = float(stress[~solution.in_contact].sum()) / pressure_sum
    force = (asperity_part + oil_part) * conditions.load
    return Friction(
        coefficient=asperity_part + oil_part,
        asperity_part=asperity_part,
        oil_part=oil_part,
        shear=-np.sign(sliding) * stress,
        shear_force=-float(np.sign(sliding)) * force,
        power=force * abs(sliding),
        boundary_friction=boundary_friction,
        oil_below=below,
        oil_above=above,
        **_rolling(solution),
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


def _sheared_film(
    solution: ContactSolution,
    thermal: Thermal,
    film_temperature: Field | None,
    inlet_factor: Field | float,
) -> ShearedFilm | None:
    """Return the sheared film, None for a dry contact."""
    oil = solution.lubricant
    conditions = solution.conditions
    if oil is None:
        return None
    viscosity = oil.viscosity(solution.pressure)
    if film_temperature is not None:
        viscosity = viscosity * inlet_factor * warm_factor(solution, thermal, film_temperature)
    elif solution.viscosity_factor is not None:
        viscosity = viscosity * solution.viscosity_factor
    ambient: Field = np.full(solution.grid.cells, thermal.ambient)
    return ShearedFilm(
        rate=conditions.sliding_speed / solution.gap,
        viscosity=viscosity,
        pressure=solution.pressure,
        temperature=ambient if film_temperature is None else film_temperature,
        transit=solution.grid.spacing[0] / conditions.entrainment_speed,
    )


def _oil_stress(
    solution: ContactSolution, film: ShearedFilm, *, exponent: float = 1.0, scale: float = 1.0
) -> Field:
    """Return the shear stress of the oil [Pa], not negative; zero where the oil is cavitated.

    `exponent` multiplies ln(η/η₀) under pressure, `scale` the stresses of the friction law: any
    law, a function of stress over such a scale, gives `scale` times its stress at η/`scale`.
    """
    oil = solution.lubricant
    assert oil is not None
    thickening = np.log(oil.viscosity(solution.pressure) / oil.viscosity.eta0)
    viscosity = film.viscosity * np.exp((exponent - 1.0) * thickening) / scale
    stress = scale * oil.friction(replace(film, viscosity=viscosity))
    return np.where(solution.cavitated, 0.0, stress)


def _oil_error(solution: ContactSolution, film: ShearedFilm) -> tuple[float, float]:
    """Return the error below and above the sum of the oil's shear stress [Pa]."""
    oil = solution.lubricant
    assert oil is not None
    open_cells = ~solution.in_contact
    exponent = math.hypot(oil.alpha_error, LAW_ERROR)
    changes = [
        {"exponent": 1.0 - exponent},
        {"exponent": 1.0 + exponent},
        {"scale": 1.0 / STRESS_FACTOR},
        {"scale": STRESS_FACTOR},
    ]
    stresses = [_oil_stress(solution, film, **change) for change in changes]
    if isinstance(oil.friction, NewtonianShear):
        thin = EyringShear(TYPICAL_EYRING_STRESS)(film)
        stresses[2] = np.where(solution.cavitated, 0.0, thin)
    total = float(_oil_stress(solution, film)[open_cells].sum())
    less, more, weak, strong = (abs(float(stress[open_cells].sum()) - total) for stress in stresses)
    return min(math.hypot(less, weak), total), math.hypot(more, strong)


def _rolling(solution: ContactSolution) -> dict[str, float]:
    """Return force, coefficient and power of rolling friction by field of `Friction`."""
    load, speed = solution.conditions.load, solution.conditions.entrainment_speed
    coefficient = _rolling_coefficient(solution)
    return {
        "rolling_force": coefficient * load,
        "rolling_coefficient": coefficient,
        "rolling_power": 2.0 * coefficient * load * speed,
    }


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
