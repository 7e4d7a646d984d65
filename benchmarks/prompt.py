"""From the prompt to the answer: processor time of whole commands beside that of the solves in them."""

import json
import os
import resource
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from functools import cache
from pathlib import Path

CASE = Path(__file__).parents[1] / "examples" / "paper.toml"
PROCESSOR = 0  # the one that all run on: further surfaces are then solved in the command's own process
INSIDE = """
import json, sys
from time import process_time
from asperity import ehl
from asperity.case import load_case
from asperity.results import solve_case
spent = {"solve": 0.0, "own resonance": 0.0, "stress": 0.0, "heat": 0.0}
def timed(name, work):
    began = process_time()
    done = work()
    spent[name] += process_time() - began
    return done
case = load_case(sys.argv[1])
for number in (-1, *range(case.surface_count(None))):
    one = case if number < 1 else case.on_surface(number)
    if number == 0:
        spent = dict.fromkeys(spent, 0.0)  # the surface before brought what is loaded once
    surface = one.surface()
    rubbing = {"boundary_friction": one.boundary_friction, "thermal": one.thermal}
    solved = timed("solve", lambda: ehl.solve_thermal_contact(
        one.conditions, one.lubricant, surface, **rubbing, options=one.options))
    friction, _ = timed("heat", lambda: ehl.friction_and_heat(solved, **rubbing))
    timed("stress", lambda: ehl.subsurface_stress(solved, shear=friction.shear))
    timed("own resonance", lambda: ehl.own_resonance(solved, one.vibration.mass))
print(json.dumps(spent))
"""


def _on_one_processor() -> None:
    if hasattr(os, "sched_setaffinity"):
        os.sched_setaffinity(0, {PROCESSOR})


@cache
def _bytecode() -> tempfile.TemporaryDirectory[str]:
    """Where Python keeps what it compiled, also where it is told to keep none beside the sources."""
    return tempfile.TemporaryDirectory()


def _run(*arguments: str) -> tuple[float, str]:
    """Processor time of a Python process on one thread [s], system's included, and what it printed."""
    kept = {key: value for key, value in os.environ.items() if key != "PYTHONDONTWRITEBYTECODE"}
    threads = {f"{library}_NUM_THREADS": "1" for library in ("OPENBLAS", "OMP", "MKL")}
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    done = subprocess.run(
        [sys.executable, *arguments],
        env={**kept, **threads, "PYTHONPYCACHEPREFIX": _bytecode().name},
        capture_output=True,
        text=True,
        check=False,
        preexec_fn=_on_one_processor,
    )
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return sum(getattr(after, kind) - getattr(before, kind) for kind in ("ru_utime", "ru_stime")), done.stdout


def seconds(*arguments: str, tries: int) -> float:
    """Least processor time of `asperity` with these arguments [s]; once before, unmeasured, to compile."""
    return min([_run("-m", "asperity", *arguments)[0] for _ in range(tries + 1)][1:])


def rows(*, fast: bool) -> Iterator[tuple[str, float]]:
    """What is measured, and its processor time [s]: least of several, all that is compiled in its cache."""
    tries = 2 if fast else 5
    with tempfile.TemporaryDirectory() as folder:
        recording, run = Path(folder) / "small.csv", Path(folder) / "run.nc"
        lines = (f"{n / 20000:.5f},{n * 7919 % 1000 / 1000 - 0.5:.4f}" for n in range(8000))
        recording.write_text("time [s],acceleration [m/s^2]\n" + "\n".join(lines), "utf-8")
        yield "asperity --help", seconds("--help", tries=tries)
        yield "asperity check of a recording", seconds("check", str(recording), tries=tries)
        yield "asperity check of a file that is none", seconds("check", str(CASE), tries=tries)
        inside = [json.loads(_run("-c", INSIDE, str(CASE))[1]) for _ in range(tries)]
        least = {name: min(one[name] for one in inside) for name in inside[0]}
        command = seconds("solve", str(CASE), tries=tries)
        yield "asperity solve examples/paper.toml", command
        for name, spent in least.items():
            yield f"of it {name}, of all surfaces", spent
        yield "of it the rest", command - sum(least.values())
        yield "the same with --out", seconds("solve", str(CASE), "--out", str(run), tries=tries)


def lines(*, fast: bool) -> Iterator[str]:
    """The table as Markdown."""
    yield "## From the prompt to the answer"
    yield ""
    yield "| what | processor time [s] |"
    yield "|---|---|"
    for what, spent in rows(fast=fast):
        yield f"| {what} | {spent:.2f} |"


if __name__ == "__main__":
    for line in lines(fast="--fast" in sys.argv):
        print(line, flush=True)
