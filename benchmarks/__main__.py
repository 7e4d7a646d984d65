"""Measure every figure quoted in the docs part by part, store the results and compare them: `make
bench`.

Each part runs in its own process on one thread. A part that fails or exceeds its time limit is
listed at the end; its previous results stay. An interrupted run resumes where it stopped.
"""

import argparse
import importlib
import inspect
import os
import subprocess
import sys
import threading
from collections.abc import Iterable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import nullcontext
from itertools import chain
from time import perf_counter
from typing import NamedTuple

from threadpoolctl import threadpool_limits

from benchmarks import kept, unfinished
from benchmarks.unfinished import Unfinished

# parts whose result is a time: nothing runs alongside; the references of other parts come first
ALONE = (
    "prompt",
    "roughness_levels",
    "first_call",
    "page",
    "speed",
    "conserving",
    "motion",
    "cycles",
    "films",
    "chosen_films",
    "friction",
    "stress",
    "surfaces",
    "recordings",
    "study",
    "rollers",
    "bounded",
    "certified",
    "monitor",
    "gallery",
)
# parts without timings: one entry per processor; an entry is a part, or parts that depend on
# each other
ABREAST = (
    ("inference", "forecast", "next_points", "rings", "evidence"),  # the longest first
    ("wearing",),
    ("indicators",),
    ("no_speed", "chosen_grids"),
    ("damping", "damping_stages"),
    ("intervals",),
    ("sensors",),
    ("failures",),
    ("alarms", "soonest"),
    ("level_alarms",),
    ("hostile",),
    ("motion_table",),
    ("robustness",),
    ("controls",),
    ("vibration",),
)
PARTS = (*ALONE, *chain.from_iterable(ABREAST))
# short enough to run at full size always
WHOLE = (
    "certified",
    "chosen_films",
    "first_call",
    "stress",
    "surfaces",
    "rollers",
    "gallery",
    "soonest",
    "controls",
)
ON_ALL = (
    "recordings",
    "study",
    "first_call",
    "prompt",
    "page",
)  # as users run them, on all processors
TIMES = "times"  # the part that lists how long the others took


class RunRequest(NamedTuple):
    """Parts and limits of a run."""

    parts: tuple[str, ...]
    whole: bool
    seconds: float
    most: float  # time limit of one part


def main() -> None:
    """Run the parts, store their output as csv, write the page and print the changes."""
    arguments = argparse.ArgumentParser(prog="python -m benchmarks", description=__doc__)
    arguments.add_argument(
        "parts", nargs="*", metavar="PART", help=f"one of {', '.join(PARTS)}; default: all"
    )
    arguments.add_argument(
        "--whole", action="store_true", help="run the long parts at full size (hours)"
    )
    arguments.add_argument(
        "--minutes", type=float, help="limit of all parts together (default 40; none with --whole)"
    )
    arguments.add_argument(
        "--most", type=float, help="limit of one part in minutes (default 8; none with --whole)"
    )
    arguments.add_argument(
        "--afresh", action="store_true", help="restart an interrupted run from its first part"
    )
    arguments.add_argument("--alone", type=float, metavar="SECONDS", help=argparse.SUPPRESS)
    arguments_given = arguments.parse_args()
    if unknown := [part for part in arguments_given.parts if part not in PARTS]:
        arguments.error(f"unknown part {unknown[0]}; choose from {', '.join(PARTS)}")
    if arguments_given.alone:
        for line in _printed_lines(
            arguments_given.parts[0], whole=arguments_given.whole, seconds=arguments_given.alone
        ):
            print(line, flush=True)
        return
    minutes, most = (
        given or (float("inf") if arguments_given.whole else usual)
        for given, usual in ((arguments_given.minutes, 40), (arguments_given.most, 8))
    )
    request = RunRequest(
        tuple(arguments_given.parts or PARTS), arguments_given.whole, 60.0 * minutes, 60.0 * most
    )
    run = Unfinished.of(
        request.parts,
        whole=arguments_given.whole,
        afresh=arguments_given.afresh,
        file=None if arguments_given.parts else unfinished.FILE,
    )
    if run.done:
        print(
            f"Going on with the run of {run.began}, after {', '.join(run.done)}; --afresh starts"
            " anew.\n",
            flush=True,
        )
    _measure(request, run)
    _conclude(run, alone=bool(arguments_given.parts))
    sys.exit(any(failure for _, failure, _ in run.done.values()) or bool(run.left))


def _measure(request: RunRequest, run: Unfinished) -> None:
    """Run the remaining parts within the time limit; store each part when it ends."""
    end, print_lock = perf_counter() + request.seconds, threading.Lock()

    def measure(part: str) -> None:
        began = perf_counter()
        seconds = min(request.most, end - began)
        if seconds <= 0.0:
            return
        printed, failure = _run(part, whole=request.whole, seconds=seconds)
        with print_lock:
            if seconds < request.most and failure.startswith(
                "stopped"
            ):  # stopped by the limit of the whole run: the next run starts with it
                return
            changed = [] if failure else kept.keep(part, printed.splitlines())
            run.end(part, perf_counter() - began, failure, changed)
            print(f"{part}: {failure}\n" if failure else printed, flush=True)

    def in_turn(parts: Iterable[str]) -> None:
        for part in parts:
            measure(part)

    left = run.left
    in_turn(part for part in left if part in ALONE)
    with ThreadPoolExecutor(max(1, min(2, os.cpu_count() or 1))) as pool:
        for _ in pool.map(in_turn, [[part for part in row if part in left] for row in ABREAST]):
            pass


def _conclude(run: Unfinished, *, alone: bool) -> None:
    """Write the page; print the duration of each part and what changed."""
    times = [
        f"| {part} | {seconds:.0f} | {failure or 'measured'} |"
        for part, (seconds, failure, _) in run.done.items()
    ]
    times = ["## Time of each part", "", "| part | time [s] | outcome |", "|---|---|---|", *times]
    changed = [line for _, _, lines in run.done.values() for line in lines]
    if not alone and not run.left:
        kept.keep(TIMES, times)
        run.forget()
    kept.PAGE.write_text(kept.page(parts=(*PARTS, TIMES)), "utf-8")
    print(
        "\n".join(
            [
                *times,
                "",
                f"## Changes of more than {100 * kept.CHANGED:.0f} % since the last run",
                "",
            ]
        )
    )
    print("\n".join(changed) or "Nothing.")
    if run.left:
        print(f"\nOut of time before {', '.join(run.left)}: the same command resumes there.")


def _printed_lines(part: str, *, whole: bool, seconds: float) -> Iterator[str]:
    """Yield a part's lines and, unless it states its sample size, whether it was measured in full.

    A part with a `seconds` parameter computes what fits into that time and resumes in the next run.
    """
    part_lines = importlib.import_module(f"benchmarks.{part}").lines
    time_limit = (
        {"seconds": seconds} if "seconds" in inspect.signature(part_lines).parameters else {}
    )
    counted = part in WHOLE
    with nullcontext() if part in ON_ALL else threadpool_limits(1):
        for line in part_lines(fast=not whole and part not in WHOLE, **time_limit):
            counted = counted or kept.SAMPLE.match(line) is not None
            yield line
    if not counted:
        yield kept.IN_FULL if whole else kept.IN_SHORT


def _run(part: str, *, whole: bool, seconds: float) -> tuple[str, str]:
    """Return what a part prints, and the reason if it did not finish."""
    command = [
        sys.executable,
        "-m",
        "benchmarks",
        part,
        f"--alone={seconds}",
        *(["--whole"] if whole else []),
    ]
    limited = {"OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"} if part not in ON_ALL else {}
    most = None if seconds == float("inf") else seconds
    try:
        done = subprocess.run(
            command,
            stdout=subprocess.PIPE,
            text=True,
            timeout=most,
            check=False,
            env={**os.environ, **limited},
        )
    except subprocess.TimeoutExpired:
        return "", f"stopped after {seconds:.0f} s"
    return done.stdout, "" if done.returncode == 0 else f"failed with exit code {done.returncode}"


if __name__ == "__main__":
    main()
