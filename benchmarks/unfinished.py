"""State of a benchmark run that can be resumed: the parts that have ended."""

import hashlib
import json
from collections.abc import Sequence
from dataclasses import dataclass, field
from datetime import datetime
from pathlib import Path

FILE = Path("build/benchmarks.json")
PACKAGE = Path(__file__).parents[1] / "src" / "asperity"

Ended = tuple[float, str, list[str]]  # seconds, failure, changes from the last run


@dataclass
class Unfinished:
    """A run's parts and the results of those that have ended."""

    parts: tuple[str, ...]
    whole: bool
    began: str
    file: Path | None  # file of the state; None: not stored
    done: dict[str, Ended] = field(default_factory=dict)

    @classmethod
    def of(
        cls, parts: Sequence[str], *, whole: bool, afresh: bool, file: Path | None
    ) -> "Unfinished":
        """Return the interrupted run with these parts and this size, or a new one."""
        new = cls(tuple(parts), whole, f"{datetime.now():%Y-%m-%d %H:%M}", file)
        if afresh or file is None or not file.is_file():
            return new
        last = json.loads(file.read_text("utf-8"))
        if (tuple(last["parts"]), last["whole"]) != (new.parts, whole):
            return new
        return cls(
            new.parts,
            whole,
            last["began"],
            file,
            {part: tuple(ended) for part, ended in last["done"].items()},
        )

    @property
    def left(self) -> list[str]:
        """Parts that have not ended, in order."""
        return [part for part in self.parts if part not in self.done]

    def end(self, part: str, seconds: float, trouble: str, changed: list[str]) -> None:
        """Store the result of a part."""
        self.done[part] = seconds, trouble, changed
        if self.file is None:
            return
        self.file.parent.mkdir(exist_ok=True)
        kept = {"parts": self.parts, "whole": self.whole, "began": self.began, "done": self.done}
        self.file.write_text(json.dumps(kept), "utf-8")

    def forget(self) -> None:
        """Delete the state of a finished run."""
        if self.file is not None:
            self.file.unlink(missing_ok=True)


def stamp(*names: str) -> str:
    """Return a digest of packages and modules; results of other code are not reused."""
    digest = hashlib.sha256()
    for name in names:
        for path in sorted((PACKAGE / name).rglob("*.py")) or [PACKAGE / f"{name}.py"]:
            digest.update(path.read_bytes())
    return digest.hexdigest()[:12]
