"""In which order recordings are judged, which of a long series are, and which have to wait."""

import os
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

from asperity.tracking.alarming import BASELINE, LAST
from asperity.tracking.files import Place, Table, in_their_places
from asperity.tracking.instants import Heard, Placed, by_place, by_time
from asperity.tracking.sensors import Sensors
from asperity.tracking.store import Kept, Version

LATEST = 112  # recordings of a long series that are judged with the first BASELINE: as many as the alarm looks back


class Order(NamedTuple):
    """Recordings in the order in which they are judged, what x is, and where each stands, by its file.

    What several sensors heard at one time, each in a file of its own, is one of `instants`. `waits` are sentences on
    recordings that cannot be laid beside the others yet.
    """

    instants: list[tuple[Version, ...]]
    x_name: str
    places: Mapping[str, Place]
    waits: tuple[str, ...] = ()

    @property
    def keys(self) -> list[Version]:
        """All of them, one by one."""
        return [key for instant in self.instants for key in instant]


def ordered(known: Sequence[Version], table: Table | None, sensors: Sensors) -> Order:
    """The recordings that the table knows by now, or all, by x."""
    places = None
    if table is not None:
        places = table.placed([Path(key.file) for key in known if table.row(Path(key.file)) is not None])
        known = [key for key in known if key.file in places]
    kept = {key: sensors.kept(key) for key in known}
    names = {name for heard in kept.values() for name, one in heard.items() if not one.refused}
    waits: list[Version] = []
    if len(names) > sensors.channels and sensors.place.sensor in names:
        waits = [key for key, heard in kept.items() if _is_of(sensors.place.sensor, heard)]
        names.discard(sensors.place.sensor)
    said = _said(waits, "does not say of which sensor it is, and others do", "name it in a sidecar or a table")
    kept = {key: heard for key, heard in kept.items() if key not in {*waits}}
    x_name = "" if table is None else table.x_name
    if len(names) > sensors.channels:
        return _apart(kept, places, x_name, said)
    files = [key.file for key in kept]
    times = [next(iter(heard.values())).time for heard in kept.values()]
    stand, x_name = in_their_places(files, times, [not _refused(heard) for heard in kept.values()], places, x_name)
    return Order([(key,) for key in sorted(kept, key=lambda key: stand[key.file].x)], x_name, stand, said)


def _apart(
    kept: Mapping[Version, Mapping[str, Kept]], places: Mapping[str, Place] | None, x_name: str, said: tuple[str, ...]
) -> Order:
    """Recordings of sensors that have files of their own: what stands at one x, or was made at one time, is one."""
    stands: dict[Version, tuple[float, ...]] = {}
    if x_name and places is not None:
        known = {name for heard in kept.values() for name, one in heard.items() if not one.refused}
        stated = [
            Placed(name if (name := next(iter(heard))) in known else "", places[key.file].x, _first(heard).duration_s)
            for key, heard in kept.items()
        ]
        stands |= zip(kept, by_place(stated, x_name), strict=True)
    else:
        x_name = "time_h"
        waits = [key for key, heard in kept.items() if not _refused(heard) and _first(heard).time is None]
        said += _said(waits, "does not say when it began, and sensors are laid beside one another by that",
                      "say so in a sidecar, or x in a table")  # fmt: skip
        kept = {key: heard for key, heard in kept.items() if key not in {*waits}}
        parts = [(key, name, one) for key, heard in kept.items() for name, one in heard.items()]
        laid = by_time([Heard(key.file, name, one.time, one.duration_s) for key, name, one in parts])
        stands |= {key: there for (key, *_), there in zip(parts, laid, strict=True)}
    instants: dict[tuple[float, ...], list[Version]] = {}
    for key, there in stands.items():
        instants.setdefault(there, []).append(key)
    placed = {
        key.file: replace((places or {}).get(key.file, Place(x=there[0])), x=there[0]) for key, there in stands.items()
    }
    return Order([tuple(instants[there]) for there in sorted(instants)], x_name, placed, said)


def _first(heard: Mapping[str, Kept]) -> Kept:
    return next(iter(heard.values()))


def _refused(heard: Mapping[str, Kept]) -> bool:
    return all(one.refused for one in heard.values())


def _is_of(name: str, heard: Mapping[str, Kept]) -> bool:
    return {*heard} == {name} and not heard[name].refused


def _said(waits: Sequence[Version], why: str, remedy: str) -> tuple[str, ...]:
    """A sentence on recordings that wait; none on none."""
    if not waits:
        return ()
    more = f" (and {len(waits) - 1} more)" if len(waits) > 1 else ""
    return (f"{file_name(waits[0])}{more} waits: it {why}; {remedy}",)


def longest() -> int:
    """Recordings of a series that are all judged."""
    return BASELINE + LATEST


def window(order: Order, end: int, sensors: Sensors) -> list[Version]:
    """What is judged of a long series: the first ones nobody has acknowledged, the latest, and who raised the alarm."""
    instants = order.instants[:end]
    chosen = {*range(end)}
    if end > longest():
        acknowledged, standing = sensors.acknowledged, sensors.standing
        behind = 0
        if acknowledged is not None:
            those = (number for number, keys in enumerate(instants, 1) if acknowledged in map(file_name, keys))
            behind = next(those, 0)
        chosen = {*range(behind, min(behind + BASELINE, end)), *range(end - LATEST, end)}
        if standing is not None:
            chosen |= {number for number, keys in enumerate(instants) if standing.file in [key.file for key in keys]}
    return [key for number in sorted(chosen) for key in instants[number]]


def file_name(key: Version) -> str:
    """The name of its file, without folders."""
    return key.file.rpartition(os.sep)[2]


def unacknowledged(rows: Sequence[Mapping[str, Any]], acknowledged: str | None) -> Sequence[Mapping[str, Any]]:
    """Rows behind the recording up to which somebody has looked: what came before may have been repaired."""
    if acknowledged == LAST:
        return ()
    for number, row in enumerate(rows, 1):
        files = [row["file"], *(one["file"] for one in row.get("sensors", {}).values())]
        if acknowledged in [Path(file).name for file in files]:
            return rows[number:]
    return rows
