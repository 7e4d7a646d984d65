"""Measured capacitances of a contact from a table."""

import csv
from math import isfinite, nan
from pathlib import Path

from asperity.core.errors import BadInput, UnreadableFile
from asperity.core.files import require_file
from asperity.inference.observations import Observation

ZERO_CELSIUS = 273.15
REQUIRED = ("load_n", "entrainment_m_s", "capacitance_f", "capacitance_std_f")
TEMPERATURE = "temperature_degc"
MAX_BYTES = 10_000_000


def read_capacitances(path: str | Path) -> tuple[Observation, ...]:
    """Read capacitances of a contact at operating points from a csv file in SI units.

    Its columns are load_n, entrainment_m_s, capacitance_f and capacitance_std_f, and perhaps
    temperature_degc of the oil. Stray capacitance of wires and holders must have been subtracted.

    Raises
    ------
    UnreadableFile
        for a missing or large file, or one without these columns.
    BadInput
        for a value that is not a positive number.
    """
    path = Path(path)
    require_file(path)
    if path.stat().st_size > MAX_BYTES:
        raise UnreadableFile(f"{path} has {path.stat().st_size} bytes, too many for a table")
    try:
        with path.open(encoding="utf-8-sig", errors="replace", newline="") as file:
            rows = list(csv.DictReader(file, skipinitialspace=True))
    except csv.Error as error:
        raise UnreadableFile(f"{path} is not a table: {error}") from None
    if not rows or any(name not in rows[0] for name in REQUIRED):
        raise UnreadableFile(f"{path} needs rows with the columns {', '.join(REQUIRED)}")
    return tuple(_observation(row, f"{path}, line {line}") for line, row in enumerate(rows, 2))


def _observation(row: dict[str, str], place: str) -> Observation:
    def number(name: str) -> float:
        try:
            value = float(row[name])
        except (TypeError, ValueError):
            value = nan
        if not isfinite(value):
            raise BadInput(f"{place}: {name} must be a number, got {row[name]!r}")
        return value

    return Observation(
        load_n=number("load_n"),
        entrainment_m_s=number("entrainment_m_s"),
        temperature_k=number(TEMPERATURE) + ZERO_CELSIUS if row.get(TEMPERATURE) else None,
        capacitance_f=number("capacitance_f"),
        capacitance_std_f=number("capacitance_std_f"),
        name=place,
    )
