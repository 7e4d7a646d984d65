"""The first solve after installation, compilation included: in a fresh process with an empty compiler cache."""

import os
import subprocess
import sys
import tempfile
from pathlib import Path
from time import perf_counter

CASE = Path(__file__).parents[1] / "examples" / "paper.toml"


def first_call() -> tuple[float, bool]:
    """Seconds of `asperity solve` with nothing compiled, and whether it said what the wait was for."""
    with tempfile.TemporaryDirectory() as empty:
        began = perf_counter()
        done = subprocess.run(
            [sys.executable, "-m", "asperity", "solve", str(CASE)],
            env={**os.environ, "NUMBA_CACHE_DIR": empty},
            check=True,
            capture_output=True,
            text=True,
        )
        return perf_counter() - began, "compiles" in done.stderr
