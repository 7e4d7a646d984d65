"""Units of case files: which are accepted for a quantity, and exact conversion of pairs."""

from decimal import Decimal
from math import pi

import pytest

from asperity.case.units import parse_amount, split_amount
from asperity.core.errors import BadInput


@pytest.mark.parametrize(
    ("text", "unit", "si"),
    [
        ("60 r/min", "rad/s", 2.0 * pi),
        ("60 rpm", "rad/s", 2.0 * pi),
        ("3 rad/s", "rad/s", 3.0),
        ("2 kHz", "Hz", 2000.0),
        ("0.5 um", "m", 0.5e-6),
        ("500 N", "N", 500.0),
        ("1.2 GPa", "Pa", 1.2e9),
        ("40 degC", "K", 313.15),
        ("90 cSt", "m^2/s", 90e-6),
        ("18 1/GPa", "1/Pa", 18e-9),
    ],
)
def test_an_amount_is_converted_to_si(text, unit, si):
    assert float(parse_amount(unit, text)) == pytest.approx(si, rel=1e-12)


@pytest.mark.parametrize(
    ("text", "unit"),
    [
        ("3 rad/s", "Hz"),
        ("60 r/min", "Hz"),
        ("2 Hz", "rad/s"),
        ("2 1/s", "rad/s"),
        ("1 m", "N"),
        ("1", "m"),
        ("0 m", "m"),
        ("-1 m", "m"),
        ("1e400 m", "m"),
    ],
)
def test_another_quantity_is_refused(text, unit):
    with pytest.raises(BadInput):
        parse_amount(unit, text)


@pytest.mark.parametrize(
    ("text", "unit", "number"),
    [
        ("2.5 um", "um", "2.5"),
        ("2.5 um", "mm", "0.0025"),
        ("2.5 mm", "um", "2500"),
        ("7", "", "7"),
        ("0.1 MPa", "kPa", "100"),
    ],
)
def test_the_end_of_a_range_is_converted_to_the_unit_of_its_start(text, unit, number):
    assert split_amount(text, unit) == (Decimal(number), unit)


@pytest.mark.parametrize(
    ("text", "unit"), [("2 N", "um"), ("2 um", "N"), ("2", "um"), ("2 um", "")]
)
def test_the_end_of_a_range_has_the_quantity_of_its_start(text, unit):
    with pytest.raises(BadInput, match="must have"):
        split_amount(text, unit)
