"""Slow twin of inlet shear heating: Grubin's inlet of a line contact, resolved across the film.

Rigid Hertzian bodies before the Hertz zone, reduced pressure q = (1 - exp(-α p))/α that reaches 1/α
at its edge, Barus' oil with η = η₀ exp(α p - β T), pure rolling, surfaces at ambient temperature.
Temperature is solved across the film with the velocity profile that it causes.
"""

import numpy as np
import scipy
from scipy.optimize import brentq


def inlet_film_factor(
    *,
    speed: float,
    eta0: float,
    alpha: float,
    beta: float,
    conductivity: float,
    capacity: float,
    expansion: float,
    half_width: float,
    radius: float,
    reach: float,
    cells: tuple[int, int] = (200, 20),
) -> float:
    """Return the film with inlet shear heating over the isothermal one.

    `capacity` is the heat capacity per volume; `expansion` is expansivity times absolute
    temperature; `reach` of the inlet in half-widths.
    """
    along, across = cells
    edges = -half_width * (1.0 + (reach - 1.0) * np.linspace(1.0, 0.0, along + 1) ** 2)
    dx = np.diff(edges)
    opening = {
        "edges": _opening(edges, half_width, radius),
        "cells": _opening(0.5 * (edges[1:] + edges[:-1]), half_width, radius),
    }
    z = np.linspace(0.0, 0.5, across + 1)  # from the middle of the film to a surface
    cubes = np.diff(z**3) / 3.0
    rise = np.zeros(cells)

    def slope(film):  # of the reduced pressure
        fluidity = 2.0 * (np.exp(beta * rise) * cubes).sum(axis=1) / eta0
        gap = film + opening["cells"]
        return speed * (gap - film) / (gap**3 * fluidity)

    def film_of():
        return brentq(lambda film: (slope(film) * dx).sum() - 1.0 / alpha, 1e-9, 1e-3, rtol=1e-12)

    isothermal = film = film_of()
    for _ in range(200):
        gap, reduced = film + opening["cells"], np.cumsum(slope(film) * dx)
        middle = reduced - 0.5 * slope(film) * dx
        thickening = 1.0 / (1.0 - alpha * np.minimum(middle, 0.999999 / alpha))
        gradient = slope(film) * thickening
        fluidity = np.exp(beta * rise) / (eta0 * thickening[:, None])
        heat = (gradient**2 * gap**3)[:, None] * cubes * fluidity
        flux = _flux(film, film + opening["edges"], fluidity, speed, z, cubes)
        mean = 0.5 * (flux[1:] + flux[:-1])
        heat += expansion * gradient[:, None] * mean
        new = _temperature(heat * dx[:, None], flux, gap, dx, z, conductivity, capacity)
        change = float(np.max(np.abs(new - rise)))
        rise = 0.5 * (rise + new)
        film, before = film_of(), film
        if abs(film / before - 1.0) < 1e-7 and change < 1e-5 * rise.max():
            return film / isothermal
    raise AssertionError("the twin did not converge")


def _opening(x, half_width, radius):
    """Return the gap of dry contact before the Hertz zone."""
    ratio = np.maximum(-x / half_width, 1.0)
    root = np.sqrt(ratio**2 - 1.0)
    return half_width**2 / (2.0 * radius) * (ratio * root - np.log(ratio + root))


def _flux(film, gap, fluidity, speed, z, cubes):
    """Return the oil flow between levels through the faces along x; their sum is speed film/2."""
    at_faces = np.vstack([fluidity[:1], 0.5 * (fluidity[1:] + fluidity[:-1]), fluidity[-1:]])
    gradient = speed * (gap - film) / (gap**3 * 2.0 * (at_faces * cubes).sum(axis=1))
    steps = at_faces * np.diff(z**2) / 2.0
    integral = np.zeros((len(gap), len(z)))
    integral[:, :-1] = steps[:, ::-1].cumsum(axis=1)[:, ::-1]
    velocity = speed - (gradient * gap**2)[:, None] * integral
    flux = 0.5 * (velocity[:, 1:] + velocity[:, :-1]) * np.diff(z) * gap[:, None]
    return flux + (speed * film / 2.0 - flux.sum(axis=1))[:, None] * np.diff(z) / 0.5


def _temperature(heat, flux, gap, dx, z, conductivity, capacity):
    """Return the rise of every cell: upwind in both directions, conduction across the film."""
    number, centres = np.arange(heat.size).reshape(heat.shape), 0.5 * (z[1:] + z[:-1])
    upward = np.zeros((len(heat), len(z)))  # by continuity, from the middle
    upward[:, 1:] = -np.cumsum(np.diff(flux, axis=0), axis=1)
    along, up = capacity * flux, capacity * upward
    own = np.maximum(along[1:], 0.0) - np.minimum(along[:-1], 0.0)
    own += np.maximum(up[:, 1:], 0.0) - np.minimum(up[:, :-1], 0.0)
    conducted = conductivity * (dx / gap)[:, None] / np.diff(centres)
    own[:, :-1] += conducted
    own[:, 1:] += conducted
    own[:, -1] += conductivity * dx / gap / (0.5 - centres[-1])
    entries = [
        (number, number, own),
        (number[1:], number[:-1], -np.maximum(along[1:-1], 0.0)),
        (number[:-1], number[1:], np.minimum(along[1:-1], 0.0)),
        (number[:, 1:], number[:, :-1], -np.maximum(up[:, 1:-1], 0.0) - conducted),
        (number[:, :-1], number[:, 1:], np.minimum(up[:, 1:-1], 0.0) - conducted),
    ]
    rows, columns, values = (np.concatenate([e[i].ravel() for e in entries]) for i in range(3))
    matrix = scipy.sparse.csc_array((values, (rows, columns)), shape=2 * (heat.size,))
    return scipy.sparse.linalg.spsolve(matrix, heat.ravel()).reshape(heat.shape)
