"""Watching several sensors of one machine: judged together on arrival and stored by name."""

import json
import shutil
import sqlite3
from contextlib import closing
from dataclasses import fields
from datetime import UTC, datetime, timedelta
from io import BytesIO

import numpy as np
import pytest

from asperity.core.errors import BadInput
from asperity.core.storage import append_digest
from asperity.monitoring import (
    TrackSettings,
    WatchSettings,
    acknowledge_in,
    keep_track,
    store_overview,
    track_recordings,
    watch_folder,
)
from asperity.monitoring.series_state import pack_shared, unpack_shared
from asperity.monitoring.simultaneous import TimedRecording, match_times
from asperity.recording import ReadOptions
from support.sensor_signals import BAND, RATE, TRUTH, sensor_signals

pytestmark = pytest.mark.usefixtures("coarse_search")

SINGLE_PRECISION = 1e-8  # effect on CRF of spectra stored in single precision
START = datetime(2025, 3, 1, 12, tzinfo=UTC)


@pytest.fixture(scope="module")
def machine(tmp_path_factory):
    """Files with the channels a and b, and the same data as single files with a sidecar that states
    sensor and start.
    """
    folder = tmp_path_factory.mktemp("machine")
    rng = np.random.default_rng(8)
    for name in ("channels", "files"):
        (folder / name).mkdir()
    for number, f0 in enumerate(np.append(TRUTH, 3800.0)):
        signals = dict(zip("ab", sensor_signals(rng, f0, (1.0, 0.6)), strict=True))
        np.savez(folder / "channels" / f"{number}.npz", **signals, fs=RATE, unit="m/s^2")
        for delay_s, (name, values) in enumerate(signals.items()):
            np.savez(folder / "files" / f"{name}{number}.npz", acc=values, fs=RATE, unit="m/s^2")
            start = START + timedelta(days=number, seconds=delay_s)
            facts = f'sensor = "{name}"\nstarted = "{start}"\n'
            (folder / "files" / f"{name}{number}.npz.toml").write_text(facts)
    return folder


def arrive(machine, folder, *names):
    folder.mkdir(exist_ok=True)
    for name in names:
        shutil.copy(machine / ("files" if name[0] in "ab" else "channels") / f"{name}.npz", folder)
        sidecar = machine / "files" / f"{name}.npz.toml"
        if sidecar.is_file():
            shutil.copy(sidecar, folder)


def watch(tmp_path, table=None, **changes):
    names = {field.name for field in fields(TrackSettings)}
    tracking = {"band_hz": BAND} | {k: v for k, v in changes.items() if k in names}
    watching = {
        "poll_interval_s": 0.0,
        "settle_time_s": 0.0,
        "machine": "rig",
        "point": "ring",
    } | {k: v for k, v in changes.items() if k not in names}
    return watch_folder(
        tmp_path / "in",
        tmp_path / "out",
        TrackSettings(**tracking),
        WatchSettings(**watching),
        table=table,
    )


def query_store(tmp_path, query):
    with closing(sqlite3.connect(tmp_path / "out" / "asperity.db")) as connection:
        return connection.execute(query).fetchall()


def crf(track):
    return [recording.resonance.crf_hz for recording in track.recordings]


PER_SENSOR = (
    "SELECT sensor.name, count(*) FROM recording JOIN sensor ON sensor.id = recording.sensor GROUP"
    " BY 1"
)


def test_channels_are_judged_as_by_track_and_stored_by_their_names(machine, tmp_path):
    arrive(machine, tmp_path / "in", *"01234567")
    updates = watch(tmp_path, channel="a, b")
    first = next(updates)
    arrive(machine, tmp_path / "in", "8")
    latest = next(updates)
    updates.close()
    tracked = track_recordings([tmp_path / "in"], TrackSettings(channel="a,b", band_hz=BAND))
    assert [reading.sensor for reading in latest.new] == ["a", "b"]
    assert len(first.track.recordings) == 8
    assert crf(latest.track) == pytest.approx(crf(tracked), rel=SINGLE_PRECISION)
    assert latest.track.verdict() == tracked.verdict()
    assert "The line was detected on a and b in 9." in latest.track.verdict()
    assert query_store(tmp_path, PER_SENSOR) == [("a", 9), ("b", 9)]
    rms = query_store(
        tmp_path, "SELECT sensor, rms FROM trend WHERE file LIKE '%/0.npz' ORDER BY sensor"
    )
    on_sensors = tracked.recordings[0].on_sensors
    assert rms == [(name, pytest.approx(on_sensors[name].reading.quality.rms)) for name in "ab"]
    reused = next(watch(tmp_path, channel="a,b", once=True, reuse_judgement=True))
    assert (reused.track, reused.judgement) == (
        None,
        json.loads(json.dumps(latest.track.scalars(all_sources=False))),
    )
    store_state = keep_track(
        tracked,
        tmp_path / "out" / "asperity.db",
        ReadOptions(channel="a,b"),
        machine="rig",
        point="ring",
    )
    assert store_state.alarm == tracked.alarm
    assert query_store(tmp_path, PER_SENSOR) == [
        ("a", 9),
        ("b", 9),
    ]  # track and watch store the same


def test_files_of_sensors_are_matched_as_they_arrive(machine, tmp_path):
    arrive(
        machine,
        tmp_path / "in",
        *(f"a{number}" for number in range(9)),
        *(f"b{number}" for number in range(7)),
    )
    updates = watch(tmp_path)
    next(updates)
    arrive(machine, tmp_path / "in", "b8", "b7")
    latest = next(updates).track
    tracked = track_recordings([tmp_path / "in"], TrackSettings(band_hz=BAND))
    assert [recording.x for recording in latest.recordings] == pytest.approx(
        [24.0 * number for number in range(9)]
    )
    assert [[*recording.on_sensors] for recording in latest.recordings] == [["a", "b"]] * 9
    assert crf(latest) == pytest.approx(crf(tracked), rel=SINGLE_PRECISION)
    assert latest.verdict() == tracked.verdict()
    assert query_store(tmp_path, PER_SENSOR) == [("a", 9), ("b", 9)]


def test_the_reference_sensor_is_kept_when_another_has_more_recordings(machine, tmp_path):
    """Rows that were already reported refer to its heights."""
    arrive(machine, tmp_path / "in", *(f"{name}{number}" for number in range(7) for name in "ab"))
    updates = watch(tmp_path)
    assert [recording.reading.sensor for recording in next(updates).track.recordings] == ["a"] * 7
    arrive(machine, tmp_path / "in", "b7", "b8")
    assert [recording.reading.sensor for recording in next(updates).track.recordings] == [
        *"aaaaaaa",
        "b",
        "b",
    ]
    updates.close()
    resumed = next(watch(tmp_path)).track  # resumed from the store
    assert [recording.reading.sensor for recording in resumed.recordings] == [*"aaaaaaa", "b", "b"]


def test_a_recording_that_cannot_be_matched_waits_and_is_reported(machine, tmp_path):
    arrive(machine, tmp_path / "in", "a0", "b0", "a1", "b1")
    (tmp_path / "in" / "b1.npz.toml").write_text('sensor = "b"\n')  # without its start
    (tmp_path / "in" / "a1.npz.toml").unlink()  # without its sensor
    updates = watch(tmp_path)
    update = next(updates)
    assert len(update.track.recordings) == 1
    assert [sentence.partition(";")[0] for sentence in update.failed] == [
        "a1.npz waits: it does not name its sensor, and others do",
        "b1.npz waits: it does not state its start, and sensors are matched by time",
    ]
    arrive(machine, tmp_path / "in", "a1", "b1")
    update = next(updates)
    assert (len(update.track.recordings), update.failed) == (2, ())
    assert [[*recording.on_sensors] for recording in update.track.recordings] == [["a", "b"]] * 2


def test_a_single_sensor_needs_no_times_and_includes_unreadable_recordings(machine, tmp_path):
    """The sensor of a damaged recording is unknown."""
    arrive(machine, tmp_path / "in", "a0", "a1")
    for number in range(2):
        (tmp_path / "in" / f"a{number}.npz.toml").write_text('sensor = "a"\n')
    (tmp_path / "in" / "a2.npz").write_bytes((tmp_path / "in" / "a0.npz").read_bytes()[:700])
    update = next(watch(tmp_path))
    assert ([recording.x for recording in update.track.recordings], update.failed) == (
        [1.0, 2.0, 2.0],
        (),
    )


def test_a_recording_that_is_missing_in_the_table_waits(machine, tmp_path):
    arrive(machine, tmp_path / "in", "0", "1")
    rows = ["file,x,sensor", "0.npz,1,", "1.npz,2,"]
    (tmp_path / "table.csv").write_text("\n".join(rows[:2]))
    updates = watch(tmp_path, channel="a,b", table=tmp_path / "table.csv")
    assert (update := next(updates)).waiting == 1
    assert [recording.x for recording in update.track.recordings] == [1.0]
    (tmp_path / "table.csv").write_text("\n".join(rows))
    assert (update := next(updates)).waiting == 0
    assert [recording.x for recording in update.track.recordings] == [1.0, 2.0]


def test_a_sensor_that_stops_delivering_is_reported(machine, tmp_path):
    arrive(
        machine,
        tmp_path / "in",
        *(f"a{number}" for number in range(9)),
        *(f"b{number}" for number in range(6)),
    )
    update = next(watch(tmp_path))
    assert "Sensor b has delivered nothing with the last 3 recordings." in update.track.verdict()
    assert "The line was detected on a and b in 6, on a in 3." in update.track.verdict()


def test_a_copy_does_not_end_a_watch(machine, tmp_path):
    arrive(machine, tmp_path / "in", "a0", "b0", "a1", "b1")
    shutil.copy(tmp_path / "in" / "a1.npz", tmp_path / "in" / "b1.npz")
    update = next(watch(tmp_path))
    assert (
        "Sensor b is not usable in 1 of 2: it holds the same samples as a."
        in update.track.verdict()
    )


def write_rising_level(folder, first, count, growth):
    rng = np.random.default_rng(4)
    folder.mkdir(exist_ok=True)
    for number in range(first, first + count):
        a, b = sensor_signals(rng, 3000.0, (0.0, 0.0))
        np.savez(
            folder / f"{number:02d}.npz",
            a=a,
            b=np.exp(growth * max(number - 12, 0)) * b,
            fs=RATE,
            unit="m/s^2",
        )


def test_an_alarm_of_all_sensors_is_notified_and_acknowledged_once(tmp_path):
    sent = []

    class Recorder:
        name = "recorder"

        def send(self, message):
            sent.append((message["state"], message["sensor"], message["raised_by"]))

    write_rising_level(tmp_path / "in", 0, 20, 0.3)
    updates = watch(tmp_path, channel="a,b", notifiers=[Recorder()])
    assert next(updates).track.alarm.state == "alarm"
    assert sent == [("alarm", "a, b", "the level (rms) on b")]
    store = tmp_path / "out" / "asperity.db"
    assert [(row["sensor"], row["state"]) for row in store_overview(store).rows] == [
        ("a", "alarm"),
        ("b", "alarm"),
    ]
    acknowledge_in(store, "rig/ring/b")
    write_rising_level(tmp_path / "in", 20, 1, 0.0)
    assert next(updates).track.alarm.state != "alarm"
    assert {row["state"] for row in store_overview(store).rows} == {"cannot-tell"}


def test_further_recordings_are_judged_without_relearning_the_sensors(
    machine, tmp_path, monkeypatch
):
    from asperity.monitoring import series_state

    monkeypatch.setattr(series_state, "ALWAYS_RELEARNED", 6)
    arrive(machine, tmp_path / "in", *"01234567")
    updates = watch(tmp_path, channel="a,b")
    next(updates)
    monkeypatch.setattr(
        series_state, "learn_sensors", lambda *_, **__: pytest.fail("learned again")
    )
    arrive(machine, tmp_path / "in", "8")
    updated = next(updates).track
    updates.close()
    resumed = next(watch(tmp_path, channel="a,b", once=True)).track  # from the stored state
    monkeypatch.undo()
    tracked = track_recordings([tmp_path / "in"], TrackSettings(channel="a,b", band_hz=BAND))
    std = [recording.resonance.crf_std for recording in tracked.recordings]
    assert np.max(np.abs(np.subtract(crf(updated), crf(tracked))) / std) < 0.5
    assert crf(resumed) == pytest.approx(crf(updated), rel=1e-4)
    assert [[*recording.on_sensors] for recording in updated.recordings] == [["a", "b"]] * 9
    assert all(recording.on_sensors["b"].detects for recording in updated.recordings)


def test_the_learned_state_of_sensors_is_stored_completely(machine, tmp_path):
    arrive(machine, tmp_path / "in", *"01234567")
    next(watch(tmp_path, channel="a,b", once=True))
    ((body,),) = query_store(tmp_path, "SELECT body FROM learned")
    restored = unpack_shared(body, 3)
    assert (restored.since, [*restored.shared.by_sensor]) == (3, ["a", "b"])
    assert restored.shared.agreement.established == ("a", "b")
    assert pack_shared(restored.shared) == body
    assert unpack_shared(body[:-40], 3).shared is None
    other_version = BytesIO()
    np.savez(other_version, state=np.zeros(1))
    assert unpack_shared(append_digest(other_version.getvalue()), 3).shared is None


def test_a_sensor_option_is_refused_with_several_sensors(machine, tmp_path):
    arrive(machine, tmp_path / "in", "a0", "b0")
    with pytest.raises(
        BadInput, match="these recordings belong to the sensors a, b, got sensor c; omit the sensor"
    ):
        next(watch(tmp_path, sensor="c"))
    with pytest.raises(
        BadInput, match="each channel is a sensor of its own, got sensor c; omit the sensor"
    ):
        watch(tmp_path, sensor="c", channel="a,b")


def test_a_recording_without_a_time_gets_the_x_of_the_preceding_one():
    hour = timedelta(hours=1)
    matches = match_times(
        [
            TimedRecording("a0", "a", START, 60.0),
            TimedRecording("cut", "", None, np.nan),
            TimedRecording("a1", "a", START + hour, 60.0),
            TimedRecording("b0", "b", START + timedelta(seconds=29), 60.0),
            TimedRecording("b1", "b", START + hour + timedelta(seconds=31), 60.0),
        ]
    )
    assert [(match.x, match.number) for match in matches[:4]] == [
        (0.0, 0),
        (0.0, 0),
        (1.0, 1),
        (0.0, 0),
    ]
    assert matches[4].x == pytest.approx(1.0 + 31.0 / 3600.0)
    assert matches[1] not in (matches[0], matches[3])  # it is not matched
    assert matches[0] == matches[3]


def test_contiguous_recordings_are_matched_to_simultaneous_ones():
    begin = [START + timedelta(seconds=10 * number) for number in range(8)]
    a = [TimedRecording(f"a{number}", "a", time, 10.0) for number, time in enumerate(begin)]
    b = [
        TimedRecording(f"b{number}", "b", time - timedelta(milliseconds=1), 10.0)
        for number, time in enumerate(begin)
    ][1:]
    matches = match_times([*a, *b])
    assert [match.number for match in matches[:8]] == list(range(8))
    assert [match.number for match in matches[8:]] == list(range(1, 8))


def test_recordings_with_the_same_start_are_matched_at_any_duration():
    matches = match_times(
        [TimedRecording("a", "a", START, np.nan), TimedRecording("b", "b", START, np.nan)]
    )
    assert matches[0] == matches[1]
