"""Scalars of a solved contact: load and area shares, film thickness, pressure and residuals."""

import numpy as np

from asperity.contact.conditions import ContactConditions
from asperity.contact.grid import Grid
from asperity.core.arrays import Field, Mask, usual_float_errors
from asperity.ehl import ContactError, ContactSolution, ContactState, Scales, Uncertainty
from asperity.ehl.load_shares import CENTRE, area_share, carried_share
from asperity.ehl.models.mixed import MixedBalance, evaluate
from asperity.ehl.models.single_pressure import Balance
from asperity.ehl.outcome import TWO_PRESSURES
from asperity.ehl.problem_setup import contact_problem, on_one_line
from asperity.ehl.strategies.oil_state import pressures_of
from asperity.kernels.reynolds import LUBRICATED
from asperity.solution.regime import film_ratio, rms_slope


@usual_float_errors
def contact_state(solution: ContactSolution) -> ContactState:
    """Return the scalars of a solution; residuals are re-evaluated from its fields."""
    return state_of(solution, balance_of(solution))


def balance_of(solution: ContactSolution, *, whole: bool = True) -> Balance | MixedBalance:
    """Re-evaluate the equations of a solution from its fields, on its own grid.

    With `whole=False`, a contact that is uniform along y is evaluated on one line of cells.
    """
    scales = Scales.from_conditions(solution.conditions, solution.lubricant)
    problem = contact_problem(
        solution.conditions,
        solution.lubricant,
        solution.surface,
        solution.options,
        solution.viscosity_factor,
        strategy=solution.convergence.attempt,
    )
    if not whole and problem.uniform:
        problem = on_one_line(problem)
    if solution.options.model in TWO_PRESSURES and solution.lubricant is not None:
        return evaluate(problem, pressures_of(solution, problem, scales), second_order=True)
    pressure = solution.pressure[:, : problem.cells[1]] / scales.pressure
    return problem.evaluate(pressure, solution.rigid_approach / scales.gap)


def plastic_overlap(solution: ContactSolution) -> Field:
    """Return the overlap [m], (nx, ny), that the pressure cap has permitted.

    This much of the heights stays flattened when the bodies separate.
    """
    balance = balance_of(solution)
    # the gap of the solution itself is limited by the contact film
    depth = np.maximum(balance.problem.contact_gap - balance.gap, 0.0)
    depth = (
        depth
        * (balance.pressure >= balance.problem.p_cap)
        * Scales.from_conditions(solution.conditions, solution.lubricant).gap
    )
    return np.broadcast_to(depth, solution.grid.cells)


def state_of(solution: ContactSolution, balance: Balance | MixedBalance) -> ContactState:
    """Return the scalars of a solution from its evaluated equations (also of a moving contact)."""
    grid = solution.grid
    in_contact = solution.in_contact
    problem = balance.problem
    zone = problem.zone()
    centre = problem.zone(CENTRE)
    dx, dy = problem.spacing
    width = grid.cells[1] * dy if problem.form.periodic else 2.0 * problem.form.aspect
    unbalanced, carried_oil = _unbalanced_oil(balance, zone)
    return ContactState(
        car=area_share(in_contact, zone),
        car_domain=float(in_contact.mean() * _hertz_areas(solution.conditions, grid)),
        clr=carried_share(solution.pressure, in_contact),
        capped_oil_load_ratio=carried_share(solution.pressure, balance.yielded & ~in_contact),
        sq=solution.surface.sq,
        h_min=float(solution.gap.min()),
        h_central=float(solution.gap[centre].mean()),
        h_mean=float(solution.gap[zone].mean()),
        lambda_ratio=film_ratio(solution),
        p_max=float(solution.pressure.max()),
        reynolds_residual=balance.residual_rms,
        load_error=balance.load_error,
        mass_flux_imbalance=float(unbalanced * dx * dy / (carried_oil * width)),
        contact_slope=_contact_slope(solution),
        rms_slope=rms_slope(solution),
        error=_error(solution),
    )


def _unbalanced_oil(balance: Balance | MixedBalance, zone: Mask) -> tuple[float, float]:
    """Return the oil lost and gained by cells, and the mean oil content of a zone."""
    if isinstance(balance, MixedBalance):
        # residuals of all cells count: at low speed they equal the refilled oil
        return np.abs(balance.outflow[zone]).sum(), balance.content[zone].mean()
    counted = balance.rows.state != LUBRICATED
    content = balance.film.content[zone].mean() if balance.film else np.inf
    return np.abs(balance.outflow[zone & counted]).sum(), content


def _error(solution: ContactSolution) -> ContactError:
    """Return the errors known from the solution alone (iteration and grid), and the assumptions."""
    convergence = solution.convergence
    options = solution.options
    step = convergence.iteration_error
    cells = convergence.discretisation_error
    iteration = None if step is None else (step.clr, step.clr)
    grid = None if cells is None else cells.sides("clr")
    clr = carried_share(solution.pressure, solution.in_contact)
    cap = solution.p_cap
    inlet = -solution.grid.lower[0] / solution.conditions.hertz.half_widths[0]
    return ContactError(
        clr=Uncertainty(value=clr, iteration=iteration, grid=grid, range=(0.0, 1.0)),
        choices=(
            f"model {options.model}",
            "no pressure cap" if cap is None else f"pressure cap {cap / 1e9:.3g} GPa",
            *(
                []
                if solution.lubricant is None
                else [f"contact threshold {options.contact_film * 1e9:.3g} nm"]
            ),
            f"inlet length {inlet:.3g} half-widths",
        ),
    )


def _contact_slope(solution: ContactSolution) -> float | None:
    """Return the mean slope of the touching cells by central differences; y is periodic."""
    heights = solution.surface.heights
    (dx, dy) = solution.grid.spacing
    across = (np.roll(heights, -1, axis=1) - np.roll(heights, 1, axis=1)) / (2.0 * dy)
    slope = np.hypot(np.gradient(heights, dx, axis=0), across)
    return float(slope[solution.in_contact].mean()) if solution.in_contact.any() else None


def _hertz_areas(conditions: ContactConditions, grid: Grid) -> float:
    """Return the area of the grid in Hertz contact areas."""
    if conditions.endless:
        return grid.extent[0] / (2.0 * conditions.hertz.half_widths[0])
    return grid.extent[0] * grid.extent[1] / conditions.hertz.area
