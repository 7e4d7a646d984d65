"""The finite-volume Reynolds equation on arrays: net outflow of each cell, its derivative, its local stencil.

x is the first axis and aperiodic with zero pressure on both end faces; y is the second axis and periodic. The wedge is
taken upwind to second order, face value m + (m - m_upstream)/2; Poiseuille faces carry the mean of two node mobilities.
Knows no units, no oil and no tolerance.
"""

from typing import NamedTuple

import numpy as np
from numba import njit

from asperity.arrays import Codes, Field, Mask

RUPTURED, TOUCHING, LUBRICATED, CAPPED = 0, 1, 2, 3  # what decides a cell


class Film(NamedTuple):
    """Oil content m = rho H and Poiseuille mobility eps of every cell, each with its slopes in H and P."""

    content: Field
    content_by_gap: Field
    content_by_pressure: Field
    mobility: Field
    mobility_by_gap: Field
    mobility_by_pressure: Field

    def held_where(self, held: Mask) -> "Film":
        """The same film, its gap fixed in some cells."""
        return self._replace(
            content_by_gap=np.where(held, 0.0, self.content_by_gap),
            mobility_by_gap=np.where(held, 0.0, self.mobility_by_gap),
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
def net_outflow(
    pressure: Field, content: Field, mobility: Field, inlet_content: Field, dx: float, dy: float, out: Field
) -> None:
    """Couette plus Poiseuille outflow minus inflow of each cell, per cell area."""
    nx, ny = pressure.shape
    upstream = np.empty(ny)
    for j in range(ny):
        upstream[j] = inlet_content[j] - mobility[0, j] * pressure[0, j] * 2.0 / dx
    for i in range(nx):
        for j in range(ny):
            if i < nx - 1:
                flux = -0.5 * (mobility[i, j] + mobility[i + 1, j]) * (pressure[i + 1, j] - pressure[i, j]) / dx
            else:
                flux = mobility[i, j] * pressure[i, j] * 2.0 / dx
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
    rows: Rows, film: Film, pressure: Field, d_pressure: Field, d_gap: Field, dx: float, dy: float, out: Field
) -> None:
    """Every cell's scaled equation, linearised, applied to a change of pressure and the gap change it causes."""
    nx, ny = pressure.shape
    state = rows.state
    eps, eps_h, eps_p = film.mobility, film.mobility_by_gap, film.mobility_by_pressure
    m_h, m_p = film.content_by_gap, film.content_by_pressure
    upstream = np.empty(ny)
    for j in range(ny):
        d_eps = eps_h[0, j] * d_gap[0, j] + eps_p[0, j] * d_pressure[0, j]
        upstream[j] = m_h[0, j] * d_gap[0, j] - (eps[0, j] * d_pressure[0, j] + d_eps * pressure[0, j]) * 2.0 / dx
    for i in range(nx):
        for j in range(ny):
            d_eps = eps_h[i, j] * d_gap[i, j] + eps_p[i, j] * d_pressure[i, j]
            flux = m_h[i, j] * d_gap[i, j] + m_p[i, j] * d_pressure[i, j]
            if i > 0:
                flux += 0.5 * (flux - m_h[i - 1, j] * d_gap[i - 1, j] - m_p[i - 1, j] * d_pressure[i - 1, j])
            if i < nx - 1:
                d_east = eps_h[i + 1, j] * d_gap[i + 1, j] + eps_p[i + 1, j] * d_pressure[i + 1, j]
                flux -= (
                    0.5
                    * (
                        (eps[i, j] + eps[i + 1, j]) * (d_pressure[i + 1, j] - d_pressure[i, j])
                        + (d_eps + d_east) * (pressure[i + 1, j] - pressure[i, j])
                    )
                    / dx
                )
            else:
                flux += (eps[i, j] * d_pressure[i, j] + d_eps * pressure[i, j]) * 2.0 / dx
            out[i, j] = (flux - upstream[j]) / dx
            upstream[j] = flux
        for j in range(ny):
            if state[i, j] == LUBRICATED:
                jn = j + 1 if j < ny - 1 else 0
                js = j - 1 if j > 0 else ny - 1
                d_eps = eps_h[i, j] * d_gap[i, j] + eps_p[i, j] * d_pressure[i, j]
                d_north = eps_h[i, jn] * d_gap[i, jn] + eps_p[i, jn] * d_pressure[i, jn]
                d_south = eps_h[i, js] * d_gap[i, js] + eps_p[i, js] * d_pressure[i, js]
                north = (eps[i, j] + eps[i, jn]) * (d_pressure[i, j] - d_pressure[i, jn]) + (d_eps + d_north) * (
                    pressure[i, j] - pressure[i, jn]
                )
                south = (eps[i, js] + eps[i, j]) * (d_pressure[i, js] - d_pressure[i, j]) + (d_eps + d_south) * (
                    pressure[i, js] - pressure[i, j]
                )
                out[i, j] = (out[i, j] + 0.5 * (north - south) / (dy * dy)) * rows.fluid_scale[i, j]
            elif state[i, j] == TOUCHING:
                out[i, j] = d_gap[i, j] * rows.contact_scale
            else:
                out[i, j] = d_pressure[i, j]


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
            east = 0.5 * (own + eps[i + 1, j]) if i < nx - 1 else 2.0 * own
            west = 0.5 * (own + eps[i - 1, j]) if i > 0 else 2.0 * own
            above = m_h[i - 1, j] if i > 0 else m_h[i, j]
            wedge = m_h[i, j] * near[0] - above * near[1] + m_p[i, j]
            wedge = max(wedge, near[0] - near[1])
            out[i, j] = (east + west) / (dx * dx) + (own + 0.5 * (eps[i, jn] + eps[i, js])) / (dy * dy) + wedge / dx


@njit(cache=True)
def local_stencil(rows: Rows, film: Film, near: Field, dx: float, dy: float, out: Stencil) -> None:
    """Fill the five-point approximation of the scaled Jacobian.

    `near` holds the compliance of cells 0, 1, 2 along x and, last, that of the cell from which on it counts as far.
    """
    nx, ny = out.centre.shape
    eps, m_h, m_p = film.mobility, film.content_by_gap, film.content_by_pressure
    touching = rows.contact_scale
    for i in range(nx):
        for j in range(ny):
            state = rows.state[i, j]
            out.west[i, j] = 0.0
            out.east[i, j] = 0.0
            out.north[i, j] = 0.0
            out.south[i, j] = 0.0
            if state == LUBRICATED:
                jn = j + 1 if j < ny - 1 else 0
                js = j - 1 if j > 0 else ny - 1
                own = eps[i, j]
                east = (0.5 * (own + eps[i + 1, j]) if i < nx - 1 else 2.0 * own) / (dx * dx)
                west = (0.5 * (own + eps[i - 1, j]) if i > 0 else 2.0 * own) / (dx * dx)
                north = 0.5 * (own + eps[i, jn]) / (dy * dy)
                south = 0.5 * (own + eps[i, js]) / (dy * dy)
                here = m_h[i, j]
                above = m_h[i - 1, j] if i > 0 else here
                above_p = m_p[i - 1, j] if i > 0 else 0.0
                scale = rows.fluid_scale[i, j]
                wedge = here * near[0] - above * near[1] + m_p[i, j]
                out.centre[i, j] = (east + west + north + south + wedge / dx) * scale
                out.west[i, j] = (-west + (here * near[1] - above * near[0] - above_p) / dx) * scale
                out.east[i, j] = (-east + (here * near[1] - above * near[2]) / dx) * scale
                out.north[i, j] = -north * scale
                out.south[i, j] = -south * scale
            elif state == TOUCHING:
                out.centre[i, j] = (near[0] - near[3]) * touching
                out.west[i, j] = (near[1] - near[3]) * touching
                out.east[i, j] = (near[1] - near[3]) * touching
            else:
                out.centre[i, j] = 1.0
