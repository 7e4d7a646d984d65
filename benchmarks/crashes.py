"""Interrupted studies: kill a worker or the parent at random times, resume, and compare the results
with an uninterrupted study.

`python -m benchmarks.crashes [MOMENTS]`; the exit code is 1 if any number differs.
"""

import os
import random
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections import Counter
from pathlib import Path

import pandas
import pyarrow.parquet

CASE = Path(__file__).parents[1] / "examples" / "paper.toml"
SETTINGS = [
    "grid.cells=[64, 64]",
    'study.sq={from="0.5 um", to="4 um", step="0.7 um"}',
    "study.seeds=3",
]
TIMES = "seconds"  # the only column that differs between identical runs


def command(out: Path) -> list[str]:
    settings = [word for setting in SETTINGS for word in ("--set", setting)]
    return [
        sys.executable,
        "-m",
        "asperity",
        "study",
        str(CASE),
        "--out",
        str(out),
        "--workers",
        "2",
        "--quiet",
        *settings,
    ]


def children(pid: int) -> list[int]:
    """Return worker processes of a study, without multiprocessing's resource tracker."""
    found = subprocess.run(
        ["pgrep", "-P", str(pid), "-f", "spawn_main"], capture_output=True, text=True, check=False
    )
    return [int(line) for line in found.stdout.split()]


def killed(out: Path, after: float, target: str) -> str:
    """Start or resume the study, kill the target after `after` seconds, and return its fate."""
    running = subprocess.Popen(
        command(out), stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True
    )
    time.sleep(after)
    if running.poll() is None:
        workers = children(running.pid)
        victim = random.choice(workers) if target == "worker" and workers else running.pid
        os.kill(victim, signal.SIGKILL)
        if victim == running.pid:
            running.wait()
            for _ in range(200):
                left = [pid for pid in workers if Path(f"/proc/{pid}").exists()]
                if not left:
                    break
                time.sleep(0.1)
            return f"parent killed, {len(left)} workers left behind"
        running.wait()
        return f"worker killed, study ended with {running.returncode}"
    return "had finished"


def computed_twice(out: Path) -> int:
    ids = Counter(
        case_id
        for part in (out / "parts").glob("*.parquet")
        for case_id in pyarrow.parquet.read_table(part)["case_id"].to_pylist()
    )
    return sum(count > 1 for count in ids.values())


def main(moments: int) -> None:
    folder = Path(tempfile.mkdtemp(prefix="asperity-crashes-"))
    try:
        started = time.perf_counter()
        subprocess.run(command(folder / "whole"), check=True, stdout=subprocess.DEVNULL)
        length = time.perf_counter() - started
        whole = pandas.read_parquet(folder / "whole" / "table.parquet").drop(columns=TIMES)
        rng = random.Random(1)
        same = twice = behind = 0
        print(
            f"{len(whole)} cases take {length:.0f} s; then killed at {moments} moments and resumed"
        )
        for number in range(moments):
            out = folder / f"killed-{number}"
            target = ("worker", "parent")[number % 2]
            after = rng.uniform(0.3, 0.95 * length)
            fate = killed(out, after, target)
            subprocess.run(command(out), check=True, stdout=subprocess.DEVNULL)
            again = pandas.read_parquet(out / "table.parquet").drop(columns=TIMES)
            same += again.equals(whole)
            twice += computed_twice(out)
            left = len(list(out.rglob("*.part")))
            behind += left
            print(
                f"  after {after:5.1f} s: {fate}; bit-identical: {again.equals(whole)}; files left"
                f" over: {left}"
            )
            shutil.rmtree(out)
        print(
            f"{same} of {moments} bit-identical; {twice} cases computed twice, {behind}"
            " files left over"
        )
        sys.exit(same < moments or twice > 0 or behind > 0)
    finally:
        shutil.rmtree(folder, ignore_errors=True)


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 20)
