"""Recordings from office programs and loggers of other locales; files that are no recordings."""

import zipfile
from datetime import datetime

import numpy as np
import pytest

from asperity.core.errors import UnreadableFile
from asperity.monitoring import TrackSettings, recordings_in, search_target, track_recordings
from asperity.monitoring.reading import read_spectrum
from asperity.recording import ReadOptions, read_recording

VALUES = np.round(300.0 * np.random.default_rng(2).standard_normal(60), 2)
VALUES[[7, 31]] = 1234.5, -2345.25  # with a thousands separator
GERMAN, ENGLISH = str.maketrans(",.", ".,"), {}


def rows(format_time, separator, translation):
    return "".join(
        f"{format_time(k)}{separator}{f'{value:,.2f}'.translate(translation)}\n"
        for k, value in enumerate(VALUES)
    )


@pytest.mark.parametrize(
    ("name", "text", "rate", "started"),
    [
        (
            "german-stamps.csv",
            "Zeit;Beschleunigung [m/s^2]\n"
            + rows(lambda k: f"31.01.2025 13:00:00,{4 * k:03}", ";", GERMAN),
            250.0,
            datetime(2025, 1, 31, 13),
        ),
        (
            "am-pm.csv",
            "Time\tacc [m/s^2]\n"
            + rows(lambda k: f"1/31/2025 1:00:00.{4 * k:03} PM", "\t", ENGLISH),
            250.0,
            datetime(2025, 1, 31, 13),
        ),
        (
            "abtastrate.csv",
            "Abtastrate [Hz];250\nNummer;a [m/s^2]\n" + rows(str, ";", GERMAN),
            250.0,
            None,
        ),
        (
            "kilohertz.csv",
            "Abtastfrequenz: 0,25 kHz\nNummer;a [m/s^2]\n" + rows(str, ";", GERMAN),
            250.0,
            None,
        ),
        (
            "labview.lvm",
            "LabVIEW Measurement\t\nDelta_X\t0.004000\t0.004000\nX_Value\tacc [m/s^2]\n"
            + rows(str, "\t", ENGLISH),
            250.0,
            None,
        ),
    ],
)
def test_text_of_another_locale_is_read_in_full(tmp_path, name, text, rate, started):
    (tmp_path / name).write_text(text, "utf-8")
    channel = {} if name[0] in "g" or name == "am-pm.csv" else {"channel": "2"}
    recording = read_recording(tmp_path / name, **channel)
    assert recording.rate_hz == pytest.approx(rate, rel=1e-9)
    assert np.allclose(recording.values, VALUES, rtol=1e-12)
    assert not recording.notes
    assert started is None or recording.facts["started"].value == started


def test_archives_are_refused_with_advice(tmp_path):
    for name, content, message in (
        ("rec.zip", "a.csv", "rec.zip is a zip archive of 1 files; unpack it"),
        (
            "rec.xlsx",
            "xl/workbook.xml",
            "is an Excel workbook; save the sheet that holds the recording as csv",
        ),
        ("book.csv", "xl/workbook.xml", "book.csv is an Excel workbook"),
    ):
        with zipfile.ZipFile(tmp_path / name, "w") as packed:
            packed.writestr(content, "1,2\n")
        with pytest.raises(UnreadableFile, match=message):
            read_recording(tmp_path / name)
    np.savez(tmp_path / "named.npz", acc=np.tile(VALUES, 40), fs=250.0, unit="m/s^2")
    (tmp_path / "named.npz").rename(tmp_path / "named.dat")
    assert np.array_equal(read_recording(tmp_path / "named.dat").values, np.tile(VALUES, 40))


def test_other_files_are_not_counted_as_recordings(tmp_path):
    for number in range(4):
        time_stamp = f"2024.01.31.{number:02}.00.00"
        np.savez(
            tmp_path / f"{time_stamp}.npz",
            acc=np.random.default_rng(number).standard_normal(4000),
            fs=4e3,
            unit="g",
        )
    for name in (
        "readme.txt",
        "Liesmich.txt",
        "2024.01.31.09.00.00.npz.filepart",
        "half.csv.crdownload",
    ):
        (tmp_path / name).write_text("1 2 3\n" * 50)
    assert len(recordings_in([tmp_path])) == 4
    (tmp_path / "0-notes.txt").write_text("Sensor 3 was moved on Monday.\n")
    (tmp_path / "2024.01.31.01.30.00.npz").write_bytes(b"cut")
    track = track_recordings([tmp_path], TrackSettings(band_hz=(500.0, 1500.0)))
    assert track.x_name == "time_h"
    x_by_file = {row["file"][-23:]: row["x"] for row in track.scalars()["recordings"]}
    assert sorted(x for x in x_by_file.values() if x is not None) == [0.0, 1.0, 2.0, 3.0]
    assert sum(x is None for x in x_by_file.values()) == 2


def test_bursts_of_lost_samples_add_neither_lines_nor_a_slope(tmp_path):
    """Held for 10 ms ten times a second (40 % of segments): the rest gives the undisturbed
    spectrum.
    """
    rng = np.random.default_rng(3)
    complete = rng.standard_normal(20 * 20_000)
    interrupted = complete.copy()
    for first in range(0, 2 * interrupted.size // 5, 2_000):
        interrupted[first : first + 200] = interrupted[first]
    densities = []
    for name, values in (("whole", complete), ("held", interrupted)):
        np.savez(tmp_path / f"{name}.npz", acc=values, fs=20e3, unit="m/s^2")
        reading = read_spectrum(
            tmp_path / f"{name}.npz", ReadOptions(), search_target(None, (2e3, 4e3)), 4.0
        )
        assert not reading.reason
        low = (reading.spectrum.frequency_hz > 4.0) & (reading.spectrum.frequency_hz < 100.0)
        densities.append(reading.spectrum.density[low])
    assert np.mean(densities[1]) == pytest.approx(np.mean(densities[0]), rel=0.15)
    assert np.max(densities[1]) < 2.0 * np.mean(densities[0])
    assert any(
        "4 % of the time: lost samples? Excluded" in remark for remark in reading.quality.remarks
    )
