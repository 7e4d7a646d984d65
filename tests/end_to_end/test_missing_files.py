"""Files of a history, wear or study that are deleted, doubled or renamed are named."""

import json
import re
import shutil

import pytest

from asperity.case import load_case
from asperity.core.errors import BadInput, UnreadableFile
from asperity.paper import papers_case
from asperity.simulation import load_history, load_wear, run_history, run_wear
from asperity.study import load_study, plan_study, run_study, study_verdict

SMALL = {"grid.cells": [32, 24], "surface.correlation_length": "40 um"}
WEAR = '[wear]\nk = "3e-17 1/Pa"\n'


@pytest.fixture(scope="module")
def results(tmp_path_factory):
    """Folders with a history of four maps, worn surfaces and a study with maps."""
    pytest.importorskip("zarr", reason="the extra study is not installed")
    folder = tmp_path_factory.mktemp("results")
    case = papers_case().with_overrides(SMALL)
    run_history(case, steps=3, every=1, out=folder / "history", strict=False)
    worn = load_case(f"{case.text}\n{WEAR}", folder=folder, name="wear.toml")
    run_wear(worn, hours=0.5, out=folder / "wear")
    swept = case.with_overrides({"study": {"sq": ["1 um", "2 um"], "seeds": 1}})
    run_study(plan_study(swept), out=folder / "study", workers=1, fields=("gap",))
    return folder


def described(kind, folder):
    """Return the numbers of a result, and what a reader of verdict and report is told."""
    if kind == "study":
        result = load_study(folder)
        remarks = study_verdict(result)
        maps = []
        for case_id in result.table["case_id"]:
            try:
                maps.append(result.maps(case_id)["gap"].sum())
            except UnreadableFile as error:
                remarks += str(error)
        return [result.table.to_csv(), maps], remarks
    result = (load_history if kind == "history" else load_wear)(folder)
    numbers = json.dumps(result.scalars(), default=str, sort_keys=True)
    return [numbers.replace(str(folder), ""), len(result.frames)], " ".join(result.notes)


def next_name(path):
    """Return the name of the following map, or another name."""
    number = re.search(r"\d{3,}", path.name)
    if number is None:
        return path.with_name(f"copy-{path.name}")
    return path.with_name(
        path.name.replace(number[0], str(int(number[0]) + 1).zfill(len(number[0])))
    )


def delete(path):
    path.unlink()


def double(path):
    shutil.copy(path, next_name(path))


def rename(path):
    path.replace(next_name(path))


def swap(path):
    """Exchange a file with the next one."""
    content, following = path.read_bytes(), next_name(path)
    if following.exists():
        path.write_bytes(following.read_bytes())
        following.write_bytes(content)


@pytest.mark.parametrize("change", [delete, double, rename, swap])
@pytest.mark.parametrize("kind", ["history", "wear", "study"])
def test_a_changed_file_is_named_or_has_no_effect(results, tmp_path, kind, change):
    expected, remarks = described(kind, results / kind)
    whole = results / kind
    files = [path.relative_to(whole) for path in whole.rglob("[!.]*") if path.is_file()]
    assert len(files) > 6
    named = 0
    for name in files:
        folder = tmp_path / kind
        shutil.copytree(whole, folder)
        change(folder / name)
        try:
            numbers, later = described(kind, folder)
        except UnreadableFile as error:
            numbers, later = expected, str(error)
        shutil.rmtree(folder)
        is_named = name.name in later or len(later) != len(remarks)
        assert is_named or numbers == expected, name
        named += is_named
    assert named or (kind, change) in (("study", double), ("study", swap))


def test_a_run_without_its_state_is_not_resumed(results, tmp_path):
    case = papers_case().with_overrides(SMALL)
    shutil.copytree(results / "history", tmp_path / "history")
    (tmp_path / "history/memory.npz").unlink()
    with pytest.raises(UnreadableFile, match=r"memory\.npz is missing; restore it"):
        run_history(case, steps=4, every=1, out=tmp_path / "history", strict=False)
    shutil.copytree(results / "wear", tmp_path / "wear")
    (tmp_path / "wear/memory.npz").unlink()
    worn = load_case(f"{case.text}\n{WEAR}", folder=results, name="wear.toml")
    with pytest.raises(BadInput, match=r"memory\.npz is missing; restore it"):
        run_wear(worn, hours=1.0, out=tmp_path / "wear")
