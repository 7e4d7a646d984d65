"""Transfer between grids: averages preserve means, interpolation preserves linear fields."""

import numpy as np
import pytest

from asperity.ehl.grid_transfer import average, interpolate


def centres(n):
    return (np.arange(n) + 0.5) / n


@pytest.mark.parametrize(
    "cells", [((8, 6), (4, 3)), ((9, 7), (5, 4)), ((257, 1), (129, 1)), ((6, 5), (6, 3))]
)
def test_averaging_preserves_the_mean_and_linear_fields(cells):
    fine, coarse = cells
    field = np.random.default_rng(1).standard_normal(fine)
    assert average(field, coarse).shape == coarse
    assert average(field, coarse).mean() == pytest.approx(field.mean(), rel=1e-12)
    line = np.broadcast_to(centres(fine[0])[:, None], fine)
    if fine[0] % coarse[0] == 0:  # a cell that straddles an edge breaks the slope
        np.testing.assert_allclose(
            average(line, coarse), np.broadcast_to(centres(coarse[0])[:, None], coarse)
        )


def test_two_by_two_cells_are_averaged():
    field = np.arange(24.0).reshape(4, 6)
    np.testing.assert_allclose(average(field, (2, 3)), field.reshape(2, 2, 3, 2).mean(axis=(1, 3)))


@pytest.mark.parametrize("cells", [((8, 6), (16, 12)), ((9, 5), (17, 9)), ((129, 1), (257, 1))])
def test_cubic_interpolation_preserves_cubics_and_periodic_fields(cells):
    coarse, fine = cells
    x, interpolated = (
        centres(fine[0]),
        interpolate(centres(coarse[0])[:, None] ** 3 * np.ones(coarse), fine, cubic=True),
    )
    inside = (x > centres(coarse[0])[1]) & (x < centres(coarse[0])[-2])
    np.testing.assert_allclose(
        interpolated[inside], (x**3)[inside, None] * np.ones(fine)[inside], atol=1e-12
    )
    waves = np.broadcast_to(np.cos(2.0 * np.pi * centres(64)), (4, 64))
    periodic = interpolate(waves, (4, 128), cubic=True)
    np.testing.assert_allclose(
        periodic, np.broadcast_to(np.cos(2.0 * np.pi * centres(128)), (4, 128)), atol=1e-5
    )


@pytest.mark.parametrize("cells", [((4, 3), (8, 6)), ((5, 4), (9, 7)), ((129, 1), (257, 1))])
def test_linear_interpolation_preserves_linear_and_periodic_fields(cells):
    coarse, fine = cells
    line = interpolate(np.broadcast_to(centres(coarse[0])[:, None], coarse), fine)
    inside = (centres(fine[0]) > centres(coarse[0])[0]) & (
        centres(fine[0]) < centres(coarse[0])[-1]
    )
    np.testing.assert_allclose(
        line[inside], np.broadcast_to(centres(fine[0])[inside, None], line[inside].shape)
    )
    np.testing.assert_allclose(interpolate(np.ones(coarse), fine), 1.0)
    shifted = np.random.default_rng(2).standard_normal(coarse)
    if fine[1] % coarse[1] == 0:
        step = fine[1] // coarse[1]
        shifted_result = interpolate(np.roll(shifted, 1, axis=1), fine)
        np.testing.assert_allclose(
            shifted_result, np.roll(interpolate(shifted, fine), step, axis=1)
        )
