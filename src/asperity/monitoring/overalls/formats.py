"""Tables of overall values as files: csv, parquet and JSON lines."""

import csv
import json
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pandas

from asperity.core.errors import BadInput, UnreadableFile, install_text
from asperity.core.files import require_file
from asperity.core.sandbox import read_in_subprocess
from asperity.core.third_party import first_line
from asperity.recording import acceleration_scale

SERIES_SUFFIXES = (".csv", ".txt", ".parquet", ".jsonl", ".ndjson")
MOST_BYTES = 500_000_000
SEPARATORS = (";", "\t", ",")
BLOCK = 100_000  # rows that are held as lists
WAVEFORM = "values"  # key of the samples of a recording in JSON lines
UNIT_COLUMNS = ("unit", "units", "einheit")
METRES = "m/s^2"
REMEDY = "give columns time, rms"


def read_table(path: Path) -> pandas.DataFrame:
    """Return the columns of a table, those of text files as text.

    Raises
    ------
    BadInput
        for another format, no rows, or rows that do not fit the heading.
    UnreadableFile
        if the file cannot be read.
    """
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
            table: pandas.DataFrame = read_in_subprocess(
                path.absolute(), f"{__name__}:read_parquet", remedy=REMEDY
            )
        else:
            table = _read_json(path) if suffix in (".jsonl", ".ndjson") else _read_csv(path)
    except ImportError:
        remedy = f"{install_text('recordings')}, or write a .csv"
        raise BadInput(f"{path.name} needs pyarrow; {remedy}") from None
    except BadInput:
        raise
    except (OSError, ValueError, csv.Error, RecursionError) as error:  # of pandas and pyarrow too
        raise UnreadableFile(
            f"{path.name} cannot be read as a table ({first_line(error)}); {REMEDY}"
        ) from None
    if not len(table):
        raise BadInput(f"{path.name} has no rows; give time stamps and values")
    return table.set_axis(_distinct([str(name).strip() for name in table.columns]), axis=1)


def read_parquet(path: Path) -> pandas.DataFrame:
    """Return the columns of a parquet file, and its index unless that numbers the rows."""
    try:
        table = pandas.read_parquet(path)
    except (OSError, ValueError) as error:
        raise UnreadableFile(
            f"{path.name} cannot be read as a table ({first_line(error)}); {REMEDY}"
        ) from None
    if not isinstance(table.index, pandas.RangeIndex):
        table = table.reset_index()
    return table


def _distinct(names: list[str]) -> list[str]:
    """Return the names, a repeated one with its number."""
    return [
        f"{name} ({names[: number + 1].count(name)})" if name in names[:number] else name
        for number, name in enumerate(names)
    ]


def _read_csv(path: Path) -> pandas.DataFrame:
    try:
        return _csv_table(path, _encoding(path))
    except UnicodeDecodeError:
        return _csv_table(path, "cp1252")


def _encoding(path: Path) -> str:
    with path.open("rb") as stream:
        return "utf-16" if stream.read(2) in (b"\xff\xfe", b"\xfe\xff") else "utf-8-sig"


def _csv_table(path: Path, encoding: str) -> pandas.DataFrame:
    rows = _csv_rows(path, encoding)
    heading = next(rows, (0, [""]))[1]
    if heading[-1] == "":
        heading.pop()
    blocks: list[pandas.DataFrame] = []
    block: list[list[str]] = []
    for line, row in rows:
        if len(row) == len(heading) + 1 and not row[-1]:  # a trailing separator
            row.pop()
        if len(row) != len(heading):
            raise BadInput(
                f"{path.name}: line {line} has {len(row)} fields, the heading {len(heading)}; "
                "write one field for each column"
            )
        block.append(row)
        if len(block) == BLOCK:
            blocks.append(pandas.DataFrame(block, columns=heading, dtype="str"))
            block = []
    blocks.append(pandas.DataFrame(block, columns=heading, dtype="str"))
    return pandas.concat(blocks, ignore_index=True)


def _csv_rows(path: Path, encoding: str) -> Iterator[tuple[int, list[str]]]:
    """Yield the number and the fields of each line that is not blank."""
    with path.open(encoding=encoding, newline="") as stream:
        heading = stream.readline()
        stream.seek(0)
        separator = next((mark for mark in SEPARATORS if mark in heading), None)
        if separator is None:
            yield from (
                (number, line.split()) for number, line in enumerate(stream, 1) if line.strip()
            )
            return
        reader = csv.reader(stream, delimiter=separator, skipinitialspace=True)
        for row in reader:
            if len(row) > 1 or (row and row[0].strip()):
                yield reader.line_num, row


def _read_json(path: Path) -> pandas.DataFrame:
    """Return the columns of JSON lines; samples are reduced to rms and kurtosis."""
    columns: dict[str, list[object]] = {}
    count = 0
    with path.open(encoding="utf-8-sig") as stream:
        for number, line in enumerate(stream, 1):
            if not line.strip():
                continue
            row = json.loads(line)
            if not isinstance(row, dict):
                raise ValueError(f"line {number} holds no JSON object")
            if WAVEFORM in row and not isinstance(row[WAVEFORM], int | float):
                row = _reduced(row, f"{path.name}: line {number}")
            for name, value in row.items():
                column = columns.setdefault(name, [])
                if len(column) < count:
                    column.extend([None] * (count - len(column)))
                column.append(value)
            count += 1
    for column in columns.values():
        column.extend([None] * (count - len(column)))
    return pandas.DataFrame({name: pandas.Series(column) for name, column in columns.items()})


def _reduced(row: dict[str, object], place: str) -> dict[str, object]:
    """Return a row with rms and kurtosis in place of its samples."""
    stated = row[WAVEFORM]
    if not isinstance(stated, list) or any(isinstance(sample, list | dict) for sample in stated):
        raise BadInput(f"{place} has values that are no list of numbers; write values = [0.1, 0.2]")
    try:
        samples = np.asarray(stated, dtype=float)
    except (TypeError, ValueError, OverflowError):
        raise BadInput(
            f"{place} has values that are no list of numbers; write values = [0.1, 0.2]"
        ) from None
    others = {key: value for key, value in row.items() if key not in (WAVEFORM, "rate")}
    if samples.size < 2:
        return others | {"rms": None, "kurtosis": None}
    centred = samples - samples.mean()
    rms = float(np.sqrt(np.mean(centred**2)))
    kurtosis = float(np.mean(centred**4)) / rms**4 if rms else np.nan
    return others | {"rms": rms, "kurtosis": kurtosis}


def unit_of_rows(table: pandas.DataFrame, file: str) -> tuple[str, np.ndarray | None, str]:
    """Return the unit that a column states, a factor of each row to it, and the column's name.

    Raises
    ------
    BadInput
        for several units that are not all of accelerations.
    """
    name = next((name for name in table.columns if name.lower() in UNIT_COLUMNS), "")
    if not name:
        return "", None, ""
    texts = table[name].fillna("").astype("str").str.strip()
    units = list(dict.fromkeys(texts))
    if len(units) == 1:
        return units[0], None, name
    scales = {unit: acceleration_scale(unit) for unit in units}
    if any(scale is None for scale in scales.values()):
        listed = ", ".join(unit or "no unit" for unit in units[:4])
        raise BadInput(
            f"{file} has rows in different units ({listed}); write all of them in one unit"
        )
    return METRES, texts.map(scales).to_numpy(dtype=float), name
