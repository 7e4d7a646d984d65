"""Result files with a SHA-256 digest of their content, verified on reading.

netCDF and npz files end with the digest, which their libraries ignore; tables have it in their
metadata, JSON files under a key. Errors distinguish a damaged file from one without a digest.
"""

import hashlib
import json
import os
import zipfile
from collections.abc import Collection, Iterator, Mapping
from contextlib import contextmanager
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

import asperity
from asperity.core.documents import Table
from asperity.core.errors import AsperityError, BadInput, UnreadableFile
from asperity.core.files import require_file, write_bytes, write_text
from asperity.core.limits import GIGABYTE, reading_limit, stored_size, unpacked_limit
from asperity.core.sandbox import read_in_subprocess
from asperity.core.third_party import first_line

if TYPE_CHECKING:
    import pyarrow
    import xarray

MANIFEST = "manifest.json"
ENTRIES = {"versions": dict, "source": str, "case": str, "case_folder": str}  # of a manifest
MAX_JSON = 64_000_000  # bytes of a manifest
_MARK, _DIGITS = b"\nasperity-sha256 ", 64
SEAL, CASE = "seal", "asperity_case"  # keys of the digest and of a table's case


def digest(content: object) -> str:
    """Return the SHA-256 of bytes, arrays, JSON values, or mappings of them in any order."""
    state = hashlib.sha256()
    _feed(state, content)
    return state.hexdigest()


def _feed(state: "hashlib._Hash", content: Any) -> None:
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


def verify(path: Path, stated: str | None, content: object, remedy: str) -> None:
    """Raise UnreadableFile unless the digest of the content is the stated one."""
    if stated is None:
        raise UnreadableFile(
            f"{path} has no digest: it is from another version of asperity, truncated or modified; "
            f"{remedy}"
        )
    if stated != digest(content):
        raise UnreadableFile(
            f"{path} is damaged or modified: its digest does not match its content; {remedy}"
        )


# Files of bytes
# ------------------------------------------------------------------------------------------


CONTENT_ENTRY = "content"  # name of the entry with JSON text, beside stored arrays


def append_digest(body: bytes) -> bytes:
    """Return the bytes followed by their digest."""
    return body + _MARK + digest(body).encode()


def strip_digest(content: bytes, name: str, remedy: str) -> bytes:
    """Return the bytes before the digest of `append_digest`; UnreadableFile on a mismatch."""
    body = content[: -_DIGITS - len(_MARK)]
    mark = content[-_DIGITS - len(_MARK) : -_DIGITS]
    stated = content[-_DIGITS:]
    verify(Path(name), stated.decode("latin-1") if mark == _MARK else None, body, remedy)
    return body


def write_with_digest(path: Path, body: bytes) -> None:
    """Write bytes followed by their digest, atomically; raises as `files.atomic_write`."""
    write_bytes(path, append_digest(body))


def read_with_digest(path: Path, remedy: str) -> bytes:
    """Return the bytes that `write_with_digest` wrote; raise UnreadableFile on a mismatch."""
    require_file(path)
    _require_size(path, remedy)
    try:
        with path.open("rb") as file:  # end first: a file of another type may be too large to read
            body = file.seek(0, os.SEEK_END) - _DIGITS - len(_MARK)
            file.seek(max(0, body))
            end = file.read()
            file.seek(0)
            content = file.read(max(0, body)) if end.startswith(_MARK) else b""
    except OSError as error:
        raise UnreadableFile(f"{path} cannot be read: {error.strerror}; {remedy}") from None
    verify(
        path, end[-_DIGITS:].decode("latin-1") if end.startswith(_MARK) else None, content, remedy
    )
    return content


def _require_size(path: Path, remedy: str) -> None:
    """Raise UnreadableFile for a file, such as a sparse one, that is larger than its reading."""
    size = path.stat().st_size
    if size > reading_limit(stored_size(path)):
        raise UnreadableFile(
            f"{path} has {size / GIGABYTE:.2g} GB, too much for a stored result; {remedy}"
        )


def stored_digest(path: Path, remedy: str) -> str:
    """Return the digest that a file states at its end, or that of a file without one.

    Raises
    ------
    UnreadableFile
        if the file is too large.
    """
    _require_size(path, remedy)
    with path.open("rb") as file:
        file.seek(max(0, file.seek(0, os.SEEK_END) - _DIGITS - len(_MARK)))
        end = file.read()
        if end.startswith(_MARK):
            return end[-_DIGITS:].decode("latin-1")
        file.seek(0)
        return hashlib.file_digest(file, "sha256").hexdigest()


def netcdf_bytes(dataset: "xarray.Dataset", encoding: Mapping[str, Mapping[str, object]]) -> bytes:
    """Return a dataset as netCDF bytes, made in memory, as HDF5 crashes on a full disk."""
    buffer = BytesIO()
    dataset.to_netcdf(buffer, engine="h5netcdf", encoding=encoding)
    return buffer.getvalue()


def read_netcdf(
    path: Path, names: Collection[str], remedy: str, *, sealed: bool = True
) -> "xarray.Dataset":
    """Read variables of a netCDF file into memory, by a subprocess with limits.

    A file that this package wrote is `sealed`: it must have its digest.

    Raises
    ------
    UnreadableFile
        as `read_with_digest`; or for content that is not stored in the file itself or that unpacks
        to more than `limits.reading_limit`.
    """
    import xarray

    require_file(path)
    variables, attributes = read_in_subprocess(
        path.absolute(),
        "asperity.core.unpacking:unpack_netcdf",
        [*names],
        remedy,
        sealed,
        remedy=remedy,
    )
    return xarray.Dataset(
        {name: variable for name, variable in variables.items() if variable[0] != (name,)},
        {name: variable for name, variable in variables.items() if variable[0] == (name,)},
        attributes,
    )


def unpack_arrays(body: bytes, name: str, remedy: str) -> dict[str, npt.NDArray[Any]]:
    """Return the arrays of an npz file.

    Raises
    ------
    UnreadableFile
        if it declares more content than `limits.unpacked_limit`, or is damaged.
    """
    try:
        with zipfile.ZipFile(BytesIO(body)) as packed:
            declared = float(sum(entry.file_size for entry in packed.infolist()))
        limit = unpacked_limit(len(body))
        if declared > limit:
            raise UnreadableFile(
                f"{name} declares {declared / GIGABYTE:.2g} GB of content, more than the limit of "
                f"{limit / GIGABYTE:.2g} GB; {remedy}"
            )
        with np.load(BytesIO(body), allow_pickle=False) as stored:
            return {key: stored[key] for key in stored.files}
    except UnreadableFile:
        raise
    except Exception as error:
        raise UnreadableFile(f"{name} is damaged ({first_line(error)}); {remedy}") from error


# Tables
# ------------------------------------------------------------------------------------------


def write_table(path: Path, table: "pyarrow.Table", case: str) -> None:
    """Write a table as parquet with page checksums, its digest and its `case`, atomically.

    Raises as `files.atomic_write`.
    """
    import pyarrow.parquet

    metadata = {**(table.schema.metadata or {}), CASE.encode(): case.encode()}
    table = table.replace_schema_metadata(metadata)
    with_digest = table.replace_schema_metadata(
        {**metadata, SEAL.encode(): digest(table_content(table)).encode()}
    )
    buffer = BytesIO()
    pyarrow.parquet.write_table(with_digest, buffer, write_page_checksum=True)
    write_bytes(path, buffer.getvalue())


def read_table(path: Path, case: str, remedy: str) -> "pyarrow.Table":
    """Return the table that `write_table` wrote for this case, read by a subprocess with limits.

    Raises
    ------
    UnreadableFile
        for a damaged file, a table of another case, and one that unpacks to more than
        `limits.reading_limit`.
    """
    require_file(path)
    table: pyarrow.Table = read_in_subprocess(
        path.absolute(), "asperity.core.unpacking:unpack_table", case, remedy, remedy=remedy
    )
    return table


def require_case(path: Path, found: str | None, case: str, remedy: str) -> None:
    """Raise UnreadableFile unless the file belongs to the case of its folder."""
    if found != case:
        raise UnreadableFile(f"{path} belongs to another case than its folder; {remedy}")


def table_metadata(table: "pyarrow.Table") -> dict[str, str]:
    """Return the metadata of a table as text."""
    metadata = table.schema.metadata or {}
    return {key.decode(): value.decode() for key, value in metadata.items()}


def table_content(table: "pyarrow.Table") -> dict[str, object]:
    """Return a table's metadata, and the type and values of each column."""
    import pyarrow

    content: dict[str, object] = {"": [table_metadata(table), table.column_names]}
    for name, column in zip(table.column_names, table.columns, strict=True):
        kind = column.type
        # parquet renames the items of a list type
        content[f"type of {name}"] = (
            f"list of {kind.value_type}" if pyarrow.types.is_list(kind) else str(kind)
        )
        if pyarrow.types.is_floating(kind) or pyarrow.types.is_integer(kind):
            content[f"where {name}"] = column.is_valid().to_numpy()
            content[f"values of {name}"] = column.fill_null(0).to_numpy()
        else:
            content[f"values of {name}"] = column.to_pylist()
    return content


# Folders
# ------------------------------------------------------------------------------------------


def write_json(path: Path, content: Table) -> None:
    """Write a JSON object with its digest; raises as `files.atomic_write`."""
    plain = json.loads(json.dumps(content))
    write_text(path, json.dumps({**plain, SEAL: digest(plain)}, indent=1))


def read_json(path: Path, remedy: str) -> dict[str, Any]:
    """Return the object that `write_json` wrote; raise UnreadableFile for anything else."""
    require_file(path)
    if path.stat().st_size > MAX_JSON:
        raise UnreadableFile(f"{path} is larger than {MAX_JSON / 1e6:.0f} MB; {remedy}")
    try:
        content = json.loads(path.read_text("utf-8"))
    except (OSError, ValueError, RecursionError):
        raise UnreadableFile(f"{path} is damaged; {remedy}") from None
    if not isinstance(content, dict):
        raise UnreadableFile(f"{path} is damaged: it is not a JSON object; {remedy}")
    verify(path, content.pop(SEAL, None), content, remedy)
    return content


def read_manifest(folder: Path, *, of: str, layout: int) -> dict[str, Any]:
    """Return the manifest of a folder with results of the kind `of` ("study", "history").

    Raises UnreadableFile if the manifest is missing, damaged, of another kind or of another
    `layout`.
    """
    path = folder / MANIFEST
    if not path.exists():
        raise UnreadableFile(f"{folder} holds no {of}: it has no {MANIFEST}; check its name")
    manifest = read_json(path, f"compute the {of} into another folder")
    if manifest.get("format") != layout or manifest.get("of") != of:
        raise UnreadableFile(
            f"{path} is not a {of} manifest that this version of asperity can read; choose another "
            "folder"
        )
    fits = all(isinstance(manifest.get(name), kind) for name, kind in ENTRIES.items())
    # a case without a line break would be taken for the name of a file
    if not fits or "\n" not in manifest["case"] or "asperity" not in manifest["versions"]:
        raise UnreadableFile(f"{path} is damaged; compute the {of} into another folder")
    return manifest


@contextmanager
def refusing_damaged_content(folder: Path, of: str) -> Iterator[None]:
    """Raise UnreadableFile for errors that content of another type or shape causes."""
    try:
        yield
    except AsperityError:
        raise
    except (
        *(ArithmeticError, AssertionError, AttributeError, LookupError, OSError, RecursionError),
        *(TypeError, ValueError),
    ) as error:
        raise UnreadableFile(
            f"{folder} holds a damaged {of} ({first_line(error)[:80]}); compute it into another "
            "folder"
        ) from error


def require_same_version(manifest: Mapping[str, Any], folder: Path) -> None:
    """Raise BadInput if another version of asperity began the folder, so that results never mix."""
    version = manifest["versions"]["asperity"]
    current = asperity.__version__
    if version != current:
        raise BadInput(
            f"{folder} was computed by asperity {version}, this is {current}; choose another folder"
        )


def version_notes(versions: Table) -> tuple[str, ...]:
    """Return a note if the results are from another version of asperity."""
    version = versions.get("asperity")
    current = asperity.__version__
    if version == current:
        return ()
    return (f"Computed by asperity {version}, read by {current}: recomputed values may differ.",)
