"""Laws and sections: every law of a table becomes a section of the case file, and what a case chose becomes laws again.

A parameter is a quantity where its law gives it a unit, else a plain value. Sections follow the tables of laws, so that
a law needs nothing here.
"""

from collections.abc import Mapping
from dataclasses import MISSING, fields
from functools import cache, partial
from typing import Annotated, Any, cast, get_type_hints

from pydantic import Field, PlainValidator, Strict, create_model

from asperity.case.amounts import (
    OPTIONAL,
    PAIRED,
    Conductivity,
    Density,
    HeatCapacity,
    Temperature,
    amount_type,
    default_amount,
    default_pair,
)
from asperity.case.refusals import Section, choose, validated
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
LAWS: dict[str, Mapping[str, type]] = {
    "viscosity": VISCOSITY_LAWS,
    "density": DENSITY_LAWS,
    "rheology": RHEOLOGY_LAWS,
    "friction": FRICTION_LAWS,
    "warmth": WARMTH_LAWS,
}


def section_fields(law: type, units: Mapping[str, str]) -> dict[str, Any]:
    """A dataclass's fields as fields of a section: quantities where they have a unit, else as annotated."""
    types = get_type_hints(law)
    section: dict[str, Any] = {}
    for entry in fields(law):
        unit = units.get(entry.name)
        default: Any = ... if entry.default is MISSING else entry.default
        kind = amount_type(unit) if unit else Annotated[types[entry.name], Strict()]
        if default is None:
            kind = Annotated[kind | None, OPTIONAL]
        written = default_amount(default, unit) if unit and isinstance(default, float) else default
        section[entry.name] = (kind, written)
    return section


@cache
def _law_section(name: str, law: type) -> type[Section]:
    return create_model(name, __base__=Section, law=(str, ...), **section_fields(law, _LAW_UNITS))


def _law_sections(family: str) -> dict[str, type[Section]]:
    return {name: _law_section(name, law) for name, law in LAWS[family].items()}


def _one_of(family: str) -> PlainValidator:
    return PlainValidator(partial(choose, "law", partial(_law_sections, family)))


def _law(family: str, section: Section) -> Any:
    values = {name: getattr(section, name) for name in type(section).model_fields}
    law = LAWS[family][values.pop("law")]
    return law(**{name: float(value) if isinstance(value, float) else value for name, value in values.items()})


class LubricantSection(Section):
    """[lubricant]: one law of each family."""

    viscosity: Annotated[Section, _one_of("viscosity")]
    density: Annotated[Section, _one_of("density")]
    rheology: Annotated[Section, _one_of("rheology")]
    friction: Annotated[Section, _one_of("friction"), Field(validate_default=True)] = cast(Section, "bair-winer")

    def lubricant(self) -> Lubricant:
        """The oil."""
        return Lubricant(**{family: _law(family, getattr(self, family)) for family in type(self).model_fields})


def parse_lubricant(value: object) -> LubricantSection | None:
    """The oil's section; None for "none", a dry contact."""
    return None if value == "none" else validated(LubricantSection, value)


class ThermalSection(Section):
    """[thermal]: what takes up the heat of sliding, and whether the film feels it."""

    ambient: Temperature = default_amount(Thermal().ambient, "K")
    bulk: Annotated[tuple[Temperature, Temperature] | None, PAIRED, OPTIONAL] = None  # of the bodies
    conductivity: Annotated[tuple[Conductivity, Conductivity], PAIRED] = default_pair(Solid().conductivity, "W/m/K")
    density: Annotated[tuple[Density, Density], PAIRED] = default_pair(Solid().density, "kg/m^3")
    heat_capacity: Annotated[tuple[HeatCapacity, HeatCapacity], PAIRED] = default_pair(Solid().heat_capacity, "J/kg/K")
    oil_conductivity: Conductivity = default_amount(Thermal().oil_conductivity, "W/m/K")
    warmth: Annotated[Section, _one_of("warmth"), Field(validate_default=True)] = cast(Section, "exponential")
    feedback: Annotated[bool, Strict()] = Thermal().feedback

    def thermal(self) -> Thermal:
        """The thermal side of the contact."""
        first, second = (
            Solid(conductivity=float(k), density=float(rho), heat_capacity=float(c))
            for k, rho, c in zip(self.conductivity, self.density, self.heat_capacity, strict=True)
        )
        return Thermal(
            ambient=float(self.ambient),
            bulk=None if self.bulk is None else (float(self.bulk[0]), float(self.bulk[1])),
            oil_conductivity=float(self.oil_conductivity),
            warmth=_law("warmth", self.warmth),
            solids=(first, second),
            feedback=self.feedback,
        )
