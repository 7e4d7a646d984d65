"""Stresses below sliding Hertz contacts in closed form and by summation of point loads; no
transform, no grid.

Pressure p_h sqrt(1 - r²), traction along x on the body q = friction times pressure; half-width and
p_h are 1; z points into the body, tension is positive.
"""

import numpy as np


def line(x, z, friction, nu=0.3):
    """σ_xx, σ_yy, σ_zz, σ_xz below a sliding cylinder, in plane strain.

    Source: E. McEwen, Phil. Mag. 40 (1949) 454, as in K. L. Johnson, Contact Mechanics (1985), eqs
    4.49 and 7.8; the same as J. O. Smith, C. K. Liu, J. Appl. Mech. 20 (1953) 157.
    """
    even = 1.0 - x**2 + z**2
    root = np.sqrt(even**2 + 4.0 * x**2 * z**2)
    m, n = np.sqrt((root + even) / 2.0), np.sign(x) * np.sqrt((root - even) / 2.0)
    total = m**2 + n**2
    pressed_x = -m * (1.0 + (z**2 + n**2) / total) + 2.0 * z
    pressed_z = -m * (1.0 - (z**2 + n**2) / total)
    pressed_xz = -n * (m**2 - z**2) / total
    sheared_x = n * (2.0 - (z**2 - m**2) / total) - 2.0 * x
    xx, zz = pressed_x + friction * sheared_x, pressed_z + friction * pressed_xz
    return xx, nu * (xx + zz), zz, pressed_xz + friction * pressed_x


def point(x, y, z, friction, nu=0.3, radial=80, around=160):
    """σ_xx, σ_yy, σ_zz, σ_xy, σ_yz, σ_xz at points below a sliding ball: Hamilton's integral by
    quadrature.

    Boussinesq's and Cerruti's point loads at Gauss points over the disc. Source: K. L. Johnson,
    Contact Mechanics (1985), eqs 3.19 and 3.76; G. M. Hamilton, Proc. IMechE 197C (1983) 53.
    """
    nodes, weights = np.polynomial.legendre.leggauss(radial)
    angle = np.pi / 4.0 * (nodes + 1.0)  # r = sin(angle) removes the root from the pressure
    turn = 2.0 * np.pi * (np.arange(around) + 0.5) / around
    r, load = np.sin(angle)[:, None], (weights * np.sin(angle) * np.cos(angle) ** 2)[:, None]
    load = np.broadcast_to(load * np.pi / 4.0 * 2.0 * np.pi / around, (radial, around)).ravel()
    x, y, z = (np.asarray(value, float)[..., None] for value in (x, y, z))
    x, y = x - (r * np.cos(turn)).ravel(), y - (r * np.sin(turn)).ravel()
    stresses = np.array(boussinesq(x, y, z, nu)) + friction * np.array(cerruti(x, y, z, nu))
    return (stresses * load).sum(axis=-1)


def boussinesq(x, y, z, nu):
    """Stresses under a unit force into the body at the origin."""
    r2 = x**2 + y**2
    d = np.sqrt(r2 + z**2)
    factor = (1.0 - 2.0 * nu) / r2
    xx = factor * ((1.0 - z / d) * (x**2 - y**2) / r2 + z * y**2 / d**3) - 3.0 * z * x**2 / d**5
    yy = factor * ((1.0 - z / d) * (y**2 - x**2) / r2 + z * x**2 / d**3) - 3.0 * z * y**2 / d**5
    xy = factor * ((1.0 - z / d) * 2.0 * x * y / r2 - x * y * z / d**3) - 3.0 * x * y * z / d**5
    return [
        s / (2.0 * np.pi)
        for s in (xx, yy, -3.0 * z**3 / d**5, xy, -3.0 * y * z**2 / d**5, -3.0 * x * z**2 / d**5)
    ]


def cerruti(x, y, z, nu):
    """Stresses under a unit force along x at the origin."""
    d = np.sqrt(x**2 + y**2 + z**2)
    s = d + z
    cubic, linear = 1.0 / (d**3 * s**2) + 2.0 / (d**2 * s**3), 1.0 / (d * s**2)
    weight = 1.0 - 2.0 * nu
    xx = weight * (x / d**3 - 3.0 * x * linear + x**3 * cubic) - 3.0 * x**3 / d**5
    yy = weight * (x / d**3 - x * linear + x * y**2 * cubic) - 3.0 * x * y**2 / d**5
    xy = weight * (-y * linear + x**2 * y * cubic) - 3.0 * x**2 * y / d**5
    zz, yz, xz = -3.0 * x * z**2 / d**5, -3.0 * x * y * z / d**5, -3.0 * x**2 * z / d**5
    return [stress / (2.0 * np.pi) for stress in (xx, yy, zz, xy, yz, xz)]
