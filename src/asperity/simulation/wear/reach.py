"""Part of a track that lies in the contact: the Hertz zone, or the scar where it is larger."""

import numpy as np

from asperity.contact.grid import MIN_CELLS, Grid
from asperity.core.arrays import Field
from asperity.surface import Surface

WORN_SHARE = 0.01  # of the largest depth: cells worn less lie outside the track


def reached_cells(depth: Field, points: Field, half_width: float) -> slice:
    """Return the cells of the Hertz zone and the scar; at least the fewest of a surface."""
    inside = np.flatnonzero((np.abs(points) <= half_width) | (depth > WORN_SHARE * depth.max()))
    first, last = (
        (int(inside[0]), int(inside[-1])) if inside.size else (points.size // 2, points.size // 2)
    )
    short = max(MIN_CELLS - (last - first + 1), 0)
    first = min(max(first - (short + 1) // 2, 0), points.size - MIN_CELLS)
    return slice(first, max(last + (short + 1) // 2 + 1, first + MIN_CELLS))


def cropped(surface: Surface, cells: tuple[slice, slice]) -> Surface:
    """Return the part of a surface on those cells."""
    heights = surface.heights[cells]
    grid = surface.grid
    if heights.shape == grid.cells:
        return surface
    starts = [part.start or 0 for part in cells]
    lower = [
        low + start * step
        for low, start, step in zip(grid.lower, starts, grid.spacing, strict=True)
    ]
    upper = [
        low + count * step
        for low, count, step in zip(lower, heights.shape, grid.spacing, strict=True)
    ]
    repeats = [
        repeat and part == slice(None) for repeat, part in zip(grid.periodic, cells, strict=True)
    ]
    part = Grid(
        (heights.shape[0], heights.shape[1]),
        (lower[0], lower[1]),
        (upper[0], upper[1]),
        (repeats[0], repeats[1]),
    )
    return Surface(heights, part)
