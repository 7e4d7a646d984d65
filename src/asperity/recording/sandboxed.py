"""Reading by third-party libraries in a separate process (`asperity.core.sandbox`), in blocks.

That process keeps the files used last and the position in each channel, so that a block is read
once.
"""

from collections.abc import Iterator
from dataclasses import fields
from functools import partial
from importlib import import_module
from itertools import count
from pathlib import Path

import numpy as np

from asperity.core.arrays import Field
from asperity.core.sandbox import read_in_subprocess
from asperity.core.third_party import suppress_output
from asperity.recording.model import Channel, Contents
from asperity.recording.reader import REMEDY

_MAX_OPEN_FILES = 4  # threads of a caller may read several files


def contents(path: Path, reader: str, library: str) -> Contents:
    """List the channels of a file by `read` of the module `reader`; raises as `read_in_subprocess`.

    `library` is loaded before, within its own time limit.
    """
    path = path.absolute()
    format, notes, channels = read_in_subprocess(
        path, f"{__name__}:list_channels", reader, remedy=REMEDY, library=library
    )

    def blocks(number: int, size: int) -> Iterator[Field]:
        for done in count():
            arguments = (reader, number, size, done)
            block, notes[:] = read_in_subprocess(
                path, f"{__name__}:read_block", *arguments, remedy=REMEDY, library=library
            )
            if block is None:
                return
            yield block

    channels_of_file = [
        Channel(blocks=partial(blocks, number), **channel_fields)
        for number, channel_fields in enumerate(channels)
    ]
    return Contents(format=format, channels=channels_of_file, notes=notes)


# In the reading process
# ----------------------------------------------------------------


class _Opened:
    """An open file with the position reached in each channel."""

    def __init__(self, path: Path, reader: str) -> None:
        self.contents: Contents = import_module(reader).read(path)
        self.positions: dict[int, tuple[int, int, Iterator[Field]]] = {}

    def block(self, number: int, size: int, done: int) -> Field | None:
        """Return a block of a channel, or None after its last."""
        previous_size, previous_done, source = self.positions.pop(number, (0, 0, None))
        if source is None or previous_size != size or previous_done != done:
            source = self.contents.channels[number].blocks(size)
            for _ in range(done):
                next(source, None)
        block = next(source, None)
        if block is not None:
            self.positions[number] = (size, done + 1, source)
        return None if block is None else np.asarray(block, dtype=np.float64)


_opened: dict[tuple[Path, str, int, int], _Opened] = {}  # least recently used first


def _open(path: Path, reader: str) -> _Opened:
    status = path.stat()
    key = (path, reader, status.st_mtime_ns, status.st_size)
    opened = _opened.pop(key, None) or _Opened(path, reader)
    _opened[key] = opened
    while len(_opened) > _MAX_OPEN_FILES:
        _opened.pop(next(iter(_opened)))
    return opened


def list_channels(path: Path, reader: str) -> tuple[str, list[str], list[dict[str, object]]]:
    """Return format, notes and channels of a file, without the functions that read samples."""
    for key in [key for key in _opened if key[0] == path]:  # a new request reads the file again
        del _opened[key]
    with suppress_output():
        listed = _open(path, reader).contents
    channel_fields = [entry.name for entry in fields(Channel) if entry.name != "blocks"]
    return (
        listed.format,
        listed.notes,
        [{name: getattr(channel, name) for name in channel_fields} for channel in listed.channels],
    )


def read_block(
    path: Path, reader: str, number: int, size: int, done: int
) -> tuple[Field | None, list[str]]:
    """Return the block of a channel after `done` others, or None; and the notes so far."""
    with suppress_output():
        opened = _open(path, reader)
        return opened.block(number, size, done), opened.contents.notes
