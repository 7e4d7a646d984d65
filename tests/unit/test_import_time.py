import gc
import os
import platform
import subprocess
import sys
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path

import numpy as np
import pytest
import x3pio

import asperity
from asperity.core.processes import GC_THRESHOLD, set_up_worker

PAPER = Path(__file__).parents[2] / "examples" / "paper.toml"
HEAVY = (
    "numpy",
    "scipy",
    "numba",
    "matplotlib",
    "xarray",
    "pandas",
    "pint",
    "pydantic",
    "plotly",
    "SurfaceTopography",
)
HEAVY += ("importlib.resources", "importlib.metadata", "multiprocessing")  # standard library


def loaded_after(statement: str) -> list[str]:
    probe = f"import sys; {statement}; print(*[m for m in {HEAVY!r} if m in sys.modules])"
    return (
        subprocess.run([sys.executable, "-c", probe], capture_output=True, text=True, check=True)
        .stdout.splitlines()[-1]
        .split()
    )


@pytest.mark.parametrize(
    "statement",
    [
        "import asperity",
        "import asperity.cli",
        "dir(__import__('asperity'))",
        "import asperity; asperity.BadInput",
    ],
)
def test_importing_the_package_loads_no_heavy_modules(statement):
    assert loaded_after(statement) == []


def test_help_loads_no_heavy_modules():
    statement = "import asperity.cli\ntry: asperity.cli.main(['--help'])\nexcept SystemExit: pass\n"
    probe = f"import sys\n{statement}print(*[m for m in {HEAVY!r} if m in sys.modules])"
    done = subprocess.run([sys.executable, "-c", probe], capture_output=True, text=True, check=True)
    assert "solve" in done.stdout
    assert done.stdout.splitlines()[-1] == ""


VIBRATED = (
    "--set",
    "grid.cells=[32, 24]",
    "--set",
    "surface.correlation_length=40 um",
    "--set",
    "vibration.duration=1 s",
)
SMALL = (
    "--set",
    "grid.cells=[32, 24]",
    "--set",
    "surface.correlation_length=40 um",
    "--set",
    "vibration=none",
)
STATISTICS = {
    "scipy.signal",
    "scipy.stats",
    "scipy.optimize",
    "scipy.interpolate",
    "scipy.integrate",
    "scipy.spatial",
}
COMPUTE = {"numba", *STATISTICS}
DRAW = {"matplotlib", "plotly", "jinja2"}
UNITS = {"pint", "dask"}
STUDY = {"distributed", "SALib", "zarr"}
READ = {
    "SurfaceTopography",
    "soundfile",
    "nptdms",
    "pyuff",
    "idelib",
}  # libraries for single file formats
TABLES = {"pandas", "pyarrow", "xarray"}
NOT_LOADED = {  # commands and the modules that they must not load
    ("--version",): (
        {"numpy", "scipy", "pydantic", "pint", "rich"} | COMPUTE | DRAW | STUDY | READ | TABLES
    ),
    ("solve", "absent.toml"): {"rich"} | COMPUTE | UNITS | DRAW | STUDY | READ | TABLES,
    ("surface", "ring.x3p"): (
        {"rich", "numba", "xarray", "jinja2"} | STUDY
    ),  # SurfaceTopography imports matplotlib
    ("check", "noise.npy", "--rate", "20000"): (
        {"rich", "scipy.fft", "h5py"} | COMPUTE | UNITS | DRAW | STUDY | READ | TABLES
    ),
    ("check", "noise.csv"): (
        {"rich", "scipy.fft", "h5py"} | COMPUTE | UNITS | DRAW | STUDY | READ | TABLES
    ),
    ("check", str(PAPER)): (
        {"rich", "scipy.fft", "h5py"} | COMPUTE | UNITS | DRAW | STUDY | READ | TABLES
    ),
    ("track", "noise.npy", "--rate", "20000", "--method", "peak"): (
        {"numba", "rich"} | DRAW | STUDY | READ | TABLES
    ),
    ("rig", "--out", "rig", "--samples", "1", "--repeats", "1", "--duration", "1 s"): (
        {
            "rich",
            "numba",
        }
        | DRAW
        | STUDY
        | TABLES
    ),
    ("solve", str(PAPER), *SMALL, "--out", "run.nc"): (
        {"rich"} | STATISTICS | UNITS | DRAW | STUDY | READ | TABLES
    ),
    ("solve", str(PAPER), *VIBRATED): {"rich"} | STATISTICS | UNITS | DRAW | STUDY | READ | TABLES,
    ("vibrate", str(PAPER), "--quiet"): {"rich"} | DRAW | STUDY | READ | TABLES,
}


@pytest.mark.parametrize("arguments", NOT_LOADED, ids=lambda arguments: " ".join(arguments)[:40])
def test_a_command_loads_only_what_it_needs(tmp_path, arguments):
    heights = np.random.default_rng(5).standard_normal((32, 48)) * 1e-6
    x3pio.write(str(tmp_path / "ring.x3p"), heights, x_scale=2e-6, y_scale=3e-6)
    noise = np.random.default_rng(0).standard_normal(40_000)
    np.save(tmp_path / "noise.npy", noise)
    np.savetxt(
        tmp_path / "noise.csv", np.column_stack([np.arange(8000) / 2e4, noise[:8000]]), "%.6g", ","
    )
    names = sorted(NOT_LOADED[arguments])
    probe = (
        f"import atexit, sys\natexit.register(lambda: print('loaded', *[m for m in {names!r} if m"
        f" in sys.modules]))\nfrom asperity.cli import main\nmain({list(arguments)!r})"
    )
    done = subprocess.run(
        [sys.executable, "-c", probe], cwd=tmp_path, capture_output=True, text=True, check=False
    )
    assert done.stdout.splitlines()[-1].split() == ["loaded"], done.stderr


COMPILES = {"numba.np.linalg", "numba.np.npyimpl", "numba.typed.typeddict"}


def test_cached_kernels_load_no_compiler(tmp_path):
    probe = (
        f"import sys\nfrom asperity.cli import main\ntry: main(['solve', {str(PAPER)!r},"
        f" *{VIBRATED!r}])\nexcept SystemExit: print('loaded', *[m for m in {sorted(COMPILES)!r} if"
        " m in sys.modules])"
    )
    for _ in range(2):  # the first run may have to compile
        done = subprocess.run(
            [sys.executable, "-c", probe], cwd=tmp_path, capture_output=True, text=True, check=False
        )
    assert done.stdout.splitlines()[-1].split() == ["loaded"], done.stderr


def test_a_solve_starts_without_garbage_collection():
    probe = (
        "import atexit, gc\nfound = []\ngc.callbacks.append(lambda phase, info: found.append(info)"
        " if gc.get_threshold()[0] > 10_000 else None)\natexit.register(lambda: print('searched',"
        f" len(found)))\nfrom asperity.cli import main\nmain(['solve', {str(PAPER)!r},"
        f" *{VIBRATED!r}, '--quiet'])"
    )
    for _ in range(2):  # the first run may have to compile
        done = subprocess.run(
            [sys.executable, "-c", probe], capture_output=True, text=True, check=False
        )
    assert done.stdout.splitlines()[-1] == "searched 0", done.stderr


def test_a_command_ends_without_garbage_collection():
    probe = (
        "import atexit, gc\natexit.register(lambda: print('left', gc.get_freeze_count() > 1000))\n"
        "from asperity.cli import main\nmain(['--version'])"
    )
    done = subprocess.run([sys.executable, "-c", probe], capture_output=True, text=True, check=True)
    assert done.stdout.splitlines()[-1] == "left True"


def test_numba_is_loaded_only_for_a_solve():
    assert "numba" not in loaded_after(
        "import asperity; asperity.read_surface; asperity.power_spectrum"
    )


def test_a_case_is_read_without_numba():
    assert "numba" not in loaded_after(f"import asperity; asperity.load_case({str(PAPER)!r})")


def test_every_public_name_exists():
    assert len(asperity.__all__) <= 55
    for name in asperity.__all__:
        assert getattr(asperity, name).__module__.startswith("asperity.")
    assert set(asperity.__all__) <= set(dir(asperity))


def test_an_unknown_name_is_reported():
    with pytest.raises(AttributeError, match="slove_case"):
        _ = asperity.slove_case


@pytest.mark.skipif(platform.libc_ver()[0] != "glibc", reason="memory is reused with glibc only")
def test_freed_memory_is_reused():
    """Fields of 16 MB: the system clears 4096 pages of newly allocated memory."""
    probe = (
        "import resource, numpy as np\nfrom asperity.core.processes import"
        " tune_memory_use\ntune_memory_use()\ndef faults():\n  before ="
        " resource.getrusage(resource.RUSAGE_SELF).ru_minflt\n  np.ones(1 << 21) + np.ones(1 <<"
        " 21)\n  return resource.getrusage(resource.RUSAGE_SELF).ru_minflt -"
        " before\nprint(faults(), max(faults() for _ in range(5)))"
    )
    environment = {**os.environ, "NUMPY_MADVISE_HUGEPAGE": "0"}
    done = subprocess.run(
        [sys.executable, "-c", probe], env=environment, capture_output=True, text=True, check=True
    )
    first, later = map(int, done.stdout.split())
    assert first > 4096
    assert later < 400


def test_workers_use_the_same_garbage_collection_threshold():
    with ProcessPoolExecutor(1, get_context("spawn"), set_up_worker) as pool:
        assert pool.submit(gc.get_threshold).result()[0] == GC_THRESHOLD
