"""`asperity watch` without new recordings: a sensor that delivers nothing is not healthy."""

import json
import os
import sqlite3
import sys
import time
from contextlib import closing
from datetime import UTC, datetime, timedelta
from pathlib import Path

import numpy as np
import pytest

from asperity.monitoring import WatchSettings, watch_folder
from asperity.monitoring.states import duration_text, overdue_reason

NOON = datetime(2026, 11, 22, 12, 0, tzinfo=UTC)
LOOK = ("--once", "--settle", "0", "--store", "plant.db", "--machine", "Fan 1", "--point", "DE")
LISTENER = (
    "import sys, pathlib\npathlib.Path(sys.argv[1]).open('a').write(sys.stdin.read() + chr(10))\n"
)


def snapshots(folder, levels, first=0):
    Path(folder).mkdir(exist_ok=True)
    for number, level in enumerate(levels, first):
        values = level * np.random.default_rng(number).standard_normal(2000)
        np.savez(Path(folder) / f"s-{number:03}.npz", acc=values, fs=20e3, unit="m/s^2")


def judgements(column):
    with closing(sqlite3.connect("plant.db")) as connection:
        return [
            value for (value,) in connection.execute(f"SELECT {column} FROM judgement ORDER BY id")
        ]


def test_the_usual_interval_is_estimated_from_arrival_times():
    every_10_min = [NOON + timedelta(minutes=10 * number) for number in range(12)]
    last = every_10_min[-1]
    assert overdue_reason(every_10_min, None, last + timedelta(minutes=49)) == ""
    reason = overdue_reason(every_10_min, None, last + timedelta(minutes=51))
    assert (
        reason
        == "no recording has come for 51 min, since 2026-11-22T13:50:00+00:00; the usual interval"
        " is 10 min"
    )
    assert (
        overdue_reason(every_10_min[:5], None, NOON + timedelta(days=300)) == ""
    )  # no interval is known yet
    assert "for 2 h" in overdue_reason(every_10_min[:1], 3600.0, NOON + timedelta(hours=2))
    assert [duration_text(120.0), duration_text(3600.0), duration_text(7 * 86400.0)] == [
        "2 min",
        "60 min",
        "7 days",
    ]
    assert overdue_reason([], 1.0, NOON) == ""
    fast = [NOON + timedelta(seconds=number) for number in range(12)]
    assert (
        overdue_reason(fast, None, fast[-1] + timedelta(seconds=59)) == ""
    )  # never less than a minute


@pytest.mark.parametrize("time", ["nan", "0", "inf"])
def test_an_impossible_interval_is_refused(asp, time):
    snapshots("in", np.ones(1))
    code, _, err = asp("watch", "in", *LOOK, "--expect", time)
    assert code == 2
    assert "--expect" in err
    assert not Path("plant.db").exists()


def test_a_sensor_that_delivers_nothing_is_blind_and_notified_once(asp):
    snapshots("in", np.ones(10))
    Path("listen.py").write_text(LISTENER)
    command = f"'{sys.executable}' listen.py log.jsonl"
    assert asp("watch", "in", *LOOK, "--on-alarm", command, "--quiet")[0] == 0
    time.sleep(1.2)
    code, out, _ = asp("watch", "in", *LOOK, "--on-alarm", command, "--expect", "0.5", "--json")
    result = json.loads(out)
    assert (code, result["alarm"]["state"], result["alarm"]["raised_by"]) == (5, "blind", "silence")
    assert result["verdict"].startswith("Blind: no recording has come for")
    assert result["sensor"]["state"] == "blind"
    assert result["alarm"]["causes"] == ["silence"]
    assert "the limit is 0.5 s" in result["alarm"]["reason"]
    assert asp("store", "plant.db", "--quiet")[0] == 5
    page = Path(result["results"], "report.html").read_text("utf-8")
    assert "Blind: no recording has come for" in page
    assert "Check that the machine runs, then sensor, cable and supply" in page
    assert asp("watch", "in", *LOOK, "--on-alarm", command, "--expect", "0.5", "--quiet")[0] == 5
    assert judgements("state") == ["none", "blind"]  # shown again, stored once
    snapshots("in", [1.0], first=10)
    assert asp("watch", "in", *LOOK, "--on-alarm", command, "--expect", "60", "--quiet")[0] == 0
    notifications = [json.loads(line) for line in Path("log.jsonl").read_text().splitlines()]
    assert [event["state"] for event in notifications] == ["none", "blind", "none"]
    assert notifications[1]["raised_by"] == "silence"


def test_an_alarm_remains_without_recordings(asp):
    snapshots("in", np.exp(np.log(20.0) * np.clip(np.arange(36) - 12, 0, None) / 23))
    assert asp("watch", "in", *LOOK, "--quiet")[0] == 3
    time.sleep(0.2)
    code, out, _ = asp("watch", "in", *LOOK, "--expect", "0.1", "--json")
    result = json.loads(out)
    assert (code, result["alarm"]["state"], result["alarm"]["raised_by"]) == (
        3,
        "alarm",
        "the level (rms)",
    )
    assert result["verdict"].startswith("Blind: no recording has come")
    assert "ALARM since" in result["verdict"]
    assert result["sensor"]["state"] == "blind"
    assert result["alarm"]["causes"] == ["level", "silence"]
    page = Path(result["results"], "report.html").read_text("utf-8")
    assert "ALARM since" in page
    assert "No recording has come for" in page


@pytest.mark.skipif(os.name == "nt", reason="clocks of Windows are too coarse for it")
def test_a_running_watch_reports_a_blind_sensor_unprompted(tmp_path):
    snapshots(tmp_path / "in", np.ones(8))
    updates = watch_folder(
        tmp_path / "in",
        tmp_path / "out",
        watching=WatchSettings(poll_interval_s=0.05, settle_time_s=0.0, overdue_after_s=0.6),
    )
    assert next(updates).track is not None
    overdue = next(updates)
    assert overdue.judgement["alarm"]["state"] == overdue.track.alarm.state == "blind"
    assert overdue.track.alarm.since == 7
    snapshots(tmp_path / "in", [1.0], first=8)
    assert len(next(updates).new) == 1
    updates.close()


def test_only_selected_states_and_their_end_are_notified(asp):
    """`--tell alarm` reports the alarm and its end, not the first judgement or a blind sensor."""
    Path("listen.py").write_text(LISTENER)
    tell = ("--on-alarm", f"'{sys.executable}' listen.py log.jsonl", "--tell", "alarm", "--quiet")
    snapshots("in", np.ones(12))
    asp("watch", "in", *LOOK, *tell)
    time.sleep(0.2)
    assert asp("watch", "in", *LOOK, *tell, "--expect", "0.1")[0] == 5
    assert not Path("log.jsonl").exists()
    snapshots("in", np.exp(np.log(20.0) * np.arange(1, 25) / 24), first=12)
    assert asp("watch", "in", *LOOK, *tell)[0] == 3
    assert asp("watch", "in", *LOOK, *tell, "--acknowledge", "last")[0] == 0
    notifications = [
        json.loads(line)["state"] for line in Path("log.jsonl").read_text().splitlines()
    ]
    assert notifications == ["alarm", "none"]
    code, _, err = asp("watch", "in", *LOOK, "--tell", "alarm,loud")
    assert code == 2
    assert "tell must be one of" in err
