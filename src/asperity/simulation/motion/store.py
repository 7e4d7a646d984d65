"""Result folder of a history: manifest, rows, maps of some steps, state for the next step."""

import json
import math
import re
import time
import tomllib
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pandas
import pyarrow

from asperity.case import Case
from asperity.core.errors import BadInput, UnreadableFile
from asperity.core.quantities import quantity
from asperity.core.storage import read_netcdf, refusing_damaged_content, require_case
from asperity.ehl import FileContents
from asperity.simulation.folder import (
    FILES,
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
    with refusing_damaged_content(folder, "history"):
        return _load(folder)


def _load(folder: Path) -> History:
    stored = stored_run(folder, LAYOUT)
    rows, digests = _rows(stored.files)
    if not rows:
        raise UnreadableFile(f"{folder} holds a history without a step; run its case again")
    names, remarks = _checked_files(stored.files, digests, int(rows[-1]["step"]))
    return History(
        case=stored.case,
        table=pandas.DataFrame(rows),
        frames=_frames(stored.files, names),
        folder=folder,
        memory=_memory(stored.files),
        remarks=(*stored.remarks, *remarks),
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
        self.remarks: tuple[str, ...] = ()
        self._frame_names: list[str] = []
        if files is None:
            return
        rows, digests = _rows(files)
        memory = _memory(files)
        # absent if the process was stopped at its first save
        self.require_state(memory is not None or MEMORY not in digests)
        if memory is not None:
            self.memory = memory
            self.rows = [row for row in rows if row["step"] <= int(memory["number"])]
            self.require_rows(self.last == int(memory["number"]))
            names, self.remarks = _checked_files(files, digests, self.last)
            self._frame_names = [name for name in names if _step_of(name) <= self.last]

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
            name = f"{MAPS}/step-{snapshot.number:06d}.nc"
            _frame_contents(snapshot, self.files.identity).save(self.files.path / name)
            self._frame_names.append(name)

    def save(self) -> None:
        """Write rows, then the state: a crash in between leaves surplus rows, which are dropped."""
        if self.files is None or self.memory is None:
            return
        self._write_rows(self.files)
        self.files.write_arrays(MEMORY, {**self.memory})
        self.saved_at = time.monotonic()

    def _write_rows(self, files: RunFolder) -> None:
        digests = files.digests(self._frame_names)
        files.write_rows(pyarrow.Table.from_pylist(self.rows), self.case, digests)

    def history(self, seconds: float, computed: int) -> History:
        """Save and return the history."""
        if computed:
            self.save()
            if self.files is not None:
                self._write_rows(self.files)  # again, as the state exists now
        return History(
            case=self.case,
            table=pandas.DataFrame(self.rows),
            frames=tuple(self.frames)
            if self.files is None
            else _frames(self.files, self._frame_names),
            folder=None if self.files is None else self.files.path,
            seconds=seconds,
            computed=computed,
            memory=self.memory,
            remarks=self.remarks,
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


def _rows(files: RunFolder) -> tuple[list[Row], dict[str, str]]:
    """Return the stored rows, and the digests of the files that were stored with them."""
    table = files.rows()
    if table is None:
        return [], {}
    rows: list[Row] = table.to_pylist()
    digests: dict[str, str] = json.loads(table.schema.metadata.get(FILES.encode(), b"{}"))
    return rows, digests


def _checked_files(
    files: RunFolder, digests: Mapping[str, str], last: int
) -> tuple[list[str], tuple[str, ...]]:
    """Return the maps that belong to the steps up to the last one, and remarks on the others."""
    names, remarks = files.check_files(digests, lambda name: _step_of(name) > last)
    return [name for name in names if name != MEMORY], remarks


def _step_of(name: str) -> int:
    """Return the step of a file of maps by its name; -1 for other names."""
    match = re.fullmatch(rf"{MAPS}/step-(\d+)\.nc", name)
    return int(match[1]) if match else -1


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


def _frames(files: RunFolder, names: Iterable[str]) -> tuple[MotionFrame, ...]:
    """Read files of maps, in order of their steps."""
    frames = []
    for name in sorted(names):
        path, remedy = files.path / name, f"delete it, or {REMEDY}"
        stored = read_netcdf(path, VARIABLES, remedy)
        require_case(path, stored.attrs.get("case"), files.identity, remedy)
        number = int(stored.attrs["step"])
        when = float(stored.attrs["time_s"])
        maps = [stored[name].values for name in VARIABLES]
        frames.append(MotionFrame(number, when, maps[0], maps[1], maps[2].astype(bool)))
    return tuple(frames)
