"""[lubricant] of a case file: laws with their parameters, or an oil's data sheet."""

from collections.abc import Mapping
from functools import cached_property
from typing import Annotated, cast

from pydantic import Field

from asperity.case.laws import LubricantSection, OilSupply, law_description, law_of_family
from asperity.case.messages import Section, validated
from asperity.case.units import OPTIONAL, Number, amount_in, plain
from asperity.core.errors import BadInput
from asperity.lubricant import (
    BaseOil,
    Lubricant,
    OilFact,
    OilSheet,
    Thickening,
    make_law,
    measured_oils,
    oil_facts,
    oil_notes,
)

_SHEET_KEYS = (
    "grade",
    "viscosity_40",
    "viscosity_100",
    "viscosity_index",
    "density_15",
    "alpha",
    "alpha_estimate",
)


class SheetSection(Section):
    """[lubricant]: an oil's data sheet at a temperature, in place of laws."""

    oil: Annotated[str | None, OPTIONAL] = None  # name of a measured oil
    grade: Annotated[str | None, OPTIONAL] = None
    viscosity_40: Annotated[Annotated[float, amount_in("m^2/s")] | None, OPTIONAL] = None
    viscosity_100: Annotated[Annotated[float, amount_in("m^2/s")] | None, OPTIONAL] = None
    viscosity_index: Annotated[Number | None, OPTIONAL] = None
    density_15: Annotated[Annotated[float, amount_in("kg/m^3")] | None, OPTIONAL] = None
    base: BaseOil = "mineral"
    alpha: Annotated[Annotated[float, amount_in("1/Pa")] | None, OPTIONAL] = None
    alpha_estimate: Annotated[str | None, OPTIONAL] = None
    temperature: Annotated[float, amount_in("K")]
    thickening: Thickening = "roelands"
    rheology: Annotated[Section, law_of_family("rheology"), Field(validate_default=True)] = cast(
        Section, "newtonian"
    )
    friction: Annotated[Section, law_of_family("friction"), Field(validate_default=True)] = cast(
        Section, "bair-winer"
    )

    @cached_property
    def sheet(self) -> OilSheet:
        """Data sheet; raises BadInput if it is inconsistent."""
        values = {name: plain(getattr(self, name)) for name in _SHEET_KEYS}
        if self.oil is None:
            return OilSheet(base=self.base, **values)
        others = [name for name, value in values.items() if value is not None]
        if others or self.base != "mineral":
            raise BadInput(
                f"has both oil and {[*others, 'base'][0]}; use oil alone for a measured oil, "
                "or leave oil out"
            )
        table = measured_oils()
        if self.oil not in table:
            raise BadInput(f'oil must be one of the measured {", ".join(table)}, got "{self.oil}"')
        return table[self.oil].sheet(plain(self.temperature))

    def lubricant(self) -> Lubricant:
        """Return the lubricant at its temperature."""
        return self.sheet.lubricant(
            plain(self.temperature),
            thickening=self.thickening,
            rheology=make_law("rheology", law_description(self.rheology)),
            friction=make_law("friction", law_description(self.friction)),
        )

    def supply(self) -> OilSupply:
        """Return the values that [thermal] takes from it."""
        temperature = plain(self.temperature)
        return OilSupply(temperature, self.sheet.walther.thinning(temperature))

    def facts(self) -> tuple[OilFact, ...]:
        """Return its numbers, stated and estimated."""
        return oil_facts(self.sheet, plain(self.temperature))

    def notes(self) -> tuple[str, ...]:
        """Return the notes for a reader of the results."""
        return oil_notes(self.sheet, plain(self.temperature))


def parse_lubricant(value: object) -> LubricantSection | SheetSection | None:
    """Parse [lubricant]; None for "none", a dry contact."""
    if value == "none":
        return None
    if not isinstance(value, Mapping) or {"viscosity", "density"}.isdisjoint(value):
        return validated(SheetSection, value)
    sheet = [
        key
        for key in SheetSection.model_fields
        if key in value and key not in LubricantSection.model_fields
    ]
    if sheet:
        law = next(key for key in ("viscosity", "density") if key in value)
        raise BadInput(
            f"has both {law} (a law) and {sheet[0]} (of a data sheet); keep either laws or data "
            'sheet, or replace the whole table: lubricant = { grade = "VG 100", '
            'temperature = "70 degC" }'
        )
    return validated(LubricantSection, value)
