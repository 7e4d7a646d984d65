"""Dates in file names whose order of day and month is ambiguous, and the order of recordings."""

import os
from datetime import datetime

import numpy as np
import pytest

from asperity.monitoring import TrackSettings, check_recordings, recordings_in, track_recordings
from asperity.recording.file_dates import name_order_remark

DAY_FIRST = ["05-11-2024_1405.npz", "09-11-2024_1405.npz", "03-12-2024_1405.npz"]  # in time
BAND = (2000.0, 4000.0)


def write(folder, names, times=None, started=None):
    """Write recordings with these times of change; one month per file in order by default."""
    for number, name in enumerate(names):
        values = np.random.default_rng(number).standard_normal(8000)
        facts = {} if started is None else {"started": f"2024-{number + 1:02}-01 12:00:00"}
        np.savez(folder / name, acc=values, fs=20e3, unit="m/s^2", **facts)
        changed = (times or [datetime(2024, n + 1, 1) for n in range(len(names))])[number]
        os.utime(folder / name, (changed.timestamp(),) * 2)
    return recordings_in([folder])


def test_day_first_names_out_of_order_are_remarked_in_check_and_track(tmp_path):
    write(tmp_path, DAY_FIRST)
    remark = (
        "names such as 03-12-2024_1405.npz begin their date with the day, by their times of "
        "change, and recordings in order of names are not in order of time; state `started` in "
        "sidecars, or name files by year, month and day"
    )
    checks = check_recordings([tmp_path], band_hz=BAND)
    assert all(remark in checked.quality.remarks for checked in checks.checked)
    track = track_recordings([tmp_path], TrackSettings(band_hz=BAND))
    assert f"{remark[:1].upper()}{remark[1:]}." in track.notes


@pytest.mark.parametrize(
    ("names", "times", "part"),
    [
        # the times of change are those of a copy: neither reading agrees
        (DAY_FIRST, [datetime(2025, 1, 1)] * 3, "03-12-2024 in names such as 03-12-2024_1405.npz"),
        (DAY_FIRST, [datetime(2025, 1, k) for k in (3, 1, 2)], "agree with neither"),
        # a day above 12 excludes months first, whatever the times of change are
        (
            ["25-11-2024.npz", "03-12-2024.npz"],
            [datetime(2025, 1, 1)] * 2,
            "with the day, by",
        ),
        (["11-25-2024.npz", "03-12-2025.npz"], [datetime(2025, 1, 1)] * 2, "with the month, by"),
    ],
)
def test_what_is_known_of_the_order_is_stated(tmp_path, names, times, part):
    assert part in name_order_remark(write(tmp_path, names, times))


@pytest.mark.parametrize(
    "names",
    [
        ["2024-11-05_1405.npz", "2024-11-09_1405.npz", "2024-12-03_1405.npz"],
        ["03-11-2024.npz", "04-11-2024.npz", "05-11-2024.npz"],  # in order either way
        ["a1.npz", "a2.npz", "a3.npz"],
        ["11-05-2024.npz", "11-09-2024.npz", "12-03-2024.npz"],  # months, by times of change
        ["03-12-2024.npz", "b.npz"],
        ["31-31-2024.npz", "30-30-2024.npz"],  # no dates
    ],
)
def test_names_in_order_have_no_remark(tmp_path, names):
    assert name_order_remark(write(tmp_path, names)) == ""


def test_recordings_that_state_their_start_have_no_remark(tmp_path):
    write(tmp_path, DAY_FIRST, started=True)
    track = track_recordings([tmp_path], TrackSettings(band_hz=BAND))
    assert not any("in order of names" in note for note in track.notes)
    checks = check_recordings([tmp_path], band_hz=BAND)
    assert all(checked.quality.remarks == () for checked in checks.checked)
