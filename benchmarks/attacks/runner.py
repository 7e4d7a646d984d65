"""Runs a command under attack, and says what became of it: its end, what it said, how long it took,
what memory.
"""

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

LONGEST_S, MOST_MB, MOST_CHARACTERS = 20.0, 1000.0, 500
_CONTROL = re.compile(r"[\x00-\x08\x0b-\x1f\x7f-\x9f]")


@dataclass(frozen=True)
class Outcome:
    """What became of a command."""

    name: str
    code: int | None  # None: it had to be stopped
    out: str
    said: str
    seconds: float
    processor_s: float
    megabytes: float

    @property
    def faults(self) -> list[str]:
        """What must not be."""
        found = []
        if self.code is None:
            found.append("hangs")
        elif self.code not in (0, 1, 2, 3, 4, 5):
            found.append(f"ends with {self.code}")
        if "Traceback" in self.said or "Traceback" in self.out:
            found.append("traceback")
        if self.code in (1, 2):
            if len(self.said) > MOST_CHARACTERS:
                found.append(f"refusal of {len(self.said)} characters")
            if self.said.count("\n") > 1:
                found.append(f"refusal of {self.said.count(chr(10))} lines")
            if not self.said.startswith("error: "):
                found.append("no sentence")
            if self.processor_s > LONGEST_S:
                found.append(
                    f"refusal after {self.processor_s:.0f} s of a processor, {self.seconds:.0f} s"
                    " in all"
                )
            if self.megabytes > MOST_MB:
                found.append(f"refusal took {self.megabytes:.0f} MB")
        if _CONTROL.search(self.said):
            found.append("control characters on the terminal")
        return found


def _family(pid: int) -> list[int]:
    """A process and all below it."""
    pids = [pid]
    for parent in pids:
        try:
            for task in Path(f"/proc/{parent}/task").iterdir():
                pids += [int(child) for child in (task / "children").read_text().split()]
        except OSError:
            continue
    return pids


def processor_s(pid: int) -> float:
    """Seconds of a processor that a process, all below it and what ended below it have taken."""
    total = 0.0
    for member in _family(pid):
        try:
            numbers = Path(f"/proc/{member}/stat").read_text().rpartition(")")[2].split()
            total += sum(map(int, numbers[11:15])) / os.sysconf("SC_CLK_TCK")
        except (OSError, IndexError):
            continue
    return total


def _resident(pid: int) -> float:
    """Megabytes of memory of a process and all below it."""
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
    """Run `asperity` with arguments in a folder, as a process that is watched."""
    begun, spent, most = time.perf_counter(), _ended_s(), 0.0
    with tempfile.TemporaryFile() as out, tempfile.TemporaryFile() as said:
        process = subprocess.Popen(
            [sys.executable, "-m", "asperity", *arguments],
            cwd=folder,
            stdout=out,
            stderr=said,
            stdin=subprocess.DEVNULL,
            start_new_session=True,
        )
        while process.poll() is None and time.perf_counter() - begun < limit_s:
            most = max(most, _resident(process.pid))
            if most > 6000.0:
                break
            time.sleep(0.02)
        code = process.poll()
        if code is None:
            os.killpg(process.pid, signal.SIGKILL)
            process.wait()
        seconds = time.perf_counter() - begun
        texts = []
        for stream in (out, said):
            stream.seek(0)
            texts.append(stream.read().decode("utf-8", "replace"))
    return Outcome(name, code, texts[0], texts[1], seconds, _ended_s() - spent, most)


def _ended_s() -> float:
    """Seconds of a processor that all have taken whose end was waited for."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime
