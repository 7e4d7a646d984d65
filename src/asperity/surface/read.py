"""Reading measured surfaces, in the formats of the instruments.

SurfaceTopography does the reading, x3pio and sdfio the x3p and SDF files that it cannot. Nothing is corrected here:
levelling, filling and resampling are left to `asperity.surface.prepare`.
"""

import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager, redirect_stderr, redirect_stdout
from dataclasses import dataclass
from io import StringIO
from pathlib import Path
from typing import Any

import numpy as np

from asperity.arrays import Field
from asperity.errors import BadInput, UnreadableFile
from asperity.grid import FEWEST_CELLS, Grid
from asperity.surface.model import MeasuredSurface, length_text

_TEXT = {"xyz", "asc"}  # columns of numbers: any name will do for them
_UNMARKED = {"nms", "hgt"}  # formats that accept nearly any bytes, so only the file's name can call for them
_PLAUSIBLE_PIXEL = 1e-10, 1e-3  # an atom to a millimetre [m]
_REMEDY = "export it again, as standard x3p or SDF if need be"


@dataclass(frozen=True, slots=True)
class _Map:
    """What a reader found: `heights` (nx, ny) and `pixel` in the units named, None where the file names none."""

    heights: Field
    pixel: tuple[float, float]
    format: str
    unit: str | None
    notes: tuple[str, ...] = ()


def read_surface(path: str | Path, *, unit: str | None = None, lateral_unit: str | None = None) -> MeasuredSurface:
    """Read a measured map; heights in metres, NaN where the instrument saw nothing.

    Parameters
    ----------
    path : a file in any format of SurfaceTopography, x3pio or sdfio
    unit, lateral_unit : units of the heights and of x and y, such as "um" and "mm", for files that name none

    Raises
    ------
    UnreadableFile
        for a file that is missing, empty, cut short, not what its name says, in no known format, or a profile.
    BadInput
        for a file without units when none are given, or units given for a file that has its own.
    """
    path = Path(path)
    found = _read(path)
    height_scale, lateral_scale = _scales(path.name, found.unit, unit, lateral_unit)
    if min(found.heights.shape) < FEWEST_CELLS:
        raise UnreadableFile(
            f"{path.name} holds {found.heights.shape[0]} x {found.heights.shape[1]} heights, too few for a map; "
            f"give a measurement of at least {FEWEST_CELLS} x {FEWEST_CELLS}"
        )
    heights = np.where(np.isfinite(found.heights), found.heights, np.nan) * height_scale
    if np.isnan(heights).all():
        raise UnreadableFile(f"{path.name} holds no valid height among its {heights.size}; measure it again")
    pixel = (found.pixel[0] * lateral_scale, found.pixel[1] * lateral_scale)
    half = tuple(n * d / 2.0 for n, d in zip(heights.shape, pixel, strict=True))
    grid = Grid(
        cells=(heights.shape[0], heights.shape[1]),
        lower=(-half[0], -half[1]),
        upper=(half[0], half[1]),
        periodic=(False, False),
    )
    return MeasuredSurface(heights, grid, path.name, found.format, (*found.notes, *_oddities(pixel)))


def _oddities(pixel: tuple[float, float]) -> Iterator[str]:
    smallest, largest = _PLAUSIBLE_PIXEL
    for axis, size in zip("xy", pixel, strict=True):
        if not smallest <= size <= largest:
            yield f"the pixel along {axis} is {length_text(size)}, hardly a roughness map; check the lateral unit"
    if not np.isclose(*pixel, rtol=1e-3):
        yield f"the pixel is not square: {length_text(pixel[0])} along x, {length_text(pixel[1])} along y"


def _scales(name: str, stated: str | None, unit: str | None, lateral_unit: str | None) -> tuple[float, float]:
    """Metres in one unit of height and in one unit of length, from the file or else from the caller."""
    convert = library().Support.UnitConversion.get_unit_conversion_factor

    def metres(given: str) -> float:
        try:
            return float(convert(given.replace("um", "µm"), "m"))
        except (ValueError, KeyError) as error:
            raise BadInput(f"{name} cannot have the unit {given!r}; use a length such as nm, um, mm or m") from error

    if stated is not None:
        if unit is not None or lateral_unit is not None:
            raise BadInput(f"{name} states its own unit, {stated}; leave out unit and lateral_unit")
        return metres(stated), metres(stated)
    if unit is None or lateral_unit is None:
        raise BadInput(f"{name} names no units; give unit (of the heights) and lateral_unit, such as um and mm")
    return metres(unit), metres(lateral_unit)


def _read(path: Path) -> _Map:
    """The map in the file, by the readers that its suffix names; without a telling suffix, by its content."""
    name, suffix = path.name, path.suffix.lower().removeprefix(".")
    try:
        with path.open("rb") as file:
            start = file.read(1)
    except FileNotFoundError:
        raise UnreadableFile(f"{path} does not exist; correct the path") from None
    except OSError as error:
        raise UnreadableFile(f"{path} cannot be opened ({error.strerror}); name a file that can be read") from error
    if not start:
        raise UnreadableFile(f"{name} is empty; {_REMEDY}")

    suffixes = {reader.format(): set(reader.file_extensions()) for reader in library().IO.readers}
    formats = [form for form, known in suffixes.items() if suffix in known]
    if not formats:
        return _read_by_content(path)
    if _TEXT.intersection(formats):
        formats = [form for form in suffixes if form in _TEXT.union(formats)]
    reason: Exception | None = None
    for form in formats:
        try:
            return _topography(path, form)
        except UnreadableFile:
            raise
        except Exception as error:  # noqa: BLE001 - the readers of forty formats raise whatever they stumble over
            reason = reason or error
            if isinstance(error, library().Exceptions.CorruptFile):
                break  # recognised but damaged: the next reader would only misread it
    if suffix in _LAST_RESORTS:
        try:
            return _LAST_RESORTS[suffix](path)
        except UnreadableFile:
            raise
        except Exception as error:  # noqa: BLE001 - as above
            reason = error
    actual = _format_of(path)
    if actual is not None and actual not in formats:
        remedy = f"rename it to .{min(suffixes[actual])} if that is right"
        raise UnreadableFile(f"{name} is called .{suffix} but looks like {actual} inside; {remedy}") from reason
    raise UnreadableFile(f"{name} is no readable .{suffix} file ({_why(reason)}); {_REMEDY}") from reason


def _read_by_content(path: Path) -> _Map:
    try:
        return _topography(path, None)
    except UnreadableFile:
        raise
    except Exception as error:
        raise UnreadableFile(f"{path.name} is in no format that can be read; {_REMEDY}") from error


def _format_of(path: Path) -> str | None:
    """What the content is, as far as it bears a mark of its own."""
    with _quietly():
        try:
            form = str(library().open_topography(str(path)).format())
        except Exception:  # noqa: BLE001 - as above
            form = next((known for known, read in _LAST_RESORTS.items() if _readable(read, path)), "")
    return form if form and form not in _UNMARKED | _TEXT else None


def _readable(read: Callable[[Path], _Map], path: Path) -> bool:
    try:
        read(path)
    except Exception:  # noqa: BLE001 - as above
        return False
    return True


def _topography(path: Path, form: str | None) -> _Map:
    with _quietly() as notes:
        reader = library().open_topography(str(path), format=form)
        if form is None and reader.format() in _UNMARKED:
            raise UnreadableFile(f"{path.name} is in no format that can be read; {_REMEDY}")
        channel = reader.default_channel
        if channel.dim != 2:
            raise UnreadableFile(f"{path.name} holds a profile of {channel.nb_grid_pts[0]} points; give an areal map")
        if channel.physical_sizes is None:
            raise UnreadableFile(f"{path.name} holds heights without a pixel size; {_REMEDY}")
        topography = reader.topography()
        heights = np.ma.filled(np.ma.asarray(topography.heights(), dtype=np.float64), np.nan)
        sizes, unit = topography.physical_sizes, topography.unit
    pixel = (float(sizes[0]) / heights.shape[0], float(sizes[1]) / heights.shape[1])
    maps = [other.name for other in reader.channels if other.dim == 2]
    if len(maps) > 1:
        notes.append(f"of the {len(maps)} maps in the file, the first, {channel.name!r}, was read")
    return _Map(heights, pixel, str(reader.format()), unit, tuple(notes))


def _x3p(path: Path) -> _Map:
    import x3pio

    content: Any = x3pio.read(path)
    if not isinstance(content, x3pio.Surface):
        kind = type(content).__name__.lower()
        raise UnreadableFile(f"{path.name} holds a {kind}, not a map on a regular grid; give an areal map")
    pixel = (float(content.header.x.increment), float(content.header.y.increment))
    return _Map(_x_first(content.layers[0].z), pixel, "x3p", "m")


def _sdf(path: Path) -> _Map:
    import sdfio

    content: Any = sdfio.read(path)
    if min(content.data.shape) == 1:
        raise UnreadableFile(f"{path.name} holds a profile of {content.data.size} points; give an areal map")
    return _Map(_x_first(content.data), (float(content.header.x_scale), float(content.header.y_scale)), "sdf", "m")


_LAST_RESORTS: dict[str, Callable[[Path], _Map]] = {"x3p": _x3p, "sdf": _sdf}


def _x_first(rows: Any) -> Field:
    """Rows of constant y, as the file has them, to (nx, ny)."""
    return np.ascontiguousarray(np.ma.filled(np.ma.asarray(rows, dtype=np.float64), np.nan).T)


def library() -> Any:
    """SurfaceTopography, without its remark that MPI is absent."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ImportWarning)
        import SurfaceTopography
    return SurfaceTopography


@contextmanager
def _quietly() -> Iterator[list[str]]:
    """Collect a reader's warnings as notes, and drop what it prints: the terminal belongs to the caller."""
    notes: list[str] = []
    with redirect_stdout(StringIO()), redirect_stderr(StringIO()), warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("ignore")
        warnings.simplefilter("always", UserWarning)
        yield notes
    notes.extend(f"the reader warns: {_first_line(w.message)}" for w in caught)


def _why(reason: Exception | None) -> str:
    """The reader's own words, unless they only speak of bytes that it did not expect at the start."""
    if isinstance(reason, library().Exceptions.FileFormatMismatch):
        return "its content is something else"
    return _first_line(reason)


def _first_line(reason: Any) -> str:
    text = next((line.strip() for line in str(reason).splitlines() if line.strip()), type(reason).__name__)
    printable = "".join(c for c in text if c.isprintable()).rstrip(".;")
    return printable if len(printable) <= 100 else printable[:97] + "..."
