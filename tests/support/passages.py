"""Synthetic jumps for the mechanisms of wear: a track, the contact at some positions on it, and a
body.
"""

import numpy as np

from asperity.contact.grid import Grid
from asperity.wear import Body, Passage, Patch

STEEL = Body(youngs_modulus=210e9, poisson_ratio=0.3, hardness=None, speed=1.6)


def track(cells=(64, 32), size=(400e-6, 200e-6)):
    return Grid(
        cells, (-0.5 * size[0], -0.5 * size[1]), (0.5 * size[0], 0.5 * size[1]), (False, True)
    )


def hertz_patches(grid, half_width, p_max, count, *, friction=0.0, asperities=0.0, film=0.5e-6):
    """Return a line contact's pressure at equidistant positions along the track; `asperities` is
    their share of it.
    """
    patches = []
    length = grid.extent[0]
    for number in range(count):
        away = (
            grid.x - grid.lower[0] - (number + 0.5) * length / count + 0.5 * length
        ) % length - 0.5 * length
        along = p_max * np.sqrt(np.maximum(1.0 - (away / half_width) ** 2, 0.0))
        pressure = np.repeat(along[:, None], grid.cells[1], axis=1)
        patches.append(
            Patch(
                pressure=pressure,
                asperity_pressure=asperities * pressure,
                shear=friction * pressure,
                film=np.where(pressure > 0.0, film, np.inf),
            )
        )
    return tuple(patches)


def passage(grid, patches, **given):
    settled = {
        "body": 0,
        "heights": np.zeros(grid.cells),
        "removed": np.zeros(grid.cells),
        "material": STEEL,
        "sliding_speed": 0.4,
        "half_width": 50e-6,
        "overrollings": 0.0,
        "jump": 1e5,
        "seconds": 100.0,
        "boundary_friction": 0.15,
        "rng": np.random.default_rng(1),
    }
    return Passage(grid=grid, patches=patches, **(settled | given))
