"""Quantities with units, as case files and the command line write them: conversion to SI and back.

The only module that uses pint, which is loaded for units outside the table of common ones. All
other modules use SI only.
"""

import math
import re
from collections.abc import Mapping
from decimal import Decimal
from functools import cache, lru_cache, partial
from numbers import Integral, Real
from tokenize import TokenError
from typing import TYPE_CHECKING, Annotated, Any, TypeAlias

from pydantic import BeforeValidator, Field, PlainValidator, PositiveInt, Strict

from asperity.case.messages import none_from_word, quoted, remedy_for
from asperity.core.errors import BadInput

if TYPE_CHECKING:
    import pint

_MEASURES = {  # SI unit -> quantity, and an example
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
    "ohm m": ("a resistivity", "0.22 uohm m"),
    "ohm m^2": ("a resistance times an area", "1 nohm m^2"),
    "J/mol": ("a molar energy", "49 kJ/mol"),
}
_TURN = Decimal("6.283185307179586476925286766559")  # 2 pi
_PER_MINUTE = str(_TURN / 60)
# unit -> its SI unit and the conversion factor: pint and its registry load slower than a case
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
# units that pint does not know, or reads differently
_CUSTOM = {
    "Nm": ("N m", "1"),
    "r/min": ("rad/s", _PER_MINUTE),
    "1/min": ("rad/s", _PER_MINUTE),
}
# confusing the two would be wrong by a factor of 2 pi
_FREQUENCIES = {"Hz": "in hertz", "rad/s": "in r/min or rad/s"}
HUGE = 1e300
MAX_UNIT = 60  # characters
WRITTEN_TABLES = "study", "infer"
TINY = math.ulp(0.0)  # the smallest positive number
_WRITTEN = re.compile(r"\s*([+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)\s*([\w\s.*/^()·⁻-]*)")


class Amount(float):
    """Quantity in SI that keeps its text, so that a case is written back in its author's units."""

    text: str

    def __new__(cls, value: float, text: str) -> "Amount":
        """Create an amount of `value` in SI, written as `text` with its unit."""
        amount = super().__new__(cls, value)
        amount.text = text
        return amount

    def __getnewargs__(self) -> tuple[float, str]:  # type: ignore[override]  # for copies
        return float(self), self.text


class SiFloat(float):
    """Number that a program states, in SI where its key has a unit."""


class SiInt(int):
    """Whole number that a program states, in SI where its key has a unit."""


def numbers_in_si(overrides: Mapping[str, object]) -> dict[str, object]:
    """Return overrides with all numbers marked as SI, but those of [study] and [infer].

    These are values of many quantities, which are written as in a file.
    """
    return {
        key: value if key.partition(".")[0] in WRITTEN_TABLES else _in_si(value)
        for key, value in overrides.items()
    }


def _in_si(value: object) -> object:
    if isinstance(value, Mapping):
        return {key: _in_si(part) for key, part in value.items()}
    if isinstance(value, list | tuple):
        return [_in_si(part) for part in value]
    if isinstance(value, bool | Amount):
        return value
    if isinstance(value, Integral):
        return SiInt(value)
    return SiFloat(value) if isinstance(value, Real) else value


def plain(value: object) -> Any:
    """Return floats without the text they were written in, also in pairs."""
    if isinstance(value, tuple):
        return tuple(map(plain, value))
    return float(value) if isinstance(value, float) else value


_KINEMATIC = "multiply a kinematic viscosity by the density: 100 cSt at 0.88 g/cm^3 are 88 mPa s"


class _UnusableUnit(ValueError):
    """Problem with a unit, as the end of a sentence."""


@cache
def _units() -> "pint.UnitRegistry[Decimal]":
    from pint import UnitRegistry

    # decimal: 5.4 mm is the float nearest to 0.0054, not a product of floats
    return UnitRegistry(non_int_type=Decimal)


def _common(unit_text: str) -> tuple[str, str] | None:
    return _COMMON.get(unit_text) or _CUSTOM.get(unit_text)


@lru_cache(4096)  # a case has forty quantities, and a study repeats most of them a thousand times
def _convert(number: str, unit_text: str, unit: str | None) -> Decimal:
    """Convert a number of `unit_text` to `unit`; None is the SI unit of its kind."""
    source = _common(unit_text)
    target = _common(unit_text if unit is None else unit)
    if source is not None and target is not None and source[0] == target[0]:
        return Decimal(number) * Decimal(source[1]) / (1 if unit is None else Decimal(target[1]))
    if len(unit_text) > MAX_UNIT:
        raise _UnusableUnit(f"whose unit is longer than {MAX_UNIT} characters")
    import pint

    try:
        quantity = _units().Quantity(Decimal(number), unit_text)
        return (quantity.to_base_units() if unit is None else quantity.to(unit)).magnitude
    except pint.UndefinedUnitError:
        raise _UnusableUnit("whose unit is unknown; units are case-sensitive") from None
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
        raise _UnusableUnit(f"which is another quantity{remedy}") from None
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
    """Split a text into number and unit ("" without one); None if it is no quantity."""
    written = _WRITTEN.fullmatch(value.replace("°C", "degC")) if isinstance(value, str) else None
    return None if written is None else (written[1], " ".join(written[2].split()))


def parse_amount(unit: str, value: object, least: float = TINY) -> Amount:
    """Parse a quantity in the SI unit `unit`, of at least `least`: by default positive.

    `least` is 0, or minus infinity for any value. The message of BadInput starts with the expected
    quantity.
    """
    measure, example = _MEASURES.get(unit, (f"a quantity in {unit}", f"1 {unit}"))
    expected = f'must be {measure} such as "{example}"'
    if isinstance(value, Amount):
        return value
    value = _as_text(value, unit)
    if isinstance(value, int | float) and not isinstance(value, bool):
        raise BadInput(f"{expected}, got the bare number {value}; add its unit")
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
    except _UnusableUnit as error:
        raise BadInput(f"{expected}, got {quoted(value)}, {error}") from None
    if not least <= si < math.inf:
        allowed = "positive and finite" if least == TINY else "finite and not negative"
        raise BadInput(f"must be {allowed}, got {quoted(value)}; correct its sign or value")
    return Amount(si, f"{number} {unit_text}")


def _as_text(value: object, unit: str) -> object:
    """Return a number that a program states as text in an SI unit; others unchanged."""
    if isinstance(value, SiFloat | SiInt):
        return default_amount(float(value) if abs(value) < HUGE else math.inf, unit).text
    return value


def read_amount(name: str, unit: str, text: str) -> float:
    """Read a positive quantity from the command line, such as "300 s", in the SI unit `unit`.

    The message of BadInput begins with `name`.

    Examples
    --------
    >>> from asperity.case import read_amount
    >>> round(read_amount("speed", "rad/s", "1500 rpm"), 2)
    157.08
    """
    try:
        return float(parse_amount(unit, text))
    except BadInput as error:
        raise BadInput(f"{name} {error}") from None


def read_length(name: str, text: str) -> float:
    """Read a length from the command line, such as "0.25 mm", in m; raises as `read_amount`.

    Examples
    --------
    >>> from asperity.case import read_length
    >>> read_length("pixel", "0.5 um")
    5e-07
    """
    return read_amount(name, "m", text)


def split_amount(value: object, unit: str | None = None) -> tuple[Decimal, str]:
    """Split a quantity into number and unit as written, or convert the number to `unit`.

    A bare number has the unit "". Raises BadInput for anything else, or if it cannot be converted.

    Examples
    --------
    >>> from asperity.case import split_amount
    >>> split_amount("2.5 um")
    (Decimal('2.5'), 'um')
    """
    bare = isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value)
    parts = (str(value), "") if bare else _split(value)
    if parts is None:
        raise BadInput(f'must be a number, or a quantity such as "0.5 um", got {quoted(value)}')
    number, written_unit = parts
    if unit is None or written_unit == unit:
        return Decimal(number), written_unit
    try:
        if written_unit and unit:
            return _convert(number, written_unit, unit), unit
    except _UnusableUnit:
        pass
    raise BadInput(
        f"must have {f'the unit {unit}' if unit else 'no unit'}, as the start of the range, "
        f"got {quoted(value)}"
    )


def to_si(value: object) -> Any:
    """Return a value of a case file in SI; two equal values as one; anything else unchanged.

    Examples
    --------
    >>> from asperity.case import to_si
    >>> to_si("20 N/mm")
    20000.0
    """
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
    """Return a library default as an amount with its unit."""
    return Amount(
        value, f"{value:g} {unit}" if float(f"{value:g}") == value else f"{value!r} {unit}"
    )


def amount_in(unit: str, least: float = TINY) -> PlainValidator:
    """Return the validator of a quantity in `unit`, of at least `least`."""
    return PlainValidator(partial(parse_amount, unit, least=least))


def _paired(value: object) -> object:
    """Return a pair for one value that holds for both bodies or directions."""
    return value if value is None or isinstance(value, list | tuple) else (value, value)


Length: TypeAlias = Annotated[float, amount_in("m")]
Force: TypeAlias = Annotated[float, amount_in("N")]
Speed: TypeAlias = Annotated[float, amount_in("m/s")]
SpeedOrRest: TypeAlias = Annotated[float, amount_in("m/s", 0.0)]
Pressure: TypeAlias = Annotated[float, amount_in("Pa")]
Number: TypeAlias = Annotated[float, Strict()]
Count: TypeAlias = Annotated[PositiveInt, Strict()]
Seed: TypeAlias = Annotated[int, Strict(), Field(ge=0)]
PAIRED = BeforeValidator(_paired)
OPTIONAL = BeforeValidator(none_from_word)
