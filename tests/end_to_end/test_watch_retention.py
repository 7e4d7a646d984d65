"""Retention of a store: spectra in single precision, thinned spectra and rows, smaller files."""

import json
import sqlite3
from contextlib import closing
from datetime import UTC, datetime, timedelta
from pathlib import Path

import numpy as np
import pytest

from asperity.monitoring import WatchSettings, watch_folder
from asperity.monitoring.store import retention
from asperity.monitoring.store.database import Store

START = datetime(2025, 3, 1, 12, tzinfo=UTC)


def snapshots(folder, levels, first=0, every=timedelta(hours=6)):
    """Write recordings of noise, four a day; without `every` they do not state their start."""
    Path(folder).mkdir(exist_ok=True)
    for number, level in enumerate(levels, first):
        values = level * np.random.default_rng(number).standard_normal(2000)
        path = Path(folder) / f"s-{number:03}.npz"
        np.savez(path, acc=values, fs=20e3, unit="m/s^2")
        if every is not None:
            started = (START + number * every).isoformat()
            Path(f"{path}.toml").write_text(f'started = "{started}"\n')


def look(tmp_path, store="store.db", **changes):
    """Return the only update of a single run."""
    watching = WatchSettings(
        store=tmp_path / store, once=True, settle_time_s=0.0, machine="m", point="p", **changes
    )
    (update,) = watch_folder(tmp_path / "in", tmp_path / "out", watching=watching)
    return update


def query_store(store, query):
    with closing(sqlite3.connect(store)) as connection:
        return connection.execute(query).fetchall()


@pytest.fixture(autouse=True)
def _short_windows(monkeypatch):
    """Judge the first 8 and the latest 16 recordings, so that few recordings are a long series."""
    monkeypatch.setattr("asperity.monitoring.ordering.LATEST_JUDGED", 16)
    monkeypatch.setattr("asperity.monitoring.watching.watch_state.STRIDE", 8)
    monkeypatch.setattr(retention, "FIRST", 8)
    monkeypatch.setattr(retention, "LATEST", 16)


def failing():
    """Return steady levels, a rise to twenty times that, and steady levels again."""
    return np.concatenate([np.ones(24), np.exp(np.log(20.0) * np.arange(24) / 23), np.ones(40)])


def test_spectra_are_stored_in_single_precision(tmp_path):
    snapshots(tmp_path / "in", np.ones(3))
    look(tmp_path)
    ((size,),) = query_store(tmp_path / "store.db", "SELECT avg(length(reading)) FROM recording")
    lines = 1001  # of a record of 0.1 s: 2000 samples
    assert size < 4 * lines + 3500


def test_only_samples_of_older_spectra_are_stored(tmp_path):
    snapshots(tmp_path / "in", failing())
    look(tmp_path)
    rows = query_store(
        tmp_path / "store.db", "SELECT length(reading), state, row FROM recording ORDER BY file"
    )
    assert len(rows) == 88
    assert all(row for _, _, row in rows)
    complete = [number for number, (size, _, _) in enumerate(rows) if size]
    states = [state for _, state, _ in rows]
    changes = [n for n in range(1, 88) if states[n] != states[n - 1]]
    days = {(START + n * timedelta(hours=6)).date(): n for n in reversed(range(88))}.values()
    assert {*range(8), *range(72, 88), *changes, *days} <= {*complete}
    assert len(complete) < 60


@pytest.mark.parametrize("every", [timedelta(hours=6), None])
def test_old_recordings_are_thinned_out_and_the_judgement_remains(tmp_path, every):
    levels = failing()
    updates = {}
    for store, keep_s in (("whole.db", None), ("thinned.db", 5 * 86400.0)):
        for first in range(0, 88, 22):
            snapshots(tmp_path / "in", levels[first : first + 22], first, every)
            updates[store] = look(tmp_path, store, keep_s=keep_s)
        snapshots(tmp_path / "in", [1.0, 1.1], 88, every)
        updates[store] = look(tmp_path, store, keep_s=keep_s)
        for file in (tmp_path / "in").iterdir():
            file.unlink()
    whole, thinned = (update.track for update in updates.values())
    assert whole.alarm.state == "alarm"
    assert thinned.verdict() == whole.verdict()
    assert [recording.x for recording in thinned.recordings] == [
        recording.x for recording in whole.recordings
    ]
    assert thinned.alarm == whole.alarm
    counts = [
        query_store(tmp_path / name, "SELECT count(*) FROM recording")[0][0] for name in updates
    ]
    assert counts[0] == 90
    assert counts[1] < 60 if every is not None else counts[1] == 90  # all arrived today


def test_deleted_recordings_count_as_positions_and_are_not_read_again(tmp_path):
    snapshots(tmp_path / "in", np.ones(60), every=None)
    look(tmp_path)
    with closing(Store(tmp_path / "store.db")) as store, store.transaction() as run:
        for number in range(60):  # as if one had arrived per hour
            time = (START + timedelta(hours=number)).isoformat()
            run("UPDATE recording SET arrived = ? WHERE id = ?", (time, number + 1))
    before = look(tmp_path)
    after = look(tmp_path, keep_s=86400.0)
    again = look(tmp_path, keep_s=86400.0)
    x = [[recording.x for recording in update.track.recordings] for update in (before, again)]
    assert x[0] == x[1]
    assert (after.new, again.new) == ((), ())
    count, gaps = query_store(
        tmp_path / "store.db",
        "SELECT (SELECT count(*) FROM recording), (SELECT sum(count) FROM gap)",
    )[0]
    assert count < 40
    assert count + gaps == 60
    assert query_store(tmp_path / "store.db", "SELECT count(*) FROM dropped") == [(gaps,)]
    for number in range(60):
        (tmp_path / f"in/s-{number:03}.npz").unlink()
    snapshots(tmp_path / "in", [1.0], 60, None)
    update = look(tmp_path, keep_s=86400.0)
    assert update.track.recordings[-1].x == 61.0
    assert query_store(tmp_path / "store.db", "SELECT count(*) FROM dropped") == [(0,)]


def test_a_thinned_store_becomes_smaller(tmp_path):
    snapshots(tmp_path / "in", np.concatenate([failing(), np.ones(80)]))
    look(tmp_path)
    before = (tmp_path / "store.db").stat().st_size
    look(tmp_path, keep_s=5 * 86400.0)
    assert (tmp_path / "store.db").stat().st_size < 0.75 * before
    with closing(Store(tmp_path / "store.db")) as store:
        assert store.read("PRAGMA integrity_check") == [("ok",)]
        assert store.read("PRAGMA foreign_key_check") == []


def test_an_alarm_is_acknowledged_in_a_thinned_store(tmp_path):
    from asperity.monitoring import acknowledge_in

    snapshots(tmp_path / "in", failing())
    assert look(tmp_path, keep_s=5 * 86400.0).track.alarm.state == "alarm"
    acknowledge_in(tmp_path / "store.db", "m/p/sensor")
    snapshots(tmp_path / "in", np.ones(3), first=88)
    assert look(tmp_path, keep_s=5 * 86400.0).track.alarm.state == "cannot-tell"


def test_an_unusable_age_is_refused(asp):
    snapshots("in", np.ones(2))
    for age in ("0d", "90", "soon"):
        code, _, err = asp("watch", "in", "--once", "--keep", age)
        assert code == 2
        assert "--keep" in err
    code, out, _ = asp("watch", "in", "--once", "--settle", "0", "--keep", "90d", "--json")
    assert code == 4
    assert len(json.loads(out)["recordings"]) == 2
