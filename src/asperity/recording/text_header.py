"""Headers of recordings as text: dialect, names, units, declared rate and start of each block."""

import re
from dataclasses import dataclass, field
from datetime import datetime
from typing import BinaryIO

import numpy as np

from asperity.core.arrays import Field
from asperity.core.errors import UnreadableFile
from asperity.core.text_dialect import Dialect, sniff_dialect
from asperity.recording.reader import MOST_CHANNELS, parse_time
from asperity.recording.units import known_unit, name_and_unit

_HEAD_BYTES = 1 << 18  # bytes, in which the header and the first rows must lie
_LONGEST_HEADER = 400  # lines


@dataclass(slots=True)
class TextTable:
    """One block of rows: its position, its header, and, unless the file is large, its numbers."""

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
    bad_rows: int = 0  # rows without a number in them
    stamps: list[datetime] = field(default_factory=list)


def looks_like_text(head: bytes) -> bool:
    """Return whether the bytes contain no control characters foreign to text."""
    if head.startswith((b"\xff\xfe", b"\xfe\xff")):
        return True
    return not any(code in head for code in (*range(9), *range(14, 27), *range(28, 32)))


def read_header(stream: BinaryIO, start: int) -> TextTable | None:
    """Return the next block of rows from byte `start` on, its numbers not yet read, or None."""
    stream.seek(start)
    head = stream.read(_HEAD_BYTES)
    complete = head if len(head) < _HEAD_BYTES else head[: head.rfind(b"\n") + 1 or None]
    lines = complete.splitlines(keepends=True)
    texts = [decode_line(line) for line in lines]
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
                f"a row of {len(row)} numbers is not a row of samples; give one column per channel"
            )
        header = texts[:number]
        names, units = _labels(header, len(row), dialect)
        return TextTable(
            offset=start + sum(map(len, lines[:number])),
            dialect=dialect,
            columns=len(row),
            names=names,
            units=units,
            declared=_declared(header),
            started=_started(header),
            stamped=stamped,
        )
    return None


def decode_line(line: bytes) -> str:
    """Return a line as text, UTF-8 or else Windows-1252."""
    try:
        return line.decode("utf-8-sig").strip("\r\n")
    except UnicodeDecodeError:
        return line.decode("cp1252", errors="replace").strip("\r\n")


def _row(fields: list[str], dialect: Dialect) -> tuple[list[float] | None, bool]:
    """Return the numbers of a line, or None; and whether its first field is a date."""
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
    """Return names and units of the columns, from the last header lines with as many fields."""
    matching = _label_lines(header, count, dialect)
    last = matching[-1] if matching else []
    are_units = [known_unit(label) for label in last]
    if (
        len(matching) > 1
        and any(are_units)
        and all(known_unit(label) or len(label) < 9 for label in last)
    ):
        names = [name or str(k + 1) for k, name in enumerate(matching[-2])]
        return names, [
            label if known else None for label, known in zip(last, are_units, strict=True)
        ]
    if not last or any(dialect.number(label) is not None for label in last if label):
        return [str(number + 1) for number in range(count)], [None] * count
    pairs = [name_and_unit(label) for label in last]
    return [name or str(k + 1) for k, (name, _) in enumerate(pairs)], [unit for _, unit in pairs]


def _label_lines(header: list[str], count: int, dialect: Dialect) -> list[list[str]]:
    """Return the fields of the last header lines with as many as there are columns."""
    matching = []
    for line in [line for line in header if line.strip()][-3:]:
        stripped = line.lstrip("#%/ ")
        single = count == 1 and not re.search(
            "[:=]", stripped
        )  # blanks do not separate in the label of a single column
        fields = [
            label.strip().strip('"')
            for label in ([stripped] if single else dialect.fields(stripped))
        ]
        if len(fields) + (line.rstrip().endswith(dialect.separator or "\0")) in (count, count + 1):
            matching.append((fields + [""] * count)[:count])
    return matching


def _declared(header: list[str]) -> dict[str, str]:
    """Return the key-value lines of a header, with hertz and seconds as plain numbers.

    Recognises "key: value", "key = value" and "key;value".
    """
    declared = {}
    for line in header:
        pair = re.match(
            r"[#%/\s\"]*([A-Za-z][^:=;\t]{0,40}?)\"?\s*[:=;\t]\s*\"?(.+?)\"?[;\t,\s]*$", line
        ) or re.match(r"(?i)[#%/\s\"]*(sensitivity[^,:=;\t]*)\"?,\s*\"?(.+?)\"?[,\s]*$", line)
        if not pair:
            continue
        key = re.sub(r"\s*[\[(]\s*(hz|s|sec)\s*[\])]\s*$", "", pair[1].strip(), flags=re.I)
        value = pair[2].strip()
        several = {part.strip() for part in re.split(r"[\t;]", value) if part.strip()}
        if len(several) == 1:  # lvm repeats it for every channel
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
    """Return the last date in a header line, after a colon or the words that CETR's viewer uses."""
    for line in reversed(header):
        for text in (line.partition(":")[2], re.sub(r"^[A-Za-z ]*\b(?:date|at)\b:?\s*", "", line)):
            started = parse_time(text.strip())
            if started is not None:
                return started
    return None
