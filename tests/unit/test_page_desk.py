"""Page state without widgets: coarse and full answers, stale marks, comparison, undo, export."""

import json
import re
import shutil
import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest
import x3pio

from asperity.app import contact_jobs as work
from asperity.app import export as take
from asperity.app.contact_jobs import JobFailure, Ticket, run_job
from asperity.app.contact_result import (
    CAVITATED,
    TILES,
    TOUCHING,
    difference,
    result_of_run,
    spectrum_title,
)
from asperity.app.opening import open_page
from asperity.app.session import ContactSession
from asperity.app.settings import Settings, surface_key
from asperity.app.surface_store import SurfaceStore
from asperity.case import load_case
from asperity.contact.hertz import ellipse_pressure, line_pressure
from asperity.core.quantities import UNKNOWN
from asperity.ehl import Options, solve_contact
from asperity.paper import papers_case
from asperity.report import write_report
from asperity.results import solve_case
from asperity.solution import contact_state
from asperity.surface import Surface

NO_SESSION = Ticket(-1, 0)
CELLS = {"grid.cells": [96, 64], "surface.correlation_length": "30 um", "vibration.duration": "1 s"}
MUTE = {**CELLS, "vibration": "none", "contact.roughness": "standing"}


class ImmediateQueue:
    """Queue stub: runs work immediately or holds it."""

    def __init__(self):
        self.pending, self.held, self.running = [], False, False

    @property
    def busy(self):
        return bool(self.pending)

    def submit(self, job, callback):
        self.pending.append((job, callback))
        while self.pending and not self.held and not self.running:
            self.run_next()

    def run_next(self):
        (function, arguments), callback = self.pending.pop(0)
        self.running = True
        callback(run_job(function, NO_SESSION, *arguments))
        self.running = False

    def close(self):
        self.pending.clear()


@pytest.fixture(scope="module")
def run():
    """Solve a contact with running roughness over 4 passages of the Hertz zone, not 6."""
    with pytest.MonkeyPatch.context() as patch:
        for module in ("results.running", "transient.running"):
            patch.setattr(f"asperity.{module}.PASSAGES", 4)
        return solve_case(papers_case().with_overrides({**CELLS, "solver.running_cells": 400}))


@pytest.fixture(scope="module")
def result(run):
    return result_of_run(run, 0.1)


def session_of(overrides=MUTE):
    drawn = []
    queue = ImmediateQueue()
    session = ContactSession(
        Settings(papers_case().with_overrides(overrides)),
        queue,
        lambda: drawn.append(session.result),
    )
    return session, queue, drawn


def test_an_answer_equals_the_run(run, result):
    summary = run.summary()
    assert {key: result.row[key] for key in TILES} == {key: summary[key] for key in TILES}
    np.testing.assert_allclose(result.pressure, run.solution.pressure, rtol=1e-6)
    np.testing.assert_array_equal(result.cells == TOUCHING, run.solution.in_contact)
    np.testing.assert_array_equal(result.cells == CAVITATED, run.solution.cavitated)
    assert result.verdict == run.verdict()
    assert set(run.notes) <= set(result.notes)


def test_tiles_show_the_intervals_of_the_verdict(run, result):
    uncertainties = {tile.key: tile.uncertainty for tile in result.tiles}
    assert uncertainties["clr"] in run.verdict()
    assert uncertainties["crf_hz"] in run.verdict()
    assert uncertainties["car"].startswith("± ")
    assert uncertainties["lambda_ratio"] == ""  # closed-form film
    assert re.fullmatch(r"0\.\d+ to 0\.\d+", uncertainties["friction_coefficient"])
    assert uncertainties["flash_temperature_max_k"] == UNKNOWN


def test_an_undetermined_resonance_is_stated_in_the_tiles(result):
    assert {tile.key: tile.uncertainty for tile in replace(result, determined=False).tiles}[
        "clr"
    ] == UNKNOWN
    unknown = replace(result, row={**result.row, "clr_low": None})
    assert {tile.key: tile.uncertainty for tile in unknown.tiles}["clr"] == UNKNOWN
    wide_interval = replace(result, row={**result.row, "car": 0.002, "car_error": 0.069})
    assert {tile.key: tile.uncertainty for tile in wide_interval.tiles}[
        "car"
    ] == "0.0 to 7.1 %"  # and no interval
    without_resonance = replace(result, row={**result.row, "crf_hz": None})
    assert {tile.key: (tile.value, tile.uncertainty) for tile in without_resonance.tiles}[
        "crf_hz"
    ] == (
        "–",
        "",
    )


def test_the_spectrum_is_that_of_the_run_around_its_band(run, result):
    spectrum, full_spectrum = result.spectrum, run.vibration.spectrum
    assert spectrum.crf_hz == run.vibration.resonance.crf_hz
    assert spectrum.frequency.size <= 500
    in_band = (full_spectrum.frequency_hz >= spectrum.frequency[0]) & (
        full_spectrum.frequency_hz <= spectrum.frequency[-1]
    )
    assert spectrum.density.mean() == pytest.approx(full_spectrum.density[in_band].mean(), rel=0.02)
    peak = spectrum.frequency[np.argmax(spectrum.curve)]
    assert peak == pytest.approx(
        spectrum.crf_hz, abs=2.0 * float(np.diff(spectrum.frequency[:2])[0])
    )


def test_titles_of_the_settings_fit_on_a_phone(result):
    pytest.importorskip("panel")
    from asperity.app.figures import TrialFigures

    trials = TrialFigures(lambda _: None)
    titles = [spectrum_title(result), trials.share.title.text, trials.crf.title.text]
    assert titles[0].startswith("CRF ")
    assert f"fitted to ± {result.spectrum.crf_std_hz:.1f} Hz" in titles[0]
    assert max(map(len, titles)) <= 36  # of 390 pixels


def test_the_hertz_pressure_carries_the_load():
    x = np.linspace(-1.2, 1.2, 1201)
    y = np.linspace(-2.4, 2.4, 1201)
    pressure = np.array([ellipse_pressure(x, float(y_value), (1.0, 2.0), 3.0) for y_value in y])
    assert pressure.sum() * (x[1] - x[0]) * (y[1] - y[0]) == pytest.approx(
        2.0 / 3.0 * np.pi * 2.0 * 3.0, rel=1e-4
    )
    np.testing.assert_allclose(
        ellipse_pressure(x, 0.0, (1.0, 2.0), 3.0), line_pressure(x, 1.0, 3.0)
    )
    assert not ellipse_pressure(x, 2.0, (1.0, 2.0), 3.0).any()


def test_a_line_contacts_profile_is_uniform_along_y(result):
    conditions = papers_case().conditions
    np.testing.assert_allclose(
        result.hertz(0),
        line_pressure(result.x, conditions.hertz.half_widths[0], conditions.hertz.p_max),
    )


def test_the_coarse_answer_precedes_the_full_answer():
    session, _, drawn = session_of()
    session.solve()
    results = list({id(result): result for result in drawn if result is not None}.values())
    assert [result.coarse for result in results] == [True, False]
    coarse, full = results
    assert coarse.gap.shape == (48, 32)
    assert full.gap.shape == (96, 64)
    assert coarse.row["clr"] == pytest.approx(full.row["clr"], abs=0.15)
    assert all(tile.uncertainty in ("coarse snapshot", "") for tile in coarse.tiles)


def test_a_coarse_answer_starts_from_the_previous_one():
    case = papers_case().with_overrides(MUTE)
    first = work.solve_coarsely(NO_SESSION, case, None)
    changed = case.with_overrides({"contact.load": "520 N"})
    cold = work.solve_coarsely(NO_SESSION, changed, None)
    warm = work.solve_coarsely(NO_SESSION, changed, first.solution)
    assert warm.solution.convergence.iterations < cold.solution.convergence.iterations / 2
    assert warm.result.row["clr"] == pytest.approx(cold.result.row["clr"], abs=0.02)
    other = case.with_overrides({"surface.seed": 99})
    assert work.solve_coarsely(
        NO_SESSION, other, first.solution
    ).solution.convergence.iterations == (
        work.solve_coarsely(NO_SESSION, other, None).solution.convergence.iterations
    )


def test_a_coarse_answer_uses_the_averaged_surface():
    case = papers_case().with_overrides(MUTE)
    coarse = work.solve_coarsely(NO_SESSION, case, None)
    fine = case.surface()
    averaged = (fine.heights[::2] + fine.heights[1::2]) / 2
    heights = (averaged[:, ::2] + averaged[:, 1::2]) / 2
    np.testing.assert_allclose(coarse.solution.surface.heights, heights)
    surface = Surface(heights, coarse.solution.grid)
    solved = solve_contact(case.conditions, case.lubricant, surface, options=Options())
    assert coarse.result.row["clr"] == pytest.approx(contact_state(solved).clr, abs=2e-3)


def test_a_coarse_answer_with_too_many_iterations_uses_fewer_cells(monkeypatch):
    case = papers_case().with_overrides({**MUTE, "grid.cells": [128, 128]})
    monkeypatch.setattr(work, "COLD_STEPS", 200)
    assert work.solve_coarsely(NO_SESSION, case, None).solution.grid.cells == (64, 64)
    monkeypatch.setattr(work, "COLD_STEPS", 2)
    monkeypatch.setattr(work, "COARSEST_CELLS", 48 * 48)
    monkeypatch.setattr(work, "COARSE_CELLS", 80 * 80)
    assert work.solve_coarsely(NO_SESSION, case, None).solution.grid.cells == (32, 32)
    monkeypatch.setattr(work, "COARSEST_STEPS", 2)
    assert work.solve_coarsely(NO_SESSION, case, None) == work.CoarseResult(None, None)


def test_cells_too_few_for_a_coarse_answer_only_are_accepted():
    session, _, _ = session_of({**MUTE, "grid.x": [-9.0, 3.0], "grid.cells": [96, 64]})
    session.solve()
    assert work.solve_coarsely(NO_SESSION, session.settings.case, None) == work.CoarseResult(
        None, None
    )
    assert session.status.startswith("Solved on 96 × 64 cells")


def test_a_contact_on_few_cells_has_no_coarse_answer():
    coarse = work.solve_coarsely(
        NO_SESSION, papers_case().with_overrides({**MUTE, "grid.cells": [64, 64]}), None
    )
    assert coarse == work.CoarseResult(None, None)


def test_results_are_stale_until_the_answer_arrives():
    session, queue, _ = session_of()
    session.solve()
    assert not session.stale
    queue.held = True
    session.change("contact.load", "600 N")
    assert session.stale
    assert session.status == "Solving ..."
    queue.run_next()
    assert session.status == "Coarse solution, refining ..."
    assert session.stale
    queue.run_next()
    assert not session.stale
    assert session.status.startswith("Solved on 96 × 64 cells")


@pytest.mark.parametrize("first", ["coarse", "full"])
def test_with_a_free_worker_the_full_answer_does_not_wait(first):
    coarse_queue, full_queue = ImmediateQueue(), ImmediateQueue()
    coarse_queue.held = full_queue.held = full_queue.has_room = True
    session = ContactSession(
        Settings(papers_case().with_overrides(MUTE)), coarse_queue, lambda: None, full_queue
    )
    session.solve()
    assert (len(coarse_queue.pending), len(full_queue.pending)) == (1, 1)
    if first == "coarse":
        coarse_queue.run_next()
        assert (session.result.coarse, session.pending, len(full_queue.pending)) == (True, True, 1)
        full_queue.run_next()
    else:
        full_queue.run_next()
        assert not session.pending
        coarse_queue.run_next()
    assert (session.result.coarse, session.pending, len(session.trials)) == (False, False, 1)
    assert (coarse_queue.pending, full_queue.pending) == ([], [])


def test_an_answer_to_earlier_settings_is_discarded():
    coarse_queue, full_queue = ImmediateQueue(), ImmediateQueue()
    coarse_queue.held = full_queue.held = full_queue.has_room = True
    session = ContactSession(
        Settings(papers_case().with_overrides(MUTE)), coarse_queue, lambda: None, full_queue
    )
    session.solve()
    coarse_queue.run_next()
    full_queue.has_room = False  # busy with the earlier settings
    session.change("contact.load", "600 N")
    full_queue.run_next()
    assert (session.pending, session.trials) == (True, [])
    coarse_queue.run_next()
    full_queue.run_next()
    assert (session.pending, session.result.text) == (False, session.settings.case.text)
    assert "600 N" in session.result.text


def test_without_a_free_worker_the_full_answer_follows_the_coarse_one():
    coarse_queue, full_queue = ImmediateQueue(), ImmediateQueue()
    coarse_queue.held = full_queue.held = True
    full_queue.has_room = False
    session = ContactSession(
        Settings(papers_case().with_overrides(MUTE)), coarse_queue, lambda: None, full_queue
    )
    session.solve()
    assert full_queue.pending == []
    coarse_queue.run_next()
    assert len(full_queue.pending) == 1
    full_queue.run_next()
    assert not session.result.coarse


def test_an_invalid_value_keeps_its_message_and_marks_the_figures_until_corrected():
    session, _, _ = session_of()
    session.solve()
    before = session.result
    session.change("contact.load", "600")
    assert "bare number 600" in session.rejected["contact.load"].message
    assert session.result is before
    assert session.stale
    session.change("contact.load", "500 N")  # unchanged
    assert not session.rejected
    assert not session.stale


def test_an_unsolved_contact_is_reported(monkeypatch):
    session, _, _ = session_of({**MUTE, "solver.max_iterations": 1})
    session.solve()
    assert session.status.startswith("NOT CONVERGED, do not use: out of iterations")
    assert session.trials == []
    monkeypatch.setattr(work, "TIME_LIMIT_S", -1.0)
    session.change("contact.load", "900 N")
    assert session.status.startswith("Not solved: No solution within")
    assert session.stale


def test_a_numerical_overflow_is_reported_in_one_sentence():
    def divided(ticket):  # noqa: ARG001
        return 1 / 0

    failure = run_job(divided, NO_SESSION)
    assert isinstance(failure, JobFailure)
    assert failure.message.startswith(
        "These values cannot be solved (division by zero). Undo the last change."
    )


def test_a_grid_too_small_for_the_load_is_reported():
    session, _, _ = session_of()
    session.change("surface.correlation_length.0", "3 um")
    assert session.status.startswith("Not solved: surface: correlation length")
    assert session.result is None


def test_a_value_far_beyond_its_slider_is_named_as_too_large():
    session, _, _ = session_of()
    session.change("contact.load", "1e9 N")
    assert session.status == (
        "Not solved: Normal load, F: 1e9 N is too large to be solved here; choose 50 N to 5000 N."
    )


def test_a_pinned_result_stays_for_comparison():
    session, queue, _ = session_of()
    session.solve()
    pinned_result = session.result
    session.pin()
    session.change("contact.load", "900 N")
    assert session.pinned is pinned_result
    change = session.result.row["clr"] - pinned_result.row["clr"]
    assert difference("clr", session.result.row["clr"], pinned_result.row["clr"]).startswith(
        "+" if change >= 0 else "−"
    )
    assert difference("crf_hz", None, 3.0) == "–"
    queue.held = True
    session.change("contact.load", "800 N")
    session.pin()  # not the stale result
    assert session.pinned is pinned_result
    session.unpin()
    assert session.pinned is None


def test_earlier_settings_are_in_the_history_once_and_can_be_restored():
    session, _, _ = session_of()
    session.solve()
    session.change("surface.sq", "2 um")
    session.change("contact.load", "900")
    assert [trial.sq for trial in session.trials] == pytest.approx([1e-6, 2e-6])
    assert session.trials[1].clr == session.result.row["clr"]
    session.go_back(0)
    assert session.settings.case.contents.surface.sq == 1e-6
    assert not session.rejected
    assert len(session.trials) == 2


def test_an_address_sets_the_case():
    session, _, _ = session_of()
    changed = session.settings.with_value("contact.load", "700 N")
    assert session.go_to(changed.address) == []
    assert session.result.text == changed.case.text


def test_a_closed_desk_holds_no_resources():
    session, _, _ = session_of()
    session.solve()
    session.pin()
    session.close()
    assert (session.result, session.pinned, session.trials) == (None, None, [])


def test_a_dropped_surface_replaces_the_cases_own(tmp_path):
    heights = np.random.default_rng(5).standard_normal((400, 400)) * 1e-6
    x3pio.write(str(tmp_path / "ring.x3p"), heights, x_scale=2e-6, y_scale=2e-6)
    case, key, steps = work.open_surface(
        NO_SESSION, papers_case().with_overrides(MUTE), tmp_path / "ring.x3p"
    )
    assert case.contents.surface.name == "ring.x3p"
    assert steps[0] == "Measured surface ring.x3p:"
    assert surface_key(f"held={key}") == key
    assert len(steps) > 3
    text = take.case_text(case)
    assert "# Needs ring.x3p in the same folder." in text
    assert str(tmp_path) not in text
    assert load_case(text, folder=tmp_path).surface().sq == case.surface().sq


def test_dropped_surfaces_are_held_for_links_and_the_oldest_is_removed(tmp_path, monkeypatch):
    rng = np.random.default_rng(5)
    session, other, surfaces = tmp_path / "one", tmp_path / "other", SurfaceStore()
    session.mkdir(), other.mkdir()
    keys = []
    for number in range(3):
        folder = session / str(number)
        folder.mkdir()
        x3pio.write(
            str(folder / "ring.x3p"),
            rng.standard_normal((300, 300)) * 1e-6,
            x_scale=2e-6,
            y_scale=2e-6,
        )
        case, key, _ = work.open_surface(
            NO_SESSION, papers_case().with_overrides(MUTE), folder / "ring.x3p"
        )
        keys.append(key)
        monkeypatch.setattr("asperity.app.surface_store.MAX_SURFACES", 2)
        surfaces.add(key, case)
    assert len(set(keys)) == 3
    assert surfaces.load(keys[0], other) is None
    shutil.rmtree(session)  # the session that dropped it has ended
    loaded = surfaces.load(keys[2], other)
    assert loaded.text == case.text
    assert loaded.folder.parent == other
    surfaces.close()
    assert loaded.surface().sq > 0.0  # whose session is still active
    assert surfaces.load(keys[2], other) is None


@pytest.mark.parametrize(
    "content", [b"", b"PK\x03\x04 cut short", b"<script>", bytes(range(256)) * 20]
)
def test_a_damaged_surface_is_reported_in_one_sentence(tmp_path, content):
    (tmp_path / "ring.x3p").write_bytes(content)
    failure = run_job(
        work.open_surface, NO_SESSION, papers_case().with_overrides(MUTE), tmp_path / "ring.x3p"
    )
    assert isinstance(failure, JobFailure)
    assert "ring.x3p" in failure.message


def test_the_exported_case_gives_the_same_numbers(tmp_path):
    case = papers_case().with_overrides(MUTE)
    (tmp_path / take.CASE_FILE).write_text(take.case_text(case), "utf-8")
    (tmp_path / take.SCRIPT).write_text(take.python_script(), "utf-8")
    completed = subprocess.run(
        [sys.executable, take.SCRIPT], cwd=tmp_path, capture_output=True, text=True, check=True
    )
    state = solve_case(case).state
    assert (
        f"CLR {state.clr:.4f}, CAR {state.car:.4f}, film {state.h_central:.4g} m"
        in completed.stdout
    )


def test_the_report_is_the_report_page(monkeypatch):
    monkeypatch.setattr("asperity.report.base.svg", lambda _: "<svg/>")
    text = work.make_report(NO_SESSION, papers_case().with_overrides(MUTE), write_report)
    assert text.startswith("<!doctype html>")
    assert "Content-Security-Policy" in text


def test_a_stored_run_opens_as_solved(tmp_path, run, result):
    run.save(tmp_path / "run.nc")
    opened = open_page(tmp_path / "run.nc")
    assert opened.kind == "contact"
    assert json.dumps(opened.result.row) == json.dumps(result.row)
    assert opened.case.text == run.case.text


def test_a_stored_snapshot_keeps_its_surface(tmp_path):
    run = solve_case(papers_case().with_overrides(MUTE))
    run.save(tmp_path / "run.nc")
    opened = open_page(tmp_path / "run.nc")
    assert opened.case.stored is not None
    changed = Settings(opened.case).with_value("contact.slip", "0.4")
    np.testing.assert_array_equal(changed.case.surface().heights, run.solution.surface.heights)
