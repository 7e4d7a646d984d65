"""Memory of a sensor for its next judgement: shared spectra, and distribution of the levels."""

import json

from asperity.monitoring.series_state import SeriesMemory, StoredLevels, pack_shared, unpack_shared
from asperity.monitoring.store.database import Store
from asperity.monitoring.store.schema import Run
from asperity.monitoring.track_result import Track


def read_memory(store: Store, sensor: int) -> SeriesMemory:
    """Return what the series of a sensor has in common; empty at first."""
    stored = store.read(
        "SELECT body, since FROM learned JOIN sensor ON sensor.id = learned.sensor "
        "WHERE sensor = ?",
        sensor,
    )
    return unpack_shared(stored[0][0], stored[0][1] or 0) if stored else SeriesMemory()


def write_memory(run: Run, sensor: int, memory: SeriesMemory | None) -> None:
    """Store what the series has in common, where it is new."""
    if memory is None or memory.shared is None:
        return
    run("UPDATE sensor SET since = ? WHERE id = ?", (memory.since, sensor))
    if memory.since == 0:
        run("DELETE FROM learned WHERE sensor = ?", (sensor,))
        if not memory.moved:  # otherwise it covers only a part, and all is separated again
            run(
                "INSERT INTO learned (sensor, body) VALUES (?, ?)",
                (sensor, pack_shared(memory.shared)),
            )


def read_levels(store: Store, sensor: int) -> StoredLevels | None:
    """Return the memory of the levels; None before the first judgement."""
    stored = store.read("SELECT body FROM levels WHERE sensor = ?", sensor)
    return StoredLevels(**json.loads(stored[0][0])) if stored else None


def write_levels(run: Run, sensor: int, track: Track) -> None:
    """Store the memory of the levels for the next judgement."""
    judged, monitors, _ = track.alarm.level_memory
    run("DELETE FROM levels WHERE sensor = ?", (sensor,))
    if judged and monitors:
        stored = StoredLevels(track.recordings[judged - 1].file, monitors)
        run(
            "INSERT INTO levels (sensor, body) VALUES (?, ?)",
            (sensor, json.dumps(stored._asdict())),
        )
