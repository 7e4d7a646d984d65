"""Uploads: dropped files are written in chunks to a temporary file with a safe name and a limit."""

import re
from collections.abc import Callable
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from panel.widgets import FileDropper

CHUNK_SIZE = 4_000_000  # bytes
MAX_NAME = 80  # characters of a file name
MAX_VISIT = 1_000_000_000  # bytes of all files of a visit
MAX_FILES = 10_000  # of a visit
_VISIT_FULL = (
    f"more than {MAX_VISIT // 1_000_000} MB or {MAX_FILES} files in one visit; reload the page to "
    "drop others"
)
_UNSAFE = re.compile(r"[^\w.\-]+")


def safe_name(name: str) -> str:
    """Return a file name without folders and without characters special to shells or HTML."""
    last = re.split(r"[/\\]", name)[-1]
    cleaned = _UNSAFE.sub("_", last).lstrip(".-")[-MAX_NAME:].lstrip(".-")
    return cleaned or "file"


class FileDrop(FileDropper):  # type: ignore[misc]
    """Drop area for files, which are kept for the session.

    `on_file` is called with the path of each complete file, `on_error` with a message.
    """

    def __init__(
        self,
        *,
        limit: int,
        on_file: Callable[[Path], None],
        on_error: Callable[[str], None],
        several: bool,
        **settings: object,
    ) -> None:
        super().__init__(
            multiple=several,
            chunk_size=CHUNK_SIZE,
            previews=[],
            max_file_size=f"{limit // 1_000_000}MB",
            **settings,
        )
        self._limit, self._on_file, self._on_error = limit, on_file, on_error
        self._folder: TemporaryDirectory[str] | None = None
        self._open: dict[str, tuple[Path, int, int]] = {}  # path, chunks and bytes so far
        self._count, self._received = 0, 0  # files and bytes of the visit

    @property
    def folder(self) -> Path:
        """Folder of this session's files."""
        if self._folder is None:
            self._folder = TemporaryDirectory(prefix="asperity-page-")
        return Path(self._folder.name)

    def close(self) -> None:
        """Remove all dropped files."""
        if self._folder is not None:
            self._folder.cleanup()
            self._folder = None
        self._open.clear()

    def _problem(self, size: int, added: int, *, in_order: bool) -> str:
        """Return why a chunk is refused, "" if it is not."""
        if size > self._limit or not in_order:
            return f"larger than {self._limit // 1_000_000} MB, or a chunk is missing"
        return _VISIT_FULL if self._received + added > MAX_VISIT else ""

    def _process_event(self, event: Any) -> None:
        """Write a chunk to disk, instead of keeping it in memory as Panel does."""
        if event.event_name != "upload_event":
            return
        chunk = event.data if isinstance(event.data, dict) else {}
        name = str(chunk.get("name", ""))
        data = chunk.get("data", b"")
        try:
            number = int(chunk["chunk"])
            total = int(chunk["total_chunks"])
            data = data.encode() if isinstance(data, str) else memoryview(data)
        except (KeyError, TypeError, ValueError, OverflowError):
            self._on_error("A chunk of the file was damaged. Drop the file again.")
            return
        self._write(name, number, total, data)

    def _write(self, name: str, number: int, total: int, data: bytes | memoryview) -> None:
        """Append a chunk to its file, or refuse the file."""
        if number == 1:
            if name in self._open:
                self._open.pop(name)[0].unlink(missing_ok=True)
            if self._count >= MAX_FILES:
                self._on_error(f"{safe_name(name)} was rejected: {_VISIT_FULL}.")
                return
            self._count += 1
            folder = self.folder / str(self._count)
            folder.mkdir()
            self._open[name] = (folder / safe_name(name), 0, 0)
        if name not in self._open:
            return  # a rejected file
        path, chunks, size = self._open[name]
        problem = self._problem(size + len(data), len(data), in_order=number == chunks + 1)
        if problem:
            del self._open[name]
            path.unlink(missing_ok=True)
            self._on_error(f"{safe_name(name)} was rejected: {problem}.")
            return
        with path.open("ab") as file:
            file.write(data)
        self._received += len(data)
        self._open[name] = (path, number, size + len(data))
        if number == total:
            del self._open[name]
            self._on_file(path)
