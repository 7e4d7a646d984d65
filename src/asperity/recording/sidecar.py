"""Sidecars with facts about recordings: ring-07.csv.toml, ring-07.toml (or .json), recordings.toml.

recordings.toml applies to its whole folder.
"""

import json
import tomllib
from difflib import get_close_matches
from pathlib import Path
from typing import Any

from asperity.core.errors import BadInput
from asperity.recording.reader import parse_time

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
SIDECAR_KEYS = ("rate_hz", "unit", "channel", "scale", "started", *MACHINE_KEYS, *OPERATING_KEYS)
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
    own = [f"{name}{suffix}" for suffix in SUFFIXES]
    own += [f"{file.stem}{suffix}" for suffix in SUFFIXES if file.suffix]
    return [*own, *(f"{FOLDER_WIDE}{suffix}" for suffix in SUFFIXES)]


def read_sidecar(path: Path) -> tuple[dict[str, Any], str]:
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


def _checked(path: Path) -> dict[str, Any]:
    try:
        text = path.read_text("utf-8-sig")
        stated = tomllib.loads(text) if path.suffix == ".toml" else json.loads(text)
    except (OSError, ValueError, RecursionError) as error:
        raise BadInput(
            f"{path.name} cannot be read as {path.suffix[1:]} ({error}); correct it"
        ) from None
    if not isinstance(stated, dict):
        raise BadInput(f"{path.name} must hold keys such as rate_hz, got {type(stated).__name__}")
    for key, value in stated.items():
        if key not in SIDECAR_KEYS:
            closest = get_close_matches(key, SIDECAR_KEYS, 1)
            hint = (
                f"did you mean {closest[0]}?"
                if closest
                else (f"it may state {', '.join(SIDECAR_KEYS)}")
            )
            raise BadInput(f"{path.name} has an unknown key {key!r}; {hint}")
        number = isinstance(value, int | float) and not isinstance(value, bool)
        if key in ("rate_hz", "scale") and not (
            number and 0.0 < abs(value) < float("inf") and (value > 0 or key == "scale")
        ):
            raise BadInput(f"{path.name}: {key} must be a positive number, got {value!r}")
        if key in OPERATING_KEYS and not (
            number and -273.15 < value < float("inf") and (value > 0 or key == OPERATING_KEYS[2])
        ):
            expected = "a temperature in degC" if key == OPERATING_KEYS[2] else "a positive number"
            raise BadInput(f"{path.name}: {key} must be {expected}, got {value!r}")
        if key in FAULT_RATE_KEYS:
            _require_rates(path, key, value)
        if key == "bands_hz":
            _require_bands(path, value)
        if key == "condition_channels":
            _require_channels(path, value)
        if key == "pulses_per_turn" and not (number and 0.0 < value < float("inf")):
            raise BadInput(f"{path.name}: pulses_per_turn must be a positive number, got {value!r}")
        if key == "machine_class" and value not in MACHINE_CLASSES:
            raise BadInput(
                f"{path.name}: machine_class must be one of {', '.join(MACHINE_CLASSES)}, got "
                f"{value!r}"
            )
        if (
            key in ("unit", *TEXT_KEYS)
            and not isinstance(value, str)
            and not (key != "unit" and number)
        ):
            raise BadInput(f"{path.name}: {key} must be text, got {value!r}")
    if "started" in stated:
        started = parse_time(stated["started"])
        if started is None:
            raise BadInput(
                f"{path.name}: started must be a date and time such as 2025-01-31 12:00:00"
            )
        stated["started"] = started
    for key in TEXT_KEYS:
        if key in stated:
            stated[key] = str(stated[key])
    return stated


def _require_bands(path: Path, value: Any) -> None:
    """Require bands by name, such as housing = [2000, 5000]."""
    valid = isinstance(value, dict) and value
    for ends in value.values() if valid else ():
        is_pair = isinstance(ends, list) and len(ends) == 2
        valid = (
            valid
            and is_pair
            and all(type(end) in (int, float) for end in ends)
            and 0.0 <= ends[0] < ends[1]
        )
    if not valid:
        raise BadInput(
            f"{path.name}: bands_hz must be two frequencies by name, such as {{ housing = "
            f"[2000, 5000] }}, "
            f"got {value!r}"
        )


def _require_channels(path: Path, value: Any) -> None:
    """Require channels by the condition that they hold, such as temperature_degc = "oil"."""
    known = (
        isinstance(value, dict) and value and all(isinstance(name, str) for name in value.values())
    )
    if not known or not set(value) <= set(OPERATING_KEYS):
        raise BadInput(
            f"{path.name}: condition_channels must name channels by "
            f"{', '.join(OPERATING_KEYS)}, such as "
            f'{{ temperature_degc = "oil" }}, got {value!r}'
        )


def _require_rates(path: Path, key: str, value: Any) -> None:
    """Require fault rates by name, such as BPFO = 87.3."""
    valid = (
        isinstance(value, dict)
        and value
        and all(
            isinstance(rate, int | float)
            and not isinstance(rate, bool)
            and 0.0 < rate < float("inf")
            for rate in value.values()
        )
    )
    if not valid:
        raise BadInput(
            f"{path.name}: {key} must be positive rates by name, such as {{ BPFO = "
            f"{EXAMPLE_RATES[key]} }}, got {value!r}"
        )
