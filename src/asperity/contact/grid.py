"""Computational grid of a contact: cells, corners and periodic axes; samples at cell centres."""

from dataclasses import dataclass

import numpy as np

from asperity.core.arrays import Field
from asperity.core.errors import BadInput

MIN_CELLS = 8


@dataclass(frozen=True, slots=True)
class Grid:
    """Uniform rectangular grid; x runs along rolling, y along the contact line.

    Parameters
    ----------
    cells : (nx, ny)
    lower, upper : corners (x, y) [m], measured from the contact centre
    periodic : periodic axes; a line contact is periodic in y

    Raises
    ------
    BadInput
        An axis has fewer than 8 cells, or the upper corner is not beyond the lower one.

    Examples
    --------
    >>> from asperity.contact.grid import Grid
    >>> grid = Grid(cells=(64, 32), lower=(-2e-4, 0.0), upper=(2e-4, 1e-4))
    >>> grid.spacing
    (6.25e-06, 3.125e-06)
    """

    cells: tuple[int, int]
    lower: tuple[float, float]
    upper: tuple[float, float]
    periodic: tuple[bool, bool] = (False, True)

    def __post_init__(self) -> None:
        for axis, count, low, high in zip("xy", self.cells, self.lower, self.upper, strict=True):
            if count < MIN_CELLS:
                raise BadInput(
                    f"grid must have at least {MIN_CELLS} cells along {axis}, got {count}; use 64 "
                    "or more"
                )
            if not low < high:
                raise BadInput(
                    f"grid must have an upper {axis} beyond its lower one, got {low:g} m to "
                    f"{high:g} m; swap them"
                )

    @property
    def spacing(self) -> tuple[float, float]:
        """Cell sizes (dx, dy) [m]."""
        (nx, ny) = self.cells
        (x0, y0) = self.lower
        (x1, y1) = self.upper
        return (x1 - x0) / nx, (y1 - y0) / ny

    @property
    def extent(self) -> tuple[float, float]:
        """Side lengths (Lx, Ly) [m]."""
        return self.upper[0] - self.lower[0], self.upper[1] - self.lower[1]

    @property
    def x(self) -> Field:
        """Cell centres along rolling [m], shape (nx,)."""
        return self.lower[0] + (np.arange(self.cells[0]) + 0.5) * self.spacing[0]

    @property
    def y(self) -> Field:
        """Cell centres along the contact line [m], shape (ny,)."""
        return self.lower[1] + (np.arange(self.cells[1]) + 0.5) * self.spacing[1]
