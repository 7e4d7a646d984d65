"""Fatigue: Miner's sum, what counts as damage, what breaks out, and that mild wear runs ahead of
it.
"""

from dataclasses import replace

import numpy as np
import pytest

from asperity import BadInput
from asperity.contact.grid import Grid
from asperity.rating import dang_van, dang_van_per_path
from asperity.solution import stress_below
from asperity.wear.fatigue import (
    DangVanPits,
    VonMisesPits,
    break_out_pits,
    layer_depths,
    overrollings_to_failures,
    shift_damage,
    stress_path,
)
from support.passages import hertz_patches, passage, track

P_MAX, WIDTH = 1e9, 50e-6


def test_each_paths_measure_is_the_exact_one_within_a_hundredth():
    rng = np.random.default_rng(4)
    for times in (2, 3, 6, 12):
        stresses = rng.normal(size=(6, 60, times)).cumsum(axis=2)
        exact = [dang_van(stresses[:, [path]], 0.3) for path in range(60)]
        np.testing.assert_allclose(dang_van_per_path(stresses, 0.3), exact, rtol=0.02, atol=0.01)


@pytest.mark.parametrize("slope", [0.0, 0.3])
def test_pulsating_tension_and_torsion_have_their_closed_measures(slope):
    """S/4 + a S/3 and T/2, from the unloaded state and one loaded one."""
    stresses = np.zeros((6, 2, 2))
    stresses[0, 0, 1] = stresses[3, 1, 1] = 1.0
    np.testing.assert_allclose(
        dang_van_per_path(stresses, slope), [0.25 + slope / 3.0, 0.5], rtol=1e-9
    )


def test_a_path_that_stays_below_is_given_a_bound_that_does_too():
    stresses = np.random.default_rng(2).normal(size=(6, 50, 5))
    full = dang_van_per_path(stresses, 0.2)
    level = float(np.median(full))
    some = dang_van_per_path(stresses, 0.2, above=level)
    assert np.array_equal(some > level, full > level)
    assert np.array_equal(some[full > level], full[full > level])
    assert np.any(some != full)


def test_the_path_below_a_rolling_line_contact_is_hertz():
    """p_h/4 at half a half-width, as positions get close."""
    grid = track((256, 16), (400e-6, 200e-6))
    found = []
    for count in (16, 128):
        path = stress_path(hertz_patches(grid, WIDTH, P_MAX, count), grid, 0.5 * WIDTH, 0.3)
        found.append(float(dang_van_per_path(path, 0.0).max()) / P_MAX)
    assert found[1] == pytest.approx(0.25, rel=0.01, abs=0.0)
    assert 0.23 < found[0] < 0.256


def test_the_ends_of_a_track_are_one_place():
    """A contact that lies across the ends of its track stresses what is below it like one in the
    middle.
    """
    grid = track((65, 16))
    (middle,) = hertz_patches(grid, WIDTH, P_MAX, 1)
    turn = 30
    ends = replace(
        middle,
        pressure=np.roll(middle.pressure, turn, axis=0),
        shear=np.roll(middle.shear, turn, axis=0),
    )
    one, other = (
        stress_path((patch,), grid, 20e-6, 0.3).reshape(6, *grid.cells, 2)
        for patch in (middle, ends)
    )
    np.testing.assert_allclose(np.roll(one, turn, axis=1), other, atol=1e-6 * P_MAX)
    below = stress_below(
        middle.pressure, None, grid, np.array([20e-6]), poisson_ratio=0.3
    ).tensor_at(20e-6)
    np.testing.assert_allclose(one[2, ..., 1], below.zz, atol=1e-6 * P_MAX)
    assert not one[..., 0].any()


def miner(jumps, jump, *, limit=150e6, exponent=9.0):
    """A smooth contact's largest sum after some jumps, and the measure that it is of."""
    grid = track((64, 8))
    fatigue = VonMisesPits(limit=limit, cycles=1e7, exponent=exponent)
    patches, state, changes = hertz_patches(grid, WIDTH, P_MAX, 8), {}, []
    for _ in range(jumps):
        changes.append(fatigue(passage(grid, patches, jump=jump, state=state)))
        state = changes[-1].state
    return changes


def test_miners_sum_of_a_constant_amplitude_is_cycles_over_life():
    changes = miner(3, 20.0)
    measure = changes[0].facts["measure_pa"]
    life = 1e7 * (150e6 / measure) ** 9.0
    assert (
        0.5 * P_MAX < measure < 0.56 * P_MAX
    )  # von Mises below a line contact: 0.5575 p_h at most
    for number, change in enumerate(changes, start=1):
        assert change.facts["sum"] == pytest.approx(20.0 * number / life, rel=1e-12, abs=0.0)
        assert not change.heights_change.any()
    again = miner(1, 60.0)[0]
    assert again.facts["sum"] == pytest.approx(changes[2].facts["sum"], rel=1e-12, abs=0.0)


def test_pits_come_when_the_sum_passes_one_and_not_before():
    measure = miner(1, 1.0)[0].facts["measure_pa"]
    life = 1e7 * (150e6 / measure) ** 9.0
    assert not miner(1, 0.999 * life)[0].heights_change.any()
    broken = miner(1, 1.001 * life)[0]
    assert broken.heights_change.min() < -1e-6
    assert broken.facts["cells"] > 0


def test_the_next_jump_ends_before_many_cells_fail():
    lives = np.full((3, 20, 10), np.inf)
    lives[1] = 50.0 + np.arange(200.0).reshape(20, 10)
    lives[2, 0, 5] = 7.0
    assert overrollings_to_failures(lives) == 51.0  # 7, 50, 51: two of 200 have failed before
    assert overrollings_to_failures(np.full((3, 20, 10), np.inf)) == np.inf
    measure = miner(1, 1.0)[0].facts["measure_pa"]
    life = 1e7 * (150e6 / measure) ** 9.0
    first, second = miner(2, 0.25 * life)
    assert first.longest == pytest.approx(second.longest + 0.25 * life, rel=1e-6)
    assert 0.7 * life < first.longest < 1.5 * life


def test_below_the_limit_nothing_is_ever_damaged():
    change = miner(1, 1e12, limit=P_MAX)[0]
    assert change.facts["sum"] == 0.0
    assert not change.heights_change.any()
    above = miner(1, 1e12, limit=0.5 * P_MAX)[0]
    assert above.heights_change.any()


@pytest.mark.parametrize("shape", [(2.0, 1.0), (1.0, 1.0), (1.0, 3.0)])
def test_a_pit_of_any_layer_has_the_volume_of_its_bowl_whatever_the_cells(shape):
    """The shallowest too, whose bowl is narrower than a cell is long."""
    grid = Grid((40, 40), (0.0, 0.0), (40e-6 * shape[0], 40e-6 * shape[1]), (True, True))
    depths = layer_depths(grid, 8e-6)
    for layer, depth in enumerate(depths):
        failed = np.zeros((depths.size, *grid.cells), dtype=bool)
        failed[layer, 20, 20] = True
        pits, _ = break_out_pits(np.zeros(failed.shape), depths, failed, grid, 3.0)
        volume = float(pits.sum() * np.prod(grid.spacing))
        assert volume == pytest.approx(np.pi / 8.0 * (3.0 * depth) ** 2 * depth, rel=1e-9, abs=0.0)


def test_a_pit_has_the_volume_of_its_bowl_and_is_booked():
    """π/8 W² D, on a grid that shows it; what the heights lose is what the facts say."""
    grid = track((400, 400), (200e-6, 200e-6))
    depths = layer_depths(grid, WIDTH)
    failed = np.zeros((depths.size, *grid.cells), dtype=bool)
    failed[6, 200, 3] = True  # across the side that repeats
    damage = np.where(failed, 1.5, 0.2)
    pits, left = break_out_pits(damage, depths, failed, grid, 3.0)
    deep = depths[6]
    assert pits.max() == pytest.approx(deep, rel=1e-3, abs=0.0)
    assert pits.sum() * 0.5e-6**2 == pytest.approx(
        np.pi / 8.0 * (3.0 * deep) ** 2 * deep, rel=1e-9, abs=0.0
    )
    assert left.max() < 1.0
    change = miner(1, 1e9)[0]
    volume = -change.heights_change.sum() * float(np.prod(track((64, 8)).spacing))
    assert change.facts["volume_m3"] == pytest.approx(volume, rel=1e-12, abs=0.0)


def test_layers_that_failed_are_gone_and_the_ones_below_come_up():
    grid = track((16, 16), (0.8e-6, 0.8e-6))  # cells that are far smaller than a pit
    depths = np.array([1e-6, 2e-6, 4e-6])
    damage = np.broadcast_to(np.array([1.2, 0.4, 0.1])[:, None, None], (3, 16, 16)).copy()
    pits, left = break_out_pits(damage, depths, damage >= 1.0, grid, 3.0)
    np.testing.assert_allclose(pits, 1e-6, rtol=1e-3)
    np.testing.assert_allclose(
        left[:, 0, 0], [0.4, 0.25, 0.075], rtol=1e-3
    )  # what was at 2, 3 and 5 um; at 8 um it is new


def test_what_is_worn_off_brings_up_what_lay_deeper():
    depths = np.array([1e-6, 2e-6, 4e-6])
    damage = np.array([0.8, 0.4, 0.2])[:, None, None] * np.ones((3, 2, 2))
    removed = np.array([[0.0, 0.5e-6], [1e-6, 9e-6]])
    after = shift_damage(damage, depths, removed)
    np.testing.assert_allclose(after[:, 0, 0], [0.8, 0.4, 0.2])
    np.testing.assert_allclose(after[:, 0, 1], [0.6, 0.35, 0.175])
    np.testing.assert_allclose(after[:, 1, 0], [0.4, 0.3, 0.15])
    np.testing.assert_allclose(after[:, 1, 1], [0.0, 0.0, 0.0])


def test_wear_that_is_fast_enough_leaves_no_pits():
    """A layer takes its damage on the way up: the sum stays below the integral of damage over depth
    by wear.
    """
    grid = track((64, 8))
    patches = hertz_patches(grid, WIDTH, P_MAX, 8)
    fatigue = VonMisesPits(limit=150e6, cycles=1e7)
    measure = fatigue(passage(grid, patches, jump=1.0)).facts["measure_pa"]
    rate = float(fatigue.damage(np.array(measure)))
    jump = 0.05 / rate

    def pitted(removed):
        state, taken = {}, 0.0
        for _ in range(60):
            one = fatigue(
                passage(grid, patches, jump=jump, state=state, removed=np.full(grid.cells, removed))
            )
            state, taken = one.state, taken + one.facts["volume_m3"]
        return taken, float(state["damage"].max())

    reach = float(layer_depths(grid, WIDTH)[-1])
    assert pitted(0.0)[0] > 0.0
    volume, largest = pitted(2.0 * 0.05 * reach)
    assert volume == 0.0
    assert largest < 1.0


def test_the_same_strengths_stand_behind_every_jump():
    grid = track((64, 8))
    patches = hertz_patches(grid, WIDTH, P_MAX, 4)
    fatigue = VonMisesPits(limit=300e6, scatter=0.1)
    first = fatigue(passage(grid, patches, jump=10.0, rng=np.random.default_rng(5)))
    second = fatigue(
        passage(grid, patches, jump=10.0, rng=np.random.default_rng(6), state=first.state)
    )
    np.testing.assert_allclose(second.state["damage"], 2.0 * first.state["damage"])
    assert np.ptp(first.state["strength"]) > 0.3


@pytest.mark.parametrize(
    ("wrong", "said"),
    [
        ({"limit": -1.0}, "fatigue limit must be positive"),
        ({"limit": 1e8, "slope": -0.1}, "fatigue slope must be 0 or more"),
        ({"limit": 1e8, "scatter": 0.5}, "fatigue scatter must lie between 0 and 0.3"),
    ],
)
def test_what_fatigue_refuses(wrong, said):
    with pytest.raises(BadInput, match=said):
        DangVanPits(**wrong)
