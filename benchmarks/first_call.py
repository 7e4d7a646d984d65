"""First solve after installation, with compilation: a fresh process with an empty compiler
cache.
"""

import os
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path
from time import perf_counter

CASE = Path(__file__).parents[1] / "examples" / "paper.toml"


def first_call() -> tuple[float, bool]:
    """Return seconds of `asperity solve` without a cache, and whether it explained the wait."""
    with tempfile.TemporaryDirectory() as empty:
        began = perf_counter()
        done = subprocess.run(
            [sys.executable, "-m", "asperity", "solve", str(CASE)],
            env={**os.environ, "NUMBA_CACHE_DIR": empty},
            check=True,
            capture_output=True,
            text=True,
        )
        return perf_counter() - began, "compiling" in done.stderr


def lines(*, fast: bool) -> Iterator[str]:  # noqa: ARG001 - there is only one first call
    """Yield the result as Markdown."""
    yield "## The first call\n"
    seconds, explained = first_call()
    yield (
        f"First `asperity solve` after installation, including compilation: {seconds:.1f} s, "
        f"{'announced by a message' if explained else 'NOT ANNOUNCED by a message'}."
    )
