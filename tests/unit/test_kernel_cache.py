"""The cache of compiled kernels may be emptied, damaged or nowhere: kernels compile again, and give
the same.
"""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from asperity.kernels import compiled

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


def test_a_kernel_is_stale_where_a_module_beside_it_has_changed(ran, tmp_path):
    caller = "from asperity.kernels.compiled import njit\nfrom factor import FACTOR, times\n\n"
    caller += "@njit(cache=True)\ndef kernel(x):\n    return times(x) + FACTOR\n\n"
    caller += "print(kernel(1), sum(kernel.stats.cache_hits.values()))\n"
    (tmp_path / "kernel.py").write_text(caller)
    for factor in (2, 3):
        called = f"from asperity.kernels.compiled import njit\nFACTOR = {factor}\n\n"
        called += "@njit(cache=True)\ndef times(x):\n    return FACTOR * x\n"
        (tmp_path / "factor.py").write_text(called)
        assert ran(tmp_path / "cache") == f"{2 * factor} 0"
        assert ran(tmp_path / "cache") == f"{2 * factor} 1"


def test_what_two_processes_keep_under_one_number_is_not_taken_for_one_another(tmp_path):
    """Both find the cache empty and take the first number: index and code end up as different ones
    left them.
    """
    stamp = ("source", "modules")
    late = []
    one, other = (compiled._CheckedFile(str(tmp_path), "late", stamp) for _ in range(2))
    keep, one._save_data = one._save_data, lambda *what: late.append(what)
    other._load_index = dict  # read before the first had written
    one.save("float64", "code of floats")
    other.save("int64", "code of integers")
    keep(*late[0])
    assert compiled._CheckedFile(str(tmp_path), "late", stamp).load("int64") is None
