"""CPU time of each script of the gallery, in its own process on one thread."""

import os
import resource
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

SCRIPTS = Path(__file__).parents[1] / "docs" / "scripts"
MOST = 60  # limit of CPU time [s]


def lines(*, fast: bool) -> Iterator[str]:  # noqa: ARG001 - short already
    """Yield one row per script."""
    scripts = sorted(SCRIPTS.rglob("[0-9]*.py"), key=lambda path: path.name)
    yield "## Gallery scripts"
    yield ""
    yield f"CPU time of a complete script, with imports; limit {MOST} s."
    yield ""
    yield "| script | time [s] |"
    yield "|---|---|"
    for script in scripts:
        yield f"| {script.name} | {_taken(script):.1f} |"


def _taken(script: Path) -> float:
    """Return the CPU time of a script and its subprocesses [s]."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    with tempfile.TemporaryDirectory() as folder:
        limited = {"MPLBACKEND": "agg", "OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"}
        subprocess.run(
            [sys.executable, str(script)],
            cwd=folder,
            env=os.environ | limited,
            check=True,
            stdout=subprocess.DEVNULL,
        )
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime - before.ru_utime + after.ru_stime - before.ru_stime
