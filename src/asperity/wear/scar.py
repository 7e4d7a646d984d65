"""Wear scar in a profile across the track: area missing below, and piled up above, the old surface.

The old surface is a polynomial through the profile beside the track. The uncertainty from that
choice, and from the waviness of the old surface, is measured on the profile itself: the same
evaluation is repeated where nothing was worn.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np
import numpy.typing as npt

from asperity.core.arrays import Field
from asperity.core.errors import BadInput
from asperity.surface import MeasuredSurface, length_text

OUTLIER_LEVEL = 5.0  # robust standard deviations off the old surface: worn
ROUGHNESS_LEVEL = 2.0  # robust standard deviations: below, a point may be roughness
MAX_GAP = 0.25  # of the track's width: narrower gaps between outlying parts belong to the track
DEGREES = (1, 2)  # of the polynomial through the old surface
REACHES = (1.0, 2.0, np.inf)  # track widths on either side that the old surface is fitted to
MARGINS = (0.0, 0.1)  # of the width, added on either side of the detected track
MIN_POINTS = 20  # across a track, and beside it
_ROUNDS = 20


@dataclass(frozen=True, slots=True)
class ScarAreas:
    """Scar areas by one evaluation variant [m^2], and their scatter where nothing was worn.

    `missing` and `piled` are corrected for roughness: the same evaluation of the untouched
    profile, times the share of the track that is no rougher, is subtracted. `missing_std` and
    `piled_std` are its standard deviations.
    """

    missing: float
    piled: float
    missing_std: float
    piled_std: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Scar:
    """Wear track in a profile.

    `edges` [m] from the profile's first point; `areas` one per evaluation variant; `heights` [m]
    above the old surface of the first variant, shape (n,), at `spacing` [m]; `roughness` [m] is the
    robust standard deviation beside the track.
    """

    edges: tuple[float, float]
    areas: tuple[ScarAreas, ...]
    heights: Field
    spacing: float
    roughness: float

    @property
    def width(self) -> float:
        """Width of the track [m]."""
        return self.edges[1] - self.edges[0]

    @property
    def missing(self) -> float:
        """Mean area below the old surface [m^2]."""
        return float(np.mean([area.missing for area in self.areas]))

    @property
    def piled(self) -> float:
        """Mean area above the old surface [m^2]."""
        return float(np.mean([area.piled for area in self.areas]))


def find_scar(measured: MeasuredSurface) -> Scar:
    """Find the wear track in a measured profile across it.

    Raises
    ------
    BadInput
        for a profile without a detectable track, or with too few points beside it.
    """
    finite = np.isfinite(measured.profile)
    spacing = measured.grid.spacing[0 if measured.uniform != 0 else 1]
    x = (np.arange(finite.size) * spacing)[finite]
    z = measured.profile[finite]
    height, roughness = _heights_above_fit(x, z)
    first, last = _track(x, height, roughness, measured.name)
    edges = float(x[first]), float(x[last])
    width = edges[1] - edges[0]
    untouched = (x < edges[0]) | (x > edges[1])
    if (
        last - first < MIN_POINTS
        or np.count_nonzero(untouched) < 2 * MIN_POINTS
        or width > 0.5 * (x[-1] - x[0])
    ):
        raise BadInput(
            f"{measured.name} has a track {length_text(width)} wide in a profile "
            f"{length_text(x[-1] - x[0])} long; measure a profile at least twice as long as the "
            f"track is wide, with at least {MIN_POINTS} points across the track and "
            f"{2 * MIN_POINTS} outside it"
        )
    areas = tuple(
        _areas(x, z, edges, ROUGHNESS_LEVEL * roughness, *variant)
        for variant in product(DEGREES, REACHES, MARGINS)
    )
    levelled = z - _old_surface(x, z, edges, DEGREES[0], np.inf)
    return Scar(edges=edges, areas=areas, heights=levelled, spacing=spacing, roughness=roughness)


def _heights_above_fit(x: Field, z: Field) -> tuple[Field, float]:
    """Return heights above a robust line fit, and their robust standard deviation."""
    inliers = np.ones(x.size, dtype=bool)
    height, std = z, 0.0
    for _ in range(_ROUNDS):
        height = z - np.polynomial.Polynomial.fit(x[inliers], z[inliers], 1)(x)
        std = 1.4826 * float(np.median(np.abs(height[inliers] - np.median(height[inliers]))))
        selected = np.abs(height) <= OUTLIER_LEVEL * std
        if np.array_equal(selected, inliers) or np.count_nonzero(selected) < MIN_POINTS:
            break
        inliers = selected
    return height, std


def _track(x: Field, height: Field, roughness: float, name: str) -> tuple[int, int]:
    """Return first and last point of the track: the largest outlying part, gaps closed."""
    outstanding = np.flatnonzero(np.abs(height) > OUTLIER_LEVEL * roughness)
    if outstanding.size == 0:
        raise BadInput(
            f"{name} shows no track: no point deviates beyond its roughness; measure across the "
            "track"
        )
    runs = np.split(outstanding, np.flatnonzero(np.diff(outstanding) > 1) + 1)
    first, last = _close_gaps(x, runs, int(np.argmax([np.abs(height[run]).sum() for run in runs])))
    smooth = np.flatnonzero(np.abs(height) <= roughness)
    before = smooth[smooth < first]
    after = smooth[smooth > last]
    return int(before[-1]) if before.size else 0, int(after[0]) if after.size else x.size - 1


def _close_gaps(x: Field, parts: Sequence[npt.NDArray[np.intp]], largest: int) -> tuple[int, int]:
    """Return first and last point of the largest part and of those that narrow gaps separate."""
    low = high = largest
    grown = True
    while grown:
        grown = False
        first = int(parts[low][0])
        last = int(parts[high][-1])
        reach = MAX_GAP * max(x[last] - x[first], float(np.ptp(x)) / 20.0)
        if low > 0 and x[first] - x[parts[low - 1][-1]] <= reach:
            low, grown = low - 1, True
        if high < len(parts) - 1 and x[parts[high + 1][0]] - x[last] <= reach:
            high, grown = high + 1, True
    return first, last


def _old_surface(
    x: Field,
    z: Field,
    edges: tuple[float, float],
    degree: int,
    reach: float,
    spared: tuple[float, float] | None = None,
) -> Field:
    """Fit the old surface through points beside `edges`, without `spared`; return it at all x."""
    width = edges[1] - edges[0]
    untouched = ((x < edges[0]) & (x >= edges[0] - reach * width)) | (
        (x > edges[1]) & (x <= edges[1] + reach * width)
    )
    if spared is not None:
        untouched &= (x < spared[0]) | (x > spared[1])
    return np.asarray(np.polynomial.Polynomial.fit(x[untouched], z[untouched], degree)(x))


def _areas(
    x: Field,
    z: Field,
    edges: tuple[float, float],
    quiet: float,
    degree: int,
    reach: float,
    margin: float,
) -> ScarAreas:
    width = edges[1] - edges[0]
    widened = edges[0] - margin * width, edges[1] + margin * width
    height = z - _old_surface(x, z, widened, degree, reach)
    areas = _below_and_above(x, height, widened)
    unworn = np.array(
        [
            _below_and_above(x, z - _old_surface(x, z, window, degree, reach, widened), window)
            for window in _elsewhere(x, widened)
        ]
    ).reshape(-1, 2)
    if not len(unworn):
        return ScarAreas(*areas, 0.0, 0.0)
    share = float(np.mean(np.abs(height[(x >= widened[0]) & (x <= widened[1])]) < quiet))
    missing, piled = np.maximum(np.array(areas) - share * unworn.mean(axis=0), 0.0)
    return ScarAreas(float(missing), float(piled), *(float(std) for std in unworn.std(axis=0)))


def _elsewhere(x: Field, edges: tuple[float, float]) -> list[tuple[float, float]]:
    """Return windows as wide as the track where nothing was worn, half a width apart."""
    width = edges[1] - edges[0]
    starts = np.arange(x[0], x[-1] - width, 0.5 * width)
    return [(float(a), float(a + width)) for a in starts if a + width < edges[0] or a > edges[1]]


def _below_and_above(x: Field, height: Field, edges: tuple[float, float]) -> tuple[float, float]:
    inside = (x >= edges[0]) & (x <= edges[1])
    below, above = (
        np.trapezoid(np.maximum(sign * height[inside], 0.0), x[inside]) for sign in (-1.0, 1.0)
    )
    return float(below), float(above)
