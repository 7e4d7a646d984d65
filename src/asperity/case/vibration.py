"""[vibration] of a case file: the values of a preset, overridden by the case."""

import re
from collections.abc import Mapping
from typing import Literal

from pydantic import create_model

from asperity.case.laws import FieldSpecs, section_field
from asperity.case.messages import Section, validated
from asperity.case.units import default_amount, plain
from asperity.coupling import PRESETS, VibrationModel, preset_choices, vibration_choices


def _vibration_key(name: str) -> str:
    """Return the case key of a keyword of VibrationModel: without the unit's suffix."""
    return re.sub("_(hz|s)$", "", name)


_FIELDS: FieldSpecs = {
    _vibration_key(name): section_field(*choice) for name, choice in vibration_choices().items()
}
_FIELDS = {"preset": (Literal["sound", "paper"], "sound"), **_FIELDS}
VibrationSection = create_model("vibration", __base__=Section, **_FIELDS)


def parse_vibration(value: object) -> Section | None:
    """Parse [vibration]: a preset's values, overridden by the case; None for "none"."""
    if value == "none":
        return None
    chosen = value.get("preset", "sound") if isinstance(value, Mapping) else "sound"
    if isinstance(value, Mapping) and isinstance(chosen, str) and chosen in PRESETS:
        units = {key: choice.unit for key, choice in vibration_choices().items()}
        preset = preset_choices(chosen).items()
        written = {
            _vibration_key(key): default_amount(v, units[key]) if units[key] else v
            for key, v in preset
        }
        value = {**written, **value}
    return validated(VibrationSection, value)


def preset_keys() -> tuple[str, ...]:
    """Return the keys that presets determine."""
    return tuple(map(_vibration_key, preset_choices("sound")))


def vibration_model(section: Section | None) -> VibrationModel | None:
    """Return the vibration model of a section; None without one."""
    if section is None:
        return None
    return VibrationModel(
        **{name: plain(getattr(section, _vibration_key(name))) for name in vibration_choices()}
    )
