"""Running contact: means over time of moving roughness, with their intervals."""

import json
import math
from dataclasses import make_dataclass, replace
from itertools import count, islice
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from asperity.case import case_template, load_case, load_machine
from asperity.contact.grid import Grid
from asperity.core.errors import BadInput, NotConverged
from asperity.ehl import half_as_many, least_film, running_cells, solve_contact
from asperity.results import load_run, running_surfaces, solve_case, uncertainty_rows
from asperity.results.running import _moments
from asperity.solution import contact_state
from asperity.surface import MovingSurfaces, Surface, flat_surface
from asperity.transient import (
    Series,
    moving_contact,
    run_track,
    settled_from,
    solve_passage,
    time_means,
)
from asperity.transient.motion import step_seconds
from asperity.transient.running import TOLERANCE

PAPER = Path(__file__).parents[2] / "examples" / "paper.toml"
RUNNING = {"grid.cells": [64, 32]}

Step = make_dataclass("Step", ("number", "solution", "memory"))


def series(values, *, steps_per_passage=10, **zones):
    rows = np.stack([np.zeros(len(values)), values], axis=1)
    return Series((1, 1), steps_per_passage, ("time_s", "clr"), rows, 0, 0, 0.0, **zones)


@pytest.fixture(scope="module")
def run():
    return solve_case(load_case(PAPER).with_overrides(RUNNING), surfaces=2)


@pytest.mark.parametrize("periodic", [True, False])
def test_roughness_on_fewer_cells_has_the_heights_of_its_waves(periodic):
    def surface(cells):
        grid = Grid(cells, (-2.0, -1.0), (2.0, 1.0), periodic=(True, periodic))
        x, y = (grid.x[:, None] + 2.0) / 4.0, (grid.y + 1.0) / 2.0
        across = np.cos(2.0 * np.pi * (3.0 * y + 0.1)) if periodic else np.cos(3.0 * np.pi * y)
        return Surface(np.cos(2.0 * np.pi * 4.0 * x + 0.3) * across, grid)

    fine, coarse = surface((60, 40)), surface((24, 14))
    grid = Grid((60, 40), (-2.0, -1.0), (2.0, 1.0), periodic=(False, periodic))
    moving = MovingSurfaces(fine, flat_surface(fine.grid), (1.0, 1.0), grid)
    fewer = moving.on_cells((24, 14))
    np.testing.assert_allclose(fewer.first.heights, coarse.heights, atol=1e-12)
    assert fewer.grid.cells == (24, 14)
    with pytest.raises(BadInput, match="at most"):
        moving.on_cells((64, 40))


def test_the_fine_grid_has_equally_many_cells_per_correlation_length():
    case = load_case(PAPER)
    assert case.running_cells() == (80, 40)
    cells = running_cells(case.conditions, case.grid, (40e-6, 10e-6), 4608)
    lengths = [e / n for e, n in zip(case.grid.extent, cells, strict=True)]
    assert lengths[0] / lengths[1] == pytest.approx(4.0, rel=0.1)
    tight = case.with_overrides({"grid.cells": [64, 32]})
    assert tight.running_cells() == (64, 32)
    assert half_as_many(tight.conditions, tight.grid, (64, 32)) == (32, 16)
    assert half_as_many(tight.conditions, tight.grid, (48, 32)) is None


def test_a_grid_too_coarse_for_another_leaves_clr_undetermined():
    case = load_case(PAPER).with_overrides({"grid.cells": [48, 24]})
    run = solve_case(case)
    assert (run.running.cells, run.running.clr.grid, run.running.tracks) == ((48, 24), None, 1)
    assert run.running.steps == len(run.running.series) - 1  # of one grid, counted once
    assert "no coarser grid is available to estimate its error" in run.verdict()
    numbers = run.scalars()
    assert (numbers["determined"], numbers["clr_low"], numbers["clr_error"]) == (False, None, None)
    assert numbers["sq_m"] == pytest.approx(1e-6)


def test_the_note_on_too_little_load_is_for_standing_roughness_only():
    """The snapshot at the start of a running contact may carry as little: it is not the answer."""
    changes = {
        "contact.load": "500 N",
        "contact.entrainment_speed": "0.3 m/s",
        "contact.slip": 0.0,
        "lubricant.viscosity.eta0": "0.08 Pa s",
        "lubricant.viscosity.alpha": "20 1/GPa",
        "surface.sq": "0.45 um",
        "surface.correlation_length": ["36 um", "72 um"],
        "grid.cells": [48, 24],
        "solver.running_cells": 600,
    }
    case = load_case(case_template("line")).with_overrides(changes)
    standing, running = (
        solve_case(case.with_overrides({"contact.roughness": roughness}), surfaces=1)
        for roughness in ("standing", "running")
    )
    assert standing.state.clr < 0.01 < running.state.clr
    remark = "asperities carry almost no load"
    assert sum(remark in note for note in standing.notes) == 1
    assert not any(remark in note for note in running.notes)


def test_a_start_that_does_not_converge_does_not_change_the_mean(run, monkeypatch, tmp_path):
    """Each time step has the oil of the one before, and the start is cut off."""

    def of_few_steps(*arguments, options, **more):
        return solve_contact(*arguments, options=replace(options, max_iterations=2), **more)

    monkeypatch.setattr("asperity.transient.time_step.solve_contact", of_few_steps)
    approximate = solve_case(run.case, surfaces=2)
    assert approximate.converged
    assert approximate.running.failed == 0
    assert approximate.running.clr.value == pytest.approx(run.running.clr.value, abs=0.01)
    assert run.snapshot_clr is not None
    assert approximate.snapshot_clr is None
    assert approximate.scalars()["snapshot_clr"] is None
    assert "not determined in a snapshot of standing roughness" in approximate.verdict()
    assert any("those of its last moment" in note for note in approximate.notes)
    approximate.save(tmp_path / "run.nc")
    assert load_run(tmp_path / "run.nc").summary() == approximate.summary()


@pytest.mark.parametrize("failing", [12, 2])
def test_a_passage_with_failed_steps_is_refused_with_a_failed_solution(monkeypatch, failing):
    """Also if its last step converges."""

    def steps(*arguments, **more):
        for snapshot in moving_contact(*arguments, **more):
            solution = snapshot.solution
            if 0 < snapshot.number <= failing:
                failed = replace(solution.convergence, status="out of iterations")
                solution = replace(solution, convergence=failed)
            yield replace(snapshot, solution=solution)

    monkeypatch.setattr("asperity.transient.running.moving_contact", steps)
    case = load_case(PAPER).with_overrides(RUNNING | {"grid.cells": [48, 24]})
    if failing == 2:
        assert solve_case(case, strict=False).running.failed == 2
        return
    with pytest.raises(NotConverged) as caught:
        solve_case(case)
    assert not caught.value.solution.convergence.converged
    run = solve_case(case, strict=False)
    assert (run.converged, run.running) == (False, None)
    assert run.verdict().startswith("NOT CONVERGED")


def test_a_passage_from_a_start_that_does_not_converge_begins_one_earlier(monkeypatch):
    case = load_case(PAPER).with_overrides(RUNNING | {"grid.cells": [48, 24]})
    surfaces = running_surfaces(case).on_cells((48, 24))
    steps = 2 * round(case.conditions.hertz.half_widths[0] / surfaces.grid.spacing[0])
    options = replace(case.options, tolerance=1e-2)
    step = {"time_step": 2.0, "options": options}
    earlier = surfaces.earlier(steps * step_seconds(case.conditions, surfaces, 2.0))
    *_, last = islice(moving_contact(case.conditions, case.lubricant, earlier, **step), steps + 1)
    expected, starts = last.solution, []

    def of_few_steps(*contact, options, **more):
        starts.append(contact[2])
        return solve_contact(*contact, options=replace(options, max_iterations=2), **more)

    monkeypatch.setattr("asperity.transient.time_step.solve_contact", of_few_steps)
    found = solve_passage(case.conditions, case.lubricant, surfaces, options=case.options)
    assert len(starts) == 2  # one passage before, then two
    assert not np.allclose(starts[0].heights, starts[1].heights)
    np.testing.assert_allclose(found.surface.heights, expected.surface.heights, atol=1e-15)
    assert contact_state(found).clr == pytest.approx(contact_state(expected).clr, abs=0.02)


def test_a_contact_whose_time_steps_fail_ends_after_one_passage():
    hopeless = load_case(PAPER).with_overrides(RUNNING | {"solver.max_iterations": 1})
    with pytest.raises(NotConverged, match="contact not solved: out of iterations") as caught:
        solve_case(hopeless)
    assert not caught.value.solution.convergence.converged


def test_one_contact_among_many_has_fewer_cells_unless_it_states_how_many():
    case = load_case(PAPER)
    assert math.prod(case.among_many.running_cells()) < 0.5 * math.prod(case.running_cells())
    stated = case.with_overrides({"solver.running_cells": 2000})
    assert stated.among_many.running_cells() == stated.running_cells() == (64, 32)


def test_the_start_of_a_series_is_cut_off():
    rng, steps = np.random.default_rng(1), np.arange(121)
    noise = 0.01 * rng.standard_normal(121)
    assert settled_from(series(noise), "clr") == 1
    assert settled_from(series(noise + 0.5 * np.exp(-steps / 8.0)), "clr") in (3, 4)
    assert settled_from(series(noise + 0.01 * steps), "clr") is None


def test_intervals_cover_the_mean_of_correlated_series():
    """First-order autoregression whose correlation time is a third of a passage."""
    rng, covered, phi = np.random.default_rng(7), [], math.exp(-0.3)

    def correlated(count):
        values = np.empty(count)
        values[0] = rng.standard_normal()
        for k in range(1, count):
            values[k] = phi * values[k - 1] + math.sqrt(1.0 - phi**2) * rng.standard_normal()
        return values

    for _ in range(300):
        coarse = [correlated(61) for _ in range(3)]
        fine = series(0.1 + coarse[0] + 0.3 * correlated(61))
        mean = time_means([series(values) for values in coarse], [1, 1, 1], fine)["clr"]
        covered.append(abs(mean.value - 0.1) <= mean.time)
    assert 0.82 < np.mean(covered) < 0.97


def test_the_mean_of_a_moving_window_has_the_stated_scatter():
    """White noise averaged over a Hertz zone, as a contact averages its roughness."""
    rng, covered = np.random.default_rng(5), []
    for _ in range(400):
        noise = np.concatenate([[0.0], np.cumsum(rng.standard_normal(200))])
        part = series(noise[20:] - noise[:-20], steps_per_passage=20)
        mean = time_means([part], [1], part)["clr"]
        covered.append(abs(mean.value) <= mean.time)
    assert 0.88 < np.mean(covered) < 0.97


def test_the_scatter_of_slow_roughness_is_not_determined():
    values = 0.1 * np.random.default_rng(3).standard_normal(61)
    assert math.isfinite(time_means([series(values)], [1], series(values))["clr"].time)
    slow = series(values, zones=0.25)
    assert time_means([slow], [1], slow)["clr"].time == math.inf


@pytest.mark.usefixtures("short_tracks")
def test_a_track_too_short_for_its_scatter_leaves_friction_undetermined(monkeypatch):
    """On the report too, whose table of uncertainty failed."""
    monkeypatch.setattr("asperity.transient.running.MIN_INDEPENDENT", 100.0)
    run = solve_case(load_case(PAPER).with_overrides({**RUNNING, "solver.running_cells": 400}))
    assert run.running.numbers["friction_error"] is None
    assert (run.friction_interval.low, run.friction_interval.high) == (None, None)
    rows = dict(uncertainty_rows(run.error, run.friction_interval))
    assert rows["µ, 90 % interval"] == "not determined"
    assert any(note.startswith("Too little roughness passes") for note in run.notes)


@pytest.mark.parametrize(("contact", "cells", "mean"), [(2, (46, 28), 8.0), (5, (50, 26), 7.0)])
def test_time_steps_of_a_gear_contact_take_few_newton_steps(contact, cells, mean):
    """12 and 10 in the mean, 41 at most, where one thin film limited the step of all cells; 7.6 in
    the second contact with linear equations solved to a tenth or closer.
    """
    machine = load_machine(PAPER.with_name("fzg-c.toml"))
    case = machine.case(machine.contacts[contact]).with_overrides({"solver.running_cells": 1200})
    surfaces = running_surfaces(case).on_cells(cells)
    options = replace(case.options, tolerance=TOLERANCE)
    snapshots = moving_contact(
        case.conditions, case.lubricant, surfaces, time_step=2.0, options=options
    )
    taken = [snapshot.solution.convergence for snapshot in islice(snapshots, 1, 41)]
    assert all(convergence.converged for convergence in taken)
    counts = [convergence.iterations for convergence in taken]
    assert np.mean(counts) < mean
    assert max(counts) < 16


def test_repeated_tracks_scatter_by_their_means():
    values = [0.1 * n + 0.001 * np.random.default_rng(n).standard_normal(61) for n in range(3)]
    repeated = [series(part, track_zones=2.0) for part in values]
    mean = time_means(repeated, [1, 1, 1], repeated[0])["clr"]
    assert mean.value == pytest.approx(0.1, abs=1e-3)
    assert mean.time == pytest.approx(2.92 * 0.1 / math.sqrt(3.0), rel=0.02)  # Student's t
    new = [series(part) for part in values]
    assert time_means(new, [1, 1, 1], new[0])["clr"].time < 0.1 * mean.time


@pytest.mark.parametrize(
    ("slip", "rough", "time_step", "length"),
    [
        (0.2, "first", 2.0, 6),
        (1.0, "first", 2.0, 6),
        (3.0, "first", 1.0, 6),  # the roughness moves fast relative to the oil
        (1.0, "second", 2.0, 12),  # at half the oil's speed
        (1.9, "second", 2.0, 24),
    ],
)
def test_steps_and_length_of_a_series_follow_the_speed_of_the_roughness(
    monkeypatch, slip, rough, time_step, length
):
    case = load_case(PAPER).with_overrides(
        {"grid.cells": [64, 32], "contact.slip": slip, "motion.rough": rough}
    )
    steps, noise = [], np.random.default_rng(2)
    converged = SimpleNamespace(convergence=SimpleNamespace(converged=True, iterations=1))

    def march(*_, time_step, **__):
        steps.append(time_step)
        for number in count():
            yield Step(number, converged, {})

    monkeypatch.setattr("asperity.transient.running.moving_contact", march)
    surfaces = case.moving_surfaces()
    measured = run_track(
        case.conditions, case.lubricant, surfaces, lambda _: {"clr": noise.standard_normal()}
    )
    assert (steps, measured.length) == ([time_step], length)


def test_moments_of_heat_and_stress_are_after_the_cut():
    kept = tuple(SimpleNamespace(number=number) for number in range(0, 130, 10))
    assert [moment.number for moment in _moments(series(np.zeros(121))._replace(kept=kept), 6)] == [
        70,
        90,
        100,
        120,
    ]


def test_tracks_of_generated_roughness_do_not_repeat():
    case = load_case(PAPER).with_overrides(RUNNING)
    fast, slow = (
        running_surfaces(case.with_overrides({"contact.slip": slip})) for slip in (1.0, 0.0)
    )
    zone = 2.0 * case.conditions.hertz.half_widths[0]
    assert fast.first.grid.extent[0] >= 6.0 * 1.5 * zone
    assert 6.0 * zone <= slow.first.grid.extent[0] < fast.first.grid.extent[0]


@pytest.mark.parametrize("speeds", [(1.0, 0.0), (1.3, 0.6)])
def test_earlier_surfaces_arrive_as_they_are_now(speeds):
    grid = Grid((60, 8), (-2.0, -1.0), (2.0, 1.0), periodic=(True, True))
    x = (grid.x[:, None] + 2.0) / 4.0 + np.zeros(8)
    first, second = (Surface(np.cos(2.0 * np.pi * k * x), grid) for k in (3, 7))
    now = MovingSurfaces(first, second, speeds, replace(grid, periodic=(False, True)))
    np.testing.assert_allclose(
        now.earlier(0.37).composite_at(0.37).heights, now.composite_at(0.0).heights, atol=1e-12
    )


def test_the_headline_is_the_mean_over_time(run):
    running = run.running
    settled = np.array(running.series)[1 + running.cut * running.steps_per_passage :]
    numbers = run.summary()
    assert numbers["roughness"] == "running"
    assert numbers["clr_std"] == pytest.approx(settled.std())
    assert numbers["snapshot_clr"] == running.series[0]
    assert numbers["clr"] == pytest.approx(settled.mean(), abs=running.clr.time + 0.05)
    assert numbers["clr_low"] < numbers["clr"] < numbers["clr_high"]
    assert numbers["clr"] > numbers["snapshot_clr"] + 0.05  # 0.66 against 0.51
    assert numbers["friction_asperity_part"] == pytest.approx(0.15 * numbers["clr"], rel=1e-3)
    assert run.state.clr == numbers["clr"]
    # of the full roughness, not of the part of a track that is in the contact on its cells
    conditions, oil = run.case.conditions, run.case.lubricant
    assert run.solution.surface.sq != pytest.approx(1e-6, rel=0.01)
    assert numbers["sq_m"] == pytest.approx(1e-6)
    assert numbers["lambda_ratio"] == pytest.approx(least_film(conditions, oil) / 1e-6)
    verdict = run.verdict()
    assert "% in a snapshot of standing roughness; " in verdict
    assert "mean over time of 2 tracks" in verdict


def test_a_passage_ends_within_the_interval_of_the_mean(run):
    """Single moments scatter by the standard deviation over time."""
    case = load_case(PAPER).with_overrides(RUNNING)
    solution = solve_passage(
        case.conditions, case.lubricant, case.moving_surfaces(), options=case.options
    )
    assert solution.convergence.converged
    clr = contact_state(solution).clr
    assert abs(clr - run.state.clr) < 3.0 * run.running.clr_std
    assert clr > run.snapshot_clr


def test_a_snapshot_is_named_in_the_verdict():
    case = load_case(PAPER).with_overrides({**RUNNING, "contact.roughness": "standing"})
    snapshot = solve_case(case)
    assert "snapshot of standing roughness, 90 % intervals for this surface" in snapshot.verdict()
    assert snapshot.summary()["roughness"] == "standing"
    at_rest = solve_case(case.with_overrides({"contact.slip": 2.0, "motion.rough": "second"}))
    assert "standing roughness" not in at_rest.verdict()


def test_a_stored_running_contact_is_solved_again_to_the_same_numbers(run, tmp_path):
    again = solve_case(load_run(run.save(tmp_path / "run.nc")).case, surfaces=2)
    assert again.state.clr == run.state.clr


def test_rolling_friction_of_faint_running_roughness_is_that_of_a_smooth_contact(run):
    """By the flow's dissipation and by the sum of (h/2) dp/dx; 8 % apart on this grid."""
    faint = load_case(PAPER).with_overrides({**RUNNING, "surface.sq": "5 nm"})
    standing = faint.with_overrides({"contact.roughness": "standing"})
    running, still = (
        solve_case(case).scalars()["rolling_friction_coefficient"] for case in (faint, standing)
    )
    assert running == pytest.approx(still, rel=0.1)
    assert 0.2 * running < run.scalars()["rolling_friction_coefficient"] < 2.0 * running


def test_the_interval_covers_twice_as_fine_a_grid(run):
    """The mean over a passage of the same track on 128 x 64 cells is 0.685."""
    assert run.error.clr.low < 0.685 < run.error.clr.high


def test_a_stored_run_has_the_same_numbers(run, tmp_path):
    loaded = load_run(run.save(tmp_path / "run.nc"))
    assert loaded.running == run.running
    assert json.dumps(loaded.summary()) == json.dumps(run.summary())
    assert loaded.verdict() == run.verdict()


@pytest.mark.parametrize(
    "still",
    [
        {"contact.roughness": "standing"},
        {"contact.slip": 2.0, "motion.rough": "second"},
        {"lubricant": "none"},
        {"surface": "flat"},
        {"thermal.feedback": True},
        {"contact.slip": 4.1},
    ],
)
def test_a_contact_without_running_roughness_has_a_snapshot(still):
    case = load_case(PAPER).with_overrides(RUNNING)
    assert case.is_running
    assert not case.with_overrides(still).is_running


def test_worker_processes_do_not_change_the_numbers():
    case = load_case(PAPER).with_overrides({**RUNNING, "grid.cells": [52, 26]})
    alone, together = (solve_case(case, surfaces=2, workers=count) for count in (1, 2))
    for key in ("clr", "clr_low", "car", "friction_coefficient", "crf_hz"):
        assert alone.scalars()[key] == together.scalars()[key]
