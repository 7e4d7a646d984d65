"""A case: the contact that a case file states, as the objects that the solvers take.

`asperity.results` solves cases.
"""

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from functools import cached_property, partial
from pathlib import Path

from asperity.case.lubricant import SheetSection
from asperity.case.messages import parse_section
from asperity.case.roughness_scale import texture_of
from asperity.case.sections import CaseFile, MotionSection, require_beyond_contact
from asperity.case.surfaces import FileSection, composite_roughness, moving_roughness, two_bodies
from asperity.case.text import parse_toml, read_text, replaced, restated
from asperity.case.units import numbers_in_si, plain
from asperity.case.vibration import vibration_model
from asperity.contact.conditions import ContactConditions, ElasticPair
from asperity.contact.grid import Grid
from asperity.core.displayed import Brief
from asperity.core.errors import BadInput, UnreadableFile
from asperity.core.limits import require_affordable
from asperity.coupling import VibrationModel
from asperity.ehl import ACCURACY, MOST_RUNNING_CELLS, Options, auto_grid, running_cells
from asperity.lubricant import Lubricant, OilFact, OilSheet, Thermal
from asperity.solution import Sensing, inlet_notes, plausibility_notes
from asperity.structure import NamedStructure, load_structure
from asperity.surface import CompositeSurface, MovingSurfaces, Surface, track_grid
from asperity.wear import WearModel

# default number of surfaces per solution on coarse and on fine grids, to limit computing time
DEFAULT_SURFACES, DEFAULT_SURFACES_FINE = 5, 3
# above it, roughness moves more than two cells relative to the oil in a one-cell time step
MOST_RUNNING_SLIP = 4.0
MANY_RUNNING_CELLS = 1200  # of the fine grid in studies, machines and friction curves
DEFAULT_TRACKS = 1  # of a running contact; a generated track holds several contacts
DEFAULT_TRACKS_MEASURED = 3
MOST_SURFACES = 1000  # a prediction interval hardly narrows beyond a few dozen
FINE_GRID = 256 * 256  # cells above which a grid counts as fine
CHECKED = {  # parts that are checked when a case is loaded, and their names in messages
    **{"conditions": "contact and material", "options": "solver", "lubricant": "lubricant"},
    **{key: key for key in ("grid", "thermal", "sensing", "structure", "vibration", "wear")},
}
CELL_BYTES, CELL_S = 800.0, 1e-4  # cost of a cell while a contact is solved


@dataclass(frozen=True, repr=False)
class Case(Brief):
    """Contact to solve, as its case file states it; created by `load_case`.

    `contents` are the file's tables, `folder` is the base of surface files, `source` the name of
    the case in messages, `stored` the roughness of the run that the case came from.
    """

    contents: CaseFile
    folder: Path = field(compare=False, repr=False)
    source: str = field(compare=False)
    stored: Surface | None = field(default=None, compare=False, repr=False)
    stored_notes: tuple[str, ...] = field(
        default=(), compare=False, repr=False
    )  # processing steps of `stored`

    def __post_init__(self) -> None:
        # report errors now rather than after a long computation
        for name, part in CHECKED.items():
            if name == "structure" and self.stored is not None:
                continue  # of a saved run, which does not need it
            if name == "grid" and self._is_measured and self.contents.grid.chosen:
                continue  # would need its file
            with self.naming(part):
                getattr(self, name)

    # the sections of laws are created at run time, which pickle cannot import
    def __reduce__(self) -> tuple[object, ...]:
        loader = partial(load_case, folder=self.folder, name=self.source, stored=self.stored)
        return loader, (self.text,), {"stored_notes": self.stored_notes}

    @contextmanager
    def naming(self, part: str) -> Iterator[None]:
        """Prefix errors inside with the case and its part."""
        try:
            yield
        except BadInput as error:
            named = str(error).startswith(f"{self.source}: ")  # by a part inside this one
            raise type(error)(str(error) if named else f"{self.source}: {part}: {error}") from None

    @cached_property
    def conditions(self) -> ContactConditions:
        """Bodies, load and motion."""
        contact = self.contents.contact
        material = self.contents.material
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
        """Lubricant; None for a dry contact."""
        section = self.contents.lubricant
        return None if section is None else section.lubricant()

    @property
    def _sheet(self) -> SheetSection | None:
        section = self.contents.lubricant
        return section if isinstance(section, SheetSection) else None

    @property
    def oil_sheet(self) -> OilSheet | None:
        """Data sheet of the oil, valid at any temperature; None for an oil by laws, or none."""
        return None if self._sheet is None else self._sheet.sheet

    @property
    def oil_facts(self) -> tuple[OilFact, ...]:
        """Stated and estimated numbers of an oil's data sheet; empty for an oil by laws."""
        return () if self._sheet is None else self._sheet.facts()

    @property
    def boundary_friction(self) -> float:
        """Shear stress over pressure where the bodies touch."""
        return float(self.contents.material.boundary_friction)

    @cached_property
    def thermal(self) -> Thermal:
        """Thermal model of the bodies and the oil."""
        return self.contents.thermal.thermal(None if self._sheet is None else self._sheet.supply())

    @cached_property
    def sensing(self) -> Sensing:
        """Electrical and acoustic properties."""
        section = self.contents.sensing
        return Sensing() if section is None else section.sensing()

    @cached_property
    def structure(self) -> NamedStructure | None:
        """Machine structure around the contact; None for the mass of [vibration] alone."""
        stated = self.contents.structure
        return None if stated is None else load_structure(stated, folder=self.folder)

    @cached_property
    def grid(self) -> Grid:
        """Computing grid [m]; `auto_grid` chooses what the case omits.

        Half-widths are converted to metres, also along the length of a line contact. Stored
        roughness brings its own grid.
        """
        section = self.contents.grid
        conditions = self.conditions
        line = conditions.endless
        (a, b) = conditions.hertz.half_widths
        if section.chosen and self.stored is not None:
            return self.stored.grid
        x, y = (
            None if limits is None else (limits[0] * half, limits[1] * half)
            for limits, half in (
                (section.x, a),
                (section.y, a if line else b),
            )  # y of a line contact is in half-widths a too
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
        require_beyond_contact("x", section.x, "-4.5 to 1.9")
        if not line:
            require_beyond_contact("y", section.y, "-3 to 3")
        _require_affordable(grid)
        return grid

    @cached_property
    def options(self) -> Options:
        """Solver options."""
        return self.contents.options()

    @cached_property
    def vibration(self) -> VibrationModel | None:
        """Vibration model; None if the case has no [vibration]."""
        return vibration_model(self.contents.vibration)

    @cached_property
    def wear(self) -> WearModel | None:
        """Wear model; None if the case has no [wear]."""
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
        """Return two measured surfaces with their speeds; None without a second one."""
        with self.naming("surface"):
            return two_bodies(
                self.contents.surface, self.grid, self.folder, self.conditions.surface_speeds
            )

    @property
    def motion(self) -> MotionSection:
        """Motion of the roughness."""
        return self.contents.motion or MotionSection()

    @property
    def roughness_moves(self) -> bool:
        """True if a rough body moves through a lubricated contact."""
        if self.lubricant is None:
            return False
        first, second = (speed != 0.0 for speed in self.conditions.surface_speeds)
        if len(self.contents.surface.parts) > 1:
            moves = first or second
        else:
            moves = {"first": first, "second": second, "both": first or second}[self.motion.rough]
        return moves and self.surface().sq > 0.0

    @property
    def is_running(self) -> bool:
        """True if roughness moves and the solution is the mean over time of the running contact.

        Otherwise it is that of standing roughness: `contact.roughness = "standing"`, thermal
        feedback, roughness that is stored, a slide-to-roll ratio above `MOST_RUNNING_SLIP`, whose
        motion the time steps do not resolve, and contacts without moving roughness.
        """
        return (
            self.contents.contact.roughness == "running"
            and self.stored is None
            and not self.thermal.feedback
            and abs(self.conditions.slide_to_roll) <= MOST_RUNNING_SLIP
            and self.roughness_moves
        )

    @property
    def among_many(self) -> "Case":
        """The case with fewer cells of a running contact, unless it states cells or an accuracy."""
        if self.contents.solver.running_cells or self.contents.grid.accuracy:
            return self
        return self.with_written({"solver.running_cells": MANY_RUNNING_CELLS})

    def running_cells(self) -> tuple[int, int]:
        """Return the cells of the running contact's fine grid, at most those of `grid`."""
        texture = texture_of(self.contents.surface, self.folder)
        assert texture is not None
        share = ACCURACY / (self.contents.grid.accuracy or ACCURACY)
        most = self.contents.solver.running_cells or round(MOST_RUNNING_CELLS * share)
        return running_cells(self.conditions, self.grid, texture.lengths, most)

    @property
    def solved_cells(self) -> tuple[int, int]:
        """Cells of the finest grid on which the contact is solved."""
        return self.running_cells() if self.is_running else self.grid.cells

    def moving_surfaces(self, lengths: int = 1) -> MovingSurfaces:
        """Return both bodies' roughness on tracks that repeat along rolling, each at its own speed.

        A track has `motion.track` lengths of the domain, of generated roughness at least `lengths`.

        Roughness that is generated, or measured on one surface only, is on the body that
        `motion.rough` names; "both" bodies have independent samples of Sq/√2 each, the first with
        the case's seed. Two measured surfaces are on one body each. The ends of a measured surface
        are joined. Raises BadInput for one measured surface on both bodies, a track that it does
        not cover, or the roughness of a run, which does not extend along the track.
        """
        section = self.contents.surface
        rough = self.motion.rough
        speeds = self.conditions.surface_speeds
        track = track_grid(self.grid, max(self.motion.track, 1 if self._is_measured else lengths))
        _require_affordable(track)
        with self.naming("surface"):
            if self.stored is not None:
                raise BadInput(
                    "comes from a run, which stores the contact's part only; use the case file"
                )
            return moving_roughness(section, rough, track, self.folder, speeds, self.grid)

    def surface(self) -> Surface:
        """Return the composite roughness on the grid: generated, measured, or stored in the run.

        Raises BadInput for a surface that the grid cannot represent or a measurement that does not
        cover the contact, UnreadableFile for a surface file that cannot be read.
        """
        with self.naming("surface"):
            return self._roughness[0]

    def surface_count(self, count: int | None = None) -> int:
        """Return the number of surfaces to solve: `count`, that of [solver], or the default.

        One where all surfaces of the case are identical. A measured map contains few that do not
        overlap, a run only its own: BadInput if more are requested.
        """
        with self.naming("surface"):
            requested = self.contents.solver.surfaces if count is None else count
            number = requested or self._default_surfaces
            if not 1 <= number <= MOST_SURFACES:
                raise BadInput(
                    f"surfaces must be 1 to {MOST_SURFACES}, got {number}; use asperity study for "
                    "more"
                )
            if number == 1 or self.surface().sq == 0.0:
                return 1
            try:
                available = self.contents.surface.available(self.grid, self.folder)
            except UnreadableFile:
                if self.stored is None or requested:
                    raise
                # a run stores its surface; the measurement may be missing
                available = 1
            if available == 1 and all(
                part.is_fixed for part in self.contents.surface.parts.values()
            ):
                return 1
            if available is not None and requested and requested > available:
                raise BadInput(
                    f"the measured map holds {available} non-overlapping contacts, got {requested} "
                    "surfaces to solve; solve fewer, or measure a larger map"
                )
            return number if available is None else min(number, available)

    @property
    def _is_measured(self) -> bool:
        return any(isinstance(p, FileSection) for p in self.contents.surface.parts.values())

    @property
    def _default_surfaces(self) -> int:
        if self.is_running:
            return DEFAULT_TRACKS_MEASURED if self._is_measured else DEFAULT_TRACKS
        nx, ny = self.grid.cells
        return DEFAULT_SURFACES if nx * ny <= FINE_GRID else DEFAULT_SURFACES_FINE

    def on_surface(self, number: int) -> "Case":
        """Return the case on another surface: a later seed or map position; 0 is its own."""
        overrides = self.contents.surface.variant_overrides(number)
        return self.with_written(overrides) if number else self

    @property
    def surface_notes(self) -> tuple[str, ...]:
        """Processing of a measured surface, and deviations of a generated one from its request."""
        self.surface()
        return self._roughness[1]

    @property
    def notes(self) -> tuple[str, ...]:
        """Notes on the case for a reader of the results, one sentence each."""
        conditions = self.conditions
        oil = self.lubricant
        of_oil = () if self._sheet is None else self._sheet.notes()
        return (
            *of_oil,
            *plausibility_notes(conditions, oil, self.options.inlet_layer),
            *inlet_notes(conditions, oil, self.grid, rough=self.surface().sq > 0.0),
        )

    @property
    def text(self) -> str:
        """The case as TOML, every default written out; loads to an equal case."""
        return restated(self.contents)

    def with_overrides(self, overrides: Mapping[str, object]) -> "Case":
        """Return the case with values replaced, such as `{"contact.load": "400 N"}`.

        Numbers are in SI: `{"contact.load": 400.0}`; those in text need their unit. Text is parsed
        as a TOML value if possible, and used as it is otherwise. Stored roughness is kept as long
        as neither the surface nor the grid changes. `vibration.preset` replaces all values that
        presets determine. Raises BadInput as for a case file.
        """
        return self.with_written(numbers_in_si(overrides))

    def with_written(self, overrides: Mapping[str, object]) -> "Case":
        """Return the case with values replaced as in a file, where a quantity has its unit."""
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
    folder : base of surface files; by default that of the case file, or the current one
    name : name of the case in messages; by default the path
    stored : roughness to use in place of the case's own, from a run

    Raises
    ------
    UnreadableFile
        if the file is missing or not TOML.
    BadInput
        for an invalid key, law, unit or value, in one sentence that names it.

    Examples
    --------
    >>> from asperity.case import case_template, load_case
    >>> case = load_case(case_template("line"))
    >>> f"{case.conditions.load:.0f} N, {case.conditions.entrainment_speed} m/s"
    '1000 N, 1.0 m/s'
    """
    if isinstance(source, str) and "\n" in source:
        text, name, folder = source, name or "case", folder or Path()
    else:
        path = Path(source)
        text, name, folder = read_text(path), name or str(path), folder or path.parent
    tables = parse_toml(text, name)
    if "machine" in tables:
        raise BadInput(
            f"{name}: has a [machine] with several contacts; solve them with asperity machine"
        )
    return Case(parse_section(CaseFile, tables, name), folder, name, stored)
