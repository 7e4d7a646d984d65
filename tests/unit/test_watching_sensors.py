"""Several sensors of one machine, watched: judged as one as they arrive, each kept by its own
name.
"""

import json
import shutil
import sqlite3
from contextlib import closing
from dataclasses import fields
from datetime import UTC, datetime, timedelta

import numpy as np
import pytest

from asperity.core.errors import BadInput
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

START = datetime(2025, 3, 1, 12, tzinfo=UTC)


@pytest.fixture(scope="module")
def machine(tmp_path_factory):
    """Files with the channels a and b, and the same as a file each, beside which stands who heard
    it, and when.
    """
    folder = tmp_path_factory.mktemp("machine")
    rng = np.random.default_rng(8)
    for name in ("whole", "apart"):
        (folder / name).mkdir()
    for number, f0 in enumerate(np.append(TRUTH, 3800.0)):
        heard = dict(zip("ab", sensor_signals(rng, f0, (1.0, 0.6)), strict=True))
        np.savez(folder / "whole" / f"{number}.npz", **heard, fs=RATE, unit="m/s^2")
        for late, (name, values) in enumerate(heard.items()):
            np.savez(folder / "apart" / f"{name}{number}.npz", acc=values, fs=RATE, unit="m/s^2")
            said = (
                f'sensor = "{name}"\nstarted = "{START + timedelta(days=number, seconds=late)}"\n'
            )
            (folder / "apart" / f"{name}{number}.npz.toml").write_text(said)
    return folder


def arrive(machine, folder, *names):
    folder.mkdir(exist_ok=True)
    for name in names:
        shutil.copy(machine / ("apart" if name[0] in "ab" else "whole") / f"{name}.npz", folder)
        beside = machine / "apart" / f"{name}.npz.toml"
        if beside.is_file():
            shutil.copy(beside, folder)


def looking(tmp_path, table=None, **changes):
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


def held(tmp_path, query):
    with closing(sqlite3.connect(tmp_path / "out" / "asperity.db")) as connection:
        return connection.execute(query).fetchall()


def crf(track):
    return [one.resonance.crf_hz for one in track.recordings]


PER_SENSOR = (
    "SELECT sensor.name, count(*) FROM recording JOIN sensor ON sensor.id = recording.sensor GROUP"
    " BY 1"
)


def test_channels_are_judged_as_track_judges_them_and_kept_by_their_names(machine, tmp_path):
    arrive(machine, tmp_path / "in", *"01234567")
    looks = looking(tmp_path, channel="a, b")
    first = next(looks)
    arrive(machine, tmp_path / "in", "8")
    last = next(looks)
    looks.close()
    tracked = track_recordings([tmp_path / "in"], TrackSettings(channel="a,b", band_hz=BAND))
    assert [reading.sensor for reading in last.new] == ["a", "b"]
    assert (len(first.track.recordings), crf(last.track)) == (8, crf(tracked))
    assert last.track.verdict() == tracked.verdict()
    assert "The line was detected on a and b in 9." in last.track.verdict()
    assert held(tmp_path, PER_SENSOR) == [("a", 9), ("b", 9)]
    rms = held(tmp_path, "SELECT sensor, rms FROM trend WHERE file LIKE '%/0.npz' ORDER BY sensor")
    own = tracked.recordings[0].on_sensors
    assert rms == [(name, pytest.approx(own[name].reading.quality.rms)) for name in "ab"]
    again = next(looking(tmp_path, channel="a,b", once=True, reuse_judgement=True))
    assert (again.track, again.judgement) == (
        None,
        json.loads(json.dumps(last.track.scalars(all_sources=False))),
    )
    kept = keep_track(
        tracked,
        tmp_path / "out" / "asperity.db",
        ReadOptions(channel="a,b"),
        machine="rig",
        point="ring",
    )
    assert kept.alarm == tracked.alarm
    assert held(tmp_path, PER_SENSOR) == [("a", 9), ("b", 9)]  # a track and a watch keep the same


def test_files_of_sensors_are_laid_beside_one_another_as_they_arrive(machine, tmp_path):
    arrive(
        machine,
        tmp_path / "in",
        *(f"a{number}" for number in range(9)),
        *(f"b{number}" for number in range(7)),
    )
    looks = looking(tmp_path)
    next(looks)
    arrive(machine, tmp_path / "in", "b8", "b7")
    last = next(looks).track
    tracked = track_recordings([tmp_path / "in"], TrackSettings(band_hz=BAND))
    assert [one.x for one in last.recordings] == pytest.approx(
        [24.0 * number for number in range(9)]
    )
    assert [[*one.on_sensors] for one in last.recordings] == [["a", "b"]] * 9
    assert crf(last) == crf(tracked)
    assert last.verdict() == tracked.verdict()
    assert held(tmp_path, PER_SENSOR) == [("a", 9), ("b", 9)]


def test_who_led_leads_on_though_another_has_more_recordings_later(machine, tmp_path):
    """Rows that were given have its heights."""
    arrive(machine, tmp_path / "in", *(f"{name}{number}" for number in range(7) for name in "ab"))
    looks = looking(tmp_path)
    assert [one.reading.sensor for one in next(looks).track.recordings] == ["a"] * 7
    arrive(machine, tmp_path / "in", "b7", "b8")
    assert [one.reading.sensor for one in next(looks).track.recordings] == [*"aaaaaaa", "b", "b"]
    looks.close()
    again = next(looking(tmp_path)).track  # from the store
    assert [one.reading.sensor for one in again.recordings] == [*"aaaaaaa", "b", "b"]


def test_a_recording_that_cannot_be_laid_beside_others_waits_and_is_told(machine, tmp_path):
    arrive(machine, tmp_path / "in", "a0", "b0", "a1", "b1")
    (tmp_path / "in" / "b1.npz.toml").write_text('sensor = "b"\n')  # no word of when
    (tmp_path / "in" / "a1.npz.toml").unlink()  # nor of whose it is
    looks = looking(tmp_path)
    update = next(looks)
    assert len(update.track.recordings) == 1
    assert [sentence.partition(";")[0] for sentence in update.failed] == [
        "a1.npz waits: it does not name its sensor, and others do",
        "b1.npz waits: it does not state its start, and sensors are matched by time",
    ]
    arrive(machine, tmp_path / "in", "a1", "b1")
    update = next(looks)
    assert (len(update.track.recordings), update.failed) == (2, ())
    assert [[*one.on_sensors] for one in update.track.recordings] == [["a", "b"]] * 2


def test_one_sensor_needs_no_time_and_takes_what_cannot_be_read(machine, tmp_path):
    """Nobody can say whose a damaged recording is."""
    arrive(machine, tmp_path / "in", "a0", "a1")
    for number in range(2):
        (tmp_path / "in" / f"a{number}.npz.toml").write_text('sensor = "a"\n')
    (tmp_path / "in" / "a2.npz").write_bytes((tmp_path / "in" / "a0.npz").read_bytes()[:700])
    update = next(looking(tmp_path))
    assert ([one.x for one in update.track.recordings], update.failed) == ([1.0, 2.0, 2.0], ())


def test_a_recording_that_the_table_does_not_know_yet_waits(machine, tmp_path):
    arrive(machine, tmp_path / "in", "0", "1")
    rows = ["file,x,sensor", "0.npz,1,", "1.npz,2,"]
    (tmp_path / "table.csv").write_text("\n".join(rows[:2]))
    looks = looking(tmp_path, channel="a,b", table=tmp_path / "table.csv")
    assert (update := next(looks)).waiting == 1
    assert [one.x for one in update.track.recordings] == [1.0]
    (tmp_path / "table.csv").write_text("\n".join(rows))
    assert (update := next(looks)).waiting == 0
    assert [one.x for one in update.track.recordings] == [1.0, 2.0]


def test_a_sensor_of_which_nothing_comes_any_more_is_told(machine, tmp_path):
    arrive(
        machine,
        tmp_path / "in",
        *(f"a{number}" for number in range(9)),
        *(f"b{number}" for number in range(6)),
    )
    update = next(looking(tmp_path))
    assert "Sensor b has delivered nothing with the last 3 recordings." in update.track.verdict()
    assert "The line was detected on a and b in 6, on a in 3." in update.track.verdict()


def test_a_copy_does_not_end_a_watch(machine, tmp_path):
    arrive(machine, tmp_path / "in", "a0", "b0", "a1", "b1")
    shutil.copy(tmp_path / "in" / "a1.npz", tmp_path / "in" / "b1.npz")
    update = next(looking(tmp_path))
    assert (
        "Sensor b is not usable in 1 of 2: it holds the same samples as a."
        in update.track.verdict()
    )


def louder(folder, first, count, growth):
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


def test_an_alarm_is_that_of_all_told_once_and_acknowledged_once(tmp_path):
    told = []

    class Somebody:
        name = "somebody"

        def send(self, said):
            told.append((said["state"], said["sensor"], said["raised_by"]))

    louder(tmp_path / "in", 0, 20, 0.3)
    looks = looking(tmp_path, channel="a,b", notifiers=[Somebody()])
    assert next(looks).track.alarm.state == "alarm"
    assert told == [("alarm", "a, b", "the level (rms) on b")]
    store = tmp_path / "out" / "asperity.db"
    assert [(row["sensor"], row["state"]) for row in store_overview(store).rows] == [
        ("a", "alarm"),
        ("b", "alarm"),
    ]
    acknowledge_in(store, "rig/ring/b")
    louder(tmp_path / "in", 20, 1, 0.0)
    assert next(looks).track.alarm.state != "alarm"
    assert {row["state"] for row in store_overview(store).rows} == {"cannot-tell"}


def test_further_recordings_are_judged_beside_what_the_series_has_shown(
    machine, tmp_path, monkeypatch
):
    from asperity.monitoring import series_state

    monkeypatch.setattr(series_state, "ALWAYS_RELEARNED", 6)
    arrive(machine, tmp_path / "in", *"01234567")
    looks = looking(tmp_path, channel="a,b")
    next(looks)
    monkeypatch.setattr(series_state, "learn_sensors", lambda *_, **__: pytest.fail("learned anew"))
    arrive(machine, tmp_path / "in", "8")
    beside = next(looks).track
    looks.close()
    resumed = next(looking(tmp_path, channel="a,b", once=True)).track  # by what the store holds
    monkeypatch.undo()
    tracked = track_recordings([tmp_path / "in"], TrackSettings(channel="a,b", band_hz=BAND))
    std = [one.resonance.crf_std for one in tracked.recordings]
    assert np.max(np.abs(np.subtract(crf(beside), crf(tracked))) / std) < 0.5
    assert crf(resumed) == pytest.approx(crf(beside), rel=1e-4)
    assert [[*one.on_sensors] for one in beside.recordings] == [["a", "b"]] * 9
    assert all(one.on_sensors["b"].detects for one in beside.recordings)


def test_what_was_learned_of_sensors_is_kept_whole(machine, tmp_path):
    arrive(machine, tmp_path / "in", *"01234567")
    next(looking(tmp_path, channel="a,b", once=True))
    ((body,),) = held(tmp_path, "SELECT body FROM learned")
    back = unpack_shared(body, 3)
    assert (back.since, [*back.shared.by_sensor]) == (3, ["a", "b"])
    assert back.shared.agreement.established == ("a", "b")
    assert pack_shared(back.shared) == body
    assert unpack_shared(body[:-40], 3).shared is None


def test_a_sensor_that_somebody_named_has_no_others(machine, tmp_path):
    arrive(machine, tmp_path / "in", "a0", "b0")
    with pytest.raises(
        BadInput, match="these recordings belong to the sensors a, b, got sensor c; omit the sensor"
    ):
        next(looking(tmp_path, sensor="c"))
    with pytest.raises(
        BadInput, match="each channel is a sensor of its own, got sensor c; omit the sensor"
    ):
        looking(tmp_path, sensor="c", channel="a,b")


def test_what_has_no_time_stands_where_the_one_before_does():
    hour = timedelta(hours=1)
    laid = match_times(
        [
            TimedRecording("a0", "a", START, 60.0),
            TimedRecording("cut", "", None, np.nan),
            TimedRecording("a1", "a", START + hour, 60.0),
            TimedRecording("b0", "b", START + timedelta(seconds=29), 60.0),
            TimedRecording("b1", "b", START + hour + timedelta(seconds=31), 60.0),
        ]
    )
    assert [(one.x, one.number) for one in laid[:4]] == [(0.0, 0), (0.0, 0), (1.0, 1), (0.0, 0)]
    assert laid[4].x == pytest.approx(1.0 + 31.0 / 3600.0)
    assert laid[1] not in (laid[0], laid[3])  # it stands alone
    assert laid[0] == laid[3]


def test_recordings_end_to_end_are_laid_beside_those_made_at_the_time():
    begin = [START + timedelta(seconds=10 * number) for number in range(8)]
    a = [TimedRecording(f"a{number}", "a", time, 10.0) for number, time in enumerate(begin)]
    b = [
        TimedRecording(f"b{number}", "b", time - timedelta(milliseconds=1), 10.0)
        for number, time in enumerate(begin)
    ][1:]
    laid = match_times([*a, *b])
    assert [one.number for one in laid[:8]] == list(range(8))
    assert [one.number for one in laid[8:]] == list(range(1, 8))


def test_what_begins_at_one_time_is_one_however_long_it_is():
    laid = match_times(
        [TimedRecording("a", "a", START, np.nan), TimedRecording("b", "b", START, np.nan)]
    )
    assert laid[0] == laid[1]
