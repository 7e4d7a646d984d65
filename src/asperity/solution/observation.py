"""Capacitance, electrical resistance and ultrasonic reflection of a solved contact.

Capacitance: ε₀ ∫ ε_r/h dA over all cells that do not touch (or also over those, if a film insulates
them) and over the bodies around the grid. ε_r follows the oil's density by Clausius and Mossotti;
oil that cavitates is streamers beside air.

Contact resistance: the current through touching cells spreads as the pressure of a rigid punch does
(J. R. Barber, Proc. R. Soc. A 459 (2003) 53), so R = (ρ₁ + ρ₂) E*/2k with the stiffness k of the
touching cells alone.

Ultrasonic reflection: springs between two half-spaces (H. G. Tattersall, J. Phys. D 6 (1973) 819).
Those of the film are its bulk modulus over its thickness, those of the asperities their stiffness
without that of the Hertz zone as a whole.
"""

import math
from dataclasses import dataclass, field

import numpy as np
import scipy
from numpy.typing import ArrayLike

from asperity.contact.conditions import ContactConditions
from asperity.core.arrays import Field, Mask, usual_float_errors
from asperity.core.errors import AsperityError
from asperity.ehl import ContactSolution, Scales, hertz_zone
from asperity.ehl.models.single_pressure import Problem
from asperity.ehl.outcome import CONSERVING
from asperity.lubricant import Thermal
from asperity.solution.sensing import Sensing
from asperity.solution.state import balance_of
from asperity.solution.stiffness import at_depth, roller_depth, stiffness_scale

VACUUM = 8.8541878128e-12  # permittivity ε₀ [F/m]
EXPANSION = 0.7  # loss of the oil's density per kelvin [kg/m³/K]
STIFFNESS_TOLERANCE = 1e-4  # relative residual of the equations of touching cells
MAX_STEPS = 2000
RAYS = 720  # around the grid
PLACES = 2000  # along x beside the grid of a line contact


@dataclass(frozen=True, slots=True, kw_only=True)
class Observables:
    """Observables of a contact.

    `capacitance` [F] is that of the whole contact, `zone_capacitance` that of the Hertz zone; both
    count cells that do not touch. `contact_resistance` [Ω] is None where no cells touch.
    `interface_stiffness` [N/m³] of the Hertz zone is the sum of `film_stiffness` and the
    asperities' part; `impedances` [kg/m²/s] are those of the bodies for longitudinal waves.
    """

    capacitance: float
    zone_capacitance: float
    contact_resistance: float | None
    film_stiffness: float
    interface_stiffness: float
    impedances: tuple[float, float]
    sensing: Sensing = field(repr=False)

    @property
    def ultrasonic_reflection(self) -> float:
        """Reflection coefficient at the frequency of `sensing`."""
        return float(self.reflection(self.sensing.ultrasonic_frequency_hz))

    def reflection(self, frequency_hz: ArrayLike) -> Field:
        """Return the amplitude of the reflected over that of the incident wave, 0 to 1."""
        first, second = self.impedances
        angular = 2.0 * math.pi * np.asarray(frequency_hz, dtype=float)
        spring = 1j * angular * first * second / self.interface_stiffness
        return np.abs((first - second + spring) / (first + second + spring))


@usual_float_errors
def observables(
    solution: ContactSolution,
    sensing: Sensing | None = None,
    *,
    thermal: Thermal | None = None,
    film_rise: Field | float = 0.0,
) -> Observables:
    """Compute capacitance, electrical resistance and ultrasonic reflection of a solved contact.

    Parameters
    ----------
    sensing : electrical and acoustic properties; default `Sensing()`
    thermal : has the density of the two bodies; default `Thermal()`
    film_rise : temperature of the film above ambient [K], a number or shape (nx, ny)

    Raises
    ------
    AsperityError
        if the equations of the touching cells do not converge.

    Examples
    --------
    >>> from asperity.case import case_template, load_case
    >>> from asperity.results import solve_case
    >>> from asperity.solution import observables
    >>> case = load_case(case_template("point")).with_overrides({"surface": "flat"})
    >>> seen = observables(solve_case(case).solution)
    >>> f"{1e12 * seen.capacitance:.0f} pF, reflection {seen.ultrasonic_reflection:.2f}"
    '16 pF, reflection 0.03'
    """
    sensing, conditions = sensing or Sensing(), solution.conditions
    touching = solution.in_contact & (solution.pressure > 0.0)
    zone, cell = hertz_zone(conditions, solution.grid), _cell_area(solution)
    filled = _filled_share(solution)
    insulation = np.inf if sensing.boundary_film is None else sensing.boundary_film
    gap = np.where(touching, insulation, solution.gap)
    plates = cell * _permittivity(solution, sensing, film_rise, filled) / gap
    stiffness = _touching_stiffness(solution, touching)
    film = _film_stiffness(solution, touching, zone, filled)
    asperities = _asperity_stiffness(solution, stiffness, zone, float(zone.sum()) * cell)
    return Observables(
        capacitance=VACUUM * (float(plates.sum()) + _around(solution, sensing)),
        zone_capacitance=VACUUM * float(plates[zone].sum()),
        contact_resistance=_resistance(conditions, sensing, stiffness, touching.sum() * cell),
        film_stiffness=film,
        interface_stiffness=film + asperities,
        impedances=_impedances(conditions, thermal or Thermal()),
        sensing=sensing,
    )


def _cell_area(solution: ContactSolution) -> float:
    """Return the area that a cell stands for [m²]; that of a line contact over its whole length."""
    dx, dy = solution.grid.spacing
    length, width = solution.conditions.length, solution.grid.cells[1] * dy
    return dx * dy * (length / width if solution.conditions.endless and length else 1.0)


def _filled_share(solution: ContactSolution) -> Field:
    """Return the share of every gap that oil fills, (nx, ny); 0 in a dry contact.

    Behind the film's end the oil keeps the thickness that it had there, if the model does not state
    its content.
    """
    if solution.lubricant is None:
        return np.zeros(solution.gap.shape)
    if solution.options.model == CONSERVING and solution.oil is not None:
        return np.minimum(solution.oil.content, 1.0)
    full = ~solution.cavitated
    places = np.arange(full.shape[0])[:, None]
    last = np.maximum.accumulate(np.where(full, places, -1), axis=0)
    film = np.take_along_axis(solution.gap, np.maximum(last, 0), axis=0)
    return np.where(full | (last < 0), 1.0, np.minimum(film / solution.gap, 1.0))


def _permittivity(
    solution: ContactSolution, sensing: Sensing, film_rise: Field | float, filled: Field
) -> Field:
    """Return the relative permittivity of every gap: oil beside air."""
    if solution.lubricant is None:
        return np.ones(solution.gap.shape)
    density = solution.lubricant.density
    compressed = (density(solution.pressure) - EXPANSION * film_rise) / density.rho0
    polarisation = (sensing.permittivity - 1.0) / (sensing.permittivity + 2.0) * compressed
    oil = (1.0 + 2.0 * polarisation) / (1.0 - polarisation)
    return np.asarray(1.0 + filled * (oil - 1.0))


def _around(solution: ContactSolution, sensing: Sensing) -> float:
    """Return ∫ ε_r/h dA [m] around the grid, oil on the inlet side and air on the outlet side.

    The gap is the parabola through the mean gap on the grid's edges.
    """
    oil = 1.0 if solution.lubricant is None else sensing.permittivity
    if solution.conditions.long:
        return _plates_along(solution, oil)
    grid = solution.grid
    rx = solution.conditions.radius_along_rolling
    ry = solution.conditions.radius_across_rolling
    shift = _shift_at_edges(
        solution.gap - grid.x[:, None] ** 2 / (2.0 * rx) - grid.y**2 / (2.0 * ry)
    )
    angle = 2.0 * np.pi * (np.arange(RAYS) + 0.5) / RAYS
    cosine, sine = np.cos(angle), np.sin(angle)
    inlet = cosine < 0.0
    edge = np.minimum(
        np.where(inlet, grid.x[0], grid.x[-1]) / cosine,
        np.where(sine < 0.0, grid.y[0], grid.y[-1]) / sine,
    )
    radius = 1.0 / (cosine**2 / rx + sine**2 / ry)
    inner = edge**2 / (2.0 * radius)
    outer = radius / math.e  # where the paraboloid's integral equals that of a hemisphere
    plates = radius * np.log((outer + shift) / (inner + shift))
    return float(np.mean(np.where(inlet, oil, 1.0) * plates) * 2.0 * np.pi)


def _shift_at_edges(offset: Field) -> float:
    """Return the mean over the edges of a field (nx, ny)."""
    return float(np.concatenate([offset[0], offset[-1], offset[:, 0], offset[:, -1]]).mean())


def _plates_along(solution: ContactSolution, oil: float) -> float:
    """Return ∫ ε_r/h dA [m] before and behind the grid of a line contact or a roller."""
    radius, length = solution.conditions.radius_along_rolling, solution.conditions.length
    assert length is not None
    total = 0.0
    for row, permittivity in ((0, oil), (-1, 1.0)):
        edge = abs(float(solution.grid.x[row]))
        shift = float(solution.gap[row].mean()) - edge**2 / (2.0 * radius)
        x = np.geomspace(edge, radius, PLACES)
        total += permittivity * float(np.trapezoid(1.0 / (x**2 / (2.0 * radius) + shift), x=x))
    return length * total


def _film_stiffness(solution: ContactSolution, touching: Mask, zone: Mask, filled: Field) -> float:
    """Return the mean bulk modulus over thickness of full films in the Hertz zone [N/m³]."""
    if solution.lubricant is None:
        return 0.0
    density, pressure = solution.lubricant.density, np.maximum(solution.pressure, 0.0)
    compressibility = density.slope(pressure) / density(pressure)
    if not np.all(compressibility > 0.0):
        return math.inf  # an incompressible oil
    held = touching | (filled < 1.0)
    springs = 1.0 / (compressibility * np.where(held, np.inf, solution.gap))
    return float(springs[zone].mean())


def _touching_stiffness(solution: ContactSolution, cells: Mask) -> float:
    """Return the stiffness of the bodies [N/m] if they were held together at some cells only."""
    if not cells.any():
        return 0.0
    problem: Problem = balance_of(solution, whole=False).problem
    cells = cells[:, : problem.cells[1]]
    pressure = np.zeros(problem.cells)

    def displacement(touching: Field) -> Field:
        pressure[cells] = touching
        return problem.deflection(pressure)[cells]

    count = int(cells.sum())
    linear = scipy.sparse.linalg
    held = linear.LinearOperator((count, count), matvec=displacement, dtype=float)
    found, failed = linear.minres(held, np.ones(count), rtol=STIFFNESS_TOLERANCE, maxiter=MAX_STEPS)
    if failed:
        raise AsperityError(
            f"the stiffness of the touching cells did not converge in {MAX_STEPS} steps; use fewer "
            "grid.cells"
        )
    conditions = solution.conditions
    scale = stiffness_scale(conditions, problem, Scales.from_conditions(conditions, None))
    depth = roller_depth(conditions) if conditions.endless else None
    return float(at_depth(conditions, scale * float(found.sum()), depth).real)


def _resistance(
    conditions: ContactConditions, sensing: Sensing, stiffness: float, area: float
) -> float | None:
    """Return the contact resistance [Ω] of touching cells; None if there are none."""
    if stiffness <= 0.0:
        return None
    spread = sum(sensing.resistivity) * conditions.pair.reduced_modulus / (2.0 * stiffness)
    return float(spread + sensing.film_resistivity / area)


def _asperity_stiffness(
    solution: ContactSolution, stiffness: float, zone: Mask, area: float
) -> float:
    """Return the stiffness of the asperities per area of the Hertz zone [N/m³].

    Their compliance is that of the touching cells less that of the zone as a whole; infinite where
    the bodies touch all over it.
    """
    if stiffness <= 0.0:
        return 0.0
    compliance = 1.0 / stiffness - 1.0 / _touching_stiffness(solution, zone)
    return 1.0 / (compliance * area) if compliance > 0.0 else math.inf


def _impedances(conditions: ContactConditions, thermal: Thermal) -> tuple[float, float]:
    """Return the impedances sqrt(ρ M) of longitudinal waves, with their modulus M [kg/m²/s]."""
    pair = conditions.pair
    first, second = (
        math.sqrt(solid.density * e * (1.0 - nu) / ((1.0 + nu) * (1.0 - 2.0 * nu)))
        for solid, e, nu in zip(
            thermal.solids, pair.youngs_moduli, pair.poisson_ratios, strict=True
        )
    )
    return first, second
