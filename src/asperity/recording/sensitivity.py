"""Sensitivity of a sensor, by which recorded volts become accelerations or velocities."""

import re
from collections.abc import Iterable
from contextlib import suppress
from dataclasses import dataclass

import numpy as np

from asperity.core.errors import BadInput
from asperity.recording.units import acceleration_scale, velocity_scale, voltage_scale

EXAMPLE = "100 mV/g"
_NAMED = re.compile(r"(?i)sensitivity|empfindlichkeit|sensibilit|übertragungsfaktor")
_UNIT = re.compile(r"(?i)[\s_-]units?$")
_NUMBER = r"[-+]?\d[\d.,]*(?:e[-+]?\d+)?"
_BARE = re.compile(rf"(?i){_NUMBER}")
_LIST = re.compile(r"\[([^\[\]]*)\]([^\[\]]*)")
_AMBIGUOUS = re.compile(r"[-+]?[1-9]\d{0,2},\d{3}(?![\d.,])")
_THOUSANDS = {  # by the decimal mark after them
    ".": re.compile(r"[-+]?[1-9]\d{0,2}(?:,\d{3})+(?:\.\d+|(?<=,\d{3},\d{3}))"),
    ",": re.compile(r"[-+]?[1-9]\d{0,2}(?:\.\d{3})+,\d+"),
}
_CHARGE = re.compile(r"^[pnµu]?c(?:oul\w*)?$")


class ChargeOutput(BadInput):
    """Sensitivity of a sensor in coulomb, which states no volts."""


@dataclass(frozen=True, slots=True)
class SensorSensitivity:
    """Sensitivity of a sensor: `volts` for one `unit` of acceleration or velocity."""

    volts: float
    unit: str
    text: str


def parse_sensitivity(text: str) -> SensorSensitivity:
    """Return a sensitivity as written in files: 100 mV/g, 10.2 mV/(m/s²), 4 V/(m/s), 10 g/V.

    Raises
    ------
    ChargeOutput
        for the charge of a piezoelectric sensor.
    BadInput
        for other units, a number that is not positive, or one that reads in two ways.
    """
    number, unit = _number_and_unit(text)
    upper, _, lower = (part.strip() for part in unit.partition("/"))
    if _CHARGE.fullmatch(upper.lower()):
        raise ChargeOutput(
            f"a sensitivity of {text} is that of a charge output, whose volts depend on the gain "
            "of its amplifier; state scale and unit instead"
        )
    if (volts := voltage_scale(upper)) and _is_measured(lower):
        return SensorSensitivity(number * volts, _bare(lower), text)
    measured, _, upper = (part.strip() for part in unit.rpartition("/"))
    if (volts := voltage_scale(upper)) and _is_measured(measured):
        return SensorSensitivity(volts / number, _bare(measured), text)
    raise _refusal(text)


def sensitivity_text(attributes: Iterable[tuple[str, object]]) -> str | None:
    """Return the sensitivity stated among named values, with its unit; None without one.

    The first value that is a sensitivity in volts counts: calibration dates and transverse
    sensitivities have the word in their names too. Several values, one for each channel, are
    separated by semicolons.
    """
    named = {str(key): _text(value) for key, value in attributes if _NAMED.search(str(key))}
    units = [text for key, text in named.items() if _UNIT.search(key)]
    texts = [
        _with_unit(text, _unit_in_name(key) or next(iter(units), ""))
        for key, text in named.items()
        if not _UNIT.search(key)
    ]
    for accepted in (_is_sensitivity, _is_charge, _is_ambiguous):
        for text in texts:
            if accepted(text):
                return text
    return texts[0] if texts else None


def _with_unit(text: str, unit: str) -> str:
    """Return values with their unit, separated by semicolons; equal ones once."""
    listed = _LIST.fullmatch(text.strip())
    if listed:
        text, unit = listed[1].replace(",", ";"), listed[2].strip() or unit
        text = re.sub(r"(?<=[\d.])\s+(?=[-+\d.])", ";", text)
    parts = [part.strip() for part in re.split(r"[\t;]", text) if part.strip()]
    if listed and len(set(parts)) == 1:
        parts = parts[:1]
    return "; ".join(f"{part} {unit}".strip() if _BARE.fullmatch(part) else part for part in parts)


def _is_sensitivity(text: str) -> bool:
    """Return whether one of the values separated by semicolons is a sensitivity in volts."""
    for part in text.split("; "):
        with suppress(BadInput):
            parse_sensitivity(part)
            return True
    return False


def _is_charge(text: str) -> bool:
    try:
        parse_sensitivity(text)
    except ChargeOutput:
        return True
    except BadInput:
        return False
    return False


def _is_ambiguous(text: str) -> bool:
    """Return whether a text is an ambiguous sensitivity, which is refused with a reason."""
    return _AMBIGUOUS.match(text) is not None


def _text(value: object) -> str:
    if isinstance(value, np.ndarray | list | tuple):
        return f"[{', '.join(_text(entry) for entry in np.ravel(value).tolist())}]"
    return value.decode("utf-8", "replace") if isinstance(value, bytes) else str(value)


def _unit_in_name(name: str) -> str:
    """Return the unit in a name such as Sensitivity (mV/g) or sensitivity_mv_per_g."""
    ending = re.split(_NAMED, name)[-1].lstrip("yé").replace("_per_", "/")
    return _bare(ending.strip(" _"))


def _bare(unit: str) -> str:
    """Return a unit without the brackets around it."""
    text = unit.strip()
    return text[1:-1].strip() if text[:1] + text[-1:] in ("()", "[]") else text


def _is_measured(unit: str) -> bool:
    bare = _bare(unit)
    return acceleration_scale(bare) is not None or velocity_scale(bare) is not None


def _number_and_unit(text: str) -> tuple[float, str]:
    plain = text.strip().replace(" per ", "/").replace("_per_", "/")
    matched = re.fullmatch(rf"(?i)({_NUMBER})\s*(\D.*?)(?:\s+rms)?", plain)
    if matched and _AMBIGUOUS.fullmatch(matched[1]):
        number = matched[1]
        raise BadInput(
            f"a sensitivity of {text} may be {number.replace(',', '.')} or "
            f"{number.replace(',', '')} {_bare(matched[2])}; write it without a comma"
        )
    value = _value(matched[1]) if matched else 0.0
    if matched is None or not 0.0 < value < float("inf"):
        raise _refusal(text)
    return value, _bare(matched[2])


def _value(number: str) -> float:
    """Return a number with a decimal point or comma, and perhaps thousands; 0 for another text."""
    for mark, thousands in _THOUSANDS.items():
        if thousands.fullmatch(number):
            number = number.replace("," if mark == "." else ".", "")
    try:
        return float(number.replace(",", "."))
    except ValueError:
        return 0.0


def _refusal(text: str) -> BadInput:
    return BadInput(
        f"a sensitivity must be positive, in volts per unit such as {EXAMPLE}, got {text!r}"
    )
