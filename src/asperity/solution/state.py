"""What a tribologist reads off a solved contact: load and area shares, film, and how well the equations are met."""

import numpy as np

from asperity.contact.conditions import ContactConditions
from asperity.contact.grid import Grid
from asperity.core.arrays import Field
from asperity.ehl import (
    ContactError,
    ContactSolution,
    ContactState,
    Scales,
    Uncertainty,
    least_film,
)
from asperity.ehl.load_shares import CENTRE, area_share, carried_share
from asperity.ehl.models.mixed import MixedBalance, evaluate
from asperity.ehl.models.single_pressure import Balance
from asperity.ehl.outcome import TWO_PRESSURES
from asperity.ehl.problem_setup import contact_problem, on_one_line
from asperity.ehl.strategies.oil_state import pressures_of
from asperity.kernels.reynolds import CAPPED, LUBRICATED


def contact_state(solution: ContactSolution) -> ContactState:
    """Read the scalars off a solution; the residuals are evaluated anew from its fields."""
    return state_of(solution, balance_of(solution))


def balance_of(solution: ContactSolution, *, whole: bool = True) -> Balance | MixedBalance:
    """What is left of a solution's equations, evaluated anew from its fields on its own grid.

    Unless `whole`, a contact in which nothing varies along y is taken on one line of cells.
    """
    scales = Scales.from_conditions(solution.conditions, solution.lubricant)
    problem = contact_problem(
        solution.conditions,
        solution.lubricant,
        solution.surface,
        solution.options,
        solution.viscosity_factor,
        attempt=solution.convergence.attempt,
    )
    if not whole and problem.uniform:
        problem = on_one_line(problem)
    if solution.options.model in TWO_PRESSURES and solution.lubricant is not None:
        return evaluate(problem, pressures_of(solution, problem, scales), second_order=True)
    pressure = solution.pressure[:, : problem.cells[1]] / scales.pressure
    return problem.evaluate(pressure, solution.rigid_approach / scales.gap)


def plastic_overlap(solution: ContactSolution) -> Field:
    """How deep the pressure cap has let the bodies overlap [m], (nx, ny): what stays flattened when they part."""
    balance = balance_of(solution)
    depth = np.maximum(
        balance.problem.contact_gap - balance.gap, 0.0
    )  # the solution's own gap ends at the film
    depth = (
        depth
        * (balance.pressure >= balance.problem.p_cap)
        * Scales.from_conditions(solution.conditions, solution.lubricant).gap
    )
    return np.broadcast_to(depth, solution.grid.cells)


def state_of(solution: ContactSolution, balance: Balance | MixedBalance) -> ContactState:
    """The scalars of a solution whose equations, those of a moving contact perhaps, are left with `balance`."""
    grid, touching, problem = solution.grid, solution.in_contact, balance.problem
    sq, oil = solution.surface.sq, solution.lubricant
    zone, centre = problem.zone(), problem.zone(CENTRE)
    dx, dy = problem.spacing
    width = grid.cells[1] * dy if problem.form.periodic else 2.0 * problem.form.aspect
    lost = balance.rows.state != LUBRICATED
    if isinstance(balance, MixedBalance):
        capped, carried = balance.yielded, balance.content[zone].mean()
        lost[:] = (
            # what is left of any cell's equation: at low speed it is as much as what is refilled
            True
        )
    else:
        capped = balance.rows.state == CAPPED
        carried = balance.film.content[zone].mean() if balance.film else np.inf
    unbalanced = np.abs(balance.outflow[zone & lost]).sum()
    return ContactState(
        car=area_share(touching, zone),
        car_domain=float(touching.mean() * _hertz_areas(solution.conditions, grid)),
        clr=carried_share(solution.pressure, touching),
        capped_oil_load_ratio=carried_share(solution.pressure, capped & ~touching),
        sq=sq,
        h_min=float(solution.gap.min()),
        h_central=float(solution.gap[centre].mean()),
        h_mean=float(solution.gap[zone].mean()),
        lambda_ratio=least_film(solution.conditions, oil) / sq if oil and sq > 0.0 else None,
        p_max=float(solution.pressure.max()),
        reynolds_residual=balance.residual_rms,
        load_error=balance.load_error,
        mass_flux_imbalance=float(unbalanced * dx * dy / (carried * width)),
        contact_slope=_contact_slope(solution),
        error=_error(solution),
    )


def _error(solution: ContactSolution) -> ContactError:
    """What the solution alone can tell: iteration and grid, and what was chosen."""
    convergence, options = solution.convergence, solution.options
    step, cells = convergence.iteration_error, convergence.discretisation_error
    iteration, grid = (
        None if step is None else (step.clr, step.clr),
        None if cells is None else cells.sides("clr"),
    )
    clr = carried_share(solution.pressure, solution.in_contact)
    cap, inlet = solution.p_cap, -solution.grid.lower[0] / solution.conditions.hertz.half_widths[0]
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
            f"inlet {inlet:.3g} half-widths long",
        ),
    )


def _contact_slope(solution: ContactSolution) -> float | None:
    """Central differences; y goes round."""
    heights, (dx, dy) = solution.surface.heights, solution.grid.spacing
    across = (np.roll(heights, -1, axis=1) - np.roll(heights, 1, axis=1)) / (2.0 * dy)
    slope = np.hypot(np.gradient(heights, dx, axis=0), across)
    return float(slope[solution.in_contact].mean()) if solution.in_contact.any() else None


def _hertz_areas(conditions: ContactConditions, grid: Grid) -> float:
    """Area of the grid in Hertz contact areas."""
    if conditions.endless:
        return grid.extent[0] / (2.0 * conditions.hertz.half_widths[0])
    return grid.extent[0] * grid.extent[1] / conditions.hertz.area
