"""Result folder of a wear history: manifest, rows, state for the next jump, frames, end, surfaces.

A finished run can be extended to more hours, with the same result as if they had been requested at
first. The end cuts the last jump short, so the state before that jump is stored separately from the
end, which has a row and a frame of its own: an extension that is killed leaves the finished history
unchanged.
"""

import json
import re
import time
import tomllib
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pandas
import pyarrow

from asperity.core.errors import UnreadableFile
from asperity.core.storage import refusing_damaged_content
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
from asperity.simulation.wear.frames import WearFrame, is_kept
from asperity.simulation.wear.history import WearHistory
from asperity.simulation.wear.jump import WearingContact
from asperity.simulation.wear.rows import Row
from asperity.simulation.wear.state import WearState
from asperity.surface import MovingSurfaces, write_surface

END = "end.npz"
SURFACES = "surfaces"
FRAMES = "frames"
LAYOUT = FolderLayout(
    kind="wear",
    version=4,
    contents="wear history",
    table="wear.parquet",
    subfolders=(SURFACES, FRAMES),
)


class HistoryEnd(NamedTuple):
    """End of a wear history: state, last row and last frame."""

    worn: WearState
    row: Row
    frame: WearFrame

    def arrays(self) -> Arrays:
        """Return the arrays to store, by name."""
        frame = {f"frame:{name}": value for name, value in self.frame.arrays().items()}
        return {**self.worn.arrays(), **frame, "row": np.array(json.dumps(self.row))}

    @classmethod
    def from_arrays(cls, arrays: Arrays) -> "HistoryEnd":
        """Rebuild the end from `arrays`."""
        frame = {
            name.removeprefix("frame:"): value
            for name, value in arrays.items()
            if name.startswith("frame:")
        }
        return cls(
            WearState.from_arrays(arrays),
            json.loads(str(arrays["row"])),
            WearFrame.from_arrays(frame),
        )


class WearRecorder(RunRecorder[Row]):
    """Rows of a wear history during its computation, in memory and, with a folder, on disk."""

    def __init__(self, contact: WearingContact, files: RunFolder | None) -> None:
        super().__init__(files)
        self.contact = contact
        self.frames: dict[int, WearFrame] = {}
        self.worn = WearState.unworn(contact.surfaces)
        self.end: HistoryEnd | None = None
        if files is None:
            return
        self.end = files.arrays(END, HistoryEnd.from_arrays)
        state = files.arrays(MEMORY, WearState.from_arrays)
        self.require_state(state is not None or self.end is None)
        if state is not None:
            self.worn, self.rows = state, _rows(files)
            self.require_rows(len(self.rows) >= state.number)
            self.frames = _frames(files, map(_frame_file, range(state.number)))

    def record(self, row: Row, frame: WearFrame) -> None:
        """Record row and frame of a jump, in place of an earlier one; drop surplus frames."""
        self.rows = [*self.rows[: frame.number], row]
        self.frames[frame.number] = frame
        surplus = [number for number in self.frames if not is_kept(number, frame.number)]
        for number in surplus:
            del self.frames[number]
        if self.files is None:
            return
        for number in surplus:
            (self.files.path / _frame_file(number)).unlink(missing_ok=True)
        if frame.number in self.frames:
            self.files.write_arrays(_frame_file(frame.number), frame.arrays())

    def save(self, state: WearState, *, at_once: bool = False) -> None:
        """Write rows and the state for the next jump, if due or `at_once`."""
        self.worn = state
        if self.files is not None and (at_once or self.is_due):
            table = pyarrow.Table.from_pandas(pandas.DataFrame(self.rows), preserve_index=False)
            self.files.write_rows(table, self.contact.case)
            self.files.write_arrays(MEMORY, state.arrays())
            self.saved_at = time.monotonic()

    def finish(self, state: WearState, row: Row, frame: WearFrame) -> None:
        """Write the end and the surfaces."""
        self.end = HistoryEnd(state, row, frame)
        self.rows = [*self.rows[: state.number], row]
        if self.files is None:
            return
        self.save(self.worn, at_once=True)
        # an earlier end refers to surfaces that are about to be replaced
        (self.files.path / END).unlink(missing_ok=True)
        after = self.contact.worn_surfaces(state)
        for name, surfaces in (("before", self.contact.surfaces), ("after", after)):
            _write_both(surfaces, self.files.path / SURFACES, name)
        names = [_frame_file(number) for number in self.frames if number < state.number]
        names += [f"{SURFACES}/{path.name}" for path in surface_files(self.files.path)]
        digests = np.array(json.dumps(self.files.digests(names)))
        self.files.write_arrays(END, {**self.end.arrays(), FILES: digests})

    def history(self, seconds: float, computed: int) -> WearHistory:
        """Return the finished history."""
        assert self.end is not None
        return _history(
            self.contact,
            self.end,
            self.rows,
            self.frames,
            folder=None if self.files is None else self.files.path,
            seconds=seconds,
            computed=computed,
        )


def _history(
    contact: WearingContact,
    end: HistoryEnd,
    rows: list[Row],
    frames: Mapping[int, WearFrame],
    *,
    folder: Path | None,
    seconds: float = 0.0,
    computed: int = 0,
    remarks: tuple[str, ...] = (),
) -> WearHistory:
    """Return the history up to `end`, without rows that a longer run has added."""
    last = end.worn.number
    earlier = [frames[number] for number in sorted(frames) if number < last]
    return WearHistory(
        contact=contact,
        table=pandas.DataFrame([*rows[:last], end.row]),
        worn=end.worn,
        frames=(*(frame for frame in earlier if is_kept(frame.number, last)), end.frame),
        folder=folder,
        path=None if folder is None else folder / LAYOUT.table,
        files=() if folder is None else surface_files(folder),
        seconds=seconds,
        computed=computed,
        remarks=remarks,
    )


def surface_files(folder: Path) -> tuple[Path, ...]:
    """Return the surface files of a wear history's folder."""
    return tuple(
        folder / SURFACES / f"{body}-{when}.x3p"
        for body in ("first", "second")
        for when in ("before", "after")
    )


def _write_both(surfaces: MovingSurfaces, folder: Path, when: str) -> None:
    for body, surface in (("first", surfaces.first), ("second", surfaces.second)):
        write_surface(surface, folder / f"{body}-{when}.x3p")


def load_wear(folder: str | Path) -> WearHistory:
    """Load a wear history from its folder.

    Raises
    ------
    UnreadableFile
        if there is none, it is damaged, or it is not finished.
    """
    folder = Path(folder)
    with refusing_damaged_content(folder, "wear history"):
        return _load(folder)


def _load(folder: Path) -> WearHistory:
    case, files, remarks = stored_run(folder, LAYOUT)
    end = files.arrays(END, HistoryEnd.from_arrays)
    if end is None:
        raise UnreadableFile(
            f"{folder} holds an unfinished wear history; run asperity wear again to finish it"
        )
    assert case.wear is not None
    contact = WearingContact(case, case.wear, case.moving_surfaces())
    rows = _rows(files)
    if len(rows) < end.worn.number:
        raise UnreadableFile(f"{folder / LAYOUT.table} ends before {folder / END}; {REMEDY}")
    digests: dict[str, str] = files.arrays(END, _digests) or {}
    last = end.worn.number

    def is_surplus(name: str) -> bool:
        number = _number_of(name)
        return number >= last or (number >= 0 and not is_kept(number, last))

    names, differing = files.check_files(digests, is_surplus)
    frames = _frames(files, [name for name in names if _number_of(name) >= 0])
    return _history(contact, end, rows, frames, folder=folder, remarks=(*remarks, *differing))


def is_wear_folder(folder: Path) -> bool:
    """Return True if a folder holds a wear history."""
    return LAYOUT.matches(folder)


@contextmanager
def open_recorder(contact: WearingContact, folder: Path | None) -> Iterator[WearRecorder]:
    """Open a recorder, with a new or resumed folder that is locked against other processes.

    Raises BadInput for a folder that cannot be written to, that holds something else, or that
    another process works in.
    """
    if folder is None:
        yield WearRecorder(contact, None)
        return
    case = contact.case
    tables = tomllib.loads(case.text)
    tables.pop("study", None)
    files = RunFolder(folder, LAYOUT, case_digest(tables, contact.surfaces))
    resumable_manifest(files, case)
    with locked_folder(files, case):
        yield WearRecorder(contact, files)


def _frame_file(number: int) -> str:
    return f"{FRAMES}/{number:06d}.npz"


def _number_of(name: str) -> int:
    """Return the number of a frame by its file; -1 for other files."""
    match = re.fullmatch(rf"{FRAMES}/(\d+)\.npz", name)
    return int(match[1]) if match else -1


def _digests(arrays: Arrays) -> dict[str, str]:
    digests: dict[str, str] = json.loads(str(arrays.get(FILES, "{}")))
    return digests


def _frames(files: RunFolder, names: Iterable[str]) -> dict[int, WearFrame]:
    """Read the stored frames among some files."""
    stored = (files.arrays(name, WearFrame.from_arrays) for name in names)
    return {frame.number: frame for frame in stored if frame is not None}


def _rows(files: RunFolder) -> list[Row]:
    table = files.rows()
    rows: list[Row] = [] if table is None else table.to_pandas().to_dict("records")
    return rows
