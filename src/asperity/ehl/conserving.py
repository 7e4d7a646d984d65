"""The mixed contact with no oil lost, on one grid, dimensionless: what each cell asks for.

One signed unknown s a cell tells the oil: s < 0 ruptured (film content 1 + s, no pressure), 0 <= s <= P_cap a full
film under P_f = s, s > P_cap oil at the cap, which presses the gap open for good by k (s - P_cap). The total normal
stress P is the oil's and, where bodies touch, the elastic contact's beside it; the cap bounds their sum. Reynolds'
equation holds in every cell, upwind to first order: that is also its step in time along the way of the oil.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from asperity.arrays import Codes, Field, Mask
from asperity.ehl.problem import CLOSED_WITHIN, Problem
from asperity.kernels.conserving import FULL, PLATEAU, RUPTURED, driven_outflow

FREE, TOUCHING, CAPPED = 0, 1, 2  # what decides the total stress of a cell: its oil, closed bodies, the cap


class Unknowns(NamedTuple):
    """Signed fluid unknown and total normal stress of each cell, (nx, ny), and the approach H0."""

    fluid: Field
    pressure: Field
    approach: float


class Earlier(NamedTuple):
    """Oil of a time before: each cell's `content`, and the `rate` at which it counts, one over the time since.

    `followed` oil has moved on by a cell since, so that its rate is one over the length of a cell.
    """

    content: Field
    rate: float
    followed: bool


class Flow(NamedTuple):
    """The oil of a balance: film height, content m = rho theta H, mobility, and their slopes.

    `..._by_unknown` at a given gap, `..._by_gap` at a given unknown; `ambient` is the mobility that the cells at both
    ends would have at ambient pressure, shape (2, ny); `entering_by_gap` that of the content upstream of the first.
    """

    pressure: Field
    height: Field
    content: Field
    content_by_unknown: Field
    content_by_gap: Field
    mobility: Field
    mobility_by_unknown: Field
    mobility_by_gap: Field
    ambient: Field
    ambient_by_unknown: Field
    ambient_by_gap: Field
    entering: Field
    entering_by_gap: Field


@dataclass(frozen=True, slots=True)
class OilBalance:
    """A problem evaluated at one set of unknowns.

    `gap` is the elastic one, negative where the cap lets bodies flatten each other; `outflow` is what each cell loses
    per area and time, `fluid_scale` turns it into something like a pressure; `contact_residual` is left of the
    equations of the total stress, `contact_scale` their compliance's inverse.
    """

    problem: Problem
    unknowns: Unknowns
    earlier: Earlier | None
    gap: Field
    flow: Flow
    fluid_state: Codes
    contact_state: Codes
    outflow: Field
    fluid_scale: Field
    contact_scale: float
    contact_residual: Field

    @property
    def load_error(self) -> float:
        """Relative."""
        dx, dy = self.problem.spacing
        return float(self.unknowns.pressure.sum() * dx * dy / self.problem.load - 1.0)

    @property
    def residual_rms(self) -> float:
        """Root mean square of all equations, as a share of p_h."""
        fluid = self.outflow * self.fluid_scale
        return float(np.sqrt(np.mean(fluid**2) + np.mean(self.contact_residual**2)))

    @property
    def throughflow(self) -> float:
        """Oil that enters the domain."""
        flow, (dx, dy) = self.flow, self.problem.spacing
        driven = (flow.mobility[0] + flow.ambient[0]) * flow.pressure[0] / dx
        return float((flow.entering - driven).sum()) * dy

    @property
    def imbalance(self) -> float:
        """Oil that cells lose and gain, in sum, over the throughflow: no less than what all lose together."""
        dx, dy = self.problem.spacing
        return float(np.abs(self.outflow).sum()) * dx * dy / abs(self.throughflow)

    @property
    def in_contact(self) -> Mask:
        """Cells where the elastic bodies touch, whatever oil at the cap has pressed between them since."""
        closed = self.gap <= (1.0 + CLOSED_WITHIN) * self.problem.contact_gap
        return np.asarray(closed & (self.unknowns.pressure > 0.0))

    @property
    def growth(self) -> Field:
        """How far oil at the cap has pressed the gap open."""
        return np.asarray(self.flow.height - np.maximum(self.gap, self.problem.contact_gap))


def evaluate(problem: Problem, unknowns: Unknowns, earlier: Earlier | None = None) -> OilBalance:
    """What is left of every equation; with oil of an `earlier` time, of one step since then."""
    fluid, pressure, approach = unknowns
    near = problem.deflection.near
    compliance = float(near[0] - near[3])
    gap = problem.undeformed + problem.deflection(pressure)
    gap += approach
    state = np.where(fluid < 0.0, np.int8(RUPTURED), np.where(fluid > problem.p_cap, np.int8(PLATEAU), np.int8(FULL)))
    flow = _flow(problem, fluid, gap, state, compliance)

    dx = problem.spacing[0]
    if earlier is not None and earlier.followed:
        outflow = (flow.content - np.concatenate([flow.entering[None], earlier.content[:-1]])) / dx
    else:
        outflow = np.diff(flow.content, axis=0, prepend=flow.entering[None]) / dx
        if earlier is not None:
            outflow += earlier.rate * (flow.content - earlier.content)
    driven_outflow(flow.pressure, flow.mobility, flow.ambient, problem.spacing, outflow)

    contact_scale = 1.0 / compliance
    touching = (gap - problem.contact_gap) * contact_scale
    free = pressure - flow.pressure
    residual = np.minimum(free, touching)
    decided = np.where(touching < free, np.int8(TOUCHING), np.int8(FREE))
    over = pressure - problem.p_cap > residual
    residual[over] = pressure[over] - problem.p_cap
    decided[over] = CAPPED
    scale = 1.0 / _diagonal(problem, flow, state, near)
    return OilBalance(problem, unknowns, earlier, gap, flow, state, decided, outflow, scale, contact_scale, residual)


def _flow(problem: Problem, fluid: Field, gap: Field, state: Codes, compliance: float) -> Flow:
    oil, floor, cap = problem.lubricant, problem.contact_gap, problem.p_cap
    assert oil is not None  # a contact without oil has none to conserve
    ruptured, full, plateau = (state == code for code in (RUPTURED, FULL, PLATEAU))
    pressure, share = np.clip(fluid, 0.0, cap), 1.0 + np.minimum(fluid, 0.0)
    grows = np.where(plateau, compliance, 0.0)
    height = np.maximum(gap, floor)
    height += np.where(plateau, compliance * (fluid - cap), 0.0) if np.isfinite(cap) else 0.0
    lifted = (gap > floor).astype(float)

    pascals = pressure * problem.p_scale
    density = oil.density(pascals) / oil.density.rho0
    density_slope = oil.density.slope(pascals) * (problem.p_scale / oil.density.rho0)
    viscosity = oil.viscosity(pascals)
    if problem.viscosity_factor is not None:
        viscosity = viscosity * problem.viscosity_factor
    log_slope = oil.viscosity.log_slope(pascals) * problem.p_scale
    thinning, exponent = oil.rheology.thinning(viscosity * problem.sliding / height)
    mobility = density * height**3 * (oil.viscosity.eta0 / problem.speed) / (viscosity * thinning)
    mobility_by_height = mobility * (3.0 + exponent) / height
    by_pressure = mobility * (density_slope / density - (1.0 + exponent) * log_slope)
    ends = [0, -1]
    ambient = height[ends] ** 3 / problem.speed
    if problem.viscosity_factor is not None:
        ambient /= problem.viscosity_factor[ends]
    ambient_by_height = 3.0 * ambient / height[ends]
    full_content, content_by_height = density * height, density * share
    x0, dx = problem.x[0], problem.spacing[0]
    ahead = gap[0] + ((x0 - dx) ** 2 - x0**2) / 2.0  # one cell before the inlet, full of oil at ambient pressure
    return Flow(
        pressure=pressure,
        height=height,
        content=full_content * share,
        content_by_unknown=np.where(
            ruptured, full_content, np.where(full, density_slope * height, content_by_height * grows)
        ),
        content_by_gap=content_by_height * lifted,
        mobility=mobility,
        mobility_by_unknown=np.where(full, by_pressure, mobility_by_height * grows),
        mobility_by_gap=mobility_by_height * lifted,
        ambient=ambient,
        ambient_by_unknown=ambient_by_height * grows[ends],
        ambient_by_gap=ambient_by_height * lifted[ends],
        entering=np.maximum(ahead, floor),
        entering_by_gap=(ahead > floor).astype(float),
    )


def _diagonal(problem: Problem, flow: Flow, state: Codes, near: Field) -> Field:
    """About the derivative of each cell's outflow by its own unknown, kept well above zero."""
    dx, dy = problem.spacing
    above = np.concatenate([flow.content_by_gap[:1], flow.content_by_gap[:-1]])
    bending = np.maximum(flow.content_by_gap * near[0] - above * near[1], near[0] - near[1]) / dx
    driven = 2.0 * flow.mobility * (1.0 / dx**2 + 1.0 / dy**2)
    # a cell closed to the floor holds next to no oil: what it lacks counts as what would lift it
    held = np.maximum(flow.content_by_unknown, near[0] - near[3]) / dx
    return np.asarray(np.where(state == FULL, driven + bending, 0.0) + held)
