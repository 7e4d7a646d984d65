"""Bad input of every kind: exit code 2, one sentence that names the value, and no file written."""

import json
from pathlib import Path

import numpy as np
import pytest
import x3pio

from asperity.cli import main

PAPER = (
    (Path(__file__).parents[2] / "examples" / "paper.toml")
    .read_text("utf-8")
    .replace("[256, 256]", "[64, 64]")
)


@pytest.fixture
def refused(tmp_path, monkeypatch, capsys):
    """Run a command that must be refused, in its own folder; return its stderr."""
    monkeypatch.chdir(tmp_path)

    def run(*arguments: str) -> str:
        before = sorted(tmp_path.rglob("*"))
        with pytest.raises(SystemExit) as end:
            main(arguments)
        captured = capsys.readouterr()
        assert end.value.code == 2
        if "--json" in arguments:
            assert list(json.loads(captured.out)) == ["error"]
        else:
            assert captured.out == ""
        assert captured.err.startswith("error: ")
        assert captured.err.count("\n") == 1
        assert sorted(tmp_path.rglob("*")) == before
        return captured.err

    return run


def write_case(old: str = "", new: str = "") -> None:
    assert old in PAPER
    Path("case.toml").write_text(PAPER.replace(old, new, 1), "utf-8")


MISTAKES = {
    "mistyped key": ('load = "500 N"', 'laod = "500 N"', ("contact.laod", "did you mean load?")),
    "mistyped section": ("[contact]", "[contcat]", ("contcat", "did you mean contact?")),
    "unknown law": (
        'law = "barus"',
        'law = "reynolds"',
        ("viscosity.law", "reynolds", "barus, roelands"),
    ),
    "wrong unit": ('load = "500 N"', 'load = "500 mm"', ("contact.load", "500 mm", "a force")),
    "unknown unit": ('mass = "0.1 kg"', 'mass = "0.1 kq"', ("vibration.mass", "0.1 kq", "a mass")),
    "bare number": ('load = "500 N"', "load = 500", ("contact.load", "500", "its unit")),
    "negative length": (
        'length = "10 mm"',
        'length = "-10 mm"',
        ("contact.length", "-10 mm", "positive"),
    ),
    "load 0": ('load = "500 N"', 'load = "0 N"', ("contact.load", "0 N", "positive")),
    "grid of 3 cells": ("cells = [64, 64]", "cells = [3, 3]", ("grid", "at least 8 cells", "3")),
    "no TOML": ("[contact]", "[contact", ("case.toml", "not valid TOML")),
    "other geometry": (
        'geometry = "line"',
        'geometry = "point"',
        ("length belongs to a line contact", "leave it out"),
    ),
    "missing surface file": ('kind = "gaussian"', 'file = "ring.x3p"', ("surface",)),
    "fine surface on coarse grid": (
        "cells = [64, 64]",
        "cells = [16, 16]",
        ("correlation length", "20 um"),
    ),
    "roughness of nothing": (
        'sq = "1 um"',
        'sq = "1e-300 um"',
        ("sq must be at least 1e-15 m", "got 1e-306 m"),
    ),
    "slow sampling": (
        "damping_ratio",
        'rate = "5 kHz"\ndamping_ratio',
        ("sampling rate", "5000 Hz"),
    ),
}


@pytest.mark.parametrize("mistake", MISTAKES)
def test_an_error_in_the_case_is_named(refused, mistake):
    old, new, names = MISTAKES[mistake]
    write_case(old, new)
    message = refused("solve", "case.toml", "--out", "run.nc", "--json")
    assert "case.toml" in message
    for name in names:
        assert name in message


def measured(path: str, cells: tuple[int, int], pixel: float, missing: float = 0.0) -> None:
    rng = np.random.default_rng(3)
    heights = 1e-6 * rng.standard_normal(cells)
    heights[rng.random(cells) < missing] = np.nan
    x3pio.write(path, heights.T, x_scale=pixel, y_scale=pixel)


def test_an_oil_that_is_not_liquid_under_the_load_is_refused(refused):
    write_case('"18.2 1/GPa"', '"1e9 1/GPa"')
    message = refused("solve", "case.toml", "--out", "run.nc")
    for name in ("coefficient of 1e+09 1/GPa", "Hertz pressure of 0.569 GPa", "check its unit"):
        assert name in message


def test_a_surface_with_too_many_missing_points_is_refused(refused):
    write_case()
    measured("ring.x3p", (300, 200), 2e-6, missing=0.6)
    assert "ring.x3p misses" in refused(
        "solve", "case.toml", "--surface", "ring.x3p", "--out", "run.nc"
    )


def test_a_surface_smaller_than_the_contact_is_refused(refused):
    write_case()
    measured("ring.x3p", (100, 100), 1e-6)
    message = refused("solve", "case.toml", "--surface", "ring.x3p", "--out", "run.nc")
    assert "ring.x3p" in message
    assert "100 um" in message.replace("100.0", "100")


@pytest.mark.parametrize("name", ["ring.x3p", "ring.opd", "ring.al3d", "ring.sdf", "ring.xyz"])
def test_a_surface_whose_content_contradicts_its_extension_is_refused(refused, name):
    write_case()
    Path(name).write_bytes(b"This is a letter, not a surface.\n")
    assert name in refused("solve", "case.toml", "--surface", name, "--out", "run.nc")
    assert name in refused("surface", name, "--out", "map.png")


@pytest.mark.parametrize(
    ("arguments", "name"),
    [
        (("solve", "absent.toml"), "absent.toml"),
        (("solve", "absent.nc"), "absent.nc"),
        (("solve", "case.toml", "--surface", "absent.opd"), "absent.opd"),
        (("surface", "absent.opd"), "absent.opd"),
        (("report", "absent.nc"), "absent.nc"),
        (("report", "case.toml"), "case.toml"),
        (("solve", "letter.nc"), "letter.nc"),
        (("solve", "case.toml", "--out", "nowhere/run.nc"), "nowhere"),
        (("solve", "case.toml", "--out", "case.toml"), ".nc"),
        (("report", "letter.nc", "--out", "nowhere/page.html"), "nowhere"),
        (("demo", "--out", "letter.nc"), "letter.nc"),
        (("solve", "case.toml", "--set", "contact.load"), "contact.load"),
        (("solve", "case.toml", "--set", "contact.laod=400 N"), "contact.laod"),
        (("solve", "case.toml", "--set", "..=1"), ".."),
        (("slove", "case.toml"), "solve"),
        (("solve", "case.toml", "--otu", "run.nc"), "--otu"),
        (("solve",), "CASE"),
    ],
)
def test_unusable_files_and_arguments_are_named(refused, arguments, name):
    write_case()
    Path("letter.nc").write_text("Dear ring,")
    assert name in refused(*arguments)
