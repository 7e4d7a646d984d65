"""The sections of a case file, in the order in which it has them."""

from typing import Annotated, Any, Literal, Self

from pydantic import Field, PlainValidator, Strict, field_validator, model_validator

from asperity.case.infer import InferSection, parse_infer
from asperity.case.laws import LubricantSection, ThermalSection
from asperity.case.lubricant import SheetSection, parse_lubricant
from asperity.case.messages import LocatedError, Section, quoted
from asperity.case.roller_shape import ShapeSection
from asperity.case.study import StudySection, parse_study
from asperity.case.surfaces import RoughBody, SurfaceSection, parse_surface
from asperity.case.units import (
    OPTIONAL,
    PAIRED,
    Amount,
    Count,
    Force,
    Length,
    Number,
    Pressure,
    Speed,
    default_amount,
    parse_amount,
)
from asperity.case.vibration import parse_vibration
from asperity.case.wear import WearSection
from asperity.contact.conditions import Geometry
from asperity.core.errors import BadInput
from asperity.ehl import MAX_CELLS_PER_TIME_STEP, ContactModel, Options, Start
from asperity.solution import BOUNDARY_FRICTION

MOST_FREQUENCIES = 200  # at which a contact may be shaken


def _parse_radius(value: object) -> Amount | tuple[Amount, Amount]:
    """One radius, or [Rx, Ry] of an elliptic contact."""
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
    entrainment_speed: Speed
    slip: Number = 0.0  # slide-to-roll ratio (u1 - u2)/entrainment speed


class MaterialSection(Section):
    """[material]: the two bodies."""

    youngs_modulus: Annotated[tuple[Pressure, Pressure], PAIRED]
    poisson_ratio: Annotated[tuple[Number, Number], PAIRED]
    hardness: Annotated[Pressure | None, OPTIONAL] = None
    boundary_friction: Annotated[float, Strict(), Field(ge=0.0, le=2.0)] = BOUNDARY_FRICTION


def _parse_cells(value: object) -> Literal["auto"] | tuple[int, int]:
    """[nx, ny], or "auto"."""
    if value == "auto":
        return "auto"
    if not isinstance(value, list | tuple) or len(value) != 2:
        raise BadInput(f'must be a list of two such as [256, 128], or "auto", got {quoted(value)}')
    for place, count in enumerate(value):
        if type(count) is not int:
            raise LocatedError((place,), f"must be a whole number, got {quoted(count)}")
    return value[0], value[1]


class GridSection(Section):
    """[grid]: cells, and corners in half-widths of the smooth dry line contact; what is left out is chosen."""

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
                'accuracy chooses a grid, and cells, x and y are all given; leave it out or set cells = "auto"'
            )
        return self

    @property
    def chosen(self) -> bool:
        """Whether anything of the grid is left to be chosen."""
        return self.cells == "auto" or self.x is None or self.y is None


class SolverSection(Section):
    """[solver]: how hard to solve."""

    tolerance: Number = Options().tolerance
    max_iterations: Annotated[int, Strict()] = Options().max_iterations
    contact_film: Length = default_amount(Options().contact_film, "m")
    dynamic: Annotated[int, Strict()] = (
        0  # frequencies at which the solved contact is shaken for k and c; 0: none
    )
    surfaces: Count | None = (
        None  # surfaces of one kind that a solution is the mean of; left out: as the wait allows
    )

    @field_validator("dynamic")
    @classmethod
    def _a_curve_or_none(cls, count: int) -> int:
        if count and not 3 <= count <= MOST_FREQUENCIES:
            raise BadInput(
                f"must be 0, for no curve over frequency, or 3 to {MOST_FREQUENCIES}, got {count}"
            )
        return count


class MotionSection(Section):
    """[motion]: how `asperity run` lets the roughness move."""

    steps: Count = 200
    time_step: Annotated[float, Strict(), Field(gt=0.0, le=MAX_CELLS_PER_TIME_STEP)] = (
        1.0  # cells that the oil travels in one
    )
    rough: RoughBody = "first"  # which body carries a generated surface; both: a half each
    start: Start = "steady"
    track: Count = 1  # lengths of the domain after which a surface repeats
    flattening: Annotated[bool, Strict()] = False  # what is pressed flat stays flat: running-in


class CaseFile(Section):
    """A whole case file. `lubricant = "none"` is a dry contact: an oil is not something to forget."""

    model: ContactModel = "mixed"
    contact: ContactSection
    material: MaterialSection
    lubricant: Annotated[LubricantSection | SheetSection | None, PlainValidator(parse_lubricant)]
    surface: Annotated[SurfaceSection, PlainValidator(parse_surface)]
    grid: GridSection = GridSection()
    solver: SolverSection = SolverSection()
    thermal: ThermalSection = Field(default_factory=ThermalSection)
    vibration: Annotated[Any, PlainValidator(parse_vibration)] = None
    study: Annotated[StudySection | None, PlainValidator(parse_study)] = None
    motion: Annotated[MotionSection | None, OPTIONAL] = None
    wear: Annotated[WearSection | None, OPTIONAL] = None
    infer: Annotated[InferSection | None, PlainValidator(parse_infer)] = None
