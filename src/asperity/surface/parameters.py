"""ISO 25178-2 parameters of rough surfaces, and descriptions of measured files."""

from dataclasses import asdict, dataclass, replace
from functools import lru_cache
from pathlib import Path
from typing import Any, Literal, NamedTuple

import numpy as np
import scipy

from asperity.contact.grid import Grid
from asperity.core.arrays import Field, usual_float_errors
from asperity.core.documents import JsonObject
from asperity.core.quantities import Quantity, catalogue
from asperity.surface.bearing import bearing_curve, core_heights
from asperity.surface.condition import DEFAULT_CONDITIONING, SurfaceConditioning, condition_surface
from asperity.surface.model import MeasuredSurface, Surface
from asperity.surface.profile import ProfileParameters, profile_parameters
from asperity.surface.read import read_surface

_DECAY_THRESHOLD = 0.2  # ISO 25178-2: autocorrelation that defines Sal and Str
_DIRECTIONS = 180  # rays over half a turn; the autocorrelation is symmetric
NO_LAY = 0.5  # Str from which a texture counts as isotropic (ISO 25178-2, note)


@dataclass(frozen=True, slots=True)
class SurfaceParameters:
    """Areal parameters of ISO 25178-2, about the mean of the valid cells.

    Height: `sa`, `sq` arithmetic and root mean square height [m]; `ssk`, `sku` skewness and
    kurtosis (0 and 3 for Gaussian heights); `sp`, `sv`, `sz` maximum peak height, maximum pit depth
    and their sum [m]. Hybrid: `sdq` root mean square gradient, from differences of neighbouring
    cells; `sdr` developed interfacial area ratio. Spatial: `sal` shortest distance over which the
    autocorrelation falls to 0.2 [m]; `str_` ratio of the shortest to the longest such distance (1
    isotropic, towards 0 with a lay). If the autocorrelation stays above 0.2 within half the map in
    some direction, `str_` is an upper bound and `str_bounded` is true. `lay_deg` direction of the
    longest distance from x towards y [degrees], nan for `str_` above 0.5. Functional: core height
    `sk`, reduced peak height `spk`, reduced pit depth `svk` [m], and the material ratios `smr1`,
    `smr2` of the core, 0 to 1. `ssk`, `sku`, `sal` and `str_` of a flat surface are nan, as are
    `sal` and `str_` without decay.
    """

    sa: float
    sq: float
    ssk: float
    sku: float
    sp: float
    sv: float
    sz: float
    sdq: float
    sdr: float
    sal: float
    str_: float
    str_bounded: bool
    lay_deg: float
    sk: float
    spk: float
    svk: float
    smr1: float
    smr2: float


@dataclass(frozen=True, slots=True)
class SurfaceDescription:
    """Description of a measured file: raw and levelled map, parameters after levelling and steps.

    `profile` holds the parameters of ISO 21920-2 if the file is a profile; `profile_letter` is
    their prefix in that standard: "R" after an L-filter, else "P" (primary profile).
    """

    path: Path
    measured: MeasuredSurface
    levelled: MeasuredSurface
    parameters: SurfaceParameters
    steps: tuple[str, ...]
    profile: ProfileParameters | None = None
    profile_letter: Literal["P", "R"] = "P"

    def symbol(self, quantity: Quantity) -> Quantity:
        """Return a profile parameter with the symbol of this profile: Pq instead of Rq."""
        return replace(quantity, symbol=self.profile_letter + quantity.symbol.removeprefix("R"))

    def verdict(self) -> str:
        """Return one sentence: roughness, cells and missing data."""
        measured = self.measured
        nx, ny = measured.grid.cells
        dx, dy = measured.grid.spacing
        rms = f"{1e6 * self.parameters.sq:.3g} um"
        summary = f"Sq {rms}, {nx} x {ny} cells of {1e6 * dx:.4g} x {1e6 * dy:.4g} um"
        if measured.uniform is not None:
            summary = f"profile, {self.profile_letter}q {rms}, {nx} points every {1e6 * dx:.4g} um"
        return f"{self.path}: {summary}, {100 * measured.missing:.2g} % missing."

    def scalars(self) -> dict[str, Any]:
        """Return the SI numbers of `asperity surface --json` for the file; None for nan."""
        return {
            "file": str(self.path),
            "format": self.measured.format,
            "cells": list(self.measured.grid.cells),
            "pixel_m": list(self.measured.grid.spacing),
            "size_m": list(self.measured.grid.extent),
            "missing": self.measured.missing,
            "rolling_along": self.levelled.rolling_along,
            **_by_key(self.parameters),
            "profile": None
            if self.profile is None
            else {"letter": self.profile_letter, **_by_key(self.profile)},
            "steps": list(self.steps),
            "notes": list(self.measured.notes),
        }


def _by_key(parameters: SurfaceParameters | ProfileParameters) -> JsonObject:
    """Return parameters by their keys in the catalogue, where lengths end in _m; None for nan."""
    keys = catalogue()
    return {
        f"{name}_m" if f"{name}_m" in keys else name.rstrip("_"): value if value == value else None
        for name, value in asdict(parameters).items()
    }


def describe_surface(
    path: str | Path,
    *,
    unit: str | None = None,
    lateral_unit: str | None = None,
    pixel: float | tuple[float, float] | None = None,
    conditioning: SurfaceConditioning = DEFAULT_CONDITIONING,
) -> SurfaceDescription:
    """Read and level a measured file and compute its parameters; missing cells are not filled.

    Parameters
    ----------
    path, unit, lateral_unit, pixel : as for `read_surface`
    conditioning : form removal, filters and other settings

    Raises
    ------
    UnreadableFile, BadInput
        As `read_surface` and `condition_surface`.
    """
    measured = read_surface(path, unit=unit, lateral_unit=lateral_unit, pixel=pixel)
    levelled, steps = condition_surface(measured, conditioning)
    profile = None
    if levelled.uniform is not None:
        profile = profile_parameters(levelled.profile, levelled.grid.spacing[1 - levelled.uniform])
    letter: Literal["P", "R"] = "P" if conditioning.l_filter is None else "R"
    return SurfaceDescription(
        Path(path), measured, levelled, surface_parameters(levelled), steps, profile, letter
    )


class HeightParameters(NamedTuple):
    """Parameters of `SurfaceParameters` that depend only on the distribution of heights."""

    sa: float
    sq: float
    ssk: float
    sku: float
    sk: float
    spk: float
    svk: float
    smr1: float
    smr2: float


def height_parameters(surface: Surface | MeasuredSurface) -> HeightParameters:
    """Compute mean heights, skewness, kurtosis and core heights, without form removal.

    Examples
    --------
    >>> import numpy as np
    >>> from asperity.contact.grid import Grid
    >>> from asperity.surface import Surface, height_parameters
    >>> x = np.linspace(0.0, 2.0 * np.pi, 400, endpoint=False)
    >>> grid = Grid(cells=(400, 8), lower=(0.0, 0.0), upper=(1e-3, 2e-5))
    >>> wave = Surface(1e-6 * np.sin(x)[:, np.newaxis] * np.ones(8), grid)
    >>> parameters = height_parameters(wave)
    >>> f"Sa {parameters.sa * 1e6:.3f} um, Sku {parameters.sku:.2f}"
    'Sa 0.637 um, Sku 1.50'
    """
    heights = surface.heights - np.nanmean(surface.heights)
    sq = float(np.sqrt(np.nanmean(heights**2)))
    if sq == 0.0:
        return HeightParameters(0.0, 0.0, float("nan"), float("nan"), 0.0, 0.0, 0.0, 0.0, 1.0)
    core = core_heights(bearing_curve(distinct_heights(surface)))
    return HeightParameters(
        sa=float(np.nanmean(np.abs(heights))),
        sq=sq,
        ssk=float(np.nanmean(heights**3)) / sq**3,
        sku=float(np.nanmean(heights**4)) / sq**4,
        sk=core.core,
        spk=core.peaks,
        svk=core.pits,
        smr1=core.upper,
        smr2=core.lower,
    )


@usual_float_errors
def surface_parameters(surface: Surface | MeasuredSurface) -> SurfaceParameters:
    """Compute the ISO 25178-2 parameters; remove the form of a measured surface first (`level`).

    Examples
    --------
    >>> import numpy as np
    >>> from asperity.contact.grid import Grid
    >>> from asperity.surface import gaussian_surface, surface_parameters
    >>> grid = Grid(cells=(64, 64), lower=(0.0, 0.0), upper=(1e-3, 1e-3), periodic=(True, True))
    >>> rng = np.random.default_rng(1)
    >>> surface = gaussian_surface(grid, sq=0.5e-6, correlation_length=50e-6, rng=rng)
    >>> f"Sal {surface_parameters(surface).sal * 1e6:.0f} um"
    'Sal 59 um'
    """
    heights = surface.heights - np.nanmean(surface.heights)
    of_heights = height_parameters(surface)
    if of_heights.sq == 0.0:
        nan = float("nan")
        return SurfaceParameters(
            **of_heights._asdict(),
            sp=0.0,
            sv=0.0,
            sz=0.0,
            sdq=0.0,
            sdr=0.0,
            sal=nan,
            str_=nan,
            str_bounded=False,
            lay_deg=nan,
        )
    sal, texture, bounded, lay = _texture(heights, surface.grid)
    sp = float(np.nanmax(heights))
    sv = -float(np.nanmin(heights))
    return SurfaceParameters(
        **of_heights._asdict(),
        sp=sp,
        sv=sv,
        sz=sp + sv,
        sdq=gradient(heights, surface.grid),
        sdr=_developed_area(heights, surface.grid) - 1.0,
        sal=sal,
        str_=texture,
        str_bounded=bounded,
        lay_deg=lay,
    )


def lay_text(surface: Surface) -> str:
    """Return the direction of a surface's lay as text."""
    _, texture, bounded, lay = _texture(surface.heights, surface.grid)
    if np.isnan(texture):
        return "has no lay that its size determines"
    ratio = f"Str {'below ' if bounded else ''}{texture:.2g}"
    if np.isnan(lay):
        return f"has no lay ({ratio})"
    return f"has its lay at {abs(lay):.0f} degrees from rolling ({ratio})"


def distinct_heights(surface: Surface | MeasuredSurface) -> Field:
    """Return the heights; of a profile only one of its equal rows."""
    return (
        surface.profile
        if isinstance(surface, MeasuredSurface) and surface.uniform is not None
        else surface.heights
    )


def correlation_lengths(
    surface: Surface | MeasuredSurface, direction: float = 0.0
) -> tuple[float, float]:
    """Return the correlation lengths [m] along and across `direction` [rad from x].

    At this distance the autocorrelation falls to 1/e; nan if it does not within half the map.
    Generators take these lengths; the threshold of Sal is 0.2.

    Examples
    --------
    >>> import numpy as np
    >>> from asperity.contact.grid import Grid
    >>> from asperity.surface import correlation_lengths, gaussian_surface
    >>> grid = Grid(cells=(128, 128), lower=(0.0, 0.0), upper=(2e-3, 2e-3), periodic=(True, True))
    >>> rng = np.random.default_rng(1)
    >>> surface = gaussian_surface(grid, sq=0.5e-6, correlation_length=(80e-6, 40e-6), rng=rng)
    >>> [round(length * 1e6) for length in correlation_lengths(surface)]
    [75, 39]
    """
    return _correlation_lengths(surface, direction)


@lru_cache(maxsize=2)  # used by the notes of a surface, by those of its solution and by its checks
def _correlation_lengths(
    surface: Surface | MeasuredSurface, direction: float
) -> tuple[float, float]:
    correlation, middle = _autocorrelation(
        surface.heights - np.nanmean(surface.heights), surface.grid
    )
    angles = np.array([direction, direction + np.pi / 2.0])
    first, second = _decay(correlation, middle, surface.grid, angles, np.exp(-1.0))[0]
    return float(first), float(second)


def gradient(heights: Field, grid: Grid) -> float:
    """Return the root mean square gradient Sdq, from differences of neighbouring cells."""
    squares = 0.0
    for axis, (spacing, periodic) in enumerate(zip(grid.spacing, grid.periodic, strict=True)):
        steps = np.roll(heights, -1, axis) - heights if periodic else np.diff(heights, axis=axis)
        squares += float(np.nanmean(steps**2)) / spacing**2
    return float(np.sqrt(squares))


def _developed_area(heights: Field, grid: Grid) -> float:
    """Return area over projected area, the mean of two triangulations (ISO 25178-2)."""
    for axis, periodic in enumerate(grid.periodic):
        if periodic:
            heights = np.concatenate([heights, np.take(heights, [0], axis)], axis)
    slope_x = (np.diff(heights, axis=0) / grid.spacing[0]) ** 2
    slope_y = (np.diff(heights, axis=1) / grid.spacing[1]) ** 2
    corners = [
        np.sqrt(1.0 + x + y)
        for x in (slope_x[:, :-1], slope_x[:, 1:])
        for y in (slope_y[:-1], slope_y[1:])
    ]
    return float(np.nanmean(np.mean(corners, axis=0)))


def _autocorrelation(heights: Field, grid: Grid) -> tuple[Field, tuple[int, int]]:
    """Return f_ACF of ISO 25178-2 3.2.x for lags up to half the map, and the index of zero lag.

    Each lag is the mean over the pairs of valid cells; a periodic axis is not padded.
    """
    reach = (grid.cells[0] // 2, grid.cells[1] // 2)
    shape = [
        n if periodic else scipy.fft.next_fast_len(n + m, real=True)
        for n, m, periodic in zip(grid.cells, reach, grid.periodic, strict=True)
    ]
    finite = np.isfinite(heights)
    sums = scipy.fft.irfft2(
        np.abs(scipy.fft.rfft2(np.where(finite, heights, 0.0), shape)) ** 2, shape
    )
    lags = np.ix_(*(np.arange(-m, m + 1) % size for m, size in zip(reach, shape, strict=True)))
    if finite.all():
        pairs = np.outer(*map(_pairs, grid.cells, reach, grid.periodic))
    else:
        pairs = np.rint(
            scipy.fft.irfft2(np.abs(scipy.fft.rfft2(finite.astype(float), shape)) ** 2, shape)
        )[lags]
    means = np.divide(sums[lags], pairs, out=np.zeros_like(pairs), where=pairs > 0)
    return means / means[reach], reach


def _pairs(cells: int, reach: int, periodic: bool) -> Field:
    """Return the number of pairs of cells for each lag along an axis."""
    return (
        np.full(2 * reach + 1, float(cells))
        if periodic
        else cells - np.abs(np.arange(-reach, reach + 1.0))
    )


def _texture(heights: Field, grid: Grid) -> tuple[float, float, bool, float]:
    """Return Sal, Str, true if Str is only an upper bound, and the lay [degrees] or nan."""
    nan = float("nan")
    correlation, middle = _autocorrelation(heights, grid)
    angles = np.arange(_DIRECTIONS) * np.pi / _DIRECTIONS
    distances, lengths = _decay(correlation, middle, grid, angles, _DECAY_THRESHOLD)
    unbounded = np.isnan(distances)
    if unbounded.all():
        return nan, nan, False, nan
    shortest = float(np.nanmin(distances))
    longest = float(np.max(np.where(unbounded, lengths, distances)))
    texture = shortest / longest
    # the mean direction of the longest decays, as axes: twice the angle
    far = unbounded if unbounded.any() else distances > (1.0 - 1e-9) * longest
    axis = 0.5 * float(np.angle(np.exp(2j * angles[far]).sum()))
    lay = float(np.degrees(axis)) if texture < NO_LAY else nan
    lay += 180.0 if lay < -90.0 + 0.5 * 180.0 / _DIRECTIONS else 0.0
    return shortest, texture, bool(unbounded.any()), lay


def _decay(
    correlation: Field, middle: tuple[int, int], grid: Grid, angles: Field, threshold: float
) -> tuple[Field, Field]:
    """Return the distances at which rays fall below the threshold (or nan), and their lengths."""
    cosines = np.cos(angles)[:, None] / grid.spacing[0]
    sines = np.sin(angles)[:, None] / grid.spacing[1]
    # a ray ends at the largest lag; its samples are at most half a cell apart
    lengths = 1.0 / np.maximum(np.abs(cosines) / middle[0], np.abs(sines) / middle[1])
    radii = np.linspace(0.0, 1.0, 4 * max(middle) + 1) * lengths
    along = scipy.ndimage.map_coordinates(
        correlation,
        [middle[0] + radii * cosines, middle[1] + radii * sines],
        order=3,
        mode="nearest",
    )
    return _first_below(along, radii, threshold), lengths[:, 0]


def _first_below(along: Field, radii: Field, threshold: float) -> Field:
    """Return the interpolated radius at which each ray falls below the threshold, or nan."""
    below = along < threshold
    ray = np.flatnonzero(below.any(axis=1))
    after = np.argmax(below[ray], axis=1)
    high = along[ray, after - 1]
    low = along[ray, after]
    inner = radii[ray, after - 1]
    outer = radii[ray, after]
    distances = np.full(len(radii), np.nan)
    distances[ray] = inner + (outer - inner) * (high - threshold) / (high - low)
    return distances
