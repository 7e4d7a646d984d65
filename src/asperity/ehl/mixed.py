"""The mixed contact with two pressures, on one grid, dimensionless: what each cell asks for.

The oil has a pressure q of its own, in every cell and so in those that touch too; the asperities carry the rest of the
total pressure P. With R the cell's net oil outflow in the film max(H, H_c), its density and viscosity those of q:

    oil         max( min( q, R/J ),  q - P_cap ) = 0                  ruptured, lubricated, capped
    asperities  max( min( P - q, (H - H_c)/k ),  P - P_cap ) = 0      free, touching, capped

A closed cell's outflow is scaled by its own derivative, the film held: by that of an open one, shut-in oil would count
as balanced whatever its pressure. No cell moves its oil less easily than ambient oil in the contact film. The wedge is
first order, or second order that leans back where the film's content jumps, as at the edge of a touching cell.

A closed cell that takes in more oil than even q = P drives out again is lifted: it gets q = P, counts as free, and as
long as its gap is still below H_c, what it lacks counts as oil that it lacks. So its row asks for an open gap at once.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from asperity.arrays import Codes, Field, Mask
from asperity.ehl.problem import CLOSED_WITHIN, FIRST_ORDER, Problem
from asperity.kernels.reynolds import CAPPED, LUBRICATED, RUPTURED, TOUCHING, Faces, Film, Rows, leaning_outflow
from asperity.lubricant import Lubricant

FREE = LUBRICATED  # code of a cell in which the oil's pressure is the total one


class Pressures(NamedTuple):
    """The unknowns: the oil's pressure q and the total pressure P, both (nx, ny), and the approach H0."""

    oil: Field
    total: Field
    approach: float


@dataclass(frozen=True, slots=True)
class MixedBalance:
    """A problem evaluated at two pressures: gap, what is left of both equations, and what linearisation needs.

    `rows` are the oil's; `solid` says what decides a cell's total pressure: FREE, TOUCHING or CAPPED.
    """

    problem: Problem
    unknowns: Pressures
    gap: Field  # may be negative where the cap lets the bodies overlap: the depth of plastic flattening
    oil_residual: Field
    solid_residual: Field
    rows: Rows
    solid: Codes
    film: Film
    faces: Faces
    lean: Field
    outflow: Field  # net oil outflow per cell area

    @property
    def pressure(self) -> Field:
        """The total pressure, (nx, ny)."""
        return self.unknowns.total

    @property
    def load_error(self) -> float:
        """Relative."""
        dx, dy = self.problem.spacing
        return float(self.pressure.sum() * dx * dy / self.problem.load - 1.0)

    @property
    def residual_rms(self) -> float:
        """Root mean square of both equations, as a share of p_h."""
        return float(np.sqrt(np.mean(self.oil_residual**2) + np.mean(self.solid_residual**2)))

    @property
    def in_contact(self) -> Mask:
        """Cells where the bodies touch: gap closed to the contact film, or flattened below it."""
        closed = self.gap <= (1.0 + CLOSED_WITHIN) * self.problem.contact_gap
        return np.asarray((self.solid == TOUCHING) | closed)


def evaluate(problem: Problem, unknowns: Pressures, *, second_order: bool, freed: Mask | None = None) -> MixedBalance:
    """What is left of every equation; `freed` cells are taken as free whatever their gap.

    So are lifted ones, and the unknowns are changed where that takes it.
    """
    return _evaluate(problem, unknowns, second_order, freed, may_lift=True)


def _evaluate(
    problem: Problem, unknowns: Pressures, second_order: bool, freed: Mask | None, *, may_lift: bool
) -> MixedBalance:
    oil, pressure, approach = unknowns
    assert problem.lubricant is not None
    gap = problem.undeformed + problem.deflection(pressure)
    gap += approach
    contact_scale = 1.0 / (problem.deflection.near[0] - problem.deflection.near[3])
    touching = (gap - problem.contact_gap) * contact_scale
    film, faces, outflow, fluid_scale = _flow(problem, oil, gap, problem.lubricant)
    own_outflow = _own_outflow(film, faces, problem.spacing)
    lean = _lean(film.content) if second_order else np.zeros_like(gap)
    outflow += _leaning(film.content, lean, problem)

    borne = pressure - oil
    free = borne < touching
    lifted = ~free & (outflow + borne * own_outflow < 0.0)
    if may_lift and np.any(lifted & (borne > 0.0)):
        freed = lifted if freed is None else freed | lifted
        unknowns = Pressures(np.where(lifted, pressure, oil), pressure, approach)
        return _evaluate(problem, unknowns, second_order, freed, may_lift=False)
    free |= lifted & (borne <= 0.0)
    if freed is not None:
        free |= freed
    solid_residual = np.where(free, borne, touching)
    solid = np.where(free, np.int8(FREE), np.int8(TOUCHING))
    capped = pressure - problem.p_cap > solid_residual
    solid_residual[capped], solid[capped] = pressure[capped] - problem.p_cap, CAPPED

    sunk = (solid == FREE) & (touching < 0.0) & (pressure < problem.p_cap)
    lacking = np.where(sunk, film.content_by_gap * (gap - problem.contact_gap), 0.0)
    outflow += lacking / problem.spacing[0] + _leaning(lacking, lean, problem)
    outflow[1:] -= lacking[:-1] / problem.spacing[0]

    closed = (solid != FREE) & (touching <= 0.0)
    film = film.held_where(closed)
    scale = np.where(closed, 1.0 / own_outflow, fluid_scale)
    balanced = outflow * scale
    oil_residual = np.minimum(balanced, oil)
    state = np.where(balanced < oil, np.int8(LUBRICATED), np.int8(RUPTURED))
    full = ~closed & (oil - problem.p_cap > oil_residual)
    oil_residual[full], state[full] = oil[full] - problem.p_cap, CAPPED
    if not problem.form.periodic:
        for rim in (0, -1):
            state[:, rim], oil_residual[:, rim] = RUPTURED, oil[:, rim]
            solid[:, rim], solid_residual[:, rim] = FREE, borne[:, rim]
    rows = Rows(state, scale, contact_scale)
    return MixedBalance(
        problem, unknowns, gap, oil_residual, solid_residual, rows, solid, film, faces, lean, outflow
    )  # fmt: skip


def _flow(problem: Problem, oil: Field, gap: Field, lubricant: Lubricant) -> tuple[Film, Faces, Field, Field]:
    return problem.flow(oil, gap, lubricant, FIRST_ORDER, least_mobility=problem.contact_gap**3 / problem.speed)


def _leaning(content: Field, lean: Field, problem: Problem) -> Field:
    added = np.empty_like(content)
    leaning_outflow(content, lean, problem.spacing[0], added)
    return added


def _lean(content: Field) -> Field:
    """Half of 2 m₁ m₂/(m₁² + m₂²) of the cells upstream of each face east, (nx, ny): 1/2 where the film is even."""
    lean = np.zeros_like(content)
    upstream, here = content[:-1], content[1:]
    lean[1:] = upstream * here / (upstream**2 + here**2)
    return lean


def _own_outflow(film: Film, faces: Faces, spacing: tuple[float, float]) -> Field:
    """Derivative of each cell's net outflow by its own pressure, its film held, (nx, ny)."""
    dx, dy = spacing
    east, west = faces.east.copy(), np.empty_like(faces.east)
    east[-1] *= 2.0
    west[0], west[1:] = 2.0 * faces.inlet, faces.east[:-1]
    across = faces.north + np.roll(faces.north, 1, axis=1)
    return (east + west) / dx**2 + across / dy**2 + film.content_by_pressure / dx
