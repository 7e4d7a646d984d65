"""Figures that were measured stand in tables, those of a benchmark in its csv: prose tells what
they mean.
"""

import re
from collections.abc import Iterator
from importlib.util import module_from_spec, spec_from_file_location

import pytest
from benchmarks import gallery, kept
from test_prose import paragraphs, sentences

from support.pages import SPAN, Line, Page, pages, read
from support.source import ROOT

MOST = 2  # in a paragraph
MADE = "docs/benchmarks.md"  # by the benchmarks
DATED = "docs/decisions.md"  # a record of what was known at its date, times of a clock included
NUMBER = r"(?<![\w.^])\d[\d.]*(?:e-?\d+)?"
SIZES = r"(?:s|ms|minutes|min|hours|MB|MiB|GB|GiB)\b"
FIGURE = re.compile(
    rf"{NUMBER}[\s ]?(?:%|{SIZES}|times\b|points?\b|dB\b)|\b\d+ of \d+\b|\b\d+ (?:and|to|or) \d+ %"
)
CLOCKED = re.compile(rf"{NUMBER}[\s ]?{SIZES}")
BY_A_CLOCK = re.compile(
    r"(?i)\b(?:takes?|took|taken|costs?|median|medians|slowest|longest|processor|by the clock)\b"
)
OF_TIME = re.compile(r"\[(?:s|ms)\]|\b(?:seconds|processor time)\b")
FILE = re.compile(r"^:file: (\S+)$", re.MULTILINE)
TELLING = 3  # numbers of a row


def plain(text: str) -> str:
    """Without links, code and formulas."""
    return re.sub(r"\$[^$]*\$", "$", SPAN.sub("`", re.sub(r"\]\([^)]*\)", "]", text)))


def crowded(page: Page) -> list[str]:
    """Paragraphs with more figures than are read as a sentence."""
    found = ((number, text, FIGURE.findall(plain(text))) for number, text in paragraphs(page))
    return [
        f"{number}: {figures}: {text}" for number, text, figures in found if len(figures) > MOST
    ]


def clocked(page: Page) -> list[str]:
    """Sentences that say how long or how much something took, and tables typed by hand that do."""
    told = [
        f"{number}: {sentence}"
        for number, text in paragraphs(page)
        for sentence in sentences(plain(text))
        if CLOCKED.search(sentence) and BY_A_CLOCK.search(sentence)
    ]
    heads = [
        f"{line.number}: {line.text}" for line in heads_of_tables(page) if OF_TIME.search(line.text)
    ]
    rows = [
        f"{line.number}: {cell}"
        for line, cells in page.rows()
        for cell in map(plain, cells)
        if CLOCKED.search(cell) and BY_A_CLOCK.search(cell)
    ]
    return told + heads + rows


def heads_of_tables(page: Page) -> Iterator[Line]:
    for line, after in zip(page.prose, page.prose[1:], strict=False):
        if line.text.startswith("|") and after.text.startswith("|--"):
            yield line


def numbers(cells: list[str]) -> tuple[str, ...]:
    """Those of a row, if it has enough to tell it from others: none and all of something is no
    figure.
    """
    found = tuple(kept.NUMBER.findall(" ".join(cells)))
    return (
        found
        if len({number for number in found if float(number.replace("−", "-")) not in (0.0, 100.0)})
        >= TELLING
        else ()
    )


def rows_of_benchmarks() -> set[tuple[str, ...]]:
    return {numbers(row) for path in kept.FOLDER.glob("*.csv") for row in kept.read(path)[1:]} - {
        ()
    }


def typed(page: Page) -> list[str]:
    """Tables by hand of which more than half stands in the csv of benchmarks, by their heads."""
    rows = rows_of_benchmarks()
    heads = {line.number for line in heads_of_tables(page)}
    tables: dict[str, list[bool]] = {}
    head = ""
    for line, cells in page.rows():
        if line.number in heads:
            head = f"{line.number}: {line.text}"
        elif numbers(cells):
            tables.setdefault(head, []).append(numbers(cells) in rows)
    return [head for head, found in tables.items() if 2 * sum(found) > len(found)]


WRITTEN = [page for page in pages() if page.path.relative_to(ROOT).as_posix() != MADE]
PAGES = pytest.mark.parametrize(
    "page", WRITTEN, ids=lambda page: page.path.relative_to(ROOT).as_posix()
)


@PAGES
def test_a_paragraph_holds_few_figures(page):
    wrong = crowded(page)
    assert not wrong, "a table holds them better: " + "\n".join(wrong)


@PAGES
def test_what_a_clock_found_stands_where_the_benchmark_writes_it(page):
    wrong = clocked(page) if page.path.relative_to(ROOT).as_posix() != DATED else []
    assert not wrong, "include or link the csv of a part of `make bench`: " + "\n".join(wrong)


@PAGES
def test_no_table_of_a_benchmark_is_typed(page):
    wrong = typed(page)
    assert not wrong, "include the csv: " + "\n".join(wrong)


def test_csv_that_pages_include_are_there():
    files = [
        (page, file)
        for page in pages()
        for block in page.blocks
        if block.language == "{csv-table}"
        for file in FILE.findall(block.text)
    ]
    assert len(files) > 30
    stages = {
        "../benchmark/certified.csv": ROOT / "benchmark" / "certified.csv"
    }  # staged beside the pages
    gone = [
        (page.path, file)
        for page, file in files
        if not stages.get(file, page.path.parent / file).is_file()
    ]
    assert gone == []


TOLD = {
    "Of 45 a few, 12 %, 3 to 5 % and 7 %.": (1, 0),
    "12 %, 3 times.": (0, 0),
    "It takes 3 s.": (0, 1),
    "It lasts 3 s.": (0, 0),
    "| cells | time [s] |\n|---|---|\n| 1 | 2 |": (0, 1),
    "| what | found |\n|---|---|\n| solved | median 0.3 s |": (0, 1),
    "3 of 4, 5 of 6 and `7 of 8`.": (0, 0),
    "3 of 4. 5 of 6. 7 of 8.": (1, 0),
    "Slowest: 3 s, 2 MB and 4 %.": (1, 1),
}


@pytest.mark.parametrize(("text", "counts"), TOLD.items())
def test_what_is_told(text, counts):
    page = Page(ROOT / "page.md", f"{text}\n")
    assert (len(crowded(page)), len(clocked(page))) == counts


def test_a_typed_table_is_seen():
    head, *rows = kept.read(kept.FOLDER / "rollers.csv")
    lines = [f"| {' | '.join(row)} |" for row in (head, *rows[:4])]
    lines.insert(1, "|---|")
    assert len(typed(Page(ROOT / "page.md", "\n".join(lines)))) == 1
    others = [line.replace("1.", "9.") for line in lines[2:]]
    assert typed(Page(ROOT / "page.md", "\n".join([*lines, *others]))) == []


def test_the_pages_apart_are_needed():
    assert clocked(read(ROOT / DATED))
    assert crowded(read(ROOT / MADE))


def test_the_benchmarks_figure_is_drawn_from_its_csv(tmp_path):
    """Of the csv as it is, and of one with another number in it."""
    script = spec_from_file_location("draw_benchmark", ROOT / "docs" / "draw_benchmark.py")
    module = module_from_spec(script)
    script.loader.exec_module(module)
    head, *rows = kept.read(module.TABLE)
    (axes,) = module.figure().axes
    drawn = {line.get_label(): line.get_ydata() for line in axes.lines}
    of = [head.index(name) for name in ("solver", "cases", "median error [%]")]
    assert sum(len(errors) for errors in drawn.values()) == len(rows)
    for solver, family, error in ([row[column] for column in of] for row in rows):
        assert float(error) in drawn[f"{family}, {solver}"]
    rows[0][of[2]] = "0.0123"
    other = tmp_path / "certified.csv"
    other.write_text("\n".join(",".join(row) for row in (head, *rows)), "utf-8")
    (axes,) = module.figure(other).axes
    assert 0.0123 in axes.lines[0].get_ydata()


def test_every_script_of_the_gallery_was_timed_and_is_short():
    _, *rows = kept.read(kept.FOLDER / "gallery.csv")
    assert [name for name, _ in rows] == sorted(
        path.name for path in gallery.SCRIPTS.glob("[0-9]*.py")
    )
    assert len(rows) >= 15
    assert max(float(seconds) for _, seconds in rows) < gallery.MOST
