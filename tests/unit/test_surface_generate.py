import numpy as np
import pytest

from asperity.contact.grid import Grid
from asperity.core.errors import BadInput
from asperity.surface import gaussian_surface, self_affine_surface


def grid(cells=(128, 128), side=400e-6):
    return Grid(cells, (0.0, 0.0), (side, side))


def seeded(seed):
    return np.random.default_rng(seed)


def test_the_sample_has_the_requested_sq_and_zero_mean():
    surface = gaussian_surface(grid(), sq=0.7e-6, correlation_length=20e-6, rng=seeded(1))
    assert surface.sq == pytest.approx(0.7e-6, rel=1e-12)
    assert abs(surface.heights.mean()) < 1e-12 * surface.sq


def test_sq_only_scales_the_surface_of_a_seed():
    low, high = (
        gaussian_surface(grid(), sq=sq, correlation_length=20e-6, rng=seeded(7))
        for sq in (0.5e-6, 4e-6)
    )
    np.testing.assert_allclose(high.heights, 8.0 * low.heights, rtol=1e-12)


def test_seeds_are_reproducible_and_differ():
    first, repeated, other = (
        gaussian_surface(grid(), sq=1e-6, correlation_length=(30e-6, 15e-6), rng=seeded(s))
        for s in (3, 3, 4)
    )
    np.testing.assert_array_equal(first.heights, repeated.heights)
    assert abs(np.corrcoef(first.heights.ravel(), other.heights.ravel())[0, 1]) < 0.3


@pytest.mark.parametrize(
    "make",
    [
        lambda g: gaussian_surface(g, sq=1e-6, correlation_length=25e-6, rng=seeded(5)),
        lambda g: self_affine_surface(
            g, sq=1e-6, hurst=0.8, cutoffs=(20e-6, 200e-6), rng=seeded(5)
        ),
    ],
)
def test_a_finer_grid_shows_the_same_physical_surface(make):
    coarse, fine = make(grid((64, 64))), make(grid((192, 192)))
    # the middle of three fine cells is centred in the coarse cell
    np.testing.assert_allclose(
        fine.heights[1::3, 1::3], coarse.heights, atol=1e-9 * 1e-6 + 1e-6 * 1e-6
    )


@pytest.mark.parametrize(
    ("length", "message"),
    [(1.9 * 400e-6 / 128, "at least 2 cells"), (201e-6, "half the domain"), (-1e-6, "positive")],
)
def test_a_correlation_length_that_the_grid_cannot_represent_is_refused(length, message):
    with pytest.raises(BadInput, match=message):
        gaussian_surface(grid(), sq=1e-6, correlation_length=(20e-6, length), rng=seeded(1))


@pytest.mark.parametrize(
    ("hurst", "cutoffs"),
    [(0.0, (20e-6, 200e-6)), (1.2, (20e-6, 200e-6)), (0.8, (200e-6, 20e-6)), (0.8, (1e-6, 1e-4))],
)
def test_a_power_law_that_the_grid_cannot_represent_is_refused(hurst, cutoffs):
    with pytest.raises(BadInput):
        self_affine_surface(grid(), sq=1e-6, hurst=hurst, cutoffs=cutoffs, rng=seeded(1))


def test_zero_roughness_is_refused():
    with pytest.raises(BadInput, match="sq must be positive"):
        gaussian_surface(grid(), sq=0.0, correlation_length=20e-6, rng=seeded(1))
