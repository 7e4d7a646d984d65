"""One sensor of a store: its recordings, settings of reading, acknowledgement and standing alarm.

`sensors` holds what concerns sensors that are judged together, and their notifications.
"""

import json
from datetime import UTC, datetime
from math import nan

from asperity.core.documents import Table
from asperity.core.errors import BadInput, UnreadableFile
from asperity.monitoring.reading import Reading, pack_reading, unpack_reading
from asperity.monitoring.store.database import (
    FileVersion,
    Run,
    SensorAddress,
    StandingAlarm,
    Store,
    StoredRecording,
)
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
            "SELECT id, file, version, started, state, refused, duration FROM recording "
            "WHERE sensor = ? ORDER BY id",
            self.number,
        )
        self.recordings = {
            FileVersion(file, version): StoredRecording(
                number,
                datetime.fromisoformat(started) if started else None,
                state,
                bool(refused),
                duration or nan,
            )
            for number, file, version, started, state, refused, duration in rows
        }
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

    def add(self, key: FileVersion, reading: Reading) -> None:
        """Store the reading of a file."""
        duration = None if reading.quality is None else reading.quality.duration_s
        values = (
            self.number,
            *key,
            now(),
            reading.started,
            reading.refused,
            duration,
            pack_reading(reading),
        )
        with self.store.transaction() as run:
            run(
                "INSERT INTO recording "
                "(sensor, file, version, heard, started, refused, duration, reading) "
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
            number, reading.time, None, reading.refused, nan if duration is None else duration
        )
        self.unjudged.add(key)

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
            return unpack_reading(body, f"a recording in {self.store.path}")
        except UnreadableFile:
            with self.store.transaction() as run:
                run("DELETE FROM recording WHERE id = ?", (self.recordings.pop(key).number,))
            self.unjudged.discard(key)
            return None

    def insert_judgement(self, run: Run, judgement: Table) -> None:
        """Insert a judgement, by names of columns, within a transaction."""
        values = {"sensor": self.number, "time": now(), **judgement}
        marks = ", ".join("?" * len(values))
        run(f"INSERT INTO judgement ({', '.join(values)}) VALUES ({marks})", [*values.values()])


def now() -> str:
    """Return the present time (UTC) as the store writes it."""
    return datetime.now(UTC).isoformat(timespec="seconds")
