"""The case file: a contact written down in TOML with units, turned into the objects that the solvers take, and back.

Units live here and nowhere deeper. What is wrong with a file is said in one sentence that names the file, the key,
the value and the remedy. Solving a case is left to `asperity.results`.
"""

import math
import os
import re
import tomllib
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from copy import deepcopy
from dataclasses import MISSING, dataclass, field, fields, replace
from decimal import Decimal
from difflib import get_close_matches
from functools import cache, cached_property, lru_cache, partial
from pathlib import Path
from tokenize import TokenError
from typing import TYPE_CHECKING, Annotated, Any, Literal, TypeAlias, TypeVar, cast, get_args

import numpy as np
from pydantic import (
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Field,
    PlainValidator,
    PositiveInt,
    Strict,
    ValidationError,
    create_model,
)

from asperity.conditions import ContactConditions, ElasticPair, Geometry
from asperity.coupling import PRESETS, VibrationModel, preset_choices
from asperity.ehl import BOUNDARY_FRICTION, LONGEST_STEP, Options, Start
from asperity.errors import BadInput, UnreadableFile
from asperity.grid import Grid
from asperity.lubricant import (
    DENSITY_LAWS,
    FRICTION_LAWS,
    RHEOLOGY_LAWS,
    VISCOSITY_LAWS,
    WARMTH_LAWS,
    Lubricant,
    Solid,
    Thermal,
)
from asperity.surface import (
    CompositeSurface,
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
    track_grid,
)

if TYPE_CHECKING:
    import pint

SHORTEST_INLET = 4.0  # half-widths; a shorter inlet starves the film (0.448 um at 1.9, 0.722 um at 4.5; docs/paper.md)
SAMPLE_DEVIATION = 0.05  # of a generated surface's correlation lengths, beyond which the notes say so

_MEASURES = {  # SI unit -> what it measures, and how one is written
    "m": ("a length", "5.4 mm"),
    "N": ("a force", "500 N"),
    "m/s": ("a speed", "2 m/s"),
    "Pa": ("a pressure", "2 GPa"),
    "1/Pa": ("an inverse pressure", "18.2 1/GPa"),
    "Pa s": ("a viscosity", "0.096 Pa s"),
    "kg/m^3": ("a density", "0.88 g/cm^3"),
    "kg": ("a mass", "0.1 kg"),
    "s": ("a time", "2 s"),
    "Hz": ("a frequency", "50 kHz"),
    "N s/m": ("a damping coefficient", "80 N s/m"),
    "K": ("a temperature", "40 degC"),
    "1/K": ("an inverse temperature", "0.037 1/K"),
    "W/m/K": ("a thermal conductivity", "46 W/m/K"),
    "J/kg/K": ("a heat capacity", "460 J/kg/K"),
}
# parameters of laws that are not listed are plain numbers
_LAW_UNITS = {
    "eta0": "Pa s",
    "alpha": "1/Pa",
    "p0": "Pa",
    "rho0": "kg/m^3",
    "tau0": "Pa",
    "floor": "Pa",
    "tau_l0": "Pa",
    "softening": "1/K",
    "beta": "1/K",
}
_VIBRATION_UNITS = {
    "mass": "kg",
    "damping": "N s/m",
    "reference_depth": "m",
    "passing_speed": "m/s",
    "rate_hz": "Hz",
    "duration_s": "s",
    "cutoff_reference_hz": "Hz",
}
_WRITTEN = re.compile(r"\s*([+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)\s*([\w\s.*/^()·⁻-]*)")


class Amount(float):
    """A positive quantity in SI that remembers how it was written, so that a case is restated in its author's units."""

    text: str

    def __new__(cls, value: float, text: str) -> "Amount":
        """`value` in SI, `text` with its unit."""
        amount = super().__new__(cls, value)
        amount.text = text
        return amount


@cache
def _units() -> "pint.UnitRegistry[Decimal]":
    from pint import UnitRegistry

    return UnitRegistry(non_int_type=Decimal)  # decimal: 5.4 mm is the float nearest to 0.0054, not a product of floats


@lru_cache(4096)  # a case states forty quantities, and a study states most of them a thousand times over
def _in(unit: str, number: str, unit_text: str) -> float:
    return float(_units().Quantity(Decimal(number), unit_text).to(unit).magnitude)


def _amount(unit: str, value: object) -> Amount:
    """A quantity with its unit, in `unit`."""
    import pint

    measure, example = _MEASURES[unit]
    expected = f'must be {measure} such as "{example}"'
    if isinstance(value, Amount):
        return value
    if isinstance(value, int | float) and not isinstance(value, bool):
        raise BadInput(f"{expected}, got the bare number {value}; give it its unit")
    written = _WRITTEN.fullmatch(value) if isinstance(value, str) else None
    if written is None:
        raise BadInput(f"{expected}, got {_shown(value)}")
    number, unit_text = written[1], " ".join(written[2].split())
    if not unit_text:
        raise BadInput(f"{expected}, got {_shown(value)} without a unit")
    if unit == "Hz" and "Hz" not in unit_text:  # rpm and rad/s would slip through as inverse times, a factor 2 pi off
        raise BadInput(f"{expected}, got {_shown(value)}, which is not in hertz")
    try:
        si = _in(unit, number, unit_text)
    except pint.UndefinedUnitError:
        raise BadInput(f"{expected}, got {_shown(value)}, whose unit is not known; capitals matter") from None
    except pint.DimensionalityError:
        raise BadInput(f"{expected}, got {_shown(value)}, which is something else") from None
    except (pint.PintError, ValueError, TypeError, AssertionError, ArithmeticError, SyntaxError, TokenError):
        raise BadInput(f"{expected}, got {_shown(value)}, whose unit cannot be read") from None
    if not 0.0 < si < math.inf:
        raise BadInput(f"must be positive and finite, got {_shown(value)}; correct its sign or value")
    return Amount(si, f"{number} {unit_text}")


def split_amount(value: object, unit: str | None = None) -> tuple[Decimal, str]:
    """A number and its unit as written, or the number in `unit`; a bare number has the unit "".

    Raises
    ------
    BadInput
        for what is neither, or cannot be had in `unit`.
    """
    import pint

    if isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value):
        number, own = Decimal(str(value)), ""
    else:
        written = _WRITTEN.fullmatch(value) if isinstance(value, str) else None
        if written is None:
            raise BadInput(f'must be a number, or a quantity such as "0.5 um", got {_shown(value)}')
        number, own = Decimal(written[1]), " ".join(written[2].split())
    if unit is None or own == unit:
        return number, own
    try:
        if own and unit:
            return _units().Quantity(number, own).to(unit).magnitude, unit
    except (pint.PintError, ValueError, TypeError, AssertionError, ArithmeticError, SyntaxError, TokenError):
        pass
    raise BadInput(f"must be in {unit or 'no unit'} as the range's beginning is, got {_shown(value)}")


def in_si(value: object) -> Any:
    """A value of a case file as a number in SI; two equal ones as one; names as they stand."""
    if isinstance(value, list | tuple):
        entries = [in_si(entry) for entry in value]
        return entries[0] if len(entries) == 2 and entries[0] == entries[1] else entries
    if isinstance(value, int | float) and not isinstance(value, bool):
        return float(value)
    written = _WRITTEN.fullmatch(value) if isinstance(value, str) else None
    if written is None or not written[2].strip():
        return value
    return _to_si(written[1], " ".join(written[2].split()))


@lru_cache(4096)
def _to_si(number: str, unit_text: str) -> float:
    return float(_units().Quantity(Decimal(number), unit_text).to_base_units().magnitude)


def _restated(value: float, unit: str) -> Amount:
    """A default of the library, written out with its unit."""
    return Amount(value, f"{value:g} {unit}" if float(f"{value:g}") == value else f"{value!r} {unit}")


def _shown(value: object) -> str:
    return f'"{value}"' if isinstance(value, str) else str(value)


def _twice(value: object) -> object:
    """One value for both bodies or both directions."""
    return value if isinstance(value, list | tuple) else (value, value)


def read_length(name: str, text: str) -> float:
    """A length on the command line, such as "0.25 mm", in metres.

    Raises
    ------
    BadInput
        for what is no positive length with a unit; the message begins with `name`.
    """
    return read_amount(name, "m", text)


def _twice_if_any(value: object) -> object:
    return None if value is None else _twice(value)


def _both(value: float, unit: str) -> tuple[Amount, Amount]:
    return _restated(value, unit), _restated(value, unit)


def read_amount(name: str, unit: str, text: str) -> float:
    """A positive quantity on the command line, such as "300 s", in `unit`, an SI one.

    Raises
    ------
    BadInput
        for what is none with a unit of that kind; the message begins with `name`.
    """
    try:
        return float(_amount(unit, text))
    except BadInput as error:
        raise BadInput(f"{name} {error}") from None


def _none(value: object) -> object:
    """Let the word none leave an optional thing out: `--set material.hardness=none`."""
    return None if value == "none" else value


def _type(unit: str) -> Any:
    return Annotated[float, PlainValidator(partial(_amount, unit))]


Length: TypeAlias = Annotated[float, PlainValidator(partial(_amount, "m"))]
Force: TypeAlias = Annotated[float, PlainValidator(partial(_amount, "N"))]
Speed: TypeAlias = Annotated[float, PlainValidator(partial(_amount, "m/s"))]
Pressure: TypeAlias = Annotated[float, PlainValidator(partial(_amount, "Pa"))]
Temperature: TypeAlias = Annotated[float, PlainValidator(partial(_amount, "K"))]
Conductivity: TypeAlias = Annotated[float, PlainValidator(partial(_amount, "W/m/K"))]
Density: TypeAlias = Annotated[float, PlainValidator(partial(_amount, "kg/m^3"))]
HeatCapacity: TypeAlias = Annotated[float, PlainValidator(partial(_amount, "J/kg/K"))]
Number: TypeAlias = Annotated[float, Strict()]
Count: TypeAlias = Annotated[PositiveInt, Strict()]
Seed: TypeAlias = Annotated[int, Strict(), Field(ge=0)]
_Twice = BeforeValidator(_twice)
_Optional = BeforeValidator(_none)
_TwiceIfAny = BeforeValidator(_twice_if_any)


L = TypeVar("L")
S = TypeVar("S", bound="Section")


class Section(BaseModel):
    """A table of the case file; keys that are not fields are refused."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False, serialize_by_alias=True)


def _radius(value: object) -> Amount | tuple[Amount, Amount]:
    """One radius, or [Rx, Ry] of an elliptic contact."""
    if isinstance(value, list | tuple):
        if len(value) != 2:
            raise BadInput(f"must be one length or a pair [Rx, Ry], got {len(value)} values")
        return _amount("m", value[0]), _amount("m", value[1])
    return _amount("m", value)


class ContactSection(Section):
    """[contact]: geometry, load and motion."""

    geometry: Geometry
    radius: Annotated[float | tuple[float, float], PlainValidator(_radius)]
    length: Annotated[Length | None, _Optional] = None  # of a line contact
    load: Force
    entrainment_speed: Speed
    slip: Number = 0.0  # slide-to-roll ratio (u1 - u2)/entrainment speed


class MaterialSection(Section):
    """[material]: the two bodies."""

    youngs_modulus: Annotated[tuple[Pressure, Pressure], _Twice]
    poisson_ratio: Annotated[tuple[Number, Number], _Twice]
    hardness: Annotated[Pressure | None, _Optional] = None
    boundary_friction: Annotated[float, Strict(), Field(ge=0.0, le=2.0)] = BOUNDARY_FRICTION


class GaussianSection(Section):
    """[surface] kind = "gaussian"."""

    kind: Literal["gaussian"]
    sq: Length
    correlation_length: Annotated[tuple[Length, Length], _Twice]
    direction_deg: Number = 0.0  # of the first correlation length, from x towards y
    seed: Seed = 0


class NonGaussianSection(Section):
    """[surface] kind = "non-gaussian"."""

    kind: Literal["non-gaussian"]
    sq: Length
    skewness: Number
    kurtosis: Number
    correlation_length: Annotated[tuple[Length, Length], _Twice]
    direction_deg: Number = 0.0
    seed: Seed = 0


class RunInSection(Section):
    """[surface] kind = "run-in"."""

    kind: Literal["run-in"]
    sq: Length
    correlation_length: Annotated[tuple[Length, Length], _Twice]
    plateau_share: Number
    plateau_roughness: Number = 0.1  # Sq of the plateau over that of the surface before it was worn
    direction_deg: Number = 0.0
    seed: Seed = 0


class GroundSection(Section):
    """[surface] kind = "ground"."""

    kind: Literal["ground"]
    sq: Length
    groove_width: Length
    groove_length: Length
    direction_deg: Number = 0.0  # of the lay, from x towards y
    seed: Seed = 0


class SandblastedSection(Section):
    """[surface] kind = "sandblasted"."""

    kind: Literal["sandblasted"]
    sq: Length
    crater_radius: Length
    seed: Seed = 0


class SelfAffineSection(Section):
    """[surface] kind = "self-affine"."""

    kind: Literal["self-affine"]
    sq: Length
    hurst: Number
    cutoffs: tuple[Length, Length]  # shortest and longest wavelength
    seed: Seed = 0


class FlatSection(Section):
    """[surface] kind = "flat", or surface = "flat"."""

    kind: Literal["flat"]


class FileSection(Section):
    """A measured surface and what is done to it."""

    file: str
    sq: Annotated[Length | None, _Optional] = None  # scale to this; left out: as measured
    form: Form = "quadratic"
    fit: Literal["crop", "tile"] = "crop"
    turn: Annotated[bool, Strict()] = False  # by a quarter turn: what the file has along x runs along y
    outliers: Outliers = "keep"
    s_filter: Annotated[Length | None, _Optional] = None
    l_filter: Annotated[Length | None, _Optional] = None
    unit: str | None = None  # of the heights, where the file does not say
    lateral_unit: str | None = None
    pixel: Annotated[tuple[Length, Length], _Twice] | None = None  # of a matrix of bare heights


class MeasuredSection(FileSection):
    """[surface] file = "..."."""

    second: FileSection | None = None  # on the other body; the composite of both is solved


_SURFACES: dict[str, type[Section]] = {
    "gaussian": GaussianSection,
    "non-gaussian": NonGaussianSection,
    "self-affine": SelfAffineSection,
    "ground": GroundSection,
    "sandblasted": SandblastedSection,
    "run-in": RunInSection,
    "flat": FlatSection,
}


class GridSection(Section):
    """[grid]: cells, and corners in half-widths of the smooth dry line contact."""

    cells: tuple[Annotated[int, Strict()], Annotated[int, Strict()]]
    x: tuple[Number, Number]
    y: tuple[Number, Number]


class SolverSection(Section):
    """[solver]: how hard to solve."""

    tolerance: Number = Options().tolerance
    max_iterations: Annotated[int, Strict()] = Options().max_iterations
    contact_film: Length = _restated(Options().contact_film, "m")


def _seeds(value: object) -> int | tuple[int, ...]:
    """How many seeds, or the seeds themselves."""
    if type(value) is int and value >= 1:
        return value
    if isinstance(value, list | tuple) and value and all(type(seed) is int and seed >= 0 for seed in value):
        return tuple(value)
    raise BadInput(f"must be 1 or more, or a list of seeds such as [1, 2, 3], got {_shown(value)}")


class RangeSection(Section):
    """A range in [study]: `step` from one value to the next, or `count` of them; over samples, neither."""

    start: Any = Field(alias="from")
    to: Any
    step: Any = None
    count: Count | None = None
    scale: Literal["linear", "log"] = "linear"


class StudySection(Section):
    """[study]: what a sweep varies. Every other key names a quantity of the case."""

    kind: Literal["solve", "vibrate"] = "solve"
    axes: dict[str, tuple[Any, ...] | RangeSection]  # as written: key -> values
    samples: Count | None = None  # a Latin hypercube of so many points in place of the product
    sample_seed: Seed = 0
    seeds: Annotated[int | tuple[int, ...], PlainValidator(_seeds)] = 1  # how many surfaces a point, or which
    seeding: Literal["independent", "common"] = "independent"


class MotionSection(Section):
    """[motion]: how `asperity run` lets the roughness move."""

    steps: Count = 200
    time_step: Annotated[float, Strict(), Field(gt=0.0, le=LONGEST_STEP)] = 1.0  # cells that the oil travels in one
    rough: Literal["first", "second", "both"] = "first"  # which body carries a generated surface; both: a half each
    start: Start = "steady"
    track: Count = 1  # lengths of the domain after which a surface repeats
    flattening: Annotated[bool, Strict()] = False  # what is pressed flat stays flat: running-in


class _Located(BadInput):
    """What is wrong, and the keys that lead to it."""

    def __init__(self, keys: tuple[str | int, ...], message: str) -> None:
        super().__init__(message)
        self.keys = keys
        self.message = message


def _parameters(law: type, units: Mapping[str, str]) -> dict[str, Any]:
    """A dataclass's fields as fields of a section: quantities where a unit is listed, else as annotated."""
    parameters: dict[str, Any] = {}
    for parameter in fields(law):
        unit = units.get(parameter.name)
        kind = _type(unit) if unit else Annotated[cast(Any, parameter.type), Strict()]
        default: Any = ... if parameter.default is MISSING else parameter.default
        if default is None:
            kind = Annotated[kind | None, _Optional]
        stated = _restated(default, unit) if unit and isinstance(default, float) else default
        parameters[parameter.name] = (kind, stated)
    return parameters


def _law_sections(laws: Mapping[str, type]) -> dict[str, type[Section]]:
    return {
        name: create_model(name, __base__=Section, law=(str, ...), **_parameters(law, _LAW_UNITS))
        for name, law in laws.items()
    }


def _choice(key: str, sections: Mapping[str, type[Section]], value: object) -> Section:
    """The section that value[key] names; a bare name stands for a table that holds nothing else."""
    table = {key: value} if isinstance(value, str) else value
    if not isinstance(table, Mapping):
        raise BadInput(f"must be a table with the key {key}, got {_shown(value)}")
    if key not in table:
        raise _Located((key,), f"is missing; it is one of {', '.join(sections)}")
    name = table[key]
    if not isinstance(name, str) or name not in sections:
        near = get_close_matches(str(name), sections, n=1)
        raise _Located(
            (key,),
            f"must be one of {', '.join(sections)}, got {_shown(name)}"
            + (f'; did you mean "{near[0]}"?' if near else ""),
        )
    return _validated(sections[name], table)


def _surface_section(value: object) -> Section:
    if isinstance(value, Mapping) and "file" in value:
        if "kind" in value:
            raise BadInput("has both kind and file; keep kind for a generated surface or file for a measured one")
        return _validated(MeasuredSection, value)
    if isinstance(value, Mapping) and "kind" not in value:
        raise BadInput(f"must hold kind (one of {', '.join(_SURFACES)}) or file (a measured surface)")
    return _choice("kind", _SURFACES, value)


_FRICTION_SECTIONS = _law_sections(FRICTION_LAWS)


class LubricantSection(Section):
    """[lubricant]: one law of each family."""

    viscosity: Annotated[Section, PlainValidator(partial(_choice, "law", _law_sections(VISCOSITY_LAWS)))]
    density: Annotated[Section, PlainValidator(partial(_choice, "law", _law_sections(DENSITY_LAWS)))]
    rheology: Annotated[Section, PlainValidator(partial(_choice, "law", _law_sections(RHEOLOGY_LAWS)))]
    friction: Annotated[
        Section, PlainValidator(partial(_choice, "law", _FRICTION_SECTIONS)), Field(validate_default=True)
    ] = cast(Section, "bair-winer")


def _lubricant_section(value: object) -> LubricantSection | None:
    return None if value == "none" else _validated(LubricantSection, value)


_STUDY_KEYS = tuple(name for name in StudySection.model_fields if name != "axes")


def _study_section(value: object) -> StudySection | None:
    """The plan of a study; quantities stand beside its own keys, as tables (contact.load) or by their bare names."""
    if value is None or value == "none":
        return None
    if not isinstance(value, Mapping):
        raise BadInput(f"must be a table, got {_shown(value)}")
    own = {key: tuple(v) if isinstance(v, list) else v for key, v in value.items() if key in _STUDY_KEYS}
    axes = dict(_axes({key: v for key, v in value.items() if key not in _STUDY_KEYS}))
    return _validated(StudySection, {**own, "axes": axes})


def _axes(table: Mapping[str, object], parents: tuple[str, ...] = ()) -> Iterator[tuple[str, object]]:
    for key, value in table.items():
        keys = (*parents, key)
        if isinstance(value, Mapping) and not {"from", "to", "step", "count"} & set(value):
            yield from _axes(value, keys)
        elif isinstance(value, Mapping):
            try:
                yield ".".join(keys), _validated(RangeSection, value)
            except _Located as mistake:
                raise _Located(keys + mistake.keys, mistake.message) from None
        elif isinstance(value, list) and value:
            yield ".".join(keys), tuple(value)
        else:
            raise _Located(
                keys,
                f'must be a list of values or a range such as {{ from = "0.5 um", to = "4 um", step = "0.1 um" }}, '
                f"got {_shown(value)}",
            )


class ThermalSection(Section):
    """[thermal]: what takes up the heat of sliding, and whether the film feels it."""

    ambient: Temperature = _restated(Thermal().ambient, "K")
    bulk: Annotated[tuple[Temperature, Temperature] | None, _TwiceIfAny, _Optional] = None  # of the bodies
    conductivity: Annotated[tuple[Conductivity, Conductivity], _Twice] = _both(Solid().conductivity, "W/m/K")
    density: Annotated[tuple[Density, Density], _Twice] = _both(Solid().density, "kg/m^3")
    heat_capacity: Annotated[tuple[HeatCapacity, HeatCapacity], _Twice] = _both(Solid().heat_capacity, "J/kg/K")
    oil_conductivity: Conductivity = _restated(Thermal().oil_conductivity, "W/m/K")
    warmth: Annotated[
        Section, PlainValidator(partial(_choice, "law", _law_sections(WARMTH_LAWS))), Field(validate_default=True)
    ] = cast(Section, "exponential")
    feedback: Annotated[bool, Strict()] = Thermal().feedback


def _vibration_key(name: str) -> str:
    """The key of a field of VibrationModel: in a case, the unit stands beside the value."""
    return re.sub("_(hz|s)$", "", name)


_PRESET: Any = (Literal["sound", "paper"], "sound")
VibrationSection = create_model(
    "vibration",
    __base__=Section,
    preset=_PRESET,
    **{_vibration_key(name): kind for name, kind in _parameters(VibrationModel, _VIBRATION_UNITS).items()},
)


def _vibration_section(value: object) -> Any:
    """A preset's choices, and over them what the case says."""
    if value == "none":
        return None
    chosen = value.get("preset", "sound") if isinstance(value, Mapping) else "sound"
    if isinstance(value, Mapping) and isinstance(chosen, str) and chosen in PRESETS:
        value = {**_preset_table(chosen), **value}
    return _validated(VibrationSection, value)


def _preset_table(name: str) -> dict[str, Any]:
    """A preset's choices as a case writes them."""
    units = _VIBRATION_UNITS
    return {
        _vibration_key(key): _restated(choice, units[key]) if key in units else choice
        for key, choice in preset_choices(name).items()
    }


class CaseFile(Section):
    """A whole case file. `lubricant = "none"` is a dry contact: an oil is not something to forget."""

    model: Literal["unified", "conserving"] = "unified"
    contact: ContactSection
    material: MaterialSection
    lubricant: Annotated[LubricantSection | None, PlainValidator(_lubricant_section)]
    surface: Annotated[Section, PlainValidator(_surface_section)]
    grid: GridSection
    solver: SolverSection = SolverSection()
    thermal: ThermalSection = Field(default_factory=ThermalSection)
    vibration: Annotated[Any, PlainValidator(_vibration_section)] = None
    study: Annotated[StudySection | None, PlainValidator(_study_section)] = None
    motion: Annotated[MotionSection | None, _Optional] = None


def _validated(model: type[S], table: object) -> S:
    try:
        return model.model_validate(table)
    except ValidationError as error:
        raise _first_mistake(model, error) from None


def checked(model: type[S], table: object, source: str) -> S:
    """A table with units, of a case or of another file, as the section that it is meant to be.

    Raises
    ------
    BadInput
        for what the section refuses; the sentence begins with `source` and names the key.
    """
    try:
        return _validated(model, table)
    except _Located as mistake:
        raise BadInput(f"{source}: {_dotted(mistake.keys)} {mistake.message}") from None


def _first_mistake(model: type[Section], error: ValidationError) -> _Located:
    """The mistake to mend first, in a sentence: a mistyped key explains a missing one."""
    mistakes = error.errors(include_url=False)
    mistake = next((m for m in mistakes if m["type"] == "extra_forbidden"), mistakes[0])
    keys, kind, given = mistake["loc"], mistake["type"], mistake["input"]
    cause = mistake.get("ctx", {}).get("error")
    if isinstance(cause, _Located):
        return _Located(keys + cause.keys, cause.message)
    if isinstance(cause, BadInput):
        return _Located(keys, str(cause))
    if kind == "extra_forbidden":
        known = _keys_of(model, keys[:-1])
        near = get_close_matches(str(keys[-1]), known, n=1)
        remedy = f"did you mean {near[0]}?" if near else f"known here: {', '.join(known)}"
        return _Located(keys, f"is not a known key; {remedy}")
    if kind == "missing":
        return _Located(keys, "is missing; add it")
    expected = mistake["msg"].removeprefix("Input ").removeprefix("should ")
    if expected.startswith("be a valid dictionary"):
        expected = "be a table"
    expected = expected.replace("'", '"').replace("a valid tuple", "a list")
    return _Located(keys, f"must {expected}, got {_shown(given)}")


def _keys_of(model: type[Section], keys: tuple[str | int, ...]) -> list[str]:
    for key in keys:
        if isinstance(key, str):
            model = next(_sections_in(model.model_fields[key].annotation))
    return [entry.alias or name for name, entry in model.model_fields.items()]


def _sections_in(annotation: Any) -> Iterator[type[Section]]:
    if isinstance(annotation, type) and issubclass(annotation, Section):
        yield annotation
    for part in get_args(annotation):
        yield from _sections_in(part)


def _dotted(keys: tuple[str | int, ...]) -> str:
    return "".join(f"[{key}]" if isinstance(key, int) else f".{key}" for key in keys).removeprefix(".")


@dataclass(frozen=True)
class Case:
    """A contact to solve, as its case file states it. Made by `load_case`.

    `contents` are the file's tables, `folder` is where a surface file is looked for, `source` what messages call the
    case, `stored` the roughness of the run that the case came from.
    """

    contents: CaseFile
    folder: Path = field(compare=False, repr=False)
    source: str = field(compare=False)
    stored: Surface | None = field(default=None, compare=False, repr=False)
    stored_notes: tuple[str, ...] = field(default=(), compare=False, repr=False)  # what was done to make `stored`

    def __post_init__(self) -> None:
        # refuse now what would else be refused later, perhaps after a long wait
        built = {
            "contact and material": "conditions",
            "lubricant": "lubricant",
            "grid": "grid",
            "solver": "options",
            "thermal": "thermal",
            "vibration": "vibration",
        }
        for part, name in built.items():
            with self.naming(part):
                getattr(self, name)

    def __reduce__(self) -> tuple[Any, ...]:  # the sections of laws are made at run time, which pickle cannot follow
        return _case_again, (self.text, self.folder, self.source, self.stored, self.stored_notes)

    @contextmanager
    def naming(self, part: str) -> Iterator[None]:
        """Let what is refused inside say which case and which part of it is meant."""
        try:
            yield
        except BadInput as error:
            raise type(error)(f"{self.source}: {part}: {error}") from None

    @cached_property
    def conditions(self) -> ContactConditions:
        """Bodies, load and motion."""
        contact, material = self.contents.contact, self.contents.material
        first, second = (float(modulus) for modulus in material.youngs_modulus)
        speed = float(contact.entrainment_speed)
        return ContactConditions(
            pair=ElasticPair((first, second), material.poisson_ratio),
            geometry=contact.geometry,
            radius=_plain_radius(contact.radius),
            length=None if contact.length is None else float(contact.length),
            load=float(contact.load),
            surface_speeds=(speed * (1.0 + contact.slip / 2.0), speed * (1.0 - contact.slip / 2.0)),
            hardness=None if material.hardness is None else float(material.hardness),
        )

    @cached_property
    def lubricant(self) -> Lubricant | None:
        """The oil, None for a dry contact."""
        section = self.contents.lubricant
        if section is None:
            return None
        return Lubricant(
            viscosity=_law(VISCOSITY_LAWS, section.viscosity),
            density=_law(DENSITY_LAWS, section.density),
            rheology=_law(RHEOLOGY_LAWS, section.rheology),
            friction=_law(FRICTION_LAWS, section.friction),
        )

    @property
    def boundary_friction(self) -> float:
        """Shear stress over pressure where the bodies touch."""
        return float(self.contents.material.boundary_friction)

    @cached_property
    def thermal(self) -> Thermal:
        """What takes up the heat of sliding."""
        section = self.contents.thermal
        first, second = (
            Solid(conductivity=float(k), density=float(rho), heat_capacity=float(c))
            for k, rho, c in zip(section.conductivity, section.density, section.heat_capacity, strict=True)
        )
        return Thermal(
            ambient=float(section.ambient),
            bulk=None if section.bulk is None else (float(section.bulk[0]), float(section.bulk[1])),
            oil_conductivity=float(section.oil_conductivity),
            warmth=_law(WARMTH_LAWS, section.warmth),
            solids=(first, second),
            feedback=section.feedback,
        )

    @cached_property
    def grid(self) -> Grid:
        """The rectangle to compute on; half-widths turned into metres, along a line contact's length too."""
        section, line = self.contents.grid, self.conditions.geometry == "line"
        a, b = self.conditions.hertz.half_widths
        if line:
            b = a  # y runs along the line: its piece is measured in the same half-width
        (left, right), (front, back) = section.x, section.y
        grid = Grid(section.cells, (left * a, front * b), (right * a, back * b), periodic=(False, line))
        for axis, low, high in [("x", left, right)] if line else [("x", left, right), ("y", front, back)]:
            if not (low < -1.0 and high > 1.0):
                raise BadInput(
                    f"{axis} must reach beyond the contact on both sides, got {low:g} to {high:g} half-widths; "
                    f"use {'-4.5 to 1.9' if axis == 'x' else '-3 to 3'}"
                )
        return grid

    @cached_property
    def options(self) -> Options:
        """How hard to solve."""
        section = self.contents.solver
        return Options(
            tolerance=section.tolerance,
            max_iterations=section.max_iterations,
            contact_film=float(section.contact_film),
            model=self.contents.model,
        )

    @cached_property
    def vibration(self) -> VibrationModel | None:
        """The vibration model; None when the case has no [vibration]."""
        section = self.contents.vibration
        if section is None:
            return None
        values = {entry.name: getattr(section, _vibration_key(entry.name)) for entry in fields(VibrationModel)}
        plain: dict[str, Any] = {name: float(v) if isinstance(v, float) else v for name, v in values.items()}
        return VibrationModel(**plain)

    @cached_property
    def _roughness(self) -> tuple[Surface, tuple[str, ...]]:
        section = self.contents.surface
        if self.stored is not None:
            return self.stored, self.stored_notes
        if isinstance(section, FileSection):
            return self._measured(section)
        if isinstance(section, FlatSection):
            return flat_surface(self.grid), ()
        return self._generated(section, np.random.default_rng(getattr(section, "seed", 0)), self.grid)

    def _generated(self, section: Section, rng: np.random.Generator, grid: Grid) -> tuple[Surface, tuple[str, ...]]:
        if isinstance(section, SelfAffineSection):
            shortest, longest = (float(length) for length in section.cutoffs)
            sq, hurst = float(section.sq), section.hurst
            return self_affine_surface(grid, sq=sq, hurst=hurst, cutoffs=(shortest, longest), rng=rng), ()
        if isinstance(section, SandblastedSection):
            sq, radius = float(section.sq), float(section.crater_radius)
            return sandblasted_surface(grid, sq=sq, crater_radius=radius, rng=rng), ()
        if isinstance(section, GroundSection):
            width, length = float(section.groove_width), float(section.groove_length)
            lay = math.radians(section.direction_deg)
            return ground_surface(
                grid, sq=float(section.sq), groove_width=width, groove_length=length, direction=lay, rng=rng
            ), ()
        assert isinstance(section, GaussianSection | NonGaussianSection | RunInSection)
        lx, ly = (float(length) for length in section.correlation_length)
        lay = math.radians(section.direction_deg)
        common: dict[str, Any] = {
            "sq": float(section.sq),
            "correlation_length": (lx, ly),
            "direction": lay,
            "rng": rng,
        }
        if isinstance(section, RunInSection):
            share, rest = section.plateau_share, section.plateau_roughness
            return run_in_surface(grid, plateau_share=share, plateau_roughness=rest, **common), ()
        if isinstance(section, NonGaussianSection):
            made = non_gaussian_surface(grid, skewness=section.skewness, kurtosis=section.kurtosis, **common)
        else:
            made = gaussian_surface(grid, **common)
        found = correlation_lengths(made, lay)
        if all(abs(f / asked - 1.0) <= SAMPLE_DEVIATION for f, asked in zip(found, (lx, ly), strict=True)):
            return made, ()
        return made, (
            f"This sample's autocorrelation falls to 1/e over {area_text(found)}, where {area_text((lx, ly))} "
            "was asked for: the domain holds few correlation lengths, so seeds scatter.",
        )

    def _measured(self, section: FileSection) -> tuple[Surface, tuple[str, ...]]:
        prepared = self._prepared(section)
        if not (isinstance(section, MeasuredSection) and section.second is not None):
            return prepared.surface, prepared.steps
        second = self._prepared(section.second)
        speeds = self.conditions.surface_speeds
        combined = CompositeSurface(prepared.surface, second.surface, speeds).surface
        return combined, (
            *(f"{section.file}: {step}" for step in prepared.steps),
            *(f"{section.second.file}: {step}" for step in second.steps),
            f"added {section.file} (moving at {speeds[0]:.4g} m/s) and {section.second.file} ({speeds[1]:.4g} m/s), "
            f"the second face down; Sq {length_text(combined.sq)} together",
        )

    def _prepared(self, section: FileSection, grid: Grid | None = None) -> PreparedSurface:
        def plain(length: float | None) -> float | None:
            return None if length is None else float(length)

        pixel = None if section.pixel is None else (float(section.pixel[0]), float(section.pixel[1]))
        measured = read_surface(
            self.folder / section.file, unit=section.unit, lateral_unit=section.lateral_unit, pixel=pixel
        )
        prepared = prepare_surface(
            measured,
            grid or self.grid,
            sq=plain(section.sq),
            form=section.form,
            fit=section.fit,
            turn=section.turn,
            outliers=section.outliers,
            s_filter=plain(section.s_filter),
            l_filter=plain(section.l_filter),
        )
        return replace(prepared, steps=(*measured.notes, *prepared.steps))

    def composite(self) -> CompositeSurface | None:
        """Two measured surfaces apart, each with its speed; None when the case has no second one."""
        section = self.contents.surface
        if not (isinstance(section, MeasuredSection) and section.second is not None):
            return None
        with self.naming("surface"):
            first, second = self._prepared(section), self._prepared(section.second)
            return CompositeSurface(first.surface, second.surface, self.conditions.surface_speeds)

    @property
    def motion(self) -> MotionSection:
        """How the roughness moves, where it is let."""
        return self.contents.motion or MotionSection()

    def moving_surfaces(self) -> MovingSurfaces:
        """Both bodies' roughness on tracks that repeat along rolling, each at its own speed.

        Roughness that is generated, or measured on one surface only, lies on the body that `motion.rough` names; "both"
        bodies carry independent samples of Sq/√2 each, of which the first has the case's seed. Two measured surfaces
        lie on one body each. A measured surface's ends are joined.

        Raises
        ------
        BadInput
            for one measured surface that shall be on both bodies, a track that it does not cover, or roughness kept in
            a run, which is on neither track.
        """
        section, motion, speeds = self.contents.surface, self.motion, self.conditions.surface_speeds
        track = track_grid(self.grid, motion.track)
        with self.naming("surface"):
            if self.stored is not None:
                raise BadInput("is kept in a run, and what it had beside the contact is not; let the case file move")
            if isinstance(section, MeasuredSection) and section.second is not None:
                one, other = self._prepared(section, track).surface, self._prepared(section.second, track).surface
                return MovingSurfaces(one, other, speeds, self.grid)
            if isinstance(section, FileSection):
                if motion.rough == "both":
                    raise BadInput(
                        f"{section.file} is one surface and motion.rough asks for two; name the other as second"
                    )
                made = self._prepared(section, track).surface
            elif isinstance(section, FlatSection):
                made = flat_surface(track)
            elif motion.rough == "both":
                seed = getattr(section, "seed", 0)
                each = (np.random.default_rng(seed), np.random.default_rng([seed, 2]))
                samples = (self._generated(section, rng, track)[0].heights for rng in each)
                first, second = (Surface(heights / math.sqrt(2.0), track) for heights in samples)
                return MovingSurfaces(first, second, speeds, self.grid)
            else:
                made = self._generated(section, np.random.default_rng(getattr(section, "seed", 0)), track)[0]
            return MovingSurfaces.one_rough(made, speeds, self.grid, first=motion.rough == "first")

    def surface(self) -> Surface:
        """The composite roughness on the grid: generated, read and prepared, or as stored in the run.

        Raises
        ------
        BadInput
            for a surface that the grid cannot carry, or a measurement that does not cover the contact.
        UnreadableFile
            for a surface file that cannot be read.
        """
        with self.naming("surface"):
            return self._roughness[0]

    @property
    def surface_notes(self) -> tuple[str, ...]:
        """What was done to a measured surface, and where a generated one strays from what was asked for."""
        self.surface()
        return self._roughness[1]

    @property
    def notes(self) -> tuple[str, ...]:
        """What a reader of the results has to know about the case, a sentence each."""
        inlet = -self.contents.grid.x[0]
        if inlet >= SHORTEST_INLET or self.lubricant is None:
            return ()
        return (
            f"The inlet of {inlet:g} half-widths is shorter than {SHORTEST_INLET:g} and starves the film; "
            "start grid.x at -4.5 unless that is meant.",
        )

    @property
    def text(self) -> str:
        """The case as TOML, every default written out; loads to an equal case."""
        import tomli_w

        tables = _plain(self.contents)
        if self.contents.lubricant is None:
            tables["lubricant"] = "none"
        return tomli_w.dumps(tables)

    def with_overrides(self, overrides: Mapping[str, object]) -> "Case":
        """The case with values replaced, such as `{"contact.load": "400 N", "grid.cells": "[128, 128]"}`.

        Text is read as a TOML value where it is one and taken as it stands where not. Stored roughness is kept
        as long as neither the surface nor the grid changes. `vibration.preset` replaces all that presets choose.

        Raises
        ------
        BadInput
            for a key or value that the case file would be refused for.
        """
        tables = tomllib.loads(self.text)
        if "vibration.preset" in overrides:  # what the old preset chose is written out, and would stand above the new
            for choice in preset_choices("sound"):
                tables.get("vibration", {}).pop(_vibration_key(choice), None)
        for path, value in overrides.items():
            *parents, key = path.split(".")
            if not all((*parents, key)):
                raise BadInput(f"{self.source}: {path} is not a key; name one such as contact.load")
            table = tables
            for parent in parents:
                if not isinstance(table.get(parent), dict):
                    table[parent] = {}
                table = table[parent]
            table[key] = _toml_value(value) if isinstance(value, str) else deepcopy(value)  # a later key may go into it
        case = _case(tables, self.folder, self.source)
        same = case.grid == self.grid and case.contents.surface == self.contents.surface
        return replace(case, stored=self.stored, stored_notes=self.stored_notes) if same else case


def load_case(
    source: str | Path, *, folder: Path | None = None, name: str | None = None, stored: Surface | None = None
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
        name = name or "case"
        return _case(_tables(source, name), folder or Path(), name, stored)
    path = Path(source)
    try:
        text = path.read_text("utf-8")
    except FileNotFoundError:
        raise UnreadableFile(f"{path} does not exist; check its name") from None
    except UnicodeDecodeError:
        raise UnreadableFile(f"{path} is not a text file; a case is TOML") from None
    except OSError as error:
        raise UnreadableFile(f"{path} cannot be read: {error.strerror}") from None
    name = name or str(path)
    return _case(_tables(text, name), folder or path.parent, name, stored)


def _case(tables: dict[str, Any], folder: Path, source: str, stored: Surface | None = None) -> Case:
    return Case(checked(CaseFile, tables, source), folder, source, stored)


def _case_again(text: str, folder: Path, source: str, stored: Surface | None, stored_notes: tuple[str, ...]) -> Case:
    return replace(load_case(text, folder=folder, name=source, stored=stored), stored_notes=stored_notes)


def _tables(text: str, source: str) -> dict[str, Any]:
    try:
        return tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise UnreadableFile(f"{source} is not valid TOML: {error}") from None


def _toml_value(text: str) -> object:
    try:
        return tomllib.loads(f"value = {text}")["value"]
    except tomllib.TOMLDecodeError:
        return text  # the shell took the quotes away


def _plain_radius(radius: float | tuple[float, float]) -> float | tuple[float, float]:
    return (float(radius[0]), float(radius[1])) if isinstance(radius, tuple) else float(radius)


def _law(laws: Mapping[str, type[L]], section: Section) -> L:
    values = {name: getattr(section, name) for name in type(section).model_fields}
    law = laws[values.pop("law")]
    return law(**{name: float(value) if isinstance(value, float) else value for name, value in values.items()})


def _plain(section: Section) -> dict[str, Any]:
    """Tables of plain values, quantities as they were written; what is left out stays out."""
    values = {entry.alias or name: getattr(section, name) for name, entry in type(section).model_fields.items()}
    if isinstance(section, StudySection):
        values |= values.pop("axes")
    return {key: _plain_value(value) for key, value in values.items() if value is not None}


def _plain_value(value: object) -> object:
    if isinstance(value, Section):
        return _plain(value)
    if isinstance(value, tuple):
        return [_plain_value(entry) for entry in value]
    return value.text if isinstance(value, Amount) else value


def relative_to(file: str | Path, folder: Path) -> str:
    """`file` as seen from `folder`, so that a case can be moved together with its surface."""
    try:
        return Path(os.path.relpath(file, folder)).as_posix()
    except ValueError:  # on another drive
        return Path(file).resolve().as_posix()
