"""Readers of measured surfaces in instrument formats.

SurfaceTopography reads most formats, x3pio and sdfio the x3p and SDF files that it cannot read,
`asperity.surface.text` tables. Heights are not corrected; see `asperity.surface.prepare`.
"""

import warnings
import zipfile
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType
from xml.etree import ElementTree

import numpy as np
import numpy.typing as npt

from asperity.contact.grid import MIN_CELLS, Grid
from asperity.core.arrays import Field
from asperity.core.errors import BadInput, UnreadableFile, require_positive
from asperity.core.files import require_file
from asperity.core.limits import require_unpacked
from asperity.core.sandbox import read_in_subprocess
from asperity.core.third_party import first_line, suppress_output
from asperity.surface.model import MeasuredSurface, length_text
from asperity.surface.text import SUFFIXES as TABLES
from asperity.surface.text import read_table

_TEXT = {"xyz", "asc"}  # columns of numbers, in files of any name
_UNMARKED = {"nms", "hgt"}  # accept nearly any bytes, so that they are tried only by file name
_PLAUSIBLE_PIXEL = 1e-10, 1e-3  # an atom to a millimetre [m]
_POSSIBLE_LENGTH = 1e-15, 1e6  # [m]; other lengths indicate a damaged file
_PLAUSIBLE_SLOPE = 3.0  # median over neighbours, 72 degrees
_STEP_TOLERANCE = 0.01  # deviation of a profile's steps, over the mean step, that is reported
_REMEDY = "export it again, for example as standard x3p or SDF"


@dataclass(frozen=True, slots=True)
class RawMap:
    """Content of a file: `heights` (nx, ny) and `pixel` in `unit`, which is None if not stated.

    Heights of shape (n, 1) are a profile. `pixel` is None if the caller must give it.
    """

    heights: Field
    pixel: tuple[float, float] | None
    format: str
    unit: str | None
    notes: tuple[str, ...] = ()


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
    path : file in any format of SurfaceTopography, x3pio or sdfio, or a text table: two columns are
        a profile, three a list of points, more a matrix of heights with rows along x
    unit, lateral_unit : units of the heights and of x and y, such as "um" and "mm", for files
        without units
    pixel : distance of neighbouring heights [m], one number or (dx, dy), for a matrix of heights

    Raises
    ------
    UnreadableFile
        The file is missing, empty, truncated, of another type than its name, or of no known format.
    BadInput
        Units or pixel size are missing, or given for a file that states them.
    """
    path = Path(path)
    sizes = None if pixel is None else pixel if isinstance(pixel, tuple) else (pixel, pixel)
    for size in sizes or ():
        require_positive("pixel", size, "m")
    require_file(path)
    stated = (unit, lateral_unit, sizes)
    reader = "asperity.surface.read:load_surface"
    library = "SurfaceTopography"
    surface: MeasuredSurface = read_in_subprocess(
        path.absolute(), reader, *stated, remedy=_REMEDY, library=library
    )
    return surface


def load_surface(
    path: Path, unit: str | None, lateral_unit: str | None, sizes: tuple[float, float] | None
) -> MeasuredSurface:
    """Read a surface in this process; see `read_surface`."""
    raw = _read(path, matrix=sizes is not None)
    height_scale, sizes = _sizes(path.name, raw, unit, lateral_unit, sizes)
    heights = np.where(np.isfinite(raw.heights), raw.heights, np.nan) * height_scale
    _require_possible(path.name, heights, sizes)
    notes = raw.notes + _drop_impossible(heights)
    uniform = 1 if heights.shape[1] == 1 else None
    if uniform:
        heights, sizes = np.repeat(heights, MIN_CELLS, axis=1), (sizes[0], sizes[0])
    if min(heights.shape) < MIN_CELLS:
        raise UnreadableFile(
            f"{path.name} holds {heights.shape[0]} x {raw.heights.shape[1]} heights, too few for a "
            f"map; give a measurement of at least {MIN_CELLS} x {MIN_CELLS}"
        )
    nx, ny = heights.shape
    half = (nx * sizes[0] / 2.0, ny * sizes[1] / 2.0)
    grid = Grid(cells=(nx, ny), lower=(-half[0], -half[1]), upper=half, periodic=(False, False))
    notes += tuple(_warnings(sizes, heights))
    return MeasuredSurface(heights, grid, path.name, raw.format, notes, uniform)


def _require_possible(name: str, heights: Field, sizes: tuple[float, float]) -> None:
    if np.isnan(heights).all():
        raise UnreadableFile(
            f"{name} holds no valid height among its {heights.size}; measure it again"
        )
    if not all(_POSSIBLE_LENGTH[0] < size < _POSSIBLE_LENGTH[1] for size in sizes):
        raise UnreadableFile(f"{name} has a pixel of {sizes[0]:g} x {sizes[1]:g} m; {_REMEDY}")


def _drop_impossible(heights: Field) -> tuple[str, ...]:
    """Set impossible heights to nan in place; return a note of them, if any."""
    impossible = np.abs(heights - np.nanmedian(heights)) > _POSSIBLE_LENGTH[1]
    if not impossible.any():
        return ()
    heights[impossible] = np.nan
    count = int(np.count_nonzero(impossible))
    return (
        f"{count} heights, more than 1000 km from the median, count as missing; check the file",
    )


def _sizes(
    name: str,
    raw: RawMap,
    unit: str | None,
    lateral_unit: str | None,
    pixel: tuple[float, float] | None,
) -> tuple[float, tuple[float, float]]:
    """Return metres per unit of height and the pixel [m], from the file or else the caller."""
    if raw.pixel is not None:
        if pixel is not None:
            raise BadInput(f"{name} states its own pixel size; leave out pixel")
        height, lateral = _scales(name, raw.unit, unit, lateral_unit)
        return height, (raw.pixel[0] * lateral, raw.pixel[1] * lateral)
    if pixel is None:
        raise BadInput(f"{name} holds heights without a pixel size; give pixel, their distance")
    if lateral_unit is not None:
        raise BadInput(
            f"{name} holds only heights, whose pixel is in metres; leave out lateral_unit"
        )
    return _scales(name, raw.unit, unit, "m" if raw.unit is None else None)[0], pixel


def _warnings(pixel: tuple[float, float], heights: Field) -> Iterator[str]:
    smallest, largest = _PLAUSIBLE_PIXEL
    steps = np.abs(np.diff(heights, axis=0)) / pixel[0]
    slope = float(np.nanmedian(steps)) if np.isfinite(steps).any() else 0.0
    if slope > _PLAUSIBLE_SLOPE:
        yield (
            f"neighbouring heights differ by {slope:.3g} times their distance; check the units of "
            "both"
        )
    for axis, size in zip("xy", pixel, strict=True):
        if not smallest <= size <= largest:
            yield (
                f"the pixel along {axis} is {length_text(size)}, implausible for a roughness map; "
                "check the lateral unit"
            )
    if not np.isclose(*pixel, rtol=1e-3):
        yield (
            f"the pixel is not square: {length_text(pixel[0])} along x, {length_text(pixel[1])} "
            "along y"
        )


def _scales(
    name: str, stated: str | None, unit: str | None, lateral_unit: str | None
) -> tuple[float, float]:
    """Return metres per unit of height and per unit of length, from the file or else the caller."""
    convert = surface_topography().Support.UnitConversion.get_unit_conversion_factor

    def metres(unit_name: str) -> float:
        try:
            return float(convert(unit_name.replace("um", "µm"), "m"))
        except (ValueError, KeyError) as error:
            raise BadInput(
                f"{name} cannot have the unit {unit_name!r}; use a length such as nm, um, mm or m"
            ) from error

    if stated is not None:
        if unit is not None or lateral_unit is not None:
            raise BadInput(f"{name} states its own unit, {stated}; leave out unit and lateral_unit")
        return metres(stated), metres(stated)
    if unit is None or lateral_unit is None:
        raise BadInput(
            f"{name} states no units; give unit (of the heights) and lateral_unit, such as "
            "`unit` um `lateral_unit` mm, or surface.unit in a case"
        )
    return metres(unit), metres(lateral_unit)


def _read(path: Path, *, matrix: bool) -> RawMap:
    """Read a file with the readers of its suffix, or by its content if the suffix is unknown."""
    _require_readable(path)
    name = path.name
    suffix = path.suffix.lower().removeprefix(".")
    if suffix == "npy":
        return _array(path)
    if matrix and suffix in TABLES:
        return RawMap(_x_first(read_table(path)[::-1]), None, "text", None)
    suffixes = {
        reader.format(): set(reader.file_extensions()) for reader in surface_topography().IO.readers
    }
    formats = [form for form, extensions in suffixes.items() if suffix in extensions]
    if not formats and suffix not in TABLES:
        result = _try_formats(path, [None])
        if isinstance(result, RawMap):
            return result
        raise UnreadableFile(f"{name} is in no format that can be read; {_REMEDY}") from result
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
        f"{name} is no readable .{suffix} file ({_cause(result)}); {_REMEDY}"
    ) from result


def _cause(reason: Exception | None) -> str:
    # messages of a mismatch mention unexpected bytes
    mismatch = surface_topography().Exceptions.FileFormatMismatch
    return "its content has another format" if isinstance(reason, mismatch) else first_line(reason)


def _require_readable(path: Path) -> None:
    try:
        with path.open("rb") as file:
            start = file.read(1)
    except OSError as error:
        raise UnreadableFile(
            f"{path} cannot be opened ({error.strerror}); name a file that can be read"
        ) from error
    if not start:
        raise UnreadableFile(f"{path.name} is empty; {_REMEDY}")
    if zipfile.is_zipfile(path):
        with zipfile.ZipFile(path) as archive:
            require_unpacked(path, sum(part.file_size for part in archive.infolist()), _REMEDY)


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
            raise UnreadableFile(f"{path.name} is in no format that can be read; {_REMEDY}")
        channel = reader.default_channel
        if channel.dim == 1:
            line = reader.topography()
            x, z = line.positions_and_heights()
            return _profile(path, x, z, str(reader.format()), line.unit)
        bare = channel.physical_sizes is None
        topography = (
            reader.topography(physical_sizes=channel.nb_grid_pts) if bare else reader.topography()
        )
        heights = np.ma.filled(np.ma.asarray(topography.heights(), dtype=np.float64), np.nan)
        (width, length) = topography.physical_sizes
        unit = topography.unit
    pixel = None if bare else (float(width) / heights.shape[0], float(length) / heights.shape[1])
    maps = [other.name for other in reader.channels if other.dim == 2]
    if len(maps) > 1:
        notes.append(f"of the {len(maps)} maps in the file, the first, {channel.name!r}, was read")
    return RawMap(heights, pixel, str(reader.format()), unit, tuple(notes))


def _profile(path: Path, x: Field, z: Field, form: str, unit: str | None) -> RawMap:
    """Return a profile with even steps; other profiles are interpolated, with a note."""
    steps = np.diff(x)
    if x.size < MIN_CELLS or not (steps > 0.0).all():
        raise UnreadableFile(
            f"{path.name} is no profile of at least {MIN_CELLS} points with increasing x; {_REMEDY}"
        )
    step = float(x[-1] - x[0]) / (x.size - 1)
    notes: tuple[str, ...] = ()
    z = np.ma.filled(np.ma.asarray(z, dtype=np.float64), np.nan)
    if np.max(np.abs(steps - step)) > _STEP_TOLERANCE * step:
        notes = (
            "the profile's points are not evenly spaced; they were interpolated onto even steps",
        )
        z = np.interp(x[0] + step * np.arange(x.size), x, z)
    return RawMap(z[:, None], (step, step), form, unit, notes)


def _table(path: Path) -> RawMap:
    """Read two columns as a profile, more as a matrix; SurfaceTopography reads lists of points."""
    numbers = read_table(path)
    if numbers.shape[1] == 2:
        return _profile(path, numbers[:, 0], numbers[:, 1], "text", None)
    if min(numbers.shape) < MIN_CELLS:
        raise UnreadableFile(
            f"{path.name} holds {numbers.shape[0]} rows of {numbers.shape[1]} numbers; "
            "give a profile (x, z), points on a regular grid (x, y, z) or a matrix of heights"
        )
    return RawMap(_x_first(numbers[::-1]), None, "text", None)


def _array(path: Path) -> RawMap:
    """Read heights of shape (nx, ny) from .npy, a file that SurfaceTopography would leave open."""
    try:
        heights = np.asarray(np.load(path, allow_pickle=False), dtype=np.float64)
    except Exception as error:
        raise UnreadableFile(
            f"{path.name} is no readable .npy file ({first_line(error)}); {_REMEDY}"
        ) from error
    if heights.ndim != 2:
        raise UnreadableFile(
            f"{path.name} holds an array of {heights.ndim} axes; give heights along x and y"
        )
    return RawMap(heights, None, "npy", None)


def _x3p(path: Path) -> RawMap:
    import x3pio

    try:
        content = x3pio.read(path)
    except Exception:
        tolerant = _tolerant_x3p(path)
        if tolerant is None:
            raise
        return tolerant
    if not isinstance(content, x3pio.Surface):
        kind = type(content).__name__.lower()
        raise UnreadableFile(
            f"{path.name} holds a {kind}, not a map on a regular grid; give an areal map"
        )
    pixel = (float(content.header.x.increment), float(content.header.y.increment))
    return RawMap(_x_first(content.layers[0].z), pixel, "x3p", "m")


def _tolerant_x3p(path: Path) -> RawMap | None:
    """Read an x3p map whose archive violates the standard (subfolder or unknown elements).

    The checksums of the archive detect damage. Returns None unless it holds a map on a regular
    grid.
    """
    try:
        with zipfile.ZipFile(path) as archive:
            mains = [name for name in archive.namelist() if name.split("/")[-1] == "main.xml"]
            root = ElementTree.fromstring(archive.read(mains[0]))
            elements = {
                element.tag.split("}")[-1]: (element.text or "").strip() for element in root.iter()
            }
            steps = [
                float(root.findtext(f".//{{*}}{axis}/{{*}}Increment") or "nan")
                for axis in ("CX", "CY", "CZ")
            ]
            data = archive.read(mains[0].removesuffix("main.xml") + elements["PointDataLink"])
        kind = {"D": "<f8", "F": "<f4"}[root.findtext(".//{*}CZ/{*}DataType") or ""]
        cells = int(elements["SizeX"]), int(elements["SizeY"])
        rows = np.frombuffer(data, dtype=kind).reshape(cells[1], cells[0]) * steps[2]
    except Exception:  # noqa: BLE001 - any error of a damaged archive or its XML
        return None
    notes = ("the x3p archive violates the standard, but holds a map",)
    return RawMap(_x_first(rows), (steps[0], steps[1]), "x3p", "m", notes)


def _sdf(path: Path) -> RawMap:
    import sdfio

    content = sdfio.read(path)
    return RawMap(
        _x_first(content.data),
        (float(content.header.x_scale), float(content.header.y_scale)),
        "sdf",
        "m",
    )


_LAST_RESORTS: dict[str, Callable[[Path], RawMap]] = {
    "x3p": _x3p,
    "sdf": _sdf,
    **dict.fromkeys(TABLES, _table),
}


def _x_first(rows: npt.ArrayLike) -> Field:
    """Transpose rows of constant y to shape (nx, ny)."""
    return np.ascontiguousarray(np.ma.filled(np.ma.asarray(rows, dtype=np.float64), np.nan).T)


def surface_topography() -> ModuleType:
    """Import SurfaceTopography without its warning about missing MPI."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ImportWarning)
        import SurfaceTopography
    module: ModuleType = SurfaceTopography
    return module
