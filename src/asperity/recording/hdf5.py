"""HDF5 (and MATLAB 7.3, which is HDF5), by h5py: every data set of numbers is a channel or several.

Rate, unit and start may stand as attributes on the data set or a group above it, or as scalars
beside it.
"""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from asperity.core.errors import UnreadableFile
from asperity.recording.model import Channel, Contents
from asperity.recording.reader import columns, facts_in, numeric, refused_as

_DEEPEST = 8  # groups in groups


def is_hdf5(head: bytes) -> bool:
    """Whether the HDF5 signature stands at one of the places where it may."""
    return any(head[at : at + 8] == b"\x89HDF\r\n\x1a\n" for at in (0, 512, 1024, 2048))


def read(path: Path) -> Contents:
    """Channels named by their path in the file."""
    import h5py

    notes: list[str] = []
    with refused_as(path, "no readable HDF5 file"):
        file = h5py.File(path, "r")
    with file, refused_as(path, "a damaged HDF5 file"):
        channels = list(_channels(path, file, "", {}, notes, set()))
        matlab = any(
            str(key).startswith("MATLAB") for member in file.values() for key in member.attrs
        )
    return Contents(format="mat v7.3" if matlab else "hdf5", channels=channels, notes=notes)


def _channels(
    path: Path, group: Any, name: str, above: dict[str, Any], notes: list[str], seen: set[Any]
) -> Iterator[Channel]:
    import h5py

    if name.count("/") > _DEEPEST or group.id in seen:  # a group may be linked into itself
        return
    seen.add(group.id)
    around = above | dict(group.attrs)
    members = [(str(key), group.get(key)) for key in group if not str(key).startswith("#")]
    for key, member in members:
        if isinstance(member, h5py.Dataset) and member.size is not None and member.size <= 64:
            around[key] = _scalar(member)
    for key, member in members:
        inner = f"{name}/{key}" if name else key
        if isinstance(member, h5py.Group):
            yield from _channels(path, member, inner, around, notes, seen)
        elif (
            isinstance(member, h5py.Dataset)
            and numeric(member)
            and member.size is not None
            and member.size > 64
        ):
            facts = facts_in(path.name, around | dict(member.attrs))
            packed = _packing(member, "scale_factor", 1.0), _packing(member, "add_offset", 0.0)
            yield from columns(
                inner, _OnDisk(path, member.name, member.shape, packed), notes, **facts
            )


def _packing(member: Any, name: str, usual: float) -> float:
    """An attribute by which values were packed into integers (CF conventions 8.1)."""
    value = np.asarray(member.attrs.get(name, usual)).reshape(-1)
    if value.size != 1 or value.dtype.kind not in "iuf" or not np.isfinite(value[0]):
        raise UnreadableFile(
            f"{member.name} states {name} = {value}, which is no number; export it again"
        )
    return float(value[0])


class _OnDisk:
    """A data set whose file is opened at its first slice and closed after its last."""

    def __init__(
        self, path: Path, name: str, shape: tuple[int, ...], packed: tuple[float, float]
    ) -> None:
        self.path, self.name, self.shape = path, name, shape
        self._along = int(np.argmax(shape))
        self._packed = packed
        self._file: Any = None

    def __getitem__(self, where: Any) -> Any:
        import h5py

        if self._file is None:
            self._file = h5py.File(self.path, "r")
        values = self._file[self.name][where]
        if self._packed != (1.0, 0.0):
            values = np.asarray(values, dtype=np.float64) * self._packed[0] + self._packed[1]
        ends = where if isinstance(where, tuple) else (where,)
        if ends[self._along].stop >= self.shape[self._along]:
            self._file.close()
            self._file = None
        return values


def _scalar(member: Any) -> Any:
    """A small data set as a number, or as text: MATLAB keeps that as 16-bit characters."""
    value = member[()]
    if isinstance(value, np.ndarray) and member.attrs.get("MATLAB_class") == b"char":
        return "".join(map(chr, value.reshape(-1).tolist()))
    return value
