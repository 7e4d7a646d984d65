"""Smooth lubricated line contact in one dimension, by dense Newton on nodes.

Dimensionless as in the literature: lengths in a, pressures in p_h, gaps in a^2/R. Unlike the
package it keeps pressures at nodes (zero at both ends) with linear variation between them, solves
Reynolds' equation upstream of a fixed rupture point, and moves that point until P >= 0 upstream and
R >= 0 downstream.
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np


class Oil(NamedTuple):
    """Logarithm of the viscosity ratio and the density ratio, as functions of P, each with its
    derivative.
    """

    log_viscosity: Callable
    log_viscosity_slope: Callable
    density: Callable
    density_slope: Callable


class Film(NamedTuple):
    x: np.ndarray
    pressure: np.ndarray
    gap: np.ndarray
    rupture: int

    @property
    def smallest(self):
        """Vertex of the parabola through the three lowest nodes."""
        i = int(np.argmin(self.gap))
        c2, c1, c0 = np.polyfit(self.x[i - 1 : i + 2] - self.x[i], self.gap[i - 1 : i + 2], 2)
        return c0 - c1**2 / (4.0 * c2)

    @property
    def central(self):
        return np.interp(0.0, self.x, self.gap)


def compliance(x):
    """Return the displacement of each node under a unit hat of pressure on each node: -ln|x|/pi,
    integrated.
    """
    spacing = x[1] - x[0]
    offset = np.arange(-x.size, x.size + 1) * spacing
    twice_integrated = np.zeros(offset.size)
    away = offset != 0.0
    twice_integrated[away] = offset[away] ** 2 * (np.log(np.abs(offset[away])) / 2.0 - 0.75)
    hat = -np.diff(twice_integrated, 2) / spacing / np.pi
    node = np.arange(x.size)
    return hat[node[:, None] - node[None, :] + x.size - 1]


def upwind(values):
    """Second-order upwind values at the midpoints between nodes; the first is of first order."""
    return np.concatenate([values[:1], 1.5 * values[1:-1] - 0.5 * values[:-2]])


def line_contact(lower, upper, nodes, speed, oil):
    """Film of a smooth line contact; `speed` is 12 eta0 u R^2 / (a^3 p_h)."""
    x = np.linspace(lower, upper, nodes)
    matrix = compliance(x)
    pressure = np.sqrt(np.maximum(1.0 - x**2, 0.0))
    approach = 1.1 - np.min(x**2 / 2.0 + matrix @ pressure)
    rupture = int(np.searchsorted(x, 1.05))  # no pressure at these nodes
    for stiffening in (0.4, 0.7, 0.85, 1.0):  # continuation in the viscosity exponent
        tried = set()
        while rupture not in tried:
            tried.add(rupture)
            pressure, approach, outflow = _full_film(
                x, matrix, pressure, approach, speed, oil, stiffening, rupture
            )
            if pressure[rupture - 1] < 0.0:
                rupture -= 1
            elif outflow[rupture - 1] < 0.0:  # the first dry node would take in oil
                rupture += 1
    assert pressure.min() >= 0.0
    assert outflow[rupture - 1 :].min() >= 0.0
    return Film(x, pressure, x**2 / 2.0 + matrix @ pressure + approach, rupture)


def _full_film(x, matrix, pressure, approach, speed, oil, stiffening, rupture):
    """Solve R = 0 upstream of `rupture`, and the load balance, by Newton's method; return R of all
    inner nodes, too.
    """
    spacing = x[1] - x[0]
    wet = slice(0, rupture - 1)  # indices of inner nodes
    pressure = pressure.copy()
    pressure[rupture:] = 0.0
    for _ in range(100):
        gap = x**2 / 2.0 + matrix @ pressure + approach
        flux, by_p, by_approach = _fluxes(x, matrix, pressure, gap, speed, oil, stiffening)
        outflow = np.diff(flux)
        jacobian = np.zeros((rupture, rupture))
        jacobian[:-1, :-1] = np.diff(by_p, axis=0)[wet, 1:rupture]
        jacobian[:-1, -1] = np.diff(by_approach)[wet]
        jacobian[-1, :-1] = spacing
        step = -np.linalg.solve(
            jacobian, np.append(outflow[wet], spacing * pressure.sum() - np.pi / 2.0)
        )
        if np.abs(step).max() < 1e-9:
            return pressure, approach, outflow
        pressure[1:rupture] += np.clip(step[:-1], -0.3, 0.3)
        approach += np.clip(step[-1], -0.3, 0.3)
    raise AssertionError(f"the reference did not converge: last step {np.abs(step).max():.1e}")


def _fluxes(x, matrix, pressure, gap, speed, oil, stiffening):
    """Flux at the midpoints, and its derivatives by all pressures and by the approach."""
    spacing, face = x[1] - x[0], np.arange(x.size - 1)
    density, slope = oil.density(pressure), oil.density_slope(pressure)
    mobility = density * gap**3 / speed * np.exp(-stiffening * oil.log_viscosity(pressure))
    mobility_by_gap = 3.0 * mobility / gap
    content_by_p = density[:, None] * matrix + np.diag(slope * gap)
    mobility_by_p = mobility_by_gap[:, None] * matrix + np.diag(
        mobility * (slope / density - stiffening * oil.log_viscosity_slope(pressure))
    )
    between = (mobility[1:] + mobility[:-1]) / 2.0
    gradient = np.diff(pressure) / spacing
    flux = upwind(density * gap) - between * gradient
    by_p = upwind(content_by_p) - (mobility_by_p[1:] + mobility_by_p[:-1]) / 2.0 * gradient[:, None]
    by_p[face, face] += between / spacing
    by_p[face, face + 1] -= between / spacing
    by_approach = upwind(density) - (mobility_by_gap[1:] + mobility_by_gap[:-1]) / 2.0 * gradient
    return flux, by_p, by_approach


def load_response(film, speed, oil, frequency):
    """Complex change of the load (sum of P dX) per unit of approach at the angular frequency ω a/u.

    Dense: every node stores the change of its film; the rupture point is fixed.
    """
    x, pressure, gap, rupture = film
    matrix, inner = compliance(x), slice(1, rupture)
    _, by_p, by_approach = _fluxes(x, matrix, pressure, gap, speed, oil, 1.0)
    spacing, density = x[1] - x[0], oil.density(pressure)
    stored = 1j * frequency * spacing
    content_by_p = density[:, None] * matrix + np.diag(oil.density_slope(pressure) * gap)
    rows = np.diff(by_p, axis=0)[: rupture - 1, inner] + stored * content_by_p[inner, inner]
    rhs = np.diff(by_approach)[: rupture - 1] + stored * density[inner]
    return np.linalg.solve(rows, rhs).sum() * spacing
