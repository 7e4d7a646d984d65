"""Sidecars with facts about recordings: ring-07.csv.toml, ring-07.toml (or .json), recordings.toml.

recordings.toml applies to its whole folder.
"""

import json
import math
import tomllib
from difflib import get_close_matches
from pathlib import Path

from asperity.core.errors import BadInput, shortened
from asperity.recording.reader import parse_time
from asperity.recording.sensitivity import parse_sensitivity

FOLDER_WIDE = "recordings"
OPERATING_KEYS = (
    "load_n",
    "entrainment_m_s",
    "temperature_degc",
    "speed_hz",
)  # operating conditions of a recording
FAULT_RATE_KEYS = ("faults_hz", "faults_per_turn")
EXAMPLE_RATES = {"faults_hz": 87.3, "faults_per_turn": 3.58}
MACHINE_KEYS = (
    "sensor",
    "machine_class",
    *FAULT_RATE_KEYS,
    "bands_hz",
    "tacho",
    "pulses_per_turn",
    "condition_channels",
)
SIGNAL_KEYS = (
    "rate_hz",
    "unit",
    "channel",
    "scale",
    "sensitivity",
    "started",
)
SIDECAR_KEYS = (*SIGNAL_KEYS, *MACHINE_KEYS, *OPERATING_KEYS)
SUFFIXES = (".toml", ".json")
TEXT_KEYS = ("channel", "tacho", "sensor")  # which may be numbers
MACHINE_CLASSES = (
    "large-rigid",
    "large-flexible",
    "medium-rigid",
    "medium-flexible",
)  # of ISO 20816-3


def is_sidecar(path: Path) -> bool:
    """Return whether a file has a sidecar's suffix."""
    return path.suffix.lower() in SUFFIXES


def sidecar_names(name: str) -> list[str]:
    """Return the possible names of a recording's sidecar, in order of precedence."""
    file = Path(name)
    names = [f"{name}{suffix}" for suffix in SUFFIXES]
    names += [f"{file.stem}{suffix}" for suffix in SUFFIXES if file.suffix]
    return [*names, *(f"{FOLDER_WIDE}{suffix}" for suffix in SUFFIXES)]


def read_sidecar(path: Path) -> tuple[dict[str, object], str]:
    """Return the facts stated in the sidecar of `path`, and its name; empty if there is none.

    Raises
    ------
    BadInput
        for a sidecar that cannot be read, an unknown key, or a wrong value.
    """
    for name in sidecar_names(path.name):
        candidate = path.with_name(name)
        if candidate.is_file():
            return _checked(candidate), name
    return {}, ""


def _checked(path: Path) -> dict[str, object]:
    stated = _read_keys(path)
    for key, value in stated.items():
        if key not in SIDECAR_KEYS:
            closest = get_close_matches(key, SIDECAR_KEYS, 1)
            hint = (
                f"did you mean {closest[0]}?"
                if closest
                else (f"it may state {', '.join(SIDECAR_KEYS)}")
            )
            raise BadInput(f"{path.name} has an unknown key {shortened(repr(key))}; {hint}")
        valid, requirement = _requirement(key, value)
        if not valid:
            raise BadInput(f"{path.name}: {key} must {requirement}, got {shortened(repr(value))}")
    if "started" in stated:
        started = parse_time(stated["started"])
        if started is None:
            raise BadInput(
                f"{path.name}: started must be a date and time such as 2025-01-31 12:00:00"
            )
        stated["started"] = started
    if "sensitivity" in stated:
        try:
            parse_sensitivity(str(stated["sensitivity"]))
        except BadInput as refusal:
            raise BadInput(f"{path.name}: {refusal}") from None
    return stated | {key: str(stated[key]) for key in TEXT_KEYS if key in stated}


def _read_keys(path: Path) -> dict[str, object]:
    try:
        text = path.read_text("utf-8-sig")
        stated = tomllib.loads(text) if path.suffix == ".toml" else json.loads(text)
    except (OSError, ValueError, RecursionError) as error:
        raise BadInput(
            f"{path.name} cannot be read as {path.suffix[1:]} ({error}); correct it"
        ) from None
    if not isinstance(stated, dict):
        raise BadInput(f"{path.name} must hold keys such as rate_hz, got {type(stated).__name__}")
    return stated


def _requirement(key: str, value: object) -> tuple[bool, str]:
    """Return whether a key may have a value, and what it must be."""
    number = _number(value)
    size = 0.0 if number is None else number
    if key == "scale":
        return 0.0 < abs(size) < math.inf, "be a positive number"
    if key == "temperature_degc":
        return number is not None and -273.15 < number < math.inf, "be a temperature in degC"
    if key in ("rate_hz", "pulses_per_turn", *OPERATING_KEYS):
        return 0.0 < size < math.inf, "be a positive number"
    if key == "machine_class":
        return value in MACHINE_CLASSES, f"be one of {', '.join(MACHINE_CLASSES)}"
    if key in ("unit", "sensitivity", *TEXT_KEYS):
        return isinstance(value, str) or (key in TEXT_KEYS and number is not None), "be text"
    return _table_requirement(key, value)


def _table_requirement(key: str, value: object) -> tuple[bool, str]:
    """Return `_requirement` of a key that holds values by name."""
    entries = value if isinstance(value, dict) else {}
    if key in FAULT_RATE_KEYS:
        rates = [_number(rate) or 0.0 for rate in entries.values()]
        valid = entries and all(0.0 < rate < math.inf for rate in rates)
        return bool(
            valid
        ), f"be positive fault frequencies by name, such as {{ BPFO = {EXAMPLE_RATES[key]} }}"
    if key == "bands_hz":
        valid = entries and all(map(_is_band, entries.values()))
        return bool(valid), ("be two frequencies by name, such as { housing = [2000, 5000] }")
    if key == "condition_channels":
        valid = entries and all(isinstance(name, str) for name in entries.values())
        return bool(valid) and set(entries) <= set(OPERATING_KEYS), (
            f'name channels by {", ".join(OPERATING_KEYS)}, such as {{ temperature_degc = "oil" }}'
        )
    return True, ""


def _number(value: object) -> float | None:
    return value if isinstance(value, int | float) and not isinstance(value, bool) else None


def _is_band(limits: object) -> bool:
    return (
        isinstance(limits, list)
        and len(limits) == 2
        and all(type(end) in (int, float) for end in limits)
        and bool(0.0 <= limits[0] < limits[1])
    )
