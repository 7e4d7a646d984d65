"""[cycle] of a case file: load and speeds over time."""

import csv
import math
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Literal

import numpy as np

from asperity.case.messages import Section, choose
from asperity.case.units import Count, amount_in, default_amount, plain
from asperity.contact.conditions import ContactConditions
from asperity.contact.cycle import OperatingCycle
from asperity.core.errors import UnreadableFile
from asperity.core.files import require_file
from asperity.ehl import Start

COLUMNS = ("time_s", "load_n", "speed_first_m_s", "speed_second_m_s")
RADIUS = "radius_m"  # optional column
OSCILLATION_ROWS = 360

Time = Annotated[float, amount_in("s", 0.0)]


class _CycleSection(Section):
    """Keys of every [cycle]."""

    start: Start = "steady"  # of a cycle that does not repeat
    instants: Count = 12  # at which the rough contact is solved


class TableCycleSection(_CycleSection):
    """[cycle] of kind "table": a file of times, loads and speeds."""

    kind: Literal["table"]
    file: str

    def cycle(self, contact: ContactConditions, folder: Path) -> OperatingCycle:
        """Return the cycle; UnreadableFile or BadInput for a file that is none."""
        return read_cycle(folder / self.file, contact)


class StartStopSection(_CycleSection):
    """[cycle] of kind "start-stop": from rest to the speeds of [contact] and back."""

    kind: Literal["start-stop"]
    rise: Annotated[float, amount_in("s")]
    running: Time = default_amount(0.0, "s")
    fall: Annotated[float, amount_in("s")]
    rest: Time = default_amount(0.0, "s")

    def cycle(self, contact: ContactConditions, folder: Path) -> OperatingCycle:  # noqa: ARG002 (no file)
        """Return the cycle, from rest."""
        lengths = [plain(value) for value in (self.rise, self.running, self.fall, self.rest)]
        shares = [1.0, 1.0, 0.0, 0.0]
        rows = [(0.0, 0.0)]
        for length, share in zip(lengths, shares, strict=True):
            if length > 0.0:
                rows.append((rows[-1][0] + length, share))
        times, speeds = np.array(rows).T
        return _of_speeds(contact, times, speeds)


class OscillationSection(_CycleSection):
    """[cycle] of kind "oscillation": both surface speeds of [contact] times a cosine."""

    kind: Literal["oscillation"]
    frequency: Annotated[float, amount_in("Hz")]

    def cycle(self, contact: ContactConditions, folder: Path) -> OperatingCycle:  # noqa: ARG002 (no file)
        """Return the cycle, from the largest speed."""
        phases = np.linspace(0.0, 2.0 * math.pi, OSCILLATION_ROWS + 1)
        times = phases / (2.0 * math.pi * plain(self.frequency))
        return _of_speeds(contact, times, np.cos(phases))


CycleSection = TableCycleSection | StartStopSection | OscillationSection
CYCLES: Mapping[str, type[CycleSection]] = {
    "table": TableCycleSection,
    "start-stop": StartStopSection,
    "oscillation": OscillationSection,
}


def parse_cycle(value: object) -> CycleSection | None:
    """Parse [cycle]."""
    if value is None or isinstance(value, CycleSection):
        return value
    section: CycleSection = choose("kind", lambda: CYCLES, value)
    return section


def read_cycle(path: Path, contact: ContactConditions) -> OperatingCycle:
    """Read a cycle from a table of comma-separated values, whose first line names its columns.

    Columns are `time_s`, `load_n`, `speed_first_m_s` and `speed_second_m_s`; `radius_m`, along
    rolling, may be missing, and is then that of the contact.

    Raises
    ------
    UnreadableFile
        for a file that is missing or not such a table.
    BadInput
        as `OperatingCycle`.
    """
    require_file(path)
    try:
        with path.open(encoding="utf-8-sig", newline="") as file:
            rows = list(csv.DictReader(file))
    except (UnicodeDecodeError, csv.Error) as error:
        raise UnreadableFile(f"{path} is not a table of comma-separated values: {error}") from None
    names = tuple(rows[0]) if rows else ()
    missing = [name for name in COLUMNS if name not in names]
    unknown = [name for name in names if name not in (*COLUMNS, RADIUS)]
    if missing or unknown:
        raise UnreadableFile(
            f"{path} must have the columns {', '.join(COLUMNS)}, and perhaps {RADIUS}; got "
            f"{', '.join(map(str, names)) or 'none'}"
        )
    columns = {
        name: [
            _number(
                row[name],
                name,
                path,
            )
            for row in rows
        ]
        for name in names
    }
    radius = contact.radius_along_rolling
    return OperatingCycle(
        times=columns["time_s"],
        loads=columns["load_n"],
        speeds=list(
            zip(
                columns[COLUMNS[2]],
                columns[COLUMNS[3]],
                strict=True,
            )
        ),
        radii=columns.get(RADIUS, [radius] * len(rows)),
    )


def _number(text: str | None, name: str, path: Path) -> float:
    try:
        return float(text or "")
    except ValueError:
        raise UnreadableFile(f"{path}: {name} must be a number, got {text!r}") from None


def _of_speeds(
    contact: ContactConditions, times: "np.ndarray", shares: "np.ndarray"
) -> OperatingCycle:
    """Return a cycle of constant load whose speeds are shares of the contact's."""
    first, second = contact.surface_speeds
    return OperatingCycle(
        times=times,
        loads=np.full(len(times), contact.load),
        speeds=np.outer(shares, (first, second)),
        radii=np.full(len(times), contact.radius_along_rolling),
    )
