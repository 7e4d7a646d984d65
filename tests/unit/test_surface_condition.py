import numpy as np
import pytest

from asperity.contact.grid import Grid
from asperity.core.errors import BadInput
from asperity.surface import (
    MeasuredSurface,
    SurfaceConditioning,
    condition_surface,
    gaussian_surface,
    level,
)


def measured(heights, pixel=1e-6, uniform=None):
    half = tuple(n * pixel / 2.0 for n in heights.shape)
    grid = Grid(heights.shape, tuple(-h for h in half), half, periodic=(False, False))
    return MeasuredSurface(heights, grid, "map.x3p", "x3p", uniform=uniform)


def rough(cells=(160, 120), length=6e-6, seed=3):
    grid = Grid(cells, (0.0, 0.0), (cells[0] * 1e-6, cells[1] * 1e-6))
    return gaussian_surface(
        grid, sq=1e-6, correlation_length=length, rng=np.random.default_rng(seed)
    ).heights


def wave(cells, wavelength, axis=0):
    x = np.arange(cells[axis]) * 1e-6
    z = 1e-6 * np.cos(2.0 * np.pi * x / wavelength)
    return z[:, None] * np.ones(cells[1]) if axis == 0 else np.ones(cells[0])[:, None] * z


@pytest.mark.parametrize("hollow", [False, True])
@pytest.mark.parametrize(("angle", "tilt"), [(0.0, 0.0), (0.7, 0.1), (1.5, -0.2)])
def test_removing_a_cylinder_of_any_axis_leaves_no_residual(hollow, angle, tilt):
    grid = measured(np.zeros((120, 90))).grid
    x, y = np.meshgrid(grid.x, grid.y, indexing="ij")
    across, along = (
        x * np.cos(angle) + y * np.sin(angle) - 9e-6,
        y * np.cos(angle) - x * np.sin(angle),
    )
    # points at a constant distance from the axis: z of the circle, stretched by the tilt
    heights = tilt * along + np.sqrt(1.0 + tilt**2) * np.sqrt((150e-6) ** 2 - across**2)
    heights[20:30, 40:60] = np.nan
    levelled, step = level(measured(-heights if hollow else heights), "cylinder")
    assert np.nanmax(np.abs(levelled.heights)) < 1e-12
    assert "150 um radius" in step
    assert ("hollow" in step) == hollow


def test_a_circle_is_removed_from_a_profile():
    x = (np.arange(400) - 199.5)[:, None] * np.ones(8) * 1e-6
    levelled, step = level(measured(np.sqrt((5e-3) ** 2 - (x - 30e-6) ** 2), uniform=1), "cylinder")
    assert np.max(np.abs(levelled.heights)) < 1e-12
    assert "5 mm radius" in step


@pytest.mark.parametrize(
    ("form", "degree"), [("plane", 1), ("quadratic", 2), ("cubic", 3), ("quartic", 4)]
)
def test_a_polynomial_form_removes_terms_up_to_its_degree_only(form, degree):
    x, y = np.meshgrid(np.linspace(-1, 1, 60), np.linspace(-1, 1, 50), indexing="ij")
    polynomial = 1e-6 * (x + y) ** degree
    assert level(measured(polynomial), form)[0].sq < 1e-18
    assert level(measured(1e-6 * x ** (degree + 1)), form)[0].sq > 1e-8


@pytest.mark.parametrize(
    ("wavelength", "passed"), [(10e-6, 0.5 ** (2.0**2)), (20e-6, 0.5), (60e-6, 0.5 ** (1 / 9))]
)
@pytest.mark.parametrize("axis", [0, 1])
def test_the_filters_transmit_as_in_iso_16610(wavelength, passed, axis):
    """The S-filter transmits exp(-ln 2 (cut-off/wavelength)^2), the L-filter the rest of 1."""
    z = wave((600, 600), wavelength, axis)
    short, _ = condition_surface(measured(z), SurfaceConditioning(form="none", s_filter=20e-6))
    long, _ = condition_surface(measured(z), SurfaceConditioning(form="none", l_filter=20e-6))
    middle = (slice(100, -100), slice(100, -100))
    assert np.ptp(short.heights[middle]) / 2e-6 == pytest.approx(passed, abs=1e-3)
    assert np.ptp(long.heights[middle]) / 2e-6 == pytest.approx(1.0 - passed, abs=1e-3)


def test_the_filters_leave_missing_cells_missing_and_a_plateau_flat():
    z = np.full((80, 60), 1e-6)
    z[20:30, 10:40] = np.nan
    filtered, _ = condition_surface(measured(z), SurfaceConditioning(form="none", s_filter=15e-6))
    np.testing.assert_array_equal(np.isnan(filtered.heights), np.isnan(z))
    assert np.nanmax(np.abs(filtered.heights)) < 1e-18


def test_outliers_are_reported_and_removed_on_request():
    z = rough()
    z[[30, 70, 100], [20, 50, 90]] += 30e-6
    unchanged, steps = condition_surface(measured(z))
    assert unchanged.missing == 0.0
    assert steps[0].startswith("kept 3 heights")
    cleaned, steps = condition_surface(measured(z), SurfaceConditioning(outliers="remove"))
    assert steps[0].startswith("removed 3 outliers")
    assert np.isnan(cleaned.heights[[30, 70, 100], [20, 50, 90]]).all()
    assert np.count_nonzero(np.isnan(cleaned.heights)) == 3


def test_a_rough_surface_has_no_outliers():
    assert len(condition_surface(measured(rough()))[1]) == 1


def test_a_quarter_turn_maps_x_to_y():
    z = rough()
    turned = measured(z).turned()
    assert turned.grid.cells == (120, 160)
    # counter-clockwise: the point (x, y) moves to (-y, x)
    i, j = 100, 30
    x, y = measured(z).grid.x[i], measured(z).grid.y[j]
    indices = (np.argmin(np.abs(turned.grid.x + y)), np.argmin(np.abs(turned.grid.y - x)))
    assert turned.heights[indices] == z[i, j]
    restored = turned.turned().turned().turned()
    np.testing.assert_array_equal(restored.heights, z)
    assert (
        "turned the map by 90 degrees"
        in condition_surface(measured(z), SurfaceConditioning(turn=True))[1][0]
    )


def test_a_turned_profile_is_constant_along_x():
    z = rough()[:, :1] * np.ones(8)
    turned = measured(z, uniform=1).turned()
    assert turned.uniform == 0
    np.testing.assert_array_equal(turned.profile, z[:, 0])


def test_too_few_heights_for_a_form_are_refused():
    z = np.full((20, 20), np.nan)
    z[0, :5] = 1e-6
    with pytest.raises(BadInput, match="too few valid heights"):
        level(measured(z), "quadratic")
