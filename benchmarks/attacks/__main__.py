"""All attacks, and the table of docs/validation.md: `python -m benchmarks.attacks [--share 0.01]
[KIND ...]`.
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

LONGEST_S = runner.LONGEST_S
ROOT = Path(__file__).parents[2]


class Kind(NamedTuple):
    """How many attacks of a kind there are, and what does them: yields a fault, or None, for
    each.
    """

    attacks: int
    do: Callable[[str, int], Iterator[str | None]]


def in_worker(kind: str, count: int) -> Iterator[str | None]:
    """Attacks in a worker that is started again where one kills or stops it.

    What takes 20 s of a processor, or three times that by the clock, hangs: other work on the
    machine is nobody's hang.
    """
    at, longest = 0, (0.0, 0.0, 0)
    while at < count:
        command = [sys.executable, "-m", "benchmarks.attacks.worker", kind, str(at), str(count)]
        worker = subprocess.Popen(
            command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True, cwd=ROOT
        )
        lines: queue.Queue[str] = queue.Queue()
        threading.Thread(target=_hand_on, args=(worker, lines), daemon=True).start()
        patience = 600.0  # to set up
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
            told = json.loads(line)
            if "done" in told:
                fault = told["fault"]
                longest = max(longest, (told["processor_s"], told["seconds"], told["done"]))
                if fault is None and told["processor_s"] > LONGEST_S:
                    fault = f"took {told['processor_s']:.0f} s of a processor"
                yield None if fault is None else f"{kind} {told['done']}: {fault}"
                at, patience = told["done"] + 1, 600.0
            else:
                patience = 3.0 * LONGEST_S
        worker.wait()
    processor, clock, number = longest
    print(
        f"  longest: {kind} {number}, {processor:.1f} s of a processor, {clock:.1f} s",
        file=sys.stderr,
        flush=True,
    )


def _hand_on(worker: "subprocess.Popen[str]", lines: "queue.Queue[str]") -> None:
    assert worker.stdout is not None
    for line in worker.stdout:
        lines.put(line)
    lines.put("")


def hostile(_: str, count: int) -> Iterator[str | None]:
    """Each in a process of its own, its memory watched."""
    for name, make in list(HOSTILE.items())[:count]:
        yield endings.in_folder(
            lambda folder, name=name, make=make: _met(name, make(folder), folder)
        )


def _met(name: str, arguments: tuple[str, ...], folder: Path) -> str | None:
    faults = runner.run(name, arguments, folder).faults
    return f"{name}: {', '.join(faults)}" if faults else None


KINDS = {
    "case files": Kind(500, in_worker),
    "--set values": Kind(300, in_worker),
    "damaged results": Kind(1500, in_worker),
    "recordings and surfaces": Kind(2000, in_worker),
    "hostile files": Kind(len(HOSTILE), hostile),
    "kills": Kind(60, endings.kills),
    "disk full": Kind(20, endings.full_disks),
    "injections": Kind(30, in_worker),
}


def main() -> None:
    """Attack, and print a row a kind; what did not hold goes to standard error."""
    arguments = argparse.ArgumentParser(prog="python -m benchmarks.attacks", description=__doc__)
    arguments.add_argument("--share", type=float, default=1.0, help="of each kind's attacks")
    arguments.add_argument("kinds", nargs="*", help=", ".join(KINDS))
    wanted = arguments.parse_args()
    print("| attacks | number | held |\n|---|---|---|", flush=True)
    failed = 0
    for name in wanted.kinds or KINDS:
        count = max(1, round(KINDS[name].attacks * wanted.share))
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
