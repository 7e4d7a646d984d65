"""Killed processes and full disks: saved results must be complete or resumable."""

import os
import random
import resource
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pandas

from asperity.core.errors import BadInput
from asperity.results import load_run
from asperity.simulation import load_history
from benchmarks.attacks.inputs import small_text

QUIET = {"stdout": subprocess.DEVNULL, "stderr": subprocess.PIPE, "text": True}


def in_folder(attack: Callable[[Path], str | None]) -> str | None:
    """Run an attack in a temporary folder."""
    folder = Path(tempfile.mkdtemp(prefix="asperity-attack-"))
    try:
        return attack(folder)
    finally:
        shutil.rmtree(folder, ignore_errors=True)


def _command(*arguments: str) -> list[str]:
    return [sys.executable, "-m", "asperity", *arguments]


def kills(_: str, count: int) -> Iterator[str | None]:
    """Kill histories, which must resume bit for bit, and runs, which must be complete or absent."""
    with tempfile.TemporaryDirectory(prefix="asperity-attack-") as place:
        home = Path(place)
        (home / "case.toml").write_text(small_text(100), "utf-8")
        run = _command(
            "run", str(home / "case.toml"), "--steps", "10", "--every", "5", "-q", "--out"
        )
        start = time.perf_counter()
        subprocess.run([*run, str(home / "whole")], check=True, **QUIET)
        length = time.perf_counter() - start
        table = load_history(home / "whole").table
        for number in range(count):
            after = random.Random(number).uniform(0.2, 1.1) * length
            folder = home / f"killed-{number}"
            if number % 2:
                yield _killed_history(run, folder, after, table)
            else:
                yield _killed_save(home / "case.toml", folder, after)
            shutil.rmtree(folder, ignore_errors=True)


def _kill(command: list[str], after: float) -> None:
    running = subprocess.Popen(command, **QUIET)
    time.sleep(after)
    running.send_signal(signal.SIGKILL)
    running.communicate()


def _killed_history(
    run: list[str], folder: Path, after: float, table: pandas.DataFrame
) -> str | None:
    _kill([*run, str(folder)], after)
    again = subprocess.run([*run, str(folder)], check=False, **QUIET)
    if again.returncode:
        return f"history killed after {after:.1f} s does not resume: {again.stderr[:200]}"
    same = load_history(folder).table.equals(table)
    return None if same else f"history killed after {after:.1f} s gives other numbers"


def _killed_save(case: Path, folder: Path, after: float) -> str | None:
    folder.mkdir()
    _kill(_command("solve", str(case), "-q", "--out", str(folder / "run.nc")), after)
    if (folder / "run.nc").exists():
        try:
            load_run(folder / "run.nc")
        except BadInput as refusal:
            return f"run killed after {after:.1f} s: {refusal}"
    return None


def full_disks(_: str, count: int) -> Iterator[str | None]:
    """Limit file sizes to a few kilobytes, which has the effect of a full disk."""
    commands = (
        ("solve", "case.toml", "-q", "--out", "new/run.nc"),
        ("run", "case.toml", "--steps", "2", "-q", "--out", "new/history"),
        (
            "study",
            "case.toml",
            "--workers",
            "1",
            "-q",
            "--set",
            "study.sq=['1 um']",
            "--out",
            "new/study",
        ),
        ("rig", "--out", "new/rig", "--samples", "1", "--repeats", "1", "--duration", "5 s"),
    )
    for number in range(count):
        command, kilobytes = commands[number % 4], (1, 4, 9, 16, 23)[number // 4 % 5]
        yield in_folder(
            lambda folder, command=command, kilobytes=kilobytes: _full(folder, command, kilobytes)
        )


def _full(folder: Path, arguments: tuple[str, ...], kilobytes: int) -> str | None:
    (folder / "case.toml").write_text(small_text(100), "utf-8")
    (folder / "new").mkdir()

    def limit() -> None:
        resource.setrlimit(resource.RLIMIT_FSIZE, (kilobytes << 10, kilobytes << 10))

    environment = {**os.environ, "NUMBA_CACHE_DIR": os.environ.get("NUMBA_CACHE_DIR", "")}
    ended = subprocess.run(
        _command(*arguments), cwd=folder, env=environment, preexec_fn=limit, check=False, **QUIET
    )
    name = f"{arguments[0]} with {kilobytes} kB"
    if ended.returncode not in (0, 1) or ended.stderr.count("\n") > 1:
        return f"{name}: ends with {ended.returncode}, {ended.stderr.count(chr(10))} lines"
    left = [path.name for path in folder.rglob("*.part")]
    return f"{name}: left {left}" if left else None
