"""Commands grouped by task in `asperity --help`, each with its whole summary."""

from collections.abc import Sequence
from contextlib import AbstractContextManager
from typing import Protocol

from typer.core import TyperGroup

GROUPS = {
    "First steps": ("demo", "new", "page"),
    "One contact": (
        *("solve", "cycle", "deplete", "run", "wear"),
        *("stribeck", "traction", "vibrate", "observe"),
    ),
    "Machines and studies": ("machine", "study", "sensitivity", "calibrate"),
    "Surfaces and recordings": ("surface", "check", "track", "watch", "store", "infer"),
    "Saved results": ("report", "export"),
    "Validation": ("benchmark", "rig"),
}


class Formatter(Protocol):
    """Writer of sections and two-column lists of a help text."""

    def section(self, name: str) -> AbstractContextManager[None]:
        """Indent what follows below a title."""

    def write_dl(self, rows: Sequence[tuple[str, str]]) -> None:
        """Write names with their descriptions."""


class GroupedCommands(TyperGroup):
    """Commands in the order and under the titles of `GROUPS`."""

    def list_commands(self, _context: object) -> list[str]:
        """Return the names of the commands, group by group."""
        return [name for names in GROUPS.values() for name in names]

    def format_commands(self, _context: object, formatter: Formatter) -> None:
        """Write a section per group, with summaries that are wrapped but not cut."""
        width = max(map(len, self.commands))
        for title, names in GROUPS.items():
            with formatter.section(title):
                formatter.write_dl([(f"{name:{width}}", self._summary(name)) for name in names])

    def _summary(self, name: str) -> str:
        return (self.commands[name].help or "").partition("\n\n")[0].replace("\n", " ")
