"""`make bench`: every figure that the docs quote, measured part by part within a time, kept, and
compared.

Each part runs in a process of its own, on one thread: one that fails or takes too long is named at
the end, with what it said the last time left standing. A run that is cut off, or out of time, goes
on where it stopped.
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

# whose times are their result: nothing runs beside them; those first that the others' are told
# against
ALONE = (
    "prompt",
    "roughness_levels",
    "first_call",
    "page",
    "speed",
    "conserving",
    "motion",
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
# what is counted, on each processor one of these, each one part or some that need what another
# keeps
ABREAST = (
    ("inference", "forecast", "next_points", "rings"),  # the longest first
    ("wearing",),
    ("indicators",),
    ("no_speed", "chosen_grids"),
    ("damping", "damping_stages"),
    ("intervals",),
    ("sensors",),
    ("failures",),
    ("alarms", "soonest"),
    ("hostile",),
    ("motion_table",),
    ("robustness",),
    ("vibration",),
)
PARTS = (*ALONE, *chain.from_iterable(ABREAST))
# short enough as they are, whatever is asked
WHOLE = (
    "certified",
    "chosen_films",
    "first_call",
    "stress",
    "surfaces",
    "rollers",
    "gallery",
    "soonest",
)
ON_ALL = (
    "recordings",
    "study",
    "first_call",
    "prompt",
    "page",
)  # as their users have them, on all processors
TIMES = "times"  # the part that says how long the others took


class Asked(NamedTuple):
    """What a run is asked for."""

    parts: tuple[str, ...]
    whole: bool
    seconds: float
    most: float  # seconds of one part


def main() -> None:
    """Run the parts, keep what they say as csv, write the page and say what changed."""
    arguments = argparse.ArgumentParser(prog="python -m benchmarks", description=__doc__)
    arguments.add_argument(
        "parts", nargs="*", metavar="PART", help=f"of {', '.join(PARTS)}; all unless named"
    )
    arguments.add_argument(
        "--whole", action="store_true", help="the long parts at full size, too: hours"
    )
    arguments.add_argument(
        "--minutes", type=float, help="of all parts together; 40 unless given, no end if whole"
    )
    arguments.add_argument(
        "--most", type=float, help="minutes of one part; 8 unless given, no end if whole"
    )
    arguments.add_argument(
        "--afresh", action="store_true", help="all parts, also those of a run that was cut off"
    )
    arguments.add_argument("--alone", type=float, metavar="SECONDS", help=argparse.SUPPRESS)
    wanted = arguments.parse_args()
    if unknown := [part for part in wanted.parts if part not in PARTS]:
        arguments.error(f"there is no part {unknown[0]}; there are {', '.join(PARTS)}")
    if wanted.alone:
        for line in _said(wanted.parts[0], whole=wanted.whole, seconds=wanted.alone):
            print(line, flush=True)
        return
    minutes, most = (
        given or (float("inf") if wanted.whole else usual)
        for given, usual in ((wanted.minutes, 40), (wanted.most, 8))
    )
    asked = Asked(tuple(wanted.parts or PARTS), wanted.whole, 60.0 * minutes, 60.0 * most)
    run = Unfinished.of(
        asked.parts,
        whole=wanted.whole,
        afresh=wanted.afresh,
        file=None if wanted.parts else unfinished.FILE,
    )
    if run.done:
        print(
            f"Going on with the run of {run.began}, after {', '.join(run.done)}; --afresh starts"
            " anew.\n",
            flush=True,
        )
    _measure(asked, run)
    _conclude(run, alone=bool(wanted.parts))
    sys.exit(any(trouble for _, trouble, _ in run.done.values()) or bool(run.left))


def _measure(asked: Asked, run: Unfinished) -> None:
    """Run what is left, within the time; each part is kept as it ends."""
    end, saying = perf_counter() + asked.seconds, threading.Lock()

    def measure(part: str) -> None:
        began = perf_counter()
        seconds = min(asked.most, end - began)
        if seconds <= 0.0:
            return
        printed, trouble = _run(part, whole=asked.whole, seconds=seconds)
        with saying:
            if seconds < asked.most and trouble.startswith(
                "stopped"
            ):  # by the end of all: the next run has it first
                return
            changed = [] if trouble else kept.keep(part, printed.splitlines())
            run.end(part, perf_counter() - began, trouble, changed)
            print(f"{part}: {trouble}\n" if trouble else printed, flush=True)

    def in_turn(parts: Iterable[str]) -> None:
        for part in parts:
            measure(part)

    left = run.left
    in_turn(part for part in left if part in ALONE)
    with ThreadPoolExecutor(max(1, min(2, os.cpu_count() or 1))) as pool:
        for _ in pool.map(in_turn, [[part for part in row if part in left] for row in ABREAST]):
            pass


def _conclude(run: Unfinished, *, alone: bool) -> None:
    """Write the page, and say what the parts took and what changed."""
    times = [
        f"| {part} | {seconds:.0f} | {trouble or 'measured'} |"
        for part, (seconds, trouble, _) in run.done.items()
    ]
    times = ["## What the parts took", "", "| part | time [s] | outcome |", "|---|---|---|", *times]
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
                f"## What changed by more than {100 * kept.CHANGED:.0f} % against the last",
                "",
            ]
        )
    )
    print("\n".join(changed) or "Nothing.")
    if run.left:
        print(f"\nOut of time before {', '.join(run.left)}: the same command goes on there.")


def _said(part: str, *, whole: bool, seconds: float) -> Iterator[str]:
    """A part's lines, and whether that is all of it, unless it says how large its sample is.

    One that asks for its `seconds` does what it has time for, and goes on the next time.
    """
    told = importlib.import_module(f"benchmarks.{part}").lines
    asks = {"seconds": seconds} if "seconds" in inspect.signature(told).parameters else {}
    counted = part in WHOLE
    with nullcontext() if part in ON_ALL else threadpool_limits(1):
        for line in told(fast=not whole and part not in WHOLE, **asks):
            counted = counted or kept.SAMPLE.match(line) is not None
            yield line
    if not counted:
        yield kept.IN_FULL if whole else kept.IN_SHORT


def _run(part: str, *, whole: bool, seconds: float) -> tuple[str, str]:
    """What a part prints, and what kept it from doing so to the end."""
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
