"""Overview of a store with many machines: one row per sensor, and export of all recordings."""

import json
from collections.abc import Mapping
from contextlib import closing
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from asperity.core.errors import BadInput
from asperity.core.files import atomic_write, write_csv
from asperity.monitoring.alarm import LAST
from asperity.monitoring.store.database import SensorAddress, Store
from asperity.monitoring.store.sensor import ACKNOWLEDGED
from asperity.monitoring.store.sensor_lookup import open_sensors, sensors_judged_with
from asperity.monitoring.track_result import Track, flat
from asperity.monitoring.watching.watch_state import version_of
from asperity.recording import ReadOptions

if TYPE_CHECKING:
    import pandas

SEVERITY = (  # most severe first
    "alarm",
    "blind",
    "cannot-tell",
    "alert",
    "none",
)
STATE_TEXTS = {
    "blind": "blind",
    "cannot-tell": "cannot tell",
    "alert": "alert",
    "none": "none",
    "alarm": "ALARM",
}
SUFFIXES = (".csv", ".parquet")


@dataclass(frozen=True, slots=True, kw_only=True)
class StoreOverview:
    """State of every sensor of a store; `rows` as in `asperity store --json`, most severe first."""

    path: Path
    rows: tuple[dict[str, Any], ...]

    @property
    def state(self) -> str:
        """Most severe state of all sensors."""
        return min((row["state"] for row in self.rows), key=SEVERITY.index, default="cannot-tell")

    def verdict(self) -> str:
        """Return the numbers of sensors, recordings and states as one sentence."""
        if not self.rows:
            return f"{self.path.name} contains no recordings yet."
        machines = len({row["machine"] for row in self.rows})
        recordings = sum(row["recordings"] for row in self.rows)
        sensors = f"{len(self.rows)} sensor{'s' * (len(self.rows) > 1)}"
        location = f"{machines} machine{'s' * (machines > 1)}"
        counts = {state: sum(row["state"] == state for row in self.rows) for state in SEVERITY[:-1]}
        states = ", ".join(
            f"{STATE_TEXTS[state]} {count}" for state, count in counts.items() if count
        )
        return f"{sensors} on {location}, {recordings} recordings: {states or 'no alarm'}."

    def scalars(self) -> dict[str, Any]:
        """Return the JSON of `asperity store`."""
        return {"verdict": self.verdict(), "state": self.state, "sensors": list(self.rows)}

    def export(self, path: str | Path) -> Path:
        """Write all recordings of the store as rows of a .csv or .parquet file.

        Raises
        ------
        BadInput
            for another suffix, or a path that is not writable.
        """
        path = Path(path)
        if path.suffix.lower() not in SUFFIXES:
            raise BadInput(
                f"a store is exported as .csv or .parquet, got {path.name}; change the suffix"
            )
        with closing(Store(self.path, make=False, repair=False)) as store:
            table = _table(store)
        if path.suffix.lower() == ".csv":
            write_csv(path, table)
        else:
            with atomic_write(path) as part:
                table.to_parquet(part, index=False)
        return path


def store_overview(path: str | Path) -> StoreOverview:
    """Read the state of every sensor of a store.

    Raises
    ------
    UnreadableFile
        if the file is not a store.
    """
    with closing(Store(path, make=False, repair=False)) as store:
        rows = [_sensor_row(store, number, address) for number, address in store.sensors()]
    rows.sort(key=lambda row: SEVERITY.index(row["state"]))
    return StoreOverview(path=Path(path), rows=tuple(rows))


def _sensor_row(store: Store, number: int, address: SensorAddress) -> dict[str, Any]:
    """Return a sensor's row."""
    ((count, last),) = store.read(
        "SELECT count(*), max(arrived) FROM recording WHERE sensor = ?", number
    )
    judged = store.read(
        "SELECT state, since, reason, time, verdict FROM judgement WHERE sensor = ? AND state != ? "
        "ORDER BY id DESC LIMIT 1",
        *(number, ACKNOWLEDGED),
    )
    missing = ("cannot-tell", None, "no judgement yet", None, "No judgement yet.")
    state, since, reason, judged_at, verdict = judged[0] if judged else missing
    values = {
        "recordings": count,
        "last_arrival": last,
        "state": state,
        "since": since,
        "reason": reason,
    }
    return address._asdict() | values | {"judged": judged_at, "verdict": verdict}


def _table(store: Store) -> "pandas.DataFrame":
    import pandas

    rows = store.read(
        "SELECT sensor, file, arrived, started, state, row FROM recording ORDER BY sensor, id"
    )
    addresses: Mapping[int, SensorAddress] = dict(store.sensors())
    return pandas.DataFrame(
        {
            **addresses[sensor]._asdict(),
            "arrived": arrived,
            **(
                {"file": file, "started": started or None, "state": state}
                if row is None
                else flat(json.loads(row))
            ),
        }
        for sensor, file, arrived, started, state, row in rows
    )


def keep_track(
    track: Track,
    store: str | Path,
    options: ReadOptions,
    *,
    machine: str | None = None,
    point: str | None = None,
    sensor: str | None = None,
    acknowledge: str | None = None,
) -> Track:
    """Append a track to a store and return it, with the unacknowledged alarm there.

    Parameters
    ----------
    options : with which the recordings were read
    machine, point, sensor : as in `WatchSettings`
    acknowledge : as in `TrackSettings`

    Raises
    ------
    BadInput
        if recordings of the sensor were read with other settings before.
    """
    paths = {
        file: str(Path(file).resolve())
        for recording in track.recordings
        for file in recording.files
    }
    track = replace(
        track, recordings=tuple(recording.with_files(paths) for recording in track.recordings)
    )
    folder = Path(track.recordings[0].file).parent
    sensors = open_sensors(store, folder, (machine, point, sensor), track.target, options)
    with closing(sensors.store):
        keys = {file: version_of(Path(file)) for file in paths.values()}
        for recording in track.recordings:
            for reading in recording.readings.values():
                if not sensors.holds(keys[reading.file], reading):
                    sensors.add(keys[reading.file], reading)
        if acknowledge is not None:
            sensors.acknowledge(
                Path(track.recordings[-1].file if acknowledge == LAST else acknowledge).name
            )
        return sensors.record_judgement(track, keys, len(keys), "", None)


def acknowledge_in(store: str | Path, named: str) -> None:
    """Acknowledge the alarm of a sensor and of those judged with it, up to the last recording.

    Parameters
    ----------
    named : the sensor, as machine/point/sensor

    Raises
    ------
    BadInput
        if the sensor does not exist, or has no judgement.
    """
    with closing(Store(store, make=False, repair=False)) as opened:
        addresses = {"/".join(address): address for _, address in opened.sensors()}
        if named not in addresses:
            raise BadInput(
                f"the store has no sensor {named!r}; it has {', '.join(addresses) or 'none'}"
            )
        sensors = sensors_judged_with(opened, addresses[named])
        judgement = sensors.last_judgement()
        if judgement is None:
            raise BadInput(f"{named} has not been judged yet; there is nothing to acknowledge")
        sensors.acknowledge(Path(judgement["recordings"][-1]["file"]).name)
