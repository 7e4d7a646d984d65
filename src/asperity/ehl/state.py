"""What a tribologist reads off a solved contact: load and area shares, film, and how well the equations are met."""

from dataclasses import dataclass

import numpy as np

from asperity.conditions import ContactConditions
from asperity.ehl.conserving import OilBalance, evaluate
from asperity.ehl.conserving_solve import unknowns_of
from asperity.ehl.posing import contact_problem, smooth_film
from asperity.ehl.problem import Balance
from asperity.ehl.scales import Scales
from asperity.ehl.shares import CENTRE, area_share, carried_share
from asperity.ehl.solution import ContactSolution
from asperity.grid import Grid
from asperity.kernels.reynolds import CAPPED, LUBRICATED


@dataclass(frozen=True, slots=True, kw_only=True)
class ContactState:
    """Scalars of a solved contact, SI.

    The Hertz zone is |x| <= a for a line contact, the ellipse of half-widths a, b for others. `car` contact cells in it
    over all cells there; `car_domain` contact area of the whole domain over the Hertz area; `clr` load on contact cells
    over the load; `capped_oil_load_ratio` load on cells that stand at the pressure cap without touching, over the load:
    oil that the model holds at the hardness, which a coarser contact threshold would count as contact; `sq` composite
    roughness [m]; films [m]: `h_min` smallest gap of the domain (the contact film where bodies touch), `h_central` mean
    over a tenth of the Hertz zone's half-widths, `h_mean` mean over the zone; `lambda_ratio` the usual fit of the
    smooth contact's least film over Sq (`smooth_film`; None for a smooth surface or a dry contact); `p_max` [Pa];
    `reynolds_residual` root mean square of what is left of every cell's equation, as a share of p_h; `load_error`
    relative; `mass_flux_imbalance` oil that vanishes or appears in those cells of the Hertz zone where Reynolds'
    equation does not hold, in sum, over the oil that the surfaces carry through the zone, u times mean film (0 when
    dry). The cavity behind the contact is left out: the model refills it, which changes nothing upstream;
    `contact_slope` mean slope of the undeformed roughness over touching cells (None where none touch).
    """

    car: float
    car_domain: float
    clr: float
    capped_oil_load_ratio: float
    sq: float
    h_min: float
    h_central: float
    h_mean: float
    lambda_ratio: float | None
    p_max: float
    reynolds_residual: float
    load_error: float
    mass_flux_imbalance: float
    contact_slope: float | None = None


def contact_state(solution: ContactSolution) -> ContactState:
    """Read the scalars off a solution; the residuals are evaluated anew from its fields."""
    scales = Scales.of(solution.conditions, solution.lubricant)
    problem = contact_problem(
        solution.conditions,
        solution.lubricant,
        solution.surface,
        solution.options,
        solution.viscosity_factor,
        attempt=solution.convergence.attempt,
    )
    if solution.oil is not None:
        return state_of(solution, evaluate(problem, unknowns_of(solution, problem, scales)))
    return state_of(
        solution, problem.evaluate(solution.pressure / scales.pressure, solution.rigid_approach / scales.gap)
    )


def state_of(solution: ContactSolution, balance: Balance | OilBalance) -> ContactState:
    """The scalars of a solution whose equations, those of a moving contact perhaps, are left with `balance`."""
    grid, touching, problem = solution.grid, solution.in_contact, balance.problem
    sq, oil = solution.surface.sq, solution.lubricant
    zone, centre = problem.zone(), problem.zone(CENTRE)
    dx, dy = problem.spacing
    width = grid.cells[1] * dy if problem.form.periodic else 2.0 * problem.form.aspect
    if isinstance(balance, OilBalance):
        capped = balance.unknowns.pressure >= problem.p_cap
        unbalanced, carried = np.abs(balance.outflow[zone]).sum(), balance.flow.content[zone].mean()
    else:
        capped = balance.rows.state == CAPPED
        unbalanced = np.abs(balance.outflow[zone & (balance.rows.state != LUBRICATED)]).sum()
        carried = balance.film.content[zone].mean() if balance.film else np.inf
    return ContactState(
        car=area_share(touching, zone),
        car_domain=float(touching.mean() * _hertz_areas(solution.conditions, grid)),
        clr=carried_share(solution.pressure, touching),
        capped_oil_load_ratio=carried_share(solution.pressure, capped & ~touching),
        sq=sq,
        h_min=float(solution.gap.min()),
        h_central=float(solution.gap[centre].mean()),
        h_mean=float(solution.gap[zone].mean()),
        lambda_ratio=smooth_film(solution.conditions, oil) / sq if oil and sq > 0.0 else None,
        p_max=float(solution.pressure.max()),
        reynolds_residual=balance.residual_rms,
        load_error=balance.load_error,
        mass_flux_imbalance=float(unbalanced * dx * dy / (carried * width)),
        contact_slope=_contact_slope(solution),
    )


def _contact_slope(solution: ContactSolution) -> float | None:
    """Central differences; y goes round."""
    heights, (dx, dy) = solution.surface.heights, solution.grid.spacing
    across = (np.roll(heights, -1, axis=1) - np.roll(heights, 1, axis=1)) / (2.0 * dy)
    slope = np.hypot(np.gradient(heights, dx, axis=0), across)
    return float(slope[solution.in_contact].mean()) if solution.in_contact.any() else None


def _hertz_areas(conditions: ContactConditions, grid: Grid) -> float:
    """Area of the grid in Hertz contact areas."""
    if conditions.geometry == "line":
        return grid.extent[0] / (2.0 * conditions.hertz.half_widths[0])
    return grid.extent[0] * grid.extent[1] / conditions.hertz.area
