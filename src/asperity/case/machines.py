"""[machine] of a case file: a machine element by catalogue data, in place of [contact]."""

import math
from collections.abc import Mapping
from copy import deepcopy
from dataclasses import dataclass, field
from functools import cached_property, partial
from pathlib import Path
from typing import Annotated, Any, Literal, TypeAlias

import tomli_w
from pydantic import PlainValidator

from asperity.case.bearing_sections import (
    Angle,
    BallBearingSection,
    CylindricalRollerBearingSection,
    FourPointBearingSection,
    NeedleBearingSection,
    Rotation,
    TaperedRollerBearingSection,
)
from asperity.case.case import Case
from asperity.case.materials import MaterialSection
from asperity.case.messages import Section, choose, parse_section
from asperity.case.ratings import RatingSection
from asperity.case.sections import CaseFile
from asperity.case.study import RangeSection, parse_study
from asperity.case.text import Tables, parse_toml, read_text, replaced
from asperity.case.units import (
    OPTIONAL,
    PAIRED,
    Amount,
    Count,
    Force,
    Length,
    Number,
    Speed,
    amount_in,
    default_amount,
    numbers_in_si,
    plain,
)
from asperity.contact.conditions import ElasticPair
from asperity.contact.materials import material
from asperity.core.documents import Table
from asperity.core.errors import BadInput
from asperity.core.files import require_file
from asperity.machine import (
    BallBearing,
    CatalogueBearing,
    CylindricalRollerBearing,
    FlatCam,
    FourPointBearing,
    HelicalGear,
    Machine,
    MachineContact,
    NeedleRollerBearing,
    RollerCam,
    SpurGear,
    TaperedRollerBearing,
    TwinDisc,
    catalogue_bearing,
)
from asperity.surface import read_table

RotationOrNone: TypeAlias = Annotated[float, amount_in("rad/s", 0.0)]
LengthPair: TypeAlias = Annotated[tuple[Length, Length], PAIRED]
MACHINE_TABLES = ("machine", "rating", "study")  # not in the case of a contact
OF_ALL_CONTACTS = ("roughness",)  # keys of [contact] beside a [machine]
DIGITS = 10  # of the values of a derived contact


class SpurGearSection(Section):
    """[machine] kind = "spur-gear"."""

    kind: Literal["spur-gear"]
    module: Length
    teeth: tuple[Count, Count]
    pressure_angle: Angle = Amount(math.radians(20.0), "20 deg")
    centre_distance: Annotated[Length | None, OPTIONAL] = None
    profile_shift: tuple[Number, Number] = (0.0, 0.0)
    face_width: Length
    tip_diameters: Annotated[LengthPair | None, OPTIONAL] = None
    torque: Annotated[float, amount_in("N m")]
    speed: Rotation


class HelicalGearSection(SpurGearSection):
    """[machine] kind = "helical-gear"."""

    kind: Literal["helical-gear"]  # type: ignore[assignment]
    helix_angle: Angle


class TwinDiscSection(Section):
    """[machine] kind = "twin-disc"."""

    kind: Literal["twin-disc"]
    radii: LengthPair
    speeds: Annotated[tuple[RotationOrNone, RotationOrNone] | None, OPTIONAL] = None
    entrainment_speed: Annotated[Speed | None, OPTIONAL] = None
    slide_to_roll: Annotated[Number | None, OPTIONAL] = None
    load: Force
    length: Annotated[Length | None, OPTIONAL] = None
    crown_radius: Annotated[Length | None, OPTIONAL] = None


class FlatCamSection(Section):
    """[machine] kind = "cam-flat"."""

    kind: Literal["cam-flat"]
    base_radius: Length
    lift: Annotated[Length | None, OPTIONAL] = None
    half_angle: Annotated[Angle | None, OPTIONAL] = None
    lift_table: Annotated[str | None, OPTIONAL] = None  # file of angles [deg] and lifts [mm]
    width: Length
    speed: Rotation
    spring_load: Force
    spring_rate: Annotated[float, amount_in("N/m", 0.0)] = default_amount(0.0, "N/m")
    follower_mass: Annotated[float, amount_in("kg", 0.0)] = Amount(0.0, "0 kg")


class RollerCamSection(FlatCamSection):
    """[machine] kind = "cam-roller"."""

    kind: Literal["cam-roller"]  # type: ignore[assignment]
    roller_radius: Length
    slip: Number = 0.0


MACHINES: dict[str, tuple[type[Section], type[Machine]]] = {
    "spur-gear": (SpurGearSection, SpurGear),
    "helical-gear": (HelicalGearSection, HelicalGear),
    "cylindrical-roller-bearing": (CylindricalRollerBearingSection, CylindricalRollerBearing),
    "needle-bearing": (NeedleBearingSection, NeedleRollerBearing),
    "tapered-roller-bearing": (TaperedRollerBearingSection, TaperedRollerBearing),
    "ball-bearing": (BallBearingSection, BallBearing),
    "four-point-bearing": (FourPointBearingSection, FourPointBearing),
    "twin-disc": (TwinDiscSection, TwinDisc),
    "cam-flat": (FlatCamSection, FlatCam),
    "cam-roller": (RollerCamSection, RollerCam),
}


def _sections() -> dict[str, type[Section]]:
    return {kind: section for kind, (section, _) in MACHINES.items()}


GEAR_STEEL, BEARING_STEEL = "case-hardened steel", "through-hardened bearing steel"


class _MachineTables(Section):
    """Tables of a case file that the machine itself needs."""

    machine: Annotated[Any, PlainValidator(partial(choose, "kind", _sections))]
    material: MaterialSection
    rating: RatingSection = RatingSection()


@dataclass(frozen=True)
class MachineCase:
    """Machine as its case file states it; created by `load_machine`.

    `hardness` [Pa] bounds the pressure, None for elastic bodies. `tables` are the file's, `folder`
    is the base of surface files, `source` the name of the case in messages. `rating` has further
    data for rating standards. `catalogue` is the bearing that the file designates, if any; `sweep`
    has the values of its [study] by dotted key.
    """

    tables: Table
    machine: Machine
    pair: ElasticPair
    hardness: float | None
    rating: RatingSection
    folder: Path = field(compare=False, repr=False)
    source: str = field(compare=False)
    catalogue: CatalogueBearing | None = None
    sweep: Mapping[str, tuple[object, ...] | RangeSection] = field(default_factory=dict)

    @cached_property
    def contacts(self) -> tuple[MachineContact, ...]:
        """Contacts that carry load."""
        return self.machine.contacts(self.pair)

    @property
    def notes(self) -> tuple[str, ...]:
        """Notes for a reader of the contacts, one sentence each."""
        notes = self.machine.notes(self.pair)
        if self.catalogue is not None:
            notes = (*notes, _catalogue_note(self.catalogue))
        if "material" in self.tables:
            return notes
        assumed = material(self.default_material)
        return (
            *notes,
            f"Both bodies are assumed to be {assumed.name}: E {assumed.youngs_modulus / 1e9:g} "
            f"GPa, ν {assumed.poisson_ratio:g}, hardness {assumed.hardness / 1e9:g} GPa.",
        )

    @property
    def default_material(self) -> str:
        """Name of the material of both bodies if the case states none."""
        return _default_material(self.machine)

    @property
    def text(self) -> str:
        """Case as TOML, as it was written."""
        return tomli_w.dumps(dict(self.tables))

    @property
    def complete(self) -> bool:
        """True if the case states all that a contact needs to be solved."""
        return {"lubricant", "surface"} <= set(self.tables)

    def contact_table(self, contact: MachineContact) -> dict[str, object]:
        """Return the [contact] table of one of the contacts; BadInput without entrainment."""
        conditions = contact.conditions(self.pair)
        radii = [
            _written(radius, "m")
            for radius in (conditions.radius_along_rolling, conditions.radius_across_rolling)
        ]
        length = {} if conditions.length is None else {"length": _written(conditions.length, "m")}
        stated = self.tables.get("contact", {})
        assert isinstance(stated, Mapping)
        return {
            **stated,
            "geometry": conditions.geometry,
            "radius": radii if conditions.geometry == "elliptic" else radii[0],
            **length,
            "load": _written(conditions.load, "N"),
            "entrainment_speed": _written(conditions.entrainment_speed, "m/s"),
            # symmetric in the two bodies
            "slip": float(f"{contact.slide_to_roll or 0.0:.{DIGITS}g}"),
        }

    def case(self, contact: MachineContact) -> Case:
        """Return the case of one of the contacts; BadInput as `load_case`."""
        sections = {key: table for key, table in self.tables.items() if key not in MACHINE_TABLES}
        tables = {"material": {"name": self.default_material}, **sections}
        contents = parse_section(
            CaseFile, {**tables, "contact": self.contact_table(contact)}, self.source
        )
        return Case(contents, self.folder, self.source)

    def with_overrides(self, overrides: Mapping[str, object]) -> "MachineCase":
        """Return the machine with values replaced, such as `{"machine.torque": "300 N m"}`.

        Numbers are in SI, those in text need their unit.
        """
        return self.with_written(numbers_in_si(overrides))

    def with_written(self, overrides: Mapping[str, object]) -> "MachineCase":
        """Return the machine with values replaced as in a file, where a quantity has its unit."""
        return _machine_case(
            replaced(deepcopy(dict(self.tables)), overrides, self.source), self.folder, self.source
        )


def load_machine(path: str | Path, overrides: Mapping[str, object] | None = None) -> MachineCase:
    """Read a case file with a machine; `overrides` replace values by dotted keys.

    Raises
    ------
    UnreadableFile
        if the file is missing or not TOML.
    BadInput
        for an impossible machine, or an invalid key, unit or value, in one sentence that names it.
    """
    path = Path(path)
    tables = parse_toml(read_text(path), str(path))
    if overrides:
        tables = replaced(tables, overrides, str(path))
    return _machine_case(tables, path.parent, str(path))


def has_machine(path: str | Path) -> bool:
    """Return True if a case file has a [machine]; UnreadableFile as `load_machine`."""
    path = Path(path)
    return "machine" in parse_toml(read_text(path), str(path))


def _machine_case(tables: Tables, folder: Path, source: str) -> MachineCase:
    if "machine" not in tables:
        raise BadInput(
            f"{source}: has no [machine]; add one, or use asperity solve for a single contact"
        )
    contact = tables.get("contact", {})
    if not isinstance(contact, Mapping) or set(contact) - set(OF_ALL_CONTACTS):
        raise BadInput(
            f"{source}: has a [machine] and a [contact]; leave one of them out, or only "
            f"contact.{', '.join(OF_ALL_CONTACTS)}"
        )
    present = {key: tables[key] for key in _MachineTables.model_fields if key in tables}
    catalogue = _designated(present, source)
    sweep = _sweep(tables, source)
    steel = {"name": BEARING_STEEL}  # elastic constants are those of any steel
    parsed = parse_section(_MachineTables, {"material": steel, **present}, source)
    section = parsed.machine
    stated = parsed.material
    pair = ElasticPair(plain(stated.youngs_modulus), stated.poisson_ratio)
    try:
        machine = MACHINES[section.kind][1](**_arguments(section, folder))
        parsed.rating.require_applicable(section.kind)
        hardness = plain(stated.hardness)
        if "material" not in tables:
            hardness = material(_default_material(machine)).hardness
        machine_case = MachineCase(
            tables, machine, pair, hardness, parsed.rating, folder, source, catalogue, sweep
        )
        drawn = [contact for contact in machine_case.contacts if not contact.stands_still]
    except BadInput as refusal:
        raise BadInput(f"{source}: machine: {refusal}") from None
    if machine_case.complete and drawn:
        machine_case.case(drawn[0])  # checks the remaining tables
    return machine_case


def _sweep(tables: Tables, source: str) -> Mapping[str, tuple[object, ...] | RangeSection]:
    """Return the values of [study] by dotted key."""
    try:
        study = parse_study(tables.get("study"))
    except BadInput as refusal:
        raise BadInput(f"{source}: study: {refusal}") from None
    if study is None:
        return {}
    if other := sorted(study.model_fields_set - {"axes"}):
        raise BadInput(
            f"{source}: study.{other[0]} does not apply to a machine; its [study] has lists of "
            "values only"
        )
    return study.axes


def _arguments(section: Section, folder: Path) -> dict[str, Any]:
    """Return the machine's arguments; a lift table is read from its file."""
    names = (name for name in type(section).model_fields if name != "kind")
    arguments = {name: plain(getattr(section, name)) for name in names}
    if arguments.get("lift_table") is not None:
        arguments["lift_table"] = _lift_table(folder / arguments["lift_table"])
    return arguments


def _lift_table(path: Path) -> tuple[tuple[float, float], ...]:
    """Read angles [deg] and lifts [mm] from two columns; return them in SI."""
    require_file(path)
    table = read_table(path)
    if table.shape[1] != 2:
        raise BadInput(
            f"lift_table must have two columns, angle in degrees and lift in mm, got "
            f"{table.shape[1]} in {path}"
        )
    return tuple((math.radians(angle), 1e-3 * lift) for angle, lift in table)


def _designated(tables: Tables, source: str) -> CatalogueBearing | None:
    """Complete the tables of a bearing by its designation; stated values take precedence."""
    machine = tables.get("machine")
    if not isinstance(machine, Mapping) or "designation" not in machine:
        return None
    stated = dict(machine)
    try:
        bearing = catalogue_bearing(str(stated.pop("designation")))
    except BadInput as refusal:
        raise BadInput(f"{source}: machine.{refusal}") from None
    if stated.get("kind", bearing.kind) != bearing.kind:
        raise BadInput(
            f"{source}: machine.kind is {stated['kind']}, but {bearing.designation} is a "
            f"{bearing.kind}; leave kind out"
        )
    rollers = bearing.length is not None
    element = "roller" if rollers else "ball"
    geometry: dict[str, object] = {
        "kind": bearing.kind,
        f"{element}s": bearing.elements,
        f"{element}_diameter": _written(bearing.diameter, "m"),
        "pitch_diameter": _written(bearing.pitch_diameter, "m"),
    }
    if bearing.length is not None:
        geometry |= {"roller_length": _written(bearing.length, "m"), "profile": "iso"}
    ratings = {
        "dynamic_load_rating": _written(bearing.dynamic_load_rating, "N"),
        "fatigue_load_limit": _written(bearing.fatigue_load_limit, "N"),
    }
    tables["machine"] = {**geometry, **stated}
    rating = tables.get("rating", {})
    if isinstance(rating, Mapping):
        tables["rating"] = {**ratings, **rating}
    return bearing


def _catalogue_note(bearing: CatalogueBearing) -> str:
    elements = "balls" if bearing.length is None else "rollers"
    return (
        f"{bearing.designation} by its designation: {bearing.elements} {elements} of "
        f"{1e3 * bearing.diameter:.4g} mm on a pitch diameter of "
        f"{1e3 * bearing.pitch_diameter:.4g} mm, C {1e-3 * bearing.dynamic_load_rating:.4g} kN, "
        f"C0 {1e-3 * bearing.static_load_rating:.4g} kN, unless the case states other values. "
        "Internal geometry is not standardised: state that of the maker if it is known."
    )


def _default_material(machine: Machine) -> str:
    return GEAR_STEEL if isinstance(machine, SpurGear) else BEARING_STEEL


def _written(value: float, unit: str) -> str:
    return f"{value:.{DIGITS}g} {unit}"
