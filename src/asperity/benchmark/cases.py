"""Cases of the benchmark, read from their files."""

import math
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from asperity.core.errors import BadInput

KINDS = ("dry", "wave", "ehl", "mixed", "conserving", "moving", "slider")
_BESIDE = Path(__file__).with_name("cases")  # in a wheel
_IN_REPOSITORY = Path(__file__).parents[3] / "benchmark" / "cases"


@dataclass(frozen=True)
class Certified:
    """A quantity with its value and uncertainty, in `unit`, and the ways that it was found by."""

    quantity: str
    unit: str
    value: float
    uncertainty: float
    ways: tuple[str, str]


@dataclass(frozen=True)
class BenchmarkCase:
    """A case: `given` in plain SI numbers, and what is certified of it."""

    name: str
    kind: str
    given: Mapping[str, Any]
    certified: tuple[Certified, ...]


def load_benchmark(folder: Path | None = None) -> tuple[BenchmarkCase, ...]:
    """The cases of a folder; without one, those that come with asperity.

    Raises
    ------
    BadInput
        for a folder without cases, and for a file that is no case.
    """
    place = folder or (_BESIDE if _BESIDE.is_dir() else _IN_REPOSITORY)
    files = sorted(place.glob("*.toml"))
    if not files:
        raise BadInput(
            f"{place} holds no cases of the benchmark (*.toml); name the folder that does"
        )
    return tuple(_read(path) for path in files)


def _read(path: Path) -> BenchmarkCase:
    try:
        given = tomllib.loads(path.read_text("utf-8"))
        certified = tuple(
            Certified(
                entry["quantity"],
                entry["unit"],
                float(entry["value"]),
                float(entry["uncertainty"]),
                (entry["ways"][0]["by"], entry["ways"][1]["by"]),
            )
            for entry in given.pop("certified")
        )
        kind = given["kind"]
    except (
        tomllib.TOMLDecodeError,
        UnicodeDecodeError,
        KeyError,
        IndexError,
        TypeError,
        ValueError,
    ) as error:
        raise BadInput(
            f"{path} is no case of the benchmark: {error!r}; benchmark/certify.py writes them"
        ) from None
    if kind not in KINDS:
        raise BadInput(f"{path}: kind must be one of {', '.join(KINDS)}, got {kind}")
    if any(not math.isfinite(entry.value) or entry.uncertainty <= 0.0 for entry in certified):
        raise BadInput(f"{path}: a value must be finite and its uncertainty positive")
    return BenchmarkCase(path.stem, kind, given, certified)
