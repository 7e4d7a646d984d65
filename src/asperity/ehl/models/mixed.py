"""Two-pressure mixed contact on one grid, dimensionless: the equations of each cell.

The oil has a pressure q in every cell, including touching ones; the asperities carry the rest of
the total pressure P. With R the cell's net oil outflow in the film max(H, H_c), its density and
viscosity those of q:

    oil         max( min( q, R/J ),  q - P_cap ) = 0                  ruptured, lubricated, capped
    asperities  max( min( P - q, (H - H_c)/k ),  P - P_cap ) = 0      free, touching, capped

A closed cell's outflow is scaled by its derivative at fixed film: with that of an open one, trapped
oil would count as balanced at any pressure. A cell's mobility is at least that of ambient oil in
the contact film. The wedge is first order, or second order with a slope limiter that acts where the
film's content jumps, as at the edge of a touching cell.

A closed cell that takes in more oil than drains at q = P is opened: it gets q = P and counts as
free, and while its gap is below H_c the missing gap counts as missing oil, so its equation at once
demands an open gap. This excludes cells in plastic overlap so deep that opening would take more
than the cap.

Where oil is conserved, R = 0 in every cell, and one signed unknown represents q, the missing share
of the film, and the permanent opening of the gap by oil at the cap.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from asperity.core.arrays import Codes, Field, Mask
from asperity.ehl.controls import MIXED_SOLVER
from asperity.ehl.models.oil_advection import (
    advected_outflow,
    limiter_outflow,
    outflow_by_content,
    second_order_outflow,
    slope_limiter,
    upstream_content,
    upwind_at_outlet,
    uses_limiter,
)
from asperity.ehl.models.single_pressure import (
    CLOSED_WITHIN,
    FIRST_ORDER,
    THIRD_ORDER,
    Precision,
    Problem,
)
from asperity.kernels import load_sharing
from asperity.kernels.load_sharing import FREE, CellState, ContactBounds
from asperity.kernels.reynolds import CAPPED, LUBRICATED, RUPTURED, TOUCHING, Faces, Film, Rows


class Pressures(NamedTuple):
    """Unknowns: oil pressure q and total pressure P, both (nx, ny), and approach H0.

    Where oil is conserved, `oil` is signed: below 0 the missing share of the film (q = 0), above
    the cap the permanent opening of the gap (q = P_cap).
    """

    oil: Field
    total: Field
    approach: float


@dataclass(frozen=True)
class MixedBalance:
    """A problem evaluated at two pressures: gap, residuals, and terms of the linearisation.

    `rows` are those of the oil; `solid` is the state of a cell's total pressure: FREE, TOUCHING or
    CAPPED.
    """

    problem: Problem
    unknowns: Pressures
    # negative where the cap lets the bodies overlap: depth of plastic flattening
    gap: Field
    oil_residual: Field
    solid_residual: Field
    rows: Rows
    solid: Codes
    film: Film
    faces: Faces
    limiter: Field
    outflow: Field  # net oil outflow per cell area
    sealed: Mask  # cells whose film does not depend on the gap
    # where oil is conserved: content beyond the full film's, negative in cavities
    surplus: Field | None = None
    # its derivative in the signed unknown; 0 where the film is full and below the cap
    surplus_by_oil: Field | None = None

    @property
    def solved(self) -> Mask:
        """Cells in which Reynolds' equation holds: where oil is conserved, all inside the rim."""
        if self.surplus is None:
            return np.asarray(self.rows.state == LUBRICATED)
        return np.broadcast_to(~self.problem.rim, self.gap.shape)

    @property
    def content(self) -> Field:
        """Oil over each cell, (nx, ny)."""
        return self.film.content if self.surplus is None else self.film.content + self.surplus

    @property
    def pressure(self) -> Field:
        """Total pressure, (nx, ny)."""
        return self.unknowns.total

    @property
    def limiter_correction(self) -> Field:
        """Second-order correction of the wedge, in content, (nx, ny)."""
        return self.limiter * (
            self.film.content - upstream_content(self.problem, self.film.content)
        )

    @property
    def film_share(self) -> Field:
        """Share of the gap that is oil, (nx, ny): below 1 in conserving cavities."""
        share = np.ones_like(self.gap)
        return share if self.surplus is None else share + np.minimum(self.unknowns.oil, 0.0)

    @property
    def growth(self) -> Field:
        """Permanent opening of the gap by conserved oil at the cap, (nx, ny)."""
        zero = np.zeros_like(self.gap)
        return zero if self.surplus is None else _growth(self.problem, self.unknowns.oil)

    @property
    def height(self) -> Field:
        """Gap with its permanent opening, at least the contact film, (nx, ny)."""
        return np.maximum(self.gap, self.problem.contact_gap) + self.growth

    @property
    def throughflow(self) -> float:
        """Oil that enters the domain."""
        (_, dy), oil = self.problem.spacing, self.oil_pressure
        entering = self.problem.entering(self.gap)
        return (
            float((entering - 2.0 * self.faces.inlet * oil[0] / self.problem.spacing[0]).sum()) * dy
        )

    @property
    def imbalance(self) -> float:
        """Sum of oil lost and gained by cells, over the throughflow; bounds the net loss."""
        dx, dy = self.problem.spacing
        return float(np.abs(self.outflow[self.solved]).sum()) * dx * dy / abs(self.throughflow)

    @property
    def load_error(self) -> float:
        """Relative excess of the pressure over the load."""
        return self.problem.load_error(self.pressure)

    @cached_property
    def residual_rms(self) -> float:
        """Root mean square of both equations, as a share of p_h."""
        return float(np.sqrt(np.mean(self.oil_residual**2) + np.mean(self.solid_residual**2)))

    @property
    def oil_pressure(self) -> Field:
        """Oil pressure, (nx, ny)."""
        return np.clip(self.unknowns.oil, 0.0, self.problem.p_cap)

    @property
    def parted(self) -> Mask:
        """Cells without asperity pressure."""
        return np.asarray(self.solid == FREE)

    @property
    def yielded(self) -> Mask:
        """Cells at the cap."""
        return np.asarray(self.pressure >= self.problem.p_cap)

    @property
    def in_contact(self) -> Mask:
        """Cells in which the bodies touch: gap at the contact film, or flattened below it."""
        closed = self.gap <= (1.0 + CLOSED_WITHIN) * self.problem.contact_gap
        return np.asarray((self.solid == TOUCHING) | closed)


def evaluate(
    problem: Problem, unknowns: Pressures, *, second_order: bool, freed: Mask | None = None
) -> MixedBalance:
    """Return the residual of every equation.

    `freed` cells count as free whatever their gap, and so do opened ones, whose unknowns are
    changed where necessary.
    """
    gap = problem.undeformed + problem.deflection(unknowns.total) + unknowns.approach
    flow, opening = _flow(problem, unknowns, gap, second_order), np.empty(gap.shape, dtype=bool)
    freed = np.zeros(gap.shape, dtype=bool) if freed is None else freed
    if load_sharing.mark_opening(flow.cells, _bounds(problem), opening):
        oil, total = flow.cells.oil, unknowns.total
        unknowns = unknowns._replace(oil=np.where(opening & (total > oil), total, unknowns.oil))
        freed = freed | opening
        flow = _flow(problem, unknowns, gap, second_order)
        load_sharing.mark_opening(flow.cells, _bounds(problem), opening)
    return _balance(problem, unknowns, flow, opening, freed)


class _Flow(NamedTuple):
    """Flow of the oil at a known gap, and the state of each cell that decides how it is closed.

    The surplus and its derivative are None where oil is not conserved.
    """

    cells: CellState
    height: Field
    film: Film
    faces: Faces
    scale: Field
    limiter: Field
    surplus: Field | None
    surplus_by_oil: Field | None


def _bounds(problem: Problem) -> ContactBounds:
    """Return the bounds of gap and pressure."""
    closed = problem.contact_gap
    return ContactBounds(
        closed, 1.0 / problem.softness, (1.0 + CLOSED_WITHIN) * closed, problem.p_cap
    )


def _flow(problem: Problem, unknowns: Pressures, gap: Field, second_order: bool) -> _Flow:
    """Return the flow of the oil at a given gap."""
    assert problem.lubricant is not None
    signed, surplus, surplus_by_oil = unknowns.oil, None, None
    oil, height, limiter = np.clip(signed, 0.0, problem.p_cap), gap, np.zeros_like(gap)
    if problem.conserve:
        height = np.maximum(gap, problem.contact_gap) + _growth(problem, signed)
    film, faces, outflow, scale = problem.flow(
        oil,
        height,
        problem.lubricant,
        THIRD_ORDER if problem.accurate else FIRST_ORDER,
        least_mobility=problem.contact_gap**3 / problem.speed,
    )
    if second_order and uses_limiter(problem):
        limiter = slope_limiter(problem, film.content, gap)
    outflow += second_order_outflow(problem, film.content, limiter, second_order=second_order)
    if problem.conserve:
        surplus, surplus_by_oil = _surplus(problem, film, signed)
        outflow += advected_outflow(problem, surplus)
        upwind_at_outlet(problem, film.content, outflow)
    cells = CellState(signed, oil, unknowns.total, gap, outflow, np.empty_like(gap))
    load_sharing.outflow_by_pressure(
        film, faces, outflow_by_content(problem), *problem.spacing, cells.own_outflow
    )
    return _Flow(cells, height, film, faces, scale, limiter, surplus, surplus_by_oil)


def _balance(
    problem: Problem, unknowns: Pressures, flow: _Flow, opening: Mask, freed: Mask
) -> MixedBalance:
    """Return the equations of every cell; those of `opening` and `freed` cells are free."""
    cells, film, scale, bounds = flow.cells, flow.film, flow.scale, _bounds(problem)
    sealed = np.empty(freed.shape, dtype=bool)
    solid, solid_residual, sunk = _contact_rows(problem, flow, opening, freed)
    load_sharing.mark_sealed(cells, bounds, solid, sunk, scale, sealed)
    if flow.surplus_by_oil is None:
        oil_residual, state = np.empty_like(cells.gap), np.empty_like(solid)
        load_sharing.fill_oil_rows(cells, bounds, scale, oil_residual, state)
        load_sharing.fix_film_gap(sealed, film)
        if problem.exact:  # their mobility is that of the contact film
            film.log_mobility_by_gap[sunk] = 0.0
    else:
        film, scale, oil_residual, state = _conserving_rows(
            problem, flow, flow.surplus_by_oil, sealed
        )
    _fix_rows(problem, cells, state, solid, oil_residual, solid_residual)
    return MixedBalance(
        problem,
        unknowns,
        cells.gap,
        oil_residual,
        solid_residual,
        Rows(state, scale, bounds.contact_scale),
        solid,
        film,
        flow.faces,
        flow.limiter,
        cells.outflow,
        sealed,
        flow.surplus,
        flow.surplus_by_oil,
    )


def _contact_rows(
    problem: Problem, flow: _Flow, opening: Mask, freed: Mask
) -> tuple[Codes, Field, Mask]:
    """Return state and residual of the total pressure, and free cells below the contact film.

    The gap missing in these counts as missing oil in the outflow.
    """
    gap, outflow = flow.cells.gap, flow.cells.outflow
    solid, residual = np.empty(gap.shape, dtype=np.int8), np.empty_like(gap)
    sunk = np.empty(gap.shape, dtype=bool)
    if load_sharing.fill_contact_rows(
        flow.cells, _bounds(problem), opening, freed, solid, residual, sunk
    ):
        lacking = np.where(sunk, flow.film.content_by_gap * (gap - problem.contact_gap), 0.0)
        outflow += advected_outflow(problem, lacking) + limiter_outflow(
            problem, lacking, flow.limiter, flow.limiter
        )
    return solid, residual, sunk


def _conserving_rows(
    problem: Problem, flow: _Flow, surplus_by_oil: Field, sealed: Mask
) -> tuple[Film, Field, Field, Codes]:
    """Return film, scale, residual and state of the oil's equations where oil is conserved.

    The film of `sealed` cells is fixed, except where oil at the cap has opened it.
    """
    signed, film = flow.cells.signed, flow.film
    # a closed cell holds hardly any oil: its missing oil counts as the gap that would open it
    loose, lacks = (
        surplus_by_oil > 0.0,
        np.maximum(surplus_by_oil, problem.softness) * outflow_by_content(problem),
    )
    scale = np.where(loose, 1.0 / lacks, flow.scale)
    oil_residual = flow.cells.outflow * scale
    state = np.where(signed < 0.0, RUPTURED, np.where(loose, CAPPED, LUBRICATED)).astype(np.int8)
    pressed = signed > problem.p_cap  # opened by the oil, not by the approach
    load_sharing.fix_film_gap(sealed & ~pressed, film)
    stiff = pressed & (film.log_mobility_by_gap == 0.0)
    film = film._replace(
        log_mobility_by_gap=np.where(stiff, -3.0 / flow.height, film.log_mobility_by_gap)
    )
    return film, scale, oil_residual, state


def _fix_rows(
    problem: Problem,
    cells: CellState,
    state: Codes,
    solid: Codes,
    oil_residual: Field,
    solid_residual: Field,
) -> None:
    """Set the equations of the rim, without pressure, and of cells with fixed pressures."""
    if np.any(rim := problem.rim):
        state[:, rim], oil_residual[:, rim] = RUPTURED, cells.signed[:, rim]
        solid[:, rim], solid_residual[:, rim] = FREE, (cells.total - cells.oil)[:, rim]
    if problem.fixed is not None:
        state[problem.fixed], solid[problem.fixed] = RUPTURED, FREE
        oil_residual[problem.fixed] = solid_residual[problem.fixed] = 0.0


def _surplus(problem: Problem, film: Film, signed: Field) -> tuple[Field, Field]:
    """Return the content beyond the full film's and the derivative of all content.

    The surplus is negative in cavities; the derivative is in the signed unknown.
    """
    missing = np.minimum(signed, 0.0)
    pressed = signed > problem.p_cap
    density = film.content_by_gap
    surplus = film.content * missing
    by_growth = 0.0 if np.isinf(problem.p_cap) else density * problem.softness
    return surplus, np.where(signed < 0.0, film.content, np.where(pressed, by_growth, 0.0))


def _growth(problem: Problem, signed: Field) -> Field:
    """Return the permanent opening of the gap by oil at the cap."""
    excess = (
        np.maximum(signed - problem.p_cap, 0.0)
        if np.isfinite(problem.p_cap)
        else np.zeros_like(signed)
    )
    return excess * problem.softness


def has_thin_film(balance: MixedBalance) -> bool:
    """Return True for bodies that touch nowhere, with a film far thinner than their deflection."""
    least = float(np.min(balance.gap))
    return 0.0 < least < MIXED_SOLVER.thin_film and bool(np.all(balance.solid == FREE))


def limiter_slopes(balance: MixedBalance, dtype: Precision) -> tuple[Field, Field]:
    """Return derivatives of the limited correction in the own and, negative, the upstream content.

    The opening of cells is held constant. Both have shape (nx, ny).
    """
    content = balance.film.content
    by_own, by_upstream = np.empty((2, *content.shape), dtype)
    load_sharing.limiter_slopes(
        balance.limiter, content, upstream_content(balance.problem, content), by_own, by_upstream
    )
    return by_own, by_upstream


class ConservedOil(NamedTuple):
    """Derivatives of the surplus and of the gap where oil is conserved.

    They are those of the surplus in the signed unknown, everywhere and in cavities, of the
    permanent opening in the signed unknown, and of the surplus in the gap.
    """

    surplus_by_oil: Field
    missing_by_oil: Field
    growth_by_oil: Field
    surplus_by_gap: Field

    @classmethod
    def of_balance(cls, balance: MixedBalance, real: Precision) -> "ConservedOil | None":
        """Return the derivatives in a precision; None where oil is not conserved."""
        if balance.surplus_by_oil is None:
            return None
        signed, problem = balance.unknowns.oil, balance.problem
        single, zero = balance.surplus_by_oil.astype(real), real(0.0)
        pressed = (signed > problem.p_cap) & balance.solved
        return cls(
            single,
            np.where(signed < 0.0, single, zero),
            np.where(pressed, real(problem.softness), zero),
            (np.minimum(signed, 0.0) * balance.film.content_by_gap).astype(real),
        )
