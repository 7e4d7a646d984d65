"""From a measured map to roughness on a contact grid: condition, cut, fill, resample, close the ends, scale, combine.

Every step says in one sentence what it did; the sentences travel with the result.
"""

from dataclasses import dataclass
from typing import Literal, NamedTuple, get_args

import numpy as np
import numpy.typing as npt

from asperity.contact.grid import Grid
from asperity.core.arrays import Field
from asperity.core.errors import BadInput
from asperity.surface.condition import Form, Outliers, condition_surface
from asperity.surface.model import (
    MeasuredSurface,
    Surface,
    area_text,
    length_text,
    require_roughness,
)
from asperity.surface.read import surface_topography

Fit = Literal["crop", "tile"]

_OVERLAP = (
    1.0 / 8.0
)  # of a repeating side, over which its ends are blended: long enough to hide, short enough to spare
_LOBES = 16  # of the windowed sinc to either side; Kaiser's 6 then stops aliases to 1e-3 ...
_KAISER = 6.0  # ... and passes waves longer than 2.3 cells untouched


@dataclass(frozen=True, slots=True)
class PreparedSurface:
    """Roughness on the contact grid, and the sentences that say how it came about."""

    surface: Surface
    steps: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class CompositeSurface:
    """Two rough surfaces that face each other, and the speed [m/s] along x at which each moves.

    Raises
    ------
    BadInput
        if they do not lie on one grid.
    """

    first: Surface
    second: Surface
    speeds: tuple[float, float]

    def __post_init__(self) -> None:
        if self.first.grid != self.second.grid:
            raise BadInput(
                f"two surfaces in contact need one grid, got {self.first.grid} and {self.second.grid}; "
                "prepare both for the same one"
            )

    @property
    def surface(self) -> Surface:
        """What the gap sees: the sum of both. The second lies face down, turned over about x, so its y runs back."""
        return Surface(self.first.heights + self.second.heights[:, ::-1], self.first.grid)


def prepare_surface(
    measured: MeasuredSurface,
    grid: Grid,
    *,
    sq: float | None = None,
    form: Form = "quadratic",
    fit: Fit = "crop",
    turn: bool = False,
    outliers: Outliers = "keep",
    s_filter: float | None = None,
    l_filter: float | None = None,
    most_missing: float = 0.25,
    place: int = 0,
) -> PreparedSurface:
    """Put a measured map onto a contact grid as roughness about a zero mean.

    The map is conditioned as a whole, a place of it cut out, its missing cells filled, resampled
    by a windowed sinc that keeps every wave that the coarser of pixel and cell can show, and,
    along an axis that repeats, its ends blended into one another. A profile goes on unchanged
    across its direction.

    Parameters
    ----------
    measured : what the instrument gave
    grid : the contact's grid; x of the map runs along rolling
    sq : scale the heights to this Sq [m]; None keeps them as measured
    form, turn, outliers, s_filter, l_filter : how to condition the map first, see `condition`
    fit : "crop" needs a map as large as the grid; "tile" repeats a smaller one, mirrored so that no seam shows
    most_missing : the largest share of missing cells that is filled
    place : which part of the map, of as many as `places` counts that do not overlap; 0 is its centre

    Raises
    ------
    BadInput
        for a map smaller than the grid, a place that it has not, too many missing cells, or a flat map that is to be
        scaled.
    """
    if fit not in get_args(Fit):
        raise BadInput(f"fit must be one of {', '.join(get_args(Fit))}, got {fit!r}")
    if sq is not None:
        require_roughness(sq)
    levelled, conditioning = condition_surface(
        measured, form=form, turn=turn, outliers=outliers, s_filter=s_filter, l_filter=l_filter
    )
    overlap = _overlap(levelled, grid)
    fitting, centre = _fitting(levelled, grid, fit), _centre(levelled, grid, place)
    if place:
        fitting += f", then moved by {' and '.join(map(length_text, centre))} to place {place}"
    heights, positions = _cut(levelled, grid, overlap, centre)
    heights, filling = _fill(heights, levelled, most_missing)
    heights, resampling = _resample(heights, positions, levelled.grid, grid, overlap)
    steps = [*conditioning, fitting, filling, resampling]
    for axis, (cells, shared) in enumerate(zip(grid.cells, overlap, strict=True)):
        if shared:
            before = _shape_inside(heights, grid)
            heights = _close(heights, axis, cells, shared)
            steps.append(
                _closing(axis, shared, levelled, grid, before, _shape_inside(heights, grid))
            )
    heights = heights - heights.mean()
    natural_sq = float(np.std(heights))
    if sq is None:
        steps.append(f"removed the mean; Sq is {length_text(natural_sq)}")
        return PreparedSurface(Surface(heights, grid), tuple(steps))
    if natural_sq == 0.0:
        raise BadInput(
            f"{measured.name} is flat and cannot be scaled to an Sq of {length_text(sq)}; leave sq out"
        )
    steps.append(
        f"removed the mean and scaled the heights by {sq / natural_sq:.4g}, "
        f"from Sq {length_text(natural_sq)} to {length_text(sq)}"
    )
    return PreparedSurface(Surface(heights * (sq / natural_sq), grid), tuple(steps))


def places(measured: MeasuredSurface, grid: Grid, *, turn: bool = False) -> int:
    """How many parts of a map as large as the grid do not overlap, its centre one of them; at least 1."""
    return len(_places(measured.turned() if turn else measured, grid))


def _overlap(measured: MeasuredSurface, grid: Grid) -> tuple[int, ...]:
    """Cells over which the ends of each axis are blended."""
    return tuple(
        max(4, round(n * _OVERLAP)) if ends and axis != measured.uniform else 0
        for axis, (n, ends) in enumerate(zip(grid.cells, grid.periodic, strict=True))
    )


def _places(measured: MeasuredSurface, grid: Grid) -> list[tuple[float, float]]:
    """Centres of parts that lie side by side within the map, from the map's own centre [m], the nearest first."""
    steps, each_way = [], []
    for axis, (side, cell, shared) in enumerate(
        zip(grid.extent, grid.spacing, _overlap(measured, grid), strict=True)
    ):
        step, have = side + shared * cell, measured.grid.extent[axis]
        steps.append(step)
        each_way.append(
            0 if axis == measured.uniform else max(0, int((have / step * (1.0 + 1e-9) - 1.0) / 2.0))
        )
    lattice = [
        (i, j)
        for i in range(-each_way[0], each_way[0] + 1)
        for j in range(-each_way[1], each_way[1] + 1)
    ]
    lattice.sort(key=lambda at: (abs(at[0]) + abs(at[1]), at))
    return [(i * steps[0], j * steps[1]) for i, j in lattice]


def _centre(measured: MeasuredSurface, grid: Grid, place: int) -> tuple[float, float]:
    """Of a place, from the map's own centre [m]."""
    centres = _places(measured, grid)
    if not 0 <= place < len(centres):
        raise BadInput(
            f"{measured.name} has room for {len(centres)} of the contact's {area_text(grid.extent)} apart from one "
            f"another, got place {place}; count them from 0"
        )
    return centres[place]


def _fitting(measured: MeasuredSurface, grid: Grid, fit: Fit) -> str:
    """What part of the map is used, or why it cannot be."""
    have, need = area_text(measured.grid.extent), area_text(grid.extent)
    if measured.uniform is not None:
        axis = 1 - measured.uniform
        length, side = measured.grid.extent[axis], grid.extent[axis]
        steady = f"taken to go on unchanged along {'xy'[measured.uniform]}"
        if length >= side * (1.0 - 1e-9):
            return f"cut {length_text(side)} from the centre of the profile of {length_text(length)}, {steady}"
        if fit == "crop":
            raise BadInput(
                f"{measured.name} is a profile of {length_text(length)}, shorter than the contact's "
                f"{length_text(side)}; use a smaller grid, a longer profile, or fit = tile to repeat it mirrored"
            )
        return f"repeated the profile of {length_text(length)}, mirrored at its ends, to {length_text(side)}, {steady}"
    # a grid whose corners come out of a division may exceed the map it was cut to by a rounding
    # error
    if all(m >= g * (1.0 - 1e-9) for m, g in zip(measured.grid.extent, grid.extent, strict=True)):
        return f"cut {need} from the centre of the {have} measured"
    if fit == "crop":
        raise BadInput(
            f"{measured.name} covers {have}, smaller than the contact's {need}; "
            "use a smaller grid, a larger map, or fit = tile to repeat it mirrored"
        )
    return f"repeated the {have} measured, mirrored at its edges, to cover {need}"


def _cut(
    measured: MeasuredSurface, grid: Grid, overlap: tuple[int, ...], centre: tuple[float, float]
) -> tuple[Field, list[Field]]:
    """The part around a centre that resampling needs, mirrored beyond the edges, and where its cells sit [m]."""
    indices: list[npt.NDArray[np.intp]] = []
    positions: list[Field] = []
    for n, pixel, extent, cell, shared, offset in zip(
        measured.grid.cells,
        measured.grid.spacing,
        grid.extent,
        grid.spacing,
        overlap,
        centre,
        strict=True,
    ):
        half = (extent + shared * cell) / 2.0
        margin = 1 + int(np.ceil(_LOBES * max(pixel, cell) / pixel))  # the sinc's reach
        reach = int(np.ceil(half / pixel)) + margin
        moved = round(offset / pixel)
        wanted = np.arange(n // 2 - reach, n // 2 + reach + 1) + moved
        folded = np.mod(wanted, 2 * n)
        indices.append(np.minimum(folded, 2 * n - 1 - folded))
        positions.append(np.asarray((wanted - moved + 0.5 - n / 2.0) * pixel, dtype=np.float64))
    return measured.heights[np.ix_(*indices)], positions


def _fill(heights: Field, measured: MeasuredSurface, most_missing: float) -> tuple[Field, str]:
    """Missing cells by a harmonic function: the smoothest that meets the heights around each hole."""
    missing = ~np.isfinite(heights)
    share = float(np.mean(missing))
    if share == 0.0:
        return heights, "found no missing cells to fill"
    if share > most_missing:
        raise BadInput(
            f"{measured.name} misses {100.0 * share:.3g} % of the cells in the part used, more than the "
            f"{100.0 * most_missing:g} % that are filled; measure it again or use another part"
        )
    sizes = (float(heights.shape[0]), float(heights.shape[1]))
    filled = (
        surface_topography()
        .Topography(np.ma.masked_array(heights, missing), sizes)
        .interpolate_undefined_data()
    )
    whole = np.ma.filled(filled.heights(), np.nan)
    return whole, f"filled {100.0 * share:.2g} % missing cells by harmonic interpolation"


def _resample(
    heights: Field, positions: list[Field], source: Grid, grid: Grid, overlap: tuple[int, ...]
) -> tuple[Field, str]:
    """Band-limited interpolation along each axis; `overlap` cells more than the grid has."""
    shortest = []
    for axis, (n, shared, pixel, cell) in enumerate(
        zip(grid.cells, overlap, source.spacing, grid.spacing, strict=True)
    ):
        wanted = (np.arange(n + shared) + 0.5 - (n + shared) / 2.0) * cell
        step = max(pixel, cell)
        t = (wanted[:, None] - positions[axis][None, :]) / step
        weights = np.sinc(t) * np.i0(_KAISER * np.sqrt(np.maximum(1.0 - (t / _LOBES) ** 2, 0.0)))
        weights[np.abs(t) > _LOBES] = 0.0
        weights /= weights.sum(axis=1, keepdims=True)
        heights = np.moveaxis(np.tensordot(weights, heights, axes=(1, axis)), 0, axis)
        shortest.append(2.0 * step)
    pixels, cells = area_text(source.spacing), area_text(grid.spacing)
    return np.ascontiguousarray(heights), (
        f"resampled from pixels of {pixels} to cells of {cells} by a windowed sinc, "
        f"which keeps the waves longer than {area_text((shortest[0], shortest[1]))} as they are"
    )


def _close(heights: Field, axis: int, cells: int, shared: int) -> Field:
    """Blend what follows the last cell into the first ones, so that the surface goes on where it began.

    The weights keep the variance whatever the correlation rho of the two ends: w1^2 + w2^2 + 2 rho
    w1 w2 = 1.
    """
    rows = np.moveaxis(heights, axis, 0)
    start, beyond = rows[:shared], rows[cells : cells + shared]
    rho = float(
        np.clip(
            np.mean(start * beyond) / max(np.std(start) * np.std(beyond), np.finfo(float).tiny),
            -0.5,
            1.0,
        )
    )
    t = (np.arange(shared) + 0.5)[:, None] / shared
    own = t * t * (3.0 - 2.0 * t)
    other = 1.0 - own
    closed = rows[:cells].copy()
    closed[:shared] = (own * start + other * beyond) / np.sqrt(
        own**2 + other**2 + 2.0 * rho * own * other
    )
    return np.moveaxis(closed, 0, axis)


def _closing(
    axis: int, shared: int, measured: MeasuredSurface, grid: Grid, before: "_Shape", after: "_Shape"
) -> str:
    length = shared * grid.spacing[axis]
    spare = measured.grid.extent[axis] - grid.extent[axis]
    mirrored = "" if spare >= length else ", mirrored there for want of more measurement,"
    return (
        f"blended the ends along {'xy'[axis]} over {length_text(length)}{mirrored} so that the surface repeats "
        f"(Sq {length_text(before.sq)} before, {length_text(after.sq)} after; Sdq {before.sdq:.3g}, {after.sdq:.3g}; "
        f"Ssk {before.ssk:.2f}, {after.ssk:.2f}; Sku {before.sku:.2f}, {after.sku:.2f})"
    )


class _Shape(NamedTuple):
    """The parameters that blending may move."""

    sq: float
    sdq: float
    ssk: float
    sku: float


def _shape_inside(heights: Field, grid: Grid) -> _Shape:
    inside = (
        heights[: grid.cells[0], : grid.cells[1]] - heights[: grid.cells[0], : grid.cells[1]].mean()
    )
    sq = float(np.std(inside))
    sdq = float(
        np.sqrt(
            sum(
                np.mean(np.diff(inside, axis=axis) ** 2) / d**2
                for axis, d in enumerate(grid.spacing)
            )
        )
    )
    if sq == 0.0:
        return _Shape(0.0, 0.0, 0.0, 0.0)
    return _Shape(sq, sdq, float(np.mean(inside**3)) / sq**3, float(np.mean(inside**4)) / sq**4)
