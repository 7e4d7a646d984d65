"""What benchmarks keep: csv that the page includes, and what changed since."""

import importlib

import pytest
from benchmarks import kept
from benchmarks.__main__ import PARTS, TIMES, WHOLE
from benchmarks.unfinished import Unfinished

LINES = [
    "## Cost\n",
    "| cells | time [s] |",
    "|---|---|",
    "| 256 | 0.50 |",
    "| 512 | 2.0 ± 0.1 |",
    "",
    "Median 0.48 s.",
]


def test_lines_come_back_as_a_page(tmp_path):
    assert kept.keep("cost", LINES, tmp_path) == ["cost.csv: new", "cost-said.csv: new"]
    assert (tmp_path / "cost.csv").read_text("utf-8") == "cells,time [s]\n256,0.50\n512,2.0 ± 0.1\n"
    page = kept.page(tmp_path, ["absent", "cost"])
    assert "\n\n## Cost\n\n| cells | time [s] |\n| --- | --- |\n| 256 | 0.50 |\n| 512 | 2.0 ± 0.1 |\n\nMedian" in page


def test_two_tables_have_a_file_each_and_one_that_is_gone_leaves_none(tmp_path):
    kept.keep("cost", [*LINES, "| a |", "|---|", "| 1 |"], tmp_path)
    assert kept.read(tmp_path / "cost-2.csv") == [["a"], ["1"]]
    kept.keep("cost", LINES, tmp_path)
    assert not (tmp_path / "cost-2.csv").exists()


@pytest.mark.parametrize(
    ("old", "new", "told"),
    [
        ("| 256 | 0.50 |", "| 256 | 0.54 |", []),
        ("| 256 | 0.50 |", "| 256 | 0.60 |", ["cost.csv: 256, time [s]: 0.50 is now 0.60"]),
        ("2.0 ± 0.1", "2.0 ± 0.2", ["cost.csv: 512, time [s]: 0.1 is now 0.2"]),
        ("0.50", "failed", ["cost.csv: 256, time [s]: '0.50' is now 'failed'"]),
        ("Median 0.48 s.", "Median 0.96 s.", ["cost-said.csv: Median 0.96 s., said: 0.48 is now 0.96"]),
        ("| 256 | 0.50 |\n", "", ["cost.csv: 2 rows are now 1, 1 of them as before"]),
        (
            "| 256 | 0.50 |\n| 512 | 2.0 ± 0.1 |",
            "| 512 | 3.0 ± 0.1 |",
            ["cost.csv: 2 rows are now 1, 1 of them as before", "cost.csv: 512, time [s]: 2.0 is now 3.0"],
        ),
        ("| 512 | 2.0 ± 0.1 |", "| 512 | 2.0 | 0.1 |", ["cost.csv: has another shape"]),
        ("\nMedian 0.48 s.", "", ["cost-said.csv: has another shape"]),
    ],
)
def test_what_moved_by_more_than_a_tenth_is_told(tmp_path, old, new, told):
    text = "\n".join(LINES)
    assert old in text
    kept.keep("cost", text.splitlines(), tmp_path)
    assert kept.keep("cost", text.replace(old, new).splitlines(), tmp_path) == told


def test_the_page_of_the_docs_includes_the_files_as_they_are():
    assert kept.PAGE.read_text("utf-8") == kept.page(parts=(*PARTS, TIMES))


def test_a_run_that_was_cut_off_goes_on_after_the_parts_that_ended(tmp_path):
    where = {"whole": False, "file": tmp_path / "build" / "run.json"}
    run = Unfinished.of(["one", "two", "three"], afresh=False, **where)
    run.end("two", 3.5, "", ["two.csv: new"])
    again = Unfinished.of(["one", "two", "three"], afresh=False, **where)
    assert again.left == ["one", "three"]
    assert again.began == run.began
    assert again.done == {"two": (3.5, "", ["two.csv: new"])}
    assert Unfinished.of(["one", "two", "three"], afresh=True, **where).left == ["one", "two", "three"]
    assert Unfinished.of(["one", "two"], afresh=False, **where).left == ["one", "two"]
    assert Unfinished.of(["one", "two", "three"], afresh=False, **(where | {"whole": True})).done == {}
    again.forget()
    assert Unfinished.of(["one", "two", "three"], afresh=False, **where).done == {}


def test_every_part_is_one_that_can_be_run():
    assert len(set(PARTS)) == len(PARTS)
    assert set(WHOLE) < set(PARTS)
    assert all(callable(importlib.import_module(f"benchmarks.{part}").lines) for part in PARTS)
