"""Run all attacks and print the table of docs/validation.md.

`python -m benchmarks.attacks [--share 0.01] [KIND ...]`.
"""

import argparse
import json
import queue
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import NamedTuple

from benchmarks.attacks import endings, runner
from benchmarks.attacks.hostile import HOSTILE

MAX_SECONDS = runner.MAX_SECONDS
ROOT = Path(__file__).parents[2]


class Kind(NamedTuple):
    """Kind of attack: the number of attacks and the function that yields each fault, or None."""

    attacks: int
    do: Callable[[str, int], Iterator[str | None]]


def in_worker(kind: str, count: int) -> Iterator[str | None]:
    """Run attacks in a worker process, restarted after an attack that kills or blocks it.

    An attack hangs if it takes over 20 s of CPU time or three times that in wall-clock time, which
    allows for other work on the machine.
    """
    at, longest = 0, (0.0, 0.0, 0)
    while at < count:
        command = [sys.executable, "-m", "benchmarks.attacks.worker", kind, str(at), str(count)]
        worker = subprocess.Popen(
            command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True, cwd=ROOT
        )
        lines: queue.Queue[str] = queue.Queue()
        threading.Thread(target=_forward_lines, args=(worker, lines), daemon=True).start()
        patience = 600.0  # for the set-up
        while True:
            try:
                line = lines.get(timeout=patience)
            except queue.Empty:
                worker.kill()
                yield f"{kind} {at}: hangs"
                at += 1
                break
            if not line:
                if at < count:
                    yield f"{kind} {at}: the process dies with {worker.wait()}"
                    at += 1
                break
            message = json.loads(line)
            if "done" in message:
                fault = message["fault"]
                timing = message["processor_s"], message["seconds"], message["done"]
                longest = max(longest, timing)
                if fault is None and message["processor_s"] > MAX_SECONDS:
                    fault = f"took {message['processor_s']:.0f} s of a processor"
                yield None if fault is None else f"{kind} {message['done']}: {fault}"
                at, patience = message["done"] + 1, 600.0
            else:
                patience = 3.0 * MAX_SECONDS
        worker.wait()
    processor, clock, number = longest
    print(
        f"  longest: {kind} {number}, {processor:.1f} s of a processor, {clock:.1f} s",
        file=sys.stderr,
        flush=True,
    )


def _forward_lines(worker: "subprocess.Popen[str]", lines: "queue.Queue[str]") -> None:
    assert worker.stdout is not None
    for line in worker.stdout:
        lines.put(line)
    lines.put("")


def hostile(_: str, count: int) -> Iterator[str | None]:
    """Run each hostile file in its own process and watch its memory."""
    for name, make in list(HOSTILE.items())[:count]:
        yield endings.in_folder(
            lambda folder, name=name, make=make: _attack(name, make(folder), folder)
        )


def _attack(name: str, arguments: tuple[str, ...], folder: Path) -> str | None:
    faults = runner.run(name, arguments, folder).faults
    return f"{name}: {', '.join(faults)}" if faults else None


KINDS = {
    "case files": Kind(500, in_worker),
    "--set values": Kind(300, in_worker),
    "damaged results": Kind(1500, in_worker),
    "recordings and surfaces": Kind(2000, in_worker),
    "stores": Kind(1000, in_worker),
    "hostile files": Kind(len(HOSTILE), hostile),
    "kills": Kind(60, endings.kills),
    "disk full": Kind(20, endings.full_disks),
    "injections": Kind(30, in_worker),
}


def main() -> None:
    """Run the attacks and print a row for each kind; faults go to standard error."""
    arguments = argparse.ArgumentParser(prog="python -m benchmarks.attacks", description=__doc__)
    arguments.add_argument("--share", type=float, default=1.0, help="share of the attacks to run")
    arguments.add_argument("kinds", nargs="*", help=", ".join(KINDS))
    options = arguments.parse_args()
    print("| attacks | number | held |\n|---|---|---|", flush=True)
    failed = 0
    for name in options.kinds or KINDS:
        count = max(1, round(KINDS[name].attacks * options.share))
        faults = []
        for fault in KINDS[name].do(name, count):
            if fault is not None:
                faults.append(fault)
                print(f"  {fault}", file=sys.stderr, flush=True)
        failed += len(faults)
        print(f"| {name} | {count} | {count - len(faults)} |", flush=True)
    sys.exit(failed > 0)


if __name__ == "__main__":
    main()
