"""Interval of the friction coefficient of a solved contact, by part."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

from asperity.core.quantities import quantity
from asperity.ehl import ContactSolution, Sides
from asperity.results.surface_spread import Row, mean_row, prediction_interval
from asperity.solution import Friction, contact_state

KEY = "friction_coefficient"


@dataclass(frozen=True, slots=True, kw_only=True)
class FrictionInterval:
    """Friction coefficient and its error below and above it, by part.

    `oil` covers viscosity and shear stress at contact pressure; `heat` the film warmer than the
    oil's viscosity; `numerical` cells, iteration and, of a running contact, the finite time (None
    where undetermined); `surfaces` the scatter between surfaces.
    """

    value: float
    oil: Sides
    heat: float
    numerical: float | None
    surfaces: Sides = (0.0, 0.0)

    @classmethod
    def of_oil(cls, friction: Friction) -> "FrictionInterval":
        """Return the interval by oil and heat alone, at one moment or position."""
        return cls(
            value=friction.coefficient,
            oil=(friction.oil_below, friction.oil_above),
            heat=friction.heat_below,
            numerical=0.0,
        )

    @property
    def text(self) -> str:
        """Value and interval as text."""
        entry = quantity(KEY)
        low, high = entry.ends
        return entry.text_in({KEY: self.value, low: self.low, high: self.high})

    @property
    def low(self) -> float | None:
        """Lower end of the interval."""
        if self.numerical is None:
            return None
        below = math.hypot(self.oil[0], self.heat, self.numerical, self.surfaces[0])
        return max(0.0, self.value - below)

    @property
    def high(self) -> float | None:
        """Upper end of the interval."""
        if self.numerical is None:
            return None
        return self.value + math.hypot(self.oil[1], self.numerical, self.surfaces[1])


def friction_interval(rows: Sequence[Row]) -> FrictionInterval | None:
    """Return the interval from the numbers of all surfaces; None without friction."""
    means = mean_row(rows)
    if means.get(KEY) is None:
        return None
    surfaces: Sides = (0.0, 0.0)
    if len(rows) > 1:
        values = [float(row[KEY] or 0.0) for row in rows]
        surfaces = prediction_interval(values, share=False)[1]
    error = means.get("friction_error")
    below, above = (means.get(f"friction_oil_{side}") for side in ("below", "above"))
    if below is None or above is None:  # of a run of an earlier version
        error, below, above = None, 0.0, 0.0
    return FrictionInterval(
        value=float(means[KEY]),
        oil=(float(below), float(above)),
        heat=float(means.get("friction_heat_below") or 0.0),
        numerical=None if error is None else float(error),
        surfaces=surfaces,
    )


def numerical_error(friction: Friction, solution: ContactSolution, clr: float) -> float | None:
    """Return the error of friction due to those of load share and film; None if unknown.

    The oil's stress follows the shear rate at most linearly: the film's part is an upper bound.
    """
    if friction.power == 0.0 or solution.lubricant is None:
        return 0.0  # a dry contact has boundary friction at any load share
    error = solution.convergence.error
    if error is None:
        return None
    oil_traction = friction.oil_part / (1.0 - clr) if clr < 1.0 else 0.0
    sharing = abs(friction.boundary_friction - oil_traction) * error.clr
    film = friction.oil_part * error.h_central / contact_state(solution).h_central
    return math.hypot(sharing, film)
