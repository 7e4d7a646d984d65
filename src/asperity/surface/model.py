"""A rough surface on a grid: heights only, no physics."""

from dataclasses import dataclass

import numpy as np

from asperity.arrays import Field
from asperity.errors import BadInput
from asperity.grid import Grid


@dataclass(frozen=True, slots=True)
class Surface:
    """Composite roughness: heights [m], shape (nx, ny) on `grid`, x along rolling; positive = material.

    Raises
    ------
    BadInput
        if the shape is not the grid's or a height is not finite.
    """

    heights: Field
    grid: Grid

    def __post_init__(self) -> None:
        if self.heights.shape != self.grid.cells:
            raise BadInput(f"heights must have the grid's shape {self.grid.cells}, got {self.heights.shape}; resample them onto the grid")
        missing = int(np.count_nonzero(~np.isfinite(self.heights)))
        if missing:
            raise BadInput(f"surface has {missing} heights that are not finite; fill or crop them first")

    @property
    def sq(self) -> float:
        """Root-mean-square height about the mean [m]."""
        return float(np.std(self.heights))


def flat_surface(grid: Grid) -> Surface:
    """A perfectly smooth surface."""
    return Surface(np.zeros(grid.cells), grid)
