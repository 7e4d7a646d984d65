"""A wear history on disk: manifest, rows, what the next jump needs, frames, the end, surfaces before and after.

A run that is killed at any moment goes on from the last jump kept and gives, bit for bit, what it
would have given; one that is over goes on to more hours as if it had been asked for them at first.
So what the next jump needs is kept before the last jump, which the end cuts short, and the end
apart from it with a row and a frame of its own: a longer run that is killed on its way leaves it
as it was.
"""

import hashlib
import json
import time
import tomllib
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from io import BytesIO
from pathlib import Path
from typing import Any, NamedTuple, TypeVar

import filelock
import numpy as np
import numpy.typing as npt
import pandas
import pyarrow

from asperity.case import Case, load_case, relative_path
from asperity.core.errors import BadInput, UnreadableFile
from asperity.core.files import make_folder, require_writable, versions
from asperity.core.storage import (
    MANIFEST,
    read_manifest,
    read_sealed,
    read_table,
    require_case,
    require_same_version,
    version_notes,
    write_json,
    write_sealed,
    write_table,
)
from asperity.simulation.wear.frames import WearFrame, is_kept
from asperity.simulation.wear.history import WearHistory
from asperity.simulation.wear.jump import WearingContact
from asperity.simulation.wear.rows import Row
from asperity.simulation.wear.state import WearState
from asperity.surface import MovingSurfaces, write_surface

FORMAT = 3  # counts up when a reader of the format before could not read the folder
TABLE, MEMORY, END, LOCK = "wear.parquet", "memory.npz", "end.npz", ".lock"
SURFACES, FRAMES = "surfaces", "frames"
KEPT_EVERY_S = 2.0  # what a crash may cost
IDENTITY, REMEDY = "identity", "wear the case in another folder"
T = TypeVar("T")


Arrays = dict[str, npt.NDArray[Any]]


class End(NamedTuple):
    """Where a history ends: what it has come to, its last row and its last frame."""

    worn: WearState
    row: Row
    frame: WearFrame

    def arrays(self) -> Arrays:
        """As arrays by name."""
        frame = {f"frame:{name}": value for name, value in self.frame.arrays().items()}
        return {**self.worn.arrays(), **frame, "row": np.array(json.dumps(self.row))}

    @classmethod
    def of_arrays(cls, arrays: Arrays) -> "End":
        """What `arrays` made."""
        frame = {
            name.removeprefix("frame:"): value
            for name, value in arrays.items()
            if name.startswith("frame:")
        }
        return cls(
            WearState.of_arrays(arrays), json.loads(str(arrays["row"])), WearFrame.of_arrays(frame)
        )


class Keeper:
    """The rows of a wear history as they come, in memory and, with a folder, on disk."""

    def __init__(self, ageing: WearingContact, folder: Path | None, identity: str = "") -> None:
        self.ageing, self.folder, self.identity = ageing, folder, identity
        self.rows: list[Row] = []
        self.frames: dict[int, WearFrame] = {}
        self.worn = WearState.begin(ageing.surfaces)
        self.end: End | None = None
        self.kept_at = time.monotonic()
        if folder is None:
            return
        self.end = _read(folder / END, identity, End.of_arrays)
        worn = _read(folder / MEMORY, identity, WearState.of_arrays)
        if worn is not None:
            self.worn, self.rows = worn, _rows(folder, identity)
            if len(self.rows) < worn.number:
                raise UnreadableFile(
                    f"{folder / TABLE} ends before {folder / MEMORY}; start another folder"
                )
            self.frames = _frames(folder, identity, worn.number)

    def take(self, row: Row, frame: WearFrame) -> None:
        """Take the row of a jump, in place of one that was taken before, and its frame; some of those before go."""
        self.rows = [*self.rows[: frame.number], row]
        self.frames[frame.number] = frame
        gone = [number for number in self.frames if not is_kept(number, frame.number)]
        for number in gone:
            del self.frames[number]
        if self.folder is None:
            return
        for number in gone:
            _frame_file(self.folder, number).unlink(missing_ok=True)
        if frame.number in self.frames:
            write_sealed(
                _frame_file(self.folder, frame.number), _packed(frame.arrays(), self.identity)
            )

    def keep(self, worn: WearState, *, at_once: bool = False) -> None:
        """Keep what the next jump needs, from time to time."""
        self.worn = worn
        if self.folder is not None and (at_once or time.monotonic() - self.kept_at > KEPT_EVERY_S):
            self._write_rows(self.folder)
            write_sealed(self.folder / MEMORY, _packed(worn.arrays(), self.identity))
            self.kept_at = time.monotonic()

    def _write_rows(self, folder: Path) -> None:
        table = pyarrow.Table.from_pandas(pandas.DataFrame(self.rows), preserve_index=False)
        write_table(
            folder / TABLE,
            table.replace_schema_metadata({"case": self.ageing.case.text}),
            self.identity,
        )

    def finish(self, worn: WearState, row: Row, frame: WearFrame) -> None:
        """Keep the end, and the surfaces as they are then."""
        self.end = End(worn, row, frame)
        self.rows = [*self.rows[: worn.number], row]
        if self.folder is None:
            return
        self.keep(self.worn, at_once=True)
        (self.folder / END).unlink(
            missing_ok=True
        )  # that of fewer hours, whose surfaces are about to go
        after = self.ageing.worn_surfaces(worn)
        for name, surfaces in (("before", self.ageing.surfaces), ("after", after)):
            _write_both(surfaces, self.folder / SURFACES, name)
        write_sealed(self.folder / END, _packed(self.end.arrays(), self.identity))

    def history(self, seconds: float, computed: int) -> WearHistory:
        """All of it."""
        assert self.end is not None
        return _history(
            self.ageing,
            self.end,
            self.rows,
            self.frames,
            folder=self.folder,
            seconds=seconds,
            computed=computed,
        )


def _history(
    ageing: WearingContact,
    end: End,
    rows: list[Row],
    frames: Mapping[int, WearFrame],
    *,
    folder: Path | None,
    **told: Any,
) -> WearHistory:
    """Up to the end, whatever a longer run has left beyond it."""
    number = end.worn.number
    before = [frames[one] for one in sorted(frames) if one < number and is_kept(one, number)]
    return WearHistory(
        ageing=ageing,
        table=pandas.DataFrame([*rows[:number], end.row]),
        worn=end.worn,
        frames=(*before, end.frame),
        folder=folder,
        path=None if folder is None else folder / TABLE,
        files=() if folder is None else surface_files(folder),
        **told,
    )


def surface_files(folder: Path) -> tuple[Path, ...]:
    """The surfaces of a wear history's folder."""
    return tuple(
        folder / SURFACES / f"{body}-{when}.x3p"
        for body in ("first", "second")
        for when in ("before", "after")
    )


def _write_both(surfaces: MovingSurfaces, folder: Path, when: str) -> None:
    for body, surface in (("first", surfaces.first), ("second", surfaces.second)):
        write_surface(surface, folder / f"{body}-{when}.x3p")


def load_wear(folder: str | Path) -> WearHistory:
    """A wear history as its folder keeps it.

    Raises
    ------
    UnreadableFile
        if there is none, it is damaged, or has not come to its end.
    """
    folder = Path(folder)
    manifest = read_manifest(folder, of="wear", layout=FORMAT)
    home = (folder / manifest["case_folder"]).resolve()
    case = load_case(manifest["case"], folder=home, name=manifest["source"])
    identity: str = manifest["digest"]
    end = _read(folder / END, identity, End.of_arrays)
    if end is None:
        raise UnreadableFile(
            f"{folder} holds a wear history that has not come to its end; run asperity wear again"
        )
    assert case.wear is not None
    ageing = WearingContact(case, case.wear, case.moving_surfaces())
    rows, frames = _rows(folder, identity), _frames(folder, identity, end.worn.number)
    return _history(
        ageing, end, rows, frames, folder=folder, remarks=version_notes(manifest["versions"])
    )


def is_wear_folder(folder: Path) -> bool:
    """Whether a folder says of itself that it holds a wear history."""
    path = folder / MANIFEST
    try:
        return path.is_file() and json.loads(path.read_text("utf-8"))["of"] == "wear"
    except (OSError, ValueError, KeyError, TypeError, RecursionError):
        return False


@contextmanager
def open_keeper(ageing: WearingContact, folder: Path | None) -> Iterator[Keeper]:
    """A wear history's folder, made or found and held against others, or no folder.

    `BadInput` for a folder that cannot be written to, that holds something else, or that another
    process is working in.
    """
    if folder is None:
        yield Keeper(ageing, None)
        return
    case = ageing.case
    if folder.exists():
        make_folder(folder)  # a file is refused
    digest, manifest = _digest(case, ageing.surfaces), folder / MANIFEST
    if manifest.exists():
        kept = read_manifest(folder, of="wear", layout=FORMAT)
        require_same_version(kept, folder)
        if kept["digest"] != digest:
            remedy = "choose another folder, or the case as it was"
            raise BadInput(f"{folder} holds the wear of another case than {case.source}; {remedy}")
    elif folder.exists() and not all(map(_just_begun, folder.iterdir())):
        raise BadInput(f"{folder} is not empty and holds no wear history; name a new folder")
    for inside in (SURFACES, FRAMES):
        make_folder(folder / inside)
    require_writable(manifest)
    try:
        with filelock.FileLock(folder / LOCK, timeout=0):
            for left in (
                path
                for place in (".", SURFACES, FRAMES)
                for path in (folder / place).glob(".*.part")
            ):
                left.unlink(missing_ok=True)
            write_json(manifest, _manifest(case, digest, folder))
            yield Keeper(ageing, folder, digest)
    except filelock.Timeout:
        raise BadInput(
            f"another process wears this case in {folder}; wait for it, or stop it"
        ) from None


def _just_begun(entry: Path) -> bool:
    """Whether a file is of a history that another process is beginning, or was killed at."""
    return entry.name in (LOCK, SURFACES, FRAMES) or (
        entry.name.startswith(f".{MANIFEST}.") and entry.suffix == ".part"
    )


def _digest(case: Case, surfaces: MovingSurfaces) -> str:
    """What has to be the same for a history to go on: all of the case but its study, and its surfaces."""
    tables = tomllib.loads(case.text)
    tables.pop("study", None)
    digest = hashlib.sha256(json.dumps(tables, sort_keys=True).encode())
    for surface in (surfaces.first, surfaces.second):
        digest.update(np.ascontiguousarray(surface.heights).tobytes())
    return digest.hexdigest()


def _manifest(case: Case, digest: str, folder: Path) -> dict[str, Any]:
    return {
        "of": "wear",
        "format": FORMAT,
        "digest": digest,
        "versions": versions(),
        "source": case.source,
        "case": case.text,
        "case_folder": relative_path(case.folder.resolve(), folder.resolve()),
    }


def _packed(arrays: Arrays, identity: str) -> bytes:
    everything: dict[str, Any] = {**arrays, IDENTITY: np.array(identity)}
    packed = BytesIO()
    np.savez(packed, **everything)
    return packed.getvalue()


def _read(path: Path, identity: str, made: Callable[[Arrays], T]) -> T | None:
    """What was packed into a file; None where there is none."""
    if not path.exists():
        return None
    try:
        with np.load(BytesIO(read_sealed(path, REMEDY)), allow_pickle=False) as kept:
            arrays = {name: kept[name] for name in kept.files}
        require_case(path, str(arrays.pop(IDENTITY, "")), identity, REMEDY)
        return made(arrays)
    except UnreadableFile:
        raise
    except Exception as error:
        raise UnreadableFile(f"{path} is damaged, or of another asperity; {REMEDY}") from error


def _frame_file(folder: Path, number: int) -> Path:
    return folder / FRAMES / f"{number:06d}.npz"


def _frames(folder: Path, identity: str, before: int) -> dict[int, WearFrame]:
    """Those kept of the jumps before that one."""
    paths = [_frame_file(folder, number) for number in range(before)]
    frames = [
        frame for path in paths if (frame := _read(path, identity, WearFrame.of_arrays)) is not None
    ]
    return {frame.number: frame for frame in frames}


def _rows(folder: Path, identity: str) -> list[Row]:
    path = folder / TABLE
    if not path.exists():
        return []
    rows: list[Row] = read_table(path, identity, REMEDY).to_pandas().to_dict("records")
    return rows
