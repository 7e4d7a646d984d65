"""Load sharing of oil and asperities, cell by cell; see `asperity.ehl.models.mixed`.

All in double precision; knows no lubricant and no tolerance.
"""

from typing import NamedTuple

import numpy as np

from asperity.core.arrays import Codes, Field, Mask
from asperity.kernels.compiled import njit
from asperity.kernels.reynolds import CAPPED, LUBRICATED, RUPTURED, TOUCHING, Faces, Film

FREE = LUBRICATED  # code of a cell without asperity pressure


class CellState(NamedTuple):
    """Pressures, gap and net outflow of each cell.

    `own_outflow` is the derivative of the outflow in the cell's pressure at fixed film.
    """

    signed: Field  # signed unknown of the oil
    oil: Field
    total: Field
    gap: Field
    outflow: Field
    own_outflow: Field


class ContactBounds(NamedTuple):
    """Contact film, stiffness of a cell and pressure cap."""

    contact_gap: float
    contact_scale: float
    closed_gap: float  # a cell with at most this gap counts as closed
    p_cap: float


@njit(cache=True)
def outflow_by_pressure(
    film: Film, faces: Faces, outflow_by_content: float, dx: float, dy: float, out: Field
) -> None:
    """Fill `out` with the derivative of each cell's net outflow in its pressure at fixed film.

    `outflow_by_content` is the derivative in its content.
    """
    nx, ny = out.shape
    for i in range(nx):
        for j in range(ny):
            east = faces.east[i, j] if i < nx - 1 else 2.0 * faces.east[i, j]
            west = faces.east[i - 1, j] if i > 0 else 2.0 * faces.inlet[j]
            across = faces.north[i, j] + faces.north[i, j - 1 if j > 0 else ny - 1]
            out[i, j] = (
                (east + west) / (dx * dx)
                + across / (dy * dy)
                + film.content_by_pressure[i, j] * outflow_by_content
            )


@njit(cache=True)
def limiter(
    content: Field, upstream: Field, gap: Field, closed: float, opening_range: float, out: Field
) -> None:
    """Fill `out` with the slope limiter m₁ m₂/(m₁² + m₂²) of the wedge, m₁ upstream of m₂.

    It falls linearly to zero where a gap is less than `opening_range` above `closed`, and is zero
    in the first cells along x.
    """
    nx, ny = content.shape
    out[0] = 0.0
    for i in range(1, nx):
        for j in range(ny):
            here, before = content[i, j], upstream[i, j]
            opened = min(max((gap[i, j] - closed) / opening_range, 0.0), 1.0)
            opened *= min(max((gap[i - 1, j] - closed) / opening_range, 0.0), 1.0)
            out[i, j] = before * here / (before * before + here * here) * opened


@njit(cache=True)
def _contact_excess(cells: CellState, bounds: ContactBounds, i: int, j: int) -> tuple[float, float]:
    """Return the gap beyond contact as a pressure, and the asperity pressure."""
    touching = (cells.gap[i, j] - bounds.contact_gap) * bounds.contact_scale
    return touching, cells.total[i, j] - cells.oil[i, j]


@njit(cache=True)
def mark_opening(cells: CellState, bounds: ContactBounds, opening: Mask) -> bool:
    """Mark closed cells that gain more oil than drains at the full pressure.

    Excludes cells whose overlap is so deep that lifting them would take more than the cap. Returns
    whether any marked cell still has asperity pressure.
    """
    nx, ny = opening.shape
    any_found = False
    for i in range(nx):
        for j in range(ny):
            total, (touching, asperity_pressure) = (
                cells.total[i, j],
                _contact_excess(cells, bounds, i, j),
            )
            opening[i, j] = (
                asperity_pressure >= touching
                and total - touching <= bounds.p_cap
                and cells.outflow[i, j] + asperity_pressure * cells.own_outflow[i, j] < 0.0
                and cells.signed[i, j] >= 0.0
            )
            any_found = any_found or (opening[i, j] and asperity_pressure > 0.0)
    return any_found


@njit(cache=True)
def fill_contact_rows(
    cells: CellState,
    bounds: ContactBounds,
    opening: Mask,
    freed: Mask,
    solid: Codes,
    residual: Field,
    sunk: Mask,
) -> bool:
    """Fill the state and the residual of each cell's total pressure.

    `freed` cells are free whatever their gap, and so are `opening` ones without asperity pressure.
    Marks in `sunk` free cells with a gap below the contact film, and returns whether there are any.
    """
    nx, ny = residual.shape
    any_found = False
    for i in range(nx):
        for j in range(ny):
            total, (touching, asperity_pressure) = (
                cells.total[i, j],
                _contact_excess(cells, bounds, i, j),
            )
            free = (
                asperity_pressure < touching
                or freed[i, j]
                or (opening[i, j] and asperity_pressure <= 0.0)
            )
            excess, cap_excess = asperity_pressure if free else touching, total - bounds.p_cap
            capped = cap_excess > excess
            residual[i, j] = cap_excess if capped else excess
            solid[i, j] = CAPPED if capped else (FREE if free else TOUCHING)
            sunk[i, j] = free and not capped and touching < 0.0 and total - touching <= bounds.p_cap
            any_found = any_found or sunk[i, j]
    return any_found


@njit(cache=True)
def mark_sealed(
    cells: CellState, bounds: ContactBounds, solid: Codes, sunk: Mask, scale: Field, sealed: Mask
) -> None:
    """Mark cells whose film does not depend on the gap.

    The rows of closed cells are rescaled at fixed film, in place.
    """
    nx, ny = scale.shape
    for i in range(nx):
        for j in range(ny):
            closed = solid[i, j] != FREE and cells.gap[i, j] <= bounds.closed_gap
            sealed[i, j] = closed or (cells.gap[i, j] <= bounds.contact_gap and not sunk[i, j])
            if closed:
                scale[i, j] = 1.0 / cells.own_outflow[i, j]


@njit(cache=True)
def fill_oil_rows(
    cells: CellState, bounds: ContactBounds, scale: Field, residual: Field, state: Codes
) -> None:
    """Fill residual and state of the oil's equations, with refilled cavities."""
    nx, ny = residual.shape
    for i in range(nx):
        for j in range(ny):
            balanced, oil = cells.outflow[i, j] * scale[i, j], cells.oil[i, j]
            excess, code = (balanced, LUBRICATED) if balanced < oil else (oil, RUPTURED)
            if oil - bounds.p_cap > excess:
                excess, code = oil - bounds.p_cap, CAPPED
            residual[i, j], state[i, j] = excess, code


@njit(cache=True)
def fix_film_gap(fixed: Mask, film: Film) -> None:
    """Set a film's derivatives in the gap to zero in the cells of `fixed`, in place."""
    nx, ny = fixed.shape
    for i in range(nx):
        for j in range(ny):
            if fixed[i, j]:
                film.content_by_gap[i, j] = film.log_mobility_by_gap[i, j] = 0.0
    for j in range(ny):
        if fixed[0, j]:
            film.ambient_by_gap[0, j] = 0.0
        if fixed[nx - 1, j]:
            film.ambient_by_gap[1, j] = 0.0


@njit(cache=True)
def limiter_slopes(
    limiter: Field, content: Field, upstream: Field, own: Field, by_upstream: Field
) -> None:
    """Fill the derivatives of m₁ m₂/(m₁² + m₂²) (m₂ - m₁) in m₂ and, negative, in m₁.

    In the precision of the output arrays.
    """
    nx, ny = limiter.shape
    for i in range(nx):
        for j in range(ny):
            here, before = content[i, j], upstream[i, j]
            curvature = (
                (here - before)
                * (here - before)
                * (here + before)
                / (here * here + before * before)
            )
            own[i, j], by_upstream[i, j] = (
                limiter[i, j] * (1.0 - curvature / here),
                limiter[i, j] * (1.0 - curvature / before),
            )


@njit(cache=True)
def extend_lubrication(
    gap: Field,
    closed_gap: float,
    solid: Codes,
    rim: Mask,
    balanced: tuple[Field, Field],
    state: Codes,
    residual: Field,
) -> None:
    """Mark closed cells at the cap as lubricated downstream of filled ones, in place.

    `balanced` is the outflow and its scale, which give the residual of such a cell.
    """
    outflow, scale = balanced
    nx, ny = gap.shape
    fills = np.zeros(ny, np.bool_)  # upstream cells that pass oil on
    for i in range(nx):
        for j in range(ny):
            sealed = solid[i, j] == CAPPED and gap[i, j] <= closed_gap
            own = state[i, j] == LUBRICATED and residual[i, j] < 0.0
            fills[j] = sealed and (own or fills[j])
            if fills[j] and state[i, j] == RUPTURED and not rim[j]:
                state[i, j], residual[i, j] = LUBRICATED, outflow[i, j] * scale[i, j]
