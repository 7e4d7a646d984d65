"""Cost of monitoring: a store of 10 000 recordings and one more, and a watch over known files.

CPU time, least of several. `python -m benchmarks.monitor` runs this part alone; `--fast` uses
a tenth of the recordings.
"""

import argparse
import resource
import subprocess
import sys
from collections.abc import Iterator
from contextlib import closing
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory
from time import process_time

import numpy as np
import scipy

from asperity.monitoring import TrackSettings, Update, WatchSettings, watch_folder
from asperity.monitoring.reading import read_channels
from asperity.monitoring.store.database import STORE
from asperity.monitoring.store.sensor_lookup import open_sensors
from asperity.monitoring.target import search_target
from asperity.monitoring.watching.watch_state import WatchState, version_of
from asperity.recording import ReadOptions

RATE, SAMPLES, BAND = 12e3, 12_000, (2000.0, 4000.0)
SPACING, MORE = 5.0, 12
# relative shift between the structural modes of adjacent sensors
ELSEWHERE = 0.05
LINES = ((3300.0, 0.004, 0.5), (2300.0, 0.01, 0.7))  # of the machine: frequency, damping, level


def channel_signals(rng: np.random.Generator, sensors: int) -> dict[str, np.ndarray]:
    """Return one second of a machine by channel: two modes and a contact line that scatters by 1
    %.
    """
    line_hz = 2800.0 * (1.0 + 0.01 * rng.standard_normal())
    channels = {}
    for sensor in range(sensors):
        values = 0.3 * rng.standard_normal(SAMPLES)
        modes = [
            (frequency * (1.0 + ELSEWHERE * sensor), damping, level)
            for frequency, damping, level in LINES
        ]
        for frequency, damping, level in ((line_hz, 0.02, 1.0), *modes):
            turn, decay = (
                2.0 * np.pi * frequency / RATE,
                np.exp(-damping * 2.0 * np.pi * frequency / RATE),
            )
            fresh = rng.standard_normal(SAMPLES)
            line = scipy.signal.lfilter([1.0], [1.0, -2.0 * decay * np.cos(turn), decay**2], fresh)
            values += level * line / line.std()
        channels[f"acc{sensor + 1}"] = values.astype(np.float32)
    return channels


def write(path: Path, rng: np.random.Generator, sensors: int) -> None:
    np.savez(path, **channel_signals(rng, sensors), fs=RATE, unit="m/s^2")


def channel(sensors: int) -> str:
    """Return all channels as an argument of `watch`."""
    return ",".join(f"acc{sensor + 1}" for sensor in range(sensors))


def filled(folder: Path, store: Path, many: int, sensors: int) -> None:
    """Fill a folder and a store with `many` recordings, 200 of them different."""
    rng, target, options = (
        np.random.default_rng(1),
        search_target(None, BAND),
        ReadOptions(channel=channel(sensors)),
    )
    sensors_in_store = open_sensors(store, folder.resolve(), (None, None, None), target, options)
    sensors_in_store.set_spacing(SPACING)
    prototype = folder.parent / "one.npz"
    readings = []
    for _ in range(200):
        write(prototype, rng, sensors)
        readings.append(
            [reading for _, reading in read_channels([prototype], options, target, SPACING)]
        )
    for number in range(many):
        path = folder / f"r-{number:05}.npz"
        path.write_bytes(b"P")
        key = version_of(path.resolve())
        for reading in readings[number % 200]:
            sensors_in_store.add(key, replace(reading, file=key.file))
    with closing(sensors_in_store.store), sensors_in_store.store.transaction() as run:
        run("UPDATE recording SET state = 'none'")  # as if each had been judged on arrival


def one_more(folder: Path, out: Path, many: int, sensors: int) -> tuple[list[float], list[float]]:
    """Return CPU times [s] of judging one more recording, and of the whole scan of the
    folder.
    """
    rng = np.random.default_rng(2)
    judged: list[float] = []
    plain = WatchState.judge

    def timed(*arguments: object, **named: object) -> object:
        began = process_time()
        track = plain(*arguments, **named)
        judged.append(process_time() - began)
        return track

    WatchState.judge = timed  # type: ignore[assignment,method-assign]
    looks = watch_folder(
        folder,
        out,
        TrackSettings(band_hz=BAND, channel=channel(sensors)),
        WatchSettings(poll_interval_s=0.05, settle_time_s=0.0),
    )
    _require_known(next(looks))
    judged.clear()
    whole = []
    for number in range(MORE):
        write(folder / f"r-{many + number:05}.npz", rng, sensors)
        began = process_time()
        next(looks)
        whole.append(process_time() - began)
    WatchState.judge = plain  # type: ignore[method-assign]
    return judged, whole


def _require_known(update: Update) -> None:
    """Raise unless the watch knows the filled store and finds its resonances."""
    track = update.track
    if (
        update.new
        or track is None
        or not all(recording.resonance.found for recording in track.recordings)
    ):
        raise RuntimeError(
            f"the watch read {len(update.new)} recordings that are already in its store, or found"
            " no line"
        )


def known(folder: Path, out: Path) -> float:
    """Return CPU time [s] of `asperity watch --once` without new files, with imports."""
    command = [
        sys.executable,
        "-m",
        "asperity",
        "watch",
        str(folder),
        "--out",
        str(out),
        "--once",
        "--quiet",
    ]
    command += ["--channel", channel(1), "--settle", "0", "--band", *(f"{end:g}" for end in BAND)]
    subprocess.run(command, check=False, capture_output=True)
    took = []
    for _ in range(3):
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        subprocess.run(command, check=False, capture_output=True)
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        took.append(after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime)
    return min(took)


def lines(*, fast: bool = False) -> Iterator[str]:
    """Yield the lines of a Markdown table."""
    many = 1000 if fast else 10_000
    yield "## Store of a monitor"
    yield ""
    yield "| operation | CPU time |"
    yield "|---|---|"
    for sensors in (1, 2):
        with TemporaryDirectory() as name:
            folder, out = _folders(name)
            filled(folder, out / STORE, many, sensors)
            judged, whole = one_more(folder, out, many, sensors)
            size = (out / STORE).stat().st_size / 2**20
            of = "a sensor" if sensors == 1 else f"{sensors} sensors"
            yield f"| a store of {many} recordings of {of}: size | {size:.0f} MB |"
            yield (
                f"| {of}: one more evaluated, median of {MORE} | {1e3 * np.median(judged):.0f} ms |"
            )
            yield (
                f"| {of}: one more found, read, evaluated and stored, median |"
                f" {1e3 * np.median(whole):.0f} ms |"
            )
            yield f"| {of}: the same, longest | {1e3 * np.max(whole):.0f} ms |"
    with TemporaryDirectory() as name:
        folder, out = _folders(name)
        filled(folder, out / STORE, 1001, 1)
        yield f"| `watch --once` over 1001 known files | {known(folder, out):.2f} s |"


def _folders(name: str) -> tuple[Path, Path]:
    folder, out = Path(name) / "in", Path(name) / "out"
    folder.mkdir()
    out.mkdir()
    return folder, out


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--fast", action="store_true")
    for line in lines(fast=parser.parse_args().fast):
        print(line, flush=True)
