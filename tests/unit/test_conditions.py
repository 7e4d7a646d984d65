import pytest

from asperity.contact.conditions import ElasticPair
from asperity.contact.hertz import elliptic_contact, point_contact
from asperity.core.errors import BadInput
from support.paper import contact


def test_the_papers_modulus_is_the_effective_modulus():
    """The printed 219.78 GPa is E/(1 - nu^2) = E', twice the E* of Hertz."""
    pair = ElasticPair((200e9, 200e9), (0.3, 0.3))
    assert pair.effective_modulus == pytest.approx(219.78e9, rel=1e-5)
    assert pair.reduced_modulus == pytest.approx(109.89e9, rel=1e-5)


def test_a_rigid_partner_leaves_the_others_plane_strain_modulus():
    assert ElasticPair((70e9, 1e30), (0.33, 0.2)).reduced_modulus == pytest.approx(
        70e9 / (1.0 - 0.33**2), rel=1e-12
    )


def test_the_papers_contact_has_the_documented_size():
    """physics.md section 2: a = 55.93 um, p_h = 0.5691 GPa, a^2/R = 0.5793 um."""
    paper = contact()
    a = paper.hertz.half_widths[0]
    assert a == pytest.approx(55.93e-6, rel=1e-4)
    assert paper.hertz.p_max == pytest.approx(0.5691e9, rel=1e-4)
    assert a**2 / paper.radius == pytest.approx(0.5793e-6, rel=1e-4)
    assert paper.line_load == 50e3


def test_speeds_of_the_papers_rig():
    """Roller 12 mm at 3375 r/min, ring 108 mm at 300 r/min: slide-to-roll ratio 0.2 (paper's Table
    2).
    """
    rig = contact(surface_speeds=(2.12, 1.70))
    assert rig.entrainment_speed == pytest.approx(1.91)
    assert rig.sliding_speed == pytest.approx(0.42)
    assert rig.slide_to_roll == pytest.approx(0.2, abs=0.02)
    assert contact(surface_speeds=(1.70, 2.12)).sliding_speed == pytest.approx(0.42)


def test_each_geometry_uses_its_own_hertz_formula():
    modulus = contact().pair.reduced_modulus
    ball = contact(geometry="point", length=None)
    assert ball.hertz == point_contact(500.0, 5.4e-3, modulus)
    barrel = contact(geometry="elliptic", length=None, radius=(5e-3, 20e-3))
    assert barrel.hertz == elliptic_contact(500.0, (5e-3, 20e-3), modulus)
    assert barrel.radius_along_rolling == 5e-3
    with pytest.raises(BadInput, match="no load per length"):
        _ = ball.line_load


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"geometry": "plane"}, "line, point, elliptic, roller, got 'plane'"),
        ({"radius": -5.4e-3}, "radius must be positive and finite, got -0.0054 m"),
        ({"radius": (1e-3, 2e-3)}, "one number"),
        ({"geometry": "elliptic", "length": None}, r"a pair \(Rx, Ry\)"),
        ({"load": 0.0}, "load must be positive"),
        ({"load": float("nan")}, "load must be positive"),
        ({"length": None}, "needs its length"),
        ({"length": -1.0}, "length must be positive"),
        ({"geometry": "point"}, "length belongs to a line contact"),
        ({"hardness": 0.0}, "hardness must be positive"),
        ({"surface_speeds": (1.0, -1.5)}, "entrainment speed must be positive"),
    ],
)
def test_an_impossible_contact_is_refused(changes, message):
    with pytest.raises(BadInput, match=message):
        contact(**changes)


@pytest.mark.parametrize(
    ("moduli", "ratios"), [((0.0, 2e11), (0.3, 0.3)), ((2e11, 2e11), (0.3, 0.51))]
)
def test_an_impossible_material_is_refused(moduli, ratios):
    with pytest.raises(BadInput, match=r"must"):
        ElasticPair(moduli, ratios)
