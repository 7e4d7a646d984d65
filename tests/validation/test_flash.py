"""Flash temperature against closed forms of moving heat sources, heat balances and a dense
reference solution.
"""

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.special import k0e

from asperity.contact.hertz import line_pressure
from asperity.ehl import solve_contact
from asperity.lubricant import EyringShear, Solid, Thermal
from asperity.solution import flash_temperature, friction, friction_and_heat
from asperity.solution.flash import moving_source
from support.moving_heat import band, rectangle, rectangle_at_rest, tian_kennedy_square
from support.paper import barus, contact, grid, rough
from support.sampled import sampled

STEEL = Solid()
K, KAPPA = STEEL.conductivity, STEEL.diffusivity
B = 50e-6  # half-width of the sources [m]
INFINITE_LENGTH = 1e3  # m


def speed_at(peclet):
    """Sliding speed u = 2 κ Pe/b."""
    return 2.0 * KAPPA * peclet / B


def band_rise(peclet, across=32, cells=128):
    """Return the positions along x and the rise under a central band of `across` cells."""
    dx = 2.0 * B / across
    body = moving_source((cells, 8), (dx, dx), speed_at(peclet), STEEL, length=INFINITE_LENGTH)
    x = (np.arange(cells) + 0.5 - cells / 2) * dx
    heat = np.where(np.abs(x) < B, 1.0, 0.0)[:, None] * np.ones(8)
    return x, body(heat)[:, 3]


@pytest.mark.parametrize("peclet", [0.01, 0.3, -0.3, 5.0, -5.0, 100.0])
def test_a_band_source_agrees_with_jaeger(peclet):
    x, rise = band_rise(peclet)
    for cell in (30, 48, 55, 64, 79, 90):
        exact = band(x[cell], B, speed_at(peclet), K, KAPPA)
        assert rise[cell] == pytest.approx(exact, rel=1e-6, abs=1e-6 * rise.max())


def test_a_fast_band_agrees_with_blok():
    """T = 1.128 q sqrt(l/(k ρ c u)) at the trailing edge, the square root of the distance from the
    leading edge before it, zero ahead.
    """
    x, rise = band_rise(1e4)
    inside = np.abs(x) < B
    expected = 2.0 / K * np.sqrt(KAPPA * (x[inside] + B) / (np.pi * speed_at(1e4)))
    np.testing.assert_allclose(rise[inside][4:], expected[4:], rtol=0.02)
    np.testing.assert_allclose(rise[inside][0], expected[0], rtol=0.02)
    assert rise[inside][-1] == pytest.approx(
        1.128 * np.sqrt(2 * B / (K * STEEL.density * STEEL.heat_capacity * speed_at(1e4))), rel=0.02
    )
    assert np.all(rise[x < -B] < 1e-3 * rise.max())


def square_rise(peclet, across=32):
    dx = 2.0 * B / across
    body = moving_source((across, across), (dx, dx), speed_at(peclet), STEEL, length=None)
    return body(np.ones((across, across)))


def test_a_square_at_rest_agrees_with_the_closed_form():
    rise = square_rise(0.0, 33)  # the central cell lies at the square's centre
    assert rise[16, 16] == pytest.approx(rectangle_at_rest(B, B, K), rel=1e-4)
    assert rise[16, 16] == pytest.approx(1.122 * B / K, rel=1e-3)
    np.testing.assert_allclose(rise, rise.T, rtol=1e-9)


@pytest.mark.parametrize(
    ("peclet", "tolerance"), [(0.01, 0.02), (0.1, 0.02), (1.0, 0.06), (10.0, 0.06), (300.0, 0.02)]
)
def test_a_square_source_agrees_with_tian_and_kennedy(peclet, tolerance):
    """Within 2 % at both limits, and within the error of their fit between."""
    assert square_rise(peclet, 64).max() == pytest.approx(
        tian_kennedy_square(B, peclet, K), rel=tolerance
    )


@pytest.mark.parametrize("peclet", [0.05, 1.0, 10.0, -10.0, 300.0])
def test_a_square_source_agrees_with_quadrature(peclet):
    rise, middle = square_rise(peclet), (np.arange(32) + 0.5) * B / 16 - B
    for i, j in ((0, 0), (8, 3), (15, 15), (31, 16), (31, 0)):
        exact = rectangle(middle[i], middle[j], B, B, speed_at(peclet), K, KAPPA)
        assert rise[i, j] == pytest.approx(exact, rel=1e-4)


@pytest.mark.parametrize("speed", [1e-3, 0.1, 1.9, -2.1, 50.0, 1e3])
def test_few_panels_are_as_accurate_as_many(speed, monkeypatch):
    """Against the kernel in panels of half a cell throughout with many nodes."""
    source = (96, 16), (2e-6, 1e-6), speed, STEEL
    found = moving_source(*source, length=0.01).spectrum[0]
    monkeypatch.setattr("asperity.solution.flash.MAX_DRIFT", 0.0)
    monkeypatch.setattr("asperity.solution.flash.NODES", 16)
    expected = moving_source.__wrapped__(*source, length=0.01).spectrum[0]
    assert np.abs(found - expected).max() < 5e-5 * np.abs(expected).max()


def test_a_line_at_rest_uses_its_length():
    """An infinitely long line has no steady temperature."""
    dx = 2.0 * B / 33
    body = moving_source((33, 8), (dx, dx), 0.0, STEEL, length=0.01)
    assert body(np.ones((33, 8)))[16, 2] == pytest.approx(rectangle_at_rest(B, 0.005, K), rel=1e-4)


def test_periodicity_in_y_equals_many_copies():
    rng, n, dx = np.random.default_rng(2), 8, 5e-6
    heat = rng.random((16, n))
    periodic = moving_source((16, n), (dx, dx), 1.0, STEEL, length=INFINITE_LENGTH)(heat)
    copies = 25
    many = moving_source((16, n * copies), (dx, dx), 1.0, STEEL, length=None)(np.tile(heat, copies))
    middle = many[:, n * (copies // 2) : n * (copies // 2 + 1)]
    np.testing.assert_allclose(
        periodic - periodic.mean(), middle - middle.mean(), atol=2e-3 * np.ptp(periodic)
    )


def warm_contact(speeds, gap=0.5e-6, cells=(128, 8)):
    on = grid(cells, x=(-3.0, 3.0))
    a, p_h = contact().hertz.half_widths[0], contact().hertz.p_max
    conditions = contact(surface_speeds=speeds)
    pressure = line_pressure(on.x, a, p_h)[:, None] * np.ones(cells)
    gaps = np.where(np.abs(on.x) < a, gap, 1e-3)[:, None]
    return sampled(conditions, replace(barus(), friction=EyringShear(5e6)), on, pressure, gaps)


SPEEDS = [(2.101, 1.719), (1.719, 2.101), (3.8, 0.02), (5.0, -1.2), (4.0, 0.0)]


@pytest.mark.parametrize("speeds", SPEEDS)
def test_the_bodies_absorb_all_frictional_heat(speeds):
    """Heat flow through distant planes in both bodies, from their temperatures at depth."""
    solution = warm_contact(speeds)
    rubbing = friction(solution)
    heat = flash_temperature(solution, rubbing)
    assert heat.heat_1_w + heat.heat_2_w == pytest.approx(rubbing.power, rel=5e-3)
    x, dx = solution.grid.x, solution.grid.spacing[0]
    inputs = (heat.into_1[:, 0], heat.heat[:, 0] - heat.into_1[:, 0])
    carried = 0.0
    for speed, heat_in, surface in zip(
        speeds, inputs, (heat.surface_1, heat.surface_2), strict=True
    ):
        if abs(speed) < 0.1:
            carried += heat_in.sum() * dx  # at rest heat spreads in all directions
            continue
        plane = np.sign(speed) * 20.0 * abs(x[0])

        def rise(x_at, z, heat_in=heat_in, speed=speed):
            v, distance = speed / (2 * KAPPA), np.hypot(x_at - x, z)
            return (
                np.sum(
                    heat_in * np.exp(v * (x_at - x) - abs(v) * distance) * k0e(abs(v) * distance)
                )
                * dx
                / (np.pi * K)
            )

        def flow(z, speed=speed, plane=plane, rise=rise):
            step = 1e-7
            gradient = (rise(plane + step, z) - rise(plane - step, z)) / (2 * step)
            return np.sign(speed) * (K / KAPPA * speed * rise(plane, z) - K * gradient)

        depth = 12.0 * np.sqrt(KAPPA * abs(plane / speed))
        carried += quad(flow, 0.0, depth, epsrel=1e-6, limit=200)[0]
        between = 0.5 * (surface[90, 0] + surface[91, 0])
        assert between == pytest.approx(rise(x[90] + 0.5 * dx, 0.0), rel=0.03)
    assert carried * 0.01 == pytest.approx(rubbing.power, rel=5e-3)


@pytest.mark.parametrize("speeds", SPEEDS[:4])
def test_heat_partition_satisfies_the_coupled_equations(speeds):
    """q_1 = q/2 + k_f (T_2 - T_1)/h, q_2 = q/2 - k_f (T_2 - T_1)/h, with each temperature from its
    own body's heat.
    """
    solution = warm_contact(speeds)
    thermal = Thermal(bulk=(313.15, 330.0), solids=(STEEL, Solid(conductivity=9.0)))
    heat = flash_temperature(solution, thermal=thermal)
    transferred = thermal.oil_conductivity / solution.gap * (heat.surface_2 - heat.surface_1)
    size = np.abs(heat.heat).max()
    np.testing.assert_allclose(heat.into_1, heat.heat / 2.0 + transferred, atol=1e-4 * size)
    rise = moving_source(
        solution.grid.cells, solution.grid.spacing, speeds[1], thermal.solids[1], length=0.01
    )
    np.testing.assert_allclose(heat.surface_2, 16.85 + rise(heat.heat - heat.into_1), rtol=1e-9)
    across = (np.arange(100) + 0.5) / 100  # across the film: k_f T'' = -q/h
    bulge = (
        np.mean(across * (1.0 - across) / 2.0) * heat.heat * solution.gap / thermal.oil_conductivity
    )
    np.testing.assert_allclose(
        heat.film, (heat.surface_1 + heat.surface_2) / 2.0 + bulge, rtol=1e-4
    )


def test_heat_partition_agrees_with_a_dense_solution():
    """All cells of one line together, by numpy.linalg.solve; with touching cells and a film."""
    solution = warm_contact((3.0, 0.8), cells=(48, 8))
    touching = np.abs(solution.grid.x - 1e-5)[:, None] < 1.5e-5 * np.ones(8)
    gap = np.where(touching, 5e-9, solution.gap)
    solution = replace(solution, gap=gap, in_contact=touching)
    heat = flash_temperature(solution)
    responses = []
    for speed in (3.0, 0.8):
        body = moving_source((48, 8), solution.grid.spacing, speed, STEEL, length=0.01)
        responses.append(np.array([body(row[:, None] * np.ones(8))[:, 0] for row in np.eye(48)]).T)
    q, resistance = heat.heat[:, 0], gap[:, 0] / 0.14
    passed = np.linalg.solve(
        np.diag(resistance) + sum(responses), (responses[1] - responses[0]) @ q / 2.0
    )
    np.testing.assert_allclose(heat.into_1[:, 0], q / 2.0 + passed, atol=1e-4 * q.max())


def test_opposed_speeds_give_mirror_images():
    heat = flash_temperature(warm_contact((2.000001, -2.0)))
    np.testing.assert_allclose(
        heat.surface_1, heat.surface_2[::-1], rtol=1e-4, atol=1e-4 * heat.max_k
    )
    assert heat.surface_1.argmax() > heat.surface_2.argmax()


def test_a_thick_film_halves_the_heat_and_a_thin_one_equalises_the_temperatures():
    thick = flash_temperature(warm_contact((3.8, 0.02), gap=1e-3))
    np.testing.assert_allclose(thick.into_1, thick.heat / 2.0, atol=5e-3 * thick.heat.max())
    solution = warm_contact((3.8, 0.02), gap=1e-12)
    thin = flash_temperature(solution)
    inside = thin.heat > 0.5 * thin.heat.max()
    np.testing.assert_allclose(thin.surface_1[inside], thin.surface_2[inside], rtol=1e-3)
    assert thin.heat_1_w > 1.5 * thin.heat_2_w  # the faster body takes more


def test_pure_rolling_generates_no_heat():
    heat = flash_temperature(warm_contact((1.9, 1.9)))
    assert (heat.max_k, heat.film_max_k, heat.heat_1_w, heat.heat_2_w) == (0.0, 0.0, 0.0, 0.0)


def test_a_dry_rough_point_contact_has_equal_surface_temperatures():
    conditions = contact(
        geometry="point", length=None, load=5.0, hardness=2e9, surface_speeds=(2.0, -0.5)
    )
    a = conditions.hertz.half_widths[0]
    on = replace(
        grid((64, 64)), lower=(-2 * a, -2 * a), upper=(2 * a, 2 * a), periodic=(False, False)
    )
    solution = solve_contact(conditions, None, rough(on, 0.2e-6, correlation_length=a / 4))
    rubbing, heat = friction_and_heat(solution)
    touching = solution.in_contact
    difference = (heat.surface_1 - heat.surface_2)[touching]
    assert np.abs(difference).max() < 1e-3 * heat.max_k
    assert np.all(heat.into_1[~touching] == 0.0)
    assert heat.heat_1_w + heat.heat_2_w == pytest.approx(rubbing.power, rel=5e-3)
    assert rubbing.power == pytest.approx(0.15 * 5.0 * 2.5, rel=1e-3)
