"""`make bench`: every figure that the docs quote, measured part by part within a time, kept, and compared.

Each part runs in a process of its own, on one thread: one that fails or takes too long is named at the end, with what
it said the last time left standing.
"""

import argparse
import importlib
import os
import subprocess
import sys
from collections.abc import Iterator
from contextlib import nullcontext
from time import perf_counter

from threadpoolctl import threadpool_limits

from benchmarks import kept

PARTS = (  # those first that the others' times are told against
    "prompt",
    "roughness_levels",
    "first_call",
    "page",
    "speed",
    "films",
    "friction",
    "stress",
    "vibration",
    "surfaces",
    "conserving",
    "motion",
    "indicators",
    "recordings",
    "study",
    "robustness",
    "bounded",
    "rollers",
    "intervals",
    "damping",
    "damping_stages",
    "wearing",
    "alarms",
    "motion_table",
)
ON_ALL = ("recordings", "study", "first_call", "prompt", "page")  # as their users have them, on all processors
TIMES = "times"  # the part that says how long the others took


def main() -> None:
    """Run the parts, keep what they say as csv, write the page and say what changed."""
    arguments = argparse.ArgumentParser(prog="python -m benchmarks", description=__doc__)
    arguments.add_argument("parts", nargs="*", metavar="PART", help=f"of {', '.join(PARTS)}; all unless named")
    arguments.add_argument("--fast", action="store_true", help="fewer repeats and contacts, nothing solved twice")
    arguments.add_argument("--minutes", type=float, default=40.0, help="of all parts together; 40 unless given")
    arguments.add_argument("--most", type=float, default=8.0, help="minutes of one part; 8 unless given")
    arguments.add_argument("--alone", action="store_true", help=argparse.SUPPRESS)
    wanted = arguments.parse_args()
    if unknown := [part for part in wanted.parts if part not in PARTS]:
        arguments.error(f"there is no part {unknown[0]}; there are {', '.join(PARTS)}")
    if wanted.alone:
        for line in _said(wanted.parts[0], fast=wanted.fast):
            print(line, flush=True)
        return
    changed, times = [], []
    end = perf_counter() + 60.0 * wanted.minutes
    for part in wanted.parts or PARTS:
        began = perf_counter()
        printed, trouble = _run(part, fast=wanted.fast, seconds=min(60.0 * wanted.most, end - began))
        times.append(f"| {part} | {perf_counter() - began:.0f} | {trouble or 'measured'} |")
        print(printed if not trouble else f"{part}: {trouble}\n", flush=True)
        if not trouble:
            changed += kept.keep(part, printed.splitlines())
    if not wanted.parts:
        kept.keep(TIMES, ["## What the parts took", "| part | time [s] | outcome |", "|---|---|---|", *times])
    kept.PAGE.write_text(kept.page(parts=(*PARTS, TIMES)), "utf-8")
    print("\n".join(["## What the parts took", "", "| part | time [s] | outcome |", "|---|---|---|", *times]))
    print("\n".join(["", f"## What changed by more than {100 * kept.CHANGED:.0f} % against the last", "", *changed]))
    if not changed:
        print("Nothing.")
    sys.exit(any("measured" not in line for line in times))


def _said(part: str, *, fast: bool) -> Iterator[str]:
    module = importlib.import_module(f"benchmarks.{part}")
    with nullcontext() if part in ON_ALL else threadpool_limits(1):
        yield from module.lines(fast=fast)


def _run(part: str, *, fast: bool, seconds: float) -> tuple[str, str]:
    """What a part prints, and what kept it from doing so to the end."""
    if seconds <= 0.0:
        return "", "not begun: out of time"
    command = [sys.executable, "-m", "benchmarks", part, "--alone", *(["--fast"] if fast else [])]
    limited = {"OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"} if part not in ON_ALL else {}
    try:
        done = subprocess.run(
            command, stdout=subprocess.PIPE, text=True, timeout=seconds, check=False, env={**os.environ, **limited}
        )
    except subprocess.TimeoutExpired:
        return "", f"stopped after {seconds:.0f} s"
    return done.stdout, "" if done.returncode == 0 else f"failed with exit code {done.returncode}"


if __name__ == "__main__":
    main()
