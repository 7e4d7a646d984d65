"""Tables of a store, and their conversion from older versions."""

import sqlite3
from collections.abc import Callable
from typing import TypeAlias

from asperity.monitoring.store.digests import add_columns

Run: TypeAlias = Callable[..., sqlite3.Cursor]  # runs a statement in a transaction
# 1: no duration of recordings; 2: `learned` is a column of `sensor`; 3: no `gap`, `RENAMED`;
# 4: no digests
VERSION = 5
LEARNED = "CREATE TABLE learned (sensor INTEGER PRIMARY KEY REFERENCES sensor, body BLOB NOT NULL)"
LEVELS = "CREATE TABLE levels (sensor INTEGER PRIMARY KEY REFERENCES sensor, body TEXT NOT NULL)"
# versions of files whose recordings were deleted, and the number deleted before a recording
DROPPED = (
    "CREATE TABLE dropped (sensor INTEGER NOT NULL REFERENCES sensor, file TEXT NOT NULL, "
    "version TEXT NOT NULL, PRIMARY KEY (sensor, file, version)) WITHOUT ROWID"
)
GAP = "CREATE TABLE gap (recording INTEGER PRIMARY KEY REFERENCES recording, count INTEGER)"
TREND = """CREATE VIEW trend AS
    SELECT machine.name AS machine, point.name AS point, sensor.name AS sensor, recording.file,
        recording.arrived, recording.started, recording.state, json_extract(row, '$.x') AS x,
        json_extract(row, '$.crf_hz') AS crf_hz,
        json_extract(row, '$.crf_std_hz') AS crf_std_hz, json_extract(row, '$.rms') AS rms,
        json_extract(row, '$.kurtosis') AS kurtosis,
        json_extract(row, '$.velocity_rms') AS velocity_rms, json_extract(row, '$.zone') AS zone,
        json_extract(row, '$.reason') AS reason
    FROM recording JOIN sensor ON sensor.id = recording.sensor JOIN point ON point.id = sensor.point
        JOIN machine ON machine.id = point.machine"""
RENAMED = (  # table, old and new name of a column
    ("recording", "heard", "arrived"),
    ("sensor", "asked", "question"),
    ("sensor", "said", "content"),
    ("call", "said", "content"),
)
SCHEMA = f"""
CREATE TABLE machine (id INTEGER PRIMARY KEY, name TEXT NOT NULL UNIQUE);
CREATE TABLE point (
    id INTEGER PRIMARY KEY, machine INTEGER NOT NULL REFERENCES machine, name TEXT NOT NULL,
    UNIQUE (machine, name));
CREATE TABLE sensor (
    id INTEGER PRIMARY KEY, point INTEGER NOT NULL REFERENCES point, name TEXT NOT NULL,
    settings TEXT NOT NULL, question TEXT, content TEXT, since INTEGER, UNIQUE (point, name));
{LEARNED};
{LEVELS};
{DROPPED};
{GAP};
CREATE TABLE recording (
    id INTEGER PRIMARY KEY, sensor INTEGER NOT NULL REFERENCES sensor, file TEXT NOT NULL,
    version TEXT NOT NULL, arrived TEXT NOT NULL, started TEXT, duration REAL,
    refused INTEGER NOT NULL, state TEXT, row TEXT, reading BLOB NOT NULL,
    UNIQUE (sensor, file, version));
CREATE TABLE judgement (
    id INTEGER PRIMARY KEY, sensor INTEGER NOT NULL REFERENCES sensor, time TEXT NOT NULL,
    state TEXT NOT NULL, since TEXT, reason TEXT, raised_by TEXT, false_alarm_rate REAL,
    verdict TEXT, recordings INTEGER, new INTEGER);
CREATE TABLE call (
    id INTEGER PRIMARY KEY, sensor INTEGER NOT NULL REFERENCES sensor, who TEXT NOT NULL,
    state TEXT NOT NULL, content TEXT NOT NULL, time TEXT NOT NULL,
    attempts INTEGER NOT NULL DEFAULT 0, due REAL NOT NULL DEFAULT 0, failure TEXT, answered TEXT);
CREATE INDEX calls ON call (sensor, who);
CREATE INDEX judgements ON judgement (sensor, state);
{TREND};
"""


def create_tables(run: Run) -> None:
    """Create the tables of a new store within a transaction."""
    for statement in SCHEMA.split(";\n"):
        run(statement)
    add_columns(run)
    run(f"PRAGMA user_version = {VERSION}")


def convert_tables(run: Run) -> None:
    """Convert a store of an older version within a transaction."""
    if run("PRAGMA user_version").fetchone()[0] == 1:
        run("ALTER TABLE recording ADD COLUMN duration REAL")
        run("UPDATE recording SET duration = json_extract(row, '$.duration_s')")
        run("PRAGMA user_version = 2")
    if run("PRAGMA user_version").fetchone()[0] == 2:  # not done by another process
        run(LEARNED)
        run("INSERT INTO learned SELECT id, learned FROM sensor WHERE learned IS NOT NULL")
        # the column stays: not every SQLite can drop columns
        run("UPDATE sensor SET learned = NULL")
        run("PRAGMA user_version = 3")
    if run("PRAGMA user_version").fetchone()[0] == 3:
        for statement in (LEVELS, DROPPED, GAP, "DROP VIEW trend"):
            run(statement)
        for table, old, new in RENAMED:
            run(f"ALTER TABLE {table} RENAME COLUMN {old} TO {new}")
        run(TREND)
        run("PRAGMA user_version = 4")
    if run("PRAGMA user_version").fetchone()[0] == 4:
        add_columns(run)
        run(f"PRAGMA user_version = {VERSION}")
