"""Stiffness and damping of bearings for rotor dynamics against the static matrices."""

import numpy as np
import pytest

from asperity.case import load_machine
from asperity.core.errors import BadInput
from asperity.machines import stiffness_table
from asperity.results import solve_case
from asperity.solution import OscillatingContact
from support.bearings import BALLS

ROLLERS = """
lubricant = { grade = "VG 68", temperature = "70 degC" }
surface = { kind = "gaussian", sq = "0.1 um", correlation_length = "30 um", seed = 1 }
machine.kind = "cylindrical-roller-bearing"
machine.rollers = 13
machine.roller_diameter = "9 mm"
machine.roller_length = "10 mm"
machine.pitch_diameter = "46.5 mm"
machine.clearance = "20 um"
machine.radial_load = "4 kN"
machine.speed = "3000 r/min"
"""


def machine(tmp_path, text, **overrides):
    path = tmp_path / "machine.toml"
    path.write_text(text, "utf-8")
    return load_machine(path).with_written(overrides)


def test_a_roller_bearing_is_as_stiff_as_by_iso_16281(tmp_path):
    """ISO's stiffness of a roller between rings is a fit of measurements: 15 %."""
    case = machine(tmp_path, ROLLERS)
    (row,) = stiffness_table(case).table.to_dict("records")
    static = case.machine.stiffness_matrix(case.pair)[0, 0]
    assert row["kxx"] == pytest.approx(static, rel=0.15)
    assert 0.0 < row["kyy"] < row["kxx"]  # few rollers carry, near the load
    assert row["kxy"] == row["kyx"] == row["cxy"] == 0.0
    assert row["cxx"] > 0.0
    assert row["frequency"] == pytest.approx(100.0 * np.pi)


def test_a_smooth_ball_bearing_is_as_stiff_as_dry_hertz_contacts(tmp_path):
    """At these loads the film adds a few per cent of compliance."""
    case = machine(tmp_path, BALLS)
    (row,) = stiffness_table(case).table.to_dict("records")
    static = case.machine.stiffness_matrix(case.pair)[0, 0]
    assert row["kxx"] == pytest.approx(static, rel=0.04)


def test_an_axially_loaded_bearing_is_equally_stiff_in_all_directions(tmp_path):
    thrust = {"machine.radial_load": "0 N", "machine.axial_load": "2 kN"}
    case = machine(
        tmp_path, BALLS, **thrust, **{"machine.clearance": "20 um", "machine.tilt": "0 rad"}
    )
    (row,) = stiffness_table(case).table.to_dict("records")
    assert row["kxx"] == pytest.approx(row["kyy"], rel=1e-6)
    assert row["cxx"] == pytest.approx(row["cyy"], rel=1e-6)
    # every ball: both contacts in series, times cos² of its angle, half of them across x
    contact = case.contacts[0]
    angle = float(case.machine.loads(case.pair)[1][0])
    both = []
    for contact in case.contacts[:2]:
        snapshot = case.case(contact).with_written({"contact.roughness": "standing"})
        run = solve_case(snapshot.among_many, surfaces=1, groups=())
        value = OscillatingContact(run.solution).evaluate(50.0)
        both.append(value.stiffness + 1j * 100.0 * np.pi * value.damping)
    spring = 4.5 * np.cos(angle) ** 2 / (1.0 / both[0] + 1.0 / both[1])
    assert row["kxx"] == pytest.approx(spring.real, rel=1e-6)
    assert row["cxx"] == pytest.approx(spring.imag / (100.0 * np.pi), rel=1e-6)


def test_an_angular_contact_bearing_is_softer_when_its_ring_may_move_along_the_axis(tmp_path):
    """K_rr - K_ra²/K_aa of the static matrix; forces that turn with the contact add some."""
    thrust = {
        "machine.radial_load": "1 kN",
        "machine.axial_load": "2 kN",
        "machine.contact_angle": "40 deg",
    }
    case = machine(tmp_path, BALLS, **thrust)
    (row,) = stiffness_table(case).table.to_dict("records")
    static = case.machine.stiffness_matrix(case.pair)
    condensed = static[0, 0] - static[0, 1] ** 2 / static[1, 1]
    assert row["kxx"] == pytest.approx(condensed, rel=0.05)
    assert row["kxx"] < 0.97 * static[0, 0]


def test_a_profiled_roller_carries_on_part_of_its_length(tmp_path):
    straight, profiled = (
        stiffness_table(machine(tmp_path, ROLLERS, **extra)).table["kxx"][0]
        for extra in ({}, {"machine.profile": "iso"})
    )
    assert profiled < straight


def test_another_machine_has_a_row_for_each_contact(tmp_path):
    discs = """
lubricant = { grade = "VG 68", temperature = "70 degC" }
surface = "flat"
machine.kind = "twin-disc"
machine.radii = ["20 mm", "20 mm"]
machine.length = "10 mm"
machine.load = "1 kN"
machine.speeds = ["100 rad/s", "90 rad/s"]
grid.cells = [64, 32]
"""
    case = machine(tmp_path, discs)
    (row,) = stiffness_table(case).table.to_dict("records")
    assert row["load_n"] == 1000.0
    assert row["frequency"] == 100.0
    assert 1e8 < row["kxx"] < 1e9


def test_a_machine_without_a_lubricant_is_refused_in_one_sentence(tmp_path):
    dry = ROLLERS.replace('lubricant = { grade = "VG 68", temperature = "70 degC" }', "")
    with pytest.raises(BadInput, match=r"a stiffness table needs \[lubricant\] and \[surface\]"):
        stiffness_table(machine(tmp_path, dry))
