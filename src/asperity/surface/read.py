"""Readers of measured surfaces in instrument formats.

SurfaceTopography reads most formats, x3pio and sdfio the x3p and SDF files that it cannot read,
`asperity.surface.text` tables. Heights are not corrected; see `asperity.surface.prepare`.
"""

import re
import zipfile
from collections.abc import Callable, Sequence
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from asperity.contact.grid import MIN_CELLS
from asperity.core.arrays import Field
from asperity.core.errors import UnreadableFile, require_positive
from asperity.core.files import require_file
from asperity.core.limits import require_plausible_size
from asperity.core.sandbox import read_in_subprocess
from asperity.core.third_party import first_line, suppress_output, surface_topography
from asperity.surface.arrays import NotForXarray, array_map, read_netcdf, read_numpy
from asperity.surface.model import MeasuredSurface
from asperity.surface.plausibility import REMEDY, to_metres
from asperity.surface.points import map_of_points
from asperity.surface.raw_map import RawMap, map_of_rows
from asperity.surface.text import SUFFIXES as TABLES
from asperity.surface.text import read_table
from asperity.surface.wyko import START as WYKO_START
from asperity.surface.wyko import read_wyko
from asperity.surface.x3p import read_sdf, read_x3p

if TYPE_CHECKING:
    import xarray

_HEADER_BYTES = 4096
_NUMBERS = re.compile(r"[\d\s.,;:+\-eE]+")
_TRIBOMETER = re.compile(
    r"\b(traction|friction) (coeff|force)|slide.{0,3}roll|\bSRR\b", re.IGNORECASE
)
_TEXT = {"xyz", "asc"}  # columns of numbers, in files of any name
_UNMARKED = {"nms", "hgt"}  # accept nearly any bytes, so that they are tried only by file name
_STEP_TOLERANCE = 0.01  # deviation of a profile's steps, over the mean step, that is reported


def read_surface(
    path: str | Path,
    *,
    unit: str | None = None,
    lateral_unit: str | None = None,
    pixel: float | tuple[float, float] | None = None,
) -> MeasuredSurface:
    """Read a measured map or profile; heights in metres, nan for missing cells.

    A profile runs along x and is extended unchanged along y, like ground or turned roughness across
    the rolling direction of a line contact; `MeasuredSurface.uniform` is then 1.

    Parameters
    ----------
    path : file in any format of SurfaceTopography, x3pio or sdfio, an array (npy, npz, netCDF), or
        a text table: two columns are a profile, three a list of points, more a matrix of heights.
        Matrices and arrays have a row per y, the largest first, and a column per x, the rolling
        direction; in netCDF axes named x and y determine the orientation
    unit, lateral_unit : units of the heights and of x and y, such as "um" and "mm", for files
        without units, or in place of a file's own
    pixel : distance of neighbouring heights [m], one number or (dx, dy), for a matrix of heights,
        or in place of a file's own

    Raises
    ------
    UnreadableFile
        The file is missing, empty, truncated, of another type than its name, or of no known format.
    BadInput
        Units or pixel size are missing, or the pixel is implausible and not confirmed.
    """
    path = Path(path)
    stated = (unit, lateral_unit, _pair(pixel))
    require_file(path)
    reader = "asperity.surface.read:load_surface"
    library = "SurfaceTopography"
    surface: MeasuredSurface = read_in_subprocess(
        path.absolute(), reader, *stated, remedy=REMEDY, library=library
    )
    return surface


def load_surface(
    path: Path, unit: str | None, lateral_unit: str | None, sizes: tuple[float, float] | None
) -> MeasuredSurface:
    """Read a surface in this process; see `read_surface`."""
    raw = _read(path, matrix=sizes is not None)
    return to_metres(path.name, raw, unit, lateral_unit, sizes)


def surface_from_array(
    heights: "np.ndarray | xarray.DataArray",
    *,
    unit: str | None = None,
    lateral_unit: str | None = None,
    pixel: float | tuple[float, float] | None = None,
    name: str = "array",
) -> MeasuredSurface:
    """Return the surface of an array of heights, as it would be read from a file.

    Parameters
    ----------
    heights : a row per y, the largest first, and a column per x, the rolling direction; of an
        xarray with axes named x and y these decide
    unit : unit of the heights, such as "um", unless an xarray states it
    lateral_unit : unit of an xarray's coordinates, unless they state it
    pixel : distance of neighbouring heights [m], one number or (dx, dy), without coordinates
    name : name in messages

    Raises
    ------
    UnreadableFile
        The array has no two axes or no valid height.
    BadInput
        Units or pixel size are missing or implausible.

    Examples
    --------
    >>> import numpy as np
    >>> from asperity.surface import surface_from_array
    >>> surface = surface_from_array(np.eye(16, 32), unit="um", pixel=2e-6)
    >>> surface.grid.cells  # 32 along x
    (32, 16)
    """
    return to_metres(name, array_map(name, heights, "array"), unit, lateral_unit, _pair(pixel))


def _pair(pixel: float | tuple[float, float] | None) -> tuple[float, float] | None:
    """Return the pixel along both axes; BadInput unless it is positive."""
    sizes = None if pixel is None else pixel if isinstance(pixel, tuple) else (pixel, pixel)
    for size in sizes or ():
        require_positive("pixel", size, "m")
    return sizes


def _read(path: Path, *, matrix: bool) -> RawMap:
    """Read a file with the readers of its suffix, or by its content if the suffix is unknown."""
    start = _first_bytes(path)
    suffix = path.suffix.lower().removeprefix(".")
    if suffix in _ARRAYS:
        with suppress(NotForXarray):
            return _ARRAYS[suffix](path)
    if start.startswith(WYKO_START):
        return read_wyko(path)
    if suffix in TABLES and _TRIBOMETER.search(_heading(start)):
        raise UnreadableFile(
            f"{path.name} contains tribometer results (traction, speed), not heights; give a map "
            "or profile of the surface"
        )
    return _table(path) if matrix and suffix in TABLES else _instrument_map(path, suffix)


def _heading(start: bytes) -> str:
    """Return the line above the first numbers of a table: the names of its columns."""
    before = ""
    for line in start.decode("latin-1").splitlines():
        if line.strip() and _NUMBERS.fullmatch(line):
            return before
        before = line
    return ""


def _instrument_map(path: Path, suffix: str) -> RawMap:
    """Read a map in an instrument's format."""
    name = path.name
    suffixes = {
        reader.format(): set(reader.file_extensions()) for reader in surface_topography().IO.readers
    }
    formats = [form for form, extensions in suffixes.items() if suffix in extensions]
    if not formats and suffix not in TABLES:
        result = _try_formats(path, [None])
        if isinstance(result, RawMap):
            return result
        raise UnreadableFile(f"{name} is in no format that can be read; {REMEDY}") from result
    if _TEXT.intersection(formats):
        formats = [form for form in suffixes if form in _TEXT.union(formats)]
    result = _try_formats(path, formats, _LAST_RESORTS.get(suffix))
    if isinstance(result, RawMap):
        return result
    actual = _format_of(path)
    if actual is not None and actual not in formats:
        remedy = f"rename it to .{min(suffixes[actual])} if that is correct"
        raise UnreadableFile(
            f"{name} has the suffix .{suffix} but its content looks like {actual}; {remedy}"
        ) from result
    raise UnreadableFile(
        f"{name} is not a readable .{suffix} file ({_cause(result)}); {REMEDY}"
    ) from result


def _cause(reason: Exception | None) -> str:
    # messages of a mismatch mention unexpected bytes
    mismatch = surface_topography().Exceptions.FileFormatMismatch
    return "its content has another format" if isinstance(reason, mismatch) else first_line(reason)


def _first_bytes(path: Path) -> bytes:
    """Return the first bytes of a file; UnreadableFile if it cannot be opened or is empty."""
    try:
        with path.open("rb") as file:
            start = file.read(_HEADER_BYTES)
    except OSError as error:
        raise UnreadableFile(
            f"{path} cannot be opened ({error.strerror}); name a file that can be read"
        ) from error
    if not start:
        raise UnreadableFile(f"{path.name} is empty; {REMEDY}")
    if zipfile.is_zipfile(path):
        with zipfile.ZipFile(path) as archive:
            require_plausible_size(path, sum(part.file_size for part in archive.infolist()), REMEDY)
    return start


def _try_formats(
    path: Path,
    formats: Sequence[str | None],
    last_resort: Callable[[Path], RawMap] | None = None,
) -> RawMap | Exception | None:
    """Return the map of the first format that can be read, or the error that explains why none."""
    reason: Exception | None = None
    for form in formats:
        try:
            return _topography(path, form)
        except UnreadableFile:
            raise
        except Exception as error:  # noqa: BLE001 - readers of forty formats raise any error
            reason = reason or error
            if isinstance(error, surface_topography().Exceptions.CorruptFile):
                break  # recognised but damaged: another reader would misread it
    if last_resort is not None:
        try:
            return last_resort(path)
        except UnreadableFile:
            raise
        except Exception as error:  # noqa: BLE001 - as above
            reason = error
    return reason


def _format_of(path: Path) -> str | None:
    """Return the format of a file by its content; None if the content is ambiguous."""
    with suppress_output():
        try:
            form = str(surface_topography().open_topography(str(path)).format())
        except Exception:  # noqa: BLE001 - as above
            form = ""
        for candidate in () if form else ("x3p", "sdf"):
            with suppress(Exception):
                _LAST_RESORTS[candidate](path)
                return candidate
    return form if form and form not in _UNMARKED | _TEXT else None


def _topography(path: Path, form: str | None) -> RawMap:
    with suppress_output() as notes:
        reader = surface_topography().open_topography(str(path), format=form)
        if form is None and reader.format() in _UNMARKED:
            raise UnreadableFile(f"{path.name} is in no format that can be read; {REMEDY}")
        form = str(reader.format())
        channel = reader.default_channel
        if channel.dim == 1:
            line = reader.topography()
            x, z = line.positions_and_heights()
            return _profile(path, x, z, form, line.unit)
        bare = channel.physical_sizes is None
        if bare and form in _TEXT:
            raise ValueError("a table without header")  # points may look like a matrix
        topography = (
            reader.topography(physical_sizes=channel.nb_grid_pts) if bare else reader.topography()
        )
        heights = np.ma.filled(np.ma.asarray(topography.heights(), dtype=np.float64), np.nan)
        pixel = None if bare else (float(topography.pixel_size[0]), float(topography.pixel_size[1]))
    if form == "asc":  # SurfaceTopography takes the first row as the smallest y
        heights = heights[:, ::-1]
    maps = [other.name for other in reader.channels if other.dim == 2]
    if len(maps) > 1:
        notes.append(f"of the {len(maps)} maps in the file, the first, {channel.name!r}, was read")
    return RawMap(
        heights=heights,
        pixel=pixel,
        format=form,
        unit=topography.unit,
        lateral_unit=topography.unit,
        notes=tuple(notes),
    )


def _profile(path: Path, x: Field, z: Field, form: str, unit: str | None) -> RawMap:
    """Return a profile with even steps; other profiles are interpolated, with a note."""
    steps = np.diff(x)
    if x.size < MIN_CELLS or not (steps > 0.0).all():
        raise UnreadableFile(
            f"{path.name} is not a profile of at least {MIN_CELLS} points with increasing x; "
            f"{REMEDY}"
        )
    step = float(x[-1] - x[0]) / (x.size - 1)
    notes: tuple[str, ...] = ()
    z = np.ma.filled(np.ma.asarray(z, dtype=np.float64), np.nan)
    if np.max(np.abs(steps - step)) > _STEP_TOLERANCE * step:
        notes = (
            "the profile's points are not evenly spaced; they were interpolated onto even steps",
        )
        z = np.interp(x[0] + step * np.arange(x.size), x, z)
    return RawMap(
        heights=z[:, None],
        pixel=(step, step),
        format=form,
        unit=unit,
        lateral_unit=unit,
        notes=notes,
    )


def _table(path: Path) -> RawMap:
    """Read two columns as a profile, three as points, more as a matrix of heights."""
    numbers = read_table(path)
    if numbers.shape[1] == 2:
        return _profile(path, numbers[:, 0], numbers[:, 1], "text", None)
    if numbers.shape[1] == 3 and len(numbers) >= MIN_CELLS**2:
        return map_of_points(path.name, numbers)
    if min(numbers.shape) < MIN_CELLS:
        raise UnreadableFile(
            f"{path.name} has {numbers.shape[0]} x {numbers.shape[1]} numbers, too few for a "
            f"surface; give a profile (x, z), at least {MIN_CELLS**2} points (x, y, z), or at "
            f"least {MIN_CELLS} x {MIN_CELLS} heights"
        )
    return map_of_rows(numbers, "text")


_LAST_RESORTS: dict[str, Callable[[Path], RawMap]] = {
    "x3p": read_x3p,
    "sdf": read_sdf,
    **dict.fromkeys(TABLES, _table),
}
_ARRAYS: dict[str, Callable[[Path], RawMap]] = {
    "npy": read_numpy,
    "npz": read_numpy,
    "nc": read_netcdf,
    "cdf": read_netcdf,
}
