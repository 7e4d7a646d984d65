"""[wear] of a case file: wear model for `asperity wear`."""

from collections.abc import Callable, Mapping
from typing import Annotated, Any, TypeVar, cast

from pydantic import Field, PlainValidator, Strict, create_model

from asperity.case.laws import FieldSpecs, law_description, law_from_table
from asperity.case.messages import Section, quoted
from asperity.case.units import OPTIONAL, PAIRED, Count, amount_in, parse_amount, plain
from asperity.contact.conditions import ContactConditions
from asperity.core.errors import BadInput
from asperity.wear import MECHANISMS, REMOVAL_LAWS, SCATTER, SEVERITIES, WearCoefficient, WearModel

Made = TypeVar("Made")


def _parse_coefficient(value: object) -> object:
    """Parse a coefficient in 1/Pa, 0 or more, or the name of a wear class."""
    if isinstance(value, str) and value in SEVERITIES:
        return value
    if isinstance(value, str) and value.strip().isalpha():
        raise BadInput(
            f'must be a coefficient such as "1e-18 1/Pa", or one of {", ".join(SEVERITIES)}, '
            f"got {quoted(value)}"
        )
    return parse_amount("1/Pa", value, 0.0)


_FREQUENCY = Annotated[float, amount_in("Hz")]
_COEFFICIENT = Annotated[object, PlainValidator(_parse_coefficient)]
_MECHANISMS: FieldSpecs = {
    name: (Annotated[Section | None, law_from_table(table)], None)
    for name, table in MECHANISMS.items()
}
_Mechanisms: Any = create_model("wear", __base__=Section, **_MECHANISMS)


class WearSection(_Mechanisms):  # type: ignore[misc]  # with the keys of MECHANISMS
    """[wear]: law and coefficients of removal, flattening, mechanisms and length of jumps."""

    law: Annotated[Section, law_from_table(REMOVAL_LAWS), Field(validate_default=True)] = cast(
        Section, "archard"
    )
    k: Annotated[
        tuple[_COEFFICIENT, _COEFFICIENT], PAIRED
    ]  # of each body: 1/Pa, or "mild", "moderate", "severe"
    scatter: Annotated[float, Strict(), Field(ge=0.0, le=10.0)] = (
        SCATTER  # of a stated k: deviation of its logarithm
    )
    flattening: Annotated[bool, Strict()] = False  # keep plastic flattening
    overrolling: Annotated[tuple[_FREQUENCY, _FREQUENCY] | None, PAIRED, OPTIONAL] = None
    patches: Count | None = None
    step: Annotated[float, Strict(), Field(gt=0.0, le=0.5)] = WearModel.step

    def model(self, conditions: ContactConditions, boundary_friction: float) -> WearModel:
        """Return the wear model of the bodies of a contact."""
        law = _build_law(self.law, REMOVAL_LAWS)

        def coefficient(value: object) -> WearCoefficient:
            if not isinstance(value, str):
                result = WearCoefficient.from_value(plain(value), self.scatter)
                # refuses a law that cannot wear
                law.equivalent_coefficient(result.k, boundary_friction if result.k else 1.0)
                return result
            middle = WearCoefficient.from_severity(value, conditions.hardness)  # type: ignore[arg-type]
            return WearCoefficient(
                law.equivalent_coefficient(middle.k, boundary_friction), middle.low, middle.high
            )

        first, second = map(coefficient, self.k)
        overrolling = plain(self.overrolling)
        _require_circumference(overrolling, conditions)
        chosen = {name: getattr(self, name) for name in MECHANISMS}
        return WearModel(
            law=law,
            coefficients=(first, second),
            flattening=self.flattening,
            mechanisms={
                name: _build_law(section, MECHANISMS[name])
                for name, section in chosen.items()
                if section is not None
            },
            overrolling=overrolling,
            patches=self.patches,
            step=self.step,
        )


def _require_circumference(
    rates: tuple[float, float] | None, conditions: ContactConditions
) -> None:
    width = 2.0 * conditions.hertz.half_widths[0]
    for rate, speed in zip(rates or (), conditions.surface_speeds, strict=False):
        if 0.0 < abs(speed) < rate * width:
            raise BadInput(
                f"overrolling of {rate:.4g} Hz at {abs(speed):.4g} m/s implies a circumference of "
                f"{1e3 * abs(speed) / rate:.3g} mm, less than the contact width "
                f"({1e3 * width:.3g} mm); state how often a point of the body passes the contact"
            )


def _build_law(section: Section, table: Mapping[str, Callable[..., Made]]) -> Made:
    described = law_description(section)
    return table[str(described.pop("law"))](**described)
