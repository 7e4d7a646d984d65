"""Figures quoted on the question pages: each is listed with its test or csv file."""

import ast
import csv
import re

import pytest
from benchmarks.kept import read

from support.source import ROOT, functions, parsed

FOLDER = ROOT / "docs" / "questions"
with (FOLDER / "figures.csv").open(encoding="utf-8", newline="") as _file:
    FIGURES = list(csv.DictReader(_file))
MEASURED = re.compile(r"\d[\d.]* ?%|\b\d+e-\d+|\b\d+ of \d+|\b[\d.]+ times|\b\d+ smooth")
PLAIN = re.compile(r"^```.*?^```|`[^`]*`", re.MULTILINE | re.DOTALL)


@pytest.mark.parametrize(
    "page", sorted(path.stem for path in FOLDER.glob("*.md") if path.stem != "index")
)
def test_every_figure_of_a_page_is_listed(page):
    text = PLAIN.sub("", (FOLDER / f"{page}.md").read_text("utf-8"))
    listed = [row["number"] for row in FIGURES if row["page"] == page]
    for figure in MEASURED.findall(text):
        assert any(figure in entry for entry in listed), (
            f"{page}.md says {figure!r}; name in figures.csv what holds it"
        )


@pytest.mark.parametrize("row", FIGURES, ids=lambda row: f"{row['page']}: {row['number']}")
def test_every_listed_figure_is_on_its_page_and_in_its_source(row):
    assert row["number"] in (FOLDER / f"{row['page']}.md").read_text("utf-8")
    file, _, name = row["source"].partition("::")
    assert (ROOT / file).is_file()
    if file.endswith(".py"):
        assert name in {function.name for function in functions(parsed(ROOT / file))}


def test_the_named_profiles_have_the_lowest_peaks():
    head, *rows = read(ROOT / "docs" / "benchmarks" / "rollers.csv")
    level, tilted = head.index("0 mrad"), head.index("0.5 mrad")
    assert min(rows, key=lambda row: float(row[level]))[0] == "1.2"
    assert min(rows, key=lambda row: float(row[tilted]))[0] == "3"


def test_the_quoted_number_of_solved_films_is_37():
    tree = parsed(ROOT / "tests" / "validation" / "test_auto_grid.py")
    (films,) = (
        node.value
        for node in tree.body
        if isinstance(node, ast.Assign) and node.targets[0].id == "FILMS"
    )
    assert (
        sum(error is not None for *_, errors in ast.literal_eval(films) for error in errors) == 37
    )
