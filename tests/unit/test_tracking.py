"""Assembly of a series from its files: selection, order, search band and stored readings."""

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from asperity.case import load_case
from asperity.core.errors import BadInput, UnreadableFile
from asperity.coupling import search_band
from asperity.monitoring import TrackSettings, recordings_in, search_target, track_recordings
from asperity.monitoring.files import read_table
from asperity.monitoring.judgement import judge
from asperity.monitoring.reading import (
    common_spacing,
    pack_reading,
    read_spectrum,
    segment_length,
    unpack_reading,
)
from asperity.recording import ReadOptions

RATE = 20e3
CASE = load_case(Path(__file__).parents[2] / "examples" / "paper.toml")
TARGET = search_target(CASE)


def record(path, seed, *, level=1.0, seconds=2.0, rate=RATE, f0=3000.0):
    """Write noise filtered by an oscillator at f0, with rate and unit."""
    from scipy.signal import lfilter

    rng = np.random.default_rng(seed)
    noise = rng.standard_normal(round(seconds * rate))
    angle, decay = 2.0 * np.pi * f0 / rate, np.exp(-2.0 * np.pi * 0.02 * f0 / rate)
    ringing = lfilter([1.0], [1.0, -2.0 * decay * np.cos(angle), decay**2], noise)
    np.savez(path, acc=level * (ringing + noise), fs=rate, unit="m/s^2")
    return path


def test_recordings_of_a_folder_are_sorted_by_their_numbers(tmp_path):
    for name in (
        "r10.wav",
        "r9.wav",
        "r2.csv",
        "²r.csv",
        "²3.csv",
        "2003.10.22.12.06.24",
        ".hidden.wav",
        "r2.csv.toml",
        "page.html",
        "a.nc",
    ):
        (tmp_path / name).write_text("1\n2\n")
    (tmp_path / "table.csv").write_text("file,sq_um\nr2.csv,1\n")
    (tmp_path / "results").mkdir()
    names = [path.name for path in recordings_in([tmp_path, tmp_path / "r9.wav"])]
    assert names == ["2003.10.22.12.06.24", "r2.csv", "r9.wav", "r10.wav", "²3.csv", "²r.csv"]


def test_a_table_gives_the_x_of_recordings(tmp_path):
    path = tmp_path / "t.csv"
    path.write_text("file;sq_um;sq_um_std;load_n\na.wav;0,54;0,1;500\nb.wav;0,87;;\n")
    table = read_table(path)
    assert (table.x_name, table.places["a.wav"].x, table.places["a.wav"].x_std) == (
        "sq_um",
        0.54,
        0.1,
    )
    assert table.place(Path("there/b.wav")).x_std is None
    for text, message in (
        ("name,x\na,1\n", "needs a column file"),
        ("file,x\na,one\n", "line 2: x must be a number"),
        ("file,x,load_n,load_n\na,1,500,900\n", "has 2 columns load_n; leave all but one"),
        (f"file,x\n{'a' * 200_000},1\n", "cannot be read as a table"),
    ):
        path.write_text(text)
        with pytest.raises(BadInput, match=message):
            read_table(path)


def test_the_band_follows_from_the_contact_and_states_its_source():
    assert TARGET.band_hz == search_band(CASE.conditions, CASE.vibration)
    assert not TARGET.assumed
    given = search_target(None, (2e3, 3e3))
    assert (given.band_hz, given.full_load_crf_hz, given.assumed) == ((2e3, 3e3), None, False)
    default = search_target()
    assert default.assumed
    assert "give `case` or `band_hz`" in default.source
    assert search_target(CASE, (2e3, 3e3)).full_load_crf_hz == TARGET.full_load_crf_hz


def test_the_frequency_spacing_follows_from_the_record_length(tmp_path):
    short, long = (record(tmp_path / f"{s}.npz", 1, seconds=s) for s in (2.0, 40.0))
    assert common_spacing([long], ReadOptions(), TARGET) == 0.5
    assert common_spacing([short], ReadOptions(), TARGET) == 4.0
    assert segment_length(RATE, 0.5) == 40_000


def test_a_stored_reading_is_restored_completely(tmp_path):
    reading = read_spectrum(record(tmp_path / "a.npz", 1), ReadOptions(), TARGET, 4.0)
    packed = pack_reading(reading)
    restored = unpack_reading(packed, "stored")
    assert np.array_equal(restored.spectrum.density, reading.spectrum.density)
    assert np.array_equal(restored.spectrum.frequency_hz, reading.spectrum.frequency_hz)
    assert np.array_equal(restored.velocity, reading.velocity, equal_nan=True)
    assert replace(restored, spectrum=None, velocity=0.0) == replace(
        reading, spectrum=None, velocity=0.0
    )
    with pytest.raises(UnreadableFile, match="read again"):
        unpack_reading(packed[:500], "stored")
    with pytest.raises(UnreadableFile, match="stored is damaged"):
        unpack_reading(packed[:500] + b"x" + packed[501:], "stored")


def test_parallel_reading_gives_the_same_results(tmp_path, monkeypatch):
    files = [record(tmp_path / f"{k}.npz", k, f0=2500.0 + 100.0 * k) for k in range(7)]
    serial = track_recordings(files, case=CASE)
    monkeypatch.setattr("asperity.monitoring.reading.MIN_POOL_BYTES", 0)
    parallel = track_recordings(files, TrackSettings(workers=2), case=CASE)
    assert parallel.scalars() == serial.scalars()


def test_recordings_far_quieter_than_the_series_are_classed_as_machine_off(tmp_path):
    files = [record(tmp_path / f"{k}.npz", k, level=0.02 if k == 3 else 1.0) for k in range(7)]
    track = track_recordings(files, TrackSettings(method="likelihood"), case=CASE)
    reasons = [recording.resonance.reason for recording in track.recordings]
    assert "machine was off" in reasons[3]
    assert [recording.resonance.found for recording in track.recordings].count(False) == 1


def test_a_recording_with_another_sampling_rate_is_excluded_and_noted(tmp_path):
    files = [record(tmp_path / f"{k}.npz", k, rate=25e3 if k == 2 else RATE) for k in range(7)]
    track = track_recordings(files, TrackSettings(method="likelihood"), case=CASE)
    assert (
        "sampled at 25000 Hz where the series has 20000 Hz" in track.recordings[2].resonance.reason
    )
    assert any("1 of 7 recordings have another sampling rate" in note for note in track.notes)


def test_rates_that_differ_by_clock_drift_form_one_series(tmp_path):
    files = [record(tmp_path / f"{k}.npz", k, rate=RATE + 0.01 * k) for k in range(7)]
    track = track_recordings(files, TrackSettings(method="likelihood"), case=CASE)
    assert track.resonance_count == 7


def test_time_is_x_if_all_recordings_state_their_start(tmp_path):
    readings = [
        read_spectrum(record(tmp_path / f"{k}.npz", k), ReadOptions(), TARGET, 4.0)
        for k in range(3)
    ]
    timed = [
        replace(reading, started=f"2024-01-0{3 - k}T12:00:00") for k, reading in enumerate(readings)
    ]
    track = judge(timed, TARGET)
    assert (track.x_name, [recording.x for recording in track.recordings]) == (
        "time_h",
        [0.0, 24.0, 48.0],
    )
    assert Path(track.recordings[0].file).name == "2.npz"
    assert judge([timed[0], readings[1]], TARGET).x_name == "recording"


@pytest.mark.parametrize(
    ("starts", "hours"),
    [
        (
            ("02:30:00+02:00", "02:30:00+01:00"),
            1.0,
        ),  # 02:30 in summer time, and again after the change to winter time
        (("02:45:00+02:00", "02:15:00+01:00"), 0.5),
        (("02:15:00", "02:45:00"), 0.5),  # local times are taken as stated
    ],
)
def test_times_with_a_zone_are_distinguished_at_the_end_of_summer_time(tmp_path, starts, hours):
    for number, start in enumerate(starts):
        recording = record(tmp_path / f"{number}.npz", number)
        Path(f"{recording}.toml").write_text(f'started = "2024-10-27T{start}"\n', "utf-8")
    track = track_recordings(recordings_in([tmp_path]), case=CASE)
    assert (track.x_name, [recording.x for recording in track.recordings]) == (
        "time_h",
        [0.0, hours],
    )
    assert Path(track.recordings[0].file).name == "0.npz"


def test_few_recordings_are_judged_separately_with_a_note(tmp_path):
    track = track_recordings([record(tmp_path / "a.npz", 1)], case=CASE)
    assert (track.method, track.resonance_count) == ("modes", 0)
    assert re.search(
        r"a line at (2\d|30)\d\d Hz stands out, but a single spectrum cannot separate",
        track.verdict(),
    )
    assert any("needs 6 recordings, got 1" in note for note in track.notes)
    resonance = (
        track_recordings([tmp_path / "a.npz"], TrackSettings(method="likelihood"), case=CASE)
        .recordings[0]
        .resonance
    )
    assert resonance.crf_hz == pytest.approx(3000.0, rel=0.01)
    row = track_recordings(
        [tmp_path / "a.npz"], TrackSettings(method="likelihood"), case=CASE
    ).scalars()["recordings"][0]
    assert (
        row["damping_ratio"]
        == resonance.damping_ratio
        == pytest.approx(0.02, abs=4.0 * row["damping_std"])
    )
    assert 0.0 < row["damping_std"] < 0.004
    peak = track_recordings(
        [tmp_path / "a.npz"], TrackSettings(method="peak"), case=CASE
    ).scalars()["recordings"][0]
    assert (peak["damping_ratio"], peak["damping_std"]) == (None, None)
    with pytest.raises(BadInput, match="x needs one value for each of 1"):
        track_recordings([tmp_path / "a.npz"], case=CASE, x=[1.0, 2.0])
