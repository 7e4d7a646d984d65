"""[vibration] of a case file: a preset's choices, and over them what the case says."""

import re
from collections.abc import Mapping
from typing import Any, Literal

from pydantic import create_model

from asperity.case.amounts import default_amount
from asperity.case.laws import section_field
from asperity.case.refusals import Section, validated
from asperity.coupling import PRESETS, VibrationModel, preset_choices, vibration_choices


def _vibration_key(name: str) -> str:
    """The key of a keyword of VibrationModel: in a case, the unit stands beside the value."""
    return re.sub("_(hz|s)$", "", name)


_PRESET: Any = (Literal["sound", "paper"], "sound")
_FIELDS: dict[str, Any] = {_vibration_key(name): section_field(*choice) for name, choice in vibration_choices().items()}
VibrationSection = create_model("vibration", __base__=Section, preset=_PRESET, **_FIELDS)


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
    units = {key: choice.unit for key, choice in vibration_choices().items()}
    return {
        _vibration_key(key): default_amount(choice, units[key]) if units[key] else choice
        for key, choice in preset_choices(name).items()
    }


def preset_keys() -> tuple[str, ...]:
    """The keys that presets choose."""
    return tuple(map(_vibration_key, preset_choices("sound")))


def vibration_model(section: Any) -> VibrationModel | None:
    """The vibration model that a section states; None without one."""
    if section is None:
        return None
    values = {name: getattr(section, _vibration_key(name)) for name in vibration_choices()}
    plain: dict[str, Any] = {name: float(v) if isinstance(v, float) else v for name, v in values.items()}
    return VibrationModel(**plain)
