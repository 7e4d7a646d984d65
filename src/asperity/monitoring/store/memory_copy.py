"""Copy of sensors in memory, with which a watch continues while its store cannot be written."""

from collections.abc import Mapping, Sequence
from copy import copy
from functools import partial
from pathlib import Path

from asperity.monitoring.store.database import Store
from asperity.monitoring.store.schema import Run
from asperity.monitoring.store.sensor import Sensor
from asperity.monitoring.store.sensors import Sensors

FIRST, LATEST = 24, 200  # recordings of a sensor whose spectra are copied: more than are judged
LATEST_ROWS = 1000  # recordings and judgements whose rows are copied


class MemoryCopy:
    """Copy of sensors in memory; `merge` adds to the store what has come since.

    Parameters
    ----------
    sensors : of a store that can still be read

    Raises
    ------
    StoreUnavailable
        if the store cannot be read.
    """

    def __init__(self, sensors: Sensors) -> None:
        original = sensors.store
        memory = Store(original.path, in_memory=True)
        numbers = [sensor.number for sensor in sensors.by_name.values()]
        with memory.transaction() as run:
            for table in ("machine", "point"):
                _copy_rows(original, run, table, "1")
            for sensor in sensors.by_name.values():
                _copy_sensor(original, run, sensor)
        self._last = _last_numbers(original, numbers)
        self.sensors = Sensors(
            memory,
            sensors.address,
            sensors.settings,
            channels=sensors.channels,
            named=sensors.named,
        )
        if sensors.spacing_hz is not None:
            self.sensors.set_spacing(sensors.spacing_hz)
        self.sensors.notifications = copy(sensors.notifications)
        self.sensors.notifications.store = memory

    def merge(self, store: Store) -> None:
        """Add recordings, judgements and notifications of the copy to the store, or none of them.

        Raises
        ------
        StoreUnavailable
            if the store cannot be written.
        """
        added = [*self.sensors.by_name.values()]
        numbers = [store.register_sensor(sensor.address, sensor.settings)[0] for sensor in added]
        with store.transaction() as run:
            for sensor, number in zip(added, numbers, strict=True):
                self._merge_sensor(run, sensor, number)
        added_numbers = [sensor.number for sensor in added]
        self._last = _last_numbers(self.sensors.store, added_numbers)  # merged only once

    def _merge_sensor(self, run: Run, sensor: Sensor, number: int) -> None:
        """Add what the copy of a sensor has and the store lacks.

        A copy that began without the recordings of the store adds only its notifications; its
        files are read again and judged with those of the store.
        """
        query = "SELECT count(*) FROM recording WHERE sensor = ?"
        ((stored,),) = run(query, (number,)).fetchall()
        if stored and not self._last["recording"]:
            self._add_rows(run, sensor, number, ("call",))
            return
        self._replace_memories(run, sensor, number)
        self._add_rows(run, sensor, number, (*self._last,))

    def _replace_memories(self, run: Run, sensor: Sensor, number: int) -> None:
        """Replace settings and memories of a sensor in the store."""
        memory = self.sensors.store
        rows = memory.read("SELECT settings, since FROM sensor WHERE id = ?", sensor.number)
        run("UPDATE sensor SET settings = ?, since = ? WHERE id = ?", (*rows[0], number))
        run("DELETE FROM learned WHERE sensor = ?", (number,))
        learned = memory.read("SELECT body FROM learned WHERE sensor = ?", sensor.number)
        for (body,) in learned:
            run("INSERT INTO learned (sensor, body) VALUES (?, ?)", (number, body))
        run("DELETE FROM levels WHERE sensor = ?", (number,))
        for (body,) in memory.read("SELECT body FROM levels WHERE sensor = ?", sensor.number):
            run("INSERT INTO levels (sensor, body) VALUES (?, ?)", (number, body))

    def _add_rows(self, run: Run, sensor: Sensor, number: int, tables: Sequence[str]) -> None:
        """Add new rows of a sensor in some tables, and attempts to notify."""
        memory = self.sensors.store
        for table in tables:
            columns = [name for name in _columns(memory, table) if name not in ("id", "sensor")]
            new = memory.read(
                f"SELECT {', '.join(columns)} FROM {table} WHERE sensor = ? AND id > ? ORDER BY id",
                *(sensor.number, self._last[table]),
            )
            statement = (
                f"INSERT OR IGNORE INTO {table} (sensor, {', '.join(columns)}) "
                f"VALUES ({', '.join('?' * (len(columns) + 1))})"
            )
            for row in new:
                run(statement, (number, *row))
        attempts = memory.read(
            "SELECT attempts, due, failure, answered, id FROM call WHERE sensor = ? AND id <= ?",
            *(sensor.number, self._last["call"]),
        )
        for attempt in attempts:
            run(
                "UPDATE call SET attempts = ?, due = ?, failure = ?, answered = ? WHERE id = ?",
                attempt,
            )


def _last_numbers(store: Store, sensors: Sequence[int]) -> dict[str, int]:
    """Return the last number of some sensors in each table that grows."""
    marks = ", ".join("?" * len(sensors))
    return {
        table: store.read(f"SELECT max(id) FROM {table} WHERE sensor IN ({marks})", *sensors)[0][0]
        or 0
        for table in ("recording", "judgement", "call")
    }


def _copy_sensor(original: Store, run: Run, sensor: Sensor) -> None:
    """Copy a sensor with its recordings, latest judgements and last notifications."""
    number = sensor.number
    copy_rows = partial(_copy_rows, original, run)
    copy_rows("sensor", "id = ?", number)
    copy_rows("learned", "sensor = ?", number)
    copy_rows("levels", "sensor = ?", number)
    copy_rows("dropped", "sensor = ?", number)
    known = sorted(recording.number for recording in sensor.recordings.values())
    first_row = known[-LATEST_ROWS] if len(known) > LATEST_ROWS else 0
    copy_rows("recording", "sensor = ? AND id >= ?", number, first_row, blank={"reading": "x''"})
    copy_rows(
        "recording",
        "sensor = ? AND id < ?",
        *(number, first_row),
        blank={"reading": "x''", "row": "NULL"},
    )
    copy_rows("gap", "recording IN (SELECT id FROM recording WHERE sensor = ?)", number)
    marked = {sensor.acknowledged, sensor.standing and Path(sensor.standing.file).name}
    starts = [
        known.index(recording.number)
        for key, recording in sensor.recordings.items()
        if Path(key.file).name in marked
    ]
    chosen = {*known[-LATEST:]}
    for start in (0, *starts):
        chosen |= {*known[start : start + FIRST]}
    for recording in chosen:
        ((reading, row),) = original.read(
            "SELECT reading, row FROM recording WHERE id = ?", recording
        )
        run("UPDATE recording SET reading = ?, row = ? WHERE id = ?", (reading, row, recording))
    latest = "SELECT id FROM judgement WHERE sensor = ? ORDER BY id DESC LIMIT ?"
    copy_rows(
        "judgement",
        f"sensor = ? AND (state IN ('alarm', 'acknowledged') OR id IN ({latest}))",
        *(number, number, LATEST_ROWS),
    )
    last = "SELECT max(id) FROM call GROUP BY sensor, who"
    copy_rows("call", f"sensor = ? AND (answered IS NULL OR id IN ({last}))", number)


def _columns(store: Store, table: str) -> list[str]:
    """Return the names of a table's columns."""
    return [row[1] for row in store.read(f"PRAGMA table_info({table})")]


def _copy_rows(
    original: Store,
    run: Run,
    table: str,
    condition: str,
    *values: object,
    blank: Mapping[str, str] | None = None,
) -> None:
    """Copy the rows of a table that fulfil a condition; `blank` columns get another content."""
    columns = [row[1] for row in run(f"PRAGMA table_info({table})")]
    selected = [(blank or {}).get(name, name) for name in columns]
    rows = original.read(f"SELECT {', '.join(selected)} FROM {table} WHERE {condition}", *values)
    statement = f"INSERT INTO {table} VALUES ({', '.join('?' * len(columns))})"
    for row in rows:
        run(statement, row)
