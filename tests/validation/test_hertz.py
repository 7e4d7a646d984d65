"""The solved dry, smooth contact against Hertz."""

import numpy as np
import pytest

from asperity.contact.hertz import line_gap, line_pressure
from asperity.ehl import Options, solve_contact
from asperity.solution import contact_state
from asperity.surface import flat_surface
from support.paper import RADIUS, contact, grid

HERTZ = contact().hertz
A, P_H = HERTZ.half_widths[0], HERTZ.p_max


def solved(cells, **changes):
    return solve_contact(
        contact(**changes),
        None,
        flat_surface(grid((cells, 8), (-2.0, 2.0))),
        options=Options(tolerance=1e-6),
    )


@pytest.fixture(scope="module")
def fine():
    return solved(256)


def half_width(solution):
    """Zero of the straight line fitted to p^2 over x^2, without the cells at the edge."""
    x2, p2 = (solution.grid.x / A) ** 2, (solution.pressure[:, 0] / P_H) ** 2
    slope, height = np.polyfit(x2[x2 < 0.9], p2[x2 < 0.9], 1)
    return np.sqrt(-height / slope)


def test_pressure_and_half_width_agree_with_hertz_within_half_a_percent_at_256_cells(fine):
    assert fine.pressure.max() == pytest.approx(P_H, rel=2e-4)
    assert half_width(fine) == pytest.approx(1.0, rel=1e-4)
    touching = np.abs(fine.grid.x[fine.in_contact[:, 0]])
    assert touching.max() + fine.grid.spacing[0] / 2.0 == pytest.approx(A, abs=fine.grid.spacing[0])
    hertz = line_pressure(fine.grid.x, A, P_H)
    assert np.linalg.norm(fine.pressure[:, 0] - hertz) < 0.0025 * np.linalg.norm(hertz)


def test_the_gap_outside_agrees_with_hertz(fine):
    outside = np.abs(fine.grid.x) > 1.1 * A
    expected = line_gap(fine.grid.x, A, RADIUS)[outside]
    np.testing.assert_allclose(fine.gap[outside, 0], expected, atol=1e-4 * expected.max())
    np.testing.assert_allclose(fine.gap[fine.in_contact], 0.0, atol=1e-5 * A**2 / RADIUS)


def test_a_smooth_contact_is_uniform_and_symmetric(fine):
    np.testing.assert_allclose(
        fine.pressure, fine.pressure[:, :1] @ np.ones((1, 8)), atol=1e-6 * P_H
    )
    np.testing.assert_allclose(fine.pressure, fine.pressure[::-1], atol=1e-4 * P_H)


def test_the_largest_pressure_converges_at_second_order():
    errors = [abs(solved(cells).pressure.max() / P_H - 1.0) for cells in (64, 128, 256)]
    assert errors[1] < errors[0] / 3.0
    assert errors[2] < errors[1] / 3.0


def test_a_dry_smooth_contact_carries_all_load_on_all_of_its_area(fine):
    state = contact_state(fine)
    assert state.clr == pytest.approx(1.0, abs=1e-12)
    assert state.car == pytest.approx(1.0, abs=0.02)
    assert state.car_domain == pytest.approx(1.0, abs=0.02)
    assert abs(state.load_error) < 1e-6
    assert fine.pressure.mean() * fine.grid.extent[0] == pytest.approx(50e3, rel=1e-6)
    assert not fine.cavitated.any()


def test_a_cap_spreads_the_load():
    """p <= p_cap; with the cap reached, the load is met by a wider contact."""
    capped = solved(256, hardness=0.8 * P_H)
    assert capped.pressure.max() == pytest.approx(0.8 * P_H, rel=1e-12)
    assert capped.pressure.mean() * capped.grid.extent[0] == pytest.approx(50e3, rel=1e-6)
    assert np.ptp(capped.grid.x[capped.in_contact[:, 0]]) > 2.01 * A
