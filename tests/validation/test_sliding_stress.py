"""Stresses below known pressures against closed forms; Hertz's pressure is sampled on the grid."""

import numpy as np
import pytest
from scipy.optimize import minimize

from asperity.contact.grid import Grid
from asperity.contact.hertz import line_pressure
from asperity.solution import SubsurfaceStress
from asperity.solution.stress import stress_below
from support import sliding

NU = 0.3
DEPTHS = np.concatenate([[0.0], np.geomspace(0.01, 2.5, 15)])


def below_line(friction: float, cells: int = 256) -> SubsurfaceStress:
    grid = Grid((cells, 8), (-2.0, -1.6), (2.0, 1.6))
    pressure = np.repeat(line_pressure(grid.x, 1.0, 1.0)[:, None], 8, axis=1)
    return stress_below(
        pressure, friction * pressure if friction else None, grid, DEPTHS, poisson_ratio=NU
    )


def below_point(friction: float, cells: int = 128) -> SubsurfaceStress:
    grid = Grid((cells, cells), (-1.6, -1.6), (1.6, 1.6), (False, False))
    pressure = np.sqrt(np.maximum(1.0 - grid.x[:, None] ** 2 - grid.y**2, 0.0))
    return stress_below(
        pressure, friction * pressure if friction else None, grid, DEPTHS, poisson_ratio=NU
    )


def von_mises(xx, yy, zz, xy, yz, xz):
    apart = (xx - yy) ** 2 + (yy - zz) ** 2 + (zz - xx) ** 2
    return np.sqrt(apart / 2.0 + 3.0 * (xy**2 + yz**2 + xz**2))


def test_the_largest_stresses_below_a_line_contact_agree_with_textbooks():
    """0.300 p_h in shear at 0.786 a, von Mises 0.558 p_h at 0.704 a (Johnson, section 4.2; plane
    strain, nu = 0.3).
    """
    stress = below_line(0.0)
    assert stress.shear_peak.value == pytest.approx(0.300, rel=0.002)
    assert stress.shear_peak.depth == pytest.approx(0.786, rel=0.01)
    assert stress.peak.value == pytest.approx(0.558, rel=0.002)
    assert stress.peak.depth == pytest.approx(0.704, rel=0.01)


def test_the_largest_stress_below_a_point_contact_agrees_with_textbooks():
    """Von Mises 0.62 p_h at 0.48 a, on the axis; the shear stress is half of it (Johnson, section
    4.2).
    """
    stress = below_point(0.0)
    assert stress.peak.value == pytest.approx(0.62, rel=0.002)
    assert stress.peak.depth == pytest.approx(0.48, rel=0.01)
    assert stress.shear_peak.value == pytest.approx(0.31, rel=0.002)


def mcewen_peak(friction: float) -> tuple[float, float]:
    """Return the largest von Mises stress below a sliding line contact and its depth, from the
    closed form.
    """

    def negative(place):
        xx, yy, zz, xz = sliding.line(place[0], np.abs(place[1]), friction, NU)
        return -float(von_mises(xx, yy, zz, 0.0, 0.0, xz))

    starts = [(x, z) for x in (-0.6, 0.2, 0.6) for z in (1e-3, 0.3, 0.7)]
    best = min(
        (minimize(negative, start, method="Nelder-Mead") for start in starts),
        key=lambda found: found.fun,
    )
    return -best.fun, float(abs(best.x[1]))


@pytest.mark.parametrize("friction", [0.1, 0.2, 0.3, 0.4])
def test_the_peak_below_a_sliding_line_contact_agrees_with_smith_and_liu(friction):
    """Its depth decreases from 0.67 a; it reaches the surface between f = 0.25 and 0.3."""
    value, depth = mcewen_peak(friction)
    peak = below_line(friction).peak
    assert peak.value == pytest.approx(value, rel=0.003)
    assert peak.depth == pytest.approx(depth, rel=0.03, abs=0.005)


@pytest.mark.parametrize("friction", [0.0, 0.25])
def test_the_whole_tensor_below_a_sliding_line_contact(friction):
    stress = below_line(friction)
    for depth in (0.06, 0.3, 0.786, 2.0):
        found = stress.tensor_at(depth)
        xx, yy, zz, xz = sliding.line(stress.grid.x, depth, friction, NU)
        # in p_h; limited by the square root at the edge of the pressure
        tolerance = 0.005 if depth < 0.1 else 0.0012
        for name, expected in (("xx", xx), ("yy", yy), ("zz", zz), ("xz", xz)):
            np.testing.assert_allclose(
                getattr(found, name)[:, 3], expected, atol=tolerance, err_msg=name
            )
        assert max(np.abs(found.xy).max(), np.abs(found.yz).max()) < 1e-6


@pytest.mark.parametrize("friction", [0.0, 0.25])
def test_the_whole_tensor_below_a_sliding_ball(friction):
    """Hamilton's case, against point loads summed over the disc."""
    stress = below_point(friction)
    i, j = np.arange(5, 128, 9), np.arange(3, 128, 10)
    x, y = np.meshgrid(stress.grid.x[i], stress.grid.y[j], indexing="ij")
    for depth in (0.12, 0.48, 1.5):
        found = stress.tensor_at(depth)
        expected = sliding.point(x, y, np.full(x.shape, depth), friction, NU)
        for name, values in zip(("xx", "yy", "zz", "xy", "yz", "xz"), expected, strict=True):
            np.testing.assert_allclose(
                getattr(found, name)[np.ix_(i, j)], values, atol=3e-3, err_msg=name
            )


@pytest.mark.parametrize("friction", [0.1, 0.2])
def test_the_peak_below_a_sliding_ball_agrees_with_hamilton(friction):
    x, z = np.meshgrid(np.linspace(0.0, 0.4, 41), np.linspace(0.4, 0.52, 25), indexing="ij")
    stresses = von_mises(*sliding.point(x, 0.0 * x, z, friction, NU, radial=30, around=40))
    peak = below_point(friction).peak
    assert peak.value == pytest.approx(stresses.max(), rel=0.002)
    assert peak.depth == pytest.approx(z.flat[stresses.argmax()], rel=0.02)


def test_the_summed_point_loads_agree_with_the_closed_form_on_the_axis():
    """Shear on the axis of a sliding ball: sigma_xz/q = -1 + 3/2 z atan(1/z) - z^2/(2 (1 + z^2)),
    by point loads.
    """
    z = np.array([0.1, 0.5, 1.0])
    on_axis = (
        sliding.point(np.zeros(3), np.zeros(3), z, 1.0, NU)[5]
        - sliding.point(0 * z, 0 * z, z, 0.0, NU)[5]
    )
    expected = -1.0 + 1.5 * z * np.arctan(1.0 / z) - 0.5 * z**2 / (1.0 + z**2)
    np.testing.assert_allclose(on_axis, expected, rtol=1e-6)


def test_surface_stresses_under_traction_agree_with_hamilton_and_goodman():
    """sigma_xx = -(4 + nu) pi q x/8, sigma_yy = -3 nu pi q x/8 inside the contact (J. Appl. Mech.
    33 (1966) 371).
    """
    grid = Grid((256, 256), (-1.2, -1.2), (1.2, 1.2), (False, False))
    radius = np.hypot(grid.x[:, None], grid.y)
    traction = np.sqrt(np.maximum(1.0 - radius**2, 0.0))
    surface = stress_below(
        0.0 * traction, traction, grid, np.array([0.0]), poisson_ratio=NU
    ).tensor_at(0.0)
    inside, x = radius < 0.7, np.broadcast_to(grid.x[:, None], grid.cells)
    for name, slope in (("xx", (4.0 + NU) * np.pi / 8.0), ("yy", 3.0 * NU * np.pi / 8.0)):
        expected = -slope * x[inside]
        np.testing.assert_allclose(
            getattr(surface, name)[inside], expected, atol=0.01 * np.abs(expected).max()
        )
