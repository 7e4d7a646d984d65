"""Formats that somebody else's library reads, in the process of its own (`asperity.core.sandbox`): piece by piece, as others.

That process keeps the files it was asked for last, and where each channel stands, so that a piece
is read once.
"""

from collections.abc import Iterator
from dataclasses import fields
from functools import partial
from importlib import import_module
from itertools import count
from pathlib import Path
from typing import Any

import numpy as np

from asperity.core.arrays import Field
from asperity.core.sandbox import read_in_subprocess
from asperity.core.third_party import suppress_output
from asperity.recording.model import Channel, Contents
from asperity.recording.reader import REMEDY

_KEPT = 4  # files at a time: threads of a caller may read several


def contents(path: Path, reader: str, library: str) -> Contents:
    """What the `read` of the module `reader` finds in a file; raises as `read_in_subprocess`.

    `library` is loaded before, in time of its own.
    """
    path = path.absolute()
    form, notes, channels = read_in_subprocess(
        path, f"{__name__}:listed", reader, remedy=REMEDY, library=library
    )

    def blocks(number: int, size: int) -> Iterator[Field]:
        for done in count():
            place = (reader, number, size, done)
            block, notes[:] = read_in_subprocess(
                path, f"{__name__}:piece", *place, remedy=REMEDY, library=library
            )
            if block is None:
                return
            yield block

    every = [
        Channel(blocks=partial(blocks, number), **about) for number, about in enumerate(channels)
    ]
    return Contents(format=form, channels=every, notes=notes)


# In the process that reads
# --------------------------------------------------------------------------------------------


class _Opened:
    """A file, and for each channel how many blocks of what size were read of it."""

    def __init__(self, path: Path, reader: str) -> None:
        self.contents: Contents = import_module(reader).read(path)
        self.places: dict[int, tuple[int, int, Iterator[Field]]] = {}

    def block(self, number: int, size: int, done: int) -> Field | None:
        """A block of a channel, or None behind its last."""
        at_size, at, source = self.places.pop(number, (0, 0, None))
        if source is None or at_size != size or at != done:
            source = self.contents.channels[number].blocks(size)
            for _ in range(done):
                next(source, None)
        block = next(source, None)
        if block is not None:
            self.places[number] = (size, done + 1, source)
        return None if block is None else np.asarray(block, dtype=np.float64)


_opened: dict[tuple[Any, ...], _Opened] = {}  # the last asked for last


def _open(path: Path, reader: str) -> _Opened:
    status = path.stat()
    key = (path, reader, status.st_mtime_ns, status.st_size)
    opened = _opened.pop(key, None) or _Opened(path, reader)
    _opened[key] = opened
    while len(_opened) > _KEPT:
        _opened.pop(next(iter(_opened)))
    return opened


def listed(path: Path, reader: str) -> tuple[str, list[str], list[dict[str, Any]]]:
    """Format, notes and channels of a file, without what reads its samples."""
    for key in [key for key in _opened if key[0] == path]:  # asked for anew, it is read anew
        del _opened[key]
    with suppress_output():
        found = _open(path, reader).contents
    about = [entry.name for entry in fields(Channel) if entry.name != "blocks"]
    return (
        found.format,
        found.notes,
        [{name: getattr(channel, name) for name in about} for channel in found.channels],
    )


def piece(
    path: Path, reader: str, number: int, size: int, done: int
) -> tuple[Field | None, list[str]]:
    """The block of a channel behind so many that are done, or None; and the notes so far."""
    with suppress_output():
        opened = _open(path, reader)
        return opened.block(number, size, done), opened.contents.notes
