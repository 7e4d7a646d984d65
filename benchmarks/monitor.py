"""What a monitor costs: a store of 10 000 recordings and one more, and a watch over files that it knows.

Processor time, least of several. `python -m benchmarks.monitor` runs this part alone; `--fast` with a tenth of the
recordings.
"""

import argparse
import resource
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory
from time import process_time

import numpy as np
import scipy

from asperity.recording import ReadOptions
from asperity.tracking import watch as watching
from asperity.tracking.reading import read_spectrum
from asperity.tracking.sensor import Sensor
from asperity.tracking.sensors import settings_of
from asperity.tracking.store import Place, Store, Version
from asperity.tracking.target import search_target
from asperity.tracking.watch import watch_folder

RATE, SAMPLES, BAND = 12e3, 12_000, (2000.0, 4000.0)
SPACING, MORE = 5.0, 12
LINES = ((3300.0, 0.004, 0.5), (2300.0, 0.01, 0.7))  # of the machine: frequency, damping, level


def recorded(rng: np.random.Generator) -> np.ndarray:
    """A second of a machine with two modes and a contact line that scatters by 1 %."""
    values = 0.3 * rng.standard_normal(SAMPLES)
    for frequency, damping, level in ((2800.0 * (1.0 + 0.01 * rng.standard_normal()), 0.02, 1.0), *LINES):
        turn, decay = 2.0 * np.pi * frequency / RATE, np.exp(-damping * 2.0 * np.pi * frequency / RATE)
        line = scipy.signal.lfilter([1.0], [1.0, -2.0 * decay * np.cos(turn), decay**2], rng.standard_normal(SAMPLES))
        values += level * line / line.std()
    return values


def write(path: Path, rng: np.random.Generator) -> None:
    np.savez(path, acc=recorded(rng).astype(np.float32), fs=RATE, unit="m/s^2")


def filled(folder: Path, store: Path, many: int) -> None:
    """A folder and a store of `many` recordings, of which 200 differ."""
    rng, target, options = np.random.default_rng(1), search_target(None, BAND), ReadOptions()
    sensor = Sensor(Store(store), Place("machine", folder.name, "sensor"), settings_of(target, options))
    sensor.settle_spacing(SPACING)
    write(folder / "first.npz", rng)
    content = (folder / "first.npz").read_bytes()
    (folder / "first.npz").unlink()
    readings = []
    for _ in range(200):
        write(folder.parent / "one.npz", rng)
        readings.append(read_spectrum(folder.parent / "one.npz", options, target, SPACING))
    for number in range(many):
        path = folder / f"r-{number:05}.npz"
        path.write_bytes(content[:1])
        status = path.stat()
        key = Version(str(path), f"{status.st_size} {status.st_mtime_ns}")
        sensor.keep(key, replace(readings[number % 200], file=str(path)))
    with sensor.store.transaction() as run:
        run("UPDATE recording SET state = 'none'")  # as if each had been judged when it came


def one_more(folder: Path, out: Path, many: int) -> tuple[list[float], list[float]]:
    """Processor time [s] of judging one more recording, and of all that a look at the folder takes."""
    rng = np.random.default_rng(2)
    judged: list[float] = []
    plain = watching._Memory.judged

    def timed(*arguments: object, **named: object) -> object:
        began = process_time()
        track = plain(*arguments, **named)
        judged.append(process_time() - began)
        return track

    watching._Memory.judged = timed  # type: ignore[assignment,method-assign]
    looks = watch_folder(folder, out, band_hz=BAND, every_s=0.05, settle_s=0.0)
    next(looks)
    judged.clear()
    whole = []
    for number in range(MORE):
        write(folder / f"r-{many + number:05}.npz", rng)
        began = process_time()
        next(looks)
        whole.append(process_time() - began)
    watching._Memory.judged = plain  # type: ignore[method-assign]
    return judged, whole


def known(folder: Path, out: Path) -> float:
    """Processor time [s] of `asperity watch --once` where nothing is new, its imports too."""
    command = [sys.executable, "-m", "asperity", "watch", str(folder), "--out", str(out), "--once", "--quiet"]
    command += ["--settle", "0", "--band", *(f"{end:g}" for end in BAND)]
    subprocess.run(command, check=False, capture_output=True)
    took = []
    for _ in range(3):
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        subprocess.run(command, check=False, capture_output=True)
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        took.append(after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime)
    return min(took)


def lines(*, fast: bool = False) -> Iterator[str]:
    """Lines of a markdown table."""
    many = 1000 if fast else 10_000
    yield "## A monitor's store"
    yield ""
    yield "| what | processor time |"
    yield "|---|---|"
    with TemporaryDirectory() as name:
        folder, out = Path(name) / "in", Path(name) / "out"
        folder.mkdir()
        out.mkdir()
        filled(folder, out / "asperity.db", many)
        judged, whole = one_more(folder, out, many)
        size = (out / "asperity.db").stat().st_size / 2**20
        yield f"| a store of {many} recordings: size | {size:.0f} MB |"
        yield f"| one more judged, median of {MORE} | {1e3 * np.median(judged):.0f} ms |"
        yield f"| one more looked for, read, judged and kept, median | {1e3 * np.median(whole):.0f} ms |"
        yield f"| the same, longest | {1e3 * np.max(whole):.0f} ms |"
    with TemporaryDirectory() as name:
        folder, out = Path(name) / "in", Path(name) / "out"
        folder.mkdir()
        out.mkdir()
        filled(folder, out / "asperity.db", 1001)
        yield f"| `watch --once` over 1001 known files | {known(folder, out):.2f} s |"


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--fast", action="store_true")
    for line in lines(fast=parser.parse_args().fast):
        print(line, flush=True)
