"""Files of a history, wear or study that are deleted, doubled or renamed are named."""

import json
import re
import shutil

import pytest

from asperity.case import load_case
from asperity.core.errors import BadInput, UnreadableFile
from asperity.core.storage import read_json, write_json
from asperity.paper import papers_case
from asperity.simulation import load_history, load_wear, run_history, run_wear
from asperity.study import load_study, plan_study, run_study, study_verdict

SMALL = {"grid.cells": [32, 24], "surface.correlation_length": "40 um"}
STANDING = {**SMALL, "contact.roughness": "standing"}
WEAR = '[wear]\nk = "3e-17 1/Pa"\n'


@pytest.fixture(scope="module")
def results(tmp_path_factory):
    """Folders with a history of four maps, worn surfaces and a study with maps."""
    pytest.importorskip("zarr", reason="the extra study is not installed")
    folder = tmp_path_factory.mktemp("results")
    run_history(
        papers_case().with_overrides(SMALL),
        steps=3,
        every=1,
        out=folder / "history",
        strict=False,
    )
    case = papers_case().with_overrides(STANDING)
    worn = load_case(f"{case.text}\n{WEAR}", folder=folder, name="wear.toml")
    run_wear(worn, hours=0.5, out=folder / "wear")
    swept = case.with_overrides({"study": {"sq": ["1 um", "2 um"], "seeds": 1}})
    run_study(plan_study(swept), out=folder / "study", workers=1, fields=("gap",))
    return folder


def described(kind, folder):
    """Return the numbers of a result, and its verdict or notes."""
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
    case = papers_case().with_overrides(STANDING)
    shutil.copytree(results / "wear", tmp_path / "wear")
    (tmp_path / "wear/memory.npz").unlink()
    worn = load_case(f"{case.text}\n{WEAR}", folder=results, name="wear.toml")
    with pytest.raises(BadInput, match=r"memory\.npz is missing; restore it"):
        run_wear(worn, hours=1.0, out=tmp_path / "wear")


def rewritten(folder, **entries):
    """Write other entries into a manifest, with a valid digest."""
    manifest = read_json(folder / "manifest.json", "")
    write_json(folder / "manifest.json", manifest | entries)


@pytest.mark.parametrize("kind", ["history", "wear", "study"])
@pytest.mark.parametrize(
    "entries",
    [
        {"versions": 5},
        {"versions": {}},
        {"source": None},
        {"case": None},
        {"case": "/etc/passwd"},
        {"case": [1]},
        {"case_folder": 5},
        {"case_folder": "a\0b"},
        {"case_folder": "\ud800"},
        {"digest": None, "design": None},
        {"points": 5, "digest": 5},
        {"seeds": "x" * 100_000, "digest": 5},
    ],
    ids=lambda entries: str(entries)[:40],
)
def test_a_manifest_of_other_types_is_refused_in_one_sentence(results, tmp_path, kind, entries):
    shutil.copytree(results / kind, tmp_path / kind)
    rewritten(tmp_path / kind, **entries)
    with pytest.raises(BadInput) as refused:
        described(kind, tmp_path / kind)
    assert len(str(refused.value)) < 500


def test_a_sparse_manifest_is_not_read(results, tmp_path):
    shutil.copytree(results / "history", tmp_path / "history")
    with (tmp_path / "history/manifest.json").open("ab") as file:
        file.truncate(1 << 40)
    with pytest.raises(UnreadableFile, match="is larger than 64 MB"):
        load_history(tmp_path / "history")
    shutil.copytree(results / "history", tmp_path / "second")
    with (tmp_path / "second/memory.npz").open("ab") as file:
        file.truncate(1 << 40)
    with pytest.raises(UnreadableFile, match="too much for a stored result"):
        load_history(tmp_path / "second")


def test_files_outside_the_folder_are_not_read(results, tmp_path):
    shutil.copytree(results / "history", tmp_path / "history")
    frame = tmp_path / "history/fields/step-000001.nc"
    frame.rename(tmp_path / "outside.nc")
    frame.symlink_to(tmp_path / "outside.nc")
    with pytest.raises(UnreadableFile, match="lists a file outside of it"):
        load_history(tmp_path / "history")
    shutil.copytree(results / "study", tmp_path / "study")
    group = next((tmp_path / "study/fields.zarr").glob("*/gap"))
    group.rename(tmp_path / "gap")
    group.symlink_to(tmp_path / "gap")
    study = load_study(tmp_path / "study")
    with pytest.raises(UnreadableFile, match="contains a link"):
        study.maps(group.parent.name)
