"""Stored files: damage, files of another case and other versions are detected and reported."""

import json
import shutil

import numpy as np
import pyarrow
import pytest

from asperity.core.errors import UnreadableFile
from asperity.core.storage import (
    append_digest,
    digest,
    read_json,
    read_table,
    read_with_digest,
    strip_digest,
    version_notes,
    write_json,
    write_table,
    write_with_digest,
)
from asperity.paper import papers_case
from asperity.simulation import load_history, run_history

TABLE = pyarrow.Table.from_pylist(
    [
        {"name": "a", "car": 0.1, "steps": 3, "fine": True},
        {"name": "b", "car": None, "steps": 4, "fine": False},
    ]
)


def with_flipped_bits(content: bytes, seed: int, count: int):
    for bit in np.random.default_rng(seed).integers(8 * len(content), size=count):
        changed = bytearray(content)
        changed[bit // 8] ^= 1 << bit % 8
        yield bytes(changed)


def test_a_digest_depends_on_names_types_shapes_and_values():
    array = np.arange(6.0)
    contents = [
        {"a": array},
        {"b": array},
        {"a": array.astype(np.float32)},
        {"a": array.reshape(2, 3)},
        {"a": array + 1e-15},
        {"a": array, "b": 1},
        {"a": array, "b": 1.0},
        b"a",
    ]
    assert len({digest(content) for content in contents}) == len(contents)
    assert digest({"a": 1, "b": 2}) == digest({"b": 2, "a": 1})


def test_a_file_without_its_digest_is_refused(tmp_path):
    path = tmp_path / "file"
    for body in (b"", b"some bytes"):
        write_with_digest(path, body)
        assert read_with_digest(path, "write it again") == body
    path.write_bytes(b"short")
    with pytest.raises(UnreadableFile, match=r"no digest.*; write it again"):
        read_with_digest(path, "write it again")


@pytest.mark.parametrize("seed", range(4))
def test_a_flipped_bit_in_a_table_is_refused_or_changes_nothing(tmp_path, seed):
    path = tmp_path / "table.parquet"
    write_table(path, TABLE, "this case")
    refused = 0
    for changed in with_flipped_bits(path.read_bytes(), seed, 50):
        path.write_bytes(changed)
        try:
            assert read_table(path, "this case", "compute it again").equals(TABLE)
        except UnreadableFile:
            refused += 1
    assert refused > 20


def test_a_table_of_lists_is_restored(tmp_path):
    """A study that varies only the vibration model stores lists of bands; parquet renames the items
    of a list.
    """
    table = pyarrow.table({"band_hz": [[2e3, 4e3], None, [1e3, 2e3]], "names": [["a"], [], ["b"]]})
    write_table(tmp_path / "table.parquet", table, "this case")
    back = read_table(tmp_path / "table.parquet", "this case", "delete it")
    assert back.to_pydict() == table.to_pydict()


def test_a_table_of_another_case_is_refused(tmp_path):
    write_table(tmp_path / "table.parquet", TABLE, "another case")
    with pytest.raises(UnreadableFile, match="another case than its folder"):
        read_table(tmp_path / "table.parquet", "this case", "compute it again")


def test_a_changed_value_in_a_manifest_is_refused(tmp_path):
    path = tmp_path / "manifest.json"
    write_json(path, {"points": [{"surface.sq": "0.5 um"}], "pair": (1, 2)})
    assert read_json(path, "") == {"points": [{"surface.sq": "0.5 um"}], "pair": [1, 2]}
    path.write_text(path.read_text().replace("0.5 um", "0.7 um"))
    with pytest.raises(UnreadableFile, match="its digest does not match its content"):
        read_json(path, "compute it again")
    path.write_text(json.dumps({"points": []}))
    with pytest.raises(UnreadableFile, match="no digest"):
        read_json(path, "compute it again")


def test_another_version_is_reported():
    assert version_notes({"asperity": "0.0.1"})[0].startswith("Computed by asperity 0.0.1")


@pytest.fixture(scope="module")
def histories(tmp_path_factory):
    """Folders of two cases that differ in their load."""
    case = papers_case().with_overrides(
        {"grid.cells": [32, 32], "surface.correlation_length": "60 um"}
    )
    folders = []
    for load in ("500 N", "400 N"):
        folder = tmp_path_factory.mktemp("histories") / load.split()[0]
        run_history(case.with_overrides({"contact.load": load}), steps=2, every=1, out=folder)
        folders.append(folder)
    return folders


@pytest.mark.parametrize(
    "name", ["memory.npz", "history.parquet", "fields/step-000001.nc", "manifest.json"]
)
def test_files_of_another_case_are_refused(histories, tmp_path, name):
    own, other = histories
    folder = shutil.copytree(own, tmp_path / "mixed")
    load_history(folder)
    shutil.copy(other / name, folder / name)
    with pytest.raises(UnreadableFile, match="another case"):
        load_history(folder)


@pytest.mark.parametrize(
    "name", ["memory.npz", "history.parquet", "fields/step-000001.nc", "manifest.json"]
)
def test_a_flipped_bit_in_a_history_is_refused_or_changes_nothing(histories, tmp_path, name):
    folder = shutil.copytree(histories[0], tmp_path / "damaged")
    content, history = (folder / name).read_bytes(), load_history(folder)
    for changed in with_flipped_bits(content, 1, 25):
        (folder / name).write_bytes(changed)
        try:
            again = load_history(folder)
        except UnreadableFile:
            continue
        assert again.table.equals(history.table)
        assert again.case == history.case


@pytest.mark.parametrize("body", [b"", b"a", bytes(range(256)) * 9])
def test_bytes_with_a_digest_are_returned_unchanged(body):
    packed = append_digest(body)
    assert strip_digest(packed, "content", "remedy") == body
    for damaged in (packed[:-1], packed[1:], b"x" + packed, body):
        with pytest.raises(UnreadableFile, match=r"content .*; remedy"):
            strip_digest(damaged, "content", "remedy")
