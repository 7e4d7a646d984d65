"""MATLAB files up to version 7, by scipy.io; newer ones are HDF5 and left to `hdf5`.

Structs are walked into: a rate or a unit in a struct belongs to the rows of samples in it.
"""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import scipy

from asperity.recording.model import Contents
from asperity.recording.reader import columns, facts_in, numeric, refused_as

_DEEPEST = 8


def is_matlab(head: bytes) -> bool:
    """Whether a file has the header of MATLAB 5 to 7; version 4 has none and is known by its name only."""
    return (
        head.startswith(b"MATLAB")
        and head[124:126] in (b"\x00\x01", b"\x01\x00")
        and not head[512:520].startswith(b"\x89HDF")
    )


def read(path: Path) -> Contents:
    """Channels named by variable and field: bearing.gs."""
    notes: list[str] = []
    with refused_as(path, "no readable MATLAB file"):
        held = scipy.io.loadmat(
            path, struct_as_record=False, squeeze_me=True, chars_as_strings=True
        )
        held = {key: value for key, value in held.items() if not key.startswith("__")}
        rows = list(_rows(path.name, held, "", {}))
    channels = [
        channel for name, values, facts in rows for channel in columns(name, values, notes, **facts)
    ]
    return Contents(format="mat v5", channels=channels, notes=notes)


Row = tuple[str, Any, dict[str, Any]]  # name, array, and what the file states of it


def _rows(file: str, held: dict[str, Any], name: str, above: dict[str, Any]) -> Iterator[Row]:
    if name.count(".") > _DEEPEST:
        return
    around = above | {
        key: value for key, value in held.items() if np.size(value) == 1 and not _fields(value)
    }
    for key, value in held.items():
        inner = f"{name}.{key}" if name else key
        if fields := _fields(value):
            yield from _rows(file, fields, inner, around)
        elif isinstance(value, np.ndarray) and value.dtype == object:
            for number, entry in enumerate(value.reshape(-1)[:64], 1):
                if fields := _fields(entry):
                    yield from _rows(file, fields, f"{inner}({number})", around)
                elif isinstance(entry, np.ndarray) and numeric(entry) and entry.size > 64:
                    yield f"{inner}({number})", entry, facts_in(file, around)
        elif isinstance(value, np.ndarray) and numeric(value) and value.size > 64:
            yield inner, value, facts_in(file, around)


def _fields(value: Any) -> dict[str, Any]:
    names = getattr(value, "_fieldnames", None)
    return {name: getattr(value, name) for name in names} if names else {}
