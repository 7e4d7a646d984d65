"""[surface] of a case file: roughness made from numbers or read from a file, at rest on the grid and on moving tracks.

A section of generated roughness says itself how its surface is made; `GENERATED_SECTIONS` lists them by `kind`.
"""

import math
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any, Literal, get_args

import numpy as np
from pydantic import Strict

from asperity.case.amounts import OPTIONAL, PAIRED, Length, Number, Seed
from asperity.case.refusals import Section, choose, validated
from asperity.errors import BadInput
from asperity.grid import Grid
from asperity.surface import (
    CompositeSurface,
    Fit,
    Form,
    MovingSurfaces,
    Outliers,
    PreparedSurface,
    Surface,
    area_text,
    correlation_lengths,
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

SAMPLE_DEVIATION = 0.05  # of a generated surface's correlation lengths, beyond which the notes say so

RoughBody = Literal["first", "second", "both"]


class SurfaceSection(Section):
    """[surface]."""


class GeneratedSection(SurfaceSection):
    """Roughness made from numbers; a field `seed` draws it where chance is involved."""

    def make(self, grid: Grid, rng: np.random.Generator) -> Surface:
        """The surface on a grid."""
        raise NotImplementedError

    def notes(self, surface: Surface) -> tuple[str, ...]:  # noqa: ARG002
        """Where a surface made so strays from what the section states."""
        return ()

    def draw(self, grid: Grid, *stream: int) -> Surface:
        """The surface of the section's seed; another `stream` of it is an independent one."""
        seed: int = getattr(self, "seed", 0)
        return self.make(grid, np.random.default_rng([seed, *stream] if stream else seed))


class GaussianSection(GeneratedSection):
    """[surface] kind = "gaussian"."""

    kind: Literal["gaussian"]
    sq: Length
    correlation_length: Annotated[tuple[Length, Length], PAIRED]
    direction_deg: Number = 0.0  # of the first correlation length, from x towards y
    seed: Seed = 0

    def make(self, grid: Grid, rng: np.random.Generator) -> Surface:
        """Filtered noise."""
        return gaussian_surface(grid, **_filter(self), rng=rng)

    def notes(self, surface: Surface) -> tuple[str, ...]:
        """How far the sample's correlation lengths stray."""
        return _sample_notes(self, surface)


class NonGaussianSection(GeneratedSection):
    """[surface] kind = "non-gaussian"."""

    kind: Literal["non-gaussian"]
    sq: Length
    skewness: Number
    kurtosis: Number
    correlation_length: Annotated[tuple[Length, Length], PAIRED]
    direction_deg: Number = 0.0
    seed: Seed = 0

    def make(self, grid: Grid, rng: np.random.Generator) -> Surface:
        """Filtered noise of these moments."""
        return non_gaussian_surface(grid, skewness=self.skewness, kurtosis=self.kurtosis, **_filter(self), rng=rng)

    def notes(self, surface: Surface) -> tuple[str, ...]:
        """How far the sample's correlation lengths stray."""
        return _sample_notes(self, surface)


class SelfAffineSection(GeneratedSection):
    """[surface] kind = "self-affine"."""

    kind: Literal["self-affine"]
    sq: Length
    hurst: Number
    cutoffs: tuple[Length, Length]  # shortest and longest wavelength
    seed: Seed = 0

    def make(self, grid: Grid, rng: np.random.Generator) -> Surface:
        """Noise with a power law for a spectrum."""
        shortest, longest = self.cutoffs
        cutoffs = (float(shortest), float(longest))
        return self_affine_surface(grid, sq=float(self.sq), hurst=self.hurst, cutoffs=cutoffs, rng=rng)


class GroundSection(GeneratedSection):
    """[surface] kind = "ground"."""

    kind: Literal["ground"]
    sq: Length
    groove_width: Length
    groove_length: Length
    direction_deg: Number = 0.0  # of the lay, from x towards y
    seed: Seed = 0

    def make(self, grid: Grid, rng: np.random.Generator) -> Surface:
        """Grooves of grains."""
        return ground_surface(
            grid,
            sq=float(self.sq),
            groove_width=float(self.groove_width),
            groove_length=float(self.groove_length),
            direction=math.radians(self.direction_deg),
            rng=rng,
        )


class SandblastedSection(GeneratedSection):
    """[surface] kind = "sandblasted"."""

    kind: Literal["sandblasted"]
    sq: Length
    crater_radius: Length
    seed: Seed = 0

    def make(self, grid: Grid, rng: np.random.Generator) -> Surface:
        """Craters."""
        return sandblasted_surface(grid, sq=float(self.sq), crater_radius=float(self.crater_radius), rng=rng)


class RunInSection(GeneratedSection):
    """[surface] kind = "run-in"."""

    kind: Literal["run-in"]
    sq: Length
    correlation_length: Annotated[tuple[Length, Length], PAIRED]
    plateau_share: Number
    plateau_roughness: Number = 0.1  # Sq of the plateau over that of the surface before it was worn
    direction_deg: Number = 0.0
    seed: Seed = 0

    def make(self, grid: Grid, rng: np.random.Generator) -> Surface:
        """Filtered noise with its peaks worn to a plateau."""
        share, roughness = self.plateau_share, self.plateau_roughness
        return run_in_surface(grid, plateau_share=share, plateau_roughness=roughness, **_filter(self), rng=rng)


class FlatSection(GeneratedSection):
    """[surface] kind = "flat", or surface = "flat"."""

    kind: Literal["flat"]

    def make(self, grid: Grid, rng: np.random.Generator) -> Surface:  # noqa: ARG002
        """No roughness."""
        return flat_surface(grid)


GENERATED_SECTIONS: dict[str, type[GeneratedSection]] = {
    get_args(section.model_fields["kind"].annotation)[0]: section
    for section in (
        GaussianSection,
        NonGaussianSection,
        SelfAffineSection,
        GroundSection,
        SandblastedSection,
        RunInSection,
        FlatSection,
    )
}


def _filter(section: GaussianSection | NonGaussianSection | RunInSection) -> dict[str, Any]:
    lx, ly = section.correlation_length
    return {
        "sq": float(section.sq),
        "correlation_length": (float(lx), float(ly)),
        "direction": math.radians(section.direction_deg),
    }


def _sample_notes(section: GaussianSection | NonGaussianSection, surface: Surface) -> tuple[str, ...]:
    stated = _filter(section)["correlation_length"]
    lengths = correlation_lengths(surface, math.radians(section.direction_deg))
    if all(abs(sample / mean - 1.0) <= SAMPLE_DEVIATION for sample, mean in zip(lengths, stated, strict=True)):
        return ()
    return (
        f"This sample's autocorrelation falls to 1/e over {area_text(lengths)}, where {area_text(stated)} "
        "was asked for: the domain holds few correlation lengths, so seeds scatter.",
    )


class FileSection(SurfaceSection):
    """A measured surface and what is done to it."""

    file: str
    sq: Annotated[Length | None, OPTIONAL] = None  # scale to this; left out: as measured
    form: Form = "quadratic"
    fit: Fit = "crop"
    turn: Annotated[bool, Strict()] = False  # by a quarter turn: what the file has along x runs along y
    outliers: Outliers = "keep"
    s_filter: Annotated[Length | None, OPTIONAL] = None
    l_filter: Annotated[Length | None, OPTIONAL] = None
    unit: str | None = None  # of the heights, where the file does not say
    lateral_unit: str | None = None
    pixel: Annotated[tuple[Length, Length], PAIRED] | None = None  # of a matrix of bare heights

    def prepare(self, grid: Grid, folder: Path) -> PreparedSurface:
        """The file's map on a grid; `folder` is where the file is looked for."""
        pixel = None if self.pixel is None else (float(self.pixel[0]), float(self.pixel[1]))
        measured = read_surface(folder / self.file, unit=self.unit, lateral_unit=self.lateral_unit, pixel=pixel)
        prepared = prepare_surface(
            measured,
            grid,
            sq=_metres(self.sq),
            form=self.form,
            fit=self.fit,
            turn=self.turn,
            outliers=self.outliers,
            s_filter=_metres(self.s_filter),
            l_filter=_metres(self.l_filter),
        )
        return replace(prepared, steps=(*measured.notes, *prepared.steps))


class MeasuredSection(FileSection):
    """[surface] file = "..."."""

    second: FileSection | None = None  # on the other body; the composite of both is solved


def parse_surface(value: object) -> SurfaceSection:
    """The section of a generated surface by its kind, or that of a measured one."""
    if isinstance(value, Mapping) and "file" in value:
        if "kind" in value:
            raise BadInput("has both kind and file; keep kind for a generated surface or file for a measured one")
        return validated(MeasuredSection, value)
    if isinstance(value, Mapping) and "kind" not in value:
        raise BadInput(f"must hold kind (one of {', '.join(GENERATED_SECTIONS)}) or file (a measured surface)")
    return choose("kind", lambda: GENERATED_SECTIONS, value)


def _metres(length: float | None) -> float | None:
    return None if length is None else float(length)


def two_bodies(
    section: SurfaceSection, grid: Grid, folder: Path, speeds: tuple[float, float]
) -> CompositeSurface | None:
    """Two measured surfaces apart, each with its speed [m/s]; None where the section has no second one."""
    if not (isinstance(section, MeasuredSection) and section.second is not None):
        return None
    first, second = section.prepare(grid, folder), section.second.prepare(grid, folder)
    return CompositeSurface(first.surface, second.surface, speeds)


def composite_roughness(
    section: SurfaceSection, grid: Grid, folder: Path, speeds: tuple[float, float]
) -> tuple[Surface, tuple[str, ...]]:
    """The roughness of both bodies together on the grid, and what was done to get it, a sentence each."""
    if isinstance(section, GeneratedSection):
        surface = section.draw(grid)
        return surface, section.notes(surface)
    assert isinstance(section, FileSection)
    first = section.prepare(grid, folder)
    if not (isinstance(section, MeasuredSection) and section.second is not None):
        return first.surface, first.steps
    second = section.second.prepare(grid, folder)
    combined = CompositeSurface(first.surface, second.surface, speeds).surface
    return combined, (
        *(f"{section.file}: {step}" for step in first.steps),
        *(f"{section.second.file}: {step}" for step in second.steps),
        f"added {section.file} (moving at {speeds[0]:.4g} m/s) and {section.second.file} ({speeds[1]:.4g} m/s), "
        f"the second face down; Sq {length_text(combined.sq)} together",
    )


def moving_roughness(
    section: SurfaceSection, rough: RoughBody, track: Grid, folder: Path, speeds: tuple[float, float], grid: Grid
) -> MovingSurfaces:
    """The roughness of both bodies on their tracks, seen through the contact's `grid`; see `Case.moving_surfaces`."""
    apart = two_bodies(section, track, folder, speeds)
    if apart is not None:
        return MovingSurfaces(apart.first, apart.second, speeds, grid)
    if isinstance(section, FileSection):
        if rough == "both":
            raise BadInput(f"{section.file} is one surface and motion.rough asks for two; name the other as second")
        surface = section.prepare(track, folder).surface
    else:
        assert isinstance(section, GeneratedSection)
        surface = section.draw(track)
        if rough == "both":
            samples = (surface, section.draw(track, 2))
            first, second = (Surface(sample.heights / math.sqrt(2.0), track) for sample in samples)
            return MovingSurfaces(first, second, speeds, grid)
    return MovingSurfaces.one_rough(surface, speeds, grid, first=rough == "first")
