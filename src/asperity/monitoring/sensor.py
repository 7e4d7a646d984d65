"""One sensor of a store: its recordings, how they are read, who has looked at them, and the alarm that stands.

What is said of sensors that are judged together, and who is told, is left to `sensors`.
"""

import json
from collections.abc import Mapping
from datetime import UTC, datetime
from math import nan
from typing import Any

from asperity.core.errors import BadInput, UnreadableFile
from asperity.monitoring.reading import Reading, reading_bytes, reading_from
from asperity.monitoring.store import Kept, Place, Standing, Store, Version
from asperity.trend import AlarmState

ACKNOWLEDGED = "acknowledged"  # state of a judgement that a person has made
# among the settings of a sensor that was not named: nobody else's recordings are to be taken for
# its
FOLDER = "folder"
TOGETHER = (
    "together"  # among the settings of sensors that are judged as one: the name by which they go
)
LATER = (FOLDER, TOGETHER)  # settings that older stores lack


class Sensor:
    """The recordings of one sensor.

    `settings` are those by which its recordings are read, and those given with `begin` where it is
    new. `recordings` are all that the store holds, `unjudged` those of which nothing was said yet;
    `acknowledged` names the one up to which somebody has looked, None for none; `standing` is the
    alarm that stands since.

    Raises
    ------
    BadInput
        for other settings than those that it was begun with.
    """

    def __init__(
        self,
        store: Store,
        place: Place,
        settings: Mapping[str, Any],
        begin: Mapping[str, Any] | None = None,
    ) -> None:
        self.store, self.place = store, place
        self.number, self.settings = store.entered(place, {**settings, **(begin or {})})
        for name, value in settings.items():
            if self.settings.get(name) != value and not (
                name in LATER and name not in self.settings
            ):
                raise BadInput(
                    f"{store.path} was begun with {name} {self.settings.get(name)}, now it is {value}; go on with the "
                    "same, or choose another out or another sensor"
                )
        self.recordings = {
            Version(file, version): Kept(
                row,
                datetime.fromisoformat(started) if started else None,
                state,
                bool(refused),
                duration or nan,
            )
            for row, file, version, started, state, refused, duration in store.read(
                "SELECT id, file, version, started, state, refused, duration FROM recording WHERE sensor = ? "
                "ORDER BY id",
                self.number,
            )
        }
        self.unjudged = {key for key, kept in self.recordings.items() if kept.state is None}
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

    @property
    def spacing_hz(self) -> float | None:
        """Distance of the lines of its spectra; None before the first recording."""
        return self.settings.get("spacing_hz")

    def settle_spacing(self, spacing_hz: float) -> None:
        """Say how far apart lines are, once and for all."""
        self.settings["spacing_hz"] = spacing_hz
        with self.store.transaction() as run:
            run(
                "UPDATE sensor SET settings = ? WHERE id = ?",
                (json.dumps(self.settings), self.number),
            )

    def keep(self, key: Version, reading: Reading) -> None:
        """Keep what reading a file gave."""
        duration = None if reading.quality is None else reading.quality.duration_s
        told = (
            self.number,
            *key,
            now(),
            reading.started,
            reading.refused,
            duration,
            reading_bytes(reading),
        )
        with self.store.transaction() as run:
            run(
                "INSERT INTO recording (sensor, file, version, heard, started, refused, duration, reading) "
                "VALUES (?, ?, ?, ?, ?, ?, ?, ?) "
                # by another watch
                "ON CONFLICT (sensor, file, version) DO UPDATE SET reading = excluded.reading",
                told,
            )
            found = run(
                "SELECT id FROM recording WHERE sensor = ? AND file = ? AND version = ?", told[:3]
            )
            (number,) = found.fetchone()
        self.recordings[key] = Kept(
            number, reading.time, None, reading.refused, nan if duration is None else duration
        )
        self.unjudged.add(key)

    def say(self, key: Version, state: AlarmState) -> None:
        """What is said of a recording from now on."""
        self.recordings[key] = self.recordings[key]._replace(state=state)
        self.unjudged.discard(key)

    def reading(self, key: Version) -> Reading | None:
        """What was kept; None, and forgotten, where it is damaged."""
        ((body,),) = self.store.read(
            "SELECT reading FROM recording WHERE id = ?", self.recordings[key].number
        )
        try:
            return reading_from(body, f"a recording in {self.store.path}")
        except UnreadableFile:
            with self.store.transaction() as run:
                run("DELETE FROM recording WHERE id = ?", (self.recordings.pop(key).number,))
            self.unjudged.discard(key)
            return None

    def enter(self, run: Any, judgement: Mapping[str, Any]) -> None:
        """A line of all that was said of it, by the names of the columns, within a transaction."""
        said = {"sensor": self.number, "time": now(), **judgement}
        places = ", ".join("?" * len(said))
        run(f"INSERT INTO judgement ({', '.join(said)}) VALUES ({places})", [*said.values()])


def now() -> str:
    """The time, as the store has it."""
    return datetime.now(UTC).isoformat(timespec="seconds")
