"""Benchmark cases, read from their files."""

import math
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeAlias

from asperity.core.errors import BadInput

CaseTable: TypeAlias = Mapping[str, Any]  # plain SI numbers of a case by key

KINDS = ("dry", "wave", "ehl", "mixed", "conserving", "moving", "slider")
_IN_PACKAGE = Path(__file__).with_name("cases")  # of an installed wheel
_IN_REPOSITORY = Path(__file__).parents[3] / "benchmark" / "cases"


@dataclass(frozen=True)
class Certified:
    """Certified quantity with its value and uncertainty in `unit`, and the two methods used."""

    quantity: str
    unit: str
    value: float
    uncertainty: float
    ways: tuple[str, str]


@dataclass(frozen=True)
class BenchmarkCase:
    """Benchmark case: `given` in plain SI numbers, and its certified quantities."""

    name: str
    kind: str
    given: CaseTable
    certified: tuple[Certified, ...]


def load_benchmark(folder: Path | None = None) -> tuple[BenchmarkCase, ...]:
    """Load the cases of a folder, by default those packaged with asperity.

    Raises
    ------
    BadInput
        for a folder without cases, or an invalid case file.
    """
    source = folder or (_IN_PACKAGE if _IN_PACKAGE.is_dir() else _IN_REPOSITORY)
    files = sorted(source.glob("*.toml"))
    if not files:
        raise BadInput(f"{source} contains no benchmark cases (*.toml); choose another folder")
    return tuple(_read(path) for path in files)


def _read(path: Path) -> BenchmarkCase:
    try:
        inputs = tomllib.loads(path.read_text("utf-8"))
        certified = tuple(
            Certified(
                entry["quantity"],
                entry["unit"],
                float(entry["value"]),
                float(entry["uncertainty"]),
                (entry["ways"][0]["by"], entry["ways"][1]["by"]),
            )
            for entry in inputs.pop("certified")
        )
        kind = inputs["kind"]
    except (
        tomllib.TOMLDecodeError,
        UnicodeDecodeError,
        KeyError,
        IndexError,
        TypeError,
        ValueError,
    ) as error:
        raise BadInput(
            f"{path} is not a benchmark case: {error!r}; benchmark/certify.py writes such files"
        ) from None
    if kind not in KINDS:
        raise BadInput(f"{path}: kind must be one of {', '.join(KINDS)}, got {kind}")
    if any(not math.isfinite(entry.value) or entry.uncertainty <= 0.0 for entry in certified):
        raise BadInput(f"{path}: a value must be finite and its uncertainty positive")
    return BenchmarkCase(path.stem, kind, inputs, certified)
