"""Alarms of `asperity track` and `watch`: states, exit codes, levels, log and acknowledgement."""

import json
import sqlite3
from contextlib import closing
from pathlib import Path

import numpy as np
import pytest

STEADY, LOUD = 12, 24


def snapshots(folder, levels, seconds=0.1, first=0):
    """Write noise without a contact resonance, in recordings of 0.1 s."""
    Path(folder).mkdir(exist_ok=True)
    for number, level in enumerate(levels, first):
        rng = np.random.default_rng(number)
        values = level * rng.standard_normal(round(seconds * 20e3))
        np.savez(Path(folder) / f"s-{number:03}.npz", acc=values, fs=20e3, unit="m/s^2")


def failing():
    """Return constant levels followed by a rise to twenty times that level."""
    grown = np.exp(np.log(20.0) * np.arange(LOUD) / (LOUD - 1))
    return np.concatenate([np.ones(STEADY), grown]) * (
        1.0 + 0.05 * np.random.default_rng(9).standard_normal(STEADY + LOUD)
    )


def test_a_rising_level_raises_an_alarm_without_a_resonance(asp):
    snapshots("in", failing())
    code, out, _ = asp("track", "in", "--json")
    result = json.loads(out)
    assert code == 3
    assert result["alarm"]["state"] == "alarm"
    assert result["alarm"]["raised_by"] == "the level (rms)"
    assert result["alarm"]["false_alarm_rate"] == 1e-3
    assert (
        STEADY < [row["state"] for row in result["recordings"]].index("alarm") < STEADY + LOUD - 5
    )
    assert result["verdict"].startswith("ALARM since s-")
    assert "No contact resonance found in 36 recordings" in result["verdict"]
    assert not any(
        "off" in row["reason"] for row in result["recordings"]
    )  # the recordings before the rise are healthy
    for row in result["recordings"]:
        assert row["kurtosis"] == pytest.approx(3.0, abs=0.4)  # kurtosis of Gaussian noise
        assert row["crest"] == pytest.approx(3.8, abs=1.2)


def test_a_stopped_machine_is_not_healthy(asp):
    snapshots("in", [1.0] * 12 + [0.02])
    code, out, _ = asp("track", "in", "--json")
    result = json.loads(out)
    assert (code, result["alarm"]["state"]) == (5, "blind")
    assert result["alarm"]["since"].endswith("s-012.npz")
    assert "machine was off, or the sensor disconnected: rms is 2 %" in result["verdict"]


def test_recordings_before_the_first_run_are_judged_stopped_after_it(asp):
    snapshots("in", [0.02, 0.02] + [1.0] * 8)
    states = [row["reason"] for row in json.loads(asp("track", "in", "--json")[1])["recordings"]]
    assert ["machine was off" in reason for reason in states] == [True, True] + [False] * 8


def test_a_watch_keeps_its_alarm_until_it_is_acknowledged(asp):
    rates = ("--false-alarms", "1/1000", "--json", "--once", "--settle", "0")
    levels = failing()
    snapshots("in", levels)
    code, out, _ = asp("watch", "in", *rates)
    assert code == 3
    since = json.loads(out)["alarm"]["since"]
    for number in range(STEADY, levels.size):  # the cause has gone, the alarm remains
        Path(f"in/s-{number:03}.npz").unlink()
    code, out, _ = asp("watch", "in", *rates)
    assert code == 3
    assert json.loads(out)["alarm"]["since"] == since
    snapshots("in", [1.0], first=STEADY + LOUD)
    code, out, _ = asp("watch", "in", *rates)
    assert (code, json.loads(out)["alarm"]["since"]) == (3, since)
    code, out, _ = asp("watch", "in", *rates, "--acknowledge", "last")
    assert (code, json.loads(out)["alarm"]["state"]) == (0, "none")
    snapshots("in", levels[:3], first=STEADY + LOUD + 1)
    code, out, _ = asp("watch", "in", *rates)
    assert (code, json.loads(out)["alarm"]["state"]) == (
        4,
        "cannot-tell",
    )  # the baseline is estimated anew
    log = rows("SELECT state, since, time FROM judgement ORDER BY id")
    assert [state for state, _, _ in log] == [
        "alarm",
        "alarm",
        "acknowledged",
        "none",
        "cannot-tell",
    ]
    assert log[0][1] == since
    assert log[2][1] == "s-036.npz"
    assert all(time for _, _, time in log)


def rows(query, store="in/asperity-watch/asperity.db"):
    """Read the judgements of a store with SQL."""
    with closing(sqlite3.connect(store)) as connection:
        return connection.execute(query).fetchall()


def test_an_empty_folder_is_not_healthy(asp):
    Path("in").mkdir()
    code, out, _ = asp("watch", "in", "--once")
    assert code == 4
    assert out.startswith("No recording has arrived yet")


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("--false-alarms", "often"), "must be a rate such as 0.001 or 1/1000, got 'often'"),
        (("--false-alarms", "0.5"), "must lie between 0 and 0.1 per recording, got 0.5"),
        (("--false-alarms", "-1"), "must lie between 0 and 0.1 per recording, got -1"),
        (("--acknowledge", "s-999.npz"), "s-999.npz is not among the 3 recordings"),
    ],
)
def test_an_invalid_rate_or_recording_is_refused(asp, arguments, message):
    snapshots("in", [1.0] * 3)
    code, out, err = asp("track", "in", *arguments)
    assert (code, out) == (2, "")
    assert message in err
