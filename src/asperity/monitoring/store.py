"""One SQLite file for all that is monitored: machine, point, sensor, recordings, judgements.

Whatever is written is written whole (transactions, write-ahead log): a watch may be killed at any
moment. What is written of a sensor is left to `sensor` and `sensors`.
"""

import json
import sqlite3
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from datetime import datetime
from pathlib import Path
from typing import Any, NamedTuple

from asperity.core.errors import AsperityError, UnreadableFile
from asperity.core.files import require_writable
from asperity.trend import AlarmState

STORE = "asperity.db"
VERSION = 3  # 1 had no duration of a recording, 2 had what was learned of a sensor in its own row
BUSY_S = 30.0  # another watch may be writing
REMEDY = "delete it and its recordings are read again, or choose another store"
LEARNED = "CREATE TABLE learned (sensor INTEGER PRIMARY KEY REFERENCES sensor, body BLOB NOT NULL)"
SCHEMA = f"""
CREATE TABLE machine (id INTEGER PRIMARY KEY, name TEXT NOT NULL UNIQUE);
CREATE TABLE point (
    id INTEGER PRIMARY KEY, machine INTEGER NOT NULL REFERENCES machine, name TEXT NOT NULL, UNIQUE (machine, name));
CREATE TABLE sensor (
    id INTEGER PRIMARY KEY, point INTEGER NOT NULL REFERENCES point, name TEXT NOT NULL, settings TEXT NOT NULL,
    asked TEXT, said TEXT, since INTEGER, UNIQUE (point, name));
{LEARNED};
CREATE TABLE recording (
    id INTEGER PRIMARY KEY, sensor INTEGER NOT NULL REFERENCES sensor, file TEXT NOT NULL, version TEXT NOT NULL,
    heard TEXT NOT NULL, started TEXT, duration REAL, refused INTEGER NOT NULL, state TEXT, row TEXT,
    reading BLOB NOT NULL,
    UNIQUE (sensor, file, version));
CREATE TABLE judgement (
    id INTEGER PRIMARY KEY, sensor INTEGER NOT NULL REFERENCES sensor, time TEXT NOT NULL, state TEXT NOT NULL,
    since TEXT, reason TEXT, raised_by TEXT, false_alarm_rate REAL, verdict TEXT, recordings INTEGER, new INTEGER);
CREATE TABLE call (
    id INTEGER PRIMARY KEY, sensor INTEGER NOT NULL REFERENCES sensor, who TEXT NOT NULL, state TEXT NOT NULL,
    said TEXT NOT NULL, time TEXT NOT NULL, attempts INTEGER NOT NULL DEFAULT 0, due REAL NOT NULL DEFAULT 0,
    failure TEXT, answered TEXT);
CREATE INDEX calls ON call (sensor, who);
CREATE INDEX judgements ON judgement (sensor, state);
CREATE VIEW trend AS
    SELECT machine.name AS machine, point.name AS point, sensor.name AS sensor, recording.file, recording.heard,
        recording.started, recording.state, json_extract(row, '$.x') AS x, json_extract(row, '$.crf_hz') AS crf_hz,
        json_extract(row, '$.crf_std_hz') AS crf_std_hz, json_extract(row, '$.rms') AS rms,
        json_extract(row, '$.kurtosis') AS kurtosis,
        json_extract(row, '$.velocity_rms') AS velocity_rms, json_extract(row, '$.zone') AS zone,
        json_extract(row, '$.reason') AS reason
    FROM recording JOIN sensor ON sensor.id = recording.sensor JOIN point ON point.id = sensor.point
        JOIN machine ON machine.id = point.machine;
"""


class Place(NamedTuple):
    """Which sensor recordings are of: names of the machine, the point on it, the sensor there."""

    machine: str
    point: str
    sensor: str


class Version(NamedTuple):
    """A version of a file: another size or time of change makes another."""

    file: str
    version: str


class Standing(NamedTuple):
    """An alarm that nobody has acknowledged: the recording that raised it, why, by what."""

    file: str
    reason: str
    raised_by: str


class Kept(NamedTuple):
    """A recording of the store: its number there, when it began, None if unknown, its state, None unjudged.

    `refused` where nothing could be read of it; `duration_s` is nan until it has been judged or
    read.
    """

    number: int
    time: datetime | None
    state: AlarmState | None
    refused: bool
    duration_s: float


class Store:
    """A store of recordings and judgements; made where there is none.

    Raises
    ------
    BadInput
        for a path that cannot be written to.
    UnreadableFile
        for a file that is no such store, or of a later version.
    """

    def __init__(self, path: str | Path, *, make: bool = True) -> None:
        self.path = Path(path)
        if not self.path.exists() and not make:
            raise UnreadableFile(f"{self.path} does not exist; check its name")
        require_writable(self.path)
        self._connection = sqlite3.connect(self.path, timeout=BUSY_S, isolation_level=None)
        with self._understood():
            version = self._connection.execute("PRAGMA user_version").fetchone()[0]
            self._connection.execute("PRAGMA journal_mode = WAL")
            self._connection.execute("PRAGMA foreign_keys = ON")
            if version == 0:
                self._begin()
            elif version in (1, 2):
                self._from_before()
            elif version != VERSION:
                raise UnreadableFile(
                    f"{self.path} is a store of version {version}, and this asperity writes {VERSION}; "
                    "take the newer asperity, or choose another store"
                )

    def close(self) -> None:
        """Nothing is lost without it; with it the write-ahead log is folded into the file."""
        self._connection.close()

    def _begin(self) -> None:
        with self.transaction() as run:
            if run("PRAGMA user_version").fetchone()[0] == VERSION:
                return  # another watch was faster
            if run("SELECT count(*) FROM sqlite_master").fetchone()[0]:
                raise UnreadableFile(
                    f"{self.path} is a database of something else; choose another store"
                )
            for statement in SCHEMA.split(";\n"):
                run(statement)
            run(f"PRAGMA user_version = {VERSION}")

    def _from_before(self) -> None:
        """Make a store of an older version one of this."""
        with self.transaction() as run:
            if run("PRAGMA user_version").fetchone()[0] == 1:
                run("ALTER TABLE recording ADD COLUMN duration REAL")
                run("UPDATE recording SET duration = json_extract(row, '$.duration_s')")
                run("PRAGMA user_version = 2")
            if run("PRAGMA user_version").fetchone()[0] == 2:  # no other watch was faster
                run(LEARNED)
                run("INSERT INTO learned SELECT id, learned FROM sensor WHERE learned IS NOT NULL")
                run(
                    "UPDATE sensor SET learned = NULL"
                )  # the column stays: not every SQLite drops one
                run("PRAGMA user_version = 3")

    @contextmanager
    def _understood(self) -> Iterator[None]:
        try:
            yield
        except sqlite3.OperationalError as error:
            reason = "another program holds it" if "locked" in str(error) else str(error)
            raise AsperityError(
                f"{self.path} cannot be used: {reason}; free it or its disk, and try again"
            ) from error
        except sqlite3.DatabaseError as error:
            raise UnreadableFile(
                f"{self.path} is no store of asperity, or damaged ({error}); {REMEDY}"
            ) from None

    @contextmanager
    def transaction(self) -> Iterator[Any]:
        """All that is run inside, or nothing of it."""
        with self._understood():
            self._connection.execute("BEGIN IMMEDIATE")
            try:
                yield self._connection.execute
            except BaseException:
                self._connection.execute("ROLLBACK")
                raise
            self._connection.execute("COMMIT")

    def read(self, query: str, *values: Any) -> list[Any]:
        """Rows of a query."""
        with self._understood():
            return self._connection.execute(query, values).fetchall()

    def places(self) -> list[tuple[int, Place]]:
        """Every sensor with its number, by name."""
        rows = self.read(
            "SELECT sensor.id, machine.name, point.name, sensor.name FROM sensor JOIN point ON point.id = sensor.point "
            "JOIN machine ON machine.id = point.machine ORDER BY 2, 3, 4"
        )
        return [(number, Place(*names)) for number, *names in rows]

    def sensors_at(self, machine: str, point: str) -> list[tuple[str, dict[str, Any]]]:
        """Names and settings of the sensors at a point, in the order in which they were entered."""
        rows = self.read(
            "SELECT sensor.name, settings FROM sensor JOIN point ON point.id = sensor.point "
            "JOIN machine ON machine.id = point.machine WHERE machine.name = ? AND point.name = ? ORDER BY sensor.id",
            *(machine, point),
        )
        return [(name, json.loads(settings)) for name, settings in rows]

    def entered(self, place: Place, settings: Mapping[str, Any]) -> tuple[int, dict[str, Any]]:
        """Number and settings of a sensor of the store; one that is new gets those given."""
        with self.transaction() as run:
            run("INSERT OR IGNORE INTO machine (name) VALUES (?)", (place.machine,))
            (machine,) = run("SELECT id FROM machine WHERE name = ?", (place.machine,)).fetchone()
            run("INSERT OR IGNORE INTO point (machine, name) VALUES (?, ?)", (machine, place.point))
            key = (machine, place.point)
            (point,) = run("SELECT id FROM point WHERE machine = ? AND name = ?", key).fetchone()
            told = (point, place.sensor, json.dumps(dict(settings)))
            run("INSERT OR IGNORE INTO sensor (point, name, settings) VALUES (?, ?, ?)", told)
            number, begun = run(
                "SELECT id, settings FROM sensor WHERE point = ? AND name = ?", told[:2]
            ).fetchone()
        return number, json.loads(begun)
