"""How a series is put together: which files, which order, which band; what is kept of it."""

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
    """Noise through an oscillator at f0, kept with rate and unit."""
    from scipy.signal import lfilter

    rng = np.random.default_rng(seed)
    noise = rng.standard_normal(round(seconds * rate))
    turn, shrink = 2.0 * np.pi * f0 / rate, np.exp(-2.0 * np.pi * 0.02 * f0 / rate)
    ringing = lfilter([1.0], [1.0, -2.0 * shrink * np.cos(turn), shrink**2], noise)
    np.savez(path, acc=level * (ringing + noise), fs=rate, unit="m/s^2")
    return path


def test_a_folder_is_its_recordings_in_the_order_of_their_numbers(tmp_path):
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


def test_a_table_places_recordings(tmp_path):
    path = tmp_path / "t.csv"
    path.write_text("file;sq_um;sq_um_std;load_n\na.wav;0,54;0,1;500\nb.wav;0,87;;\n")
    table = read_table(path)
    assert (table.x_name, table.places["a.wav"].x, table.places["a.wav"].x_std) == (
        "sq_um",
        0.54,
        0.1,
    )
    assert table.place(Path("there/b.wav")).x_std is None
    for text, said in (
        ("name,x\na,1\n", "needs a column file"),
        ("file,x\na,one\n", "line 2: x must be a number"),
        ("file,x,load_n,load_n\na,1,500,900\n", "has 2 columns load_n; leave all but one"),
        (f"file,x\n{'a' * 200_000},1\n", "cannot be read as a table"),
    ):
        path.write_text(text)
        with pytest.raises(BadInput, match=said):
            read_table(path)


def test_the_band_is_the_contacts_and_its_origin_is_said():
    assert TARGET.band_hz == search_band(CASE.conditions, CASE.vibration)
    assert not TARGET.assumed
    given = search_target(None, (2e3, 3e3))
    assert (given.band_hz, given.full_load_crf_hz, given.assumed) == ((2e3, 3e3), None, False)
    nobody = search_target()
    assert nobody.assumed
    assert "give case or band_hz" in nobody.source
    assert search_target(CASE, (2e3, 3e3)).full_load_crf_hz == TARGET.full_load_crf_hz


def test_lines_are_as_fine_as_the_records_are_long(tmp_path):
    short, long = (record(tmp_path / f"{s}.npz", 1, seconds=s) for s in (2.0, 40.0))
    assert common_spacing([long], ReadOptions(), TARGET) == 0.5
    assert common_spacing([short], ReadOptions(), TARGET) == 4.0
    assert segment_length(RATE, 0.5) == 40_000


def test_a_reading_is_kept_in_full(tmp_path):
    readings = read_spectrum(record(tmp_path / "a.npz", 1), ReadOptions(), TARGET, 4.0)
    packed = pack_reading(readings)
    again = unpack_reading(packed, "kept")
    assert np.array_equal(again.spectrum.density, readings.spectrum.density)
    assert np.array_equal(again.spectrum.frequency_hz, readings.spectrum.frequency_hz)
    assert np.array_equal(again.velocity, readings.velocity, equal_nan=True)
    assert replace(again, spectrum=None, velocity=0.0) == replace(
        readings, spectrum=None, velocity=0.0
    )
    with pytest.raises(UnreadableFile, match="read again"):
        unpack_reading(packed[:500], "kept")
    with pytest.raises(UnreadableFile, match="kept is damaged"):
        unpack_reading(packed[:500] + b"x" + packed[501:], "kept")


def test_processes_read_what_one_alone_reads(tmp_path, monkeypatch):
    files = [record(tmp_path / f"{k}.npz", k, f0=2500.0 + 100.0 * k) for k in range(7)]
    alone = track_recordings(files, case=CASE)
    monkeypatch.setattr("asperity.monitoring.reading.MIN_POOL_BYTES", 0)
    together = track_recordings(files, TrackSettings(workers=2), case=CASE)
    assert together.scalars() == alone.scalars()


def test_recordings_far_quieter_than_the_series_are_off(tmp_path):
    files = [record(tmp_path / f"{k}.npz", k, level=0.02 if k == 3 else 1.0) for k in range(7)]
    track = track_recordings(files, TrackSettings(method="likelihood"), case=CASE)
    reasons = [one.resonance.reason for one in track.recordings]
    assert "machine was off" in reasons[3]
    assert [one.resonance.found for one in track.recordings].count(False) == 1


def test_another_sampling_rate_is_left_out_and_said(tmp_path):
    files = [record(tmp_path / f"{k}.npz", k, rate=25e3 if k == 2 else RATE) for k in range(7)]
    track = track_recordings(files, TrackSettings(method="likelihood"), case=CASE)
    assert (
        "sampled at 25000 Hz where the series has 20000 Hz" in track.recordings[2].resonance.reason
    )
    assert any("1 of 7 recordings have another sampling rate" in note for note in track.notes)


def test_rates_that_differ_by_a_clocks_drift_are_one_series(tmp_path):
    files = [record(tmp_path / f"{k}.npz", k, rate=RATE + 0.01 * k) for k in range(7)]
    track = track_recordings(files, TrackSettings(method="likelihood"), case=CASE)
    assert track.resonance_count == 7


def test_time_is_the_place_where_all_recordings_know_theirs(tmp_path):
    readings = [
        read_spectrum(record(tmp_path / f"{k}.npz", k), ReadOptions(), TARGET, 4.0)
        for k in range(3)
    ]
    timed = [replace(one, started=f"2024-01-0{3 - k}T12:00:00") for k, one in enumerate(readings)]
    track = judge(timed, TARGET)
    assert (track.x_name, [one.x for one in track.recordings]) == ("time_h", [0.0, 24.0, 48.0])
    assert Path(track.recordings[0].file).name == "2.npz"
    assert judge([timed[0], readings[1]], TARGET).x_name == "recording"


@pytest.mark.parametrize(
    ("starts", "hours"),
    [
        (
            ("02:30:00+02:00", "02:30:00+01:00"),
            1.0,
        ),  # half past two in summer time, and again when clocks went back
        (("02:45:00+02:00", "02:15:00+01:00"), 0.5),
        (("02:15:00", "02:45:00"), 0.5),  # as they stand, whatever the night
    ],
)
def test_times_with_a_zone_are_told_apart_when_clocks_go_back(tmp_path, starts, hours):
    for number, start in enumerate(starts):
        recording = record(tmp_path / f"{number}.npz", number)
        Path(f"{recording}.toml").write_text(f'started = "2024-10-27T{start}"\n', "utf-8")
    track = track_recordings(recordings_in([tmp_path]), case=CASE)
    assert (track.x_name, [one.x for one in track.recordings]) == ("time_h", [0.0, hours])
    assert Path(track.recordings[0].file).name == "0.npz"


def test_few_recordings_are_taken_one_by_one_and_that_is_said(tmp_path):
    track = track_recordings([record(tmp_path / "a.npz", 1)], case=CASE)
    assert (track.method, track.resonance_count) == ("modes", 0)
    assert re.search(
        r"a line at (2\d|30)\d\d Hz stands out, but a single spectrum cannot separate",
        track.verdict(),
    )
    assert any("needs 6 recordings and has 1" in note for note in track.notes)
    trusted = (
        track_recordings([tmp_path / "a.npz"], TrackSettings(method="likelihood"), case=CASE)
        .recordings[0]
        .resonance
    )
    assert trusted.crf_hz == pytest.approx(3000.0, rel=0.01)
    row = track_recordings(
        [tmp_path / "a.npz"], TrackSettings(method="likelihood"), case=CASE
    ).scalars()["recordings"][0]
    assert (
        row["damping_ratio"]
        == trusted.damping_ratio
        == pytest.approx(0.02, abs=4.0 * row["damping_std"])
    )
    assert 0.0 < row["damping_std"] < 0.004
    peak = track_recordings(
        [tmp_path / "a.npz"], TrackSettings(method="peak"), case=CASE
    ).scalars()["recordings"][0]
    assert (peak["damping_ratio"], peak["damping_std"]) == (None, None)
    with pytest.raises(BadInput, match="x needs one value for each of 1"):
        track_recordings([tmp_path / "a.npz"], case=CASE, x=[1.0, 2.0])
