"""In which order recordings are judged, which of a long series are, and which have to wait."""

import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from asperity.monitoring.alarm import BASELINE, LAST
from asperity.monitoring.files import Place, Table, placed_at, where
from asperity.monitoring.sensors import Sensors
from asperity.monitoring.simultaneous import Heard, Placed, by_place, by_time
from asperity.monitoring.store import Kept, Version

# recordings of a long series that are judged with the first BASELINE: as many as the alarm looks
# back
LATEST = 112


class Order(NamedTuple):
    """Recordings in the order in which they are judged, what x is, and the x of each, by its file.

    What several sensors heard at one time, each in a file of its own, is one of `instants`.
    `stated` is what a table says; `waits` are sentences on recordings that cannot be laid beside
    the others yet.
    """

    instants: list[tuple[Version, ...]]
    x_name: str
    x: Mapping[str, float]
    stated: Mapping[str, Place] | None = None
    waits: tuple[str, ...] = ()

    @property
    def keys(self) -> list[Version]:
        """All of them, one by one."""
        return [key for instant in self.instants for key in instant]

    def place(self, file: str) -> Place:
        """Where a recording stands, and what else is stated of it."""
        return placed_at(self.x[file], (self.stated or {}).get(file))


def ordered(known: Sequence[Version], table: Table | None, sensors: Sensors) -> Order:
    """The recordings that the table knows by now, or all, by x."""
    places = None
    if table is not None:
        places = table.placed(
            [Path(key.file) for key in known if table.row(Path(key.file)) is not None]
        )
        known = [key for key in known if key.file in places]
    names, own = sensors.heard(known), sensors.place.sensor
    waits: list[Version] = []
    if len(names) > sensors.channels and own in names:
        waits = [key for key in known if _is_of(own, sensors.kept(key))]
        names.discard(own)
        waiting = {*waits}
        known = [key for key in known if key not in waiting]
    said = _said(
        waits,
        "does not say of which sensor it is, and others do",
        "name it in a sidecar or a table",
    )
    x_name = "" if table is None else table.x_name
    if len(names) > sensors.channels:
        return _apart({key: sensors.kept(key) for key in known}, places, x_name, said)
    first = [sensors.first(key) for key in known]
    files, times, heard = (
        [key.file for key in known],
        [one.time for one in first],
        [not one.refused for one in first],
    )
    x, x_name = where(files, times, heard, places, x_name)
    return Order(
        [(key,) for key in sorted(known, key=lambda key: x[key.file])], x_name, x, places, said
    )


def _apart(
    kept: Mapping[Version, Mapping[str, Kept]],
    places: Mapping[str, Place] | None,
    x_name: str,
    said: tuple[str, ...],
) -> Order:
    """Recordings of sensors that have files of their own: what stands at one x, or was made at one time, is one."""
    stands: dict[Version, tuple[float, ...]] = {}
    if x_name and places is not None:
        known = {name for heard in kept.values() for name, one in heard.items() if not one.refused}
        stated = [
            Placed(
                name if (name := next(iter(heard))) in known else "",
                places[key.file].x,
                _first(heard).duration_s,
            )
            for key, heard in kept.items()
        ]
        stands |= zip(kept, by_place(stated, x_name), strict=True)
    else:
        x_name = "time_h"
        waits = [
            key for key, heard in kept.items() if not _refused(heard) and _first(heard).time is None
        ]
        said += _said(
            waits,
            "does not say when it began, and sensors are laid beside one another by that",
            "say so in a sidecar, or x in a table",
        )
        kept = {key: heard for key, heard in kept.items() if key not in {*waits}}
        parts = [(key, name, one) for key, heard in kept.items() for name, one in heard.items()]
        laid = by_time(
            [Heard(key.file, name, one.time, one.duration_s) for key, name, one in parts]
        )
        stands |= {key: there for (key, *_), there in zip(parts, laid, strict=True)}
    instants: dict[tuple[float, ...], list[Version]] = {}
    for key, there in stands.items():
        instants.setdefault(there, []).append(key)
    x = {key.file: there[0] for key, there in stands.items()}
    return Order([tuple(instants[there]) for there in sorted(instants)], x_name, x, places, said)


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
            those = (
                number
                for number, keys in enumerate(instants, 1)
                if acknowledged in map(file_name, keys)
            )
            behind = next(those, 0)
        chosen = {*range(behind, min(behind + BASELINE, end)), *range(end - LATEST, end)}
        if standing is not None:
            chosen |= {
                number
                for number, keys in enumerate(instants)
                if standing.file in [key.file for key in keys]
            }
    return [key for number in sorted(chosen) for key in instants[number]]


def file_name(key: Version) -> str:
    """The name of its file, without folders."""
    return key.file.rpartition(os.sep)[2]


def unacknowledged(
    rows: Sequence[Mapping[str, Any]], acknowledged: str | None
) -> Sequence[Mapping[str, Any]]:
    """Rows behind the recording up to which somebody has looked: what came before may have been repaired."""
    if acknowledged == LAST:
        return ()
    for number, row in enumerate(rows, 1):
        files = [row["file"], *(one["file"] for one in row.get("sensors", {}).values())]
        if acknowledged in [Path(file).name for file in files]:
            return rows[number:]
    return rows
