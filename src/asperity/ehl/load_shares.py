"""CAR, CLR and the Hertz zone: worked out here and nowhere else."""

import numpy as np

from asperity.contact.conditions import ContactConditions
from asperity.contact.grid import Grid
from asperity.core.arrays import Field, Mask
from asperity.ehl.roller_profile import RollerProfile

CENTRE = 0.1  # half-widths each side of x = 0 that count as the centre of the contact


def within_ellipse(
    x: Field, y: Field, half_widths: tuple[float, float], spacing: tuple[float, float]
) -> Mask:
    """Cells within the ellipse of these half-widths about the origin, at least the middle ones, shape (nx, ny)."""
    (a, b), (dx, dy) = half_widths, spacing
    along, across = x / max(a, dx), y / max(b, dy)
    return np.asarray((along**2)[:, None] + across**2 <= 1.0)


def hertz_zone(conditions: ContactConditions, grid: Grid, share: float = 1.0) -> Mask:
    """Cells within a share of the smooth dry contact's half-widths, at least the middle ones, shape (nx, ny)."""
    (a, b), (dx, dy) = conditions.hertz.half_widths, grid.spacing
    if conditions.geometry == "roller":
        along = RollerProfile(conditions, a, a**2 / conditions.radius_along_rolling)
        return along.zone(grid.x / a, grid.y / a, share, (dx / a, dy / a))
    return within_ellipse(
        grid.x, grid.y, (share * a, np.inf if conditions.endless else share * b), grid.spacing
    )


def area_share(cells: Mask, zone: Mask) -> float:
    """Share of a zone's cells, 0 to 1: of cells that touch, in the Hertz zone, CAR."""
    return float(cells[zone].mean())


def carried_share(pressure: Field, cells: Mask) -> float:
    """Share of the load on some cells, 0 to 1: on cells that touch, CLR."""
    return float(pressure[cells].sum() / (pressure.sum() or 1.0))
