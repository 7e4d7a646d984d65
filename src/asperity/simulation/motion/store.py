"""A history on disk: manifest, rows, maps of some steps, and what the next step needs.

A run that is stopped at any moment goes on from the last step kept and gives, bit for bit, the
history it would have given.
"""

import hashlib
import json
import math
import time
import tomllib
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from io import BytesIO
from pathlib import Path
from typing import Any

import filelock
import numpy as np
import pandas
import pyarrow

from asperity.case import Case, load_case, relative_path
from asperity.core.arrays import Field
from asperity.core.errors import BadInput, UnreadableFile
from asperity.core.files import make_folder, require_writable, versions
from asperity.core.quantities import quantity
from asperity.core.storage import (
    MANIFEST,
    read_manifest,
    read_netcdf,
    read_sealed,
    read_table,
    require_case,
    require_same_version,
    version_notes,
    write_json,
    write_sealed,
    write_table,
)
from asperity.ehl import Contents
from asperity.simulation.motion.history import History, MotionFrame
from asperity.simulation.motion.rows import Row
from asperity.surface import MovingSurfaces
from asperity.transient import Memory, Snapshot

FORMAT = 2  # counts up when a reader of the format before could not read the folder
TABLE, MEMORY, MAPS, LOCK = "history.parquet", "memory.npz", "fields", ".lock"
KEPT_EVERY_S = 2.0  # what a crash may cost
IDENTITY, REMEDY = "identity", "run the case into another folder"
MAPS_KEPT = 40  # in a whole history, unless said otherwise


def load_history(folder: str | Path) -> History:
    """A history as its folder keeps it.

    Raises
    ------
    UnreadableFile
        if there is none, or it is damaged.
    """
    folder = Path(folder)
    manifest = read_manifest(folder, of="history", layout=FORMAT)
    home = (folder / manifest["case_folder"]).resolve()
    case = load_case(manifest["case"], folder=home, name=manifest["source"])
    identity: str = manifest["digest"]
    rows = _rows(folder, identity)
    if not rows:
        raise UnreadableFile(f"{folder} holds a history without a step; run its case again")
    return History(
        case=case,
        table=pandas.DataFrame(rows),
        frames=_frames(folder, identity, int(rows[-1]["step"])),
        folder=folder,
        memory=_memory(folder, identity),
        remarks=version_notes(manifest["versions"]),
    )


def is_history_folder(folder: Path) -> bool:
    """Whether a folder says of itself that it holds a history."""
    path = folder / MANIFEST
    try:
        return (
            (folder / TABLE).exists()
            and path.is_file()
            and json.loads(path.read_text("utf-8"))["of"] == "history"
        )
    except (OSError, ValueError, KeyError, TypeError, RecursionError):
        return False


class Keeper:
    """The rows and maps of a history as they come, in memory and, with a folder, on disk."""

    def __init__(self, case: Case, folder: Path | None, every: int, identity: str = "") -> None:
        self.case, self.folder, self.every, self.identity = case, folder, every, identity
        self.rows: list[Row] = []
        self.frames: list[MotionFrame] = []
        self.memory: Memory | None = None
        self.kept_at = time.monotonic()
        if folder is not None and (memory := _memory(folder, identity)) is not None:
            self.memory = memory
            self.rows = [
                row for row in _rows(folder, identity) if row["step"] <= int(memory["number"])
            ]
            if self.last != int(memory["number"]):
                raise UnreadableFile(
                    f"{folder / TABLE} ends before {folder / MEMORY}; start another folder"
                )

    @property
    def last(self) -> int:
        """Number of the last step kept; -1 before the start."""
        return int(self.rows[-1]["step"]) if self.rows else -1

    def keep(self, snapshot: Snapshot, row: Row, *, bad: bool) -> None:
        """Keep a step; after a bad one the history goes on from the last good one."""
        self.rows.append(row)
        if not bad:
            self.memory = snapshot.memory
            if snapshot.number % self.every == 0:
                self._keep_frame(snapshot)
        if self.folder is not None and time.monotonic() - self.kept_at > KEPT_EVERY_S:
            self.write(self.folder)

    def _keep_frame(self, snapshot: Snapshot) -> None:
        solution, grid = snapshot.solution, snapshot.solution.grid
        gap, pressure = solution.gap.astype(np.float32), solution.pressure.astype(np.float32)
        if self.folder is None:
            self.frames.append(
                MotionFrame(snapshot.number, snapshot.time, gap, pressure, solution.in_contact)
            )
            return
        touching, heights = (
            solution.in_contact.astype(np.int8),
            solution.surface.heights.astype(np.float32),
        )
        maps = {"gap": gap, "pressure": pressure, "in_contact": touching, "surface_height": heights}
        about = {
            "title": "Step of a moving contact",
            "step": snapshot.number,
            "time_s": snapshot.time,
        }
        about |= {"case": self.identity}
        contents = Contents(
            {
                name: (("x", "y"), values, quantity(name).attributes)
                for name, values in maps.items()
            },
            {
                "x": ("x", grid.x, {**quantity("x_m").attributes, "axis": "X"}),
                "y": ("y", solution.grid.y, {**quantity("y_m").attributes, "axis": "Y"}),
            },
            {"Conventions": "CF-1.11", **about},
        )
        contents.variables["in_contact"][2].update(
            {"flag_values": np.array([0, 1], np.int8), "flag_meanings": "apart touching"}
        )
        contents.save(self.folder / MAPS / f"step-{snapshot.number:06d}.nc")

    def write(self, folder: Path) -> None:
        """Rows first, then what the next step needs: a crash between them leaves rows too many, which are dropped."""
        if self.memory is None:
            return
        table = pyarrow.Table.from_pylist(self.rows).replace_schema_metadata(
            {"case": self.case.text}
        )
        write_table(folder / TABLE, table, self.identity)
        arrays: dict[str, Any] = {**self.memory, IDENTITY: np.array(self.identity)}
        packed = BytesIO()
        np.savez(packed, **arrays)
        write_sealed(folder / MEMORY, packed.getvalue())
        self.kept_at = time.monotonic()

    def history(self, seconds: float, computed: int) -> History:
        """All of it, written."""
        if self.folder is not None and computed:
            self.write(self.folder)
        return History(
            case=self.case,
            table=pandas.DataFrame(self.rows),
            frames=tuple(self.frames)
            if self.folder is None
            else _frames(self.folder, self.identity, self.last),
            folder=self.folder,
            seconds=seconds,
            computed=computed,
            memory=self.memory,
        )


@contextmanager
def open_keeper(
    case: Case, surfaces: MovingSurfaces, last: int, folder: Path | None, every: int | None
) -> Iterator[Keeper]:
    """A history's folder, made or found and held against others, or no folder.

    `BadInput` for a folder that cannot be written to, that holds something else, or that another
    process is working in.
    """
    if every is not None and every < 1:
        raise BadInput(
            f"maps are kept every 1 step or more, got {every}; leave it out for about {MAPS_KEPT} in all"
        )
    usual = max(1, math.ceil(last / MAPS_KEPT))
    if folder is None:
        yield Keeper(case, None, every or usual)
        return
    if folder.exists():
        make_folder(folder)  # a file is refused
    digest, manifest = _digest(case, surfaces), folder / MANIFEST
    if manifest.exists():
        kept = read_manifest(folder, of="history", layout=FORMAT)
        require_same_version(kept, folder)
        if kept["digest"] != digest:
            remedy = "choose another folder, or the case as it was"
            raise BadInput(
                f"{folder} holds the history of another case than {case.source}; {remedy}"
            )
        usual = kept["every"]
    elif folder.exists() and not all(map(_just_begun, folder.iterdir())):
        raise BadInput(f"{folder} is not empty and holds no history; name a new folder")
    make_folder(folder / MAPS)
    require_writable(manifest)
    try:
        with filelock.FileLock(folder / LOCK, timeout=0):
            for left in (*folder.glob(".*.part"), *(folder / MAPS).glob(".*.part")):
                left.unlink(missing_ok=True)
            write_json(manifest, _manifest(case, digest, every or usual, folder))
            yield Keeper(case, folder, every or usual, digest)
    except filelock.Timeout:
        raise BadInput(
            f"another process computes this history in {folder}; wait for it, or stop it"
        ) from None


def _just_begun(entry: Path) -> bool:
    """Whether a file is of a history that another process is beginning, or was killed at."""
    return entry.name in (LOCK, MAPS) or (
        entry.name.startswith(f".{MANIFEST}.") and entry.suffix == ".part"
    )


def _digest(case: Case, surfaces: MovingSurfaces) -> str:
    """What has to be the same for a history to go on: all of the case but how long it goes on, and its surfaces."""
    tables = tomllib.loads(case.text)
    tables["motion"] = case.motion.model_dump(exclude={"steps"})
    tables.pop("study", None)
    digest = hashlib.sha256(json.dumps(tables, sort_keys=True).encode())
    for surface in (surfaces.first, surfaces.second):
        digest.update(np.ascontiguousarray(surface.heights).tobytes())
    return digest.hexdigest()


def _manifest(case: Case, digest: str, every: int, folder: Path) -> dict[str, Any]:
    return {
        "of": "history",
        "format": FORMAT,
        "digest": digest,
        "versions": versions(),
        "source": case.source,
        "case": case.text,
        "case_folder": relative_path(case.folder.resolve(), folder.resolve()),
        "every": every,
    }


def _rows(folder: Path, identity: str) -> list[Row]:
    path = folder / TABLE
    if not path.exists():
        return []
    rows: list[Row] = read_table(path, identity, REMEDY).to_pylist()
    return rows


def _memory(folder: Path, identity: str) -> Mapping[str, Field] | None:
    path = folder / MEMORY
    if not path.exists():
        return None
    with np.load(BytesIO(read_sealed(path, REMEDY)), allow_pickle=False) as kept:
        memory = {name: kept[name] for name in kept.files}
    require_case(path, str(memory.pop(IDENTITY, None)), identity, REMEDY)
    return memory


def _frames(folder: Path, identity: str, last: int) -> tuple[MotionFrame, ...]:
    """The maps on disk, up to the last step kept."""
    frames = []
    for path in sorted((folder / MAPS).glob("step-*.nc")):
        remedy = f"delete it, or {REMEDY}"
        kept = read_netcdf(path, remedy)
        require_case(path, kept.attrs.get("case"), identity, remedy)
        number, when = int(kept.attrs["step"]), float(kept.attrs["time_s"])
        maps = [kept[name].values for name in ("gap", "pressure", "in_contact")]
        if number <= last:
            frames.append(MotionFrame(number, when, maps[0], maps[1], maps[2].astype(bool)))
    return tuple(frames)
