"""Which files are recordings, in what order, and the table that says where each belongs."""

import csv
import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import datetime
from functools import lru_cache
from pathlib import Path

from asperity.core.errors import BadInput, UnreadableFile
from asperity.core.files import require_file
from asperity.recording import OPERATING_KEYS, is_sidecar

_NO_RECORDINGS = {
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
    ".gz",
    ".7z",
    ".rar",
}
ABSOLUTE_ZERO = -273.15  # degC
SENSOR = "sensor"  # heading of the column that says which of several sensors a recording is of
_CONDITION_WORDS = {  # in headings of what recordings were made at
    "load_n": {"load", "force", "kraft"},
    "speed_hz": {"speed", "rpm", "drehzahl"},
    "entrainment_m_s": {"speed", "entrainment"},
    "temperature_degc": {"temperature", "temp", "temperatur", "degc"},
}
_ABOUT = {
    "readme",
    "liesmich",
    "license",
    "licence",
    "changelog",
}  # names of files that are about others


@dataclass(frozen=True, slots=True, kw_only=True)
class Place:
    """Where a recording stands in the series, and whose it is, as a table says it; None for what it does not say."""

    x: float
    x_std: float | None = None
    load_n: float | None = None
    speed_hz: float | None = None
    entrainment_m_s: float | None = None
    temperature_degc: float | None = None
    sensor: str | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Table:
    """A table of places by file, as it names them, with or without folders; `x_name` heads its column of x, if any."""

    name: str
    x_name: str
    places: dict[str, Place]

    def place(self, path: Path) -> Place:
        """Where a recording stands.

        Raises
        ------
        BadInput
            for a recording that is not in the table.
        """
        row = self.row(path)
        if row is None:
            raise BadInput(
                f"{self.name} has no row for {path.name}; add one, or leave that recording out"
            )
        return self.places[row]

    def row(self, path: Path) -> str | None:
        """How the table names a recording: by the most of its path; None where it does not."""
        parts = path.absolute().parts
        for last in (path.name, path.stem):
            for first in range(len(parts)):
                name = "/".join((*parts[first:-1], last))
                if name in self.places:
                    return name
        return None

    def placed(self, paths: Sequence[Path]) -> dict[str, Place]:
        """Where each recording stands, by its path.

        Raises
        ------
        BadInput
            as `place`, and where one row is that of several recordings.
        """
        by_row: dict[str, list[Path]] = {}
        for path in paths:
            by_row.setdefault(self.row(path) or "", []).append(path)
        for row, several in by_row.items():
            if row and len(several) > 1:
                raise BadInput(
                    f"{self.name} has one row {row} for {len(several)} recordings, {several[0]} and {several[1]} among "
                    "them; name them there with their folders"
                )
        return {str(path): self.place(path) for path in paths}


def in_time(times: Sequence[datetime | None], heard: Sequence[bool]) -> tuple[list[float], str]:
    """Hours since the first recording, where all say when they began and not all at once; their number otherwise.

    What was not heard, no recording or a damaged one, takes no place: it stands at that of the one
    before.
    """
    known = [time for time, there in zip(times, heard, strict=True) if there]
    stated = [time for time in known if time is not None]
    if len(stated) == len(known) and any(time != stated[0] for time in stated):
        first = min(stated)
        x = iter([(time - first).total_seconds() / 3600.0 for time in stated])
        x_name = "time_h"
    else:
        x, x_name = iter([float(number) for number in range(1, len(known) + 1)]), "recording"
    at = 0.0 if x_name == "time_h" else 1.0
    places = []
    for there in heard:
        at = next(x) if there else at
        places.append(at)
    return places, x_name


def in_their_places(
    files: Sequence[str],
    times: Sequence[datetime | None],
    heard: Sequence[bool],
    places: Mapping[str, Place] | None,
    x_name: str,
) -> tuple[dict[str, Place], str]:
    """Where each recording stands, and what x is, by `where`."""
    x, x_name = where(files, times, heard, places, x_name)
    return {file: placed_at(at, (places or {}).get(file)) for file, at in x.items()}, x_name


def where(
    files: Sequence[str],
    times: Sequence[datetime | None],
    heard: Sequence[bool],
    places: Mapping[str, Place] | None,
    x_name: str,
) -> tuple[dict[str, float], str]:
    """The x of each recording, and what x is: as a table says it, or by `in_time` where none does."""
    if x_name and places is not None:
        return {file: places[file].x for file in files}, x_name
    x, x_name = in_time(times, heard)
    return dict(zip(files, x, strict=True)), x_name


def placed_at(x: float, stated: Place | None) -> Place:
    """A place at x, with what else is stated of it."""
    return Place(x=x) if stated is None else replace(stated, x=x)


def recordings_in(paths: Sequence[str | Path]) -> list[Path]:
    """The files named, and those in the folders named, by name with numbers in their order.

    Left out of a folder: folders in it, hidden files, sidecars, tables with a column `file`,
    results.

    Raises
    ------
    BadInput
        for a path that does not exist, or a folder with nothing left.
    """
    recordings: list[Path] = []
    for path in map(Path, paths):
        if path.is_dir():
            inside = [file for file in path.iterdir() if may_be_recording(file)]
            if not inside:
                raise BadInput(f"{path} holds no recordings; name files, or the folder they lie in")
            recordings += sorted(inside, key=lambda file: natural(file.name))
        elif path.exists():
            recordings.append(path)
        else:
            raise BadInput(f"{path} does not exist; check its name")
    return list(dict.fromkeys(recordings))


def may_be_recording(path: Path) -> bool:
    """Whether a file in a folder is taken for a recording."""
    if (
        not path.is_file()
        or path.name.startswith(".")
        or is_sidecar(path)
        or path.suffix.lower() in _NO_RECORDINGS
    ):
        return False
    if path.stem.lower() in _ABOUT and path.suffix.lower() in ("", ".txt"):
        return False
    return path.suffix.lower() not in (".csv", ".tsv", ".txt") or "file" not in _heading(path)


def read_table(path: str | Path) -> Table:
    """Read a table (csv) of file, x and its deviation, what recordings were made at, and by which sensor.

    The latter are load_n, speed_hz (of the shaft), entrainment_m_s, temperature_degc (of the oil).
    The column of x is the first that is none of these; its heading names it, such as sq_um. A
    column of that heading with _std behind is its standard deviation. A table without x says what
    recordings were made at, and their time or name where they stand.

    Raises
    ------
    UnreadableFile
        for a file that is missing, no csv, or without the columns.
    BadInput
        for a row without a number where one is due, and two columns of one name.
    """
    path = Path(path)
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
    others = [
        name
        for name in columns
        if name not in ("file", SENSOR, *OPERATING_KEYS) and not name.endswith("_std")
    ]
    _require_units(path, others)
    if "file" not in columns or not (others or set(columns) & {SENSOR, *OPERATING_KEYS}):
        raise UnreadableFile(
            f"{path} needs a column file and one of x, such as sq_um; got {', '.join(columns) or 'none'}"
        )
    x_name = "x" if "x" in others else next(iter(others), "")
    places = {}
    for number, row in enumerate(rows, 2):
        name = (row["file"] or "").strip()
        if not name:
            continue
        said = {
            column: _number(
                (row.get(column) or "").strip(), delimiter, f"{path}, line {number}: {column}"
            )
            for column in (x_name, f"{x_name}_std", *OPERATING_KEYS)
        }
        _require_possible(said, f"{path}, line {number}")
        x, x_std = said.pop(x_name), said.pop(f"{x_name}_std")
        if not x_name:
            x = float(number - 1)
        if x is None:
            raise BadInput(f"{path}, line {number}: {x_name} of {name} is missing; fill it in")
        key = Path(name.replace("\\", "/")).as_posix()
        if key in places:
            raise BadInput(
                f"{path}, line {number}: {name} has a row already; leave one of the two out"
            )
        places[key] = Place(
            x=x, x_std=x_std, sensor=(row.get(SENSOR) or "").strip() or None, **said
        )
    return Table(name=path.name, x_name=x_name, places=places)


def _require_units(path: Path, columns: Sequence[str]) -> None:
    """BadInput for a load, speed or temperature by another name, perhaps in another unit."""
    for name in columns:
        words = set(re.split(r"[\W_]+", name.lower()))
        meant = [key for key, said in _CONDITION_WORDS.items() if words & said]
        if meant:
            raise BadInput(
                f"{path} has a column {name}; take {' or '.join(meant)}, by that name and in that unit, or another "
                "name if it is where recordings stand"
            )


def _require_possible(said: Mapping[str, float | None], where: str) -> None:
    """BadInput for a load or speed that is not positive, and a temperature below absolute zero."""
    for column in OPERATING_KEYS:
        value, least = said[column], ABSOLUTE_ZERO if column == "temperature_degc" else 0.0
        if value is not None and value <= least:
            raise BadInput(
                f"{where}: {column} must be above {least:g}, got {value:g}; leave it empty if it is not known"
            )


def _number(text: str, delimiter: str, where: str) -> float | None:
    if not text:
        return None
    try:
        number = float(text.replace(",", ".") if delimiter == ";" else text)
    except ValueError:
        number = math.nan
    if not math.isfinite(number):
        raise BadInput(f"{where} must be a number, got {text!r}")
    return number


def _heading(path: Path) -> list[str]:
    """The fields of a file's first line."""
    try:
        with path.open("rb") as file:
            first = file.readline(1 << 12).decode("utf-8-sig", errors="replace")
    except OSError:
        return []
    return [field.strip().strip('"') for field in re.split(r"[,;\t]", first.strip())]


@lru_cache(maxsize=1 << 16)
def natural(name: str) -> tuple[tuple[int, int | str], ...]:
    """By what names are sorted so that their numbers stand in order."""
    return tuple(
        (0, int(part)) if part.isdecimal() else (1, part)
        for part in re.split(r"(\d+)", name)
        if part
    )


def utf8(name: str) -> bool:
    """Whether a file's name can be written down."""
    try:
        name.encode()
    except UnicodeEncodeError:
        return False
    return True
