"""Rough surfaces from models of machining: grooves of grinding and craters of sandblasting.

Marks are placed at random over the periodic domain and evaluated at the cell centres, so a seed
defines one physical surface on any grid that resolves it.
"""

import math
from collections.abc import Callable, Iterator
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from asperity.contact.grid import Grid
from asperity.core.arrays import Field
from asperity.core.errors import BadInput, require_positive
from asperity.surface.generate import require_lengths
from asperity.surface.model import Surface, length_text

_GROOVES_PER_POINT = 8.0  # fewer leave uncut surface, more do not change the shape
_CRATERS_PER_POINT = 6.0
_BATCH_CELLS = 200_000  # marked at once, limited by the caches


class _Grooves(NamedTuple):
    """Grooves of grinding: centres (n, 2) and widths [m], roots of the depths, length, lay."""

    centres: Field
    root_depths: Field
    widths: Field
    length: float
    direction: float

    @property
    def cosine(self) -> float:
        """Cosine of the angle between the grooves and x."""
        return float(abs(np.cos(self.direction)))

    def depth(self, marks: npt.NDArray[np.intp], along: Field, across: Field) -> Field:
        """Return the depth of some grooves at points along and across them."""
        cut = (1.0 - (2.0 * across / self.widths[marks, None, None]) ** 2) * np.sqrt(
            np.maximum(1.0 - (2.0 * along / self.length) ** 2, 0.0)
        )
        return np.asarray(self.root_depths[marks, None, None] ** 2 * np.maximum(cut, 0.0))

    def half_columns(self, dx: float) -> int:
        """Return the half-width of the widest groove along x in cells."""
        across = self.widths.max() * abs(np.sin(self.direction))
        return int(np.ceil((self.length * self.cosine + across) / 2.0 / dx)) + 1

    def half_rows(self, groove: int, dy: float) -> int:
        """Return the half-width of a groove along y in cells."""
        return int(np.ceil(self.widths[groove] / 2.0 / self.cosine / dy)) + 1


def ground_surface(
    grid: Grid,
    *,
    sq: float,
    groove_width: float,
    groove_length: float,
    direction: float = 0.0,
    rng: np.random.Generator,
) -> Surface:
    """Generate a ground surface: grains cut parabolic grooves along the lay, the deepest remains.

    Depths are exponentially distributed, widths proportional to the square root of the depth (round
    grains), and grooves taper towards both ends. The heights are negatively skewed: pits are deeper
    than peaks are high.

    Parameters
    ----------
    grid : grid of the heights
    sq : root-mean-square height of the sample [m]; the mean is zero
    groove_width, groove_length : dimensions of the mean groove [m]
    direction : angle of the lay from x, the direction of rolling, towards y [rad]; pi/2 is across
    rng : random generator

    Raises
    ------
    BadInput
        Grooves are narrower than 4 cells or longer than half the domain.

    Examples
    --------
    >>> import numpy as np
    >>> from asperity.contact.grid import Grid
    >>> from asperity.surface import ground_surface
    >>> grid = Grid(cells=(64, 64), lower=(0.0, 0.0), upper=(1e-3, 1e-3), periodic=(True, True))
    >>> rng = np.random.default_rng(1)
    >>> surface = ground_surface(grid, sq=0.5e-6, groove_width=80e-6, groove_length=400e-6, rng=rng)
    >>> f"Sq {surface.heights.std() * 1e6:.2f} um"
    'Sq 0.50 um'
    """
    require_lengths(
        grid,
        (groove_length, groove_width / 2.0),
        direction,
        ("groove_length", "half the groove_width"),
    )
    steep = abs(np.sin(direction)) > abs(np.cos(direction))
    if steep:  # swap the axes, so that grooves run mainly along x
        layout = Grid(grid.cells[::-1], grid.lower[::-1], grid.upper[::-1], grid.periodic[::-1])
        direction = np.pi / 2.0 - direction
    else:
        layout = grid
    count = max(
        1,
        round(
            _GROOVES_PER_POINT * grid.extent[0] * grid.extent[1] / (groove_width * groove_length)
        ),
    )
    centres = rng.random((count, 2)) * layout.extent
    root_depths = np.sqrt(rng.exponential(size=count))  # proportional to the widths
    widths = groove_width * root_depths / np.mean(root_depths)
    field = _cut_grooves(layout, _Grooves(centres, root_depths, widths, groove_length, direction))
    return Surface.scaled(field.T if steep else field, grid, sq)


def sandblasted_surface(
    grid: Grid, *, sq: float, crater_radius: float, rng: np.random.Generator
) -> Surface:
    """Generate a sandblasted surface: the sum of craters whose rims hold the displaced material.

    A crater of radius R is z = -(1 - u)^2 (1 - 4 u), u = (r/2R)^2 < 1, with a depth proportional to
    its radius; the standard deviation of radii is 25 %. Heights are nearly Gaussian, with pits
    slightly deeper than peaks.

    Parameters
    ----------
    grid, sq, rng : as for `ground_surface`
    crater_radius : mean radius of the craters [m]

    Raises
    ------
    BadInput
        Craters are smaller than 2 cells or larger than an eighth of the domain.

    Examples
    --------
    >>> import numpy as np
    >>> from asperity.contact.grid import Grid
    >>> from asperity.surface import sandblasted_surface
    >>> grid = Grid(cells=(64, 64), lower=(0.0, 0.0), upper=(1e-3, 1e-3), periodic=(True, True))
    >>> rng = np.random.default_rng(1)
    >>> surface = sandblasted_surface(grid, sq=1e-6, crater_radius=60e-6, rng=rng)
    >>> f"Sq {surface.heights.std() * 1e6:.2f} um"
    'Sq 1.00 um'
    """
    require_positive("crater_radius", crater_radius, "m")
    least = 2.0 * max(grid.spacing)
    most = min(grid.extent) / 8.0
    if not least <= crater_radius <= most:
        raise BadInput(
            f"crater_radius must lie between 2 cells, {length_text(least)}, and an eighth of the "
            f"domain, {length_text(most)}, got {length_text(crater_radius)}; change it or the grid"
        )
    count = max(
        1, round(_CRATERS_PER_POINT * grid.extent[0] * grid.extent[1] / (np.pi * crater_radius**2))
    )
    centres = rng.random((count, 2)) * grid.extent
    radii = crater_radius * np.clip(1.0 + 0.25 * rng.standard_normal(count), 0.25, 1.75)

    def cells(mark: int) -> int:
        return 4 * math.prod(half + 1 for half in _crater_cells(radii[mark], grid.spacing))

    heights = np.zeros(math.prod(grid.cells))
    for marks in _batches(np.argsort(radii), cells):
        _add_craters(heights, grid, centres[marks], radii[marks])
    return Surface.scaled(heights.reshape(grid.cells), grid, sq)


def _crater_cells(radius: float, spacing: tuple[float, float]) -> tuple[int, int]:
    """Return the half-widths of a crater with its rim in cells."""
    dx, dy = spacing
    return int(np.ceil(2.0 * radius / dx)), int(np.ceil(2.0 * radius / dy))


def _cells_around(centres: Field, spacing: float, half: int) -> npt.NDArray[np.intp]:
    """Return the cells up to `half` away from each centre along one axis, on the last axis."""
    nearest = np.floor(centres / spacing).astype(np.intp)
    return np.asarray(nearest[..., None] + np.arange(-half, half + 1))


def _add_craters(heights: Field, grid: Grid, centres: Field, radii: Field) -> None:
    """Add craters of ascending radius to flat heights in place."""
    (nx, ny), (dx, dy) = grid.cells, grid.spacing
    i, j = (
        _cells_around(centres[:, axis], grid.spacing[axis], half)
        for axis, half in enumerate(_crater_cells(radii[-1], grid.spacing))
    )
    u = ((i + 0.5) * dx - centres[:, 0, None])[:, :, None] ** 2 + (
        ((j + 0.5) * dy - centres[:, 1, None])[:, None, :] ** 2
    )
    radius = radii[:, None, None]
    u = np.minimum(u / (2.0 * radius) ** 2, 1.0)
    crater = -radius * (1.0 - u) ** 2 * (1.0 - 4.0 * u)
    cells = np.mod(i, nx)[:, :, None] * ny + np.mod(j, ny)[:, None, :]
    np.add.at(heights, cells.ravel(), crater.ravel())


def _cut_grooves(grid: Grid, grooves: _Grooves) -> Field:
    """Return the lower envelope of grooves that run mainly along x; zero where nothing is cut."""
    (nx, ny), dy = grid.cells, grid.spacing[1]
    columns = 2 * grooves.half_columns(grid.spacing[0]) + 1
    heights = np.zeros(nx * ny)
    for marks in _batches(
        np.argsort(grooves.widths), lambda widest: columns * 2 * grooves.half_rows(widest, dy)
    ):
        _cut_batch(heights, grid, grooves, marks)
    return heights.reshape(nx, ny)


def _cut_batch(heights: Field, grid: Grid, grooves: _Grooves, marks: npt.NDArray[np.intp]) -> None:
    """Cut grooves of ascending width into flat heights in place."""
    (nx, ny) = grid.cells
    (dx, dy) = grid.spacing
    cosine = grooves.cosine
    columns = grooves.half_columns(dx)
    rows = grooves.half_rows(marks[-1], dy)
    x, y = grooves.centres[marks].T
    i = _cells_around(x, dx, columns)
    off_x = (i + 0.5) * dx - x[:, None]
    middle = y[:, None] + float(np.tan(grooves.direction)) * off_x
    j = _cells_around(middle, dy, rows)
    off_y = (j + 0.5) * dy - middle[:, :, None]  # along y, not perpendicular to the groove
    along = (off_x / cosine)[:, :, None] + off_y * np.sin(grooves.direction) * np.sign(
        np.cos(grooves.direction)
    )
    depth = grooves.depth(marks, along, off_y * cosine)
    cells = np.mod(i, nx)[:, :, None] * ny + np.mod(j, ny)
    np.minimum.at(heights, cells.ravel(), -depth.ravel())


def _batches(
    order: npt.NDArray[np.intp], cells: Callable[[int], int]
) -> Iterator[npt.NDArray[np.intp]]:
    """Yield marks of similar size in ascending order; `cells(mark)` limits the size of a batch."""
    first = 0
    while first < order.size:
        last = first + 1
        while (
            last < order.size
            and (2 * (last - first) * cells(int(order[min(2 * last - first, order.size) - 1])))
            <= _BATCH_CELLS
        ):
            last = min(2 * last - first, order.size)
        yield order[first:last]
        first = last
