"""Heights and pixel of a file or an array in metres, with checks of their plausibility."""

from collections.abc import Iterator

import numpy as np

from asperity.contact.grid import MIN_CELLS, Grid
from asperity.core.arrays import Field
from asperity.core.errors import BadInput, UnreadableFile
from asperity.core.third_party import surface_topography
from asperity.surface.model import MeasuredSurface, length_text
from asperity.surface.raw_map import RawMap

REMEDY = "export it again, for example as standard x3p or SDF"
_POSSIBLE_LENGTH = 1e-15, 1e6  # [m]; other lengths indicate a damaged file
_PLAUSIBLE_SLOPE = 3.0  # median over neighbours, 72 degrees
_PLAUSIBLE_PIXEL = 1e-9, 1e-4  # [m]; other pixels need a confirmation
_REPORTED_MISSING = 0.05
_COARSE_LEVELS = 0.1  # distance of digitised heights over Sq ...
_FEW_LEVELS = 0.2  # ... where there are so few of them, over the number of heights
# names of units beside those of SurfaceTopography
_UNIT_NAMES = {
    "metre": "m",
    "meter": "m",
    "micrometre": "µm",
    "micrometer": "µm",
    "micron": "µm",
    "nanometre": "nm",
    "nanometer": "nm",
    "millimetre": "mm",
    "millimeter": "mm",
    "angstrom": "Å",
}


def to_metres(
    name: str,
    raw: RawMap,
    unit: str | None,
    lateral_unit: str | None,
    sizes: tuple[float, float] | None,
) -> MeasuredSurface:
    """Return the surface of a file's or an array's content in metres."""
    replaced = _replaced(raw, unit, lateral_unit, sizes)
    height_scale, sizes = _sizes(name, raw, unit, lateral_unit, sizes)
    heights = np.where(np.isfinite(raw.heights), raw.heights, np.nan) * height_scale
    _require_possible(name, heights, sizes)
    notes = raw.notes + replaced + _drop_impossible(heights)
    uniform = 1 if heights.shape[1] == 1 else None
    if uniform:
        heights, sizes = np.repeat(heights, MIN_CELLS, axis=1), (sizes[0], sizes[0])
    if min(heights.shape) < MIN_CELLS:
        raise UnreadableFile(
            f"{name} holds {heights.shape[0]} x {raw.heights.shape[1]} heights, too few for a "
            f"map; give a measurement of at least {MIN_CELLS} x {MIN_CELLS}"
        )
    nx, ny = heights.shape
    half = (nx * sizes[0] / 2.0, ny * sizes[1] / 2.0)
    grid = Grid(cells=(nx, ny), lower=(-half[0], -half[1]), upper=half, periodic=(False, False))
    notes += tuple(_warnings(sizes, heights))
    return MeasuredSurface(
        heights=heights,
        grid=grid,
        name=name,
        format=raw.format,
        notes=notes,
        uniform=uniform,
        rolling_along=raw.rolling_along,
    )


def _require_possible(name: str, heights: Field, sizes: tuple[float, float]) -> None:
    if np.isnan(heights).all():
        raise UnreadableFile(
            f"{name} holds no valid height among its {heights.size}; measure it again"
        )
    if not all(_POSSIBLE_LENGTH[0] < size < _POSSIBLE_LENGTH[1] for size in sizes):
        raise UnreadableFile(f"{name} has a pixel of {sizes[0]:g} x {sizes[1]:g} m; {REMEDY}")


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
    """Return metres per unit of height and the pixel [m]."""
    if raw.pixel is None and pixel is None:
        raise BadInput(
            f"{name} holds heights without a pixel size; give `pixel`, their distance, or "
            "surface.pixel in a case"
        )
    if pixel is not None and lateral_unit is not None:
        raise BadInput(
            f"{name} has a stated pixel, which is in metres; leave out `pixel` or `lateral_unit`"
        )
    height_unit, length_unit = unit or raw.unit, lateral_unit or raw.lateral_unit
    if height_unit is None or (length_unit is None and pixel is None):
        raise BadInput(
            f"{name} states no units; give unit (of the heights) and lateral_unit, such as "
            "`unit` um `lateral_unit` mm, or surface.unit in a case"
        )
    height_scale = _metres(name, height_unit, stated=unit is not None)
    if pixel is not None:
        return height_scale, pixel
    assert raw.pixel is not None
    assert length_unit is not None
    scale = _metres(name, length_unit, stated=lateral_unit is not None)
    sizes = (raw.pixel[0] * scale, raw.pixel[1] * scale)
    if lateral_unit is None or raw.lateral_unit is None:
        _require_plausible(name, sizes)
    return height_scale, sizes


def _require_plausible(name: str, sizes: tuple[float, float]) -> None:
    """Refuse an implausible pixel that is not confirmed."""
    smallest, largest = _PLAUSIBLE_PIXEL
    for axis, size in zip("xy", sizes, strict=True):
        if not smallest <= size <= largest:
            raise BadInput(
                f"{name} has a pixel of {length_text(size)} along {axis}, implausible for a "
                "roughness map; give the correct `lateral_unit`, or confirm it with `pixel`"
            )


def _replaced(
    raw: RawMap,
    unit: str | None,
    lateral_unit: str | None,
    pixel: tuple[float, float] | None,
) -> tuple[str, ...]:
    """Return notes on values of the file that the caller replaces."""
    units = ("heights", unit, raw.unit), ("lengths along x and y", lateral_unit, raw.lateral_unit)
    notes = [
        f"{quantity} are read in {stated}, although the file states {original}"
        for quantity, stated, original in units
        if stated is not None and original is not None and _length(stated) != _length(original)
    ]
    if pixel is not None and raw.pixel is not None:
        own = f"{raw.pixel[0]:g} x {raw.pixel[1]:g} {raw.lateral_unit or ''}".rstrip()
        notes.append(f"the pixel is the stated one, not that of the file, {own}")
    return tuple(notes)


def _metres(name: str, unit: str, *, stated: bool) -> float:
    """Return the length of a unit [m], `stated` by the caller or found in the file."""
    length = _length(unit)
    if length is not None:
        return length
    if stated:
        raise BadInput(
            f"{name} cannot have the unit {unit!r}; use a length such as nm, um, mm or m"
        )
    raise UnreadableFile(
        f"{name} holds values in {unit}, not heights; export its height (topography) channel, or "
        "give `unit` if they are heights"
    )


def _length(unit: str) -> float | None:
    """Return the length of a unit [m]; None for another unit."""
    convert = surface_topography().Support.UnitConversion.get_unit_conversion_factor
    plain = unit.strip().replace("\N{GREEK SMALL LETTER MU}", "\N{MICRO SIGN}")
    word = plain.lower()
    name = _UNIT_NAMES.get(word) or _UNIT_NAMES.get(word.removesuffix("s"))
    try:
        return float(convert(name or plain.replace("um", "\N{MICRO SIGN}m"), "m"))
    except (ValueError, KeyError):
        return None


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
                f"the pixel along {axis} is {length_text(size)}, as stated, which is unusual for a "
                "roughness map"
            )
    valid = heights[np.isfinite(heights)]
    levels = np.unique(valid)
    missing = 1.0 - valid.size / heights.size
    if missing > _REPORTED_MISSING:
        yield (
            f"{100 * missing:.2g} % of the heights are missing; parameters are those of the rest, "
            "and a contact fills them in"
        )
    if levels.size == 1:
        yield "all heights are equal; nothing was measured, or the channel is the wrong one"
    elif levels.size < _FEW_LEVELS * valid.size and (
        step := float(np.median(np.diff(levels)))
    ) > _COARSE_LEVELS * np.std(valid):
        yield (
            f"the heights have only {levels.size} levels, {length_text(step)} apart; gradients and "
            "summits below this resolution are artefacts"
        )
    if not np.isclose(*pixel, rtol=1e-3):
        yield (
            f"the pixel is not square: {length_text(pixel[0])} along x, {length_text(pixel[1])} "
            "along y"
        )
