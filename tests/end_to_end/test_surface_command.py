"""`asperity surface` and `solve --surface` on files of several formats."""

import json
import re
from pathlib import Path

import numpy as np
import pytest
import x3pio

PAPER = (Path(__file__).parents[2] / "examples" / "paper.toml").read_text("utf-8")


@pytest.fixture
def asp(asp):
    Path("case.toml").write_text(PAPER.replace("[256, 256]", "[32, 32]"), "utf-8")
    x = np.arange(300) * 2e-6
    grooves = 0.5e-6 * np.sin(2.0 * np.pi * x / 40e-6)[:, None] * np.ones(260)
    x3pio.write(
        "ground.x3p", (grooves + 50e-6 * (x[:, None] / x.max()) ** 2).T, x_scale=2e-6, y_scale=2e-6
    )
    Path("line.csv").write_text(
        "".join(f'"0,{i:04d}";"{np.sin(i / 9):.4f}"\n'.replace(".", ",") for i in range(1000))
    )
    return asp


def test_surface_reports_its_processing_and_parameters(asp):
    code, out, err = asp(
        "surface", "ground.x3p", "--form", "quadratic", "--l-filter", "0.2 mm", "--out", "map.png"
    )
    assert (code, err) == (0, "")
    assert out.startswith("ground.x3p: Sq 0.3")
    for expected in (
        "core height, Sk ",
        "Spk",
        "Smr1",
        "Sz",
        "Sdr",
        "quadratic form",
        "longer than 200 µm",
    ):
        assert expected in out
    assert Path("map.png").read_bytes().startswith(b"\x89PNG")
    found = json.loads(asp("surface", "ground.x3p", "--json")[1])["files"][0]
    assert {
        "sz_m",
        "sdr",
        "sk_m",
        "spk_m",
        "svk_m",
        "smr1",
        "smr2",
        "str",
        "steps",
        "notes",
    } <= set(found)
    assert found["profile"] is None


def test_a_profile_has_profile_parameters_and_a_figure(asp):
    code, out, _ = asp(
        "surface", "line.csv", "--unit", "um", "--lateral-unit", "mm", "--out", "line.png"
    )
    assert code == 0
    assert out.startswith("line.csv: profile, Pq 0.7")
    assert "arithmetic mean height, Pa " in out
    assert "mean profile element spacing, Psm " in out
    assert ", Pmr2 " in out
    assert Path("line.png").read_bytes().startswith(b"\x89PNG")
    found = json.loads(
        asp("surface", "line.csv", "--unit", "um", "--lateral-unit", "mm", "--json")[1]
    )["files"][0]
    assert found["profile"]["rsm_m"] == pytest.approx(2.0 * np.pi * 9 * 0.1e-6, rel=0.01)
    assert found["profile"]["letter"] == "P"


def test_filtered_profiles_have_roughness_parameters(asp):
    given = ("surface", "line.csv", "--unit", "um", "--lateral-unit", "mm", "--l-filter", "8 um")
    code, out, _ = asp(*given)
    assert code == 0
    assert "arithmetic mean height, Ra " in out
    assert ": profile, Rq " in out
    assert json.loads(asp(*given, "--json")[1])["files"][0]["profile"]["letter"] == "R"
    shorter = ("surface", "line.csv", "--unit", "um", "--lateral-unit", "mm", "--s-filter", "1 um")
    assert (
        "arithmetic mean height, Pa " in asp(*shorter)[1]
    )  # a primary profile may have passed this filter


def test_a_profile_figure_agrees_with_the_text(asp, monkeypatch):
    written = []
    monkeypatch.setattr("matplotlib.axes.Axes.text", lambda *given, **_: written.append(given[3]))
    steps = (
        np.cumsum(np.random.default_rng(3).standard_normal(901)) * 1e-2
    )  # not a sine: its flattest secant is unique
    Path("rough.csv").write_text(
        "\n".join(f"{0.1e-3 * k:.6f},{z:.6f}" for k, z in enumerate(steps))
    )
    code, out, _ = asp(
        "surface", "rough.csv", "--unit", "um", "--lateral-unit", "mm", "--out", "rough.png"
    )
    assert code == 0
    drawn = dict(re.findall(r"(P\w*k) ([\d.]+)", written[0]))
    assert sorted(drawn) == ["Pk", "Ppk", "Pvk"]
    for name, value in drawn.items():
        assert re.search(rf", {name} +{re.escape(value)} µm", out), (name, value, out)
    found = json.loads(
        asp("surface", "rough.csv", "--unit", "um", "--lateral-unit", "mm", "--json")[1]
    )["files"][0]
    assert found["sk_m"] == pytest.approx(found["profile"]["rk_m"], rel=1e-12)
    assert found["svk_m"] == pytest.approx(found["profile"]["rvk_m"], rel=1e-12)


def test_good_surfaces_are_shown_beside_a_bad_one(asp):
    code, out, err = asp("surface", "ground.x3p", "missing.x3p", "line.csv")
    assert code == 2
    assert out.startswith("ground.x3p: Sq 0.3")
    assert "missing.x3p" in err
    assert "--unit um --lateral-unit mm" in err  # line.csv
    assert err.count("\n") == 1
    code, out, err = asp("surface", "ground.x3p", "missing.x3p", "--json")
    result = json.loads(out)
    assert [row["file"] for row in result["files"] + result["refused"]] == [
        "ground.x3p",
        "missing.x3p",
    ]
    assert result["refused"][0]["reason"] in err


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("surface", "ground.x3p", "--form", "sphere"), "form must be one of"),
        (("surface", "ground.x3p", "--l-filter", "3"), "--l-filter must be a length"),
        (
            ("surface", "ground.x3p", "--pixel", "2 um", "--lateral-unit", "um"),
            "leave out --pixel or",
        ),
        (("surface", "line.csv"), "give unit"),
    ],
)
def test_invalid_arguments_are_refused_in_one_sentence(asp, arguments, message):
    code, out, err = asp(*arguments)
    assert (code, out) == (2, "")
    assert message in err
    assert err.count("\n") == 1


def test_a_ground_surface_is_solved_with_its_lay_across_and_along(asp):
    """Ridges across rolling carry oil in and lift the contact; along it the oil escapes."""
    clr = {}
    for lay, turn in (("across", "false"), ("along", "true")):
        code, out, _ = asp(
            "solve",
            "case.toml",
            "--surface",
            "ground.x3p",
            "--set",
            "surface.sq=1 um",
            "--set",
            f"surface.turn={turn}",
            "--out",
            f"{lay}.nc",
            "--json",
        )
        assert code == 0
        clr[lay] = json.loads(out)["clr"]
    assert clr["across"] < clr["along"]
    assert asp("report", "across.nc", "along.nc", "--out", "lay.html")[0] == 0
    assert "turn True" in Path("lay.html").read_text("utf-8")
