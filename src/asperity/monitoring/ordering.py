"""Order of recordings for judgement, window of a long series, and recordings that must wait."""

import os
from collections.abc import Mapping, Sequence
from itertools import accumulate
from pathlib import Path
from typing import NamedTuple

from asperity.core.documents import JsonObject
from asperity.monitoring.alarm import LAST
from asperity.monitoring.files import RecordingPlace, RecordingTable, place_at, x_of_recordings
from asperity.monitoring.simultaneous import (
    PlacedRecording,
    Slot,
    TimedRecording,
    match_places,
    match_times,
)
from asperity.monitoring.store.database import FileVersion, StoredRecording
from asperity.monitoring.store.sensors import Sensors
from asperity.trend import FIRST_JUDGED, LATEST_JUDGED


class Order(NamedTuple):
    """Recordings in the order in which they are judged, the name of x, and x by file.

    Simultaneous recordings of several sensors, each in a file of its own, are one of `instants`.
    `stated` is the content of a table; `waits` are sentences on recordings that cannot be matched
    with the others yet.
    """

    instants: list[tuple[FileVersion, ...]]
    x_name: str
    x: Mapping[str, float]
    stated: Mapping[str, RecordingPlace] | None = None
    waits: tuple[str, ...] = ()

    @property
    def keys(self) -> list[FileVersion]:
        """All files, in order."""
        return [key for instant in self.instants for key in instant]

    def place(self, file: str) -> RecordingPlace:
        """Return the place of a recording and its stated conditions."""
        return place_at(self.x[file], (self.stated or {}).get(file))


def order_recordings(
    series: Sequence[FileVersion], table: RecordingTable | None, sensors: Sensors
) -> Order:
    """Order by x the recordings that the table contains, or all without a table."""
    places = None
    if table is not None:
        places = table.places_of(
            [Path(key.file) for key in series if table.row(Path(key.file)) is not None]
        )
        series = [key for key in series if key.file in places]
    names, unnamed = _named_sensors(series, sensors)
    waiting = {*unnamed}
    series = [key for key in series if key not in waiting]
    waits = _wait_notes(
        unnamed, "does not name its sensor, and others do", "name it in a sidecar or a table"
    )
    x_name = "" if table is None else table.x_name
    if len(names) > sensors.channels:
        stored = {key: sensors.stored(key) for key in series}
        return _match_sensors(stored, places, x_name, waits)
    first = [sensors.first_stored(key) for key in series]
    stated_name = x_name
    x, x_name = x_of_recordings(
        [key.file for key in series],
        [recording.time for recording in first],
        [not recording.refused for recording in first],
        places,
        stated_name,
    )
    if x_name == "recording" and not stated_name:  # deleted recordings count
        x = _counting_deleted(x, [recording.gap for recording in first])
    return Order(
        [(key,) for key in sorted(series, key=lambda key: x[key.file])], x_name, x, places, waits
    )


def _counting_deleted(x: Mapping[str, float], gaps: Sequence[int]) -> dict[str, float]:
    """Return positions that include the recordings deleted before each one."""
    return {
        file: value + deleted
        for (file, value), deleted in zip(x.items(), accumulate(gaps), strict=True)
    }


def _named_sensors(
    series: Sequence[FileVersion], sensors: Sensors
) -> tuple[set[str], list[FileVersion]]:
    """Return the names of sensors, and recordings that lack a name while others have one."""
    names = sensors.readable_names(series)
    common_name = sensors.address.sensor
    if len(names) <= sensors.channels or common_name not in names:
        return names, []
    unnamed = [key for key in series if _belongs_to(common_name, sensors.stored(key))]
    return names - {common_name}, unnamed


def _match_sensors(
    stored: Mapping[FileVersion, Mapping[str, StoredRecording]],
    places: Mapping[str, RecordingPlace] | None,
    x_name: str,
    waits: tuple[str, ...],
) -> Order:
    """Match the files of several sensors by stated x, or else by time."""
    if x_name and places is not None:
        slots = _match_by_place(stored, places, x_name)
    else:
        x_name = "time_h"
        untimed = {
            key
            for key, by_sensor in stored.items()
            if not _refused(by_sensor) and _first(by_sensor).time is None
        }
        waits += _wait_notes(
            [key for key in stored if key in untimed],
            "does not state its start, and sensors are matched by time",
            "state `started` in a sidecar, or x in a table",
        )
        slots = _match_by_time(
            {key: by_sensor for key, by_sensor in stored.items() if key not in untimed}
        )
    instants: dict[Slot, list[FileVersion]] = {}
    for key, slot in slots.items():
        instants.setdefault(slot, []).append(key)
    x = {key.file: slot.x for key, slot in slots.items()}
    return Order([tuple(instants[slot]) for slot in sorted(instants)], x_name, x, places, waits)


def _match_by_place(
    stored: Mapping[FileVersion, Mapping[str, StoredRecording]],
    places: Mapping[str, RecordingPlace],
    x_name: str,
) -> dict[FileVersion, Slot]:
    """Match files by their stated x."""
    readable = {
        name
        for by_sensor in stored.values()
        for name, recording in by_sensor.items()
        if not recording.refused
    }
    placed = [
        PlacedRecording(
            name if (name := next(iter(by_sensor))) in readable else "",
            places[key.file].x,
            _first(by_sensor).duration_s,
        )
        for key, by_sensor in stored.items()
    ]
    return dict(zip(stored, match_places(placed, x_name), strict=True))


def _match_by_time(
    stored: Mapping[FileVersion, Mapping[str, StoredRecording]],
) -> dict[FileVersion, Slot]:
    """Match files by the time of their start."""
    parts = [
        (key, TimedRecording(key.file, name, recording.time, recording.duration_s))
        for key, by_sensor in stored.items()
        for name, recording in by_sensor.items()
    ]
    matched = match_times([recording for _, recording in parts])
    return {key: slot for (key, _), slot in zip(parts, matched, strict=True)}


def _first(by_sensor: Mapping[str, StoredRecording]) -> StoredRecording:
    return next(iter(by_sensor.values()))


def _refused(by_sensor: Mapping[str, StoredRecording]) -> bool:
    return all(recording.refused for recording in by_sensor.values())


def _belongs_to(name: str, by_sensor: Mapping[str, StoredRecording]) -> bool:
    return {*by_sensor} == {name} and not by_sensor[name].refused


def _wait_notes(waits: Sequence[FileVersion], reason: str, remedy: str) -> tuple[str, ...]:
    """Return a sentence on recordings that have to wait, if there are any."""
    if not waits:
        return ()
    others = f" (and {len(waits) - 1} more)" if len(waits) > 1 else ""
    return (f"{file_name(waits[0])}{others} waits: it {reason}; {remedy}",)


def max_window() -> int:
    """Return the length up to which all recordings of a series are judged."""
    return FIRST_JUDGED + LATEST_JUDGED


def judged_window(order: Order, end: int, sensors: Sensors) -> list[FileVersion]:
    """Return the files judged up to `end`.

    Of a long series these are the first after the last acknowledgement, the latest ones of every
    recording that is not judged yet, and the one that raised the standing alarm.
    """
    instants = order.instants[:end]
    stored = [number for number, keys in enumerate(instants) if sensors.complete(keys)]
    chosen = {*stored}
    if len(stored) > max_window():
        acknowledged = sensors.acknowledged
        standing = sensors.standing
        start = 0
        if acknowledged is not None:
            numbers = (
                number
                for number, keys in enumerate(instants, 1)
                if acknowledged in map(file_name, keys)
            )
            start = next(numbers, 0)
        unjudged = sensors.unjudged()
        new = sum(unjudged.issuperset(instants[number]) for number in stored[-LATEST_JUDGED:])
        latest = LATEST_JUDGED + max(new - 1, 0)
        after = [number for number in stored if number >= start]
        chosen = {*after[:FIRST_JUDGED], *stored[-latest:]}
        if standing is not None:
            chosen |= {
                number
                for number, keys in enumerate(instants)
                if standing.file in [key.file for key in keys]
            }
    return [key for number in sorted(chosen) for key in instants[number]]


def file_name(key: FileVersion) -> str:
    """Return the name of a file without its folder."""
    return key.file.rpartition(os.sep)[2]


def unacknowledged(rows: Sequence[JsonObject], acknowledged: str | None) -> Sequence[JsonObject]:
    """Return the rows after the last acknowledged recording; the machine may have been repaired."""
    if acknowledged == LAST:
        return ()
    for number, row in enumerate(rows, 1):
        if acknowledged in _file_names(row):
            return rows[number:]
    return rows


def _file_names(row: JsonObject) -> list[str]:
    """Return the names of a row's files on all sensors."""
    sensors = row.get("sensors")
    parts = sensors.values() if isinstance(sensors, Mapping) else ()
    files = [row["file"], *(part["file"] for part in parts if isinstance(part, Mapping))]
    return [Path(str(file)).name for file in files]
