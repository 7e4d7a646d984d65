"""Hertz's closed forms against independent relations, to 1e-12."""

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.special import elliprd, elliprf

from asperity.contact.hertz import (
    elliptic_contact,
    line_contact,
    line_gap,
    line_pressure,
    point_compression,
    point_contact,
    point_stiffness,
)

LOAD, RADIUS, LENGTH, MODULUS = 200.0, 5.4e-3, 0.01, 113.74e9


def test_line_pressure_carries_the_load_and_flattens_the_curve():
    """p = p_h sqrt(1 - X^2) integrates to the load; inside, deflection has curvature p_h 2/(E* a) =
    1/R.
    """
    hertz = line_contact(LOAD, LENGTH, RADIUS, MODULUS)
    a, p_h = hertz.half_widths[0], hertz.p_max
    angle = (np.arange(40) + 0.5) * np.pi / 40.0  # Chebyshev nodes integrate sqrt(1 - X^2) exactly
    total_load = np.sum(line_pressure(a * np.cos(angle), a, p_h) * np.sin(angle)) * a * np.pi / 40.0
    assert total_load * LENGTH == pytest.approx(LOAD, rel=1e-12)
    assert 2.0 * p_h / (MODULUS * a) == pytest.approx(1.0 / RADIUS, rel=1e-12)
    assert hertz.p_mean * hertz.area == pytest.approx(LOAD, rel=1e-12)
    assert hertz.approach is None


def test_line_pressure_ends_at_the_half_width():
    np.testing.assert_array_equal(
        line_pressure(np.array([-2.0, -1.0, 0.0, 1.0, 5.0]), 1.0, 3.0), [0, 0, 3, 0, 0]
    )


@pytest.mark.parametrize("x", [1.0001, 1.3, -2.0, 6.0])
def test_line_gap_equals_the_deflected_parabola(x):
    """h = x^2/2 - (1/pi) int P ln|(x - s)/(1 - s)| ds - 1/2, with s = cos(t), in units of a and
    a^2/R.
    """

    def displaced(t):
        return np.sin(t) ** 2 * np.log(np.abs((x - np.cos(t)) / (1.0 - np.cos(t))))

    integral, _ = quad(displaced, 0.0, np.pi, epsabs=1e-13, epsrel=1e-13, limit=400)
    assert line_gap(np.array([3.0 * x]), 3.0, 9.0)[0] == pytest.approx(
        x**2 / 2.0 - 0.5 - integral / np.pi, abs=1e-11
    )
    assert line_gap(np.array([0.3]), 3.0, 9.0)[0] == 0.0


def test_line_gap_is_the_integral_of_its_slope():
    """dh/dX = sqrt(X^2 - 1) a^2/R, integrated numerically."""
    x = np.array([1.0 + 1e-6, 1.5, 4.0])
    expected = [
        quad(lambda s: np.sqrt((s - 1.0) * (s + 1.0)), 1.0, end, epsrel=1e-13, epsabs=0.0)[0]
        for end in x
    ]
    np.testing.assert_allclose(line_gap(x, 1.0, 1.0), expected, rtol=1e-12, atol=1e-15)


def test_point_contact_is_johnsons():
    """p0 = (6 F E*^2 / (pi^3 R^2))^(1/3) and approach (9 F^2 / (16 R E*^2))^(1/3): Johnson eqs
    4.23, 4.24.
    """
    hertz = point_contact(LOAD, RADIUS, MODULUS)
    assert hertz.p_max == pytest.approx(
        (6.0 * LOAD * MODULUS**2 / (np.pi**3 * RADIUS**2)) ** (1 / 3), rel=1e-12
    )
    assert hertz.approach == pytest.approx(
        (9.0 * LOAD**2 / (16.0 * RADIUS * MODULUS**2)) ** (1 / 3), rel=1e-12
    )
    a = hertz.half_widths[0]
    total_load, _ = quad(
        lambda c: 2.0 * np.pi * a**2 * hertz.p_max * c**2, 0.0, 1.0
    )  # c = sqrt(1 - r^2/a^2)
    assert total_load == pytest.approx(LOAD, rel=1e-12)
    assert hertz.p_mean * hertz.area == pytest.approx(LOAD, rel=1e-12)


def test_point_stiffness_is_the_derivative_of_the_force():
    z = point_compression(LOAD, RADIUS, MODULUS)
    force = 4.0 / 3.0 * MODULUS * np.sqrt(RADIUS) * (z + 1e-30j) ** 1.5
    assert force.real == pytest.approx(LOAD, rel=1e-12)
    assert point_stiffness(LOAD, RADIUS, MODULUS) == pytest.approx(force.imag / 1e-30, rel=1e-12)
    a = point_contact(LOAD, RADIUS, MODULUS).half_widths[0]
    assert point_stiffness(LOAD, RADIUS, MODULUS) == pytest.approx(2.0 * MODULUS * a, rel=1e-12)


def test_the_papers_contact_at_200_n():
    """physics.md section 4: z0 = 6.855 um, S0 = 4.3765e7 N/m at E* = 113.74 GPa."""
    assert point_compression(LOAD, RADIUS, MODULUS) == pytest.approx(6.855e-6, rel=1e-4)
    assert point_stiffness(LOAD, RADIUS, MODULUS) == pytest.approx(4.3765e7, rel=1e-4)


@pytest.mark.parametrize("ratio", [1.0, 1.0001, 1.1, 2.0, 10.0, 1e3])
@pytest.mark.parametrize("swapped", [False, True])
def test_elliptic_contact_matches_both_curvatures(ratio, swapped):
    """The pressure ellipsoid p0 on semi-axes a, b displaces by (L - M x^2 - N y^2)/(pi E*).

    Johnson eq 3.29, with L, M and N as Carlson integrals: M/(pi E*) = 1/(2 Rx), N/(pi E*) = 1/(2
    Ry) and L/(pi E*) is the approach.
    """
    radii = (RADIUS, RADIUS * ratio) if not swapped else (RADIUS * ratio, RADIUS)
    hertz = elliptic_contact(LOAD, radii, MODULUS)
    a, b = hertz.half_widths
    strength = np.pi * hertz.p_max * a * b / 2.0
    m, n = 2.0 / 3.0 * elliprd(0.0, b**2, a**2), 2.0 / 3.0 * elliprd(0.0, a**2, b**2)
    assert strength * m / (np.pi * MODULUS) == pytest.approx(0.5 / radii[0], rel=1e-12)
    assert strength * n / (np.pi * MODULUS) == pytest.approx(0.5 / radii[1], rel=1e-12)
    assert strength * 2.0 * elliprf(0.0, a**2, b**2) / (np.pi * MODULUS) == pytest.approx(
        hertz.approach, rel=1e-12
    )
    assert 2.0 / 3.0 * np.pi * a * b * hertz.p_max == pytest.approx(LOAD, rel=1e-12)
    assert hertz.p_mean * hertz.area == pytest.approx(LOAD, rel=1e-12)


def test_a_contact_of_nanometres_scales_geometrically():
    """Lengths scale with R if the load scales with R^2; pressures are unchanged."""
    tip, ring = (
        elliptic_contact(1e-9, (5e-9, 10e-9), MODULUS),
        elliptic_contact(1e3, (5e-3, 10e-3), MODULUS),
    )
    assert tip.half_widths == pytest.approx([1e-6 * width for width in ring.half_widths], rel=1e-12)
    assert tip.p_max == pytest.approx(ring.p_max, rel=1e-12)


@pytest.mark.parametrize("excess", [1e-13, 1e-11, 1e-9, 1e-6])
def test_nearly_equal_radii_approach_a_ball(excess):
    ball = point_contact(LOAD, RADIUS, MODULUS)
    nearly = elliptic_contact(LOAD, (RADIUS, RADIUS * (1.0 + excess)), MODULUS)
    assert nearly.p_max == pytest.approx(ball.p_max, rel=excess + 1e-12)
    assert nearly.half_widths == pytest.approx(ball.half_widths, rel=excess + 1e-12)
