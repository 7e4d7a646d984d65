"""[vibration] of a case file: a preset's choices, and over them what the case says."""

import re
from collections.abc import Mapping
from dataclasses import fields
from typing import Any, Literal

from pydantic import create_model

from asperity.case.amounts import default_amount
from asperity.case.laws import section_fields
from asperity.case.refusals import Section, validated
from asperity.coupling import PRESETS, VibrationModel, preset_choices

_VIBRATION_UNITS = {
    "mass": "kg",
    "damping": "N s/m",
    "reference_depth": "m",
    "passing_speed": "m/s",
    "rate_hz": "Hz",
    "duration_s": "s",
    "cutoff_reference_hz": "Hz",
}


def _vibration_key(name: str) -> str:
    """The key of a field of VibrationModel: in a case, the unit stands beside the value."""
    return re.sub("_(hz|s)$", "", name)


_PRESET: Any = (Literal["sound", "paper"], "sound")
VibrationSection = create_model(
    "vibration",
    __base__=Section,
    preset=_PRESET,
    **{_vibration_key(name): kind for name, kind in section_fields(VibrationModel, _VIBRATION_UNITS).items()},
)


def parse_vibration(value: object) -> Any:
    """A preset's choices, and over them what the case says; None for "none"."""
    if value == "none":
        return None
    chosen = value.get("preset", "sound") if isinstance(value, Mapping) else "sound"
    if isinstance(value, Mapping) and isinstance(chosen, str) and chosen in PRESETS:
        value = {**_preset_table(chosen), **value}
    return validated(VibrationSection, value)


def _preset_table(name: str) -> dict[str, Any]:
    """A preset's choices as a case writes them."""
    units = _VIBRATION_UNITS
    return {
        _vibration_key(key): default_amount(choice, units[key]) if key in units else choice
        for key, choice in preset_choices(name).items()
    }


def preset_keys() -> tuple[str, ...]:
    """The keys that presets choose."""
    return tuple(map(_vibration_key, preset_choices("sound")))


def vibration_model(section: Any) -> VibrationModel | None:
    """The vibration model that a section states; None without one."""
    if section is None:
        return None
    values = {entry.name: getattr(section, _vibration_key(entry.name)) for entry in fields(VibrationModel)}
    plain: dict[str, Any] = {name: float(v) if isinstance(v, float) else v for name, v in values.items()}
    return VibrationModel(**plain)
