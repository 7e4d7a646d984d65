"""HDF5 (and MATLAB 7.3, which is HDF5), by h5py: every numeric data set is one channel or several.

Rate, unit and start may be attributes of the data set or of a group above it, or scalars next to
it.
"""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from asperity.core.errors import UnreadableFile
from asperity.recording.model import Channel, Contents
from asperity.recording.reader import (
    FEWEST_SAMPLES,
    columns,
    holds_series,
    numeric,
    reject_as,
    stated_facts,
)

_MAX_DEPTH = 8  # levels of nested groups


def is_hdf5(head: bytes) -> bool:
    """Return whether the HDF5 signature is at one of its allowed offsets."""
    return any(head[at : at + 8] == b"\x89HDF\r\n\x1a\n" for at in (0, 512, 1024, 2048))


def read(path: Path) -> Contents:
    """Read channels named by their path in the file."""
    import h5py

    notes: list[str] = []
    with reject_as(path, "not a readable HDF5 file"):
        file = h5py.File(path, "r")
    with file, reject_as(path, "a damaged HDF5 file"):
        channels = list(_channels(path, file, "", {}, notes, set()))
        matlab = any(
            str(key).startswith("MATLAB") for member in file.values() for key in member.attrs
        )
    return Contents(format="mat v7.3" if matlab else "hdf5", channels=channels, notes=notes)


def _channels(
    path: Path,
    group: Any,
    name: str,
    inherited: dict[str, object],
    notes: list[str],
    visited: set[object],
) -> Iterator[Channel]:
    import h5py

    if name.count("/") > _MAX_DEPTH or group.id in visited:  # a group may be linked into itself
        return
    visited.add(group.id)
    attributes = inherited | dict(group.attrs)
    members = [(str(key), group.get(key)) for key in group if not str(key).startswith("#")]
    for key, member in members:
        if (
            isinstance(member, h5py.Dataset)
            and member.size is not None
            and member.size <= FEWEST_SAMPLES
        ):
            attributes[key] = _scalar(member)
    for key, member in members:
        path_in_file = f"{name}/{key}" if name else key
        if isinstance(member, h5py.Group):
            yield from _channels(path, member, path_in_file, attributes, notes, visited)
        elif (
            isinstance(member, h5py.Dataset)
            and numeric(member)
            and member.size is not None
            and holds_series(member.shape, member.dtype.kind)
        ):
            facts = stated_facts(path.name, attributes | dict(member.attrs))
            packed = _packing(member, "scale_factor", 1.0), _packing(member, "add_offset", 0.0)
            stored = _OnDisk(path, member.name, member.shape, packed)
            for channel in columns(path_in_file, stored, notes, **facts):
                yield replace(channel, short=member.size <= FEWEST_SAMPLES)


def _packing(member: Any, name: str, usual: float) -> float:
    """Return an attribute by which values were packed into integers (CF conventions 8.1)."""
    value = np.asarray(member.attrs.get(name, usual)).reshape(-1)
    if value.size != 1 or value.dtype.kind not in "iuf" or not np.isfinite(value[0]):
        raise UnreadableFile(
            f"{member.name} states {name} = {value}, which is not a number; export it again"
        )
    return float(value[0])


class _OnDisk:
    """Data set whose file is opened at its first slice and closed after its last."""

    def __init__(
        self, path: Path, name: str, shape: tuple[int, ...], packed: tuple[float, float]
    ) -> None:
        self.path, self.name, self.shape = path, name, shape
        self._along = int(np.argmax(shape))
        self._packed = packed
        self._file: Any = None

    def __getitem__(self, where: tuple[int | slice, ...]) -> npt.ArrayLike:
        import h5py

        if self._file is None:
            self._file = h5py.File(self.path, "r")
        values: npt.ArrayLike = self._file[self.name][where]
        if self._packed != (1.0, 0.0):
            values = np.asarray(values, dtype=np.float64) * self._packed[0] + self._packed[1]
        end = where[self._along]
        if isinstance(end, slice) and end.stop >= self.shape[self._along]:
            self._file.close()
            self._file = None
        return values


def _scalar(member: Any) -> object:
    """Return a small data set as a number, or as text, which MATLAB stores as 16-bit characters."""
    value: object = member[()]
    if isinstance(value, np.ndarray) and member.attrs.get("MATLAB_class") == b"char":
        return "".join(map(chr, value.reshape(-1).tolist()))
    return value
