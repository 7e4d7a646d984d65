"""[surface] of a case file: roughness made from numbers or read from a file, at rest on the grid and on moving tracks.

`KINDS` has a line for every generated surface: what makes it, and its keys.
"""

import math
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any, Literal, NamedTuple

import numpy as np
from pydantic import Field, PlainValidator, Strict, create_model

from asperity.case.messages import LocatedError, Section, choose, validated
from asperity.case.units import OPTIONAL, PAIRED, Length, Number, Seed, plain
from asperity.contact.grid import Grid
from asperity.core.errors import BadInput
from asperity.surface import (
    CompositeSurface,
    FitMode,
    Form,
    MeasuredSurface,
    MovingSurfaces,
    Outliers,
    PreparedSurface,
    Surface,
    SurfaceConditioning,
    area_text,
    correlation_lengths,
    count_places,
    flat_surface,
    gaussian_surface,
    ground_surface,
    length_text,
    non_gaussian_surface,
    prepare_surface,
    read_surface,
    run_in_surface,
    sandblasted_surface,
    self_affine_surface,
)

SAMPLE_DEVIATION = (
    0.05  # of a generated surface's correlation lengths, beyond which the notes say so
)

RoughBody = Literal["first", "second", "both"]


def _parse_second(value: object) -> "SurfaceSection | None":
    """The other body's surface; without kind a measured one."""
    if value is None or value == "none":
        return None
    if isinstance(value, Mapping) and "second" in value:
        raise LocatedError(
            ("second",), "is a third surface where a contact has two bodies; leave it out"
        )
    if isinstance(value, Mapping) and "kind" not in value:
        return validated(FileSection, value)
    return parse_surface(value)


class SurfaceSection(Section, ABC):
    """[surface]; `second` is that of the other body, where each has its own."""

    second: Annotated[Any, PlainValidator(_parse_second)] = None

    @property
    def parts(self) -> "dict[str, SurfaceSection]":
        """Both bodies' surfaces by the key that each stands at; one where it is that of both together."""
        return {"surface": self, **({} if self.second is None else {"surface.second": self.second})}

    @property
    @abstractmethod
    def fixed(self) -> bool:
        """Whether there is no other surface like it."""

    @abstractmethod
    def room(self, grid: Grid, folder: Path) -> int | None:
        """How many surfaces of its kind there are; None for as many as one likes."""

    @abstractmethod
    def numbered(self, number: int) -> dict[str, object]:
        """The keys and values that make it the surface of that number; it is number 0 itself."""

    @abstractmethod
    def made(self, grid: Grid, folder: Path, *stream: int) -> tuple[Surface, tuple[str, ...]]:
        """The surface on a grid, and what was done to get it; of another `stream` an independent one, where drawn."""

    @property
    @abstractmethod
    def name(self) -> str:
        """Its file's, or its kind."""

    def available(self, grid: Grid, folder: Path) -> int | None:
        """How many different surfaces both bodies can have together; None for as many as one likes."""
        varied = [part for part in self.parts.values() if not part.fixed]
        rooms = [room for part in varied if (room := part.room(grid, folder)) is not None]
        return min(rooms) if rooms else None if varied else 1

    def another(self, number: int) -> dict[str, object]:
        """The keys and values of the case that make both bodies' the surfaces of that number."""
        return {
            f"{key}.{name}": value
            for key, part in self.parts.items()
            if not part.fixed
            for name, value in part.numbered(number).items()
        }


_LENGTH: Any = (Length, ...)
_LENGTHS: Any = (tuple[Length, Length], ...)
_PAIR: Any = (Annotated[tuple[Length, Length], PAIRED], ...)
_NUMBER: Any = (Number, ...)
_DIRECTION: Any = (Number, 0.0)  # of the first correlation length, or of the lay, from x towards y
_SEED: Any = (Seed, 0)


class _Kind(NamedTuple):
    """A kind of generated surface: what makes it of the grid, the section's fields and an rng; and the fields."""

    generator: Callable[..., Surface]
    fields: dict[str, Any]


KINDS: dict[str, _Kind] = {
    "gaussian": _Kind(
        gaussian_surface,
        {"sq": _LENGTH, "correlation_length": _PAIR, "direction_deg": _DIRECTION, "seed": _SEED},
    ),
    "non-gaussian": _Kind(
        non_gaussian_surface,
        {"sq": _LENGTH, "skewness": _NUMBER, "kurtosis": _NUMBER, "correlation_length": _PAIR}
        | {"direction_deg": _DIRECTION, "seed": _SEED},
    ),
    "self-affine": _Kind(  # cut-offs: shortest and longest wavelength
        self_affine_surface, {"sq": _LENGTH, "hurst": _NUMBER, "cutoffs": _LENGTHS, "seed": _SEED}
    ),
    "ground": _Kind(
        ground_surface,
        {
            "sq": _LENGTH,
            "groove_width": _LENGTH,
            "groove_length": _LENGTH,
            "direction_deg": _DIRECTION,
            "seed": _SEED,
        },
    ),
    "sandblasted": _Kind(
        sandblasted_surface, {"sq": _LENGTH, "crater_radius": _LENGTH, "seed": _SEED}
    ),
    # plateau_roughness: Sq of the plateau over that of the surface before it was worn
    "run-in": _Kind(
        run_in_surface,
        {
            "sq": _LENGTH,
            "correlation_length": _PAIR,
            "plateau_share": _NUMBER,
            "plateau_roughness": (Number, 0.1),
        }
        | {"direction_deg": _DIRECTION, "seed": _SEED},
    ),
    "flat": _Kind(lambda grid, rng: flat_surface(grid), {}),  # noqa: ARG005
}


class GeneratedSection(SurfaceSection):
    """Roughness made from numbers: the fields are keywords of its generator; a `seed` draws it where it is random."""

    kind: str

    def arguments(self) -> dict[str, Any]:
        """The fields as the generator takes them: SI, an angle in radians."""
        values = {
            name: plain(getattr(self, name)) for name in KINDS[self.kind].fields if name != "seed"
        }
        if "direction_deg" in values:
            values["direction"] = math.radians(values.pop("direction_deg"))
        return values

    def make(self, grid: Grid, *stream: int) -> Surface:
        """The surface on a grid; another `stream` of the seed is an independent one."""
        seed: int = getattr(self, "seed", 0)
        rng = np.random.default_rng([seed, *stream] if stream else seed)
        return KINDS[self.kind].generator(grid, **self.arguments(), rng=rng)

    @property
    def name(self) -> str:
        """Its kind."""
        return self.kind

    @property
    def fixed(self) -> bool:
        """Where no seed draws it."""
        return "seed" not in KINDS[self.kind].fields

    def room(self, grid: Grid, folder: Path) -> int | None:  # noqa: ARG002 - it needs none
        """As many as there are seeds."""
        return None

    def numbered(self, number: int) -> dict[str, object]:
        """With a later seed."""
        return {"seed": getattr(self, "seed", 0) + number}

    def made(self, grid: Grid, folder: Path, *stream: int) -> tuple[Surface, tuple[str, ...]]:  # noqa: ARG002
        """Drawn on the grid."""
        surface = self.make(grid, *stream)
        return surface, self.notes(surface)

    def notes(self, surface: Surface) -> tuple[str, ...]:
        """How far the correlation lengths of a sample stray from those of a (non-)Gaussian section."""
        if self.kind not in ("gaussian", "non-gaussian"):
            return ()
        arguments = self.arguments()
        stated, lengths = (
            arguments["correlation_length"],
            correlation_lengths(surface, arguments["direction"]),
        )
        if all(
            abs(sample / mean - 1.0) <= SAMPLE_DEVIATION
            for sample, mean in zip(lengths, stated, strict=True)
        ):
            return ()
        return (
            f"This sample's autocorrelation falls to 1/e over {area_text(lengths)}, where {area_text(stated)} "
            "was asked for: the domain holds few correlation lengths, so seeds scatter.",
        )


GENERATED_SECTIONS: dict[str, type[GeneratedSection]] = {
    name: create_model(
        name, __base__=GeneratedSection, **{"kind": (Literal[name], ...), **kind.fields}
    )
    for name, kind in KINDS.items()
}


class FileSection(SurfaceSection):
    """A measured surface and what is done to it."""

    file: str
    sq: Annotated[Length | None, OPTIONAL] = None  # scale to this; left out: as measured
    form: Form = "quadratic"
    fit: FitMode = "crop"
    turn: Annotated[bool, Strict()] = (
        False  # by a quarter turn: what the file has along x runs along y
    )
    outliers: Outliers = "keep"
    s_filter: Annotated[Length | None, OPTIONAL] = None
    l_filter: Annotated[Length | None, OPTIONAL] = None
    unit: str | None = None  # of the heights, where the file does not say
    lateral_unit: str | None = None
    pixel: Annotated[tuple[Length, Length], PAIRED] | None = None  # of a matrix of bare heights
    place: Annotated[int, Strict(), Field(ge=0)] | None = (
        None  # which part of the map; left out: its centre
    )

    def measured(self, folder: Path) -> MeasuredSurface:
        """The file's map; `folder` is where the file is looked for."""
        return read_surface(
            folder / self.file,
            unit=self.unit,
            lateral_unit=self.lateral_unit,
            pixel=plain(self.pixel),
        )

    @property
    def name(self) -> str:
        """Its file's."""
        return self.file

    @property
    def fixed(self) -> bool:
        """A map has other places."""
        return False

    def room(self, grid: Grid, folder: Path) -> int | None:
        """As many as the map holds side by side, from its own place on."""
        return max(1, count_places(self.measured(folder), grid, turn=self.turn) - (self.place or 0))

    def numbered(self, number: int) -> dict[str, object]:
        """At the place so many places on."""
        return {"place": (self.place or 0) + number}

    def made(self, grid: Grid, folder: Path, *stream: int) -> tuple[Surface, tuple[str, ...]]:  # noqa: ARG002
        """Prepared for the grid."""
        prepared = self.prepare(grid, folder)
        return prepared.surface, prepared.steps

    @property
    def conditioning(self) -> SurfaceConditioning:
        """Settings of form removal, rotation, outliers and filters."""
        return SurfaceConditioning(
            form=self.form,
            turn=self.turn,
            outliers=self.outliers,
            s_filter=plain(self.s_filter),
            l_filter=plain(self.l_filter),
        )

    def prepare(self, grid: Grid, folder: Path) -> PreparedSurface:
        """The file's map on a grid; `folder` is where the file is looked for."""
        measured = self.measured(folder)
        prepared = prepare_surface(
            measured,
            grid,
            conditioning=self.conditioning,
            sq=plain(self.sq),
            fit=self.fit,
            place=self.place or 0,
        )
        return replace(prepared, steps=(*measured.notes, *prepared.steps))


def parse_surface(value: object) -> SurfaceSection:
    """The section of a generated surface by its kind, or that of a measured one."""
    if isinstance(value, Mapping) and "file" in value:
        if "kind" in value:
            raise BadInput(
                "has both kind and file; keep kind for a generated surface or file for a measured one"
            )
        return validated(FileSection, value)
    if isinstance(value, Mapping) and "kind" not in value:
        raise BadInput(
            f"must hold kind (one of {', '.join(GENERATED_SECTIONS)}) or file (a measured surface)"
        )
    return choose("kind", lambda: GENERATED_SECTIONS, value)


def two_bodies(
    section: SurfaceSection, grid: Grid, folder: Path, speeds: tuple[float, float]
) -> CompositeSurface | None:
    """Both bodies' surfaces apart, each with its speed [m/s]; None where the section has no second one."""
    if section.second is None:
        return None
    (first, _), (second, _) = _bodies(section, grid, folder)
    return CompositeSurface(first, second, speeds)


def composite_roughness(
    section: SurfaceSection, grid: Grid, folder: Path, speeds: tuple[float, float]
) -> tuple[Surface, tuple[str, ...]]:
    """The roughness of both bodies together on the grid, and what was done to get it, a sentence each."""
    if section.second is None:
        return section.made(grid, folder)
    (first, done), (second, done_to_second) = _bodies(section, grid, folder)
    combined = CompositeSurface(first, second, speeds).surface
    return combined, (
        *(f"{section.name}: {step}" for step in done),
        *(f"{section.second.name}: {step}" for step in done_to_second),
        f"added {section.name} (moving at {speeds[0]:.4g} m/s) and {section.second.name} ({speeds[1]:.4g} m/s), "
        f"the second face down; Sq {length_text(combined.sq)} together",
    )


def _bodies(
    section: SurfaceSection, grid: Grid, folder: Path
) -> list[tuple[Surface, tuple[str, ...]]]:
    """Both bodies' surfaces; a second one that is drawn depends on the first one's seed too, and is no copy of it."""
    drawn = int(getattr(section, "seed", 0) or getattr(section, "place", 0) or 0)
    return [section.made(grid, folder), section.second.made(grid, folder, 2, drawn)]


def moving_roughness(
    section: SurfaceSection,
    rough: RoughBody,
    track: Grid,
    folder: Path,
    speeds: tuple[float, float],
    grid: Grid,
) -> MovingSurfaces:
    """The roughness of both bodies on their tracks, seen through the contact's `grid`; see `Case.moving_surfaces`."""
    apart = two_bodies(section, track, folder, speeds)
    if apart is not None:
        return MovingSurfaces(apart.first, apart.second, speeds, grid)
    if isinstance(section, FileSection):
        if rough == "both":
            raise BadInput(
                f"{section.file} is one surface and motion.rough asks for two; name the other as second"
            )
        surface = section.prepare(track, folder).surface
    else:
        assert isinstance(section, GeneratedSection)
        surface = section.make(track)
        if rough == "both":
            samples = (surface, section.make(track, 2))
            first, second = (Surface(sample.heights / math.sqrt(2.0), track) for sample in samples)
            return MovingSurfaces(first, second, speeds, grid)
    return MovingSurfaces.one_rough(surface, speeds, grid, first=rough == "first")
