"""`asperity vibrate` from the command line."""

import json
from pathlib import Path

import pytest

from asperity import load_case

PAPER = (Path(__file__).parents[2] / "examples" / "paper.toml").read_text("utf-8")


def test_table_1_has_the_documented_rows(asp):
    code, out, _ = asp(
        "vibrate", "case.toml", "--preset", "paper", "--table1", "--records", "20", "--json"
    )
    assert code == 0
    rows = json.loads(out)["rows"]
    assert len(rows) == 12
    assert list(rows[0]) == [
        *(
            "cutoff_hz",
            "height_m",
            "load_n",
            "crf_hz",
            "crfa",
            "crfa_low",
            "crfa_high",
            "paper_crf_hz",
            "paper_crfa",
        )
    ]
    assert rows[7]["height_m"] == 4e-6
    assert rows[7]["paper_crfa"] == 2.58
    assert all(row["crfa_low"] < row["crfa"] < row["crfa_high"] for row in rows)


def test_table_1_needs_no_case_and_is_drawn(asp):
    code, out, _ = asp("vibrate", "--table1", "--records", "20", "--figures", "drawn")
    assert code == 0
    assert out.startswith("Table 1, preset paper: CRF within 0.")
    assert {path.name for path in Path("drawn").iterdir()} == {"table1.png", "load-trend.png"}


def test_a_case_vibrates_dry_with_all_load_on_asperities(asp):
    code, out, err = asp("vibrate", "case.toml", "--json")
    assert (code, err) == (0, "")
    result = json.loads(out)
    assert result["clr"] == result["car"] == 1.0
    assert result["natural_frequency_hz"] == pytest.approx(
        3834.6, abs=0.1
    )  # physics.md: 3834 Hz at 500 N, E 200 GPa
    assert result["crf_hz"] == pytest.approx(3834.6, abs=3 * result["crf_std_hz"])
    assert asp("vibrate", "case.toml")[1].splitlines()[0] == result["verdict"]
    assert asp("vibrate", "case.toml", "--quiet")[1] == result["verdict"] + "\n"


def test_the_papers_preset_replaces_the_cases_choices_and_draws_figs_3_and_4(asp):
    code, out, _ = asp("vibrate", "case.toml", "--preset", "paper", "--figures", "drawn", "--json")
    assert code == 0
    assert json.loads(out)["damping_ratio"] == pytest.approx(0.02 / 6.2831853)
    assert {path.name for path in Path("drawn").iterdir()} == {"excitation.png", "response.png"}


def test_a_stiffness_of_the_solved_contact_solves_it(asp):
    overrides = (
        "vibration.stiffness_law=tangent",
        "vibration.rate=200 kHz",
        "surface.correlation_length=30 um",
    )
    code, out, _ = asp(
        "vibrate", "case.toml", "--json", *(word for key in overrides for word in ("--set", key))
    )
    assert code == 0
    result = json.loads(out)
    assert "solved contact" in result["verdict"]
    assert 0.1 < result["clr"] < 1.0
    assert 5000.0 < result["crf_hz"] < result["full_load_crf_hz"] < 10e3


def test_an_unsolved_contact_is_stored_without_its_tangent_stiffness(asp):
    overrides = (
        "vibration.stiffness_law=tangent",
        "vibration.rate=200 kHz",
        "solver.max_iterations=1",
    )
    sets = [word for key in overrides for word in ("--set", key)]
    code, out, _ = asp("solve", "case.toml", "--out", "run.nc", *sets)
    assert code == 1
    assert out.startswith("NOT CONVERGED")
    assert "neighbouring loads" in out
    assert Path("run.nc").exists()


def test_a_dynamic_load_beyond_a_linear_spring_is_stated(asp):
    loud = ("--set", "vibration.cutoff_reference=5 kHz")
    assert "too much for a linear spring" in asp("vibrate", "case.toml", *loud)[1].splitlines()[0]
    code, out, _ = asp(
        "vibrate", "case.toml", *loud, "--set", "vibration.response=nonlinear", "--json"
    )
    assert code == 0
    assert json.loads(out)["contact_loss"] > 0.0


@pytest.mark.parametrize(
    ("arguments", "names"),
    [
        ((), ("case is missing",)),
        (("case.toml", "--preset", "papper"), ("vibration.preset", "papper")),
        (("--table1", "--preset", "papper"), ("sound, paper", "papper")),
        (("--table1", "--records", "3"), ("at least 20", "3")),
        (("case.toml", "--records", "30"), ("--table1",)),
        (("case.toml", "--set", "vibration.filter=rc"), ("continuous, bilinear", "rc")),
        (("case.toml", "--set", "vibration=none"), ("[vibration]",)),
        (("case.toml", "--set", "vibration.damping=5 kg"), ("vibration.damping", "N s/m")),
        (
            ("case.toml", "--set", "vibration.response=rk5", "--set", "vibration.substeps=0"),
            ("sub-steps", "0"),
        ),
        (("case.toml", "--figures", "case.toml"), ("case.toml", "folder")),
        (("absent.toml", "--table1"), ("absent.toml",)),
    ],
)
def test_unusable_input_is_named(asp, arguments, names):
    code, out, err = asp("vibrate", *arguments)
    assert (code, out) == (2, "")
    assert err.startswith("error: ")
    assert err.count("\n") == 1
    assert all(name in err for name in names)


def test_single_choices_override_a_preset_in_the_file():
    text = PAPER.replace("[vibration]", '[vibration]\npreset = "paper"\nrate = "20 kHz"')
    case = load_case(text)
    assert case.vibration.rate_hz == 20e3
    assert case.vibration.damping_law.name == "hertz-for-radian"
    assert load_case(case.text) == case
    sound = case.with_overrides({"vibration.rate": "60 kHz", "vibration.preset": "sound"})
    assert sound.vibration.damping_law.name == "ratio"
    assert sound.vibration.rate_hz == 60e3
