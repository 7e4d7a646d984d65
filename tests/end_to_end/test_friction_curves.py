"""`asperity stribeck` and `asperity traction` from the command line and from Python."""

import csv
import json
from itertools import pairwise
from pathlib import Path

import pytest

from asperity import load_case
from asperity.core.errors import BadInput
from asperity.results import stribeck_curve, traction_curve

pytestmark = pytest.mark.usefixtures("two_passages")

SMALL = ("--set", "grid.cells=[48, 32]", "--set", "surface.correlation_length=40 um")
PNG = b"\x89PNG"


@pytest.fixture
def case(asp):  # noqa: ARG001 - it creates the folder
    overrides = {"grid.cells": [48, 32], "surface.correlation_length": "40 um"}
    return load_case("case.toml").with_overrides(overrides)


def test_stribeck_falls_from_boundary_friction_to_that_of_the_oil(asp):
    code, out, err = asp(
        "stribeck", "case.toml", *SMALL, "--sq", "0.5 um", "--json", "--out", "curve.png"
    )
    assert (code, err) == (0, "")
    result = json.loads(out)
    assert result["figures"] == ["curve.png"]
    assert Path("curve.png").read_bytes().startswith(PNG)
    (curve,) = result["curves"]
    points = curve["points"]
    assert len(points) == 13
    assert all(point["converged"] for point in points)
    friction = [point["friction_coefficient"] for point in points]
    assert 0.1 < friction[0] < 0.15
    assert 0.02 < friction[-1] < 0.06
    assert all(slower >= faster for slower, faster in pairwise(friction))
    assert points[-1]["clr"] < 0.01 < points[0]["clr"]
    assert all(
        point["friction_coefficient"] == pytest.approx(point["asperity_part"] + point["oil_part"])
        for point in points
    )
    assert result["verdict"].startswith(
        f"The friction coefficient changes from {friction[0]:.4f} (± not determined) at 0.0191 m/s "
        f"to {friction[-1]:.4f}"
    )


def test_traction_rises_from_zero_to_its_limit(asp):
    slips = [argument for slip in ("0", "0.3", "0.001", "3") for argument in ("--slip", slip)]
    code, out, _ = asp(
        "traction",
        "case.toml",
        *SMALL,
        "--sq",
        "0.5 um",
        "--sq",
        "1 um",
        *slips,
        "--out",
        "curve.png",
        "--out",
        "curve.csv",
    )
    assert code == 0
    first, second = out.splitlines()[:2]
    assert first.startswith("The largest friction coefficient is 0.0")
    assert "(Sq 1 µm, boundary friction 0.15)" in second
    assert out.count("1.91") == 8
    assert "thermal.feedback=true" in out  # the film is hot at 300 % sliding
    assert Path("curve.png").read_bytes().startswith(PNG)
    with Path("curve.csv").open(encoding="utf-8", newline="") as table:
        points = list(csv.DictReader(table))
    assert [point["slide_to_roll"] for point in points] == ["0.0", "0.001", "0.3", "3.0"] * 2
    assert sorted({point["sq_m"] for point in points}) == ["1e-06", "5e-07"]


def test_a_traction_curve_of_running_roughness_depends_on_its_speed(case):
    """The rough body is the first, faster one; both slips have intervals."""
    curve = traction_curve(case, slips=[0.3, 2.0, 5.0])
    slow, fast, opposite = curve.points
    assert [slow.roughness, fast.roughness, opposite.roughness] == [*2 * ["running"], "standing"]
    assert all(point.converged for point in curve.points)
    assert fast.clr != pytest.approx(slow.clr, abs=1e-3)


def test_a_traction_curve_in_python(case):
    case, seen = case.with_overrides({"contact.roughness": "standing"}), []
    curve = traction_curve(case, slips=[0.3, 0.0, 0.001], progress=seen.append)
    slips = [point.slide_to_roll for point in curve.points]
    assert slips == pytest.approx([0.0, 0.001, 0.3])
    friction = [point.friction_coefficient for point in curve.points]
    assert (
        friction[0]
        == curve.points[0].flash_temperature_max_k
        == curve.points[0].friction_power_w
        == 0.0
    )
    assert friction[1] < friction[2]
    assert seen
    assert (
        len({round(point.clr, 4) for point in curve.points}) == 1
    )  # Newtonian oil: sliding changes only the traction


def test_thermal_feedback_changes_the_curve(case):
    speeds = [10.0]
    cold = stribeck_curve(case, speeds=speeds)
    warm = stribeck_curve(case.with_overrides({"thermal.feedback": "true"}), speeds=speeds)
    assert warm.feedback
    assert warm.points[0].oil_part < 0.9 * cold.points[0].oil_part
    assert cold.hint() is not None
    assert warm.hint() is None


def test_points_that_do_not_converge_are_marked_and_fail_the_command(asp):
    code, out, err = asp(
        "stribeck", "case.toml", *SMALL, "--speed", "1.9", "--set", "solver.max_iterations=1"
    )
    assert code == 1
    assert out.startswith("NOT CONVERGED at 1 of 1 points: ")
    assert "NOT CONVERGED" in out.splitlines()[-1]
    assert err.count("\n") == 1


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (
            ("stribeck", "case.toml", "--set", "contact.slip=0.0"),
            "contact.slip is 0, so that nothing slides",
        ),
        (("stribeck", "case.toml", "--speed", "-1"), "entrainment speed must be positive"),
        (
            ("stribeck", "case.toml", "--out", "curve.svg"),
            "must be a file that ends in .csv, .png or .pdf",
        ),
        (("stribeck", "case.toml", "--sq", "1 kg"), "surface.sq must be a length"),
        (
            ("traction", "case.toml", "--slip", "-0.1"),
            "slide-to-roll ratio must be between 0 and 1000, got -0.1",
        ),
    ],
)
def test_invalid_curves_are_refused_in_one_line(asp, arguments, message):
    code, out, err = asp(*arguments, "--quiet")
    assert (code, out) == (2, "")
    assert message in err
    assert err.count("\n") == 1


def test_an_empty_curve_is_refused(case):
    with pytest.raises(BadInput, match="at least one point"):
        traction_curve(case, slips=[])
