"""Recordings of several sensors, laid beside one another and judged as one machine."""

import json

import numpy as np
import pytest

from asperity.core.errors import BadInput
from asperity.monitoring import TrackSettings, keep_track, store_overview, track_recordings
from asperity.recording import ReadOptions
from support.sensor_signals import BAND, RATE, TRUTH, sensor_signals


@pytest.fixture(scope="module")
def both(tmp_path_factory):
    """A folder of files with the channels a and b, of which b is dead in the folder `dead`."""
    folder = tmp_path_factory.mktemp("both")
    rng = np.random.default_rng(8)
    for name in ("whole", "dead", "apart"):
        (folder / name).mkdir()
    for number, f0 in enumerate(TRUTH):
        a, b = sensor_signals(rng, f0, (1.0, 0.6))
        facts = {"fs": RATE, "unit": "m/s^2"}
        np.savez(folder / "whole" / f"{number}.npz", a=a, b=b, **facts)
        np.savez(folder / "dead" / f"{number}.npz", a=a, b=1e-9 * np.ones_like(b), **facts)
        for name, values in (("a", a), ("b", b)):
            np.savez(folder / "apart" / f"{name}{number}.npz", acc=values, **facts)
    return folder


def test_channels_of_one_file_are_sensors_of_one_machine(both, tmp_path):
    track = track_recordings([both / "whole"], TrackSettings(channel="a, b", band_hz=BAND))
    assert len(track.recordings) == TRUTH.size
    assert "The line was detected on a and b in 8." in track.verdict()
    crf = [one.resonance.crf_hz for one in track.recordings]
    assert crf == pytest.approx(TRUTH, abs=12.0)
    row = json.loads(json.dumps(track.scalars()))["recordings"][0]
    assert [*row["sensors"]] == ["a", "b"]
    assert row["sensors"]["b"]["hears"] is True
    assert row["sensors"]["b"]["rms"] != row["sensors"]["a"]["rms"]
    assert {"rms_a", "rms_b", "hears_b"} <= set(track.table.columns)
    kept = keep_track(
        track, tmp_path / "asperity.db", ReadOptions(channel="a,b"), machine="rig", point="ring"
    )
    assert kept.alarm == track.alarm
    assert [one["sensor"] for one in store_overview(tmp_path / "asperity.db").rows] == ["a", "b"]


def test_files_of_sensors_are_laid_beside_one_another_by_a_table(both, tmp_path):
    rows = [
        f"{name}{number}.npz,{number + 0.5},{name}" for name in "ab" for number in range(TRUTH.size)
    ]
    (tmp_path / "table.csv").write_text("\n".join(["file,x,sensor", *rows]))
    by_table = track_recordings(
        [both / "apart"], TrackSettings(band_hz=BAND), table=tmp_path / "table.csv"
    )
    by_channel = track_recordings([both / "whole"], TrackSettings(channel="a,b", band_hz=BAND))
    assert [one.x for one in by_table.recordings] == [number + 0.5 for number in range(TRUTH.size)]
    assert [one.resonance.crf_hz for one in by_table.recordings] == pytest.approx(
        [one.resonance.crf_hz for one in by_channel.recordings], rel=1e-9
    )
    (tmp_path / "table.csv").write_text(
        "\n".join(["file,x,sensor", *rows[:-8], *(row[:-1] for row in rows[-8:])])
    )
    with pytest.raises(BadInput, match="others do not"):
        track_recordings(
            [both / "apart"], TrackSettings(band_hz=BAND), table=tmp_path / "table.csv"
        )


def test_a_sidecar_says_of_which_sensor_a_recording_is_and_when_it_began(both, tmp_path):
    for name in "ab":
        for number in range(TRUTH.size):
            to = tmp_path / f"{name}{number}.npz"
            to.write_bytes((both / "apart" / to.name).read_bytes())
            late = 1 if name == "b" else 0
            said = f'sensor = "{name}"\nstarted = "2025-03-0{number + 1} 12:00:0{late}"\n'
            to.with_suffix(".npz.toml").write_text(said)
    track = track_recordings([tmp_path], TrackSettings(band_hz=BAND))
    assert track.x_name == "time_h"
    assert [one.x for one in track.recordings] == pytest.approx(
        [24.0 * number for number in range(TRUTH.size)]
    )
    assert "on a and b in 8" in track.verdict()


def test_a_dead_sensor_is_told_and_the_other_goes_on(both):
    track = track_recordings([both / "dead"], TrackSettings(channel="a,b", band_hz=BAND))
    alone = track_recordings([both / "dead"], TrackSettings(channel="a", band_hz=BAND))
    assert "The line was detected on a in 8. Sensor b is not usable in 8 of 8:" in track.verdict()
    assert [one.resonance.crf_hz for one in track.recordings] == [
        one.resonance.crf_hz for one in alone.recordings
    ]
    assert track.alarm.state == alone.alarm.state != "blind"


def test_a_level_that_grows_on_the_other_sensor_is_heard(tmp_path):
    rng = np.random.default_rng(4)
    for number in range(24):
        a, b = sensor_signals(rng, 3000.0, (0.0, 0.0))
        louder = np.exp(0.3 * max(number - 12, 0))
        np.savez(tmp_path / f"{number:02d}.npz", a=a, b=louder * b, fs=RATE, unit="m/s^2")
    track = track_recordings([tmp_path], TrackSettings(channel="a,b", band_hz=BAND))
    assert track.alarm.state == "alarm"
    assert track.alarm.raised_by.endswith("on b")


@pytest.mark.parametrize(
    ("channel", "named"), [("a,c", "channel c cannot be read"), ("a,a", "names a channel twice")]
)
def test_channels_that_are_none_are_refused(both, channel, named):
    with pytest.raises(BadInput, match=named):
        track_recordings([both / "whole"], TrackSettings(channel=channel, band_hz=BAND))


def test_sensors_that_are_off_together_are_no_copies(both, tmp_path):
    for number in range(TRUTH.size):
        with np.load(both / "whole" / f"{number}.npz") as kept:
            running = 0.0 if number == 4 else 1.0
            np.savez(
                tmp_path / f"{number}.npz",
                a=running * kept["a"],
                b=running * kept["b"],
                fs=RATE,
                unit="m/s^2",
            )
    track = track_recordings([tmp_path], TrackSettings(channel="a,b", band_hz=BAND))
    assert "on a and b in 7" in track.verdict()
    assert [one.resonance.found for one in track.recordings] == [
        number != 4 for number in range(TRUTH.size)
    ]


def test_a_copy_is_no_second_sensor(tmp_path):
    rng = np.random.default_rng(1)
    for number, f0 in enumerate(TRUTH[:6]):
        (a,) = sensor_signals(rng, f0, (1.0,))
        np.savez(tmp_path / f"{number}.npz", a=a, b=a, fs=RATE, unit="m/s^2")
    with pytest.raises(BadInput, match="sensors a and b hold the same samples in 0"):
        track_recordings([tmp_path], TrackSettings(channel="a,b", band_hz=BAND))


def test_sensors_are_laid_beside_one_another_by_number_where_there_are_as_many(both, tmp_path):
    for name in "ab":
        for number in range(3):
            to = tmp_path / f"{name}{number}.npz"
            to.write_bytes((both / "apart" / to.name).read_bytes())
            to.with_suffix(".npz.toml").write_text(f'sensor = "{name}"\n')
    track = track_recordings([tmp_path], TrackSettings(band_hz=BAND))
    assert [one.x for one in track.recordings] == [1.0, 2.0, 3.0]
    assert [[*one.on_sensors] for one in track.recordings] == [["a", "b"]] * 3
    assert "needs 6 recordings of a sensor and has 3" in track.verdict()
    (tmp_path / "b2.npz").unlink()
    with pytest.raises(BadInput, match="3 of a, 2 of b"):
        track_recordings([tmp_path], TrackSettings(band_hz=BAND))


@pytest.mark.parametrize(
    ("x_name", "off", "together"),
    [("time_h", 0.5 / 3600.0, 8), ("sq_um", 1e-4, 8), ("sq_um", 0.2, 0)],
)
def test_x_that_are_one_but_for_a_clock_or_rounding_are_one(both, tmp_path, x_name, off, together):
    rows = [
        f"{name}{number}.npz,{number + off * (name == 'b')!r},{name}"
        for name in "ab"
        for number in range(TRUTH.size)
    ]
    (tmp_path / "table.csv").write_text("\n".join([f"file,{x_name},sensor", *rows]))
    track = track_recordings(
        [both / "apart"], TrackSettings(band_hz=BAND), table=tmp_path / "table.csv"
    )
    assert sum(len(one.on_sensors) == 2 for one in track.recordings) == together
    assert any("No recordings of two sensors have the same x" in note for note in track.notes) == (
        together == 0
    )


def test_a_file_that_nobody_knows_the_sensor_of_takes_no_place_from_another(both, tmp_path):
    for name in "ab":
        for number in range(TRUTH.size):
            to = tmp_path / f"{name}{number}.npz"
            to.write_bytes((both / "apart" / to.name).read_bytes())
            to.with_suffix(".npz.toml").write_text(f'sensor = "{name}"\n')
    (tmp_path / "a2b.npz").write_bytes(b"no recording")
    track = track_recordings([tmp_path], TrackSettings(band_hz=BAND))
    assert sum(len(one.on_sensors) == 2 for one in track.recordings) == TRUTH.size
    (tmp_path / "b4.npz").write_bytes(b"no recording, but its sidecar says whose")
    track = track_recordings([tmp_path], TrackSettings(band_hz=BAND))
    assert [
        one.on_sensors["b"].reading.refused for one in track.recordings if len(one.on_sensors) == 2
    ] == [number == 4 for number in range(TRUTH.size)]


def test_a_sensor_that_was_moved_is_noted_with_its_place(tmp_path, monkeypatch):
    """Where: tests/unit/test_series.py; here, what a track makes of it."""
    rng = np.random.default_rng(3)
    for number, f0 in enumerate(np.linspace(2900.0, 3750.0, 14)):
        (heard,) = sensor_signals(rng, f0, (1.0,))
        np.savez(tmp_path / f"{number:02d}.npz", acc=heard, fs=RATE, unit="m/s^2")
    assert not any(
        "mounting" in note
        for note in track_recordings([tmp_path], TrackSettings(band_hz=BAND)).notes
    )
    monkeypatch.setattr(
        "asperity.resonance.series.first_moved_recording",
        lambda blocks, _: 6 if len(blocks.density) == 14 else None,
    )
    track = track_recordings([tmp_path], TrackSettings(band_hz=BAND))
    (said,) = [note for note in track.notes if "mounting" in note]
    assert said.startswith("The sensor or its mounting changed at x = 7 (06.npz)")
    assert [number for number, one in enumerate(track.recordings) if one.remounted is not None] == [
        6
    ]
