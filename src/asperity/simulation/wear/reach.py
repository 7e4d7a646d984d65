"""The part of a track that the contact reaches: the Hertz zone, and the scar where it has grown beyond."""

import numpy as np

from asperity.contact.grid import MIN_CELLS, Grid
from asperity.core.arrays import Field
from asperity.surface import Surface

TRACE = 0.01  # of the deepest profile: what has lost less lies beside the track


def reached(depth: Field, places: Field, half_width: float) -> slice:
    """Cells of the Hertz zone, and of what is worn by more than a trace; as many as a surface has at least."""
    inside = np.flatnonzero((np.abs(places) <= half_width) | (depth > TRACE * depth.max()))
    first, last = (
        (int(inside[0]), int(inside[-1])) if inside.size else (places.size // 2, places.size // 2)
    )
    short = max(MIN_CELLS - (last - first + 1), 0)
    first = min(max(first - (short + 1) // 2, 0), places.size - MIN_CELLS)
    return slice(first, max(last + (short + 1) // 2 + 1, first + MIN_CELLS))


def part_of(surface: Surface, cells: tuple[slice, slice]) -> Surface:
    """The part of a surface on those cells."""
    heights, grid = surface.heights[cells], surface.grid
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
    kept = Grid(
        (heights.shape[0], heights.shape[1]),
        (lower[0], lower[1]),
        (upper[0], upper[1]),
        (repeats[0], repeats[1]),
    )
    return Surface(heights, kept)
