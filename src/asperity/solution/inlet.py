"""Inlet shear heating: temperature of the oil before the Hertz zone, and its viscosity there.

Oil that is drawn into the contact is sheared by the backward flow under its pressure and by
sliding, and warmed by compression. Per area of film, with the pressure-driven flow
Q = -h³/(12 η) grad p, the shear stress τ of sliding and the expansivity ε,

    q = -Q · grad p + τ Δu + ε T (u h + Q) · grad p.

The mean temperature over the film's thickness, T_w + θ, obeys

    div(ρ c E θ) + G θ = q - ρ c (u h + Q) · grad T_w,

with the mean temperature T_w of both surfaces. The profile of θ across the film is a parabola for
sliding and compression, heated evenly, and of fourth degree for flow, which heats next to the
surfaces: they conduct G = 12 k/h and 20 k/h, and carry E = u h + 1.2 Q and u h + 8/7 Q. Surfaces
warm by the flow of heat G θ, as in `flash`. Flow under pressure depends on the fluidity near the
surfaces: the viscosity for Reynolds' equation is 1/(24 int_0^½ ζ²/η dζ), ζ = z/h. Bulk temperatures
and the heat of sliding belong to `thermal` where feedback is on.

The inlet of the smooth bodies is solved, on a coarser grid: roughness hardly changes a film that is
several times thicker. Sources of the theory: J. A. Greenwood, J. J. Kauzlarich, J. Lubr. Technol.
95 (1973) 411; P. F. Murch, W. R. D. Wilson, J. Lubr. Technol. 97 (1975) 212.
"""

import math
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
import scipy
from threadpoolctl import threadpool_limits

from asperity.contact.conditions import ContactConditions
from asperity.contact.grid import MIN_CELLS, Grid
from asperity.core.arrays import Field, Mask, usual_float_errors
from asperity.core.errors import AsperityError, NotConverged
from asperity.ehl import (
    ContactSolution,
    Options,
    hertz_zone,
    inlet_heating_factor,
    inlet_length,
    solve_contact,
)
from asperity.ehl.far_pressure import build_up_lengths
from asperity.ehl.grid_design import MIN_CELLS_IN_INLET
from asperity.ehl.load_shares import CENTRE
from asperity.lubricant import EXPANSION, Lubricant, Thermal
from asperity.solution.film_transport import FilmTransport
from asperity.solution.fixed_point import Mixer
from asperity.solution.flash import HeatedBodies, cell_area
from asperity.solution.traction import friction
from asperity.surface import flat_surface

MATTERS = 0.9  # published factor below which inlet shear heating is computed by default
NEGLIGIBLE = 0.998  # above it the film changes by less than 0.1 %
HEAT_CAPACITY = 2000.0  # of mineral oils at 40 °C [J/kg/K]; 10 % of it move a film by 0.05 %
CONVERGED = 1e-5  # of the film: pressures are small where the oil warms
AHEAD, BEHIND, BESIDE = 12.0, 2.5, 6.0  # most extent of the grid, in lengths of the loaded zone
# cells of the grid, where the contact's own has as many; they move the film by 0.3 %
LEAST_CELLS, MOST_CELLS, CELLS_A_LENGTH = 48, 96, 6.0
TOLERANCE = 5e-3  # change of the logarithm of viscosity
MAX_SOLVES, MOST_CHANGE = 30, 1.0  # in number, and of the same in each
WALL_TOLERANCE = 1e-4  # change of the surfaces' temperature over the largest rise
MAX_WALL_ROUNDS = 30
EDGE_FACES = 2  # next to which the pressure adapts to that beyond the grid
_ROOTS, _SHARES = np.polynomial.legendre.leggauss(5)
_NODES, _WEIGHTS = 0.25 * (_ROOTS + 1.0), 0.25 * _SHARES  # across half of the film


@dataclass(frozen=True, kw_only=True)
class InletHeating:
    """Inlet shear heating of a contact of smooth bodies, on a coarse grid.

    `rise` is the mean rise of the film's temperature [K], `viscosity_factor` the viscosity for
    Reynolds' equation over that without heat; both (nx, ny) on `grid`. `film_factor`
    is the central film over the isothermal one. `max_k` is the largest rise [K]; `generated_w` the
    heat generated [W], `walls_w` its part that flows into the bodies, and `carried_w` that which
    the oil carries away; of a line contact over its length.
    """

    grid: Grid
    rise: Field
    viscosity_factor: Field
    film_factor: float
    max_k: float
    generated_w: float
    walls_w: float
    carried_w: float

    def factor_on(self, grid: Grid) -> Field:
        """Return the viscosity factor on another grid of the same contact, (nx, ny)."""
        positions = (
            (centres - low) / step - 0.5
            for centres, low, step in zip(
                (grid.x, grid.y), self.grid.lower, self.grid.spacing, strict=True
            )
        )
        where = np.meshgrid(*positions, indexing="ij")
        logs = np.log(self.viscosity_factor)
        return np.asarray(
            np.exp(scipy.ndimage.map_coordinates(logs, where, order=1, mode="nearest"))
        )


def heats_inlet(
    conditions: ContactConditions, lubricant: Lubricant | None, thermal: Thermal
) -> bool:
    """Return True if inlet shear heating is computed: as stated, or else where it matters.

    It matters where the published factor on the film is below `MATTERS`; it is never computed where
    that is above `NEGLIGIBLE`.
    """
    if lubricant is None or thermal.inlet_heating is False:
        return False
    fit = inlet_heating_factor(conditions, lubricant, thermal)
    return fit < (MATTERS if thermal.inlet_heating is None else NEGLIGIBLE)


def inlet_viscosity_factor(
    conditions: ContactConditions, lubricant: Lubricant | None, grid: Grid, thermal: Thermal
) -> Field | None:
    """Return local over isothermal viscosity, (nx, ny), None if the inlet is not heated.

    Raises as `inlet_heating`.
    """
    if lubricant is None or not heats_inlet(conditions, lubricant, thermal):
        return None
    return inlet_heating(conditions, lubricant, grid, thermal).factor_on(grid)


def solved_inlet(solution: ContactSolution, thermal: Thermal) -> InletHeating | None:
    """Return the inlet shear heating that a solution includes, None if it has none.

    Raises as `inlet_heating`.
    """
    conditions, lubricant = solution.conditions, solution.lubricant
    if lubricant is None or solution.viscosity_factor is None:
        return None
    if not heats_inlet(conditions, lubricant, thermal):
        return None
    return inlet_heating(conditions, lubricant, solution.grid, thermal)


@lru_cache(maxsize=8)
@usual_float_errors
def inlet_heating(
    conditions: ContactConditions, lubricant: Lubricant, grid: Grid, thermal: Thermal
) -> InletHeating:
    """Solve the film of the smooth bodies with inlet shear heating.

    Parameters
    ----------
    grid : grid of the contact; it is coarsened

    Raises
    ------
    AsperityError
        if the contact of the smooth bodies, or heat and film together, do not converge.
    """
    with threadpool_limits(1):  # sums depend on the number of threads
        try:
            return _solved(conditions, lubricant, grid, thermal)
        except NotConverged as failure:  # its solution is not that of the contact asked for
            raise AsperityError(
                f"inlet shear heating: smooth bodies, {failure}; set thermal.inlet_heating=false "
                "to compute the film without it"
            ) from None


def _solved(
    conditions: ContactConditions, lubricant: Lubricant, grid: Grid, thermal: Thermal
) -> InletHeating:
    """Solve film and heat in turn."""
    surface, options = (
        flat_surface(_coarser(grid, conditions, lubricant)),
        Options(tolerance=CONVERGED),
    )
    mixer = Mixer()
    log_factor: Field = np.zeros(surface.grid.cells)
    eta0: Field = np.full(surface.grid.cells, lubricant.viscosity.eta0)
    temperature = np.full_like(eta0, _base_temperature(thermal))
    base = thermal.warmth.factor(eta0, temperature, thermal.ambient)
    cold = solution = solve_contact(
        conditions, lubricant, surface, options=options, viscosity_factor=base
    )
    for _ in range(MAX_SOLVES):
        heat = _Inlet(solution, thermal).heat()
        change = np.clip(np.log(heat.viscosity_factor) - log_factor, -MOST_CHANGE, MOST_CHANGE)
        if np.max(np.abs(change)) < TOLERANCE:
            return replace(heat, film_factor=_central(solution) / _central(cold))
        log_factor = mixer(log_factor, change)
        solution = solve_contact(
            conditions,
            lubricant,
            surface,
            options=options,
            start=solution,
            viscosity_factor=base * np.exp(log_factor),
        )
    raise AsperityError(
        "inlet shear heating did not converge; set thermal.inlet_heating=false to compute the film "
        "without it"
    )


def _base_temperature(thermal: Thermal) -> float:
    """Return the temperature that the inlet heats up from [K].

    With feedback, that of the bodies is part of the film's temperature.
    """
    return thermal.ambient + (sum(thermal.bulk_rise) / 2.0 if thermal.feedback else 0.0)


def _log_mean(first: Field, second: Field) -> Field:
    """Return the logarithmic mean of positive numbers."""
    ratio = np.log(first / second)
    close = np.abs(ratio) < 1e-3
    return np.where(close, 0.5 * (first + second), (first - second) / np.where(close, 1.0, ratio))


def _coarser(grid: Grid, conditions: ContactConditions, lubricant: Lubricant) -> Grid:
    """Return a grid with half as many cells, within limits, around the inlet."""
    halves, light = conditions.hertz.half_widths, build_up_lengths(conditions, lubricant)
    length, width = max(halves[0], light[0]), grid.extent[1]
    if not conditions.long:
        width = max(halves[1], light[1])
    resolved = min(
        length / CELLS_A_LENGTH, inlet_length(conditions, lubricant) / MIN_CELLS_IN_INLET
    )
    nx, west, east = _axis(grid, 0, (-AHEAD * length, BEHIND * length), resolved)
    ny, south, north = _axis(grid, 1, (-BESIDE * width, BESIDE * width), width / CELLS_A_LENGTH)
    ny = MIN_CELLS if conditions.endless else ny
    return replace(grid, cells=(nx, ny), lower=(west, south), upper=(east, north))


def _axis(
    grid: Grid, axis: int, ends: tuple[float, float], resolved: float
) -> tuple[int, float, float]:
    """Return cells and ends of the coarse grid along an axis, with cells of at most `resolved`."""
    low, high = max(grid.lower[axis], ends[0]), min(grid.upper[axis], ends[1])
    own = math.ceil((high - low) / grid.spacing[axis])
    least = max(LEAST_CELLS, math.ceil((high - low) / resolved))
    return min(own, max(least, min(own // 2, MOST_CELLS))), low, high


def _central(solution: ContactSolution) -> float:
    return float(solution.gap[hertz_zone(solution.conditions, solution.grid, CENTRE)].mean())


class _Inlet:
    """Heat of the film before the Hertz zone, of a solved contact."""

    def __init__(self, solution: ContactSolution, thermal: Thermal) -> None:
        lubricant, grid, conditions = solution.lubricant, solution.grid, solution.conditions
        assert lubricant is not None
        self.solution, self.thermal, self.grid = solution, thermal, grid
        self.speed = conditions.entrainment_speed
        self.cold = lubricant.viscosity(solution.pressure)
        viscosity = self.cold
        if solution.viscosity_factor is not None:
            viscosity = viscosity * solution.viscosity_factor
        stress = viscosity * conditions.sliding_speed / solution.gap
        mobility = solution.gap**3 / (12.0 * viscosity * lubricant.rheology.thinning(stress)[0])
        self.density = lubricant.density(solution.pressure)
        self.capacity = self._on_faces(HEAT_CAPACITY * self.density)
        self.carried = self._on_faces(self.speed * solution.gap)  # by the surfaces
        slopes = self._slopes(solution.pressure if solution.oil is None else solution.oil.pressure)
        self.flow = self._flow(mobility, slopes)
        self.heat_input, self.backward_share = self._heat_input(slopes)

    def _heat_input(self, slopes: tuple[Field, Field]) -> tuple[Field, Field]:
        """Return the heat per area [W/m^2], and the share of backward flow in it.

        Heat behind the centre does not matter to the film.
        """
        solution, thermal = self.solution, self.thermal
        along, across = (-flow * slope for flow, slope in zip(self.flow, slopes, strict=True))
        ahead = self.grid.x[:, None] < 0.0
        backward = 0.5 * (along[1:] + along[:-1] + across[:, 1:] + across[:, :-1]) * ahead
        before = self._before_zone()
        sliding: Field = np.zeros(self.grid.cells)
        if not thermal.feedback:  # otherwise in the temperature of the film
            stress = np.abs(friction(solution, thermal=thermal).shear)
            sliding = stress * solution.conditions.sliding_speed * before
        carried = self.speed * solution.gap * 0.5 * (slopes[0][1:] + slopes[0][:-1])
        compression = thermal.ambient * EXPANSION / self.density * (carried - backward) * before
        total = backward + sliding + np.abs(compression)
        share = np.divide(backward, total, out=np.ones_like(total), where=total > 0.0)
        return backward + sliding + compression, share

    def _on_faces(self, cells: Field) -> tuple[Field, Field]:
        """Return the means on faces along x, (nx + 1, ny), and along y, (nx, ny + 1)."""
        along = np.pad(cells, ((1, 1), (0, 0)), mode="edge")
        mode = "wrap" if self.grid.periodic[1] else "edge"
        across = np.pad(cells, ((0, 0), (1, 1)), mode=mode)  # type: ignore[call-overload]
        return 0.5 * (along[1:] + along[:-1]), 0.5 * (across[:, 1:] + across[:, :-1])

    def _slopes(self, pressure: Field) -> tuple[Field, Field]:
        """Return the pressure gradient on faces [Pa/m]; 0 on the outer ones."""
        dx, dy = self.grid.spacing
        mode = "wrap" if self.grid.periodic[1] else "edge"
        along = np.pad(pressure, ((1, 1), (0, 0)), mode="edge")
        across = np.pad(pressure, ((0, 0), (1, 1)), mode=mode)  # type: ignore[call-overload]
        return np.diff(along, axis=0) / dx, np.diff(across, axis=1) / dy

    def _flow(self, mobility: Field, slopes: tuple[Field, Field]) -> tuple[Field, Field]:
        """Return the flow Q on faces as the solver has it, at most that of the surfaces.

        Through the outer faces it is as large, relative to that, as through the next ones inside.
        """
        mode = "wrap" if self.grid.periodic[1] else "edge"
        along = np.pad(mobility, ((1, 1), (0, 0)), mode="edge")
        across = np.pad(mobility, ((0, 0), (1, 1)), mode=mode)  # type: ignore[call-overload]
        flows = (
            -_log_mean(along[1:], along[:-1]) * slopes[0],
            -_log_mean(across[:, 1:], across[:, :-1]) * slopes[1],
        )
        shares = [
            np.clip(flow / carried, -1.0, 1.0)
            for flow, carried in zip(flows, self.carried, strict=True)
        ]
        shares[0][:EDGE_FACES] = shares[0][EDGE_FACES]
        if not self.grid.periodic[1]:
            shares[1][:, 0], shares[1][:, -1] = shares[1][:, 1], shares[1][:, -2]
        return shares[0] * self.carried[0], shares[1] * self.carried[1]

    def _before_zone(self) -> Mask:
        """Return the cells before the Hertz zone."""
        conditions = self.solution.conditions
        a, b = conditions.hertz.half_widths
        x, y = self.grid.x[:, None], self.grid.y[None, :]
        beyond = (x / a) ** 2 + (0.0 if conditions.long else (y / b) ** 2) > 1.0
        return np.broadcast_to((x < 0.0) & beyond, self.grid.cells)

    def heat(self) -> InletHeating:
        """Return temperatures and heat flows; `film_factor` remains 1."""
        share = self.backward_share
        conduction = self.thermal.oil_conductivity / self.solution.gap
        conduction /= share / 20.0 + (1.0 - share) / 12.0
        film, mean = self._transport(share * 8.0 / 7.0 + (1.0 - share) * 1.2), self._transport(1.0)
        bodies = HeatedBodies(self.solution, self.thermal)
        solve = film.solver(conduction)
        wall: Field = np.zeros(self.grid.cells)
        for _ in range(MAX_WALL_ROUNDS):
            excess = solve(self.heat_input - mean.apply(wall))
            change = bodies(conduction * excess).mean_rise - wall
            wall = wall + change
            if np.max(np.abs(change)) <= WALL_TOLERANCE * np.max(np.abs(excess + wall)):
                break
        else:
            raise AsperityError(
                "the temperature of the surfaces in the inlet did not converge; set "
                "thermal.inlet_heating=false"
            )
        rise, area = wall + excess, cell_area(self.solution)
        length = area / math.prod(self.grid.spacing)  # of a line contact over that of its grid
        return InletHeating(
            grid=self.grid,
            rise=rise,
            viscosity_factor=self._factor(wall, excess),
            film_factor=1.0,
            max_k=float(rise.max()),
            generated_w=float(self.heat_input.sum() * area),
            walls_w=float((conduction * excess).sum() * area),
            carried_w=(film.leaving(excess) + mean.leaving(wall)) * length,
        )

    def _transport(self, spread: Field | float) -> FilmTransport:
        """Return the transport by the surfaces and `spread` times the pressure-driven flow."""
        shares = self._on_faces(np.broadcast_to(spread, self.grid.cells))
        along, across = (
            capacity * share * flow
            for capacity, share, flow in zip(self.capacity, shares, self.flow, strict=True)
        )
        return FilmTransport(self.grid, along + self.capacity[0] * self.carried[0], across)

    def _factor(self, wall: Field, excess: Field) -> Field:
        """Return the viscosity for flow under pressure over that without heat."""
        thermal, share = self.thermal, self.backward_share
        base: Field = np.full(self.grid.cells, _base_temperature(thermal))
        cold = thermal.warmth.factor(self.cold, base, thermal.ambient)
        fluidity: Field = np.zeros(self.grid.cells)
        for node, weight in zip(_NODES, _WEIGHTS, strict=True):
            profile = share * 1.25 * (1.0 - 16.0 * node**4) + (1.0 - share) * 1.5 * (
                1.0 - 4.0 * node**2
            )
            here = base + wall + profile * excess
            factor = thermal.warmth.factor(self.cold, here, thermal.ambient)
            fluidity += 24.0 * weight * node**2 / factor
        return 1.0 / (cold * fluidity)
