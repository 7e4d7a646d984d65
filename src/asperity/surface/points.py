"""Maps from lists of points (x, y, z): complete grids, with holes, or a little off a grid."""

from typing import NamedTuple

import numpy as np
import numpy.typing as npt
import scipy

from asperity.core.arrays import Field
from asperity.core.errors import UnreadableFile
from asperity.surface.raw_map import RawMap

_SAME_LINE = 0.4  # of the largest gap between coordinates: below it two points lie on one line
_MAX_DEVIATION = 0.45  # of a point from its place on the grid, in pixels; 0.5 could be the next one
_REPORTED_DEVIATION = 0.01
_MIN_FILLED = 0.2  # share of the grid that has points
_MAX_SCATTERED = 1_000_000  # points that are interpolated


class _Lines(NamedTuple):
    """Lines of a grid along one axis: index of each point's line, number, pitch and deviation."""

    position: npt.NDArray[np.intp]
    number: int
    pitch: float
    deviation: float


def map_of_points(name: str, points: Field) -> RawMap:
    """Return the map of points (n, 3), each row x, y and z; missing points are nan.

    Points near a regular grid take its nearest place; others are interpolated linearly onto square
    pixels of the same mean area.

    Raises
    ------
    UnreadableFile
        The points lie on a line, or are too many to be interpolated.
    """
    x, y, z = points[np.isfinite(points[:, :2]).all(axis=1)].T
    along, across = _lines(x), _lines(y)
    if along is None or across is None:
        return _interpolated(name, x, y, z)
    cells = along.number, across.number
    places = along.position * across.number + across.position
    if len(x) < _MIN_FILLED * cells[0] * cells[1] or len(np.unique(places)) < len(places):
        return _interpolated(name, x, y, z)
    heights = np.full(cells, np.nan)
    heights.ravel()[places] = z
    deviation = max(along.deviation, across.deviation)
    notes: tuple[str, ...] = ()
    if deviation > _REPORTED_DEVIATION:
        notes = (
            f"the points lie up to {100 * deviation:.2g} % of a pixel off a regular grid; each "
            "counts as its nearest place",
        )
    return RawMap(heights=heights, pixel=(along.pitch, across.pitch), format="xyz", notes=notes)


def _lines(values: Field) -> _Lines | None:
    """Return the evenly spaced lines on which coordinates lie; None if they do not."""
    ordered = np.sort(values)
    gaps = np.diff(ordered)
    if not len(gaps) or gaps.max() <= 0.0:
        return None
    starts = np.flatnonzero(gaps > _SAME_LINE * gaps.max()) + 1
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


def _interpolated(name: str, x: Field, y: Field, z: Field) -> RawMap:
    """Return a map on square pixels, by linear interpolation between scattered points."""
    if len(x) > _MAX_SCATTERED:
        raise UnreadableFile(
            f"{name} holds {len(x)} points off any regular grid, more than the {_MAX_SCATTERED} "
            "that are interpolated; export it on a grid"
        )
    width, length = np.ptp(x), np.ptp(y)
    if not width > 0.0 or not length > 0.0:
        raise UnreadableFile(
            f"{name} holds points (x, y, z) on one line; give a profile as two columns (x, z)"
        )
    pixel = float(np.sqrt(width * length / len(x)))
    cells = int(width / pixel) + 1, int(length / pixel) + 1
    at = np.ogrid[: cells[0], : cells[1]]
    nodes = (x.min() + pixel * at[0], y.min() + pixel * at[1])
    heights = scipy.interpolate.griddata((x, y), z, nodes, method="linear")
    note = "the points lie off any regular grid; they were interpolated linearly onto square pixels"
    return RawMap(heights=np.asarray(heights), pixel=(pixel, pixel), format="xyz", notes=(note,))
