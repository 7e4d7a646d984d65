"""Results on disk: one digest over everything that a file holds, written with it and held against it on reading.

netCDF and npz files end with it, as bytes that their libraries pass over; tables have it in their
metadata, manifests under a key. What is damaged is told from what never had a digest; folders and
their layout are left to their stores.
"""

import hashlib
import json
import os
from collections.abc import Mapping
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING, Any

import asperity
from asperity.core.errors import BadInput, UnreadableFile
from asperity.core.files import require_file, write_bytes, write_text
from asperity.core.third_party import first_line

if TYPE_CHECKING:
    import pyarrow
    import xarray

MANIFEST = "manifest.json"
_MARK, _DIGITS = b"\nasperity-sha256 ", 64
_SEAL, _CASE = (
    "seal",
    "asperity_case",
)  # keys of the digest, and of the case that a table belongs to


def digest(content: Any) -> str:
    """SHA-256 of bytes, arrays, whatever JSON can hold, and mappings of them in whatever order."""
    state = hashlib.sha256()
    _feed(state, content)
    return state.hexdigest()


def _feed(state: Any, content: Any) -> None:
    if isinstance(content, Mapping):
        for name in sorted(content):
            state.update(f"\n{name!r}:".encode())
            _feed(state, content[name])
    elif isinstance(content, bytes):
        state.update(content)
    elif hasattr(content, "tobytes"):
        state.update(f"{content.dtype.str}{content.shape}".encode())
        state.update(content.tobytes())
    else:
        state.update(json.dumps(content, sort_keys=True).encode())


def _believed(path: Path, stated: str | None, content: Any, remedy: str) -> None:
    if stated is None:
        raise UnreadableFile(
            f"{path} carries no digest: it is not of this version of asperity, cut short, or changed since; {remedy}"
        )
    if stated != digest(content):
        raise UnreadableFile(
            f"{path} is damaged or was changed: its digest is of other content; {remedy}"
        )


# Files of bytes
# -------------------------------------------------------------------------------------------------------


def sealed(body: bytes) -> bytes:
    """Bytes with their digest behind them."""
    return body + _MARK + digest(body).encode()


def unsealed(content: bytes, name: str, remedy: str) -> bytes:
    """The bytes that `sealed` took; UnreadableFile, which names the thing and ends with the remedy, for any others."""
    body, mark, stated = (
        content[: -_DIGITS - len(_MARK)],
        content[-_DIGITS - len(_MARK) : -_DIGITS],
        content[-_DIGITS:],
    )
    _believed(Path(name), stated.decode("latin-1") if mark == _MARK else None, body, remedy)
    return body


def write_sealed(path: Path, body: bytes) -> None:
    """Write bytes and their digest behind them, whole or not at all; raises as `files.whole_file`."""
    write_bytes(path, sealed(body))


def read_sealed(path: Path, remedy: str) -> bytes:
    """The bytes that `write_sealed` wrote; UnreadableFile, which ends with the remedy, for any others."""
    require_file(path)
    try:
        with path.open(
            "rb"
        ) as file:  # its end first: a file of another kind may be far too large to read
            body = file.seek(0, os.SEEK_END) - _DIGITS - len(_MARK)
            file.seek(max(0, body))
            end = file.read()
            file.seek(0)
            content = file.read(max(0, body)) if end.startswith(_MARK) else b""
    except OSError as error:
        raise UnreadableFile(f"{path} cannot be read: {error.strerror}; {remedy}") from None
    _believed(
        path, end[-_DIGITS:].decode("latin-1") if end.startswith(_MARK) else None, content, remedy
    )
    return content


def netcdf_bytes(dataset: "xarray.Dataset", encoding: Mapping[str, Any]) -> bytes:
    """A dataset as netCDF, made in memory: the HDF5 library does not survive a disk that is full."""
    buffer = BytesIO()
    dataset.to_netcdf(buffer, engine="h5netcdf", encoding=encoding)
    return buffer.getvalue()


def read_netcdf(path: Path, remedy: str) -> "xarray.Dataset":
    """A dataset that was written sealed, in memory; raises as `read_sealed`."""
    import xarray

    body = BytesIO(read_sealed(path, remedy))
    try:
        with xarray.open_dataset(body, engine="h5netcdf", decode_cf=False) as opened:
            return opened.load()
    except Exception as error:
        raise UnreadableFile(f"{path} is no netCDF file; {remedy}") from error


# Tables
# ---------------------------------------------------------------------------------------------------------------


def write_table(path: Path, table: "pyarrow.Table", case: str) -> None:
    """Write a table as parquet with page checksums, its digest and the `case` that it belongs to, whole or not at all.

    Raises as `files.whole_file`.
    """
    import pyarrow.parquet

    told = {**(table.schema.metadata or {}), _CASE.encode(): case.encode()}
    table = table.replace_schema_metadata(told)
    sealed = table.replace_schema_metadata(
        {**told, _SEAL.encode(): digest(_columns(table)).encode()}
    )
    buffer = BytesIO()
    pyarrow.parquet.write_table(sealed, buffer, write_page_checksum=True)
    write_bytes(path, buffer.getvalue())


def read_table(path: Path, case: str, remedy: str) -> "pyarrow.Table":
    """The table that `write_table` wrote for that case; UnreadableFile, which ends with the remedy, for any other."""
    import pyarrow.parquet

    require_file(path)
    try:
        table = pyarrow.parquet.read_table(path, page_checksum_verification=True)
        told = {
            key.decode(): value.decode() for key, value in (table.schema.metadata or {}).items()
        }
        sealed = told.pop(_SEAL, None)
        table = table.replace_schema_metadata(told)
        content = _columns(table)
    except Exception as error:
        raise UnreadableFile(f"{path} is damaged ({first_line(error)}); {remedy}") from error
    _believed(path, sealed, content, remedy)
    require_case(path, told.get(_CASE), case, remedy)
    return table


def require_case(path: Path, theirs: str | None, case: str, remedy: str) -> None:
    """Refuse a file of another case than the folder's that it lies in."""
    if theirs != case:
        raise UnreadableFile(f"{path} belongs to another case than its folder; {remedy}")


def _columns(table: "pyarrow.Table") -> dict[str, Any]:
    """What a table holds: its metadata, and the type and values of each column."""
    import pyarrow

    told = {key.decode(): value.decode() for key, value in (table.schema.metadata or {}).items()}
    held: dict[str, Any] = {"": [told, table.column_names]}
    for name, column in zip(table.column_names, table.columns, strict=True):
        kind = column.type
        # a list's items are called otherwise by the file than by what was written
        held[f"type of {name}"] = (
            f"list of {kind.value_type}" if pyarrow.types.is_list(kind) else str(kind)
        )
        if pyarrow.types.is_floating(kind) or pyarrow.types.is_integer(kind):
            held[f"where {name}"] = column.is_valid().to_numpy()
            held[f"values of {name}"] = column.fill_null(0).to_numpy()
        else:
            held[f"values of {name}"] = column.to_pylist()
    return held


# Folders
# --------------------------------------------------------------------------------------------------------------


def write_json(path: Path, content: Mapping[str, Any]) -> None:
    """Write keys and values with their digest; raises as `files.whole_file`."""
    held = json.loads(json.dumps(content))
    write_text(path, json.dumps({**held, _SEAL: digest(held)}, indent=1))


def read_json(path: Path, remedy: str) -> dict[str, Any]:
    """What `write_json` wrote; UnreadableFile, which ends with the remedy, for anything else."""
    require_file(path)
    try:
        content = json.loads(path.read_text("utf-8"))
    except (OSError, ValueError, RecursionError):
        raise UnreadableFile(f"{path} is damaged; {remedy}") from None
    if not isinstance(content, dict):
        raise UnreadableFile(f"{path} is damaged: it holds no keys; {remedy}")
    _believed(path, content.pop(_SEAL, None), content, remedy)
    return content


def read_manifest(folder: Path, *, of: str, layout: int) -> dict[str, Any]:
    """What a folder that holds a study or a history (`of`) in a layout of that number says about itself.

    Raises UnreadableFile where it says nothing that can be read, or not what was written.
    """
    path = folder / MANIFEST
    if not path.exists():
        raise UnreadableFile(f"{folder} holds no {of}: it has no {MANIFEST}; check its name")
    manifest = read_json(path, f"compute the {of} into another folder")
    if manifest.get("format") != layout or manifest.get("of") != of:
        raise UnreadableFile(
            f"{path} is not a {of}'s manifest that this asperity can read; choose another folder"
        )
    return manifest


def require_same_version(manifest: Mapping[str, Any], folder: Path) -> None:
    """Refuse to go on in a folder that another asperity began: its numbers would stand beside ours."""
    theirs, ours = manifest["versions"]["asperity"], asperity.__version__
    if theirs != ours:
        raise BadInput(
            f"{folder} was computed by asperity {theirs}, this is {ours}; choose another folder"
        )


def version_notes(versions: Mapping[str, Any]) -> tuple[str, ...]:
    """A sentence where results are of another asperity than this; nothing where they are of this one."""
    theirs, ours = versions.get("asperity"), asperity.__version__
    if theirs == ours:
        return ()
    return (f"Computed by asperity {theirs}, read by {ours}: what is worked out anew may differ.",)
