"""A history on disk: manifest, rows, maps of some steps, and what the next step needs.

A run that is stopped at any moment goes on from the last step kept and gives, bit for bit, the history it would have
given.
"""

import hashlib
import json
import math
import time
import tomllib
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import filelock
import numpy as np
import pandas
import pyarrow
import pyarrow.parquet
import xarray

from asperity.arrays import Field
from asperity.case import Case, load_case, relative_path
from asperity.ehl import Contents, Memory, Snapshot
from asperity.errors import BadInput, UnreadableFile
from asperity.files import (
    MANIFEST,
    make_folder,
    read_manifest,
    require_same_version,
    require_writable,
    versions,
    whole_file,
    write_text,
)
from asperity.history.history import Frame, History
from asperity.history.rows import Row
from asperity.quantities import quantity
from asperity.surface import MovingSurfaces

FORMAT = 1  # counts up when a reader of the format before could not read the folder
TABLE, MEMORY, MAPS = "history.parquet", "memory.npz", "fields"
KEPT_EVERY_S = 2.0  # what a crash may cost
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
    rows = _rows(folder)
    if not rows:
        raise UnreadableFile(f"{folder} holds a history without a step; run its case again")
    frames = _frames(folder, int(rows[-1]["step"]))
    return History(case=case, table=pandas.DataFrame(rows), frames=frames, folder=folder, memory=_memory(folder))


def is_history(folder: Path) -> bool:
    """Whether a folder says of itself that it holds a history."""
    try:
        return (folder / TABLE).exists() and json.loads((folder / MANIFEST).read_text("utf-8"))["of"] == "history"
    except (OSError, ValueError, KeyError, TypeError):
        return False


class Keeper:
    """The rows and maps of a history as they come, in memory and, with a folder, on disk."""

    def __init__(self, case: Case, folder: Path | None, every: int) -> None:
        self.case, self.folder, self.every = case, folder, every
        self.rows: list[Row] = []
        self.frames: list[Frame] = []
        self.memory: Memory | None = None
        self.kept_at = time.monotonic()
        if folder is not None and (memory := _memory(folder)) is not None:
            self.memory = memory
            self.rows = [row for row in _rows(folder) if row["step"] <= int(memory["number"])]
            if self.last != int(memory["number"]):
                raise UnreadableFile(f"{folder / TABLE} ends before {folder / MEMORY}; start another folder")

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
            self.frames.append(Frame(snapshot.number, snapshot.time, gap, pressure, solution.in_contact))
            return
        touching, heights = solution.in_contact.astype(np.int8), solution.surface.heights.astype(np.float32)
        maps = {"gap": gap, "pressure": pressure, "in_contact": touching, "surface_height": heights}
        about = {"title": "Step of a moving contact", "step": snapshot.number, "time_s": snapshot.time}
        contents = Contents(
            {name: (("x", "y"), values, quantity(name).attributes) for name, values in maps.items()},
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
        table = pyarrow.Table.from_pylist(self.rows).replace_schema_metadata({"case": self.case.text})
        with whole_file(folder / TABLE) as part:
            pyarrow.parquet.write_table(table, part)
        arrays: dict[str, Any] = dict(self.memory)
        with whole_file(folder / MEMORY) as part, part.open("wb") as file:
            np.savez(file, **arrays)
        self.kept_at = time.monotonic()

    def history(self, seconds: float, computed: int) -> History:
        """All of it, written."""
        if self.folder is not None and computed:
            self.write(self.folder)
        return History(
            case=self.case,
            table=pandas.DataFrame(self.rows),
            frames=tuple(self.frames) if self.folder is None else _frames(self.folder, self.last),
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

    `BadInput` for a folder that cannot be written to, that holds something else, or that another process is working in.
    """
    if every is not None and every < 1:
        raise BadInput(f"maps are kept every 1 step or more, got {every}; leave it out for about {MAPS_KEPT} in all")
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
            raise BadInput(f"{folder} holds the history of another case than {case.source}; {remedy}")
        usual = kept["every"]
    elif folder.exists() and any(folder.iterdir()):
        raise BadInput(f"{folder} is not empty and holds no history; name a new folder")
    make_folder(folder / MAPS)
    require_writable(manifest)
    try:
        with filelock.FileLock(folder / ".lock", timeout=0):
            for left in (*folder.glob(".*.part"), *(folder / MAPS).glob(".*.part")):
                left.unlink(missing_ok=True)
            write_text(manifest, json.dumps(_manifest(case, digest, every or usual, folder), indent=1))
            yield Keeper(case, folder, every or usual)
    except filelock.Timeout:
        raise BadInput(f"another process computes this history in {folder}; wait for it, or stop it") from None


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


def _rows(folder: Path) -> list[Row]:
    path = folder / TABLE
    if not path.exists():
        return []
    try:
        rows: list[Row] = pyarrow.parquet.read_table(path).to_pylist()
    except (OSError, pyarrow.ArrowException) as error:
        raise UnreadableFile(f"{path} is damaged ({error}); run the case into another folder") from None
    return rows


def _memory(folder: Path) -> Mapping[str, Field] | None:
    path = folder / MEMORY
    if not path.exists():
        return None
    try:
        with np.load(path, allow_pickle=False) as kept:
            return {name: kept[name] for name in kept.files}
    except (OSError, ValueError, KeyError, EOFError) as error:
        raise UnreadableFile(f"{path} is damaged ({error}); run the case into another folder") from None


def _frames(folder: Path, last: int) -> tuple[Frame, ...]:
    """The maps on disk, up to the last step kept."""
    frames = []
    for path in sorted((folder / MAPS).glob("step-*.nc")):
        try:
            with xarray.open_dataset(path, engine="h5netcdf", decode_cf=False) as opened:
                number, when = int(opened.attrs["step"]), float(opened.attrs["time_s"])
                maps = [opened[name].values for name in ("gap", "pressure", "in_contact")]
        except (OSError, ValueError, KeyError, TypeError, RuntimeError, AttributeError):
            raise UnreadableFile(f"{path} is damaged; delete it, or run the case into another folder") from None
        if number <= last:
            frames.append(Frame(number, when, maps[0], maps[1], maps[2].astype(bool)))
    return tuple(frames)
