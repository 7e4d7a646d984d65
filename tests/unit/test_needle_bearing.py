"""Needle roller bearings: closed forms, the cylindrical roller bearing, and refusals."""

import math
from pathlib import Path

import numpy as np
import pytest

from asperity.case import load_machine
from asperity.contact.conditions import ElasticPair
from asperity.core.errors import BadInput
from asperity.machine import CylindricalRollerBearing, NeedleRollerBearing
from asperity.machines import machine_conditions

STEEL = ElasticPair((206e9, 206e9), (0.3, 0.3))
EXAMPLE = Path(__file__).parents[2] / "examples" / "needle.toml"
GEOMETRY = {
    "rollers": 28,
    "roller_diameter": 2.5e-3,
    "roller_length": 12.8e-3,
    "pitch_diameter": 22.5e-3,
    "radial_load": 2000.0,
    "speed": 100.0 * math.pi,
    "clearance": 15e-6,
}


@pytest.mark.parametrize("profile", ["straight", "iso"])
def test_contacts_are_those_of_a_cylindrical_roller_bearing(profile):
    needles = NeedleRollerBearing(**GEOMETRY, profile=profile, guidance="full-complement")
    rollers = CylindricalRollerBearing(**GEOMETRY, profile=profile)
    assert needles.contacts(STEEL) == rollers.contacts(STEEL)
    assert needles.frequencies == rollers.frequencies
    assert needles.loads @ np.cos(needles.angles) == pytest.approx(2000.0, rel=1e-9)


def test_loads_speeds_and_frequencies_of_the_example():
    bearing = load_machine(EXAMPLE).machine
    assert isinstance(bearing, NeedleRollerBearing)
    assert bearing.loads[:5] == pytest.approx([492.232, 441.202, 294.317, 74.9185, 0.0], rel=1e-5)
    inner, outer = bearing.contacts(STEEL)[:2]
    ratio = 2.5 / 22.5
    assert (inner.radius, outer.radius) == pytest.approx(
        (1.25e-3 * (1.0 - ratio), 1.25e-3 * (1.0 + ratio)), rel=1e-12
    )
    assert inner.entrainment_speed == pytest.approx(
        22.5e-3 / 4.0 * (1.0 - ratio**2) * 100.0 * math.pi, rel=1e-12
    )
    assert bearing.frequencies["bpfo_hz"] == pytest.approx(28 * 50.0 * (1.0 - ratio) / 2.0)
    assert inner.hertz(STEEL).p_max == pytest.approx(1.1167e9, rel=1e-4)
    keys = {rating.key for rating in machine_conditions(load_machine(EXAMPLE)).ratings}
    assert "viscosity_ratio" in keys


def test_the_load_zone_of_many_needles_has_sjovalls_constant():
    """4.085 for the exponent 10/9, without clearance."""
    thin = GEOMETRY | {
        "rollers": 400,
        "roller_diameter": 0.3e-3,
        "roller_length": 2e-3,
        "pitch_diameter": 46.5e-3,
        "clearance": 0.0,
    }
    bearing = NeedleRollerBearing(**thin)
    assert bearing.loads[0] * 400 / 2000.0 == pytest.approx(1.0 / 0.24480, rel=1e-4)


def test_touching_rollers_slide_at_twice_their_surface_speed():
    full = NeedleRollerBearing(**GEOMETRY, guidance="full-complement")
    rotation = 2.0 * math.pi * full.frequencies["bsf_hz"]
    assert full.neighbour_sliding_speed == pytest.approx(rotation * 2.5e-3, rel=1e-12)
    assert full.neighbour_sliding_speed == pytest.approx(3.4907, rel=1e-4)
    assert any("touch each other and slide at 3.49 m/s" in note for note in full.notes(STEEL))
    caged = NeedleRollerBearing(**GEOMETRY)
    assert caged.neighbour_sliding_speed is None
    assert not any("touch" in note for note in caged.notes(STEEL))


def test_gaps_between_rollers_add_up():
    """Centres at the corners of a polygon; the gap is a side less the diameter."""
    bearing = NeedleRollerBearing(**GEOMETRY)
    x, y = 11.25e-3 * np.cos(bearing.angles), 11.25e-3 * np.sin(bearing.angles)
    side = math.hypot(x[1] - x[0], y[1] - y[0])
    assert bearing.gap == pytest.approx(side - 2.5e-3, rel=1e-9)


def test_a_tilt_unloads_one_end_of_the_most_loaded_roller():
    """ISO 16281: the approach of a slice at x is δ - x tan ψ."""
    bearing = NeedleRollerBearing(**GEOMETRY)
    approach = (bearing.loads[0] / (35948.0 * 12.8 ** (8.0 / 9.0))) ** 0.9  # mm
    assert approach - 6.4 * bearing.unloading_tilt == pytest.approx(0.0, abs=1e-9 * approach)
    assert any("A tilt of 0.43 mrad unloads one end" in note for note in bearing.notes(STEEL))


@pytest.mark.parametrize(
    ("changed", "message"),
    [
        ({"roller_length": 7e-3}, "2.8 times roller_diameter.*use the kind cylindrical-roller"),
        ({"roller_length": 30e-3}, "12 times roller_diameter.*shorten them"),
        ({"rollers": 29}, "29 rolling elements of 2.5 mm do not fit"),
        ({"rollers": 25, "guidance": "full-complement"}, "leaves room for 3 more.*raise rollers"),
        ({"guidance": "none"}, "guidance must be"),
        ({"radial_load": 0.0}, "unloads every roller"),
    ],
)
def test_impossible_needle_bearings_are_refused(changed, message):
    with pytest.raises(BadInput, match=message):
        NeedleRollerBearing(**(GEOMETRY | changed))


@pytest.mark.parametrize("guidance", ["cage", "full-complement"])
def test_needles_of_exactly_the_limits_are_accepted(guidance):
    for slenderness in (3.0, 10.0):
        length = {"roller_length": slenderness * 2.5e-3}
        assert NeedleRollerBearing(**(GEOMETRY | length), guidance=guidance).loads[0] > 0.0
