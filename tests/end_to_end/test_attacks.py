"""Hostile files are refused in one sentence; `make attacks`, which CI runs, tries many more."""

import pytest
from benchmarks.attacks import runner
from benchmarks.attacks.hostile import HOSTILE

QUICK = (
    "x3p with entities of entities",
    "npy that claims 1e12 numbers",
    "HDF5 that claims 1e11 samples",
    "mat 4 of 1e9 x 1e9",
    "HDF5 whose groups hold themselves",
    "csv of 200 000 columns",
    "tdms that claims 1e12 samples",
    "pipe as recording",
    "pipe as case",
    "pipe as manifest",
    "/dev/zero as surface",
    "run of 40 GB, sparse",
    "case with 3000 brackets",
    "case with an integer of 5000 digits",
    "manifest with 100 000 brackets",
    "HDF5 whose text is of no kind",
)


@pytest.mark.parametrize("name", QUICK)
def test_a_hostile_file_is_refused_in_one_sentence(tmp_path, name):
    outcome = runner.run(name, HOSTILE[name](tmp_path), tmp_path)
    assert outcome.faults == []
    assert outcome.code == 2 or name.startswith("tdms")
