"""What benchmarks keep: csv that the page includes, and what changed since."""

import importlib
from functools import partial
from types import SimpleNamespace

import pytest
from benchmarks import __main__ as bench_main
from benchmarks import chosen_grids, forecast, kept, next_points, unfinished
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


def test_lines_come_back_as_a_page(tmp_path):
    assert kept.keep("cost", LINES, tmp_path) == ["cost.csv: new", "cost-said.csv: new"]
    assert (tmp_path / "cost.csv").read_text("utf-8") == "cells,time [s]\n256,0.50\n512,2.0 ± 0.1\n"
    page = kept.page(tmp_path, ["absent", "cost"])
    assert (
        "\n\n## Cost\n\n| cells | time [s] |\n| --- | --- |\n| 256 | 0.50 |\n| 512 | 2.0 ± 0.1"
        " |\n\nMedian" in page
    )


def test_a_line_of_nothing_parts_two_tables(tmp_path):
    kept.keep(
        "cost",
        [*LINES[:5], "", "| what | first | second |", "|---|---|---|", "| a | 1 | 2 |", ""],
        tmp_path,
    )
    assert kept.read(tmp_path / "cost.csv")[-1] == ["512", "2.0 ± 0.1"]
    assert kept.read(tmp_path / "cost-2.csv") == [["what", "first", "second"], ["a", "1", "2"]]


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
        (
            "Median 0.48 s.",
            "Median 0.96 s.",
            ["cost-said.csv: Median 0.96 s., said: 0.48 is now 0.96"],
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
        ("\nMedian 0.48 s.", "", ["cost-said.csv: has another shape"]),
    ],
)
def test_what_moved_by_more_than_a_tenth_is_told(tmp_path, old, new, told):
    text = "\n".join(LINES)
    assert old in text
    kept.keep("cost", text.splitlines(), tmp_path)
    assert kept.keep("cost", text.replace(old, new).splitlines(), tmp_path) == told


@pytest.mark.parametrize(
    ("had", "have", "replaced"),
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
def test_a_smaller_sample_is_compared_and_replaces_nothing(tmp_path, had, have, replaced):
    kept.keep("cost", [*LINES, "", "| a |", "|---|", "| 1 |", had], tmp_path)
    files = {path.name: path.read_text("utf-8") for path in tmp_path.iterdir()}
    told = kept.keep(
        "cost", [*"\n".join(LINES).replace("0.50", "0.60").splitlines(), have], tmp_path
    )
    assert "cost.csv: 256, time [s]: 0.50 is now 0.60" in told
    assert replaced == (
        {path.name: path.read_text("utf-8") for path in tmp_path.iterdir()} != files
    )
    assert (tmp_path / "cost-2.csv").exists() != replaced
    assert told[0].startswith("cost: stays as it was; ") != replaced


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
    assert Unfinished.of(["one", "two", "three"], afresh=True, **where).left == [
        "one",
        "two",
        "three",
    ]
    assert Unfinished.of(["one", "two"], afresh=False, **where).left == ["one", "two"]
    assert (
        Unfinished.of(["one", "two", "three"], afresh=False, **(where | {"whole": True})).done == {}
    )
    again.forget()
    assert Unfinished.of(["one", "two", "three"], afresh=False, **where).done == {}


@pytest.mark.parametrize(
    ("said", "whole", "last"),
    [
        (["| 1 |"], True, kept.IN_FULL),
        (["| 1 |"], False, kept.IN_SHORT),
        (["Sample: 7 rings.", "| 1 |"], False, "| 1 |"),
    ],
)
def test_a_part_ends_with_how_much_of_it_that_was_unless_it_says_so(monkeypatch, said, whole, last):
    monkeypatch.setattr(
        importlib, "import_module", lambda _: SimpleNamespace(lines=lambda **_: iter(said))
    )
    assert list(bench_main._said("intervals", whole=whole, seconds=1.0))[-1] == last
    assert kept.sample(bench_main._said("certified", whole=whole, seconds=1.0)) == (
        7.0 if len(said) > 1 else 0.0
    )


def test_a_part_that_had_no_time_says_so(tmp_path, monkeypatch):
    for part in (forecast, next_points):
        monkeypatch.setattr(part, "ROWS", tmp_path / "none.csv")
        assert any(line.startswith("Sample: 0 ") for line in part.tables())


def test_hard_contacts_are_gone_on_with_and_kept_as_they_are_solved(tmp_path, monkeypatch):
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
    assert "2 of 2 solved on the chosen grid, median 0.1 s" in chosen_grids.summary(
        list(pairs.values())
    )


def test_what_other_code_has_done_is_not_gone_on_with(tmp_path, monkeypatch):
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


def test_every_part_is_one_that_can_be_run():
    assert len(set(PARTS)) == len(PARTS)
    assert set(WHOLE) < set(PARTS)
    assert all(callable(importlib.import_module(f"benchmarks.{part}").lines) for part in PARTS)


@pytest.fixture
def bench(tmp_path, monkeypatch, capsys):
    """The command on two timed parts and a row of two counted ones, none of which is run; what it
    prints, its code.
    """
    ran: list[str] = []
    troubles: dict[str, str] = {}

    def run(part, *, whole, **_):
        ran.append(f"{part} {whole}")
        return "| cells |\n|---|\n| 1 |", troubles.get(part, "")

    monkeypatch.setattr(bench_main, "ALONE", ("a", "b"))
    monkeypatch.setattr(bench_main, "ABREAST", (("c", "d"),))
    monkeypatch.setattr(bench_main, "PARTS", ("a", "b", "c", "d"))
    monkeypatch.setattr(bench_main, "_run", run)
    monkeypatch.setattr(unfinished, "FILE", tmp_path / "run.json")
    monkeypatch.setattr(kept, "PAGE", tmp_path / "benchmarks.md")
    monkeypatch.setattr(kept, "keep", partial(kept.keep, folder=tmp_path))

    def command(*words):
        monkeypatch.setattr("sys.argv", ["benchmarks", *words])
        with pytest.raises(SystemExit) as end:
            bench_main.main()
        return capsys.readouterr().out, end.value.code

    return command, ran, troubles


def test_all_parts_run_once_and_the_next_run_starts_anew(bench):
    command, ran, _ = bench
    printed, code = command()
    assert (ran, code) == (["a False", "b False", "c False", "d False"], 0)
    assert "a.csv: new" in printed
    printed, _ = command("--whole")
    assert ran[4:] == ["a True", "b True", "c True", "d True"]
    assert "a.csv" not in printed  # the same as the last


def test_out_of_time_goes_on_with_what_is_left(bench, monkeypatch):
    command, ran, _ = bench
    clock = iter(
        [0.0, 0.0, 1.0, *[1e6] * 9]
    )  # all of the time has gone once the first part has ended
    monkeypatch.setattr(bench_main, "perf_counter", lambda: next(clock))
    printed, code = command("--minutes", "1")
    assert (ran, code) == (["a False"], 1)
    assert "Out of time before b, c, d" in printed


def test_a_part_that_fails_is_named_and_the_others_run(bench):
    command, ran, troubles = bench
    troubles["b"] = "failed with exit code 1"
    printed, code = command()
    assert (len(ran), code) == (4, 1)
    assert "| b | 0 | failed with exit code 1 |" in printed
    assert "b.csv" not in printed


def test_named_parts_run_alone_and_leave_a_cut_off_run_as_it_is(bench):
    command, ran, _ = bench
    unfinished.FILE.write_text(
        '{"parts": ["a", "b", "c", "d"], "whole": false, "began": "then", "done": {}}'
    )
    command("d")
    assert ran == ["d False"]
    run = Unfinished.of(["a", "b", "c", "d"], whole=False, afresh=False, file=unfinished.FILE)
    assert run.began == "then"
    run.end("a", 2.0, "", [])
    printed, _ = command()
    assert ran[1:] == ["b False", "c False", "d False"]
    assert "Going on with the run of then, after a" in printed
    assert "| a | 2 | measured |" in printed


def test_rows_of_many_runs_add_up_and_say_whose_they_are(tmp_path):
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


def test_the_rows_that_are_kept_make_the_tables():
    from benchmarks.inference import ROWS, tables

    lines = list(tables())
    rows = list(Rows(ROWS, ("machine", "law")))
    assert lines[-1].startswith(
        f"{len({row['machine'] for row in rows})} machines with 12 surfaces"
    )
    told = [line for line in lines if line.startswith("| as the emulator has it | 6 |")]
    heard = [
        row
        for row in rows
        if (row["law"], row["points"]) == ("as the emulator has it", "6") and row["clr_true"]
    ]
    assert f"| {len(heard)} |" in told[0]
