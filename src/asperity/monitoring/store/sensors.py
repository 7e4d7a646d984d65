"""Sensors of a store whose recordings are judged together; in most cases a single sensor.

Each sensor has its recordings under its own name. A judgement covers all of them; it is stored for
each and notified once.
"""

import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from datetime import datetime
from typing import Any

from asperity.core.documents import JsonObject, Table
from asperity.core.errors import BadInput
from asperity.monitoring.reading import Reading
from asperity.monitoring.series_state import SeriesMemory, StoredLevels
from asperity.monitoring.states import SILENCE
from asperity.monitoring.store.database import (
    FileVersion,
    SensorAddress,
    StandingAlarm,
    Store,
    StoredRecording,
)
from asperity.monitoring.store.memories import read_levels, read_memory, write_levels, write_memory
from asperity.monitoring.store.notification_queue import (
    NotificationQueue,
    PendingNotification,
    notification_content,
)
from asperity.monitoring.store.recording_rows import StoredRow, stored_rows
from asperity.monitoring.store.schema import Run
from asperity.monitoring.store.sensor import ACKNOWLEDGED, TOGETHER, Sensor
from asperity.monitoring.track_result import Track
from asperity.trend import AlarmState

ALARM_COLUMNS = ("state", "since", "reason", "raised_by", "false_alarm_rate")


class Sensors:
    """Sensors at one point of a store that are judged together.

    `address` names them together. A recording belongs to the sensor that its table, sidecar or
    channel names, otherwise to that of `address`.

    Parameters
    ----------
    settings : with which recordings are read
    channels : number of channels read per file
    named : whether the user named the sensor; then all recordings belong to it

    Raises
    ------
    BadInput
        if the recordings of a sensor were read with other settings before.
    """

    def __init__(
        self,
        store: Store,
        address: SensorAddress,
        settings: Table,
        *,
        channels: int = 1,
        named: bool = False,
    ) -> None:
        if named and channels > 1:
            raise BadInput(
                f"each channel is a sensor of its own, got sensor {address.sensor}; omit the sensor"
            )
        self.store, self.address, self.settings = store, address, settings
        self.channels, self.named = channels, named
        self.notifications = NotificationQueue(store)
        self.by_name: dict[str, Sensor] = {}
        self._spacing_hz: float | None = None
        # version of the database and rows by recording number, as of the last judgement
        self._written: tuple[int | None, dict[int, JsonObject]] = (None, {})
        for name, stored in store.sensors_at(address.machine, address.point):
            if name == address.sensor or (stored.get(TOGETHER) == address.sensor and not named):
                self._registered(name)

    def _registered(self, name: str) -> Sensor:
        """Return a sensor, registered in the store if it is new."""
        if name not in self.by_name:
            together = {} if name == self.address.sensor else {TOGETHER: self.address.sensor}
            initial = {} if self.spacing_hz is None else {"spacing_hz": self.spacing_hz}
            address = self.address._replace(sensor=name)
            self.by_name[name] = Sensor(self.store, address, {**self.settings, **together}, initial)
        return self.by_name[name]

    def _sensors(self) -> Iterator[Sensor]:
        return iter(self.by_name.values())

    @property
    def _first(self) -> Sensor | None:
        return next(self._sensors(), None)

    # Recordings
    # ----------------------------------------------------------------------------------------------

    def unread(self, keys: Sequence[FileVersion]) -> list[FileVersion]:
        """Return the files of which not every channel has been read."""
        sensors = [*self._sensors()]
        return [
            key
            for key in keys
            if sum(key in sensor.recordings or key in sensor.dropped for sensor in sensors)
            < self.channels
        ]

    def stored(self, key: FileVersion) -> dict[str, StoredRecording]:
        """Return the stored recordings of a file, by sensor."""
        return {
            name: sensor.recordings[key]
            for name, sensor in self.by_name.items()
            if key in sensor.recordings
        }

    def first_stored(self, key: FileVersion) -> StoredRecording:
        """Return the stored recording of a file on the first sensor that could read it."""
        stored = [sensor.recordings[key] for sensor in self._sensors() if key in sensor.recordings]
        return next((recording for recording in stored if not recording.refused), stored[0])

    def complete(self, keys: Sequence[FileVersion]) -> bool:
        """Tell whether the spectrum of any of the files is stored."""
        return any(
            sensor.recordings[key].complete
            for key in keys
            for sensor in self._sensors()
            if key in sensor.recordings
        )

    def readable_names(self, keys: Sequence[FileVersion]) -> set[str]:
        """Return the names of sensors that could read any of the files."""
        return {
            name
            for name, sensor in self.by_name.items()
            if any(key in sensor.recordings and not sensor.recordings[key].refused for key in keys)
        }

    def state(self, key: FileVersion) -> AlarmState | None:
        """Return the alarm state at a file; None before it was judged."""
        for sensor in self._sensors():
            recording = sensor.recordings.get(key)
            if recording is not None and recording.state is not None:
                return recording.state
        return None

    def unjudged(self) -> set[FileVersion]:
        """Return the files that have not been judged yet."""
        return {
            key for sensor in self._sensors() for key in sensor.unjudged if self.state(key) is None
        }

    def series(self) -> list[FileVersion]:
        """Return the last version of every file, including files that no longer exist."""
        numbered = (
            (recording.number, key)
            for sensor in self._sensors()
            for key, recording in sensor.recordings.items()
        )
        ordered = sorted(numbered) if self.several else numbered
        return [*{key.file: key for _, key in ordered}.values()]

    @property
    def several(self) -> bool:
        """Presence of recordings on more than one sensor."""
        return len(self.by_name) > 1

    @property
    def spacing_hz(self) -> float | None:
        """Spacing of the spectra's lines [Hz]; None before the first recording."""
        spacings = (sensor.spacing_hz for sensor in self._sensors())
        return next((spacing for spacing in spacings if spacing is not None), self._spacing_hz)

    def set_spacing(self, spacing_hz: float) -> None:
        """Set the spacing of lines [Hz] for all recordings of these sensors."""
        self._spacing_hz = spacing_hz
        for sensor in self._sensors():
            sensor.set_spacing(spacing_hz)

    def add(self, key: FileVersion, reading: Reading) -> Reading:
        """Store the reading of a file under the name of its sensor; return it as stored."""
        return self._registered(self._name_of(reading)).add(key, reading)

    def holds(self, key: FileVersion, reading: Reading) -> bool:
        """Tell whether a sensor's reading of a file is stored."""
        return self._name_of(reading) in self.stored(key)

    def _name_of(self, reading: Reading) -> str:
        name = self.address.sensor if self.named else reading.sensor
        if not name and reading.refused:  # its sensor is unknown
            name = next(iter(self.by_name), "")
        return name or self.address.sensor

    def readings(self, key: FileVersion) -> list[Reading]:
        """Return the stored readings of a file, without damaged ones."""
        stored = [sensor.reading(key) for sensor in self._sensors() if key in sensor.recordings]
        return [reading for reading in stored if reading is not None]

    def rows(self, instants: Sequence[Sequence[FileVersion]]) -> list[JsonObject]:
        """Return one judged row per instant, as in `asperity track --json`."""
        rows: dict[int, str] = {}
        for sensor in self._sensors():
            query = "SELECT id, row FROM recording WHERE sensor = ? AND row IS NOT NULL"
            rows |= dict(self.store.read(query, sensor.number))
        numbers_of = (
            [recording.number for key in keys for recording in self.stored(key).values()]
            for keys in instants
        )
        first = (
            next((rows[number] for number in numbers if number in rows), None)
            for numbers in numbers_of
        )
        return [json.loads(row) for row in first if row is not None]

    # Judgements
    # ----------------------------------------------------------------------------------------------

    def refresh(self) -> None:
        """Read standing alarm and acknowledgement, which another process may have changed."""
        for sensor in self._sensors():
            sensor.refresh()

    @property
    def acknowledged(self) -> str | None:
        """Name of the last acknowledged recording; None without one."""
        names = (sensor.acknowledged for sensor in self._sensors())
        return next((name for name in names if name is not None), None)

    @property
    def standing(self) -> StandingAlarm | None:
        """Alarm that has not been acknowledged."""
        alarms = (sensor.standing for sensor in self._sensors())
        return next((alarm for alarm in alarms if alarm is not None), None)

    def acknowledge(self, file: str) -> None:
        """Acknowledge alarms up to a recording."""
        with self.store.transaction() as run:
            for sensor in self._sensors():
                sensor.insert_judgement(run, {"state": ACKNOWLEDGED, "since": file})
        self.refresh()

    @property
    def last_question(self) -> str | None:
        """Digest of the settings and recordings of the last judgement."""
        return self._of_first("question")

    def last_judgement(self) -> dict[str, Any] | None:
        """Return the last judgement as in `asperity track --json`; None before the first."""
        text = self._of_first("content")
        if text is None:
            return None
        judgement: dict[str, Any] = json.loads(text)
        numbers = judgement.pop("numbers")
        marks = f"({', '.join('?' * len(numbers))})"
        rows = dict(self.store.read(f"SELECT id, row FROM recording WHERE id IN {marks}", *numbers))
        return {
            "verdict": judgement.pop("verdict"),
            "recordings": [json.loads(rows[number]) for number in numbers if number in rows],
            **judgement,
        }

    def _of_first(self, column: str) -> str | None:
        """Return a column of the first sensor; None without a sensor."""
        if self._first is None:
            return None
        query = f"SELECT {column} FROM sensor WHERE id = ?"
        text: str | None = self.store.read(query, self._first.number)[0][0]
        return text

    def series_memory(self) -> SeriesMemory:
        """Return what the series has in common; empty at first."""
        return (
            SeriesMemory() if self._first is None else read_memory(self.store, self._first.number)
        )

    def levels(self) -> StoredLevels | None:
        """Return the memory of the levels; None before the first judgement."""
        return None if self._first is None else read_levels(self.store, self._first.number)

    def record_judgement(
        self,
        track: Track,
        keys: Mapping[str, FileVersion],
        new: int,
        question: str,
        memory: SeriesMemory | None,
        recipients: Sequence[str] = (),
    ) -> Track:
        """Store a judgement and return the track, with a standing alarm put back if it lacks it.

        Parameters
        ----------
        keys : versions of its recordings, by file
        new : number of recordings that are judged for the first time
        question : digest that `last_question` returns
        recipients : notified if the state differs from the last one they received

        Raises
        ------
        BadInput
            for recordings of several sensors if the user named one.
        """
        self._require_single(track)
        self.refresh()
        track = self._with_standing_alarm(track)
        judgement = track.scalars(all_sources=False)
        alarm = judgement["alarm"]
        lines = judgement.pop("recordings")
        leading, others = stored_rows([*self._sensors()], track, lines, keys)
        content = json.dumps({**judgement, "numbers": [stored.number for stored in leading]})
        entry = {name: alarm[name] for name in ALARM_COLUMNS}
        entry |= {"verdict": judgement["verdict"], "recordings": len(lines), "new": new}
        rows = [*leading, *others]
        with self.store.transaction() as run:
            written = self._write_rows(run, rows)
            for sensor in self._sensors():
                sensor.insert_judgement(run, entry)
                run(
                    "UPDATE sensor SET question = ?, content = ? WHERE id = ?",
                    (question, content, sensor.number),
                )
            self._queue(run, recipients, notification_content(judgement, lines[-1]["file"]))
            if self._first is not None:
                write_memory(run, self._first.number, memory)
                write_levels(run, self._first.number, track)
        self._written = written
        for stored in rows:
            stored.sensor.set_state(stored.key, stored.state)
        self._set_standing(alarm)
        return track

    def _write_rows(
        self, run: Run, stored: Sequence[StoredRow]
    ) -> tuple[int, dict[int, JsonObject]]:
        """Write the rows that have changed; return the database's version and all rows."""
        rows = {row.number: row.row for row in stored}
        ((version,),) = run("PRAGMA data_version").fetchall()
        # another program may have changed them
        written = self._written[1] if self._written[0] == version else {}
        for number, row in rows.items():
            if written.get(number) != row:
                run(
                    "UPDATE recording SET row = ?, state = ? WHERE id = ?",
                    (json.dumps(row), row["state"], number),
                )
        return version, rows

    def _set_standing(self, alarm: Mapping[str, Any]) -> None:
        """Store an alarm as unacknowledged on the sensors that have none."""
        for sensor in self._sensors():
            if alarm["state"] == "alarm" and sensor.standing is None:
                sensor.standing = StandingAlarm(
                    alarm["since"], alarm["reason"], alarm["raised_by"] or ""
                )

    def _require_single(self, track: Track) -> None:
        """Raise BadInput for recordings of several sensors if the user named one."""
        if self.named and track.sensors:
            raise BadInput(
                f"these recordings belong to the sensors {', '.join(track.sensors)}, got sensor "
                f"{self.address.sensor}; omit the sensor"
            )

    def _with_standing_alarm(self, track: Track) -> Track:
        """Put the standing alarm into a track whose own alarm has ended."""
        if self.standing is None or track.alarm.state == "alarm":
            return track
        alarm = replace(
            track.alarm,
            state="alarm",
            since=track.number_of(self.standing.file) or 0,
            reason=f"{self.standing.reason}; raised before and not acknowledged",
            raised_by=self.standing.raised_by,
        )
        return replace(track, alarm=alarm)

    def arrivals(self) -> list[datetime]:
        """Return when the last recordings arrived."""
        if self._first is None:
            return []
        rows = self.store.read(
            "SELECT time FROM judgement WHERE sensor = ? AND new > 0 ORDER BY id DESC LIMIT 33",
            self._first.number,
        )
        return [datetime.fromisoformat(time) for (time,) in reversed(rows)]

    def record_overdue(self, reason: str, recipients: Sequence[str]) -> dict[str, Any] | None:
        """Store, once, that recordings are overdue; return the last judgement with that added.

        None before the first judgement. An unacknowledged alarm persists.
        """
        self.refresh()
        judgement = self.last_judgement()
        if judgement is None or self._first is None:
            return None
        file = judgement["recordings"][-1]["file"]
        if self.standing is None:
            blind = {"state": "blind", "since": file, "reason": reason, "raised_by": SILENCE}
            judgement["alarm"] |= {**blind, "verdict": f"Blind: {reason}."}
        judgement["verdict"] = f"Blind: {reason}. {judgement['verdict']}"
        judgement["sensor"] = {"state": "blind", "reason": reason}
        active = judgement["alarm"].get("causes", [])  # none in stores of older versions
        judgement["alarm"]["causes"] = sorted({*active, SILENCE})
        query = "SELECT raised_by FROM judgement WHERE sensor = ? ORDER BY id DESC LIMIT 1"
        if self.store.read(query, self._first.number)[:1] == [(SILENCE,)]:
            return judgement
        entry = {
            "state": judgement["alarm"]["state"],
            "since": judgement["alarm"]["since"],
            "reason": reason,
            "raised_by": SILENCE,
            "verdict": judgement["verdict"],
            "new": 0,
        }
        with self.store.transaction() as run:
            for sensor in self._sensors():
                sensor.insert_judgement(run, entry)
            self._queue(run, recipients, notification_content(judgement, file))
        return judgement

    # Notifications
    # ----------------------------------------------------------------------------------------------

    def _queue(self, run: Run, recipients: Sequence[str], content: JsonObject) -> None:
        if self._first is not None:
            address = self.address._replace(sensor=", ".join(self.by_name))
            self.notifications.add(run, self._first.number, address, recipients, content)

    def queue_notifications(self, recipients: Sequence[str], judgement: Mapping[str, Any]) -> None:
        """Queue notifications to recipients that do not know the last judgement yet."""
        with self.store.transaction() as run:
            last = judgement["recordings"][-1]["file"]
            self._queue(run, recipients, notification_content(judgement, last))

    def pending_notifications(self, recipient: str) -> list[PendingNotification]:
        """Return notifications that a recipient has not received yet."""
        return (
            [] if self._first is None else self.notifications.pending(self._first.number, recipient)
        )
