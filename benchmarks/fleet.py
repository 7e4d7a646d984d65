"""Cost of a fleet: sensors with a month of hourly recordings in one store and one process.

The store is filled with readings prepared in advance, as if each had been judged on arrival; then
a tree of folders is watched, with new recordings at every sensor. `python -m benchmarks.fleet`
prints memory, size of the store and processor time; `--fast` uses a tenth of the sensors.
"""

import argparse
import json
import resource
from collections.abc import Iterator
from contextlib import closing
from dataclasses import replace
from datetime import datetime, timedelta
from pathlib import Path
from tempfile import TemporaryDirectory
from time import process_time

import numpy as np

from asperity.monitoring import TrackSettings, WatchSettings, track_recordings, watch_tree
from asperity.monitoring.ordering import order_recordings
from asperity.monitoring.reading import Reading, read_channels
from asperity.monitoring.store.database import STORE, FileVersion, Store
from asperity.monitoring.store.retention import thin_store
from asperity.monitoring.store.sensor_lookup import open_sensors
from asperity.monitoring.store.sensors import Sensors
from asperity.monitoring.target import search_target
from asperity.recording import ReadOptions
from benchmarks.monitor import BAND, RATE, SPACING, channel_signals

SENSORS, DAYS, PER_DAY = 200, 30, 24
PREPARED = 40  # different readings
START = datetime(2025, 3, 1)
SETTINGS = TrackSettings(band_hz=BAND)


def write_recording(path: Path, rng: np.random.Generator, hour: int) -> None:
    """Write one second of a machine, with its start."""
    path.parent.mkdir(parents=True, exist_ok=True)
    np.savez(path, **channel_signals(rng, 1), fs=RATE, unit="m/s^2")
    started = (START + timedelta(hours=hour)).isoformat()
    path.with_name(f"{path.name}.toml").write_text(f'started = "{started}"\n')


def prepared_readings(folder: Path) -> tuple[list[Reading], str]:
    """Return readings of different recordings, and a judged row."""
    rng, target = np.random.default_rng(1), search_target(None, BAND)
    readings = []
    for number in range(PREPARED):
        path = folder / f"p-{number}.npz"
        write_recording(path, rng, number)
        readings += [
            reading for _, reading in read_channels([path], ReadOptions(), target, SPACING)
        ]
    row = track_recordings([folder], SETTINGS).scalars()["recordings"][-1]
    return readings, json.dumps(row | {"state": "none"})


def open_place(store: Store, folder: Path) -> Sensors:
    """Return the sensors of a folder of the tree."""
    names = (folder.parent.name, folder.name, None)
    return open_sensors(store, folder, names, search_target(None, BAND), ReadOptions())


def fill_place(sensors: Sensors, folder: Path, readings: list[Reading], row: str) -> None:
    """Add the recordings of a month to a sensor, thinned once a day."""
    sensors.set_spacing(SPACING)
    for hour in range(DAYS * PER_DAY):
        key = FileVersion(str(folder / f"r-{hour:05}.npz"), "1 1")
        started = (START + timedelta(hours=hour)).isoformat()
        reading = replace(readings[hour % PREPARED], file=key.file, started=started)
        sensors.add(key, reading)
        sensors.by_name["sensor"].set_state(key, "none")
        if hour % PER_DAY == PER_DAY - 1:
            with sensors.store.transaction() as run:
                run(
                    "UPDATE recording SET state = 'none', row = ? "
                    "WHERE sensor = ? AND state IS NULL",
                    (row, sensors.by_name["sensor"].number),
                )
            order = order_recordings(sensors.series(), None, sensors)
            thin_store(sensors, order.instants, (), None)


def memory_mb() -> float:
    """Return the largest memory of this process so far [MB]."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0


def watched(root: Path, out: Path, folders: list[Path]) -> Iterator[tuple[str, float, float]]:
    """Yield round, CPU time [s] and memory [MB] of a watch with new recordings at every sensor."""
    rng = np.random.default_rng(3)
    watching = WatchSettings(poll_interval_s=0.0, settle_time_s=0.0)
    with closing(watch_tree(root, out, SETTINGS, watching)) as updates:
        for number, name in enumerate(("first", "second", "third")):
            for folder in folders:
                write_recording(folder / f"s-{number}.npz", rng, DAYS * PER_DAY + number)
            began = process_time()
            for _ in folders:
                update = next(updates)
                if len(update.new) != 1 or update.failed:
                    raise RuntimeError(f"{update.place}: {len(update.new)} new, {update.failed}")
            yield name, process_time() - began, memory_mb()


def lines(*, fast: bool = False, sensors: int = SENSORS) -> Iterator[str]:
    """Yield the lines of a Markdown table."""
    count = sensors // 10 if fast else sensors
    total = count * DAYS * PER_DAY
    yield f"## Fleet of {count} sensors"
    yield ""
    yield "| quantity | value |"
    yield "|---|---|"
    with TemporaryDirectory() as name:
        root, out = Path(name).resolve() / "plant", Path(name).resolve() / "out"
        root.mkdir()
        out.mkdir()
        readings, row = prepared_readings(Path(name) / "prepared")
        folders = [root / f"m{number // 2:03}" / "AB"[number % 2] for number in range(count)]
        began = process_time()
        with closing(Store(out / STORE)) as store:
            for folder in folders:
                fill_place(open_place(store, folder), folder, readings, row)
        filled = process_time() - began
        size = (out / STORE).stat().st_size
        yield f"| recordings of a month, one an hour | {total} |"
        yield f"| store | {size / 2**20:.0f} MB, {size / total / 1024:.2f} kB per recording |"
        yield f"| CPU time to store and thin, per recording | {1e3 * filled / total:.2f} ms |"
        for round_name, cpu_s, memory in watched(root, out, folders):
            share = cpu_s / 3600.0
            yield (
                f"| {round_name} recording of each sensor read, evaluated and stored | "
                f"{1e3 * cpu_s / count:.0f} ms of CPU time each; "
                f"{100.0 * share:.1f} % of a core at one an hour |"
            )
            yield f"| memory of the process after it | {memory:.0f} MB |"


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--fast", action="store_true")
    parser.add_argument("--sensors", type=int, default=SENSORS)
    arguments = parser.parse_args()
    for line in lines(fast=arguments.fast, sensors=arguments.sensors):
        print(line, flush=True)
