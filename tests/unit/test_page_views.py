"""Recordings, studies and histories as the page shows them: what the command line says of the same
files.
"""

import os

import numpy as np
import pytest

from asperity.app.contact_jobs import JobFailure, Ticket, run_job
from asperity.app.contact_result import CAVITATED, TOUCHING
from asperity.app.folder_jobs import open_history, open_study, solve_row
from asperity.app.opening import open_page
from asperity.app.recording_jobs import RecordingInputs, track_files, track_folder
from asperity.core.signals import Signal
from asperity.monitoring import TrackSettings, track_recordings
from asperity.paper import papers_case
from asperity.simulation import run_history, run_wear
from asperity.study import load_study, plan_study, run_study
from asperity.vibration import ContactOscillator, acceleration, white_noise
from support.wearing import FEW, worn_case

NOBODY = Ticket(-1, 0)
SMALL = {"grid.cells": [32, 24], "surface.correlation_length": "40 um", "vibration": "none"}


@pytest.fixture(scope="module")
def rig(tmp_path_factory):
    return recordings(tmp_path_factory.mktemp("rig"))


def recordings(folder):
    """A series whose resonance rises, as npy files at 20 kHz."""
    for number, crf in enumerate((2600.0, 2800.0, 3000.0, 3200.0, 3400.0, 3600.0, 3700.0)):
        spring = ContactOscillator(
            mass=0.1, stiffness=0.1 * (2 * np.pi * crf) ** 2, damping_ratio=0.02, load=500.0
        )
        noise = Signal(white_noise(40_000, number) * 1e-7, 2e4, "m")
        values = (
            acceleration(spring, noise).values
            + np.random.default_rng(number).standard_normal(40_000) * 1e-3
        )
        np.save(folder / f"hour-{number}.npy", values)
    return folder


def test_dropped_recordings_are_heard_as_track_hears_them(rig):
    paths = sorted(rig.glob("*.npy"))
    series = track_files(NOBODY, paths, RecordingInputs(rate_hz=2e4, unit="m/s^2"), None)
    track = track_recordings(paths, TrackSettings(rate_hz=2e4, unit="m/s^2"))
    assert series.verdict == track.verdict()
    assert [row["crf_hz"] for row in series.rows] == [
        row.row()["crf_hz"] for row in track.recordings
    ]
    assert [row["file"] for row in series.rows] == [path.name for path in paths]
    assert series.levels.shape == (7, series.frequency.size)
    loudest = series.frequency[
        np.argmax(np.where(series.frequency > 2e3, series.levels, -np.inf), axis=1)
    ]
    np.testing.assert_allclose(loudest, [row["crf_hz"] for row in series.rows], atol=60.0)


def test_a_recording_that_does_not_say_its_rate_is_refused_in_the_pages_words(rig):
    refused = run_job(track_files, NOBODY, sorted(rig.glob("*.npy"))[:1], RecordingInputs(), None)
    assert isinstance(refused, JobFailure)
    assert "give the sampling rate" in refused.message
    assert "give rate_hz" not in refused.message


def test_a_folder_is_read_once_and_grows(rig, tmp_path):
    folder = tmp_path / "arriving"
    folder.mkdir()
    stated = RecordingInputs(rate_hz=2e4, unit="m/s^2", band_hz=(2e3, 4e3))
    assert track_folder(NOBODY, folder, tmp_path / "memory", stated, None) is None
    for number, path in enumerate(sorted(rig.glob("*.npy"))[:3], 1):
        arrived = folder / path.name
        arrived.write_bytes(path.read_bytes())
        os.utime(arrived, (1e9 + number, 1e9 + number))
        series = track_folder(NOBODY, folder, tmp_path / "memory", stated, None)
        assert len(series.rows) == number
    assert series.band_hz == (2e3, 4e3)


@pytest.fixture(scope="module")
def study(tmp_path_factory):
    folder = tmp_path_factory.mktemp("study") / "wear"
    case = papers_case().with_overrides(
        {**SMALL, "study": {"sq": ["0.5 um", "1.5 um"], "seeds": 2, "kind": "solve"}}
    )
    run_study(plan_study(case), out=folder, workers=1)
    return folder


def test_a_study_is_shown_by_its_rows_and_means(study):
    data = open_study(NOBODY, study)
    table = load_study(study).table
    assert [axis.key for axis in data.axes] == ["surface.sq"]
    assert data.axes[0].unit == "um"
    np.testing.assert_array_equal(data.outputs["clr"], table["clr"])
    x, mean, low, high = data.means["surface.sq", "clr"]
    np.testing.assert_allclose(x, [0.5, 1.5])
    np.testing.assert_allclose(mean, table.groupby("surface.sq", sort=False)["clr"].mean())
    assert (low <= mean).all()  # at 0.5 um no asperity touches on either surface
    assert low[1] < mean[1] < high[1]
    assert open_page(study).case.contents.surface.sq == 1e-6


def test_a_point_of_a_study_becomes_its_contact(study):
    data = open_study(NOBODY, study)
    for row, number in enumerate(data.numbers):
        result = solve_row(NOBODY, study, number)
        assert result.row["clr"] == pytest.approx(data.outputs["clr"][row], abs=1e-12)


def test_a_history_is_shown_by_its_steps_and_maps(tmp_path):
    kept = run_history(papers_case().with_overrides(SMALL), out=tmp_path / "moving", steps=6)
    history = open_history(NOBODY, tmp_path / "moving")
    assert history.verdict == kept.verdict()
    np.testing.assert_array_equal(history.curves["clr"], kept.table["clr"])
    assert history.names == tuple(f"Step {frame.number}" for frame in kept.frames)
    assert history.clock == "time_s"
    for contact_maps, frame in zip(history.maps, kept.frames, strict=True):
        np.testing.assert_array_equal(contact_maps.cells == TOUCHING, frame.in_contact)
        assert not (contact_maps.pressure[contact_maps.cells == CAVITATED] > 0.0).any()
    assert open_page(tmp_path / "moving").kind == "history"


def test_a_contact_that_wears_is_shown_by_its_hours_and_maps(tmp_path):
    kept = run_wear(worn_case(FEW), hours=0.2, out=tmp_path / "worn")
    history = open_history(NOBODY, tmp_path / "worn")
    assert (history.verdict, history.clock) == (kept.verdict(), "hours")
    np.testing.assert_array_equal(history.curves["sq_m"], kept.table["sq_m"])
    np.testing.assert_array_equal(history.time, kept.table["hours"])
    assert history.times == tuple(frame.hours for frame in kept.frames)
    for contact_maps, frame in zip(history.maps, kept.frames, strict=True):
        np.testing.assert_array_equal(contact_maps.cells == TOUCHING, frame.in_contact)
    assert open_page(tmp_path / "worn").kind == "history"


def test_a_folder_that_is_damaged_is_a_sentence(study, tmp_path):
    (tmp_path / "manifest.json").write_text(
        (study / "manifest.json").read_text("utf-8")[:200], "utf-8"
    )
    assert isinstance(run_job(open_study, NOBODY, tmp_path), JobFailure)
    assert isinstance(run_job(open_history, NOBODY, tmp_path), JobFailure)
