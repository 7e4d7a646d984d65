"""Rows of long benchmarks, stored in the repository; runs of many sessions add rows to the tables.

Each row names the commit of the code that computed it, with a + if code or examples had uncommitted
changes.
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
    """Return the current commit, with a + for uncommitted changes."""
    changed = _git("status", "--porcelain", "--", "src", "benchmarks", "examples")
    return _git("rev-parse", "--short=8", "HEAD") + "+" * bool(changed)


def _git(*arguments: str) -> str:
    return subprocess.run(
        ["git", *arguments], cwd=HERE.parent, capture_output=True, text=True, check=True
    ).stdout.strip()


class Rows:
    """Rows of a csv file; some columns are the keys."""

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
        """Append rows to the file, numbers to four digits."""
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
        """Return the commits of the rows, each with its number of rows."""
        found = [row["code"] for row in self]
        return ", ".join(f"{commit} ({found.count(commit)})" for commit in dict.fromkeys(found))


def _short(value: Any) -> Any:
    return f"{value:.{DIGITS}g}" if isinstance(value, float) else value
