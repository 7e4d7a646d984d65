"""Capacitance, electrical resistance and ultrasonic reflection of a solved contact.

Capacitance: ε₀ ∫ ε_r/h dA over all cells that do not touch (or also over those, if a film insulates
them) and over the bodies around the grid. ε_r follows the oil's density by Clausius and Mossotti;
oil that cavitates is streamers beside air.

Contact resistance: the current through touching cells spreads as the pressure of a rigid punch does
(J. R. Barber, Proc. R. Soc. A 459 (2003) 53), so R = (ρ₁ + ρ₂) E*/2k with the stiffness k of the
touching cells alone.

Ultrasonic reflection: a spring between two half-spaces (H. G. Tattersall, J. Phys. D 6 (1973) 819).
Its compliance is the approach of the bodies beyond their own deflection under an even pressure on
the Hertz zone, where oil yields by h/B and touching cells do not.
"""

import math
from dataclasses import dataclass, field

import numpy as np
import scipy
from numpy.typing import ArrayLike

from asperity.contact.conditions import ContactConditions
from asperity.core.arrays import Field, Mask, usual_float_errors
from asperity.core.errors import AsperityError, BadInput
from asperity.ehl import ContactSolution, Scales, hertz_zone
from asperity.ehl.models.single_pressure import Problem
from asperity.ehl.outcome import CONSERVING
from asperity.lubricant import Thermal
from asperity.solution.sensing import Sensing
from asperity.solution.state import balance_of
from asperity.solution.stiffness import at_depth, roller_depth, stiffness_scale

VACUUM = 8.8541878128e-12  # permittivity ε₀ [F/m]
EXPANSION = 0.7  # loss of the oil's density per kelvin [kg/m³/K]
STIFFNESS_TOLERANCE = 1e-6  # relative residual of the equations of touching cells
MAX_STEPS = 2000
RAYS = 720  # around the grid
PLACES = 2000  # along x beside the grid of a line contact


@dataclass(frozen=True, slots=True, kw_only=True)
class Observables:
    """Observables of a contact.

    `capacitance` [F] is that of the whole contact, `zone_capacitance` that of the Hertz zone.
    `contact_resistance` [Ω] is None where no cells touch or a film insulates them.
    `interface_stiffness` of the Hertz zone [N/m³] is infinite if the bodies touch all over it, and
    None with incompressible oil. `impedances` [kg/m²/s] are those of the bodies for longitudinal
    waves.
    """

    capacitance: float
    zone_capacitance: float
    contact_resistance: float | None
    interface_stiffness: float | None
    impedances: tuple[float, float]
    sensing: Sensing = field(repr=False)

    @property
    def ultrasonic_reflection(self) -> float | None:
        """Reflection coefficient at the frequency of `sensing`; None with incompressible oil."""
        if self.interface_stiffness is None:
            return None
        return float(self.reflection(self.sensing.ultrasonic_frequency_hz))

    def reflection(self, frequency_hz: ArrayLike) -> Field:
        """Return the amplitude of the reflected over that of the incident wave, 0 to 1.

        Raises
        ------
        BadInput
            for incompressible oil.
        """
        stiffness = self.interface_stiffness
        if stiffness is None:
            raise BadInput(
                "incompressible oil has no ultrasonic reflection; use another density law"
            )
        angular = 2.0 * math.pi * np.asarray(frequency_hz, dtype=float)
        if stiffness == 0.0:
            return np.ones(angular.shape)
        first, second = (1.0 / impedance for impedance in self.impedances)
        spring = 1j * angular / stiffness
        return np.abs((second - first + spring) / (first + second + spring))


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
    '16 pF, reflection 0.05'
    """
    sensing, conditions = sensing or Sensing(), solution.conditions
    touching = solution.in_contact & (solution.pressure > 0.0)
    zone, cell = hertz_zone(conditions, solution.grid), _cell_area(solution)
    filled = _filled_share(solution)
    plates = (
        cell
        * _permittivity(solution, sensing, film_rise, filled)
        / _plate_gap(solution, sensing, touching)
    )
    conducting = touching & (sensing.boundary_film is None)
    return Observables(
        capacitance=VACUUM * (float(plates.sum()) + _around(solution, sensing)),
        zone_capacitance=VACUUM * float(plates[zone].sum()),
        contact_resistance=_resistance(solution, sensing, conducting, conducting.sum() * cell),
        interface_stiffness=_interface_stiffness(solution, zone, touching, filled),
        impedances=_impedances(conditions, thermal or Thermal()),
        sensing=sensing,
    )


def _plate_gap(solution: ContactSolution, sensing: Sensing, touching: Mask) -> Field:
    """Return the gap of every capacitor [m]; infinite where touching cells conduct.

    It is at least the boundary film, or the contact film: beside dry contact the gap tends to 0.
    """
    if sensing.boundary_film is not None:
        return np.maximum(solution.gap, sensing.boundary_film)
    return np.where(touching, np.inf, np.maximum(solution.gap, solution.options.contact_film))


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
        return np.where(solution.in_contact, sensing.permittivity, 1.0)
    density = solution.lubricant.density
    compressed = (density(solution.pressure) - EXPANSION * film_rise) / density.rho0
    polarisation = (sensing.permittivity - 1.0) / (sensing.permittivity + 2.0) * compressed
    oil = (1.0 + 2.0 * polarisation) / (1.0 - polarisation)
    return np.asarray(1.0 + filled * (oil - 1.0))


def _around(solution: ContactSolution, sensing: Sensing) -> float:
    """Return ∫ ε_r/h dA [m] around the grid, oil on the inlet side and air on the outlet side.

    Along every ray the gap is the parabola through the gap on the grid's edge, up to R/e, where its
    integral equals that of a hemisphere.
    """
    oil = 1.0 if solution.lubricant is None else sensing.permittivity
    if solution.conditions.long:
        return _plates_along(solution, oil)
    grid = solution.grid
    rx = solution.conditions.radius_along_rolling
    ry = solution.conditions.radius_across_rolling
    angle = 2.0 * np.pi * (np.arange(RAYS) + 0.5) / RAYS
    cosine, sine = np.cos(angle), np.sin(angle)
    inlet = cosine < 0.0
    edge = np.minimum(
        np.where(inlet, grid.x[0], grid.x[-1]) / cosine,
        np.where(sine < 0.0, grid.y[0], grid.y[-1]) / sine,
    )
    at_edge = _nearest(grid.x, edge * cosine), _nearest(grid.y, edge * sine)
    gap = np.maximum(solution.gap[at_edge], solution.options.contact_film)
    radius = 1.0 / (cosine**2 / rx + sine**2 / ry)
    beyond = np.maximum(radius / math.e - edge**2 / (2.0 * radius), 0.0)
    plates = radius * np.log1p(beyond / gap)
    return float(np.mean(np.where(inlet, oil, 1.0) * plates) * 2.0 * np.pi)


def _nearest(axis: Field, places: Field) -> np.ndarray:
    """Return the cells of an axis that are nearest to some places."""
    spacing = axis[1] - axis[0]
    numbers = np.rint((places - axis[0]) / spacing).astype(int)
    return np.asarray(np.clip(numbers, 0, axis.size - 1))


def _plates_along(solution: ContactSolution, oil: float) -> float:
    """Return ∫ ε_r/h dA [m] before and behind the grid of a line contact or a roller."""
    radius, length = solution.conditions.radius_along_rolling, solution.conditions.length
    assert length is not None
    total = 0.0
    for row, permittivity in ((0, oil), (-1, 1.0)):
        edge = abs(float(solution.grid.x[row]))
        gap = max(float(solution.gap[row].mean()), solution.options.contact_film)
        x = np.geomspace(edge, max(radius, edge), PLACES)
        plates = 1.0 / (gap + (x**2 - edge**2) / (2.0 * radius))
        total += permittivity * float(np.trapezoid(plates, x=x))
    return length * total


def _solved(problem: Problem, cells: Mask, springs: Field, displacement: Field) -> Field:
    """Return the dimensionless pressure on some cells that yields a displacement there.

    `springs` is their compliance beside that of the bodies.
    """
    pressure = np.zeros(problem.cells)

    def displaced(values: Field) -> Field:
        pressure[cells] = values
        return problem.deflection(pressure)[cells] + springs * values

    count, linear = int(cells.sum()), scipy.sparse.linalg
    found, failed = linear.minres(
        linear.LinearOperator((count, count), matvec=displaced, dtype=float),
        displacement,
        rtol=STIFFNESS_TOLERANCE,
        maxiter=MAX_STEPS,
    )
    if failed:
        raise AsperityError(
            f"the stiffness of the interface did not converge in {MAX_STEPS} steps; use fewer "
            "grid.cells"
        )
    return np.asarray(found)


def _resistance(
    solution: ContactSolution, sensing: Sensing, cells: Mask, area: float
) -> float | None:
    """Return the contact resistance [Ω] of conducting cells; None if there are none."""
    if not cells.any():
        return None
    conditions = solution.conditions
    problem: Problem = balance_of(solution, whole=False).problem
    cells = cells[:, : problem.cells[1]]
    held = _solved(problem, cells, np.zeros(1), np.ones(int(cells.sum())))
    scale = stiffness_scale(conditions, problem, Scales.from_conditions(conditions, None))
    depth = roller_depth(conditions) if conditions.endless else None
    stiffness = at_depth(conditions, scale * float(held.sum()), depth).real
    spread = sum(sensing.resistivity) * conditions.pair.reduced_modulus / (2.0 * stiffness)
    return float(spread + sensing.film_resistivity / area)


def _interface_stiffness(
    solution: ContactSolution, zone: Mask, touching: Mask, filled: Field
) -> float | None:
    """Return the stiffness per area of the Hertz zone under an even pressure [N/m³].

    Cells without contact and without a full film carry nothing. With the bodies' deflection D and
    the compliance S of the oil, (D + S) p = D 1 + δ, where p has the sum of the even pressure 1.
    """
    full = ~touching & (filled >= 1.0)
    springs = _oil_springs(solution, full)
    if np.any(springs[full] <= 0.0):
        return None
    problem: Problem = balance_of(solution, whole=False).problem
    lines = problem.cells[1]
    zone, carrying = zone[:, :lines], (zone & (touching | full))[:, :lines]
    if not carrying.any():
        return 0.0
    springs = springs[:, :lines][carrying]
    even = problem.deflection(zone.astype(float))[carrying]
    following = _solved(problem, carrying, springs, even).sum()
    per_approach = _solved(problem, carrying, springs, np.ones(even.size)).sum()
    approach = (float(zone.sum()) - following) / per_approach
    # bodies that touch all over the zone approach by the error of the equations only
    if approach <= 10.0 * STIFFNESS_TOLERANCE * float(np.abs(even).max()):
        return math.inf
    scales = Scales.from_conditions(solution.conditions, solution.lubricant)
    return float(scales.pressure / (scales.gap * approach))


def _oil_springs(solution: ContactSolution, full: Mask) -> Field:
    """Return the dimensionless compliance h/B of full films, (nx, ny); 0 elsewhere."""
    if solution.lubricant is None:
        return np.zeros(full.shape)
    density, pressure = solution.lubricant.density, np.maximum(solution.pressure, 0.0)
    scales = Scales.from_conditions(solution.conditions, solution.lubricant)
    compliance = solution.gap * density.slope(pressure) / density(pressure)
    return np.where(full, compliance * scales.pressure / scales.gap, 0.0)


def _impedances(conditions: ContactConditions, thermal: Thermal) -> tuple[float, float]:
    """Return the impedances sqrt(ρ M) of longitudinal waves, with their modulus M [kg/m²/s]."""
    pair = conditions.pair
    first, second = (
        math.sqrt(solid.density * e * (1.0 - nu) / ((1.0 + nu) * (1.0 - 2.0 * nu)))
        if nu < 0.5
        else math.inf
        for solid, e, nu in zip(
            thermal.solids, pair.youngs_moduli, pair.poisson_ratios, strict=True
        )
    )
    return first, second
