"""Benchmark results: csv files included in the page, and reported changes."""

import csv
import importlib
from functools import partial
from types import SimpleNamespace

import pytest
from benchmarks import __main__ as bench_main
from benchmarks import chosen_grids, controls, forecast, kept, next_points, unfinished
from benchmarks.__main__ import PARTS, TIMES, WHOLE
from benchmarks.rows import Rows
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


def test_stored_lines_are_rendered_as_a_page(tmp_path):
    assert kept.keep("cost", LINES, tmp_path) == ["cost.csv: new", "cost-text.csv: new"]
    assert (tmp_path / "cost.csv").read_text("utf-8") == "cells,time [s]\n256,0.50\n512,2.0 ± 0.1\n"
    page = kept.page(tmp_path, ["absent", "cost"])
    assert (
        "\n\n## Cost\n\n| cells | time [s] |\n| --- | --- |\n| 256 | 0.50 |\n| 512 | 2.0 ± 0.1"
        " |\n\nMedian" in page
    )


def test_an_empty_line_separates_two_tables(tmp_path):
    kept.keep(
        "cost",
        [*LINES[:5], "", "| what | first | second |", "|---|---|---|", "| a | 1 | 2 |", ""],
        tmp_path,
    )
    assert kept.read(tmp_path / "cost.csv")[-1] == ["512", "2.0 ± 0.1"]
    assert kept.read(tmp_path / "cost-2.csv") == [["what", "first", "second"], ["a", "1", "2"]]


def test_each_table_has_a_file_and_a_removed_table_has_none(tmp_path):
    kept.keep("cost", [*LINES, "| a |", "|---|", "| 1 |"], tmp_path)
    assert kept.read(tmp_path / "cost-2.csv") == [["a"], ["1"]]
    kept.keep("cost", LINES, tmp_path)
    assert not (tmp_path / "cost-2.csv").exists()


@pytest.mark.parametrize(
    ("old", "new", "reported"),
    [
        ("| 256 | 0.50 |", "| 256 | 0.54 |", []),
        ("| 256 | 0.50 |", "| 256 | 0.60 |", ["cost.csv: 256, time [s]: 0.50 is now 0.60"]),
        ("2.0 ± 0.1", "2.0 ± 0.2", ["cost.csv: 512, time [s]: 0.1 is now 0.2"]),
        ("0.50", "failed", ["cost.csv: 256, time [s]: '0.50' is now 'failed'"]),
        (
            "Median 0.48 s.",
            "Median 0.96 s.",
            ["cost-text.csv: Median 0.96 s., text: 0.48 is now 0.96"],
        ),
        ("| 256 | 0.50 |\n", "", ["cost.csv: 2 rows are now 1, 1 of them as before"]),
        (
            "| 256 | 0.50 |\n| 512 | 2.0 ± 0.1 |",
            "| 512 | 3.0 ± 0.1 |",
            [
                "cost.csv: 2 rows are now 1, 1 of them as before",
                "cost.csv: 512, time [s]: 2.0 is now 3.0",
            ],
        ),
        ("| 512 | 2.0 ± 0.1 |", "| 512 | 2.0 | 0.1 |", ["cost.csv: has another shape"]),
        ("\nMedian 0.48 s.", "", ["cost-text.csv: has another shape"]),
    ],
)
def test_changes_above_ten_per_cent_are_reported(tmp_path, old, new, reported):
    text = "\n".join(LINES)
    assert old in text
    kept.keep("cost", text.splitlines(), tmp_path)
    assert kept.keep("cost", text.replace(old, new).splitlines(), tmp_path) == reported


@pytest.mark.parametrize(
    ("stored", "current", "replaced"),
    [
        ("Sample: 52 machines.", "Sample: 6 machines.", False),
        ("Sample: 52 machines.", "Sample: 53 machines.", True),
        (kept.IN_FULL, kept.IN_SHORT, False),
        (kept.IN_SHORT, kept.IN_FULL, True),
        (kept.IN_SHORT, kept.IN_SHORT, True),
        (kept.IN_FULL, kept.IN_FULL, True),
        ("", kept.IN_SHORT, True),
    ],
)
def test_a_smaller_sample_is_compared_but_not_stored(tmp_path, stored, current, replaced):
    kept.keep("cost", [*LINES, "", "| a |", "|---|", "| 1 |", stored], tmp_path)
    files = {path.name: path.read_text("utf-8") for path in tmp_path.iterdir()}
    reported = kept.keep(
        "cost", [*"\n".join(LINES).replace("0.50", "0.60").splitlines(), current], tmp_path
    )
    assert "cost.csv: 256, time [s]: 0.50 is now 0.60" in reported
    assert replaced == (
        {path.name: path.read_text("utf-8") for path in tmp_path.iterdir()} != files
    )
    assert (tmp_path / "cost-2.csv").exists() != replaced
    assert reported[0].startswith("cost: stays as it was; ") != replaced


def test_the_docs_page_includes_the_current_files():
    assert kept.PAGE.read_text("utf-8") == kept.page(parts=(*PARTS, TIMES))


def test_an_interrupted_run_resumes_after_its_completed_parts(tmp_path):
    options = {"whole": False, "file": tmp_path / "build" / "run.json"}
    run = Unfinished.of(["one", "two", "three"], afresh=False, **options)
    run.end("two", 3.5, "", ["two.csv: new"])
    again = Unfinished.of(["one", "two", "three"], afresh=False, **options)
    assert again.left == ["one", "three"]
    assert again.began == run.began
    assert again.done == {"two": (3.5, "", ["two.csv: new"])}
    assert Unfinished.of(["one", "two", "three"], afresh=True, **options).left == [
        "one",
        "two",
        "three",
    ]
    assert Unfinished.of(["one", "two"], afresh=False, **options).left == ["one", "two"]
    assert (
        Unfinished.of(["one", "two", "three"], afresh=False, **(options | {"whole": True})).done
        == {}
    )
    again.forget()
    assert Unfinished.of(["one", "two", "three"], afresh=False, **options).done == {}


@pytest.mark.parametrize(
    ("output", "whole", "last"),
    [
        (["| 1 |"], True, kept.IN_FULL),
        (["| 1 |"], False, kept.IN_SHORT),
        (["Sample: 7 rings.", "| 1 |"], False, "| 1 |"),
    ],
)
def test_a_part_ends_with_its_sample_size(monkeypatch, output, whole, last):
    monkeypatch.setattr(
        importlib, "import_module", lambda _: SimpleNamespace(lines=lambda **_: iter(output))
    )
    assert list(bench_main._printed_lines("intervals", whole=whole, seconds=1.0))[-1] == last
    assert kept.sample(bench_main._printed_lines("certified", whole=whole, seconds=1.0)) == (
        7.0 if len(output) > 1 else 0.0
    )


def test_a_part_without_rows_reports_an_empty_sample(tmp_path, monkeypatch):
    for part in (forecast, next_points):
        monkeypatch.setattr(part, "ROWS", tmp_path / "none.csv")
        assert any(line.startswith("Sample: 0 ") for line in part.tables())


def test_solved_contacts_are_stored_and_resumed(tmp_path, monkeypatch):
    solved = []

    def solve(sample, _model, _most, finer):
        solved.append((sample, finer))
        return chosen_grids.Outcome((8, 8), True, 0.1, 0.5, (0.4, 0.6), True)

    monkeypatch.setattr(chosen_grids, "KEPT", tmp_path)
    monkeypatch.setattr(chosen_grids, "solved", solve)
    assert list(chosen_grids.kept_pairs({10: "late", 9: "early"}, float("inf"))) == [9, 10]
    pairs = chosen_grids.kept_pairs({9: "early", 11: "later"}, float("-inf"))
    assert solved == [(name, finer) for name in ("late", "early") for finer in (1.0, 1.5)]
    assert list(pairs) == [9, 10]
    assert "2 of 2 solved on the automatic grid, median 0.1 s" in chosen_grids.summary(
        list(pairs.values())
    )


def test_results_of_other_code_are_not_resumed(tmp_path, monkeypatch):
    monkeypatch.setattr(unfinished, "PACKAGE", tmp_path)
    (tmp_path / "room").mkdir()
    for path in ("room/first.py", "room/second.py", "alone.py"):
        (tmp_path / path).write_text(path)
    before = {
        names: unfinished.stamp(*names)
        for names in (("room", "alone"), ("room",), ("room/second",), ("alone",))
    }
    (tmp_path / "room" / "second.py").write_text("another")
    changed = {names: unfinished.stamp(*names) != stamp for names, stamp in before.items()}
    assert changed == {
        ("room", "alone"): True,
        ("room",): True,
        ("room/second",): True,
        ("alone",): False,
    }


def test_every_part_can_be_run():
    assert len(set(PARTS)) == len(PARTS)
    assert set(WHOLE) < set(PARTS)
    assert all(callable(importlib.import_module(f"benchmarks.{part}").lines) for part in PARTS)


def test_each_constant_of_the_search_has_a_row_with_its_present_value():
    """Most rows show more work or an unsolved contact; changes of few constants show nothing."""
    constants = controls.constants()
    assert controls.ROWS.keys() == constants.keys()
    with (kept.FOLDER / "controls.csv").open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    assert {row["constant"]: row["value"] for row in rows} == {
        name: f"{value:g}" for name, value in constants.items()
    }

    def work(text):
        return [float("inf")] if text == "not solved" else [int(count) for count in text.split("/")]

    dearer = [
        row["constant"]
        for row in rows
        if max(work(row["steps with the change"])) > 1.04 * max(work(row["steps"]))
    ]
    assert len(dearer) > 0.8 * len(rows)


def test_a_changed_constant_is_restored():
    before = controls.constants()
    with controls.changed("Meniscus.front", 40.0):
        assert controls.constants() == before | {"Meniscus.front": 40.0}
    assert controls.constants() == before


@pytest.fixture
def bench(tmp_path, monkeypatch, capsys):
    """Run the command on two sequential and two parallel dummy parts; return its output and exit
    code.
    """
    calls: list[str] = []
    failures: dict[str, str] = {}

    def run(part, *, whole, **_):
        calls.append(f"{part} {whole}")
        return "| cells |\n|---|\n| 1 |", failures.get(part, "")

    monkeypatch.setattr(bench_main, "ALONE", ("a", "b"))
    monkeypatch.setattr(bench_main, "ABREAST", (("c", "d"),))
    monkeypatch.setattr(bench_main, "PARTS", ("a", "b", "c", "d"))
    monkeypatch.setattr(bench_main, "_run", run)
    monkeypatch.setattr(unfinished, "FILE", tmp_path / "run.json")
    monkeypatch.setattr(kept, "PAGE", tmp_path / "benchmarks.md")
    monkeypatch.setattr(kept, "keep", partial(kept.keep, folder=tmp_path))

    def command(*arguments):
        monkeypatch.setattr("sys.argv", ["benchmarks", *arguments])
        with pytest.raises(SystemExit) as end:
            bench_main.main()
        return capsys.readouterr().out, end.value.code

    return command, calls, failures


def test_all_parts_run_once_and_the_next_run_starts_afresh(bench):
    command, calls, _ = bench
    printed, code = command()
    assert (calls, code) == (["a False", "b False", "c False", "d False"], 0)
    assert "a.csv: new" in printed
    printed, _ = command("--whole")
    assert calls[4:] == ["a True", "b True", "c True", "d True"]
    assert "a.csv" not in printed  # unchanged since the last run


def test_running_out_of_time_reports_the_remaining_parts(bench, monkeypatch):
    command, calls, _ = bench
    clock = iter([0.0, 0.0, 1.0, *[1e6] * 9])  # the time is used up after the first part
    monkeypatch.setattr(bench_main, "perf_counter", lambda: next(clock))
    printed, code = command("--minutes", "1")
    assert (calls, code) == (["a False"], 1)
    assert "Out of time before b, c, d" in printed


def test_a_failed_part_is_reported_and_the_others_run(bench):
    command, calls, failures = bench
    failures["b"] = "failed with exit code 1"
    printed, code = command()
    assert (len(calls), code) == (4, 1)
    assert "| b | 0 | failed with exit code 1 |" in printed
    assert "b.csv" not in printed


def test_selected_parts_leave_an_interrupted_run_unchanged(bench):
    command, calls, _ = bench
    unfinished.FILE.write_text(
        '{"parts": ["a", "b", "c", "d"], "whole": false, "began": "then", "done": {}}'
    )
    command("d")
    assert calls == ["d False"]
    run = Unfinished.of(["a", "b", "c", "d"], whole=False, afresh=False, file=unfinished.FILE)
    assert run.began == "then"
    run.end("a", 2.0, "", [])
    printed, _ = command()
    assert calls[1:] == ["b False", "c False", "d False"]
    assert "Going on with the run of then, after a" in printed
    assert "| a | 2 | measured |" in printed


def test_rows_of_several_runs_accumulate_with_their_code_version(tmp_path):
    path = tmp_path / "machines.csv"
    first = Rows(path, ("machine", "law"))
    first.code = "abc"
    assert (1, "own") not in first
    first.write(
        [{"machine": 1, "law": "own", "clr": 0.123456}, {"machine": 1, "law": "other", "clr": ""}]
    )
    again = Rows(path, ("machine", "law"))
    again.code = "def+"
    assert (1, "own") in again
    assert (1, "other") in first
    again.write([{"machine": 2, "law": "own", "clr": 12345678.0}])
    assert (
        path.read_text("utf-8")
        == "code,machine,law,clr\nabc,1,own,0.1235\nabc,1,other,\ndef+,2,own,1.235e+07\n"
    )
    assert Rows(path, ("machine", "law")).codes() == "abc (2), def+ (1)"


def test_stored_rows_produce_the_tables():
    from benchmarks.inference import ROWS, tables

    lines = list(tables())
    rows = list(Rows(ROWS, ("machine", "law")))
    assert lines[-1].startswith(
        f"{len({row['machine'] for row in rows})} machines with 12 surfaces"
    )
    table_rows = [line for line in lines if line.startswith("| emulator grid | 6 |")]
    complete_rows = [
        row
        for row in rows
        if (row["law"], row["points"]) == ("emulator grid", "6") and row["clr_true"]
    ]
    assert f"| {len(complete_rows)} |" in table_rows[0]
