"""Wear histories in a folder: resuming after a kill, extension, parallel workers, refusals."""

import shutil
import signal
import subprocess
import sys
import time
from dataclasses import replace
from io import BytesIO
from pathlib import Path

import numpy as np
import pandas
import pytest

from asperity import read_surface, run_wear
from asperity.core.errors import AsperityError, BadInput, NotConverged, UnreadableFile
from asperity.core.storage import read_with_digest, write_with_digest
from asperity.core.third_party import surface_topography
from asperity.paper import RigSettings, simulate_rig, write_rig
from asperity.simulation import WearHistory, WearProgress, body_column, folder, load_wear
from asperity.simulation.wear import frames, store
from asperity.simulation.wear.frames import is_kept
from asperity.simulation.wear.state import WearState
from asperity.surface import height_parameters
from asperity.wear import surfaces_at
from support.wearing import CASE, POINT, worn_case

HOURS = 0.6
TWO = {"wear.patches": 2}  # positions per jump, for short runs


class Stop(Exception):
    """Raised to interrupt a run."""


def case(overrides: dict[str, object] | None = None):
    return worn_case({**TWO, "wear.step": 0.1, **(overrides or {})})


def assert_same(actual: WearHistory, expected: WearHistory) -> None:
    pandas.testing.assert_frame_equal(actual.table, expected.table, check_exact=True)
    for a, b in (
        (actual.final_surfaces.first, expected.final_surfaces.first),
        (actual.final_surfaces.second, expected.final_surfaces.second),
    ):
        np.testing.assert_array_equal(a.heights, b.heights)
    assert actual.worn_volume == expected.worn_volume


@pytest.fixture(scope="module")
def unbroken() -> WearHistory:
    return run_wear(case(), hours=HOURS)


def test_a_run_stopped_at_any_jump_resumes_bit_for_bit(unbroken, tmp_path, monkeypatch):
    monkeypatch.setattr(folder, "SAVE_INTERVAL_S", 0.0)
    jumps = len(unbroken.table) - 1
    assert jumps >= 10
    rng = np.random.default_rng(3)
    for when in [1, *sorted(rng.choice(np.arange(2, jumps), 3, replace=False)), jumps]:

        def stop(progress: WearProgress, when: int = int(when)) -> None:
            if progress.row["jump"] == when:
                raise Stop

        with pytest.raises(Stop):
            run_wear(case(), hours=HOURS, out=tmp_path / "worn", progress=stop)
    again = run_wear(case(), hours=HOURS, out=tmp_path / "worn")
    assert again.computed < jumps
    assert_same(again, unbroken)
    assert_same(load_wear(tmp_path / "worn"), unbroken)
    assert run_wear(case(), hours=HOURS, out=tmp_path / "worn").computed == 0


def test_a_killed_run_resumes_to_the_same_result(unbroken, tmp_path):
    """Killed by the system after its first save, and again after the first save once resumed."""
    (tmp_path / "case.toml").write_text(CASE + "patches = 2\nstep = 0.1\n", "utf-8")
    program = (
        "from asperity.simulation import folder; folder.SAVE_INTERVAL_S = 0.0; "
        "from asperity.cli import main; main()"
    )
    command = [sys.executable, "-c", program, "wear", "case.toml", "--hours", f"{HOURS:g}"]
    table, saved = tmp_path / "worn" / store.LAYOUT.table, None
    for _ in range(2):
        process = subprocess.Popen(
            [*command, "--out", "worn", "--quiet"],
            cwd=tmp_path,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )
        while process.poll() is None and (not table.exists() or table.read_bytes() == saved):
            time.sleep(0.02)
        process.send_signal(signal.SIGKILL)
        assert process.wait() == -signal.SIGKILL  # it had not ended yet
        saved = table.read_bytes()
    again = run_wear(case(), hours=HOURS, out=tmp_path / "worn")
    assert 0 < again.computed < len(unbroken.table) - 1
    assert_same(again, unbroken)


def test_an_extended_run_equals_a_run_of_the_full_duration(unbroken, tmp_path):
    short = run_wear(case(), hours=0.55 * HOURS, out=tmp_path / "worn")
    assert short.hours == pytest.approx(0.55 * HOURS, rel=1e-12, abs=0.0)
    assert_same(run_wear(case(), hours=HOURS, out=tmp_path / "worn"), unbroken)
    with pytest.raises(BadInput, match=r"holds .* h of wear, got 0.1 h"):
        run_wear(case(), hours=0.1, out=tmp_path / "worn")


def test_fewer_hours_than_stored_are_refused_and_files_stay_unchanged(tmp_path):
    """Also for a time between the last two jumps."""
    stored = run_wear(case(), hours=0.5, out=tmp_path / "worn")
    files = [
        path
        for path in (tmp_path / "worn").rglob("*")
        if path.is_file() and path.name != folder.LOCK
    ]
    before = [path.read_bytes() for path in files]
    last = float(stored.table["hours"].iloc[-2])
    with pytest.raises(BadInput, match=r"holds 0.5 h of wear, got 0.\d+ h"):
        run_wear(case(), hours=0.5 * (last + 0.5), out=tmp_path / "worn")
    assert [path.read_bytes() for path in files] == before
    assert_same(load_wear(tmp_path / "worn"), stored)


def test_the_number_of_workers_does_not_change_the_result():
    """Over three jumps of moving roughness; every jump distributes its contacts in one way."""
    running = case({"contact.roughness": "running"})
    assert_same(run_wear(running, hours=0.2, workers=2), run_wear(running, hours=0.2, workers=1))


def test_other_software_opens_the_surface_files(tmp_path):
    worn = run_wear(case(), hours=0.2, out=tmp_path / "worn")
    assert [path.name for path in worn.files] == [
        "first-before.x3p",
        "first-after.x3p",
        "second-before.x3p",
        "second-after.x3p",
    ]
    for path, surface in zip(
        worn.files[:2], (worn.initial_surfaces.first, worn.final_surfaces.first), strict=True
    ):
        topography = surface_topography().open_topography(str(path)).topography()
        assert topography.unit == "m"
        np.testing.assert_array_equal(topography.heights(), surface.heights)
        np.testing.assert_allclose(topography.physical_sizes, surface.grid.extent, rtol=1e-12)
        surface_read = read_surface(path)
        np.testing.assert_array_equal(surface_read.heights, surface.heights)
        row = worn.table.iloc[0 if "before" in path.name else -1]
        parameters = height_parameters(surface_read)
        for key, value in (
            ("sq_m", parameters.sq),
            ("spk_m", parameters.spk),
            ("ssk", parameters.ssk),
        ):
            assert row[body_column(key, 0)] == pytest.approx(value, rel=1e-9, abs=0.0)


def test_values_are_interpolated_between_rows(unbroken):
    table = unbroken.table
    between = unbroken.values_at(0.5 * (table["hours"][3] + table["hours"][4]))
    assert between["clr"] == pytest.approx(0.5 * (table["clr"][3] + table["clr"][4]))
    assert unbroken.state(0.0).clr == table["clr"][0]
    with pytest.raises(BadInput, match=r"got 1\.1 h"):
        unbroken.values_at(HOURS + 0.5)


def test_the_interval_of_k_rescales_time(unbroken):
    """A run with k at the end of its interval reproduces the stated bound."""
    band = unbroken.interval_by_k("sq_m")
    slow, fast = unbroken.k_interval
    assert (slow, fast) == pytest.approx((np.exp(-0.8224), np.exp(0.8224)), rel=1e-4, abs=0.0)
    known = band[band["low"].notna()].iloc[-1]
    faster = run_wear(case({"wear.k": f"{1e-16 * fast!r} 1/Pa"}), hours=HOURS)
    assert known["low"] == pytest.approx(
        faster.values_at(float(known["hours"]))["sq_m"], rel=2e-3, abs=0.0
    )
    low, high = unbroken.volume_interval(0)
    assert low < unbroken.worn_volume[0] < high
    later = faster.worn_volume[0]  # also that of k after HOURS * fast
    assert later < high < 1.75 * later  # wear slows down; the interval extrapolates the last rate
    assert run_wear(case({"wear.flattening": True}), hours=1e-4).interval_by_k("sq_m") is None


def test_the_film_defect_law_runs_with_its_own_parameters():
    """With this k, bare metal needs thousands of jumps under Archard's law; here few sites are
    bare.
    """
    defects = {"wear.law": "film-defect", "wear.k": "severe"}
    assert len(run_wear(case(defects), hours=10.0).table) < 20


def test_flattening_is_reported_separately_from_wear():
    soft = {"wear.flattening": True, "material.hardness": "1 GPa", "wear.k": "0 1/Pa"}
    worn = run_wear(case(soft), hours=0.01)
    assert worn.worn_volume == (0.0, 0.0)
    assert worn.table["flattened_1_m"].iloc[-1] > 1e-9
    assert worn.table["clr"].iloc[-1] < worn.table["clr"].iloc[0]
    assert worn.final_surfaces.first.sq < worn.initial_surfaces.first.sq
    np.testing.assert_array_equal(
        worn.final_surfaces.second.heights, worn.initial_surfaces.second.heights
    )  # the smooth lower body


def test_invalid_runs_are_refused_and_leave_no_files(tmp_path):
    with pytest.raises(BadInput, match=r"add \[wear\] with k"):
        run_wear(case({"wear": "none"}), hours=1.0)
    with pytest.raises(BadInput, match="hours of wear must be positive"):
        run_wear(case(), hours=0.0, out=tmp_path / "worn")
    with pytest.raises(
        BadInput, match=r"wear of 10000 h in .* jumps would take about .*; reduce it"
    ):
        run_wear(case({"wear.k": "1e-9 1/Pa"}), hours=1e4, out=tmp_path / "worn")
    assert not (tmp_path / "worn").exists()
    (tmp_path / "other").mkdir()
    (tmp_path / "other" / "thing").touch()
    with pytest.raises(BadInput, match="is not empty and holds no wear history"):
        run_wear(case(), hours=1.0, out=tmp_path / "other")


def test_a_folder_of_another_case_or_a_damaged_one_is_refused(tmp_path):
    run_wear(case(), hours=0.05, out=tmp_path / "worn")
    with pytest.raises(BadInput, match="holds the wear history of another case"):
        run_wear(case({"contact.load": "400 N"}), hours=0.05, out=tmp_path / "worn")
    for name in (store.END, store.LAYOUT.table, store.MEMORY):
        shutil.copytree(tmp_path / "worn", tmp_path / name)
        path: Path = tmp_path / name / name
        content = bytearray(path.read_bytes())
        third = len(content) // 3  # single bytes of a table may be unused
        content[third : 2 * third] = bytes(byte ^ 1 for byte in content[third : 2 * third])
        path.write_bytes(content)
        with pytest.raises(UnreadableFile, match="damaged"):
            run_wear(case(), hours=0.1, out=tmp_path / name)
    (tmp_path / "worn" / store.END).unlink()
    with pytest.raises(UnreadableFile, match="holds an unfinished wear history"):
        load_wear(tmp_path / "worn")


def test_unsolvable_contacts_stop_the_run_with_a_reason(tmp_path):
    iteration_limit = {"solver.max_iterations": 1, "solver.tolerance": 1e-6}
    with pytest.raises(
        NotConverged, match=r"2 of 2 contacts .*; raise solver.tolerance or solver.max_iterations$"
    ):
        run_wear(case(iteration_limit), hours=1.0)
    with pytest.raises(
        NotConverged, match=r"2 of 2 contacts could not be solved after 0 h: contact not solved"
    ):
        run_wear(case(iteration_limit), hours=1.0, out=tmp_path / "worn")


def test_an_unsolvable_standing_body_raises_a_message_with_remedies():
    """It has one position, solved from a cold start: a retry would fail in the same way."""
    iteration_limit = {"solver.max_iterations": 1, "solver.tolerance": 1e-6, "contact.slip": 2.0}
    iteration_limit |= {"motion.rough": "second"}
    with pytest.raises(
        NotConverged,
        match=r"1 of 1 contacts .*; raise solver.tolerance or solver.max_iterations, .*",
    ):
        run_wear(case(iteration_limit), hours=1.0)


def test_a_contact_that_outgrows_its_grid_stops_the_run():
    narrow = {"contact.load": "60 N", "lubricant": "none", "surface": "flat", "grid.y": [-1.6, 1.6]}
    narrow["wear.step"] = 0.2
    with pytest.raises(
        AsperityError, match=r"as wide as its grid after .* h; state a wider grid.y"
    ):
        run_wear(worn_case(TWO | narrow, POINT), hours=10.0)


def test_a_rig_records_a_contact_as_it_wears(unbroken, tmp_path):
    rig = simulate_rig(
        RigSettings(repeats=2, repeat_std_hz=0.0),
        case=unbroken.case,
        moments=unbroken.moments([0.0, HOURS]),
    )
    assert [recording.sample for recording in rig.recordings] == [1, 1, 2, 2]
    for recording, hours in zip(rig.recordings[::2], (0.0, HOURS), strict=True):
        moment = unbroken.values_at(hours)
        assert recording.clr == pytest.approx(moment["clr"])
        assert recording.crf_hz == pytest.approx(moment["crf_hz"], rel=1e-9, abs=0.0)
        assert recording.true_sq_m == pytest.approx(moment["sq_m"])
        assert abs(recording.sq_m - recording.true_sq_m) < 1e-7
    write_rig(rig, tmp_path / "rig")
    table = pandas.read_csv(tmp_path / "rig" / "table.csv")
    assert table["hours"].tolist() == [0.0, 0.0, HOURS, HOURS]
    assert table.columns[1] == "hours"  # the column that `asperity track` uses as x
    assert len(unbroken.moments()) == 12


def test_killing_a_longer_run_leaves_the_shorter_one_unchanged(tmp_path, monkeypatch):
    """Rows, end state and surface files stay consistent and exclude the rows of the longer run."""
    monkeypatch.setattr(folder, "SAVE_INTERVAL_S", 0.0)
    short = run_wear(case(), hours=0.4, out=tmp_path / "worn")
    last = int(short.table["jump"].iloc[-1])
    files = [path.read_bytes() for path in short.files]

    def stop(progress: WearProgress) -> None:
        if progress.row["jump"] == last + 2:
            raise Stop

    with pytest.raises(Stop):
        run_wear(case(), hours=HOURS, out=tmp_path / "worn", progress=stop)
    again = load_wear(tmp_path / "worn")
    assert_same(again, short)
    assert [path.read_bytes() for path in again.files] == files
    assert again.table["hours"].iloc[-1] == 0.4


def test_a_folder_with_another_layout_is_refused(tmp_path, monkeypatch):
    """By its version number or, if the number was not raised, by the content of its files."""
    with monkeypatch.context() as before:
        older = replace(store.LAYOUT, version=store.LAYOUT.version - 1)
        before.setattr(store, "LAYOUT", older)
        run_wear(case(), hours=0.05, out=tmp_path / "old")
    for opened in (
        lambda: load_wear(tmp_path / "old"),
        lambda: run_wear(case(), hours=0.1, out=tmp_path / "old"),
    ):
        with pytest.raises(
            UnreadableFile,
            match="not a wear manifest that this version of asperity can read; choose another",
        ):
            opened()
    run_wear(case(), hours=0.05, out=tmp_path / "worn")
    for name in (store.MEMORY, store.END):
        shutil.copytree(tmp_path / "worn", tmp_path / name)
        with np.load(BytesIO(read_with_digest(tmp_path / "worn" / name, ""))) as packed:
            arrays = {key: packed[key] for key in packed.files}
        arrays["numbers"] = arrays["numbers"][:5]
        shorter = BytesIO()
        np.savez(shorter, **arrays)
        write_with_digest(tmp_path / name / name, shorter.getvalue())
        with pytest.raises(
            UnreadableFile,
            match=(
                "is damaged or was written by another version; compute the case into another folder"
            ),
        ):
            run_wear(case(), hours=0.1, out=tmp_path / name)


def test_the_stored_names_match_the_layout_version():
    """Names stored for each jump; when they change, increase store.LAYOUT.version."""
    kept = WearState.unworn(case().moving_surfaces()).arrays()
    names = {"worn", "flattened", "changed", "rates"}
    assert set(kept) == {f"{name}_{body}" for name in names for body in (0, 1)} | {"numbers"}
    assert (store.LAYOUT.version, kept["numbers"].size) == (4, 9)


def test_frames_are_spread_over_the_history(unbroken, tmp_path):
    jumps = len(unbroken.table) - 1
    numbers = [frame.number for frame in unbroken.frames]
    assert numbers[0] == 0
    assert numbers[-1] == jumps
    assert len(numbers) <= frames.MAX_FRAMES + 1
    assert all(is_kept(number, jumps) for number in numbers[:-1])
    assert [frame.hours for frame in unbroken.frames] == [
        unbroken.table["hours"][number] for number in numbers
    ]
    first = unbroken.frames[0]
    first_solution = unbroken.contact.solver(surfaces_at(unbroken.initial_surfaces, first.position))
    np.testing.assert_array_equal(first.pressure, first_solution.pressure.astype(np.float32))
    np.testing.assert_array_equal(first.in_contact, first_solution.asperity_pressure > 0.0)
    kept = run_wear(case(), hours=0.5, out=tmp_path / "worn")
    for actual, expected in zip(kept.frames, load_wear(tmp_path / "worn").frames, strict=True):
        assert (actual.number, actual.hours, actual.position) == (
            expected.number,
            expected.hours,
            expected.position,
        )
        np.testing.assert_array_equal(actual.gap, expected.gap)


def test_the_number_of_frames_is_bounded():
    for latest in (0, 23, 24, 47, 48, 1000):
        kept = [number for number in range(latest + 1) if is_kept(number, latest)]
        assert kept[0] == 0
        assert (
            frames.MAX_FRAMES // 2 <= len(kept) <= frames.MAX_FRAMES or latest < frames.MAX_FRAMES
        )
        assert set(kept) <= {
            number for number in range(latest + 1) if is_kept(number, max(0, latest - 1))
        } | {latest}
