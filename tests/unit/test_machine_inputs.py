"""Machine inputs that people have: designation, lift table, load spectrum, test stages."""

import math

import numpy as np
import pandas
import pytest

from asperity.case import load_machine
from asperity.contact.conditions import ElasticPair
from asperity.core.errors import BadInput
from asperity.machine import (
    BallBearing,
    CylindricalRollerBearing,
    FlatCam,
    RollerCam,
    catalogue_bearings,
)
from asperity.machines import machine_conditions, sweep_machine, sweep_points
from asperity.machines.ratings import machine_ratings
from asperity.rating import palmgren_torque, reliability_factor
from support.golden_numbers import EXAMPLES

STEEL = ElasticPair(youngs_moduli=(206e9, 206e9), poisson_ratios=(0.3, 0.3))
OIL = """
[lubricant]
grade = "VG 68"
temperature = "70 degC"
[surface]
kind = "gaussian"
sq = "0.1 um"
correlation_length = "20 um"
"""
BEARING = f"""
[machine]
designation = "6206"
radial_load = "2 kN"
speed = "3000 r/min"
[rating]
contamination = 0.5
{OIL}
"""
CAM = {
    "base_radius": 36e-3,
    "width": 14e-3,
    "speed": 150.0,
    "spring_load": 300.0,
    "spring_rate": 30e3,
    "follower_mass": 0.1,
}
LIFT, HALF_ANGLE = 9e-3, math.radians(60.0)


@pytest.fixture
def machine(tmp_path):
    def load(text, overrides=None):
        path = tmp_path / "machine.toml"
        path.write_text(text, "utf-8")
        return load_machine(path, overrides)

    return load


def ratings_of(case):
    return {entry.key: entry.machine_value for entry in machine_ratings(case)}


def iso_281_rating(bearing):
    """ISO 281:2007: basic dynamic load rating of the geometry [N], fc by its formula."""
    diameter, ratio = 1e3 * bearing.diameter, bearing.diameter / bearing.pitch_diameter
    if bearing.length is None:
        inner = (1.04 * ((1 - ratio) / (1 + ratio)) ** 1.72) ** (10 / 3)
        groove = (1.04 / 0.04) ** 0.41
        shape = ratio**0.3 * (1 - ratio) ** 1.39 / (1 + ratio) ** (1 / 3)
        factor = 39.9 * 0.95 * (1 + inner) ** -0.3 * shape * groove
        return 1.3 * factor * bearing.elements ** (2 / 3) * diameter**1.8
    inner = (1.04 * ((1 - ratio) / (1 + ratio)) ** (143 / 108)) ** 4.5
    shape = ratio ** (2 / 9) * (1 - ratio) ** (29 / 27) / (1 + ratio) ** 0.25
    factor = 207.9 * 0.83 * (1 + inner) ** (-2 / 9) * shape
    length = (1e3 * bearing.length) ** (7 / 9)
    return 1.1 * factor * length * bearing.elements**0.75 * diameter ** (29 / 27)


@pytest.mark.parametrize("designation", sorted(catalogue_bearings()))
def test_the_load_ratings_of_the_table_are_those_of_iso_281(designation):
    bearing = catalogue_bearings()[designation]
    assert bearing.dynamic_load_rating == pytest.approx(iso_281_rating(bearing), rel=0.04)


def test_a_designation_replaces_geometry_and_load_ratings(machine):
    case = machine(BEARING)
    assert isinstance(case.machine, BallBearing)
    assert (case.machine.balls, case.machine.pitch_diameter) == (9, 0.046)
    assert ratings_of(case)["modified_life_s"] > 0.0
    assert any("6206 by its designation: 9 balls of 9.525 mm" in note for note in case.notes)
    stated = machine(BEARING, {"machine.balls": 8, "rating.dynamic_load_rating": "25 kN"})
    assert stated.machine.balls == 8
    assert ratings_of(stated)["reference_life"] > ratings_of(case)["reference_life"]
    roller = machine(BEARING, {"machine.designation": "nu206"})
    assert isinstance(roller.machine, CylindricalRollerBearing)


@pytest.mark.parametrize(
    ("overrides", "message"),
    [
        ({"machine.designation": "6299"}, 'machine.designation must be one of 6203, .*got "6299"'),
        ({"machine.kind": "spur-gear"}, "but 6206 is a ball-bearing; leave kind out"),
        ({"rating.reliability": 0.5}, "rating.reliability must lie between 0.9 and 0.9995"),
        ({"rating.spectrum": [{"share": 0.5, "load": 1.0}]}, "must add up to 1, got 0.5"),
        ({"rating.spectrum": [{"share": 1.0, "load": 0.0}]}, "must have positive share, load"),
        ({"rating": 5}, "rating must be a table"),
    ],
)
def test_impossible_bearing_inputs_are_refused(machine, overrides, message):
    with pytest.raises(BadInput, match=message):
        machine(BEARING, overrides)


@pytest.mark.parametrize(
    ("reliability", "factor"),
    [
        *[(0.9, 1.0), (0.95, 0.64), (0.96, 0.55), (0.97, 0.47), (0.98, 0.37), (0.99, 0.25)],
        *[(0.992, 0.22), (0.994, 0.19), (0.996, 0.16), (0.998, 0.12), (0.999, 0.093)],
        (0.9995, 0.077),
    ],
)
def test_reliability_factors_are_those_of_iso_281(reliability, factor):
    """Table 12 of ISO 281:2007, recollected."""
    assert reliability_factor(reliability) == pytest.approx(factor, rel=0.02)


def test_reliability_shortens_the_life(machine):
    basic = ratings_of(machine(BEARING))
    reliable = ratings_of(machine(BEARING, {"rating.reliability": 0.95}))
    ratio = reliable["modified_life_s"] / basic["modified_life_s"]
    assert ratio == pytest.approx(reliable["reliability_factor"]) == pytest.approx(0.64, rel=0.01)


def test_the_damage_of_a_load_spectrum_adds_up(machine):
    entries = [{"share": 0.7, "load": 0.6, "speed": 1.0}, {"share": 0.3, "load": 1.5, "speed": 0.5}]
    life = ratings_of(machine(BEARING, {"rating.spectrum": entries}))["spectrum_life_s"]
    single = [
        ratings_of(
            machine(
                BEARING,
                {
                    "machine.radial_load": f"{2000 * entry['load']} N",
                    "machine.speed": f"{3000 * entry['speed']} r/min",
                },
            )
        )["modified_life_s"]
        for entry in entries
    ]
    assert 1.0 / life == pytest.approx(0.7 / single[0] + 0.3 / single[1], rel=1e-6)
    same = [{"share": 0.4, "load": 1.0}, {"share": 0.6, "load": 1.0}]
    alike = ratings_of(machine(BEARING, {"rating.spectrum": same}))
    assert alike["spectrum_life_s"] == pytest.approx(alike["modified_life_s"], rel=1e-9)


def test_friction_torque_by_palmgren(machine):
    """By hand: 1e-7 2 (20 3000)^(2/3) 46^3 + 0.0005 (2000/11300)^0.55 2000 46 N mm."""
    by_hand = 2e-7 * 60000 ** (2 / 3) * 46**3 + 5e-4 * (2000 / 11300) ** 0.55 * 2000 * 46
    torque = palmgren_torque(0.046, 100.0 * math.pi, 20e-6, 2000.0, static_rating=11300.0)
    assert torque == pytest.approx(1e-3 * by_hand, rel=1e-3)
    assert 0.03 < ratings_of(machine(BEARING))["rated_friction_torque_n_m"] < 0.07
    still = palmgren_torque(0.046, 1e-3, 20e-6, 0.0, static_rating=11300.0)
    assert still == pytest.approx(160e-7 * 2 * 46**3 * 1e-3)


@pytest.mark.parametrize("tilt", [0.0, None])
@pytest.mark.parametrize(("radial", "axial"), [(2000.0, 0.0), (2000.0, 1500.0), (10.0, 800.0)])
def test_the_stiffness_matrix_is_the_derivative_of_the_forces(radial, axial, tilt):
    bearing = BallBearing(
        balls=9, ball_diameter=9.525e-3, pitch_diameter=46e-3, speed=300.0,
        radial_load=radial, axial_load=axial, clearance=8e-6, tilt=tilt,
    )  # fmt: skip
    shifts, arm = np.array(bearing.shifts(STEEL)), bearing._arm
    arms = np.array([1.0, 1.0, arm])

    def forces(moved):
        return bearing._forces(moved * arms, bearing.stiffness(STEEL)) * arms

    steps = np.array([1e-9, 1e-9, 1e-9 / arm])
    numeric = np.array(
        [
            (forces(shifts + step) - forces(shifts - step)) / (2.0 * steps[axis])
            for axis, step in enumerate(np.diag(steps))
        ]
    ).T
    matrix = bearing.stiffness_matrix(STEEL)
    assert matrix == pytest.approx(matrix.T)
    np.testing.assert_allclose(matrix, numeric, rtol=1e-4, atol=1e-4 * matrix.max())


def test_the_stiffness_of_a_roller_bearing_is_the_derivative_of_its_load(machine):
    case = machine(BEARING, {"machine.designation": "NU 206"})
    bearing, step = case.machine, 1e-9
    low, high = (
        float(np.cos(bearing.angles) @ bearing._slice_loads(bearing.shift + side).sum(axis=1))
        for side in (-step, step)
    )
    matrix = bearing.stiffness_matrix(case.pair)
    assert matrix[0, 0] == pytest.approx((high - low) / (2.0 * step), rel=1e-4)
    assert machine_conditions(case).scalars()["stiffness_matrix"] == matrix.tolist()


def test_the_oil_of_the_micropitting_test_fails_on_its_own_gears():
    """On the test's own gears, oil and stage the safety is 1/1.4 by definition."""
    case = load_machine(
        EXAMPLES / "fzg-c.toml",
        {
            "machine.torque": "215.6 N m",
            "machine.speed": "2170 r/min",
            "machine.face_width": "14 mm",
            "lubricant.temperature": "90 degC",
            "rating": {"roughness_ra": "0.5 um", "micropitting_stage": 9},
        },
    )
    found = ratings_of(case)
    assert found["micropitting_safety"] == pytest.approx(1.0 / 1.4, rel=1e-3)
    better = ratings_of(case.with_overrides({"rating.micropitting_stage": 10}))
    assert better["permissible_film"] < found["permissible_film"]
    with pytest.raises(BadInput, match="micropitting_stage must be a load stage from 5 to 10"):
        case.with_overrides({"rating.micropitting_stage": 4})


def harmonic_table(step, rounding, offset=0.0):
    angles = np.radians(np.arange(-60.0, 60.0 + 1e-9, step))
    lifts = 0.5 * LIFT * (1.0 + np.cos(np.pi * angles / HALF_ANGLE))
    if rounding:
        lifts = np.round(lifts / rounding) * rounding
    return tuple(zip((angles + offset).tolist(), lifts.tolist(), strict=True))


@pytest.mark.parametrize("step", [1.0, 2.0, 5.0])
@pytest.mark.parametrize("rounding", [0.0, 1e-6, 5e-6])
def test_the_curvature_of_a_lift_table_is_that_of_its_law(step, rounding):
    exact = FlatCam(lift=LIFT, half_angle=HALF_ANGLE, **CAM)
    cam = FlatCam(lift_table=harmonic_table(step, rounding, offset=0.7), **CAM)
    scale = abs(exact.law(0.0, 2))
    for degrees in np.linspace(-50.0, 50.0, 21):
        angle = math.radians(degrees)
        assert cam.law(angle, 2) == pytest.approx(exact.law(angle, 2), abs=0.01 * scale)
    assert cam.law.largest == pytest.approx(LIFT, rel=1e-3)


def test_a_cam_by_table_has_contacts_on_both_flanks():
    exact = RollerCam(lift=LIFT, half_angle=HALF_ANGLE, roller_radius=9e-3, **CAM)
    cam = RollerCam(lift_table=harmonic_table(1.0, 1e-6), roller_radius=9e-3, **CAM)
    assert len(cam.contacts(STEEL)) == 2 * len(exact.contacts(STEEL)) - 1
    top, same = (
        next(contact for contact in machine.contacts(STEEL) if abs(contact.position) < 1e-6)
        for machine in (cam, exact)
    )
    assert top.radius == pytest.approx(same.radius, rel=0.01)
    assert top.load == pytest.approx(same.load, rel=0.01)
    assert cam.frequencies["roller_hz"] == pytest.approx(exact.frequencies["roller_hz"], rel=2e-3)


def test_a_lift_table_is_read_from_a_file(machine, tmp_path):
    rows = [f"{math.degrees(a):.0f};{1e3 * s:.3f}" for a, s in harmonic_table(1.0, 1e-6)]
    table = "\n".join(["angle deg;lift mm", *rows])
    (tmp_path / "lift.csv").write_text(table.replace(".", ","), "utf-8")
    text = f"""
[machine]
kind = "cam-flat"
base_radius = "36 mm"
lift_table = "lift.csv"
width = "14 mm"
speed = "150 rad/s"
spring_load = "300 N"
{OIL}
"""
    case = machine(text)
    assert len(case.contacts) == 17
    assert any("table of 121 lifts is smoothed by 0.2" in note for note in case.notes)
    with pytest.raises(BadInput, match="lift_table and lift both state the lift"):
        machine(text, {"machine.lift": "9 mm"})
    with pytest.raises(BadInput, match=r"missing.csv.* does not exist"):
        machine(text, {"machine.lift_table": "missing.csv"})


@pytest.mark.parametrize(
    ("table", "message"),
    [
        (harmonic_table(1.0, 0.0)[:5], "must have at least 12 lifts, got 5"),
        (harmonic_table(1.0, 0.0)[::-1], "rising angles"),
        (harmonic_table(1.0, 0.0)[:60], "largest lift at an end; give both flanks"),
        (tuple((10.0 * a, s) for a, s in harmonic_table(1.0, 0.0)), "spans 1200 deg"),
        (tuple((a, s - 1e-3) for a, s in harmonic_table(1.0, 0.0)), "a lift of -1 mm"),
    ],
)
def test_impossible_lift_tables_are_refused(table, message):
    with pytest.raises(BadInput, match=message):
        FlatCam(lift_table=table, **CAM)


SWEPT = BEARING.replace(
    "[rating]",
    """[study]
machine.radial_load = ["1 kN", "3 kN"]
lubricant.temperature = ["70 degC", "90 degC"]
[contact]
roughness = "standing"
[solver]
surfaces = 1
[rating]""",
).replace('designation = "6206"', 'designation = "6206"\nclearance = "60 um"')


@pytest.mark.usefixtures("in_this_process")
def test_a_study_solves_a_machine_at_every_point(machine, tmp_path):
    case = machine(SWEPT, {"surface": "flat", "grid.cells": [96, 48]})
    swept = sweep_machine(case, out=tmp_path / "sweep", workers=1)
    assert swept.axes == ("machine.radial_load", "lubricant.temperature")
    loads, temperatures = ([row[key] for row in swept.rows] for key in swept.axes)
    assert loads == ["1 kN", "1 kN", "3 kN", "3 kN"]
    assert temperatures == ["70 degC", "90 degC"] * 2
    films = [row["h_min_m"] for row in swept.rows]
    assert films[0] > films[1]  # a thinner oil
    assert films[0] > films[2]  # a higher load
    lives = [row["reference_life"] for row in swept.rows]
    assert lives[0] == lives[1] > lives[2]
    table = pandas.read_csv(tmp_path / "sweep" / "study.csv")
    assert table["h_min_m"].tolist() == pytest.approx(films)
    again = sweep_machine(case, out=tmp_path / "sweep", workers=1)
    assert [row["h_min_m"] for row in again.rows] == films
    alone = machine(SWEPT, {"study": "none", "machine.radial_load": "3 kN"})
    assert sweep_points(case)[2] == {
        "machine.radial_load": "3 kN",
        "lubricant.temperature": "70 degC",
    }
    assert alone.sweep == {}


def test_a_machine_without_a_study_is_not_swept(machine):
    with pytest.raises(BadInput, match=r"study is missing; add .study. with lists of values"):
        sweep_machine(machine(BEARING))
    ranged = SWEPT.replace('["1 kN", "3 kN"]', '{ from = "1 kN", to = "3 kN", count = 3 }')
    with pytest.raises(BadInput, match=r"study.machine.radial_load must be a list of values"):
        sweep_machine(machine(ranged))


@pytest.mark.parametrize(
    ("study", "message"),
    [
        ("machine.speed = [3000]", "got the bare number 3000"),
        ('machine.flow = ["1 N"]', "machine.flow"),
        ('seeds = 4\nmachine.radial_load = ["1 kN"]', "study.seeds does not apply to a machine"),
    ],
)
def test_points_of_a_study_are_checked_before_they_are_solved(machine, study, message):
    with pytest.raises(BadInput, match=message):
        sweep_points(machine(BEARING.replace("[rating]", f"[study]\n{study}\n[rating]")))


def test_an_edge_between_the_contacts_of_a_cam_is_found():
    """A bump of 50 um between two of the seventeen contacts."""
    angles = np.radians(np.arange(-60.0, 60.5, 1.0))
    lifts = 0.5 * LIFT * (1.0 + np.cos(np.pi * angles / HALF_ANGLE))
    lifts[np.argmin(np.abs(angles - np.radians(26.0)))] += 50e-6
    with pytest.raises(BadInput, match="is undercut"):
        FlatCam(lift_table=tuple(zip(angles.tolist(), lifts.tolist(), strict=True)), **CAM)


def test_missing_inputs_of_a_life_are_named(machine):
    entries = [{"share": 1.0, "load": 1.0}]
    case = machine(BEARING, {"rating.contamination": "none", "rating.spectrum": entries})
    found = {entry.key: entry for entry in machine_ratings(case)}
    for key in ("life_factor", "reliability_factor", "modified_life_s", "spectrum_life_s"):
        assert found[key].machine_value is None
        assert found[key].reason == "[rating] has no contamination"


def test_losses_of_a_machine_with_an_unsolved_contact_are_unknown(machine, tmp_path):
    """Cells too large for the roughness: every contact is refused."""
    case = machine(SWEPT, {"grid.cells": [32, 32], "study": {"machine.radial_load": ["1 kN"]}})
    (row,) = sweep_machine(case, out=tmp_path / "sweep", workers=1).rows
    assert row["failed"] > 0
    assert row["friction_power_w"] is None
    assert row["rolling_friction_power_w"] is None
