"""Roughening mechanisms in a wear case: reported, transferred, stored bit by bit, jump limit."""

import math
from dataclasses import replace

import numpy as np
import pytest

from asperity import BadInput
from asperity.simulation.wear.jump import WearingContact
from asperity.simulation.wear.state import WearState
from asperity.wear import surfaces_at
from support.wearing import worn_case

GENTLE = {"motion.rough": "second", "wear.k": "1e-17 1/Pa", "wear.patches": 3}
MECHANISMS = {
    "fatigue": {"law": "von-mises", "limit": "700 MPa", "cycles": 1e4},
    "ploughing": {"law": "debris", "concentration": "3e11 1/m^3"},
    "scuffing": {"law": "pressure-shear", "limit": "1e17 Pa^2"},
}
SECONDS = 100.0


def wear_model(*mechanisms):
    case = worn_case(
        GENTLE | {f"wear.{mechanism}": MECHANISMS[mechanism] for mechanism in mechanisms}
    )
    assert case.wear is not None
    return WearingContact(case, case.wear, case.moving_surfaces())


@pytest.fixture(scope="module")
def solved():
    """The contact at three positions of the new tracks, solved once."""
    model = wear_model()
    worn = WearState.unworn(model.surfaces)
    return [
        (place, model.solver(surfaces_at(model.worn_surfaces(worn), place)))
        for place in model.positions(worn)
    ]


def after_jumps(model, solved, jumps=1):
    worn = WearState.unworn(model.surfaces)
    for _ in range(jumps):
        worn = model.after_jump(worn, solved, SECONDS)
    return worn


@pytest.mark.parametrize("mechanism", list(MECHANISMS))
def test_each_mechanism_acts_and_is_reported(mechanism, solved):
    model = wear_model(mechanism)
    worn, unchanged = after_jumps(model, solved, 2), after_jumps(wear_model(), solved, 2)
    assert not unchanged.facts
    assert not unchanged.changed[1].any()
    assert {name.rpartition(".")[0] for name in worn.facts} == {f"{mechanism}.1", f"{mechanism}.2"}
    assert worn.changed[1].any()
    for body in (0, 1):
        lost = model.volume(worn.worn[body] - worn.changed[body], body)
        assert lost == pytest.approx(worn.booked[body] + worn.mechanical[body], rel=1e-9, abs=0.0)


def test_scuffing_transfers_material_to_the_other_body(solved):
    model = wear_model("scuffing")
    worn = after_jumps(model, solved)
    depths = [
        worn.facts[f"scuffing.{body}.volume_m3"] / float(np.prod(model.surfaces.grid.extent))
        for body in (1, 2)
    ]
    assert min(depths) > 0.0
    volumes = [model.volume(np.full((2, 2), depth), body) for body, depth in enumerate(depths)]
    assert worn.mechanical[0] == pytest.approx(volumes[0] - 0.5 * volumes[1], rel=1e-9, abs=0.0)
    assert worn.mechanical[1] == pytest.approx(volumes[1] - 0.5 * volumes[0], rel=1e-9, abs=0.0)


def test_a_restored_state_continues_bit_by_bit(solved):
    model = wear_model("fatigue", "ploughing")
    state = after_jumps(model, solved)
    restored = WearState.from_arrays(state.arrays())
    assert restored.longest == state.longest
    first, continued = (model.after_jump(worn, solved, SECONDS) for worn in (state, restored))
    for body in (0, 1):
        np.testing.assert_array_equal(first.changed[body], continued.changed[body])
    np.testing.assert_array_equal(
        first.states["fatigue.2"]["damage"], continued.states["fatigue.2"]["damage"]
    )
    assert first.facts == continued.facts


def test_the_jump_limit_of_roughening_applies(solved):
    """The more frequently overrolled body decides, at its own rate; without roughening, no
    limit.
    """
    model = wear_model("ploughing")
    worn = after_jumps(model, solved)
    assert 0.0 < worn.longest < SECONDS
    unlimited = replace(worn, longest=math.inf)
    assert model.seconds(worn, solved) == worn.longest < wear_model().seconds(unlimited, solved)
    assert model.seconds(unlimited, solved) == wear_model().seconds(unlimited, solved) > worn.time
    assert after_jumps(wear_model(), solved).longest == math.inf


@pytest.mark.parametrize(
    ("mechanism", "message"),
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
def test_invalid_roughening_settings_are_refused(mechanism, message):
    with pytest.raises(BadInput, match=message):
        worn_case(GENTLE | {"wear.fatigue": mechanism}).wear  # noqa: B018
