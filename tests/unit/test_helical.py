"""Helical gear pairs: geometry, equivalent contact of a slice, load of the slices, ratings."""

import math
from pathlib import Path

import numpy as np
import pytest

from asperity.case import load_machine
from asperity.contact.conditions import ElasticPair
from asperity.core.errors import BadInput
from asperity.machine import HelicalGear, SpurGear
from asperity.machines import machine_conditions
from asperity.rating import helical_load_factor

EXAMPLES = Path(__file__).parents[2] / "examples"
STEEL = ElasticPair((206e9, 206e9), (0.3, 0.3))
SPUR = {
    "module": 4.5e-3,
    "teeth": (16, 24),
    "pressure_angle": math.radians(20.0),
    "profile_shift": (0.18, 0.17),
    "face_width": 0.014,
    "torque": 265.1,
    "speed": 227.0,
}
PAIRS = [(5.0, 0.014), (5.0, 0.1), (15.0, 0.014), (15.0, 0.06), (30.0, 0.1)]  # deg, m


def helical(degrees, **changed):
    return HelicalGear(**{**SPUR, **changed}, helix_angle=math.radians(degrees))


def with_overlap(degrees, overlap):
    """Return a pair of stated overlap ratio, b sin β/(π m)."""
    width = overlap * math.pi * SPUR["module"] / math.sin(math.radians(degrees))
    return helical(degrees, face_width=width)


# Geometry
# ---------------------------------------------------------------------------------


def test_geometry_of_a_published_pair():
    """KHK, Gear Technical Reference, example of a profile-shifted helical pair; recollected."""
    pair = HelicalGear(
        module=3e-3,
        teeth=(12, 60),
        pressure_angle=math.radians(20.0),
        helix_angle=math.radians(30.0),
        profile_shift=(0.09809, 0.0),
        face_width=0.02,
        torque=10.0,
        speed=100.0,
    )
    degrees = math.degrees
    assert degrees(pair.transverse_pressure_angle) == pytest.approx(22.79588, abs=1e-5)
    assert degrees(pair.working_angle) == pytest.approx(23.1126, abs=2e-4)
    assert 1e3 * pair.centres == pytest.approx(125.0, abs=1e-3)
    assert [2e3 * radius for radius in pair.reference_radii] == pytest.approx(
        [41.569, 207.846], abs=1e-3
    )
    assert [2e3 * radius for radius in pair.base_radii] == pytest.approx(
        [38.322, 191.611], abs=1e-3
    )


def test_overlap_ratio_from_the_axial_pitch():
    pair = helical(15.0)
    axial_pitch = math.pi * pair.module / math.sin(pair.helix_angle)
    assert pair.overlap_ratio == pytest.approx(pair.face_width / axial_pitch, rel=1e-12)


# Equivalent contact of a slice
# ---------------------------------------------------------------------------------


def flank(radius, helix, angle, along):
    """Return a point of an involute helicoid: unrolled by `angle`, at `along` the axis."""
    turned = along * math.tan(helix) / radius
    polar = angle + turned
    foot = radius * np.array([math.cos(polar), math.sin(polar)])
    tangent = np.array([math.sin(polar), -math.cos(polar)])
    return np.array([*(foot + radius * angle * tangent), along])


@pytest.mark.parametrize(("degrees", "distance"), [(5.0, 9e-3), (20.0, 15e-3), (35.0, 20e-3)])
def test_curvature_normal_to_the_line_of_contact(degrees, distance):
    """The radius of a flank is s/cos βb: second differences of the involute helicoid."""
    radius, helix, step = 33.8e-3, math.radians(degrees), 2e-4
    angle = distance / radius

    def first(a, z, da, dz):
        return (flank(radius, helix, a + da, z + dz) - flank(radius, helix, a - da, z - dz)) / 2.0

    e_a, e_z = first(angle, 0.0, step, 0.0) / step, first(angle, 0.0, 0.0, step) / step
    normal = np.cross(e_a, e_z)
    normal /= np.linalg.norm(normal)
    middle = flank(radius, helix, angle, 0.0)

    def second(da, dz):
        ends = flank(radius, helix, angle + da, dz) + flank(radius, helix, angle - da, -dz)
        return float((ends - 2.0 * middle) @ normal) / step**2

    aa, zz = second(step, 0.0), second(0.0, step)
    az = (second(step, step) - aa - zz) / 2.0
    metric = np.array([[e_a @ e_a, e_a @ e_z], [e_a @ e_z, e_z @ e_z]])
    shape = np.linalg.solve(metric, np.array([[aa, az], [az, zz]]))
    small, large = sorted(abs(np.linalg.eigvals(shape)))
    assert small == pytest.approx(0.0, abs=1e-2 * large)  # straight along the line of contact
    assert 1.0 / large == pytest.approx(distance / math.cos(helix), rel=1e-3)


def test_contact_of_a_slice():
    """Speeds of the transverse section; radii s and T - s over cos βb."""
    pair = helical(15.0)
    contact = next(entry for entry in pair.contacts(STEEL) if entry.name == "D")
    distance, length = contact.position, pair.line_of_action
    radii = [value / math.cos(pair.base_helix_angle) for value in (distance, length - distance)]
    assert contact.radius == pytest.approx(radii[0] * radii[1] / sum(radii), rel=1e-12)
    speeds = 227.0 * distance, 227.0 * 16 / 24 * (length - distance)
    assert contact.surface_speeds == pytest.approx(speeds, rel=1e-12)
    pitch = next(entry for entry in pair.contacts(STEEL) if entry.name == "C")
    assert pitch.slide_to_roll == pytest.approx(0.0, abs=1e-12)


# Load of the slices
# ---------------------------------------------------------------------------------


@pytest.mark.parametrize(("degrees", "width"), PAIRS)
@pytest.mark.parametrize("phase", [0.0, 0.2, 0.55, 0.9])
def test_slices_balance_the_torque(degrees, width, phase):
    """At any time the normal forces on all lines of contact add up to torque/(r_b1 cos βb)."""
    pair = helical(degrees, face_width=width)
    start = pair.path["A"] + phase * pair.base_pitch
    across = np.linspace(0.0, width, 40_001)
    lines = [
        pair.line_load(
            start + number * pair.base_pitch + across * math.tan(pair.base_helix_angle), start
        )
        for number in range(-12, 3)
    ]
    force = sum(np.trapezoid(line, across) for line in lines) / math.cos(pair.base_helix_angle)
    assert force * math.cos(pair.base_helix_angle) == pytest.approx(pair.normal_force, rel=1e-4)


def test_whole_overlap_divides_the_load_by_the_contact_ratio():
    """With a whole overlap ratio the lines' length is constant: the mean share is 1/εα."""
    pair = with_overlap(15.0, 2.0)
    distances = np.linspace(pair.path["A"], pair.path["E"], 2001)
    shares = [pair.share(float(distance)) for distance in distances]
    mean = float(np.trapezoid(shares, distances)) / (distances[-1] - distances[0])
    assert mean == pytest.approx(1.0 / pair.contact_ratio, rel=1e-4)


def test_pressure_of_a_wide_pair_with_the_zone_factor():
    """ISO 6336-2: p_C = Z_H Z_E Z_ε sqrt(F_t (u + 1)/(d1 b u)) with the mean load 1/εα."""
    pair = with_overlap(15.0, 2.0)
    u, work, across = 24 / 16, pair.working_angle, pair.transverse_pressure_angle
    zone = math.sqrt(
        2.0 * math.cos(pair.base_helix_angle) * math.cos(work)
        / (math.cos(across) ** 2 * math.sin(work))
    )  # fmt: skip
    elastic = math.sqrt(206e9 / (2.0 * math.pi * (1.0 - 0.3**2)))
    diameter = 2.0 * pair.reference_radii[0]
    tangential = 2.0 * SPUR["torque"] / diameter
    stress = tangential * (u + 1.0) / (diameter * pair.face_width * u * pair.contact_ratio)
    contact = pair.contact("C", pair.path["C"])
    mean_load = 1.0 / pair.contact_ratio / pair.share(pair.path["C"])
    found = contact.hertz(STEEL).p_max * math.sqrt(mean_load)
    assert found == pytest.approx(zone * elastic * math.sqrt(stress), rel=1e-9)


def test_slight_helix_has_the_loads_of_a_spur_pair():
    """Loads of a spur pair but at the ends, where they lie within its jump."""
    spur, pair = SpurGear(**SPUR), helical(1.0)
    for name in ("AB", "B", "C", "D", "DE"):
        assert pair.share(pair.path[name]) == pytest.approx(spur.share(spur.path[name]), rel=0.02)
    for name in ("A", "E"):  # 1/3 with the neighbour in double contact, 1/2 with it in single
        assert spur.share(spur.path[name]) <= pair.share(pair.path[name]) <= 0.5 + 1e-9


@pytest.mark.parametrize("degrees", [1.0, 15.0, 30.0])
def test_load_distribution_of_minimum_elastic_energy(degrees):
    """Within 15 % of Pedrero et al. (2010): slice stiffness cos(b0 ξ), ξ from the middle."""
    pair = helical(degrees, face_width=0.1)
    ratio = pair.contact_ratio
    b0 = (0.5 * (1.0 + ratio / 2.0) ** 2 - 1.0) ** -0.5
    places = np.linspace(-ratio / 2.0, ratio / 2.0, 401)
    middle = (pair.path["A"] + pair.path["E"]) / 2.0
    ours = pair.line_load(middle + places * pair.base_pitch, 0.0)
    theirs = np.cos(b0 * places)
    theirs *= np.trapezoid(ours, places) / np.trapezoid(theirs, places)
    assert np.max(np.abs(ours - theirs)) < 0.2 * ours.max()
    assert ours.max() == pytest.approx(theirs.max(), rel=0.15)


# Ratings and case
# ---------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("ratio", "factor"), [(1.5, 1.0), (2.0, 1.0), (2.5, 1.22361), (3.5, 1.3), (4.0, 1.3)]
)
def test_helical_load_factor(ratio, factor):
    """K_Bγ = 1 + 0.2 sqrt((εγ - 2)(5 - εγ)) between 2 and 3.5 (ISO/TR 15144-1)."""
    assert helical_load_factor(ratio) == pytest.approx(factor, abs=1e-5)


def test_rated_line_loads():
    """Load sharing factor of a spur pair, or 1/ε, times the buttressing factor."""
    narrow, wide = helical(15.0), with_overlap(15.0, 1.5)
    for pair, end, middle in (
        (narrow, (1.0 + 0.3 * narrow.overlap_ratio) / 3.0, 1.0),
        (wide, 1.3 / wide.contact_ratio, 1.0 / wide.contact_ratio),
    ):
        full = pair.normal_force / math.cos(pair.base_helix_angle) / pair.face_width
        assert pair.rated_line_load(pair.path["A"]) / full == pytest.approx(end, rel=1e-9)
        assert pair.rated_line_load(pair.path["E"]) / full == pytest.approx(end, rel=1e-9)
        assert pair.rated_line_load(pair.path["C"]) / full == pytest.approx(middle, rel=1e-9)


def helical_case(**changed):
    case = load_machine(EXAMPLES / "fzg-c.toml")
    gears = {**case.tables["machine"], "kind": "helical-gear", "helix_angle": "15 deg"}
    del gears["tip_diameters"]
    return case.with_overrides({"machine": gears | changed})


def test_a_helical_case_is_rated():
    case = helical_case()
    found = {rating.key: rating for rating in machine_conditions(case).ratings}
    spur = {
        rating.key: rating
        for rating in machine_conditions(load_machine(EXAMPLES / "fzg-c.toml")).ratings
    }
    for key in ("mesh_friction", "rated_bulk_k", "rated_flash_k", "rated_film"):
        assert not found[key].reason
        assert not found[key].beyond

    def loading(gears):  # w^0.2 v^-0.2 ρ^-0.45, the part of the friction that changes
        pitch = gears.contact("C", gears.path["C"])
        return (sum(pitch.surface_speeds) / gears.normal_force) ** -0.2 * pitch.radius**-0.45

    ratio = loading(case.machine) / loading(load_machine(EXAMPLES / "fzg-c.toml").machine)
    both = [ratings["mesh_friction"].machine_value for ratings in (found, spur)]
    assert both[0] / both[1] == pytest.approx(ratio, rel=1e-9)
    wide = helical_case(face_width="60 mm")
    load_factor = helical_load_factor(wide.machine.contact_ratio + wide.machine.overlap_ratio)
    assert load_factor > 1.1
    friction_of_wide = machine_conditions(wide).ratings[0].machine_value
    assert friction_of_wide / both[0] == pytest.approx((load_factor * 14.0 / 60.0) ** 0.2, rel=1e-9)
    steep = machine_conditions(helical_case(helix_angle="32 deg", profile_shift=[0.0, 0.0]))
    assert "a helix angle of 32 deg (30 at most)" in steep.ratings[0].beyond


def test_notes_and_title():
    result = machine_conditions(helical_case())
    assert "helix angle 15 deg" in result.verdict()
    pair = result.case.machine
    radius = pair.reference_radii[0]
    axial = pair.torque / radius * math.tan(pair.helix_angle)
    assert any(f"axial force of {axial:.4g} N" in note for note in result.notes)


@pytest.mark.parametrize(
    ("degrees", "message"),
    [(0.5, "below 1 deg use a spur gear"), (60.0, "between 1 and 45 deg, got 60 deg")],
)
def test_helix_angles_out_of_range_are_refused(degrees, message):
    with pytest.raises(BadInput, match=message):
        helical(degrees)


def test_a_helical_case_without_its_angle_is_refused():
    with pytest.raises(BadInput, match=r"machine\.helix_angle"):
        load_machine(EXAMPLES / "fzg-c.toml").with_overrides({"machine.kind": "helical-gear"})
