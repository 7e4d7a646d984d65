"""Laws and sections: every law of a table becomes a section of the case file, and what a case chose becomes laws again.

A parameter is a quantity where its law gives it a unit, else a plain value. Sections follow the
tables of laws, so that a law needs nothing here.
"""

from collections.abc import Mapping
from dataclasses import MISSING, fields
from functools import cache, partial
from typing import Annotated, Any, NamedTuple, cast, get_type_hints

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


def section_field(kind: Any, default: Any, unit: str) -> tuple[Any, Any]:
    """A parameter as a field of a section: a quantity where it has a unit, else as annotated; MISSING: required."""
    kind = Annotated[float, amount_in(unit)] if unit else Annotated[kind, Strict()]
    if default is None:
        kind = Annotated[kind | None, OPTIONAL]
    written = default_amount(default, unit) if unit and isinstance(default, float) else default
    return kind, ... if default is MISSING else written


def section_fields(law: type) -> dict[str, Any]:
    """A dataclass's fields as fields of a section."""
    types, marks = get_type_hints(law), parameters(law)
    return {
        entry.name: section_field(types[entry.name], entry.default, marks[entry.name].unit)
        for entry in fields(law)
    }


@cache
def _law_section(name: str, law: type) -> type[Section]:
    return create_model(name, __base__=Section, law=(str, ...), **section_fields(law))


def one_of(family: LawFamily) -> PlainValidator:
    """What reads a section's field that is a law of a family."""
    return one_of_table(LAWS[family])


def one_of_table(table: Mapping[str, type]) -> PlainValidator:
    """What reads a section's field that is a law of a table, by its name there."""

    def sections() -> dict[str, type[Section]]:
        return {name: _law_section(name, law) for name, law in table.items()}

    return PlainValidator(partial(choose, "law", sections))


def law_description(section: Section) -> dict[str, Any]:
    """A law's section as `make_law` takes it."""
    return {name: plain(getattr(section, name)) for name in type(section).model_fields}


class LubricantSection(Section):
    """[lubricant]: one law of each family."""

    viscosity: Annotated[Section, one_of("viscosity")]
    density: Annotated[Section, one_of("density")]
    rheology: Annotated[Section, one_of("rheology")]
    friction: Annotated[Section, one_of("friction"), Field(validate_default=True)] = cast(
        Section, "bair-winer"
    )

    def lubricant(self) -> Lubricant:
        """The oil."""
        return make_lubricant(
            {family: law_description(getattr(self, family)) for family in type(self).model_fields}
        )


def _both(kind: Any, default: Any) -> Any:
    return Annotated[tuple[kind, kind], PAIRED], (default, default)


_THERMAL, _SOLID = section_fields(Thermal), section_fields(Solid)
_NUMBERS: dict[str, Any] = {
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
    """What an oil by its data sheet says to [thermal]: its temperature [K], and -d(ln ν)/dT there [1/K]."""

    temperature: float
    thinning: float


class ThermalSection(_Numbers):  # type: ignore[misc]  # its numbers are those of `Thermal` and of both its `Solid`s
    """[thermal]: what takes up the heat of sliding, and whether the film feels it."""

    warmth: Annotated[Section, one_of("warmth"), Field(validate_default=True)] = cast(
        Section, "exponential"
    )
    feedback: Annotated[bool, Strict()] = Thermal().feedback

    @property
    def tacit(self) -> tuple[str, ...]:
        """Which of the keys that an oil by its data sheet can decide stand at their defaults."""
        default = ThermalSection()
        by_default = {
            "ambient": self.ambient.text == default.ambient.text,
            "warmth": self.warmth == default.warmth,
        }
        return tuple(key for key, tacit in by_default.items() if tacit)

    def thermal(self, oil: OilSupply | None = None) -> Thermal:
        """The thermal side of the contact; an oil by its data sheet decides what is left at its default.

        Raises BadInput for an ambient temperature that is neither the default nor the oil's.
        """
        tacit = () if oil is None else self.tacit
        ambient, warmth = plain(self.ambient), make_law("warmth", law_description(self.warmth))
        if oil is not None:
            if "ambient" not in tacit and ambient != oil.temperature:
                raise BadInput(
                    f"ambient of {self.ambient.text} is not the {oil.temperature - ZERO_CELSIUS:.6g} degC of "
                    "lubricant.temperature; leave ambient out"
                )
            ambient = oil.temperature
            warmth = ExponentialWarmth(oil.thinning) if "warmth" in tacit else warmth
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
        )
