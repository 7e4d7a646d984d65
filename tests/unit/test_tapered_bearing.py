"""Tapered roller bearings: geometry of cones, equilibrium, closed forms and refusals."""

import math
from pathlib import Path

import numpy as np
import pytest
import scipy

from asperity.case import load_machine
from asperity.contact.conditions import ElasticPair
from asperity.core.errors import BadInput
from asperity.machine import CylindricalRollerBearing, TaperedRollerBearing
from asperity.machine.tapered import half_zone_ratio
from asperity.machines import machine_conditions
from asperity.report.machine.sketch import machine_sketch

STEEL = ElasticPair((206e9, 206e9), (0.3, 0.3))
EXAMPLE = Path(__file__).parents[2] / "examples" / "tapered.toml"
GEOMETRY = {
    "rollers": 17,
    "roller_diameter": 7.4e-3,
    "roller_length": 11e-3,
    "pitch_diameter": 46e-3,
    "cup_angle": math.radians(14.0),
    "speed": 100.0 * math.pi,
}
LOADED = GEOMETRY | {"radial_load": 4000.0}


def sjovall_integral(eps, power, *, radial):
    """J_r(ε), or J_a(ε) without the factor cos ψ."""
    end = math.pi if eps > 1.0 else math.acos(1.0 - 2.0 * eps)

    def integrand(psi):
        load = max(1.0 - (1.0 - math.cos(psi)) / (2.0 * eps), 0.0) ** power
        return load * math.cos(psi) if radial else load

    return scipy.integrate.quad(integrand, 0.0, end)[0] / math.pi


@pytest.fixture
def bearing():
    return TaperedRollerBearing(**LOADED)


def mid_points(bearing):
    """Radii of the contact lines' middles at cone and cup, from the bearing's axis [m]."""
    half = bearing.roller_diameter / 2.0 * math.cos(bearing.roller_axis_angle)
    return bearing.pitch_diameter / 2.0 - half, bearing.pitch_diameter / 2.0 + half


def test_cup_cone_and_roller_have_a_common_apex(bearing):
    """Axial distance from the apex to each line's middle, and along the roller's axis."""
    inner, outer = bearing.contact_angles
    axis, taper = bearing.roller_axis_angle, bearing.taper_half_angle
    centre = bearing.pitch_diameter / 2.0 / math.tan(axis)
    offset = bearing.roller_diameter / 2.0 * math.sin(axis)
    radius_i, radius_o = mid_points(bearing)
    assert radius_i / math.tan(inner) == pytest.approx(centre + offset, rel=1e-12)
    assert radius_o / math.tan(outer) == pytest.approx(centre - offset, rel=1e-12)
    assert math.tan(taper) == pytest.approx(7.4 / 46.0 * math.sin(axis), rel=1e-12)
    assert bearing.apex_distance == pytest.approx(radius_o / math.sin(outer), rel=1e-12)
    assert [math.degrees(angle) for angle in (inner, axis, taper)] == pytest.approx(
        [10.14581, 12.07290, 1.927096], rel=1e-6
    )


def test_effective_radii_are_those_of_cones(bearing):
    """1/R = 1/R1 + 1/R2 with r/cos(half angle) of each cone; the cup is concave."""
    inner, outer = bearing.contact_angles
    roller = 3.7e-3 / math.cos(bearing.taper_half_angle)
    radius_i, radius_o = mid_points(bearing)
    cone, cup = radius_i / math.cos(inner), radius_o / math.cos(outer)
    assert bearing.radii == pytest.approx(
        (1.0 / (1.0 / roller + 1.0 / cone), 1.0 / (1.0 / roller - 1.0 / cup)), rel=1e-12
    )
    first, second = bearing.contacts(STEEL)[:2]
    assert (first.radius, second.radius) == bearing.radii
    assert [1e3 * radius for radius in bearing.radii] == pytest.approx(
        [3.116184, 4.279631], rel=1e-6
    )


def test_the_raceways_roll_at_the_epicyclic_speeds_of_cones(bearing):
    inner, outer = bearing.contact_angles
    kinematics = bearing.kinematics
    cage = 100.0 * math.pi * math.sin(inner) / (math.sin(inner) + math.sin(outer))
    assert kinematics.cage_speed == pytest.approx(cage, rel=1e-12)
    radius_i, radius_o = mid_points(bearing)
    speed = radius_o * cage
    assert radius_i * (100.0 * math.pi - cage) == pytest.approx(speed, rel=1e-12)
    assert kinematics.spin * 3.7e-3 == pytest.approx(speed, rel=1e-12)
    for contact in bearing.contacts(STEEL):
        assert contact.surface_speeds == pytest.approx((speed, speed), rel=1e-12)
    ratio = 7.4 / 46.0 * math.cos(bearing.roller_axis_angle)
    assert bearing.frequencies == pytest.approx(
        {
            "shaft_hz": 50.0,
            "bpfo_hz": 17 * 25.0 * (1.0 - ratio),
            "bpfi_hz": 17 * 25.0 * (1.0 + ratio),
            "bsf_hz": 25.0 * 46.0 / 7.4 * (1.0 - ratio**2),
            "ftf_hz": 25.0 * (1.0 - ratio),
        },
        rel=1e-12,
    )


def test_a_small_angle_has_the_geometry_of_a_cylindrical_roller_bearing():
    """Differences of 1 - cos β, 1.2e-4 at 1 deg."""
    flat = TaperedRollerBearing(**(LOADED | {"cup_angle": math.radians(1.0)}))
    straight = CylindricalRollerBearing(
        **{key: value for key, value in LOADED.items() if key != "cup_angle"}
    )
    for found, expected in zip(flat.radii, straight.kinematics.radii, strict=True):
        assert found == pytest.approx(expected, rel=2e-4)
    assert flat.frequencies == pytest.approx(straight.frequencies, rel=2e-4)
    assert flat.loads[:4] == pytest.approx(straight.loads[:4], rel=5e-3)


@pytest.mark.parametrize("profile", ["straight", "iso"])
@pytest.mark.parametrize("degrees", [1.0, 14.0, 30.0])
def test_thrust_without_axial_shift_has_the_loads_of_a_cylindrical_roller_bearing(degrees, profile):
    """δ = δ_r cos α cos ψ: the loads Q are those under F_r/cos α, with the thrust sin α Σ Q."""
    angle = math.radians(degrees)
    across = {key: value for key, value in GEOMETRY.items() if key != "cup_angle"}
    straight = CylindricalRollerBearing(
        **across, radial_load=4000.0 / math.cos(angle), profile=profile
    )
    tapered = TaperedRollerBearing(
        **(LOADED | {"cup_angle": angle}),
        axial_load=math.sin(angle) * float(straight.loads.sum()),
        profile=profile,
    )
    tolerance = 1e-5 * straight.loads.max()
    assert tapered.loads == pytest.approx(straight.loads, abs=tolerance)
    assert tapered.shifts[0] * math.cos(angle) == pytest.approx(straight.shift, rel=1e-5)
    assert tapered.contacts(STEEL)[0].line_load == pytest.approx(
        straight.contacts(STEEL)[0].line_load, rel=1e-5
    )


def test_pure_thrust_loads_all_rollers_equally():
    bearing = TaperedRollerBearing(**GEOMETRY, axial_load=3000.0)
    expected = 3000.0 / (17 * math.sin(math.radians(14.0)))
    assert bearing.loads == pytest.approx([expected] * 17, rel=1e-9)
    assert len(bearing.contacts(STEEL)) == 34
    assert not any("in line with the radial load" in note for note in bearing.notes(STEEL))


def test_loads_are_in_equilibrium_in_both_directions():
    rng = np.random.default_rng(5)
    for _ in range(40):
        angle = math.radians(rng.uniform(5.0, 35.0))
        radial = 10.0 ** rng.uniform(2.0, 4.5)
        bearing = TaperedRollerBearing(
            **(GEOMETRY | {"cup_angle": angle, "rollers": int(rng.integers(9, 18))}),
            radial_load=radial,
            axial_load=radial * math.tan(angle) * (1.0 + 10.0 ** rng.uniform(-1.5, 1.0)),
            profile="iso" if rng.random() < 0.5 else "straight",
        )
        across = float(bearing.loads @ np.cos(bearing.angles)) * math.cos(angle)
        assert across == pytest.approx(radial, rel=1e-6)
        assert float(bearing.loads.sum()) * math.sin(angle) == pytest.approx(
            bearing.thrust, rel=1e-6
        )


@pytest.mark.parametrize("profile", ["straight", "iso"])
def test_forces_are_the_derivative_of_the_energy_and_stiffness_that_of_the_forces(profile):
    bearing = TaperedRollerBearing(**LOADED, axial_load=2000.0, profile=profile)
    row = bearing._row
    shifts, step = np.array([*bearing.shifts, 0.0]), 1e-10
    moves = step * np.eye(3)[:2]
    energy_slopes = [
        (row.energy(shifts + move) - row.energy(shifts - move)) / (2.0 * step) for move in moves
    ]
    assert energy_slopes == pytest.approx([4000.0, 2000.0], rel=1e-5)
    force_slopes = [
        (row.forces(shifts + move) - row.forces(shifts - move)) / (2.0 * step) for move in moves
    ]
    tangent = row.tangent(shifts)
    assert tangent[:2] == pytest.approx(np.array(force_slopes), rel=1e-3, abs=1e-4 * tangent.max())


@pytest.mark.parametrize("eps", [0.3, 0.5, 1.0, 2.5])
def test_the_load_zone_of_many_rollers_has_sjovalls_integrals(eps):
    """F_r = Z Q_max J_r cos α and F_a = Z Q_max J_a sin α, n = 10/9."""
    across = sjovall_integral(eps, 10.0 / 9.0, radial=True)
    along = sjovall_integral(eps, 10.0 / 9.0, radial=False)
    thin = {"rollers": 400, "roller_diameter": 0.3e-3, "roller_length": 1e-3}
    angle = LOADED["cup_angle"]
    bearing = TaperedRollerBearing(
        **(LOADED | thin), axial_load=4000.0 * math.tan(angle) * along / across
    )
    assert bearing.loads[0] == pytest.approx(4000.0 / (400 * across * math.cos(angle)), rel=1e-4)
    if eps == 0.5:
        assert along / across == pytest.approx(half_zone_ratio(10.0 / 9.0), rel=1e-6)
        assert bearing.thrust == pytest.approx(bearing.induced_thrust, rel=1e-6)
        assert np.count_nonzero(bearing.loads) == pytest.approx(200, abs=2)


def test_the_induced_thrust_agrees_with_published_values(bearing):
    """Harris: 0.7939 and 0.8225 for F_r tan α/F_a; ISO 281: F_r/(2 Y) with Y = 0.4 cot α."""
    assert half_zone_ratio(1.1) == pytest.approx(1.0 / 0.7939, rel=1e-3)
    assert half_zone_ratio(1.5) == pytest.approx(1.0 / 0.8225, rel=1e-3)
    tangent = math.tan(math.radians(14.0))
    assert bearing.thrust == pytest.approx(1.2580 * 4000.0 * tangent, rel=1e-4)
    assert bearing.thrust == pytest.approx(4000.0 * tangent / 0.8, rel=1e-2)
    assert np.count_nonzero(bearing.loads) == 9
    assert any("1255 N, induced by the radial load" in note for note in bearing.notes(STEEL))


@pytest.mark.parametrize("rib_degrees", [None, 10.5, 13.0])
def test_the_forces_on_a_roller_balance(rib_degrees):
    """Cup, cone and rib, radially outwards and towards the large end."""
    rib = None if rib_degrees is None else math.radians(rib_degrees)
    bearing = TaperedRollerBearing(**LOADED, rib_angle=rib)
    inner, outer = bearing.contact_angles
    direction = bearing.roller_axis_angle if rib is None else rib
    at_cone, at_cup = (contact.load for contact in bearing.contacts(STEEL)[:2])
    force = (
        at_cup * np.array([-math.cos(outer), math.sin(outer)])
        + at_cone * np.array([math.cos(inner), -math.sin(inner)])
        - bearing.rib_forces[0] * np.array([math.sin(direction), math.cos(direction)])
    )
    assert force == pytest.approx([0.0, 0.0], abs=1e-9 * at_cup)
    if rib is None:
        assert at_cone == pytest.approx(at_cup, rel=1e-12)
        half = math.sin((outer - inner) / 2.0)
        assert bearing.rib_forces[0] == pytest.approx(2.0 * at_cup * half, rel=1e-12)


def test_the_example_has_these_loads():
    result = machine_conditions(load_machine(EXAMPLE))
    bearing = result.case.machine
    assert isinstance(bearing, TaperedRollerBearing)
    assert bearing.loads[:6] == pytest.approx(
        [992.249, 917.877, 708.264, 402.730, 68.0926, 0.0], rel=1e-5
    )
    assert bearing.rib_forces.max() == pytest.approx(66.7344, rel=1e-5)
    assert [1e6 * shift for shift in bearing.shifts] == pytest.approx(
        [5.99869, -0.0676696], rel=1e-4
    )
    assert result.worst["p_hertz_pa"] == pytest.approx(1.0212e9, rel=1e-4)
    assert "Tapered roller bearing, 9 of 17 rollers loaded" in result.verdict()
    assert machine_sketch(result).picture().uri.startswith("data:image")


def test_a_stated_cone_angle_is_a_check():
    rounded = TaperedRollerBearing(**LOADED, cone_angle=math.radians(10.1))
    assert rounded.radii == TaperedRollerBearing(**LOADED).radii


def test_few_loaded_rollers_are_noted():
    angle = LOADED["cup_angle"]
    loose = TaperedRollerBearing(**LOADED, axial_load=1.02 * 4000.0 * math.tan(angle))
    assert any("The thrust loads 3 of 17 rollers" in note for note in loose.notes(STEEL))
    brass = ElasticPair((100e9, 206e9), (0.3, 0.3))
    assert any("steel rollers" in note for note in loose.notes(brass))


@pytest.mark.parametrize(
    ("changed", "message"),
    [
        ({"cup_angle": math.radians(0.2)}, "got 0.2 deg; below, use the kind cylindrical-roller"),
        ({"cup_angle": math.radians(50.0)}, "between 1 and 45 deg, got 50 deg"),
        ({"rollers": 20}, "20 rolling elements of 7.4 mm do not fit"),
        (
            {"cone_angle": math.radians(12.0)},
            "cone_angle of 12 deg does not meet .* one apex.* 10.15 deg; leave cone_angle out",
        ),
        ({"rib_angle": math.radians(20.0)}, "between .* 10.15 and 14.00 deg, got 20 deg"),
        ({"roller_length": 0.3}, "less than 220 mm, where the rollers reach the apex.*300 mm"),
        (
            {"axial_load": 900.0},
            "comes apart under an axial_load of 900 N with 4000 N radial load; give more than "
            "997.3 N, or leave axial_load out for 1255 N",
        ),
        ({"radial_load": 0.0}, "both 0 N, no roller is loaded"),
        ({"radial_load": -5.0}, "radial_load must not be negative, got -5 N"),
        ({"axial_load": -5.0}, "axial_load must not be negative, got -5 N"),
        ({"profile": "round"}, "profile must be"),
    ],
)
def test_impossible_tapered_bearings_are_refused(changed, message):
    with pytest.raises(BadInput, match=message):
        TaperedRollerBearing(**(LOADED | changed))
