"""Fatigue: Miner's sum, damage parameter, pits, and mild wear faster than pitting."""

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


def test_each_path_measure_is_exact_within_one_percent():
    rng = np.random.default_rng(4)
    for times in (2, 3, 6, 12):
        stresses = rng.normal(size=(6, 60, times)).cumsum(axis=2)
        exact = [dang_van(stresses[:, [path]], 0.3) for path in range(60)]
        np.testing.assert_allclose(dang_van_per_path(stresses, 0.3), exact, rtol=0.02, atol=0.01)


@pytest.mark.parametrize("slope", [0.0, 0.3])
def test_pulsating_tension_and_torsion_have_closed_form_measures(slope):
    """S/4 + a S/3 and T/2, between the unloaded state and one loaded state."""
    stresses = np.zeros((6, 2, 2))
    stresses[0, 0, 1] = stresses[3, 1, 1] = 1.0
    np.testing.assert_allclose(
        dang_van_per_path(stresses, slope), [0.25 + slope / 3.0, 0.5], rtol=1e-9
    )


def test_a_path_below_the_limit_has_a_bound_below_it():
    stresses = np.random.default_rng(2).normal(size=(6, 50, 5))
    all_paths = dang_van_per_path(stresses, 0.2)
    level = float(np.median(all_paths))
    some = dang_van_per_path(stresses, 0.2, above=level)
    assert np.array_equal(some > level, all_paths > level)
    assert np.array_equal(some[all_paths > level], all_paths[all_paths > level])
    assert np.any(some != all_paths)


def test_the_path_below_a_rolling_line_contact_is_hertz():
    """p_h/4 at a depth of half a half-width, for closely spaced positions."""
    grid = track((256, 16), (400e-6, 200e-6))
    amplitudes = []
    for count in (16, 128):
        path = stress_path(hertz_patches(grid, WIDTH, P_MAX, count), grid, 0.5 * WIDTH, 0.3)
        amplitudes.append(float(dang_van_per_path(path, 0.0).max()) / P_MAX)
    assert amplitudes[1] == pytest.approx(0.25, rel=0.01, abs=0.0)
    assert 0.23 < amplitudes[0] < 0.256


def test_the_ends_of_a_track_coincide():
    """A contact across the ends of its track gives the stresses of one in the middle."""
    grid = track((65, 16))
    (middle,) = hertz_patches(grid, WIDTH, P_MAX, 1)
    shift = 30
    ends = replace(
        middle,
        pressure=np.roll(middle.pressure, shift, axis=0),
        shear=np.roll(middle.shear, shift, axis=0),
    )
    centred, wrapped = (
        stress_path((patch,), grid, 20e-6, 0.3).reshape(6, *grid.cells, 2)
        for patch in (middle, ends)
    )
    np.testing.assert_allclose(np.roll(centred, shift, axis=1), wrapped, atol=1e-6 * P_MAX)
    reference = stress_below(
        middle.pressure, None, grid, np.array([20e-6]), poisson_ratio=0.3
    ).tensor_at(20e-6)
    np.testing.assert_allclose(centred[2, ..., 1], reference.zz, atol=1e-6 * P_MAX)
    assert not centred[..., 0].any()


def miner(jumps, jump, *, limit=150e6, exponent=9.0):
    """Largest damage sum of a smooth contact after some jumps, and its damage parameter."""
    grid = track((64, 8))
    fatigue = VonMisesPits(limit=limit, cycles=1e7, exponent=exponent)
    patches, state, changes = hertz_patches(grid, WIDTH, P_MAX, 8), {}, []
    for _ in range(jumps):
        changes.append(fatigue(passage(grid, patches, jump=jump, state=state)))
        state = changes[-1].state
    return changes


def test_miners_sum_at_constant_amplitude_is_cycles_over_life():
    changes = miner(3, 20.0)
    measure = changes[0].facts["measure_pa"]
    life = 1e7 * (150e6 / measure) ** 9.0
    assert (
        0.5 * P_MAX < measure < 0.56 * P_MAX
    )  # von Mises below a line contact is at most 0.5575 p_h
    for number, change in enumerate(changes, start=1):
        assert change.facts["sum"] == pytest.approx(20.0 * number / life, rel=1e-12, abs=0.0)
        assert not change.heights_change.any()
    single_jump = miner(1, 60.0)[0]
    assert single_jump.facts["sum"] == pytest.approx(changes[2].facts["sum"], rel=1e-12, abs=0.0)


def test_pits_form_only_when_the_sum_exceeds_one():
    measure = miner(1, 1.0)[0].facts["measure_pa"]
    life = 1e7 * (150e6 / measure) ** 9.0
    assert not miner(1, 0.999 * life)[0].heights_change.any()
    failed = miner(1, 1.001 * life)[0]
    assert failed.heights_change.min() < -1e-6
    assert failed.facts["cells"] > 0


def test_the_next_jump_ends_before_many_cells_fail():
    lives = np.full((3, 20, 10), np.inf)
    lives[1] = 50.0 + np.arange(200.0).reshape(20, 10)
    lives[2, 0, 5] = 7.0
    assert overrollings_to_failures(lives) == 51.0  # 7, 50, 51: two of 200 have already failed
    assert overrollings_to_failures(np.full((3, 20, 10), np.inf)) == np.inf
    measure = miner(1, 1.0)[0].facts["measure_pa"]
    life = 1e7 * (150e6 / measure) ** 9.0
    first, second = miner(2, 0.25 * life)
    assert first.longest == pytest.approx(second.longest + 0.25 * life, rel=1e-6)
    assert 0.7 * life < first.longest < 1.5 * life


def test_stresses_below_the_limit_cause_no_damage():
    change = miner(1, 1e12, limit=P_MAX)[0]
    assert change.facts["sum"] == 0.0
    assert not change.heights_change.any()
    above_limit = miner(1, 1e12, limit=0.5 * P_MAX)[0]
    assert above_limit.heights_change.any()


@pytest.mark.parametrize("shape", [(2.0, 1.0), (1.0, 1.0), (1.0, 3.0)])
def test_a_pit_of_any_layer_has_the_volume_of_its_bowl_for_all_cell_shapes(shape):
    """The bowl of the shallowest layer is narrower than a cell."""
    grid = Grid((40, 40), (0.0, 0.0), (40e-6 * shape[0], 40e-6 * shape[1]), (True, True))
    depths = layer_depths(grid, 8e-6)
    for layer, depth in enumerate(depths):
        failed = np.zeros((depths.size, *grid.cells), dtype=bool)
        failed[layer, 20, 20] = True
        pits, _ = break_out_pits(np.zeros(failed.shape), depths, failed, grid, 3.0)
        volume = float(pits.sum() * np.prod(grid.spacing))
        assert volume == pytest.approx(np.pi / 8.0 * (3.0 * depth) ** 2 * depth, rel=1e-9, abs=0.0)


def test_a_pit_has_the_volume_of_its_bowl_and_is_reported():
    """π/8 W² D on a resolving grid; the loss of height equals the reported volume."""
    grid = track((400, 400), (200e-6, 200e-6))
    depths = layer_depths(grid, WIDTH)
    failed = np.zeros((depths.size, *grid.cells), dtype=bool)
    failed[6, 200, 3] = True  # across the periodic side
    damage = np.where(failed, 1.5, 0.2)
    pits, remaining = break_out_pits(damage, depths, failed, grid, 3.0)
    deep = depths[6]
    assert pits.max() == pytest.approx(deep, rel=1e-3, abs=0.0)
    assert pits.sum() * 0.5e-6**2 == pytest.approx(
        np.pi / 8.0 * (3.0 * deep) ** 2 * deep, rel=1e-9, abs=0.0
    )
    assert remaining.max() < 1.0
    change = miner(1, 1e9)[0]
    volume = -change.heights_change.sum() * float(np.prod(track((64, 8)).spacing))
    assert change.facts["volume_m3"] == pytest.approx(volume, rel=1e-12, abs=0.0)


def test_failed_layers_are_removed_and_deeper_layers_move_up():
    grid = track((16, 16), (0.8e-6, 0.8e-6))  # cells far smaller than a pit
    depths = np.array([1e-6, 2e-6, 4e-6])
    damage = np.broadcast_to(np.array([1.2, 0.4, 0.1])[:, None, None], (3, 16, 16)).copy()
    pits, remaining = break_out_pits(damage, depths, damage >= 1.0, grid, 3.0)
    np.testing.assert_allclose(pits, 1e-6, rtol=1e-3)
    np.testing.assert_allclose(
        remaining[:, 0, 0], [0.4, 0.25, 0.075], rtol=1e-3
    )  # damage from 2, 3 and 5 um depth; at 8 um the material is undamaged


def test_wear_moves_deeper_layers_up():
    depths = np.array([1e-6, 2e-6, 4e-6])
    damage = np.array([0.8, 0.4, 0.2])[:, None, None] * np.ones((3, 2, 2))
    removed = np.array([[0.0, 0.5e-6], [1e-6, 9e-6]])
    after = shift_damage(damage, depths, removed)
    np.testing.assert_allclose(after[:, 0, 0], [0.8, 0.4, 0.2])
    np.testing.assert_allclose(after[:, 0, 1], [0.6, 0.35, 0.175])
    np.testing.assert_allclose(after[:, 1, 0], [0.4, 0.3, 0.15])
    np.testing.assert_allclose(after[:, 1, 1], [0.0, 0.0, 0.0])


def test_fast_wear_prevents_pits():
    """A layer accumulates damage as it rises: at most the integral of damage over depth by wear."""
    grid = track((64, 8))
    patches = hertz_patches(grid, WIDTH, P_MAX, 8)
    fatigue = VonMisesPits(limit=150e6, cycles=1e7)
    measure = fatigue(passage(grid, patches, jump=1.0)).facts["measure_pa"]
    rate = float(fatigue.damage(np.array(measure)))
    jump = 0.05 / rate

    def pitted(removed):
        state, pit_volume = {}, 0.0
        for _ in range(60):
            step = fatigue(
                passage(grid, patches, jump=jump, state=state, removed=np.full(grid.cells, removed))
            )
            state, pit_volume = step.state, pit_volume + step.facts["volume_m3"]
        return pit_volume, float(state["damage"].max())

    reach = float(layer_depths(grid, WIDTH)[-1])
    assert pitted(0.0)[0] > 0.0
    volume, largest = pitted(2.0 * 0.05 * reach)
    assert volume == 0.0
    assert largest < 1.0


def test_strengths_are_the_same_in_every_jump():
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
    ("wrong", "message"),
    [
        ({"limit": -1.0}, "fatigue limit must be positive"),
        ({"limit": 1e8, "slope": -0.1}, "fatigue slope must be 0 or more"),
        ({"limit": 1e8, "scatter": 0.5}, "fatigue scatter must lie between 0 and 0.3"),
    ],
)
def test_invalid_fatigue_settings_are_refused(wrong, message):
    with pytest.raises(BadInput, match=message):
        DangVanPits(**wrong)
