"""One store for many machines: filled by `watch` and `track`, shown, exported, resumed."""

import json
import os
import shutil
import signal
import sqlite3
import subprocess
import sys
import time
from contextlib import closing
from pathlib import Path

import numpy as np
import pandas
import pytest

from asperity.core.errors import AsperityError, UnreadableFile
from asperity.monitoring import TrackSettings, WatchSettings, store_overview, watch_folder
from asperity.monitoring.store.database import Store
from asperity.monitoring.store.digests import GROUPS
from asperity.monitoring.store.schema import RENAMED

ONCE = ("--once", "--settle", "0", "--quiet")


def snapshots(folder, levels, seconds=0.1, first=0, sensors=("acc",)):
    """Write noise without a contact resonance, in recordings of 0.1 s."""
    Path(folder).mkdir(exist_ok=True)
    for number, level in enumerate(levels, first):
        rng = np.random.default_rng(number)
        signals = {name: level * rng.standard_normal(round(seconds * 20e3)) for name in sensors}
        np.savez(Path(folder) / f"s-{number:03}.npz", **signals, fs=20e3, unit="m/s^2")


def failing(steady=12, loud=24):
    """Return constant levels followed by a rise to twenty times that level."""
    return np.concatenate([np.ones(steady), np.exp(np.log(20.0) * np.arange(loud) / (loud - 1))])


def query_store(store, query):
    with closing(sqlite3.connect(store)) as connection:
        return connection.execute(query).fetchall()


def without_times(store):
    """Return the content of a store without the times of writing."""
    return [
        query_store(
            store,
            "SELECT sensor, file, started, state, row, reading FROM recording ORDER BY sensor,"
            " file",
        ),
        query_store(
            store,
            "SELECT sensor, state, since, reason, raised_by, verdict, recordings FROM judgement"
            " ORDER BY id",
        ),
        query_store(
            store,
            "SELECT name, settings, json_remove(content, '$.numbers') FROM sensor ORDER BY id",
        ),
    ]


def test_one_store_holds_many_machines_and_ranks_them_by_severity(asp):
    snapshots("drive", np.ones(10))
    snapshots("fan", failing())
    assert (
        asp("watch", "drive", *ONCE, "--store", "plant.db", "--machine", "Pump 3", "--point", "DE")[
            0
        ]
        == 0
    )
    assert (
        asp(
            "track", "fan", "--store", "plant.db", "--machine", "Fan 1", "--point", "NDE", "--quiet"
        )[0]
        == 3
    )
    code, out, _ = asp(
        "store", "plant.db", "--json", "--out", "plant.parquet", "--out", "plant.csv"
    )
    result = json.loads(out)
    assert (code, result["state"]) == (3, "alarm")
    assert result["verdict"] == "2 sensors on 2 machines, 46 recordings: ALARM 1."
    # the most severe first
    assert [row["machine"] for row in result["sensors"]] == ["Fan 1", "Pump 3"]
    assert result["sensors"][0]["reason"].startswith("the level (rms) rose to")
    table = pandas.read_parquet("plant.parquet")
    assert list(table["machine"].value_counts().sort_index()) == [36, 10]
    assert table[table.machine == "Fan 1"]["state"].iloc[-1] == "alarm"
    rms = query_store("plant.db", "SELECT rms FROM trend WHERE machine = 'Fan 1' ORDER BY x")
    assert np.allclose([value for (value,) in rms], failing(), rtol=0.1)  # plain SQL
    assert len(pandas.read_csv("plant.csv")) == 46
    code, out, _ = asp(
        "watch", "fan", *ONCE, "--store", "plant.db", "--machine", "Fan 1", "--point", "NDE"
    )
    assert code == 3
    assert out.startswith("ALARM since s-")


def test_judged_recordings_are_not_judged_again(asp, monkeypatch):
    snapshots("in", np.ones(10))
    first = asp("watch", "in", "--once", "--settle", "0", "--json")
    judged = []
    monkeypatch.setattr(
        "asperity.monitoring.watching.watch_state.judge", lambda *_, **__: judged.append(1)
    )
    second = asp("watch", "in", "--once", "--settle", "0", "--json")
    assert (judged, second[0]) == ([], first[0])
    before, after = json.loads(first[1]), json.loads(second[1])
    # the second run states only the deciding source
    before.pop("stages_by"), after.pop("stages_by")
    assert (len(before.pop("new")), after.pop("new")) == (10, [])
    assert after == before


@pytest.mark.parametrize(
    "change", [("--false-alarms", "1/500"), ("--acknowledge", "last"), ("--stages-from", "both")]
)
def test_changed_settings_are_judged_again(asp, change):
    snapshots("in", np.ones(10))
    asp("watch", "in", *ONCE)
    asp("watch", "in", *ONCE, *change)
    states = query_store(
        "in/asperity-watch/asperity.db", "SELECT state FROM judgement WHERE state != 'acknowledged'"
    )
    assert len(states) == 2


@pytest.mark.parametrize("channels", [(), ("--channel", "acc,other")])
def test_a_watch_killed_repeatedly_ends_with_the_same_store(asp, tmp_path, channels):
    levels = failing()
    snapshots(tmp_path / "in", levels, sensors=("acc", "other")[: 1 + bool(channels)])
    command = ["watch", "in", *ONCE, *channels, "--workers", "1", "--store"]
    assert asp(*command, "whole.db")[0] == 3
    store = tmp_path / "killed.db"
    counts = [0]
    total = len(levels) * (1 + bool(channels))
    while len(counts) < 3 and counts[-1] < total - 6:
        process = subprocess.Popen([sys.executable, "-m", "asperity", *command, "killed.db"])
        while process.poll() is None and (not store.is_file() or _count(store) < counts[-1] + 6):
            time.sleep(0.005)
        process.send_signal(signal.SIGKILL)
        process.wait()
        counts.append(_count(store))
    assert counts[1] > 0
    assert counts[-1] < total  # it was killed before the end
    assert asp(*command, "killed.db")[0] == 3
    assert without_times(store) == without_times(tmp_path / "whole.db")


def _count(store):
    try:
        return query_store(store, "SELECT count(*) FROM recording")[0][0]
    except sqlite3.OperationalError:
        return 0  # not started yet


def test_many_new_recordings_are_judged_one_after_another(tmp_path, monkeypatch):
    """An alarm long before the latest recordings is not missed, and remains."""
    monkeypatch.setattr("asperity.monitoring.ordering.LATEST_JUDGED", 16)
    monkeypatch.setattr("asperity.monitoring.watching.watch_state.STRIDE", 8)
    snapshots(tmp_path / "in", [*failing(), *np.ones(30)])
    (update,) = watch_folder(
        tmp_path / "in", tmp_path / "out", watching=WatchSettings(once=True, settle_time_s=0.0)
    )
    assert update.track.alarm.state == "alarm"
    since = Path(update.track.recordings[update.track.alarm.since].file).name
    assert "s-012.npz" < since < "s-036.npz"
    # the first eight, the latest 16 of each new one, and the one that raised the alarm
    assert 24 <= len(update.track.recordings) <= 8 + 16 + 7 + 1
    states = query_store(tmp_path / "out/asperity.db", "SELECT state FROM recording ORDER BY file")
    assert all(state for (state,) in states)  # each was judged
    snapshots(tmp_path / "in", [1.0], first=66)
    (update,) = watch_folder(
        tmp_path / "in", tmp_path / "out", watching=WatchSettings(once=True, settle_time_s=0.0)
    )
    assert update.track.alarm.state == "alarm"
    assert (
        "raised before and not acknowledged" not in update.track.alarm.reason
    )  # its recording is among those judged
    (update,) = watch_folder(
        tmp_path / "in",
        tmp_path / "out",
        TrackSettings(acknowledge="last"),
        WatchSettings(once=True, settle_time_s=0.0),
    )
    assert update.track.alarm.state == "none"


def test_a_file_that_is_not_a_store_is_refused(asp):
    Path("text.db").write_text("not a database, but long enough to be taken for one\n" * 100)
    assert "is not a store of asperity, or damaged" in asp("store", "text.db")[2]
    with closing(sqlite3.connect("other.db")) as connection:
        connection.execute("CREATE TABLE theirs (a)")
    before = Path("other.db").read_bytes()
    code, _, err = asp("store", "other.db")
    assert code == 2
    assert "other.db is a database of another program" in err
    assert query_store("other.db", "SELECT name FROM sqlite_master") == [("theirs",)]
    assert len(before) == Path("other.db").stat().st_size
    assert asp("store", "absent.db")[0] == 2
    snapshots("in", np.ones(3))
    assert asp("track", "in", "--store", "nowhere/plant.db")[0] == 2
    assert "contains no recordings yet" in store_overview(_empty("empty.db")).verdict()
    with closing(sqlite3.connect("empty.db")) as connection:
        connection.execute("PRAGMA user_version = 99")
    with pytest.raises(UnreadableFile, match="a store of version 99"):
        Store("empty.db")


def _empty(path):
    Store(path).close()
    return path


def test_a_store_locked_by_another_program_is_refused(tmp_path, monkeypatch):
    monkeypatch.setattr("asperity.monitoring.store.database.BUSY_S", 0.05)
    snapshots(tmp_path / "in", [1.0])
    store = Store(tmp_path / "plant.db")
    with store.transaction(), pytest.raises(AsperityError, match="another program has locked it"):
        next(
            watch_folder(
                tmp_path / "in",
                tmp_path / "out",
                watching=WatchSettings(store=tmp_path / "plant.db", once=True, settle_time_s=0.0),
            )
        )


def test_a_damaged_recording_of_the_store_is_read_again(tmp_path):
    snapshots(tmp_path / "in", np.ones(8))
    look = WatchSettings(once=True, settle_time_s=0.0)
    next(watch_folder(tmp_path / "in", tmp_path / "out", watching=look))
    with closing(sqlite3.connect(tmp_path / "out/asperity.db")) as connection:
        connection.execute("UPDATE recording SET reading = x'00ff' WHERE file LIKE '%s-003.npz'")
        connection.commit()
    update = next(watch_folder(tmp_path / "in", tmp_path / "out", watching=look))
    assert "was damaged: recording s-003.npz" in update.failed[0]
    assert [Path(reading.file).name for reading in update.new] == ["s-003.npz"]
    assert len(update.track.recordings) == 8


def test_a_changed_file_is_a_new_recording_and_its_history_remains(tmp_path):
    snapshots(tmp_path / "in", np.ones(8))
    look = WatchSettings(once=True, settle_time_s=0.0)
    next(watch_folder(tmp_path / "in", tmp_path / "out", watching=look))
    snapshots(tmp_path / "in", [2.0], first=3)
    os.utime(tmp_path / "in/s-003.npz", (1e9, 1e9))
    update = next(watch_folder(tmp_path / "in", tmp_path / "out", watching=look))
    assert len(update.track.recordings) == 8
    assert update.track.recordings[3].reading.quality.rms == pytest.approx(2.0, rel=0.1)
    assert query_store(tmp_path / "out/asperity.db", "SELECT count(*) FROM recording") == [(9,)]
    shutil.rmtree(tmp_path / "in")


def test_every_file_of_an_untidy_folder_is_accounted_for(asp):
    """Files with future times; empty, cut, foreign, half-copied, duplicate and late files."""
    snapshots("in", np.ones(8))
    ahead = time.time() + 7200.0
    os.utime("in/s-005.npz", (ahead, ahead))
    Path("in/empty.npz").touch()
    Path("in/cut.npz").write_bytes(Path("in/s-001.npz").read_bytes()[:700])
    Path("in/notes.txt").write_text("Nothing of note.\n")
    Path("in/late.npz.filepart").write_bytes(b"PK")
    shutil.copy("in/s-002.npz", "in/s-002-copy.npz")
    look = ("watch", "in", "--once", "--settle", "0.2", "--json")
    time.sleep(0.3)
    result = json.loads(asp(*look)[1])
    assert result["waiting"] == 1  # the empty file
    rows = {Path(row["file"]).name: row for row in result["recordings"]}
    assert len(rows) == 11
    assert rows["s-005.npz"]["rms"] == pytest.approx(1.0, rel=0.1)
    assert {name for name, row in rows.items() if row["x"] is None} == {"cut.npz", "notes.txt"}
    Path("in/late.npz.filepart").unlink()
    snapshots("in", [1.0], first=3)  # written again, later
    snapshots("in", [1.0], first=9)
    time.sleep(0.3)
    result = json.loads(asp(*look)[1])
    assert sorted(Path(file).name for file in result["new"]) == ["s-003.npz", "s-009.npz"]
    assert len(result["recordings"]) == 12
    assert query_store("in/asperity-watch/asperity.db", "SELECT count(*) FROM recording") == [(13,)]


def test_rows_changed_by_another_program_are_written_again(tmp_path):
    snapshots(tmp_path / "in", np.ones(9))
    updates = watch_folder(
        tmp_path / "in",
        tmp_path / "out",
        watching=WatchSettings(poll_interval_s=0.0, settle_time_s=0.0),
    )
    next(updates)
    rows = "SELECT file, row FROM recording WHERE file < '%s' ORDER BY file"
    rows %= tmp_path / "in/s-009"
    before = query_store(tmp_path / "out/asperity.db", rows)
    with closing(sqlite3.connect(tmp_path / "out/asperity.db")) as connection:
        connection.execute("UPDATE recording SET row = '{}' WHERE id = 3")
        connection.commit()
    for number in (9, 10):
        snapshots(tmp_path / "in", [1.0], first=number)
        next(updates)
        assert query_store(tmp_path / "out/asperity.db", rows) == before
    updates.close()


def test_an_alarm_acknowledged_by_one_process_is_not_raised_by_another(asp):
    """One process watches for months; another acknowledges."""
    snapshots("in", failing())
    updates = watch_folder(
        "in",
        "out",
        watching=WatchSettings(poll_interval_s=0.0, settle_time_s=0.0, machine="Fan 1", point="DE"),
    )
    assert next(updates).track.alarm.state == "alarm"
    assert asp("store", "out/asperity.db", "--quiet")[0] == 3
    assert (
        asp("store", "out/asperity.db", "--quiet", "--acknowledge", "Fan 1/DE/sensor")[0] == 3
    )  # no new output
    snapshots("in", [1.0], first=40)
    assert next(updates).track.alarm.state == "cannot-tell"
    updates.close()
    assert asp("store", "out/asperity.db", "--quiet")[0] == 4
    assert (
        "the store has no sensor 'Fan 2'; it has Fan 1/DE/sensor"
        in asp("store", "out/asperity.db", "--acknowledge", "Fan 2")[2]
    )


@pytest.mark.parametrize("version", [1, 2, 3])
def test_a_store_of_an_older_version_is_continued(asp, version):
    snapshots("in", failing())
    asp("watch", "in", *ONCE, "--store", "plant.db")
    with closing(sqlite3.connect("plant.db")) as connection:
        for group in GROUPS:
            connection.execute(f"ALTER TABLE {group.table} DROP COLUMN {group.digest}")
        if version == 1:  # as version 0.2.0 left it
            connection.execute("ALTER TABLE recording DROP COLUMN duration")
        connection.execute("DROP TABLE levels")
        if version < 3:
            connection.execute("DROP TABLE learned")
            connection.execute("ALTER TABLE sensor ADD COLUMN learned BLOB")
            connection.execute("UPDATE sensor SET learned = x'0102'")
        connection.execute("DROP TABLE dropped")
        connection.execute("DROP TABLE gap")
        connection.execute("DROP VIEW trend")
        for table, old, new in RENAMED:
            connection.execute(f"ALTER TABLE {table} RENAME COLUMN {new} TO {old}")
        connection.execute("CREATE VIEW trend AS SELECT heard FROM recording")
        connection.execute(f"PRAGMA user_version = {version}")
        connection.commit()
    with closing(Store("plant.db")):
        learned = query_store("plant.db", "SELECT body FROM learned")
        assert learned == ([(b"\x01\x02",)] if version < 3 else [])
    snapshots("in", [20.0], first=36)
    assert asp("watch", "in", *ONCE, "--store", "plant.db")[0] == 3
    assert len(query_store("plant.db", "SELECT arrived, rms FROM trend")) == 37
    durations = query_store("plant.db", "SELECT duration FROM recording")
    assert durations == [(pytest.approx(0.1),)] * 37


def test_track_acknowledges_in_the_store_and_agrees_with_it(asp):
    snapshots("in", failing())
    assert asp("track", "in", "--store", "plant.db", "--quiet")[0] == 3
    assert (
        asp("track", "in/s-001.npz", "in/s-002.npz", "--store", "plant.db", "--quiet")[0] == 3
    )  # the alarm remains
    assert asp("track", "in", "--store", "plant.db", "--quiet", "--acknowledge", "last")[0] == 0
    assert asp("store", "plant.db", "--quiet")[0] == 0


def test_two_folders_of_one_name_are_two_machines(asp):
    for machine in ("pump1", "pump2"):
        Path(machine).mkdir()
        snapshots(f"{machine}/DE", failing() if machine == "pump1" else np.ones(10))
        asp("watch", f"{machine}/DE", *ONCE, "--store", "plant.db")
    result = json.loads(asp("store", "plant.db", "--json")[1])
    assert [(row["machine"], row["state"]) for row in result["sensors"]] == [
        ("pump1", "alarm"),
        ("pump2", "none"),
    ]
    Path("other/pump1").mkdir(parents=True)
    snapshots("other/pump1/DE", np.ones(3))
    code, _, err = asp("watch", "other/pump1/DE", *ONCE, "--store", "plant.db")
    assert code == 2
    assert "was begun with folder" in err
    absolute = str(Path("pump1/DE").resolve())
    assert (
        asp("watch", absolute, *ONCE, "--store", "plant.db")[0] == 3
    )  # the same folder under another path
    assert json.loads(asp("store", "plant.db", "--json")[1])["sensors"][0]["recordings"] == 36


def test_conditions_stated_later_take_effect(asp):
    Path("in").mkdir()
    for number in range(3):
        np.save(f"in/s-{number}.npy", np.random.default_rng(number).standard_normal(2000))
    look = ("watch", "in", "--once", "--settle", "0", "--json")
    assert {row["rate_hz"] for row in json.loads(asp(*look)[1])["recordings"]} == {None}
    Path("in/recordings.json").write_text('{"rate_hz": 20000}')
    result = json.loads(asp(*look)[1])
    assert len(result["new"]) == len(result["recordings"]) == 3
    assert {row["rate_hz"] for row in result["recordings"]} == {20000.0}


@pytest.mark.skipif(sys.platform != "linux", reason="other systems have no such names")
def test_a_name_that_is_not_utf_8_is_skipped_and_reported(asp):
    snapshots("in", np.ones(3))
    shutil.copy("in/s-000.npz", b"in/r\xff\xe9.npz")
    code, out, err = asp("watch", "in", *ONCE)
    assert code == 4
    assert out
    assert "is left out: its name is not UTF-8; rename it" in err


def test_versions_written_sensor_by_sensor_are_both_read(tmp_path):
    from benchmarks.hostile import latest

    with closing(sqlite3.connect(tmp_path / "s.db")) as connection:
        connection.execute("CREATE TABLE sensor (id INTEGER PRIMARY KEY, name)")
        connection.execute(
            "CREATE TABLE recording (id INTEGER PRIMARY KEY, sensor, file, version, refused, "
            "reading, state)"
        )
        connection.executemany("INSERT INTO sensor VALUES (?, ?)", [(1, "a"), (2, "b")])
        connection.executemany(
            "INSERT INTO recording (sensor, file, version, refused, reading, state) "
            "VALUES (?, ?, ?, '', ?, '')",
            [(sensor, "in/r", version, version) for sensor in (1, 2) for version in ("1", "2")]
            + [(1, "in/q", "1", "1"), (2, "in/q", "1", "1"), (1, "in/q", "2", "2")],
        )
        connection.commit()
    held = latest(tmp_path / "s.db")
    assert held["r"] == [("a", "", "2", ""), ("b", "", "2", "")]
    assert held["q"] == [("a", "", "2", "")]


def test_a_killed_watch_ends_with_the_store_of_an_uninterrupted_one(monkeypatch):
    """Run `python -m benchmarks.hostile` for seconds: an untidy folder, two watches, one of them
    killed. Two sensors here; `benchmarks.hostile` has one as well.
    """
    from benchmarks import hostile

    monkeypatch.setattr(hostile, "PARTS_S", 0.4)
    monkeypatch.setattr(hostile, "HUGE_S", 6.0)
    lines = hostile.run(0.12, 2, 2, every=0.2, settle=0.3, say=lambda _: None)
    rows = [line.split("|")[1:3] for line in lines if line.startswith("|")]
    values = {name.strip(): value.strip() for name, value in rows}
    assert values["files without an outcome"] == "0"
    same, differ = values["files equal in both stores, files that differ"].split(",")
    assert (int(same) > 10, int(differ)) == (True, 0)
    assert int(values["judged"]) > 10
