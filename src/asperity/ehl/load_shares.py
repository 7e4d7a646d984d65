"""Definitions of CAR, CLR and the Hertz zone."""

import numpy as np

from asperity.contact.conditions import ContactConditions
from asperity.contact.grid import Grid
from asperity.core.arrays import Field, Mask
from asperity.ehl.roller_profile import RollerProfile

CENTRE = 0.1  # half-widths of the central zone on each side of x = 0


def within_ellipse(
    x: Field, y: Field, half_widths: tuple[float, float], spacing: tuple[float, float]
) -> Mask:
    """Return the cells within an ellipse about the origin, at least the central ones, (nx, ny)."""
    (a, b), (dx, dy) = half_widths, spacing
    along = x / max(a, dx)
    across = y / max(b, dy)
    return np.asarray((along**2)[:, None] + across**2 <= 1.0)


def hertz_zone(conditions: ContactConditions, grid: Grid, share: float = 1.0) -> Mask:
    """Return the cells within a share of the Hertz half-widths, shape (nx, ny).

    The central ones always belong to it.
    """
    (a, b) = conditions.hertz.half_widths
    (dx, dy) = grid.spacing
    if conditions.geometry == "roller":
        along = RollerProfile(conditions, a, a**2 / conditions.radius_along_rolling)
        return along.zone(grid.x / a, grid.y / a, share, (dx / a, dy / a))
    return within_ellipse(
        grid.x, grid.y, (share * a, np.inf if conditions.endless else share * b), grid.spacing
    )


def area_share(cells: Mask, zone: Mask) -> float:
    """Return the share of cells in a zone, 0 to 1: CAR for touching cells in the Hertz zone."""
    return float(cells[zone].mean())


def carried_share(pressure: Field, cells: Mask) -> float:
    """Return the load share of some cells, 0 to 1: CLR for touching cells."""
    return float(pressure[cells].sum() / (pressure.sum() or 1.0))
