"""Sections of a case file for tables of laws, and their conversion to laws.

A parameter is a quantity if its law gives it a unit, else a plain value. Sections follow the
tables of laws, so a new law needs nothing here.
"""

from collections.abc import Mapping
from dataclasses import MISSING, fields
from functools import cache, partial
from typing import Annotated, Any, NamedTuple, TypeAlias, cast, get_type_hints

from pydantic import Field, PlainValidator, Strict, create_model

from asperity.case.messages import Section, choose
from asperity.case.units import OPTIONAL, PAIRED, amount_in, default_amount, plain
from asperity.core.errors import BadInput
from asperity.core.quantities import parameters
from asperity.lubricant import (
    LAWS,
    ZERO_CELSIUS,
    ExponentialWarmth,
    LawFamily,
    Lubricant,
    Solid,
    Thermal,
    make_law,
    make_lubricant,
)

FieldSpecs: TypeAlias = dict[str, Any]  # type and default of a section's fields by name


def section_field(kind: Any, default: object, unit: str) -> tuple[object, object]:
    """Return a parameter as a section's field: a quantity if it has a unit; MISSING is required."""
    kind = Annotated[float, amount_in(unit)] if unit else Annotated[kind, Strict()]
    if default is None:
        kind = Annotated[kind | None, OPTIONAL]
    written = default_amount(default, unit) if unit and isinstance(default, float) else default
    return kind, ... if default is MISSING else written


def section_fields(law: type) -> FieldSpecs:
    """Return the fields of a dataclass as fields of a section."""
    types = get_type_hints(law)
    marks = parameters(law)
    return {
        entry.name: section_field(types[entry.name], entry.default, marks[entry.name].unit)
        for entry in fields(law)
    }


@cache
def _law_section(name: str, law: type) -> type[Section]:
    return create_model(name, __base__=Section, law=(str, ...), **section_fields(law))


def law_of_family(family: LawFamily) -> PlainValidator:
    """Return the validator of a field that is a law of a family."""
    return law_from_table(LAWS[family])


def law_from_table(table: Mapping[str, type]) -> PlainValidator:
    """Return the validator of a field that is a law of a table, by its name there."""

    def sections() -> dict[str, type[Section]]:
        return {name: _law_section(name, law) for name, law in table.items()}

    return PlainValidator(partial(choose, "law", sections))


def law_description(section: Section) -> dict[str, object]:
    """Return a law's section as `make_law` takes it."""
    return {name: plain(getattr(section, name)) for name in type(section).model_fields}


class LubricantSection(Section):
    """[lubricant]: one law per family."""

    viscosity: Annotated[Section, law_of_family("viscosity")]
    density: Annotated[Section, law_of_family("density")]
    rheology: Annotated[Section, law_of_family("rheology")]
    friction: Annotated[Section, law_of_family("friction"), Field(validate_default=True)] = cast(
        Section, "bair-winer"
    )

    def lubricant(self) -> Lubricant:
        """Return the lubricant."""
        return make_lubricant(
            {family: law_description(getattr(self, family)) for family in type(self).model_fields}
        )


def _both(kind: Any, default: object) -> tuple[Any, object]:
    return Annotated[tuple[kind, kind], PAIRED], (default, default)


_THERMAL = section_fields(Thermal)
_SOLID = section_fields(Solid)
_NUMBERS: FieldSpecs = {
    "ambient": _THERMAL["ambient"],
    "bulk": (
        Annotated[_both(*_THERMAL["ambient"])[0] | None, PAIRED, OPTIONAL],
        None,
    ),  # of the bodies
    **{name: _both(*field) for name, field in _SOLID.items()},
    "oil_conductivity": _THERMAL["oil_conductivity"],
}
_Numbers: Any = create_model("thermal", __base__=Section, **_NUMBERS)


class OilSupply(NamedTuple):
    """Values of [thermal] from an oil's data sheet: temperature [K], -d(ln ν)/dT there [1/K]."""

    temperature: float
    thinning: float


class ThermalSection(_Numbers):  # type: ignore[misc]  # fields of `Thermal` and `Solid`
    """[thermal]: conduction of the heat of sliding, and thermal feedback on the film."""

    warmth: Annotated[Section, law_of_family("warmth"), Field(validate_default=True)] = cast(
        Section, "exponential"
    )
    feedback: Annotated[bool, Strict()] = Thermal().feedback
    inlet_heating: Annotated[bool, Strict()] | None = Thermal().inlet_heating

    @property
    def defaulted(self) -> tuple[str, ...]:
        """Keys that an oil's data sheet can determine and that have their default."""
        default = ThermalSection()
        at_default = {
            "ambient": self.ambient.text == default.ambient.text,
            "warmth": self.warmth == default.warmth,
        }
        return tuple(key for key, unchanged in at_default.items() if unchanged)

    def thermal(self, oil: OilSupply | None = None) -> Thermal:
        """Return the thermal model; an oil's data sheet determines defaulted values.

        Raises BadInput for an ambient temperature that is neither the default nor the oil's.
        """
        defaulted = () if oil is None else self.defaulted
        ambient = plain(self.ambient)
        warmth = make_law("warmth", law_description(self.warmth))
        if oil is not None:
            if "ambient" not in defaulted and ambient != oil.temperature:
                raise BadInput(
                    f"ambient is {self.ambient.text}, but lubricant.temperature is "
                    f"{oil.temperature - ZERO_CELSIUS:.6g} degC; leave ambient out"
                )
            ambient = oil.temperature
            warmth = ExponentialWarmth(oil.thinning) if "warmth" in defaulted else warmth
        first, second = (
            Solid(**{name: plain(getattr(self, name))[body] for name in _SOLID}) for body in (0, 1)
        )
        return Thermal(
            ambient=ambient,
            bulk=plain(self.bulk),
            oil_conductivity=plain(self.oil_conductivity),
            warmth=warmth,
            solids=(first, second),
            feedback=self.feedback,
            inlet_heating=self.inlet_heating,
        )
