"""A short selection of the attacks of `python -m benchmarks.attacks`, from each fast kind; CI runs
a larger one by `make attacks`.
"""

import pytest
from benchmarks.attacks import damage, endings, inputs, names, runner
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


@pytest.mark.parametrize(
    ("kind", "count"),
    [
        (inputs.cases, 8),
        (inputs.settings, 8),
        (damage.results, 24),
        (damage.measured, 24),
        (names.injections, 2),
    ],
)
def test_attacks_find_no_fault(tmp_path, kind, count):
    attack = kind(tmp_path)
    assert [fault for fault in map(attack, range(count)) if fault is not None] == []


@pytest.mark.parametrize("name", QUICK)
def test_a_hostile_file_is_refused_in_one_sentence(tmp_path, name):
    outcome = runner.run(name, HOSTILE[name](tmp_path), tmp_path)
    assert outcome.faults == []
    assert outcome.code == 2 or name.startswith("tdms")


def test_kills_and_full_disks_leave_no_partial_output():
    assert [
        fault for fault in (*endings.kills("", 1), *endings.full_disks("", 1)) if fault is not None
    ] == []
