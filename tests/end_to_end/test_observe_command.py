"""`asperity observe`: what a sensor on a structure sees of a contact."""

import json
from pathlib import Path

import pytest

from asperity.case import load_case
from asperity.results import solve_case

HOLDER = """
name = "roller in its holder"
mass = [[2.0, 0.0], [0.0, 20.0]]
stiffness = [[1e6, 0.0], [0.0, 2e8]]
damping = [[50.0, 0.0], [0.0, 500.0]]
contact = [1.0, -1.0]
sensor = [1.0, 0.0]
noise = 1e-6
"""


def test_a_mode_of_the_holder_moves_with_the_contact(asp):
    Path("holder.toml").write_text(HOLDER, "utf-8")
    code, out, _ = asp("observe", "case.toml", "--structure", "holder.toml", "--json")
    result = json.loads(out)
    assert code == 0
    assert set(result) == {
        *("verdict", "structure", "resolution", "visible", "sq_m", "clr", "modes", "figures")
    }
    assert result["structure"] == "roller in its holder"
    assert result["sq_m"] == pytest.approx([1.25e-6, 1e-6, 0.8e-6])
    assert result["clr"] == sorted(result["clr"], reverse=True)
    low, high = result["modes"]
    assert set(low) == {
        *("frequency_hz", "damping_ratio", "contact_share", "contact_stiffness_n_m"),
        *(
            "frequencies_hz",
            "damping_ratios",
            "movement",
            "shift_per_clr",
            "amplitude_at_sensor",
            "noise_at_sensor",
        ),
    }
    assert low["noise_at_sensor"] == 1e-6
    assert low["contact_share"] < 0.02
    assert high["contact_share"] > 0.9
    assert high["movement"] > 10.0 * low["movement"]
    assert high["amplitude_at_sensor"] > 0.0
    first, *_, last = high["frequencies_hz"]
    change = (last / first - 1.0) / (result["clr"][-1] - result["clr"][0])
    assert high["shift_per_clr"] == pytest.approx(change, rel=0.01)


def test_the_verdict_depends_on_resolution_and_noise(asp):
    Path("holder.toml").write_text(HOLDER, "utf-8")
    arguments = ("observe", "case.toml", "--structure", "holder.toml", "--quiet")
    assert asp(*arguments)[1].startswith("This sensor can see this contact: the mode of roller in")
    coarse = asp(*arguments, "--resolution", "0.5")[1]
    assert coarse.startswith("This sensor cannot see this contact")
    assert "against a resolution of 50 %" in coarse
    Path("holder.toml").write_text(HOLDER.replace("1e-6", "1e6"), "utf-8")
    noisy = asp(*arguments)[1]
    assert noisy.startswith("This sensor cannot see this contact")
    assert "below the noise" in noisy


def test_a_sensor_that_does_not_move_sees_nothing(asp):
    still = HOLDER.replace("sensor = [1.0, 0.0]", "sensor = [0.0, 0.0]").replace("noise = 1e-6", "")
    Path("still.toml").write_text(still, "utf-8")
    out = asp("observe", "case.toml", "--structure", "still.toml", "--quiet")[1]
    assert out.startswith("This sensor cannot see this contact")


def test_without_a_structure_the_mass_is_on_the_contact(asp):
    """Its mode is the contact's own resonance."""
    result = json.loads(asp("observe", "case.toml", "--json")[1])
    (mode,) = result["modes"]
    assert result["structure"] == "the single mass of 0.1 kg"
    assert mode["contact_share"] == pytest.approx(1.0)
    case = load_case("case.toml").with_overrides({"contact.roughness": "standing"})
    own = solve_case(case, surfaces=1).own_resonance.elastic
    assert mode["frequency_hz"] == pytest.approx(own.frequency_hz, rel=0.01)
    assert mode["damping_ratio"] == pytest.approx(own.damping_ratio, rel=0.1)


def test_what_cannot_be_observed_is_refused_in_one_sentence(asp):
    code, _, err = asp("observe", "case.toml", "--set", "vibration=none")
    assert code == 2
    assert "state a structure, or a mass in [vibration] of the case" in err
    code, _, err = asp("observe", "case.toml", "--resolution", "2")
    assert (code, "resolution must be between 0 and 1, got 2" in err) == (2, True)
    code, _, err = asp("observe", "case.toml", "--structure", "missing.toml")
    assert (code, "missing.toml does not exist" in err) == (2, True)


def test_without_roughness_the_answer_is_not_determined(asp):
    arguments = ("observe", "case.toml", "--set", 'surface="flat"', "--json")
    result = json.loads(asp(*arguments)[1])
    assert result["visible"] is None
    assert result["verdict"].startswith("Not determined whether this sensor can see this contact")
    assert "100 % of the strain energy" in result["verdict"]


def test_modes_outside_the_band_are_stated(asp):
    Path("slow.toml").write_text(
        "mass = [[1e9]]\nstiffness = [[0.0]]\ncontact = [1.0]\nsensor = [1.0]\n", "utf-8"
    )
    out = asp("observe", "case.toml", "--structure", "slow.toml")[1]
    assert "cannot see this contact: slow has no mode from 50 to 20000 Hz" in out
