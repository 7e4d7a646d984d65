"""Linearised Reynolds equation as compact stencils, for approximate inverses; see `reynolds`.

All arrays of a call share one precision, which is also that of the arithmetic.
"""

from typing import NamedTuple

import numpy as np

from asperity.core.arrays import Field
from asperity.kernels.compiled import njit
from asperity.kernels.reynolds import LUBRICATED, TOUCHING, Faces, Film, Rows


class Stencil(NamedTuple):
    """Five-point approximation of the scaled Jacobian: cell, both x and both y neighbours."""

    centre: Field
    west: Field
    east: Field
    north: Field
    south: Field


class OuterNeighbours(NamedTuple):
    """Stencil entries of the cells two away along x; shape (0, 0) for five-point stencils."""

    west: Field
    east: Field


@njit(cache=True)
def local_stencil(
    rows: Rows,
    film: Film,
    faces: Faces,
    compliance: Field,
    spacing: tuple[float, float],
    storing: float,
    out: Stencil,
) -> None:
    """Fill the five-point approximation of the scaled Jacobian, in the precision of `out`.

    `compliance` holds the compliance of cells 0, 1, 2 along x and, last, that of the first far
    cell.
    """
    nx, ny = out.centre.shape
    real = out.centre.dtype.type
    zero, unity, two, storing_rate = real(0.0), real(1.0), real(2.0), real(storing)
    dx, dy = spacing
    over_dx, over_dx2, over_dy2 = real(1.0 / dx), real(1.0 / (dx * dx)), real(1.0 / (dy * dy))
    compliance0, compliance1, compliance2 = (
        real(compliance[0]),
        real(compliance[1]),
        real(compliance[2]),
    )
    touching_own = real((compliance[0] - compliance[3]) * rows.contact_scale)
    touching_next = real((compliance[1] - compliance[3]) * rows.contact_scale)
    m_h, m_p = film.content_by_gap, film.content_by_pressure
    across = np.empty(ny + 1, out.centre.dtype)  # conductances of the y faces, south to north
    for i in range(nx):
        west_of, at_inlet, at_outlet = max(i - 1, 0), i == 0, i == nx - 1
        for j in range(ny):
            across[j + 1] = over_dy2 * faces.north[i, j]
        across[0] = across[ny]
        for j in range(ny):
            wet, touching = rows.state[i, j] == LUBRICATED, rows.state[i, j] == TOUCHING
            here, above = m_h[i, j], m_h[west_of, j]
            above_p = zero if at_inlet else m_p[west_of, j]
            scale = rows.fluid_scale[i, j]
            east = over_dx2 * (two * faces.east[i, j] if at_outlet else faces.east[i, j])
            west = over_dx2 * (two * faces.inlet[j] if at_inlet else faces.east[west_of, j])
            wedge = here * compliance0 - above * compliance1 + m_p[i, j]
            own_stored, next_stored = (
                storing_rate * (here * compliance0 + m_p[i, j]),
                storing_rate * here * compliance1,
            )
            centre = (
                east + west + across[j] + across[j + 1] + wedge * over_dx + own_stored
            ) * scale
            upstream = (
                -west + (here * compliance1 - above * compliance0 - above_p) * over_dx + next_stored
            ) * scale
            downstream = (
                -east + (here * compliance1 - above * compliance2) * over_dx + next_stored
            ) * scale
            out.centre[i, j] = centre if wet else (touching_own if touching else unity)
            out.west[i, j] = upstream if wet else (touching_next if touching else zero)
            out.east[i, j] = downstream if wet else (touching_next if touching else zero)
            out.north[i, j] = -across[j + 1] * scale if wet else zero
            out.south[i, j] = -across[j] * scale if wet else zero


@njit(cache=True, fastmath={"reassoc", "contract", "arcp"}, inline="always")
def _fill_north_slopes(
    faces: Faces,
    pressure: Field,
    slope: Field,
    i: int,
    over_dy2: np.floating,
    across: Field,
    over: Field,
) -> None:
    """Fill the derivatives of the flow through each north face of row `i` in both its cells.

    `slope` holds those of the log mobility in pressure, by the pressure itself and by the gap.
    """
    ny = pressure.shape[1]
    for j in range(ny):
        jn = j + 1 if j < ny - 1 else faces.behind
        through, pressure_gradient = (
            over_dy2 * faces.north[i, j],
            over_dy2 * (pressure[i, j] - pressure[i, jn]),
        )
        by_own = faces.north_by_own[i, j] * slope[0, j] + faces.north_by_own_gap[i, j] * slope[1, j]
        by_next = (
            faces.north_by_next[i, j] * slope[0, jn] + faces.north_by_next_gap[i, j] * slope[1, jn]
        )
        across[j], over[j] = (
            through + pressure_gradient * by_own,
            pressure_gradient * by_next - through,
        )


@njit(cache=True, fastmath={"reassoc", "contract", "arcp"}, inline="always")
def _add_south_faces(
    rows: Rows,
    faces: Faces,
    i: int,
    over_dy2: np.floating,
    across: Field,
    over: Field,
    out: Stencil,
) -> None:
    """Complete row `i` of a stencil with the flow through the south faces."""
    zero, ny = out.centre.dtype.type(0.0), across.size
    for j in range(1, ny):
        scale = rows.fluid_scale[i, j] if rows.state[i, j] == LUBRICATED else zero
        out.centre[i, j] -= scale * over[j - 1]
        out.south[i, j] = -scale * across[j - 1]
    scale = rows.fluid_scale[i, 0] if rows.state[i, 0] == LUBRICATED else zero
    last = ny - 1
    before, beyond = (
        (over[last], across[last]) if faces.behind == 0 else _first_line(faces, i, over_dy2)
    )
    out.centre[i, 0] -= scale * before
    out.south[i, 0] = -scale * beyond


@njit(cache=True, fastmath={"reassoc", "contract", "arcp"})
def own_stencil(
    rows: Rows,
    film: Film,
    faces: Faces,
    pressure: Field,
    compliance: float,
    spacing: tuple[float, float],
    out: Stencil,
) -> None:
    """Fill a stencil of the scaled Jacobian whose gaps follow only their own cell's pressure.

    `compliance` is that of a cell on itself; the wedge is of first order, and mobilities of inner
    faces follow pressure and gap. Rows other than lubricated ones are identity rows. In the
    precision of `out`.
    """
    nx, ny = pressure.shape
    real = out.centre.dtype.type
    zero, unity, two = real(0.0), real(1.0), real(2.0)
    over_dx = real(1.0 / spacing[0])
    over_dx2, over_dy2 = real(1.0 / spacing[0] ** 2), real(1.0 / spacing[1] ** 2)
    own = real(compliance)
    m_h, m_p, log_h, log_p = (
        film.content_by_gap,
        film.content_by_pressure,
        film.log_mobility_by_gap,
        film.log_mobility_by_pressure,
    )
    slope, slope_next = np.empty((2, ny), out.centre.dtype), np.empty((2, ny), out.centre.dtype)
    carried = np.empty(ny, out.centre.dtype)
    # derivatives of the flow through the east, west and north faces in the cells on both sides
    by_here, by_east, by_before, by_west, across, over = np.zeros((6, ny), out.centre.dtype)
    for j in range(ny):
        slope_next[0, j], slope_next[1, j] = log_p[0, j], own * log_h[0, j]
        by_west[j] = -two * over_dx2 * faces.inlet[j]
    for i in range(nx):
        for j in range(ny):
            slope[0, j], slope[1, j] = slope_next[0, j], slope_next[1, j]
            carried[j] = over_dx * (own * m_h[i, j] + m_p[i, j])
        if i < nx - 1:
            for j in range(ny):
                slope_next[0, j], slope_next[1, j] = log_p[i + 1, j], own * log_h[i + 1, j]
                through = over_dx2 * faces.east[i, j]
                pressure_gradient = over_dx2 * (pressure[i, j] - pressure[i + 1, j])
                by_own = (
                    faces.east_by_own[i, j] * slope[0, j]
                    + faces.east_by_own_gap[i, j] * slope[1, j]
                )
                by_next = (
                    faces.east_by_next[i, j] * slope_next[0, j]
                    + faces.east_by_next_gap[i, j] * slope_next[1, j]
                )
                by_here[j] = through + pressure_gradient * by_own
                by_east[j] = pressure_gradient * by_next - through
        else:
            for j in range(ny):
                by_here[j], by_east[j] = two * over_dx2 * faces.east[i, j], zero
        _fill_north_slopes(faces, pressure, slope, i, over_dy2, across, over)
        for j in range(ny):
            wet = rows.state[i, j] == LUBRICATED
            scale = rows.fluid_scale[i, j] if wet else zero
            out.centre[i, j] = (
                scale * (by_here[j] - by_west[j] + across[j] + carried[j]) if wet else unity
            )
            out.west[i, j] = -scale * by_before[j]
            out.east[i, j] = scale * by_east[j]
            out.north[i, j] = scale * over[j]
        _add_south_faces(rows, faces, i, over_dy2, across, over, out)
        for j in range(ny):
            by_before[j], by_west[j] = by_here[j] + carried[j], by_east[j]


@njit(cache=True)
def _first_line(faces: Faces, i: int, over_dy2: np.floating) -> tuple[np.floating, np.floating]:
    """Return derivatives of the flow into the first line where y is not periodic.

    No Reynolds equation holds in that line.
    """
    through = over_dy2 * faces.north[i, faces.north.shape[1] - 1]
    return -through, through


@njit(cache=True, fastmath={"reassoc", "contract", "arcp"})
def wedge_stencil(
    rows: Rows,
    film: Film,
    faces: Faces,
    pressure: Field,
    compliance: tuple[float, float],
    spacing: tuple[float, float],
    out: Stencil,
    far: OuterNeighbours,
) -> None:
    """Fill a stencil of the scaled Jacobian that includes wedge and mobility derivatives.

    A gap follows the pressure of its own cell and of its neighbours along x, by the two values of
    `compliance`; across x its own only. In the precision of `out`; the entry of the wedge three
    cells upstream is dropped.
    """
    nx, ny = pressure.shape
    real = out.centre.dtype.type
    n0, n1, over_dx, over_dy2 = (
        real(compliance[0]),
        real(compliance[1]),
        real(1.0 / spacing[0]),
        real(1.0 / spacing[1] ** 2),
    )
    # derivatives of the flow through a face in gap and pressure of the cells upstream, here and
    # downstream (`by_gap`, `by_pressure`), and in the pressures of the cells -2 ... 2 from here:
    # east face (`flow`) and west face (`before`)
    by_gap, by_pressure = np.zeros((3, ny), out.centre.dtype), np.zeros((3, ny), out.centre.dtype)
    flow, before = np.zeros((5, ny), out.centre.dtype), np.zeros((5, ny), out.centre.dtype)
    for i in range(-1, nx):
        if i < 0:
            _fill_inlet_slopes(film, faces, pressure, over_dx, by_gap, by_pressure)
        elif i == nx - 1:
            _fill_outlet_slopes(film, faces, pressure, over_dx, by_gap, by_pressure)
        else:
            _fill_east_slopes(film, faces, pressure, over_dx, i, by_gap, by_pressure)
        for j in range(ny):
            flow[0, j] = n1 * by_gap[0, j]
            flow[1, j] = n0 * by_gap[0, j] + n1 * by_gap[1, j] + by_pressure[0, j]
            flow[2, j] = n1 * (by_gap[0, j] + by_gap[2, j]) + n0 * by_gap[1, j] + by_pressure[1, j]
            flow[3, j] = n1 * by_gap[1, j] + n0 * by_gap[2, j] + by_pressure[2, j]
            flow[4, j] = n1 * by_gap[2, j]
        if i >= 0:
            _fill_wedge_row(rows, flow, before, over_dx, i, out, far)
        if i >= 0 and ny > 1:
            _add_across(rows, film, faces, pressure, n0, over_dy2, i, out)
        flow, before = before, flow


@njit(cache=True, fastmath={"reassoc", "contract", "arcp"}, inline="always")
def _fill_wedge_row(
    rows: Rows,
    flow: Field,
    before: Field,
    over_dx: np.floating,
    i: int,
    out: Stencil,
    far: OuterNeighbours,
) -> None:
    """Fill row `i` of a stencil from derivatives of the flows through its east and west faces."""
    nx, ny = out.centre.shape
    real = out.centre.dtype.type
    zero, unity = real(0.0), real(1.0)
    first, second = real(i > 0) * over_dx, real(i > 1) * over_dx
    last, last_but_one = real(i < nx - 1) * over_dx, real(i < nx - 2) * over_dx
    for j in range(ny):
        wet = rows.state[i, j] == LUBRICATED
        scale = rows.fluid_scale[i, j] if wet else zero
        far.west[i, j] = second * scale * (flow[0, j] - before[1, j])
        out.west[i, j] = first * scale * (flow[1, j] - before[2, j])
        out.centre[i, j] = over_dx * scale * (flow[2, j] - before[3, j]) if wet else unity
        out.east[i, j] = last * scale * (flow[3, j] - before[4, j])
        far.east[i, j] = last_but_one * scale * flow[4, j]
        out.north[i, j], out.south[i, j] = zero, zero


@njit(cache=True, fastmath={"reassoc", "contract", "arcp"})
def _fill_inlet_slopes(
    film: Film,
    faces: Faces,
    pressure: Field,
    over_dx: np.floating,
    by_gap: Field,
    by_pressure: Field,
) -> None:
    """Fill derivatives of the flow through the inlet faces in the next cell."""
    two, log_p = pressure.dtype.type(2.0), film.log_mobility_by_pressure
    for j in range(pressure.shape[1]):
        end_gradient = over_dx * pressure[0, j]
        by_gap[2, j] = film.content_by_gap[0, j] - end_gradient * (
            film.mobility[0, j] * film.log_mobility_by_gap[0, j] + film.ambient_by_gap[0, j]
        )
        by_pressure[2, j] = (
            -two * over_dx * faces.inlet[j] - end_gradient * film.mobility[0, j] * log_p[0, j]
        )


@njit(cache=True, fastmath={"reassoc", "contract", "arcp"})
def _fill_outlet_slopes(
    film: Film,
    faces: Faces,
    pressure: Field,
    over_dx: np.floating,
    by_gap: Field,
    by_pressure: Field,
) -> None:
    """Fill derivatives of the flow through the outlet faces in the upstream and own cell."""
    i, real = pressure.shape[0] - 1, pressure.dtype.type
    half, unity, two = real(0.5), real(1.0), real(2.0)
    m_h, m_p, log_h, log_p = (
        film.content_by_gap,
        film.content_by_pressure,
        film.log_mobility_by_gap,
        film.log_mobility_by_pressure,
    )
    for j in range(pressure.shape[1]):
        end_gradient = two * over_dx * pressure[i, j]
        own = end_gradient * faces.east_by_own[i, j]
        by_gap[0, j], by_pressure[0, j] = -half * m_h[i - 1, j], -half * m_p[i - 1, j]
        by_gap[1, j] = (
            (unity + half) * m_h[i, j]
            + own * log_h[i, j]
            + end_gradient * half * film.ambient_by_gap[1, j]
        )
        by_pressure[1, j] = (
            (unity + half) * m_p[i, j] + own * log_p[i, j] + two * over_dx * faces.east[i, j]
        )
        by_gap[2, j], by_pressure[2, j] = real(0.0), real(0.0)


@njit(cache=True, fastmath={"reassoc", "contract", "arcp"})
def _fill_east_slopes(
    film: Film,
    faces: Faces,
    pressure: Field,
    over_dx: np.floating,
    i: int,
    by_gap: Field,
    by_pressure: Field,
) -> None:
    """Fill derivatives of the flow through inner east faces in the upstream, own and next cell."""
    real = pressure.dtype.type
    unity, inner = real(1.0), real(i > 0)
    m_h, m_p, log_h, log_p = (
        film.content_by_gap,
        film.content_by_pressure,
        film.log_mobility_by_gap,
        film.log_mobility_by_pressure,
    )
    ahead, back, upstream = inner * faces.wedge[0], inner * faces.wedge[1], max(i - 1, 0)
    for j in range(pressure.shape[1]):
        pressure_gradient, through = (
            over_dx * (pressure[i, j] - pressure[i + 1, j]),
            over_dx * faces.east[i, j],
        )
        own, following = (
            pressure_gradient * faces.east_by_own[i, j],
            pressure_gradient * faces.east_by_next[i, j],
        )
        own_gap, next_gap = (
            pressure_gradient * faces.east_by_own_gap[i, j],
            pressure_gradient * faces.east_by_next_gap[i, j],
        )
        by_gap[0, j], by_pressure[0, j] = -back * m_h[upstream, j], -back * m_p[upstream, j]
        by_gap[1, j] = (unity - ahead + back) * m_h[i, j] + own_gap * log_h[i, j]
        by_pressure[1, j] = (unity - ahead + back) * m_p[i, j] + own * log_p[i, j] + through
        by_gap[2, j] = ahead * m_h[i + 1, j] + next_gap * log_h[i + 1, j]
        by_pressure[2, j] = ahead * m_p[i + 1, j] + following * log_p[i + 1, j] - through


@njit(cache=True, fastmath={"reassoc", "contract", "arcp"})
def _add_across(
    rows: Rows,
    film: Film,
    faces: Faces,
    pressure: Field,
    own: np.floating,
    over_dy2: np.floating,
    i: int,
    out: Stencil,
) -> None:
    """Add the flows between x lines to row `i` of a stencil.

    The gap follows each cell's own pressure, by the compliance `own`.
    """
    ny = pressure.shape[1]
    for j in range(ny):
        jn = j + 1 if j < ny - 1 else faces.behind
        through, pressure_gradient = (
            over_dy2 * faces.north[i, j],
            over_dy2 * (pressure[i, j] - pressure[i, jn]),
        )
        log_p, log_h = film.log_mobility_by_pressure[i], film.log_mobility_by_gap[i]
        slope = faces.north_by_own[i, j] * log_p[j] + faces.north_by_own_gap[i, j] * own * log_h[j]
        slope_next = (
            faces.north_by_next[i, j] * log_p[jn] + faces.north_by_next_gap[i, j] * own * log_h[jn]
        )
        by_own = through + pressure_gradient * slope
        by_next = -through + pressure_gradient * slope_next
        if rows.state[i, j] == LUBRICATED:
            out.centre[i, j] += rows.fluid_scale[i, j] * by_own
            out.north[i, j] += rows.fluid_scale[i, j] * by_next
        if rows.state[i, jn] == LUBRICATED and (jn == j + 1 or jn == 0):
            out.centre[i, jn] -= rows.fluid_scale[i, jn] * by_next
            out.south[i, jn] -= rows.fluid_scale[i, jn] * by_own
