"""Recordings as text: any separator, decimal points or commas, header lines, several blocks of rows in one file.

pandas parses the numbers; this module finds out what they are: dialect, names, units, declared
rate, column of times. Small files are read at once, large ones piece by piece.
"""

import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from datetime import datetime
from functools import partial
from io import BytesIO
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np

from asperity.core.arrays import Field
from asperity.core.errors import UnreadableFile
from asperity.core.text_dialect import MISSING, Dialect, sniff_dialect
from asperity.recording.model import Channel, Contents
from asperity.recording.reader import MOST_CHANNELS, facts_in, parse_time
from asperity.recording.timing import Filling, clock_of, is_time, timed
from asperity.recording.units import known_unit, name_and_unit

SUFFIXES = {"", "txt", "csv", "tsv", "asc", "dat", "lvm", "prn"}
_LARGE = 64 << 20  # bytes, from which a file is read piece by piece
_HEAD = 1 << 18  # bytes, in which the header and the first rows must lie
_CHUNK = 1 << 22
_WORTH_PANDAS = (
    1 << 20
)  # bytes of rows, below which they are read line by line before pandas is even loaded
_LONGEST_HEADER = 400  # lines
_MOST_BLOCKS = 64
_FEWEST_ROWS = 8  # of a block; fewer are a table in a header
_SAME_RATE = 1e-3  # relative, up to which header and times agree
_GAP = 1.5  # steps between two times, from which samples are missing


@dataclass(slots=True)
class _Table:
    """One block of rows: where it begins, what its header says, and, unless the file is large, its numbers."""

    offset: int
    dialect: Dialect
    columns: int
    names: list[str]
    units: list[str | None]
    declared: dict[str, str]
    started: datetime | None
    stamped: bool  # the first column holds dates
    rows: Field | None = None
    end: int | None = None
    odd: int = 0  # rows without a number in them
    stamps: list[datetime] = field(default_factory=list)


def looks_like_text(head: bytes) -> bool:
    """Whether there are no bytes in it that text has not."""
    if head.startswith((b"\xff\xfe", b"\xfe\xff")):
        return True
    return not any(code in head for code in (*range(9), *range(14, 27), *range(28, 32)))


def read(path: Path) -> Contents:
    """Channels named by the columns' headers, or "1", "2" ...; "1/name", "2/name" ... of several blocks."""
    notes: list[str] = []
    large = path.stat().st_size > _LARGE
    open_bytes = _opener(path)
    with open_bytes() as stream:
        tables: list[_Table] = []
        at: int | None = 0
        while at is not None and len(tables) < _MOST_BLOCKS:
            table = _header(stream, at)
            if table is None:
                break
            if large:
                table.rows = next(_tables(stream, table))  # for its clock
                tables.append(table)
                break
            table.rows = np.concatenate([np.empty((0, table.columns)), *_tables(stream, table)])
            while table.rows.shape[0] and np.isnan(table.rows[-1]).all():
                table.rows = table.rows[:-1]
            if table.rows.shape[0] >= _FEWEST_ROWS:
                tables.append(table)
            at = table.end
    if not tables:
        raise UnreadableFile(
            f"{path.name} holds no rows of numbers; give a recording, or name it after its format"
        )
    channels: list[Channel] = []
    for number, table in enumerate(tables, 1):
        prefix = f"{number}/" if len(tables) > 1 else ""
        channels += _channels(path, table, prefix, notes, open_bytes if large else None)
    blocks = f", {len(tables)} blocks" if len(tables) > 1 else ""
    return Contents(format=f"text{blocks}", channels=channels, notes=notes)


def _opener(path: Path) -> Callable[[], BinaryIO]:
    """Opens the file as bytes that are ASCII where they are numbers; UTF-16 is turned into UTF-8 in memory."""
    with path.open("rb") as file:
        start = file.read(2)
    if start not in (b"\xff\xfe", b"\xfe\xff"):
        return lambda: path.open("rb")
    if path.stat().st_size > _LARGE:
        raise UnreadableFile(f"{path.name} is a large file in UTF-16; save it as UTF-8")
    content = path.read_bytes().decode("utf-16", errors="replace").encode("utf-8")
    return lambda: BytesIO(content)


# The header
# ----------------------------------------------------------------------------------------------------------


def _header(stream: BinaryIO, at: int) -> _Table | None:
    """The next block of rows from byte `at` on, its numbers still to be read; None where there is none."""
    stream.seek(at)
    head = stream.read(_HEAD)
    whole = head if len(head) < _HEAD else head[: head.rfind(b"\n") + 1 or None]
    lines = whole.splitlines(keepends=True)
    texts = [_decoded(line) for line in lines]
    dialect = sniff_dialect([text for text in texts if re.search(r"\d", text)][:400][-100:])
    for number, text in enumerate(texts[:_LONGEST_HEADER]):
        fields = dialect.fields(text)
        row, stamped = _row(fields, dialect)
        if row is None:
            continue
        following = next(
            (dialect.fields(later) for later in texts[number + 1 :] if later.strip()), None
        )
        if following is not None and (
            len(following) != len(fields) or _row(following, dialect)[0] is None
        ):
            continue
        if len(row) > MOST_CHANNELS:
            raise UnreadableFile(
                f"a row of {len(row)} numbers is no row of samples; give one column a channel"
            )
        names, units = _labels(texts[:number], len(row), dialect)
        return _Table(
            offset=at + sum(map(len, lines[:number])),
            dialect=dialect,
            columns=len(row),
            names=names,
            units=units,
            declared=_declared(texts[:number]),
            started=_started(texts[:number]),
            stamped=stamped,
        )
    return None


def _decoded(line: bytes) -> str:
    try:
        return line.decode("utf-8-sig").strip("\r\n")
    except UnicodeDecodeError:
        return line.decode("cp1252", errors="replace").strip("\r\n")


def _row(fields: list[str], dialect: Dialect) -> tuple[list[float] | None, bool]:
    """The numbers of a line, or None; and whether its first field is a date."""
    values = [dialect.number(field) for field in fields]
    stamped = (
        len(values) > 1
        and values[0] is None
        and parse_time(fields[0].strip().strip('"')) is not None
    )
    if stamped:
        values[0] = np.nan
    numbers = [value for value in values if value is not None]
    if len(numbers) < len(values) or not numbers or not np.isfinite(numbers).any():
        return None, stamped
    return numbers, stamped


def _labels(header: list[str], count: int, dialect: Dialect) -> tuple[list[str], list[str | None]]:
    """Names and units of the columns, from the last one or two header lines with as many fields."""
    fitting = []
    for line in [line for line in header if line.strip()][-3:]:
        bare = line.lstrip("#%/ ")
        alone = count == 1 and not re.search(
            "[:=]", bare
        )  # a blank in the label of an only column separates nothing
        fields = [label.strip().strip('"') for label in ([bare] if alone else dialect.fields(bare))]
        if len(fields) + (line.rstrip().endswith(dialect.separator or "\0")) in (count, count + 1):
            fitting.append((fields + [""] * count)[:count])
    if not fitting:
        return [str(number + 1) for number in range(count)], [None] * count
    below: list[str] = fitting[-1]
    are_units = [known_unit(label) for label in below]
    if (
        len(fitting) > 1
        and any(are_units)
        and all(known_unit(label) or len(label) < 9 for label in below)
    ):
        names = [name or str(k + 1) for k, name in enumerate(fitting[-2])]
        return names, [
            label if known else None for label, known in zip(below, are_units, strict=True)
        ]
    if any(dialect.number(label) is not None for label in below if label):
        return [str(number + 1) for number in range(count)], [None] * count
    pairs = [name_and_unit(label) for label in below]
    return [name or str(k + 1) for k, (name, _) in enumerate(pairs)], [unit for _, unit in pairs]


def _declared(header: list[str]) -> dict[str, str]:
    """Key: value, key = value and key;value lines of a header, with hertz and seconds as plain numbers."""
    declared = {}
    for line in header:
        pair = re.match(
            r"[#%/\s\"]*([A-Za-z][^:=;\t]{0,40}?)\"?\s*[:=;\t]\s*\"?(.+?)\"?[;\t,\s]*$", line
        )
        if not pair:
            continue
        key, value = (
            re.sub(r"\s*[\[(]\s*(hz|s|sec)\s*[\])]\s*$", "", pair[1].strip(), flags=re.I),
            pair[2].strip(),
        )
        several = {part.strip() for part in re.split(r"[\t;]", value) if part.strip()}
        if len(several) == 1:  # lvm states each for every channel
            (value,) = several
        scaled = re.fullmatch(r"([-+\d.,eE]+)\s*(kHz|Hz|ms|us|µs|s|S/s|samples/s)?", value)
        if scaled:
            try:
                number = float(scaled[1].replace(",", "."))
            except ValueError:
                continue
            value = repr(
                number * {"kHz": 1e3, "ms": 1e-3, "us": 1e-6, "µs": 1e-6}.get(scaled[2] or "", 1.0)
            )
        declared[key] = value
    return declared


def _started(header: list[str]) -> datetime | None:
    """The last date that a header line states, after a colon or the words that CETR's viewer uses."""
    for line in reversed(header):
        for text in (line.partition(":")[2], re.sub(r"^[A-Za-z ]*\b(?:date|at)\b:?\s*", "", line)):
            started = parse_time(text.strip())
            if started is not None:
                return started
    return None


# The rows
# ------------------------------------------------------------------------------------------------------------


def _parsed(chunk: bytes, table: _Table, picked: tuple[int, ...] | None = None) -> Field | None:
    """The numbers of whole lines by pandas, (rows, columns); None where a line holds something else."""
    import pandas

    if not chunk.strip():
        return np.empty((0, table.columns if picked is None else len(picked)))
    wanted: Any = range(table.columns) if picked is None else picked
    first = chunk.lstrip(b"\r\n").split(b"\n", 1)[0].rstrip(b" \r")
    ended = table.dialect.separator is not None and first.endswith(table.dialect.separator.encode())
    try:
        frame = pandas.read_csv(
            BytesIO(chunk),
            sep=table.dialect.separator or r"\s+",
            decimal="," if table.dialect.comma else ".",
            header=None,
            names=range(table.columns + ended),  # one for what is behind a separator at the end
            usecols=wanted,
            dtype=np.float64,
            na_values=sorted(MISSING),
            encoding="latin-1",
            engine="c",
            index_col=False,
        )
    except (ValueError, pandas.errors.ParserError, OverflowError):
        return None
    return frame[list(wanted)].to_numpy()


def _tables(
    stream: BinaryIO, table: _Table, picked: tuple[int, ...] | None = None
) -> Iterator[Field]:
    """The rows of a block, chunk by chunk, until lines follow that are no rows; where those begin goes to `end`."""
    stream.seek(table.offset)
    at, rest = table.offset, b""
    while True:
        data = stream.read(_CHUNK)
        chunk = rest + data
        cut = chunk.rfind(b"\n") + 1 if data else len(chunk)
        chunk, rest = chunk[:cut], chunk[cut:]
        if len(rest) > _CHUNK:
            return  # no line is as long as that
        rows = (
            None if table.stamped or len(chunk) < _WORTH_PANDAS else _parsed(chunk, table, picked)
        )
        if rows is None:
            rows, ended = _line_by_line(chunk, table, at, picked)
            yield rows
            if ended is not None:
                table.end = ended
                return
        else:
            yield rows
        at += len(chunk)
        if not data:
            return


def _line_by_line(
    chunk: bytes, table: _Table, at: int, picked: tuple[int, ...] | None
) -> tuple[Field, int | None]:
    """Rows up to two lines in a row that are none; a single odd line is a missing row. And where it ended, if so."""
    rows: list[list[float]] = []
    waiting: int | None = None  # where an odd line began
    for line in chunk.splitlines(keepends=True):
        text = _decoded(line)
        if text.strip():
            fields = table.dialect.fields(text)
            values = [table.dialect.number(field) for field in fields]
            if table.stamped and values and values[0] is None:
                stamp = parse_time(fields[0].strip().strip('"'))
                if stamp is not None:
                    if picked is None:  # a large file's are too many to keep
                        table.stamps.append(stamp)
                    values[0] = (stamp - table.stamps[0]).total_seconds()
            good = [value for value in values if value is not None]
            if len(values) == table.columns and good:
                if waiting is not None:
                    rows.append([np.nan] * table.columns)
                    table.odd += 1
                    waiting = None
                table.odd += len(good) < len(values)
                rows.append([np.nan if value is None else value for value in values])
            elif waiting is not None:
                return _picked(rows, table, picked), waiting
            else:
                waiting = at
        at += len(line)
    return _picked(rows, table, picked), None


def _picked(rows: list[list[float]], table: _Table, picked: tuple[int, ...] | None) -> Field:
    array = np.array(rows, dtype=np.float64).reshape(-1, table.columns)
    return array if picked is None else array[:, list(picked)]


# Channels
# ------------------------------------------------------------------------------------------------------------


def _channels(
    path: Path,
    table: _Table,
    prefix: str,
    notes: list[str],
    open_bytes: Callable[[], BinaryIO] | None,
) -> Iterator[Channel]:
    rows = table.rows
    assert rows is not None
    clock_at = (
        0
        if table.stamped
        else next((k for k, name in enumerate(table.names) if is_time(name)), None)
    )
    clock: dict[str, Any] = {}
    spread: Callable[[Field], Field] = _as_they_are
    if clock_at is not None:
        name, unit = table.names[clock_at], table.units[clock_at]
        times = rows[:, clock_at]
        clock = timed(name, "s" if table.stamped else unit, times)
        if open_bytes is None and "rate_hz" in clock and times.size == rows.shape[0]:
            spread = _onto_grid(times, prefix, notes)
        if table.stamps:
            clock.setdefault("started", table.stamps[0])
    if table.odd:
        notes.append(
            f"{prefix}{table.odd} rows hold text instead of numbers; they count as missing"
        )
    facts = facts_in(path.name, table.declared)
    if table.started is not None:
        facts["started"] = table.started
    if (
        "rate_hz" in clock
        and "rate_hz" in facts
        and abs(facts["rate_hz"] / clock["rate_hz"] - 1.0) > _SAME_RATE
    ):
        stated = f"its header states {facts['rate_hz']:g} Hz ({facts['rate_source']}), its times {clock['rate_hz']:g} Hz"
        notes.append(f"{prefix}{stated}; the times are taken")
    facts = clock | facts if "rate_hz" not in clock else facts | clock
    names = _unique(table.names)
    for k in range(table.columns):
        if k == clock_at:
            continue
        known = facts | ({"unit": table.units[k]} if table.units[k] else {})
        if open_bytes is None:
            values = spread(rows[:, k])
            yield Channel(
                name=prefix + names[k],
                blocks=partial(_pieces, values),
                samples=values.size,
                **known,
            )
        else:
            at = None if "rate_hz" not in clock else clock_at
            blocks = partial(_streamed, open_bytes, table, (k, at), notes)
            yield Channel(name=prefix + names[k], blocks=blocks, **known)


def _unique(names: list[str]) -> list[str]:
    return [name if names.count(name) == 1 else f"{name} ({k + 1})" for k, name in enumerate(names)]


def _pieces(values: Field, size: int) -> Iterator[Field]:
    for first in range(0, values.size, size):
        yield values[first : first + size]


def _streamed(
    open_bytes: Callable[[], BinaryIO],
    table: _Table,
    place: tuple[int, int | None],
    notes: list[str],
    size: int,
) -> Iterator[Field]:
    """A column of a large file, on the grid of its column of times where that is one."""
    column, clock_at = place
    filling: Filling | None = None
    if clock_at is not None:
        assert table.rows is not None  # its first ones
        clock = clock_of(table.rows[:, clock_at])
        filling = Filling(clock) if clock is not None and clock.even else None
    with open_bytes() as stream:
        for rows in _tables(stream, table, (column,) if clock_at is None else (column, clock_at)):
            values = rows[:, 0] if filling is None else filling.spread(rows[:, 1], rows[:, 0])
            yield from _pieces(values, size)
    if filling is not None and filling.note:
        notes.append(filling.note)
    if table.end is not None:
        notes.append("another block of rows follows, which was not read; split the file")


def _as_they_are(values: Field) -> Field:
    return values


def _onto_grid(times: Field, prefix: str, notes: list[str]) -> Callable[[Field], Field]:
    """Puts rows where their times say, leaving gaps where samples are missing."""
    clock = clock_of(times)
    if clock is not None and clock.even:
        filling = Filling(clock)
        filling.spread(times, times)
        if filling.note:
            notes.append(prefix + filling.note)
        return lambda values: Filling(clock).spread(times, values)
    known = np.flatnonzero(np.isfinite(times))
    steps = np.diff(times[known])
    step = float(np.median(steps))
    gaps = int(np.count_nonzero(steps > _GAP * step))
    if np.any(steps <= 0.0):
        notes.append(
            f"{prefix}its times go back or stand still; rows were taken in the order of the file"
        )
        return _as_they_are
    elapsed = (times[known] - times[known[0]]) / step
    place = np.round(elapsed)
    stray = float(np.max(np.abs(elapsed - place)))
    if gaps and np.all(np.diff(place) > 0) and place[-1] < 2 * times.size:
        lost = int(place[-1]) + 1 - known.size
        notes.append(f"{prefix}{gaps} gaps in its times: {lost} samples are missing")
        index = place.astype(np.int64)

        def spread(values: Field) -> Field:
            full = np.full(int(index[-1]) + 1, np.nan)
            full[index] = values[known]
            return full

        return spread
    if gaps:
        notes.append(
            f"{prefix}{gaps} gaps in its times, too many to be filled; take the spectrum with care"
        )
    elif stray > 0.25 and float(np.max(np.abs(steps - step))) > 0.1 * step:
        least, most = steps.min() / step, steps.max() / step
        notes.append(
            f"{prefix}its times are uneven: steps from {least:.2f} to {most:.2f} of the median"
        )
    return _as_they_are
