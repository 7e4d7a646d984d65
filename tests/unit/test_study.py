"""Studies on disk and in memory: each case is computed exactly once, and the result is independent
of the distribution of the work. All cases are small dry contacts.
"""

import json
import os
import shutil
import subprocess
import sys
from concurrent.futures import Future, ThreadPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from pathlib import Path

import numpy as np
import pandas
import pyarrow
import pytest

import asperity.study.execute as execution
from asperity.case import load_case
from asperity.core.errors import AsperityError, BadInput, UnreadableFile
from asperity.core.processes import cores
from asperity.core.storage import read_json, write_json, write_table
from asperity.results import RUN_GROUPS, solve_case
from asperity.study import (
    estimate_study,
    load_study,
    merge_studies,
    plan_points,
    plan_study,
    run_study,
)
from asperity.study.evaluate import case_at

EXAMPLES = Path(__file__).parents[2] / "examples"
DRY = {
    "lubricant": "none",
    "grid.x": [-1.9, 1.9],
    "grid.cells": [24, 24],
    "surface.correlation_length": "30 um",
    "vibration.duration": "0.1 s",
}


@pytest.fixture(scope="module")
def case():
    return load_case(EXAMPLES / "paper.toml").with_overrides(
        {**DRY, "study": {"sq": ["1 um", "2 um"], "seeds": 3}}
    )


@pytest.fixture(scope="module")
def plan(case):
    return plan_study(case)


@pytest.fixture(scope="module")
def executor():
    with ThreadPoolExecutor(2) as threads:
        yield threads


@pytest.fixture(scope="module")
def unbroken(plan, executor):
    return run_study(plan, executor=executor).table.drop(columns="seconds")


class FailingExecutor:
    """An executor whose process dies at given cases."""

    def __init__(self, deadly):
        self.deadly, self.broken = deadly, False

    def submit(self, function, *job):
        if self.broken:
            raise BrokenProcessPool("broken")
        future = Future()
        self.broken = any(overrides == deadly for overrides in job[2] for deadly in self.deadly)
        if self.broken:
            future.set_exception(BrokenProcessPool("killed"))
        else:
            future.set_result(function(*job))
        return future

    def shutdown(self, **_):
        pass


def assert_same(result, unbroken):
    pandas.testing.assert_frame_equal(
        result.table.drop(columns="seconds"), unbroken, check_exact=True
    )


def test_a_row_equals_the_solution_of_its_case(plan, unbroken):
    chosen = plan.cases[4]
    single = solve_case(plan.case.with_overrides(chosen.overrides))
    row = unbroken.iloc[4]
    assert row["case_id"] == chosen.id
    assert row["surface.sq"] == 2e-6
    quick = single.numbers([group for group in RUN_GROUPS if group not in ("own", "virgin")])
    scalars = {
        name: value for name, value in quick.items() if name != "seconds" and value is not None
    }
    assert {name: row[name] for name in scalars} == scalars
    assert row["crf_sound_hz"] == pytest.approx(3000, rel=0.5)
    assert row["crf_paper_hz"] == pytest.approx(row["crf_sound_hz"], rel=0.05)


def test_a_study_with_vibration_reports_the_contacts_stiffness_and_damping(case):
    """In a dry rough contact, yielded cells that respond elastically are stiffer than flowing ones,
    and damping is zero.
    """
    vibrating = case.with_overrides({"study": {"sq": ["2 um"], "kind": "shake"}})
    row = run_study(plan_study(vibrating)).table.iloc[0]
    chosen = {"surface.sq": "2 um", "surface.seed": int(row["surface.seed"])}
    single = solve_case(vibrating.with_overrides(chosen)).own_scalars
    assert row["contact_stiffness_n_m"] == single["contact_stiffness_n_m"]
    assert row["contact_stiffness_n_m"] > 1.1 * row["contact_stiffness_virgin_n_m"]
    assert row["contact_damping_ratio"] == 0.0
    assert row["crf_sound_hz"] > 0.0


def test_a_study_on_disk_equals_the_study_in_memory_and_resumes(plan, unbroken, executor, tmp_path):
    def stop(progress):
        if progress.done >= 2:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        run_study(plan, out=tmp_path, executor=executor, progress=stop)
    stored = load_study(tmp_path)
    assert 2 <= len(stored.table) < 6
    assert stored.missing == 6 - len(stored.table)
    result = run_study(plan, out=tmp_path, executor=executor)
    assert result.computed == stored.missing
    assert_same(result, unbroken)
    assert_same(load_study(tmp_path), unbroken)
    pandas.testing.assert_frame_equal(pandas.read_parquet(tmp_path / "table.parquet"), result.table)
    assert run_study(plan, out=tmp_path, executor=executor).computed == 0


def test_shards_make_up_the_study_in_one_folder_or_merged(plan, unbroken, executor, tmp_path):
    for k in (1, 2, 3):
        part = run_study(plan, out=tmp_path / f"{k}", executor=executor, shard=(k, 3))
        assert len(part.table) == 2
        run_study(plan, out=tmp_path / "together", executor=executor, shard=(k, 3))
    assert_same(load_study(tmp_path / "together"), unbroken)
    merge_studies(plan, [tmp_path / f"{k}" for k in (1, 2, 3)], out=tmp_path / "merged")
    merged = run_study(plan, out=tmp_path / "merged", executor=executor)
    assert merged.computed == 0
    assert_same(merged, unbroken)


def test_partial_files_of_a_crash_are_removed_and_their_cases_recomputed(
    plan, unbroken, executor, tmp_path
):
    run_study(plan, out=tmp_path, executor=executor)
    part = next((tmp_path / "parts").glob("*.parquet"))
    (tmp_path / "parts" / f".{part.name}.123.part").write_bytes(
        part.read_bytes()[:100]
    )  # killed while writing
    part.unlink()
    result = run_study(plan, out=tmp_path, executor=executor)
    assert result.computed > 0
    assert_same(result, unbroken)
    assert not list(tmp_path.rglob("*.part"))


def test_a_damaged_part_is_named(plan, executor, tmp_path):
    run_study(plan, out=tmp_path, executor=executor)
    part = next((tmp_path / "parts").glob("*.parquet"))
    part.write_bytes(part.read_bytes()[:-50])
    with pytest.raises(UnreadableFile, match=f"{part.name} is damaged.*delete it"):
        run_study(plan, out=tmp_path, executor=executor)


def test_a_case_that_kills_its_process_fails_alone(plan, unbroken, monkeypatch, tmp_path):
    deadly = plan.cases[3].overrides
    monkeypatch.setattr(execution, "_pool", lambda _: FailingExecutor([deadly]))
    result = run_study(plan, out=tmp_path, workers=2)
    assert list(result.failures["number"]) == [3]
    assert "process that computed it died" in result.failures["reason"].iloc[0]
    pandas.testing.assert_frame_equal(
        result.table.drop(index=3).drop(columns="seconds"),
        unbroken.drop(index=3),
        check_dtype=False,
    )
    monkeypatch.setattr(execution, "_pool", lambda _: FailingExecutor([]))
    assert run_study(plan, out=tmp_path, workers=2).computed == 0
    recomputed = run_study(plan, out=tmp_path, workers=2, retry_failed=True)
    assert recomputed.computed == 1
    assert_same(recomputed, unbroken)


def test_a_refused_case_is_a_row_with_its_reason(case, executor):
    plan = plan_points(case, [{"surface.sq": "1 um"}, {"surface.correlation_length": "3 um"}])
    result = run_study(plan, executor=executor)
    assert result.failed == 1
    assert "correlation length along x must be at least 2 cells" in result.table["reason"][1]
    assert result.table["clr"].isna().tolist() == [False, True]


def test_more_levels_and_seeds_extend_a_study(case, plan, executor, tmp_path):
    run_study(plan, out=tmp_path, executor=executor)
    wider = plan_study(case.with_overrides({"study": {"sq": ["1 um", "2 um", "3 um"], "seeds": 4}}))
    result = run_study(wider, out=tmp_path, executor=executor)
    assert len(result.table) == 12
    assert result.computed == 6


def test_another_case_in_the_folder_is_refused(case, plan, executor, tmp_path):
    run_study(plan, out=tmp_path, executor=executor)
    other = plan_study(case.with_overrides({"contact.load": "400 N"}))
    with pytest.raises(BadInput, match="holds a study of another case"):
        run_study(other, out=tmp_path, executor=executor)
    manifest = json.loads((tmp_path / "manifest.json").read_text())
    manifest["versions"]["asperity"] = "0.0.1"
    del manifest["seal"]
    write_json(tmp_path / "manifest.json", manifest)
    with pytest.raises(BadInput, match=r"was computed by asperity 0\.0\.1"):
        run_study(plan, out=tmp_path, executor=executor)


def test_ids_that_do_not_match_the_points_are_refused(plan, executor, tmp_path):
    run_study(plan, out=tmp_path, executor=executor)
    manifest = read_json(tmp_path / "manifest.json", "")
    manifest["ids"][:2] = reversed(manifest["ids"][:2])
    write_json(tmp_path / "manifest.json", manifest)
    with pytest.raises(UnreadableFile, match="damaged"):
        load_study(tmp_path)


def test_a_study_of_another_version_can_still_be_read(plan, unbroken, executor, tmp_path):
    run_study(plan, out=tmp_path, executor=executor)
    manifest = json.loads((tmp_path / "manifest.json").read_text())
    manifest["versions"]["asperity"], manifest["design"] = (
        "0.0.1",
        "design of a case file with other keys",
    )
    renamed = {old: f"{number:016x}" for number, old in enumerate(manifest["ids"])}
    manifest["ids"] = list(renamed.values())
    del manifest["seal"]
    write_json(tmp_path / "manifest.json", manifest)
    for part in (tmp_path / "parts").glob("*.parquet"):
        table = pandas.read_parquet(part)
        table["case_id"] = table["case_id"].map(renamed)
        write_table(
            part, pyarrow.Table.from_pandas(table, preserve_index=False), manifest["design"]
        )
    table = load_study(tmp_path).table.drop(columns=["case_id", "seconds"])
    pandas.testing.assert_frame_equal(table, unbroken.drop(columns="case_id"))


def test_two_processes_do_not_compute_in_one_folder(plan, executor, tmp_path):
    def start_second_run(_):
        with pytest.raises(BadInput, match="another process computes this study"):
            run_study(plan, out=tmp_path, executor=executor)
        with pytest.raises(BadInput, match="another process computes this study"):
            run_study(plan, out=tmp_path, executor=executor, shard=(1, 2))

    run_study(plan, out=tmp_path, executor=executor, progress=start_second_run)


def test_a_full_disk_is_reported_and_no_result_is_lost(
    plan, unbroken, executor, tmp_path, monkeypatch
):
    run_study(plan, out=tmp_path, executor=executor, shard=(1, 3))
    before = load_study(tmp_path).table
    fsync = os.fsync

    def fail(_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "fsync", fail)
    with pytest.raises(AsperityError, match="No space left on device; nothing was left behind"):
        run_study(plan, out=tmp_path, executor=executor)
    monkeypatch.setattr(os, "fsync", fsync)
    pandas.testing.assert_frame_equal(load_study(tmp_path).table, before)
    assert_same(run_study(plan, out=tmp_path, executor=executor), unbroken)


def test_stored_fields_equal_those_of_the_solution(plan, executor, tmp_path):
    import zarr

    run_study(plan, out=tmp_path, executor=executor, fields=("pressure", "in_contact"))
    chosen = plan.cases[2]
    group = zarr.open_group(tmp_path / "fields.zarr", mode="r")
    assert sorted(group.group_keys()) == sorted(case.id for case in plan.cases)
    solution = solve_case(plan.case.with_overrides(chosen.overrides)).solution
    assert (group[f"{chosen.id}/pressure"][:] == solution.pressure).all()
    assert (group[f"{chosen.id}/in_contact"][:] == solution.in_contact).all()
    assert group[f"{chosen.id}/pressure"].chunks == solution.pressure.shape
    maps = load_study(tmp_path).maps(chosen.id)
    assert sorted(maps) == ["in_contact", "pressure"]
    assert (maps["pressure"] == solution.pressure).all()


@pytest.fixture(scope="module")
def mapped(case, executor, tmp_path_factory):
    """Folders of two studies with stored maps that differ in their load."""
    folders = []
    for load in ("500 N", "400 N"):
        plan = plan_study(
            case.with_overrides({"contact.load": load, "study": {"sq": ["1 um"], "seeds": 1}})
        )
        folders.append(tmp_path_factory.mktemp("mapped") / "study")
        run_study(plan, out=folders[-1], executor=executor, fields=("pressure", "gap"))
    return folders


def map_files(folder):
    result = load_study(folder)
    case_id = str(result.table["case_id"][0])
    group = folder / "fields.zarr" / case_id
    return result, case_id, sorted(path for path in group.rglob("*") if path.is_file())


def test_a_flipped_bit_in_any_file_of_a_map_is_refused_or_changes_nothing(mapped):
    result, case_id, files = map_files(mapped[0])
    original = result.maps(case_id)
    assert len(files) == 5  # metadata of the group; metadata and one chunk of each of 2 maps
    rng = np.random.default_rng(1)
    refused = 0
    for path in files:
        intact = path.read_bytes()
        for bit in rng.integers(8 * len(intact), size=12):
            changed = bytearray(intact)
            changed[bit // 8] ^= 1 << bit % 8
            path.write_bytes(changed)
            try:
                reloaded = result.maps(case_id)
            except UnreadableFile:
                refused += 1
            else:
                assert {name: reloaded[name].tobytes() for name in reloaded} == {
                    name: original[name].tobytes() for name in original
                }
        path.write_bytes(intact)
    assert refused > 40
    result.maps(case_id)


def test_a_missing_exchanged_or_foreign_map_is_refused(mapped, tmp_path):
    folder = shutil.copytree(mapped[0], tmp_path / "study")
    result, case_id, _ = map_files(folder)
    group = folder / "fields.zarr" / case_id
    (group / "pressure").rename(group / "other")
    with pytest.raises(UnreadableFile, match="digest mismatch"):
        result.maps(case_id)
    (group / "other").rename(group / "pressure")
    (group / "gap" / "c" / "0" / "0").unlink()  # zarr reads a missing chunk as zeros
    with pytest.raises(UnreadableFile, match="digest mismatch"):
        result.maps(case_id)
    shutil.rmtree(group)
    shutil.copytree(mapped[1] / "fields.zarr" / map_files(mapped[1])[1], group)
    with pytest.raises(UnreadableFile, match="another study"):
        result.maps(case_id)
    shutil.rmtree(group)
    with pytest.raises(UnreadableFile, match="has no maps"):
        result.maps(case_id)
    with pytest.raises(BadInput, match="no finished case"):
        result.maps("../parts")


def test_a_map_that_declares_too_large_a_shape_is_refused_before_it_is_read(mapped, tmp_path):
    folder = shutil.copytree(mapped[0], tmp_path / "study")
    result, case_id, _ = map_files(folder)
    metadata = folder / "fields.zarr" / case_id / "gap" / "zarr.json"
    content = json.loads(metadata.read_text())
    metadata.write_text(json.dumps({**content, "shape": [10**6, 10**6]}))
    with pytest.raises(UnreadableFile, match="declares 8e"):
        result.maps(case_id)


def test_other_readers_detect_damage_of_a_map_too(mapped, tmp_path):
    import zarr

    folder = shutil.copytree(mapped[0], tmp_path / "study")
    _, case_id, _ = map_files(folder)
    chunk = folder / "fields.zarr" / case_id / "gap" / "c" / "0" / "0"
    intact = chunk.read_bytes()
    chunk.write_bytes(intact[:50] + bytes([intact[50] ^ 1]) + intact[51:])
    with pytest.raises(Exception, match="checksum"):
        zarr.open_array(folder / "fields.zarr" / case_id / "gap", mode="r")[...]


def test_stored_runs_have_the_numbers_of_the_table(plan, executor, tmp_path, monkeypatch):
    monkeypatch.setattr("asperity.study.execute.require_zarr", pytest.fail)  # not needed for runs
    result = run_study(plan, out=tmp_path, executor=executor, fields=["run"])
    for row in result.table.itertuples():
        numbers = result.run(row.case_id).numbers(["load"])
        assert numbers["clr"] == row.clr
        assert numbers["car"] == row.car
    case_id = result.table["case_id"][0]
    file = tmp_path / "runs" / f"{case_id}.nc"
    file.write_bytes(file.read_bytes()[:-1])
    with pytest.raises(UnreadableFile, match="truncated or modified"):
        result.run(case_id)
    file.unlink()
    with pytest.raises(UnreadableFile, match="has no run of case"):
        result.run(case_id)
    with pytest.raises(BadInput, match="no finished case"):
        result.run("../parts")


def test_progress_counts_every_case_once(plan, executor):
    entries = []
    run_study(plan, executor=executor, progress=entries.append)
    assert [entries[0].done, entries[-1].done] == [0, 6]
    assert entries[0].seconds_left is None
    assert entries[-1].seconds_left == 0.0
    assert sorted(entry.done for entry in entries) == [entry.done for entry in entries]


def test_a_dry_run_estimates_the_remaining_cases_and_stores_nothing(plan, executor, tmp_path):
    run_study(plan, out=tmp_path / "existing", executor=executor, shard=(1, 2))
    cost = estimate_study(plan, out=tmp_path / "existing", workers=2)
    assert (cost.cases, cost.kept, cost.tried) == (6, 3, 3)
    assert cost.start_s >= 2.0
    assert cost.seconds == pytest.approx(3 * cost.case_s / min(2, cores()) + cost.start_s)
    assert estimate_study(plan, out=tmp_path / "missing", workers=1).kept == 0
    assert not (tmp_path / "missing").exists()


@pytest.mark.parametrize(
    ("settings", "sentence"),
    [
        ({"shard": (0, 3)}, "shard must be k/N"),
        ({"workers": 0}, "workers must be positive"),
        (
            {"fields": ("gap", "colour")},
            "fields must be among pressure, gap, in_contact, surface_height, run, got colour",
        ),
    ],
)
def test_invalid_settings_are_refused(plan, tmp_path, settings, sentence):
    with pytest.raises(BadInput, match=sentence):
        run_study(plan, out=tmp_path, **settings)


def test_fields_that_a_kind_does_not_have_are_refused(case, tmp_path):
    vibrating = plan_study(case.with_overrides({"study.kind": "vibrate"}))
    with pytest.raises(BadInput, match="kind 'vibrate' has no field gap; leave it out"):
        run_study(vibrating, out=tmp_path, fields=["gap"])


def test_a_folder_without_a_study_is_refused(tmp_path):
    with pytest.raises(UnreadableFile, match="holds no study"):
        load_study(tmp_path)
    (tmp_path / "manifest.json").write_text("{}")
    with pytest.raises(UnreadableFile, match="has no digest"):
        load_study(tmp_path)
    write_json(tmp_path / "manifest.json", {"of": "history"})
    with pytest.raises(UnreadableFile, match="is not a study manifest"):
        load_study(tmp_path)


def test_a_script_that_workers_cannot_import_is_reported_and_no_case_is_marked_failed(
    case, tmp_path
):
    (tmp_path / "case.toml").write_text(case.text)
    script = tmp_path / "script.py"
    script.write_text(
        "import asperity as asp\n"
        # without a __main__ guard
        "asp.run_study(asp.study.plan_study(asp.load_case('case.toml')), out='out', workers=1)\n"
    )
    completed = subprocess.run(
        [sys.executable, script], cwd=tmp_path, capture_output=True, text=True, timeout=100
    )
    assert completed.returncode == 1
    assert 'under if __name__ == "__main__":, or give executor' in completed.stderr
    assert not list((tmp_path / "out" / "parts").glob("*"))


def test_a_finished_study_can_be_loaded_without_its_measured_surface(case, executor, tmp_path):
    heights = np.random.default_rng(1).normal(scale=1e-7, size=(40, 40))
    np.savetxt(tmp_path / "worn.txt", heights, fmt="%.6e")
    surface = {"file": str(tmp_path / "worn.txt"), "pixel": "5 um", "unit": "m", "fit": "tile"}
    plan = plan_study(
        case.with_overrides({"surface": surface, "study": {"load": ["200 N"], "seeds": 2}})
    )
    stored = run_study(plan, out=tmp_path / "study", executor=executor)
    assert not stored.failed
    (tmp_path / "worn.txt").unlink()
    pandas.testing.assert_frame_equal(load_study(tmp_path / "study").table, stored.table)


SWEPT = {
    "grid": {"cells": [[24, 24], [32, 24]]},
    "material": {"hardness": ["1 GPa", "none"]},
    "surface": [
        {"kind": "flat"},
        {"kind": "gaussian", "sq": "1 um", "correlation_length": "30 um"},
    ],
}


@pytest.mark.parametrize(
    ("key", "swept", "written"),
    [
        ("grid.cells", SWEPT["grid"], ["[24.0, 24.0]", "[32.0, 24.0]"]),
        ("material.hardness", SWEPT["material"], ["1000000000.0", "none"]),
        ("surface", SWEPT["surface"], [json.dumps(table) for table in SWEPT["surface"]]),
    ],
)
def test_swept_pairs_tables_and_mixed_values_become_text_columns(
    case, executor, tmp_path, key, swept, written
):
    plan = plan_study(case.with_overrides({"study": {key.partition(".")[0]: swept}}))
    result = run_study(plan, out=tmp_path, executor=executor)
    assert list(pandas.read_parquet(tmp_path / "table.parquet")[key]) == written
    assert list(load_study(tmp_path).table[key]) == written
    assert not result.failed


def test_inlet_shear_heating_is_computed_at_every_point_or_at_none():
    """The base case decides, so that no step of the film lies between two points."""
    paper = load_case(EXAMPLES / "paper.toml")
    slow = paper.with_overrides({"contact.entrainment_speed": "1 m/s"})
    fast = paper.with_overrides({"contact.entrainment_speed": "8 m/s"})
    speeds = ({"contact.entrainment_speed": f"{speed} m/s"} for speed in (1, 8))
    for point in speeds:
        assert case_at(slow, point).thermal.inlet_heating is False
        assert case_at(fast, point).thermal.inlet_heating is True
    stated = slow.with_overrides({"thermal.inlet_heating": True})
    assert case_at(stated, {}).thermal.inlet_heating is True
    assert case_at(slow, {"thermal.inlet_heating": True}).thermal.inlet_heating is True
