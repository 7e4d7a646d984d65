"""What roughens, as a case that wears asks it: booked, handed over, kept to the bit, no longer
jumps than allowed.
"""

import math
from dataclasses import replace

import numpy as np
import pytest

from asperity import BadInput
from asperity.simulation.wear.jump import WearingContact
from asperity.simulation.wear.state import WearState
from asperity.wear import combined_roughness
from support.wearing import worn_case

GENTLE = {"motion.rough": "second", "wear.k": "1e-17 1/Pa", "wear.patches": 3}
WAYS = {
    "fatigue": {"law": "von-mises", "limit": "700 MPa", "cycles": 1e4},
    "ploughing": {"law": "debris", "concentration": "3e11 1/m^3"},
    "scuffing": {"law": "pressure-shear", "limit": "1e17 Pa^2"},
}
SECONDS = 100.0


def ageing(*ways):
    case = worn_case(GENTLE | {f"wear.{way}": WAYS[way] for way in ways})
    assert case.wear is not None
    return WearingContact(case, case.wear, case.moving_surfaces())


@pytest.fixture(scope="module")
def solved():
    """The contact at three positions of the new tracks, solved once for all."""
    new = ageing()
    worn = WearState.unworn(new.surfaces)
    return [
        (place, new.solver(combined_roughness(new.worn_surfaces(worn), place)))
        for place in new.positions(worn)
    ]


def jumped(model, solved, jumps=1):
    worn = WearState.unworn(model.surfaces)
    for _ in range(jumps):
        worn = model.after_jump(worn, solved, SECONDS)
    return worn


@pytest.mark.parametrize("way", list(WAYS))
def test_each_way_acts_and_is_booked(way, solved):
    model = ageing(way)
    worn, calm = jumped(model, solved, 2), jumped(ageing(), solved, 2)
    assert not calm.facts
    assert not calm.changed[1].any()
    assert {name.rpartition(".")[0] for name in worn.facts} == {f"{way}.1", f"{way}.2"}
    assert worn.changed[1].any()
    for body in (0, 1):
        lost = model.volume(worn.worn[body] - worn.changed[body], body)
        assert lost == pytest.approx(worn.booked[body] + worn.mechanical[body], rel=1e-9, abs=0.0)


def test_what_scuffing_hands_over_is_what_the_other_gains(solved):
    model = ageing("scuffing")
    worn = jumped(model, solved)
    taken = [
        worn.facts[f"scuffing.{body}.volume_m3"] / float(np.prod(model.surfaces.grid.extent))
        for body in (1, 2)
    ]
    assert min(taken) > 0.0
    volumes = [model.volume(np.full((2, 2), depth), body) for body, depth in enumerate(taken)]
    assert worn.mechanical[0] == pytest.approx(volumes[0] - 0.5 * volumes[1], rel=1e-9, abs=0.0)
    assert worn.mechanical[1] == pytest.approx(volumes[1] - 0.5 * volumes[0], rel=1e-9, abs=0.0)


def test_what_was_kept_goes_on_to_the_bit(solved):
    model = ageing("fatigue", "ploughing")
    once = jumped(model, solved)
    again = WearState.from_arrays(once.arrays())
    assert again.longest == once.longest
    one, other = (model.after_jump(worn, solved, SECONDS) for worn in (once, again))
    for body in (0, 1):
        np.testing.assert_array_equal(one.changed[body], other.changed[body])
    np.testing.assert_array_equal(
        one.states["fatigue.2"]["damage"], other.states["fatigue.2"]["damage"]
    )
    assert one.facts == other.facts


def test_a_jump_is_no_longer_than_what_roughens_allows(solved):
    """Of both bodies the one that passes more often decides, at its own rate; without what roughens
    nobody does.
    """
    model = ageing("ploughing")
    worn = jumped(model, solved)
    assert 0.0 < worn.longest < SECONDS
    free = replace(worn, longest=math.inf)
    assert model.seconds(worn, solved) == worn.longest < ageing().seconds(free, solved)
    assert model.seconds(free, solved) == ageing().seconds(free, solved) > worn.time
    assert jumped(ageing(), solved).longest == math.inf


@pytest.mark.parametrize(
    ("way", "said"),
    [
        (
            {"law": "tresca", "limit": "1 GPa"},
            r"wear\.fatigue\.law must be one of dang-van, von-mises",
        ),
        ({"law": "dang-van"}, r"wear\.fatigue\.limit"),
        ({"law": "dang-van", "limit": "-1 GPa"}, "limit must be positive"),
        (
            {"law": "dang-van", "limit": "1 GPa", "scatter": 2.0},
            "fatigue scatter must lie between 0 and",
        ),
    ],
)
def test_what_a_case_may_not_state(way, said):
    with pytest.raises(BadInput, match=said):
        worn_case(GENTLE | {"wear.fatigue": way}).wear  # noqa: B018
