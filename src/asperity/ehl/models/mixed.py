"""The mixed contact with two pressures, on one grid, dimensionless: what each cell asks for.

The oil has a pressure q of its own, in every cell and so in those that touch too; the asperities
carry the rest of the total pressure P. With R the cell's net oil outflow in the film max(H, H_c),
its density and viscosity those of q:

    oil         max( min( q, R/J ),  q - P_cap ) = 0                  ruptured, lubricated, capped
    asperities  max( min( P - q, (H - H_c)/k ),  P - P_cap ) = 0      free, touching, capped

A closed cell's outflow is scaled by its own derivative, the film held: by that of an open one,
shut-in oil would count as balanced whatever its pressure. No cell moves its oil less easily than
ambient oil in the contact film. The wedge is first order, or second order that leans back where
the film's content jumps, as at the edge of a touching cell.

A closed cell that takes in more oil than even q = P drives out again is lifted: it gets q = P,
counts as free, and as long as its gap is still below H_c, what it lacks counts as oil that it
lacks. So its row asks for an open gap at once. Not so a cell so deep in plastic overlap that
lifting it would take more than the cap.

Where oil is conserved, R = 0 in every cell, and one signed unknown tells q, what is missing of the
film, and how far oil at the cap has pressed the gap open.
"""

from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np

from asperity.core.arrays import Codes, Field, Mask
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
    limited_outflow,
)
from asperity.lubricant import Lubricant

OPENING_RANGE = 0.5  # contact films of gap beyond the contact film


class Pressures(NamedTuple):
    """The unknowns: the oil's pressure q and the total pressure P, both (nx, ny), and the approach H0.

    Where oil is conserved, `oil` is signed: below 0 the share of the film that is missing (there q
    = 0), above the cap what presses the gap open for good (there q = P_cap).
    """

    oil: Field
    total: Field
    approach: float


@dataclass(frozen=True, slots=True)
class MixedBalance:
    """A problem evaluated at two pressures: gap, what is left of both equations, and what linearisation needs.

    `rows` are the oil's; `solid` says what decides a cell's total pressure: FREE, TOUCHING or
    CAPPED.
    """

    problem: Problem
    unknowns: Pressures
    # may be negative where the cap lets the bodies overlap: the depth of plastic flattening
    gap: Field
    oil_residual: Field
    solid_residual: Field
    rows: Rows
    solid: Codes
    film: Film
    faces: Faces
    limiter: Field
    outflow: Field  # net oil outflow per cell area
    sealed: Mask  # cells whose film does not change with the gap
    surplus: Field | None = (
        None  # content beyond the full film's, where oil is conserved: what is missing, negative
    )
    surplus_by_oil: Field | None = (
        None  # slope of all content; 0 where the film is full and below the cap
    )

    @property
    def solved(self) -> Mask:
        """Cells in which Reynolds' equation decides: where oil is conserved, all but the rim's."""
        if self.surplus is None:
            return np.asarray(self.rows.state == LUBRICATED)
        return np.broadcast_to(~self.problem.rim, self.gap.shape)

    @property
    def content(self) -> Field:
        """Oil over each cell, (nx, ny)."""
        return self.film.content if self.surplus is None else self.film.content + self.surplus

    @property
    def pressure(self) -> Field:
        """The total pressure, (nx, ny)."""
        return self.unknowns.total

    @property
    def limiter_correction(self) -> Field:
        """How far the wedge leans back from first order, in content, (nx, ny)."""
        return self.limiter * (self.film.content - _upstream(self.problem, self.film.content))

    @property
    def film_share(self) -> Field:
        """Share of the gap that is oil, (nx, ny): below 1 in cavities, where oil is conserved."""
        share = np.ones_like(self.gap)
        return share if self.surplus is None else share + np.minimum(self.unknowns.oil, 0.0)

    @property
    def growth(self) -> Field:
        """How far oil at the cap has pressed the gap open for good, where oil is conserved, (nx, ny)."""
        nothing = np.zeros_like(self.gap)
        return nothing if self.surplus is None else _growth(self.problem, self.unknowns.oil)

    @property
    def height(self) -> Field:
        """Gap between the bodies with what oil at the cap has added, no less than the contact film, (nx, ny)."""
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
        """Oil that cells lose and gain, in sum, over the throughflow: no less than what all lose together."""
        dx, dy = self.problem.spacing
        return float(np.abs(self.outflow[self.solved]).sum()) * dx * dy / abs(self.throughflow)

    @property
    def load_error(self) -> float:
        """Relative."""
        return self.problem.load_error(self.pressure)

    @property
    def residual_rms(self) -> float:
        """Root mean square of both equations, as a share of p_h."""
        return float(np.sqrt(np.mean(self.oil_residual**2) + np.mean(self.solid_residual**2)))

    @property
    def oil_pressure(self) -> Field:
        """What drives the oil, (nx, ny)."""
        return np.clip(self.unknowns.oil, 0.0, self.problem.p_cap)

    @property
    def parted(self) -> Mask:
        """Cells in which the bodies' pressure is the oil's."""
        return np.asarray(self.solid == FREE)

    @property
    def yielded(self) -> Mask:
        """Cells at the cap."""
        return np.asarray(self.pressure >= self.problem.p_cap)

    @property
    def in_contact(self) -> Mask:
        """Cells where the bodies touch: gap closed to the contact film, or flattened below it."""
        closed = self.gap <= (1.0 + CLOSED_WITHIN) * self.problem.contact_gap
        return np.asarray((self.solid == TOUCHING) | closed)


def evaluate(
    problem: Problem, unknowns: Pressures, *, second_order: bool, freed: Mask | None = None
) -> MixedBalance:
    """What is left of every equation; `freed` cells are taken as free whatever their gap.

    So are lifted ones, and the unknowns are changed where that takes it.
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
    signed, pressure, approach = unknowns
    assert problem.lubricant is not None
    closed, scale = problem.contact_gap, 1.0 / problem.softness
    bounds = ContactBounds(closed, scale, (1.0 + CLOSED_WITHIN) * closed, problem.p_cap)
    oil = np.clip(signed, 0.0, problem.p_cap)
    height = np.maximum(gap, closed) + _growth(problem, signed) if problem.conserve else gap
    film, faces, outflow, fluid_scale = _flow(problem, oil, height, problem.lubricant)
    limiter = (
        _limiter(problem, film.content, gap)
        if second_order and uses_limiter(problem)
        else np.zeros_like(gap)
    )
    surplus, surplus_by_oil = _surplus(problem, film, signed) if problem.conserve else (None, None)
    outflow += _second_order_outflow(problem, film.content, limiter, second_order=second_order)
    if surplus is not None:
        outflow += advected_outflow(problem, surplus)
        upwind_at_outlet(problem, film.content, outflow)

    cells = CellState(signed, oil, pressure, gap, outflow, np.empty_like(gap))
    load_sharing.outflow_by_pressure(
        film, faces, _outflow_by_content(problem), *problem.spacing, cells.own_outflow
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
        # a cell closed to the contact film holds next to no oil: what it lacks counts as what would
        # lift it
        loose, lacks = (
            surplus_by_oil > 0.0,
            np.maximum(surplus_by_oil, problem.softness) * _outflow_by_content(problem),
        )
        fluid_scale = np.where(loose, 1.0 / lacks, fluid_scale)
        oil_residual = outflow * fluid_scale
        state = np.where(signed < 0.0, RUPTURED, np.where(loose, CAPPED, LUBRICATED)).astype(
            np.int8
        )
        pressed = signed > problem.p_cap  # opened by the oil, not by the bodies' distance
        load_sharing.fix_film_gap(sealed & ~pressed, film)
        stiff = pressed & (film.log_mobility_by_gap == 0.0)
        film = film._replace(
            log_mobility_by_gap=np.where(stiff, -3.0 / height, film.log_mobility_by_gap)
        )
    if np.any(rim := problem.rim):
        state[:, rim], oil_residual[:, rim] = RUPTURED, signed[:, rim]
        solid[:, rim], solid_residual[:, rim] = FREE, (pressure - oil)[:, rim]
    if problem.fixed is not None:
        state[problem.fixed], solid[problem.fixed] = RUPTURED, FREE
        oil_residual[problem.fixed] = solid_residual[problem.fixed] = 0.0
    rows, left = Rows(state, fluid_scale, scale), (oil_residual, solid_residual)
    balance = MixedBalance(
        problem, unknowns, gap, *left, rows, solid, film, faces, limiter, outflow, sealed
    )
    return (
        replace(balance, surplus=surplus, surplus_by_oil=surplus_by_oil)
        if problem.conserve
        else balance
    )


def _surplus(problem: Problem, film: Film, signed: Field) -> tuple[Field, Field]:
    """Content beyond the full film's, negative in cavities, and the slope of all content in the signed unknown."""
    missing = np.minimum(signed, 0.0)
    pressed = signed > problem.p_cap
    density = film.content_by_gap
    surplus = film.content * missing
    by_growth = 0.0 if np.isinf(problem.p_cap) else density * problem.softness
    return surplus, np.where(signed < 0.0, film.content, np.where(pressed, by_growth, 0.0))


def _growth(problem: Problem, signed: Field) -> Field:
    beyond = (
        np.maximum(signed - problem.p_cap, 0.0)
        if np.isfinite(problem.p_cap)
        else np.zeros_like(signed)
    )
    return beyond * problem.softness


def _flow(
    problem: Problem, oil: Field, gap: Field, lubricant: Lubricant
) -> tuple[Film, Faces, Field, Field]:
    wedge = THIRD_ORDER if problem.accurate else FIRST_ORDER
    return problem.flow(
        oil, gap, lubricant, wedge, least_mobility=problem.contact_gap**3 / problem.speed
    )


def uses_limiter(problem: Problem) -> bool:
    """Whether the wedge leans back from first order: on smooth bodies it has its own, and borders of cavities jump."""
    return not problem.accurate and not problem.conserve


def _is_lagrangian(problem: Problem) -> bool:
    return problem.past is not None and problem.past.lagrangian


def _upstream(problem: Problem, content: Field) -> Field:
    """Of each cell, the content that its oil comes from: of followed oil, from a step before, (nx, ny)."""
    upstream = np.concatenate([content[:1], content[:-1]])
    if problem.past is not None and problem.past.upstream is not None:
        upstream[2:] = problem.past.upstream[2:]
    return upstream


def _limiter(problem: Problem, content: Field, gap: Field) -> Field:
    """Half of 2 m₁ m₂/(m₁² + m₂²) of each cell and what is upstream of it, (nx, ny): 1/2 where the film is even.

    Less beside cells that are nearly closed, and nothing beside closed ones: there the film is
    even, and its content the oil's density.
    """
    closed, limiter = problem.contact_gap, np.empty_like(content)
    load_sharing.limiter(
        content, _upstream(problem, content), gap, closed, OPENING_RANGE * closed, limiter
    )
    return limiter


def limiter_slopes(balance: MixedBalance, dtype: Any) -> tuple[Field, Field]:
    """How far the wedge leans for a change of each cell's content, and back for one of that upstream, both (nx, ny).

    How open the cells are is held, see `opening_slopes`.
    """
    content = balance.film.content
    own, by_upstream = np.empty((2, *content.shape), dtype)
    load_sharing.limiter_slopes(
        balance.limiter, content, _upstream(balance.problem, content), own, by_upstream
    )
    return own, by_upstream


def opening_slopes(balance: MixedBalance, moved: Mask) -> tuple[Any, Any, Field]:
    """How the wedge leans more at some eastern faces as some of the `moved` cells open: faces, cells and slopes.

    Both as flat indices of cells, a cell once for its own face and once for the next one
    downstream.
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


def _second_order_outflow(
    problem: Problem, content: Field, limiter: Field, *, second_order: bool
) -> Field:
    """What the wedge's second order adds to each cell's outflow, (nx, ny)."""
    if not _is_lagrangian(problem):
        return limiter_outflow(problem, content, limiter, limiter)
    assert problem.past is not None
    added = limiter * (content - _upstream(problem, content)) / problem.spacing[0]
    limiter_correction = problem.past.limiter_correction
    return (
        added - limiter_correction / problem.spacing[0]
        if second_order and limiter_correction is not None
        else added
    )


def limiter_outflow(problem: Problem, content: Field, own: Field, upstream: Field) -> Field:
    """What second order adds to each cell's outflow for a content on top of the film's own, (nx, ny).

    The wedge leans by `own` of a cell's content less `upstream` of that before it: the lean
    itself, or its slopes.
    """
    if _is_lagrangian(problem):
        return own * content * content.dtype.type(1.0 / problem.spacing[0])
    added = np.empty_like(content)
    limited_outflow(content, own, upstream, problem.spacing[0], added)
    return added


def advected_outflow(problem: Problem, content: Field) -> Field:
    """What each cell gains and passes on of a content that moves with the oil, upwind to first order, (nx, ny)."""
    past, dx = problem.past, problem.spacing[0]
    if past is None or not past.lagrangian:
        outflow = content.copy()
        outflow[1:] -= content[:-1]
        outflow /= dx
    else:
        outflow = np.zeros_like(content)
        if not problem.conserve:
            outflow[0], outflow[1] = content[0] / dx, (content[1] - content[0]) / dx
    return outflow if past is None else outflow + past.rate * content


def upwind_at_outlet(problem: Problem, content: Field, outflow: Field) -> None:
    """Take the film's last face, which leans, back to first order: where oil is missing, all of it has to be upwind."""
    if not _is_lagrangian(problem):
        dx = problem.spacing[0]
        outflow[-1] -= (content[-1] - content[-2]) * content.dtype.type(0.5 / dx)


def _outflow_by_content(problem: Problem) -> float:
    """Derivative of a cell's outflow by its own content."""
    past = problem.past
    wedge = 0.0 if past is not None and past.lagrangian else 1.0 / problem.spacing[0]
    return wedge if past is None else wedge + past.rate
