"""Metadata in files and tables are applied or refused, never ignored."""

from datetime import datetime

import h5py
import numpy as np
import pytest

from asperity.core.errors import BadInput, UnreadableFile
from asperity.monitoring import TrackSettings, track_recordings
from asperity.monitoring.files import read_table
from asperity.recording import check_recording, open_recording, read_recording
from asperity.recording.reader import parse_time


@pytest.mark.parametrize(
    "packed", [{"scale_factor": 0.01}, {"scale_factor": 0.01, "add_offset": 2.5}, {}]
)
def test_packed_values_are_unpacked(tmp_path, packed):
    stored = np.random.default_rng(0).integers(-900, 900, 4000).astype(np.int16)
    with h5py.File(tmp_path / "a.h5", "w") as file:
        data = file.create_dataset("acc", data=stored)
        data.attrs.update({"fs_hz": 20e3, "unit": "m/s^2"} | packed)
    read = read_recording(tmp_path / "a.h5")
    assert read.values == pytest.approx(
        stored * packed.get("scale_factor", 1.0) + packed.get("add_offset", 0.0)
    )


def test_an_invalid_packing_is_refused(tmp_path):
    with h5py.File(tmp_path / "a.h5", "w") as file:
        data = file.create_dataset("acc", data=np.ones(4000, np.int16))
        data.attrs.update({"fs_hz": 20e3, "unit": "m/s^2", "scale_factor": "one"})
    with pytest.raises(UnreadableFile, match="scale_factor"):
        read_recording(tmp_path / "a.h5")


def test_hours_across_a_clock_change_are_elapsed_hours():
    before, after = parse_time("2026-10-25T02:30:00+02:00"), parse_time("2026-10-25T02:30:00+01:00")
    assert (after - before).total_seconds() == 3600.0
    assert parse_time("2026-10-25T02:30:00") == datetime(2026, 10, 25, 2, 30)


def folders(tmp_path, rows):
    rng = np.random.default_rng(0)
    for name in ("one", "two"):
        (tmp_path / name).mkdir()
        np.savez(tmp_path / name / "a.npz", acc=rng.standard_normal(8000), fs=20e3, unit="m/s^2")
    (tmp_path / "table.csv").write_text("file,time_h\n" + rows)
    files = [tmp_path / name / "a.npz" for name in ("one", "two")]
    return files, read_table(tmp_path / "table.csv")


def test_files_of_one_name_are_distinguished_by_folder(tmp_path):
    files, table = folders(tmp_path, "one/a.npz,1\ntwo\\a.npz,7\n")
    assert [table.place(file).x for file in files] == [1.0, 7.0]
    track = track_recordings(files, TrackSettings(band_hz=(2e3, 4e3)), table=tmp_path / "table.csv")
    assert [recording.x for recording in track.recordings] == [1.0, 7.0]


def test_one_row_for_two_files_is_refused(tmp_path):
    files, _ = folders(tmp_path, "a.npz,7\n")
    with pytest.raises(BadInput, match=r"one row a.npz for 2 recordings.*with their folders"):
        track_recordings(files, TrackSettings(band_hz=(2e3, 4e3)), table=tmp_path / "table.csv")


def test_a_file_with_two_rows_is_refused(tmp_path):
    with pytest.raises(BadInput, match=r"line 3: a.npz has a row already"):
        folders(tmp_path, "a.npz,7\na.npz,8\n")


@pytest.mark.parametrize(
    ("column", "value", "bound"),
    [
        ("load_n", -5, "0"),
        ("speed_hz", 0, "0"),
        ("entrainment_m_s", -1, "0"),
        ("temperature_degc", -400, "-273.15"),
    ],
)
def test_impossible_table_values_are_refused(tmp_path, column, value, bound):
    table = tmp_path / "table.csv"
    table.write_text(f"file,x,{column}\na.npz,1,{value}\n")
    with pytest.raises(
        BadInput, match=rf"line 2: {column} must be above {bound}, got {value}; leave it empty"
    ):
        read_table(table)


def test_a_header_that_contradicts_its_times_is_reported(tmp_path):
    times = np.arange(4000) / 20e3
    lines = [
        f"{t:.6f},{v:.5f}"
        for t, v in zip(times, np.random.default_rng(0).standard_normal(4000), strict=True)
    ]
    path = tmp_path / "a.csv"
    path.write_text("\n".join(["sampling rate: 25600 Hz", "time [s],acc [m/s^2]", *lines]))
    read = read_recording(path)
    assert read.rate_hz == 20e3
    assert any(
        "its header states 25600 Hz" in note and "its times 20000 Hz" in note for note in read.notes
    )
    path.write_text("\n".join(["sampling rate: 20000 Hz", "time [s],acc [m/s^2]", *lines]))
    assert read_recording(path).notes == ()


@pytest.mark.parametrize(("moving", "usable"), [(40, False), (19_000, False), (21_000, True)])
def test_a_sensor_that_is_mostly_constant_is_dead(tmp_path, moving, usable):
    values = np.ones(40_000)
    values[:moving] = np.random.default_rng(0).standard_normal(moving)
    np.savez(tmp_path / "a.npz", acc=values, fs=20e3, unit="m/s^2")
    report = check_recording(open_recording(tmp_path / "a.npz"))
    assert (report.usable, report.dead) == (usable, not usable)
    sentences = report.remarks if usable else report.faults
    assert any("constant for" in sentence for sentence in sentences)
