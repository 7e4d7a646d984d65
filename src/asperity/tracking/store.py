"""One SQLite file for all that is monitored: machine, point, sensor, recordings, judgements.

Whatever is written is written whole (transactions, write-ahead log): a watch may be killed at any moment. Judging is
left to `track`; what is judged when, to `watch`.
"""

import json
import sqlite3
from collections.abc import Collection, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, NamedTuple
from uuid import uuid4

from asperity.errors import AsperityError, BadInput, UnreadableFile
from asperity.files import require_writable
from asperity.tracking.learned import Learned, learned_bytes, learned_from
from asperity.tracking.model import Track
from asperity.tracking.reading import Reading, reading_bytes, reading_from
from asperity.tracking.silence import SILENCE
from asperity.wear import ALARM_STATES, AlarmState

STORE = "asperity.db"
VERSION = 1
BUSY_S = 30.0  # another watch may be writing
ACKNOWLEDGED = "acknowledged"  # state of a judgement that a person has made
REMEDY = "delete it and its recordings are read again, or choose another store"
FOLDER = "folder"  # among the settings of a sensor that was not named: nobody else's recordings are to be taken for its
SCHEMA = """
CREATE TABLE machine (id INTEGER PRIMARY KEY, name TEXT NOT NULL UNIQUE);
CREATE TABLE point (
    id INTEGER PRIMARY KEY, machine INTEGER NOT NULL REFERENCES machine, name TEXT NOT NULL, UNIQUE (machine, name));
CREATE TABLE sensor (
    id INTEGER PRIMARY KEY, point INTEGER NOT NULL REFERENCES point, name TEXT NOT NULL, settings TEXT NOT NULL,
    asked TEXT, said TEXT, learned BLOB, since INTEGER, UNIQUE (point, name));
CREATE TABLE recording (
    id INTEGER PRIMARY KEY, sensor INTEGER NOT NULL REFERENCES sensor, file TEXT NOT NULL, version TEXT NOT NULL,
    heard TEXT NOT NULL, started TEXT, refused INTEGER NOT NULL, state TEXT, row TEXT, reading BLOB NOT NULL,
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

    `refused` where nothing could be read of it.
    """

    number: int
    time: datetime | None
    state: AlarmState | None
    refused: bool


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
                raise UnreadableFile(f"{self.path} is a database of something else; choose another store")
            for statement in SCHEMA.split(";\n"):
                run(statement)
            run(f"PRAGMA user_version = {VERSION}")

    @contextmanager
    def _understood(self) -> Iterator[None]:
        try:
            yield
        except sqlite3.OperationalError as error:
            reason = "another program holds it" if "locked" in str(error) else str(error)
            raise AsperityError(f"{self.path} cannot be used: {reason}; free it or its disk, and try again") from error
        except sqlite3.DatabaseError as error:
            raise UnreadableFile(f"{self.path} is no store of asperity, or damaged ({error}); {REMEDY}") from None

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

    def sensor(self, place: Place, settings: Mapping[str, Any]) -> "Sensor":
        """A sensor of the store, entered if need be; `settings` are those by which its recordings are read."""
        with self.transaction() as run:
            run("INSERT OR IGNORE INTO machine (name) VALUES (?)", (place.machine,))
            (machine,) = run("SELECT id FROM machine WHERE name = ?", (place.machine,)).fetchone()
            run("INSERT OR IGNORE INTO point (machine, name) VALUES (?, ?)", (machine, place.point))
            key = (machine, place.point)
            (point,) = run("SELECT id FROM point WHERE machine = ? AND name = ?", key).fetchone()
            told = (point, place.sensor, json.dumps(dict(settings)))
            run("INSERT OR IGNORE INTO sensor (point, name, settings) VALUES (?, ?, ?)", told)
            number, begun = run("SELECT id, settings FROM sensor WHERE point = ? AND name = ?", told[:2]).fetchone()
        return Sensor(self, place, number, json.loads(begun), settings)


class Sensor:
    """The recordings of one sensor and what was said of them.

    `recordings` are all that the store holds; `acknowledged` names the one up to which somebody has looked, None for
    none; `standing` is the alarm that stands since. `tells` are the states of which somebody is told, and of their end.
    """

    def __init__(
        self, store: Store, place: Place, number: int, begun: dict[str, Any], settings: Mapping[str, Any]
    ) -> None:
        self.store, self.place, self.number = store, place, number
        for name, value in settings.items():
            if begun.get(name) != value and not (name == FOLDER and FOLDER not in begun):
                raise BadInput(
                    f"{store.path} was begun with {name} {begun.get(name)}, now it is {value}; go on with the same, or "
                    "choose another out or another sensor"
                )
        self.settings = begun
        self.recordings: dict[Version, Kept] = {
            Version(file, version): Kept(
                row, datetime.fromisoformat(started) if started else None, state, bool(refused)
            )
            for row, file, version, started, state, refused in store.read(
                "SELECT id, file, version, started, state, refused FROM recording WHERE sensor = ? ORDER BY id", number
            )
        }
        self.tells: Collection[str] = ALARM_STATES
        self.acknowledged: str | None = None
        self.standing: Standing | None = None
        self.look_up()

    def look_up(self) -> None:
        """What stands and up to where somebody has looked: another process may have acknowledged it."""
        last = self.store.read(
            "SELECT id, since FROM judgement WHERE sensor = ? AND state = ? ORDER BY id DESC LIMIT 1",
            *(self.number, ACKNOWLEDGED),
        )
        at, self.acknowledged = last[0] if last else (0, None)
        raised = self.store.read(
            "SELECT since, reason, raised_by FROM judgement WHERE sensor = ? AND state = 'alarm' AND id > ? "
            "ORDER BY id LIMIT 1",
            *(self.number, at),
        )
        self.standing = Standing(*raised[0]) if raised else None

    def series(self) -> list[Version]:
        """Its recordings, of each file the last version, whether or not the file is still there."""
        last = {key.file: key for key in self.recordings}
        return [*last.values()]

    @property
    def spacing_hz(self) -> float | None:
        """Distance of the lines of its spectra; None before the first recording."""
        return self.settings.get("spacing_hz")

    def settle_spacing(self, spacing_hz: float) -> None:
        """Say how far apart lines are, once and for all."""
        self.settings["spacing_hz"] = spacing_hz
        with self.store.transaction() as run:
            run("UPDATE sensor SET settings = ? WHERE id = ?", (json.dumps(self.settings), self.number))

    def keep(self, key: Version, reading: Reading) -> None:
        """Keep what reading a file gave."""
        told = (self.number, *key, _now(), reading.started, reading.refused, reading_bytes(reading))
        with self.store.transaction() as run:
            run(
                "INSERT INTO recording (sensor, file, version, heard, started, refused, reading) "
                "VALUES (?, ?, ?, ?, ?, ?, ?) "
                "ON CONFLICT (sensor, file, version) DO UPDATE SET reading = excluded.reading",  # by another watch
                told,
            )
            found = run("SELECT id FROM recording WHERE sensor = ? AND file = ? AND version = ?", told[:3])
            (number,) = found.fetchone()
        self.recordings[key] = Kept(number, reading.time, None, reading.refused)

    def rows(self, keys: Sequence[Version]) -> list[dict[str, Any]]:
        """Lines of the recordings that were judged, as `asperity track --json` has them, in the order of the keys."""
        found = self.store.read("SELECT id, row FROM recording WHERE sensor = ? AND row IS NOT NULL", self.number)
        rows = dict(found)
        numbers = [self.recordings[key].number for key in keys]
        return [json.loads(rows[number]) for number in numbers if number in rows]

    def reading(self, key: Version) -> Reading | None:
        """What was kept; None, and forgotten, where it is damaged."""
        ((body,),) = self.store.read("SELECT reading FROM recording WHERE id = ?", self.recordings[key].number)
        try:
            return reading_from(body, f"a recording in {self.store.path}")
        except UnreadableFile:
            with self.store.transaction() as run:
                run("DELETE FROM recording WHERE id = ?", (self.recordings.pop(key).number,))
            return None

    def learned(self) -> Learned:
        """What was learned of the series; empty at first."""
        ((body, since),) = self.store.read("SELECT learned, since FROM sensor WHERE id = ?", self.number)
        return Learned() if body is None else learned_from(body, since or 0)

    @property
    def asked(self) -> str | None:
        """What the last judgement was asked."""
        return str(self.store.read("SELECT asked FROM sensor WHERE id = ?", self.number)[0][0] or "") or None

    def said(self) -> dict[str, Any] | None:
        """The last judgement as `asperity track --json` has it; None before the first."""
        ((text,),) = self.store.read("SELECT said FROM sensor WHERE id = ?", self.number)
        if text is None:
            return None
        said: dict[str, Any] = json.loads(text)
        numbers = said.pop("numbers")
        among = f"({', '.join('?' * len(numbers))})"
        rows = dict(self.store.read(f"SELECT id, row FROM recording WHERE id IN {among}", *numbers))
        return {"verdict": said.pop("verdict"), "recordings": [json.loads(rows[number]) for number in numbers], **said}

    def acknowledge(self, file: str) -> None:
        """Somebody has looked at everything up to this recording."""
        with self.store.transaction() as run:
            run(
                "INSERT INTO judgement (sensor, time, state, since) VALUES (?, ?, ?, ?)",
                (self.number, _now(), ACKNOWLEDGED, file),
            )
        self.acknowledged, self.standing = file, None

    def judged(
        self,
        track: Track,
        keys: Mapping[str, Version],
        new: int,
        asked: str,
        learned: Learned | None,
        who: Sequence[str] = (),
    ) -> Track:
        """Keep a judgement; the track with the alarm that stands, where this judgement would have dropped it.

        Parameters
        ----------
        keys : of its recordings, by their files
        new : recordings that it is the first to judge
        asked : what it was asked, as `asked` gives it back
        who : is to be called where the state is another than they were told last
        """
        self.look_up()
        if self.standing is not None and track.alarm.state != "alarm":
            files = [recording.file for recording in track.recordings]
            since = files.index(self.standing.file) if self.standing.file in files else 0
            reason = f"{self.standing.reason}; raised before and not acknowledged"
            held = replace(track.alarm, state="alarm", since=since, reason=reason, raised_by=self.standing.raised_by)
            track = replace(track, alarm=held)
        said = track.scalars(every_way=False)
        rows, alarm = said.pop("recordings"), said["alarm"]
        numbers = [self.recordings[keys[row["file"]]].number for row in rows]
        with self.store.transaction() as run:
            for number, row in zip(numbers, rows, strict=True):
                run("UPDATE recording SET row = ?, state = ? WHERE id = ?", (json.dumps(row), row["state"], number))
            run(
                "INSERT INTO judgement (sensor, time, state, since, reason, raised_by, false_alarm_rate, verdict, "
                "recordings, new) VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?, ?)",
                (self.number, _now(), *_standing(alarm), alarm["false_alarm_rate"], said["verdict"], len(rows), new),
            )
            self._call(run, who, _told(said, rows[-1]["file"]))
            told = (asked, json.dumps({**said, "numbers": numbers}), self.number)
            run("UPDATE sensor SET asked = ?, said = ? WHERE id = ?", told)
            if learned is not None and learned.shared is not None:
                run("UPDATE sensor SET since = ? WHERE id = ?", (learned.since, self.number))
                if learned.since == 0:
                    run("UPDATE sensor SET learned = ? WHERE id = ?", (learned_bytes(learned.shared), self.number))
        for row in rows:
            key = keys[row["file"]]
            self.recordings[key] = self.recordings[key]._replace(state=row["state"])
        if alarm["state"] == "alarm" and self.standing is None:
            self.standing = Standing(alarm["since"], alarm["reason"], alarm["raised_by"] or "")
        return track

    def _call(self, run: Any, who: Sequence[str], said: Mapping[str, Any]) -> None:
        """Note whom to call, in the same transaction as the judgement: neither can be without the other."""
        for name in who:
            last = run(
                "SELECT state FROM call WHERE sensor = ? AND who = ? ORDER BY id DESC LIMIT 1", (self.number, name)
            ).fetchone()
            before = None if last is None else last[0]
            if before != said["state"] and {before, said["state"]} & {*self.tells}:
                told = {"id": str(uuid4()), "time": _now(), **self.place._asdict(), "before": before, **said}
                run(
                    "INSERT INTO call (sensor, who, state, said, time) VALUES (?, ?, ?, ?, ?)",
                    (self.number, name, said["state"], json.dumps(told), told["time"]),
                )

    def tell(self, who: Sequence[str], said: Mapping[str, Any]) -> None:
        """Note whom to call who does not know yet what was said last."""
        with self.store.transaction() as run:
            self._call(run, who, _told(said, said["recordings"][-1]["file"]))

    def arrivals(self) -> list[datetime]:
        """When recordings came, the last ones."""
        rows = self.store.read(
            "SELECT time FROM judgement WHERE sensor = ? AND new > 0 ORDER BY id DESC LIMIT 33", self.number
        )
        return [datetime.fromisoformat(time) for (time,) in reversed(rows)]

    def fell_silent(self, reason: str, who: Sequence[str]) -> dict[str, Any] | None:
        """Keep, once, that no recordings come any more; the last judgement as it stands now, None before the first.

        An alarm that nobody has acknowledged stands, and is told with it.
        """
        self.look_up()
        said = self.said()
        if said is None:
            return None
        if self.standing is None:
            told = {"state": "blind", "since": said["recordings"][-1]["file"], "reason": reason, "raised_by": SILENCE}
            said["alarm"] |= {**told, "verdict": f"Blind: {reason}."}
        said["verdict"] = f"Blind: {reason}. {said['verdict']}"
        last = self.store.read("SELECT raised_by FROM judgement WHERE sensor = ? ORDER BY id DESC LIMIT 1", self.number)
        if last and last[0][0] == SILENCE:
            return said
        alarm = said["alarm"]
        with self.store.transaction() as run:
            row = (self.number, _now(), alarm["state"], alarm["since"], reason, SILENCE, said["verdict"])
            run(
                "INSERT INTO judgement (sensor, time, state, since, reason, raised_by, verdict, new) "
                "VALUES (?, ?, ?, ?, ?, ?, ?, 0)",
                row,
            )
            self._call(run, who, _told(said, said["recordings"][-1]["file"]))
        return said

    def waiting(self, who: str) -> list[tuple[int, int, float, str]]:
        """Calls that nobody has answered yet: number, attempts, when the next is due [s], what is to be said."""
        return self.store.read(
            "SELECT id, attempts, due, said FROM call WHERE sensor = ? AND who = ? AND answered IS NULL ORDER BY id",
            *(self.number, who),
        )

    def called(self, number: int, *, failure: str | None = None, due: float = 0.0) -> None:
        """Keep how a call went: answered, or why not and when it is due again."""
        answered = None if failure is not None else _now()
        with self.store.transaction() as run:
            run(
                "UPDATE call SET attempts = attempts + 1, failure = ?, due = ?, answered = ? WHERE id = ?",
                (failure, due, answered, number),
            )


def _told(said: Mapping[str, Any], recording: str) -> dict[str, Any]:
    """What is said of a judgement to who is called."""
    return {**said["alarm"], "verdict": said["verdict"], "recording": recording}


def _standing(alarm: Mapping[str, Any]) -> Sequence[str | None]:
    return [alarm[name] for name in ("state", "since", "reason", "raised_by")]


def _now() -> str:
    return datetime.now(UTC).isoformat(timespec="seconds")
