"""Deflection of a half-space by a uniformly loaded rectangle, periodic in y, as a sum of images."""

import numpy as np


def love(x, y, half_x, half_y):
    """Integral of 1/r over a rectangle centred on zero. Source: Love (1929), Johnson (1985) eq
    3.25.
    """
    total = 0.0
    for sign, edge_x, edge_y in (
        (+1, x + half_x, y + half_y),
        (+1, x - half_x, y - half_y),
        (-1, x + half_x, y - half_y),
        (-1, x - half_x, y + half_y),
    ):
        r = np.hypot(edge_x, edge_y)
        # asinh(y/|x|) = ln((y + r)/|x|), without the cancellation of y + r
        total = total + sign * (
            edge_x * np.arcsinh(edge_y / np.abs(edge_x))
            + edge_y * np.arcsinh(edge_x / np.abs(edge_y))
        )
        assert np.all(r > 0.0)
    return total


def periodic_compliance(x, y, spacing, period, images=3000):
    """Displacement at distances (x, y) from a unit pressure on one cell, all images in y included.

    In the solver's units: 1/(2 pi) times the integral of 1/r. The sum grows with the logarithm of
    the number of images; without the same length of a line load, the potential -ln|x|/pi per unit
    load and length remains.
    """
    dx, dy = spacing
    image = np.arange(-images, images + 1) * period
    cells = love(x[..., None], y[..., None] - image, dx / 2.0, dy / 2.0).sum(axis=-1) / (
        2.0 * np.pi
    )
    return cells - dx * dy / (np.pi * period) * np.log((2 * images + 1) * period)
