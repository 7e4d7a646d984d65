"""Sensors of a store whose recordings are judged as one, as `watch` and `track` keep them: mostly it is one.

Each has its recordings under its own name; a judgement is of all of them, is kept for each, and
told once.
"""

import json
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import asdict, replace
from datetime import datetime
from pathlib import Path
from typing import Any
from uuid import uuid4

from asperity.core.errors import BadInput
from asperity.monitoring.reading import Reading, channels_in
from asperity.monitoring.sensor import ACKNOWLEDGED, FOLDER, TOGETHER, Sensor, now
from asperity.monitoring.series_state import Learned, learned_bytes, learned_from
from asperity.monitoring.silence import SILENCE
from asperity.monitoring.store import Kept, Place, Standing, Store, Version
from asperity.monitoring.target import Target
from asperity.monitoring.track_result import Track
from asperity.recording import ReadOptions
from asperity.trend import ALARM_STATES, AlarmState


class Sensors:
    """Sensors at one place of a store that are judged as one.

    `place` names them together; a recording goes to the sensor that its table, its sidecar or its
    channel names, and without one to that of `place`. `tells` are the states of which somebody is
    told, and of their end.

    Parameters
    ----------
    settings : by which recordings are read
    channels : how many of a file are read
    stated : whether somebody has named the sensor, so that there is one whatever recordings say

    Raises
    ------
    BadInput
        for a sensor whose recordings were read otherwise before.
    """

    def __init__(
        self,
        store: Store,
        place: Place,
        settings: Mapping[str, Any],
        *,
        channels: int = 1,
        stated: bool = False,
    ) -> None:
        if stated and channels > 1:
            raise BadInput(
                f"channels are sensors of their own, got sensor {place.sensor}; leave it out"
            )
        self.store, self.place, self.settings = store, place, settings
        self.channels, self.stated = channels, stated
        self.tells: Collection[str] = ALARM_STATES
        self.by_name: dict[str, Sensor] = {}
        self._spacing_hz: float | None = None
        self._lines: tuple[int | None, dict[int, dict[str, Any]]] = (
            None,
            {},
        )  # of the last judgement, as they were kept
        for name, begun in store.sensors_at(place.machine, place.point):
            if name == place.sensor or (begun.get(TOGETHER) == place.sensor and not stated):
                self._entered(name)

    def _entered(self, name: str) -> Sensor:
        """A sensor, entered if need be."""
        if name not in self.by_name:
            together = {} if name == self.place.sensor else {TOGETHER: self.place.sensor}
            begin = {} if self.spacing_hz is None else {"spacing_hz": self.spacing_hz}
            place = self.place._replace(sensor=name)
            self.by_name[name] = Sensor(self.store, place, {**self.settings, **together}, begin)
        return self.by_name[name]

    def _each(self) -> Iterator[Sensor]:
        return iter(self.by_name.values())

    @property
    def _first(self) -> Sensor | None:
        return next(self._each(), None)

    # Recordings
    # ------------------------------------------------------------------------------------------------------

    def unread(self, keys: Sequence[Version]) -> list[Version]:
        """Those of some versions of files that have not been read on every channel."""
        every = [one.recordings for one in self._each()]
        return [key for key in keys if sum(key in read for read in every) < self.channels]

    def kept(self, key: Version) -> dict[str, Kept]:
        """What is known of a version of a file, by sensor."""
        return {
            name: one.recordings[key] for name, one in self.by_name.items() if key in one.recordings
        }

    def first(self, key: Version) -> Kept:
        """What is known of a version of a file by the first sensor that could read it, or else by the first."""
        held = [one.recordings[key] for one in self._each() if key in one.recordings]
        return next((kept for kept in held if not kept.refused), held[0])

    def heard(self, keys: Sequence[Version]) -> set[str]:
        """Sensors that could read any of some versions of files."""
        return {
            name
            for name, one in self.by_name.items()
            if any(key in one.recordings and not one.recordings[key].refused for key in keys)
        }

    def state(self, key: Version) -> AlarmState | None:
        """What was said of a version of a file; None before it was judged."""
        for one in self._each():
            kept = one.recordings.get(key)
            if kept is not None and kept.state is not None:
                return kept.state
        return None

    def unjudged(self) -> set[Version]:
        """Recordings of which nothing was said yet."""
        return {key for one in self._each() for key in one.unjudged if self.state(key) is None}

    def series(self) -> list[Version]:
        """All recordings, of each file the last version, whether or not the file is still there."""
        every = ((kept.number, key) for one in self._each() for key, kept in one.recordings.items())
        return [*{key.file: key for _, key in (sorted(every) if self.several else every)}.values()]

    @property
    def several(self) -> bool:
        """Whether more sensors than one have recordings."""
        return len(self.by_name) > 1

    @property
    def apart(self) -> bool:
        """Whether sensors have files of their own."""
        return len(self.by_name) > self.channels

    @property
    def spacing_hz(self) -> float | None:
        """Distance of the lines of spectra; None before the first recording."""
        return next(
            (one.spacing_hz for one in self._each() if one.spacing_hz is not None), self._spacing_hz
        )

    def settle_spacing(self, spacing_hz: float) -> None:
        """Say how far apart lines are, once and for all."""
        self._spacing_hz = spacing_hz
        for one in self._each():
            one.settle_spacing(spacing_hz)

    def keep(self, key: Version, reading: Reading) -> None:
        """Keep what reading a file gave, under the name of its sensor."""
        self._entered(self._name_of(reading)).keep(key, reading)

    def holds(self, key: Version, reading: Reading) -> bool:
        """Whether what a sensor heard is kept."""
        return self._name_of(reading) in self.kept(key)

    def _name_of(self, reading: Reading) -> str:
        name = self.place.sensor if self.stated else reading.sensor
        if not name and reading.refused:  # nobody can say whose it is
            name = next(iter(self.by_name), "")
        return name or self.place.sensor

    def readings(self, key: Version) -> list[Reading]:
        """What was kept of a version of a file, but for what is damaged."""
        held = [one.reading(key) for one in self._each() if key in one.recordings]
        return [reading for reading in held if reading is not None]

    def rows(self, instants: Sequence[Sequence[Version]]) -> list[dict[str, Any]]:
        """Lines of what was judged, one of each instant, as `asperity track --json` has them, in their order."""
        rows: dict[int, str] = {}
        for one in self._each():
            found = "SELECT id, row FROM recording WHERE sensor = ? AND row IS NOT NULL"
            rows |= dict(self.store.read(found, one.number))
        of_each = (
            [kept.number for key in keys for kept in self.kept(key).values()] for keys in instants
        )
        first = (
            next((rows[number] for number in numbers if number in rows), None)
            for numbers in of_each
        )
        return [json.loads(row) for row in first if row is not None]

    # Judgements
    # ------------------------------------------------------------------------------------------------------

    def look_up(self) -> None:
        """What stands and up to where somebody has looked: another process may have acknowledged it."""
        for one in self._each():
            one.look_up()

    @property
    def acknowledged(self) -> str | None:
        """The recording up to which somebody has looked, None for none."""
        return next(
            (one.acknowledged for one in self._each() if one.acknowledged is not None), None
        )

    @property
    def standing(self) -> Standing | None:
        """The alarm that stands since."""
        return next((one.standing for one in self._each() if one.standing is not None), None)

    def acknowledge(self, file: str) -> None:
        """Somebody has looked at everything up to this recording."""
        with self.store.transaction() as run:
            for one in self._each():
                one.enter(run, {"state": ACKNOWLEDGED, "since": file})
        self.look_up()

    @property
    def asked(self) -> str | None:
        """What the last judgement was asked."""
        first = self._first
        return (
            None
            if first is None
            else self.store.read("SELECT asked FROM sensor WHERE id = ?", first.number)[0][0]
        )

    def said(self) -> dict[str, Any] | None:
        """The last judgement as `asperity track --json` has it; None before the first."""
        first = self._first
        text = (
            None
            if first is None
            else self.store.read("SELECT said FROM sensor WHERE id = ?", first.number)[0][0]
        )
        if text is None:
            return None
        said: dict[str, Any] = json.loads(text)
        numbers = said.pop("numbers")
        among = f"({', '.join('?' * len(numbers))})"
        rows = dict(self.store.read(f"SELECT id, row FROM recording WHERE id IN {among}", *numbers))
        return {
            "verdict": said.pop("verdict"),
            "recordings": [json.loads(rows[number]) for number in numbers],
            **said,
        }

    def learned(self) -> Learned:
        """What was learned of the series; empty at first."""
        if self._first is None:
            return Learned()
        held = self.store.read(
            "SELECT body, since FROM learned JOIN sensor ON sensor.id = learned.sensor WHERE sensor = ?",
            self._first.number,
        )
        return learned_from(held[0][0], held[0][1] or 0) if held else Learned()

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

        Raises
        ------
        BadInput
            for recordings of several sensors where somebody has named one.
        """
        if self.stated and track.sensors:
            raise BadInput(
                f"these recordings are of the sensors {', '.join(track.sensors)}, got sensor {self.place.sensor}; "
                "leave it out"
            )
        self.look_up()
        if self.standing is not None and track.alarm.state != "alarm":
            reason = f"{self.standing.reason}; raised before and not acknowledged"
            since, by = track.number_of(self.standing.file) or 0, self.standing.raised_by
            track = replace(
                track,
                alarm=replace(track.alarm, state="alarm", since=since, reason=reason, raised_by=by),
            )
        said = track.scalars(every_way=False)
        alarm, lines = said["alarm"], said.pop("recordings")
        last, rows = lines[-1]["file"], self._rows_of(track, lines, keys)
        told = {
            "asked": asked,
            "said": json.dumps({**said, "numbers": [number for number, *_ in rows[0]]}),
        }
        judgement = {"false_alarm_rate": alarm["false_alarm_rate"], "verdict": said["verdict"]}
        judgement |= {name: alarm[name] for name in ("state", "since", "reason", "raised_by")}
        with self.store.transaction() as run:
            ((version,),) = run("PRAGMA data_version").fetchall()
            before = (
                self._lines[1] if self._lines[0] == version else {}
            )  # another program may have changed them
            lines_now = {number: row for every in rows for number, row, *_ in every}
            for number, row in lines_now.items():
                if before.get(number) != row:
                    run(
                        "UPDATE recording SET row = ?, state = ? WHERE id = ?",
                        (json.dumps(row), row["state"], number),
                    )
            for one in self._each():
                one.enter(run, {**judgement, "recordings": len(track.recordings), "new": new})
                run(
                    "UPDATE sensor SET asked = :asked, said = :said WHERE id = :id",
                    {**told, "id": one.number},
                )
            self._call(run, who, _told(said, last))
            if learned is not None and learned.shared is not None and self._first is not None:
                run("UPDATE sensor SET since = ? WHERE id = ?", (learned.since, self._first.number))
                if learned.since == 0:
                    run("DELETE FROM learned WHERE sensor = ?", (self._first.number,))
                    if not learned.moved:  # else it is of one part, and all is learned anew
                        run(
                            "INSERT INTO learned VALUES (?, ?)",
                            (self._first.number, learned_bytes(learned.shared)),
                        )
        self._lines = (version, lines_now)
        for every in rows:
            for _, row, sensor, key in every:
                sensor.say(key, row["state"])
        for one in self._each():
            if alarm["state"] == "alarm" and one.standing is None:
                one.standing = Standing(alarm["since"], alarm["reason"], alarm["raised_by"] or "")
        return track

    def _rows_of(
        self, track: Track, rows: Sequence[dict[str, Any]], keys: Mapping[str, Version]
    ) -> list[list[tuple[int, dict[str, Any], Sensor, Version]]]:
        """Lines of a track's recordings with their numbers: `rows` of the track, then what others heard of each."""
        whole: list[tuple[int, dict[str, Any], Sensor, Version]] = []
        others: list[tuple[int, dict[str, Any], Sensor, Version]] = []
        for recording, row in zip(track.recordings, rows, strict=True):
            for name, reading in recording.readings.items():
                key = keys[reading.file]
                held = [one for one in self._each() if key in one.recordings]
                named = next((one for one in held if one.place.sensor == name), held[0])
                leads = name == recording.reading.sensor
                line = row if leads else recording.row_on(name, row)
                (whole if leads else others).append(
                    (named.recordings[key].number, line, named, key)
                )
        return [whole, others]

    def arrivals(self) -> list[datetime]:
        """When recordings came, the last ones."""
        if self._first is None:
            return []
        rows = self.store.read(
            "SELECT time FROM judgement WHERE sensor = ? AND new > 0 ORDER BY id DESC LIMIT 33",
            self._first.number,
        )
        return [datetime.fromisoformat(time) for (time,) in reversed(rows)]

    def fell_silent(self, reason: str, who: Sequence[str]) -> dict[str, Any] | None:
        """Keep, once, that no recordings come any more; the last judgement as it stands now, None before the first.

        An alarm that nobody has acknowledged stands, and is told with it.
        """
        self.look_up()
        said = self.said()
        if said is None or self._first is None:
            return None
        file = said["recordings"][-1]["file"]
        if self.standing is None:
            told = {"state": "blind", "since": file, "reason": reason, "raised_by": SILENCE}
            said["alarm"] |= {**told, "verdict": f"Blind: {reason}."}
        said["verdict"] = f"Blind: {reason}. {said['verdict']}"
        by = "SELECT raised_by FROM judgement WHERE sensor = ? ORDER BY id DESC LIMIT 1"
        if self.store.read(by, self._first.number)[:1] == [(SILENCE,)]:
            return said
        judgement = {
            "state": said["alarm"]["state"],
            "since": said["alarm"]["since"],
            "reason": reason,
        }
        with self.store.transaction() as run:
            for one in self._each():
                one.enter(
                    run, {**judgement, "raised_by": SILENCE, "verdict": said["verdict"], "new": 0}
                )
            self._call(run, who, _told(said, file))
        return said

    # Calls
    # -----------------------------------------------------------------------------------------------------------

    def _call(self, run: Any, who: Sequence[str], said: Mapping[str, Any]) -> None:
        """Note whom to call, in the same transaction as the judgement: neither can be without the other."""
        if self._first is None:
            return
        number, place = self._first.number, self.place._replace(sensor=", ".join(self.by_name))
        for name in who:
            last = run(
                "SELECT state FROM call WHERE sensor = ? AND who = ? ORDER BY id DESC LIMIT 1",
                (number, name),
            ).fetchone()
            before = None if last is None else last[0]
            if before != said["state"] and {before, said["state"]} & {*self.tells}:
                told = {
                    "id": str(uuid4()),
                    "time": now(),
                    **place._asdict(),
                    "before": before,
                    **said,
                }
                run(
                    "INSERT INTO call (sensor, who, state, said, time) VALUES (?, ?, ?, ?, ?)",
                    (number, name, said["state"], json.dumps(told), told["time"]),
                )

    def tell(self, who: Sequence[str], said: Mapping[str, Any]) -> None:
        """Note whom to call who does not know yet what was said last."""
        with self.store.transaction() as run:
            self._call(run, who, _told(said, said["recordings"][-1]["file"]))

    def waiting(self, who: str) -> list[tuple[int, int, float, str]]:
        """Calls that nobody has answered yet: number, attempts, when the next is due [s], what is to be said."""
        if self._first is None:
            return []
        return self.store.read(
            "SELECT id, attempts, due, said FROM call WHERE sensor = ? AND who = ? AND answered IS NULL ORDER BY id",
            *(self._first.number, who),
        )

    def called(self, number: int, *, failure: str | None = None, due: float = 0.0) -> None:
        """Keep how a call went: answered, or why not and when it is due again."""
        answered = None if failure is not None else now()
        with self.store.transaction() as run:
            run(
                "UPDATE call SET attempts = attempts + 1, failure = ?, due = ?, answered = ? WHERE id = ?",
                (failure, due, answered, number),
            )


def settings_of(target: Target, options: ReadOptions) -> dict[str, Any]:
    """By what recordings are read: recordings of one sensor are all read alike."""
    machine = {"rates_per_turn": dict(target.rates_per_turn)} if target.rates_per_turn else {}
    return {"band_hz": [round(end, 6) for end in target.band_hz]} | asdict(options) | machine


def opened(
    store: str | Path,
    folder: Path,
    names: tuple[str | None, str | None, str | None],
    target: Target,
    options: ReadOptions,
) -> Sensors:
    """Sensors of the store whose recordings lie in a folder.

    Parameters
    ----------
    names : of machine, point and sensor; who is not named whole has the recordings of the folder, and of no other
    target, options : by which recordings are read
    """
    machine, point, sensor = names
    channels = [channel for channel in channels_in(options.channel) if channel is not None]
    channel = ",".join(channels) or None
    place = Place(
        machine or folder.parent.name or "machine",
        point or folder.name or "point",
        sensor or channel or "sensor",
    )
    settings = settings_of(target, replace(options, channel=channel))
    settings |= {} if machine and point else {FOLDER: str(folder)}
    return Sensors(
        Store(store), place, settings, channels=max(len(channels), 1), stated=sensor is not None
    )


def those_of(store: Store, place: Place) -> Sensors:
    """A sensor of the store, with those that it is judged with."""
    begun = dict(store.sensors_at(place.machine, place.point))[place.sensor]
    return Sensors(store, place._replace(sensor=begun.get(TOGETHER, place.sensor)), {})


def _told(said: Mapping[str, Any], recording: str) -> dict[str, Any]:
    """What is said of a judgement to who is called."""
    return {**said["alarm"], "verdict": said["verdict"], "recording": recording}
