"""Maps from lists of points (x, y, z): complete grids, with holes, or a little off a grid."""

from typing import NamedTuple

import numpy as np
import numpy.typing as npt
import scipy

from asperity.contact.grid import MIN_CELLS
from asperity.core.arrays import Field
from asperity.core.errors import UnreadableFile
from asperity.surface.raw_map import RawMap

_CLEAR_RATIO = 3.0  # of gaps between lines to gaps within one, from which there are lines
_ROUNDING = 1e-9  # of the extent: smaller gaps are none
_MAX_DEVIATION = 0.45  # of a point from its place on the grid, in pixels; 0.5 could be the next one
_REPORTED_DEVIATION = 0.01
_MIN_FILLED = 0.2  # share of the grid that has points
_MAX_SCATTERED = 1_000_000  # points that are interpolated
_REACH = 2.0  # pixels from the nearest point within which a height is interpolated


class _Lines(NamedTuple):
    """Lines of a grid along one axis: position of each point, number, pitch and deviation."""

    position: npt.NDArray[np.intp]
    number: int
    pitch: float
    deviation: float


def map_of_points(name: str, points: Field) -> RawMap:
    """Return the map of points (n, 3), each row x, y and z; missing points are nan.

    Points near a regular grid take its nearest place; others are interpolated linearly onto square
    pixels of the same mean area. Points of equal x and y are averaged.

    Raises
    ------
    UnreadableFile
        The points are too few, lie on a line, or are too many to be interpolated.
    """
    points, repeated = _averaged(points[np.isfinite(points).all(axis=1)])
    if len(points) < MIN_CELLS**2:
        raise UnreadableFile(
            f"{name} holds {len(points)} complete points (x, y, z), too few for a map; give at "
            f"least {MIN_CELLS**2}"
        )
    x, y, z = points.T
    along, across = _lines(x), _lines(y)
    if along is None or across is None:
        return _interpolated(name, points, repeated)
    cells = along.number, across.number
    places = along.position * across.number + across.position
    if len(x) < _MIN_FILLED * cells[0] * cells[1] or len(np.unique(places)) < len(places):
        return _interpolated(name, points, repeated)
    heights = np.full(cells, np.nan)
    heights.ravel()[places] = z
    notes = repeated
    deviation = max(along.deviation, across.deviation)
    if deviation > _REPORTED_DEVIATION:
        notes += (
            f"the points lie up to {100 * deviation:.2g} % of a pixel off a regular grid; each "
            "is assigned to its nearest place",
        )
    return RawMap(heights=heights, pixel=(along.pitch, across.pitch), format="xyz", notes=notes)


def _averaged(points: Field) -> tuple[Field, tuple[str, ...]]:
    """Return points of different x and y, and a note if some are means of several."""
    places, index, counts = np.unique(
        points[:, :2], axis=0, return_inverse=True, return_counts=True
    )
    if len(places) == len(points):
        return points, ()
    means = np.bincount(index.ravel(), weights=points[:, 2]) / counts
    note = f"{len(points) - len(places)} points repeat others; equal places were averaged"
    return np.column_stack([places, means]), (note,)


def _lines(values: Field) -> _Lines | None:
    """Return the evenly spaced lines on which coordinates lie; None if they do not.

    Gaps between lines are clearly larger than those between points of a line.
    """
    ordered = np.sort(values)
    smallest = _smallest_gap(np.diff(ordered), float(np.ptp(values)))
    if smallest is None:
        return None
    starts = np.flatnonzero(np.diff(ordered) >= smallest) + 1
    centres = np.array([part.mean() for part in np.split(ordered, starts)])
    pitch = float(np.median(np.diff(centres)))
    index = np.rint((values - centres[0]) / pitch)
    slope, origin = np.polyfit(index, values, 1)  # a median of rounded steps is inexact
    index = np.rint((values - origin) / slope)
    deviation = float(np.max(np.abs((values - origin) / slope - index)))
    if deviation > _MAX_DEVIATION:
        return None
    index -= index.min()
    return _Lines(index.astype(np.intp), int(index.max()) + 1, float(slope), deviation)


def _smallest_gap(gaps: Field, extent: float) -> float | None:
    """Return the smallest gap between lines; None if none is clear."""
    falling = np.sort(gaps)[::-1]
    floor, fewest = _ROUNDING * extent, MIN_CELLS - 2
    ratios = (falling[:-1] / np.maximum(falling[1:], floor))[fewest : len(gaps) // MIN_CELLS]
    if not ratios.size or falling[fewest] <= floor or ratios.max() < _CLEAR_RATIO:
        return None
    return float(falling[fewest + int(np.argmax(ratios))])


def _interpolated(name: str, points: Field, notes: tuple[str, ...]) -> RawMap:
    """Return a map on square pixels, by linear interpolation between scattered points."""
    if len(points) > _MAX_SCATTERED:
        raise UnreadableFile(
            f"{name} holds {len(points)} points off any regular grid, more than the "
            f"{_MAX_SCATTERED} that are interpolated; export it on a grid"
        )
    places, heights = points[:, :2], points[:, 2]
    pixel, axes = _square_pixels(name, places)
    nodes = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)
    between = scipy.interpolate.griddata(places, heights, nodes, method="linear")
    distance, _ = scipy.spatial.cKDTree(places).query(nodes, distance_upper_bound=_REACH * pixel)
    note = "the points lie off any regular grid; they were interpolated linearly onto square pixels"
    return RawMap(
        heights=np.where(np.isfinite(distance), between, np.nan),
        pixel=(pixel, pixel),
        format="xyz",
        notes=(*notes, note),
    )


def _square_pixels(name: str, places: Field) -> tuple[float, list[Field]]:
    """Return pixel and axes of a map with as many square pixels as places."""
    extents = np.ptp(places, axis=0)
    pixel = float(np.sqrt(extents.prod() / len(places)))
    if not pixel > 0.0 or extents.min() < (MIN_CELLS - 1) * pixel:
        raise UnreadableFile(
            f"{name} holds points (x, y, z) over {extents[0]:g} x {extents[1]:g}, too narrow for "
            "a map; give a profile as two columns (x, z), or delete stray points"
        )
    counts = (extents / pixel).astype(int) + 1
    return pixel, [
        low + pixel * np.arange(count)
        for low, count in zip(places.min(axis=0), counts, strict=True)
    ]
