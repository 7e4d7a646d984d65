import errno
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import xarray

from asperity.contact.conditions import ContactConditions, ElasticPair
from asperity.contact.grid import Grid
from asperity.core.errors import AsperityError, BadInput, UnreadableFile
from asperity.core.storage import netcdf_bytes, write_with_digest
from asperity.ehl import ContactSolution, Convergence, Iteration, Options, SolveStatus
from asperity.ehl.contact_solution import FORMAT
from asperity.ehl.outcome import Figures, GridError, SolveStrategy
from asperity.lubricant import (
    Barus,
    DowsonHigginson,
    Incompressible,
    Lubricant,
    Newtonian,
    Roelands,
)
from asperity.solution import load_solution
from asperity.solution.storage import EARLIER_TEXTS
from asperity.surface import Surface


@pytest.fixture
def solution():
    rng = np.random.default_rng(1)
    cells = (12, 9)
    grid = Grid(cells, (-0.1 / 3.0, -1e-4 / 7.0), (0.2 / 3.0, 1e-4 / 7.0))
    steps = tuple(Iteration((6 * n, 9), n, *rng.random(3)) for n in (1, 2))
    small = Figures(car=0.1 / 3.0, clr=0.1 / 7.0, h_min=1e-9 / 3.0, h_central=1e-9 / 7.0)
    return ContactSolution(
        conditions=ContactConditions(
            pair=ElasticPair((0.1 + 2e11, 2.07e11), (0.3, 1.0 / 3.0)),
            geometry="line",
            radius=5.4e-3,
            load=500.0 / 3.0,
            surface_speeds=(2.101, 1.719),
            length=0.01,
            hardness=2e9,
        ),
        lubricant=Lubricant(
            viscosity=Barus(0.096, 18.2e-9), density=DowsonHigginson(880.0), rheology=Newtonian()
        ),
        surface=Surface(rng.standard_normal(cells) * 1e-6, grid),
        options=Options(tolerance=3e-7, max_iterations=17, contact_film=1e-9 / 3.0),
        pressure=rng.random(cells) * 1e9,
        gap=rng.random(cells) * 1e-6,
        in_contact=rng.random(cells) < 0.3,
        rigid_approach=-1e-6 / 3.0,
        convergence=Convergence(
            SolveStatus.STALLED,
            steps,
            3e-7,
            0.1 + 0.2,
            SolveStrategy.FIXED_APPROACH,
            small,
            GridError(
                car=0.2 / 3.0,
                clr=0.2 / 7.0,
                h_min=2e-9 / 3.0,
                h_central=2e-9 / 7.0,
                lean=small.scale(-0.5),
            ),
        ),
        attributes={"case": 'model = "unified"\n# größer\n', "notes": "[]"},
    )


def assert_equal(loaded, expected):
    for name in (
        "conditions",
        "lubricant",
        "options",
        "rigid_approach",
        "convergence",
        "attributes",
        "grid",
    ):
        assert getattr(loaded, name) == getattr(expected, name), name
    for name in ("pressure", "gap", "in_contact"):
        a, b = getattr(loaded, name), getattr(expected, name)
        assert a.dtype == b.dtype
        assert a.tobytes() == b.tobytes(), name
    assert loaded.surface.heights.tobytes() == expected.surface.heights.tobytes()


def test_every_number_is_restored_bit_for_bit(solution, tmp_path):
    path = solution.save(tmp_path / "run.nc")
    assert_equal(load_solution(path), solution)
    assert [entry.name for entry in tmp_path.iterdir()] == ["run.nc"]


@pytest.mark.parametrize(
    "changes",
    [
        {"lubricant": None},
        {
            "lubricant": Lubricant(
                viscosity=Roelands(0.04, 2e-8), density=Incompressible(850.0), rheology=Newtonian()
            )
        },
        {"attributes": {}},
    ],
)
def test_other_lubricants_and_none_are_restored(solution, tmp_path, changes):
    changed = replace(solution, **changes)
    assert_equal(load_solution(changed.save(tmp_path / "run.nc")), changed)


@pytest.mark.parametrize("text", EARLIER_TEXTS)
def test_strategies_of_earlier_versions_are_read(solution, tmp_path, monkeypatch, text):
    described = solution._described()
    described["convergence"]["attempt"] = text
    monkeypatch.setattr(ContactSolution, "_described", lambda _: described)
    assert (
        load_solution(solution.save(tmp_path / "run.nc")).convergence.attempt
        == (EARLIER_TEXTS[text])
    )


def test_infinities_of_an_unfinished_solve_are_restored(solution, tmp_path):
    solution.pressure[3, 3] = np.nan
    solution.gap[2, 2] = np.inf
    assert_equal(load_solution(solution.save(tmp_path / "run.nc")), solution)


def test_the_file_is_readable_without_asperity(solution, tmp_path):
    with xarray.open_dataset(solution.save(tmp_path / "run.nc"), engine="h5netcdf") as opened:
        assert opened.attrs["Conventions"].startswith("CF-")
        assert opened.attrs["case"] == solution.attributes["case"]
        assert opened["pressure"].dims == ("x", "y")
        units = {
            name: opened[name].attrs["units"]
            for name in ("x", "y", "pressure", "gap", "surface_height")
        }
        assert units == {"x": "m", "y": "m", "pressure": "Pa", "gap": "m", "surface_height": "m"}
        np.testing.assert_array_equal(opened["x"], solution.grid.x)
        for name in ("asperity", "numpy", "scipy", "numba", "python"):
            assert f'"{name}": ' in opened.attrs["versions"]


@pytest.mark.parametrize("share", [0.0, 0.02, 0.3, 0.7, 0.99])
def test_a_truncated_file_is_refused(solution, tmp_path, share):
    path = solution.save(tmp_path / "run.nc")
    content = path.read_bytes()
    path.write_bytes(content[: int(share * len(content))])
    with pytest.raises(UnreadableFile, match=r"run\.nc"):
        load_solution(path)


def test_any_flipped_bit_is_detected(solution, tmp_path):
    path = solution.save(tmp_path / "run.nc")
    intact = path.read_bytes()
    for place in np.random.default_rng(2).integers(8 * len(intact), size=100):
        content = bytearray(intact)
        content[place // 8] ^= 1 << place % 8
        path.write_bytes(content)
        with pytest.raises(UnreadableFile, match="digest"):
            load_solution(path)


def test_files_without_a_run_are_refused(tmp_path):
    (tmp_path / "text.nc").write_text("pressure 1 GPa")
    xarray.Dataset({"pressure": ("x", [1.0])}).to_netcdf(tmp_path / "foreign.nc", engine="h5netcdf")
    for name, attributes in {
        "other": {},
        "newer": {"asperity_format": 99},
        "empty": {"asperity_format": FORMAT},
    }.items():
        write_with_digest(
            tmp_path / f"{name}.nc", netcdf_bytes(xarray.Dataset(attrs=attributes), {})
        )
    write_with_digest(tmp_path / "letter.nc", b"pressure 1 GPa")
    reasons = {
        "text": "has no digest",
        "foreign": "has no digest",
        "letter": "not a netCDF file",
        "other": "not a saved asperity run",
        "newer": "run format 99",
        "empty": "damaged",
        "absent": "does not exist",
    }
    for name, reason in reasons.items():
        with pytest.raises(UnreadableFile, match=reason):
            load_solution(tmp_path / f"{name}.nc")


@pytest.mark.parametrize(
    ("failure", "error"),
    [
        (KeyboardInterrupt(), KeyboardInterrupt),
        (OSError(errno.ENOSPC, "No space left on device"), AsperityError),
    ],
)
def test_an_interrupted_save_keeps_the_old_file(solution, tmp_path, monkeypatch, failure, error):
    path = solution.save(tmp_path / "run.nc")
    before = path.read_bytes()

    def write_half(part, content):
        with part.open("wb") as file:
            file.write(content[: len(content) // 2])
        raise failure

    monkeypatch.setattr(Path, "write_bytes", write_half)
    with pytest.raises(error):
        solution.save(path)
    assert path.read_bytes() == before
    assert [entry.name for entry in tmp_path.iterdir()] == ["run.nc"]


def test_a_missing_folder_is_named(solution, tmp_path):
    with pytest.raises(BadInput, match="nowhere does not exist"):
        solution.save(tmp_path / "nowhere" / "run.nc")
    with pytest.raises(BadInput, match="it is a folder"):
        solution.save(tmp_path)


def test_an_attribute_cannot_overwrite_the_formats_own(solution):
    with pytest.raises(BadInput, match="options"):
        replace(solution, attributes={"options": "mine"}).to_dataset()
