"""Cells of the two grids on which a running contact is solved."""

import math

from asperity.contact.conditions import ContactConditions
from asperity.contact.grid import Grid

MOST_RUNNING_CELLS = 3200  # of the fine grid at the default accuracy
CELLS_PER_LENGTH = 8.0  # on the fine grid, as on an automatic grid
MIN_CELLS_PER_HALF_WIDTH, MIN_CELLS_ACROSS = 8.0, 16.0  # on a fine grid with a coarser one


def running_cells(
    conditions: ContactConditions, grid: Grid, lengths: tuple[float, float], most: int
) -> tuple[int, int]:
    """Return the fine grid's cells: even numbers, about `most` in all, at most those of `grid`.

    A correlation length (`lengths` [m] along x and y) has equally many cells along both axes, at
    most `CELLS_PER_LENGTH`. The Hertz zone has at least 16 of them, if `grid` has as many.
    """
    sizes = [extent / length for extent, length in zip(grid.extent, lengths, strict=True)]
    varied = [size for size in sizes if size > 0.0]  # uniform roughness has an infinite length
    density = min(CELLS_PER_LENGTH, (most / math.prod(varied)) ** (1.0 / len(varied)))
    nx, ny = (
        min(2 * math.ceil(0.5 * max(density * size, fewest)), count - count % 2)
        for size, fewest, count in zip(sizes, _fewest(conditions, grid), grid.cells, strict=True)
    )
    return nx, ny


def half_as_many(
    conditions: ContactConditions, grid: Grid, cells: tuple[int, int]
) -> tuple[int, int] | None:
    """Return the coarse grid's cells beside a fine grid of `cells`; None if it has too few."""
    fewest = _fewest(conditions, grid)
    if any(count < math.ceil(least) for count, least in zip(cells, fewest, strict=True)):
        return None
    return cells[0] // 2, max(1, cells[1] // 2)


def _fewest(conditions: ContactConditions, grid: Grid) -> list[float]:
    """Return the fewest cells along x and y of a fine grid that has a coarser one."""
    half_widths = conditions.hertz.half_widths
    fewest = [
        MIN_CELLS_PER_HALF_WIDTH * extent / half_width
        for extent, half_width in zip(grid.extent, half_widths, strict=True)
    ]
    if conditions.long:
        fewest[1] = MIN_CELLS_ACROSS
    return fewest
