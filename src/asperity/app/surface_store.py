"""Shelf: surfaces that were dropped, held as long as the server runs, so that a link brings them back."""

import os
import shutil
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory

from asperity.case import Case

MOST_HELD, MOST_BYTES = (
    20,
    1_000_000_000,
)  # of surfaces, and of all of them together; the oldest go first


class Shelf:
    """Dropped surfaces with their cases, by what they are told by in an address."""

    def __init__(self) -> None:
        self._folder = TemporaryDirectory(prefix="asperity-shelf-")
        self._held: dict[str, Case] = {}

    def put(self, key: str, case: Case) -> None:
        """Hold a case whose surface is a dropped file; the session's own file stays where it is."""
        if key in self._held:
            return
        place = Path(self._folder.name) / key
        place.mkdir()
        _lay(case.folder / case.contents.surface.name, place)
        self._held[key] = replace(case, folder=place)
        while len(self._held) > MOST_HELD or (len(self._held) > 1 and self._size() > MOST_BYTES):
            shutil.rmtree(self._held.pop(next(iter(self._held))).folder)

    def lend(self, key: str, folder: Path) -> Case | None:
        """The case held under a key, its file in a session's own folder; None where there is none any more."""
        case = self._held.get(key)
        if case is None:
            return None
        place = folder / key
        place.mkdir(exist_ok=True)
        _lay(case.folder / case.contents.surface.name, place)
        return replace(case, folder=place)

    def close(self) -> None:
        """Let go of all of them."""
        self._held.clear()
        self._folder.cleanup()

    def _size(self) -> int:
        return sum(
            (case.folder / case.contents.surface.name).stat().st_size
            for case in self._held.values()
        )


def _lay(file: Path, folder: Path) -> None:
    """A file in another folder too, without a copy where the disk can do that."""
    target = folder / file.name
    if target.exists():
        return
    try:
        os.link(file, target)
    except OSError:
        shutil.copy2(file, target)
