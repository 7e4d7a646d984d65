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

from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np

from asperity.core.arrays import Codes, Field, Mask
from asperity.ehl.models.oil_advection import (
    OPENING_RANGE,
    advected_outflow,
    limiter_outflow,
    outflow_by_content,
    second_order_outflow,
    slope_limiter,
    upstream_content,
    upwind_at_outlet,
    uses_limiter,
)
from asperity.ehl.models.single_pressure import CLOSED_WITHIN, FIRST_ORDER, THIRD_ORDER, Problem
from asperity.kernels import load_sharing
from asperity.kernels.load_sharing import FREE, CellState, ContactBounds
from asperity.kernels.reynolds import (
    CAPPED,
    LUBRICATED,
    RUPTURED,
    TOUCHING,
    Faces,
    Film,
    Rows,
)
from asperity.lubricant import Lubricant


class Pressures(NamedTuple):
    """Unknowns: oil pressure q and total pressure P, both (nx, ny), and approach H0.

    Where oil is conserved, `oil` is signed: below 0 the missing share of the film (q = 0), above
    the cap the permanent opening of the gap (q = P_cap).
    """

    oil: Field
    total: Field
    approach: float


@dataclass(frozen=True, slots=True)
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
        nothing = np.zeros_like(self.gap)
        return nothing if self.surplus is None else _growth(self.problem, self.unknowns.oil)

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

    @property
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
    gap = problem.undeformed + problem.deflection(unknowns.total)
    gap += unknowns.approach
    return _evaluate(problem, unknowns, gap, second_order, freed, may_open=True)


def _evaluate(
    problem: Problem,
    unknowns: Pressures,
    gap: Field,
    second_order: bool,
    freed: Mask | None,
    *,
    may_open: bool,
) -> MixedBalance:
    """Evaluate at a given gap; again after opening cells, unless `may_open` is False."""
    signed, pressure, approach = unknowns
    assert problem.lubricant is not None
    closed, scale = problem.contact_gap, 1.0 / problem.softness
    bounds = ContactBounds(closed, scale, (1.0 + CLOSED_WITHIN) * closed, problem.p_cap)
    oil = np.clip(signed, 0.0, problem.p_cap)
    height = np.maximum(gap, closed) + _growth(problem, signed) if problem.conserve else gap
    film, faces, outflow, fluid_scale = _flow(problem, oil, height, problem.lubricant)
    limiter = (
        slope_limiter(problem, film.content, gap)
        if second_order and uses_limiter(problem)
        else np.zeros_like(gap)
    )
    surplus, surplus_by_oil = _surplus(problem, film, signed) if problem.conserve else (None, None)
    outflow += second_order_outflow(problem, film.content, limiter, second_order=second_order)
    if surplus is not None:
        outflow += advected_outflow(problem, surplus)
        upwind_at_outlet(problem, film.content, outflow)

    cells = CellState(signed, oil, pressure, gap, outflow, np.empty_like(gap))
    load_sharing.outflow_by_pressure(
        film, faces, outflow_by_content(problem), *problem.spacing, cells.own_outflow
    )
    freed = np.zeros(gap.shape, dtype=bool) if freed is None else freed
    opening_cells, sunk, sealed = np.empty((3, *gap.shape), dtype=bool)
    if load_sharing.mark_opening(cells, bounds, opening_cells) and may_open:
        unknowns = Pressures(
            np.where(opening_cells & (pressure > oil), pressure, signed), pressure, approach
        )
        return _evaluate(
            problem, unknowns, gap, second_order, freed | opening_cells, may_open=False
        )
    solid, solid_residual = np.empty(gap.shape, dtype=np.int8), np.empty_like(gap)
    if load_sharing.fill_contact_rows(
        cells, bounds, opening_cells, freed, solid, solid_residual, sunk
    ):
        lacking = np.where(sunk, film.content_by_gap * (gap - closed), 0.0)
        outflow += advected_outflow(problem, lacking) + limiter_outflow(
            problem, lacking, limiter, limiter
        )
    load_sharing.mark_sealed(cells, bounds, solid, sunk, fluid_scale, sealed)
    oil_residual, state = np.empty_like(gap), np.empty(gap.shape, dtype=np.int8)
    if surplus_by_oil is None:
        load_sharing.fill_oil_rows(cells, bounds, fluid_scale, oil_residual, state)
        load_sharing.fix_film_gap(sealed, film)
    else:
        film, fluid_scale, oil_residual, state = _conserving_rows(
            problem, film, signed, height, outflow, fluid_scale, surplus_by_oil, sealed
        )
    _fix_rows(problem, cells, state, solid, oil_residual, solid_residual)
    rows, left = Rows(state, fluid_scale, scale), (oil_residual, solid_residual)
    balance = MixedBalance(
        problem, unknowns, gap, *left, rows, solid, film, faces, limiter, outflow, sealed
    )
    return (
        replace(balance, surplus=surplus, surplus_by_oil=surplus_by_oil)
        if problem.conserve
        else balance
    )


def _conserving_rows(
    problem: Problem,
    film: Film,
    signed: Field,
    height: Field,
    outflow: Field,
    fluid_scale: Field,
    surplus_by_oil: Field,
    sealed: Mask,
) -> tuple[Film, Field, Field, Codes]:
    """Return film, scale, residual and state of the oil's equations where oil is conserved.

    The film of `sealed` cells is fixed, except where oil at the cap has opened it.
    """
    # a closed cell holds hardly any oil: its missing oil counts as the gap that would open it
    loose, lacks = (
        surplus_by_oil > 0.0,
        np.maximum(surplus_by_oil, problem.softness) * outflow_by_content(problem),
    )
    fluid_scale = np.where(loose, 1.0 / lacks, fluid_scale)
    oil_residual = outflow * fluid_scale
    state = np.where(signed < 0.0, RUPTURED, np.where(loose, CAPPED, LUBRICATED)).astype(np.int8)
    pressed = signed > problem.p_cap  # opened by the oil, not by the approach
    load_sharing.fix_film_gap(sealed & ~pressed, film)
    stiff = pressed & (film.log_mobility_by_gap == 0.0)
    film = film._replace(
        log_mobility_by_gap=np.where(stiff, -3.0 / height, film.log_mobility_by_gap)
    )
    return film, fluid_scale, oil_residual, state


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
    beyond = (
        np.maximum(signed - problem.p_cap, 0.0)
        if np.isfinite(problem.p_cap)
        else np.zeros_like(signed)
    )
    return beyond * problem.softness


def _flow(
    problem: Problem, oil: Field, gap: Field, lubricant: Lubricant
) -> tuple[Film, Faces, Field, Field]:
    """Return the flow with the wedge and the minimum mobility of this model."""
    wedge = THIRD_ORDER if problem.accurate else FIRST_ORDER
    return problem.flow(
        oil, gap, lubricant, wedge, least_mobility=problem.contact_gap**3 / problem.speed
    )


def limiter_slopes(balance: MixedBalance, dtype: Any) -> tuple[Field, Field]:
    """Return derivatives of the limited correction in the own and, negative, the upstream content.

    The opening of cells is held constant; see `opening_slopes`. Both (nx, ny).
    """
    content = balance.film.content
    own, by_upstream = np.empty((2, *content.shape), dtype)
    load_sharing.limiter_slopes(
        balance.limiter, content, upstream_content(balance.problem, content), own, by_upstream
    )
    return own, by_upstream


def opening_slopes(balance: MixedBalance, moved: Mask) -> tuple[Any, Any, Field]:
    """Return derivatives of the limited correction at eastern faces in the gap of opening cells.

    Faces, cells and slopes of the `moved` cells; faces and cells as flat indices, a cell once for
    its own face and once for the next one downstream.
    """
    problem, (_, ny) = balance.problem, balance.problem.cells
    gap, content, closed = balance.gap, balance.film.content.ravel(), problem.contact_gap
    cells = np.flatnonzero(moved & (gap > closed) & (gap < (1.0 + OPENING_RANGE) * closed))
    faces = np.concatenate([cells, cells + ny])
    inner = (faces >= ny) & (faces < content.size - ny)
    faces, cells = faces[inner], np.tile(cells, 2)[inner]
    here, upstream = content[faces], content[faces - ny]
    other = np.clip(
        (gap.ravel()[np.where(faces == cells, faces - ny, faces)] / closed - 1.0) / OPENING_RANGE,
        0.0,
        1.0,
    )
    leaning = upstream * here / (upstream**2 + here**2) * (here - upstream)
    return faces, cells, leaning * other / (OPENING_RANGE * closed)
