"""The finite-volume Reynolds equation on arrays: net outflow of each cell, its derivative, its local stencil.

x is the first axis and aperiodic with zero pressure on both end faces; y is the second axis and periodic. The wedge is
taken upwind to second order, face value m + (m - m_upstream)/2; Poiseuille faces carry the mean of two node mobilities,
those at the ends the mean of their cell's and what that would be at zero pressure.
Knows no units, no oil and no tolerance.
"""

from typing import NamedTuple

import numpy as np
from numba import njit

from asperity.arrays import Codes, Field, Mask

RUPTURED, TOUCHING, LUBRICATED, CAPPED = 0, 1, 2, 3  # what decides a cell


class Film(NamedTuple):
    """Oil content m = rho H and Poiseuille mobility eps of every cell, each with its slopes in H and P.

    `ambient` is the mobility that the first and the last cells along x would have at ambient pressure, shape (2, ny).
    """

    content: Field
    content_by_gap: Field
    content_by_pressure: Field
    mobility: Field
    mobility_by_gap: Field
    mobility_by_pressure: Field
    ambient: Field
    ambient_by_gap: Field

    def held_where(self, held: Mask) -> "Film":
        """The same film, its gap fixed in some cells."""
        return self._replace(
            content_by_gap=np.where(held, 0.0, self.content_by_gap),
            mobility_by_gap=np.where(held, 0.0, self.mobility_by_gap),
            ambient_by_gap=np.where(held[[0, -1]], 0.0, self.ambient_by_gap),
        )


class Rows(NamedTuple):
    """How each cell's equation is written: which of the four it is, and the factors that scale it like a pressure."""

    state: Codes
    fluid_scale: Field  # 1/diagonal of the Reynolds rows
    contact_scale: float  # 1/compliance of the contact rows


class Stencil(NamedTuple):
    """Five-point approximation of the scaled Jacobian: self, both x neighbours, both y neighbours."""

    centre: Field
    west: Field
    east: Field
    north: Field
    south: Field


@njit(cache=True)
def net_outflow(pressure: Field, film: Film, inlet_content: Field, dx: float, dy: float, out: Field) -> None:
    """Couette plus Poiseuille outflow minus inflow of each cell, per cell area."""
    nx, ny = pressure.shape
    content, mobility = film.content, film.mobility
    upstream = np.empty(ny)
    for j in range(ny):
        upstream[j] = inlet_content[j] - (mobility[0, j] + film.ambient[0, j]) * pressure[0, j] / dx
    for i in range(nx):
        for j in range(ny):
            if i < nx - 1:
                flux = -0.5 * (mobility[i, j] + mobility[i + 1, j]) * (pressure[i + 1, j] - pressure[i, j]) / dx
            else:
                flux = (mobility[i, j] + film.ambient[1, j]) * pressure[i, j] / dx
            flux += content[i, j]
            if i > 0:
                flux += 0.5 * (content[i, j] - content[i - 1, j])
            out[i, j] = (flux - upstream[j]) / dx
            upstream[j] = flux
        for j in range(ny):
            jn = j + 1 if j < ny - 1 else 0
            js = j - 1 if j > 0 else ny - 1
            north = 0.5 * (mobility[i, j] + mobility[i, jn]) * (pressure[i, j] - pressure[i, jn])
            south = 0.5 * (mobility[i, js] + mobility[i, j]) * (pressure[i, js] - pressure[i, j])
            out[i, j] += (north - south) / (dy * dy)


@njit(cache=True, fastmath={"reassoc", "contract", "arcp"})
def jacobian_product(
    rows: Rows,
    film: Film,
    pressure: Field,
    d_pressure: Field,
    d_gap: Field,
    spacing: tuple[float, float],
    storing: float,
    out: Field,
) -> None:
    """Every cell's scaled equation, linearised, applied to a change of pressure and the gap change it causes.

    A lubricated cell also stores `storing` times the oil content it gains: the inverse of a time step. All arrays in
    one precision, which is also that of the arithmetic.
    """
    nx, ny = pressure.shape
    real = pressure.dtype.type
    dx, dy = spacing
    half, over_dx, over_dy2 = real(0.5), real(1.0 / dx), real(0.5 / (dy * dy))
    kept = real(storing)
    touching = real(rows.contact_scale)
    state, scale = rows.state, rows.fluid_scale
    eps, eps_h, eps_p = film.mobility, film.mobility_by_gap, film.mobility_by_pressure
    m_h, m_p = film.content_by_gap, film.content_by_pressure
    d_eps, d_east = np.empty(ny, pressure.dtype), np.empty(ny, pressure.dtype)
    upstream, before = np.empty(ny, pressure.dtype), np.empty(ny, pressure.dtype)
    for j in range(ny):
        d_eps[j] = eps_h[0, j] * d_gap[0, j] + eps_p[0, j] * d_pressure[0, j]
        before[j] = m_h[0, j] * d_gap[0, j] + m_p[0, j] * d_pressure[0, j]
        d_face = d_eps[j] + film.ambient_by_gap[0, j] * d_gap[0, j]
        face = eps[0, j] + film.ambient[0, j]
        upstream[j] = m_h[0, j] * d_gap[0, j] - (face * d_pressure[0, j] + d_face * pressure[0, j]) * over_dx
    for i in range(nx):
        second = half if i > 0 else real(0.0)
        if i < nx - 1:
            for j in range(ny):
                d_east[j] = eps_h[i + 1, j] * d_gap[i + 1, j] + eps_p[i + 1, j] * d_pressure[i + 1, j]
            for j in range(ny):
                here = m_h[i, j] * d_gap[i, j] + m_p[i, j] * d_pressure[i, j]
                flux = here + second * (here - before[j])
                flux -= (half * over_dx) * (
                    (eps[i, j] + eps[i + 1, j]) * (d_pressure[i + 1, j] - d_pressure[i, j])
                    + (d_eps[j] + d_east[j]) * (pressure[i + 1, j] - pressure[i, j])
                )
                out[i, j] = (flux - upstream[j]) * over_dx + kept * here
                upstream[j] = flux
                before[j] = here
        else:
            for j in range(ny):
                here = m_h[i, j] * d_gap[i, j] + m_p[i, j] * d_pressure[i, j]
                flux = here + second * (here - before[j])
                d_face = d_eps[j] + film.ambient_by_gap[1, j] * d_gap[i, j]
                flux += ((eps[i, j] + film.ambient[1, j]) * d_pressure[i, j] + d_face * pressure[i, j]) * over_dx
                out[i, j] = (flux - upstream[j]) * over_dx + kept * here
        # y faces: what crosses from the south of each line is what leaves the line before
        for j in range(ny - 1):
            jn = j + 1
            north = (eps[i, j] + eps[i, jn]) * (d_pressure[i, j] - d_pressure[i, jn]) + (d_eps[j] + d_eps[jn]) * (
                pressure[i, j] - pressure[i, jn]
            )
            out[i, j] += over_dy2 * north
            out[i, jn] -= over_dy2 * north
        last = ny - 1
        crossing = (eps[i, last] + eps[i, 0]) * (d_pressure[i, last] - d_pressure[i, 0]) + (d_eps[last] + d_eps[0]) * (
            pressure[i, last] - pressure[i, 0]
        )
        out[i, last] += over_dy2 * crossing
        out[i, 0] -= over_dy2 * crossing
        for j in range(ny):
            if state[i, j] == LUBRICATED:
                out[i, j] *= scale[i, j]
            elif state[i, j] == TOUCHING:
                out[i, j] = d_gap[i, j] * touching
            else:
                out[i, j] = d_pressure[i, j]
            d_eps[j] = d_east[j]


@njit(cache=True)
def fluid_diagonal(film: Film, near: Field, dx: float, dy: float, out: Field) -> None:
    """Derivative of each cell's net outflow by its own pressure, kept positive; `near` holds the compliance along x."""
    nx, ny = out.shape
    eps, m_h, m_p = film.mobility, film.content_by_gap, film.content_by_pressure
    for i in range(nx):
        for j in range(ny):
            jn = j + 1 if j < ny - 1 else 0
            js = j - 1 if j > 0 else ny - 1
            own = eps[i, j]
            east = 0.5 * (own + eps[i + 1, j]) if i < nx - 1 else own + film.ambient[1, j]
            west = 0.5 * (own + eps[i - 1, j]) if i > 0 else own + film.ambient[0, j]
            above = m_h[i - 1, j] if i > 0 else m_h[i, j]
            wedge = m_h[i, j] * near[0] - above * near[1] + m_p[i, j]
            wedge = max(wedge, near[0] - near[1])
            out[i, j] = (east + west) / (dx * dx) + (own + 0.5 * (eps[i, jn] + eps[i, js])) / (dy * dy) + wedge / dx


@njit(cache=True)
def local_stencil(
    rows: Rows, film: Film, near: Field, spacing: tuple[float, float], storing: float, out: Stencil
) -> None:
    """Fill the five-point approximation of the scaled Jacobian, in the precision of `out`.

    `near` holds the compliance of cells 0, 1, 2 along x and, last, that of the cell from which on it counts as far.
    """
    nx, ny = out.centre.shape
    real = out.centre.dtype.type
    half, none, one, kept = real(0.5), real(0.0), real(1.0), real(storing)
    dx, dy = spacing
    over_dx, over_dx2, over_dy2 = real(1.0 / dx), real(1.0 / (dx * dx)), real(1.0 / (dy * dy))
    near0, near1, near2 = real(near[0]), real(near[1]), real(near[2])
    touching_own = real((near[0] - near[3]) * rows.contact_scale)
    touching_next = real((near[1] - near[3]) * rows.contact_scale)
    eps, m_h, m_p = film.mobility, film.content_by_gap, film.content_by_pressure
    faces = np.empty(ny + 1, out.centre.dtype)  # of the y faces, each between its southern and northern cell
    for i in range(nx):
        west_of, east_of = max(i - 1, 0), min(i + 1, nx - 1)
        at_inlet, at_outlet = i == 0, i == nx - 1
        for j in range(1, ny):
            faces[j] = half * over_dy2 * (eps[i, j - 1] + eps[i, j])
        faces[0] = half * over_dy2 * (eps[i, ny - 1] + eps[i, 0])
        faces[ny] = faces[0]
        for j in range(ny):
            wet, touching = rows.state[i, j] == LUBRICATED, rows.state[i, j] == TOUCHING
            own, here, above = eps[i, j], m_h[i, j], m_h[west_of, j]
            above_p = none if at_inlet else m_p[west_of, j]
            scale = rows.fluid_scale[i, j]
            east = over_dx2 * (own + film.ambient[1, j] if at_outlet else half * (own + eps[east_of, j]))
            west = over_dx2 * (own + film.ambient[0, j] if at_inlet else half * (own + eps[west_of, j]))
            wedge = here * near0 - above * near1 + m_p[i, j]
            own_kept, next_kept = kept * (here * near0 + m_p[i, j]), kept * here * near1
            centre = (east + west + faces[j] + faces[j + 1] + wedge * over_dx + own_kept) * scale
            upstream = (-west + (here * near1 - above * near0 - above_p) * over_dx + next_kept) * scale
            downstream = (-east + (here * near1 - above * near2) * over_dx + next_kept) * scale
            out.centre[i, j] = centre if wet else (touching_own if touching else one)
            out.west[i, j] = upstream if wet else (touching_next if touching else none)
            out.east[i, j] = downstream if wet else (touching_next if touching else none)
            out.north[i, j] = -faces[j + 1] * scale if wet else none
            out.south[i, j] = -faces[j] * scale if wet else none
