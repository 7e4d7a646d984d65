"""Four-point contact bearings: the angular-contact bearing, equilibrium, rolling and refusals."""

import math
from pathlib import Path

import numpy as np
import pytest
import scipy

from asperity.case import load_machine
from asperity.contact.conditions import ElasticPair
from asperity.contact.hertz import elliptic_contact
from asperity.core.errors import BadInput
from asperity.machine import BallBearing, FourPointBearing
from asperity.machines import machine_conditions
from asperity.report.machine.contact_path import along_path
from asperity.report.machine.sketch import machine_sketch

STEEL = ElasticPair((206e9, 206e9), (0.3, 0.3))
EXAMPLE = Path(__file__).parents[2] / "examples" / "four-point.toml"
RESTING = math.radians(35.0)
GEOMETRY = {
    "balls": 12,
    "ball_diameter": 12e-3,
    "pitch_diameter": 60e-3,
    "speed": 50.0 * math.pi,
}
GROOVE = 0.05 * 12e-3  # A, distance of the centres of two opposite arcs
BOTH = {"radial_load": 2000.0, "axial_load": 1000.0}


def forces(bearing):
    """Return radial and axial force of all contacts [N], and the moment over the arm."""
    loads, angles = bearing.loads(STEEL)
    across, along = loads * np.cos(angles), loads * np.sin(angles)
    cosines = np.cos(bearing.angles)
    axial = along[0] - along[1]
    return [float(across.sum(axis=0) @ cosines), float(axial.sum()), float(axial @ cosines)]


@pytest.mark.parametrize(
    "loads",
    [{"axial_load": 3000.0}, {"radial_load": 2000.0, "axial_load": 3000.0}],
    ids=["thrust", "both"],
)
def test_one_loaded_row_is_an_angular_contact_bearing(loads):
    four = FourPointBearing(**GEOMETRY, **loads)
    two = BallBearing(**GEOMETRY, **loads, contact_angle=RESTING)
    found, angles = four.loads(STEEL)
    expected, expected_angles = two.loads(STEEL)
    assert np.all(found[1] == 0.0)
    assert found[0] == pytest.approx(expected, rel=1e-7)
    loaded = expected > 0.0
    assert angles[0][loaded] == pytest.approx(expected_angles[loaded], rel=1e-7)
    for contact, reference in zip(four.contacts(STEEL), two.contacts(STEEL), strict=True):
        assert contact.surface_speeds == pytest.approx(reference.surface_speeds, rel=1e-7)
        assert contact.overrolling_hz == pytest.approx(reference.overrolling_hz, rel=1e-7)
        assert contact.radius == pytest.approx(reference.radius, rel=1e-7)
    assert four.spin_speeds(STEEL) == {}
    assert four.frequencies == pytest.approx(two.frequencies, rel=1e-9)


def test_pure_thrust_satisfies_the_closed_form():
    """F_a/(Z c_p A^1.5) = sin α (cos α_f/cos α - 1)^1.5, cos α_f = cos α_0 - s/(2 A)."""
    bearing = FourPointBearing(**GEOMETRY, axial_load=3000.0, clearance=20e-6)
    _, (angles, _) = bearing.loads(STEEL)
    free = math.acos(math.cos(RESTING) - 20e-6 / (2.0 * GROOVE))
    scale = 12 * bearing.stiffness(STEEL) * GROOVE**1.5
    right = math.sin(angles[0]) * (math.cos(free) / math.cos(angles[0]) - 1.0) ** 1.5
    assert 3000.0 / scale == pytest.approx(right, rel=1e-9)
    assert bearing.free_angle == pytest.approx(free, rel=1e-12)
    assert bearing.axial_play == pytest.approx(
        2.0 * GROOVE * (math.sin(free) - math.sin(RESTING)), rel=1e-12
    )
    ratio = 12.0 * math.cos(free) / 60.0
    assert bearing.frequencies["bpfi_hz"] == pytest.approx(12 * 12.5 * (1.0 + ratio), rel=1e-12)


def test_a_radial_load_is_carried_by_four_contacts():
    bearing = FourPointBearing(**GEOMETRY, radial_load=2000.0)
    loads, angles = bearing.loads(STEEL)
    assert loads[0] == pytest.approx(loads[1], rel=1e-9)
    shift = bearing.shifts(STEEL)[0]
    across = GROOVE * math.cos(RESTING) + shift * np.cos(bearing.angles)
    elastic = np.maximum(np.hypot(across, GROOVE * math.sin(RESTING)) - GROOVE, 0.0)
    assert loads[0] == pytest.approx(bearing.stiffness(STEEL) * elastic**1.5, rel=1e-9)
    assert forces(bearing) == pytest.approx([2000.0, 0.0, 0.0], rel=1e-9, abs=1e-6)
    names = [contact.name for contact in bearing.contacts(STEEL)[:4]]
    assert names == [
        f"ball 0, {side} ring"
        for side in ("left inner", "right outer", "right inner", "left outer")
    ]
    assert loads[0][:3] == pytest.approx([440.784, 354.900, 155.288], rel=1e-5)
    assert angles[0][0] == pytest.approx(math.radians(34.2162), rel=1e-5)


def test_a_light_radial_load_has_stribecks_constant():
    """2 Z Q_max cos α/F_r = 4.370 for many balls without clearance."""
    many = GEOMETRY | {"balls": 200, "ball_diameter": 0.9e-3}
    bearing = FourPointBearing(**many, radial_load=1.0)
    (loads, _), _ = bearing.loads(STEEL)
    assert 2.0 * 200 * loads[0] * math.cos(RESTING) == pytest.approx(4.370, rel=1e-3)


def test_preload_loads_four_contacts_of_each_ball():
    bearing = FourPointBearing(**GEOMETRY, clearance=-10e-6)
    across, along = GROOVE * math.cos(RESTING) + 5e-6, GROOVE * math.sin(RESTING)
    expected = bearing.stiffness(STEEL) * (math.hypot(across, along) - GROOVE) ** 1.5
    loads, _ = bearing.loads(STEEL)
    assert loads == pytest.approx(np.full((2, 12), expected), rel=1e-9)
    assert len(bearing.contacts(STEEL)) == 48


@pytest.mark.parametrize("tilt", [None, 0.0, 1e-3])
def test_loads_are_in_equilibrium_in_both_directions(tilt):
    rng = np.random.default_rng(3)
    for _ in range(20):
        radial = 10.0 ** rng.uniform(1.0, 4.0)
        bearing = FourPointBearing(
            **GEOMETRY,
            radial_load=radial,
            axial_load=radial * 10.0 ** rng.uniform(-3.0, 1.0),
            contact_angle=math.radians(rng.uniform(12.0, 45.0)),
            clearance=rng.uniform(-10e-6, 30e-6),
            tilt=tilt,
        )
        found = forces(bearing)
        force = max(bearing.radial_load, bearing.axial_load)
        assert found[:2] == pytest.approx(
            [bearing.radial_load, bearing.axial_load], abs=1e-7 * force
        )
        if tilt is None:
            assert found[2] == pytest.approx(0.0, abs=1e-7 * force)


def ball_on_four_contacts(bearing, number):
    """Return loads and angles (rings, rows) of a ball whose own forces balance, by Newton's method.

    The ball's centre is unknown; each arc pushes along the line from the arc's centre.
    """
    radial, axial, _ = bearing.shifts(STEEL)
    outward = radial * math.cos(bearing.angles[number])
    arms = [(groove - 0.5) * 12e-3 for groove in bearing.osculation]
    stiffness = [
        elliptic_contact(1.0, radii, STEEL.reduced_modulus).approach ** -1.5
        for radii in bearing._radii(RESTING)
    ]
    sine, cosine = math.sin(RESTING), math.cos(RESTING)
    centres = {
        (0, 0): (arms[0] * cosine + outward, arms[0] * sine + axial),
        (0, 1): (arms[0] * cosine + outward, -arms[0] * sine + axial),
        (1, 0): (-arms[1] * cosine, -arms[1] * sine),
        (1, 1): (-arms[1] * cosine, arms[1] * sine),
    }

    def contacts(ball):
        for (ring, _), centre in centres.items():
            line = np.array(centre) - ball
            length = float(np.hypot(*line))
            load = stiffness[ring] * max(length - arms[ring], 0.0) ** 1.5
            yield load, line / length

    def excess(ball):
        return sum(load * direction for load, direction in contacts(1e-6 * ball))

    solution = scipy.optimize.root(excess, 5e5 * np.array([outward, axial]), tol=1e-12)
    assert np.abs(solution.fun).max() < 1e-6
    found = list(contacts(1e-6 * solution.x))
    angles = [math.atan2(abs(along), abs(across)) for _, (across, along) in found]
    return np.reshape([load for load, _ in found], (2, 2)), np.reshape(angles, (2, 2))


@pytest.mark.parametrize("axial", [0.0, 300.0, 1000.0])
@pytest.mark.parametrize("osculation", [(0.52, 0.53), (0.515, 0.525)])
def test_superposed_rows_agree_with_the_balance_of_each_ball(axial, osculation):
    bearing = FourPointBearing(
        **GEOMETRY, radial_load=2000.0, axial_load=axial, osculation=osculation
    )
    loads, _ = bearing.loads(STEEL)
    angles = bearing.contact_angles(STEEL)
    for number in (0, 1):
        expected_loads, expected_angles = ball_on_four_contacts(bearing, number)
        both_rings = np.stack([loads[:, number]] * 2)
        assert both_rings == pytest.approx(expected_loads, rel=5e-3)
        tolerance = 1e-3 * expected_loads.max()
        assert both_rings.mean(axis=0) == pytest.approx(expected_loads.mean(axis=0), abs=tolerance)
        assert np.degrees(angles[:, :, number]) == pytest.approx(
            np.degrees(expected_angles), abs=0.1
        )


def test_four_contacts_slide_and_spin_by_the_motion_of_rigid_bodies():
    """Velocities ω × r of ring and ball in the frame of the cage, about parallel axes."""
    bearing = FourPointBearing(**GEOMETRY, **BOTH)
    angles = bearing.contact_angles(STEEL)
    spins = bearing.spin_speeds(STEEL)
    contacts = {contact.name: contact for contact in bearing.contacts(STEEL)}
    motion = bearing._motion(bearing.loads(STEEL)[0][:, 0], angles[:, :, 0])
    axis = np.array([0.0, 0.0, 1.0])  # radial, tangential, axial
    sums = np.zeros(2)
    for row, sides in enumerate((("left", "right"), ("right", "left"))):
        for ring, name in enumerate(("inner", "outer")):
            contact = contacts[f"ball 0, {sides[ring]} {name} ring"]
            angle = angles[ring, row, 0]
            outwards = -1.0 if ring == 0 else 1.0
            along = -1.0 if sides[ring] == "left" else 1.0
            normal = np.array([outwards * math.cos(angle), 0.0, along * math.sin(angle)])
            point = 6e-3 * normal  # from the ball's centre
            ring_rotation = (motion.ring_speed(0) if ring == 0 else -motion.cage_speed) * axis
            ball_rotation = -motion.ball_speed * axis
            of_ring = np.cross(ring_rotation, point + np.array([30e-3, 0.0, 0.0]))
            of_ball = np.cross(ball_rotation, point)
            sign = 1.0 if ring == 0 else -1.0
            assert contact.surface_speeds == pytest.approx(
                (sign * of_ring[1], sign * of_ball[1]), rel=1e-9
            )
            spin = abs((ring_rotation - ball_rotation) @ normal)
            assert spins[contact.name] == pytest.approx(spin, rel=1e-9)
            sums[ring] += contact.load * (contact.surface_speeds[0] - contact.surface_speeds[1])
    assert sums == pytest.approx([0.0, 0.0], abs=1e-9)


def test_sliding_and_spin_have_the_closed_forms():
    """Δu = (D/2)(c_m - c)(ω_i - ω_c + ω_b) and spin (ω_i - ω_c + ω_b) sin α at the inner ring."""
    bearing = FourPointBearing(**GEOMETRY, **BOTH)
    angles = bearing.contact_angles(STEEL)[:, :, 0]
    loads = bearing.loads(STEEL)[0][:, 0]
    mean = np.cos(angles) @ loads / loads.sum()
    inner, outer = 5.0 / mean
    cage = 50.0 * math.pi * (inner - 1.0) / (inner + outer)
    relative = 50.0 * math.pi - cage + cage * (outer + 1.0)
    contact = bearing.contacts(STEEL)[0]
    first, second = contact.surface_speeds
    assert first - second == pytest.approx(
        6e-3 * (mean[0] - math.cos(angles[0, 0])) * relative, rel=1e-9
    )
    assert bearing.spin_speeds(STEEL)[contact.name] == pytest.approx(
        relative * math.sin(angles[0, 0]), rel=1e-9
    )
    assert contact.slide_to_roll == pytest.approx(4.66e-3, rel=1e-2)


def test_a_radial_load_causes_spin_but_no_sliding():
    """With equal angles: ω_c = ω_i (1 - γ)/2 and ω_b = ω_i (d_m/(2 D cos α))(1 - γ²)."""
    bearing = FourPointBearing(**GEOMETRY, radial_load=20.0)
    assert all(contact.slide_to_roll == 0.0 for contact in bearing.contacts(STEEL))
    spins = bearing.spin_speeds(STEEL)
    assert len(spins) == len(bearing.contacts(STEEL))
    ratio = 12.0 * math.cos(RESTING) / 60.0
    ball = 50.0 * math.pi * (1.0 - ratio**2) / (2.0 * ratio)
    at_inner = (25.0 * math.pi * (1.0 + ratio) + ball) * math.sin(RESTING)
    at_outer = (ball - 25.0 * math.pi * (1.0 - ratio)) * math.sin(RESTING)
    assert spins["ball 0, left inner ring"] == pytest.approx(at_inner, rel=2e-3)
    assert spins["ball 0, left outer ring"] == pytest.approx(at_outer, rel=2e-3)
    passages = bearing.contacts(STEEL)[0].overrolling_hz
    assert passages == pytest.approx(
        (bearing.frequencies["bpfi_hz"], ball / (2.0 * math.pi)), rel=1e-3
    )


def test_the_forces_are_the_derivative_of_the_energy():
    bearing = FourPointBearing(**GEOMETRY, **BOTH)
    shifts, step = np.array(bearing.shifts(STEEL)), 1e-9
    rows = bearing._rows(bearing.stiffness(STEEL))
    slopes = [
        sum(row.energy(shifts + move) - row.energy(shifts - move) for row in rows) / (2.0 * step)
        for move in step * np.eye(3)[:2]
    ]
    assert slopes == pytest.approx([2000.0, 1000.0], rel=1e-5)


@pytest.mark.parametrize("tilt", [0.0, 5e-4])
def test_the_stiffness_matrix_is_the_derivative_of_the_forces(tilt):
    bearing = FourPointBearing(**GEOMETRY, **BOTH, tilt=tilt)
    shifts, arms = np.array(bearing.shifts(STEEL)), np.array([1.0, 1.0, bearing._arm])
    stiffness = bearing.stiffness(STEEL)
    steps = np.diag([1e-9, 1e-9, 1e-8])
    slopes = [
        (
            bearing._forces((shifts + step) * arms, stiffness)
            - bearing._forces((shifts - step) * arms, stiffness)
        )
        * arms
        / (2.0 * step.sum())
        for step in steps
    ]
    matrix = bearing.stiffness_matrix(STEEL)
    assert matrix == pytest.approx(np.transpose(slopes), rel=1e-4, abs=1e-5 * matrix.max())


def test_the_example_has_these_contacts():
    result = machine_conditions(load_machine(EXAMPLE))
    bearing = result.case.machine
    assert isinstance(bearing, FourPointBearing)
    loads, _ = bearing.loads(STEEL)
    assert loads[:, :4] == pytest.approx(
        np.array([[619.841, 526.600, 299.908, 70.3531], [247.863, 180.061, 37.7180, 0.0]]),
        rel=1e-4,
    )
    angles = np.degrees(bearing.contact_angles(STEEL)[:, :, 0])
    assert angles == pytest.approx(np.array([[34.6546, 33.5065], [34.7535, 33.9384]]), rel=1e-5)
    assert len(result.rows) == 24
    assert result.worst["p_hertz_pa"] == pytest.approx(1.6218e9, rel=1e-4)
    assert any("Of 7 loaded balls 5 have four loaded contacts" in note for note in result.notes)
    assert machine_sketch(result).picture().uri.startswith("data:image")
    assert along_path(result).picture().uri.startswith("data:image")


def test_effects_outside_the_model_are_noted():
    heavy = FourPointBearing(**GEOMETRY, axial_load=1e5, contact_angle=math.radians(12.0))
    assert any("passes the middle of the raceway" in note for note in heavy.notes(STEEL))
    thrust = FourPointBearing(**GEOMETRY, axial_load=500.0).notes(STEEL)
    assert any("two contacts and rolls as in an angular-contact bearing" in n for n in thrust)
    assert not any("middle of the raceway" in note for note in thrust)


@pytest.mark.parametrize(
    ("changed", "message"),
    [
        ({"contact_angle": math.radians(5.0)}, "between 10 and 60 deg, got 5 deg.*ball-bearing"),
        ({"contact_angle": math.radians(70.0)}, "between 0 and 60 deg, got 70 deg"),
        ({"balls": 16}, "16 rolling elements of 12 mm do not fit"),
        ({"osculation": (0.5, 0.53)}, "osculation must lie above 0.5"),
        ({"radial_load": 0.0, "axial_load": 0.0}, "both 0 N, no ball is loaded"),
        ({"axial_load": -1.0}, "axial_load must not be negative, got -1 N"),
        ({"clearance": 400e-6}, "above 60 deg in these grooves; it must be at most 383.0 um"),
        ({"tilt": 0.1}, "between -20 and 20 mrad, got 100 mrad"),
    ],
)
def test_impossible_four_point_bearings_are_refused(changed, message):
    with pytest.raises(BadInput, match=message):
        FourPointBearing(**(GEOMETRY | BOTH | changed))
