"""Recordings, studies and histories on the page agree with the command line on the same files."""

import os
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

from asperity.app.contact_jobs import JobFailure, Ticket, run_job
from asperity.app.contact_result import CAVITATED, TOUCHING
from asperity.app.folder_jobs import open_history, open_study, solve_row
from asperity.app.opening import open_page
from asperity.app.recording_jobs import RecordingContext, RecordingInputs, track_files, track_folder
from asperity.core.signals import Signal
from asperity.monitoring import TrackSettings, track_recordings
from asperity.paper import RigSettings, papers_case, simulate_rig, write_rig
from asperity.simulation import run_history, run_wear
from asperity.study import load_study, plan_study, run_study
from asperity.vibration import ContactOscillator, acceleration, white_noise
from support.wearing import FEW, worn_case

pytestmark = pytest.mark.usefixtures("coarse_search")

NO_SESSION = Ticket(-1, 0)
CONTEXT = RecordingContext()
SMALL = {"grid.cells": [32, 24], "surface.correlation_length": "40 um", "vibration": "none"}


@pytest.fixture(scope="module")
def rig(tmp_path_factory):
    return recordings(tmp_path_factory.mktemp("rig"))


def recordings(folder):
    """A series with rising resonance, as npy files at 20 kHz."""
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


def test_uploaded_recordings_give_the_same_results_as_track(rig):
    paths = sorted(rig.glob("*.npy"))
    series = track_files(NO_SESSION, paths, RecordingInputs(rate_hz=2e4, unit="m/s^2"), CONTEXT)
    track = track_recordings(paths, TrackSettings(rate_hz=2e4, unit="m/s^2"))
    assert series.verdict == track.verdict()
    assert [row["crf_hz"] for row in series.rows] == [
        row.row()["crf_hz"] for row in track.recordings
    ]
    assert [row["file"] for row in series.rows] == [path.name for path in paths]
    assert series.levels.shape == (7, series.frequency.size)
    peak_frequency = series.frequency[
        np.argmax(np.where(series.frequency > 2e3, series.levels, -np.inf), axis=1)
    ]
    np.testing.assert_allclose(peak_frequency, [row["crf_hz"] for row in series.rows], atol=60.0)


def test_a_recording_without_a_sampling_rate_is_refused_in_the_pages_words(rig):
    failure = run_job(
        track_files, NO_SESSION, sorted(rig.glob("*.npy"))[:1], RecordingInputs(), CONTEXT
    )
    assert isinstance(failure, JobFailure)
    assert "give the sampling rate" in failure.message
    assert "rate_hz`" not in failure.message


def test_a_folder_is_read_incrementally(rig, tmp_path):
    folder = tmp_path / "arriving"
    folder.mkdir()
    inputs = RecordingInputs(rate_hz=2e4, unit="m/s^2", band_hz=(2e3, 4e3))
    assert track_folder(NO_SESSION, folder, tmp_path / "memory", inputs, CONTEXT) is None
    for number, path in enumerate(sorted(rig.glob("*.npy"))[:3], 1):
        new_file = folder / path.name
        new_file.write_bytes(path.read_bytes())
        os.utime(new_file, (1e9 + number, 1e9 + number))
        series = track_folder(NO_SESSION, folder, tmp_path / "memory", inputs, CONTEXT)
        assert len(series.rows) == number
    assert series.band_hz == (2e3, 4e3)


@pytest.fixture(scope="module")
def study(tmp_path_factory):
    folder = tmp_path_factory.mktemp("study") / "wear"
    case = papers_case().with_overrides(
        {**SMALL, "study": {"sq": ["0.5 um", "1.5 um"], "seeds": 2, "kind": "solve"}}
    )
    with ThreadPoolExecutor(1) as executor:
        run_study(plan_study(case), out=folder, executor=executor)
    return folder


def test_a_study_is_shown_as_rows_and_means(study):
    data = open_study(NO_SESSION, study)
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


def test_a_point_of_a_study_opens_as_its_contact(study):
    data = open_study(NO_SESSION, study)
    for row, number in enumerate(data.numbers):
        result = solve_row(NO_SESSION, study, number)
        assert result.row["clr"] == pytest.approx(data.outputs["clr"][row], abs=1e-12)


def test_a_history_is_shown_by_steps_and_maps(tmp_path):
    stored = run_history(papers_case().with_overrides(SMALL), out=tmp_path / "moving", steps=6)
    history = open_history(NO_SESSION, tmp_path / "moving")
    assert history.verdict == stored.verdict()
    np.testing.assert_array_equal(history.curves["clr"], stored.table["clr"])
    assert history.names == tuple(f"Step {frame.number}" for frame in stored.frames)
    assert history.clock == "time_s"
    for contact_maps, frame in zip(history.maps, stored.frames, strict=True):
        np.testing.assert_array_equal(contact_maps.cells == TOUCHING, frame.in_contact)
        assert not (contact_maps.pressure[contact_maps.cells == CAVITATED] > 0.0).any()
    assert open_page(tmp_path / "moving").kind == "history"


def test_a_wear_history_is_shown_by_hours_and_maps(tmp_path):
    stored = run_wear(worn_case(FEW), hours=0.2, out=tmp_path / "worn")
    history = open_history(NO_SESSION, tmp_path / "worn")
    assert (history.verdict, history.clock) == (stored.verdict(), "hours")
    np.testing.assert_array_equal(history.curves["sq_m"], stored.table["sq_m"])
    np.testing.assert_array_equal(history.time, stored.table["hours"])
    assert history.times == tuple(frame.hours for frame in stored.frames)
    for contact_maps, frame in zip(history.maps, stored.frames, strict=True):
        np.testing.assert_array_equal(contact_maps.cells == TOUCHING, frame.in_contact)
    assert open_page(tmp_path / "worn").kind == "history"


def test_a_damaged_folder_is_reported_in_one_sentence(study, tmp_path):
    (tmp_path / "manifest.json").write_text(
        (study / "manifest.json").read_text("utf-8")[:200], "utf-8"
    )
    assert isinstance(run_job(open_study, NO_SESSION, tmp_path), JobFailure)
    assert isinstance(run_job(open_history, NO_SESSION, tmp_path), JobFailure)


def test_the_folder_of_a_rig_is_read_with_its_table_and_case(tmp_path):
    folder = tmp_path / "rig"
    write_rig(simulate_rig(RigSettings(samples=7, repeats=1, duration_s=2.0)), folder)
    for path in folder.iterdir():
        os.utime(path, (1e9, 1e9))
    opened = open_page(folder)
    assert (opened.kind, opened.table, opened.stated) == ("recordings", folder / "table.csv", True)
    context = RecordingContext(opened.case, opened.table)
    (tmp_path / "memory").mkdir()
    series = track_folder(NO_SESSION, folder, tmp_path / "memory", RecordingInputs(), context)
    track = track_recordings([folder], case=opened.case, table=opened.table)
    assert series.verdict == track.verdict()
    assert "Severe wear" in series.verdict
    assert (series.x_name, series.x_label, len(series.rows)) == ("sq_um", "Sq [µm]", 7)
