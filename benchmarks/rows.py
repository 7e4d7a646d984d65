"""Rows of long benchmarks, kept in the repository, so that runs of many sessions add up and tables
are made of them.

Each row says by which code it was found: the commit, with a + where the code or its examples were
changed since.
"""

import csv
import subprocess
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

HERE = Path(__file__).parent
FOLDER = HERE.parent / "docs" / "benchmarks"
DIGITS = 4  # significant


def code() -> str:
    """The commit that is run."""
    changed = _git("status", "--porcelain", "--", "src", "benchmarks", "examples")
    return _git("rev-parse", "--short=8", "HEAD") + "+" * bool(changed)


def _git(*asked: str) -> str:
    return subprocess.run(
        ["git", *asked], cwd=HERE.parent, capture_output=True, text=True, check=True
    ).stdout.strip()


class Rows:
    """A csv of rows, of which some columns say which they are."""

    def __init__(self, path: Path, keys: Sequence[str]) -> None:
        self.path, self.keys, self.code = path, keys, code()
        self.done = {tuple(row[key] for key in keys) for row in self}

    def __iter__(self) -> Iterator[dict[str, str]]:
        if self.path.exists():
            with self.path.open(encoding="utf-8", newline="") as file:
                yield from csv.DictReader(file)

    def __contains__(self, key: Sequence[object]) -> bool:
        return tuple(map(str, key)) in self.done

    def write(self, rows: Sequence[Mapping[str, Any]]) -> None:
        """Put rows behind those that are there, numbers to four digits."""
        with self.path.open("a", encoding="utf-8", newline="") as file:
            writer = csv.DictWriter(file, ["code", *rows[0]], lineterminator="\n")
            if file.tell() == 0:
                writer.writeheader()
            for row in rows:
                writer.writerow(
                    {"code": self.code, **{key: _short(value) for key, value in row.items()}}
                )
        self.done |= {tuple(str(row[key]) for key in self.keys) for row in rows}

    def codes(self) -> str:
        """Which code how many rows are of."""
        found = [row["code"] for row in self]
        return ", ".join(f"{one} ({found.count(one)})" for one in dict.fromkeys(found))


def _short(value: Any) -> Any:
    return f"{value:.{DIGITS}g}" if isinstance(value, float) else value
