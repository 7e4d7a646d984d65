"""Ploughing: volume and mean square of a mark, cut and piled-up material, roughness."""

from dataclasses import replace

import numpy as np
import pytest

from asperity import BadInput
from asperity.contact.grid import Grid
from asperity.wear.debris import Ploughing, WearMark, add_mark, drag_length
from support.passages import hertz_patches, passage, track

FINE = Grid((800, 400), (-100e-6, -50e-6), (100e-6, 50e-6), (False, True))


@pytest.mark.parametrize("length", [0.0, 60e-6])
@pytest.mark.parametrize("cutting", [0.0, 0.3, 1.0])
def test_volume_and_square_of_a_mark_are_the_closed_forms(length, cutting):
    mark = WearMark.with_ridge(length, 12e-6, 1e-6, cutting)
    groove, ridge = mark.heights(FINE.x[:, None], FINE.y[None, :])
    cell = float(np.prod(FINE.spacing))
    assert groove.sum() * cell == pytest.approx(mark.dug, rel=2e-3, abs=0.0)
    assert ridge.sum() * cell == pytest.approx(mark.piled, rel=2e-3, abs=1e-30)
    assert np.square(groove - ridge).sum() * cell == pytest.approx(mark.square, rel=2e-3, abs=0.0)
    assert mark.piled == pytest.approx((1.0 - cutting) * mark.dug, rel=1e-12, abs=1e-30)


def test_a_groove_is_two_thirds_of_width_times_depth_across():
    mark = WearMark.with_ridge(60e-6, 12e-6, 1e-6, 1.0)
    across, _ = mark.heights(np.zeros(1), FINE.y)
    assert np.trapezoid(across, FINE.y) == pytest.approx(
        2.0 / 3.0 * 12e-6 * 1e-6, rel=1e-3, abs=0.0
    )
    assert across.max() == pytest.approx(1e-6, rel=1e-3, abs=0.0)


def test_the_volume_of_a_mark_does_not_depend_on_the_grid():
    """Cells store the mean depth: the volume is independent of position even for marks one cell
    wide.
    """
    grid = track((64, 32))
    mark = WearMark.with_ridge(30e-6, 6e-6, 0.5e-6, 0.3)
    rng = np.random.default_rng(2)
    for _ in range(20):
        dug, piled = np.zeros(grid.cells), np.zeros(grid.cells)
        add_mark(dug, piled, mark, tuple(rng.uniform(grid.lower, grid.upper)), grid)
        assert dug.sum() * np.prod(grid.spacing) == pytest.approx(mark.dug, rel=0.1, abs=0.0)
        assert piled.sum() * np.prod(grid.spacing) == pytest.approx(mark.piled, rel=0.1, abs=0.0)


def ploughed(cutting, seed=0, concentration=1e14):
    grid = track((96, 48))
    ploughing = Ploughing(
        concentration=concentration, smallest=8e-6, largest=20e-6, cutting=cutting, sinking=0.2
    )
    patches = hertz_patches(grid, 50e-6, 1e9, 4)
    jump = passage(grid, patches, jump=20.0, rng=np.random.default_rng(seed))
    return ploughing, jump, ploughing(jump)


@pytest.mark.parametrize("cutting", [0.0, 0.3, 1.0])
def test_displaced_material_is_conserved_to_rounding(cutting):
    _, jump, change = ploughed(cutting)
    cell = float(np.prod(jump.grid.spacing))
    assert change.facts["marks"] > 10
    removed = -change.heights_change.sum() * cell
    dug = change.facts["volume_m3"]
    assert removed == pytest.approx(cutting * dug, abs=1e-12 * dug)


def test_the_number_of_particles_follows_the_concentration():
    _, jump, _ = ploughed(0.3)
    film = jump.loaded_film
    assert film == pytest.approx(0.5e-6, rel=1e-9, abs=0.0)
    expected = 1e14 * film * 20.0 * 400e-6 * 200e-6
    counts = [ploughed(0.3, seed)[2].facts["marks"] for seed in range(40)]
    assert np.mean(counts) == pytest.approx(expected, abs=4.0 * np.sqrt(expected / 40))


def test_a_ball_is_marked_only_on_its_track():
    """Off the track no particle is pressed in; the number of marks follows the track's area."""
    expected = 1e14 * 0.5e-6 * 20.0 * 400e-6 * 100e-6
    for cells, width in ((48, 200e-6), (96, 400e-6)):
        grid = Grid((96, cells), (-200e-6, -0.5 * width), (200e-6, 0.5 * width), (False, False))
        wide = hertz_patches(grid, 50e-6, 1e9, 4)
        round_ones = [
            replace(
                patch,
                pressure=patch.pressure * np.sqrt(np.maximum(1.0 - (grid.y / 50e-6) ** 2, 0.0)),
            )
            for patch in wide
        ]
        ploughing = Ploughing(concentration=1e14, smallest=8e-6, largest=20e-6, sinking=0.2)
        marks = []
        for seed in range(10):
            change = ploughing(
                passage(grid, round_ones, jump=20.0, rng=np.random.default_rng(seed))
            )
            marks.append(change.facts["marks"])
            widest = ploughing.mark(20e-6, 0.5e-6, passage(grid, round_ones)).reach
            assert not change.heights_change[
                :, np.abs(grid.y) > 50e-6 + widest + grid.spacing[1]
            ].any()
        assert np.mean(marks) == pytest.approx(expected, abs=4.0 * np.sqrt(expected / 10))


def test_a_jump_contains_at_least_one_mark():
    """Even for a smooth body and a thin film: shorter jumps would contain no mark and never end."""
    grid = track()
    ploughing = Ploughing(concentration=1e9, smallest=8e-6, largest=20e-6)
    jump = passage(grid, hertz_patches(grid, 50e-6, 1e9, 4, film=1e-10), jump=1.0)
    time_of_one_mark = 1.0 / (1e9 * 1e-10 * 400e-6 * 200e-6)
    assert ploughing(jump).longest == pytest.approx(time_of_one_mark, rel=1e-9, abs=0.0)


def test_particle_sizes_follow_the_power_law():
    ploughing = Ploughing(concentration=1e9, smallest=4e-6, largest=40e-6, exponent=3.0)
    sizes = ploughing.sizes((np.arange(20_000) + 0.5) / 20_000)
    assert sizes.min() == pytest.approx(4e-6, rel=1e-3, abs=0.0)
    assert sizes.max() < 40e-6
    for size in (6e-6, 10e-6, 20e-6):
        more = (size**-3.0 - 40e-6**-3.0) / (4e-6**-3.0 - 40e-6**-3.0)
        assert np.mean(sizes > size) == pytest.approx(more, abs=1e-4)


def test_particles_thinner_than_the_film_pass_through():
    grid = track()
    ploughing = Ploughing(concentration=1e14, smallest=1e-6, largest=2e-6)
    change = ploughing(passage(grid, hertz_patches(grid, 50e-6, 1e9, 4, film=3e-6), jump=10.0))
    assert change.facts["marks"] == 0.0
    assert not change.heights_change.any()


def test_roughness_of_many_marks_follows_campbells_theorem():
    """Shot noise of equal marks: mean and variance are density times the integral of mark and
    square.
    """
    grid = track((128, 64))
    cutting, density = 0.4, 60.0 / float(np.prod(grid.extent))
    mark = WearMark.with_ridge(25e-6, 20e-6, 1e-6, cutting)
    rng = np.random.default_rng(7)
    means, squares = [], []
    for _ in range(150):
        dug, piled = np.zeros(grid.cells), np.zeros(grid.cells)
        for place in rng.uniform(grid.lower, grid.upper, size=(rng.poisson(60.0), 2)):
            add_mark(dug, piled, mark, tuple(place), grid)
        heights = piled - dug
        means.append(heights.mean())
        squares.append(np.mean(np.square(heights)))
    mean = -density * cutting * mark.dug
    variance = density * mark.square
    assert np.mean(means) == pytest.approx(mean, rel=0.04, abs=0.0)
    assert np.mean(squares) - np.mean(means) ** 2 - np.var(means) == pytest.approx(
        variance - np.var(means), rel=0.05, abs=0.0
    )


def test_the_next_jump_limits_the_rise_of_sq():
    """Campbell's theorem: Sq squared rises by a tenth, for marks of nearly one size."""
    grid = track()
    ploughing = Ploughing(concentration=1e12, smallest=10e-6, largest=10.001e-6)
    waves = 1e-6 * np.cos(0.2 * np.arange(64.0))[:, None] + np.zeros(grid.cells)
    jump = passage(grid, hertz_patches(grid, 50e-6, 1e9, 4), jump=1e-6, heights=waves)
    mark = ploughing.mark(10e-6, 0.5e-6, jump)
    assert ploughing(jump).longest == pytest.approx(
        0.1 * np.var(waves) / (1e12 * 0.5e-6 * mark.square), rel=1e-3
    )
    smooth = ploughing(
        replace(jump, heights=1e-13 * waves)
    ).longest  # finite: a smooth body counts as rough as the film is thick
    assert smooth == pytest.approx(
        0.1 * 0.25e-12 / (1e12 * 0.5e-6 * mark.square), rel=1e-3, abs=0.0
    )
    thick_film = hertz_patches(grid, 50e-6, 1e9, 4, film=20e-6)
    assert ploughing(replace(jump, patches=thick_film)).longest == np.inf


def test_without_sliding_a_mark_is_a_dent():
    grid = track()
    patches = hertz_patches(grid, 50e-6, 1e9, 2)
    assert drag_length(passage(grid, patches, sliding_speed=0.0)) == 0.0
    assert drag_length(passage(grid, patches, sliding_speed=0.4)) == pytest.approx(
        2 * 50e-6 * 0.4 / 1.6, rel=1e-9, abs=0.0
    )


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        ({"concentration": 0.0}, "ploughing concentration must be positive"),
        ({"concentration": 1e9, "cutting": 1.2}, "ploughing cutting must lie between 0 and 1"),
        ({"concentration": 1e9, "sinking": 0.7}, r"ploughing sinking must lie between 0 and 0\.5"),
        ({"concentration": 1e9, "largest": 1e-6}, "ploughing largest must exceed smallest"),
    ],
)
def test_invalid_ploughing_parameters_are_refused(wrong, message):
    with pytest.raises(BadInput, match=message):
        Ploughing(**wrong)


def test_too_many_marks_are_refused_before_the_computation():
    with pytest.raises(BadInput, match="marks in one jump"):
        ploughed(0.3, concentration=1e22)
