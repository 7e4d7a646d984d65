"""Store of monitored machines in one SQLite file: sensors, recordings and judgements.

All writing is transactional (write-ahead log): a watch may be killed at any moment. `sensor` and
`sensors` hold the content of a sensor.
"""

import json
import sqlite3
from collections.abc import Iterator
from contextlib import closing, contextmanager, suppress
from datetime import datetime
from pathlib import Path
from time import monotonic
from typing import Any, NamedTuple

from asperity.core.documents import JsonObject, Table
from asperity.core.errors import AsperityError, BadInput, UnreadableFile
from asperity.core.files import new_part, require_writable
from asperity.monitoring.store.digests import add_function, damaged_rows, keep_digests
from asperity.monitoring.store.repair import (
    DamagedStore,
    foreign_triggers,
    has_orphans,
    repair_rows,
    require_intact,
    set_aside,
)
from asperity.monitoring.store.schema import VERSION, Run, convert_tables, create_tables
from asperity.trend import AlarmState

STORE = "asperity.db"
BUSY_S = 30.0  # timeout while another process writes [s]
MISSING_S = 60.0  # time after which a missing folder of the store is made again [s]
SCHEMA_ERRORS = ("no such", "duplicate column", "already exists")  # in messages of SQLite
REMEDY = "delete it, and its recordings are read again, or choose another store"


class StoreUnavailable(AsperityError):
    """A store that cannot be used at present, such as on a full disk; a retry may succeed."""


class SensorAddress(NamedTuple):
    """Address of a sensor: names of machine, measuring point and sensor."""

    machine: str
    point: str
    sensor: str


class FileVersion(NamedTuple):
    """Version of a file, by size and time of change."""

    file: str
    version: str


class StandingAlarm(NamedTuple):
    """Alarm that has not been acknowledged: first recording, reason and indicator."""

    file: str
    reason: str
    raised_by: str


class StoredRecording(NamedTuple):
    """Recording of the store: number, start (None if unknown) and state (None if not judged).

    `refused` if it could not be read; `duration_s` is nan if unknown. `day` is that of its start or
    arrival; `complete` if its spectrum is stored; `gap` is the number of recordings deleted
    directly before it.
    """

    number: int
    time: datetime | None
    state: AlarmState | None
    refused: bool
    duration_s: float
    day: str = ""
    complete: bool = True
    gap: int = 0


class Store:
    """Store of recordings and judgements; created if the file does not exist.

    With `allow_unavailable`, a file that cannot be used at present is opened for reading only, or
    replaced by an empty store in memory, until `recover` succeeds. With `repair`, damaged rows are
    removed, and a damaged file is set aside; `remarks` names them.

    Raises
    ------
    BadInput
        if the path is not writable.
    UnreadableFile
        if the file is not a store, of a later version, or damaged, unless `repair`.
    StoreUnavailable
        if the file cannot be used at present, unless `allow_unavailable`.
    """

    def __init__(
        self,
        path: str | Path,
        *,
        make: bool = True,
        in_memory: bool = False,
        allow_unavailable: bool = False,
        repair: bool = True,
    ) -> None:
        self.path = Path(path)
        self._in_memory, self._repairs = in_memory, repair
        self.remarks: list[str] = []
        self.repairs = 0  # times that damaged rows were removed from the open file
        self._missing_since: float | None = None
        self._unavailable: StoreUnavailable | None = None  # until the file is opened for writing
        if not (in_memory or make or self.path.exists()):
            raise UnreadableFile(f"{self.path} does not exist; check its name")
        try:
            self._open()
        except StoreUnavailable as error:
            if not allow_unavailable:
                raise
            self._open_provisionally(error)
        except BadInput as error:
            if not (allow_unavailable and self.path.is_file()):
                raise
            self._open_provisionally(StoreUnavailable(str(error)))

    def _open(self) -> None:
        """Connect to the file; create its tables, or convert an older version."""
        if not self._in_memory:
            require_writable(self.path)
        location = ":memory:" if self._in_memory else self.path
        self._was_empty = self.path.is_file() and self.path.stat().st_size == 0
        with self._translated_errors():
            self._connection = sqlite3.connect(location, timeout=BUSY_S, isolation_level=None)
            try:
                self._prepare()
            except DamagedStore as error:
                self._connection.close()
                if not self._repairs:
                    raise sqlite3.DatabaseError(str(error)) from error
                self.remarks.append(set_aside(self.path, str(error)))
                self._connection = sqlite3.connect(location, timeout=BUSY_S, isolation_level=None)
                self._prepare()
            except BaseException:
                self._connection.close()
                raise
        self._file = None if self._in_memory else _file_number(self.path)
        self._unavailable = None

    def _prepare(self) -> None:
        """Create the tables of a new file, or convert an older version; repair damaged rows."""
        add_function(self._connection)
        version = self._connection.execute("PRAGMA user_version").fetchone()[0]
        if version == 0:
            self._connection.execute("PRAGMA auto_vacuum = INCREMENTAL")
        self._connection.execute("PRAGMA journal_mode = WAL")
        self._connection.execute("PRAGMA foreign_keys = ON")
        if version == 0:
            self._create()
        elif version in range(1, VERSION):
            self._convert(version)
        elif version != VERSION:
            raise UnreadableFile(
                f"{self.path} is a store of version {version}, this asperity writes {VERSION}; "
                "update asperity, or choose another store"
            )
        require_intact(self._connection)
        keep_digests(self._connection)
        self._version_checked: int | None = None
        self._check_rows()

    def _convert(self, version: int) -> None:
        """Convert a store of an older version, whose content cannot be verified."""
        try:
            with self.transaction() as run:
                convert_tables(run)
        except StoreUnavailable as error:
            if any(text in str(error) for text in SCHEMA_ERRORS):
                raise DamagedStore(f"it is not a store of version {version}") from None
            raise
        self.remarks.append(f"{self.path} was converted from version {version}, as it was")

    def take_remarks(self) -> list[str]:
        """Return what has been repaired since the last call."""
        remarks, self.remarks = self.remarks, []
        return remarks

    def check_changes(self) -> None:
        """Repair what another program has changed in the open file, and count it in `repairs`.

        Raises
        ------
        UnreadableFile
            if something is damaged and the store is not to be repaired.
        """
        try:
            self._check_rows()
        except DamagedStore as error:
            self._connection.close()
            self.remarks.append(set_aside(self.path, str(error)))
            self._open()
            self.repairs += 1

    def _check_rows(self) -> None:
        """Remove damaged rows if another program has written since, and count it in `repairs`.

        Raises
        ------
        UnreadableFile
            if there are and the store is not to be repaired.
        """
        ((version,),) = self.read("PRAGMA data_version")
        if version == self._version_checked:
            return
        with self._translated_errors():
            require_intact(self._connection, whole=False)
            damaged = (
                bool(foreign_triggers(self._connection))
                or has_orphans(self._connection)
                or any(damaged_rows(self._connection))
            )
        if damaged:
            with self.transaction():
                remarks = repair_rows(self._connection, str(self.path))
                if not self._repairs:
                    raise UnreadableFile(f"{'; '.join(remarks)}; run the watch, which repairs it")
            self.remarks += remarks
            self.repairs += 1
        self._version_checked = version

    def _open_provisionally(self, error: StoreUnavailable) -> None:
        """Read the file without writing, or use an empty store in memory."""
        self._unavailable, self._file = error, None
        log = self.path.with_name(f"{self.path.name}-wal")
        # without a write-ahead log, SQLite can read a file whose folder cannot be written
        unchanging = not log.is_file() or log.stat().st_size == 0
        location = f"{self.path.absolute().as_uri()}?mode=ro{'&immutable=1' * unchanging}"
        try:
            with self._translated_errors():
                self._connection = sqlite3.connect(location, uri=True, isolation_level=None)
                add_function(self._connection)
                ((version,),) = self._connection.execute("PRAGMA user_version").fetchall()
                intact = version == VERSION and not any(damaged_rows(self._connection))
            if intact:
                return
            self._connection.close()
        except (StoreUnavailable, UnreadableFile):
            pass
        self._connection = sqlite3.connect(":memory:", isolation_level=None)
        add_function(self._connection)
        self._create()

    def close(self) -> None:
        """Close the store and merge the write-ahead log into the file."""
        self._connection.close()

    def require_present(self) -> None:
        """Raise StoreUnavailable if the file is not open for writing, was removed or replaced."""
        if self._unavailable is not None:
            raise self._unavailable
        if not self._in_memory and _file_number(self.path) != self._file:
            raise StoreUnavailable(
                f"{self.path} was removed or replaced; restore it, or its folder {self.path.parent}"
            )

    def recover(self) -> None:
        """Connect again if the file was removed or replaced, or could not be used before.

        A file missing in its folder is restored from the open connection. A missing folder is made
        again after `MISSING_S`, because it may be moved back or mounted before.

        Raises
        ------
        StoreUnavailable
            if the folder is missing, or the file cannot be written.
        """
        if self._unavailable is None and _file_number(self.path) == self._file:
            self._missing_since = None
            return
        folder = self.path.parent
        if not folder.is_dir():
            if self._missing_since is None:
                self._missing_since = monotonic()
            if monotonic() - self._missing_since < MISSING_S or not folder.parent.is_dir():
                self.require_present()
            with self._translated_errors():
                folder.mkdir()
        if not self.path.exists():
            self._restore()
        former = self._connection
        try:
            self._open()
        except BaseException:
            self._connection = former
            raise
        former.close()
        self._missing_since = None

    def _restore(self) -> None:
        """Write the content of the open connection to a new file."""
        with self._translated_errors(), new_part(self.path) as part:
            with closing(sqlite3.connect(part)) as copy:
                self._connection.backup(copy)
            part.replace(self.path)

    def _create(self) -> None:
        with self.transaction() as run:
            if run("PRAGMA user_version").fetchone()[0] == VERSION:
                return  # another process was faster
            if not self._in_memory and self.path.is_file() and self._was_empty:
                self.remarks.append(f"{self.path} was empty; recordings are read again")
            if run("SELECT count(*) FROM sqlite_master").fetchone()[0]:
                raise UnreadableFile(
                    f"{self.path} is a database of another program; choose another store"
                )
            create_tables(run)

    @contextmanager
    def _translated_errors(self) -> Iterator[None]:
        try:
            yield
        except (sqlite3.OperationalError, OSError) as error:
            reason = "another program has locked it" if "locked" in str(error) else str(error)
            raise StoreUnavailable(
                f"{self.path} cannot be used: {reason}; release it or free disk space, and retry"
            ) from error
        except sqlite3.DatabaseError as error:
            reason = " ".join(str(error).split())[:120]
            raise UnreadableFile(
                f"{self.path} is not a store of asperity, or damaged ({reason}); {REMEDY}"
            ) from None

    @contextmanager
    def transaction(self) -> Iterator[Run]:
        """Run statements as one transaction: all of them or none."""
        with self._translated_errors():
            self._connection.execute("BEGIN IMMEDIATE")
            try:
                yield self._connection.execute
                self._connection.execute("COMMIT")
            except BaseException:
                if self._connection.in_transaction:  # SQLite may have ended it on a full disk
                    with suppress(sqlite3.OperationalError):
                        self._connection.execute("ROLLBACK")
                raise

    def shrink(self, share: float) -> None:
        """Release free pages of the file where they are more than a share of it.

        A store of an older version keeps them for later recordings.
        """
        with self._translated_errors():
            free = self._connection.execute("PRAGMA freelist_count").fetchone()[0]
            pages = self._connection.execute("PRAGMA page_count").fetchone()[0]
            if free > share * pages:
                # `execute` would release a single page
                self._connection.executescript("PRAGMA incremental_vacuum")

    def read(self, query: str, *values: object) -> list[Any]:
        """Return the rows of a query."""
        with self._translated_errors():
            return self._connection.execute(query, values).fetchall()

    def sensors(self) -> list[tuple[int, SensorAddress]]:
        """Return number and address of every sensor, in order of names."""
        rows = self.read(
            "SELECT sensor.id, machine.name, point.name, sensor.name FROM sensor "
            "JOIN point ON point.id = sensor.point "
            "JOIN machine ON machine.id = point.machine ORDER BY 2, 3, 4"
        )
        return [(number, SensorAddress(*names)) for number, *names in rows]

    def sensors_at(self, machine: str, point: str) -> list[tuple[str, JsonObject]]:
        """Return names and settings of the sensors at a point, in order of registration."""
        rows = self.read(
            "SELECT sensor.name, settings FROM sensor JOIN point ON point.id = sensor.point "
            "JOIN machine ON machine.id = point.machine WHERE machine.name = ? AND point.name = ? "
            "ORDER BY sensor.id",
            *(machine, point),
        )
        return [(name, json.loads(settings)) for name, settings in rows]

    def register_sensor(self, address: SensorAddress, settings: Table) -> tuple[int, JsonObject]:
        """Return number and settings of a sensor; a new sensor gets the settings given."""
        query = (
            "SELECT sensor.id, settings FROM sensor JOIN point ON point.id = sensor.point "
            "JOIN machine ON machine.id = point.machine "
            "WHERE machine.name = ? AND point.name = ? AND sensor.name = ?"
        )
        for number, stored in self.read(query, *address):  # also of a store that is read only
            return number, json.loads(stored)
        with self.transaction() as run:
            run("INSERT OR IGNORE INTO machine (name) VALUES (?)", (address.machine,))
            (machine,) = run("SELECT id FROM machine WHERE name = ?", (address.machine,)).fetchone()
            run(
                "INSERT OR IGNORE INTO point (machine, name) VALUES (?, ?)",
                (machine, address.point),
            )
            key = (machine, address.point)
            (point,) = run("SELECT id FROM point WHERE machine = ? AND name = ?", key).fetchone()
            values = (point, address.sensor, json.dumps(dict(settings)))
            run("INSERT OR IGNORE INTO sensor (point, name, settings) VALUES (?, ?, ?)", values)
            number, stored = run(
                "SELECT id, settings FROM sensor WHERE point = ? AND name = ?", values[:2]
            ).fetchone()
        return number, json.loads(stored)


def _file_number(path: Path) -> tuple[int, int] | None:
    """Return what identifies a file on this system; None if it does not exist."""
    try:
        status = path.stat()
    except OSError:
        return None
    return status.st_dev, status.st_ino
