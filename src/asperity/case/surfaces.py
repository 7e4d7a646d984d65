"""[surface] of a case file: generated or measured roughness, on the grid and on moving tracks.

`KINDS` has an entry per generated surface: generator and keys.
"""

import math
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any, Literal, NamedTuple

import numpy as np
from pydantic import Field, PlainValidator, Strict, create_model

from asperity.case.laws import FieldSpecs
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
    step_sentence,
)

SAMPLE_DEVIATION = 0.05  # of a sample's correlation lengths, above which a note is given

RoughBody = Literal["first", "second", "both"]


def _parse_second(value: object) -> "SurfaceSection | None":
    """Parse the other body's surface; without kind a measured one."""
    if value is None or value == "none":
        return None
    if isinstance(value, Mapping) and "second" in value:
        raise LocatedError(
            ("second",), "would be a third surface, but a contact has two bodies; leave it out"
        )
    if isinstance(value, Mapping) and "kind" not in value:
        return validated(FileSection, value)
    return parse_surface(value)


class SurfaceSection(Section, ABC):
    """[surface]; `second` is that of the other body, if each has its own."""

    second: Annotated[Any, PlainValidator(_parse_second)] = None

    @property
    def parts(self) -> "dict[str, SurfaceSection]":
        """Surfaces of both bodies by key; a single one if it is the composite."""
        return {"surface": self, **({} if self.second is None else {"surface.second": self.second})}

    @property
    @abstractmethod
    def is_fixed(self) -> bool:
        """True if there is only one surface of this kind."""

    @abstractmethod
    def variant_count(self, grid: Grid, folder: Path) -> int | None:
        """Return the number of different surfaces of this kind; None if unlimited."""

    @abstractmethod
    def variant(self, number: int) -> dict[str, object]:
        """Return the keys and values of the surface of that number; 0 is itself."""

    @abstractmethod
    def build(self, grid: Grid, folder: Path, *stream: int) -> tuple[Surface, tuple[str, ...]]:
        """Return the surface on a grid, and its processing steps.

        Another `stream` gives an independent random surface.
        """

    @property
    @abstractmethod
    def name(self) -> str:
        """File name, or kind."""

    def available(self, grid: Grid, folder: Path) -> int | None:
        """Return the number of different surfaces of both bodies together; None if unlimited."""
        varied = [part for part in self.parts.values() if not part.is_fixed]
        counts = [
            variant_count
            for part in varied
            if (variant_count := part.variant_count(grid, folder)) is not None
        ]
        return min(counts) if counts else None if varied else 1

    def variant_overrides(self, number: int) -> dict[str, object]:
        """Return the case keys and values of the surfaces of that number, for both bodies."""
        return {
            f"{key}.{name}": value
            for key, part in self.parts.items()
            if not part.is_fixed
            for name, value in part.variant(number).items()
        }


_LENGTH = (Length, ...)
_LENGTHS = (tuple[Length, Length], ...)
_PAIR = (Annotated[tuple[Length, Length], PAIRED], ...)
_NUMBER = (Number, ...)
_DIRECTION = (Number, 0.0)  # of the first correlation length, or of the lay, from x towards y
_SEED = (Seed, 0)


class _Kind(NamedTuple):
    """Kind of generated surface: its generator, and the fields of the section."""

    generator: Callable[..., Surface]
    fields: FieldSpecs


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
    # plateau_roughness: Sq of the plateau over that of the unworn surface
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
    """Generated roughness: fields are keywords of its generator, and a `seed` if random."""

    kind: str

    def arguments(self) -> dict[str, Any]:
        """Return the generator's arguments: SI, angles in radians."""
        values = {
            name: plain(getattr(self, name)) for name in KINDS[self.kind].fields if name != "seed"
        }
        if "direction_deg" in values:
            values["direction"] = math.radians(values.pop("direction_deg"))
        return values

    def generate(self, grid: Grid, *stream: int) -> Surface:
        """Return the surface on a grid; another `stream` of the seed is independent."""
        seed: int = getattr(self, "seed", 0)
        rng = np.random.default_rng([seed, *stream] if stream else seed)
        return KINDS[self.kind].generator(grid, **self.arguments(), rng=rng)

    @property
    def name(self) -> str:
        """Kind of the surface."""
        return self.kind

    @property
    def is_fixed(self) -> bool:
        """True without a seed."""
        return "seed" not in KINDS[self.kind].fields

    def variant_count(self, grid: Grid, folder: Path) -> int | None:  # noqa: ARG002
        """Return None: there are as many as seeds."""
        return None

    def variant(self, number: int) -> dict[str, object]:
        """Return a later seed."""
        return {"seed": getattr(self, "seed", 0) + number}

    def build(self, grid: Grid, folder: Path, *stream: int) -> tuple[Surface, tuple[str, ...]]:  # noqa: ARG002
        """Return the surface generated on the grid, and notes."""
        surface = self.generate(grid, *stream)
        return surface, self.notes(surface)

    def notes(self, surface: Surface) -> tuple[str, ...]:
        """Return a note if a sample's correlation lengths deviate from the stated ones."""
        if self.kind not in ("gaussian", "non-gaussian"):
            return ()
        arguments = self.arguments()
        nominal = arguments["correlation_length"]
        lengths = correlation_lengths(surface, arguments["direction"])
        if all(
            abs(sample / mean - 1.0) <= SAMPLE_DEVIATION
            for sample, mean in zip(lengths, nominal, strict=True)
        ):
            return ()
        return (
            f"The correlation lengths of this sample are {area_text(lengths)}, "
            f"{area_text(nominal)} were requested: the domain holds few correlation lengths, so "
            "samples scatter with the seed.",
        )


GENERATED_SECTIONS: dict[str, type[GeneratedSection]] = {
    name: create_model(
        name, __base__=GeneratedSection, **{"kind": (Literal[name], ...), **kind.fields}
    )
    for name, kind in KINDS.items()
}


class FileSection(SurfaceSection):
    """Measured surface and its processing."""

    file: str
    sq: Annotated[Length | None, OPTIONAL] = None  # scale to this; omitted: as measured
    form: Form = "quadratic"
    fit: FitMode = "crop"
    turn: Annotated[bool, Strict()] = False  # by 90 degrees: x of the file becomes y
    outliers: Outliers = "keep"
    s_filter: Annotated[Length | None, OPTIONAL] = None
    l_filter: Annotated[Length | None, OPTIONAL] = None
    unit: str | None = None  # of the heights, if the file does not state it
    lateral_unit: str | None = None
    pixel: Annotated[tuple[Length, Length], PAIRED] | None = None  # of a matrix of bare heights
    place: Annotated[int, Strict(), Field(ge=0)] | None = (
        None  # number of the part of the map; omitted: its centre
    )

    def measured(self, folder: Path) -> MeasuredSurface:
        """Return the map of the file; `folder` is the base of its path."""
        return read_surface(
            folder / self.file,
            unit=self.unit,
            lateral_unit=self.lateral_unit,
            pixel=plain(self.pixel),
        )

    @property
    def name(self) -> str:
        """Name of the file."""
        return self.file

    @property
    def is_fixed(self) -> bool:
        """False: a map has other positions."""
        return False

    def variant_count(self, grid: Grid, folder: Path) -> int | None:
        """Return the number of non-overlapping positions on the map, from its own on."""
        return max(1, count_places(self.measured(folder), grid, turn=self.turn) - (self.place or 0))

    def variant(self, number: int) -> dict[str, object]:
        """Return a later position on the map."""
        return {"place": (self.place or 0) + number}

    def build(self, grid: Grid, folder: Path, *stream: int) -> tuple[Surface, tuple[str, ...]]:  # noqa: ARG002
        """Return the surface prepared for the grid, and its processing steps."""
        prepared = self.prepare(grid, folder)
        return prepared.surface, tuple(map(step_sentence, prepared.steps))

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
        """Return the file's map on a grid; `folder` is the base of its path."""
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
    """Parse the section of a generated surface by its kind, or of a measured one."""
    if isinstance(value, Mapping) and "file" in value:
        if "kind" in value:
            raise BadInput(
                "has both kind and file; keep kind for a generated surface or file for a measured "
                "one"
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
    """Return both bodies' surfaces separately, with speeds [m/s]; None without a second one."""
    if section.second is None:
        return None
    (first, _), (second, _) = _bodies(section, grid, folder)
    return CompositeSurface(first, second, speeds)


def composite_roughness(
    section: SurfaceSection, grid: Grid, folder: Path, speeds: tuple[float, float]
) -> tuple[Surface, tuple[str, ...]]:
    """Return the composite roughness of both bodies on the grid, and its processing steps."""
    if section.second is None:
        return section.build(grid, folder)
    (first, done), (second, done_to_second) = _bodies(section, grid, folder)
    combined = CompositeSurface(first, second, speeds).surface
    return combined, (
        *(f"{section.name}: {step}" for step in done),
        *(f"{section.second.name}: {step}" for step in done_to_second),
        f"The composite roughness adds {section.name} (moving at {speeds[0]:.4g} m/s) and "
        f"{section.second.name} ({speeds[1]:.4g} m/s), the second face down; its Sq is "
        f"{length_text(combined.sq)}.",
    )


def _bodies(
    section: SurfaceSection, grid: Grid, folder: Path
) -> list[tuple[Surface, tuple[str, ...]]]:
    """Return both bodies' surfaces; the second's random stream depends on the first's seed, too."""
    drawn = int(getattr(section, "seed", 0) or getattr(section, "place", 0) or 0)
    return [section.build(grid, folder), section.second.build(grid, folder, 2, drawn)]


def moving_roughness(
    section: SurfaceSection,
    rough: RoughBody,
    track: Grid,
    folder: Path,
    speeds: tuple[float, float],
    grid: Grid,
) -> MovingSurfaces:
    """Return both bodies' roughness on their tracks, and the contact's `grid`.

    See `Case.moving_surfaces`.
    """
    apart = two_bodies(section, track, folder, speeds)
    if apart is not None:
        return MovingSurfaces(apart.first, apart.second, speeds, grid)
    if isinstance(section, FileSection):
        if rough == "both":
            raise BadInput(
                f'motion.rough = "both" needs two surfaces, got {section.file} only; state the '
                'other as surface.second, or set contact.roughness = "standing"'
            )
        surface = section.prepare(track, folder).surface
    else:
        assert isinstance(section, GeneratedSection)
        surface = section.generate(track)
        if rough == "both":
            samples = (surface, section.generate(track, 2))
            first, second = (Surface(sample.heights / math.sqrt(2.0), track) for sample in samples)
            return MovingSurfaces(first, second, speeds, grid)
    return MovingSurfaces.one_rough(surface, speeds, grid, first=rough == "first")
