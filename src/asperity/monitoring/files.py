"""Files of recordings, their order, and the table of their places and conditions."""

import csv
import math
import os
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import datetime
from functools import lru_cache
from pathlib import Path

from asperity.core.errors import BadInput, UnreadableFile
from asperity.core.files import require_file
from asperity.recording import OPERATING_KEYS, is_sidecar

_OTHER_SUFFIXES = {
    ".html",
    ".htm",
    ".nc",
    ".png",
    ".pdf",
    ".svg",
    ".md",
    ".log",
    ".py",
    ".m",
    ".xml",
    ".yaml",
    ".yml",
    ".docx",
    ".xlsx",
    ".part",
    ".filepart",
    ".crdownload",
    ".partial",
    ".download",
    ".tmp",
    ".tdms_index",
    ".db",
    ".db-wal",
    ".db-shm",
    ".db-journal",
    ".sqlite",
    ".gz",
    ".7z",
    ".rar",
}
RESULTS_FOLDER, STORE_NAME = "asperity-watch", "asperity.db"  # of a watch, beside its recordings
ABSOLUTE_ZERO = -273.15  # degC
SENSOR = "sensor"  # heading of the column with the name of the sensor
_CONDITION_WORDS = {  # words in headings of operating conditions
    "load_n": {"load", "force", "kraft"},
    "speed_hz": {"speed", "rpm", "drehzahl"},
    "entrainment_m_s": {"speed", "entrainment"},
    "temperature_degc": {"temperature", "temp", "temperatur", "degc"},
}
_DOCUMENTATION = {"readme", "liesmich", "license", "licence", "changelog"}  # names of text files


@dataclass(frozen=True, slots=True, kw_only=True)
class RecordingPlace:
    """Place, conditions and sensor of a recording, as a table states them; None if not stated."""

    x: float
    x_std: float | None = None
    load_n: float | None = None
    speed_hz: float | None = None
    entrainment_m_s: float | None = None
    temperature_degc: float | None = None
    sensor: str | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class RecordingTable:
    """Table of places by file name, with or without folders; `x_name` heads the column of x."""

    name: str
    x_name: str
    places: dict[str, RecordingPlace]

    def place(self, path: Path) -> RecordingPlace:
        """Return the place of a recording.

        Raises
        ------
        BadInput
            if the recording is not in the table.
        """
        row = self.row(path)
        if row is None:
            raise BadInput(
                f"{self.name} has no row for {path.name}; add one, or leave that recording out"
            )
        return self.places[row]

    def row(self, path: Path) -> str | None:
        """Return the name of a recording in the table, by the longest part of its path, or None."""
        parts = path.absolute().parts
        for last in (path.name, path.stem):
            for first in range(len(parts)):
                name = "/".join((*parts[first:-1], last))
                if name in self.places:
                    return name
        return None

    def places_of(self, paths: Sequence[Path]) -> dict[str, RecordingPlace]:
        """Return the place of each recording, by its path.

        Raises
        ------
        BadInput
            if a recording is not in the table, or one row belongs to several recordings.
        """
        by_row: dict[str, list[Path]] = {}
        for path in paths:
            by_row.setdefault(self.row(path) or "", []).append(path)
        for row, recordings in by_row.items():
            if row and len(recordings) > 1:
                raise BadInput(
                    f"{self.name} has one row {row} for {len(recordings)} recordings, such as "
                    f"{recordings[0]} and {recordings[1]}; name them with their folders"
                )
        return {str(path): self.place(path) for path in paths}


def x_by_time(
    times: Sequence[datetime | None], readable: Sequence[bool]
) -> tuple[list[float], str]:
    """Return hours since the first recording and their name, or numbers if starts are unknown.

    An unreadable file gets the x of the recording before.
    """
    usable_times = [time for time, usable in zip(times, readable, strict=True) if usable]
    starts = [time for time in usable_times if time is not None]
    if len(starts) == len(usable_times) and any(time != starts[0] for time in starts):
        first = min(starts)
        x = iter([(time - first).total_seconds() / 3600.0 for time in starts])
        x_name = "time_h"
    else:
        x = iter([float(number) for number in range(1, len(usable_times) + 1)])
        x_name = "recording"
    value = 0.0 if x_name == "time_h" else 1.0
    values = []
    for usable in readable:
        value = next(x) if usable else value
        values.append(value)
    return values, x_name


def locate_recordings(
    files: Sequence[str],
    times: Sequence[datetime | None],
    readable: Sequence[bool],
    places: Mapping[str, RecordingPlace] | None,
    x_name: str,
) -> tuple[dict[str, RecordingPlace], str]:
    """Return the place of each recording and the name of x, by `x_of_recordings`."""
    x, x_name = x_of_recordings(files, times, readable, places, x_name)
    return {file: place_at(value, (places or {}).get(file)) for file, value in x.items()}, x_name


def x_of_recordings(
    files: Sequence[str],
    times: Sequence[datetime | None],
    readable: Sequence[bool],
    places: Mapping[str, RecordingPlace] | None,
    x_name: str,
) -> tuple[dict[str, float], str]:
    """Return the x of each recording and its name, from the table or else by `x_by_time`."""
    if x_name and places is not None:
        return {file: places[file].x for file in files}, x_name
    x, x_name = x_by_time(times, readable)
    return dict(zip(files, x, strict=True)), x_name


def place_at(x: float, stated: RecordingPlace | None) -> RecordingPlace:
    """Return a place at x, with the stated conditions."""
    return RecordingPlace(x=x) if stated is None else replace(stated, x=x)


def recordings_in(paths: Sequence[str | Path]) -> list[Path]:
    """Return the given files and those in the given folders and their subfolders.

    They are in natural order of folders and names. Hidden files and folders, results, sidecars and
    tables with a column `file` are excluded.

    Raises
    ------
    BadInput
        if a path does not exist, or a folder contains no recordings.
    """
    recordings: list[Path] = []
    for path in map(Path, paths):
        if path.is_dir():
            recordings += _recordings_below(path)
        elif path.exists():
            recordings.append(path)
        else:
            raise BadInput(f"{path} does not exist; check its name")
    return list(dict.fromkeys(recordings))


def _recordings_below(folder: Path) -> list[Path]:
    """Return the recordings in a folder and its subfolders."""
    inside: list[Path] = []
    subfolders = 0
    for place, folders, names in os.walk(folder):
        folders[:] = [name for name in folders if _may_hold_recordings(Path(place, name))]
        subfolders += len(folders)
        inside += [file for name in names if may_be_recording(file := Path(place, name))]
    if not inside:
        below = f", nor do its {subfolders} subfolders" if subfolders else ""
        raise BadInput(f"{folder} contains no recordings{below}; name files, or their folder")
    return sorted(
        inside,
        key=lambda file: [natural_order(part) for part in file.relative_to(folder).parts],
    )


def _may_hold_recordings(folder: Path) -> bool:
    """Return whether a subfolder is neither hidden nor one of results of a watch."""
    return not (
        folder.name.startswith((".", "__"))
        or folder.name == RESULTS_FOLDER
        or (folder / STORE_NAME).exists()
    )


def may_be_recording(path: Path) -> bool:
    """Tell whether a file in a folder is taken for a recording."""
    if (
        not path.is_file()
        or path.name.startswith(".")
        or is_sidecar(path)
        or path.suffix.lower() in _OTHER_SUFFIXES
    ):
        return False
    if path.stem.lower() in _DOCUMENTATION and path.suffix.lower() in ("", ".txt"):
        return False
    return path.suffix.lower() not in (".csv", ".tsv", ".txt") or "file" not in _heading(path)


def read_table(path: str | Path) -> RecordingTable:
    """Read a csv table of recordings: file, x, operating conditions and sensor.

    Conditions are load_n, speed_hz (shaft), entrainment_m_s and temperature_degc (oil). The first
    other column is x, named by its heading, such as sq_um; a column with the suffix _std is its
    standard deviation. Without x, time or name give the places of recordings.

    Raises
    ------
    UnreadableFile
        if the file is missing, not a csv file, or lacks the columns.
    BadInput
        if a number is missing, or two columns have the same name.
    """
    path = Path(path)
    columns, rows, delimiter = _read_csv(path)
    others = [
        name
        for name in columns
        if name not in ("file", SENSOR, *OPERATING_KEYS) and not name.endswith("_std")
    ]
    _require_units(path, others)
    if "file" not in columns or not (others or set(columns) & {SENSOR, *OPERATING_KEYS}):
        raise UnreadableFile(
            f"{path} needs a column file and one of x, such as sq_um; "
            f"got {', '.join(columns) or 'none'}"
        )
    x_name = "x" if "x" in others else next(iter(others), "")
    places = {}
    for number, row in enumerate(rows, 2):
        name = (row["file"] or "").strip()
        if not name:
            continue
        location = f"{path}, line {number}"
        place = _place_in(row, x_name, number, delimiter, location)
        key = Path(name.replace("\\", "/")).as_posix()
        if key in places:
            raise BadInput(f"{location}: {name} has a row already; leave one of the two out")
        places[key] = place
    return RecordingTable(name=path.name, x_name=x_name, places=places)


def _place_in(
    row: Mapping[str, str], x_name: str, number: int, delimiter: str, location: str
) -> RecordingPlace:
    """Return the place in line `number` of a table, which is x if no column states x."""
    values = {
        column: _number((row.get(column) or "").strip(), delimiter, f"{location}: {column}")
        for column in (x_name, f"{x_name}_std", *OPERATING_KEYS)
    }
    _require_possible(values, location)
    x = values.pop(x_name)
    x_std = values.pop(f"{x_name}_std")
    if not x_name:
        x = float(number - 1)
    if x is None:
        name = row["file"].strip()
        raise BadInput(f"{location}: {x_name} of {name} is missing; fill it in")
    sensor = (row.get(SENSOR) or "").strip() or None
    return RecordingPlace(x=x, x_std=x_std, sensor=sensor, **values)


def _read_csv(path: Path) -> tuple[list[str], list[dict[str, str]], str]:
    """Return columns, rows and delimiter of a csv file."""
    require_file(path)
    try:
        text = path.read_text("utf-8-sig")
        delimiter = ";" if text.partition("\n")[0].count(";") else ","
        reader = csv.DictReader(text.splitlines(), delimiter=delimiter)
        columns = [(name or "").strip() for name in reader.fieldnames or []]
        reader.fieldnames = columns
        rows = list(reader)
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise UnreadableFile(
            f"{path} cannot be read as a table ({error}); give a csv with columns file, x"
        ) from None
    for name in columns:
        if name and columns.count(name) > 1:
            raise BadInput(
                f"{path} has {columns.count(name)} columns {name}; leave all but one of them out"
            )
    return columns, rows, delimiter


def _require_units(path: Path, columns: Sequence[str]) -> None:
    """Raise BadInput for a load, speed or temperature by another name, perhaps in another unit."""
    for name in columns:
        words = set(re.split(r"[\W_]+", name.lower()))
        keys = [key for key, synonyms in _CONDITION_WORDS.items() if words & synonyms]
        if keys:
            raise BadInput(
                f"{path} has a column {name}; use {' or '.join(keys)} with that unit, or another "
                "name if the column is x"
            )


def _require_possible(values: Mapping[str, float | None], location: str) -> None:
    """Raise BadInput for a load or speed not above 0, or a temperature below absolute zero."""
    for column in OPERATING_KEYS:
        value = values[column]
        least = ABSOLUTE_ZERO if column == "temperature_degc" else 0.0
        if value is not None and value <= least:
            raise BadInput(
                f"{location}: {column} must be above {least:g}, got {value:g}; "
                "leave it empty if unknown"
            )


def _number(text: str, delimiter: str, location: str) -> float | None:
    if not text:
        return None
    try:
        number = float(text.replace(",", ".") if delimiter == ";" else text)
    except ValueError:
        number = math.nan
    if not math.isfinite(number):
        raise BadInput(f"{location} must be a number, got {text!r}")
    return number


def _heading(path: Path) -> list[str]:
    """Return the fields of a file's first line."""
    try:
        with path.open("rb") as file:
            first = file.readline(1 << 12).decode("utf-8-sig", errors="replace")
    except OSError:
        return []
    return [field.strip().strip('"') for field in re.split(r"[,;\t]", first.strip())]


@lru_cache(maxsize=1 << 16)
def natural_order(name: str) -> tuple[tuple[int, int | str], ...]:
    """Return the key for sorting names with their numbers in numerical order."""
    return tuple(
        (0, int(part)) if part.isdecimal() else (1, part)
        for part in re.split(r"(\d+)", name)
        if part
    )


def is_utf8(name: str) -> bool:
    """Tell whether a file name can be stored as UTF-8."""
    try:
        name.encode()
    except UnicodeEncodeError:
        return False
    return True
