"""Friction and heat of a solved contact together, with optional thermal feedback on viscosity.

With `Thermal.feedback` the film temperature sets the oil's shear stress and its viscosity in
Reynolds' equation; without it frictional heat is only a result. Inlet shear heating is separate.
"""

from dataclasses import replace
from typing import TypedDict, Unpack

import numpy as np

from asperity.contact.conditions import ContactConditions
from asperity.core.arrays import Field
from asperity.core.errors import AsperityError, NotConverged
from asperity.ehl import ContactSolution, Options, SolveStatus, solve_contact
from asperity.ehl.strategies.grid_continuation import Progress
from asperity.lubricant import Lubricant, Thermal
from asperity.solution.fixed_point import Mixer
from asperity.solution.flash import FlashTemperature, flash_temperature
from asperity.solution.inlet import inlet_viscosity_factor
from asperity.solution.traction import BOUNDARY_FRICTION, Friction, friction, warm_factor
from asperity.surface import Surface

TEMPERATURE_TOLERANCE = 1e-3  # change of the film temperature over its largest rise
MIN_SCALE = 1.0  # [K] smallest rise to which the tolerance refers
MAX_ROUNDS = 400
HOT = 30.0  # rise of the film temperature [K] above which the viscosity of any oil changes clearly
MAX_SOLVES = 25
MAX_WARM_ITERATIONS = 40  # a warm start from a slightly colder solution takes about ten


def friction_and_heat(
    solution: ContactSolution,
    *,
    boundary_friction: float = BOUNDARY_FRICTION,
    thermal: Thermal | None = None,
) -> tuple[Friction, FlashTemperature]:
    """Compute friction and flash temperature; with `thermal.feedback` mutually consistent.

    Raises
    ------
    BadInput
        for a boundary friction outside 0 to 2.
    AsperityError
        if friction and temperature do not converge.
    """
    thermal = thermal or Thermal()
    if not thermal.feedback or solution.lubricant is None:
        cold = friction(solution, boundary_friction=boundary_friction, thermal=thermal)
        heat = flash_temperature(solution, cold, thermal=thermal)
        return _with_heat_below(solution, cold, heat, thermal), heat
    rise: Field = np.zeros(solution.grid.cells)
    inlet_factor = _inlet_factor(solution, thermal)
    mixer = Mixer()
    for _ in range(MAX_ROUNDS):
        friction_result = friction(
            solution,
            boundary_friction=boundary_friction,
            thermal=thermal,
            film_temperature=thermal.ambient + rise,
            inlet_factor=inlet_factor,
        )
        heat = flash_temperature(solution, friction_result, thermal=thermal)
        change = heat.film - rise
        residual = float(np.max(np.abs(change)))
        if residual < TEMPERATURE_TOLERANCE * max(heat.film_max_k, MIN_SCALE):
            return friction_result, heat
        # Newton step with the diagonal of the Jacobian: a cell's own heating thins its oil
        warm = thermal.ambient + rise
        thinning = np.log(
            warm_factor(solution, thermal, warm) / warm_factor(solution, thermal, warm + 1.0)
        )
        rise = mixer(rise, change / (1.0 + thinning * np.maximum(heat.film, 0.0)))
    raise AsperityError(
        f"friction and temperature did not converge: {residual:.2g} K change after {MAX_ROUNDS} "
        "iterations; switch thermal feedback off, or use a friction law with a limiting stress"
    )


def _with_heat_below(
    solution: ContactSolution, cold: Friction, heat: FlashTemperature, thermal: Thermal
) -> Friction:
    """Return the friction of cold oil with the part that the warming of the film takes away."""
    if solution.lubricant is None or not np.any(heat.film):
        return cold
    warm = friction(
        solution,
        boundary_friction=cold.boundary_friction,
        thermal=thermal,
        film_temperature=thermal.ambient + np.maximum(heat.film, 0.0),
        inlet_factor=_inlet_factor(solution, thermal),
    )
    return replace(cold, heat_below=max(cold.oil_part - warm.oil_part, 0.0))


def _inlet_factor(solution: ContactSolution, thermal: Thermal) -> Field | float:
    """Return the viscosity factor of inlet shear heating of a solution, 1 without."""
    if solution.viscosity_factor is None:
        return 1.0
    conditions, lubricant = solution.conditions, solution.lubricant
    factor = inlet_viscosity_factor(conditions, lubricant, solution.grid, thermal)
    return 1.0 if factor is None else factor


class SolveSettings(TypedDict, total=False):
    """Optional settings of `solve_contact`."""

    options: Options | None
    start: ContactSolution | None
    strict: bool
    progress: Progress | None


def solve_thermal_contact(
    conditions: ContactConditions,
    lubricant: Lubricant | None,
    surface: Surface,
    *,
    boundary_friction: float = BOUNDARY_FRICTION,
    thermal: Thermal | None = None,
    **settings: Unpack[SolveSettings],
) -> ContactSolution:
    """Solve the contact with inlet shear heating where it is to be computed, and with feedback.

    With `thermal.feedback`, contact and heat are solved in turn until the film temperature
    converges (root mean square of its change below a thousandth of its largest rise). Parameters
    are those of `solve_contact` and `friction_and_heat`; the solution carries the viscosity factors
    and the iterations of all solves.

    Raises
    ------
    BadInput, NotConverged, AsperityError
        as those two; NotConverged also if contact and heat do not converge.
    """
    thermal = thermal or Thermal()
    inlet_factor = inlet_viscosity_factor(conditions, lubricant, surface.grid, thermal)
    solution = solve_contact(
        conditions, lubricant, surface, viscosity_factor=inlet_factor, **settings
    )
    cold = lubricant is None or not thermal.feedback or conditions.sliding_speed == 0.0
    if cold or not solution.convergence.converged:
        return solution
    options = settings.get("options") or Options()
    solution, settled = _iterate_with_heat(
        solution,
        options,
        boundary_friction=boundary_friction,
        thermal=thermal,
        inlet_factor=1.0 if inlet_factor is None else inlet_factor,
        progress=settings.get("progress"),
    )
    status = SolveStatus.CONVERGED if settled else SolveStatus.OUT_OF_ITERATIONS
    solution = replace(solution, convergence=replace(solution.convergence, status=status))
    if settings.get("strict", True) and not solution.convergence.converged:
        raise NotConverged(solution, f"contact and heat did not converge in {MAX_SOLVES} solves")
    return solution


def _iterate_with_heat(
    solution: ContactSolution,
    options: Options,
    *,
    boundary_friction: float,
    thermal: Thermal,
    inlet_factor: Field | float,
    progress: Progress | None,
) -> tuple[ContactSolution, bool]:
    """Solve contact and heat in turn from a solution without feedback; return convergence, too."""
    history = solution.convergence.history
    seconds = solution.convergence.seconds
    warm_options = replace(options, max_iterations=min(options.max_iterations, MAX_WARM_ITERATIONS))
    # film temperature rise at which the solution's viscosity was evaluated
    temperature_rise: Field = np.zeros(solution.grid.cells)
    damping, temperature_converged = 1.0, False
    for _ in range(MAX_SOLVES):
        _, heat = friction_and_heat(solution, boundary_friction=boundary_friction, thermal=thermal)
        residual = float(np.sqrt(np.mean((heat.film - temperature_rise) ** 2)))
        scale = max(float(np.max(heat.film)), MIN_SCALE)
        temperature_converged = residual < TEMPERATURE_TOLERANCE * scale
        if temperature_converged:
            break
        target = temperature_rise + damping * (heat.film - temperature_rise)
        candidate = solve_contact(
            solution.conditions,
            solution.lubricant,
            solution.surface,
            options=warm_options,
            start=solution,
            viscosity_factor=inlet_factor
            * warm_factor(solution, thermal, thermal.ambient + target),
            strict=False,
            progress=progress,
        )
        history += candidate.convergence.history
        seconds += candidate.convergence.seconds
        if candidate.convergence.converged:
            solution = replace(candidate, options=options)
            temperature_rise = target
            damping = min(1.0, 2.0 * damping)
        else:  # temperature step too large
            damping *= 0.5
    convergence = replace(solution.convergence, history=history, seconds=seconds)
    return replace(solution, convergence=convergence), temperature_converged
