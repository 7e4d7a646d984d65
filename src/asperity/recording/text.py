"""Recordings as text: any separator, decimal points or commas, header lines, several blocks.

pandas parses the numbers; this module determines the dialect, names, units, declared rate and
column of times. Small files are read at once, large ones in chunks.
"""

from collections.abc import Callable, Iterator
from functools import partial
from io import BytesIO
from pathlib import Path
from typing import BinaryIO

import numpy as np
import numpy.typing as npt

from asperity.core.arrays import Field
from asperity.core.errors import UnreadableFile
from asperity.core.text_dialect import MISSING
from asperity.recording.model import Channel, ChannelFacts, Contents
from asperity.recording.reader import parse_time, stated_facts
from asperity.recording.text_header import TextTable, decode_line, read_header
from asperity.recording.timing import GapFiller, fit_clock, is_time_column, rate_from_times

SUFFIXES = {"", "txt", "csv", "tsv", "asc", "dat", "lvm", "prn"}
_LARGE = 64 << 20  # bytes, above which a file is read in chunks
_CHUNK = 1 << 22
_WORTH_PANDAS = 1 << 20  # bytes of rows, below which reading lines is faster than loading pandas
_MOST_BLOCKS = 64
_FEWEST_ROWS = 8  # of a block; a shorter one is a table in a header
_SAME_RATE = 1e-3  # relative difference of rates from header and times
_GAP = 1.5  # steps between two times, above which samples are missing


def read(path: Path) -> Contents:
    """Read channels named by column headers, or "1", "2" ...; "1/name" ... for several blocks."""
    notes: list[str] = []
    large = path.stat().st_size > _LARGE
    open_bytes = _opener(path)
    with open_bytes() as stream:
        tables = list(_first_rows(stream) if large else _all_rows(stream))
    if not tables:
        raise UnreadableFile(
            f"{path.name} holds no rows of numbers; give a recording, or add its format's suffix"
        )
    channels: list[Channel] = []
    for number, table in enumerate(tables, 1):
        prefix = f"{number}/" if len(tables) > 1 else ""
        channels += _channels(path, table, prefix, notes, open_bytes if large else None)
    blocks = f", {len(tables)} blocks" if len(tables) > 1 else ""
    return Contents(format=f"text{blocks}", channels=channels, notes=notes)


def _first_rows(stream: BinaryIO) -> Iterator[TextTable]:
    """Yield the first block with the first of its rows, for its clock."""
    table = read_header(stream, 0)
    if table is not None:
        table.rows = next(_tables(stream, table))
        yield table


def _all_rows(stream: BinaryIO) -> Iterator[TextTable]:
    """Yield the blocks of a recording with all their rows."""
    start: int | None = 0
    blocks = 0
    while start is not None and blocks < _MOST_BLOCKS:
        table = read_header(stream, start)
        if table is None:
            return
        table.rows = np.concatenate([np.empty((0, table.columns)), *_tables(stream, table)])
        while table.rows.shape[0] and np.isnan(table.rows[-1]).all():
            table.rows = table.rows[:-1]
        if table.rows.shape[0] >= _FEWEST_ROWS:
            blocks += 1
            yield table
        start = table.end


def _opener(path: Path) -> Callable[[], BinaryIO]:
    """Return a function that opens the file as ASCII-compatible bytes; converts UTF-16 to UTF-8."""
    with path.open("rb") as file:
        start = file.read(2)
    if start not in (b"\xff\xfe", b"\xfe\xff"):
        return lambda: path.open("rb")
    if path.stat().st_size > _LARGE:
        raise UnreadableFile(f"{path.name} is a large file in UTF-16; save it as UTF-8")
    content = path.read_bytes().decode("utf-16", errors="replace").encode("utf-8")
    return lambda: BytesIO(content)


# The rows
# ----------------------------------------------------------------


def _parsed(
    chunk: bytes, table: TextTable, selected: tuple[int, ...] | None = None
) -> Field | None:
    """Return the numbers of whole lines by pandas, (rows, columns); None where that fails."""
    import pandas

    if not chunk.strip():
        return np.empty((0, table.columns if selected is None else len(selected)))
    used_columns = list(range(table.columns) if selected is None else selected)
    first = chunk.lstrip(b"\r\n").split(b"\n", 1)[0].rstrip(b" \r")
    ended = table.dialect.separator is not None and first.endswith(table.dialect.separator.encode())
    try:
        frame = pandas.read_csv(
            BytesIO(chunk),
            sep=table.dialect.separator or r"\s+",
            decimal="," if table.dialect.comma else ".",
            header=None,
            names=range(table.columns + ended),  # one more for a separator at the end
            usecols=used_columns,
            dtype=np.float64,
            na_values=sorted(MISSING),
            encoding="latin-1",
            engine="c",
            index_col=False,
        )
    except (ValueError, pandas.errors.ParserError, OverflowError):
        return None
    return np.asarray(frame[used_columns].to_numpy(), dtype=np.float64)


def _tables(
    stream: BinaryIO, table: TextTable, selected: tuple[int, ...] | None = None
) -> Iterator[Field]:
    """Yield the rows of a block in chunks up to its end, whose position goes to `table.end`."""
    stream.seek(table.offset)
    start, remainder = table.offset, b""
    while True:
        data = stream.read(_CHUNK)
        chunk = remainder + data
        end_of_lines = chunk.rfind(b"\n") + 1 if data else len(chunk)
        chunk, remainder = chunk[:end_of_lines], chunk[end_of_lines:]
        if len(remainder) > _CHUNK:
            return  # not text
        rows = (
            None if table.stamped or len(chunk) < _WORTH_PANDAS else _parsed(chunk, table, selected)
        )
        if rows is None:
            rows, ended = _line_by_line(chunk, table, start, selected)
            yield rows
            if ended is not None:
                table.end = ended
                return
        else:
            yield rows
        start += len(chunk)
        if not data:
            return


def _line_by_line(
    chunk: bytes, table: TextTable, start: int, selected: tuple[int, ...] | None
) -> tuple[Field, int | None]:
    """Return rows up to two bad lines in a row, and the block's end if reached.

    A single bad line counts as a missing row.
    """
    rows: list[list[float]] = []
    bad_line_at: int | None = None  # where an odd line began
    for line in chunk.splitlines(keepends=True):
        text = decode_line(line)
        if text.strip():
            fields = table.dialect.fields(text)
            values = [table.dialect.number(field) for field in fields]
            if table.stamped and values and values[0] is None:
                stamp = parse_time(fields[0].strip().strip('"'))
                if stamp is not None:
                    if selected is None:  # a large file has too many
                        table.stamps.append(stamp)
                    values[0] = (stamp - table.stamps[0]).total_seconds()
            numbers = [value for value in values if value is not None]
            if len(values) == table.columns and numbers:
                if bad_line_at is not None:
                    rows.append([np.nan] * table.columns)
                    table.bad_rows += 1
                    bad_line_at = None
                table.bad_rows += len(numbers) < len(values)
                rows.append([np.nan if value is None else value for value in values])
            elif bad_line_at is not None:
                return _selected(rows, table, selected), bad_line_at
            else:
                bad_line_at = start
        start += len(line)
    return _selected(rows, table, selected), None


def _selected(rows: list[list[float]], table: TextTable, selected: tuple[int, ...] | None) -> Field:
    array = np.array(rows, dtype=np.float64).reshape(-1, table.columns)
    return array if selected is None else array[:, list(selected)]


# Channels
# ----------------------------------------------------------------


def _channels(
    path: Path,
    table: TextTable,
    prefix: str,
    notes: list[str],
    open_bytes: Callable[[], BinaryIO] | None,
) -> Iterator[Channel]:
    rows = table.rows
    assert rows is not None
    timed = [k for k, name in enumerate(table.names) if is_time_column(name)]
    clock_at = 0 if table.stamped else next(iter(timed), None)
    clock: ChannelFacts = {} if clock_at is None else _clock_facts(table, rows, clock_at)
    fill: Callable[[Field], Field] = _unchanged
    if clock_at is not None and open_bytes is None and "rate_hz" in clock:
        fill = _grid_filler(rows[:, clock_at], prefix, notes)
    facts = _combined_facts(path, table, clock, prefix, notes)
    names = _unique(table.names)
    for k in range(table.columns):
        if k == clock_at:
            continue
        unit = table.units[k]
        column_facts = _of_column(facts, table, k, clock_at)
        column_facts |= {"unit": unit} if unit else {}
        if open_bytes is None:
            values = fill(rows[:, k])
            blocks = partial(_pieces, values)
            samples = values.size
        else:
            clock_column = None if "rate_hz" not in clock else clock_at
            blocks = partial(_streamed, open_bytes, table, (k, clock_column), notes)
            samples = None
        yield Channel(name=prefix + names[k], blocks=blocks, samples=samples, **column_facts)


def _clock_facts(table: TextTable, rows: Field, column: int) -> ChannelFacts:
    """Return rate and start from a column of times."""
    unit = "s" if table.stamped else table.units[column]
    clock = rate_from_times(table.names[column], unit, rows[:, column])
    if table.stamps:
        clock.setdefault("started", table.stamps[0])
    return clock


def _combined_facts(
    path: Path, table: TextTable, clock: ChannelFacts, prefix: str, notes: list[str]
) -> ChannelFacts:
    """Return the facts of the header and of the times, which take precedence for the rate."""
    if table.bad_rows:
        notes.append(
            f"{prefix}{table.bad_rows} rows hold text instead of numbers and count as missing"
        )
    facts = stated_facts(path.name, table.declared)
    if table.started is not None:
        facts["started"] = table.started
    if "rate_hz" not in clock:
        return clock | facts
    if "rate_hz" in facts and abs(facts["rate_hz"] / clock["rate_hz"] - 1.0) > _SAME_RATE:
        notes.append(
            f"{prefix}its header states {facts['rate_hz']:g} Hz ({facts['rate_source']}), its "
            f"times {clock['rate_hz']:g} Hz; the times are used"
        )
    return facts | clock


def _of_column(
    facts: ChannelFacts, table: TextTable, column: int, clock_at: int | None
) -> ChannelFacts:
    """Return the facts of one column, with its own sensitivity where the header lists several."""
    several = facts.get("sensitivity", "").split("; ")
    channels = [k for k in range(table.columns) if k != clock_at]
    numbers = channels if len(several) == len(channels) else range(len(several))
    if len(several) < 2 or len(several) not in (len(channels), table.columns):
        return facts.copy()
    return facts | {"sensitivity": several[list(numbers).index(column)]}


def _unique(names: list[str]) -> list[str]:
    return [name if names.count(name) == 1 else f"{name} ({k + 1})" for k, name in enumerate(names)]


def _pieces(values: Field, size: int) -> Iterator[Field]:
    for first in range(0, values.size, size):
        yield values[first : first + size]


def _streamed(
    open_bytes: Callable[[], BinaryIO],
    table: TextTable,
    columns: tuple[int, int | None],
    notes: list[str],
    size: int,
) -> Iterator[Field]:
    """Yield a column of a large file, placed on the grid of its column of times if there is one."""
    column, clock_at = columns
    filling: GapFiller | None = None
    if clock_at is not None:
        assert table.rows is not None  # its first ones
        clock = fit_clock(table.rows[:, clock_at])
        filling = GapFiller(clock) if clock is not None and clock.even else None
    with open_bytes() as stream:
        for rows in _tables(stream, table, (column,) if clock_at is None else (column, clock_at)):
            values = rows[:, 0] if filling is None else filling.fill(rows[:, 1], rows[:, 0])
            yield from _pieces(values, size)
    if filling is not None and filling.note:
        notes.append(filling.note)
    if table.end is not None:
        notes.append("another block of rows follows and was not read; split the file")


def _unchanged(values: Field) -> Field:
    return values


def _grid_filler(times: Field, prefix: str, notes: list[str]) -> Callable[[Field], Field]:
    """Return a function that places rows by their times, leaving gaps where samples are missing."""
    clock = fit_clock(times)
    if clock is not None and clock.even:
        filling = GapFiller(clock)
        filling.fill(times, times)
        if filling.note:
            notes.append(prefix + filling.note)
        return lambda values: GapFiller(clock).fill(times, values)
    return _nearest_places(times, prefix, notes)


def _nearest_places(times: Field, prefix: str, notes: list[str]) -> Callable[[Field], Field]:
    """Return `_grid_filler` for times that are uneven, or do not increase."""
    finite = np.flatnonzero(np.isfinite(times))
    steps = np.diff(times[finite])
    step = float(np.median(steps))
    gaps = int(np.count_nonzero(steps > _GAP * step))
    if np.any(steps <= 0.0):
        notes.append(f"{prefix}its times do not increase; rows are used in the order of the file")
        return _unchanged
    elapsed = (times[finite] - times[finite[0]]) / step
    position = np.round(elapsed)
    if gaps and np.all(np.diff(position) > 0) and position[-1] < 2 * times.size:
        missing = int(position[-1]) + 1 - finite.size
        notes.append(f"{prefix}{gaps} gaps in its times: {missing} samples are missing")
        return partial(_placed, finite, position.astype(np.int64))
    if gaps:
        notes.append(
            f"{prefix}{gaps} gaps in its times, too many to fill; the spectrum is doubtful"
        )
    elif float(np.max(np.abs(elapsed - position))) > 0.25:
        notes += _uneven(steps, step, prefix)
    return _unchanged


def _placed(finite: npt.NDArray[np.intp], position: npt.NDArray[np.int64], values: Field) -> Field:
    """Return known values at their positions on the grid, nan in gaps."""
    filled = np.full(int(position[-1]) + 1, np.nan)
    filled[position] = values[finite]
    return filled


def _uneven(steps: Field, step: float, prefix: str) -> Iterator[str]:
    """Yield a note if steps differ from their median."""
    if float(np.max(np.abs(steps - step))) > 0.1 * step:
        least = steps.min() / step
        most = steps.max() / step
        yield f"{prefix}its times are uneven: steps from {least:.2f} to {most:.2f} of the median"
