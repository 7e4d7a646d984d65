"""Reading of overall values over time from csv, parquet and JSON lines."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from asperity.core.arrays import Field
from asperity.core.errors import BadInput
from asperity.monitoring.overalls.columns import sort_columns
from asperity.monitoring.overalls.formats import read_table
from asperity.monitoring.overalls.number_text import decimal_marks
from asperity.monitoring.overalls.times import time_axis
from asperity.recording import read_sidecar


@dataclass(frozen=True, slots=True, kw_only=True)
class OverallValues:
    """Overall values of one sensor or machine over time.

    `x` in `x_unit` rises; `times` are the time stamps in ISO 8601, empty without dates; `stamps`
    are those of the file. `values` are by column, with the unit in `units` ("" if not stated).
    `conditions` are load, speed and temperature by their keys. `machine_class` is that of ISO
    20816-3, if stated.
    """

    path: Path
    x: Field
    x_unit: str
    times: Sequence[str]
    values: Mapping[str, Field]
    units: Mapping[str, str]
    stamps: Sequence[str] = ()
    conditions: Mapping[str, Field] = field(default_factory=dict)
    machine_class: str | None = None
    notes: tuple[str, ...] = ()


def read_overalls(path: str | Path) -> OverallValues:
    """Read a table of time stamps and overall values.

    The first column that holds times is the time, with a column of dates beside it if it holds
    times of day. Load, speed and temperature are conditions; every other column of numbers is a
    value. JSON lines may hold samples (`values`, with `unit`); their rms and kurtosis are the
    values. A sidecar may state `machine_class`. `notes` state every column that is left out.

    Raises
    ------
    BadInput
        for another format, a table without times or without values, or numbers, units and times
        that can be read in two ways.
    UnreadableFile
        if the file cannot be read.
    """
    path = Path(path)
    table = read_table(path)
    marks = decimal_marks({str(name): table[name] for name in table.columns}, path.name)
    axis, note = time_axis(table, marks, path)
    notes = [note] if note else []
    order = _order(axis.x, notes)
    stated, _ = read_sidecar(path)
    columns = sort_columns(
        table.drop(columns=[*axis.columns]).iloc[order],
        marks,
        str(stated.get("unit", "")),
        path.name,
    )
    if not columns.values:
        reasons = " ".join(columns.notes[:3])
        raise BadInput(
            f"{path.name} has no column of values beside {axis.columns[0]}; add one, such as rms"
            + (f" ({reasons.rstrip('.')})" if reasons else "")
        )
    machine_class = stated.get("machine_class")
    return OverallValues(
        path=path,
        x=axis.x[order],
        x_unit=axis.unit,
        times=[axis.times[number] for number in order] if axis.times else [],
        stamps=[axis.stamps[number] for number in order] if axis.stamps else [],
        values=columns.values,
        units=columns.units,
        conditions=columns.conditions,
        machine_class=None if machine_class is None else str(machine_class),
        notes=(*notes, *columns.notes),
    )


def _order(x: Field, notes: list[str]) -> NDArray[np.int64]:
    """Return the rows that have a time, by time."""
    order = np.argsort(x, kind="stable")
    order = order[np.isfinite(x[order])]
    if order.size < x.size:
        notes.append(f"{x.size - order.size} rows without a time are left out.")
    if (np.diff(order) < 0).any():
        notes.append("Rows are sorted by time.")
    return order
