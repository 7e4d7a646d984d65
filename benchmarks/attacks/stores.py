"""Attacks on the store of a watch: rows written by another program, and single bits."""

import json
import random
import shutil
import sqlite3
from collections.abc import Callable
from contextlib import closing
from pathlib import Path

import numpy as np

from asperity.core.errors import AsperityError
from asperity.monitoring import TrackSettings, WatchSettings
from asperity.monitoring.store.database import Store
from asperity.monitoring.store.digests import GROUPS
from asperity.monitoring.watch import open_watch

VALUES = (None, 0, -1, 1, 9, 2**62, 0.5, "", "ok", "{", "{}", "[]", "x", b"", b"\x00", b"\xff\xfe")
RECORDINGS = 28


def _watched(folder: Path, acknowledge: str | None = None) -> tuple[bool, str]:
    """Return whether one pass over a folder has remarks, and its judgement."""
    watch = open_watch(
        folder / "in",
        Store(folder / "asperity.db"),
        TrackSettings(acknowledge=acknowledge),
        WatchSettings(once=True, settle_time_s=0.0),
    )
    with closing(watch):
        update = watch.check()
    assert update is not None
    judgement = update.judgement
    if judgement is None and update.track is not None:
        judgement = update.track.scalars()
    return bool(update.failed), json.dumps(judgement, sort_keys=True, default=str)


def _make(folder: Path) -> None:
    """Fill a store with an acknowledged and a standing alarm."""
    (folder / "in").mkdir()
    levels = [*np.ones(12), *np.geomspace(1.0, 30.0, RECORDINGS - 12)]
    for number, level in enumerate(levels):
        values = level * np.random.default_rng(number).standard_normal(2000)
        np.savez(folder / f"in/s-{number:03}.npz", acc=values, fs=20e3, unit="m/s^2")
        if number == 21:
            _watched(folder)
    for acknowledge in ("s-014.npz", None, None):
        _watched(folder, acknowledge)


def _change_bit(store: Path, rng: random.Random) -> None:
    content = bytearray(store.read_bytes())
    bit = rng.randrange(8 * len(content))
    content[bit // 8] ^= 1 << bit % 8
    store.write_bytes(content)


def _change_rows(store: Path, rng: random.Random) -> None:
    """Write a meaningless value into one or all rows of a table."""
    with closing(sqlite3.connect(store)) as connection:
        group = rng.choice(GROUPS)
        column = rng.choice((*group.columns, *group.key))
        condition = rng.choice(("", f" WHERE rowid = {rng.randrange(1, RECORDINGS + 1)}"))
        if group.table == "dropped":
            condition = ""  # it has no row numbers
        statement = f"UPDATE OR IGNORE {group.table} SET {column} = ?{condition}"
        try:
            connection.execute(statement, (rng.choice(VALUES),))
            connection.commit()
        except sqlite3.IntegrityError:
            pass  # the tables themselves refuse it


def damaged_stores(folder: Path) -> Callable[[int], str | None]:
    """Return a function that changes a copy of a store, by number, and watches with it."""
    _make(folder)
    store = folder / "asperity.db"
    whole = shutil.copy(store, folder / "whole.db")
    expected = _watched(folder)[1]

    def attack(number: int) -> str | None:
        rng = random.Random(number)
        for path in folder.glob("asperity*.db*"):
            path.unlink()
        shutil.copy(whole, store)
        (_change_bit if number % 2 else _change_rows)(store, rng)
        try:
            remarks, judgement = _watched(folder)
        except AsperityError as refusal:
            text = str(refusal)
            return f"refusal of {len(text)} characters: {text}" if len(text) > 500 else None
        if judgement != expected and not remarks:
            return "silently different"
        if json.loads(judgement)["alarm"]["state"] != "alarm":
            return "the alarm is lost"
        return None

    return attack
