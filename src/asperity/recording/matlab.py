"""MATLAB files up to version 7, by scipy.io; newer ones are HDF5 (see `hdf5`).

A rate or unit in a struct applies to the arrays in it.
"""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import numpy.typing as npt
import scipy

from asperity.recording.model import ChannelFacts, Contents
from asperity.recording.reader import (
    FEWEST_SAMPLES,
    columns,
    holds_series,
    numeric,
    reject_as,
    stated_facts,
)

_MAX_DEPTH = 8


def is_matlab(head: bytes) -> bool:
    """Return whether a file has the header of MATLAB 5 to 7.

    Version 4 has none and is recognised by its name only.
    """
    return (
        head.startswith(b"MATLAB")
        and head[124:126] in (b"\x00\x01", b"\x01\x00")
        and not head[512:520].startswith(b"\x89HDF")
    )


def read(path: Path) -> Contents:
    """Read channels named by variable and field: bearing.gs."""
    notes: list[str] = []
    with reject_as(path, "not a readable MATLAB file"):
        variables = scipy.io.loadmat(
            path, struct_as_record=False, squeeze_me=True, chars_as_strings=True
        )
        variables = {key: value for key, value in variables.items() if not key.startswith("__")}
        rows = list(_rows(path.name, variables, "", {}))
    channels = [
        replace(channel, short=values.size <= FEWEST_SAMPLES)
        for name, values, facts in rows
        for channel in columns(name, values, notes, **facts)
    ]
    return Contents(format="mat v5", channels=channels, notes=notes)


Row = tuple[str, npt.NDArray[np.generic], ChannelFacts]  # name, array, facts stated in the file


def _rows(
    file: str, variables: dict[str, object], name: str, inherited: dict[str, object]
) -> Iterator[Row]:
    if name.count(".") > _MAX_DEPTH:
        return
    scalars = inherited | {
        key: value
        for key, value in variables.items()
        if np.asarray(value).size == 1 and not _fields(value)
    }
    for key, value in variables.items():
        full_name = f"{name}.{key}" if name else key
        if fields := _fields(value):
            yield from _rows(file, fields, full_name, scalars)
        elif isinstance(value, np.ndarray) and value.dtype == object:
            for number, entry in enumerate(value.reshape(-1)[:64], 1):
                if fields := _fields(entry):
                    yield from _rows(file, fields, f"{full_name}({number})", scalars)
                elif (
                    isinstance(entry, np.ndarray) and numeric(entry) and entry.size > FEWEST_SAMPLES
                ):
                    yield f"{full_name}({number})", entry, stated_facts(file, scalars)
        elif (
            isinstance(value, np.ndarray)
            and numeric(value)
            and holds_series(value.shape, value.dtype.kind)
        ):
            yield full_name, value, stated_facts(file, scalars)


def _fields(value: object) -> dict[str, object]:
    names = getattr(value, "_fieldnames", None)
    return {name: getattr(value, name) for name in names} if names else {}
