"""Resumable result folders: manifest, rows, arrays, resume check and lock.

A run that is stopped at any moment resumes from its last saved step and gives bit-identical
results.
"""

import hashlib
import json
import time
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from io import BytesIO
from pathlib import Path
from typing import Any, Generic, NamedTuple, TypeVar

import filelock
import numpy as np
import numpy.typing as npt
import pyarrow

from asperity.case import Case, load_case, relative_path
from asperity.core.documents import JsonObject, Table
from asperity.core.errors import BadInput, UnreadableFile
from asperity.core.files import make_folder, require_writable, versions
from asperity.core.storage import (
    MANIFEST,
    read_manifest,
    read_table,
    read_with_digest,
    require_case,
    require_same_version,
    stored_digest,
    unpack_arrays,
    version_notes,
    write_json,
    write_table,
    write_with_digest,
)
from asperity.surface import MovingSurfaces

MEMORY, LOCK = "memory.npz", ".lock"  # state for the next step; held while a process works
SAVE_INTERVAL_S = 2.0  # what a crash may cost
IDENTITY = "identity"  # array that holds the digest of the case
FILES = "files"  # digests of files: key of a table's metadata, or array with JSON
NAMED = 3  # files that a remark names
REMEDY = "compute the case into another folder"

Arrays = dict[str, npt.NDArray[Any]]
T = TypeVar("T")
Row = TypeVar("Row")


@dataclass(frozen=True, slots=True)
class FolderLayout:
    """Layout of one kind of result folder.

    `kind` and `version` identify it in the manifest; the version increases when an older reader
    could not read the folder. `contents` names the results in messages, `table` is the file of
    the rows, `subfolders` hold further files.
    """

    kind: str
    version: int
    contents: str
    table: str
    subfolders: tuple[str, ...]

    def matches(self, folder: Path) -> bool:
        """Return True if the folder's manifest states this kind."""
        path = folder / MANIFEST
        try:
            return path.is_file() and json.loads(path.read_text("utf-8"))["of"] == self.kind
        except (OSError, ValueError, KeyError, TypeError, RecursionError):
            return False

    def is_new(self, folder: Path) -> bool:
        """Return True if a folder is empty, or was left by a run that had no manifest yet."""
        return all(
            entry.name in (LOCK, *self.subfolders)
            or (entry.name.startswith(f".{MANIFEST}.") and entry.suffix == ".part")
            for entry in folder.iterdir()
        )


@dataclass(frozen=True, slots=True)
class RunFolder:
    """Files of one run; `identity` is the digest of its case, which every file carries."""

    path: Path
    layout: FolderLayout
    identity: str

    def rows(self) -> "pyarrow.Table | None":
        """Read the stored rows; None if there are none."""
        path = self.path / self.layout.table
        return read_table(path, self.identity, REMEDY) if path.exists() else None

    def write_rows(
        self, table: "pyarrow.Table", case: Case, digests: Mapping[str, str] | None = None
    ) -> None:
        """Write the rows, with the text of the case and the digests of files in the metadata."""
        metadata = {"case": case.text}
        if digests is not None:
            metadata[FILES] = json.dumps(digests)
        table = table.replace_schema_metadata(metadata)
        write_table(self.path / self.layout.table, table, self.identity)

    def digests(self, names: Iterable[str]) -> dict[str, str]:
        """Return the digest of each file by its name in the folder; "" for the state."""
        found = {name: stored_digest(self.path / name, REMEDY) for name in names}
        # the state is written after the list, and again while a finished run is extended
        return found | ({MEMORY: ""} if (self.path / MEMORY).exists() else {})

    def _is_inside(self, path: Path) -> bool:
        return path.resolve().is_relative_to(self.path.resolve())

    def check_files(
        self, digests: Mapping[str, str], is_surplus: Callable[[str], bool]
    ) -> tuple[list[str], tuple[str, ...]]:
        """Return the listed files that are there, and remarks on all that differs from the list.

        `is_surplus` returns True for a file that an interrupted process may have left behind.

        Raises
        ------
        UnreadableFile
            for a listed file with another content.
        """
        present = {
            path.relative_to(self.path).as_posix()
            for folder in self.layout.subfolders
            for path in (self.path / folder).glob("[!.]*")
        }
        for name in digests:
            if ".." in Path(name).parts or not self._is_inside(self.path / name):
                raise UnreadableFile(f"{self.path} lists a file outside of it, {name[:60]!r}")
        lost = [name for name in digests if not (self.path / name).is_file()]
        intact = [name for name in digests if name not in lost]
        for name in intact:
            if digests[name] not in ("", stored_digest(self.path / name, REMEDY)):
                raise UnreadableFile(
                    f"{self.path / name} is not the file that was stored, or is of another case; "
                    f"remove it, and the {self.layout.contents} is shown without"
                )
        others = [name for name in sorted(present - {*digests}) if not is_surplus(name)]
        remarks = []
        if lost:
            remarks.append(
                f"{_named(lost)} missing since the {self.layout.contents} was stored; "
                "it is shown without"
            )
        if others:
            remarks.append(f"{_named(others)} not part of the {self.layout.contents}, and left out")
        return intact, tuple(remarks)

    def arrays(self, name: str, build: Callable[[Arrays], T]) -> T | None:
        """Read a file of arrays and `build` an object from them; None if there is no file."""
        path = self.path / name
        if not path.exists():
            return None
        try:
            arrays = unpack_arrays(read_with_digest(path, REMEDY), str(path), REMEDY)
            require_case(path, str(arrays.pop(IDENTITY, "")), self.identity, REMEDY)
            return build(arrays)
        except UnreadableFile:
            raise
        except Exception as error:
            raise UnreadableFile(
                f"{path} is damaged or was written by another version; {REMEDY}"
            ) from error

    def write_arrays(self, name: str, arrays: Arrays) -> None:
        """Write arrays and the identity of the case."""
        everything: dict[str, Any] = {**arrays, IDENTITY: np.array(self.identity)}
        packed = BytesIO()
        np.savez(packed, **everything)
        write_with_digest(self.path / name, packed.getvalue())


def _named(names: Sequence[str]) -> str:
    """Return the first of some files as the subject of a sentence."""
    more = f" and {len(names) - NAMED} more" if len(names) > NAMED else ""
    return f"{', '.join(names[:NAMED])}{more} {'is' if len(names) == 1 else 'are'}"


class RunRecorder(Generic[Row]):
    """Rows of a run, in memory and, with a folder, on disk."""

    def __init__(self, files: RunFolder | None) -> None:
        self.files = files
        self.rows: list[Row] = []
        self.saved_at = time.monotonic()

    @property
    def is_due(self) -> bool:
        """True if the last save is longer ago than SAVE_INTERVAL_S."""
        return time.monotonic() - self.saved_at > SAVE_INTERVAL_S

    def require_rows(self, complete: bool) -> None:
        """Raise UnreadableFile if the stored rows end before the stored state."""
        if self.files is not None and not complete:
            table = self.files.layout.table
            memory = self.files.path / MEMORY
            raise UnreadableFile(
                f"{self.files.path / table} ends before {memory}; choose another folder"
            )

    def require_state(self, present: bool) -> None:
        """Raise UnreadableFile if the state of a stored run is missing."""
        if self.files is not None and not present:
            raise UnreadableFile(
                f"{self.files.path / MEMORY} is missing; restore it, or choose another folder"
            )


class StoredRun(NamedTuple):
    """Run in a folder: its case, its files, and remarks on its version."""

    case: Case
    files: RunFolder
    remarks: tuple[str, ...]


def stored_run(folder: Path, layout: FolderLayout) -> StoredRun:
    """Read the manifest of a folder; UnreadableFile if there is none, or it is damaged."""
    manifest = read_manifest(folder, of=layout.kind, layout=layout.version)
    home = (folder / manifest["case_folder"]).resolve()
    case = load_case(manifest["case"], folder=home, name=manifest["source"])
    files = RunFolder(folder, layout, manifest["digest"])
    return StoredRun(case, files, version_notes(manifest["versions"]))


def case_digest(tables: Table, surfaces: MovingSurfaces) -> str:
    """Return the digest of all that must be unchanged to resume a run."""
    digest = hashlib.sha256(json.dumps(tables, sort_keys=True).encode())
    for surface in (surfaces.first, surfaces.second):
        digest.update(np.ascontiguousarray(surface.heights).tobytes())
    return digest.hexdigest()


def resumable_manifest(files: RunFolder, case: Case) -> dict[str, Any] | None:
    """Return the manifest of a folder to resume; None for a new folder.

    Raises BadInput for a folder with other contents, and for another case or version.
    """
    folder, layout = files.path, files.layout
    if not folder.exists():
        return None
    make_folder(folder)  # refuses a file
    if (folder / MANIFEST).exists():
        manifest = read_manifest(folder, of=layout.kind, layout=layout.version)
        require_same_version(manifest, folder)
        if manifest["digest"] != files.identity:
            raise BadInput(
                f"{folder} holds the {layout.contents} of another case than {case.source}; "
                "choose another folder, or restore the case"
            )
        return manifest
    if not layout.is_new(folder):
        raise BadInput(f"{folder} is not empty and holds no {layout.contents}; name a new folder")
    return None


@contextmanager
def locked_folder(files: RunFolder, case: Case, **entries: object) -> Iterator[None]:
    """Create the folder, lock it, remove partial files and write the manifest with `entries`.

    Raises BadInput for a folder that cannot be written to, or that another process works in.
    """
    folder, layout = files.path, files.layout
    for subfolder in layout.subfolders:
        make_folder(folder / subfolder)
    require_writable(folder / MANIFEST)
    try:
        with filelock.FileLock(folder / LOCK, timeout=0):
            for directory in (".", *layout.subfolders):
                for partial in (folder / directory).glob(".*.part"):
                    partial.unlink(missing_ok=True)
            write_json(folder / MANIFEST, _manifest(files, case) | entries)
            yield
    except filelock.Timeout:
        raise BadInput(
            f"another process is computing this {layout.contents} in {folder}; "
            "wait until it ends, or stop it"
        ) from None


def _manifest(files: RunFolder, case: Case) -> JsonObject:
    return {
        "of": files.layout.kind,
        "format": files.layout.version,
        "digest": files.identity,
        "versions": versions(),
        "source": case.source,
        "case": case.text,
        "case_folder": relative_path(case.folder.resolve(), files.path.resolve()),
    }
