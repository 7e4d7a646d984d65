"""Roughness on a contact grid from a measured map: condition, cut, fill, resample, blend and scale.

Each step is reported in one sentence, stored with the result.
"""

from dataclasses import dataclass
from typing import Literal, NamedTuple, get_args

import numpy as np
import numpy.typing as npt
import scipy

from asperity.contact.grid import Grid
from asperity.core.arrays import Field
from asperity.core.errors import BadInput, require_choice
from asperity.core.third_party import surface_topography
from asperity.surface.condition import (
    DEFAULT_CONDITIONING,
    SIGMA_OVER_CUTOFF,
    SurfaceConditioning,
    condition_surface,
)
from asperity.surface.model import (
    MeasuredSurface,
    Surface,
    area_text,
    length_text,
    require_roughness,
)
from asperity.surface.parameters import gradient, lay_text

FitMode = Literal["crop", "tile"]

MAX_SLOPE_CHANGE = 0.3  # of Sdq by sampling or the shortest third of the waves, above which noted
_OVERLAP = 1.0 / 8.0  # share of a periodic side over which its ends are blended
# Windowed sinc: with these settings aliases are below 1e-3, waves longer than 2.3 cells unchanged
_LOBES = 16  # to either side
_KAISER = 6.0  # parameter of the Kaiser window
# first words of the steps of a preparation
_VERBS = ("turned", "removed", "kept", "cut", "repeated", "filled", "resampled", "blended")


@dataclass(frozen=True, slots=True)
class PreparedSurface:
    """Roughness on the contact grid, and a sentence for each step of its preparation."""

    surface: Surface
    steps: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class CompositeSurface:
    """Two facing rough surfaces, and their speeds along x [m/s].

    Raises
    ------
    BadInput
        The surfaces have different grids.
    """

    first: Surface
    second: Surface
    speeds: tuple[float, float]

    def __post_init__(self) -> None:
        if self.first.grid != self.second.grid:
            raise BadInput(
                f"two surfaces in contact need one grid, got {self.first.grid} and "
                f"{self.second.grid}; prepare both for the same one"
            )

    @property
    def surface(self) -> Surface:
        """Composite roughness, the sum of both; the second is turned over about x (y reversed)."""
        return Surface(self.first.heights + self.second.heights[:, ::-1], self.first.grid)


def prepare_surface(
    measured: MeasuredSurface,
    grid: Grid,
    *,
    conditioning: SurfaceConditioning = DEFAULT_CONDITIONING,
    sq: float | None = None,
    fit: FitMode = "crop",
    max_missing: float = 0.25,
    place: int = 0,
) -> PreparedSurface:
    """Transfer a measured map to a contact grid as roughness about a zero mean.

    The whole map is conditioned; then a part is cut out, missing cells are filled, and the heights
    are resampled by a windowed sinc that preserves all waves resolved by the coarser of pixel and
    cell. The ends of a periodic axis are blended. A profile is extended unchanged across its
    direction.

    Parameters
    ----------
    measured : measured map or profile
    grid : the contact's grid; x of the map runs along rolling
    conditioning : form removal, rotation, outliers and filters
    sq : scale the heights to this Sq [m]; None keeps the measured heights
    fit : "crop" requires a map as large as the grid; "tile" repeats a smaller map, mirrored
    max_missing : largest share of missing cells that is filled
    place : number of the part, below `count_places`; 0 is the centre of the map

    Raises
    ------
    BadInput
        The map is smaller than the grid, the place does not exist, too many cells are missing, or a
        flat map is to be scaled.
    """
    require_choice("fit", fit, get_args(FitMode))
    if sq is not None:
        require_roughness(sq)
    levelled, conditioning_steps = condition_surface(measured, conditioning)
    overlap = _overlap(levelled, grid)
    fitting = _fitting(levelled, grid, fit)
    centre = _centre(levelled, grid, place)
    if place:
        fitting += f", then moved by {' and '.join(map(length_text, centre))} to place {place}"
    heights, positions = _cut(levelled, grid, overlap, centre)
    heights, filling = _fill(heights, levelled, max_missing)
    heights, resampling = _resample(heights, positions, levelled.grid, grid, overlap)
    steps = [step for step in (*conditioning_steps, fitting, filling, resampling) if step]
    for axis, (cells, overlap_cells) in enumerate(zip(grid.cells, overlap, strict=True)):
        if overlap_cells:
            before = _height_statistics(heights, grid)
            heights = _blend_ends(heights, axis, cells, overlap_cells)
            after = _height_statistics(heights, grid)
            steps.append(_blending_step(axis, overlap_cells, levelled, grid, before, after))
    heights, scaling = _scale(heights - heights.mean(), sq, measured.name)
    return _checked(Surface(heights, grid), levelled, (*steps, scaling), scaled=sq is not None)


def _checked(
    surface: Surface, measured: MeasuredSurface, steps: tuple[str, ...], *, scaled: bool
) -> PreparedSurface:
    """Return the surface, with its lay, and a step where filter or sampling decide its slope."""
    if measured.is_map and surface.sq > 0.0:
        steps = (*steps, lay_text(surface))
    pixels, grid = measured.grid.spacing, surface.grid
    slope = _height_statistics(surface.heights, grid).sdq
    if slope == 0.0 or min(measured.grid.cells) < 2:
        return PreparedSurface(surface, steps)
    shortest = [3.0 * max(pair) for pair in zip(grid.spacing, pixels, strict=True)]
    sigmas = np.multiply(shortest, SIGMA_OVER_CUTOFF) / grid.spacing
    smooth = scipy.ndimage.gaussian_filter(surface.heights, sigmas, mode="nearest")
    scale = surface.sq / measured.sq if scaled else 1.0
    values = {
        f"without waves shorter than {length_text(max(shortest))}": _height_statistics(
            smooth, grid
        ).sdq,
        f"on the map's pixels of {length_text(max(pixels))}": scale
        * gradient(measured.heights, measured.grid),
    }
    if all(abs(value / slope - 1.0) < MAX_SLOPE_CHANGE for value in values.values()):
        return PreparedSurface(surface, steps)
    others = " and ".join(f"{value:.3g} {where}" for where, value in values.items())
    note = (
        f"sampling decides the slope: Sdq is {slope:.3g} on this grid, {others}; CLR depends on it "
        "more than on Sq: state s_filter, the shortest wave that counts"
    )
    return PreparedSurface(surface, (*steps, note))


def _scale(heights: Field, sq: float | None, name: str) -> tuple[Field, str]:
    natural_sq = float(np.std(heights))
    if sq is None:
        return heights, f"removed the mean; Sq is {length_text(natural_sq)}"
    if natural_sq == 0.0:
        raise BadInput(
            f"{name} is flat and cannot be scaled to an Sq of {length_text(sq)}; leave sq out"
        )
    return heights * (sq / natural_sq), (
        f"removed the mean and scaled the heights by {sq / natural_sq:.4g}, "
        f"from Sq {length_text(natural_sq)} to {length_text(sq)}"
    )


def step_sentence(step: str) -> str:
    """Return a step of the preparation as a sentence with a subject, for notes.

    Examples
    --------
    >>> from asperity.surface import step_sentence
    >>> step_sentence("filled 2 % missing cells by harmonic interpolation")
    'The preparation filled 2 % missing cells by harmonic interpolation.'
    """
    verb = step.partition(" ")[0]
    subject = "The surface" if verb == "has" else "The preparation" if verb in _VERBS else ""
    sentence = f"{subject} {step}" if subject else f"{step[:1].upper()}{step[1:]}"
    return f"{sentence.rstrip('.')}."


def count_places(measured: MeasuredSurface, grid: Grid, *, turn: bool = False) -> int:
    """Return the number of parts of the grid's size that fit into a map side by side; at least 1.

    One of them is centred on the map.
    """
    return len(_place_centres(measured.turned() if turn else measured, grid))


def _overlap(measured: MeasuredSurface, grid: Grid) -> tuple[int, ...]:
    """Return the number of cells over which the ends of each axis are blended."""
    return tuple(
        max(4, round(n * _OVERLAP)) if periodic and axis != measured.uniform else 0
        for axis, (n, periodic) in enumerate(zip(grid.cells, grid.periodic, strict=True))
    )


def _place_centres(measured: MeasuredSurface, grid: Grid) -> list[tuple[float, float]]:
    """Return centres of parts side by side, relative to the map's centre [m], nearest first."""
    steps, counts = [], []
    for axis, (side, cell, overlap_cells) in enumerate(
        zip(grid.extent, grid.spacing, _overlap(measured, grid), strict=True)
    ):
        step = side + overlap_cells * cell
        extent = measured.grid.extent[axis]
        steps.append(step)
        counts.append(  # to either side
            0
            if axis == measured.uniform
            else max(0, int((extent / step * (1.0 + 1e-9) - 1.0) / 2.0))
        )
    lattice = [
        (i, j) for i in range(-counts[0], counts[0] + 1) for j in range(-counts[1], counts[1] + 1)
    ]
    lattice.sort(key=lambda node: (abs(node[0]) + abs(node[1]), node))
    return [(i * steps[0], j * steps[1]) for i, j in lattice]


def _centre(measured: MeasuredSurface, grid: Grid, place: int) -> tuple[float, float]:
    """Return the centre of a place relative to the map's centre [m]."""
    centres = _place_centres(measured, grid)
    if not 0 <= place < len(centres):
        raise BadInput(
            f"{measured.name} has room for {len(centres)} separate places of the contact's "
            f"{area_text(grid.extent)}, got place {place}; places count from 0"
        )
    return centres[place]


def _fitting(measured: MeasuredSurface, grid: Grid, fit: FitMode) -> str:
    """Return a sentence on the part of the map that is used; raise BadInput if it is too small."""
    available = area_text(measured.grid.extent)
    required = area_text(grid.extent)
    if measured.uniform is not None:
        axis = 1 - measured.uniform
        length = measured.grid.extent[axis]
        side = grid.extent[axis]
        extended = f"extended unchanged along {'xy'[measured.uniform]}"
        profile = f"the profile of {length_text(length)}"
        if length >= side * (1.0 - 1e-9):
            return f"cut {length_text(side)} from the centre of {profile}, {extended}"
        if fit == "crop":
            raise BadInput(
                f"{measured.name} is a profile of {length_text(length)}, shorter than the "
                f"contact's {length_text(side)}; use a smaller grid, a longer profile, or fit = "
                "tile to repeat it mirrored"
            )
        return f"repeated {profile}, mirrored at its ends, to {length_text(side)}, {extended}"
    # tolerance: the corners of a grid have rounding errors
    if all(m >= g * (1.0 - 1e-9) for m, g in zip(measured.grid.extent, grid.extent, strict=True)):
        return f"cut {required} from the centre of the {available} measured"
    if fit == "crop":
        raise BadInput(
            f"{measured.name} covers {available}, smaller than the contact's {required}; "
            "use a smaller grid, a larger map, or fit = tile to repeat it mirrored"
        )
    return f"repeated the {available} measured, mirrored at its edges, to cover {required}"


def _cut(
    measured: MeasuredSurface, grid: Grid, overlap: tuple[int, ...], centre: tuple[float, float]
) -> tuple[Field, list[Field]]:
    """Return the part that resampling needs, mirrored beyond the edges, and its positions [m]."""
    indices: list[npt.NDArray[np.intp]] = []
    positions: list[Field] = []
    for n, pixel, extent, cell, overlap_cells, offset in zip(
        measured.grid.cells,
        measured.grid.spacing,
        grid.extent,
        grid.spacing,
        overlap,
        centre,
        strict=True,
    ):
        half = (extent + overlap_cells * cell) / 2.0
        margin = 1 + int(np.ceil(_LOBES * max(pixel, cell) / pixel))  # range of the sinc
        reach = int(np.ceil(half / pixel)) + margin
        shift = round(offset / pixel)
        pixels = np.arange(n // 2 - reach, n // 2 + reach + 1) + shift
        folded = np.mod(pixels, 2 * n)
        indices.append(np.minimum(folded, 2 * n - 1 - folded))
        positions.append(np.asarray((pixels - shift + 0.5 - n / 2.0) * pixel, dtype=np.float64))
    return measured.heights[np.ix_(*indices)], positions


def _fill(heights: Field, measured: MeasuredSurface, max_missing: float) -> tuple[Field, str]:
    """Fill missing cells by harmonic interpolation of the heights around each hole."""
    missing = ~np.isfinite(heights)
    share = float(np.mean(missing))
    if share == 0.0:
        return heights, ""
    if share > max_missing:
        raise BadInput(
            f"{measured.name} misses {100.0 * share:.3g} % of the cells in the part used, more "
            f"than the limit of {100.0 * max_missing:g} %; measure it again or use another part"
        )
    sizes = (float(heights.shape[0]), float(heights.shape[1]))
    filled = (
        surface_topography()
        .Topography(np.ma.masked_array(heights, missing), sizes)
        .interpolate_undefined_data()
    )
    complete = np.ma.filled(filled.heights(), np.nan)
    return complete, f"filled {100.0 * share:.2g} % missing cells by harmonic interpolation"


def _resample(
    heights: Field, positions: list[Field], source: Grid, grid: Grid, overlap: tuple[int, ...]
) -> tuple[Field, str]:
    """Interpolate band-limited along each axis, onto the grid and `overlap` additional cells."""
    shortest = []
    for axis, (n, overlap_cells, pixel, cell) in enumerate(
        zip(grid.cells, overlap, source.spacing, grid.spacing, strict=True)
    ):
        centres = (np.arange(n + overlap_cells) + 0.5 - (n + overlap_cells) / 2.0) * cell
        step = max(pixel, cell)
        t = (centres[:, None] - positions[axis][None, :]) / step
        weights = np.sinc(t) * np.i0(_KAISER * np.sqrt(np.maximum(1.0 - (t / _LOBES) ** 2, 0.0)))
        weights[np.abs(t) > _LOBES] = 0.0
        weights /= weights.sum(axis=1, keepdims=True)
        heights = np.moveaxis(np.tensordot(weights, heights, axes=(1, axis)), 0, axis)
        shortest.append(2.0 * step)
    pixels = area_text(source.spacing)
    cells = area_text(grid.spacing)
    return np.ascontiguousarray(heights), (
        f"resampled from pixels of {pixels} to cells of {cells} by a windowed sinc, "
        f"which preserves waves longer than {area_text((shortest[0], shortest[1]))}"
    )


def _blend_ends(heights: Field, axis: int, cells: int, overlap_cells: int) -> Field:
    """Blend the cells after the last one into the first ones, so that the surface is periodic.

    The weights preserve the variance for any correlation rho of the two ends: w1^2 + w2^2 + 2 rho
    w1 w2 = 1.
    """
    rows = np.moveaxis(heights, axis, 0)
    start = rows[:overlap_cells]
    extra = rows[cells : cells + overlap_cells]
    rho = float(
        np.clip(
            np.mean(start * extra) / max(np.std(start) * np.std(extra), np.finfo(float).tiny),
            -0.5,
            1.0,
        )
    )
    t = (np.arange(overlap_cells) + 0.5)[:, None] / overlap_cells
    weight = t * t * (3.0 - 2.0 * t)
    complement = 1.0 - weight
    closed = rows[:cells].copy()
    closed[:overlap_cells] = (weight * start + complement * extra) / np.sqrt(
        weight**2 + complement**2 + 2.0 * rho * weight * complement
    )
    return np.moveaxis(closed, 0, axis)


def _blending_step(
    axis: int,
    overlap_cells: int,
    measured: MeasuredSurface,
    grid: Grid,
    before: "_HeightStatistics",
    after: "_HeightStatistics",
) -> str:
    length = overlap_cells * grid.spacing[axis]
    spare = measured.grid.extent[axis] - grid.extent[axis]
    mirrored = "" if spare >= length else ", mirrored beyond the edge of the map,"
    return (
        f"blended the ends along {'xy'[axis]} over {length_text(length)}{mirrored} so that the "
        f"surface repeats (Sq {length_text(before.sq)} before, {length_text(after.sq)} after; Sdq "
        f"{before.sdq:.3g}, {after.sdq:.3g}; Ssk {before.ssk:.2f}, {after.ssk:.2f}; Sku "
        f"{before.sku:.2f}, {after.sku:.2f})"
    )


class _HeightStatistics(NamedTuple):
    """Parameters that blending may change."""

    sq: float
    sdq: float
    ssk: float
    sku: float


def _height_statistics(heights: Field, grid: Grid) -> _HeightStatistics:
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
        return _HeightStatistics(0.0, 0.0, 0.0, 0.0)
    skewness = float(np.mean(inside**3)) / sq**3
    kurtosis = float(np.mean(inside**4)) / sq**4
    return _HeightStatistics(sq, sdq, skewness, kurtosis)
