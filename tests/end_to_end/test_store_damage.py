"""A store whose rows or bits something else has changed: named, repaired, and never believed."""

import json
import random
import shutil
import sqlite3
from contextlib import closing

import numpy as np
import pytest

from asperity.core.errors import AsperityError, UnreadableFile
from asperity.monitoring import TrackSettings, WatchSettings, store_overview
from asperity.monitoring.overview import acknowledge_in
from asperity.monitoring.store.database import Store
from asperity.monitoring.store.digests import GROUPS
from asperity.monitoring.watch import open_watch

STORE = "out/asperity.db"
FALSE_ROWS = {  # statement of another program, and what the watch names
    "reading of one byte": ("UPDATE recording SET reading = x'00' WHERE id = 5", "s-004.npz"),
    "no reading": ("UPDATE recording SET reading = x'' WHERE id = 5", "s-004.npz"),
    "reading of another recording": (
        "UPDATE recording SET reading = (SELECT reading FROM recording WHERE id = 2) WHERE id = 25",
        "s-024.npz",
    ),
    "reading as text": ("UPDATE recording SET reading = 'abc' WHERE id = 5", "s-004.npz"),
    "state": ("UPDATE recording SET state = 'ok' WHERE id = 27", "s-026.npz"),
    "unknown state": ("UPDATE recording SET state = 'fine'", "and 23 more"),
    "state is missing": ("UPDATE recording SET state = NULL WHERE id = 27", "s-026.npz"),
    "row without an end": ("UPDATE recording SET row = '{' WHERE id = 5", "s-004.npz"),
    "row of another kind": ("UPDATE recording SET row = '[]'", "and 23 more"),
    "quiet row": (
        "UPDATE recording SET row = json_set(row, '$.rms', 1.0) WHERE id > 20",
        "s-020.npz",
    ),
    "row that is not UTF-8": (
        "UPDATE recording SET row = CAST(x'ff00' AS TEXT) WHERE id = 5",
        "s-004.npz",
    ),
    "start": ("UPDATE recording SET started = 'yesterday' WHERE id = 5", "s-004.npz"),
    "arrival": ("UPDATE recording SET arrived = x'00' WHERE id = 5", "s-004.npz"),
    "duration": ("UPDATE recording SET duration = 'long' WHERE id = 5", "s-004.npz"),
    "refused": ("UPDATE recording SET refused = 1 WHERE id > 20", "s-020.npz"),
    "file": ("UPDATE recording SET file = 'other' WHERE id = 5", "other"),
    "version": ("UPDATE recording SET version = '1 1' WHERE id = 5", "s-004.npz"),
    "sensor of a recording": ("UPDATE recording SET sensor = 9 WHERE id = 5", "s-004.npz"),
    "swapped recordings": (
        "UPDATE recording SET id = CASE id WHEN 5 THEN -5 ELSE 5 END WHERE id IN (5, 27)",
        "recording",
    ),
    "settings": ("UPDATE sensor SET settings = '[]'", "settings of sensor sensor"),
    "spacing": (
        "UPDATE sensor SET settings = json_set(settings, '$.spacing_hz', 0)",
        "settings of sensor",
    ),
    "name of a sensor": ("UPDATE sensor SET name = 'x'", "settings of sensor x"),
    "name of a machine": ("UPDATE machine SET name = 'x'", "settings of sensor"),
    "machine of a point": ("UPDATE point SET machine = 7", "settings of sensor"),
    "question": ("UPDATE sensor SET question = 'x'", "last judgement"),
    "content": (
        "UPDATE sensor SET content = json_set(content, '$.verdict', 'No alarm.')",
        "last judgement",
    ),
    "content without numbers": ("UPDATE sensor SET content = '{}'", "last judgement"),
    "since": ("UPDATE sensor SET since = 99", "last judgement"),
    "levels": ("UPDATE levels SET body = '{}'", "memory of levels"),
    "alarm": ("UPDATE judgement SET state = 'ok' WHERE state = 'alarm'", "judgement"),
    "acknowledgement": (
        "UPDATE judgement SET since = 's-035.npz' WHERE state = 'acknowledged'",
        "acknowledged",
    ),
    "all acknowledged": (
        "INSERT INTO judgement (sensor, time, state, since) "
        "VALUES (1, '2026-01-01T00:00:00+00:00', 'acknowledged', 's-027.npz')",
        "acknowledged",
    ),
    "notification": ("UPDATE call SET state = 'ok', content = '{'", "notification"),
    "deleted recording": ("INSERT INTO dropped VALUES (1, 'x', 'y', x'00')", "mark of a deleted"),
    "gap": ("INSERT INTO gap VALUES (5, 'many', NULL)", "count of deleted"),
}


class Recorder:
    """Recipient of notifications."""

    name = "recorder"

    def send(self, notification):
        pass


def watched(folder, **settings):
    """Return the update of one pass over a folder, and the content of its judgement."""
    (folder / "out").mkdir(exist_ok=True)
    watching = WatchSettings(
        once=True, settle_time_s=0.0, notifiers=[Recorder()], machine="mill", point="outer"
    )
    watch = open_watch(
        (folder / "in").resolve(), Store(folder / STORE), TrackSettings(**settings), watching
    )
    with closing(watch):
        update = watch.check()
    return update.failed, json.dumps(content(update), sort_keys=True, default=str)


def content(update):
    """Return the judgement of an update as in JSON."""
    return update.judgement or update.track.scalars()


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A store with an acknowledged and a standing alarm, and its recordings."""
    folder = tmp_path_factory.mktemp("watched")
    (folder / "in").mkdir()
    levels = [*np.ones(12), *np.geomspace(1.0, 30.0, 16)]
    for number, level in enumerate(levels):
        values = level * np.random.default_rng(number).standard_normal(2000)
        np.savez(folder / f"in/s-{number:03}.npz", acc=values, fs=20e3, unit="m/s^2")
        if number == 21:
            watched(folder)
    watched(folder, acknowledge="s-014.npz")
    watched(folder)
    return folder


@pytest.fixture
def place(folder, tmp_path):
    """Return the folder with a store of its own; its recordings keep their path."""
    (tmp_path / "out").mkdir()
    shutil.copy(folder / STORE, tmp_path / STORE)
    (tmp_path / "in").symlink_to(folder / "in")
    return tmp_path


def change(place, statement):
    with closing(sqlite3.connect(place / STORE)) as connection:
        connection.execute(statement)
        connection.commit()


def test_an_intact_store_has_no_remark(place, folder):
    assert watched(place) == ((), watched(folder)[1])
    assert store_overview(place / STORE).rows[0]["state"] == "alarm"


@pytest.mark.parametrize("name", FALSE_ROWS)
def test_a_row_that_another_program_wrote_is_named_and_not_used(place, name):
    expected = watched(place)[1]
    statement, named = FALSE_ROWS[name]
    change(place, statement)
    with pytest.raises(UnreadableFile, match=r"was damaged: .*run the watch, which repairs it"):
        store_overview(place / STORE)
    with pytest.raises(UnreadableFile, match="was damaged"):
        acknowledge_in(place / STORE, "mill/outer/sensor")
    failed, judgement = watched(place)
    assert named in " ".join(failed)
    assert all(len(sentence) < 500 for sentence in failed)
    assert json.loads(judgement)["alarm"]["state"] == "alarm"
    kept = {"acknowledgement", "alarm"}
    whole = {"settings", "spacing", "name of a sensor", "name of a machine", "machine of a point"}
    if name not in kept | whole | {"levels"}:
        assert judgement == expected
    failed, again = watched(place)
    assert (failed, again) == ((), judgement)


TRIGGERS = [
    "AFTER INSERT ON recording BEGIN INSERT INTO judgement (sensor, time, state, since) VALUES "
    "(NEW.sensor, NEW.arrived, 'acknowledged', 's-027.npz'); END",
    "BEFORE INSERT ON judgement BEGIN SELECT (WITH RECURSIVE c(x) AS (SELECT 1 UNION ALL SELECT "
    "x + 1 FROM c) SELECT count(*) FROM c); END",
    "BEFORE INSERT ON recording BEGIN SELECT RAISE(IGNORE); END",
    "AFTER INSERT ON judgement BEGIN UPDATE judgement SET state = 'ok'; END",
    "AFTER INSERT ON call BEGIN UPDATE call SET answered = 'now'; END",
]


@pytest.mark.parametrize("trigger", TRIGGERS)
def test_a_trigger_of_another_program_is_removed_before_it_acts(place, trigger):
    expected = watched(place)[1]
    change(place, f'CREATE TRIGGER "planted ""one""" {trigger}')
    change(place, "DELETE FROM recording WHERE id = 28")  # is read again, and inserted
    with pytest.raises(UnreadableFile, match="a trigger of another program"):
        store_overview(place / STORE)
    failed, judgement = watched(place)
    assert "a trigger of another program, removed" in " ".join(failed)
    assert judgement == expected


@pytest.mark.parametrize(
    "statement",
    [
        "DELETE FROM sensor",
        "DELETE FROM point",
        "ALTER TABLE recording RENAME COLUMN state TO st",
        "ALTER TABLE judgement DROP COLUMN verdict",
        "DROP TABLE call",
        "CREATE TRIGGER planted BEFORE INSERT ON judgement BEGIN SELECT RAISE(ABORT, 'no'); END",
    ],
)
@pytest.mark.parametrize("running", [False, True])
def test_a_changed_structure_is_named_and_the_alarm_stays(place, statement, running):
    watching = WatchSettings(poll_interval_s=0.0, settle_time_s=0.0, machine="mill", point="outer")
    watch = open_watch((place / "in").resolve(), Store(place / STORE), TrackSettings(), watching)
    with closing(watch):
        watch.check()
        if running:
            change(place, statement)
            update = watch.check()
    if not running:
        change(place, statement)
        watch = open_watch(
            (place / "in").resolve(), Store(place / STORE), TrackSettings(), watching
        )
        with closing(watch):
            update = watch.check()
    assert "was damaged" in " ".join(update.failed)
    assert content(update)["alarm"]["state"] == "alarm"


def test_sensors_do_not_take_over_recordings_whose_sensor_is_missing(place, tmp_path):
    (tmp_path / "quiet").mkdir()
    for number in range(12):
        values = np.random.default_rng(number).standard_normal(2000)
        np.savez(tmp_path / f"quiet/q-{number:03}.npz", acc=values, fs=20e3, unit="m/s^2")
    for table in ("machine", "point", "sensor"):
        change(place, f"DELETE FROM {table}")
    watching = WatchSettings(once=True, settle_time_s=0.0, machine="fan", point="rear")
    watch = open_watch(tmp_path / "quiet", Store(place / STORE), TrackSettings(), watching)
    with closing(watch):
        update = watch.check()
    assert "rows of a sensor that is missing" in update.failed[0]
    assert len(content(update)["recordings"]) == 12
    assert content(update)["alarm"]["state"] != "alarm"


def test_an_emptied_store_is_named(place):
    (place / STORE).write_bytes(b"")
    failed, judgement = watched(place)
    assert failed[0].endswith("was empty; recordings are read again")
    assert json.loads(judgement)["alarm"]["state"] == "alarm"


def test_a_damaged_recording_without_its_file_is_named(place):
    change(place, "UPDATE recording SET file = '/gone/s-001.npz' WHERE id = 2")
    (failed,) = watched(place)[0]
    assert failed.endswith("damaged: recording s-001.npz; read again if the file is still there")


def test_rows_that_change_while_a_watch_runs_are_found(place):
    watching = WatchSettings(poll_interval_s=0.0, settle_time_s=0.0, machine="mill", point="outer")
    watch = open_watch((place / "in").resolve(), Store(place / STORE), TrackSettings(), watching)
    with closing(watch):
        before = content(watch.check())
        assert watch.check() is None
        change(place, "UPDATE recording SET reading = x'00', state = 'ok' WHERE id > 20")
        update = watch.check()
        assert "s-020.npz" in update.failed[0]
        assert content(update)["alarm"]["state"] == before["alarm"]["state"] == "alarm"
        assert watch.check() is None


def test_single_bits_are_named_or_have_no_effect(place):
    """150 in the file, in turn; some are in unused bytes."""
    expected = watched(place)[1]
    content, rng = (place / STORE).read_bytes(), random.Random(42)
    named = 0
    for _ in range(150):
        damaged = bytearray(content)
        bit = rng.randrange(8 * len(damaged))
        damaged[bit // 8] ^= 1 << bit % 8
        for path in (place / "out").glob("asperity*"):
            path.unlink()
        (place / STORE).write_bytes(damaged)
        try:
            failed, judgement = watched(place)
        except AsperityError as error:
            failed, judgement = (str(error),), expected
        named += bool(failed)
        assert failed or judgement == expected, bit
        if judgement != expected:
            assert json.loads(judgement)["alarm"]["state"] == "alarm", (bit, failed)
    assert named > 50  # the others are in unused bytes


def test_a_store_with_a_damaged_structure_is_kept_aside(place):
    content = bytearray((place / STORE).read_bytes())
    content[4096 * 8 : 4096 * 8 + 12] = b"\x00" * 12  # header of a page
    (place / STORE).write_bytes(content)
    with pytest.raises(UnreadableFile, match="damaged"):
        store_overview(place / STORE)
    failed, judgement = watched(place)
    assert "is kept as asperity-damaged-" in failed[0]
    assert json.loads(judgement)["alarm"]["state"] == "alarm"
    (kept,) = (place / "out").glob("asperity-damaged-*.db")
    assert kept.read_bytes() == content


def test_a_store_of_the_former_version_gets_digests(place):
    expected = watched(place)[1]
    with closing(sqlite3.connect(place / STORE)) as connection:
        tables = {group.table for group in GROUPS}
        for table in tables:
            connection.execute(f"ALTER TABLE {table} DROP COLUMN digest")
        connection.execute("ALTER TABLE sensor DROP COLUMN content_digest")
        connection.execute("PRAGMA user_version = 4")
    (remark,), judgement = watched(place)
    assert remark.endswith("was converted from version 4, as it was")
    assert judgement == expected
    change(place, "UPDATE recording SET state = 'ok' WHERE id = 27")
    assert "s-026.npz" in watched(place)[0][0]
