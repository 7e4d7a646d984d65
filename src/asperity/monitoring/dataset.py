"""Check of a data set for publication: recordings of a contact, and its surfaces before and after.

The layout is that of docs/project/call-for-data.md.
"""

import csv
import tomllib
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from asperity.case import Case, load_case
from asperity.core.documents import JsonObject, Table
from asperity.core.errors import BadInput
from asperity.monitoring.checks import check_recordings
from asperity.surface import read_surface

STATED = "set.toml"
KEYS = ("title", "authors", "licence", "case", "recordings", "sensor", "maps_before", "maps_after")
COLUMNS = ("file", "time_h", "load_n", "speed_m_s", "oil_temperature_c")
OPEN_LICENCES = ("CC0-1.0", "CC-BY-4.0", "CC-BY-SA-4.0", "ODbL-1.0", "PDDL-1.0", "ODC-By-1.0")
MIN_RATE_HZ, MIN_DURATION_S = 20_000.0, 10.0
MIN_STEPS = 3  # of load, and of speed
MIN_PIXELS = 10  # of a map across the contact


@dataclass(frozen=True)
class DataSet:
    """Content of a folder as a data set; `missing` are sentences on what it lacks."""

    folder: Path
    title: str
    recordings: int
    maps: int
    missing: tuple[str, ...]

    @property
    def whole(self) -> bool:
        """True if nothing is missing."""
        return not self.missing

    def verdict(self) -> str:
        """Return the result as one sentence."""
        if self.whole:
            content = f"{self.recordings} recordings, {self.maps} maps"
            return f"{self.folder} is a complete data set: {content}."
        others = f", and {len(self.missing) - 1} more" if len(self.missing) > 1 else ""
        return f"{self.folder} is not a complete data set: {self.missing[0]}{others}."

    def scalars(self) -> JsonObject:
        """Return the JSON of `asperity check --set`."""
        return {
            "verdict": self.verdict(),
            "whole": self.whole,
            "title": self.title,
            "recordings": self.recordings,
            "maps": self.maps,
            "missing": list(self.missing),
        }


def check_set(folder: Path) -> DataSet:
    """Read everything that a folder's set.toml names, and list what is missing.

    Raises
    ------
    BadInput
        if there is no folder, or no readable set.toml in it.
    """
    stated = _stated(folder)
    missing = [f"{STATED} does not state {key}" for key in KEYS if key not in stated]
    if stated.get("licence") not in (None, *OPEN_LICENCES):
        missing.append(f"its licence {stated['licence']} is not one of {', '.join(OPEN_LICENCES)}")
    case = _case(folder, stated, missing)
    rows = _table(folder, stated, missing)
    maps = [
        (key, name)
        for key in ("maps_before", "maps_after")
        for name in _names(stated, key, missing)
    ]
    missing += _missing_steps(rows)
    missing += _recording_faults(folder, rows, case)
    for _, name in maps:
        missing += _map_faults(folder, name, case)
    bodies = Counter(key for key, _ in maps)
    if maps and bodies["maps_before"] != bodies["maps_after"]:
        missing.append("maps before and after are not of the same number of bodies")
    return DataSet(folder, str(stated.get("title", "")), len(rows), len(maps), tuple(missing))


def _stated(folder: Path) -> Table:
    if not folder.is_dir():
        raise BadInput(f"{folder} is not a folder; name the folder that holds {STATED}")
    try:
        return tomllib.loads((folder / STATED).read_text("utf-8"))
    except FileNotFoundError:
        raise BadInput(
            f"{folder} has no {STATED}; the documentation's call for data shows one"
        ) from None
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise BadInput(f"{folder / STATED} cannot be read as TOML: {error}") from None


def _inside(folder: Path, name: object) -> Path:
    """Return the path of a file named in the set, which must be inside the folder."""
    path = (folder / str(name)).resolve()
    if not path.is_relative_to(folder.resolve()):
        raise BadInput(f"{name} is outside the set; put it into the folder")
    return path


def _case(folder: Path, stated: Table, missing: list[str]) -> Case | None:
    if "case" not in stated:
        return None
    try:
        return load_case(_inside(folder, stated["case"]))
    except BadInput as error:
        missing.append(f"the case: {error}")
        return None


def _names(stated: Table, key: str, missing: list[str]) -> list[str]:
    names = stated.get(key, [])
    if not isinstance(names, list) or (key in stated and not names):
        missing.append(f"{key} must be a list of files, one of each body")
        return []
    return [str(name) for name in names]


def _table(folder: Path, stated: Table, missing: list[str]) -> list[dict[str, str]]:
    """Return the rows of the table of recordings; empty if it cannot be used."""
    if "recordings" not in stated:
        return []
    try:
        with _inside(folder, stated["recordings"]).open(encoding="utf-8", newline="") as file:
            rows = list(csv.DictReader(file))
    except (BadInput, OSError, UnicodeDecodeError, csv.Error) as error:
        missing.append(f"the table {stated['recordings']} cannot be read ({error})")
        return []
    absent = [name for name in COLUMNS if not rows or name not in rows[0]]
    if absent:
        missing.append(f"the table {stated['recordings']} has no column {', '.join(absent)}")
        return []
    for number, row in enumerate(rows, 2):
        for name in COLUMNS[1:]:
            if not _is_number(row[name]):
                missing.append(
                    f"line {number} of {stated['recordings']}: {name} must be a number, "
                    f"got {row[name]!r}"
                )
                return []
    return rows


def _is_number(text: str | None) -> bool:
    try:
        return float(text or "") < float("inf")
    except ValueError:
        return False


def _missing_steps(rows: list[dict[str, str]]) -> Iterator[str]:
    """Yield sentences on too few steps of load or speed, and missing repeats."""
    if not rows:
        return
    for name in ("load_n", "speed_m_s"):
        steps = {float(row[name]) for row in rows}
        if len(steps) < MIN_STEPS:
            yield f"{name} has {len(steps)} steps, at least {MIN_STEPS} are required"
    if max(Counter((float(row["load_n"]), float(row["speed_m_s"])) for row in rows).values()) < 2:
        yield "no combination of load and speed was recorded twice"


def _recording_faults(folder: Path, rows: list[dict[str, str]], case: Case | None) -> Iterator[str]:
    """Yield sentences on recordings that are missing, unusable, slow, short or in other units."""
    for row in rows:
        try:
            path = _inside(folder, row["file"])
        except BadInput as error:
            yield str(error)
            continue
        checks = check_recordings([path], case=case)
        yield from (reason for _, reason in checks.refused)
        for recording, quality, _ in checks.checked:
            if recording.rate_hz < MIN_RATE_HZ:
                yield (
                    f"{row['file']}: sampled at {recording.rate_hz:g} Hz, "
                    f"at least {MIN_RATE_HZ:g} Hz are required"
                )
            if quality.duration_s < MIN_DURATION_S:
                yield (
                    f"{row['file']}: {quality.duration_s:.3g} s long, "
                    f"at least {MIN_DURATION_S:g} s are required"
                )
            if not recording.comparable:
                yield f"{row['file']}: not an acceleration (unit {recording.unit or 'not stated'})"
            yield from (f"{row['file']}: {fault}" for fault in quality.faults)


def _map_faults(folder: Path, name: str, case: Case | None) -> Iterator[str]:
    """Yield sentences on a map that is unreadable, a profile, or too coarse or small."""
    try:
        measured = read_surface(_inside(folder, name))
    except BadInput as error:
        yield str(error)
        return
    if measured.uniform is not None:
        yield f"{name} is a profile; an areal map is required"
    if case is None:
        return
    width = 2.0 * case.conditions.hertz.half_widths[0]
    pixel = max(measured.grid.spacing)
    size = min(measured.grid.extent)
    if pixel > width / MIN_PIXELS:
        yield (
            f"{name}: pixels of {1e6 * pixel:.3g} um, coarser than a tenth of the contact's "
            f"{1e6 * width:.3g} um"
        )
    if size < width:
        yield (f"{name}: {1e6 * size:.3g} um wide, less than the contact's {1e6 * width:.3g} um")
