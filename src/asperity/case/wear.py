"""[wear] of a case file: how the contact wears, for `asperity wear`."""

from typing import Annotated, Any, cast

from pydantic import Field, PlainValidator, Strict, create_model

from asperity.case.laws import law_description, one_of_table
from asperity.case.messages import Section, quoted
from asperity.case.units import OPTIONAL, PAIRED, Count, amount_in, parse_amount, plain
from asperity.contact.conditions import ContactConditions
from asperity.core.errors import BadInput
from asperity.wear import (
    MECHANISMS,
    REMOVAL_LAWS,
    SCATTER,
    SEVERITIES,
    RemovalLaw,
    WearCoefficient,
    WearModel,
)


def _parse_coefficient(value: object) -> Any:
    """An amount in 1/Pa, 0 or more, or the name of a class of wear."""
    if isinstance(value, str) and value in SEVERITIES:
        return value
    if isinstance(value, str) and value.strip().isalpha():
        raise BadInput(
            f'must be such as "1e-18 1/Pa", or one of {", ".join(SEVERITIES)}, got {quoted(value)}'
        )
    return parse_amount("1/Pa", value, 0.0)


_FREQUENCY = Annotated[float, amount_in("Hz")]
_COEFFICIENT = Annotated[Any, PlainValidator(_parse_coefficient)]
_MECHANISMS: dict[str, Any] = {
    name: (Annotated[Section | None, one_of_table(table)], None)
    for name, table in MECHANISMS.items()
}
_Mechanisms: Any = create_model("wear", __base__=Section, **_MECHANISMS)


class WearSection(_Mechanisms):  # type: ignore[misc]  # the keys of what roughens are those of MECHANISMS
    """[wear]: law and coefficients of removal, flattening, what roughens, and how time is cut into jumps."""

    law: Annotated[Section, one_of_table(REMOVAL_LAWS), Field(validate_default=True)] = cast(
        Section, "archard"
    )
    k: Annotated[
        tuple[_COEFFICIENT, _COEFFICIENT], PAIRED
    ]  # of each body: 1/Pa, or "mild", "moderate", "severe"
    scatter: Annotated[float, Strict(), Field(ge=0.0, le=10.0)] = (
        SCATTER  # of a stated k: deviation of its logarithm
    )
    flattening: Annotated[bool, Strict()] = False  # what is pressed flat stays flat
    overrolling: Annotated[tuple[_FREQUENCY, _FREQUENCY] | None, PAIRED, OPTIONAL] = None
    patches: Count | None = None
    step: Annotated[float, Strict(), Field(gt=0.0, le=0.5)] = WearModel.step

    def model(self, conditions: ContactConditions, boundary_friction: float) -> WearModel:
        """How the bodies of a contact wear."""
        law = cast(RemovalLaw, _made(self.law, REMOVAL_LAWS))

        def coefficient(stated: Any) -> WearCoefficient:
            if not isinstance(stated, str):
                known = WearCoefficient.from_value(plain(stated), self.scatter)
                law.equivalent_coefficient(
                    known.k, boundary_friction if known.k else 1.0
                )  # which refuses what cannot wear
                return known
            middle = WearCoefficient.from_severity(stated, conditions.hardness)  # type: ignore[arg-type]
            return WearCoefficient(
                law.equivalent_coefficient(middle.k, boundary_friction), middle.low, middle.high
            )

        first, second = map(coefficient, self.k)
        overrolling = plain(self.overrolling)
        _require_ways_round(overrolling, conditions)
        chosen = {name: getattr(self, name) for name in MECHANISMS}
        return WearModel(
            law=law,
            coefficients=(first, second),
            flattening=self.flattening,
            mechanisms={
                name: _made(one, MECHANISMS[name])
                for name, one in chosen.items()
                if one is not None
            },
            overrolling=overrolling,
            patches=self.patches,
            step=self.step,
        )


def _require_ways_round(rates: tuple[float, float] | None, conditions: ContactConditions) -> None:
    width = 2.0 * conditions.hertz.half_widths[0]
    for rate, speed in zip(rates or (), conditions.surface_speeds, strict=False):
        if 0.0 < abs(speed) < rate * width:
            raise BadInput(
                f"overrolling of {rate:.4g} Hz at {abs(speed):.4g} m/s is a body {1e3 * abs(speed) / rate:.3g} mm "
                f"round, less than the contact is wide ({1e3 * width:.3g} mm); state how often a point of it passes"
            )


def _made(section: Section, table: Any) -> Any:
    described = law_description(section)
    return table[described.pop("law")](**described)
