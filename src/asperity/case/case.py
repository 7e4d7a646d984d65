"""A case: the contact that a case file states, turned into the objects that the solvers take.

Solving a case is left to `asperity.results`.
"""

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from functools import cached_property, partial
from pathlib import Path
from typing import Any

from asperity.case.lubricant import SheetSection
from asperity.case.messages import parse_section
from asperity.case.roughness_scale import texture_of
from asperity.case.sections import CaseFile, MotionSection
from asperity.case.surfaces import FileSection, composite_roughness, moving_roughness, two_bodies
from asperity.case.text import parse_toml, read_text, replaced, restated
from asperity.case.units import plain
from asperity.case.vibration import vibration_model
from asperity.contact.conditions import ContactConditions, ElasticPair
from asperity.contact.grid import Grid
from asperity.core.errors import BadInput, UnreadableFile
from asperity.core.limits import require_affordable
from asperity.coupling import VibrationModel
from asperity.ehl import ACCURACY, Options, auto_grid
from asperity.lubricant import Lubricant, OilFact, OilSheet, Thermal
from asperity.solution import inlet_notes, plausibility_notes
from asperity.surface import CompositeSurface, MovingSurfaces, Surface, track_grid
from asperity.wear import WearModel

# surfaces that a solution is the mean of, unless the case says: the wait is for as many solutions
MANY_SURFACES, FEW_SURFACES = 5, 3
MOST_SURFACES = 1000  # an interval of one further surface hardly narrows beyond a few dozen
FINE_GRID = 256 * 256  # cells above which there are few
CELL_BYTES, CELL_S = 800.0, 1e-4  # what a cell takes of memory and time while a contact is solved


@dataclass(frozen=True)
class Case:
    """A contact to solve, as its case file states it. Made by `load_case`.

    `contents` are the file's tables, `folder` is where a surface file is looked for, `source` what
    messages call the case, `stored` the roughness of the run that the case came from.
    """

    contents: CaseFile
    folder: Path = field(compare=False, repr=False)
    source: str = field(compare=False)
    stored: Surface | None = field(default=None, compare=False, repr=False)
    stored_notes: tuple[str, ...] = field(
        default=(), compare=False, repr=False
    )  # what was done to make `stored`

    def __post_init__(self) -> None:
        # refuse now what would else be refused later, perhaps after a long wait
        measured = any(
            isinstance(part, FileSection) for part in self.contents.surface.parts.values()
        )  # a grid chosen by it asks for the file
        for name in ("conditions", "lubricant", "grid", "options", "thermal", "vibration", "wear"):
            if name == "grid" and measured and self.contents.grid.chosen:
                continue
            with self.naming(
                {"conditions": "contact and material", "options": "solver"}.get(name, name)
            ):
                getattr(self, name)

    def __reduce__(
        self,
    ) -> tuple[Any, ...]:  # the sections of laws are made at run time, which pickle cannot follow
        again = partial(load_case, folder=self.folder, name=self.source, stored=self.stored)
        return again, (self.text,), {"stored_notes": self.stored_notes}

    @contextmanager
    def naming(self, part: str) -> Iterator[None]:
        """Let what is refused inside say which case and which part of it is meant."""
        try:
            yield
        except BadInput as error:
            named = str(error).startswith(f"{self.source}: ")  # by a part inside this one
            raise type(error)(str(error) if named else f"{self.source}: {part}: {error}") from None

    @cached_property
    def conditions(self) -> ContactConditions:
        """Bodies, load and motion."""
        contact, material = self.contents.contact, self.contents.material
        speed = plain(contact.entrainment_speed)
        pair = ElasticPair(plain(material.youngs_modulus), material.poisson_ratio)
        shape = None
        if contact.shape is not None and contact.length is not None:
            radius = contact.radius[0] if isinstance(contact.radius, tuple) else contact.radius
            shape = contact.shape.shape(plain(contact.length), plain(radius), pair)
        return ContactConditions(
            pair=pair,
            geometry=contact.geometry,
            radius=plain(contact.radius),
            length=plain(contact.length),
            shape=shape,
            load=plain(contact.load),
            surface_speeds=(speed * (1.0 + contact.slip / 2.0), speed * (1.0 - contact.slip / 2.0)),
            hardness=plain(material.hardness),
        )

    @cached_property
    def lubricant(self) -> Lubricant | None:
        """The oil, None for a dry contact."""
        section = self.contents.lubricant
        return None if section is None else section.lubricant()

    @property
    def _sheet(self) -> SheetSection | None:
        section = self.contents.lubricant
        return section if isinstance(section, SheetSection) else None

    @property
    def oil_sheet(self) -> OilSheet | None:
        """The oil's data sheet, which tells it at any temperature; None for one by laws, or none."""
        return None if self._sheet is None else self._sheet.sheet

    @property
    def oil_facts(self) -> tuple[OilFact, ...]:
        """What was given and what was estimated of an oil by its data sheet; of one by laws there is nothing to say."""
        return () if self._sheet is None else self._sheet.facts()

    @property
    def boundary_friction(self) -> float:
        """Shear stress over pressure where the bodies touch."""
        return float(self.contents.material.boundary_friction)

    @cached_property
    def thermal(self) -> Thermal:
        """What takes up the heat of sliding."""
        return self.contents.thermal.thermal(None if self._sheet is None else self._sheet.supply())

    @cached_property
    def grid(self) -> Grid:
        """The rectangle to compute on; half-widths turned into metres, along a line contact's length too.

        What the case leaves out of it is chosen (`auto_grid`); roughness kept in a run brings its
        own.
        """
        section, conditions = self.contents.grid, self.conditions
        line, (a, b) = conditions.endless, conditions.hertz.half_widths
        if section.chosen and self.stored is not None:
            return self.stored.grid
        x, y = (
            None if ends is None else (ends[0] * half, ends[1] * half)
            for ends, half in (
                (section.x, a),
                (section.y, a if line else b),
            )  # y runs along a line: in a too
        )
        if section.cells != "auto" and x is not None and y is not None:
            grid = Grid(section.cells, (x[0], y[0]), (x[1], y[1]), periodic=(False, line))
        else:
            grid = auto_grid(
                conditions,
                self.lubricant,
                texture_of(self.contents.surface, self.folder),
                accuracy=section.accuracy or ACCURACY,
                x=x,
                y=y,
                cells=None if section.cells == "auto" else section.cells,
            )
        for axis, ends in [("x", section.x)] if line else [("x", section.x), ("y", section.y)]:
            if ends is not None and not (ends[0] < -1.0 and ends[1] > 1.0):
                raise BadInput(
                    f"{axis} must reach beyond the contact on both sides, got {ends[0]:g} to {ends[1]:g} half-widths; "
                    f"use {'-4.5 to 1.9' if axis == 'x' else '-3 to 3'}, or leave it out"
                )
        _require_affordable(grid)
        return grid

    @cached_property
    def options(self) -> Options:
        """How hard to solve."""
        solver = {
            name: plain(value)
            for name, value in self.contents.solver
            if name not in ("surfaces", "dynamic")
        }
        return Options(model=self.contents.model, **solver)

    @cached_property
    def vibration(self) -> VibrationModel | None:
        """The vibration model; None when the case has no [vibration]."""
        return vibration_model(self.contents.vibration)

    @cached_property
    def wear(self) -> WearModel | None:
        """How the contact wears; None when the case has no [wear]."""
        section = self.contents.wear
        return None if section is None else section.model(self.conditions, self.boundary_friction)

    @cached_property
    def _roughness(self) -> tuple[Surface, tuple[str, ...]]:
        if self.stored is not None:
            return self.stored, self.stored_notes
        return composite_roughness(
            self.contents.surface, self.grid, self.folder, self.conditions.surface_speeds
        )

    def composite(self) -> CompositeSurface | None:
        """Two measured surfaces apart, each with its speed; None when the case has no second one."""
        with self.naming("surface"):
            return two_bodies(
                self.contents.surface, self.grid, self.folder, self.conditions.surface_speeds
            )

    @property
    def motion(self) -> MotionSection:
        """How the roughness moves, where it is let."""
        return self.contents.motion or MotionSection()

    def moving_surfaces(self) -> MovingSurfaces:
        """Both bodies' roughness on tracks that repeat along rolling, each at its own speed.

        Roughness that is generated, or measured on one surface only, lies on the body that
        `motion.rough` names; "both" bodies carry independent samples of Sq/√2 each, of which the
        first has the case's seed. Two measured surfaces lie on one body each. A measured surface's
        ends are joined. Raises BadInput for one measured surface that shall be on both bodies, a
        track that it does not cover, or roughness kept in a run, which is on neither track.
        """
        section, rough, speeds = (
            self.contents.surface,
            self.motion.rough,
            self.conditions.surface_speeds,
        )
        track = track_grid(self.grid, self.motion.track)
        _require_affordable(track)
        with self.naming("surface"):
            if self.stored is not None:
                raise BadInput(
                    "is kept in a run, and what it had beside the contact is not; let the case file move"
                )
            return moving_roughness(section, rough, track, self.folder, speeds, self.grid)

    def surface(self) -> Surface:
        """The composite roughness on the grid: generated, read and prepared, or as stored in the run.

        Raises BadInput for a surface that the grid cannot carry or a measurement that does not
        cover the contact, UnreadableFile for a surface file that cannot be read.
        """
        with self.naming("surface"):
            return self._roughness[0]

    def surface_count(self, asked: int | None = None) -> int:
        """How many surfaces to solve, where so many are `asked` for, or else as many as [solver] or the wait allows.

        One where all surfaces of the case are the same. A measured map holds few that do not
        overlap, a run only its own: BadInput where more are asked for.
        """
        with self.naming("surface"):
            stated = self.contents.solver.surfaces if asked is None else asked
            wanted = stated or (
                MANY_SURFACES
                if self.grid.cells[0] * self.grid.cells[1] <= FINE_GRID
                else FEW_SURFACES
            )
            if not 1 <= wanted <= MOST_SURFACES:
                raise BadInput(
                    f"surfaces must be 1 to {MOST_SURFACES}, got {wanted}; asperity study takes more"
                )
            if wanted == 1 or self.surface().sq == 0.0:
                return 1
            try:
                available = self.contents.surface.available(self.grid, self.folder)
            except UnreadableFile:
                if self.stored is None or stated:
                    raise
                # a run holds the surface that was solved, its measurement need not be at hand
                available = 1
            if available == 1 and all(part.fixed for part in self.contents.surface.parts.values()):
                return 1
            if available is not None and stated and stated > available:
                raise BadInput(
                    f"the measured map has room for {available} such contacts that do not overlap, got {stated} "
                    "surfaces to solve; ask for fewer, or measure more"
                )
            return wanted if available is None else min(wanted, available)

    def on_surface(self, number: int) -> "Case":
        """The case on another surface of its kind, with a later seed or at another place of the map; 0 is its own."""
        return self.with_overrides(self.contents.surface.another(number)) if number else self

    @property
    def surface_notes(self) -> tuple[str, ...]:
        """What was done to a measured surface, and where a generated one strays from what was asked for."""
        self.surface()
        return self._roughness[1]

    @property
    def notes(self) -> tuple[str, ...]:
        """What a reader of the results has to know about the case, a sentence each."""
        conditions, oil = self.conditions, self.lubricant
        of_oil = () if self._sheet is None else self._sheet.notes()
        return (
            *of_oil,
            *plausibility_notes(conditions, oil),
            *inlet_notes(conditions, oil, self.grid),
        )

    @property
    def text(self) -> str:
        """The case as TOML, every default written out; loads to an equal case."""
        return restated(self.contents)

    def with_overrides(self, overrides: Mapping[str, object]) -> "Case":
        """The case with values replaced, such as `{"contact.load": "400 N", "grid.cells": "[128, 128]"}`.

        Text is read as a TOML value where it is one and taken as it stands where not. Stored
        roughness is kept as long as neither the surface nor the grid changes. `vibration.preset`
        replaces all that presets choose. Raises BadInput for a key or value that the case file
        would be refused for.
        """
        tables = replaced(parse_toml(self.text, self.source), overrides, self.source)
        case = Case(parse_section(CaseFile, tables, self.source), self.folder, self.source)
        same = case.grid == self.grid and case.contents.surface == self.contents.surface
        return replace(case, stored=self.stored, stored_notes=self.stored_notes) if same else case


def _require_affordable(grid: Grid) -> None:
    nx, ny = grid.cells
    cells = float(nx) * float(ny)
    require_affordable(
        f"a grid of {nx:.10g} x {ny:.10g} cells", memory=CELL_BYTES * cells, seconds=CELL_S * cells
    )


def load_case(
    source: str | Path,
    *,
    folder: Path | None = None,
    name: str | None = None,
    stored: Surface | None = None,
) -> Case:
    """Read a case file, or its text (a `str` of more than one line).

    Parameters
    ----------
    source : path of a TOML file, or its text
    folder : where the case's surface file is looked for; by default beside the case file, or the current folder
    name : what messages call the case; by default the path
    stored : roughness to use in place of the case's own, as kept in a run

    Raises
    ------
    UnreadableFile
        if the file is missing or no TOML.
    BadInput
        for a key, law, unit or value that cannot be meant; one sentence that says which.
    """
    if isinstance(source, str) and "\n" in source:
        text, name, folder = source, name or "case", folder or Path()
    else:
        path = Path(source)
        text, name, folder = read_text(path), name or str(path), folder or path.parent
    tables = parse_toml(text, name)
    if "machine" in tables:
        raise BadInput(
            f"{name}: states a [machine], which has several contacts; asperity machine solves them all"
        )
    return Case(parse_section(CaseFile, tables, name), folder, name, stored)
