"""Lines and tables within the width of the terminal."""

import os
import re
import shutil
import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from textwrap import wrap

NARROWEST = 40  # characters of a line, below which lines are not wrapped further
TITLE = 12  # characters of a column's title, above which it is wrapped
SENTENCE = 24  # characters of the longest cell, above which the last column holds sentences
UNIT = re.compile(r"(?<=\d) (?=(?:%|[kMGnµm]?(?:Pa|Hz|N|m|W|s|g|K)|K|°C|half-widths)\b|%)")
COMMAND = re.compile(r"\s*(?:Try|try) next:?\s+(?=asperity )")
GAP = 2  # spaces before a line and between columns


def terminal_width() -> int | None:
    """Return the characters per line of the terminal, or as in COLUMNS; None without either."""
    if not (os.environ.get("COLUMNS", "").isdecimal() or sys.stdout.isatty()):
        return None
    return max(NARROWEST, shutil.get_terminal_size().columns)


def fitted(line: str, width: int | None) -> list[str]:
    """Return a line in parts of at most `width` characters; words are not broken.

    Further parts are indented as the second column of a row, otherwise below the first word. A
    suggested command is continued with a backslash, so that it can be copied.
    """
    if width is None or len(line) <= width:
        return [line]
    prefix = COMMAND.match(line)
    if prefix is not None:
        indent = " " * 4
        command = _parts(line[prefix.end() :], width - 2 - len(indent))
        first = line[: prefix.end()].rstrip()
        return [first, *(f"{indent}{part} \\" for part in command[:-1]), indent + command[-1]]
    margin = len(line) - len(line.lstrip())
    row = re.match(r" *\S.*?\S?  +(?=\S)", line)
    hanging = margin if margin == 0 else margin + 2
    if row is not None and row.end() <= width - NARROWEST // 2:
        head, hanging = line[: row.end()], row.end()
    else:
        head = line[:margin]
    indent = " " * hanging
    first, *rest = _parts(line[len(head) :], width - len(head), width - hanging)
    return [head + first, *(indent + part for part in rest)]


def _parts(text: str, width: int, further: int | None = None) -> list[str]:
    """Split a text at spaces; `further` is the width of all parts but the first."""
    further = width if further is None else further
    widest = max(width, further)
    parts = wrap(
        "\0" * (widest - width) + UNIT.sub("\1", text),  # a number stays with its unit
        widest,
        subsequent_indent="\0" * (widest - further),
        break_long_words=False,
        break_on_hyphens=False,
    )
    return [part.replace("\0", "").replace("\1", " ") for part in parts]


@dataclass(frozen=True)
class Column:
    """A column of a table: lines of its title, cells, width and alignment."""

    title: str
    cells: list[str]
    width: int
    flush_left: bool

    def heading(self) -> list[str]:
        """Return the lines of the title."""
        return _heading(self.title, max(TITLE, self.width))

    def lines(self, text: Sequence[str], height: int, *, bottom: bool = False) -> list[str]:
        """Return lines of a cell or title, aligned and filled to a height."""
        blank = [""] * (height - len(text))
        filled = [*blank, *text] if bottom else [*text, *blank]
        align = str.ljust if self.flush_left else str.rjust
        return [align(line, self.width) for line in filled]

    def narrowed(self, width: int) -> "Column":
        """Return the column with its cells wrapped to a width."""
        return Column(self.title, self.cells, min(width, self.width), self.flush_left)

    def cell(self, number: int) -> list[str]:
        """Return the lines of a cell."""
        return wrap(self.cells[number], self.width) or [""]


def layout(
    titles: Sequence[str], rows: Sequence[Sequence[str]], *, left: int, width: int | None
) -> Iterator[str]:
    """Yield the lines of a table; the first `left` columns and untitled ones are flush left.

    A table wider than `width` is split into several, each with the flush left columns.
    """
    made = [
        _column(title, [row[number] for row in rows], number < left)
        for number, title in enumerate(titles)
    ]
    if len(made) > 1 and made[-1].width > SENTENCE:
        made[-1] = Column(made[-1].title, made[-1].cells, made[-1].width, flush_left=True)
    for number, part in enumerate(_split(made, max(left, 1), width)):
        if number:
            yield ""
        yield from _table(part, len(rows))


def _heading(title: str, width: int) -> list[str]:
    """Return the lines of a title; a number stays with its unit."""
    lines = wrap(UNIT.sub("\1", title), width, break_on_hyphens=True)
    return [line.replace("\1", " ") for line in lines]


def _column(title: str, cells: list[str], flush_left: bool) -> Column:
    width = max(map(len, cells), default=1)
    heading = _heading(title, max(TITLE, width))
    return Column(title, cells, max(width, *map(len, heading), 1), flush_left or not title)


def _split(made: list[Column], left: int, width: int | None) -> Iterator[list[Column]]:
    """Yield the columns of each part; the last column gets the remaining width."""
    if width is None or _total(made) <= width:
        yield made
        return
    share = (width - 2 * GAP) // (left + 1) - GAP
    names = [column.narrowed(max(share, TITLE)) for column in made[:left]]
    rest = made[left:]
    part: list[Column] = []
    for column in rest:
        room = width - _total([*names, *part]) - GAP
        narrow = column.narrowed(room) if column is rest[-1] and column.flush_left else column
        if part and (narrow.width > room or room < min(column.width, SENTENCE)):
            yield [*names, *part]
            part, narrow = [], column.narrowed(width - _total(names) - GAP)
        part.append(narrow)
    yield [*names, *part]


def _total(columns: Sequence[Column]) -> int:
    return sum(column.width + GAP for column in columns)


def _table(columns: Sequence[Column], rows: int) -> Iterator[str]:
    """Yield heading and rows of columns side by side."""
    headings = [column.heading() for column in columns]
    yield from _side_by_side(columns, headings, bottom=True)
    for number in range(rows):
        yield from _side_by_side(columns, [column.cell(number) for column in columns])


def _side_by_side(
    columns: Sequence[Column], texts: Sequence[Sequence[str]], *, bottom: bool = False
) -> Iterator[str]:
    height = max(map(len, texts))
    stacked = (
        column.lines(text, height, bottom=bottom)
        for column, text in zip(columns, texts, strict=True)
    )
    for line in zip(*stacked, strict=True):
        yield f"{' ' * GAP}{(' ' * GAP).join(line)}".rstrip()
