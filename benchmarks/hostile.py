"""`asperity watch` on a disordered logger folder: one watch runs undisturbed, one is killed ten
times, its disk is full, permissions are lost, its clock jumps, and other programs lock its store.

Files arrive late, in parts, twice, under another name later, from a clock that is ahead, and from
other programs; some are huge. At the end every file must have an outcome on each sensor, and both
stores must be equal. `python -m
benchmarks.hostile --minutes 60 [--kills 10] [--sensors 2]` runs this part alone. It needs little
CPU time but the full elapsed time.
"""

import argparse
import os
import shutil
import sqlite3
import subprocess
import sys
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from contextlib import closing, suppress
from pathlib import Path
from tempfile import TemporaryDirectory
from time import monotonic, sleep, time
from typing import TypeAlias

import numpy as np

from asperity.monitoring.files import may_be_recording
from benchmarks.disturbances import DisturbedWatch, can_mount, schedule

RATE, SECONDS = 20e3, 0.1
AHEAD_S = 30 * 86_400.0
PARTS_S = 3.0  # between the two halves of a file in progress
MAX_SPACING_S = 5.0  # mean time between arrivals
HUGE_S = 600.0  # of a huge recording
HUGE_AT = (0.25, 0.5, 0.75)  # shares of the time at which one arrives
DISTURBED_SHARE = 0.01  # of the time, during which a disturbance lasts
INSTANT = ("kill", "jump_clock")  # disturbances that may occur during another one
NAMES = {
    "kill": "kills",
    "jump_clock": "jumps of the clock by 400 days",
    "lock_store": "locks of the store",
    "fill_disk": "full disks",
    "forbid_folder": "times without permission to read the folder",
    "forbid_results": "times without permission to write the results",
}
KINDS = ("plain",) * 6 + (
    "late",
    "in parts",
    "twice",
    "ahead",
    "cut",
    "foreign",
    "half copied",
    "empty",
    "again",
    "renamed",
)
MOVED = "-moved"  # end of the stem of a renamed file
Plan: TypeAlias = list[tuple[float, str]]


def recorded(number: int, sensor: int, seconds: float) -> np.ndarray:
    return np.random.default_rng([number, sensor]).standard_normal(round(seconds * RATE))


def channels(sensors: int) -> list[str]:
    """Return channel names, which are the same in each file."""
    return [f"acc{sensor}" for sensor in range(1, sensors + 1)]


def write(path: Path, number: int, sensors: int, seconds: float = SECONDS) -> None:
    signals = {
        name: recorded(number, sensor, seconds) for sensor, name in enumerate(channels(sensors))
    }
    with path.open("wb") as file:
        np.savez(file, **signals, fs=RATE, unit="m/s^2")


def arrive(folder: Path, number: int, kind: str, sensors: int) -> None:
    """Let one file arrive; files written in parts take `PARTS_S` twice."""
    path = folder / f"r-{number:04}.npz"
    if kind == "late":
        path = folder / f"r-{max(number - 7, 0):04}-late.npz"
    if kind == "in parts":
        write(folder.parent / "whole", number, sensors)
        content = (folder.parent / "whole").read_bytes()
        path.write_bytes(content[:900])
        sleep(PARTS_S)
        path.write_bytes(content)
        return
    if kind == "cut":
        write(folder.parent / "whole", number, sensors)
        path.write_bytes((folder.parent / "whole").read_bytes()[:700])
    elif kind == "foreign":
        (folder / f"n-{number:04}.txt").write_text("Nothing of note.\n")
        (folder / f"p-{number:04}.pdf").write_bytes(b"%PDF-1.4 nothing")
        Path(os.fsdecode(os.fsencode(folder) + b"/\xff-%04d.npz" % number)).touch()
    elif kind == "half copied":
        (folder / f"h-{number:04}.npz.filepart").write_bytes(b"PK")
    elif kind == "empty":
        path.touch()
    else:
        write(path, number, sensors, HUGE_S if kind == "huge" else SECONDS)
    if kind == "renamed":
        sleep(PARTS_S)
        path.rename(path.with_stem(path.stem + MOVED))
    if kind == "twice":
        shutil.copy(path, path.with_stem(f"{path.stem}-copy"))
    if kind == "ahead":
        os.utime(path, (time() + AHEAD_S,) * 2)
    if kind == "again":
        sleep(PARTS_S)
        write(path, number + 5000, sensors)


def watch(
    folder: Path, out: Path, *words: str, sensors: int, every: float, settle: float
) -> list[str]:
    words += ("--channel", ",".join(channels(sensors)))
    own = (
        "--out",
        str(out),
        "--quiet",
        "--machine",
        "Fan 1",
        "--point",
        "DE",
        "--band",
        "2000",
        "4000",
    )
    pace = ("--every", f"{every:g}", "--settle", f"{settle:g}")
    return [sys.executable, "-m", "asperity", "watch", str(folder), *own, *pace, *words]


def latest(store: Path) -> dict[str, list[tuple[object, ...]]]:
    """Return the readings and states of each file's last version, one row per sensor.

    Rows that a watch held in memory are written sensor by sensor, not in the order of arrival.
    """
    latest_rows: dict[str, dict[str, tuple[object, ...]]] = {}
    with closing(sqlite3.connect(store)) as connection:
        rows = connection.execute(
            "SELECT file, sensor.name, version, refused, reading, state FROM recording "
            "JOIN sensor ON sensor.id = recording.sensor ORDER BY recording.id"
        ).fetchall()
    last_versions = {Path(row[0]).name: row[2] for row in rows}
    for file, sensor, version, *outcome in rows:
        latest_rows.setdefault(Path(file).name, {})[sensor] = (version, sensor, *outcome)
    return {
        file: [row[1:] for _, row in sorted(of_file.items()) if row[0] == last_versions[file]]
        for file, of_file in latest_rows.items()
    }


def accounted(folder: Path, store: Path, sensors: int) -> tuple[Counter[str], list[str]]:
    """Count the outcomes of all files, and list files without an outcome on every sensor."""
    held, counts, unreported = latest(store), Counter[str](), []
    for path in folder.iterdir():
        rows = held.get(path.name, [])
        if len(rows) == sensors:
            refused = any(row[1] for row in rows)
            counts["refused" if refused else "judged"] += 1
        elif not path.name.isprintable() or b"\xff" in os.fsencode(path.name):
            counts["skipped, name reported"] += 1
        elif not may_be_recording(path):
            counts["not a recording by name"] += 1
        elif path.stat().st_size == 0:
            counts["empty, pending"] += 1
        else:
            unreported.append(path.name)
    return counts, unreported


def is_renamed(folder: Path, file: str) -> bool:
    """Return whether a file was renamed, or is the renamed one.

    Which of the names a store has depends on the moment at which its watch read the file.
    """
    stem = Path(file).stem.removesuffix(MOVED)
    return any(folder.glob(f"{stem}{MOVED}.*"))


def memory_text(values_mb: Sequence[float]) -> str:
    """Return the median memory of the second and of the last quarter of a run."""
    quarters = np.array_split(np.array(values_mb), 4)
    second, last = (np.median(quarter) for quarter in (quarters[1], quarters[-1]))
    return f"{second:.0f}, {last:.0f} MB"


def arrivals(
    folder: Path, minutes: float, sensors: int, watches: Sequence[DisturbedWatch], plan: Plan
) -> Iterator[int]:
    """Let files arrive for some minutes, disturb the last watch by a plan; yield their number."""
    rng, began = np.random.default_rng(1), monotonic()
    end, number = began + 60.0 * minutes, 0
    huge = [began + share * 60.0 * minutes for share in HUGE_AT]
    ends: list[tuple[float, Callable[[], None]]] = []
    disturbed = watches[-1]
    while monotonic() < end or plan:
        kind = "huge" if huge and monotonic() > huge[0] else str(rng.choice(KINDS))
        huge = huge[1:] if kind == "huge" else huge
        with suppress(PermissionError):  # while the folder is forbidden
            arrive(folder, number, kind, sensors)
            number += 1
        while ends and monotonic() > ends[0][0]:
            ends.pop(0)[1]()
        while plan and monotonic() > plan[-1][0] and (not ends or plan[-1][1] in INSTANT):
            ending = disturbed.disturb(plan.pop()[1])
            ends += [] if ending is None else [ending]
        for watched in watches:
            watched.check()
        sleep(float(rng.uniform(0.2, 1.8)) * min(60.0 * minutes / 120.0, MAX_SPACING_S))
        if number % 10 == 0:
            yield number
    for _, ending in ends:
        ending()
    yield number


def run(
    minutes: float,
    kills: int,
    sensors: int = 1,
    every: float = 2.0,
    settle: float = 5.0,
    say: Callable[[str], None] = print,
) -> Iterator[str]:
    """Yield the lines of a table."""
    disk = can_mount()
    with TemporaryDirectory() as name:
        folder = Path(name) / "in"
        folder.mkdir()
        began = monotonic()
        outs = [Path(name) / "alone", Path(name) / "disturbed"]
        pace = {"every": every, "settle": settle}
        watches = [
            DisturbedWatch(
                watch(folder, out, sensors=sensors, **pace)[3:],
                folder,
                out,
                DISTURBED_SHARE * 60.0 * minutes,
                disk=disk and out == outs[-1],
            )
            for out in outs
        ]
        plan = schedule(kills, began + 1.0, began + 60.0 * minutes, disk=disk, seed=1)
        try:
            for number in arrivals(folder, minutes, sensors, watches, plan):
                say(f"{number} arrivals after {monotonic() - began:.0f} s")
            sleep(2.0 * settle)
        finally:
            for watched in watches:
                watched.close()
        quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
        for out in outs:
            subprocess.run(
                watch(folder, out, "--once", sensors=sensors, **pace), check=False, **quiet
            )
        stores = [out / "asperity.db" for out in outs]
        counts, unreported = accounted(folder, stores[1], sensors)
        first, second = (latest(store) for store in stores)
        differ = sorted(
            file for file in first.keys() | second.keys() if first.get(file) != second.get(file)
        )
        renamed = [file for file in differ if is_renamed(folder, file)]
        differ = [file for file in differ if file not in renamed]
        yield f"Sample: {minutes:.0f} minutes."
        yield "| disordered logger folder | |"
        yield "|---|---|"
        took = (monotonic() - began) / 60.0
        yield f"| minutes, arrivals, sensors | {took:.1f}, {number}, {sensors} |"
        for kind, many in watches[1].counts.items():
            yield f"| {NAMES[kind]} | {many} |"
        yield f"| ends of the watches without a kill | {watches[0].ended}, {watches[1].ended} |"
        for text, watched in zip(("undisturbed", "disturbed"), watches, strict=True):
            yield (
                f"| memory of the {text} watch, second and last quarter | "
                f"{memory_text(watched.memory_mb)} |"
            )
        yield from (f"| {outcome} | {many} |" for outcome, many in sorted(counts.items()))
        yield f"| files without an outcome | {len(unreported)} {' '.join(unreported[:3])} |"
        same = len(first.keys() | second.keys()) - len(differ) - len(renamed)
        yield f"| files that only one watch read before they were renamed | {len(renamed)} |"
        yield (
            f"| files equal in both stores, files that differ | {same}, {len(differ)}"
            f" {' '.join(differ[:3])} |"
        )


def lines(*, fast: bool = False) -> Iterator[str]:
    """Yield Markdown lines; `fast` lasts one minute.

    `--minutes 60` runs the full hour.
    """
    yield from run(1.0 if fast else 5.0, 3 if fast else 10)


if __name__ == "__main__":
    arguments = argparse.ArgumentParser(prog="python -m benchmarks.hostile", description=__doc__)
    arguments.add_argument("--minutes", type=float, default=60.0)
    arguments.add_argument("--kills", type=int, default=10)
    arguments.add_argument("--sensors", type=int, default=1)
    given = arguments.parse_args()
    for line in run(
        given.minutes,
        given.kills,
        given.sensors,
        say=lambda text: print(text, file=sys.stderr, flush=True),
    ):
        print(line, flush=True)
