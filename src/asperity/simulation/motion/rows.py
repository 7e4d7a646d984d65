"""Columns of the motion history: values of the contact at one step, by the catalogue's keys."""

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

from asperity.case import Case
from asperity.core.errors import BadInput
from asperity.core.quantities import quantity, read
from asperity.coupling import oscillator
from asperity.ehl import ContactSolution, ContactState
from asperity.results import FrictionInterval
from asperity.solution import Friction, friction
from asperity.transient import Snapshot

if TYPE_CHECKING:
    import pandas

Row = dict[str, float | int | bool]

STATE = (
    "car",
    "car_domain",
    "clr",
    "capped_oil_load_ratio",
    "sq_m",
    "h_min_m",
    "h_central_m",
    "h_mean_m",
    "p_max_pa",
    "reynolds_residual",
    "load_error",
    "mass_flux_imbalance",
)
COLUMNS = (
    "time_s",
    *STATE,
    "contact_force_n",
    "friction_coefficient",
    "friction_coefficient_low",
    "friction_coefficient_high",
    "friction_asperity_part",
    "friction_oil_part",
    "friction_power_w",
    "flow_power_w",
    "heat_j",
    "elastic_energy_j",
    "rigid_approach_m",
    "resonance_hz",
    "track_sq_m",
    "flattened_m",
    "newton_steps",
    "converged",
)
HEAT_SOURCES = ("friction_power_w", "flow_power_w")


@dataclass(frozen=True, slots=True)
class _StepSources:
    """Attributes of a step that the catalogue's sources refer to."""

    snapshot: Snapshot
    case: Case
    friction: Friction

    @property
    def solution(self) -> ContactSolution:
        return self.snapshot.solution

    @property
    def state(self) -> ContactState:
        return self.snapshot.state

    @property
    def converged(self) -> bool:
        return self.solution.convergence.converged

    @property
    def contact_force(self) -> float:
        return self.state.clr * self.case.conditions.load

    @property
    def friction_interval(self) -> FrictionInterval:
        """Interval of one step by the oil."""
        return FrictionInterval.of_oil(self.friction)

    @property
    def resonance_hz(self) -> float:
        model = self.case.vibration
        if model is None or model.needs_solution:
            return math.nan
        try:
            return oscillator(self.state, self.case.conditions, model).natural_frequency_hz
        except BadInput:  # no asperity contact, hence no spring
            return math.nan


def step_row(snapshot: Snapshot, case: Case, previous: Row | None) -> Row:
    """Return the row of a step; equal steps give equal rows, so computing time is not included."""
    rubbing = friction(
        snapshot.solution, boundary_friction=case.boundary_friction, thermal=case.thermal
    )
    numbers = read(_StepSources(snapshot, case, rubbing), map(quantity, COLUMNS))
    numbers["heat_j"] = 0.0
    row: Row = {"step": snapshot.number}
    row |= {key: math.nan if numbers[key] is None else numbers[key] for key in COLUMNS}
    if previous is not None:
        heating = sum(float(end[key]) for end in (previous, row) for key in HEAT_SOURCES)
        row["heat_j"] = previous["heat_j"] + 0.5 * heating * (snapshot.time - previous["time_s"])
    return row


def mean_state(means: "pandas.Series[float]") -> ContactState:
    """Return the contact state of a row of means, without a lambda ratio."""
    fields = {quantity(key).source.removeprefix("state."): float(means[key]) for key in STATE}
    return ContactState(**fields, lambda_ratio=None, error=None)
