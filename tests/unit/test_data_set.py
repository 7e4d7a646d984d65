"""`asperity check --set DIR`: a complete data set, and the same with one item missing at a time."""

import csv
import json
import shutil
from pathlib import Path

import numpy as np
import pytest

from asperity import Grid
from asperity.cli import main
from asperity.monitoring import check_set
from asperity.surface import gaussian_surface, write_surface
from support.source import ROOT

STATED = """\
title = "Rings in VG 100"
authors = ["A laboratory"]
licence = "CC-BY-4.0"
case = "contact.toml"
recordings = "recordings.csv"
sensor = "accelerometer on the housing, 20 mm from the contact, radial"
maps_before = ["maps/ring-before.x3p", "maps/roller-before.x3p"]
maps_after = ["maps/ring-after.x3p", "maps/roller-after.x3p"]
"""
HEADS = ("file", "time_h", "load_n", "speed_m_s", "oil_temperature_c")
STEPS = [(200, 1.0), (300, 1.5), (500, 2.0), (500, 2.0)]


@pytest.fixture(scope="module")
def complete_set(tmp_path_factory):
    """A data set with four recordings and four maps."""
    folder = tmp_path_factory.mktemp("set")
    (folder / "set.toml").write_text(STATED, "utf-8")
    shutil.copy(ROOT / "examples" / "paper.toml", folder / "contact.toml")
    (folder / "maps").mkdir()
    grid = Grid((96, 96), (0.0, 0.0), (0.3e-3, 0.3e-3), periodic=(True, True))
    for number, name in enumerate(("ring-before", "roller-before", "ring-after", "roller-after")):
        rng = np.random.default_rng(number)
        write_surface(
            gaussian_surface(grid, sq=1e-6, correlation_length=20e-6, rng=rng),
            folder / f"maps/{name}.x3p",
        )
    rows = [(f"run-{i}.csv", i, load, speed, 40 + i) for i, (load, speed) in enumerate(STEPS)]
    write_table(folder, rows)
    for i in range(len(rows)):
        write_recording(folder / f"run-{i}.csv", seed=i)
    return folder


def write_table(folder, rows, heads=HEADS):
    with (folder / "recordings.csv").open("w", encoding="utf-8", newline="") as file:
        csv.writer(file).writerows([heads, *rows])


def write_recording(path, *, rate=20_000, seconds=10.5, unit="m/s^2", seed=0):
    values = np.random.default_rng(seed).standard_normal(int(rate * seconds))
    header = f"sampling rate: {rate} Hz\nacc [{unit}]"
    np.savetxt(path, values, "%.4g", header=header, comments="")


@pytest.fixture
def copy(complete_set, tmp_path):
    return Path(shutil.copytree(complete_set, tmp_path / "set"))


def test_a_complete_set_is_accepted(complete_set, capsys):
    found = check_set(complete_set)
    assert found.missing == ()
    assert (found.whole, found.recordings, found.maps) == (True, 4, 4)
    with pytest.raises(SystemExit) as end:
        main(["check", "--set", str(complete_set), "--json"])
    summary = json.loads(capsys.readouterr().out)
    assert (end.value.code or 0, summary["whole"], summary["title"]) == (0, True, "Rings in VG 100")


def without(key):
    def damage(folder):
        text = "".join(
            line for line in STATED.splitlines(keepends=True) if not line.startswith(f"{key} ")
        )
        (folder / "set.toml").write_text(text, "utf-8")

    return damage


def replaced(old, new):
    def damage(folder):
        assert old in STATED
        (folder / "set.toml").write_text(STATED.replace(old, new), "utf-8")

    return damage


def steps(*rows):
    def damage(folder):
        write_table(
            folder, [(f"run-{i}.csv", i, load, speed, 40) for i, (load, speed) in enumerate(rows)]
        )

    return damage


def coarse_map(folder):
    grid = Grid((20, 20), (0.0, 0.0), (0.3e-3, 0.3e-3), periodic=(True, True))
    surface = gaussian_surface(
        grid, sq=1e-6, correlation_length=60e-6, rng=np.random.default_rng(1)
    )
    write_surface(surface, folder / "maps/ring-after.x3p")


DEFECTS = {
    "set.toml does not state sensor": without("sensor"),
    "its licence all rights reserved is not one of": replaced("CC-BY-4.0", "all rights reserved"),
    "maps before and after are not of the same number": replaced(', "maps/roller-after.x3p"', ""),
    "is outside the set": replaced("maps/ring-after.x3p", "../../ring-after.x3p"),
    "load_n has 2 steps, at least 3": steps((200, 1.0), (200, 1.5), (500, 2.0), (500, 2.0)),
    "speed_m_s has 1 steps, at least 3": steps((200, 1.0), (300, 1.0), (500, 1.0), (500, 1.0)),
    "no combination of load and speed was recorded twice": steps(
        (200, 1.0), (300, 1.5), (500, 2.0), (600, 2.0)
    ),
    "has no column oil_temperature_c": lambda folder: write_table(
        folder, [("run-0.csv", 0, 1, 1)], HEADS[:-1]
    ),
    "line 2 of recordings.csv: load_n must": lambda folder: write_table(
        folder, [("run-0.csv", 0, "", 1, 1)]
    ),
    "run-1.csv: sampled at 8000 Hz": lambda folder: write_recording(
        folder / "run-1.csv", rate=8000
    ),
    "run-2.csv: 3 s long, at least 10": lambda folder: write_recording(
        folder / "run-2.csv", seconds=3.0
    ),
    "run-3.csv: not an acceleration (unit V)": lambda folder: write_recording(
        folder / "run-3.csv", unit="V"
    ),
    "run-0.csv": lambda folder: (folder / "run-0.csv").unlink(),
    "ring-after.x3p: pixels of 15 um, coarser": coarse_map,
    "the case: ": lambda folder: (folder / "contact.toml").write_text(
        "[contact]\nload = 3\n", "utf-8"
    ),
}


@pytest.mark.parametrize(("sentence_part", "damage"), DEFECTS.items(), ids=DEFECTS)
def test_missing_items_are_reported(copy, sentence_part, damage):
    damage(copy)
    found = check_set(copy)
    assert not found.whole
    assert any(sentence_part in sentence for sentence in found.missing), found.missing
    assert found.verdict().startswith(f"{copy} is not a complete data set: ")


def test_the_command_refuses_an_invalid_set(copy, tmp_path, capsys):
    without("case")(copy)
    for arguments, sentence_part in (
        (["--set", str(copy)], "not a complete data set: set.toml does not state case"),
        (["--set", str(tmp_path / "absent")], "is not a folder"),
        (["--set", str(copy / "maps")], "has no set.toml"),
        (["--set", str(copy), "run-0.csv"], "takes no other recordings"),
        ([], "check needs recordings, or --set"),
    ):
        with pytest.raises(SystemExit) as end:
            main(["check", *arguments])
        output = capsys.readouterr()
        assert end.value.code == 2
        assert sentence_part in output.out + output.err
