"""Zones of CAR and CLR against Hertz: area and place of lines, ellipses and rollers."""

import numpy as np
import pytest

from asperity.case import load_case
from asperity.case.templates import case_template
from asperity.contact.grid import Grid
from asperity.ehl import hertz_zone
from support.paper import contact


def grid_of(half_x, half_y, cells=(400, 360)):
    """Return a grid about the origin with these half sides."""
    return Grid(cells, (-half_x, -half_y), (half_x, half_y))


@pytest.mark.parametrize("share", [0.1, 0.5, 1.0])
def test_the_zone_of_a_line_is_a_strip(share):
    conditions = contact()
    a = conditions.hertz.half_widths[0]
    grid = grid_of(2.0 * a, 1e-3)
    zone = hertz_zone(conditions, grid, share)
    strip = np.abs(grid.x) <= share * a
    assert strip.sum() == pytest.approx(400 * share / 2.0, abs=1.0)
    np.testing.assert_array_equal(zone, np.repeat(strip[:, None], 360, axis=1))


@pytest.mark.parametrize("share", [0.1, 0.5, 1.0])
def test_the_zone_of_a_point_is_the_hertz_ellipse(share):
    conditions = load_case(case_template("elliptic"), name="elliptic.toml").conditions
    a, b = conditions.hertz.half_widths
    assert a / b < 0.9 or a / b > 1.1
    grid = grid_of(1.5 * a, 1.4 * b)
    zone = hertz_zone(conditions, grid, share)
    dx, dy = grid.spacing
    assert zone.sum() * dx * dy == pytest.approx(np.pi * a * b * share**2, rel=0.01)
    inside_x, inside_y = np.nonzero(zone)
    assert np.abs(grid.x[inside_x]).max() == pytest.approx(share * a, abs=dx)
    assert np.abs(grid.y[inside_y]).max() == pytest.approx(share * b, abs=dy)


@pytest.mark.parametrize("share", [0.1, 0.5, 1.0])
def test_the_zone_of_a_roller_follows_the_load_of_its_slices(share):
    """The half-width of a slice is that of a line contact with its load, √(q/q mean) a."""
    conditions = load_case(case_template("roller"), name="roller.toml").conditions
    a = conditions.hertz.half_widths[0]
    sliced = conditions.sliced_load
    low, high = sliced.ends
    grid = grid_of(2.0 * a, 0.6 * (high - low))
    zone = hertz_zone(conditions, grid, share)
    dx, dy = grid.spacing
    load = np.interp(grid.y, sliced.y, sliced.line_load / sliced.line_load.mean())
    loaded = np.abs(grid.y - 0.5 * (low + high)) <= 0.5 * share * (high - low) - dy
    half = share * a * np.sqrt(load[loaded])
    np.testing.assert_allclose(zone.sum(axis=0)[loaded] * dx, 2.0 * half, atol=2.0 * dx)
    beyond = np.abs(grid.y - 0.5 * (low + high)) > 0.5 * share * (high - low) + dy
    assert not zone[:, beyond].any()


def test_the_central_cells_always_belong_to_a_zone():
    conditions = contact()
    a = conditions.hertz.half_widths[0]
    zone = hertz_zone(conditions, grid_of(40.0 * a, 1e-3, (10, 8)))
    assert zone.sum(axis=0).tolist() == [2] * 8
