"""Input of wrong kinds is refused in one sentence: arrays, units, keys, environment, streams."""

import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pandas
import pytest

from asperity.case import load_case
from asperity.contact.grid import Grid
from asperity.core.arrays import real_array
from asperity.core.errors import BadInput
from asperity.recording import read_sidecar
from asperity.results import solve_case
from asperity.surface import Surface, bearing_curve, surface_from_array

CASE = Path(__file__).parents[2] / "examples" / "paper.toml"
GRID = Grid(cells=(32, 24), lower=(0.0, 0.0), upper=(1e-3, 1e-3))
HEIGHTS = np.random.default_rng(1).standard_normal(GRID.cells) * 1e-7
SMALL = {"grid.cells": [64, 48], "surface.correlation_length": 40e-6}


def masked():
    """Return heights of which one is missing; its stored value is a false one."""
    heights = np.ma.masked_array(HEIGHTS.copy(), mask=np.zeros(GRID.cells, dtype=bool))
    heights[3, 4] = 1e-3
    heights[3, 4] = np.ma.masked
    return heights


def test_a_masked_height_is_missing():
    for make in (Surface, lambda heights, grid: Surface.scaled(heights, grid, 1e-6)):
        with pytest.raises(BadInput, match="surface has 1 heights that are missing"):
            make(masked(), GRID)
    read = surface_from_array(masked(), unit="m", pixel=1e-6)
    assert np.isnan(read.heights).sum() == 1
    assert np.nanmax(read.heights) < 1e-6
    assert bearing_curve(masked()).height.max() < 1e-6


@pytest.mark.parametrize(
    ("heights", "reason"),
    [
        (HEIGHTS + 1j * HEIGHTS, "complex128"),
        (HEIGHTS.astype(object), "object"),
        (HEIGHTS.astype(str), "str"),
        (HEIGHTS > 0.0, "bool"),
        (HEIGHTS * 1e308, "at most 1000 m"),
        ([*HEIGHTS.tolist(), [0.0] * 24], "the grid's shape"),
    ],
)
def test_heights_of_another_kind_are_refused(heights, reason):
    with pytest.raises(BadInput, match=reason):
        Surface(heights, GRID)


@pytest.mark.parametrize("heights", [HEIGHTS * 1e308, np.ones(GRID.cells)])
def test_heights_that_cannot_be_scaled_are_refused(heights):
    with pytest.raises(BadInput, match="differ by finite amounts"):
        Surface.scaled(heights, GRID, 1e-6)


def test_a_table_of_heights_is_read_as_its_array():
    table = pandas.DataFrame(HEIGHTS)
    assert Surface(table, GRID).sq == Surface(HEIGHTS, GRID).sq
    units = {"unit": "m", "pixel": 1e-6}
    read, expected = (surface_from_array(values, **units) for values in (table, HEIGHTS))
    np.testing.assert_array_equal(read.heights, expected.heights)


def test_single_precision_is_kept():
    assert real_array("heights", HEIGHTS.astype(np.float32)).dtype == np.float32


@pytest.mark.parametrize("unit", ["(" * 3000 + "N" + ")" * 3000, "N*" * 5000 + "N", "N" * 61])
def test_an_endless_unit_is_refused(unit):
    with pytest.raises(
        BadInput, match=r"contact\.load must be a force.* longer than 60"
    ) as refused:
        load_case(CASE).with_overrides({"contact.load": f"500 {unit}"})
    assert len(str(refused.value)) < 250


def test_long_keys_are_cut_in_messages(tmp_path):
    with pytest.raises(BadInput, match=r"kkk\.\.\. \(1000 characters\) is not a known key") as key:
        load_case(CASE).with_overrides({f"contact.{'k' * 1000}": 1})
    assert len(str(key.value)) < 400
    path = tmp_path / "r.npz"
    np.savez(path, acc=HEIGHTS.ravel(), fs=20e3, unit="g")
    path.with_name("r.npz.json").write_text(json.dumps({"k" * 1000: "v" * 1000}))
    with pytest.raises(BadInput, match="kkk") as stated:
        read_sidecar(path)
    assert len(str(stated.value)) < 500


def test_a_caller_that_raises_at_underflow_gets_the_same_numbers():
    case = load_case(CASE).with_overrides(SMALL)
    usual = solve_case(case)
    with np.errstate(all="raise"):
        strict = solve_case(case)
        assert np.geterr()["under"] == "raise"
    times = {"seconds": 0.0, "processor_seconds": 0.0}
    assert strict.scalars() | times == usual.scalars() | times


CLOSED = {"stdout": (1,), "stderr": (2,), "both": (1, 2)}


@pytest.mark.parametrize("closed", CLOSED)
def test_closed_streams_lose_no_result(tmp_path, closed):
    def close():
        for stream in CLOSED[closed]:
            os.close(stream)

    settings = [f"--set={key}={value}" for key, value in SMALL.items()]
    settings[1] = "--set=surface.correlation_length=40 um"
    out = tmp_path / "run.nc"
    command = [sys.executable, "-m", "asperity", "solve", str(CASE), *settings]
    ended = subprocess.run([*command, "-q", "--out", str(out)], preexec_fn=close, check=False)
    assert ended.returncode == 0
    assert out.stat().st_size > 10_000


def test_a_wrong_number_of_threads_is_named():
    ended = subprocess.run(
        [sys.executable, "-m", "asperity", "solve", str(CASE), "-q"],
        env={**os.environ, "NUMBA_NUM_THREADS": "0"},
        capture_output=True,
        text=True,
        check=False,
    )
    assert ended.returncode == 2
    assert ended.stderr.startswith("error: numba cannot be loaded (Number of threads")
    assert ended.stderr.count("\n") == 1
