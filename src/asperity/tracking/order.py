"""In which order recordings are judged, and which of a long series are."""

import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from asperity.tracking.alarming import BASELINE, LAST
from asperity.tracking.files import Place, Table, in_their_places
from asperity.tracking.store import Sensor, Version

LATEST = 112  # recordings of a long series that are judged with the first BASELINE: as many as the alarm looks back


class Order(NamedTuple):
    """Recordings in the order in which they are judged, what x is, and where each stands, by its file."""

    keys: list[Version]
    x_name: str
    places: Mapping[str, Place]

    def place(self, number: int) -> Place:
        """Where a recording stands."""
        return self.places[self.keys[number].file]


def ordered(known: Sequence[Version], table: Table | None, sensor: Sensor) -> Order:
    """The recordings that the table knows by now, or all, by x."""
    places = None
    if table is not None:
        places = table.placed([Path(key.file) for key in known if table.row(Path(key.file)) is not None])
        known = [key for key in known if key.file in places]
    kept = [sensor.recordings[key] for key in known]
    files, heard = [key.file for key in known], [not one.refused for one in kept]
    x_name = "" if table is None else table.x_name
    stand, x_name = in_their_places(files, [one.time for one in kept], heard, places, x_name)
    return Order(sorted(known, key=lambda key: stand[key.file].x), x_name, stand)


def longest() -> int:
    """Recordings of a series that are all judged."""
    return BASELINE + LATEST


def window(order: Order, end: int, sensor: Sensor) -> list[int]:
    """What is judged of a long series: the first ones nobody has acknowledged, the latest, and who raised the alarm."""
    keys = order.keys[:end]
    if end <= longest():
        return list(range(end))
    behind = 0
    if sensor.acknowledged is not None:
        behind = next((number for number, key in enumerate(keys, 1) if file_name(key) == sensor.acknowledged), 0)
    chosen = {*range(behind, min(behind + BASELINE, end)), *range(end - LATEST, end)}
    if sensor.standing is not None:
        chosen |= {number for number, key in enumerate(keys) if key.file == sensor.standing.file}
    return sorted(chosen)


def file_name(key: Version) -> str:
    """The name of its file, without folders."""
    return key.file.rpartition(os.sep)[2]


def unacknowledged(rows: Sequence[Mapping[str, Any]], acknowledged: str | None) -> Sequence[Mapping[str, Any]]:
    """Rows behind the recording up to which somebody has looked: what came before may have been repaired."""
    if acknowledged == LAST:
        return ()
    names = [Path(row["file"]).name for row in rows]
    return rows[names.index(acknowledged) + 1 :] if acknowledged in names else rows
