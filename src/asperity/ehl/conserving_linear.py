"""The conserving contact linearised exactly, state by state, and Newton's step of it by GMRES.

The approximate inverse has two parts: the five-point stencil of the oil's balance, with the bending of near cells in
it, factored by sparse LU; and where bodies touch the half-space's own inverse, left out elsewhere.
"""

import numpy as np

from asperity.arrays import Field
from asperity.ehl.conserving import CAPPED, FREE, TOUCHING, OilBalance, Unknowns
from asperity.ehl.krylov import gmres
from asperity.ehl.linear import five_point_pattern
from asperity.kernels.conserving import FULL, driven_outflow, fluid_stencil
from asperity.kernels.reynolds import Stencil

FAR, NEAR = 0.1, 1e-3  # to what share the linearised equations are left, far from the solution ...
CLOSE = 0.1  # ... and from this residual on
MOST_KRYLOV_STEPS = 80


class Linear:
    """The linearisation of a balance: `rows` applies it, `answer` approximately inverts it."""

    def __init__(self, balance: OilBalance) -> None:
        self.balance, self.problem, self.cells = balance, balance.problem, balance.gap.shape
        earlier, flow = balance.earlier, balance.flow
        self.standing = earlier is None or not earlier.followed  # what arrives is what the cell upstream holds
        self.storing = 0.0 if earlier is None or earlier.followed else earlier.rate
        self.free, self.touching = balance.contact_state == FREE, balance.contact_state == TOUCHING
        self.pressed = (balance.fluid_state == FULL).astype(float)
        stencil = Stencil(*np.empty((5, *self.cells)))
        fluid_stencil(
            self.pressed,
            flow.content_by_unknown,
            flow.content_by_gap,
            self.pressed * self.free,
            flow.mobility,
            flow.ambient,
            self.problem.deflection.near,
            self.problem.spacing,
            float(self.standing),
            self.storing,
            stencil,
        )
        for part in stencil:
            part *= balance.fluid_scale
        self.pattern = five_point_pattern(self.cells)
        self.factors = self.pattern.factored(stencil)

    def total(self, d_fluid: Field, d_contact: Field) -> Field:
        """Change of the total stress: the oil's, where bodies touch their own, none at the cap."""
        return np.where(self.free, self.pressed * d_fluid, np.where(self.touching, d_contact, 0.0))

    def rows(self, d_fluid: Field, d_pressure: Field, d_approach: float) -> tuple[Field, Field]:
        """Changes of the scaled balance of oil and of the rows of touching cells, both (nx, ny)."""
        balance, flow, spacing = self.balance, self.balance.flow, self.problem.spacing
        d_gap = self.problem.deflection(d_pressure)
        d_gap += d_approach
        d_content = flow.content_by_unknown * d_fluid + flow.content_by_gap * d_gap
        d_mobility = flow.mobility_by_unknown * d_fluid + flow.mobility_by_gap * d_gap
        ends = [0, -1]
        d_ambient = flow.ambient_by_unknown * d_fluid[ends] + flow.ambient_by_gap * d_gap[ends]
        out = d_content * (1.0 / spacing[0] + self.storing)
        out[0] -= flow.entering_by_gap * d_gap[0] / spacing[0]
        if self.standing:
            out[1:] -= d_content[:-1] / spacing[0]
        driven_outflow(self.pressed * d_fluid, flow.mobility, flow.ambient, spacing, out)
        driven_outflow(flow.pressure, d_mobility, d_ambient, spacing, out)
        out *= balance.fluid_scale
        return out, np.where(self.touching, d_gap * balance.contact_scale, 0.0)

    def answer(self, oil: Field, contact: Field) -> tuple[Field, Field]:
        """Approximate changes of the fluid unknown and of the touching cells' stress that answer both rows."""
        d_contact = np.zeros(self.cells)
        if self.touching.any():
            d_contact[self.touching] = self.problem.deflection.undone(contact / self.balance.contact_scale)[
                self.touching
            ]
        return self.pattern.solve(self.factors, oil), d_contact


def newton_step(balance: OilBalance) -> Unknowns:
    """Changes of all unknowns that meet every linearised equation, and the load, to a tenth or, when close, better."""
    linear, problem, unknowns = Linear(balance), balance.problem, balance.unknowns
    known = np.where(balance.contact_state == CAPPED, problem.p_cap - unknowns.pressure, 0.0)
    known = np.where(linear.free, balance.flow.pressure - unknowns.pressure, known)
    nothing = np.zeros(linear.cells)
    oil_known, contact_known = linear.rows(nothing, known, 0.0)
    oil = -balance.outflow * balance.fluid_scale - oil_known
    contact = np.where(linear.touching, -balance.contact_residual - contact_known, 0.0)
    dx, dy = problem.spacing
    missing = -balance.load_error * problem.load / (dx * dy) - known.sum()

    # unknowns: of the oil, of touching cells and, last, the approach; last equation: the missing load
    weight, count = 1.0 / np.sqrt(nothing.size), nothing.size
    by_approach = linear.answer(*linear.rows(nothing, nothing, 1.0))
    total = float(linear.total(*by_approach).sum()) or 1.0

    def split(vector: Field) -> tuple[Field, Field]:
        return vector[:count].reshape(linear.cells), vector[count : 2 * count].reshape(linear.cells)

    def joined(oil: Field, contact: Field, last: float) -> Field:
        vector = np.empty(2 * count + 1)
        vector[:count], vector[count : 2 * count], vector[-1] = oil.ravel(), contact.ravel(), last
        return vector

    def product(vector: Field) -> Field:
        d_fluid, d_contact = split(vector)
        d_pressure = linear.total(d_fluid, d_contact)
        return joined(*linear.rows(d_fluid, d_pressure, float(vector[-1])), weight * float(d_pressure.sum()))

    def precondition(vector: Field) -> Field:
        d_fluid, d_contact = linear.answer(*split(vector))
        d_approach = (float(linear.total(d_fluid, d_contact).sum()) - float(vector[-1]) / weight) / total
        return joined(d_fluid - d_approach * by_approach[0], d_contact - d_approach * by_approach[1], d_approach)

    wanted = joined(oil, contact, weight * missing)
    forcing = FAR if balance.residual_rms > CLOSE else NEAR
    solved = gmres(product, precondition, wanted, tolerance=forcing, most_steps=MOST_KRYLOV_STEPS)
    d_fluid, d_contact = split(solved)
    return Unknowns(d_fluid, known + linear.total(d_fluid, d_contact), float(solved[-1]))
