"""What a store holds, for who looks after many machines: a line a sensor, and the recordings as a table to export."""

import json
from collections.abc import Mapping
from contextlib import closing
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from asperity.core.errors import BadInput
from asperity.core.files import atomic_write, write_csv
from asperity.monitoring.alarm import LAST
from asperity.monitoring.sensor import ACKNOWLEDGED
from asperity.monitoring.sensors import opened, those_of
from asperity.monitoring.store import Place, Store
from asperity.monitoring.track_result import Track, flat
from asperity.monitoring.watch import version_of
from asperity.recording import ReadOptions

if TYPE_CHECKING:
    import pandas

GRAVEST = ("alarm", "blind", "cannot-tell", "alert", "none")
IN_WORDS = {
    "blind": "blind",
    "cannot-tell": "cannot tell",
    "alert": "alert",
    "none": "none",
    "alarm": "ALARM",
}
ENDINGS = (".csv", ".parquet")


@dataclass(frozen=True, slots=True, kw_only=True)
class StoreOverview:
    """Where every sensor of a store stands; `rows` the gravest first, as `asperity store --json` has them."""

    path: Path
    rows: tuple[dict[str, Any], ...]

    @property
    def state(self) -> str:
        """The gravest state of all."""
        return min((row["state"] for row in self.rows), key=GRAVEST.index, default="cannot-tell")

    def verdict(self) -> str:
        """One sentence: how many sensors, how many of them need somebody."""
        if not self.rows:
            return f"{self.path.name} holds no recordings yet."
        machines = len({row["machine"] for row in self.rows})
        held = sum(row["recordings"] for row in self.rows)
        several = f"{len(self.rows)} sensor{'s' * (len(self.rows) > 1)} on {machines} machine{'s' * (machines > 1)}"
        counts = {state: sum(row["state"] == state for row in self.rows) for state in GRAVEST[:-1]}
        spoken = ", ".join(f"{IN_WORDS[state]} {count}" for state, count in counts.items() if count)
        return f"{several}, {held} recordings: {spoken or 'no alarm'}."

    def scalars(self) -> dict[str, Any]:
        """Everything that `asperity store --json` prints."""
        return {"verdict": self.verdict(), "state": self.state, "sensors": list(self.rows)}

    def export(self, path: str | Path) -> Path:
        """Write every recording of the store, a row each with machine, point and sensor, as .csv or .parquet.

        Raises
        ------
        BadInput
            for another ending, or a path that cannot be written to.
        """
        path = Path(path)
        if path.suffix.lower() not in ENDINGS:
            raise BadInput(
                f"a store is exported as .csv or .parquet, got {path.name}; change its ending"
            )
        with closing(Store(self.path, make=False)) as store:
            table = _table(store)
        if path.suffix.lower() == ".csv":
            write_csv(path, table)
        else:
            with atomic_write(path) as part:
                table.to_parquet(part, index=False)
        return path


def store_overview(path: str | Path) -> StoreOverview:
    """Look into a store.

    Raises
    ------
    UnreadableFile
        for a file that is none.
    """
    with closing(Store(path, make=False)) as store:
        rows = [_standing(store, number, place) for number, place in store.places()]
    rows.sort(key=lambda row: GRAVEST.index(row["state"]))
    return StoreOverview(path=Path(path), rows=tuple(rows))


def _standing(store: Store, number: int, place: Place) -> dict[str, Any]:
    """A sensor's line."""
    ((held, last),) = store.read(
        "SELECT count(*), max(heard) FROM recording WHERE sensor = ?", number
    )
    judged = store.read(
        "SELECT state, since, reason, time, verdict FROM judgement WHERE sensor = ? AND state != ? "
        "ORDER BY id DESC LIMIT 1",
        *(number, ACKNOWLEDGED),
    )
    fallen = ("cannot-tell", None, "nothing judged yet", None, "Nothing judged yet.")
    state, since, reason, judged_at, verdict = judged[0] if judged else fallen
    told = {
        "recordings": held,
        "last_heard": last,
        "state": state,
        "since": since,
        "reason": reason,
    }
    return place._asdict() | told | {"judged": judged_at, "verdict": verdict}


def _table(store: Store) -> "pandas.DataFrame":
    import pandas

    rows = store.read(
        "SELECT sensor, file, heard, started, state, row FROM recording ORDER BY sensor, id"
    )
    places: Mapping[int, Place] = dict(store.places())
    return pandas.DataFrame(
        {
            **places[sensor]._asdict(),
            "heard": heard,
            **(
                {"file": file, "started": started or None, "state": state}
                if row is None
                else flat(json.loads(row))
            ),
        }
        for sensor, file, heard, started, state, row in rows
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
    """Append a track's recordings and its judgement to a store; the track with the alarm that stands there.

    Parameters
    ----------
    options : by which the recordings were read
    machine, point, sensor, acknowledge : as `watch_folder` takes them

    Raises
    ------
    BadInput
        for a sensor whose recordings were read otherwise before.
    """
    at = {file: str(Path(file).resolve()) for one in track.recordings for file in one.files}
    track = replace(track, recordings=tuple(one.moved(at) for one in track.recordings))
    folder = Path(track.recordings[0].file).parent
    entered = opened(store, folder, (machine, point, sensor), track.target, options)
    with closing(entered.store):
        keys = {file: version_of(Path(file)) for file in at.values()}
        for recording in track.recordings:
            for reading in recording.readings.values():
                if not entered.holds(keys[reading.file], reading):
                    entered.keep(keys[reading.file], reading)
        if acknowledge is not None:
            entered.acknowledge(
                Path(track.recordings[-1].file if acknowledge == LAST else acknowledge).name
            )
        return entered.judged(track, keys, len(keys), "", None)


def acknowledge_in(store: str | Path, named: str) -> None:
    """Somebody has looked at a sensor, and at those that it is judged with, up to the last recording.

    Parameters
    ----------
    named : the sensor, as machine/point/sensor

    Raises
    ------
    BadInput
        for a sensor that is not there, or has no recordings.
    """
    with closing(Store(store, make=False)) as found:
        places = {"/".join(place): place for _, place in found.places()}
        if named not in places:
            raise BadInput(
                f"the store has no sensor {named!r}; it has {', '.join(places) or 'none'}"
            )
        entered = those_of(found, places[named])
        told = entered.said()
        if told is None:
            raise BadInput(
                f"nothing has been judged of {named} yet; there is nothing to acknowledge"
            )
        entered.acknowledge(Path(told["recordings"][-1]["file"]).name)
