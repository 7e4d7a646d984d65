"""Wear laws, wear steps and tracks against closed forms and conservation."""

import math

import numpy as np
import pytest

from asperity.contact.grid import Grid
from asperity.core.errors import BadInput
from asperity.surface import MovingSurfaces, Surface
from asperity.wear import (
    PRIORS,
    Archard,
    Body,
    DissipatedEnergy,
    Exposure,
    FilmDefect,
    RubbingConditions,
    TrackPosition,
    WearCoefficient,
    combined_roughness,
    is_uniform_along,
    longest_jump,
    map_to_track,
    positions,
    removed_depth,
    to_other_track,
)

STEEL = Body(youngs_modulus=2e11, poisson_ratio=0.3, hardness=2e9, speed=2.0)
MODULUS = 1.1e11


def exposure(k: float = 1e-17, speed: float = 2.0, overrolling: float = 50.0) -> Exposure:
    body = Body(youngs_modulus=2e11, poisson_ratio=0.3, hardness=2e9, speed=speed)
    return Exposure(k=k, body=body, overrolling=overrolling, width=1e-4, sliding_speed=0.4)


def test_a_flat_pin_wears_by_k_p_v_t():
    rubbing = RubbingConditions(pressure=np.array([1e6]), shear=np.array([1e5]), sliding_speed=0.1)
    assert 1e-16 * Archard()(rubbing)[0] * 3600.0 == pytest.approx(
        36e-9, rel=1e-12, abs=0.0
    )  # machines.md 5.3
    assert DissipatedEnergy()(rubbing)[0] == pytest.approx(1e4)
    k = DissipatedEnergy().equivalent_coefficient(1e-16, 0.1)
    assert k * DissipatedEnergy()(rubbing)[0] == pytest.approx(
        1e-16 * Archard()(rubbing)[0], abs=0.0
    )
    with pytest.raises(BadInput, match="boundary friction of 0"):
        DissipatedEnergy().equivalent_coefficient(1e-16, 0.0)


def test_the_defect_share_of_a_film_rises_from_0_when_cold_to_1_when_hot():
    law, speed = FilmDefect(spacing=3e-10, period=3e-12, heat=5e4), 0.5
    assert law.defects(np.array([200.0]), speed)[0] == pytest.approx(
        200.0 * math.exp(-5e4 / (8.31446 * 200.0)), rel=1e-3
    )
    assert law.defects(np.array([1e6]), speed)[0] == pytest.approx(1.0, abs=1e-12)
    warm = np.linspace(300.0, 700.0, 9)
    assert np.all(np.diff(law.defects(warm, speed)) > 0.0)
    # at E/(R T) = ln(200), the share of bare sites is 1 - 1/e
    temperature = 5e4 / (8.31446261815324 * math.log(200.0))
    assert law.defects(np.array([temperature]), speed)[0] == pytest.approx(
        1.0 - math.exp(-1.0), rel=1e-12, abs=0.0
    )
    at_rest = RubbingConditions(
        pressure=np.ones(3), shear=np.ones(3), sliding_speed=0.0, temperature=np.full(3, 400.0)
    )
    assert not law(at_rest).any()


def test_a_wear_class_is_an_interval_of_k_times_hardness():
    for name, (low, high) in PRIORS.items():
        known = WearCoefficient.from_severity(name, 2e9)
        assert known.k * known.low * 2e9 == pytest.approx(low, rel=1e-12, abs=0.0)
        assert known.k * known.high * 2e9 == pytest.approx(high, rel=1e-12, abs=0.0)
        assert known.low * known.high == pytest.approx(1.0)  # k is the geometric mean
    with pytest.raises(BadInput, match="hardness"):
        WearCoefficient.from_severity("mild", None)
    stated = WearCoefficient.from_value(1e-17, 0.5)
    assert stated.high == pytest.approx(math.exp(1.6449 * 0.5), rel=1e-4, abs=0.0)
    assert stated.low * stated.high == pytest.approx(1.0)


def test_a_jump_removes_the_mean_depth_and_adds_no_material():
    rng = np.random.default_rng(1)
    grid = Grid((64, 48), (0.0, 0.0), (1e-4, 6e-5), periodic=(True, True))
    rate = np.maximum(rng.normal(size=grid.cells) - 1.5, 0.0) * 1e-12
    spike = np.zeros(grid.cells)
    spike[20, 30] = 1e-12
    # at 1e3 s the truncated spectrum of the spike would give depths below 0
    for seconds in (1e-3, 1.0, 1e3, 1e6):
        for any_rate in (rate, spike):
            depth = removed_depth(any_rate, seconds, exposure(), grid, MODULUS)
            assert depth.mean() == pytest.approx(any_rate.mean() * seconds, rel=1e-12, abs=0.0)
            assert depth.min() >= 0.0
    short = exposure()
    duration = 1e-6 / short.decay_exponent(1e6, 1.0, MODULUS)  # too short for any wave to decay
    np.testing.assert_allclose(
        removed_depth(rate, duration, short, grid, MODULUS),
        rate * duration,
        rtol=0,
        atol=3e-6 * rate.max() * duration,
    )
    uniform = np.broadcast_to(rate[:1], rate.shape)
    assert is_uniform_along(removed_depth(uniform, 1.0, exposure(), grid, MODULUS))


@pytest.mark.parametrize("jumps", [1, 7])
def test_a_wave_in_full_contact_decays_as_in_closed_form_at_any_jump(jumps):
    grid = Grid((64, 64), (0.0, 0.0), (8e-5, 8e-5), periodic=(True, True))
    wave = 2.0 * np.pi / 2e-5
    heights, body, mean = (
        1e-8 * np.cos(wave * grid.x)[:, None] * np.ones(64),
        exposure(k=1e-15),
        1e9,
    )
    seconds = 2.0 / float(body.decay_exponent(wave, 1.0, MODULUS))  # two decay lengths in all
    worn = heights
    for _ in range(jumps):
        pressure = mean + 0.5 * MODULUS * wave * (worn - worn.mean())
        rate = body.k * pressure * body.sliding_speed * body.contact_time_share
        worn = worn - removed_depth(rate, seconds / jumps, body, grid, MODULUS)
    amplitude = 2.0 * np.abs(np.fft.rfft(worn[:, 0]))[4] / 64
    assert amplitude == pytest.approx(1e-8 * math.exp(-2.0), rel=1e-9, abs=0.0)
    sliding = seconds * body.sliding_speed * body.contact_time_share
    assert -worn.mean() == pytest.approx(body.k * mean * sliding, rel=1e-9, abs=0.0)


def test_the_longest_jump_is_limited_by_its_depth_and_the_shortest_wave():
    grid = Grid((64, 64), (0.0, 0.0), (8e-5, 8e-5), periodic=(True, True))
    fast, slow = np.full(grid.cells, 1e-9), np.full(grid.cells, 1e-12)
    gentle = exposure(k=1e-22)
    assert longest_jump(
        (gentle, gentle), (slow, fast), 1e-8, 1.0, grid.spacing, MODULUS
    ) == pytest.approx(10.0)
    steep = exposure(k=1e-15)
    longest = longest_jump((gentle, steep), (slow, slow), 1.0, 0.7, grid.spacing, MODULUS)
    shortest_wave = math.pi * math.hypot(*(1.0 / side for side in grid.spacing))
    assert float(steep.decay_exponent(shortest_wave, longest, MODULUS)) == pytest.approx(0.7)
    at_rest = exposure(k=0.0)
    assert (
        longest_jump((at_rest, at_rest), (0.0 * slow, 0.0 * slow), 1.0, 1.0, grid.spacing, MODULUS)
        == math.inf
    )


def test_the_contact_time_is_the_width_over_the_speed():
    assert exposure().contact_time_share == pytest.approx(50.0 * 1e-4 / 2.0)
    assert exposure(speed=0.0).contact_time_share == 1.0
    assert exposure(speed=-2.0).depth_rate_factor(3e-4) == pytest.approx(50.0 * 3e-4 / 2.0)
    assert exposure(speed=0.0).depth_rate_factor(3e-4) == 1.0


def test_maps_are_returned_to_the_cells_of_their_tracks():
    rng = np.random.default_rng(2)
    contact = Grid((16, 12), (0.0, 0.0), (1.6, 1.2))
    track = Grid((40, 12), (0.0, 0.0), (4.0, 1.2), periodic=(True, True))
    first, second = (Surface(rng.normal(size=track.cells), track) for _ in range(2))
    surfaces = MovingSurfaces(first, second, (2.0, 1.5), contact)
    place = TrackPosition(33, 7)
    combined = combined_roughness(surfaces, place).heights
    i, j = 5, 3  # a cell of the contact, mapped to both tracks
    assert combined[i, j] == first.heights[(33 + i) % 40, j] + second.heights[(7 + i) % 40, 11 - j]
    marked = np.zeros(contact.cells)
    marked[i, j] = 1.0
    assert map_to_track(marked, track.cells, place, 0)[(33 + i) % 40, j] == 1.0
    assert map_to_track(marked, track.cells, place, 1)[(7 + i) % 40, 11 - j] == 1.0
    assert map_to_track(marked, track.cells, place, 0, np.inf).min() == 0.0
    moved = to_other_track(map_to_track(marked, track.cells, place, 0), place, 0)
    np.testing.assert_array_equal(moved, map_to_track(marked, track.cells, place, 1))
    np.testing.assert_array_equal(
        to_other_track(moved, place, 1), map_to_track(marked, track.cells, place, 0)
    )


def test_positions_are_evenly_spaced_and_differ_between_jumps():
    places = [positions((120, 120), (True, True), 6, jump, 5) for jump in range(40)]
    assert places[3] == positions((120, 120), (True, True), 6, 3, 5)
    assert places[3] != places[4]
    for body in (0, 1):
        for jump in places:
            spacings = np.diff(sorted(place[body] for place in jump))
            assert np.all(
                (spacings >= 19) & (spacings <= 21)
            )  # spacing of 120/6 cells, up to rounding
        starts = {place[body] for jump in places for place in jump}
        assert len(starts) > 100  # almost every cell has been a start
    paired = {(place.first // 20, place.second // 20) for jump in places for place in jump}
    assert len(paired) == 36  # each sixth of one track meets each sixth of the other
    assert {place.second for place in positions((120, 120), (True, False), 6, 0, 5)} == {0}
