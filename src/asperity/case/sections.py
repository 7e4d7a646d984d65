"""Sections of a case file, in its order."""

from collections.abc import Mapping
from typing import Annotated, Any, Literal, Self

from pydantic import Field, PlainValidator, Strict, field_validator, model_validator

from asperity.case.cycle import CycleSection, parse_cycle
from asperity.case.infer import InferSection, parse_infer
from asperity.case.laws import LubricantSection, ThermalSection
from asperity.case.lubricant import SheetSection, parse_lubricant
from asperity.case.materials import MaterialSection, with_named_solids
from asperity.case.messages import LocatedError, Section, quoted
from asperity.case.roller_shape import ShapeSection
from asperity.case.sensing import SensingSection
from asperity.case.study import StudySection, parse_study
from asperity.case.surfaces import RoughBody, SurfaceSection, parse_surface
from asperity.case.units import (
    OPTIONAL,
    Amount,
    Count,
    Force,
    Length,
    Number,
    SpeedOrRest,
    amount_in,
    default_amount,
    parse_amount,
    plain,
)
from asperity.case.vibration import parse_vibration
from asperity.case.wear import WearSection
from asperity.contact.conditions import Geometry
from asperity.core.errors import BadInput
from asperity.ehl import MAX_CELLS_PER_TIME_STEP, ContactModel, InletLayer, Options, Start

MAX_FREQUENCIES = 200  # of the dynamic stiffness


def _parse_radius(value: object) -> Amount | tuple[Amount, Amount]:
    """Parse one radius, or [Rx, Ry] of an elliptic contact."""
    if not isinstance(value, list | tuple):
        return parse_amount("m", value)
    if len(value) != 2:
        raise BadInput(f"must be one length or a pair [Rx, Ry], got {len(value)} values")
    return parse_amount("m", value[0]), parse_amount("m", value[1])


class ContactSection(Section):
    """[contact]: geometry, load and motion."""

    geometry: Geometry
    radius: Annotated[float | tuple[float, float], PlainValidator(_parse_radius)]
    length: Annotated[Length | None, OPTIONAL] = None  # of a line contact or a roller
    shape: Annotated[ShapeSection | None, OPTIONAL] = None  # of a roller along its length
    load: Force
    entrainment_speed: SpeedOrRest  # 0 without a lubricant only
    slip: Number = 0.0  # slide-to-roll ratio (u1 - u2)/entrainment speed
    # mean over time of roughness that moves with its body, or a snapshot of roughness at rest
    roughness: Literal["running", "standing"] = "running"


def _parse_cells(value: object) -> Literal["auto"] | tuple[int, int]:
    """Parse [nx, ny], or "auto"."""
    if value == "auto":
        return "auto"
    if not isinstance(value, list | tuple) or len(value) != 2:
        raise BadInput(f'must be a list of two such as [256, 128], or "auto", got {quoted(value)}')
    for index, count in enumerate(value):
        if not isinstance(count, int) or isinstance(count, bool):
            raise LocatedError((index,), f"must be a whole number, got {quoted(count)}")
    return int(value[0]), int(value[1])


class GridSection(Section):
    """[grid]: cells, and corners in Hertz half-widths; omitted values are chosen."""

    cells: Annotated[Literal["auto"] | tuple[int, int], PlainValidator(_parse_cells)] = "auto"
    x: tuple[Number, Number] | None = None
    y: tuple[Number, Number] | None = None
    accuracy: Annotated[float | None, Strict(), Field(ge=1e-4, le=0.2)] = (
        None  # relative, of the film
    )

    @model_validator(mode="after")
    def _accuracy_has_a_choice(self) -> Self:
        if self.accuracy is not None and not self.chosen:
            raise BadInput(
                "accuracy determines a grid, but cells, x and y are all given; leave it out or set "
                'cells = "auto"'
            )
        return self

    @property
    def chosen(self) -> bool:
        """True if any part of the grid is chosen automatically."""
        return self.cells == "auto" or self.x is None or self.y is None


def require_beyond_contact(axis: str, limits: tuple[float, float] | None, usual: str) -> None:
    """Raise BadInput for the ends of an axis [half-widths] that lie inside the contact."""
    if limits is not None and not (limits[0] < -1.0 and limits[1] > 1.0):
        raise BadInput(
            f"{axis} must reach beyond the contact on both sides, got {limits[0]:g} to "
            f"{limits[1]:g} half-widths; use {usual}, or leave it out"
        )


class SolverSection(Section):
    """[solver]: numerical settings."""

    tolerance: Number = Options().tolerance
    max_iterations: Annotated[int, Strict()] = Options().max_iterations
    contact_film: Length = default_amount(Options().contact_film, "m")
    dynamic: Annotated[int, Strict()] = (
        0  # frequencies of the dynamic stiffness and damping; 0: none
    )
    # surfaces per solution, or tracks of a running contact; omitted: by the size of the grid, or
    # one track (three if measured)
    surfaces: Count | None = None
    running_cells: Count | None = None  # of a running contact; omitted: 3200 at accuracy 0.01

    @field_validator("dynamic")
    @classmethod
    def _check_dynamic(cls, count: int) -> int:
        if count and not 3 <= count <= MAX_FREQUENCIES:
            raise BadInput(
                f"must be 0, for no curve over frequency, or 3 to {MAX_FREQUENCIES}, got {count}"
            )
        return count


class InletSection(Section):
    """[inlet]: oil that enters the contact, and how a track is replenished between passes."""

    layer: Length  # on both bodies together, ahead of the contact
    passes: Count = 20  # of the contact over the track, in `asperity deplete`
    interval: Annotated[float | None, amount_in("s"), OPTIONAL] = None  # between two passes
    bleed: Annotated[float, amount_in("m", 0.0)] = default_amount(0.0, "m")  # oil added between
    surface_tension: Annotated[float, amount_in("N/m", 0.0)] = default_amount(0.03, "N/m")


class MotionSection(Section):
    """[motion]: motion of the roughness in `asperity run`."""

    steps: Count = 200
    time_step: Annotated[float, Strict(), Field(gt=0.0, le=MAX_CELLS_PER_TIME_STEP)] = (
        1.0  # cells that the oil travels per step
    )
    rough: RoughBody = "first"  # body with the generated surface; both: half of the variance each
    start: Start = "steady"
    track: Count = 1  # lengths of the domain after which a surface repeats
    flattening: Annotated[bool, Strict()] = False  # keep plastic flattening: running-in


class CaseFile(Section):
    """Whole case file. `lubricant = "none"` is a dry contact; omitting it is an error."""

    model: ContactModel = "mixed"
    contact: ContactSection
    material: MaterialSection
    lubricant: Annotated[LubricantSection | SheetSection | None, PlainValidator(parse_lubricant)]
    surface: Annotated[SurfaceSection, PlainValidator(parse_surface)]
    grid: GridSection = GridSection()
    inlet: Annotated[InletSection | None, OPTIONAL] = None
    solver: SolverSection = SolverSection()
    thermal: ThermalSection = Field(default_factory=ThermalSection)
    sensing: Annotated[SensingSection | None, OPTIONAL] = None
    structure: Annotated[str | None, OPTIONAL] = None  # file, or name of a built-in one
    vibration: Annotated[Any, PlainValidator(parse_vibration)] = None
    study: Annotated[StudySection | None, PlainValidator(parse_study)] = None
    motion: Annotated[MotionSection | None, OPTIONAL] = None
    wear: Annotated[WearSection | None, OPTIONAL] = None
    infer: Annotated[InferSection | None, PlainValidator(parse_infer)] = None
    cycle: Annotated[CycleSection | None, PlainValidator(parse_cycle)] = None

    def options(self) -> Options:
        """Return the solver options."""
        solver = {
            name: plain(value)
            for name, value in self.solver
            if name not in ("surfaces", "dynamic", "running_cells")
        }
        layer = None if self.inlet is None else InletLayer.uniform(plain(self.inlet.layer))
        return Options(model=self.model, inlet_layer=layer, **solver)

    @model_validator(mode="before")
    @classmethod
    def _name_solids(cls, tables: object) -> object:
        return with_named_solids(tables) if isinstance(tables, Mapping) else tables

    @model_validator(mode="after")
    def _oil_moves(self) -> Self:
        if self.lubricant is not None and not self.contact.entrainment_speed > 0.0:
            raise LocatedError(
                ("contact", "entrainment_speed"),
                "must be positive and finite with a lubricant, got "
                f'"{self.contact.entrainment_speed}"; correct it, or set lubricant = "none"',
            )
        return self
