"""Fields of a run as csv and VTK image."""

import json
import re
from pathlib import Path

import numpy as np
import pandas
import pytest

from asperity.case import load_case
from asperity.cli import main
from asperity.core.errors import BadInput
from asperity.results import solve_case, write_fields

EXAMPLES = Path(__file__).parents[2] / "examples"
SMALL = {"contact.roughness": "standing", "grid.cells": [64, 32], "solver.surfaces": 1}


@pytest.fixture(scope="module")
def run():
    case = load_case(EXAMPLES / "paper.toml").with_overrides({**SMALL, "vibration": "none"})
    return solve_case(case, strict=False)


def test_a_csv_has_a_row_per_cell(run, tmp_path):
    table = pandas.read_csv(write_fields(run, tmp_path / "fields.csv"))
    assert len(table) == 64 * 32
    solution = run.solution
    x, y = np.meshgrid(solution.grid.x, solution.grid.y, indexing="ij")
    columns = {"x [m]": x, "y [m]": y, "pressure [Pa]": solution.pressure, "gap [m]": solution.gap}
    for name, values in columns.items():
        np.testing.assert_allclose(table[name], values.ravel(), rtol=1e-12, atol=0.0)
    assert {"in_contact [1]", "von_mises [Pa]", "temperature_1 [K]"} <= set(table.columns)


def test_a_vtk_image_has_the_cells_of_the_grid(run, tmp_path):
    content = write_fields(run, tmp_path / "fields.vti").read_bytes()
    head = content[: content.index(b"<AppendedData")].decode()
    assert 'WholeExtent="0 64 0 32 0 1"' in head
    grid = run.solution.grid
    origin, spacing = (
        [float(part) for part in re.search(rf'{name}="([^"]*)"', head)[1].split()]
        for name in ("Origin", "Spacing")
    )
    assert origin == [*grid.lower, 0.0]
    assert spacing[:2] == list(grid.spacing)
    offset = int(re.search(r'Name="gap".*?offset="(\d+)"', head)[1])
    start = content.index(b"_", len(head)) + 1 + offset
    size = int(np.frombuffer(content, np.uint64, 1, start)[0])
    values = np.frombuffer(content, np.float64, size // 8, start + 8)
    assert (values.reshape((64, 32), order="F") == run.solution.gap).all()
    assert [path.name for path in tmp_path.iterdir()] == ["fields.vti"]


def test_another_format_is_refused(run, tmp_path):
    with pytest.raises(BadInput, match=r"fields are written as .csv or .vti, got .*fields.txt"):
        write_fields(run, tmp_path / "fields.txt")


def test_a_saved_run_is_exported_by_the_command_line(run, tmp_path, capsys):
    path, out = run.save(tmp_path / "run.nc"), tmp_path / "fields.csv"
    with pytest.raises(SystemExit) as end:
        main(["export", str(path), str(out), "--json"])
    assert end.value.code in (0, None)
    printed = json.loads(capsys.readouterr().out)
    assert (printed["fields"], sorted(printed)) == (str(out), ["fields", "verdict"])
    assert len(pandas.read_csv(out)) == 64 * 32
    with pytest.raises(SystemExit) as end:
        main(["export", str(path), str(tmp_path / "fields.xlsx")])
    assert end.value.code == 2
    assert "must be a file that ends in .csv or .vti" in capsys.readouterr().err
