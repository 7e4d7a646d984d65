"""NumPy's .npy and .npz files: arrays of samples; in .npz, rate and unit as scalars."""

import zipfile
from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import IO, Any, TypeAlias

import numpy as np
import numpy.typing as npt

from asperity.core.arrays import Field
from asperity.core.errors import UnreadableFile
from asperity.core.third_party import first_line
from asperity.recording.model import Channel, Contents
from asperity.recording.reader import (
    FEWEST_SAMPLES,
    MOST_CHANNELS,
    REMEDY,
    columns,
    holds_series,
    reject_as,
    stated_facts,
)

_LARGEST_HEADER = 1 << 16
Type: TypeAlias = np.dtype[Any]
Header: TypeAlias = tuple[tuple[int, ...], bool, Type]  # shape, Fortran order, type


def is_npy(head: bytes) -> bool:
    """Return whether a file is one array."""
    return head.startswith(b"\x93NUMPY")


def is_npz(head: bytes) -> bool:
    """Return whether a file is a zip archive, as .npz is."""
    return head.startswith(b"PK\x03\x04")


def read_npy(path: Path) -> Contents:
    """Read one row, several along the longer axis, or the fields of a structured array."""
    notes: list[str] = []
    with reject_as(path, "not a readable .npy file"):
        with path.open("rb") as file:
            shape, fortran, dtype = _header(file)
            offset = file.tell()
        available = max(path.stat().st_size - offset, 0) // dtype.itemsize
        if available < int(np.prod(shape, dtype=object)):
            rows = available // max(1, int(np.prod(shape[1:], dtype=object)))
            if fortran or rows < 2:
                raise UnreadableFile(f"{path.name} is cut short; {REMEDY}")
            notes.append(f"cut short: {rows} of {shape[0]} samples present")
            shape = (rows, *shape[1:])
    array = _Stored(path, dtype, offset, shape, fortran)
    return Contents(format="npy", channels=list(_array_channels(path, array, notes)), notes=notes)


@dataclass(frozen=True, slots=True)
class _Stored:
    """Array in a file, mapped for each slice: pages that stay mapped would count as memory."""

    path: Path
    dtype: Type
    offset: int
    shape: tuple[int, ...]
    fortran: bool
    name: str | None = None  # of a field

    def __getitem__(self, where: tuple[int | slice, ...]) -> npt.NDArray[np.generic]:
        mapped = np.memmap(
            self.path, self.dtype, "r", self.offset, self.shape, "F" if self.fortran else "C"
        )
        return np.array(mapped[where] if self.name is None else mapped[self.name][where])


def _array_channels(path: Path, array: _Stored, notes: list[str]) -> Iterator[Channel]:
    if array.dtype.names:
        for name in array.dtype.names:
            if (
                array.dtype[name].kind in "iuf"
                and len(array.shape) == 1
                and not array.dtype[name].shape
            ):
                yield from columns(name, replace(array, name=name), notes)
    elif array.dtype.kind in "iuf":
        yield from columns(path.stem, array, notes)


def read_npz(path: Path) -> Contents:
    """Read each array as one channel or several; scalars named fs, dt, unit ... describe them."""
    notes: list[str] = []
    scalars: dict[str, npt.NDArray[np.generic]] = {}
    arrays: list[tuple[str, Header]] = []
    with reject_as(path, "not a readable .npz file"), zipfile.ZipFile(path) as archive:
        for member in archive.namelist():
            if not member.endswith(".npy"):
                continue
            with archive.open(member) as file:
                shape, fortran, dtype = _header(file)
                count = int(np.prod(shape, dtype=object))
                name = member.removesuffix(".npy")
                if count <= FEWEST_SAMPLES and dtype.kind in "iufUSM":
                    data = file.read(count * dtype.itemsize)
                    scalars[name] = np.frombuffer(data, dtype, count).reshape(shape)
                if dtype.kind in "iuf" and holds_series(shape, dtype.kind):
                    arrays.append((member, (shape, fortran, dtype)))
    facts = stated_facts(
        path.name,
        {key: value.item() if value.size == 1 else value for key, value in scalars.items()},
    )
    channels = [
        replace(channel, **facts)
        for member, header in arrays
        for channel in _member_channels(path, member, header, notes)
    ]
    return Contents(format="npz", channels=channels, notes=notes)


def _member_channels(
    path: Path, member: str, header: Header, notes: list[str]
) -> Iterator[Channel]:
    """Yield the channels of a member of the archive, unpacked in blocks: it cannot be sliced."""
    shape, fortran, dtype = header
    name = member.removesuffix(".npy")
    long_axes = [n for n in shape if n != 1]
    if len(long_axes) > 2 or not long_axes:
        return
    samples = max(long_axes)
    count = min(long_axes) if len(long_axes) == 2 else 1
    rows_last = (len(long_axes) == 2) and (
        (long_axes[0] == samples) == fortran
    )  # each channel lies in one piece
    if count > MOST_CHANNELS:
        raise UnreadableFile(
            f"{path.name} holds {name} of {shape}: not a recording; give one row per channel"
        )
    for k in range(count):
        first, stride = (k * samples, 1) if rows_last else (k, count)
        blocks = partial(_unpacked, path, member, dtype, (first, stride, samples), notes)
        yield Channel(
            name=name if count == 1 else f"{name}[{k + 1}]",
            blocks=blocks,
            samples=samples,
            short=samples * count <= FEWEST_SAMPLES,
        )


def _unpacked(
    path: Path, member: str, dtype: Type, where: tuple[int, int, int], notes: list[str], size: int
) -> Iterator[Field]:
    first, stride, samples = where
    done = 0
    try:
        with zipfile.ZipFile(path) as archive, archive.open(member) as file:
            _header(file)
            remaining = (first if stride == 1 else 0) * dtype.itemsize
            while remaining > 0:
                remaining -= len(file.read(min(remaining, 1 << 20))) or remaining
            while done < samples:
                size_in_bytes = min(size, samples - done) * stride * dtype.itemsize
                data = file.read(size_in_bytes)
                complete = len(data) // (stride * dtype.itemsize)
                if complete == 0:
                    break
                values = np.frombuffer(data, dtype, complete * stride)
                done += complete
                yield (values if stride == 1 else values[first::stride]).astype(np.float64)
    except (zipfile.BadZipFile, OSError, ValueError, EOFError, zipfile.zlib.error) as error:  # type: ignore[attr-defined]
        if done == 0:
            raise UnreadableFile(
                f"{path.name} cannot be unpacked ({first_line(error)}); {REMEDY}"
            ) from error
    if done < samples:
        notes.append(f"damaged after sample {done} of {samples}; samples before that were read")


def _header(file: IO[bytes]) -> Header:
    version = np.lib.format.read_magic(file)
    read = (
        np.lib.format.read_array_header_1_0
        if version == (1, 0)
        else np.lib.format.read_array_header_2_0
    )
    shape, fortran, dtype = read(file, max_header_size=_LARGEST_HEADER)
    if dtype.hasobject:
        raise ValueError("it holds Python objects")
    if any(n < 0 for n in shape) or dtype.itemsize == 0:
        raise ValueError(f"its shape is {shape}")
    return shape, fortran, dtype
