"""Facts that stand beside a recording: ring-07.csv.toml, ring-07.toml (or .json), or recordings.toml for a folder."""

import json
import tomllib
from difflib import get_close_matches
from pathlib import Path
from typing import Any

from asperity.core.errors import BadInput
from asperity.recording.reader import parse_time

FOLDER_WIDE = "recordings"
OPERATING = (
    "load_n",
    "entrainment_m_s",
    "temperature_degc",
    "speed_hz",
)  # what a recording was made at
RATES = ("faults_hz", "faults_per_turn")
SUCH = {"faults_hz": 87.3, "faults_per_turn": 3.58}
OF_THE_MACHINE = (
    "sensor",
    "machine_class",
    *RATES,
    "bands_hz",
    "tacho",
    "pulses_per_turn",
    "condition_channels",
)
KEYS = ("rate_hz", "unit", "channel", "scale", "started", *OF_THE_MACHINE, *OPERATING)
SUFFIXES = (".toml", ".json")
NAMES = ("channel", "tacho", "sensor")  # which may be numbers
MACHINE_CLASSES = (
    "large-rigid",
    "large-flexible",
    "medium-rigid",
    "medium-flexible",
)  # of ISO 20816-3


def is_sidecar(path: Path) -> bool:
    """Whether a file tells about recordings instead of being one."""
    return path.suffix.lower() in SUFFIXES


def names_beside(name: str) -> list[str]:
    """Names that a recording's sidecar may have, the one that counts first."""
    bare = Path(name)
    own = [f"{name}{suffix}" for suffix in SUFFIXES]
    own += [f"{bare.stem}{suffix}" for suffix in SUFFIXES if bare.suffix]
    return [*own, *(f"{FOLDER_WIDE}{suffix}" for suffix in SUFFIXES)]


def stated_beside(path: Path) -> tuple[dict[str, Any], str]:
    """What is stated beside `path`, and the name of the file that states it; nothing, if there is none.

    Raises
    ------
    BadInput
        for a sidecar that cannot be read, an unknown key, or a value that is none of its kind.
    """
    for name in names_beside(path.name):
        there = path.with_name(name)
        if there.is_file():
            return _checked(there), name
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
        if key not in KEYS:
            near = get_close_matches(key, KEYS, 1)
            hint = f"did you mean {near[0]}?" if near else f"it may state {', '.join(KEYS)}"
            raise BadInput(f"{path.name} has an unknown key {key!r}; {hint}")
        number = isinstance(value, int | float) and not isinstance(value, bool)
        if key in ("rate_hz", "scale") and not (
            number and 0.0 < abs(value) < float("inf") and (value > 0 or key == "scale")
        ):
            raise BadInput(f"{path.name}: {key} must be a positive number, got {value!r}")
        if key in OPERATING and not (
            number and -273.15 < value < float("inf") and (value > 0 or key == OPERATING[2])
        ):
            what = "a temperature in degC" if key == OPERATING[2] else "a positive number"
            raise BadInput(f"{path.name}: {key} must be {what}, got {value!r}")
        if key in RATES:
            _require_rates(path, key, value)
        if key == "bands_hz":
            _require_bands(path, value)
        if key == "condition_channels":
            _require_channels(path, value)
        if key == "pulses_per_turn" and not (number and 0.0 < value < float("inf")):
            raise BadInput(f"{path.name}: pulses_per_turn must be a positive number, got {value!r}")
        if key == "machine_class" and value not in MACHINE_CLASSES:
            raise BadInput(
                f"{path.name}: machine_class must be one of {', '.join(MACHINE_CLASSES)}, got {value!r}"
            )
        if (
            key in ("unit", *NAMES)
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
    for key in NAMES:
        if key in stated:
            stated[key] = str(stated[key])
    return stated


def _require_bands(path: Path, value: Any) -> None:
    """Bands by their names, such as housing = [2000, 5000]."""
    numbers = isinstance(value, dict) and value
    for ends in value.values() if numbers else ():
        two = isinstance(ends, list) and len(ends) == 2
        numbers = (
            numbers
            and two
            and all(type(end) in (int, float) for end in ends)
            and 0.0 <= ends[0] < ends[1]
        )
    if not numbers:
        raise BadInput(
            f"{path.name}: bands_hz must be two frequencies by name, such as {{ housing = [2000, 5000] }}, "
            f"got {value!r}"
        )


def _require_channels(path: Path, value: Any) -> None:
    """Channels by the condition that they hold, such as temperature_degc = "oil"."""
    known = (
        isinstance(value, dict) and value and all(isinstance(name, str) for name in value.values())
    )
    if not known or not set(value) <= set(OPERATING):
        raise BadInput(
            f"{path.name}: condition_channels must name channels by {', '.join(OPERATING)}, such as "
            f'{{ temperature_degc = "oil" }}, got {value!r}'
        )


def _require_rates(path: Path, key: str, value: Any) -> None:
    """Rates at which faults pass, by their names, such as BPFO = 87.3."""
    numbers = (
        isinstance(value, dict)
        and value
        and all(
            isinstance(rate, int | float)
            and not isinstance(rate, bool)
            and 0.0 < rate < float("inf")
            for rate in value.values()
        )
    )
    if not numbers:
        raise BadInput(
            f"{path.name}: {key} must be positive rates by name, such as {{ BPFO = {SUCH[key]} }}, got {value!r}"
        )
