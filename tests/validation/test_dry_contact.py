"""Rough, dry contact against tamaas, with and without a pressure cap, and waves against
Westergaard.

tamaas repeats along x as well. Its domain is eight times as wide, and the parabola is corrected for
the deflection by the images of the line load, a distance L apart: -(1/pi) ln|2 sin(pi X/L)| =
-(1/pi) ln|X| + const + pi X^2/(6 L^2), so that a load of pi/2 adds (pi^2/6) (a/L)^2 of the
parabola.
"""

import numpy as np
import pytest
import tamaas

from asperity.contact.grid import Grid
from asperity.ehl import Options, solve_contact
from asperity.solution import contact_state
from asperity.surface import Surface, flat_surface, gaussian_surface
from support.paper import RADIUS, contact, grid, rough

A, P_H = contact().hertz.half_widths[0], contact().hertz.p_max
ON = grid((128, 128), (-2.0, 2.0))
CELL = ON.spacing[0]
WIDER = 8


def tamaas_pressure(surface, cap=None):
    """Return the pressure [Pa] on the surface's own cells, and the largest pressure elsewhere."""
    tamaas.set_log_level(tamaas.LogLevel.error)
    modulus = contact().pair.reduced_modulus
    (nx, ny), (width, depth) = surface.grid.cells, surface.grid.extent
    before = (WIDER - 1) * nx // 2
    here = slice(before, before + nx)
    x = surface.grid.lower[0] + (np.arange(WIDER * nx) - before + 0.5) * surface.grid.spacing[0]
    curvature = 1.0 - np.pi**2 / 6.0 * (A / (WIDER * width)) ** 2
    heights = np.repeat((-(x**2) / (2.0 * RADIUS) * curvature)[:, None], ny, axis=1)
    heights[here] += surface.heights
    model = tamaas.ModelFactory.createModel(
        tamaas.model_type.basic_2d, [WIDER * width / A, depth / A], [WIDER * nx, ny]
    )
    model.E, model.nu = 1.0, 0.0  # stresses in units of E*
    load = 50e3 / (WIDER * width) / modulus
    if cap is None:
        solver = tamaas.PolonskyKeerRey(model, heights / A, 1e-9)
    else:
        solver = tamaas.KatoSaturated(model, heights / A, 1e-7, cap / modulus)
    solver.solve(load)
    pressure = np.asarray(model.traction).reshape(WIDER * nx, ny) * modulus
    return pressure[here], max(pressure[:before].max(), pressure[before + nx :].max())


def test_the_tamaas_model_gives_hertz_pressure():
    pressure, elsewhere = tamaas_pressure(flat_surface(ON))
    assert elsewhere == 0.0
    assert pressure.max() == pytest.approx(P_H, rel=1e-3)


@pytest.mark.parametrize(
    ("sq", "correlation_length", "cap"),
    [
        (0.5e-6, 16 * CELL, None),
        (0.5e-6, 10 * CELL, None),
        (1.0e-6, 16 * CELL, None),
        (1.0e-6, 10 * CELL, 1.5e9),
        (0.5e-6, 16 * CELL, 0.7e9),
    ],
)
def test_area_and_pressure_agree_with_tamaas(sq, correlation_length, cap):
    surface = rough(ON, sq, seed=3, correlation_length=correlation_length)
    found = solve_contact(contact(hardness=cap), None, surface, options=Options(tolerance=1e-5))
    expected, elsewhere = tamaas_pressure(surface, cap)
    assert elsewhere == 0.0
    assert np.linalg.norm(found.pressure - expected) < 0.015 * np.linalg.norm(expected)
    zone = np.abs(ON.x) <= A
    state = contact_state(found)
    assert state.car == pytest.approx(np.mean(expected[zone] > 0.0), abs=0.003)
    assert state.car_domain == pytest.approx(np.mean(expected > 0.0) * 2.0, abs=0.005)
    assert state.clr == pytest.approx(1.0, abs=1e-12)


def test_signorini_conditions_hold_in_every_cell():
    """p >= 0, h >= 0, p h = 0 and the load, in a rough contact without a cap."""
    found = solve_contact(contact(), None, rough(ON, 1e-6), options=Options(tolerance=1e-6))
    largest = found.pressure.max()
    assert found.pressure.min() >= 0.0
    assert found.gap.min() >= 0.0
    assert np.max(found.gap[found.in_contact]) < 1e-4 * A**2 / RADIUS
    assert found.pressure[~found.in_contact].max() <= 1e-6 * largest
    assert found.pressure.mean() * ON.extent[0] == pytest.approx(50e3, rel=1e-6)


def test_a_flattened_wave_adds_its_own_pressure():
    """A cosine of height d and wavenumber q in full contact adds the pressure E* q d/2: Johnson
    (1985) eq 13.7.
    """
    q = 2.0 * np.pi * 4 / ON.extent[1]
    height = 0.1 * P_H * 2.0 / (contact().pair.reduced_modulus * q)
    wave = np.cos(q * ON.y)
    found = solve_contact(
        contact(),
        None,
        Surface(np.tile(height * wave, (128, 1)), ON),
        options=Options(tolerance=1e-6),
    )
    middle = found.pressure[np.abs(ON.x) < 0.3 * A]
    assert np.all(middle > 0.0)
    amplitude = 2.0 * np.mean(middle * wave, axis=1)
    np.testing.assert_allclose(amplitude, 0.1 * P_H, rtol=0.01)
    np.testing.assert_allclose(
        middle.mean(axis=1), P_H * np.sqrt(1.0 - (ON.x[np.abs(ON.x) < 0.3 * A] / A) ** 2), rtol=0.01
    )


@pytest.mark.parametrize("full", [0.8, 1.5, 3.0])
def test_short_waves_agree_with_westergaard(full):
    """Waves along y much shorter than the contact width behave as an infinite wavy surface under
    the local mean pressure.

    `full` is the pressure p* = π E* Δ/λ that flattens them, over Hertz's. The contact covers the
    share (2/π) asin √s of a wave and the mean gap is Δ (1 - s + s ln s) at s = p/p*: Westergaard
    (1939), Johnson (1985) eqs 13.8-13.10.
    """
    conditions, cells = contact(), 128
    a, p_max = conditions.hertz.half_widths[0], conditions.hertz.p_max
    length, p_flat = 0.2 * a, full * p_max
    amplitude = p_flat * length / (np.pi * conditions.pair.reduced_modulus)
    on = Grid((cells, cells), (-1.5 * a, 0.0), (1.5 * a, length))
    wave = amplitude * np.cos(2.0 * np.pi * on.y / length)
    solution = solve_contact(
        conditions, None, Surface(np.tile(wave, (cells, 1)), on), options=Options(tolerance=1e-8)
    )
    for line in (64, 80, 96):  # x/a = 0.01, 0.39, 0.76
        share = min(float(solution.pressure[line].mean()) / p_flat, 1.0)
        touching = 2.0 / np.pi * np.arcsin(np.sqrt(share))
        mean_gap = amplitude * (1.0 - share + share * np.log(share))
        assert solution.in_contact[line].mean() == pytest.approx(touching, abs=1.5 / cells)
        assert solution.gap[line].mean() == pytest.approx(mean_gap, rel=0.01, abs=2e-3 * amplitude)


@pytest.mark.parametrize(("sq", "seed"), [(0.1e-6, 1), (0.3e-6, 2)])
def test_a_rough_ball_agrees_with_non_periodic_tamaas(sq, seed):
    """Both are non-periodic, with the same cells and the same Love kernel, but another solver
    (Polonsky and Keer).
    """
    ball = contact(geometry="point", radius=10e-3, length=None, load=20.0)
    a, cells = ball.hertz.half_widths[0], 96
    corners = (-1.6 * a, -1.6 * a), (1.6 * a, 1.6 * a)
    rng = np.random.default_rng(seed)
    heights = gaussian_surface(
        Grid((cells, cells), *corners), sq=sq, correlation_length=0.4 * a, rng=rng
    ).heights
    on = Grid((cells, cells), *corners, periodic=(False, False))
    solution = solve_contact(ball, None, Surface(heights, on), options=Options(tolerance=1e-8))

    tamaas.set_log_level(tamaas.LogLevel.error)
    side, modulus = on.extent[0] / a, ball.pair.reduced_modulus
    model = tamaas.ModelFactory.createModel(
        tamaas.model_type.basic_2d, [side, side], [cells, cells]
    )
    model.E, model.nu = 1.0, 0.0  # stresses in units of E*
    tamaas.ModelFactory.registerNonPeriodic(model, "dcfft")
    bowl = -(on.x[:, None] ** 2 + on.y**2) / (2.0 * ball.radius)
    solver = tamaas.PolonskyKeerRey(model, (bowl + heights) / a, 1e-12)
    solver.setIntegralOperator("dcfft")
    solver.solve(ball.load / on.extent[0] ** 2 / modulus)
    expected = model.traction * modulus
    np.testing.assert_array_equal(solution.in_contact, expected > 0.0)
    assert np.linalg.norm(solution.pressure - expected) < 1e-6 * np.linalg.norm(expected)
