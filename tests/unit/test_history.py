"""Histories: values of each step, storage and resuming, motion of surfaces, page and command."""

import json
import os
import re
import signal
import subprocess
import sys
import time
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from asperity.case import load_case
from asperity.cli import main
from asperity.contact.grid import Grid
from asperity.core.errors import BadInput, NotConverged, UnreadableFile
from asperity.ehl import SolveStatus
from asperity.report.motion.page import render_motion_page
from asperity.simulation import load_history, run_history
from asperity.simulation.motion.run import MODELS
from asperity.surface import (
    CompositeSurface,
    MovingSurfaces,
    Surface,
    flat_surface,
    gaussian_surface,
    track_grid,
)
from asperity.transient import moving_contact

GRID = Grid((32, 16), (0.0, 0.0), (64e-6, 16e-6))
SMALL = {"grid.cells": "[48, 32]", "surface.correlation_length": "40 um", "grid.x": "[-3, 1.8]"}


def case(**overrides):
    return load_case("examples/paper.toml").with_overrides(SMALL | overrides)


def rough(grid=GRID, seed=1):
    return gaussian_surface(grid, sq=1e-6, correlation_length=8e-6, rng=np.random.default_rng(seed))


# Positions of surfaces


def test_a_shift_by_whole_cells_moves_the_heights():
    surfaces = MovingSurfaces.one_rough(rough(), (2.0, 0.0))
    np.testing.assert_array_equal(
        surfaces.composite_at(3e-6).heights, np.roll(rough().heights, 3, axis=0)
    )


def test_the_second_surface_moves_at_its_own_speed_and_is_mirrored():
    composite = CompositeSurface(rough(seed=1), rough(seed=2), (4.0, 2.0))
    surfaces = MovingSurfaces(composite.first, composite.second, composite.speeds, GRID)
    np.testing.assert_allclose(surfaces.composite_at(0.0).heights, composite.surface.heights)
    moved = (
        np.roll(composite.first.heights, 4, axis=0)
        + np.roll(composite.second.heights, 2, axis=0)[:, ::-1]
    )
    np.testing.assert_allclose(surfaces.composite_at(2e-6).heights, moved)


def test_a_shift_by_part_of_a_cell_is_exact_for_every_wave():
    x = GRID.x[:, None] * np.ones(16)
    waves = [(2.0 * np.pi * k / 64e-6, phase) for k, phase in ((1, 0.3), (5, 1.1), (13, 2.0))]

    def heights(shift):
        return sum(1e-6 * np.cos(number * (x - shift) + phase) for number, phase in waves)

    surfaces = MovingSurfaces.one_rough(Surface(heights(0.0), GRID), (1.0, 0.0))
    for shift in (0.37e-6, 12.9e-6, 640.0077e-6):
        np.testing.assert_allclose(surfaces.composite_at(shift).heights, heights(shift), atol=1e-16)


def test_a_long_motion_neither_smooths_nor_displaces_a_surface():
    surfaces = MovingSurfaces.one_rough(rough(), (1.0, 0.0))
    assert surfaces.composite_at(123.4567e-3).sq == pytest.approx(
        surfaces.composite_at(0.0).sq, rel=1e-6
    )
    np.testing.assert_allclose(
        surfaces.composite_at(1000 * 64e-6).heights, surfaces.composite_at(0.0).heights, atol=1e-15
    )


def test_a_track_may_be_longer_than_the_contact():
    track = track_grid(GRID, 3)
    surface = rough(track)
    surfaces = MovingSurfaces(surface, flat_surface(track), (1.0, 0.0), GRID)
    np.testing.assert_array_equal(surfaces.composite_at(0.0).heights, surface.heights[:32])
    np.testing.assert_allclose(surfaces.composite_at(64e-6).heights, surface.heights[64:])
    assert surfaces.passage_time(0) == pytest.approx(192e-6)
    assert surfaces.passage_time(1) == float("inf")


@pytest.mark.parametrize("index", [0, 1])
def test_marks_stay_in_place_on_the_track(index):
    surfaces = MovingSurfaces(rough(), rough(seed=2), (1.0, 1.0), GRID)
    mark = np.zeros(GRID.cells)
    mark[10, 3], side = 1.0, 3 if index == 0 else 12
    whole = surfaces.project_on_track(index, mark, 8e-6)  # four cells
    assert whole[6, side] == whole.sum() == 1.0
    between = surfaces.project_on_track(index, mark, 8.5e-6)
    assert between[6, side] == pytest.approx(0.75)
    assert between[5, side] == pytest.approx(0.25)
    assert between.sum() == pytest.approx(1.0)


def test_a_track_shorter_than_the_contact_is_refused():
    half = Grid((16, 16), (0.0, 0.0), (32e-6, 16e-6))
    with pytest.raises(BadInput, match="as long"):
        MovingSurfaces(rough(half), flat_surface(half), (1.0, 1.0), GRID)


@pytest.mark.parametrize("which", ["first", "second"])
def test_a_history_starts_with_the_roughness_of_the_case(which):
    chosen = case(**{"motion.rough": which})
    surfaces = chosen.moving_surfaces()
    np.testing.assert_allclose(
        surfaces.composite_at(0.0).heights, chosen.surface().heights, atol=1e-18
    )
    assert surfaces.rough == (which == "first", which == "second")


def test_both_bodies_share_the_roughness():
    surfaces = case(**{"motion.rough": "both", "motion.track": 2}).moving_surfaces()
    for surface in (surfaces.first, surfaces.second):
        assert surface.sq == pytest.approx(1e-6 / np.sqrt(2.0))
    correlation = np.corrcoef(surfaces.first.heights.ravel(), surfaces.second.heights.ravel())[0, 1]
    assert abs(correlation) < 0.3


@pytest.fixture
def measured(tmp_path):
    """Case in a folder with two measured surfaces, each larger than the contact."""
    import x3pio

    for name, seed in (("ring.x3p", 1), ("roller.x3p", 2)):
        heights = np.random.default_rng(seed).standard_normal((200, 220)).cumsum(0).cumsum(1)
        x3pio.write(
            tmp_path / name, (heights * (1e-6 / heights.std())).T, x_scale=2e-6, y_scale=2e-6
        )
    return replace(case(), folder=tmp_path)


def test_measured_surfaces_move_with_their_bodies_as_closed_tracks(measured):
    two = measured.with_overrides(
        {"surface": {"file": "ring.x3p", "sq": "1 um", "second": {"file": "roller.x3p"}}}
    )
    surfaces = two.moving_surfaces()
    assert surfaces.speeds == two.conditions.surface_speeds
    assert surfaces.first.sq == pytest.approx(1e-6)
    assert surfaces.rough == (True, True)
    for body in (surfaces.first, surfaces.second):
        inside = np.abs(np.diff(body.heights, axis=0)).mean()
        assert np.abs(body.heights[0] - body.heights[-1]).mean() < 3.0 * inside
    assert run_history(two, steps=1).failed == ()


def test_one_measured_surface_cannot_be_used_for_both_bodies(measured):
    single = measured.with_overrides({"surface": {"file": "ring.x3p"}, "motion.rough": "both"})
    with pytest.raises(BadInput, match=r"state the other as surface\.second"):
        single.moving_surfaces()


def test_roughness_stored_in_a_run_has_no_track():
    kept = replace(case(), stored=case().surface())
    with pytest.raises(BadInput, match="use the case file"):
        run_history(kept, steps=1)


@pytest.mark.parametrize(
    ("overrides", "message"),
    [
        ({"lubricant": "none"}, "dry contact"),
        ({"thermal.feedback": True}, "thermal.feedback=false"),
        ({"motion.start": "anew"}, 'motion.start must be "steady" or "stationary"'),
        ({"motion.time_step": 20}, "motion.time_step must be less than or equal to 8"),
        ({"motion.rugh": "both"}, "did you mean rough"),
    ],
)
def test_invalid_motions_are_refused(overrides, message):
    with pytest.raises(BadInput, match=message):
        run_history(case(**overrides), steps=1)


# Histories


@pytest.fixture(scope="module")
def history():
    return run_history(case(), steps=12, every=5)


def test_a_row_matches_its_step(history):
    chosen, table = history.case, history.table
    assert list(table["step"]) == list(range(13))
    dx = chosen.grid.spacing[0]
    np.testing.assert_allclose(np.diff(table["time_s"]), dx / chosen.conditions.entrainment_speed)
    np.testing.assert_allclose(table["contact_force_n"], table["clr"] * chosen.conditions.load)
    np.testing.assert_allclose(table["friction_asperity_part"], 0.15 * table["clr"])
    slid = table["friction_coefficient"] * chosen.conditions.load * chosen.conditions.sliding_speed
    np.testing.assert_allclose(table["friction_power_w"], slid)
    power = (table["friction_power_w"] + table["flow_power_w"]).to_numpy()
    assert table["heat_j"].iloc[-1] == pytest.approx(np.trapezoid(power, table["time_s"]))
    # Hertz point spring: stiffness grows with load^(1/3), resonance with load^(1/6)
    ratio = table["resonance_hz"].iloc[-1] / table["resonance_hz"].iloc[0]
    assert ratio == pytest.approx((table["clr"].iloc[-1] / table["clr"].iloc[0]) ** (1.0 / 6.0))
    assert [frame.number for frame in history.frames] == [0, 5, 10]
    assert history.frames[1].time == table["time_s"][5]


def test_scalars_describe_the_later_steps(history):
    scalars, later_rows = history.scalars(), history.table.iloc[6:]
    assert scalars["settled_from_step"] == 6
    assert scalars["clr"] == pytest.approx(later_rows["clr"].mean())
    assert scalars["clr_std"] == pytest.approx(np.std(later_rows["clr"].to_numpy()))
    assert scalars["clr_start"] == history.table["clr"].iloc[0]
    assert scalars["crf_hz"] == pytest.approx(later_rows["resonance_hz"].mean(), rel=0.01)
    json.dumps(scalars, allow_nan=False)


def test_the_first_row_equals_the_steady_solution(history):
    from asperity.results import solve_case

    snapshot = history.case.with_overrides({"contact.roughness": "standing"})
    single = solve_case(snapshot).scalars()
    first = history.table.iloc[0]
    for name in (
        "clr",
        "car",
        "car_domain",
        "h_min_m",
        "h_mean_m",
        "p_max_pa",
        "friction_coefficient",
    ):
        assert first[name] == pytest.approx(single[name]), name


def test_a_history_resumes_bit_for_bit(history, tmp_path):
    folder = tmp_path / "kept"
    for steps in (4, 5, 12):
        last = run_history(case(), steps=steps, every=5, out=folder)
        assert last.computed == {4: 5, 5: 1, 12: 7}[steps]
    pd.testing.assert_frame_equal(last.table, history.table, check_exact=True)
    for resumed_frame, frame in zip(last.frames, history.frames, strict=True):
        assert all(np.array_equal(a, b) for a, b in zip(resumed_frame, frame, strict=True))
    loaded = load_history(folder)
    pd.testing.assert_frame_equal(loaded.table, history.table, check_exact=True)
    assert loaded.case == history.case


def test_a_history_killed_before_its_manifest_restarts(tmp_path):
    folder = tmp_path / "begun"
    (folder / "fields").mkdir(parents=True)
    for name in (".lock", ".manifest.json.123.part"):
        (folder / name).write_text("")
    assert run_history(case(), steps=1, out=folder).steps == 1
    (tmp_path / "other").mkdir()
    (tmp_path / "other" / "letter.part").write_text("")
    with pytest.raises(BadInput, match="is not empty and holds no history"):
        run_history(case(), steps=1, out=tmp_path / "other")


def test_a_history_killed_at_any_time_resumes_bit_for_bit(history, tmp_path):
    folder = tmp_path / "killed"
    script = f"""
from asperity.case import load_case
from asperity.simulation import folder, run_history
from pathlib import Path
folder.SAVE_INTERVAL_S = 0.0
case = load_case("examples/paper.toml").with_overrides({SMALL!r})
run_history(case, steps=10000, every=5, out=Path({str(folder)!r}))
"""
    running = subprocess.Popen([sys.executable, "-c", script])
    for _ in range(2400):
        if (folder / "memory.npz").exists() and int(np.load(folder / "memory.npz")["number"]) >= 3:
            break
        time.sleep(0.05)
    os.kill(running.pid, signal.SIGKILL)
    running.wait()
    before = int(np.load(folder / "memory.npz")["number"])
    assert before >= 3
    again = run_history(case(), steps=max(12, before + 2), every=5, out=folder)
    assert again.computed == again.steps - before
    pd.testing.assert_frame_equal(again.table[:13], history.table, check_exact=True)
    assert not list(folder.glob(".*.part"))


@pytest.mark.parametrize(
    "change",
    [
        {"contact.load": "300 N"},
        {"surface.seed": 8},
        {"motion.rough": "second"},
        {"motion.start": "stationary"},
    ],
)
def test_a_folder_stores_one_history(tmp_path, change):
    run_history(case(), steps=1, out=tmp_path / "kept")
    with pytest.raises(BadInput, match="another case"):
        run_history(case(**change), steps=2, out=tmp_path / "kept")


def test_folders_without_history_are_left_unchanged(tmp_path):
    (tmp_path / "mine.txt").write_text("mine")
    with pytest.raises(BadInput, match="holds no history"):
        run_history(case(), steps=1, out=tmp_path)
    with pytest.raises(UnreadableFile, match=r"no manifest\.json"):
        load_history(tmp_path)


def test_a_damaged_state_file_is_reported(tmp_path):
    run_history(case(), steps=1, out=tmp_path / "kept")
    (tmp_path / "kept" / "memory.npz").write_bytes(b"half")
    with pytest.raises(UnreadableFile, match="damaged"):
        run_history(case(), steps=2, out=tmp_path / "kept")


@pytest.fixture
def fails_at_three(monkeypatch):
    """Model whose third step does not converge."""

    def steps(*arguments, **options):
        for snapshot in moving_contact(*arguments, **options):
            if snapshot.number == 3:
                ending = replace(
                    snapshot.solution.convergence, status=SolveStatus.OUT_OF_ITERATIONS
                )
                snapshot = replace(
                    snapshot, solution=replace(snapshot.solution, convergence=ending)
                )
            yield snapshot

    monkeypatch.setitem(MODELS, "mixed", steps)


@pytest.mark.usefixtures("fails_at_three")
def test_the_first_failed_step_stops_a_history_and_is_repeated(history, tmp_path, monkeypatch):
    with pytest.raises(NotConverged, match="step 3 of 5") as stopped:
        run_history(case(), steps=5, out=tmp_path / "kept")
    unfinished = stopped.value.solution
    assert unfinished.steps == 3
    assert unfinished.failed == (3,)
    assert unfinished.verdict().startswith("NOT CONVERGED at step 3")
    monkeypatch.setitem(MODELS, "mixed", moving_contact)
    again = run_history(case(), steps=5, out=tmp_path / "kept")
    pd.testing.assert_frame_equal(again.table, history.table[:6], check_exact=True)


@pytest.mark.usefixtures("fails_at_three")
def test_failed_steps_are_marked_if_the_history_continues():
    marked = run_history(case(), steps=5, strict=False)
    assert marked.steps == 5
    assert marked.failed == (3,)


def test_a_model_without_time_steps_is_refused(monkeypatch):
    monkeypatch.delitem(MODELS, "mixed")
    monkeypatch.setitem(MODELS, "another", moving_contact)
    with pytest.raises(BadInput, match="choose one of unified, paper, conserving, another"):
        run_history(case(), steps=1)


def test_passes_refer_to_the_rough_surface():
    chosen = case(**{"contact.slip": 0.2, "motion.rough": "second"})
    done = run_history(chosen, passes=0.1)
    assert done.steps == int(np.ceil(0.1 * 48 / 0.9))
    with pytest.raises(BadInput, match="leave one out"):
        run_history(chosen, passes=1.0, steps=3)


def test_passes_are_reported_separately_with_flattening():
    chosen = case(
        **{"motion.flattening": True, "material.hardness": "0.7 GPa", "contact.slip": 0.0}
    )
    done = run_history(chosen, steps=100)
    passes = done.by_pass()
    assert list(passes["pass"]) == [1, 2]
    table = done.table.set_index("step")
    assert passes["clr"][1] == pytest.approx(table["clr"].loc[49:96].mean())
    assert passes["track_sq_m"][0] == table["track_sq_m"].loc[48]
    assert passes["flattened_m"][1] > passes["flattened_m"][0] > 0.0
    assert len(done.scalars()["passes"]) == 2
    assert "Running-in, one point per pass" in render_motion_page(done)
    json.dumps(done.scalars(), allow_nan=False)


# Page and command


def test_the_page_has_every_map_and_loads_no_resources(history):
    page = render_motion_page(history)
    assert page == render_motion_page(history)
    data = json.loads(page.partition('id="data">')[2].partition("</script>")[0])
    assert len(data["frames"]) == len(data["captions"]) == 3
    assert data["size"] == [48, 32]
    assert "step 10 of 12" in data["captions"][2]
    without_data = re.sub(r'"data:[^"]*"', '"#"', page)
    assert not re.findall(r"""(?:src|href)=["'](?!#)|url\(|@import|fetch\(""", without_data)
    assert all(uri.startswith("data:image/png;base64,") for uri in data["frames"])


def test_a_picture_shows_the_contact_state_of_its_step(history):
    from io import BytesIO

    from PIL import Image

    from asperity.report.animated_maps import encode_frame, ranges
    from asperity.report.style import CONTACT_COLOUR

    frame = history.frames[1]
    packed, (width, height) = encode_frame(frame, ranges(history.case, history.frames))
    pixels = np.asarray(Image.open(BytesIO(packed)).convert("RGB"))
    assert pixels.shape == (3 * height, width, 3)
    yellow = np.array([int(CONTACT_COLOUR[k : k + 2], 16) for k in (1, 3, 5)])
    touching = np.all(pixels[2 * height :] == yellow, axis=2)
    np.testing.assert_array_equal(touching[::-1].T, frame.in_contact)


def test_the_command_runs_resumes_and_writes_the_page(tmp_path, capsys):
    arguments = ["run", "examples/paper.toml", "--out", str(tmp_path / "kept"), "--json"]
    for key, value in SMALL.items():
        arguments += ["--set", f"{key}={value}"]
    for steps, computed in ((3, 4), (5, 2)):
        with pytest.raises(SystemExit) as exit_info:
            main([*arguments, "--steps", str(steps), "--report", str(tmp_path / "page.html")])
        assert not exit_info.value.code
        summary = json.loads(capsys.readouterr().out)
        assert (summary["steps"], summary["computed"], summary["failed"]) == (steps, computed, [])
    assert (tmp_path / "page.html").stat().st_size > 10_000
    with pytest.raises(SystemExit) as exit_info:
        main(["report", str(tmp_path / "kept")])
    assert not exit_info.value.code
    assert (tmp_path / "kept" / "report.html").exists()


def test_the_command_reports_errors(capsys, tmp_path):
    for arguments in (
        ["--steps", "0"],
        ["--steps", "2", "--passes", "1"],
        ["--out", str(tmp_path), "--every", "0"],
    ):
        with pytest.raises(SystemExit) as exit_info:
            main(["run", "examples/paper.toml", *arguments])
        assert exit_info.value.code == 2
        output = capsys.readouterr()
        assert output.out == ""
        assert output.err.count("\n") == 1
