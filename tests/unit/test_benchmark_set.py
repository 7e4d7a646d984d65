"""Benchmark set: certified values by two independent methods where quick, runner and adapters."""

import csv
import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from benchmark import oiled, twin, ways
from benchmark.certify import stated
from benchmark.fields import HERE as FIELDS

from asperity.benchmark import load_benchmark, run_benchmark, solver_named
from asperity.core.errors import BadInput
from support.source import ROOT

CASES = {case.name: case for case in load_benchmark()}
QUICK = {  # by prefix of the name: two methods that take less than a second
    "dry-wavy-line": (
        lambda given: ways.dense_line(given, 1601),
        lambda given: solver_named("asperity").solve(given, 512),
    ),
    "dry-ringed": (ways.sneddon, lambda given: solver_named("tamaas").solve(given, 128)),
    "dry-line": (ways.hertz_line, lambda given: ways.dense_line(given, 801)),
    "dry-ball": (ways.hertz_point, ways.sneddon),
    "dry-ellipse": (ways.hertz_ellipse, ways.ellipse_by_chords),
    "dry-wave": (ways.westergaard, lambda given: ways.dense_wave(given, 400)),
    "cavity-journal": (ways.sommerfeld, ways.journal),
    "cavity-parabola": (
        ways.parabola,
        lambda given: ways.refined("asperity", given, (400, 800, 1600))[0],
    ),
    "ehl-line": (
        lambda given: ways.newton_on_nodes(given, (201, 401)),
        lambda given: solver_named("asperity").solve(given, 512),
    ),
}
# relative error of the second method on fewer nodes than used for certification
FEWER_NODES = {
    "dry-line": 3e-4,
    "dry-wavy-line": 3e-3,
    "dry-ringed": 2e-3,
    "dry-wave": 3e-4,
    "ehl-line": 5e-4,
}


SLOW = [f"ehl-line-{number}" for number in (1, 3, 4, 5, 6, 7)]  # same method as ehl-line-2


def methods_for(name):
    return next((methods for start, methods in QUICK.items() if name.startswith(start)), None)


def test_every_value_has_two_methods_and_at_most_two_per_cent_uncertainty():
    assert len(CASES) == 41
    values = sum(len(case.certified) for case in CASES.values())
    shared = sum(
        any(way.startswith("asperity") for way in case.certified[0].ways) for case in CASES.values()
    )
    page = (ROOT / "docs" / "measured" / "benchmark-set.md").read_text("utf-8")
    assert f"{len(CASES)} cases, {values} values" in page
    assert f"holds for asperity on {shared} of the cases" in page
    for case in CASES.values():
        assert case.certified, case.name
        for entry in case.certified:
            assert len(set(entry.ways)) == 2
            assert 0.0 < entry.uncertainty <= 0.02 * abs(entry.value), (case.name, entry)


def test_the_table_matches_the_cases():
    with (ROOT / "benchmark" / "certified.csv").open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    entries = [(case.name, entry) for case in CASES.values() for entry in case.certified]
    assert [(row["case"], row["quantity"], row["unit"]) for row in rows] == [
        (name, entry.quantity, entry.unit) for name, entry in entries
    ]
    for row, (_, entry) in zip(rows, entries, strict=True):
        assert float(row["value"]) == pytest.approx(entry.value, rel=1e-7)
        assert float(row["uncertainty"]) == pytest.approx(entry.uncertainty, rel=0.06)
        assert (row["first way"], row["second way"]) == entry.ways
        assert float(row["found by it"]) == pytest.approx(
            entry.value, rel=1e-7, abs=1.06 * entry.uncertainty
        )


@pytest.mark.parametrize("name", [name for name in CASES if methods_for(name) and name not in SLOW])
def test_both_methods_reproduce_the_certified_value(name):
    case = CASES[name]
    tolerance = next((share for start, share in FEWER_NODES.items() if name.startswith(start)), 0.0)
    first, second = (way(case.given) for way in methods_for(name))
    for entry in case.certified:
        assert first[entry.quantity] == pytest.approx(
            entry.value, rel=tolerance, abs=1.01 * entry.uncertainty
        )
        assert second[entry.quantity] == pytest.approx(
            entry.value, rel=tolerance, abs=1.01 * entry.uncertainty
        )


@pytest.mark.parametrize(
    ("name", "cells", "tolerance"),
    [
        ("dry-line-1", 128, 0.01),
        ("dry-ellipse-1", 64, 0.02),
        ("ehl-line-2", 128, 0.02),
        ("cavity-journal-0.6", 200, 0.01),
    ],
)
def test_asperity_reproduces_a_case_of_each_kind(name, cells, tolerance):
    found = solver_named("asperity").solve(CASES[name].given, cells)
    for entry in CASES[name].certified:
        assert found[entry.quantity] == pytest.approx(entry.value, rel=tolerance), entry.quantity


def test_a_rough_contact_agrees_on_an_intermediate_grid():
    (entry,) = CASES["dry-rough-3"].certified
    found = solver_named("tamaas").solve(CASES["dry-rough-3"].given, 320)[entry.quantity]
    assert found == pytest.approx(entry.value, abs=2.0 * entry.uncertainty)


def assert_same(actual, expected, where=""):
    """Compare floats to a relative 1e-12 (libm differs in the last bit), all else exactly."""
    if isinstance(expected, float):
        assert isinstance(actual, float), where
        assert actual == pytest.approx(expected, rel=1e-12, abs=0.0), where
    elif isinstance(expected, dict):
        assert actual.keys() == expected.keys(), where
        for key, value in expected.items():
            assert_same(actual[key], value, f"{where}.{key}")
    elif isinstance(expected, list | tuple):
        assert type(actual) is type(expected), where
        assert len(actual) == len(expected), where
        for index, (item, expected_item) in enumerate(zip(actual, expected, strict=True)):
            assert_same(item, expected_item, f"{where}[{index}]")
    else:
        assert actual == expected, where
        assert type(actual) is type(expected), where


def test_stored_cases_match_the_script_that_generates_them():
    made = {name: given for name, given, _ in stated()}
    assert_same(made, {case.name: {"kind": case.kind, **case.given} for case in CASES.values()})


# nodes, cells and relative tolerance of one case per lubricated family
TWINNED = {
    "ehl-ball-2": ([(28, 13), (37, 17), (55, 25)], 128, 0.015),
    "mixed-line-2": ([(151, 1), (301, 1), (601, 1)], 512, 0.01),
    "mixed-strip-1": ([(51, 8), (76, 12), (101, 16)], 128, 0.02),
    "conserving-line-3": ([(151, 1), (301, 1), (451, 1)], 512, 0.02),
}


@pytest.mark.parametrize("name", TWINNED)
def test_lubricated_cases_agree_with_reference_solver_and_asperity(name):
    grids, cells, tolerance = TWINNED[name]
    given = CASES[name].given
    reference_values, _ = oiled.limit(
        oiled.steady(given, grids), [1.0 / (points - 1) for points, _ in grids]
    )
    own_values = solver_named("asperity").solve(given, cells)
    for entry in CASES[name].certified:
        assert reference_values[entry.quantity] == pytest.approx(entry.value, rel=tolerance), (
            entry.quantity
        )
        assert own_values[entry.quantity] == pytest.approx(entry.value, rel=tolerance), (
            entry.quantity
        )


def test_moving_waves_agree_with_reference_solver_and_asperity():
    given = CASES["moving-line-1"].given
    reference_values, own_values = (
        oiled.moving(given, 121),
        solver_named("asperity").solve(given, 128),
    )
    for entry in CASES["moving-line-1"].certified:
        assert reference_values[entry.quantity] == pytest.approx(entry.value, rel=0.12), (
            entry.quantity
        )  # a quarter of the nodes
        assert own_values[entry.quantity] == pytest.approx(entry.value, rel=0.05), entry.quantity


def test_compliance_of_the_reference_solver_matches_hertz_and_a_wave():
    line = twin.line(-1.5, 1.5, 601)
    displaced = twin.compliance(line) @ np.sqrt(np.maximum(1.0 - line.x**2, 0.0)) + line.x**2 / 2.0
    assert np.ptp(displaced[np.abs(line.x) < 0.95]) < 1e-3
    ball = twin.half_ball(-1.4, 1.4, 1.4, (57, 29))
    squared_radius = ball.x[:, None] ** 2 + ball.y[None, :] ** 2
    displaced = (
        twin.compliance(ball) @ np.sqrt(np.maximum(1.0 - squared_radius, 0.0)).ravel()
        + squared_radius.ravel() / 2.0
    )
    assert np.ptp(displaced[squared_radius.ravel() < 0.8]) < 5e-3
    strip = twin.strip(-4.0, 4.0, 1.0, (161, 16))  # long: no end effects in the middle
    wave = np.cos(2.0 * np.pi * strip.y)
    displaced = (twin.compliance(strip) @ np.tile(wave, 161)).reshape(strip.shape)[80]
    np.testing.assert_allclose(
        displaced, wave / (2.0 * np.pi), atol=1e-3
    )  # 2 p/(E* k), and p_h is E* a/(2 R)


def test_the_reference_solver_conserves_mass_and_load():
    given = CASES["conserving-line-3"].given
    *_, (solver, state) = oiled.solved(given, [(201, 1)])
    assert (state.oil < -0.01).sum() > 10  # there are cavities
    outflow, _, _ = solver.balance(state, solver.gap(state), None)
    through = solver.content(state)[-2]
    dx = solver.problem.mesh.x[1] - solver.problem.mesh.x[0]
    assert np.abs(np.cumsum(outflow[1:-1])).max() * dx < 1e-7 * through
    assert solver.problem.mesh.weights @ state.pressure == pytest.approx(np.pi / 2.0, rel=1e-9)
    assert ((state.oil > -1.0) & (state.solid >= 0.0)).all()


def test_reference_solutions_are_converged():
    solver = twin.Twin(oiled.Stated(CASES["conserving-line-1"].given).problem((101, 1)))
    with pytest.raises(twin.NotFound, match="last step"):
        solver.settled(twin.hertz_start(solver, 0.5), most=1)


@pytest.mark.parametrize("path", sorted(FIELDS.glob("*.nc")), ids=lambda path: path.stem)
def test_fields_carry_the_load_and_give_the_certified_values(path):
    case, fields = CASES[path.stem], xr.load_dataset(path, engine="h5netcdf")
    given, pressure = case.given, fields.pressure
    if "y" in fields.dims and "load_n" in given:
        load = float(pressure.integrate("x").integrate("y")) * (2.0 if fields.y[0] == 0.0 else 1.0)
        assert load == pytest.approx(given["load_n"], rel=0.01)
    elif "line_load_n_m" in given:
        assert float(pressure.integrate("x").mean()) == pytest.approx(
            given["line_load_n_m"], rel=0.01
        )
    known = {entry.quantity: entry.value for entry in case.certified}
    if "h_central_m" in known:
        middle = fields.film if "y" not in fields.dims else fields.film.isel(y=0)
        assert float(middle.interp(x=0.0)) == pytest.approx(known["h_central_m"], rel=0.04)
    if "p_max_pa" in known:
        assert float(pressure.max()) == pytest.approx(known["p_max_pa"], rel=1e-3)
    if "p_weighted_pa" in known:
        total = float((pressure**2).sum() / pressure.sum())
        assert total == pytest.approx(known["p_weighted_pa"], rel=0.02)


def test_steady_cases_have_fields():
    without = {name for name in CASES if not (FIELDS / f"{name}.nc").is_file()}
    assert {name.rpartition("-")[0] for name in without} == {
        "cavity-journal",
        "cavity",
        "dry-ringed-ball",
        "dry-rough",
        "dry-wavy-line",
        "moving-line",
    }


def test_errors_decrease_with_grid_refinement():
    def errors(cells):
        found = solver_named("asperity").solve(CASES["ehl-line-2"].given, cells)
        return [
            abs(found[entry.quantity] / entry.value - 1.0)
            for entry in CASES["ehl-line-2"].certified
        ]

    assert all(fine < coarse / 2.0 for fine, coarse in zip(errors(128), errors(64), strict=True))


def test_tamaas_reproduces_waves_and_balls():
    tamaas = solver_named("tamaas")
    for name, tolerance in (("dry-wave-2", 1e-3), ("dry-ball-1", 0.01)):
        found = tamaas.solve(CASES[name].given, 64)
        for entry in CASES[name].certified:
            rel = 0.05 if entry.quantity == "contact_area_m2" else tolerance
            assert found[entry.quantity] == pytest.approx(entry.value, rel=rel), entry.quantity
    assert tamaas.solve(CASES["dry-line-1"].given, 64) == {}


class Exact:
    """Adapter that returns the certified values, but refuses one kind."""

    name = "exact"
    kinds = ("dry", "slider")

    def solve(self, given, cells):  # noqa: ARG002
        if given["kind"] == "slider":
            raise BadInput("has no oil")
        (case,) = (case for case in CASES.values() if case.given == given)
        return {
            entry.quantity: entry.value + 2.0 * entry.uncertainty for entry in case.certified[:1]
        }


def test_errors_are_scaled_by_uncertainty_and_unsolved_cases_are_listed(tmp_path):
    result = run_benchmark(Exact(), cells=(64,))
    dry = [case for case in CASES.values() if case.kind == "dry"]
    assert len(result.rows) == len(dry)
    np.testing.assert_allclose([row.over_uncertainty for row in result.rows], 2.0, rtol=1e-6)
    assert {name for name, _ in result.left_out} == {
        case.name for case in CASES.values() if case.kind != "dry"
    }
    assert ("cavity-parabola", "has no oil") in result.left_out
    assert "exact on 64 cells" in result.verdict()
    with result.save(tmp_path / "rows.csv").open(encoding="utf-8") as file:
        assert len(list(csv.DictReader(file))) == len(result.rows)


def test_invalid_solvers_and_cases_are_refused(tmp_path):
    with pytest.raises(
        BadInput, match="--solver must be asperity, tamaas, contactmechanics or package"
    ):
        solver_named("abaqus")
    with pytest.raises(BadInput, match="No module named 'nothing_like_it'"):
        solver_named("nothing_like_it:Thing")
    with pytest.raises(BadInput, match="an adapter needs name, kinds and solve"):
        solver_named("pathlib:Path")
    with pytest.raises(BadInput, match="contains no benchmark cases"):
        load_benchmark(tmp_path)
    (tmp_path / "one.toml").write_text("kind = 'dry'\ncertified = [{quantity = 'p'}]\n", "utf-8")
    with pytest.raises(BadInput, match="is not a benchmark case"):
        load_benchmark(tmp_path)
    with pytest.raises(BadInput, match="--cells must be at least 8, got 4"):
        run_benchmark(Exact(), cells=(4,))


def test_contactmechanics_reproduces_waves_balls_and_rough_contacts():
    pytest.importorskip("ContactMechanics", reason="a package of the development group")
    solver = solver_named("contactmechanics")
    for name, tolerance in (
        ("dry-wave-2", 2e-3),
        ("dry-ellipse-1", 1e-3),
        ("dry-ball-1", 2e-3),
        ("dry-rough-2", 0.02),
    ):
        found = solver.solve(CASES[name].given, 64)
        for entry in CASES[name].certified:
            rel = 0.05 if entry.quantity == "contact_area_m2" else tolerance
            assert found[entry.quantity] == pytest.approx(entry.value, rel=rel), entry.quantity
    assert solver.solve(CASES["dry-line-1"].given, 64) == {}


def test_a_solver_is_not_scored_on_values_that_it_certified():
    rows = run_benchmark(solver_named("tamaas"), cells=(32,)).rows
    made = {"dry-ringed-ball-1", "dry-ringed-ball-2", "dry-rough-1", "dry-rough-2", "dry-rough-3"}
    assert {row.case for row in rows if row.over_uncertainty is None} == made


def test_wrong_results_are_detected():
    class Biased(Exact):
        def solve(self, given, cells):
            return {key: 1.1 * value for key, value in super().solve(given, cells).items()}

    assert all(row.error > 0.05 for row in run_benchmark(Biased(), cells=(64,)).rows)


@pytest.mark.parametrize(
    ("durations", "reported", "solves"), [((0.5, 0.25, 0.75), 0.25, 4), ((1.5,), 1.5, 2)]
)
def test_time_is_the_minimum_of_three_runs_after_a_warm_up(
    monkeypatch, durations, reported, solves
):
    case = CASES["dry-ball-1"]
    clock = iter([time for seconds in durations for time in (10.0, 10.0 + seconds)])
    monkeypatch.setattr("asperity.benchmark.run.load_benchmark", lambda _: (case,))
    monkeypatch.setattr("asperity.benchmark.run.time.process_time", lambda: next(clock))
    calls = []

    class Counted:
        name, kinds = "counted", (case.kind,)

        def solve(self, given, cells):  # noqa: ARG002
            calls.append(cells)
            return {entry.quantity: entry.value for entry in case.certified}

    assert {row.seconds for row in run_benchmark(Counted(), cells=(64,)).rows} == {reported}
    assert len(calls) == solves


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
        "--out",
        "a.png",
    ]
    with pytest.raises(SystemExit) as end:
        main([*arguments, "--json"])
    assert (end.value.code or 0) == 0
    summary = json.loads(capsys.readouterr().out)
    assert {row["cells"] for row in summary["rows"]} == {32, 48}
    assert {row["case"] for row in summary["rows"]} == {"dry-ellipse-1", "cavity-journal-0.3"}
    assert summary["written"] == ["a.csv", "a.png"]
    assert all(Path(name).is_file() for name in summary["written"])
    with pytest.raises(SystemExit) as end:
        main(["benchmark", "--solver", "abaqus"])
    assert end.value.code == 2


def test_a_changed_certified_value_is_detected():
    moved = replace(
        CASES["dry-ball-1"].certified[0], value=1.001 * CASES["dry-ball-1"].certified[0].value
    )
    found = ways.hertz_point(CASES["dry-ball-1"].given)[moved.quantity]
    assert abs(found - moved.value) > moved.uncertainty
