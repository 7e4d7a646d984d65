"""Repair of a store: damaged rows are removed and named, a damaged file is set aside."""

import sqlite3
from collections.abc import Sequence
from contextlib import suppress
from datetime import UTC, datetime
from pathlib import Path

from asperity.monitoring.store.digests import GROUPS, Group, damaged_rows

NAMED = 5  # damaged recordings that are named
LONGEST = 60  # characters of a name that are printed
SIDE_FILES = ("", "-wal", "-shm")  # endings of the files of one SQLite database
OF_SENSOR = ("learned", "levels", "dropped", "recording", "judgement", "call")
BY_DIGEST = {(group.table, group.digest): group for group in GROUPS}


class DamagedStore(Exception):
    """A file whose structure is damaged."""


def require_intact(connection: sqlite3.Connection, *, whole: bool = True) -> None:
    """Raise DamagedStore if tables or, with `whole`, the structure of a store are damaged.

    Raises
    ------
    sqlite3.DatabaseError
        if the file is not a store, as far as its tables show.
    """
    tables = {group.table for group in GROUPS}
    kinds = dict(connection.execute("SELECT name, type FROM sqlite_master").fetchall())
    if not tables & {*kinds}:
        raise sqlite3.DatabaseError("tables are missing")
    for table in tables:
        if kinds.get(table) != "table":
            raise DamagedStore(f"the table {table} is missing")
    for group in GROUPS:
        columns = {row[1] for row in connection.execute(f"PRAGMA table_info({group.table})")}
        if not {group.digest, *group.key, *group.columns} <= columns:
            raise DamagedStore(f"columns of the table {group.table} are missing")
    if not whole:
        return
    try:
        ((result, *_),) = connection.execute("PRAGMA integrity_check(1)").fetchall()
    except sqlite3.OperationalError:
        raise
    except sqlite3.DatabaseError as error:
        raise DamagedStore(str(error)) from error
    if result != "ok":
        raise DamagedStore(" ".join(str(result).split()))


def foreign_triggers(connection: sqlite3.Connection) -> list[str]:
    """Return the names of triggers in the file; a store's own are not part of it."""
    query = "SELECT name FROM sqlite_master WHERE type = 'trigger'"
    return [name for (name,) in connection.execute(query)]


def has_orphans(connection: sqlite3.Connection) -> bool:
    """Return True if rows refer to a sensor, point or machine that does not exist."""
    return connection.execute("PRAGMA foreign_key_check").fetchone() is not None


def set_aside(path: Path, reason: str) -> str:
    """Rename a damaged store with its side files; return a sentence on it."""
    stamp = datetime.now(UTC).strftime("%Y%m%dT%H%M%S%f")
    kept = path.with_name(f"{path.stem}-damaged-{stamp}{path.suffix}")
    for ending in SIDE_FILES:
        with suppress(FileNotFoundError):
            path.with_name(path.name + ending).rename(kept.with_name(kept.name + ending))
    return (
        f"{path} was damaged ({reason}); it is kept as {kept.name}, and recordings are read again "
        "into a new store, without the former acknowledgements"
    )


def repair_rows(connection: sqlite3.Connection, name: str) -> list[str]:
    """Remove the rows that do not match their digest; return a sentence on each kind.

    Removed recordings are read again from their files, and judged again. Runs in a transaction of
    the caller.
    """
    sentences = []
    for trigger in foreign_triggers(connection):
        quoted = trigger.replace('"', '""')
        connection.execute(f'DROP TRIGGER "{quoted}"')
        sentences.append("a trigger of another program, removed")
    groups = {(row.group.table, row.group.digest) for row in damaged_rows(connection)}
    former = connection.text_factory
    connection.text_factory = lambda text: text.decode(errors="replace")
    try:
        sentences += _repair_sensors(connection)
        for key in sorted(groups):
            sentences += _repair_group(connection, BY_DIGEST[key])
        removed = connection.execute(
            "DELETE FROM gap WHERE recording NOT IN (SELECT id FROM recording WHERE sensor IN "
            "(SELECT id FROM sensor))"
        ).rowcount
        for table in OF_SENSOR:
            removed += connection.execute(
                f"DELETE FROM {table} WHERE sensor NOT IN (SELECT id FROM sensor)"
            ).rowcount
        if removed:
            sentences.append(f"{removed} rows of a sensor that is missing, removed")
    finally:
        connection.text_factory = former
    return [f"{name} was damaged: {sentence}" for sentence in sentences]


def _damaged(group: Group) -> str:
    """Return the condition for damaged rows."""
    return f"{group.digest} IS NOT {group.value}"


def _repair_sensors(connection: sqlite3.Connection) -> list[str]:
    """Remove sensors whose names or settings are damaged, with all that belongs to them."""
    machine, point, sensor = (BY_DIGEST[name, "digest"] for name in ("machine", "point", "sensor"))
    points = (
        f"SELECT id FROM point WHERE {_damaged(point)} OR machine NOT IN (SELECT id FROM machine) "
        f"OR machine IN (SELECT id FROM machine WHERE {_damaged(machine)})"
    )
    removed = connection.execute(
        f"SELECT id, name FROM sensor WHERE {_damaged(sensor)} OR point NOT IN "
        f"(SELECT id FROM point) OR point IN ({points})"
    ).fetchall()
    for number, _ in removed:
        connection.execute(
            "DELETE FROM gap WHERE recording IN (SELECT id FROM recording WHERE sensor = ?)",
            (number,),
        )
        for table in OF_SENSOR:
            connection.execute(f"DELETE FROM {table} WHERE sensor = ?", (number,))
        connection.execute("DELETE FROM sensor WHERE id = ?", (number,))
    connection.execute(f"DELETE FROM point WHERE id IN ({points})")
    connection.execute(f"DELETE FROM machine WHERE {_damaged(machine)}")
    if not removed:
        return []
    return [
        f"names or settings of {_listed([name for _, name in removed], 'sensor')}; its recordings "
        "are read again, without the former acknowledgements"
    ]


def _repair_group(connection: sqlite3.Connection, group: Group) -> list[str]:
    """Remove the damaged rows of one table, and what was derived from them."""
    table, condition = group.table, _damaged(group)
    if table in ("machine", "point") or (table, group.digest) == ("sensor", "digest"):
        return []  # removed with their sensors
    if table == "sensor":
        connection.execute(
            f"DELETE FROM learned WHERE sensor IN (SELECT id FROM sensor WHERE {condition})"
        )
        connection.execute(
            f"UPDATE sensor SET question = NULL, content = NULL, since = NULL WHERE {condition}"
        )
        return ["the last judgement of a sensor; it is made again"]
    column = "file" if table == "recording" else group.key[0]
    rows = connection.execute(f"SELECT {column} FROM {table} WHERE {condition}").fetchall()
    if not rows:
        return []  # of a removed sensor
    if table == "recording":
        connection.execute(
            f"DELETE FROM gap WHERE recording IN (SELECT id FROM recording WHERE {condition})"
        )
    # judged again, whatever was removed
    connection.execute("UPDATE sensor SET question = NULL")
    connection.execute(f"DELETE FROM {table} WHERE {condition}")
    if table == "recording":
        files = [Path(str(file)).name for (file,) in rows]
        return [f"{_listed(files, 'recording')}; read again if the file is still there"]
    return [f"{len(rows)} {EFFECTS[table]}"]


EFFECTS = {
    "learned": "memory of spectra; it is made again",
    "levels": "memory of levels; it is made again",
    "dropped": "mark of a deleted recording; its file is read again if it is still there",
    "gap": "count of deleted recordings",
    "judgement": "earlier judgement, removed; check that its alarm is acknowledged",
    "call": "notification, removed; the state is notified again",
}


def _listed(names: Sequence[object], noun: str) -> str:
    """Return the first names of a list in words."""
    more = f" and {len(names) - NAMED} more" if len(names) > NAMED else ""
    first = ", ".join(str(name)[-LONGEST:] for name in names[:NAMED])
    return f"{noun}{'s' if len(names) > 1 else ''} {first}{more}"
