"""Which of oil and asperities bears a cell, cell by cell; see `asperity.ehl.models.mixed` for the equations.

All in double precision; knows no oil and no tolerance.
"""

from typing import NamedTuple

import numpy as np

from asperity.core.arrays import Codes, Field, Mask
from asperity.kernels.compiled import njit
from asperity.kernels.reynolds import CAPPED, LUBRICATED, RUPTURED, TOUCHING, Faces, Film

FREE = LUBRICATED  # code of a cell in which the oil's pressure is the total one


class Borne(NamedTuple):
    """Pressures and gap of each cell, what flows out of it and how that grows with its own pressure, its film held."""

    signed: Field  # the oil's unknown
    oil: Field
    total: Field
    gap: Field
    outflow: Field
    own_outflow: Field


class Bounds(NamedTuple):
    """What closes a cell and what bears the most: contact film, compliance of a cell, and cap."""

    contact_gap: float
    contact_scale: float
    closed_gap: float  # below which a cell counts as closed
    p_cap: float


@njit(cache=True, error_model="numpy")
def own_outflows(
    film: Film, faces: Faces, carried: float, dx: float, dy: float, out: Field
) -> None:
    """Derivative of each cell's net outflow by its own pressure, its film held; `carried` is that by its content."""
    nx, ny = out.shape
    for i in range(nx):
        for j in range(ny):
            east = faces.east[i, j] if i < nx - 1 else 2.0 * faces.east[i, j]
            west = faces.east[i - 1, j] if i > 0 else 2.0 * faces.inlet[j]
            across = faces.north[i, j] + faces.north[i, j - 1 if j > 0 else ny - 1]
            out[i, j] = (
                (east + west) / (dx * dx)
                + across / (dy * dy)
                + film.content_by_pressure[i, j] * carried
            )


@njit(cache=True, error_model="numpy")
def lean(
    content: Field, upstream: Field, gap: Field, closed: float, opens: float, out: Field
) -> None:
    """Half of 2 m₁ m₂/(m₁² + m₂²) of each cell's content m₂ and that upstream, m₁.

    Less where a gap is less than `opens` beyond `closed`; 0 in the first cells along x.
    """
    nx, ny = content.shape
    out[0] = 0.0
    for i in range(1, nx):
        for j in range(ny):
            here, before = content[i, j], upstream[i, j]
            opened = min(max((gap[i, j] - closed) / opens, 0.0), 1.0)
            opened *= min(max((gap[i - 1, j] - closed) / opens, 0.0), 1.0)
            out[i, j] = before * here / (before * before + here * here) * opened


@njit(cache=True)
def _pressing(cells: Borne, bounds: Bounds, i: int, j: int) -> tuple[float, float]:
    """How far a cell is open, as a pressure, and what the asperities bear of its total one."""
    touching = (cells.gap[i, j] - bounds.contact_gap) * bounds.contact_scale
    return touching, cells.total[i, j] - cells.oil[i, j]


@njit(cache=True)
def lift(cells: Borne, bounds: Bounds, lifted: Mask) -> bool:
    """Mark closed cells that take in more oil than drives out again; whether the oil of one bears less than the total.

    Not those so deep in overlap that lifting them alone would take more than the cap.
    """
    nx, ny = lifted.shape
    found = False
    for i in range(nx):
        for j in range(ny):
            total, (touching, borne) = cells.total[i, j], _pressing(cells, bounds, i, j)
            lifted[i, j] = (
                borne >= touching
                and total - touching <= bounds.p_cap
                and cells.outflow[i, j] + borne * cells.own_outflow[i, j] < 0.0
                and cells.signed[i, j] >= 0.0
            )
            found = found or (lifted[i, j] and borne > 0.0)
    return found


@njit(cache=True)
def settle(
    cells: Borne,
    bounds: Bounds,
    lifted: Mask,
    freed: Mask,
    solid: Codes,
    residual: Field,
    sunk: Mask,
) -> bool:
    """Fill in what decides each cell's total pressure, and what is left of its equation; whether a free cell is sunk.

    That is a free cell whose gap is still below the contact film. `freed` ones are free whatever
    their gap, and those `lifted` where the oil bears it all.
    """
    nx, ny = residual.shape
    found = False
    for i in range(nx):
        for j in range(ny):
            total, (touching, borne) = cells.total[i, j], _pressing(cells, bounds, i, j)
            free = borne < touching or freed[i, j] or (lifted[i, j] and borne <= 0.0)
            left, beyond = borne if free else touching, total - bounds.p_cap
            capped = beyond > left
            residual[i, j] = beyond if capped else left
            solid[i, j] = CAPPED if capped else (FREE if free else TOUCHING)
            sunk[i, j] = free and not capped and touching < 0.0 and total - touching <= bounds.p_cap
            found = found or sunk[i, j]
    return found


@njit(cache=True, error_model="numpy")
def shut_in(
    cells: Borne, bounds: Bounds, solid: Codes, sunk: Mask, scale: Field, shut: Mask
) -> None:
    """Mark cells whose film does not change with the gap; closed ones have their rows scaled with their film held."""
    nx, ny = scale.shape
    for i in range(nx):
        for j in range(ny):
            closed = solid[i, j] != FREE and cells.gap[i, j] <= bounds.closed_gap
            shut[i, j] = closed or (cells.gap[i, j] <= bounds.contact_gap and not sunk[i, j])
            if closed:
                scale[i, j] = 1.0 / cells.own_outflow[i, j]


@njit(cache=True)
def refilled(cells: Borne, bounds: Bounds, scale: Field, residual: Field, state: Codes) -> None:
    """Fill in what is left of the oil's equations, and which of them decides, where cavities are refilled."""
    nx, ny = residual.shape
    for i in range(nx):
        for j in range(ny):
            balanced, oil = cells.outflow[i, j] * scale[i, j], cells.oil[i, j]
            left, code = (balanced, LUBRICATED) if balanced < oil else (oil, RUPTURED)
            if oil - bounds.p_cap > left:
                left, code = oil - bounds.p_cap, CAPPED
            residual[i, j], state[i, j] = left, code


@njit(cache=True)
def hold_film(held: Mask, film: Film) -> None:
    """Fix a film's gap in some cells, in place."""
    nx, ny = held.shape
    for i in range(nx):
        for j in range(ny):
            if held[i, j]:
                film.content_by_gap[i, j] = film.log_mobility_by_gap[i, j] = 0.0
    for j in range(ny):
        if held[0, j]:
            film.ambient_by_gap[0, j] = 0.0
        if held[nx - 1, j]:
            film.ambient_by_gap[1, j] = 0.0


@njit(cache=True, error_model="numpy")
def lean_slopes(
    lean: Field, content: Field, upstream: Field, own: Field, by_upstream: Field
) -> None:
    """How far the wedge leans for a change of each cell's content, and back for one of that upstream.

    Of m₁ m₂/(m₁² + m₂²) (m₂ - m₁); in the precision of what is filled in.
    """
    nx, ny = lean.shape
    for i in range(nx):
        for j in range(ny):
            here, before = content[i, j], upstream[i, j]
            bend = (
                (here - before)
                * (here - before)
                * (here + before)
                / (here * here + before * before)
            )
            own[i, j], by_upstream[i, j] = (
                lean[i, j] * (1.0 - bend / here),
                lean[i, j] * (1.0 - bend / before),
            )


@njit(cache=True)
def fill_streaks(
    gap: Field,
    closed_gap: float,
    solid: Codes,
    rim: Mask,
    balanced: tuple[Field, Field],
    state: Codes,
    residual: Field,
) -> None:
    """Take closed cells at the cap for lubricated as far down the stream as oil fills those before, in place.

    `balanced` is the outflow and its scale, which tell what is left of such a cell's equation.
    """
    outflow, scale = balanced
    nx, ny = gap.shape
    fills = np.zeros(ny, np.bool_)  # those of the cells before that hand oil on
    for i in range(nx):
        for j in range(ny):
            shut = solid[i, j] == CAPPED and gap[i, j] <= closed_gap
            own = state[i, j] == LUBRICATED and residual[i, j] < 0.0
            fills[j] = shut and (own or fills[j])
            if fills[j] and state[i, j] == RUPTURED and not rim[j]:
                state[i, j], residual[i, j] = LUBRICATED, outflow[i, j] * scale[i, j]
