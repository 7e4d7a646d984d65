"""Rough surfaces by what makes them: grains that cut grooves (ground), shot that leaves craters (sandblasted).

The marks are strewn over the domain by seed and repeat with it along both axes; they are evaluated
at the cell centres, so one seed is one physical surface on whatever grid resolves it.
"""

import math
from collections.abc import Callable, Iterator

import numpy as np
import numpy.typing as npt

from asperity.contact.grid import Grid
from asperity.core.errors import BadInput, require_positive
from asperity.surface.generate import require_lengths
from asperity.surface.model import Surface, length_text

_PASSES = (
    8.0  # grooves over each point: fewer leave the uncut surface, more change the shape no further
)
_SHOTS = 6.0  # craters over each point
_AT_ONCE = 200_000  # cells marked in one go: what the caches hold


def ground_surface(
    grid: Grid,
    *,
    sq: float,
    groove_width: float,
    groove_length: float,
    direction: float = 0.0,
    rng: np.random.Generator,
) -> Surface:
    """A ground surface: grains that stand out by chance cut parabolic grooves along the lay, the deepest cut remains.

    Depths are exponentially distributed, widths grow with the square root of the depth, as those
    of one round grain shape do, and grooves thin out towards both ends. The distribution of
    heights follows from the cutting: pits are deeper than peaks are high.

    Parameters
    ----------
    grid : where the heights are wanted
    sq : root-mean-square height of this very sample [m]; the mean is zero
    groove_width, groove_length : of the mean groove [m]
    direction : angle of the lay from x, the direction of rolling, towards y [rad]; pi/2 is across
    rng : the only source of chance

    Raises
    ------
    BadInput
        for grooves narrower than 4 cells or longer than half the domain.
    """
    require_lengths(
        grid,
        (groove_length, groove_width / 2.0),
        direction,
        ("groove_length", "half the groove_width"),
    )
    steep = abs(np.sin(direction)) > abs(np.cos(direction))
    if steep:  # columns along y: the other axis taken for x, at the complement of the angle
        turned = Grid(grid.cells[::-1], grid.lower[::-1], grid.upper[::-1], grid.periodic[::-1])
        direction = np.pi / 2.0 - direction
    else:
        turned = grid
    (nx, ny), (dx, dy) = turned.cells, turned.spacing
    tangent, cosine = float(np.tan(direction)), float(abs(np.cos(direction)))
    count = max(
        1, round(_PASSES * grid.extent[0] * grid.extent[1] / (groove_width * groove_length))
    )
    centres = rng.random((count, 2)) * turned.extent
    depths = np.sqrt(rng.exponential(size=count))  # square roots of depths: widths
    widths = groove_width * depths / np.mean(depths)
    half_columns = (
        int(np.ceil((groove_length * cosine + widths.max() * abs(np.sin(direction))) / 2.0 / dx))
        + 1
    )
    heights = np.zeros(nx * ny)
    order = np.argsort(widths)
    for marks in _batches(
        order, lambda widest: (2 * half_columns + 1) * 2 * _rows(widths[widest], cosine, dy)
    ):
        half_rows = _rows(widths[marks[-1]], cosine, dy)
        i = np.floor(centres[marks, 0] / dx).astype(np.intp)[:, None] + np.arange(
            -half_columns, half_columns + 1
        )
        off_x = (i + 0.5) * dx - centres[marks, 0, None]
        middle = centres[marks, 1, None] + tangent * off_x
        j = np.floor(middle / dy).astype(np.intp)[:, :, None] + np.arange(-half_rows, half_rows + 1)
        off_y = (j + 0.5) * dy - middle[
            :, :, None
        ]  # across the columns; across the groove it is shorter
        along = (off_x / cosine)[:, :, None] + off_y * np.sin(direction) * np.sign(
            np.cos(direction)
        )
        across = off_y * cosine
        cut = (1.0 - (2.0 * across / widths[marks, None, None]) ** 2) * np.sqrt(
            np.maximum(1.0 - (2.0 * along / groove_length) ** 2, 0.0)
        )
        deep = -(depths[marks, None, None] ** 2) * np.maximum(cut, 0.0)
        where = np.mod(i, nx)[:, :, None] * ny + np.mod(j, ny)
        np.minimum.at(heights, where.ravel(), deep.ravel())
    field = heights.reshape(nx, ny)
    return Surface.scaled(field.T if steep else field, grid, sq)


def sandblasted_surface(
    grid: Grid, *, sq: float, crater_radius: float, rng: np.random.Generator
) -> Surface:
    """A sandblasted surface: shot leaves craters whose rims hold what they displaced, one upon the other.

    A crater of radius R is z = -(1 - u)^2 (1 - 4 u), u = (r/2R)^2 < 1, deep in proportion to its
    radius; radii scatter by a quarter. Craters add up, so heights are nearly Gaussian, with pits a
    little deeper than peaks.

    Parameters
    ----------
    grid, sq, rng : as for `ground_surface`
    crater_radius : mean radius of the craters [m]

    Raises
    ------
    BadInput
        for craters smaller than 2 cells or larger than an eighth of the domain.
    """
    require_positive("crater_radius", crater_radius, "m")
    least, most = 2.0 * max(grid.spacing), min(grid.extent) / 8.0
    if not least <= crater_radius <= most:
        raise BadInput(
            f"crater_radius must lie between 2 cells, {length_text(least)}, and an eighth of the domain, "
            f"{length_text(most)}, got {length_text(crater_radius)}; change it or the grid"
        )
    (nx, ny), (dx, dy) = grid.cells, grid.spacing
    count = max(1, round(_SHOTS * grid.extent[0] * grid.extent[1] / (np.pi * crater_radius**2)))
    centres = rng.random((count, 2)) * grid.extent
    radii = crater_radius * np.clip(1.0 + 0.25 * rng.standard_normal(count), 0.25, 1.75)

    def reach(radius: float) -> tuple[int, int]:
        return int(np.ceil(2.0 * radius / dx)), int(np.ceil(2.0 * radius / dy))

    heights = np.zeros(nx * ny)
    order = np.argsort(radii)
    for marks in _batches(order, lambda widest: 4 * math.prod(r + 1 for r in reach(radii[widest]))):
        half = reach(radii[marks[-1]])
        i, j = (
            np.floor(centres[marks, axis] / spacing).astype(np.intp)[:, None]
            + np.arange(-far, far + 1)
            for axis, (spacing, far) in enumerate(zip((dx, dy), half, strict=True))
        )
        u = ((i + 0.5) * dx - centres[marks, 0, None])[:, :, None] ** 2 + (
            ((j + 0.5) * dy - centres[marks, 1, None])[:, None, :] ** 2
        )
        u = np.minimum(u / (2.0 * radii[marks, None, None]) ** 2, 1.0)
        crater = -radii[marks, None, None] * (1.0 - u) ** 2 * (1.0 - 4.0 * u)
        where = np.mod(i, nx)[:, :, None] * ny + np.mod(j, ny)[:, None, :]
        np.add.at(heights, where.ravel(), crater.ravel())
    return Surface.scaled(heights.reshape(nx, ny), grid, sq)


def _rows(width: float, cosine: float, dy: float) -> int:
    """Cells that a groove reaches to either side of its middle."""
    return int(np.ceil(width / 2.0 / cosine / dy)) + 1


def _batches(
    order: npt.NDArray[np.intp], cells: Callable[[int], int]
) -> Iterator[npt.NDArray[np.intp]]:
    """Marks of like size together, ascending, as many as fit into memory; `cells` of the widest among them."""
    first = 0
    while first < order.size:
        last = first + 1
        while last < order.size and (
            2 * (last - first) * cells(int(order[min(2 * last - first, order.size) - 1]))
        ) <= (_AT_ONCE):
            last = min(2 * last - first, order.size)
        yield order[first:last]
        first = last
