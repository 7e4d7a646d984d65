"""CPU time of whole commands, and of the solves in them."""

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
PROCESSOR = 0  # with one processor, further surfaces are solved in the command's own process
INSIDE = """
import io, json, sys
from contextlib import redirect_stdout
from time import process_time
from importlib import import_module
from asperity.cli import main
run, solve = (import_module(f"asperity.results.{name}") for name in ("run", "solve"))
spent = {}
def timed(name, work):
    def within(*given, **named):
        began = process_time()
        done = work(*given, **named)
        spent[name] = spent.get(name, 0.0) + process_time() - began
        return done
    return within
solve.solve_thermal_contact = timed("solve", solve.solve_thermal_contact)
run.own_resonance = timed("own resonance", run.own_resonance)
run.subsurface_stress = timed("stress", run.subsurface_stress)
run.friction_and_heat = timed("heat", run.friction_and_heat)
def command():
    spent.clear()
    with redirect_stdout(io.StringIO()):
        try:
            main(["solve", sys.argv[1]])
        except SystemExit as end:
            assert not end.code
command()
first = {"whole": process_time(), **spent}
command()
print(json.dumps({"first": first, "again": {"whole": process_time() - first["whole"], **spent}}))
"""


def _on_one_processor() -> None:
    if hasattr(os, "sched_setaffinity"):
        os.sched_setaffinity(0, {PROCESSOR})


@cache
def _bytecode() -> tempfile.TemporaryDirectory[str]:
    """Create a folder for Python's bytecode, used even with PYTHONDONTWRITEBYTECODE."""
    return tempfile.TemporaryDirectory()


def _run(*arguments: str) -> tuple[float, str]:
    """Run Python on one thread; return its user and system time [s] and its output."""
    environment = {
        key: value for key, value in os.environ.items() if key != "PYTHONDONTWRITEBYTECODE"
    }
    threads = {f"{library}_NUM_THREADS": "1" for library in ("OPENBLAS", "OMP", "MKL")}
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    done = subprocess.run(
        [sys.executable, *arguments],
        env={**environment, **threads, "PYTHONPYCACHEPREFIX": _bytecode().name},
        capture_output=True,
        text=True,
        check=False,
        preexec_fn=_on_one_processor,
    )
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return (
        sum(getattr(after, kind) - getattr(before, kind) for kind in ("ru_utime", "ru_stime")),
        done.stdout,
    )


def seconds(*arguments: str, tries: int) -> float:
    """Return the least CPU time of `asperity` [s]; a first run, not counted, compiles."""
    return min([_run("-m", "asperity", *arguments)[0] for _ in range(tries + 1)][1:])


def rows(*, fast: bool) -> Iterator[tuple[str, float]]:
    """Yield each measured command and its least CPU time [s] with warm caches."""
    tries = 2 if fast else 5
    with tempfile.TemporaryDirectory() as folder:
        recording, run = Path(folder) / "small.csv", Path(folder) / "run.nc"
        lines = (f"{n / 20000:.5f},{n * 7919 % 1000 / 1000 - 0.5:.4f}" for n in range(8000))
        recording.write_text("time [s],acceleration [m/s^2]\n" + "\n".join(lines), "utf-8")
        yield "asperity --help", seconds("--help", tries=tries)
        yield "asperity check of a recording", seconds("check", str(recording), tries=tries)
        yield "asperity check of an invalid file", seconds("check", str(CASE), tries=tries)
        yield "asperity solve examples/paper.toml", seconds("solve", str(CASE), tries=tries)
        inside = [json.loads(_run("-c", INSIDE, str(CASE))[1]) for _ in range(tries)]
        for name, title in (
            ("first", "in a profiled process"),
            ("again", "second solve in that process"),
        ):
            parts = min((times[name] for times in inside), key=lambda times: times["whole"])
            whole = parts.pop("whole")
            yield title, whole
            for part, spent in parts.items():
                yield f"- of which {part}, all surfaces", spent
            yield "- remainder", whole - sum(parts.values())
        yield "the same with --out", seconds("solve", str(CASE), "--out", str(run), tries=tries)


def lines(*, fast: bool) -> Iterator[str]:
    """Yield the table as Markdown."""
    yield "## CPU time of complete commands"
    yield ""
    yield "| command | CPU time [s] |"
    yield "|---|---|"
    for name, spent in rows(fast=fast):
        yield f"| {name} | {spent:.2f} |"


if __name__ == "__main__":
    for line in lines(fast="--fast" in sys.argv):
        print(line, flush=True)
