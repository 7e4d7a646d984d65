"""Unpacking of kept netCDF files and tables; runs in the subprocess of `sandbox`, with limits."""

from collections.abc import Collection
from io import BytesIO
from pathlib import Path
from typing import TypeAlias

import h5netcdf
import h5py
import numpy as np
import numpy.typing as npt
import pyarrow.parquet

from asperity.core.errors import UnreadableFile
from asperity.core.limits import require_plausible_size
from asperity.core.storage import (
    CASE,
    SEAL,
    read_with_digest,
    require_case,
    table_content,
    table_metadata,
    verify,
)
from asperity.core.third_party import first_line

Attributes: TypeAlias = dict[str, object]
Variable: TypeAlias = tuple[tuple[str, ...], npt.NDArray[np.generic], Attributes]


def unpack_netcdf(
    path: Path, names: Collection[str], remedy: str, sealed: bool
) -> tuple[dict[str, Variable], Attributes]:
    """Return named variables and the file's attributes; of a file with its digest if `sealed`.

    Raises
    ------
    UnreadableFile
        for another file, content that is not stored in it, or more than it can plausibly hold.
    """
    body = BytesIO(read_with_digest(path, remedy) if sealed else path.read_bytes())
    try:
        with h5py.File(body, "r") as file:
            for name in file:
                _require_own_data(path, file, name, remedy)
            present = [name for name in names if name in file]
            size = float(sum(file[name].size * file[name].dtype.itemsize for name in present))
            require_plausible_size(path, size, remedy)
        with h5netcdf.File(body, "r") as opened:
            variables = {
                name: (
                    opened[name].dimensions,
                    np.asarray(opened[name][...]),
                    dict(opened[name].attrs),
                )
                for name in present
            }
            if any(len({*along}) < len(along) for along, _, _ in variables.values()):
                raise UnreadableFile(f"{path} has a variable with two equal dimensions; {remedy}")
            return variables, dict(opened.attrs)
    except (UnreadableFile, MemoryError):
        raise
    except Exception as error:
        raise UnreadableFile(f"{path} is not a netCDF file; {remedy}") from error


def _require_own_data(path: Path, file: h5py.File, name: str, remedy: str) -> None:
    """Raise UnreadableFile unless the file itself stores a variable."""
    link = file.get(name, getlink=True)
    stored = file[name] if isinstance(link, h5py.HardLink) else None
    if not isinstance(stored, h5py.Dataset) or stored.external or stored.is_virtual:
        raise UnreadableFile(
            f"{path} is not a saved result: {name[:40]!r} is not a variable stored in it; {remedy}"
        )


def unpack_table(path: Path, case: str, remedy: str) -> pyarrow.Table:
    """Return the table of a file.

    Raises
    ------
    UnreadableFile
        if it is damaged, or of another case.
    """
    try:
        table = pyarrow.parquet.read_table(path, page_checksum_verification=True)
        metadata = table_metadata(table)
        stated = metadata.pop(SEAL, None)
        table = table.replace_schema_metadata(metadata)
        content = table_content(table)
    except MemoryError:
        raise
    except Exception as error:
        raise UnreadableFile(f"{path} is damaged ({first_line(error)}); {remedy}") from error
    verify(path, stated, content, remedy)
    require_case(path, metadata.get(CASE), case, remedy)
    return table
