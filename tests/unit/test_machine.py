"""Contacts of machines: closed forms, catalogue and published values, reference implementations,
and refusals.
"""

import math

import numpy as np
import pytest
import scipy

from asperity.contact.conditions import ElasticPair
from asperity.core.errors import BadInput
from asperity.machine import (
    BallBearing,
    CamPoint,
    CylindricalRollerBearing,
    FlatCam,
    RollerCam,
    RollingKinematics,
    SpurGear,
    TwinDisc,
)
from asperity.rating import BallRaceway, ball_life

STEEL = ElasticPair((206e9, 206e9), (0.3, 0.3))
RPM = 2.0 * math.pi / 60.0
FZG = {
    "module": 4.5e-3,
    "teeth": (16, 24),
    "pressure_angle": math.radians(20.0),
    "centre_distance": 91.5e-3,
    "speed": 2170.0 * RPM,
}
A_GEAR = FZG | {
    "profile_shift": (0.8532, -0.5),
    "face_width": 0.02,
    "tip_diameters": (88.77e-3, 112.5e-3),
    "torque": 534.5,
}
C_GEAR = FZG | {
    "profile_shift": (0.1817, 0.1715),
    "face_width": 0.014,
    "tip_diameters": (82.46e-3, 118.36e-3),
    "torque": 265.1,
}
NU206 = {
    "rollers": 13,
    "roller_diameter": 9e-3,
    "roller_length": 10e-3,
    "pitch_diameter": 46.5e-3,
    "radial_load": 4000.0,
    "speed": 3000.0 * RPM,
}
BALLS = {"balls": 7, "ball_diameter": 11.5e-3, "pitch_diameter": 43.5e-3, "speed": 100.0}
BALLS_6206 = {"balls": 9, "ball_diameter": 9.525e-3, "pitch_diameter": 46e-3, "speed": 3000.0 * RPM}
BALLS_7205 = {
    "balls": 12,
    "ball_diameter": 7.938e-3,
    "pitch_diameter": 38.5e-3,
    "speed": 100.0,
    "contact_angle": math.radians(40.0),
}
CAM = {
    "base_radius": 15e-3,
    "lift": 10e-3,
    "half_angle": math.pi,
    "width": 10e-3,
    "speed": 100.0,
    "spring_load": 100.0,
}

# Gears
# -------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("gears", "table"),  # s mm, R mm, u1, u2 m/s, slide-to-roll, share, p_h MPa of the FZG gears
    [
        (
            A_GEAR,
            {
                "A": (10.6524, 7.4033, 2.4207, 3.6772, -0.4121, 0.3333, 1132.0),
                "B": (15.4492, 8.6152, 3.5107, 2.9505, 0.1734, 1, 1817.6),
                "C": (13.9701, 8.3820, 3.1746, 3.1746, 0, 0.5639, 1383.7),
                "D": (23.9370, 7.5311, 5.4395, 1.6647, 1.0627, 1, 1944.1),
                "E": (28.7338, 5.0938, 6.5295, 0.9380, 1.4976, 0.3333, 1364.8),
            },
        ),
        (
            C_GEAR,
            {
                "A": (4.4723, 3.8996, 1.0163, 4.6135, -1.2779, 0.3333, 1313.0),
                "B": (10.2848, 7.2561, 2.3371, 3.7329, -0.4599, 1, 1667.1),
                "C": (13.9701, 8.3820, 3.1746, 3.1746, 0, 1, 1551.1),
                "D": (17.7569, 8.7288, 4.0351, 2.6009, 0.4322, 1, 1520.0),
                "E": (23.5694, 7.6635, 5.3560, 1.7203, 1.0275, 0.3333, 936.6),
            },
        ),
    ],
)
def test_fzg_gears_along_the_path_of_contact(gears, table):
    pair = SpurGear(**gears)
    found = {contact.name: contact for contact in pair.contacts(STEEL)}
    for name, (s, radius, first, second, sliding, share, pressure) in table.items():
        contact = found[name]
        assert 1e3 * contact.position == pytest.approx(s, abs=6e-5)
        assert 1e3 * contact.radius == pytest.approx(radius, abs=6e-5)
        assert contact.surface_speeds == pytest.approx((first, second), abs=6e-5)
        assert contact.slide_to_roll == pytest.approx(sliding, abs=6e-5)
        assert contact.load / pair.normal_force == pytest.approx(share, abs=6e-5)
        assert contact.hertz(STEEL).p_max / 1e6 == pytest.approx(pressure, rel=1e-4)
    assert [contact.position for contact in found.values()] == sorted(
        c.position for c in found.values()
    )


def test_the_fzg_c_profile_without_tip_shortening_agrees_with_gearpie():
    given = C_GEAR | {"tip_diameters": None, "torque": 200.0}
    pair = SpurGear(**given)
    path = pair.path
    lengths = [1e3 * (path[name] - path["A"]) for name in "BCDE"]
    assert lengths == pytest.approx([6.143, 9.676, 13.285, 19.428], rel=1e-3)
    assert pair.contact_ratio == pytest.approx(1.4624, rel=1e-3)
    assert pair.normal_force == pytest.approx(5912.1, rel=1e-3)
    pitch = next(contact for contact in pair.contacts(STEEL) if contact.name == "C")
    assert pitch.hertz(STEEL).p_max / 1e6 == pytest.approx(1347.3, rel=1e-3)
    assert 1e6 * pitch.hertz(STEEL).half_widths[0] == pytest.approx(199.5, rel=1e-3)


def test_the_torque_matches_the_load_stage_of_the_standard():
    nominal = SpurGear(**A_GEAR)
    pitch = nominal.contact("C", nominal.path["C"])
    whole = pitch.hertz(STEEL).p_max / math.sqrt(nominal.share(nominal.path["C"]))
    assert whole / 1e6 == pytest.approx(1841.0, rel=1.5e-3)  # ISO 14635-1, stage 12
    assert any("never reached" in note for note in nominal.notes(STEEL))


def test_the_path_of_contact_agrees_with_its_definition():
    """Reference: the path as points on the line of action, limited by distances from the axes."""
    pair = SpurGear(**C_GEAR)
    (base_1, base_2), (tip_1, tip_2), centres = pair.base_radii, pair.tip_radii, pair.centres
    angle = math.acos((base_1 + base_2) / centres)

    def point(s):  # in the plane, pinion at the origin, wheel on x
        foot = base_1 * np.array([math.cos(angle), math.sin(angle)])
        return foot + s * np.array([math.sin(angle), -math.cos(angle)])

    def to_wheel(s):
        return float(np.linalg.norm(point(s) - [centres, 0.0]))

    start = scipy.optimize.brentq(lambda s: to_wheel(s) - tip_2, 0.0, pair.line_of_action)
    end = scipy.optimize.brentq(
        lambda s: float(np.linalg.norm(point(s))) - tip_1, 0.0, pair.line_of_action
    )
    pitch = scipy.optimize.brentq(lambda s: point(s)[1], 0.0, pair.line_of_action)
    assert (pair.path["A"], pair.path["E"], pair.path["C"]) == pytest.approx(
        (start, end, pitch), rel=1e-9
    )


def test_gears_without_a_centre_distance_have_no_backlash():
    free = SpurGear(**(C_GEAR | {"centre_distance": None}))
    assert 1e3 * free.centres == pytest.approx(91.5, rel=1e-5)


def test_the_frequencies_of_gears():
    found = SpurGear(**C_GEAR).frequencies
    assert found["mesh_hz"] == pytest.approx(16 * 2170 / 60)
    assert found["wheel_hz"] == pytest.approx(2170 / 60 * 16 / 24)
    assert found["hunting_tooth_hz"] == pytest.approx(found["mesh_hz"] / (16 * 24 / 8))
    assert SpurGear(**C_GEAR).contacts(STEEL)[0].overrolling_hz == pytest.approx(
        (found["pinion_hz"], found["wheel_hz"])
    )


@pytest.mark.parametrize(
    ("changed", "message"),
    [
        ({"centre_distance": 80e-3}, "base circles overlap"),
        ({"centre_distance": 90.6e-3}, "jams the teeth"),
        ({"tip_diameters": (76e-3, 112e-3)}, "lose contact"),
        ({"tip_diameters": (82e-3, 125e-3)}, "reaches below the pinion's base circle"),
        (
            {"profile_shift": (1.2, -0.85), "tip_diameters": (91.5e-3, 112e-3)},
            "pinion's teeth end in a point",
        ),
        ({"teeth": (16, 4)}, "at least 5"),
        ({"pressure_angle": math.radians(5.0)}, "pressure_angle"),
        ({"torque": -1.0}, "torque must be positive"),
    ],
)
def test_invalid_gears_are_refused(changed, message):
    with pytest.raises(BadInput, match=message):
        SpurGear(**(C_GEAR | changed))


def undercut_radius(count, module, angle):
    """Reference: largest radius at which the rack's tooth cuts into the involute."""
    pitch = module * count / 2.0
    travel = np.linspace(-2.0 * pitch, 2.0 * pitch, 4001)
    cut = 0.0
    for radius in np.linspace(pitch * math.cos(angle), pitch, 2001):
        inside = math.acos(min(pitch * math.cos(angle) / radius, 1.0))
        polar = (math.tan(angle) - angle) - (math.tan(inside) - inside) + travel / pitch
        depth = pitch - radius * np.cos(polar)
        if np.any(
            (depth < module)
            & (radius * np.sin(polar) > travel + depth * math.tan(angle) + 1e-6 * module)
        ):
            cut = radius
    return cut


def test_teeth_undercut_on_the_active_flank_are_refused():
    nine = FZG | {"teeth": (9, 40), "centre_distance": None, "face_width": 0.01, "torque": 10.0}
    limit = 1e3 * undercut_radius(9, nine["module"], nine["pressure_angle"])
    with pytest.raises(BadInput, match=r"raise its profile shift to 0\.474") as refused:
        SpurGear(**(nine | {"tip_diameters": (49.5e-3, 184e-3)}))
    stated = float(str(refused.value).split("radius of ")[1].split(" mm")[0])
    assert stated == pytest.approx(limit, abs=2e-3)
    assert (
        SpurGear(**(nine | {"tip_diameters": (49.5e-3, 183.2e-3)})).contact_ratio > 1.0
    )  # engages further out
    assert (
        SpurGear(
            **(nine | {"profile_shift": (0.48, 0.0), "tip_diameters": (53.8e-3, 187e-3)})
        ).contact_ratio
        > 1.0
    )


def test_an_undercut_below_the_active_flank_is_accepted():
    wheel, shift = A_GEAR["teeth"][1], A_GEAR["profile_shift"][1]
    assert (
        shift < 1.0 - wheel * math.sin(FZG["pressure_angle"]) ** 2 / 2.0
    )  # the A wheel is undercut below its active flank
    assert SpurGear(**A_GEAR).contact_ratio > 1.0


# Rolling bearings
# -------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("count", "diameter", "pitch", "factors", "tolerance"),
    [
        (13, 9.0e-3, 46.5e-3, (5.24, 7.76, 2.49, 0.40), 1e-2),  # NU 206, Schnur 2025
        (9, 7.940e-3, 39.04e-3, (3.5848, 5.4152, 2.3567, 0.3983), 1e-4),  # 6205 of the CWRU data
    ],
)
def test_characteristic_frequencies(count, diameter, pitch, factors, tolerance):
    found = RollingKinematics(
        count=count, diameter=diameter, pitch_diameter=pitch, speed=2.0 * math.pi
    ).frequencies
    assert [found[name] for name in ("bpfo_hz", "bpfi_hz", "bsf_hz", "ftf_hz")] == pytest.approx(
        factors, rel=tolerance
    )


def test_speeds_are_relative_to_the_cage():
    """Reference: ring speed minus cage speed in the laboratory frame."""
    kinematics = CylindricalRollerBearing(**NU206).kinematics
    inner = (46.5e-3 - 9e-3) / 2.0 * (kinematics.speed - kinematics.cage_speed)
    outer = (46.5e-3 + 9e-3) / 2.0 * kinematics.cage_speed
    assert (
        kinematics.surface_speed
        == pytest.approx(inner, rel=1e-12)
        == pytest.approx(outer, rel=1e-12)
    )
    assert kinematics.surface_speed == pytest.approx(3.51529, rel=1e-5)
    assert kinematics.cage_speed / RPM == pytest.approx(1209.677, rel=1e-6)
    assert kinematics.spin / RPM == pytest.approx(7459.677, rel=1e-6)
    assert [1e3 * radius for radius in kinematics.radii] == pytest.approx(
        [3.62903, 5.37097], rel=1e-5
    )
    ball = RollingKinematics(count=9, diameter=9.525e-3, pitch_diameter=46e-3, speed=3000.0 * RPM)
    assert (ball.cage_speed / RPM, ball.spin / RPM) == pytest.approx((1189.402, 6933.50), rel=1e-6)
    assert ball.surface_speed == pytest.approx(3.45793, rel=1e-5)


@pytest.mark.parametrize(
    ("clearance", "profile", "shift", "loads"),
    [
        (0.0, "straight", 7.76328, (1259.417, 1100.187, 671.859, 120.003)),
        (0.0, "iso", 11.38316, (1333.781, 1120.993, 588.056, 53.640)),
        (20e-6, "straight", 19.84301, (1639.480, 1224.647, 168.800, 0.0)),
        (20e-6, "iso", 23.23076, (1648.971, 1198.356, 201.426, 0.0)),
        (40e-6, "straight", 31.03152, (1860.862, 1207.930, 0.0, 0.0)),
        (40e-6, "iso", 34.53273, (1875.664, 1199.572, 0.0, 0.0)),
    ],
)
def test_slices_of_iso_16281(clearance, profile, shift, loads):
    bearing = CylindricalRollerBearing(**NU206, clearance=clearance, profile=profile)
    assert 1e6 * bearing.shift == pytest.approx(shift, rel=1e-5)
    assert bearing.loads[:4] == pytest.approx(loads, rel=1e-5)
    assert float(bearing.loads @ np.cos(bearing.angles)) == pytest.approx(4000.0, rel=1e-9)


def test_slices_agree_with_a_reference_implementation():
    """The same equilibrium with plain loops over slices and bisection."""
    length, diameter, slices, clearance, load = (
        22.0,
        8.0,
        31,
        0.012,
        9000.0,
    )  # N, mm; longer than 2.5 diameters
    positions = [length * ((k + 0.5) / slices - 0.5) for k in range(slices)]
    ends = 2.5 * diameter

    def drop(x):
        beyond = max(2.0 * abs(x) - (length - ends), 0.0) / ends
        return 0.0005 * diameter * math.log(1.0 / (1.0 - beyond**2))

    def rollers(shift):
        loads = []
        for j in range(15):
            approach = shift * math.cos(2.0 * math.pi * j / 15) - clearance / 2.0
            deflections = (max(approach - 2.0 * drop(x), 0.0) ** (10.0 / 9.0) for x in positions)
            loads.append(35948.0 * length ** (8.0 / 9.0) / slices * sum(deflections))
        return loads

    low, high = 0.0, 1.0
    for _ in range(80):
        middle = (low + high) / 2.0
        forces = sum(q * math.cos(2.0 * math.pi * j / 15) for j, q in enumerate(rollers(middle)))
        low, high = (middle, high) if forces < load else (low, middle)
    bearing = CylindricalRollerBearing(
        rollers=15,
        roller_diameter=1e-3 * diameter,
        roller_length=1e-3 * length,
        pitch_diameter=70e-3,
        radial_load=load,
        speed=100.0,
        clearance=1e-3 * clearance,
        profile="iso",
        slices=slices,
    )
    assert bearing.loads == pytest.approx(rollers(low), rel=1e-9, abs=1e-6)


def sjovall_integral(eps, exponent):
    """J_r(ε) = (1/π) ∫ [1 - (1 - cos ψ)/(2ε)]^n cos ψ dψ over the load zone's half."""
    end = math.pi if eps > 1.0 else math.acos(1.0 - 2.0 * eps)
    whole = scipy.integrate.quad(
        lambda psi: max(1.0 - (1.0 - math.cos(psi)) / (2.0 * eps), 0.0) ** exponent * math.cos(psi),
        0.0,
        end,
    )
    return whole[0] / math.pi


def test_the_load_zone_integral_has_its_published_values():
    assert sjovall_integral(0.5, 1.5) == pytest.approx(0.22883, rel=1e-4)
    assert sjovall_integral(0.5, 1.1) == pytest.approx(0.24530, rel=1e-4)
    assert sjovall_integral(0.5, 10.0 / 9.0) == pytest.approx(0.24480, rel=1e-4)


@pytest.mark.parametrize("clearance", [-4e-6, 0.0, 20e-6])
def test_the_load_zone_of_many_rollers_approaches_sjovalls_integral(clearance):
    thin = NU206 | {"rollers": 400, "roller_diameter": 0.3e-3, "roller_length": 1e-3}
    bearing = CylindricalRollerBearing(**thin, clearance=clearance / 10.0)
    eps = (1.0 - bearing.clearance / (2.0 * bearing.shift)) / 2.0
    assert bearing.loads[0] == pytest.approx(
        4000.0 / (400 * sjovall_integral(eps, 10.0 / 9.0)), rel=1e-4
    )


def test_the_load_zone_with_few_elements():
    assert CylindricalRollerBearing(**NU206).loads[0] * 13 / 4000.0 == pytest.approx(
        4.093, rel=1e-4
    )
    loads, _ = BallBearing(**BALLS_6206, radial_load=2000.0).loads(STEEL)
    assert loads[0] * 9 / 2000.0 == pytest.approx(4.385, rel=1e-4)


def test_a_rollers_contacts():
    contacts = CylindricalRollerBearing(**NU206, clearance=20e-6).contacts(STEEL)
    assert len(contacts) == 10  # five loaded rollers, each on both rings
    inner, outer = contacts[:2]
    assert (inner.name, outer.name) == ("roller 0, inner ring", "roller 0, outer ring")
    assert inner.line_load == pytest.approx(163.95e3, rel=1e-4)
    assert inner.hertz(STEEL).p_max == pytest.approx(1.2758e9, rel=1e-4)
    assert outer.hertz(STEEL).p_max == pytest.approx(1.0487e9, rel=1e-4)
    assert 1e6 * outer.hertz(STEEL).half_widths[0] == pytest.approx(99.53, rel=1e-4)
    assert inner.slide_to_roll == 0.0
    assert inner.overrolling_hz == pytest.approx((7.758065 * 50, 2.486559 * 50), rel=1e-6)
    assert outer.overrolling_hz[0] == pytest.approx(5.241935 * 50, rel=1e-6)


def test_a_profiled_roller_is_solved_for_its_heaviest_slice():
    bearing = CylindricalRollerBearing(**NU206, clearance=20e-6, profile="iso")
    contact = bearing.contacts(STEEL)[0]
    assert contact.load == pytest.approx(1648.971, rel=1e-5)
    assert contact.line_load == pytest.approx(bearing.slice_loads[0].max() * 30 / 0.01)
    assert 1.3 < contact.line_load / (contact.load / 0.01) < 1.4
    assert contact.conditions(STEEL).line_load == pytest.approx(contact.line_load)


@pytest.mark.parametrize(
    ("radial", "axial", "clearance", "shifts"),  # N, m; um
    [
        (1000.0, 0.0, 0.0, (15.1101, 0.0)),
        (1000.0, 0.0, 10e-6, (21.223, 0.0)),
        (0.0, 1000.0, 0.0, (0.0, 133.538)),
        (0.0, 1000.0, 10e-6, (0.0, 149.172)),
        (1000.0, 1000.0, 10e-6, (19.592, 146.460)),
    ],
)
def test_displacements_of_ball_bearings_agree_with_iso_16281(radial, axial, clearance, shifts):
    pair = ElasticPair((210e9, 210e9), (0.3, 0.3))
    bearing = BallBearing(
        **BALLS, radial_load=radial, axial_load=axial, clearance=clearance, tilt=None
    )
    assert bearing.stiffness(pair) * 1e-3**1.5 == pytest.approx(333592.0, rel=1e-4)
    assert [1e6 * shift for shift in bearing.shifts(pair)[:2]] == pytest.approx(shifts, rel=1e-4)
    loads, angles = bearing.loads(pair)
    assert float(loads * np.cos(angles) @ np.cos(bearing.angles)) == pytest.approx(
        radial, rel=1e-6, abs=1e-6
    )
    assert float(loads @ np.sin(angles)) == pytest.approx(axial, rel=1e-6, abs=1e-6)
    assert float(loads * np.sin(angles) @ np.cos(bearing.angles)) == pytest.approx(
        0.0, abs=1e-5 * (radial + axial)
    )
    if radial == 0.0:
        assert math.degrees(angles[0]) == pytest.approx(
            13.07 if clearance == 0.0 else 14.67, abs=6e-3
        )


def test_pure_thrust_satisfies_the_closed_form():
    """F_a/(Z c_p A^1.5) = sin α (cos α0/cos α - 1)^1.5 for an angular-contact bearing."""
    free, load = math.radians(25.0), 3000.0
    bearing = BallBearing(**BALLS, axial_load=load, contact_angle=free)
    _, angles = bearing.loads(STEEL)
    scale = 7 * bearing.stiffness(STEEL) * bearing.groove_distance**1.5
    right = math.sin(angles[0]) * (math.cos(free) / math.cos(angles[0]) - 1.0) ** 1.5
    assert load / scale == pytest.approx(right, rel=1e-9)
    assert (
        bearing.frequencies["bpfo_hz"]
        > BallBearing(**BALLS, axial_load=load).frequencies["bpfo_hz"]
    )


def random_bearing(rng, *, tilt, thrusts):
    balls, diameter = int(rng.integers(7, 18)), rng.uniform(4e-3, 20e-3)
    radial = 10.0 ** rng.uniform(1.0, 4.0)
    return BallBearing(
        balls=balls,
        ball_diameter=diameter,
        pitch_diameter=diameter * balls / math.pi * rng.uniform(1.15, 1.6),
        speed=100.0,
        radial_load=radial,
        axial_load=radial * 10.0 ** rng.uniform(*thrusts),
        contact_angle=math.radians(rng.uniform(10.0, 40.0)),
        tilt=tilt,
    )


def forces(bearing):
    """Return radial force, axial force and moment per groove-centre radius on all balls [N]."""
    radial, axial, tilt = bearing.shifts(STEEL)
    return bearing._forces(np.array([radial, axial, tilt * bearing._arm]), bearing.stiffness(STEEL))


@pytest.mark.parametrize("tilt", [None, 0.0, 1e-3])
def test_every_angular_contact_bearing_reaches_equilibrium(tilt):
    """Includes very small thrust, which hardly restrains the ring axially."""
    rng = np.random.default_rng(11)
    for _ in range(60):
        bearing = random_bearing(rng, tilt=tilt, thrusts=(-5.0, 1.0))
        force = max(bearing.radial_load, bearing.axial_load)
        found = forces(bearing)
        assert found[:2] == pytest.approx(
            [bearing.radial_load, bearing.axial_load], abs=1e-7 * force
        )
        if tilt is None:
            assert found[2] == pytest.approx(0.0, abs=1e-7 * force)
        if bearing.axial_load > bearing.radial_load * math.tan(bearing.contact_angle):
            loads, angles = bearing.loads(STEEL)
            assert angles[loads > 0.0].min() > 0.0


def test_an_angular_contact_bearing_without_enough_thrust_is_refused():
    loose = BallBearing(**BALLS_7205, radial_load=1000.0, axial_load=5.0, tilt=None)
    with pytest.raises(
        BadInput, match=r"comes apart under a thrust of 5 N with 1000 N.* at least about 1.02e.03 N"
    ):
        loose.loads(STEEL)


def test_the_load_zone_of_an_angular_contact_bearing_agrees_with_its_catalogue():
    """7205 B, 1 kN radial and 1.14 kN axial, e of ISO 281: half of the balls at 40 degrees, (C/P)³
    million turns.

    C is 15.6 kN, P the radial load. Free to tilt, it would have 20 degrees and load balls opposite
    the radial load as well.
    """
    fixed, free = (
        BallBearing(**BALLS_7205, radial_load=1000.0, axial_load=1140.0, tilt=tilt)
        for tilt in (0.0, None)
    )
    loads, angles = fixed.loads(STEEL)
    assert np.count_nonzero(loads) == 7
    assert loads.max() == pytest.approx(430.0, rel=2e-3)
    assert math.degrees(angles[0]) == pytest.approx(40.0, abs=3.0)
    ratio = fixed.ball_diameter * math.cos(fixed.contact_angle) / fixed.pitch_diameter
    raceway = BallRaceway(ratio, fixed.osculation, fixed.contact_angle)
    assert ball_life(loads, 15.6e3, raceway) == pytest.approx(15.6**3 * 1e6, rel=0.25)
    free_loads, tilted_angles = free.loads(STEEL)
    assert free_loads.max() > 1.5 * loads.max()
    assert math.degrees(tilted_angles[0]) < 25.0
    assert any("tilts by -5.22 mrad" in note for note in free.notes(STEEL))
    assert any("with a moment of 16.1 N m" in note for note in fixed.notes(STEEL))
    few = BallBearing(**BALLS_7205, radial_load=1000.0, axial_load=600.0)
    assert any("The thrust loads 3 of 12 balls" in note for note in few.notes(STEEL))


def test_the_moment_of_a_fixed_ring_is_the_derivative_of_the_energy():
    """Derivative by tilt of elastic energy minus work of the loads, minimised over the shifts."""

    def energy(tilt):
        bearing = BallBearing(**BALLS_7205, radial_load=1000.0, axial_load=900.0, tilt=tilt)
        radial, axial, _ = bearing.shifts(STEEL)
        loads, _ = bearing.loads(STEEL)
        elastic = (loads / bearing.stiffness(STEEL)) ** (2.0 / 3.0)
        return 0.4 * float(loads @ elastic) - 1000.0 * radial - 900.0 * axial

    fixed_tilt = BallBearing(**BALLS_7205, radial_load=1000.0, axial_load=900.0, tilt=-1e-3)
    step = 1e-5
    assert fixed_tilt.moment(STEEL) == pytest.approx(
        (energy(-1e-3 + step) - energy(-1e-3 - step)) / (2.0 * step), rel=1e-5
    )


def test_preload_alone_loads_every_ball_equally():
    bearing = BallBearing(**BALLS_6206, clearance=-10e-6)
    loads, angles = bearing.loads(STEEL)
    assert loads == pytest.approx([bearing.stiffness(STEEL) * 5e-6**1.5] * 9)
    assert angles == pytest.approx([0.0] * 9)
    assert len(bearing.contacts(STEEL)) == 18


def test_clearance_sets_the_contact_angle_of_the_frequencies():
    """6206, 20 um: arccos(1 - s/(2 A)) = 11.76 deg; without thrust the contact angle is 0."""
    thrust, across = (
        BallBearing(**BALLS_6206, clearance=20e-6, **load)
        for load in ({"axial_load": 500.0}, {"radial_load": 500.0})
    )
    assert math.degrees(thrust.free_angle) == pytest.approx(11.76, abs=0.01)
    assert across.free_angle == 0.0
    assert thrust.frequencies["bpfi_hz"] < across.frequencies["bpfi_hz"]


def test_a_6206_under_2_kn():
    bearing = BallBearing(**BALLS_6206, radial_load=2000.0)
    assert bearing.loads(STEEL)[0][:4] == pytest.approx([974.49, 653.37, 70.52, 0.0], rel=1e-4)
    inner, outer = (contact.hertz(STEEL) for contact in bearing.contacts(STEEL)[:2])
    assert (inner.p_max / 1e6, outer.p_max / 1e6) == pytest.approx((2252.86, 2026.35), rel=1e-5)
    assert [1e3 * half for half in inner.half_widths] == pytest.approx(
        [0.148485, 1.39092], rel=1e-5
    )
    assert [1e3 * half for half in outer.half_widths] == pytest.approx(
        [0.200502, 1.14522], rel=1e-5
    )
    assert len(bearing.contacts(STEEL)) == 10
    assert "not covered" in bearing.notes(STEEL)[0]


@pytest.mark.parametrize(
    ("machine", "given", "message"),
    [
        (
            CylindricalRollerBearing,
            NU206 | {"radial_load": 0.0, "clearance": 10e-6},
            "unloads every roller",
        ),
        (CylindricalRollerBearing, NU206 | {"clearance": 1e-3}, "a twentieth of the roller"),
        (CylindricalRollerBearing, NU206 | {"rollers": 20}, "do not fit"),
        (CylindricalRollerBearing, NU206 | {"slices": 10}, "at least 30"),
        (CylindricalRollerBearing, NU206 | {"radial_load": -5.0}, "negative"),
        (BallBearing, BALLS, "no ball is loaded"),
        (BallBearing, BALLS | {"radial_load": 10.0, "clearance": -1e-3}, "a twentieth of the ball"),
        (
            BallBearing,
            BALLS | {"radial_load": 10.0, "clearance": 6e-4},
            "contact angle above 60 deg in these grooves; it must be at most",
        ),
        (
            BallBearing,
            BALLS_6206 | {"axial_load": 500.0, "osculation": (0.505, 0.505), "clearance": 4e-4},
            "60 deg",
        ),
        (
            BallBearing,
            BALLS_6206 | {"axial_load": 500.0, "osculation": (0.51, 0.51), "clearance": 4e-4},
            "60 deg",
        ),
        (BallBearing, BALLS | {"radial_load": 10.0, "tilt": 0.05}, "between -20 and 20 mrad"),
        (
            BallBearing,
            BALLS_7205 | {"radial_load": 1000.0},
            "comes apart under a radial_load of 1000 N alone",
        ),
        (BallBearing, BALLS | {"radial_load": 10.0, "osculation": (0.49, 0.53)}, "osculation"),
        (
            BallBearing,
            BALLS | {"axial_load": 10.0, "contact_angle": 0.5, "clearance": 1e-5},
            "give one of them",
        ),
        (BallBearing, BALLS | {"axial_load": -10.0}, "axial_load"),
    ],
)
def test_invalid_bearings_are_refused(machine, given, message):
    with pytest.raises(BadInput, match=message):
        machine(**given)


def test_neglected_effects_of_a_bearing_are_noted():
    fast = CylindricalRollerBearing(**(NU206 | {"speed": 20000.0 * RPM}))
    assert any(
        "centrifugal load of 82" in note for note in fast.notes(STEEL)
    )  # 1.85 N at 3000 r/min, times speed squared
    assert not any("centrifugal" in note for note in CylindricalRollerBearing(**NU206).notes(STEEL))
    loose = CylindricalRollerBearing(**(NU206 | {"clearance": 200e-6, "radial_load": 100.0}))
    assert any("A single roller" in note for note in loose.notes(STEEL))
    brass = ElasticPair((100e9, 206e9), (0.3, 0.3))
    assert any("steel rollers" in note for note in fast.notes(brass))


# Discs and cams
# -------------------------------------------------------------------------------------------------


def test_discs_preserve_the_sign_of_sliding():
    slow = TwinDisc(radii=(0.02, 0.03), speeds=(100.0, 50.0), load=500.0, length=5e-3)
    (contact,) = slow.contacts(STEEL)
    assert contact.radius == pytest.approx(0.012)
    assert contact.surface_speeds == pytest.approx((2.0, 1.5))
    assert contact.slide_to_roll == pytest.approx(0.5 / 1.75)
    (turned,) = TwinDisc(
        radii=(0.03, 0.02), speeds=(50.0, 100.0), load=500.0, length=5e-3
    ).contacts(STEEL)
    assert turned.slide_to_roll == pytest.approx(-0.5 / 1.75)
    (crowned,) = TwinDisc(
        radii=(0.02, 0.03), speeds=(100.0, 50.0), load=5.0, crown_radius=0.1
    ).contacts(STEEL)
    assert (crowned.geometry, crowned.radius, crowned.line_load) == (
        "elliptic",
        pytest.approx((0.012, 0.1)),
        None,
    )
    for wrong in ({}, {"length": 1e-3, "crown_radius": 0.1}):
        with pytest.raises(BadInput, match=r"length .* or crown_radius"):
            TwinDisc(radii=(0.02, 0.03), speeds=(100.0, 50.0), load=500.0, **wrong)


def test_an_eccentric_disc_under_a_flat_follower():
    contacts = FlatCam(**CAM).contacts(STEEL)
    assert [contact.radius for contact in contacts] == pytest.approx([0.02] * 9, rel=1e-9)
    assert [contact.surface_speeds[0] for contact in contacts] == pytest.approx([2.0] * 9, rel=1e-9)
    assert [contacts[at].entrainment_speed for at in (8, 4, 0)] == pytest.approx(
        [1.25, 1.0, 0.75], rel=1e-9
    )
    assert (
        contacts[0].slide_to_roll > 2.0
    )  # at the nose, cam and follower surfaces move in opposite directions
    assert any("opposite directions" in note for note in FlatCam(**CAM).notes(STEEL))


def test_negative_entrainment_is_reversed_for_the_solver():
    cam = FlatCam(**(CAM | {"base_radius": 30e-3, "half_angle": math.radians(70.0)}))
    contacts = cam.contacts(STEEL)
    nose, flank = contacts[0], contacts[-1]
    assert nose.entrainment_speed < 0.0 < flank.entrainment_speed
    assert nose.conditions(STEEL).entrainment_speed == pytest.approx(-nose.entrainment_speed)
    assert nose.conditions(STEEL).surface_speeds == pytest.approx(
        tuple(-u for u in nose.surface_speeds)
    )
    assert any("passes zero" in note for note in cam.notes(STEEL))


def test_a_contact_without_entrainment_has_only_hertz_pressure():
    balanced = TwinDisc(radii=(0.02, 0.02), speeds=(1.0, 1.0), load=10.0, length=1e-3).contacts(
        STEEL
    )[0]
    against = type(balanced)(**{**vars(balanced), "surface_speeds": (1.0, -1.0)})
    assert against.stands_still
    assert against.slide_to_roll is None
    assert against.hertz(STEEL) == balanced.hertz(STEEL)
    with pytest.raises(BadInput, match="no entrainment"):
        against.conditions(STEEL)


@pytest.mark.parametrize(
    ("changed", "message"),
    [
        ({"half_angle": math.radians(40.0)}, "undercut"),
        ({"follower_mass": 1.0, "speed": 200.0}, "lifts off"),
        ({"half_angle": 4.0}, "half_angle"),
        ({"lift": 0.0}, "lift must be positive"),
    ],
)
def test_invalid_cams_are_refused(changed, message):
    with pytest.raises(BadInput, match=message):
        FlatCam(**(CAM | changed))


# Roller followers
# -------------------------------------------------------------------------------------------------

ROLLER_CAM = {
    "base_radius": 18e-3,
    "lift": 9e-3,
    "half_angle": math.radians(70.0),
    "width": 10e-3,
    "speed": 150.0,
    "spring_load": 600.0,
    "roller_radius": 9e-3,
}


@pytest.mark.parametrize("angle", [0.0, 0.4, 1.5, 3.0])
def test_an_eccentric_disc_under_a_roller(angle):
    """The roller centre moves on a circle: cam radius and path are those of the disc."""
    disc, off, roller = 20e-3, 6e-3, 8e-3

    def reach(theta):
        return off * math.cos(theta) + math.sqrt(
            (disc + roller) ** 2 - (off * math.sin(theta)) ** 2
        )

    step = 1e-4
    slope = (reach(angle + step) - reach(angle - step)) / (2.0 * step)
    bend = (reach(angle + step) - 2.0 * reach(angle) + reach(angle - step)) / step**2
    point = CamPoint.from_pitch_curve(reach(angle), slope, bend, roller)
    assert point.cam_radius == pytest.approx(disc, rel=1e-6)
    assert point.path == pytest.approx(disc * _centre_rate(reach, angle, off, step), rel=1e-6)


def _centre_rate(reach, angle, off, step):
    """Return the angular rate of the roller centre about the disc centre by differences."""

    def direction(theta):
        x, y = reach(theta) * math.sin(theta), reach(theta) * math.cos(theta) - off
        return math.atan2(x, y)

    return (direction(angle + step) - direction(angle - step)) / (2.0 * step)


def test_a_roller_cam_agrees_with_its_envelope():
    """Reference: the cam as envelope of roller positions; curvature and path by differences."""
    cam = RollerCam(**ROLLER_CAM)
    angles = np.linspace(0.02, cam.half_angle - 0.02, 4001)
    reach = (
        cam.base_radius
        + cam.roller_radius
        + 0.5 * cam.lift * (1.0 + np.cos(math.pi * angles / cam.half_angle))
    )
    centres = reach * np.exp(1j * (0.5 * math.pi - angles))
    tangent = np.gradient(centres, angles, edge_order=2)
    outline = centres + cam.roller_radius * tangent / np.abs(tangent) * -1j
    passed = np.gradient(outline, angles, edge_order=2)
    turned = np.gradient(np.unwrap(np.angle(passed)), angles)
    for place in (400, 1500, 2600, 3500):
        point = cam.point_at(float(angles[place]))
        assert abs(passed[place]) == pytest.approx(point.path, rel=1e-4)
        assert abs(passed[place]) / -turned[place] == pytest.approx(point.cam_radius, rel=1e-3)


def test_a_roller_cams_contacts():
    cam = RollerCam(**ROLLER_CAM, slip=0.1, spring_rate=20e3)
    contacts = cam.contacts(STEEL)
    nose, last = contacts[0], contacts[-1]
    assert nose.load == pytest.approx(600.0 + 20e3 * 9e-3)  # the pressure angle is 0
    rate = math.pi / cam.half_angle
    sharp = 36e-3**2 / (
        36e-3 + 4.5e-3 * rate**2
    )  # ρ0 = 18 + 9 + 9 mm at the nose, ρ0'' = -(L/2)(π/β)²
    assert nose.radius == pytest.approx(1.0 / (1.0 / (sharp - 9e-3) + 1.0 / 9e-3), rel=1e-12)
    assert nose.surface_speeds[0] == pytest.approx(
        150.0 * 36e-3 * (1.0 - 9e-3 / sharp), rel=1e-12
    )  # independent of slip
    assert last.load == pytest.approx(600.0)
    assert [contact.slide_to_roll for contact in contacts] == pytest.approx([0.1] * len(contacts))
    middle = contacts[4]
    point = cam.point_at(middle.position)
    assert math.tan(point.pressure_angle) == pytest.approx(
        -4.5e-3 * rate / (18e-3 + 9e-3 + 4.5e-3), rel=1e-9
    )
    assert middle.load == pytest.approx(
        cam.follower_force(middle.position) / math.cos(point.pressure_angle)
    )
    assert any(
        "pressure angle" in note
        for note in RollerCam(**(ROLLER_CAM | {"lift": 16e-3})).notes(STEEL)
    )
    around = RollerCam(**ROLLER_CAM).frequencies
    assert around["roller_hz"] / around["cam_hz"] == pytest.approx(
        _perimeter(RollerCam(**ROLLER_CAM)) / (2.0 * math.pi * 9e-3), rel=1e-4
    )


@pytest.mark.parametrize("slip", [-0.5, 0.0, 0.2, 1.5])
def test_slip_changes_the_speed_of_the_roller_only(slip):
    """Roller turns per cam turn follow from the surface-speed ratio and the cam's perimeter."""
    cam = RollerCam(**ROLLER_CAM, slip=slip)
    contacts = cam.contacts(STEEL)
    cams, rollers = (
        np.array([contact.surface_speeds[body] for contact in contacts]) for body in (0, 1)
    )
    assert cams == pytest.approx([cam.speed * cam.point_at(angle).path for angle in cam.angles])
    assert [contact.slide_to_roll for contact in contacts] == pytest.approx([slip] * len(contacts))
    ratios = rollers / cams
    assert ratios == pytest.approx([ratios[0]] * len(ratios))
    turned = ratios[0] * _perimeter(cam) / (2.0 * math.pi * cam.roller_radius)
    assert turned == pytest.approx(
        cam.frequencies["roller_hz"] / cam.frequencies["cam_hz"], rel=1e-4
    )


def _perimeter(cam):
    """Return the perimeter of the cam, summed over its outline."""
    angles = np.linspace(-math.pi, math.pi, 20001)
    active = np.minimum(np.abs(angles), cam.half_angle)
    reach = (
        cam.base_radius
        + cam.roller_radius
        + 0.5 * cam.lift * (1.0 + np.cos(math.pi * active / cam.half_angle))
    )
    centres = reach * np.exp(1j * angles)
    tangent = np.gradient(centres, angles)
    return float(
        np.abs(np.diff(centres + 1j * cam.roller_radius * tangent / np.abs(tangent))).sum()
    )


def test_invalid_roller_cams_are_refused():
    with pytest.raises(BadInput, match="undercuts it; lower roller_radius"):
        RollerCam(**(ROLLER_CAM | {"lift": 16e-3, "half_angle": math.radians(35.0)}))
    with pytest.raises(BadInput, match="opposite directions"):
        RollerCam(**ROLLER_CAM, slip=2.5)
    with pytest.raises(BadInput, match="lifts off at 0 deg"):
        RollerCam(**ROLLER_CAM, follower_mass=2.0)


def test_discs_given_by_entrainment_and_slide_to_roll():
    by_speeds = TwinDisc(radii=(20e-3, 30e-3), speeds=(105.0, 49.0), load=100.0, length=5e-3)
    (given,) = by_speeds.contacts(STEEL)
    stated = TwinDisc(
        radii=(20e-3, 30e-3),
        entrainment_speed=given.entrainment_speed,
        slide_to_roll=given.slide_to_roll,
        load=100.0,
        length=5e-3,
    )
    assert stated.turning == pytest.approx((105.0, 49.0), rel=1e-12)
    assert stated.contacts(STEEL)[0].surface_speeds == pytest.approx(
        given.surface_speeds, rel=1e-12
    )
