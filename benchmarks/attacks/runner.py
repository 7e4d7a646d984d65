"""Run a command under attack and record its exit code, output, time and memory."""

import os
import re
import resource
import signal
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

MAX_SECONDS, MAX_MB, MAX_CHARACTERS = 20.0, 1000.0, 500
_CONTROL = re.compile(r"[\x00-\x08\x0b-\x1f\x7f-\x9f]")


@dataclass(frozen=True)
class Outcome:
    """Result of a command."""

    name: str
    code: int | None  # None: stopped at the limit
    out: str
    errors: str
    seconds: float
    processor_s: float
    megabytes: float

    @property
    def faults(self) -> list[str]:
        """Faults of the result."""
        found = []
        if self.code is None:
            found.append("hangs")
        elif self.code not in (0, 1, 2, 3, 4, 5):
            found.append(f"ends with {self.code}")
        if "Traceback" in self.errors or "Traceback" in self.out:
            found.append("traceback")
        if self.code in (1, 2):
            if len(self.errors) > MAX_CHARACTERS:
                found.append(f"refusal of {len(self.errors)} characters")
            if self.errors.count("\n") > 1:
                found.append(f"refusal of {self.errors.count(chr(10))} lines")
            if not self.errors.startswith("error: "):
                found.append("no error message")
            if self.processor_s > MAX_SECONDS:
                found.append(
                    f"refusal after {self.processor_s:.0f} s of a processor, {self.seconds:.0f} s"
                    " in all"
                )
            if self.megabytes > MAX_MB:
                found.append(f"refusal took {self.megabytes:.0f} MB")
        if _CONTROL.search(self.errors):
            found.append("control characters on the terminal")
        return found


def _family(pid: int) -> list[int]:
    """Return a process and all its descendants."""
    pids = [pid]
    for parent in pids:
        try:
            for task in Path(f"/proc/{parent}/task").iterdir():
                pids += [int(child) for child in (task / "children").read_text().split()]
        except OSError:
            continue
    return pids


def processor_s(pid: int) -> float:
    """Return the CPU time [s] of a process and its descendants, ended ones included."""
    total = 0.0
    for member in _family(pid):
        try:
            numbers = Path(f"/proc/{member}/stat").read_text().rpartition(")")[2].split()
            total += sum(map(int, numbers[11:15])) / os.sysconf("SC_CLK_TCK")
        except (OSError, IndexError):
            continue
    return total


def _resident(pid: int) -> float:
    """Return the memory [MB] of a process and its descendants."""
    total = 0.0
    for member in _family(pid):
        try:
            total += (
                int(Path(f"/proc/{member}/statm").read_text().split()[1])
                * os.sysconf("SC_PAGE_SIZE")
                / 1e6
            )
        except (OSError, IndexError):
            continue
    return total


def run(name: str, arguments: tuple[str, ...], folder: Path, *, limit_s: float = 60.0) -> Outcome:
    """Run `asperity` with arguments in a folder and watch its time and memory."""
    start, processor_before, peak_mb = time.perf_counter(), _ended_s(), 0.0
    with tempfile.TemporaryFile() as out, tempfile.TemporaryFile() as errors:
        process = subprocess.Popen(
            [sys.executable, "-m", "asperity", *arguments],
            cwd=folder,
            stdout=out,
            stderr=errors,
            stdin=subprocess.DEVNULL,
            start_new_session=True,
        )
        while process.poll() is None and time.perf_counter() - start < limit_s:
            peak_mb = max(peak_mb, _resident(process.pid))
            if peak_mb > 6000.0:
                break
            time.sleep(0.02)
        code = process.poll()
        if code is None:
            os.killpg(process.pid, signal.SIGKILL)
            process.wait()
        seconds = time.perf_counter() - start
        texts = []
        for stream in (out, errors):
            stream.seek(0)
            texts.append(stream.read().decode("utf-8", "replace"))
    return Outcome(name, code, texts[0], texts[1], seconds, _ended_s() - processor_before, peak_mb)


def _ended_s() -> float:
    """Return the CPU time [s] of all ended child processes."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime
