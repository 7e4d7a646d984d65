"""Conversion of stored values to their unit: by unit, scale and sensitivity."""

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from asperity.core.errors import BadInput
from asperity.recording.model import ACCELERATION, FULL_SCALE, UNKNOWN, Channel, Fact
from asperity.recording.sensitivity import (
    EXAMPLE,
    ChargeOutput,
    SensorSensitivity,
    parse_sensitivity,
)
from asperity.recording.units import acceleration_scale, velocity_scale, voltage_scale

_SAME_SENSITIVITY = 1e-3  # relative difference of sensitivities that agree


@dataclass(frozen=True, slots=True, kw_only=True)
class Conversion:
    """Conversion of stored values: they are in `unit` after multiplication by `scale`."""

    unit: str
    scale: float
    facts: dict[str, Fact]
    notes: tuple[str, ...]


def convert(path: Path, channel: Channel, stated: Mapping[str, Fact]) -> Conversion:
    """Return the conversion of a channel's values by what the file and `stated` facts say.

    Accelerations become m/s^2. Volts become accelerations or velocities by the sensitivity of the
    sensor, unless a scale is stated.

    Raises
    ------
    BadInput
        for facts that contradict one another or the file.
    """
    facts: dict[str, Fact] = {}
    notes: list[str] = []
    total = 1.0
    scale, stated_unit = stated.get("scale"), stated.get("unit")
    if scale is not None:
        total = _scale(scale)
        facts["scale"] = Fact(total, scale.source)
    found = _sensitivity(path, channel, stated)
    if found is not None and scale is None and _is_of_kind(found[0], stated_unit):
        stated_unit = None  # it is the unit after the conversion
    facts["unit"] = _unit(path, channel, stated_unit, scaled=scale is not None)
    unit = str(facts["unit"].value)
    if found is not None:
        sensitivity, source = found
        total *= (voltage_scale(unit) or 1.0) / sensitivity.volts
        facts["sensitivity"] = Fact(sensitivity.text, source)
        notes.append(f"{unit} converted by the sensitivity of {sensitivity.text} ({source})")
        unit = sensitivity.unit
    else:
        notes += _without_sensitivity(channel, unit, stated)
    to_metres = None if _is_force(channel.name, unit) else acceleration_scale(unit)
    if to_metres is not None:
        total, unit = total * to_metres, ACCELERATION
    elif unit == "g":
        unit = "gram-force"
        notes.append(f"g means grams of force, because the channel is called {channel.name}")
    return Conversion(unit=unit, scale=total, facts=facts, notes=tuple(notes))


def _sensitivity(
    path: Path, channel: Channel, stated: Mapping[str, Fact]
) -> tuple[SensorSensitivity, str] | None:
    """Return the sensitivity for values in volts, and its source; None without one."""
    unit_stated = "" if "unit" not in stated else str(stated["unit"].value)
    in_file = channel.unit or ""
    unit = unit_stated or in_file if "scale" in stated else in_file or unit_stated
    if voltage_scale(unit) is None:
        return None
    if "sensitivity" in stated:
        fact = stated["sensitivity"]
        sensitivity = parse_sensitivity(str(fact.value))
        _require_same(path, channel.sensitivity, sensitivity, fact.source)
        return sensitivity, fact.source
    try:
        return None if channel.sensitivity is None else _parsed(channel.sensitivity)
    except ChargeOutput as refusal:
        raise ChargeOutput(f"{path.name}: {refusal}") from None


def _parsed(text: str) -> tuple[SensorSensitivity, str] | None:
    """Return the sensitivity that a file states; None if it is not one of volts."""
    try:
        return parse_sensitivity(text), "file"
    except ChargeOutput:
        raise
    except BadInput:
        return None


def _require_same(path: Path, in_file: str | None, stated: SensorSensitivity, source: str) -> None:
    """Raise BadInput if the file states another sensitivity."""
    parsed = None if in_file is None else _parsed(in_file)
    if parsed is None:
        return
    volts, other_volts = (
        sensitivity.volts / _si_factor(sensitivity.unit) for sensitivity in (stated, parsed[0])
    )
    if abs(other_volts / volts - 1.0) > _SAME_SENSITIVITY:
        raise BadInput(
            f"{path.name} states a sensitivity of {in_file}, the {source} {stated.text}; remove "
            "the wrong one"
        )


def _si_factor(unit: str) -> float:
    return acceleration_scale(unit) or velocity_scale(unit) or 1.0


def _is_of_kind(sensitivity: SensorSensitivity, stated: Fact | None) -> bool:
    """Return whether a stated unit is that of the sensitivity: an acceleration, or the velocity."""
    unit = "" if stated is None else str(stated.value)
    if acceleration_scale(unit) is not None:
        return acceleration_scale(sensitivity.unit) is not None
    factor = velocity_scale(unit)
    return factor is not None and factor == velocity_scale(sensitivity.unit)


def _without_sensitivity(channel: Channel, unit: str, stated: Mapping[str, Fact]) -> list[str]:
    """Return what is missing for volts, and why a stated sensitivity is not used."""
    text = stated["sensitivity"].value if "sensitivity" in stated else channel.sensitivity
    if voltage_scale(unit) is not None:
        known = "no sensitivity is stated" if text is None else f"{text!r} is not a sensitivity"
        return [
            f"values are in {unit} and {known}; state it, such as "
            f'sensitivity = "{EXAMPLE}", in a sidecar'
        ]
    if unit == UNKNOWN and text is not None:
        return [
            f"a sensitivity of {text} is stated, but no unit of the values; state "
            'unit = "V" if they are volts'
        ]
    if "sensitivity" in stated:
        return [f"the sensitivity of {text} is not used, because the values are in {unit}"]
    return []


def _scale(stated: Fact) -> float:
    scale = float(stated.value)
    if not 0.0 < abs(scale) < math.inf:
        raise BadInput(
            f"scale must be finite and not 0, got {scale:g}; give `scale`, the value of a stored 1"
        )
    return scale


def _unit(path: Path, channel: Channel, stated: Fact | None, *, scaled: bool) -> Fact:
    if stated is None:
        if channel.full_scale:
            return Fact(FULL_SCALE, "file (integer samples)")
        return Fact(UNKNOWN, "not stated") if channel.unit is None else Fact(channel.unit, "file")
    if channel.full_scale and not scaled:
        raise BadInput(
            f"{path.name} holds shares of full scale, so a unit needs its scale; "
            f"give `scale`, the {stated.value} at full scale"
        )
    if channel.full_scale or channel.unit is None or scaled:
        return stated
    if not _same_unit(channel.unit, stated.value):
        raise BadInput(
            f"{path.name} states its unit as {channel.unit}, the {stated.source} as "
            f"{stated.value}; remove the wrong one, or give its scale too"
        )
    return Fact(stated.value, "file")


def _same_unit(unit: str, other: str) -> bool:
    first = acceleration_scale(unit)
    second = acceleration_scale(other)
    return unit.strip().lower() == other.strip().lower() or (first is not None and first == second)


def _is_force(name: str, unit: str) -> bool:
    """Return whether "g" means grams of force, as in friction testers' force channels."""
    last = name.split("/")[-1].split(".")[-1]
    return unit == "g" and re.fullmatch(r"(?i)F[xyznfrt]?|.*(force|load|kraft).*", last) is not None
