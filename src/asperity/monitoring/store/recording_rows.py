"""Rows of a judged series, assigned to the sensors and recordings of a store."""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

from asperity.core.documents import JsonObject
from asperity.monitoring.store.database import FileVersion
from asperity.monitoring.store.sensor import Sensor
from asperity.monitoring.track_result import Track
from asperity.trend import AlarmState


class StoredRow(NamedTuple):
    """A row of a track for one sensor: number of the recording, row, state, sensor and file."""

    number: int
    row: JsonObject
    state: AlarmState
    sensor: Sensor
    key: FileVersion


def stored_rows(
    sensors: Sequence[Sensor],
    track: Track,
    rows: Sequence[JsonObject],
    keys: Mapping[str, FileVersion],
) -> tuple[list[StoredRow], list[StoredRow]]:
    """Return the rows of each recording's leading sensor, and of the other sensors."""
    leading: list[StoredRow] = []
    others: list[StoredRow] = []
    for recording, row in zip(track.recordings, rows, strict=True):
        for name, reading in recording.readings.items():
            key = keys[reading.file]
            holders = [sensor for sensor in sensors if key in sensor.recordings]
            sensor = next(
                (holder for holder in holders if holder.address.sensor == name), holders[0]
            )
            leads = name == recording.reading.sensor
            own_row = row if leads else recording.row_on(name, row)
            (leading if leads else others).append(
                StoredRow(sensor.recordings[key].number, own_row, recording.state, sensor, key)
            )
    return leading, others
