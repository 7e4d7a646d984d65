"""Every kind of `asperity new`, followed as it suggests, shows a contact in mixed lubrication.

The commands are those that `asperity new` prints, in the folder of the case. Of machines only the
contact with the thinnest film is solved; machines, study and inference have coarse, short tracks,
contacts short ones. Only the figures of the line contact and of the moving one are rendered; those
of other pages are in other tests.
"""

import json
import re
import shlex
import time
from pathlib import Path

import pytest

from asperity.case import KINDS
from asperity.cli import main
from asperity.results import load_run
from asperity.simulation import load_history, load_wear
from asperity.study import load_study

CONTACTS = ("line", "point", "elliptic", "roller", "measured")
MACHINES = ("gear", "bearing", "cam")
MIXED = (0.1, 0.9)  # CLR
WEAR_SECONDS = 10.0  # of the processor


@pytest.fixture
def follow(tmp_path, monkeypatch, capsys):
    """Return a function that writes a starter and runs what it suggests: stdout by command."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))  # no emulator of an earlier run

    def run(*arguments: str) -> str:
        with pytest.raises(SystemExit) as end:
            main(arguments)
        captured = capsys.readouterr()
        assert (end.value.code or 0) in {0, 3}, captured.err
        return captured.out

    def steps(kind: str) -> dict[str, str]:
        printed = run("new", kind).splitlines()
        start = printed.index("Try next:") + 1
        commands = [line.strip().removeprefix("asperity ") for line in printed[start:]]
        return {command: run(*shlex.split(command)) for command in commands}

    return steps


@pytest.mark.parametrize("kind", CONTACTS)
def test_a_contact_starts_in_mixed_lubrication(follow, monkeypatch, request, kind):
    for module in ("results.running", "transient.running"):
        monkeypatch.setattr(f"asperity.{module}.PASSAGES", 4)  # not 6, on all cells
    if kind != "line":
        request.getfixturevalue("blank_figures")
    follow(kind)
    numbers = load_run(f"{kind}.nc").summary()
    assert MIXED[0] < numbers["clr"] < MIXED[1]
    assert numbers["snapshot_clr"] > 0.1  # what the maps show
    assert numbers["determined"]
    assert numbers["crf_low_hz"] < numbers["crf_hz"] < numbers["crf_high_hz"]
    assert Path(f"{kind}.html").exists()


@pytest.mark.usefixtures("blank_figures")
def test_a_dry_contact_has_a_resonance_under_the_whole_load(follow):
    follow("dry")
    numbers = load_run("dry.nc").summary()
    assert numbers["clr"] == pytest.approx(1.0, abs=1e-3)
    assert numbers["crf_hz"] > 1000.0


@pytest.mark.usefixtures("short_tracks", "thinnest_film_only", "blank_figures")
@pytest.mark.parametrize("kind", MACHINES)
def test_the_thinnest_film_of_a_machine_is_in_mixed_lubrication(follow, kind):
    conditions, _ = follow(kind).values()
    result = json.loads(Path(kind, "machine.json").read_text("utf-8"))
    assert len(result["contacts"]) > 3
    for contact in result[
        "contacts"
    ]:  # equal ones have one row, such as "roller 1, 12, inner ring"
        kind_of, number, rest = re.fullmatch(r"(\D*)(\d*)(.*)", contact["name"]).groups()
        name = rf"{re.escape(kind_of)}[\d, ]*\b{number}\b[\d, ]*{re.escape(rest)}"
        assert re.search(name, conditions), contact["name"]
    worst = next(row for row in result["contacts"] if row["name"] == result["worst"])
    assert MIXED[0] < worst["clr"] < MIXED[1]
    assert worst["crf_hz"] > 1000.0


def test_a_moving_contact_carries_load_on_asperities(follow):
    follow("motion")
    clr = load_history("motion").table["clr"]
    assert MIXED[0] < clr.mean() < MIXED[1]
    assert clr.max() - clr.min() > 0.1  # and it changes as the roughness moves


@pytest.mark.usefixtures("two_passages", "blank_figures")
def test_a_study_starts_in_full_film_and_ends_in_mixed_lubrication(follow, monkeypatch):
    monkeypatch.setattr("asperity.study.overview.MAX_MAPS", 1)  # contacts solved again to draw them
    follow("study")
    shares = load_study("study").table.groupby("surface.sq")["clr"].mean()
    assert shares.is_monotonic_increasing
    assert MIXED[0] < shares.median() < MIXED[1]
    assert shares.max() - shares.min() > 0.3


@pytest.mark.workers
@pytest.mark.usefixtures("blank_figures")
def test_wear_changes_the_load_share_within_seconds(follow):
    start = time.process_time()
    follow("wear")
    assert time.process_time() - start < WEAR_SECONDS
    shares = load_wear("wear").table["clr"].to_list()
    assert shares[0] - shares[-1] > 0.05


@pytest.mark.usefixtures("blank_figures")
def test_tracking_finds_the_severe_stage_of_the_simulated_rig(follow):
    _, tracked = follow("track").values()
    assert tracked.startswith(("Alert: ", "Alarm: "))
    assert "Severe wear from 1." in tracked
    assert Path("track.html").exists()


@pytest.mark.usefixtures("two_passages", "coarse_search", "blank_figures")
def test_inference_learns_the_load_share_of_the_simulated_rig(follow, monkeypatch):
    # of 24 solved on twice the cells
    monkeypatch.setattr("asperity.inference.emulator.FINER_POINTS", 2)
    _, inferred = follow("infer").values()
    assert Path("infer.html").exists()
    row = next(line for line in inferred.splitlines() if "asperity load share, CLR" in line)
    assert float(row.split()[-1]) > 0.5  # bits; "as assumed" below
    assert "no contact resonance" not in inferred


def test_no_kind_is_left_out():
    others = {"dry", "motion", "study", "wear", "track", "infer"}
    assert set(KINDS) == {*CONTACTS, *MACHINES, *others}
