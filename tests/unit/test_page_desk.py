"""A contact without its widgets: answered twice, marked while it is old, compared, tried again,
taken away.
"""

import json
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
    NOT_DETERMINED,
    TILES,
    TOUCHING,
    difference,
    result_of_run,
)
from asperity.app.opening import open_page
from asperity.app.session import ContactSession
from asperity.app.settings import Settings, surface_key
from asperity.app.surface_store import SurfaceStore
from asperity.case import load_case
from asperity.contact.hertz import ellipse_pressure, line_pressure
from asperity.ehl import Options, solve_contact
from asperity.paper import papers_case
from asperity.report import write_report
from asperity.results import solve_case
from asperity.solution import contact_state
from asperity.surface import Surface

NOBODY = Ticket(-1, 0)
CELLS = {"grid.cells": [96, 64], "surface.correlation_length": "30 um", "vibration.duration": "1 s"}
MUTE = {**CELLS, "vibration": "none"}


class AtOnce:
    """Stands in for a queue: does the work when it is asked to, or keeps it."""

    def __init__(self):
        self.kept, self.held, self.going = [], False, False

    @property
    def busy(self):
        return bool(self.kept)

    def submit(self, wish, arrived):
        self.kept.append((wish, arrived))
        while self.kept and not self.held and not self.going:
            self.go()

    def go(self):
        (function, arguments), arrived = self.kept.pop(0)
        self.going = True
        arrived(run_job(function, NOBODY, *arguments))
        self.going = False

    def close(self):
        self.kept.clear()


@pytest.fixture(scope="module")
def run():
    return solve_case(papers_case().with_overrides(CELLS))


@pytest.fixture(scope="module")
def result(run):
    return result_of_run(run, 0.1)


def session_of(overrides=MUTE):
    drawn = []
    queue = AtOnce()
    session = ContactSession(
        Settings(papers_case().with_overrides(overrides)),
        queue,
        lambda: drawn.append(session.result),
    )
    return session, queue, drawn


def test_an_answer_is_what_the_run_says(run, result):
    summary = run.summary()
    assert {key: result.row[key] for key in TILES} == {key: summary[key] for key in TILES}
    np.testing.assert_allclose(result.pressure, run.solution.pressure, rtol=1e-6)
    np.testing.assert_array_equal(result.cells == TOUCHING, run.solution.in_contact)
    np.testing.assert_array_equal(result.cells == CAVITATED, run.solution.cavitated)
    assert result.verdict == run.verdict()
    assert set(run.notes) <= set(result.notes)


def test_tiles_have_the_intervals_that_the_verdict_has(run, result):
    uncertainties = {tile.key: tile.uncertainty for tile in result.tiles}
    assert uncertainties["clr"] in run.verdict()
    assert uncertainties["crf_hz"] in run.verdict()
    assert uncertainties["car"].startswith("± ")
    assert uncertainties["lambda_ratio"] == ""  # by a formula
    assert (
        uncertainties["friction_coefficient"]
        == uncertainties["flash_temperature_max_k"]
        == NOT_DETERMINED
    )


def test_a_grid_that_cannot_tell_says_so_in_the_tiles(result):
    assert {tile.key: tile.uncertainty for tile in replace(result, determined=False).tiles}[
        "clr"
    ] == NOT_DETERMINED
    unknown = replace(result, row={**result.row, "clr_low": None})
    assert {tile.key: tile.uncertainty for tile in unknown.tiles}["clr"] == NOT_DETERMINED
    wide = replace(result, row={**result.row, "car": 0.002, "car_error": 0.069})
    assert {tile.key: tile.uncertainty for tile in wide.tiles}[
        "car"
    ] == "0.0 to 7.1 %"  # and nothing below
    silent = replace(result, row={**result.row, "crf_hz": None})
    assert {tile.key: (tile.value, tile.uncertainty) for tile in silent.tiles}["crf_hz"] == (
        "–",
        "",
    )


def test_the_spectrum_is_the_runs_near_its_band(run, result):
    spectrum, full = result.spectrum, run.vibration.spectrum
    assert spectrum.crf_hz == run.vibration.resonance.crf_hz
    assert spectrum.frequency.size <= 500
    near = (full.frequency_hz >= spectrum.frequency[0]) & (
        full.frequency_hz <= spectrum.frequency[-1]
    )
    assert spectrum.density.mean() == pytest.approx(full.density[near].mean(), rel=0.02)
    peak = spectrum.frequency[np.argmax(spectrum.curve)]
    assert peak == pytest.approx(
        spectrum.crf_hz, abs=2.0 * float(np.diff(spectrum.frequency[:2])[0])
    )


def test_titles_that_follow_what_is_tried_have_room_on_a_phone(result):
    pytest.importorskip("panel")
    from asperity.app.contact_page import _spectrum_title
    from asperity.app.figures import TrialFigures

    trials = TrialFigures(lambda _: None)
    titles = [_spectrum_title(result), trials.share.title.text, trials.crf.title.text]
    assert titles[0].startswith("CRF ")
    assert f"fitted to ± {result.spectrum.crf_std_hz:.1f} Hz" in titles[0]
    assert max(map(len, titles)) <= 36  # of 390 pixels


def test_hertzs_pressure_carries_the_load():
    x = np.linspace(-1.2, 1.2, 1201)
    y = np.linspace(-2.4, 2.4, 1201)
    pressure = np.array([ellipse_pressure(x, float(at), (1.0, 2.0), 3.0) for at in y])
    assert pressure.sum() * (x[1] - x[0]) * (y[1] - y[0]) == pytest.approx(
        2.0 / 3.0 * np.pi * 2.0 * 3.0, rel=1e-4
    )
    np.testing.assert_allclose(
        ellipse_pressure(x, 0.0, (1.0, 2.0), 3.0), line_pressure(x, 1.0, 3.0)
    )
    assert not ellipse_pressure(x, 2.0, (1.0, 2.0), 3.0).any()


def test_a_line_contacts_profile_is_one_all_along(result):
    conditions = papers_case().conditions
    np.testing.assert_allclose(
        result.hertz(0),
        line_pressure(result.x, conditions.hertz.half_widths[0], conditions.hertz.p_max),
    )


def test_a_coarse_answer_comes_first_and_the_full_one_after_it():
    session, _, drawn = session_of()
    session.solve()
    shown = list({id(result): result for result in drawn if result is not None}.values())
    assert [result.coarse for result in shown] == [True, False]
    coarse, full = shown
    assert coarse.gap.shape == (48, 32)
    assert full.gap.shape == (96, 64)
    assert coarse.row["clr"] == pytest.approx(full.row["clr"], abs=0.15)
    assert all(tile.uncertainty in ("coarse solution", "") for tile in coarse.tiles)


def test_a_coarse_answer_goes_on_from_the_one_before():
    case = papers_case().with_overrides(MUTE)
    first = work.solve_coarsely(NOBODY, case, None)
    turned = case.with_overrides({"contact.load": "520 N"})
    cold = work.solve_coarsely(NOBODY, turned, None)
    warm = work.solve_coarsely(NOBODY, turned, first.solution)
    assert warm.solution.convergence.iterations < cold.solution.convergence.iterations / 2
    assert warm.result.row["clr"] == pytest.approx(cold.result.row["clr"], abs=0.02)
    other = case.with_overrides({"surface.seed": 99})
    assert work.solve_coarsely(NOBODY, other, first.solution).solution.convergence.iterations == (
        work.solve_coarsely(NOBODY, other, None).solution.convergence.iterations
    )


def test_a_coarse_answer_is_the_averaged_surfaces():
    case = papers_case().with_overrides(MUTE)
    coarse = work.solve_coarsely(NOBODY, case, None)
    fine = case.surface()
    along = (fine.heights[::2] + fine.heights[1::2]) / 2
    heights = (along[:, ::2] + along[:, 1::2]) / 2
    np.testing.assert_allclose(coarse.solution.surface.heights, heights)
    alone = Surface(heights, coarse.solution.grid)
    solved = solve_contact(case.conditions, case.lubricant, alone, options=Options())
    assert coarse.result.row["clr"] == pytest.approx(contact_state(solved).clr, abs=2e-3)


def test_a_coarse_answer_that_takes_too_many_steps_is_sought_on_fewer_cells(monkeypatch):
    case = papers_case().with_overrides({**MUTE, "grid.cells": [128, 128]})
    monkeypatch.setattr(work, "COLD_STEPS", 200)
    assert work.solve_coarsely(NOBODY, case, None).solution.grid.cells == (64, 64)
    monkeypatch.setattr(work, "COLD_STEPS", 2)
    monkeypatch.setattr(work, "COARSEST_CELLS", 48 * 48)
    monkeypatch.setattr(work, "COARSE_CELLS", 80 * 80)
    assert work.solve_coarsely(NOBODY, case, None).solution.grid.cells == (32, 32)
    monkeypatch.setattr(work, "COARSEST_STEPS", 2)
    assert work.solve_coarsely(NOBODY, case, None) == work.CoarseResult(None, None)


def test_cells_that_are_too_few_only_for_a_coarse_answer_refuse_nothing():
    session, _, _ = session_of({**MUTE, "grid.x": [-9.0, 3.0], "grid.cells": [96, 64]})
    session.solve()
    assert work.solve_coarsely(NOBODY, session.settings.case, None) == work.CoarseResult(None, None)
    assert session.status.startswith("Solved on 96 × 64 cells")


def test_a_contact_on_few_cells_has_no_coarse_answer():
    coarse = work.solve_coarsely(
        NOBODY, papers_case().with_overrides({**MUTE, "grid.cells": [64, 64]}), None
    )
    assert coarse == work.CoarseResult(None, None)


def test_what_is_shown_is_old_until_its_answer_has_come():
    session, queue, _ = session_of()
    session.solve()
    assert not session.stale
    queue.held = True
    session.change("contact.load", "600 N")
    assert session.stale
    assert session.status == "Solving ..."
    queue.go()
    assert session.status == "Coarse solution, refining ..."
    assert session.stale
    queue.go()
    assert not session.stale
    assert session.status.startswith("Solved on 96 × 64 cells")


@pytest.mark.parametrize("first", ["coarse", "full"])
def test_where_there_is_room_the_full_answer_does_not_wait_for_the_coarse_one(first):
    coarsely, fully = AtOnce(), AtOnce()
    coarsely.held = fully.held = fully.has_room = True
    session = ContactSession(
        Settings(papers_case().with_overrides(MUTE)), coarsely, lambda: None, fully
    )
    session.solve()
    assert (len(coarsely.kept), len(fully.kept)) == (1, 1)
    if first == "coarse":
        coarsely.go()
        assert (session.result.coarse, session.pending, len(fully.kept)) == (True, True, 1)
        fully.go()
    else:
        fully.go()
        assert not session.pending
        coarsely.go()
    assert (session.result.coarse, session.pending, len(session.trials)) == (False, False, 1)
    assert (coarsely.kept, fully.kept) == ([], [])


def test_an_answer_to_what_was_set_before_is_none_to_what_is_set_now():
    coarsely, fully = AtOnce(), AtOnce()
    coarsely.held = fully.held = fully.has_room = True
    session = ContactSession(
        Settings(papers_case().with_overrides(MUTE)), coarsely, lambda: None, fully
    )
    session.solve()
    coarsely.go()
    fully.has_room = False  # busy with what was set before
    session.change("contact.load", "600 N")
    fully.go()
    assert (session.pending, session.trials) == (True, [])
    coarsely.go()
    fully.go()
    assert (session.pending, session.result.text) == (False, session.settings.case.text)
    assert "600 N" in session.result.text


def test_without_room_the_full_answer_is_asked_for_after_the_coarse_one():
    coarsely, fully = AtOnce(), AtOnce()
    coarsely.held = fully.held = True
    fully.has_room = False
    session = ContactSession(
        Settings(papers_case().with_overrides(MUTE)), coarsely, lambda: None, fully
    )
    session.solve()
    assert fully.kept == []
    coarsely.go()
    assert len(fully.kept) == 1
    fully.go()
    assert not session.result.coarse


def test_a_wrong_value_keeps_its_sentence_and_marks_the_picture_until_it_is_mended():
    session, _, _ = session_of()
    session.solve()
    before = session.result
    session.change("contact.load", "600")
    assert "bare number 600" in session.rejected["contact.load"].message
    assert session.result is before
    assert session.stale
    session.change("contact.load", "500 N")  # as it was
    assert not session.rejected
    assert not session.stale


def test_a_contact_that_is_not_solved_says_so(monkeypatch):
    session, _, _ = session_of({**MUTE, "solver.max_iterations": 1})
    session.solve()
    assert session.status.startswith("NOT CONVERGED, do not use: out of iterations")
    assert session.trials == []
    monkeypatch.setattr(work, "TIME_LIMIT_S", -1.0)
    session.change("contact.load", "900 N")
    assert session.status.startswith("Not solved: No solution within")
    assert session.stale


def test_values_beyond_all_reckoning_are_a_sentence():
    def divided(ticket):  # noqa: ARG001
        return 1 / 0

    refused = run_job(divided, NOBODY)
    assert isinstance(refused, JobFailure)
    assert refused.message.startswith(
        "These values cannot be solved (division by zero). Undo the last change."
    )


def test_a_contact_that_its_grid_cannot_carry_says_so():
    session, _, _ = session_of()
    session.change("surface.correlation_length.0", "3 um")
    assert session.status.startswith("Not solved: paper.toml: surface: ")
    assert session.result is None


def test_what_is_pinned_stays_to_compare_with():
    session, queue, _ = session_of()
    session.solve()
    pinned = session.result
    session.pin()
    session.change("contact.load", "900 N")
    assert session.pinned is pinned
    change = session.result.row["clr"] - pinned.row["clr"]
    assert difference("clr", session.result.row["clr"], pinned.row["clr"]).startswith(
        "+" if change >= 0 else "−"
    )
    assert difference("crf_hz", None, 3.0) == "–"
    queue.held = True
    session.change("contact.load", "800 N")
    session.pin()  # not what is old
    assert session.pinned is pinned
    session.unpin()
    assert session.pinned is None


def test_what_was_tried_lies_in_the_trail_once_and_comes_back():
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


def test_an_address_is_gone_to():
    session, _, _ = session_of()
    turned = session.settings.with_value("contact.load", "700 N")
    assert session.go_to(turned.address) == []
    assert session.result.text == turned.case.text


def test_a_desk_that_closes_holds_nothing():
    session, _, _ = session_of()
    session.solve()
    session.pin()
    session.close()
    assert (session.result, session.pinned, session.trials) == (None, None, [])


def test_a_dropped_surface_takes_the_place_of_the_cases_own(tmp_path):
    heights = np.random.default_rng(5).standard_normal((400, 400)) * 1e-6
    x3pio.write(str(tmp_path / "ring.x3p"), heights, x_scale=2e-6, y_scale=2e-6)
    case, held, steps = work.open_surface(
        NOBODY, papers_case().with_overrides(MUTE), tmp_path / "ring.x3p"
    )
    assert case.contents.surface.name == "ring.x3p"
    assert steps[0] == "Measured surface ring.x3p:"
    assert surface_key(f"held={held}") == held
    assert len(steps) > 3
    text = take.case_text(case)
    assert "# Needs ring.x3p in the same folder." in text
    assert str(tmp_path) not in text
    assert load_case(text, folder=tmp_path).surface().sq == case.surface().sq


def test_a_dropped_surface_is_held_for_links_and_the_oldest_goes(tmp_path, monkeypatch):
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
            NOBODY, papers_case().with_overrides(MUTE), folder / "ring.x3p"
        )
        keys.append(key)
        monkeypatch.setattr("asperity.app.surface_store.MAX_SURFACES", 2)
        surfaces.add(key, case)
    assert len(set(keys)) == 3
    assert surfaces.load(keys[0], other) is None
    shutil.rmtree(session)  # the session that dropped it has gone
    lent = surfaces.load(keys[2], other)
    assert lent.text == case.text
    assert lent.folder.parent == other
    surfaces.close()
    assert lent.surface().sq > 0.0  # whose session goes on
    assert surfaces.load(keys[2], other) is None


@pytest.mark.parametrize(
    "content", [b"", b"PK\x03\x04 cut short", b"<script>", bytes(range(256)) * 20]
)
def test_a_damaged_surface_is_a_sentence(tmp_path, content):
    (tmp_path / "ring.x3p").write_bytes(content)
    refused = run_job(
        work.open_surface, NOBODY, papers_case().with_overrides(MUTE), tmp_path / "ring.x3p"
    )
    assert isinstance(refused, JobFailure)
    assert "ring.x3p" in refused.message


def test_what_is_taken_away_solves_to_the_same_numbers(tmp_path):
    case = papers_case().with_overrides(MUTE)
    (tmp_path / take.CASE_FILE).write_text(take.case_text(case), "utf-8")
    (tmp_path / take.SCRIPT).write_text(take.python_script(), "utf-8")
    said = subprocess.run(
        [sys.executable, take.SCRIPT], cwd=tmp_path, capture_output=True, text=True, check=True
    )
    state = solve_case(case).state
    assert f"CLR {state.clr:.4f}, CAR {state.car:.4f}, film {state.h_central:.4g} m" in said.stdout


def test_the_report_is_our_own_page():
    text = work.make_report(NOBODY, papers_case().with_overrides(MUTE), write_report)
    assert text.startswith("<!doctype html>")
    assert "Content-Security-Policy" in text


def test_a_kept_run_is_opened_as_it_was_solved(tmp_path, run, result):
    run.save(tmp_path / "run.nc")
    opened = open_page(tmp_path / "run.nc")
    assert opened.kind == "contact"
    assert json.dumps(opened.result.row) == json.dumps(result.row)
    assert opened.case.stored is not None
    turned = Settings(opened.case).with_value("contact.slip", "0.4")
    np.testing.assert_array_equal(turned.case.surface().heights, run.solution.surface.heights)
