"""Finite-volume Reynolds equation on arrays: net outflow of each cell, and its derivative.

x is the first axis and aperiodic with zero pressure on both end faces; y is the second axis and
periodic. The wedge term is upwind, face value m + a (m_next - m) + b (m - m_upstream): second order
with (a, b) = (0, 1/2), third with (3/8, 1/8). Poiseuille faces carry a mean of two mobilities
(`kernels.face_mobilities`); end faces carry the mean of their cell's mobility and its value at zero
pressure. Knows no units, no lubricant and no tolerance.
"""

from typing import NamedTuple

import numpy as np

from asperity.core.arrays import Codes, Field, Mask
from asperity.kernels.compiled import njit

RUPTURED, TOUCHING, LUBRICATED, CAPPED = 0, 1, 2, 3  # equation that holds in a cell


class Film(NamedTuple):
    """Oil content m = rho H and Poiseuille mobility eps, with derivatives in H and P.

    The derivatives of eps are those of its logarithm. `ambient` is the mobility of the first and
    the last cells along x at ambient pressure, shape (2, ny).
    """

    content: Field
    content_by_gap: Field
    content_by_pressure: Field
    mobility: Field
    log_mobility_by_gap: Field
    log_mobility_by_pressure: Field
    ambient: Field
    ambient_by_gap: Field

    def with_fixed_gap(self, fixed: Mask) -> "Film":
        """Return the film with its gap fixed in the cells of `fixed`."""
        return self._replace(
            content_by_gap=np.where(fixed, 0.0, self.content_by_gap),
            log_mobility_by_gap=np.where(fixed, 0.0, self.log_mobility_by_gap),
            ambient_by_gap=np.where(fixed[[0, -1]], 0.0, self.ambient_by_gap),
        )

    @property
    def without_wedge(self) -> "Film":
        """The film without a wedge, for oil balanced along its path (Lagrangian)."""
        nothing = np.zeros_like(self.content)
        return self._replace(content_by_gap=nothing, content_by_pressure=nothing)


class Faces(NamedTuple):
    """Mobility of the east and north face of each cell, with derivatives in both log mobilities.

    Those that follow a cell's gap (`..._gap`) differ from those that follow its pressure where the
    mean is exact, and are the same arrays elsewhere. The last face to the east is the outlet;
    `inlet` holds the first one to the west, shape (ny,); `wedge` is (a, b). `behind` is the line of
    cells north of the last one: the first, where y is periodic, or with a mirror the last or the
    last but one. With a mirror no Reynolds equation holds in the first line.
    """

    east: Field
    east_by_own: Field
    east_by_next: Field
    north: Field
    north_by_own: Field
    north_by_next: Field
    inlet: Field
    wedge: Field
    east_by_own_gap: Field
    east_by_next_gap: Field
    north_by_own_gap: Field
    north_by_next_gap: Field
    behind: int = 0


class Rows(NamedTuple):
    """Equation of each cell (`state`), and the factors that scale it to a pressure."""

    state: Codes
    fluid_scale: Field  # 1/diagonal of the Reynolds rows
    contact_scale: float  # 1/compliance of the contact rows


class PressureChange(NamedTuple):
    """A change of pressure and the change of gap that it causes."""

    pressure: Field
    gap: Field


class Liquid(NamedTuple):
    """Lubricant at each cell's pressure: relative density, viscosity and shear-thinning factor.

    With the derivatives of density and of log viscosity in P, and of the log thinning factor in
    that of the shear rate (`exponent`).
    """

    density: Field
    density_slope: Field
    viscosity: Field
    log_slope: Field
    thinning: Field
    exponent: Field


@njit(cache=True)
def fill_film(
    liquid: Liquid, height: Field, conductance: float, least: tuple[float, float], film: Film
) -> None:
    """Fill the cells of `film`.

    `conductance` is the mobility per content and squared height, times the viscosity. The mobility
    is at least `least[0]` over the cubed height. There its derivative in P is zero, and that of its
    logarithm in log H is `least[1]`: 0, or 3 for a constant fluidity; Newton's method does not
    converge with its own, -3.
    """
    least_mobility, least_slope = least
    nx, ny = height.shape
    for i in range(nx):
        for j in range(ny):
            h, rho, rho_p, exponent = (
                height[i, j],
                liquid.density[i, j],
                liquid.density_slope[i, j],
                liquid.exponent[i, j],
            )
            content, cubed = rho * h, h * h * h
            mobility = (
                conductance * content * h * h / (liquid.viscosity[i, j] * liquid.thinning[i, j])
            )
            stiff = mobility * cubed < least_mobility
            film.content[i, j], film.content_by_gap[i, j], film.content_by_pressure[i, j] = (
                content,
                rho,
                rho_p * h,
            )
            film.mobility[i, j] = least_mobility / cubed if stiff else mobility
            film.log_mobility_by_gap[i, j] = (least_slope if stiff else 3.0 + exponent) / h
            film.log_mobility_by_pressure[i, j] = (
                0.0 if stiff else rho_p / rho - (1.0 + exponent) * liquid.log_slope[i, j]
            )


@njit(cache=True)
def net_outflow(
    pressure: Field,
    content: Field,
    faces: Faces,
    inlet_content: Field,
    dx: float,
    dy: float,
    out: Field,
) -> None:
    """Fill `out` with the net Couette plus Poiseuille outflow of each cell, per cell area."""
    nx, ny = pressure.shape
    a, b = faces.wedge[0], faces.wedge[1]
    over_dy2 = 1.0 / (dy * dy)
    upstream, north = np.empty(ny), np.empty(ny)
    for j in range(ny):
        upstream[j] = inlet_content[j] - faces.inlet[j] * pressure[0, j] * 2.0 / dx
    for i in range(nx):
        ahead, back = (a, b) if i > 0 else (0.0, 0.0)
        for j in range(ny):
            if i < nx - 1:
                flux = content[i, j] - faces.east[i, j] * (pressure[i + 1, j] - pressure[i, j]) / dx
                flux += ahead * (content[i + 1, j] - content[i, j])
                flux += back * (content[i, j] - content[max(i - 1, 0), j])
            else:
                flux = content[i, j] + faces.east[i, j] * pressure[i, j] * 2.0 / dx
                flux += 0.5 * (content[i, j] - content[i - 1, j])
            out[i, j] = (flux - upstream[j]) / dx
            upstream[j] = flux
        last = ny - 1
        for j in range(last):
            north[j] = over_dy2 * faces.north[i, j] * (pressure[i, j] - pressure[i, j + 1])
        north[last] = (
            over_dy2 * faces.north[i, last] * (pressure[i, last] - pressure[i, faces.behind])
        )
        out[i, 0] += north[0] - over_dy2 * faces.north[i, last] * (
            pressure[i, last] - pressure[i, 0]
        )
        for j in range(1, ny):
            out[i, j] += north[j] - north[j - 1]


@njit(cache=True)
def limited_outflow(content: Field, own: Field, upstream: Field, dx: float, out: Field) -> None:
    """Fill `out` with the outflow per cell area due to face values `own` m - `upstream` m_upstream.

    The first and the last face along x contribute nothing.
    """
    nx, ny = content.shape
    over_dx = content.dtype.type(1.0 / dx)
    for i in range(nx):
        for j in range(ny):
            east, west = content.dtype.type(0.0), content.dtype.type(0.0)
            if 0 < i < nx - 1:
                east = own[i, j] * content[i, j] - upstream[i, j] * content[i - 1, j]
            if i > 1:
                west = own[i - 1, j] * content[i - 1, j] - upstream[i - 1, j] * content[i - 2, j]
            out[i, j] = (east - west) * over_dx


@njit(cache=True, fastmath={"reassoc", "contract", "arcp"})
def _through_north(
    faces: Faces, pressure: Field, d_pressure: Field, d_log: Field, i: int, j: int, jn: int
) -> float:
    """Return the linearised Poiseuille flow from cell (i, j) to (i, jn)."""
    d_face = faces.north_by_own[i, j] * d_log[0, j] + faces.north_by_next[i, j] * d_log[0, jn]
    d_face += (
        faces.north_by_own_gap[i, j] * d_log[1, j] + faces.north_by_next_gap[i, j] * d_log[1, jn]
    )
    d_flow = faces.north[i, j] * (d_pressure[i, j] - d_pressure[i, jn])
    flow: float = d_flow + d_face * (pressure[i, j] - pressure[i, jn])
    return flow


@njit(cache=True, fastmath={"reassoc", "contract", "arcp"}, inline="always")
def _through_east(
    faces: Faces,
    pressure: Field,
    d_pressure: Field,
    d_log: Field,
    d_log_east: Field,
    i: int,
    j: int,
) -> float:
    """Return the linearised Poiseuille flow from cell (i + 1, j) to (i, j)."""
    d_face = faces.east_by_own[i, j] * d_log[0, j] + faces.east_by_next[i, j] * d_log_east[0, j]
    d_face += (
        faces.east_by_own_gap[i, j] * d_log[1, j] + faces.east_by_next_gap[i, j] * d_log_east[1, j]
    )
    flow: float = faces.east[i, j] * (d_pressure[i + 1, j] - d_pressure[i, j]) + d_face * (
        pressure[i + 1, j] - pressure[i, j]
    )
    return flow


@njit(cache=True, fastmath={"reassoc", "contract", "arcp"}, inline="always")
def _through_outlet(
    film: Film, faces: Faces, pressure: Field, change: PressureChange, d_log: Field, j: int
) -> float:
    """Return the linearised Poiseuille flow through the outlet over half a cell."""
    i, half = pressure.shape[0] - 1, pressure.dtype.type(0.5)
    d_face = (
        faces.east_by_own[i, j] * (d_log[0, j] + d_log[1, j])
        + half * film.ambient_by_gap[1, j] * change.gap[i, j]
    )
    flow: float = faces.east[i, j] * change.pressure[i, j] + d_face * pressure[i, j]
    return flow


@njit(cache=True, fastmath={"reassoc", "contract", "arcp"}, inline="always")
def _add_flow_across(
    faces: Faces,
    pressure: Field,
    d_pressure: Field,
    d_log: Field,
    i: int,
    over_dy2: np.floating,
    out: Field,
) -> None:
    """Add the linearised flow through the y faces: outflow of a line enters the next one."""
    last = pressure.shape[1] - 1
    for j in range(last):
        north = _through_north(faces, pressure, d_pressure, d_log, i, j, j + 1)
        out[i, j] += over_dy2 * north
        out[i, j + 1] -= over_dy2 * north
    north = _through_north(faces, pressure, d_pressure, d_log, i, last, faces.behind)
    out[i, last] += over_dy2 * north
    out[i, 0] -= over_dy2 * north


@njit(cache=True, fastmath={"reassoc", "contract", "arcp"}, inline="always")
def _scale_row(
    rows: Rows, change: PressureChange, i: int, touching: np.floating, out: Field
) -> None:
    """Scale the lubricated cells of row `i`, and fill its other cells with their own equations."""
    for j in range(out.shape[1]):
        if rows.state[i, j] == LUBRICATED:
            out[i, j] *= rows.fluid_scale[i, j]
        elif rows.state[i, j] == TOUCHING:
            out[i, j] = change.gap[i, j] * touching
        else:
            out[i, j] = change.pressure[i, j]


@njit(cache=True, fastmath={"reassoc", "contract", "arcp"})
def jacobian_product(
    rows: Rows,
    film: Film,
    faces: Faces,
    pressure: Field,
    change: PressureChange,
    spacing: tuple[float, float],
    storing: float,
    out: Field,
) -> None:
    """Fill `out` with the linearised, scaled equations for a change of pressure and gap.

    A lubricated cell also stores `storing` times the oil content it gains: the inverse of a time
    step. All arrays share one precision, which is also that of the arithmetic.
    """
    nx, ny = pressure.shape
    real = pressure.dtype.type
    dx, dy = spacing
    d_pressure, d_gap = change.pressure, change.gap
    half, over_dx, over_dy2, storing_rate = (
        real(0.5),
        real(1.0 / dx),
        real(1.0 / (dy * dy)),
        real(storing),
    )
    log_h, log_p = film.log_mobility_by_gap, film.log_mobility_by_pressure
    m_h, m_p = film.content_by_gap, film.content_by_pressure
    # changes of the log mobility by pressure and by gap
    d_log, d_log_east = np.empty((2, ny), pressure.dtype), np.empty((2, ny), pressure.dtype)
    before, here, after = (
        np.zeros(ny, pressure.dtype),
        np.empty(ny, pressure.dtype),
        np.empty(ny, pressure.dtype),
    )
    upstream = np.empty(ny, pressure.dtype)
    for j in range(ny):
        d_log[0, j], d_log[1, j] = log_p[0, j] * d_pressure[0, j], log_h[0, j] * d_gap[0, j]
        here[j] = m_h[0, j] * d_gap[0, j] + m_p[0, j] * d_pressure[0, j]
        d_face = half * film.mobility[0, j] * (d_log[0, j] + d_log[1, j])
        d_face += half * film.ambient_by_gap[0, j] * d_gap[0, j]
        crossing = faces.inlet[j] * d_pressure[0, j] + d_face * pressure[0, j]
        upstream[j] = m_h[0, j] * d_gap[0, j] - real(2.0) * over_dx * crossing
    for i in range(nx):
        if i < nx - 1:
            upwind, downwind = (faces.wedge[1], faces.wedge[0]) if i > 0 else (real(0.0), real(0.0))
            for j in range(ny):
                d_log_east[0, j] = log_p[i + 1, j] * d_pressure[i + 1, j]
                d_log_east[1, j] = log_h[i + 1, j] * d_gap[i + 1, j]
                after[j] = m_h[i + 1, j] * d_gap[i + 1, j] + m_p[i + 1, j] * d_pressure[i + 1, j]
            for j in range(ny):
                flux = here[j] + downwind * (after[j] - here[j]) + upwind * (here[j] - before[j])
                flux -= over_dx * _through_east(
                    faces, pressure, d_pressure, d_log, d_log_east, i, j
                )
                out[i, j] = (flux - upstream[j]) * over_dx + storing_rate * here[j]
                upstream[j] = flux
        else:
            for j in range(ny):
                flux = here[j] + half * (here[j] - before[j])
                through = _through_outlet(film, faces, pressure, change, d_log, j)
                flux += real(2.0) * over_dx * through
                out[i, j] = (flux - upstream[j]) * over_dx + storing_rate * here[j]
        _add_flow_across(faces, pressure, d_pressure, d_log, i, over_dy2, out)
        _scale_row(rows, change, i, real(rows.contact_scale), out)
        for j in range(ny):
            before[j], here[j] = here[j], after[j]
        d_log, d_log_east = d_log_east, d_log


@njit(cache=True)
def fluid_diagonal(
    film: Film, faces: Faces, compliance: Field, dx: float, dy: float, out: Field
) -> None:
    """Fill `out` with the positive derivative of each cell's net outflow in its own pressure.

    `compliance` holds the compliance along x. The wedge is taken as first order, which suffices for
    a scale and as the diagonal of a preconditioner.
    """
    nx, ny = out.shape
    m_h, m_p = film.content_by_gap, film.content_by_pressure
    for i in range(nx):
        for j in range(ny):
            js = j - 1 if j > 0 else ny - 1
            east = faces.east[i, j] if i < nx - 1 else 2.0 * faces.east[i, j]
            west = faces.east[i - 1, j] if i > 0 else 2.0 * faces.inlet[j]
            above = m_h[i - 1, j] if i > 0 else m_h[i, j]
            wedge = m_h[i, j] * compliance[0] - above * compliance[1] + m_p[i, j]
            wedge = max(wedge, compliance[0] - compliance[1])
            across = faces.north[i, j] + faces.north[i, js]
            out[i, j] = (east + west) / (dx * dx) + across / (dy * dy) + wedge / dx


@njit(cache=True)
def convert_precision(out: Field, part: Field, least: float) -> None:
    """Fill `out` with `part` in the precision of `out`; values up to `least` become zero."""
    nx, ny = part.shape
    for i in range(nx):
        for j in range(ny):
            out[i, j] = part[i, j] if abs(part[i, j]) > least else 0.0
