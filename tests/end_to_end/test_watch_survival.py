"""A watch survives full disks, lost folders, failing reports and clocks that jump."""

import json
import shutil
import signal
import sqlite3
import subprocess
import sys
import time
from contextlib import closing, suppress
from datetime import datetime, timedelta
from pathlib import Path

import numpy as np
import pytest

from asperity.cli.monitored.watch_output import WatchReports
from asperity.core.errors import AsperityError
from asperity.monitoring import TrackSettings, WatchSettings
from asperity.monitoring.store import database
from asperity.monitoring.watch import open_watch

FULL = "database or disk is full"


def snapshots(folder, levels, first=0):
    """Write noise without a contact resonance, in recordings of 0.1 s."""
    Path(folder).mkdir(exist_ok=True)
    for number, level in enumerate(levels, first):
        values = level * np.random.default_rng(number).standard_normal(2000)
        part = Path(folder) / f".s-{number:03}.npz"
        np.savez(part, acc=values, fs=20e3, unit="m/s^2")
        part.rename(part.with_name(part.name[1:]))


def failing(loud=24):
    """Return levels that rise to twenty times the first."""
    return np.exp(np.log(20.0) * np.arange(loud) / (loud - 1))


def query_store(store, query):
    with closing(sqlite3.connect(store)) as connection:
        return connection.execute(query).fetchall()


class Recorder:
    """Recipient of notifications."""

    name = "recorder"

    def __init__(self):
        self.states = []

    def send(self, notification):
        self.states.append(notification["state"])


class Broken(Recorder):
    """Recipient that cannot be reached until it `works`."""

    works = False

    def send(self, notification):
        if not self.works:
            raise OSError("connection refused")
        super().send(notification)


def watch(tmp_path, **changes):
    (tmp_path / "out").mkdir(exist_ok=True)
    store = changes.pop("store", tmp_path / "out/asperity.db")
    return open_watch(
        (tmp_path / "in").resolve(),
        database.Store(store, allow_unavailable=not changes.get("once")),
        TrackSettings(**changes.pop("tracking", {})),
        WatchSettings(**{"poll_interval_s": 0.0, "settle_time_s": 0.0} | changes),
    )


def test_an_alarm_is_notified_while_the_store_cannot_be_written(tmp_path, disk):
    recorder = Recorder()
    snapshots(tmp_path / "in", np.ones(12))
    watched = watch(tmp_path, notifiers=[recorder])
    watched.check()
    disk.full = True
    snapshots(tmp_path / "in", failing(), first=12)
    update = watched.check()
    assert update.track.alarm.state == "alarm"
    assert recorder.states == ["none", "alarm"]
    assert [FULL in sentence for sentence in update.failed] == [True]
    assert watched.check() is None  # the cause is stated once
    for number in range(12, 30):
        (tmp_path / f"in/s-{number:03}.npz").unlink()
    snapshots(tmp_path / "in", [20.0], first=36)
    assert watched.check().failed == ()
    disk.full = False
    update = watched.check()
    assert "is written again" in update.failed[0]
    assert update.track.alarm.state == "alarm"
    assert watched.check() is None
    watched.close()
    assert recorder.states == ["none", "alarm"]
    store = tmp_path / "out/asperity.db"
    assert query_store(store, "SELECT count(*), count(state), count(row) FROM recording") == [
        (37, 37, 37)
    ]
    assert query_store(store, "SELECT state, answered IS NULL FROM call") == [
        ("none", 0),
        ("alarm", 0),
    ]
    resumed = watch(tmp_path, notifiers=[recorder])
    assert resumed.check().track.alarm.state == "alarm"
    resumed.close()
    assert recorder.states == ["none", "alarm"]


def test_a_store_written_in_memory_first_equals_an_uninterrupted_one(tmp_path, disk):
    rows = "SELECT file, state, row, reading FROM recording ORDER BY file"
    stores = []
    for interrupted in (False, True):
        watched = watch(tmp_path, store=tmp_path / f"{interrupted}.db")
        snapshots(tmp_path / "in", np.ones(9))
        watched.check()
        disk.full = interrupted
        for first in (9, 12):
            snapshots(tmp_path / "in", np.ones(3), first=first)
            watched.check()
        disk.full = False
        watched.check()
        watched.close()
        stores.append(query_store(tmp_path / f"{interrupted}.db", rows))
        if not interrupted:
            times = {file: file.stat() for file in (tmp_path / "in").iterdir()}
            shutil.rmtree(tmp_path / "in")
    assert times
    assert stores[0] == stores[1]


def test_a_copy_in_memory_is_merged_only_once(tmp_path, disk):
    snapshots(tmp_path / "in", np.ones(9))
    watched = watch(tmp_path, notifiers=[Recorder()])
    disk.full = True
    assert len(watched.check().new) == 9
    disk.full = False
    reopen = watched.reopen
    watched.reopen = lambda _: (_ for _ in ()).throw(AsperityError("settings differ"))
    for _ in range(3):
        watched.check()
    watched.reopen = reopen
    assert "is written again" in watched.check().failed[0]
    watched.close()
    store = tmp_path / "out/asperity.db"
    assert query_store(store, "SELECT count(*) FROM recording") == [(9,)]
    assert query_store(store, "SELECT count(*) FROM call") == [(1,)]
    assert query_store(store, "SELECT count(*) FROM judgement WHERE new > 0") == [(1,)]


def test_a_store_that_fails_while_it_is_thinned_loses_no_update(tmp_path, disk, monkeypatch):
    def fail(*_):
        disk.full = True
        raise database.StoreUnavailable(FULL)

    snapshots(tmp_path / "in", np.ones(9))
    watched = watch(tmp_path)
    monkeypatch.setattr("asperity.monitoring.watching.folder_watch.thin_store", fail)
    update = watched.check()
    assert (len(update.new), len(update.failed)) == (9, 1)
    disk.full = False
    assert "is written again" in watched.check().failed[0]
    watched.close()


def test_a_full_disk_ends_a_single_run_with_an_error(tmp_path, disk):
    snapshots(tmp_path / "in", np.ones(2))
    watched = watch(tmp_path, once=True)
    disk.full = True
    with pytest.raises(AsperityError, match=FULL):
        watched.check()


def test_a_watch_that_ends_before_there_is_space_reports_it(tmp_path, disk):
    snapshots(tmp_path / "in", np.ones(2))
    watched = watch(tmp_path)
    disk.full = True
    watched.check()
    with pytest.raises(AsperityError, match="is not stored and will be read again"):
        watched.close()


def test_a_lost_result_folder_is_used_again_when_it_returns(tmp_path):
    snapshots(tmp_path / "in", np.ones(9))
    watched = watch(tmp_path)
    watched.check()
    (tmp_path / "out").rename(tmp_path / "away")
    snapshots(tmp_path / "in", [1.0], first=9)
    update = watched.check()
    assert (len(update.new), len(update.failed)) == (1, 1)
    assert not (tmp_path / "out").exists()
    (tmp_path / "away").rename(tmp_path / "out")
    assert "is written again" in watched.check().failed[0]
    watched.close()
    assert query_store(tmp_path / "out/asperity.db", "SELECT count(*) FROM recording") == [(10,)]


@pytest.mark.parametrize("folder_remains", [True, False])
def test_a_deleted_store_is_restored(tmp_path, monkeypatch, folder_remains):
    monkeypatch.setattr(database, "MISSING_S", 0.0)
    snapshots(tmp_path / "in", np.ones(9))
    watched = watch(tmp_path)
    watched.check()
    shutil.rmtree(tmp_path / "out")
    if folder_remains:
        (tmp_path / "out").mkdir()
    shutil.rmtree(tmp_path / "in")
    snapshots(tmp_path / "in", [1.0], first=9)
    watched.check()
    assert "is written again" in watched.check().failed[0]
    watched.close()
    assert query_store(tmp_path / "out/asperity.db", "SELECT count(*) FROM recording") == [(10,)]


def test_a_lost_folder_of_recordings_is_stated_once_and_makes_the_sensor_blind(tmp_path):
    snapshots(tmp_path / "in", np.ones(9))
    watched = watch(tmp_path, overdue_after_s=0.3)
    watched.check()
    (tmp_path / "in").rename(tmp_path / "away")
    notice = watched.check()
    assert (notice.notice, len(notice.failed)) == (True, 1)
    assert "cannot be read (No such file or directory); the watch continues" in notice.failed[0]
    assert watched.check() is None
    time.sleep(0.4)
    assert watched.check().judgement["alarm"]["state"] == "blind"
    (tmp_path / "away").rename(tmp_path / "in")
    snapshots(tmp_path / "in", [1.0], first=9)
    update = watched.check()
    assert update.failed == (f"{watched.folder} is read again",)
    assert len(update.new) == 1
    watched.close()


def test_recordings_lost_while_they_are_read_are_read_again(tmp_path, monkeypatch):
    """A share that is disconnected makes files unreadable only for a while."""
    from asperity.monitoring import reading as reading_module

    original = reading_module.read_spectrum

    def read_and_disconnect(path, *arguments):
        path.rename(path.with_suffix(".tmp"))
        try:
            return original(path, *arguments)
        finally:
            path.with_suffix(".tmp").rename(tmp_path / path.name)

    snapshots(tmp_path / "in", np.ones(3))
    watched = watch(tmp_path)
    monkeypatch.setattr(reading_module, "read_spectrum", read_and_disconnect)
    watched.check()
    monkeypatch.undo()
    for file in tmp_path.glob("*.npz"):
        file.rename(tmp_path / "in" / file.name)
    assert len(watched.check().new) == 3
    watched.close()
    assert query_store(tmp_path / "out/asperity.db", "SELECT refused FROM recording") == [(0,)] * 3


def test_a_failing_evaluation_is_stated_once_and_repeated(tmp_path, monkeypatch):
    snapshots(tmp_path / "in", np.ones(9))
    watched = watch(tmp_path)

    def fail(*_, **__):
        raise ValueError("singular matrix")

    monkeypatch.setattr("asperity.monitoring.watching.watch_state.judge", fail)
    (sentence,) = watched.check().failed
    assert "could not be checked (ValueError: singular matrix); the watch continues" in sentence
    assert watched.check() is None
    monkeypatch.undo()
    update = watched.check()
    assert len(update.track.recordings) == len(update.new) == 9
    watched.close()


def test_a_broken_network_is_stated_once(tmp_path, monkeypatch):
    monkeypatch.setattr("asperity.monitoring.notify.RETRY_S", 0.0)
    broken = Broken()
    snapshots(tmp_path / "in", np.ones(9))
    watched = watch(tmp_path, notifiers=[broken])
    assert "recorder could not be notified (connection refused)" in watched.check().failed[0]
    snapshots(tmp_path / "in", np.ones(1), first=9)
    assert watched.check().failed == ()
    broken.works = True
    assert watched.check().failed == ("recorder has been notified",)
    assert broken.states == ["none"]
    watched.close()


@pytest.mark.parametrize("jump", [timedelta(days=400), timedelta(days=-400)])
def test_a_clock_that_jumps_neither_makes_blind_nor_delays_notifications(
    tmp_path, monkeypatch, jump
):
    class Clock(datetime):
        @classmethod
        def now(cls, zone=None):
            return datetime.now(zone) + jump

    recipient = Broken()
    snapshots(tmp_path / "in", np.ones(9))
    watched = watch(tmp_path, notifiers=[recipient], overdue_after_s=0.5)
    watched.check()
    monkeypatch.setattr("asperity.monitoring.watching.folder_watch.datetime", Clock)
    monkeypatch.setattr(
        "asperity.monitoring.notify.time", lambda: time.time() + jump.total_seconds()
    )
    recipient.works = True
    assert watched.check().failed == ("recorder has been notified",)
    assert recipient.states == ["none"]
    time.sleep(0.6)
    assert watched.check().judgement["alarm"]["state"] == "blind"
    watched.close()


class Tracked:
    """A series that is saved as its state."""

    def __init__(self, state="none"):
        self.alarm = type("Alarm", (), {"state": state})

    def save(self, path):
        Path(path).write_text(self.alarm.state)
        return path


@pytest.fixture
def _page(monkeypatch):
    monkeypatch.setattr(
        "asperity.cli.monitored.watch_output.report.write_track_report",
        lambda track, path: track.save(path),
    )


@pytest.mark.usefixtures("_page")
def test_reports_are_written_at_first_at_a_change_and_at_the_end(tmp_path):
    reports = WatchReports(tmp_path, 3600.0, once=False)
    written = tmp_path / "report.html"
    reports.add(Tracked("none"))
    assert (written.read_text(), reports.current) == ("none", True)
    written.write_text("old")
    reports.add(Tracked("none"))
    assert (written.read_text(), reports.current) == ("old", False)
    reports.add(Tracked("alarm"))
    assert (written.read_text(), reports.current) == ("alarm", True)
    reports.add(Tracked("alarm"))
    written.write_text("old")
    reports.write_due()
    assert written.read_text() == "old"
    reports.write()
    assert (written.read_text(), reports.current) == ("alarm", True)


@pytest.mark.usefixtures("_page")
def test_brief_reports_hold_no_evaluation_in_memory(tmp_path):
    reports = WatchReports(tmp_path, 0.1, once=False, brief=True)
    reports.add(Tracked())
    (tmp_path / "track.csv").unlink()
    reports.add(Tracked())
    reports.write()
    assert not (tmp_path / "track.csv").exists()
    time.sleep(0.12)
    reports.add(Tracked())
    assert (tmp_path / "track.csv").exists()


@pytest.mark.usefixtures("_page")
def test_reports_are_written_at_intervals(tmp_path):
    reports = WatchReports(tmp_path, 0.1, once=False)
    reports.add(Tracked())
    (tmp_path / "track.csv").unlink()
    reports.add(Tracked())
    assert not (tmp_path / "track.csv").exists()
    time.sleep(0.12)
    reports.write_due()
    assert (tmp_path / "track.csv").exists()


@pytest.mark.usefixtures("_page")
def test_a_failing_report_is_stated_once_and_retried(tmp_path, capsys, monkeypatch):
    monkeypatch.setattr("asperity.cli.monitored.watch_output.REPORT_RETRY_S", 0.0)
    reports = WatchReports(tmp_path / "absent", 3600.0, once=False)
    for _ in range(3):
        reports.add(Tracked())
    assert capsys.readouterr().err.count("could not be written") == 1
    (tmp_path / "absent").mkdir()
    reports.write_due()
    assert "is written again" in capsys.readouterr().err
    assert (tmp_path / "absent" / "report.html").is_file()
    with pytest.raises(OSError, match="No such file"):
        WatchReports(tmp_path / "other", 3600.0, once=True).add(Tracked())


@pytest.fixture
def small_disk(tmp_path):
    """A file system of 12 MB; skipped where none may be mounted."""
    folder = tmp_path / "out"
    folder.mkdir()
    command = ["mount", "-t", "tmpfs", "-o", "size=12m", "tmpfs", str(folder)]
    with suppress(OSError):
        mounted = subprocess.run(command, capture_output=True, check=False)
        if mounted.returncode == 0:
            yield folder
            subprocess.run(["umount", str(folder)], check=False)
            return
    pytest.skip("no file system may be mounted here")


def test_a_full_disk_does_not_end_a_watch(tmp_path, small_disk):
    snapshots(tmp_path / "in", np.ones(12))
    (tmp_path / "listen.py").write_text(
        "import sys, pathlib\npathlib.Path('log').open('a').write(sys.stdin.read() + chr(10))\n"
    )
    command = [sys.executable, "-m", "asperity", "watch", "in", "--out", "out", "--every", "0.1"]
    command += ["--settle", "0", "--quiet", "--on-alarm", f"'{sys.executable}' listen.py"]
    errors = (tmp_path / "errors").open("w")
    process = subprocess.Popen(command, cwd=tmp_path, stderr=errors, stdout=subprocess.DEVNULL)
    log = tmp_path / "log"

    def states():
        lines = log.read_text().splitlines() if log.exists() else []
        return [json.loads(line)["state"] for line in lines if line]

    def counts():
        text = (tmp_path / "errors").read_text()
        return text.count("the watch continues"), text.count("is written again")

    def wait(condition):
        end = time.monotonic() + 60.0
        while not condition() and process.poll() is None and time.monotonic() < end:
            time.sleep(0.05)
        assert condition()

    try:
        wait(lambda: states() == ["none"] and (small_disk / "report.html").exists())
        with suppress(OSError), (small_disk / "filler").open("wb", 0) as filler:
            while True:
                filler.write(b"0" * 4096)
        snapshots(tmp_path / "in", failing(), first=12)
        wait(lambda: states() == ["none", "alarm"])
        (tmp_path / "in/s-012.npz").unlink()
        (small_disk / "filler").unlink()
        # the store may still have had space in its log
        wait(lambda: counts()[0] == counts()[1] > 0)
    finally:
        process.send_signal(signal.SIGTERM)
        assert process.wait(30) == -signal.SIGTERM
        errors.close()
    assert 1 <= counts()[0] <= 2
    stored = query_store(small_disk / "asperity.db", "SELECT count(*), count(state) FROM recording")
    assert stored == [(36, 36)]
    assert (small_disk / "report.html").stat().st_size > 10_000
    assert states() == ["none", "alarm"]


# Start on a full disk
# ---------------------------------------------------------------------------------


def stored_rows(tmp_path):
    rows = "SELECT file, state, row, reading FROM recording ORDER BY file"
    return query_store(tmp_path / "out/asperity.db", rows)


def test_a_new_sensor_starts_on_a_full_disk(tmp_path, disk):
    recorder = Recorder()
    levels = [*np.ones(12), *failing()]
    snapshots(tmp_path / "in", levels)
    stores = []
    for full in (False, True):
        watch(tmp_path).close()  # an empty store
        disk.full = full
        watched = watch(tmp_path, notifiers=[recorder] if full else ())
        update = watched.check()
        assert update.track.alarm.state == "alarm"
        assert [FULL in sentence for sentence in update.failed] == [True] * full
        disk.full = False
        if full:
            assert stored_rows(tmp_path) == []
            assert "is written again" in watched.check().failed[0]
        watched.close()
        stores.append(stored_rows(tmp_path))
        (tmp_path / "out/asperity.db").unlink()
    assert stores[0] == stores[1]
    assert recorder.states == ["alarm"]


def test_a_store_without_space_for_its_index_is_read(tmp_path, disk):
    snapshots(tmp_path / "in", [*np.ones(12), *failing()])
    watched = watch(tmp_path, tracking={"acknowledge": "last"})
    watched.check()
    watched.close()
    for file in (tmp_path / "in").iterdir():
        file.unlink()  # the history is in the store only
    disk.full = disk.closed = True
    recorder = Recorder()
    watched = watch(tmp_path, notifiers=[recorder])
    snapshots(tmp_path / "in", [20.0] * 3, first=36)
    update = watched.check()
    assert len(update.track.scalars()["recordings"]) == 39
    assert update.track.alarm.state == "cannot-tell"
    assert "disk I/O error" in update.failed[0]
    disk.full = disk.closed = False
    assert "is written again" in watched.check().failed[0]
    watched.close()
    assert len(stored_rows(tmp_path)) == 39
    assert recorder.states == ["cannot-tell"]


def test_files_are_judged_while_the_store_cannot_be_read(tmp_path, disk):
    snapshots(tmp_path / "in", [*np.ones(12), *failing()])
    watched = watch(tmp_path, tracking={"acknowledge": "last"})
    assert watched.check().track.alarm.state == "none"
    watched.close()
    disk.full = disk.lost = True
    recorder = Recorder()
    watched = watch(tmp_path, notifiers=[recorder])
    assert watched.check().track.alarm.state == "alarm"  # the acknowledgement cannot be read
    snapshots(tmp_path / "in", [20.0], first=36)
    watched.check()
    disk.full = disk.lost = False
    update = watched.check()
    assert update.track.alarm.state == "cannot-tell"  # few recordings since
    watched.close()
    assert len(stored_rows(tmp_path)) == 37
    assert recorder.states == ["alarm", "cannot-tell"]
    acknowledged = "SELECT count(*) FROM judgement WHERE state = 'acknowledged'"
    assert query_store(tmp_path / "out/asperity.db", acknowledged) == [(1,)]


def test_a_single_run_on_a_full_disk_fails(tmp_path, disk):
    snapshots(tmp_path / "in", np.ones(3))
    watch(tmp_path).close()
    disk.full = True
    with pytest.raises(database.StoreUnavailable, match=FULL):
        watch(tmp_path, once=True).check()
