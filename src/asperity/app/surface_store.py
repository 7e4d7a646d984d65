"""Store of dropped surfaces, kept while the server runs, so that links can restore them."""

import os
import shutil
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory

from asperity.case import Case

MAX_SURFACES, MAX_BYTES = 20, 1_000_000_000  # in the store; the oldest are removed first


class SurfaceStore:
    """Dropped surfaces with their cases, by key."""

    def __init__(self) -> None:
        self._folder = TemporaryDirectory(prefix="asperity-surfaces-")
        self._cases: dict[str, Case] = {}

    def add(self, key: str, case: Case) -> None:
        """Store a case and a link to its dropped file."""
        if key in self._cases:
            return
        folder = Path(self._folder.name) / key
        folder.mkdir()
        _link_or_copy(case.folder / case.contents.surface.name, folder)
        self._cases[key] = replace(case, folder=folder)
        while len(self._cases) > MAX_SURFACES or (
            len(self._cases) > 1 and self._size() > MAX_BYTES
        ):
            shutil.rmtree(self._cases.pop(next(iter(self._cases))).folder)

    def load(self, key: str, folder: Path) -> Case | None:
        """Return a stored case with its file in the folder of a session; None if not stored."""
        case = self._cases.get(key)
        if case is None:
            return None
        target = folder / key
        target.mkdir(exist_ok=True)
        _link_or_copy(case.folder / case.contents.surface.name, target)
        return replace(case, folder=target)

    def close(self) -> None:
        """Remove all surfaces."""
        self._cases.clear()
        self._folder.cleanup()

    def _size(self) -> int:
        return sum(
            (case.folder / case.contents.surface.name).stat().st_size
            for case in self._cases.values()
        )


def _link_or_copy(file: Path, folder: Path) -> None:
    """Link a file into a folder, or copy it if links are not supported."""
    target = folder / file.name
    if target.exists():
        return
    try:
        os.link(file, target)
    except OSError:
        shutil.copy2(file, target)
