"""Quantities with units, as a case file and the command line write them: read to SI, and written back as they stood.

The only module that knows pint, which is loaded for a unit that is not in the table of common
ones. Nothing deeper in the package has units other than SI.
"""

import math
import re
from decimal import Decimal
from functools import cache, lru_cache, partial
from tokenize import TokenError
from typing import TYPE_CHECKING, Annotated, Any, TypeAlias

from pydantic import BeforeValidator, Field, PlainValidator, PositiveInt, Strict

from asperity.case.messages import none_from_word, quoted, remedy_for
from asperity.core.errors import BadInput

if TYPE_CHECKING:
    import pint

_MEASURES = {  # SI unit -> what it measures, and how one is written
    "m": ("a length", "5.4 mm"),
    "N": ("a force", "500 N"),
    "m/s": ("a speed", "2 m/s"),
    "Pa": ("a pressure", "2 GPa"),
    "1/Pa": ("an inverse pressure", "18.2 1/GPa"),
    "Pa s": ("a viscosity", "0.096 Pa s"),
    "m^2/s": ("a kinematic viscosity", "100 mm^2/s"),
    "kg/m^3": ("a density", "0.88 g/cm^3"),
    "kg": ("a mass", "0.1 kg"),
    "s": ("a time", "2 s"),
    "Hz": ("a frequency", "50 kHz"),
    "N s/m": ("a damping coefficient", "80 N s/m"),
    "K": ("a temperature", "40 degC"),
    "1/K": ("an inverse temperature", "0.037 1/K"),
    "W/m/K": ("a thermal conductivity", "46 W/m/K"),
    "J/kg/K": ("a heat capacity", "460 J/kg/K"),
    "rad/s": ("a rotational speed", "1500 r/min"),
    "rad": ("an angle", "20 deg"),
    "N m": ("a torque", "265 N m"),
    "N/m": ("a stiffness", "30 N/mm"),
    "J/mol": ("a molar energy", "49 kJ/mol"),
}
_TURN = Decimal("6.283185307179586476925286766559")  # 2 pi
_PER_MINUTE = str(_TURN / 60)
# unit -> its SI unit, and what one is worth in it: pint and its registry take longer to load than a
# case
_COMMON = {
    "m": ("m", "1"),
    "mm": ("m", "1e-3"),
    "um": ("m", "1e-6"),
    "µm": ("m", "1e-6"),
    "nm": ("m", "1e-9"),
    "N": ("N", "1"),
    "kN": ("N", "1e3"),
    "m/s": ("m/s", "1"),
    "mm/s": ("m/s", "1e-3"),
    "Pa": ("Pa", "1"),
    "MPa": ("Pa", "1e6"),
    "GPa": ("Pa", "1e9"),
    "1/Pa": ("1/Pa", "1"),
    "1/GPa": ("1/Pa", "1e-9"),
    "Pa s": ("Pa s", "1"),
    "mPa s": ("Pa s", "1e-3"),
    "m^2/s": ("m^2/s", "1"),
    "mm^2/s": ("m^2/s", "1e-6"),
    "cSt": ("m^2/s", "1e-6"),
    "kg/m^3": ("kg/m^3", "1"),
    "g/cm^3": ("kg/m^3", "1e3"),
    "kg": ("kg", "1"),
    "g": ("kg", "1e-3"),
    "s": ("s", "1"),
    "Hz": ("Hz", "1"),
    "kHz": ("Hz", "1e3"),
    "N s/m": ("N s/m", "1"),
    "K": ("K", "1"),
    "1/K": ("1/K", "1"),
    "W/m/K": ("W/m/K", "1"),
    "J/kg/K": ("J/kg/K", "1"),
    "N m": ("N m", "1"),
    "N/m": ("N/m", "1"),
    "N/mm": ("N/m", "1e3"),
    "J/mol": ("J/mol", "1"),
    "kJ/mol": ("J/mol", "1e3"),
    "rad": ("rad", "1"),
    "mrad": ("rad", "1e-3"),
    "deg": ("rad", str(_TURN / 360)),
    "rad/s": ("rad/s", "1"),
    "rpm": ("rad/s", _PER_MINUTE),
}
_OURS = {
    "Nm": ("N m", "1"),
    "r/min": ("rad/s", _PER_MINUTE),
    "1/min": ("rad/s", _PER_MINUTE),
}  # not pint's, or another
_FREQUENCIES = {
    "Hz": "in hertz",
    "rad/s": "in r/min or rad/s",
}  # one for the other would be a factor 2 pi off
TINY = math.ulp(0.0)  # the least positive number
_WRITTEN = re.compile(r"\s*([+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)\s*([\w\s.*/^()·⁻-]*)")


class Amount(float):
    """A quantity in SI that remembers how it was written, so that a case is restated in its author's units."""

    text: str

    def __new__(cls, value: float, text: str) -> "Amount":
        """`value` in SI, `text` with its unit."""
        amount = super().__new__(cls, value)
        amount.text = text
        return amount

    def __getnewargs__(self) -> tuple[float, str]:  # type: ignore[override]  # or it could not be copied
        return float(self), self.text


def plain(value: Any) -> Any:
    """Numbers in SI without the text that they were written in, of a pair both; anything else as it stands."""
    if isinstance(value, tuple):
        return tuple(map(plain, value))
    return float(value) if isinstance(value, float) else value


_KINEMATIC = "a kinematic viscosity times the density is one: 100 cSt of 0.88 g/cm^3 are 88 mPa s"


class _UnusableUnit(ValueError):
    """What is wrong with a unit, as the end of a sentence."""


@cache
def _units() -> "pint.UnitRegistry[Decimal]":
    from pint import UnitRegistry

    return UnitRegistry(
        non_int_type=Decimal
    )  # decimal: 5.4 mm is the float nearest to 0.0054, not a product of floats


def _common(unit_text: str) -> tuple[str, str] | None:
    return _COMMON.get(unit_text) or _OURS.get(unit_text)


@lru_cache(
    4096
)  # a case states forty quantities, and a study states most of them a thousand times over
def _convert(number: str, unit_text: str, unit: str | None) -> Decimal:
    """A number of `unit_text` in `unit`; None is the SI unit of its kind."""
    own, wanted = _common(unit_text), _common(unit_text if unit is None else unit)
    if own is not None and wanted is not None and own[0] == wanted[0]:
        return Decimal(number) * Decimal(own[1]) / (1 if unit is None else Decimal(wanted[1]))
    import pint

    try:
        quantity = _units().Quantity(Decimal(number), unit_text)
        return (quantity.to_base_units() if unit is None else quantity.to(unit)).magnitude
    except pint.UndefinedUnitError:
        raise _UnusableUnit("whose unit is not known; capitals matter") from None
    except pint.DimensionalityError:
        kinematic = unit == "Pa s" and re.search(r"St\b|stokes|m(m)?(\^|\*\*)?2/s|m²/s", unit_text)
        celsius = unit == "K" and unit_text in ("C", "c", "degF", "F")
        remedy = (
            f"; {_KINEMATIC}"
            if kinematic
            else "; degrees Celsius are written degC or °C"
            if celsius
            else ""
        )
        raise _UnusableUnit(f"which is something else{remedy}") from None
    except (
        pint.PintError,
        ValueError,
        TypeError,
        AssertionError,
        ArithmeticError,
        SyntaxError,
        TokenError,
    ):
        raise _UnusableUnit("whose unit cannot be read") from None


def _split(value: object) -> tuple[str, str] | None:
    """Number and unit of a text, the unit "" where there is none; None for what is no quantity."""
    written = _WRITTEN.fullmatch(value.replace("°C", "degC")) if isinstance(value, str) else None
    return None if written is None else (written[1], " ".join(written[2].split()))


def parse_amount(unit: str, value: object, least: float = TINY) -> Amount:
    """A quantity of at least `least` in `unit`, an SI one: by default positive; 0, or minus infinity for any.

    The BadInput it raises begins with what it must be.
    """
    measure, example = _MEASURES.get(unit, (f"a quantity in {unit}", f"1 {unit}"))
    expected = f'must be {measure} such as "{example}"'
    if isinstance(value, Amount):
        return value
    if isinstance(value, int | float) and not isinstance(value, bool):
        raise BadInput(f"{expected}, got the bare number {value}; give it its unit")
    parts = _split(value)
    if parts is None:
        raise BadInput(f"{expected}, got {quoted(value)}{remedy_for(value, but='%')}")
    number, unit_text = parts
    if not unit_text:
        raise BadInput(f"{expected}, got {quoted(value)} without a unit")
    if (unit == "Hz" and "Hz" not in unit_text) or (
        unit == "rad/s" and (_common(unit_text) or ("",))[0] != unit
    ):
        raise BadInput(f"{expected}, got {quoted(value)}, which is not {_FREQUENCIES[unit]}")
    try:
        si = float(_convert(number, unit_text, unit))
    except _UnusableUnit as wrong:
        raise BadInput(f"{expected}, got {quoted(value)}, {wrong}") from None
    if not least <= si < math.inf:
        allowed = "positive and finite" if least == TINY else "finite, and not negative"
        raise BadInput(f"must be {allowed}, got {quoted(value)}; correct its sign or value")
    return Amount(si, f"{number} {unit_text}")


def read_amount(name: str, unit: str, text: str) -> float:
    """A positive quantity on the command line, such as "300 s", in `unit`, an SI one; BadInput begins with `name`."""
    try:
        return float(parse_amount(unit, text))
    except BadInput as error:
        raise BadInput(f"{name} {error}") from None


def read_length(name: str, text: str) -> float:
    """A length on the command line, such as "0.25 mm", in metres; raises what `read_amount` does."""
    return read_amount(name, "m", text)


def split_amount(value: object, unit: str | None = None) -> tuple[Decimal, str]:
    """A number and its unit as written, or the number in `unit`; a bare number has the unit "".

    Raises BadInput for what is neither, or cannot be had in `unit`.
    """
    bare = isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value)
    parts = (str(value), "") if bare else _split(value)
    if parts is None:
        raise BadInput(f'must be a number, or a quantity such as "0.5 um", got {quoted(value)}')
    number, own = parts
    if unit is None or own == unit:
        return Decimal(number), own
    try:
        if own and unit:
            return _convert(number, own, unit), unit
    except _UnusableUnit:
        pass
    raise BadInput(
        f"must be in {unit or 'no unit'} as the range's beginning is, got {quoted(value)}"
    )


def to_si(value: object) -> Any:
    """A value of a case file as a number in SI; two equal ones as one; what is no quantity as it stands."""
    if isinstance(value, list | tuple):
        entries = [to_si(entry) for entry in value]
        return entries[0] if len(entries) == 2 and entries[0] == entries[1] else entries
    if isinstance(value, int | float) and not isinstance(value, bool):
        return float(value)
    parts = _split(value)
    if parts is None or not parts[1]:
        return value
    try:
        return float(_convert(*parts, None))
    except _UnusableUnit:
        return value


def default_amount(value: float, unit: str) -> Amount:
    """A default of the library, written out with its unit."""
    return Amount(
        value, f"{value:g} {unit}" if float(f"{value:g}") == value else f"{value!r} {unit}"
    )


def amount_in(unit: str, least: float = TINY) -> PlainValidator:
    """What reads a section's field that is a quantity in `unit`, of at least `least`."""
    return PlainValidator(partial(parse_amount, unit, least=least))


def _paired(value: object) -> object:
    """One value for both bodies or both directions."""
    return value if value is None or isinstance(value, list | tuple) else (value, value)


Length: TypeAlias = Annotated[float, amount_in("m")]
Force: TypeAlias = Annotated[float, amount_in("N")]
Speed: TypeAlias = Annotated[float, amount_in("m/s")]
Pressure: TypeAlias = Annotated[float, amount_in("Pa")]
Number: TypeAlias = Annotated[float, Strict()]
Count: TypeAlias = Annotated[PositiveInt, Strict()]
Seed: TypeAlias = Annotated[int, Strict(), Field(ge=0)]
PAIRED = BeforeValidator(_paired)
OPTIONAL = BeforeValidator(none_from_word)
