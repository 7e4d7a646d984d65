"""Disturbances of a running `asperity watch`: kills, full disk, lost permission, clock, lock.

Full disks and lost permissions need the rights of an administrator, to mount a small disk; without
them they are left out. The clock is that of the watch's process only.
"""

import os
import shutil
import signal
import sqlite3
import subprocess
import sys
from collections import Counter
from collections.abc import Callable, Sequence
from contextlib import suppress
from datetime import datetime, timedelta
from pathlib import Path
from time import monotonic

import numpy as np

import asperity.cli
import asperity.monitoring.store.sensor
import asperity.monitoring.watching.folder_watch
import asperity.monitoring.watching.watch_state
from asperity.monitoring import notify

DISK_MB = 512
CLOCK_JUMPS = (timedelta(days=400), timedelta(0), timedelta(days=-400), timedelta(0))
CLOCK = "ASPERITY_BENCHMARK_CLOCK"  # file with the seconds by which the clock is ahead
FEWER_RIGHTS = "-dac_override,-dac_read_search"  # so that permissions count for an administrator


class DisturbedWatch:
    """A watch in a process of its own, and what is done to it.

    Parameters
    ----------
    command : of the watch
    folder : that is watched
    out : of results, on a disk of its own if `disk`
    duration_s : of a disturbance [s]
    """

    def __init__(
        self, command: Sequence[str], folder: Path, out: Path, duration_s: float, *, disk: bool
    ) -> None:
        self.folder, self.out, self.duration_s, self.disk = folder, out, duration_s, disk
        self.command = [sys.executable, "-m", "benchmarks.disturbances", *command]
        if os.geteuid() == 0 and shutil.which("setpriv"):
            rights = (f"--bounding-set={FEWER_RIGHTS}", f"--inh-caps={FEWER_RIGHTS}")
            self.command = ["setpriv", *rights, *self.command]
        self.clock = out.with_suffix(".clock")
        self.counts: Counter[str] = Counter()
        self.ended = 0  # without having been killed
        self.memory_mb: list[float] = []
        self._jumps = 0
        self._log = out.with_suffix(".log").open("ab")
        if disk:
            out.mkdir()
            mount = ("mount", "-t", "tmpfs", "-o", f"size={DISK_MB}m", "tmpfs", str(out))
            subprocess.run(mount, check=True)
        self.start()

    def start(self) -> None:
        """Start the watch."""
        environment = {**os.environ, CLOCK: str(self.clock)}
        self.process = subprocess.Popen(
            self.command, stdout=subprocess.DEVNULL, stderr=self._log, env=environment
        )

    def check(self) -> None:
        """Measure the memory of the watch, and count an end."""
        if self.process.poll() is not None:
            self.ended += 1
            self.start()
        with suppress(OSError):
            self.memory_mb.append(memory_mb(self.process.pid))

    def close(self) -> None:
        """End the watch and unmount its disk; the results stay in a folder of the same name."""
        self.process.kill()
        self.process.wait()
        self._log.close()
        if self.disk:
            copy = self.out.with_suffix(".copy")
            shutil.copytree(self.out, copy)
            subprocess.run(("umount", str(self.out)), check=True)
            self.out.rmdir()
            copy.rename(self.out)

    # Disturbances: each returns what ends it, or None
    # ----------------------------------------------------------------------------------------------

    def kill(self) -> None:
        """Kill the watch and start it again."""
        self.check()
        self.process.send_signal(signal.SIGKILL)
        self.process.wait()
        self.start()

    def fill_disk(self) -> Callable[[], None]:
        """Fill the disk of the results."""
        filler = self.out / "filler"
        with filler.open("wb", buffering=0) as file, suppress(OSError):
            while True:
                file.write(bytes(4096))
        return filler.unlink

    def forbid_folder(self) -> Callable[[], None]:
        """Withdraw the permission to read the folder of recordings."""
        self.folder.chmod(0)
        return lambda: self.folder.chmod(0o755)

    def forbid_results(self) -> Callable[[], None]:
        """Withdraw the permission to write the folder of results."""
        self.out.chmod(0o500)
        return lambda: self.out.chmod(0o755)

    def lock_store(self) -> Callable[[], None]:
        """Hold the store as another program does that makes a backup."""
        connection = sqlite3.connect(
            self.out / "asperity.db", timeout=30.0, isolation_level=None, check_same_thread=False
        )
        connection.execute("BEGIN IMMEDIATE")

        def release() -> None:
            connection.rollback()
            connection.close()

        return release

    def jump_clock(self) -> None:
        """Set the clock ahead, back, behind and back, in turn."""
        jump = CLOCK_JUMPS[self._jumps % len(CLOCK_JUMPS)]
        self._jumps += 1
        part = self.clock.with_suffix(".part")
        part.write_text(str(jump.total_seconds()))
        part.replace(self.clock)

    def disturb(self, kind: str) -> tuple[float, Callable[[], None]] | None:
        """Start a disturbance; return when and by what it ends."""
        self.counts[kind] += 1
        end = getattr(self, kind)()
        return None if end is None else (monotonic() + self.duration_s, end)


def memory_mb(process: int) -> float:
    """Return the memory of a process and its children [MB], as Linux reports it."""
    status = Path(f"/proc/{process}/status").read_text()
    own = next(line for line in status.splitlines() if line.startswith("VmRSS"))
    children = Path(f"/proc/{process}/task/{process}/children").read_text().split()
    return float(own.split()[1]) / 1024.0 + sum(memory_mb(int(child)) for child in children)


def can_mount() -> bool:
    """Tell whether a small disk can be mounted."""
    return sys.platform == "linux" and os.geteuid() == 0 and shutil.which("setpriv") is not None


def schedule(
    kills: int, begin: float, end: float, *, disk: bool, seed: int
) -> list[tuple[float, str]]:
    """Return times and kinds of disturbances, the earliest last.

    Half of the kills follow directly on a disturbance that lasts.
    """
    lasting = ["lock_store"] * 2
    if disk:
        lasting += ["fill_disk"] * 3 + ["forbid_folder"] * 2 + ["forbid_results"] * 2
    kinds = lasting + ["jump_clock"] * 4 + ["kill"] * (kills - kills // 2)
    rng = np.random.default_rng(seed)
    times = rng.uniform(begin, end, len(kinds)).tolist()
    plan = [*zip(times, kinds, strict=True)]
    followed = rng.choice(len(lasting), min(kills // 2, len(lasting)), replace=False)
    plan += [(times[number], "kill") for number in followed]
    return sorted(plan, key=lambda entry: (entry[0], entry[1] == "kill"), reverse=True)


def main() -> None:
    """Run `asperity` with a clock that is ahead by the seconds in the file `CLOCK`."""
    clock, now_s = Path(os.environ[CLOCK]), notify.time

    def ahead_s() -> float:
        try:
            return float(clock.read_text())
        except OSError:
            return 0.0

    class Clock(datetime):
        @classmethod
        def now(cls, tz=None):  # type: ignore[no-untyped-def]
            return datetime.now(tz) + timedelta(seconds=ahead_s())

    def jumping_s() -> float:
        return now_s() + ahead_s()

    monitoring = asperity.monitoring
    monitoring.store.sensor.datetime = Clock
    monitoring.watching.folder_watch.datetime = Clock
    monitoring.watching.watch_state.time = jumping_s
    notify.time = jumping_s
    asperity.cli.main()


if __name__ == "__main__":
    main()
