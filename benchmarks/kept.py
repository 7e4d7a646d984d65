"""Store benchmark output as csv for `docs/benchmarks.md`, and report changes of its numbers.

The tables of a part go to docs/benchmarks/PART.csv, PART-2.csv ..., its headings and sentences to
PART-text.csv, with references to the tables. Results of a larger sample are not replaced; a smaller
one is only compared with them.
"""

import csv
import re
from collections.abc import Iterable, Iterator
from pathlib import Path

DOCS = Path(__file__).parents[1] / "docs"
FOLDER, PAGE = DOCS / "benchmarks", DOCS / "benchmarks.md"
CHANGED = 0.1  # relative threshold of reported changes; smaller ones are noise of a shared machine
IN_FULL, IN_SHORT = (
    "Full sample.",
    "Reduced sample; `python -m benchmarks --whole` uses the full one.",
)
SAMPLE = re.compile(r"Sample: (\d+) ")  # line of a part that uses all its time
NUMBER = re.compile(r"(?<![\w.])[-−]?\d+(?:\.\d+)?(?:e[+-]?\d+)?")

Table = list[list[str]]


def split_lines(lines: Iterable[str]) -> tuple[list[str], list[Table]]:
    """Split Markdown lines into sentences (a table is its number in braces) and tables."""
    sentences: list[str] = []
    tables: list[Table] = []
    within = False  # inside a table; any other line ends it, also an empty one
    for line in (line for text in lines for line in text.splitlines() or [""]):
        if not line.startswith("|"):
            sentences += [line] if line.strip() else []
            within = False
        elif within:
            tables[-1].append(cells(line))
        else:
            tables.append([cells(line)])
            sentences.append(f"{{{len(tables)}}}")
            within = True
    return sentences, [
        [row for row in table if not all(set(cell) <= set("-: ") for cell in row)]
        for table in tables
    ]


def cells(line: str) -> list[str]:
    """Return the cells of a row."""
    return [cell.strip() for cell in line.strip().strip("|").split("|")]


def keep(part: str, lines: Iterable[str], folder: Path = FOLDER) -> list[str]:
    """Store a part's csv unless the stored sample is larger; return one line per change."""
    sentences, tables = split_lines(lines)
    before = {path.name: read(path) for path in _files(part, folder)}
    now = {_name(part, number): table for number, table in enumerate(tables, 1)}
    have, had = (
        sample(sentences),
        sample([text for row in before.get(f"{part}-text.csv", []) for text in row]),
    )
    if have < had:
        return [
            f"{part}: stays as it was; {_in_words(have)} is compared with {_in_words(had)}",
            *(
                line
                for name in now
                if name in before
                for line in changes(name, before[name], now[name])
            ),
        ]
    now[f"{part}-text.csv"] = [["text"], *([text] for text in sentences)]
    folder.mkdir(parents=True, exist_ok=True)
    for name in before.keys() - now.keys():
        (folder / name).unlink()
    for name, table in now.items():
        with (folder / name).open("w", encoding="utf-8", newline="") as file:
            csv.writer(file, lineterminator="\n").writerows(table)
    return [line for name in now for line in changes(name, before.get(name), now[name])]


def sample(sentences: Iterable[str]) -> float:
    """Return the sample size that a part states; 0 for a short run or none stated."""
    sizes = [
        (
            float("inf")
            if text == IN_FULL
            else float(found[1])
            if (found := SAMPLE.match(text))
            else 0.0
        )
        for text in sentences
    ]
    return max(sizes, default=0.0)


def _in_words(size: float) -> str:
    return (
        "the full sample"
        if size == float("inf")
        else f"a sample of {size:.0f}"
        if size
        else "a reduced sample"
    )


def changes(name: str, before: Table | None, now: Table) -> Iterator[str]:
    """Yield numbers that changed by more than a tenth, with row and column names.

    If the rows differ, only rows in both tables are compared.
    """
    if before is None:
        yield f"{name}: new"
        return
    pairs = list(zip(before, now, strict=False))
    if len(before) != len(now) and len(now[0]) > 1:
        old_rows, rows = _by_name(before[1:], now[1:])
        pairs = [
            (before[0], now[0]),
            *((old_rows[key], rows[key]) for key in rows if key in old_rows),
        ]
        yield (
            f"{name}: {len(before) - 1} rows are now {len(now) - 1}, {len(pairs) - 1} of them as"
            " before"
        )
    elif len(before) != len(now):
        yield f"{name}: has another shape"
        return
    if any(len(old) != len(new) for old, new in pairs):
        yield f"{name}: has another shape"
        return
    for old_row, row in pairs[1:]:
        for head, old, new in zip(now[0], old_row, row, strict=True):
            numbers = zip(NUMBER.findall(old), NUMBER.findall(new), strict=False)
            moved = [
                f"{a} is now {b}"
                for a, b in numbers
                if _moved(*(float(n.replace("−", "-")) for n in (a, b)))
            ]
            if moved or NUMBER.sub("", old) != NUMBER.sub("", new):
                yield (
                    f"{name}: {row[0][:60]}, {head}:"
                    f" {'; '.join(moved) or f'{old[:60]!r} is now {new[:60]!r}'}"
                )


def _by_name(*tables: Table) -> list[dict[tuple[str, ...], list[str]]]:
    """Return rows keyed by as few leading cells as identify the rows of each table."""
    widths = range(1, max((len(row) for table in tables for row in table), default=1) + 1)
    for width in widths:
        named = [{tuple(row[:width]): row for row in table} for table in tables]
        if all(len(rows) == len(table) for rows, table in zip(named, tables, strict=True)):
            break
    return named


def _moved(old: float, new: float) -> bool:
    return abs(new - old) > CHANGED * max(abs(old), abs(new))


def page(folder: Path = FOLDER, parts: Iterable[str] = ()) -> str:
    """Return the page that includes every csv."""
    text = [
        "# Benchmarks",
        "",
        "`make bench` writes this page from the csv files in `docs/benchmarks`.",
        "Times are from a shared machine: compare ratios within a table.",
    ]
    for part in parts:
        if not (folder / f"{part}-text.csv").is_file():
            continue
        for (line,) in read(folder / f"{part}-text.csv")[1:]:
            number = re.fullmatch(r"\{(\d+)\}", line)
            if number:
                head, *rows = read(folder / _name(part, int(number[1])))
                text += ["", _row(head), _row(["---"] * len(head)), *map(_row, rows)]
            else:
                text += ["", line]
    return "\n".join(text) + "\n"


def read(path: Path) -> Table:
    """Return the rows of a csv file."""
    with path.open(encoding="utf-8", newline="") as file:
        return list(csv.reader(file))


def _row(cells: list[str]) -> str:
    return f"| {' | '.join(cells)} |"


def _name(part: str, number: int) -> str:
    return f"{part}.csv" if number == 1 else f"{part}-{number}.csv"


def _files(part: str, folder: Path) -> list[Path]:
    return [
        path
        for path in sorted(folder.glob("*.csv"))
        if re.fullmatch(rf"{part}(-text|-\d+)?\.csv", path.name)
    ]
