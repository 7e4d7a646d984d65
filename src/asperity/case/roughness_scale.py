"""Length scales of a case's roughness, for automatic grids."""

import math
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np

from asperity.case.surfaces import FileSection, GeneratedSection, SurfaceSection
from asperity.case.units import plain
from asperity.ehl import Texture
from asperity.surface import condition_surface, correlation_lengths, read_surface

Pair = tuple[float, float]
SIZE_MARGIN = 1.02  # above the smallest domain that a generator accepts
GROOVE = 0.45, 0.95  # correlation lengths of a ground surface over its grooves' length and width
CRATER = 0.8  # correlation length of a sandblasted surface over the craters' radius


def texture_of(section: SurfaceSection, folder: Path) -> Texture | None:
    """Return the composite roughness scales of both bodies; None for smooth ones.

    Raises UnreadableFile for a surface file that cannot be read, BadInput for one that cannot be
    conditioned.
    """
    bodies = [
        texture
        for part in section.parts.values()
        if (texture := _of_body(part, folder)) is not None
    ]
    if len(bodies) < 2:
        return bodies[0] if bodies else None
    first, second = bodies
    return Texture(
        sq=math.hypot(first.sq, second.sq),
        lengths=_pairwise(min, first.lengths, second.lengths),
        least=_pairwise(max, first.least, second.least),
        most=_pairwise(min, first.most, second.most),
        largest_cell=_pairwise(min, first.largest_cell, second.largest_cell),
    )


def _of_body(section: SurfaceSection, folder: Path) -> Texture | None:
    if isinstance(section, GeneratedSection):
        return _KINDS[section.kind](section.arguments())
    assert isinstance(section, FileSection)
    return _measured(section, folder)


Arguments: TypeAlias = dict[str, Any]  # of a generator of surfaces, by name


def _correlated(arguments: Arguments) -> Texture:
    return _texture(arguments["sq"], arguments["correlation_length"], arguments["direction"])


def _ground(arguments: Arguments) -> Texture:
    grooves = arguments["groove_length"], arguments["groove_width"]
    return _texture(arguments["sq"], grooves, arguments["direction"], GROOVE, (1.0, 0.5))


def _texture(
    sq: float, sizes: Pair, direction: float, shares: Pair = (1.0, 1.0), resolved: Pair = (1.0, 1.0)
) -> Texture:
    """Return scales along a direction; `shares` of the sizes are correlation lengths.

    The domain holds at least two of each size, and `resolved` of them at least two cells: the
    condition of `asperity.surface.generate.require_lengths`.
    """
    cosine = abs(math.cos(direction))
    sine = abs(math.sin(direction))
    first = sizes[0] * shares[0]
    second = sizes[1] * shares[1]
    lengths = (
        1.0 / math.hypot(cosine / first, sine / second),
        1.0 / math.hypot(sine / first, cosine / second),
    )
    cells = SIZE_MARGIN * max(
        2.0 / (size * share * math.hypot(along / lengths[0], across / lengths[1]))
        for size, share, along, across in zip(
            sizes, resolved, (cosine, sine), (sine, cosine), strict=True
        )
    )
    return Texture(
        sq=sq,
        lengths=lengths,
        largest_cell=(lengths[0] / cells, lengths[1] / cells),
        least=(
            2.0 * SIZE_MARGIN * max(sizes[0] * cosine, sizes[1] * sine),
            2.0 * SIZE_MARGIN * max(sizes[0] * sine, sizes[1] * cosine),
        ),
    )


def _self_affine(arguments: Arguments) -> Texture:
    """Return half the shortest wavelength as correlation length: the scale to resolve."""
    shortest, longest = arguments["cutoffs"]
    return Texture(
        sq=arguments["sq"],
        lengths=(shortest / 2.0,) * 2,
        least=(SIZE_MARGIN * longest,) * 2,
        largest_cell=(shortest / (2.0 * SIZE_MARGIN),) * 2,
    )


def _sandblasted(arguments: Arguments) -> Texture:
    radius = arguments["crater_radius"]
    return Texture(
        sq=arguments["sq"],
        lengths=(CRATER * radius,) * 2,
        least=(8.0 * SIZE_MARGIN * radius,) * 2,
        largest_cell=(radius / (2.0 * SIZE_MARGIN),) * 2,
    )


_KINDS: dict[str, Callable[[Arguments], Texture | None]] = {
    "gaussian": _correlated,
    "non-gaussian": _correlated,
    "run-in": _correlated,
    "self-affine": _self_affine,
    "ground": _ground,
    "sandblasted": _sandblasted,
    "flat": lambda _: None,
}


def _measured(section: FileSection, folder: Path) -> Texture:
    """Return the scales of the conditioned map; infinite if its autocorrelation does not decay."""
    measured = read_surface(
        folder / section.file,
        unit=section.unit,
        lateral_unit=section.lateral_unit,
        pixel=plain(section.pixel),
    )
    levelled, _ = condition_surface(measured, section.conditioning)
    sq = plain(section.sq) or float(np.nanstd(levelled.heights))
    lengths = correlation_lengths(levelled)
    extents = [
        math.inf if axis == levelled.uniform else levelled.grid.extent[axis] for axis in (0, 1)
    ]
    return Texture(
        sq=sq,
        lengths=(_length_or_inf(lengths[0]), _length_or_inf(lengths[1])),
        most=(extents[0], extents[1]) if section.fit == "crop" else (math.inf, math.inf),
    )


def _length_or_inf(length: float) -> float:
    return math.inf if math.isnan(length) else length


def _pairwise(choose: Callable[[float, float], float], first: Pair, second: Pair) -> Pair:
    return choose(first[0], second[0]), choose(first[1], second[1])
