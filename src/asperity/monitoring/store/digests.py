"""Digests of the rows of a store, by which rows are found that something else has changed.

Triggers of the store's own connection write them; they are not part of the file, so that a row
that another program writes has no valid digest.
"""

import sqlite3
from collections.abc import Callable, Iterator
from hashlib import blake2b
from typing import NamedTuple

FUNCTION = "row_digest"


class Group(NamedTuple):
    """Columns of a table that share a digest: table, column of the digest, key, and contents."""

    table: str
    digest: str
    key: tuple[str, ...]
    columns: tuple[str, ...]

    @property
    def value(self) -> str:
        """Expression for the digest; the text of damaged rows may not be UTF-8."""
        parts = (
            f"typeof({name}), CASE WHEN typeof({name}) IN ('text', 'blob') "
            f"THEN CAST({name} AS BLOB) ELSE {name} END"
            for name in (*self.key, *self.columns)
        )
        return f"{FUNCTION}({', '.join(parts)})"


ROW = ("id",)
GROUPS = (
    Group("machine", "digest", ROW, ("name",)),
    Group("point", "digest", ROW, ("machine", "name")),
    Group("sensor", "digest", ROW, ("point", "name", "settings")),
    Group("sensor", "content_digest", ROW, ("question", "content", "since")),
    Group("learned", "digest", ("sensor",), ("body",)),
    Group("levels", "digest", ("sensor",), ("body",)),
    Group("dropped", "digest", ("sensor", "file", "version"), ()),
    Group("gap", "digest", ("recording",), ("count",)),
    Group(
        "recording",
        "digest",
        ROW,
        (
            *("sensor", "file", "version", "arrived", "started", "duration", "refused", "state"),
            *("row", "reading"),
        ),
    ),
    Group(
        "judgement",
        "digest",
        ROW,
        (
            *("sensor", "time", "state", "since", "reason", "raised_by", "false_alarm_rate"),
            *("verdict", "recordings", "new"),
        ),
    ),
    Group(
        "call",
        "digest",
        ROW,
        (
            *("sensor", "who", "state", "content", "time", "attempts", "due", "failure"),
            "answered",
        ),
    ),
)


class DamagedRow(NamedTuple):
    """Row whose content does not match its digest: group, and values of its key."""

    group: Group
    key: tuple[object, ...]


def add_columns(run: Callable[..., sqlite3.Cursor]) -> None:
    """Add the columns of the digests to the tables of a store, for the rows that it has."""
    for group in GROUPS:
        run(f"ALTER TABLE {group.table} ADD COLUMN {group.digest} BLOB")
        run(f"UPDATE {group.table} SET {group.digest} = {group.value}")


def add_function(connection: sqlite3.Connection) -> None:
    """Add the SQL function of the digest to a connection."""
    connection.create_function(FUNCTION, -1, _row_digest, deterministic=True)


def keep_digests(connection: sqlite3.Connection) -> None:
    """Write the digest of each row that this connection changes from now on."""
    for group in GROUPS:
        match = " AND ".join(f"{name} IS NEW.{name}" for name in group.key)
        columns = ", ".join((*group.key, *group.columns))
        for event, when in (("insert", "INSERT"), ("update", f"UPDATE OF {columns}")):
            connection.execute(
                f"CREATE TEMP TRIGGER IF NOT EXISTS {group.table}_{group.digest}_{event} "
                f"AFTER {when} ON main.{group.table} BEGIN "
                f"UPDATE {group.table} SET {group.digest} = {group.value} WHERE {match}; END"
            )


def damaged_rows(connection: sqlite3.Connection) -> Iterator[DamagedRow]:
    """Yield the rows that do not match their digest."""
    for group in GROUPS:
        # keys as bytes, as a damaged text may not be UTF-8
        keys = ", ".join(
            f"CASE typeof({name}) WHEN 'text' THEN CAST({name} AS BLOB) ELSE {name} END"
            for name in group.key
        )
        query = f"SELECT {keys} FROM {group.table} WHERE {group.digest} IS NOT {group.value}"
        for key in connection.execute(query).fetchall():
            yield DamagedRow(group, key)


def _row_digest(*values: object) -> bytes:
    """Return a digest of the values of a row."""
    state = blake2b(digest_size=16)
    for value in values:
        body = value if isinstance(value, bytes) else repr(value).encode()
        state.update(b"%d " % len(body))
        state.update(body)
    return state.digest()
