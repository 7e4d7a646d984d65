import subprocess
import sys

import pytest

import asperity

HEAVY = ("numpy", "scipy", "numba", "matplotlib", "xarray", "pandas", "pint", "pydantic", "plotly", "SurfaceTopography")


def loaded_after(statement: str) -> list[str]:
    probe = f"import sys; {statement}; print(*[m for m in {HEAVY!r} if m in sys.modules])"
    return (
        subprocess.run([sys.executable, "-c", probe], capture_output=True, text=True, check=True)
        .stdout.splitlines()[-1]
        .split()
    )


@pytest.mark.parametrize(
    "statement",
    ["import asperity", "import asperity.cli", "dir(__import__('asperity'))", "import asperity; asperity.BadInput"],
)
def test_nothing_heavy_is_imported_at_the_start(statement):
    assert loaded_after(statement) == []


def test_help_imports_nothing_heavy():
    statement = "import asperity.cli\ntry: asperity.cli.main(['--help'])\nexcept SystemExit: pass\n"
    probe = f"import sys\n{statement}print(*[m for m in {HEAVY!r} if m in sys.modules])"
    done = subprocess.run([sys.executable, "-c", probe], capture_output=True, text=True, check=True)
    assert "solve" in done.stdout
    assert done.stdout.splitlines()[-1] == ""


def test_numba_waits_for_a_solve():
    assert "numba" not in loaded_after("import asperity; asperity.read_surface; asperity.power_spectrum")


def test_every_public_name_is_there():
    assert len(asperity.__all__) < 55
    for name in asperity.__all__:
        assert getattr(asperity, name).__module__.startswith("asperity.")
    assert set(asperity.__all__) <= set(dir(asperity))


def test_a_name_that_is_not_there_is_named():
    with pytest.raises(AttributeError, match="slove_case"):
        _ = asperity.slove_case
