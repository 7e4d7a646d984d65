"""[material] of a case file: the two bodies, by name or by their properties."""

from collections.abc import Mapping
from typing import Annotated

from pydantic import Field, Strict, model_validator

from asperity.case.messages import LocatedError, Section, quoted
from asperity.case.units import OPTIONAL, PAIRED, Number, Pressure
from asperity.contact.materials import Material, material
from asperity.core.errors import BadInput
from asperity.solution import BOUNDARY_FRICTION

NAMED = ("youngs_modulus", "poisson_ratio", "hardness")  # keys that a name determines ...
NAMED_THERMAL = ("conductivity", "density", "heat_capacity")  # ... and those in [thermal]


class MaterialSection(Section):
    """[material]: the two bodies."""

    name: Annotated[tuple[str, str] | None, PAIRED] = None
    youngs_modulus: Annotated[tuple[Pressure, Pressure], PAIRED]
    poisson_ratio: Annotated[tuple[Number, Number], PAIRED]
    hardness: Annotated[Pressure | None, OPTIONAL] = None
    boundary_friction: Annotated[float, Strict(), Field(ge=0.0, le=2.0)] = BOUNDARY_FRICTION

    @model_validator(mode="before")
    @classmethod
    def _fill(cls, table: object) -> object:
        return {**_properties(table), **table} if isinstance(table, Mapping) else table


def _properties(table: Mapping[str, object]) -> dict[str, object]:
    """Return the keys that the names in a table determine; the softer body limits the pressure."""
    bodies = named_bodies(table)
    if bodies is None:
        return {}
    return {
        "youngs_modulus": [f"{body.youngs_modulus / 1e9:g} GPa" for body in bodies],
        "poisson_ratio": [body.poisson_ratio for body in bodies],
        "hardness": f"{min(body.hardness for body in bodies) / 1e9:g} GPa",
    }


def named_bodies(table: Mapping[str, object]) -> tuple[Material, Material] | None:
    """Return the materials of both bodies that a table names; None without names."""
    names = table.get("name")
    if names is None:
        return None
    names = names if isinstance(names, list | tuple) else (names, names)
    if len(names) != 2 or not all(isinstance(name, str) for name in names):
        raise LocatedError(
            ("name",), f"must be one name for both bodies or a list of two, got {quoted(names)}"
        )
    try:
        first, second = (material(name) for name in names)
    except BadInput as error:
        raise LocatedError(("name",), str(error)) from None
    return first, second


def with_named_solids(tables: Mapping[str, object]) -> Mapping[str, object]:
    """Return the tables of a case with the thermal properties of named materials."""
    material_table, thermal = tables.get("material"), tables.get("thermal", {})
    if not isinstance(material_table, Mapping) or not isinstance(thermal, Mapping):
        return tables
    try:
        bodies = named_bodies(material_table)
    except LocatedError as error:
        raise LocatedError(("material", *error.keys), error.message) from None
    if bodies is None:
        return tables
    units = {"conductivity": "W/m/K", "density": "kg/m^3", "heat_capacity": "J/kg/K"}
    solids = {
        key: [f"{getattr(body, key):g} {units[key]}" for body in bodies] for key in NAMED_THERMAL
    }
    return {**tables, "thermal": {**solids, **thermal}}
