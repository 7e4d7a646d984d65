"""Recordings of several sensors are matched and judged as one machine."""

import json

import numpy as np
import pytest

from asperity.core.errors import BadInput
from asperity.monitoring import TrackSettings, keep_track, store_overview, track_recordings
from asperity.recording import ReadOptions
from support.sensor_signals import BAND, RATE, TRUTH, sensor_signals

pytestmark = pytest.mark.usefixtures("coarse_search")


@pytest.fixture(scope="module")
def sensor_files(tmp_path_factory):
    """A folder of files with channels a and b; in the subfolder `dead`, channel b is dead."""
    folder = tmp_path_factory.mktemp("both")
    rng = np.random.default_rng(8)
    for name in ("channels", "dead", "files"):
        (folder / name).mkdir()
    for number, f0 in enumerate(TRUTH):
        a, b = sensor_signals(rng, f0, (1.0, 0.6))
        facts = {"fs": RATE, "unit": "m/s^2"}
        np.savez(folder / "channels" / f"{number}.npz", a=a, b=b, **facts)
        np.savez(folder / "dead" / f"{number}.npz", a=a, b=1e-9 * np.ones_like(b), **facts)
        for name, values in (("a", a), ("b", b)):
            np.savez(folder / "files" / f"{name}{number}.npz", acc=values, **facts)
    return folder


def test_channels_of_one_file_are_sensors_of_one_machine(sensor_files, tmp_path):
    track = track_recordings(
        [sensor_files / "channels"], TrackSettings(channel="a, b", band_hz=BAND)
    )
    assert len(track.recordings) == TRUTH.size
    assert "The line was detected on a and b in 8." in track.verdict()
    crf = [recording.resonance.crf_hz for recording in track.recordings]
    assert crf == pytest.approx(TRUTH, abs=12.0)
    row = json.loads(json.dumps(track.scalars()))["recordings"][0]
    assert [*row["sensors"]] == ["a", "b"]
    assert row["sensors"]["b"]["detects"] is True
    assert row["sensors"]["b"]["rms"] != row["sensors"]["a"]["rms"]
    assert {"rms_a", "rms_b", "detects_b"} <= set(track.table.columns)
    store_state = keep_track(
        track, tmp_path / "asperity.db", ReadOptions(channel="a,b"), machine="rig", point="ring"
    )
    assert store_state.alarm == track.alarm
    assert [row["sensor"] for row in store_overview(tmp_path / "asperity.db").rows] == ["a", "b"]


def test_files_of_sensors_are_matched_by_a_table(sensor_files, tmp_path):
    rows = [
        f"{name}{number}.npz,{number + 0.5},{name}" for name in "ab" for number in range(TRUTH.size)
    ]
    (tmp_path / "table.csv").write_text("\n".join(["file,x,sensor", *rows]))
    by_table = track_recordings(
        [sensor_files / "files"], TrackSettings(band_hz=BAND), table=tmp_path / "table.csv"
    )
    by_channel = track_recordings(
        [sensor_files / "channels"], TrackSettings(channel="a,b", band_hz=BAND)
    )
    assert [recording.x for recording in by_table.recordings] == [
        number + 0.5 for number in range(TRUTH.size)
    ]
    assert [recording.resonance.crf_hz for recording in by_table.recordings] == pytest.approx(
        [recording.resonance.crf_hz for recording in by_channel.recordings], rel=1e-9
    )
    (tmp_path / "table.csv").write_text(
        "\n".join(["file,x,sensor", *rows[:-8], *(row[:-1] for row in rows[-8:])])
    )
    with pytest.raises(BadInput, match="others do not"):
        track_recordings(
            [sensor_files / "files"], TrackSettings(band_hz=BAND), table=tmp_path / "table.csv"
        )


def test_a_sidecar_states_sensor_and_start_of_a_recording(sensor_files, tmp_path):
    for name in "ab":
        for number in range(TRUTH.size):
            target = tmp_path / f"{name}{number}.npz"
            target.write_bytes((sensor_files / "files" / target.name).read_bytes())
            delay_s = 1 if name == "b" else 0
            facts = f'sensor = "{name}"\nstarted = "2025-03-0{number + 1} 12:00:0{delay_s}"\n'
            target.with_suffix(".npz.toml").write_text(facts)
    track = track_recordings([tmp_path], TrackSettings(band_hz=BAND))
    assert track.x_name == "time_h"
    assert [recording.x for recording in track.recordings] == pytest.approx(
        [24.0 * number for number in range(TRUTH.size)]
    )
    assert "on a and b in 8" in track.verdict()


def test_a_dead_sensor_is_reported_and_does_not_affect_the_other(sensor_files):
    track = track_recordings([sensor_files / "dead"], TrackSettings(channel="a,b", band_hz=BAND))
    single = track_recordings([sensor_files / "dead"], TrackSettings(channel="a", band_hz=BAND))
    assert "The line was detected on a in 8. Sensor b is not usable in 8 of 8:" in track.verdict()
    assert [recording.resonance.crf_hz for recording in track.recordings] == [
        recording.resonance.crf_hz for recording in single.recordings
    ]
    assert track.alarm.state == single.alarm.state != "blind"


def test_a_rising_level_on_the_second_sensor_raises_an_alarm(tmp_path):
    rng = np.random.default_rng(4)
    for number in range(24):
        a, b = sensor_signals(rng, 3000.0, (0.0, 0.0))
        gain = np.exp(0.3 * max(number - 12, 0))
        np.savez(tmp_path / f"{number:02d}.npz", a=a, b=gain * b, fs=RATE, unit="m/s^2")
    track = track_recordings([tmp_path], TrackSettings(channel="a,b", band_hz=BAND))
    assert track.alarm.state == "alarm"
    assert track.alarm.raised_by.endswith("on b")


@pytest.mark.parametrize(
    ("channel", "message"), [("a,c", "channel c cannot be read"), ("a,a", "names a channel twice")]
)
def test_invalid_channels_are_refused(sensor_files, channel, message):
    with pytest.raises(BadInput, match=message):
        track_recordings([sensor_files / "channels"], TrackSettings(channel=channel, band_hz=BAND))


def test_sensors_that_are_both_off_are_not_taken_for_copies(sensor_files, tmp_path):
    for number in range(TRUTH.size):
        with np.load(sensor_files / "channels" / f"{number}.npz") as archive:
            running = 0.0 if number == 4 else 1.0
            np.savez(
                tmp_path / f"{number}.npz",
                a=running * archive["a"],
                b=running * archive["b"],
                fs=RATE,
                unit="m/s^2",
            )
    track = track_recordings([tmp_path], TrackSettings(channel="a,b", band_hz=BAND))
    assert "on a and b in 7" in track.verdict()
    assert [recording.resonance.found for recording in track.recordings] == [
        number != 4 for number in range(TRUTH.size)
    ]


def test_a_copy_of_a_sensor_is_refused(tmp_path):
    rng = np.random.default_rng(1)
    for number, f0 in enumerate(TRUTH[:6]):
        (a,) = sensor_signals(rng, f0, (1.0,))
        np.savez(tmp_path / f"{number}.npz", a=a, b=a, fs=RATE, unit="m/s^2")
    with pytest.raises(BadInput, match="sensors a and b hold the same samples in 0"):
        track_recordings([tmp_path], TrackSettings(channel="a,b", band_hz=BAND))


def test_sensors_with_equal_counts_are_matched_by_number(sensor_files, tmp_path):
    for name in "ab":
        for number in range(3):
            target = tmp_path / f"{name}{number}.npz"
            target.write_bytes((sensor_files / "files" / target.name).read_bytes())
            target.with_suffix(".npz.toml").write_text(f'sensor = "{name}"\n')
    track = track_recordings([tmp_path], TrackSettings(band_hz=BAND))
    assert [recording.x for recording in track.recordings] == [1.0, 2.0, 3.0]
    assert [[*recording.on_sensors] for recording in track.recordings] == [["a", "b"]] * 3
    assert "needs 6 recordings of a sensor and has 3" in track.verdict()
    (tmp_path / "b2.npz").unlink()
    with pytest.raises(BadInput, match="3 of a, 2 of b"):
        track_recordings([tmp_path], TrackSettings(band_hz=BAND))


@pytest.mark.parametrize(
    ("x_name", "offset", "matched"),
    [("time_h", 0.5 / 3600.0, 8), ("sq_um", 1e-4, 8), ("sq_um", 0.2, 0)],
)
def test_x_values_that_differ_by_clock_or_rounding_are_matched(
    sensor_files, tmp_path, x_name, offset, matched
):
    rows = [
        f"{name}{number}.npz,{number + offset * (name == 'b')!r},{name}"
        for name in "ab"
        for number in range(TRUTH.size)
    ]
    (tmp_path / "table.csv").write_text("\n".join([f"file,{x_name},sensor", *rows]))
    track = track_recordings(
        [sensor_files / "files"], TrackSettings(band_hz=BAND), table=tmp_path / "table.csv"
    )
    assert sum(len(recording.on_sensors) == 2 for recording in track.recordings) == matched
    assert any("No recordings of two sensors have the same x" in note for note in track.notes) == (
        matched == 0
    )


def test_a_file_of_an_unknown_sensor_does_not_affect_the_matching(sensor_files, tmp_path):
    for name in "ab":
        for number in range(TRUTH.size):
            target = tmp_path / f"{name}{number}.npz"
            target.write_bytes((sensor_files / "files" / target.name).read_bytes())
            target.with_suffix(".npz.toml").write_text(f'sensor = "{name}"\n')
    (tmp_path / "a2b.npz").write_bytes(b"no recording")
    track = track_recordings([tmp_path], TrackSettings(band_hz=BAND))
    assert sum(len(recording.on_sensors) == 2 for recording in track.recordings) == TRUTH.size
    (tmp_path / "b4.npz").write_bytes(b"no recording, but its sidecar names the sensor")
    track = track_recordings([tmp_path], TrackSettings(band_hz=BAND))
    assert [
        recording.on_sensors["b"].reading.refused
        for recording in track.recordings
        if len(recording.on_sensors) == 2
    ] == [number == 4 for number in range(TRUTH.size)]


def test_a_moved_sensor_is_noted_with_its_recording(tmp_path, monkeypatch):
    """The detection itself is tested in tests/unit/test_series.py."""
    rng = np.random.default_rng(3)
    for number, f0 in enumerate(np.linspace(2900.0, 3750.0, 14)):
        (signal,) = sensor_signals(rng, f0, (1.0,))
        np.savez(tmp_path / f"{number:02d}.npz", acc=signal, fs=RATE, unit="m/s^2")
    assert not any(
        "mounting" in note
        for note in track_recordings([tmp_path], TrackSettings(band_hz=BAND)).notes
    )
    monkeypatch.setattr(
        "asperity.resonance.series.first_moved_recording",
        lambda blocks, _: 6 if len(blocks.density) == 14 else None,
    )
    track = track_recordings([tmp_path], TrackSettings(band_hz=BAND))
    (moved,) = [note for note in track.notes if "mounting" in note]
    assert moved.startswith("The sensor or its mounting changed at x = 7 (06.npz)")
    assert [
        number
        for number, recording in enumerate(track.recordings)
        if recording.remounted is not None
    ] == [6]
