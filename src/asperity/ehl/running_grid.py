"""Cells of the two grids on which a running contact is solved."""

import math

from asperity.contact.conditions import ContactConditions
from asperity.contact.grid import Grid
from asperity.core.errors import BadInput

MOST_RUNNING_CELLS = 3600  # of the fine grid at the default accuracy
CELLS_PER_LENGTH = 8.0  # on the fine grid, as on an automatic grid
MIN_CELLS_PER_HALF_WIDTH, MIN_CELLS_ACROSS = 8.0, 16.0  # on the fine grid


def running_cells(
    conditions: ContactConditions, grid: Grid, lengths: tuple[float, float], most: int
) -> tuple[int, int]:
    """Return the fine grid's cells: even numbers, about `most` in all, at most those of `grid`.

    A correlation length (`lengths` [m] along x and y) has equally many cells along both axes, at
    most `CELLS_PER_LENGTH`. The Hertz zone has at least 16 of them, and 8 of the coarse grid:
    BadInput if `grid` has fewer.
    """
    extents, half_widths = grid.extent, conditions.hertz.half_widths
    sizes = [extent / length for extent, length in zip(extents, lengths, strict=True)]
    varied = [size for size in sizes if size > 0.0]  # uniform roughness has an infinite length
    density = min(CELLS_PER_LENGTH, (most / math.prod(varied)) ** (1.0 / len(varied)))
    least = [MIN_CELLS_PER_HALF_WIDTH * e / a for e, a in zip(extents, half_widths, strict=True)]
    if conditions.long:
        least[1] = MIN_CELLS_ACROSS
    for axis, fewest, count in zip("xy", least, grid.cells, strict=True):
        if count < math.ceil(fewest):
            raise BadInput(
                f"the grid has {count} cells along {axis}, but running roughness is solved on two "
                f"grids and needs {math.ceil(fewest)}; use more cells, or contact.roughness = "
                '"standing"'
            )
    nx, ny = (
        min(2 * math.ceil(0.5 * max(density * size, fewest)), count - count % 2)
        for size, fewest, count in zip(sizes, least, grid.cells, strict=True)
    )
    return nx, ny
