"""Laws and sections: every law of a table becomes a section of the case file, and what a case chose becomes laws again.

A parameter is a quantity where its law gives it a unit, else a plain value. Sections follow the tables of laws, so that
a law needs nothing here.
"""

from dataclasses import MISSING, fields
from functools import cache, partial
from typing import Annotated, Any, cast, get_type_hints

from pydantic import Field, PlainValidator, Strict, create_model

from asperity.case.amounts import OPTIONAL, PAIRED, amount_in, default_amount, plain
from asperity.case.refusals import Section, choose, validated
from asperity.lubricant import LAWS, LawFamily, Lubricant, Solid, Thermal, make_law, make_lubricant
from asperity.quantities import parameters


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
        entry.name: section_field(types[entry.name], entry.default, marks[entry.name].unit) for entry in fields(law)
    }


@cache
def _law_section(name: str, law: type) -> type[Section]:
    return create_model(name, __base__=Section, law=(str, ...), **section_fields(law))


def _one_of(family: LawFamily) -> PlainValidator:
    def sections() -> dict[str, type[Section]]:
        return {name: _law_section(name, law) for name, law in LAWS[family].items()}

    return PlainValidator(partial(choose, "law", sections))


def _description(section: Section) -> dict[str, Any]:
    return {name: plain(getattr(section, name)) for name in type(section).model_fields}


class LubricantSection(Section):
    """[lubricant]: one law of each family."""

    viscosity: Annotated[Section, _one_of("viscosity")]
    density: Annotated[Section, _one_of("density")]
    rheology: Annotated[Section, _one_of("rheology")]
    friction: Annotated[Section, _one_of("friction"), Field(validate_default=True)] = cast(Section, "bair-winer")

    def lubricant(self) -> Lubricant:
        """The oil."""
        return make_lubricant({family: _description(getattr(self, family)) for family in type(self).model_fields})


def parse_lubricant(value: object) -> LubricantSection | None:
    """The oil's section; None for "none", a dry contact."""
    return None if value == "none" else validated(LubricantSection, value)


def _both(kind: Any, default: Any) -> Any:
    return Annotated[tuple[kind, kind], PAIRED], (default, default)


_THERMAL, _SOLID = section_fields(Thermal), section_fields(Solid)
_NUMBERS: dict[str, Any] = {
    "ambient": _THERMAL["ambient"],
    "bulk": (Annotated[_both(*_THERMAL["ambient"])[0] | None, PAIRED, OPTIONAL], None),  # of the bodies
    **{name: _both(*field) for name, field in _SOLID.items()},
    "oil_conductivity": _THERMAL["oil_conductivity"],
}
_Numbers: Any = create_model("thermal", __base__=Section, **_NUMBERS)


class ThermalSection(_Numbers):  # type: ignore[misc]  # its numbers are those of `Thermal` and of both its `Solid`s
    """[thermal]: what takes up the heat of sliding, and whether the film feels it."""

    warmth: Annotated[Section, _one_of("warmth"), Field(validate_default=True)] = cast(Section, "exponential")
    feedback: Annotated[bool, Strict()] = Thermal().feedback

    def thermal(self) -> Thermal:
        """The thermal side of the contact."""
        first, second = (Solid(**{name: plain(getattr(self, name))[body] for name in _SOLID}) for body in (0, 1))
        return Thermal(
            ambient=plain(self.ambient),
            bulk=plain(self.bulk),
            oil_conductivity=plain(self.oil_conductivity),
            warmth=make_law("warmth", _description(self.warmth)),
            solids=(first, second),
            feedback=self.feedback,
        )
