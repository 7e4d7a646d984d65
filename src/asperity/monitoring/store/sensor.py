"""One sensor of a store: its recordings, settings of reading, acknowledgement and standing alarm.

`sensors` holds what concerns sensors that are judged together, and their notifications.
"""

import json
from collections.abc import Collection
from dataclasses import replace
from datetime import UTC, datetime
from math import nan
from pathlib import Path

import numpy as np

from asperity.core.documents import Table
from asperity.core.errors import BadInput, UnreadableFile
from asperity.monitoring.reading import Reading, pack_reading, unpack_reading
from asperity.monitoring.store.database import (
    FileVersion,
    SensorAddress,
    StandingAlarm,
    Store,
    StoredRecording,
)
from asperity.monitoring.store.schema import Run
from asperity.trend import AlarmState

ACKNOWLEDGED = "acknowledged"  # state of a judgement that a person has made
# setting of a sensor without machine and point: recordings of other folders do not belong to it
FOLDER = "folder"
TOGETHER = "together"  # setting of sensors that are judged together: their common name
OPTIONAL = (FOLDER, TOGETHER)  # settings that older stores lack


class Sensor:
    """Recordings of one sensor.

    `settings` are those with which its recordings are read; a new sensor also gets those of
    `initial`. `recordings` are all that the store holds, `unjudged` those without a judgement;
    `acknowledged` names the last acknowledged recording, None without one; `standing` is the alarm
    raised since then.

    Raises
    ------
    BadInput
        if its recordings were read with other settings before.
    """

    def __init__(
        self,
        store: Store,
        address: SensorAddress,
        settings: Table,
        initial: Table | None = None,
    ) -> None:
        self.store, self.address = store, address
        self.number, self.settings = store.register_sensor(address, {**settings, **(initial or {})})
        for name, value in settings.items():
            if self.settings.get(name) != value and not (
                name in OPTIONAL and name not in self.settings
            ):
                raise BadInput(
                    f"{store.path} was begun with {name} {self.settings.get(name)}, got {value}; "
                    "keep the former value, or choose another `out` or another sensor"
                )
        rows = store.read(
            "SELECT file, version, id, started, arrived, state, refused, duration, "
            "length(reading) > 0, count FROM recording LEFT JOIN gap ON recording = id "
            "WHERE sensor = ? ORDER BY id",
            self.number,
        )
        self.recordings = {FileVersion(*row[:2]): _stored_recording(*row[2:]) for row in rows}
        dropped = store.read("SELECT file, version FROM dropped WHERE sensor = ?", self.number)
        self.dropped = {FileVersion(*names) for names in dropped}
        self.unjudged = {
            key for key, recording in self.recordings.items() if recording.state is None
        }
        self.acknowledged: str | None = None
        self.standing: StandingAlarm | None = None
        self.refresh()

    def refresh(self) -> None:
        """Read standing alarm and acknowledgement, which another process may have changed."""
        last = self.store.read(
            "SELECT id, since FROM judgement WHERE sensor = ? AND state = ? "
            "ORDER BY id DESC LIMIT 1",
            *(self.number, ACKNOWLEDGED),
        )
        number, self.acknowledged = last[0] if last else (0, None)
        raised = self.store.read(
            "SELECT since, reason, raised_by FROM judgement "
            "WHERE sensor = ? AND state = 'alarm' AND id > ? ORDER BY id LIMIT 1",
            *(self.number, number),
        )
        self.standing = StandingAlarm(*raised[0]) if raised else None

    @property
    def spacing_hz(self) -> float | None:
        """Spacing of the spectra's lines [Hz]; None before the first recording."""
        spacing_hz = self.settings.get("spacing_hz")
        return spacing_hz if isinstance(spacing_hz, int | float) else None

    def set_spacing(self, spacing_hz: float) -> None:
        """Set the spacing of lines [Hz] for all recordings."""
        self.settings["spacing_hz"] = spacing_hz
        with self.store.transaction() as run:
            run(
                "UPDATE sensor SET settings = ? WHERE id = ?",
                (json.dumps(self.settings), self.number),
            )

    def add(self, key: FileVersion, reading: Reading) -> Reading:
        """Store the reading of a file; return it as it is stored, in single precision."""
        reading = _in_single_precision(reading)
        duration = None if reading.quality is None else reading.quality.duration_s
        arrived = now()
        values = (
            self.number,
            *key,
            arrived,
            reading.started,
            reading.refused,
            duration,
            pack_reading(reading),
        )
        with self.store.transaction() as run:
            run(
                "INSERT INTO recording "
                "(sensor, file, version, arrived, started, refused, duration, reading) "
                "VALUES (?, ?, ?, ?, ?, ?, ?, ?) "
                # by another watch
                "ON CONFLICT (sensor, file, version) DO UPDATE SET reading = excluded.reading",
                values,
            )
            row = run(
                "SELECT id FROM recording WHERE sensor = ? AND file = ? AND version = ?",
                values[:3],
            )
            (number,) = row.fetchone()
        self.recordings[key] = StoredRecording(
            number,
            reading.time,
            None,
            reading.refused,
            nan if duration is None else duration,
            (reading.started or arrived)[:10],
        )
        self.unjudged.add(key)
        return _in_double_precision(reading)

    def set_state(self, key: FileVersion, state: AlarmState) -> None:
        """Set the alarm state at a recording."""
        self.recordings[key] = self.recordings[key]._replace(state=state)
        self.unjudged.discard(key)

    def reading(self, key: FileVersion) -> Reading | None:
        """Return a stored reading; None if it is not stored any more, or damaged and deleted."""
        rows = self.store.read(
            "SELECT reading FROM recording WHERE id = ?", self.recordings[key].number
        )
        body = rows[0][0] if rows else b""
        if not body:
            return None
        try:
            return _in_double_precision(unpack_reading(body, f"a recording in {self.store.path}"))
        except UnreadableFile:
            self.store.remarks.append(
                f"{self.store.path} was damaged: recording {Path(key.file).name}; read again if "
                "the file is still there"
            )
            with self.store.transaction() as run:
                run("DELETE FROM recording WHERE id = ?", (self.recordings.pop(key).number,))
            self.unjudged.discard(key)
            return None

    def times(self) -> dict[FileVersion, datetime]:
        """Return start or arrival of every recording, as UTC where no zone is known."""
        rows = self.store.read(
            "SELECT file, version, started, arrived FROM recording WHERE sensor = ?", self.number
        )
        return {
            FileVersion(file, version): _as_utc(datetime.fromisoformat(started or arrived))
            for file, version, started, arrived in rows
            if FileVersion(file, version) in self.recordings
        }

    def delete(self, run: Run, key: FileVersion) -> None:
        """Delete a recording within a transaction; its file is not read again."""
        number = self.recordings.pop(key).number
        self.unjudged.discard(key)
        self.dropped.add(key)
        run("DELETE FROM gap WHERE recording = ?", (number,))
        run("DELETE FROM recording WHERE id = ?", (number,))
        run(
            "INSERT OR IGNORE INTO dropped (sensor, file, version) VALUES (?, ?, ?)",
            (self.number, *key),
        )

    def forget_dropped(self, run: Run, present: Collection[str]) -> None:
        """Forget deleted recordings whose files are not in the folder any more."""
        for key in [key for key in self.dropped if key.file not in present]:
            self.dropped.remove(key)
            run(
                "DELETE FROM dropped WHERE sensor = ? AND file = ? AND version = ?",
                (self.number, *key),
            )

    def insert_judgement(self, run: Run, judgement: Table) -> None:
        """Insert a judgement, by names of columns, within a transaction."""
        values = {"sensor": self.number, "time": now(), **judgement}
        marks = ", ".join("?" * len(values))
        run(f"INSERT INTO judgement ({', '.join(values)}) VALUES ({marks})", [*values.values()])


def now() -> str:
    """Return the present time (UTC) as the store writes it."""
    return datetime.now(UTC).isoformat(timespec="seconds")


def _stored_recording(
    number: int,
    started: str | None,
    arrived: str,
    state: AlarmState | None,
    refused: int,
    duration_s: float | None,
    complete: int,
    gap: int | None,
) -> StoredRecording:
    """Return a recording from the values of its row."""
    return StoredRecording(
        number=number,
        time=datetime.fromisoformat(started) if started else None,
        state=state,
        refused=bool(refused),
        duration_s=duration_s or nan,
        day=(started or arrived)[:10],
        complete=bool(complete),
        gap=gap or 0,
    )


def _as_utc(time: datetime) -> datetime:
    return time if time.tzinfo is not None else time.replace(tzinfo=UTC)


def _in_single_precision(reading: Reading) -> Reading:
    """Return a reading with its spectrum in single precision: half the size, error 6e-8."""
    return _with_type(reading, np.float32)


def _in_double_precision(reading: Reading) -> Reading:
    """Return a reading with its spectrum in double precision."""
    return _with_type(reading, np.float64)


def _with_type(reading: Reading, kind: type[np.floating]) -> Reading:
    """Return a reading whose spectrum has another type of numbers."""
    if reading.spectrum is None:
        return reading
    spectrum = replace(reading.spectrum, density=reading.spectrum.density.astype(kind))
    return replace(reading, spectrum=spectrum)
