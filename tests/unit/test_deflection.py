import numpy as np
import pytest
import scipy

from asperity.ehl.deflection import Deflection, _k0_integral, _line_kernel
from asperity.ehl.deflection import deflection as half_space
from support.half_space import periodic_compliance

CELLS, SPACING = (16, 12), (0.11, 0.07)


def line_deflection(cells: tuple[int, int], spacing: tuple[float, float]) -> Deflection:
    return half_space(cells, spacing, 1.0 / (2.0 * np.pi), True)


@pytest.fixture
def deflection():
    return line_deflection(CELLS, SPACING)


def test_one_loaded_cell_deflects_as_the_sum_over_its_images(deflection):
    """Love's rectangle and 6000 images: no logarithmic kernel, Bessel function or transform."""
    pressure = np.zeros(CELLS)
    pressure[3, 5] = 1.0
    (dx, dy), (nx, ny) = SPACING, CELLS
    x, y = np.meshgrid((np.arange(nx) - 3) * dx, (np.arange(ny) - 5) * dy, indexing="ij")
    expected = periodic_compliance(x, y, SPACING, ny * dy)
    np.testing.assert_allclose(deflection(pressure), expected, atol=1e-7 * np.ptp(expected))


@pytest.mark.parametrize("cells", [(16, 12), (15, 9), (9, 16)])
@pytest.mark.parametrize(
    ("spacing", "tolerance"), [((0.05, 0.05), 1e-7), ((0.2, 0.02), 3e-6), ((0.02, 0.2), 1e-7)]
)
def test_cells_of_any_shape(cells, spacing, tolerance):
    pressure = np.zeros(cells)
    pressure[0, 0] = 1.0
    x, y = np.meshgrid(
        *(np.arange(n) * d for n, d in zip(cells, spacing, strict=True)), indexing="ij"
    )
    expected = periodic_compliance(x, y, spacing, cells[1] * spacing[1])
    np.testing.assert_allclose(
        line_deflection(cells, spacing)(pressure), expected, atol=tolerance * np.ptp(expected)
    )


def alias_by_alias(
    cells: tuple[int, int], spacing: tuple[float, float], aliases: int
) -> np.ndarray:
    """Transformed kernel with each alias' cells integrated separately up to the truncation."""
    (nx, ny), (dx, dy) = cells, spacing
    kernel = np.zeros((nx, ny // 2 + 1))
    edges = (np.arange(nx + 1) - 0.5) * dx
    kernel[:, 0] = -np.diff(edges * np.log(np.abs(edges)) - edges)
    for wave in range(1, ny // 2 + 1):
        number = wave + ny * np.arange(-aliases, aliases + 1)
        wavenumber = 2.0 * np.pi * np.abs(number) / (ny * dy)
        argument = np.outer(edges, wavenumber)
        integral = np.where(
            np.abs(argument) < 40.0,
            scipy.special.iti0k0(np.minimum(np.abs(argument), 40.0))[1],
            np.pi / 2.0,
        )
        integral[0] *= -1.0
        kernel[:, wave] = np.diff(integral, axis=0) @ (np.sinc(number / ny) / wavenumber)
    return kernel


@pytest.mark.parametrize("cells", [(20, 16), (20, 15), (16, 3), (16, 2), (9, 1)])
@pytest.mark.parametrize("aspect", [0.01, 0.05, 0.3, 1.0, 4.0, 20.0])
def test_the_alias_sum_matches_four_thousand_terms(cells, aspect):
    spacing = (0.1, 0.1 / aspect)
    found, expected = (
        scipy.fft.rfft(np.concatenate([kernel, kernel[:0:-1]]), axis=0).real
        for kernel in (_line_kernel(cells, spacing), alias_by_alias(cells, spacing, 4000))
    )
    np.testing.assert_allclose(found, expected, rtol=0.0, atol=1e-11 * np.abs(expected).max())


def test_the_tail_integral_of_k0_matches_quadrature():
    """On both sides of the argument where the polynomial takes over."""
    argument = np.array([1e-3, 0.5, 2.999, 3.001, 5.0, 12.0, 20.0, 31.9])
    expected = [
        scipy.integrate.quad(scipy.special.k0, z, z + 40.0, epsabs=1e-15, epsrel=1e-11)[0]
        for z in argument
    ]
    np.testing.assert_allclose(_k0_integral(argument), expected, rtol=1e-12, atol=1e-13)


def test_a_pressure_constant_in_y_gives_the_logarithmic_kernel(deflection):
    """-(1/pi) int ln|x - s| ds, integrated cell by cell."""
    line = np.random.default_rng(1).random(CELLS[0])
    x = np.arange(CELLS[0]) * SPACING[0]
    edge = x[:, None] - x[None, :]
    upper, lower = edge + SPACING[0] / 2.0, edge - SPACING[0] / 2.0
    expected = (
        -(upper * np.log(np.abs(upper)) - lower * np.log(np.abs(lower)) - SPACING[0]) / np.pi @ line
    )
    found = deflection(np.repeat(line[:, None], CELLS[1], axis=1))
    np.testing.assert_allclose(
        found, np.repeat(expected[:, None], CELLS[1], axis=1), rtol=1e-12, atol=1e-13
    )


def test_selected_rows_deflect_as_in_the_full_grid(deflection):
    pressure = np.zeros(CELLS)
    pressure[5:9] = np.random.default_rng(2).random((4, CELLS[1]))
    np.testing.assert_allclose(
        deflection.restrict_to(4)(pressure[5:9]), deflection(pressure)[5:9], rtol=1e-13
    )
    single = deflection.restrict_to(4)(pressure[5:9].astype(np.float32))
    assert single.dtype == np.float32
    np.testing.assert_allclose(single, deflection(pressure)[5:9], rtol=1e-5)


@pytest.mark.parametrize("cells", [64, 128, 256])
def test_a_hertz_pressure_flattens_the_parabola(cells):
    """V = const - X^2/2 inside |X| < 1, to 3/cells^1.5; the pressure's edge limits the order."""
    dx = 4.0 / cells
    x = -2.0 + (np.arange(cells) + 0.5) * dx
    pressure = np.repeat(np.sqrt(np.maximum(1.0 - x**2, 0.0))[:, None], 8, axis=1)
    flat = (line_deflection((cells, 8), (dx, 0.3))(pressure) + (x**2 / 2.0)[:, None])[
        np.abs(x) < 1.0
    ]
    assert np.ptp(flat) < 3.0 * cells**-1.5
    # the constant: int sqrt(1 - s^2) ln|s| ds = -(pi/2)(ln 2 + 1/2), over -pi
    assert flat.mean() == pytest.approx((np.log(2.0) + 0.5) / 2.0, abs=3.0 * cells**-1.5)


def test_a_wave_along_y_deflects_as_on_a_half_space():
    """cos(q y) on a band much wider than a wave: V = P/q for each harmonic of the staircase."""
    cells, dy = 32, 0.05
    y = (np.arange(cells) + 0.5) * dy
    wave = np.tile(np.cos(2.0 * np.pi * y / (cells * dy)), (256, 1))
    found = line_deflection((256, cells), (0.1, dy))(wave)[128]
    order = 1 + cells * np.arange(-1000, 1001)
    sinks = np.sum(np.sinc(order / cells) / np.abs(2.0 * np.pi * order / (cells * dy)))
    np.testing.assert_allclose(found, wave[128] * sinks, rtol=2e-5)


def test_the_kernel_is_linear_reciprocal_and_symmetric(deflection):
    rng = np.random.default_rng(2)
    first, second = rng.random(CELLS), rng.random(CELLS)
    np.testing.assert_allclose(
        deflection(2.0 * first - 3.0 * second),
        2.0 * deflection(first) - 3.0 * deflection(second),
        atol=1e-13,
    )
    assert np.sum(second * deflection(first)) == pytest.approx(
        np.sum(first * deflection(second)), rel=1e-12
    )  # Betti's theorem
    np.testing.assert_allclose(deflection(first[::-1]), deflection(first)[::-1], atol=1e-13)
    np.testing.assert_allclose(deflection(first[:, ::-1]), deflection(first)[:, ::-1], atol=1e-13)
    np.testing.assert_allclose(
        deflection(np.roll(first, 5, 1)), np.roll(deflection(first), 5, 1), atol=1e-13
    )


def test_every_pressure_has_positive_energy(deflection):
    """Elastic energy is positive for zero net load on every row; otherwise a solver may diverge."""
    rng = np.random.default_rng(3)
    for _ in range(20):
        pressure = rng.standard_normal(CELLS)
        pressure -= pressure.mean()
        assert np.sum(pressure * deflection(pressure)) > 0.0


def test_the_first_kernel_row_is_the_compliance(deflection):
    pressure = np.zeros(CELLS)
    pressure[0, 0] = 1.0
    np.testing.assert_allclose(
        deflection.local_compliance, deflection(pressure)[[0, 1, 2, 8], 0], rtol=1e-12
    )


def test_a_hertz_pressure_on_a_circle_flattens_the_sphere():
    """V = const - (X^2 + Y^2)/2 in the circle at compliance 2/pi^2, const = 1; second order at the
    edge too.
    """
    errors = []
    for cells in (32, 64, 128):
        step = 3.0 / cells
        x = -1.5 + (np.arange(cells) + 0.5) * step
        squared = x[:, None] ** 2 + x**2
        pressure = np.sqrt(np.maximum(1.0 - squared, 0.0))
        displaced = (
            half_space((cells, cells), (step, step), 2.0 / np.pi**2, False)(pressure)
            + squared / 2.0
        )
        errors.append(float(np.abs(displaced[squared < 0.8] - 1.0).max()))
    assert errors[-1] < 1e-3
    assert errors[0] / errors[-1] > 4.0**2 / 2.0
