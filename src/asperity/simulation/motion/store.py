"""Result folder of a history: manifest, rows, maps of some steps, state for the next step."""

import math
import time
import tomllib
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pandas
import pyarrow

from asperity.case import Case
from asperity.core.errors import BadInput, UnreadableFile
from asperity.core.quantities import quantity
from asperity.core.storage import read_netcdf, require_case
from asperity.ehl import FileContents
from asperity.simulation.folder import (
    MEMORY,
    REMEDY,
    Arrays,
    FolderLayout,
    RunFolder,
    RunRecorder,
    case_digest,
    locked_folder,
    resumable_manifest,
    stored_run,
)
from asperity.simulation.motion.history import History, MotionFrame
from asperity.simulation.motion.rows import Row
from asperity.surface import MovingSurfaces
from asperity.transient import Memory, Snapshot

MAPS = "fields"
LAYOUT = FolderLayout(
    kind="history", version=3, contents="history", table="history.parquet", subfolders=(MAPS,)
)
DEFAULT_MAPS = 40  # in a whole history


def load_history(folder: str | Path) -> History:
    """Load a history from its folder.

    Raises
    ------
    UnreadableFile
        if there is none, or it is damaged.
    """
    folder = Path(folder)
    stored = stored_run(folder, LAYOUT)
    rows = _rows(stored.files)
    if not rows:
        raise UnreadableFile(f"{folder} holds a history without a step; run its case again")
    return History(
        case=stored.case,
        table=pandas.DataFrame(rows),
        frames=_frames(stored.files, int(rows[-1]["step"])),
        folder=folder,
        memory=_memory(stored.files),
        remarks=stored.remarks,
    )


def is_history_folder(folder: Path) -> bool:
    """Return True if a folder holds a history."""
    return (folder / LAYOUT.table).exists() and LAYOUT.matches(folder)


class HistoryRecorder(RunRecorder[Row]):
    """Rows and maps of a history during its computation, in memory and, with a folder, on disk."""

    def __init__(self, case: Case, files: RunFolder | None, every: int) -> None:
        super().__init__(files)
        self.case, self.every = case, every
        self.frames: list[MotionFrame] = []
        self.memory: Memory | None = None
        if files is not None and (memory := _memory(files)) is not None:
            self.memory = memory
            self.rows = [row for row in _rows(files) if row["step"] <= int(memory["number"])]
            self.require_rows(self.last == int(memory["number"]))

    @property
    def last(self) -> int:
        """Number of the last recorded step; -1 before the start."""
        return int(self.rows[-1]["step"]) if self.rows else -1

    def record(self, snapshot: Snapshot, row: Row, *, failed: bool) -> None:
        """Record a step; after a failed one the history resumes from the last good one."""
        self.rows.append(row)
        if not failed:
            self.memory = snapshot.memory
            if snapshot.number % self.every == 0:
                self._record_frame(snapshot)
        if self.is_due:
            self.save()

    def _record_frame(self, snapshot: Snapshot) -> None:
        solution = snapshot.solution
        gap = solution.gap.astype(np.float32)
        pressure = solution.pressure.astype(np.float32)
        if self.files is None:
            self.frames.append(
                MotionFrame(snapshot.number, snapshot.time, gap, pressure, solution.in_contact)
            )
        else:
            path = self.files.path / MAPS / f"step-{snapshot.number:06d}.nc"
            _frame_contents(snapshot, self.files.identity).save(path)

    def save(self) -> None:
        """Write rows, then the state: a crash in between leaves surplus rows, which are dropped."""
        if self.files is None or self.memory is None:
            return
        self.files.write_rows(pyarrow.Table.from_pylist(self.rows), self.case)
        self.files.write_arrays(MEMORY, {**self.memory})
        self.saved_at = time.monotonic()

    def history(self, seconds: float, computed: int) -> History:
        """Save and return the history."""
        if computed:
            self.save()
        return History(
            case=self.case,
            table=pandas.DataFrame(self.rows),
            frames=tuple(self.frames) if self.files is None else _frames(self.files, self.last),
            folder=None if self.files is None else self.files.path,
            seconds=seconds,
            computed=computed,
            memory=self.memory,
        )


@contextmanager
def open_recorder(
    case: Case, surfaces: MovingSurfaces, last: int, folder: Path | None, every: int | None
) -> Iterator[HistoryRecorder]:
    """Open a recorder, with a new or resumed folder that is locked against other processes.

    Raises BadInput for a folder that cannot be written to, that holds something else, or that
    another process works in.
    """
    if every is not None and every < 1:
        raise BadInput(
            f"every must be 1 or more, got {every}; "
            f"leave it out for about {DEFAULT_MAPS} maps in all"
        )
    default = max(1, math.ceil(last / DEFAULT_MAPS))
    if folder is None:
        yield HistoryRecorder(case, None, every or default)
        return
    files = RunFolder(folder, LAYOUT, _digest(case, surfaces))
    manifest = resumable_manifest(files, case)
    interval = every or (default if manifest is None else int(manifest["every"]))
    with locked_folder(files, case, every=interval):
        yield HistoryRecorder(case, files, interval)


def _digest(case: Case, surfaces: MovingSurfaces) -> str:
    """Return the digest of the case, without its number of steps, and of its surfaces."""
    tables = tomllib.loads(case.text)
    tables["motion"] = case.motion.model_dump(exclude={"steps"})
    tables.pop("study", None)
    return case_digest(tables, surfaces)


def _rows(files: RunFolder) -> list[Row]:
    table = files.rows()
    rows: list[Row] = [] if table is None else table.to_pylist()
    return rows


def _memory(files: RunFolder) -> Memory | None:
    def unchanged(arrays: Arrays) -> Memory:
        return arrays

    return files.arrays(MEMORY, unchanged)


def _frame_contents(snapshot: Snapshot, identity: str) -> FileContents:
    """Return the maps of a step as a dataset."""
    solution = snapshot.solution
    grid = snapshot.solution.grid
    maps = {
        "gap": solution.gap.astype(np.float32),
        "pressure": solution.pressure.astype(np.float32),
        "in_contact": solution.in_contact.astype(np.int8),
        "surface_height": solution.surface.heights.astype(np.float32),
    }
    contents = FileContents(
        {name: (("x", "y"), values, quantity(name).attributes) for name, values in maps.items()},
        {
            "x": ("x", grid.x, {**quantity("x_m").attributes, "axis": "X"}),
            "y": ("y", grid.y, {**quantity("y_m").attributes, "axis": "Y"}),
        },
        {
            "Conventions": "CF-1.11",
            "title": "Step of a moving contact",
            "step": snapshot.number,
            "time_s": snapshot.time,
            "case": identity,
        },
    )
    contents.variables["in_contact"][2].update(
        {"flag_values": np.array([0, 1], np.int8), "flag_meanings": "apart touching"}
    )
    return contents


VARIABLES = ("gap", "pressure", "in_contact")  # of a frame, which are read


def _frames(files: RunFolder, last: int) -> tuple[MotionFrame, ...]:
    """Read the maps of steps up to the last one."""
    frames = []
    for path in sorted((files.path / MAPS).glob("step-*.nc")):
        remedy = f"delete it, or {REMEDY}"
        stored = read_netcdf(path, VARIABLES, remedy)
        require_case(path, stored.attrs.get("case"), files.identity, remedy)
        number = int(stored.attrs["step"])
        when = float(stored.attrs["time_s"])
        maps = [stored[name].values for name in VARIABLES]
        if number <= last:
            frames.append(MotionFrame(number, when, maps[0], maps[1], maps[2].astype(bool)))
    return tuple(frames)
