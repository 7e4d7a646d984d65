"""Kernels recompile with the same result when their cache is empty, damaged or not writable."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from asperity.core.processes import cores
from asperity.kernels import ahead, compiled

KERNEL = """
from asperity.kernels.compiled import njit

@njit(cache=True)
def twice(x):
    return 2 * x

print(twice(21), sum(twice.stats.cache_hits.values()))
"""


@pytest.fixture
def run_kernel(tmp_path):
    (tmp_path / "kernel.py").write_text(KERNEL)

    def run(cache: Path) -> str:
        environment = {**os.environ, "NUMBA_CACHE_DIR": str(cache)}
        command = [sys.executable, str(tmp_path / "kernel.py")]
        process = subprocess.run(
            command, capture_output=True, text=True, check=False, env=environment
        )
        assert process.stderr == ""
        return process.stdout.strip()

    return run


def empty_file(path: Path) -> None:
    path.write_bytes(b"")


def flip_bit(path: Path) -> None:
    content = bytearray(path.read_bytes())
    content[len(content) // 2] ^= 16
    path.write_bytes(content)


def truncate(path: Path) -> None:
    path.write_bytes(path.read_bytes()[:-5])


@pytest.mark.parametrize("kind", ["nbi", "nbc"])
@pytest.mark.parametrize("damage", [empty_file, flip_bit, truncate])
def test_a_damaged_cache_is_rebuilt(run_kernel, tmp_path, kind, damage):
    cache = tmp_path / "cache"
    assert run_kernel(cache) == "42 0"
    assert run_kernel(cache) == "42 1"
    (cached,) = cache.rglob(f"*.{kind}")
    damage(cached)
    assert run_kernel(cache) == "42 0"
    assert run_kernel(cache) == "42 1"


def test_kernels_compile_without_a_cache_folder(run_kernel):
    assert run_kernel(Path("/proc/nowhere")) == "42 0"


def test_a_kernel_recompiles_after_a_change_of_an_imported_module(run_kernel, tmp_path):
    caller = "from asperity.kernels.compiled import njit\nfrom factor import FACTOR, times\n\n"
    caller += "@njit(cache=True)\ndef kernel(x):\n    return times(x) + FACTOR\n\n"
    caller += "print(kernel(1), sum(kernel.stats.cache_hits.values()))\n"
    (tmp_path / "kernel.py").write_text(caller)
    for factor in (2, 3):
        called = f"from asperity.kernels.compiled import njit\nFACTOR = {factor}\n\n"
        called += "@njit(cache=True)\ndef times(x):\n    return FACTOR * x\n"
        (tmp_path / "factor.py").write_text(called)
        assert run_kernel(tmp_path / "cache") == f"{2 * factor} 0"
        assert run_kernel(tmp_path / "cache") == f"{2 * factor} 1"


def test_concurrent_writers_never_mix_their_code(tmp_path):
    """Both find the cache empty and take the first number: index and code come from different
    processes.
    """
    stamp = ("source", "modules")
    delayed = []
    first, second = (compiled._CheckedFile(str(tmp_path), "late", stamp) for _ in range(2))
    save_data, first._save_data = first._save_data, lambda *entry: delayed.append(entry)
    second._load_index = dict  # read before the first process writes
    first.save("float64", "code of floats")
    second.save("int64", "code of integers")
    save_data(*delayed[0])
    assert compiled._CheckedFile(str(tmp_path), "late", stamp).load("int64") is None


OF_A_CONTACT = """
from numba import typeof
from numba.core.dispatcher import Dispatcher
used, compiled, callers = set(), Dispatcher.compile, []

def record(kernel, types):
    if not callers and kernel.py_func.__module__.startswith("asperity."):
        used.add((kernel.py_func.__name__, str(types)))
    callers.append(kernel)  # compiles the kernels that it calls
    try:
        return compiled(kernel, types)
    finally:
        callers.pop()

Dispatcher.compile = record
from asperity.app.contact_jobs import warm_up
from asperity.kernels.ahead import calls
warm_up()
ahead = {
    (kernel.py_func.__name__, str(tuple(map(typeof, arguments)))) for kernel, arguments in calls()
}
print(sorted(ahead - used), sorted(used - ahead))
"""


def test_kernels_compiled_ahead_are_those_of_a_rough_contact():
    process = subprocess.run(
        [sys.executable, "-c", OF_A_CONTACT], capture_output=True, text=True, check=True
    )
    assert process.stdout.strip() == "[] []"


def test_nothing_is_compiled_ahead_where_kernels_are_compiled():
    ahead.compile_ahead(lambda *_: pytest.fail("a kernel was compiled"))


AHEAD = """
from asperity.kernels import ahead
names = ("mark_sealed", "fill_oil_rows", "fix_film_gap")
every = [call for call in ahead.calls() if call[0].py_func.__name__ in names]
ahead.calls = lambda: every
done = []
ahead.compile_ahead(lambda *counts: done.append(counts))
print(done, [len(kernel.signatures) for kernel, _ in every])
"""


@pytest.mark.skipif(cores() < 2, reason="kernels are compiled ahead on two processors")
def test_two_processes_compile_the_kernels_of_an_empty_cache(tmp_path):
    """The other process goes through the whole list, from its end."""
    environment = {**os.environ, "NUMBA_CACHE_DIR": str(tmp_path)}
    process = subprocess.run(
        [sys.executable, "-c", AHEAD], capture_output=True, text=True, check=True, env=environment
    )
    assert process.stdout.strip() == "[(0, 3), (1, 3), (2, 3)] [1, 1, 1]"
    assert len([*tmp_path.rglob("*.nbi")]) >= 3
