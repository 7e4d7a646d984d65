"""Recordings as offices and loggers of other countries write them, and files that are no recordings
at all.
"""

import zipfile
from datetime import datetime

import numpy as np
import pytest

from asperity.core.errors import UnreadableFile
from asperity.monitoring import TrackSettings, recordings_in, search_target, track_recordings
from asperity.monitoring.reading import read_spectrum
from asperity.recording import ReadOptions, read_recording

VALUES = np.round(300.0 * np.random.default_rng(2).standard_normal(60), 2)
VALUES[[7, 31]] = 1234.5, -2345.25  # with a separator of thousands
GERMAN, ENGLISH = str.maketrans(",.", ".,"), {}


def rows(stamp, separator, swap):
    return "".join(
        f"{stamp(k)}{separator}{f'{value:,.2f}'.translate(swap)}\n"
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
def test_a_text_of_another_country_is_read_in_full(tmp_path, name, text, rate, started):
    (tmp_path / name).write_text(text, "utf-8")
    channel = {} if name[0] in "g" or name == "am-pm.csv" else {"channel": "2"}
    recording = read_recording(tmp_path / name, **channel)
    assert recording.rate_hz == pytest.approx(rate, rel=1e-9)
    assert np.allclose(recording.values, VALUES, rtol=1e-12)
    assert not recording.notes
    assert started is None or recording.facts["started"].value == started


def test_archives_say_what_they_are_and_what_to_do(tmp_path):
    for name, inside, said in (
        ("rec.zip", "a.csv", "rec.zip is a zip archive of 1 files; unpack it"),
        (
            "rec.xlsx",
            "xl/workbook.xml",
            "is an Excel workbook; save the sheet that holds the recording as csv",
        ),
        ("book.csv", "xl/workbook.xml", "book.csv is an Excel workbook"),
    ):
        with zipfile.ZipFile(tmp_path / name, "w") as packed:
            packed.writestr(inside, "1,2\n")
        with pytest.raises(UnreadableFile, match=said):
            read_recording(tmp_path / name)
    np.savez(tmp_path / "named.npz", acc=np.tile(VALUES, 40), fs=250.0, unit="m/s^2")
    (tmp_path / "named.npz").rename(tmp_path / "named.dat")
    assert np.array_equal(read_recording(tmp_path / "named.dat").values, np.tile(VALUES, 40))


def test_what_is_no_recording_takes_no_place(tmp_path):
    for number in range(4):
        stamp = f"2024.01.31.{number:02}.00.00"
        np.savez(
            tmp_path / f"{stamp}.npz",
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
    placed = {row["file"][-23:]: row["x"] for row in track.scalars()["recordings"]}
    assert sorted(x for x in placed.values() if x is not None) == [0.0, 1.0, 2.0, 3.0]
    assert sum(x is None for x in placed.values()) == 2


def test_bursts_of_lost_samples_leave_neither_lines_nor_a_slope(tmp_path):
    """Held for 10 ms ten times a second, 40 % of the pieces: what is left has the spectrum of what
    was not lost.
    """
    rng = np.random.default_rng(3)
    whole = rng.standard_normal(20 * 20_000)
    held = whole.copy()
    for first in range(0, 2 * held.size // 5, 2_000):
        held[first : first + 200] = held[first]
    densities = []
    for name, values in (("whole", whole), ("held", held)):
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
        "4 % of the time: lost samples? Left out" in remark for remark in reading.quality.remarks
    )
