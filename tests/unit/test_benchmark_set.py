"""The benchmark: its certified values by both ways where these are quick, its runner, and adapters of others."""

import csv
import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from benchmark import ways

from asperity.benchmark import load_benchmark, run_benchmark, solver_named
from asperity.errors import BadInput
from support.source import ROOT

CASES = {case.name: case for case in load_benchmark()}
QUICK = {  # by the beginning of a name: both ways that take less than a second
    "dry-line": (ways.hertz_line, lambda given: ways.dense_line(given, 801)),
    "dry-ball": (ways.hertz_point, ways.sneddon),
    "dry-ellipse": (ways.hertz_ellipse, ways.ellipse_by_chords),
    "dry-wave": (ways.westergaard, lambda given: ways.dense_wave(given, 400)),
    "cavity-journal": (ways.sommerfeld, ways.journal),
    "cavity-parabola": (ways.parabola, lambda given: ways.refined("asperity", given, (400, 800, 1600))[0]),
    "ehl-line": (ways.newton_on_nodes, lambda given: solver_named("asperity").solve(given, 512)),
}
# how near the second way is on fewer nodes than it was certified on
FEWER_NODES = {"dry-line": 3e-4, "dry-wave": 3e-4, "ehl-line": 5e-4}


SLOW = [f"ehl-line-{number}" for number in (1, 3, 4, 6)]  # as the three others


def ways_of(name):
    return next((both for start, both in QUICK.items() if name.startswith(start)), None)


def test_every_value_has_two_ways_and_an_uncertainty_of_at_most_two_per_cent():
    assert len(CASES) == 24
    for case in CASES.values():
        assert case.certified, case.name
        for entry in case.certified:
            assert len(set(entry.ways)) == 2
            assert 0.0 < entry.uncertainty <= 0.02 * abs(entry.value), (case.name, entry)


def test_the_table_is_that_of_the_cases():
    with (ROOT / "benchmark" / "certified.csv").open(encoding="utf-8", newline="") as file:
        rows = [(row["case"], row["quantity"], float(row["value"])) for row in csv.DictReader(file)]
    assert rows == [(case.name, entry.quantity, entry.value) for case in CASES.values() for entry in case.certified]


@pytest.mark.parametrize("name", [name for name in CASES if ways_of(name) and name not in SLOW])
def test_both_ways_give_the_certified_value(name):
    case = CASES[name]
    off = next((share for start, share in FEWER_NODES.items() if name.startswith(start)), 0.0)
    first, second = (way(case.given) for way in ways_of(name))
    for entry in case.certified:
        assert first[entry.quantity] == pytest.approx(entry.value, abs=1.01 * entry.uncertainty)
        assert second[entry.quantity] == pytest.approx(entry.value, rel=off, abs=1.01 * entry.uncertainty)


@pytest.mark.parametrize(
    ("name", "cells", "within"),
    [
        ("dry-line-1", 128, 0.01),
        ("dry-ellipse-1", 64, 0.02),
        ("ehl-line-2", 128, 0.02),
        ("cavity-journal-0.6", 200, 0.01),
    ],
)
def test_our_solver_meets_a_case_of_each_kind(name, cells, within):
    found = solver_named("asperity").solve(CASES[name].given, cells)
    for entry in CASES[name].certified:
        assert found[entry.quantity] == pytest.approx(entry.value, rel=within), entry.quantity


def test_a_rough_contact_holds_on_a_grid_between_those_it_was_certified_on():
    (entry,) = CASES["dry-rough-3"].certified
    found = solver_named("tamaas").solve(CASES["dry-rough-3"].given, 320)[entry.quantity]
    assert found == pytest.approx(entry.value, abs=2.0 * entry.uncertainty)


def test_errors_fall_as_cells_are_added():
    def errors(cells):
        found = solver_named("asperity").solve(CASES["ehl-line-2"].given, cells)
        return [abs(found[entry.quantity] / entry.value - 1.0) for entry in CASES["ehl-line-2"].certified]

    assert all(fine < coarse / 2.0 for fine, coarse in zip(errors(128), errors(64), strict=True))


def test_tamaas_meets_waves_and_balls():
    tamaas = solver_named("tamaas")
    for name, within in (("dry-wave-2", 1e-3), ("dry-ball-1", 0.01)):
        found = tamaas.solve(CASES[name].given, 64)
        for entry in CASES[name].certified:
            loose = 0.05 if entry.quantity == "contact_area_m2" else within
            assert found[entry.quantity] == pytest.approx(entry.value, rel=loose), entry.quantity
    assert tamaas.solve(CASES["dry-line-1"].given, 64) == {}


class Exact:
    """An adapter that answers with what is certified, but for one case."""

    name = "exact"
    kinds = ("dry", "slider")

    def solve(self, given, cells):  # noqa: ARG002
        if given["kind"] == "slider":
            raise BadInput("has no oil")
        (case,) = (case for case in CASES.values() if case.given == given)
        return {entry.quantity: entry.value + 2.0 * entry.uncertainty for entry in case.certified[:1]}


def test_a_runner_counts_errors_in_uncertainties_and_says_what_is_left_out(tmp_path):
    result = run_benchmark(Exact(), cells=(64,))
    dry = [case for case in CASES.values() if case.kind == "dry"]
    assert len(result.rows) == len(dry)
    np.testing.assert_allclose([row.over_uncertainty for row in result.rows], 2.0, rtol=1e-6)
    assert {name for name, _ in result.left_out} == {case.name for case in CASES.values() if case.kind != "dry"}
    assert ("cavity-parabola", "has no oil") in result.left_out
    assert "exact on 64 cells" in result.verdict()
    with result.save(tmp_path / "rows.csv").open(encoding="utf-8") as file:
        assert len(list(csv.DictReader(file))) == len(result.rows)


def test_what_is_no_solver_or_no_case_is_refused(tmp_path):
    with pytest.raises(BadInput, match="--solver must be asperity, tamaas, contactmechanics or package"):
        solver_named("abaqus")
    with pytest.raises(BadInput, match="No module named 'nothing_like_it'"):
        solver_named("nothing_like_it:Thing")
    with pytest.raises(BadInput, match="an adapter has name, kinds and solve"):
        solver_named("pathlib:Path")
    with pytest.raises(BadInput, match="holds no cases of the benchmark"):
        load_benchmark(tmp_path)
    (tmp_path / "one.toml").write_text("kind = 'dry'\ncertified = [{quantity = 'p'}]\n", "utf-8")
    with pytest.raises(BadInput, match="is no case of the benchmark"):
        load_benchmark(tmp_path)
    with pytest.raises(BadInput, match="--cells must be at least 8, got 4"):
        run_benchmark(Exact(), cells=(4,))


def test_a_solver_is_not_scored_by_uncertainties_that_it_made():
    rows = run_benchmark(solver_named("tamaas"), cells=(32,)).rows
    assert {row.case for row in rows if row.over_uncertainty is None} == {f"dry-rough-{n}" for n in (1, 2, 3)}


def test_a_solver_that_lies_is_seen():
    class Lying(Exact):
        def solve(self, given, cells):
            return {key: 1.1 * value for key, value in super().solve(given, cells).items()}

    assert all(row.error > 0.05 for row in run_benchmark(Lying(), cells=(64,)).rows)


def test_the_command_runs_a_folder_of_cases(tmp_path, monkeypatch, capsys):
    from asperity.cli import main

    monkeypatch.chdir(tmp_path)
    Path("some").mkdir()
    for name in ("dry-ellipse-1", "cavity-journal-0.3"):
        text = (ROOT / "benchmark" / "cases" / f"{name}.toml").read_text("utf-8")
        Path("some", f"{name}.toml").write_text(text, "utf-8")
    arguments = [
        "benchmark",
        "--cases",
        "some",
        "--cells",
        "32",
        "--cells",
        "48",
        "--out",
        "a.csv",
        "--figure",
        "a.png",
    ]
    with pytest.raises(SystemExit) as end:
        main([*arguments, "--json"])
    assert (end.value.code or 0) == 0
    said = json.loads(capsys.readouterr().out)
    assert {row["cells"] for row in said["rows"]} == {32, 48}
    assert {row["case"] for row in said["rows"]} == {"dry-ellipse-1", "cavity-journal-0.3"}
    assert said["written"] == ["a.csv", "a.png"]
    assert all(Path(name).is_file() for name in said["written"])
    with pytest.raises(SystemExit) as end:
        main(["benchmark", "--solver", "abaqus"])
    assert end.value.code == 2


def test_a_certified_value_that_moves_is_seen():
    moved = replace(CASES["dry-ball-1"].certified[0], value=1.001 * CASES["dry-ball-1"].certified[0].value)
    found = ways.hertz_point(CASES["dry-ball-1"].given)[moved.quantity]
    assert abs(found - moved.value) > moved.uncertainty
