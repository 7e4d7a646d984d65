"""The cache of compiled kernels may be emptied, damaged or nowhere: kernels compile again, and give the same."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

KERNEL = """
from asperity.kernels.compiled import njit

@njit(cache=True)
def twice(x):
    return 2 * x

print(twice(21), sum(twice.stats.cache_hits.values()))
"""


@pytest.fixture
def ran(tmp_path):
    (tmp_path / "kernel.py").write_text(KERNEL)

    def run(cache: Path) -> str:
        environment = {**os.environ, "NUMBA_CACHE_DIR": str(cache)}
        command = [sys.executable, str(tmp_path / "kernel.py")]
        done = subprocess.run(command, capture_output=True, text=True, check=False, env=environment)
        assert done.stderr == ""
        return done.stdout.strip()

    return run


def emptied(path: Path) -> None:
    path.write_bytes(b"")


def flipped(path: Path) -> None:
    content = bytearray(path.read_bytes())
    content[len(content) // 2] ^= 16
    path.write_bytes(content)


def cut(path: Path) -> None:
    path.write_bytes(path.read_bytes()[:-5])


@pytest.mark.parametrize("kind", ["nbi", "nbc"])
@pytest.mark.parametrize("damage", [emptied, flipped, cut])
def test_a_bad_cache_is_thrown_away_and_rebuilt(ran, tmp_path, kind, damage):
    cache = tmp_path / "cache"
    assert ran(cache) == "42 0"
    assert ran(cache) == "42 1"
    (kept,) = cache.rglob(f"*.{kind}")
    damage(kept)
    assert ran(cache) == "42 0"
    assert ran(cache) == "42 1"


def test_without_a_folder_for_the_cache_kernels_compile_all_the_same(ran):
    assert ran(Path("/proc/nowhere")) == "42 0"
