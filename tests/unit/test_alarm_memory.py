"""Memory between judgements, withheld changes, causes and notifications."""

from contextlib import closing
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from asperity.monitoring import TrackSettings, WatchSettings, track_recordings, watch_folder
from asperity.monitoring.ordering import Order, judged_window
from asperity.monitoring.states import causes
from asperity.monitoring.store.database import FileVersion, SensorAddress, Store
from asperity.monitoring.store.notification_queue import NotificationQueue
from asperity.trend import (
    FIRST_JUDGED,
    LATEST_JUDGED,
    AlarmChecks,
    LevelMemory,
    LevelMonitors,
    MonitoredSeries,
    RecordingStatus,
    sequential_alarm,
)

ONCE = WatchSettings(once=True, settle_time_s=0.0)


def noise(seed, count, size=0.1):
    return size * np.random.default_rng(seed).standard_normal(count)


def series(values, name="rms", contact=False):
    return MonitoredSeries(
        name=name,
        values=np.asarray(values, dtype=float),
        smallest_change=0.05 if contact else np.log(2.0),
        contact=contact,
        describe="by {:.3g}".format,
    )


def judged(values, count, memory=None):
    """Return the monitors of a level after all its recordings."""
    more = () if memory is None else (memory,)
    levels = LevelMonitors([series(values)], count, 0, *more)
    for number in range(count):
        levels.add(number)
    return levels


def write(folder, levels, first=0, unit="m/s^2"):
    folder.mkdir(parents=True, exist_ok=True)
    for number, level in enumerate(levels, first):
        values = level * np.random.default_rng(number).standard_normal(1000)
        np.savez(folder / f"s-{number:04}.npz", acc=values, fs=20e3, unit=unit)

    # Memory
    # ---------------------------------------------------------------------------------

    """Judge the first 8 and the latest 112 of 300 recordings, with the memory between."""
    """Of 300 recordings a watch judges the first 8 and the latest 112, with its memory."""
    values = noise(1, 300) + np.linspace(0.0, 0.9, 300)
    whole = judged(values, 300).judgement()
    memory = judged(values[:200], 200).memory
    window = np.r_[0:FIRST_JUDGED, 300 - LATEST_JUDGED : 300]
    place = int(np.flatnonzero(window == memory.judged)[0])
    resumed = judged(values[window], window.size, LevelMemory(place, memory.monitors))
    assert resumed.judgement() == whole
    assert judged(values[window], window.size).judgement() != whole


def test_a_window_holds_the_latest_recordings_of_every_new_one():
    keys = [FileVersion(f"{number:03}", "1") for number in range(300)]
    order = Order([(key,) for key in keys], "x", {key.file: 0.0 for key in keys})
    sensors = SimpleNamespace(
        complete=lambda _: True,
        unjudged=lambda: {*keys[280:]},
        acknowledged=None,
        standing=None,
    )
    window = judged_window(order, 300, sensors)
    assert window == [*keys[:FIRST_JUDGED], *keys[281 - LATEST_JUDGED :]]


def test_a_change_of_unit_is_not_a_change_of_level(tmp_path):
    write(tmp_path / "in", np.exp(noise(2, 16)), unit="V")
    assert [*watch_folder(tmp_path / "in", tmp_path / "out", watching=ONCE)][-1].track
    write(tmp_path / "in", 10.0 * np.exp(noise(3, 24)), first=16)
    *_, last = watch_folder(tmp_path / "in", tmp_path / "out", watching=ONCE)
    assert last.track.alarm.state == "none"


# Withheld changes and causes
# ---------------------------------------------------------------------------------


def test_an_explained_rise_raises_nothing_after_its_end():
    """Explained while it lasts; the level is normal when the explanation ends."""
    values = noise(4, 80)
    values[30:36] += np.log(5.0)
    checks = AlarmChecks(explanation=lambda number, _: "a warm-up" if number < 45 else "")
    alarm = sequential_alarm(
        np.arange(80.0), [series(values)], [RecordingStatus()] * 80, checks=checks
    )
    assert "alarm" not in alarm.states
    assert alarm.level.state == "none"


def test_a_second_cause_is_named_after_the_alarm_is_latched():
    number = np.arange(60.0)
    level = noise(5, 60) + np.where(number >= 12, np.log(5.0), 0.0)
    crf = 1.0 + np.interp(number, [0.0, 40.0, 59.0], [0.0, 0.25, 0.27]) + noise(6, 60, 0.002)
    alarm = sequential_alarm(
        number, [series(crf, "CRF", contact=True), series(level)], [RecordingStatus()] * 60
    )
    assert (alarm.state, alarm.raised_by, alarm.since) == ("alarm", "rms", 14)
    assert alarm.raised_since == "CRF"
    recordings = [SimpleNamespace(zone=None)] * 2
    assert causes(alarm, recordings) == ["contact", "level"]
    assert causes(replace(alarm, raised_since=""), recordings) == ["level"]
    assert causes(alarm, recordings, "no recording for 2 h") == ["contact", "level", "silence"]


@pytest.mark.parametrize(
    ("steps", "sent"),
    [
        ([("none", []), ("none", [])], 1),
        ([("alarm", ["level"]), ("alarm", ["level"])], 1),
        ([("alarm", ["level"]), ("alarm", ["level", "zone"]), ("alarm", ["level"])], 2),
        ([("alert", ["level"]), ("alarm", ["level"])], 2),
    ],
)
def test_a_new_cause_is_notified_once(tmp_path, steps, sent):
    address = SensorAddress("fan", "DE", "sensor")
    with closing(Store(tmp_path / "plant.db")) as store:
        sensor, _ = store.register_sensor(address, {})
        queue = NotificationQueue(store)
        for state, active in steps:
            with store.transaction() as run:
                queue.add(run, sensor, address, ["me"], {"state": state, "causes": active})
        assert len(queue.pending(sensor, "me")) == sent


def test_recordings_of_several_folders_have_a_note(tmp_path):
    for name in ("pump 1", "pump 2"):
        write(tmp_path / "plant" / name, np.ones(3))
    track = track_recordings([tmp_path / "plant"], TrackSettings(band_hz=(2e3, 4e3)))
    assert any("several folders (pump 1, pump 2)" in note for note in track.notes)
    single = track_recordings([tmp_path / "plant" / "pump 1"], TrackSettings(band_hz=(2e3, 4e3)))
    assert not any("several folders" in note for note in single.notes)
