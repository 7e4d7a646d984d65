"""From a measured map to roughness on a contact grid: level, cut, fill, resample, close the ends, scale.

Every step says in one sentence what it did; the sentences travel with the result.
"""

from dataclasses import dataclass, replace
from typing import Literal, get_args

import numpy as np
import numpy.typing as npt

from asperity.arrays import Field
from asperity.errors import BadInput, require_positive
from asperity.grid import Grid
from asperity.surface.model import MeasuredSurface, Surface, area_text, length_text
from asperity.surface.read import library

Form = Literal["none", "plane", "quadratic"]
Fit = Literal["crop", "tile"]

_POWERS: dict[Form, tuple[tuple[int, int], ...]] = {
    "none": ((0, 0),),
    "plane": ((0, 0), (1, 0), (0, 1)),
    "quadratic": ((0, 0), (1, 0), (0, 1), (2, 0), (1, 1), (0, 2)),
}
_OVERLAP = 1.0 / 8.0  # of a repeating side, over which its ends are blended: long enough to hide, short enough to spare
_HALF_AT_CUTOFF = 0.4697 / np.sqrt(2.0 * np.pi)  # ISO 16610-61 Gaussian: sigma over the wavelength passed at 50 %


@dataclass(frozen=True, slots=True)
class PreparedSurface:
    """Roughness on the contact grid, and the sentences that say how it came about."""

    surface: Surface
    steps: tuple[str, ...]


def level(measured: MeasuredSurface, form: Form) -> tuple[MeasuredSurface, str]:
    """Remove the least-squares form and the mean; returns the levelled map and what was done.

    Missing cells take no part and stay missing. `form`: "none" (the mean only), "plane" or "quadratic".

    Raises
    ------
    BadInput
        for a form that is not in that list, or fewer valid cells than the form has terms.
    """
    if form not in get_args(Form):
        raise BadInput(f"form must be one of {', '.join(get_args(Form))}, got {form!r}")
    known = np.isfinite(measured.heights)
    powers = _POWERS[form]
    if np.count_nonzero(known) < len(powers):
        raise BadInput(
            f"{measured.name} has too few valid heights to remove a {form} form; use form none or measure again"
        )
    x, y = np.meshgrid(*(np.linspace(-1.0, 1.0, n) for n in measured.grid.cells), indexing="ij")
    terms = np.stack([x**i * y**j for i, j in powers], axis=-1)
    offset = np.mean(measured.heights[known])  # some files carry centimetres of it; least squares should not
    coefficients, *_ = np.linalg.lstsq(terms[known], measured.heights[known] - offset, rcond=None)
    shape = terms @ coefficients
    levelled = replace(measured, heights=measured.heights - offset - shape)
    if form == "none":
        return levelled, "removed the mean height and no form"
    height = length_text(float(np.ptp(shape)))
    sq = f"Sq {length_text(measured.sq)} before, {length_text(levelled.sq)} after"
    return levelled, f"removed a {form} form of {height} peak to valley from the whole map ({sq})"


def prepare_surface(
    measured: MeasuredSurface,
    grid: Grid,
    *,
    sq: float | None = None,
    form: Form = "quadratic",
    fit: Fit = "crop",
    most_missing: float = 0.25,
) -> PreparedSurface:
    """Put a measured map onto a contact grid as roughness about a zero mean.

    The form is removed from the whole map, the centre cut out, its missing cells filled, resampled (low-passed first
    where the grid is coarser than the pixel) and, along an axis that repeats, its ends blended into one another.

    Parameters
    ----------
    measured : what the instrument gave
    grid : the contact's grid; x of the map runs along rolling
    sq : scale the heights to this Sq [m]; None keeps them as measured
    form : what to remove first, "none", "plane" or "quadratic"
    fit : "crop" needs a map as large as the grid; "tile" repeats a smaller one, mirrored so that no seam shows
    most_missing : the largest share of missing cells that is filled

    Raises
    ------
    BadInput
        for a map smaller than the grid, too many missing cells, or a flat map that is to be scaled.
    """
    if fit not in get_args(Fit):
        raise BadInput(f"fit must be one of {', '.join(get_args(Fit))}, got {fit!r}")
    if sq is not None:
        require_positive("sq", sq, "m")
    levelled, levelling = level(measured, form)
    steps = [levelling]
    overlap = tuple(
        max(4, round(n * _OVERLAP)) if ends else 0 for n, ends in zip(grid.cells, grid.periodic, strict=True)
    )
    steps.append(_fitting(measured, grid, fit))
    heights, positions = _cut(levelled, grid, overlap)
    heights, filling = _fill(heights, levelled, most_missing)
    steps.append(filling)
    heights, resampling = _resample(heights, positions, measured.grid, grid, overlap)
    steps.append(resampling)
    for axis, (cells, shared) in enumerate(zip(grid.cells, overlap, strict=True)):
        if shared:
            before = _sq_inside(heights, grid.cells)
            heights = _close(heights, axis, cells, shared)
            steps.append(_closing(axis, shared, measured, grid, before, _sq_inside(heights, grid.cells)))
    heights = heights - heights.mean()
    found = float(np.std(heights))
    if sq is None:
        steps.append(f"removed the mean; Sq is {length_text(found)}")
        return PreparedSurface(Surface(heights, grid), tuple(steps))
    if found == 0.0:
        raise BadInput(f"{measured.name} is flat and cannot be scaled to an Sq of {length_text(sq)}; leave sq out")
    steps.append(
        f"removed the mean and scaled the heights by {sq / found:.4g}, "
        f"from Sq {length_text(found)} to {length_text(sq)}"
    )
    return PreparedSurface(Surface(heights * (sq / found), grid), tuple(steps))


def _fitting(measured: MeasuredSurface, grid: Grid, fit: Fit) -> str:
    """What part of the map is used, or why it cannot be."""
    have, need = area_text(measured.grid.extent), area_text(grid.extent)
    # a grid whose corners come out of a division may exceed the map it was cut to by a rounding error
    if all(m >= g * (1.0 - 1e-9) for m, g in zip(measured.grid.extent, grid.extent, strict=True)):
        return f"cut {need} from the centre of the {have} measured"
    if fit == "crop":
        raise BadInput(
            f"{measured.name} covers {have}, smaller than the contact's {need}; "
            "use a smaller grid, a larger map, or fit = tile to repeat it mirrored"
        )
    return f"repeated the {have} measured, mirrored at its edges, to cover {need}"


def _cut(measured: MeasuredSurface, grid: Grid, overlap: tuple[int, ...]) -> tuple[Field, list[Field]]:
    """The part around the centre that resampling needs, mirrored beyond the edges, and where its cells sit [m]."""
    indices: list[npt.NDArray[np.intp]] = []
    positions: list[Field] = []
    for n, pixel, extent, cell, shared in zip(
        measured.grid.cells, measured.grid.spacing, grid.extent, grid.spacing, overlap, strict=True
    ):
        half = (extent + shared * cell) / 2.0
        margin = 4 + int(np.ceil(4.0 * _smoothing(pixel, cell)))  # the spline's and the low-pass's reach
        reach = int(np.ceil(half / pixel)) + margin
        wanted = np.arange(n // 2 - reach, n // 2 + reach + 1)
        folded = np.mod(wanted, 2 * n)
        indices.append(np.minimum(folded, 2 * n - 1 - folded))
        positions.append(np.asarray((wanted + 0.5 - n / 2.0) * pixel, dtype=np.float64))
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
    filled = library().Topography(np.ma.masked_array(heights, missing), sizes).interpolate_undefined_data()
    return np.ma.filled(
        filled.heights(), np.nan
    ), f"filled {100.0 * share:.2g} % missing cells by harmonic interpolation"


def _smoothing(pixel: float, cell: float) -> float:
    """Sigma in pixels of the low-pass that keeps a coarser grid from folding short waves into long ones."""
    return float(_HALF_AT_CUTOFF * 2.0 * cell / pixel) if cell > pixel * (1.0 + 1e-6) else 0.0


def _resample(
    heights: Field, positions: list[Field], source: Grid, grid: Grid, overlap: tuple[int, ...]
) -> tuple[Field, str]:
    """Low-pass where the grid is coarser, then a cubic spline; `overlap` cells more than the grid has."""
    from scipy.interpolate import RectBivariateSpline
    from scipy.ndimage import gaussian_filter1d

    smoothed = []
    for axis, (pixel, cell) in enumerate(zip(source.spacing, grid.spacing, strict=True)):
        sigma = _smoothing(pixel, cell)
        if sigma:
            heights = gaussian_filter1d(heights, sigma, axis=axis, mode="nearest")
            smoothed.append(f"waves below {length_text(2.0 * cell)} along {'xy'[axis]} low-passed first")
    wanted = [
        np.asarray((np.arange(n + shared) + 0.5 - (n + shared) / 2.0) * cell, dtype=np.float64)
        for n, shared, cell in zip(grid.cells, overlap, grid.spacing, strict=True)
    ]
    resampled = np.asarray(
        RectBivariateSpline(positions[0], positions[1], heights, kx=3, ky=3, s=0.0)(wanted[0], wanted[1])
    )
    how = "; ".join(smoothed) or f"below waves of {length_text(2.0 * max(source.spacing))} the detail is the spline's"
    pixels, cells = area_text(source.spacing), area_text(grid.spacing)
    return resampled, f"resampled from pixels of {pixels} to cells of {cells} by a cubic spline ({how})"


def _close(heights: Field, axis: int, cells: int, shared: int) -> Field:
    """Blend what follows the last cell into the first ones, so that the surface goes on where it began.

    The weights keep the variance whatever the correlation rho of the two ends: w1^2 + w2^2 + 2 rho w1 w2 = 1.
    """
    rows = np.moveaxis(heights, axis, 0)
    start, beyond = rows[:shared], rows[cells : cells + shared]
    rho = float(np.clip(np.mean(start * beyond) / max(np.std(start) * np.std(beyond), np.finfo(float).tiny), -0.5, 1.0))
    t = (np.arange(shared) + 0.5)[:, None] / shared
    own = t * t * (3.0 - 2.0 * t)
    other = 1.0 - own
    closed = rows[:cells].copy()
    closed[:shared] = (own * start + other * beyond) / np.sqrt(own**2 + other**2 + 2.0 * rho * own * other)
    return np.moveaxis(closed, 0, axis)


def _closing(axis: int, shared: int, measured: MeasuredSurface, grid: Grid, before: float, after: float) -> str:
    length = shared * grid.spacing[axis]
    spare = measured.grid.extent[axis] - grid.extent[axis]
    mirrored = "" if spare >= length else ", mirrored there for want of more measurement,"
    return (
        f"blended the ends along {'xy'[axis]} over {length_text(length)}{mirrored} so that the surface repeats "
        f"(Sq {length_text(before)} before, {length_text(after)} after)"
    )


def _sq_inside(heights: Field, cells: tuple[int, int]) -> float:
    return float(np.std(heights[: cells[0], : cells[1]]))
