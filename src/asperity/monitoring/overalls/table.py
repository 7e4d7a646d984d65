"""Reading of overall values over time from csv, parquet and JSON lines."""

import json
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np
import pandas
from numpy.typing import NDArray

from asperity.core.arrays import Field
from asperity.core.errors import BadInput, UnreadableFile
from asperity.core.files import require_file
from asperity.core.third_party import first_line
from asperity.recording import OPERATING_KEYS, is_time_column, name_and_unit, read_sidecar

Column: TypeAlias = "pandas.Series[Any]"
SERIES_SUFFIXES = (".csv", ".txt", ".parquet", ".jsonl", ".ndjson")
MOST_BYTES = 500_000_000
SAMPLE_LINES = 50  # that decide the decimal sign
SEPARATORS = (";", "\t", ",")
SMALLEST_EPOCH = 1e8  # smaller numbers are hours or row numbers, no seconds since 1970
EPOCHS = ((1e11, 1.0), (1e14, 1e3), (1e17, 1e6), (np.inf, 1e9))  # median, ticks per second
FEWEST_NUMBERS = 0.5  # share of the rows of a column that must be numbers
WAVEFORM = "values"  # key of the samples of a recording in JSON lines
_DECIMAL_COMMA = re.compile(r'"?[-+]?\d+,\d+(?:[eE][-+]?\d+)?"?')
_DAY_OR_MONTH = re.compile(r"\s*(\d{1,2})[./-](\d{1,2})[./-]\d{4}")


@dataclass(frozen=True, slots=True, kw_only=True)
class OverallValues:
    """Overall values of one sensor or machine over time.

    `x` in `x_unit` rises; `times` are the time stamps as text, empty without dates. `values` are by
    column, with the unit in `units` ("" if not stated). `conditions` are load, speed and
    temperature by their keys. `machine_class` is that of ISO 20816-3, if stated.
    """

    path: Path
    x: Field
    x_unit: str
    times: Sequence[str]
    values: Mapping[str, Field]
    units: Mapping[str, str]
    conditions: Mapping[str, Field] = field(default_factory=dict)
    machine_class: str | None = None
    notes: tuple[str, ...] = ()


def read_overalls(path: str | Path) -> OverallValues:
    """Read a table of time stamps and overall values.

    The first column that holds times is the time; load_n, speed_hz, entrainment_m_s and
    temperature_degc are conditions; every other column of numbers is a value. JSON lines may hold
    samples (`values`, with `unit`); their rms and kurtosis are the values. A sidecar may state
    `machine_class`.

    Raises
    ------
    BadInput
        for another format, or a table without times or without values.
    UnreadableFile
        if the file cannot be read.
    """
    path = Path(path)
    table = _read(path)
    notes: list[str] = []
    name = _time_column(table, path)
    x, unit, times = _axis(table[name], name, path, notes)
    order = _order(x, notes)
    columns = _columns(table.drop(columns=name), order, notes)
    conditions = {key: columns.pop(key) for key in OPERATING_KEYS if key in columns}
    if not columns:
        raise BadInput(f"{path.name} has no column of values beside {name}; add one, such as rms")
    labels = {column: name_and_unit(column) for column in columns}
    stated, _ = read_sidecar(path)
    machine_class = stated.get("machine_class")
    return OverallValues(
        path=path,
        x=x[order],
        x_unit=unit,
        times=[times[number] for number in order] if times else [],
        values={labels[column][0]: values for column, values in columns.items()},
        units={label: unit or str(stated.get("unit", "")) for label, unit in labels.values()},
        conditions=conditions,
        machine_class=None if machine_class is None else str(machine_class),
        notes=tuple(notes),
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


def _columns(
    table: pandas.DataFrame, order: NDArray[np.int64], notes: list[str]
) -> dict[str, Field]:
    """Return the columns of numbers, without row numbers."""
    columns = {
        str(column): _numbers(table[column])[order]
        for column in table.columns
        if _mostly_numbers(table[column])
    }
    for column in [column for column, values in columns.items() if _counts_rows(values)]:
        del columns[column]
        notes.append(f"Column {column} counts rows and is left out.")
    return columns


def _read(path: Path) -> pandas.DataFrame:
    require_file(path)
    suffix = path.suffix.lower()
    if suffix not in SERIES_SUFFIXES:
        raise BadInput(
            f"a series is read from {', '.join(SERIES_SUFFIXES)}, got {path.name}; "
            "convert it to .csv"
        )
    if path.stat().st_size > MOST_BYTES:
        raise BadInput(f"{path.name} is above {MOST_BYTES / 1e6:.0f} MB; split it, or average rows")
    try:
        if suffix == ".parquet":
            table = pandas.read_parquet(path)
            if not isinstance(table.index, pandas.RangeIndex):
                table = table.reset_index()
        elif suffix in (".jsonl", ".ndjson"):
            table = pandas.DataFrame([*_json_rows(path)])
        else:
            table = _read_csv(path)
    except ImportError:
        remedy = "pip install 'asperity[recordings]', or write a .csv"
        raise BadInput(f"{path.name} needs pyarrow; {remedy}") from None
    except (OSError, ValueError) as error:  # of pandas and pyarrow too
        raise UnreadableFile(
            f"{path.name} cannot be read as a table ({first_line(error)}); give columns time, rms"
        ) from None
    if not len(table):
        raise BadInput(f"{path.name} has no rows; give time stamps and values")
    return table.rename(columns=str)


def _read_csv(path: Path) -> pandas.DataFrame:
    with path.open(encoding="utf-8-sig") as stream:
        lines = [line for _, line in zip(range(SAMPLE_LINES), stream, strict=False)]
    heading, *rows = lines or [""]
    separator = next((mark for mark in SEPARATORS if mark in heading), r"\s+")
    fields = [field for row in rows for field in re.split(separator, row.strip())]
    comma = separator != "," and any(map(_DECIMAL_COMMA.fullmatch, fields))
    return pandas.read_csv(
        path,
        sep=separator,
        decimal="," if comma else ".",
        encoding="utf-8-sig",
        skipinitialspace=True,
        low_memory=False,
    )


def _json_rows(path: Path) -> Iterator[dict[str, object]]:
    """Yield the rows of JSON lines; samples are reduced to rms and kurtosis."""
    with path.open(encoding="utf-8-sig") as stream:
        for number, line in enumerate(stream, 1):
            if not line.strip():
                continue
            row = json.loads(line)
            if not isinstance(row, dict):
                raise ValueError(f"line {number} holds no JSON object")
            if WAVEFORM in row:
                samples = np.asarray(row.pop(WAVEFORM), dtype=float)
                unit = row.pop("unit", "")
                row.pop("rate", None)
                centred = samples - samples.mean()
                rms = float(np.sqrt(np.mean(centred**2)))
                row[f"rms [{unit}]" if unit else "rms"] = rms
                row["kurtosis"] = float(np.mean(centred**4)) / rms**4 if rms else np.nan
            yield row


def _time_column(table: pandas.DataFrame, path: Path) -> str:
    """Return the column of times: by its name, or else the first that holds dates."""
    for column in table.columns:
        if is_time_column(name_and_unit(column)[0]):
            return str(column)
    for column in table.columns:
        values = table[column]
        if pandas.api.types.is_datetime64_any_dtype(values):
            return str(column)
        if (
            not _mostly_numbers(values)
            and pandas.to_datetime(values.head(SAMPLE_LINES), errors="coerce", format="mixed")
            .notna()
            .mean()
            > FEWEST_NUMBERS
        ):
            return str(column)
    raise BadInput(f"{path.name} has no column of times; name one of its columns time")


def _axis(stamps: Column, name: str, path: Path, notes: list[str]) -> tuple[Field, str, list[str]]:
    """Return x, its unit, and the time stamps as text; hours since the first one for dates."""
    if _mostly_numbers(stamps) and not pandas.api.types.is_datetime64_any_dtype(stamps):
        numbers = _numbers(stamps)
        middle = float(np.nanmedian(np.abs(numbers)))
        if middle < SMALLEST_EPOCH:
            return numbers, name_and_unit(name)[1] or "", []
        per_second = next(per_second for limit, per_second in EPOCHS if middle < limit)
        nanoseconds = np.rint(np.nan_to_num(numbers) * (1e9 / per_second)).astype("M8[ns]")
        dates = pandas.Series(nanoseconds).where(np.isfinite(numbers))
    else:
        dates = _dates(stamps, notes)
    if not dates.notna().any():
        raise BadInput(f"{path.name}: no time in column {name} can be read; write ISO 8601")
    seconds = (dates - dates.min()).dt.total_seconds().to_numpy(dtype=float)
    text = dates.dt.strftime("%Y-%m-%dT%H:%M:%S.%f").str.rstrip("0").str.rstrip(".")
    return seconds / 3600.0, "h", text.fillna("").tolist()


def _dates(stamps: Column, notes: list[str]) -> Column:
    """Return dates; of 03/04/2024 the order of day and month with the more even steps."""
    if pandas.api.types.is_datetime64_any_dtype(stamps):
        return stamps
    text = stamps.astype(str)
    matches = [match for match in map(_DAY_OR_MONTH.match, text) if match]
    if len(matches) < len(text) / 2:
        return pandas.to_datetime(text, errors="coerce", format="mixed", utc=True)
    read = {
        day_first: pandas.to_datetime(
            text, errors="coerce", format="mixed", dayfirst=day_first, utc=True
        )
        for day_first in (True, False)
    }
    if any(int(match[1]) > 12 for match in matches):
        return read[True]
    if any(int(match[2]) > 12 for match in matches):
        return read[False]
    unevenness = {day_first: _unevenness(dates) for day_first, dates in read.items()}
    day_first = unevenness[True] <= unevenness[False]
    first = "day" if day_first else "month"
    notes.append(
        f"Dates such as {matches[0][0].strip()} are read with the {first} first; write ISO 8601 if "
        "that is wrong."
    )
    return read[day_first]


def _unevenness(dates: Column) -> float:
    """Return the standard deviation of the steps over their mean; infinite if times fall."""
    steps = np.diff(dates.to_numpy(dtype="M8[s]").astype(float))
    if steps.size == 0 or (steps < 0.0).any() or not steps.any():
        return np.inf
    return float(np.std(steps) / np.mean(steps))


def _counts_rows(values: Field) -> bool:
    """Return whether values are successive whole numbers, as of a row number."""
    return bool(values.size > 2 and (np.abs(np.diff(values)) == 1.0).all())


def _numbers(column: Column) -> Field:
    return np.asarray(pandas.to_numeric(column, errors="coerce"), dtype=float)


def _mostly_numbers(column: Column) -> bool:
    if pandas.api.types.is_datetime64_any_dtype(column):
        return False
    return bool(np.isfinite(_numbers(column)).mean() > FEWEST_NUMBERS)
