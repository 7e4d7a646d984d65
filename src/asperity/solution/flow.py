"""Flow of oil through a contact: what enters, leaves behind and beside it, and its layer."""

from dataclasses import dataclass

from asperity.core.arrays import Field, usual_float_errors
from asperity.core.errors import BadInput
from asperity.ehl import ContactSolution, Scales
from asperity.ehl.models.mixed import MixedBalance
from asperity.solution.state import balance_of


@dataclass(frozen=True, eq=False, kw_only=True)
class OilFlow:
    """Oil that passes a contact whose model conserves it, at ambient density.

    Parameters
    ----------
    entering, leaving : through the ends of the grid along rolling [m³/s]
    beside : through its sides, without their outermost lines of cells [m³/s]
    imbalance : entering less leaving and beside, over entering
    y : places across rolling [m], shape (n,), without these lines
    layer_before, layer_behind : thickness of the oil on both bodies together [m], (n,)
    """

    entering: float
    leaving: float
    beside: float
    imbalance: float
    y: Field
    layer_before: Field
    layer_behind: Field


@usual_float_errors
def oil_flow(solution: ContactSolution) -> OilFlow:
    """Return the flow of oil of a solution of the model "conserving".

    Raises
    ------
    BadInput
        for another model, which does not conserve the oil.
    """
    balance = balance_of(solution)
    if not isinstance(balance, MixedBalance) or balance.surplus is None:
        raise BadInput(
            f'the flow of oil needs the model "conserving", got {solution.options.model!r}'
        )
    scales = Scales.from_conditions(solution.conditions, solution.lubricant)
    problem, faces, pressure = balance.problem, balance.faces, balance.oil_pressure
    dx, dy = problem.spacing
    inner = slice(None) if problem.form.periodic else slice(1, -1)
    before = (problem.entering(balance.gap) - 2.0 * faces.inlet * pressure[0] / dx)[inner]
    behind = (balance.content[-1] + 2.0 * faces.east[-1] * pressure[-1] / dx)[inner]
    entering, leaving = float(before.sum()) * dy, float(behind.sum()) * dy
    beside = _side_flow(balance)
    rate = scales.gap * scales.length * solution.conditions.entrainment_speed
    return OilFlow(
        entering=rate * entering,
        leaving=rate * leaving,
        beside=rate * beside,
        imbalance=(entering - leaving - beside) / entering,
        y=solution.grid.y[inner],
        layer_before=before * scales.gap,
        layer_behind=behind * scales.gap,
    )


def _side_flow(balance: MixedBalance) -> float:
    """Return the flow through the sides, in the solver's units; 0 for a contact periodic in y."""
    (dx, dy), north, pressure = balance.problem.spacing, balance.faces.north, balance.oil_pressure
    if balance.problem.form.periodic:
        return 0.0
    outwards = (
        north[:, 0] * (pressure[:, 1] - pressure[:, 0]),
        north[:, -2] * (pressure[:, -2] - pressure[:, -1]),
    )
    return float(sum(part.sum() for part in outwards)) * dx / dy
