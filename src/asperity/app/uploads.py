"""Dropped files: taken in pieces straight to a temporary file, with a limit, under a name of ours."""

import re
from collections.abc import Callable
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from panel.widgets import FileDropper

PIECE = 4_000_000  # bytes that travel at a time
_NAME = re.compile(r"[^\w.\-]+")
LONGEST_NAME = 80


def safe_name(name: str) -> str:
    """A file's name without folders or anything that a shell, a path or a page would take for more than a name."""
    last = re.split(r"[/\\]", name)[-1]
    kept = _NAME.sub("_", last).lstrip(".-")[-LONGEST_NAME:].lstrip(".-")
    return kept or "file"


class Drop(FileDropper):  # type: ignore[misc]
    """A place to drop files on; each is called on with its path when it is whole, or with a sentence that refuses it.

    The files live as long as the session.
    """

    def __init__(
        self,
        *,
        limit: int,
        arrived: Callable[[Path], None],
        refused: Callable[[str], None],
        several: bool,
        **settings: Any,
    ) -> None:
        super().__init__(
            multiple=several,
            chunk_size=PIECE,
            previews=[],
            max_file_size=f"{limit // 1_000_000}MB",
            **settings,
        )
        self._limit, self._arrived, self._refused = limit, arrived, refused
        self._folder: TemporaryDirectory[str] | None = None
        self._open: dict[str, tuple[Path, int, int]] = {}  # path, pieces and bytes so far
        self._count = 0

    @property
    def folder(self) -> Path:
        """Where this session's files lie."""
        if self._folder is None:
            self._folder = TemporaryDirectory(prefix="asperity-page-")
        return Path(self._folder.name)

    def close(self) -> None:
        """Remove all that was dropped."""
        if self._folder is not None:
            self._folder.cleanup()
            self._folder = None
        self._open.clear()

    def _process_event(self, event: Any) -> None:
        """Write a piece to disk; Panel's own keeps all of them in memory."""
        if event.event_name != "upload_event":
            return
        piece = event.data
        name, data = str(piece.get("name", "")), piece.get("data", b"")
        try:
            number, total = int(piece["chunk"]), int(piece["total_chunks"])
            data = data.encode() if isinstance(data, str) else bytes(data)
        except (KeyError, TypeError, ValueError):
            self._refused("A piece of a file came damaged; drop it again.")
            return
        if number == 1:
            self._count += 1
            place = self.folder / str(self._count)
            place.mkdir()
            self._open[name] = (place / safe_name(name), 0, 0)
        if name not in self._open:
            return  # of a file that was refused
        path, pieces, size = self._open[name]
        if size + len(data) > self._limit or number != pieces + 1:
            del self._open[name]
            path.unlink(missing_ok=True)
            most = f"at most {self._limit // 1_000_000} MB may be dropped"
            self._refused(
                f"{safe_name(name)} was not taken: {most}, in pieces that follow one another."
            )
            return
        with path.open("ab") as file:
            file.write(data)
        self._open[name] = (path, number, size + len(data))
        if number == total:
            del self._open[name]
            self._arrived(path)
