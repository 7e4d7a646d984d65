import numpy as np
import pytest

from asperity.core.errors import BadInput
from asperity.lubricant import Barus, DowsonHigginson, Incompressible, Roelands

PRESSURES = np.array([0.0, 1e5, 3e7, 2e8, 1e9, 2e9])


def complex_step(law, pressures):
    step = 1e-20
    return np.imag(law(pressures + 1j * step)) / step


@pytest.mark.parametrize(
    "law", [Barus(0.096, 18.2e-9), Roelands(0.04, 22e-9), Roelands(0.096, 18.2e-9, 1.5e8)]
)
def test_log_slope_is_the_derivative_of_the_logarithm(law):
    np.testing.assert_allclose(
        law.log_slope(PRESSURES), complex_step(law, PRESSURES) / law(PRESSURES), rtol=1e-12
    )


def test_density_slope_is_the_derivative():
    law = DowsonHigginson(880.0)
    np.testing.assert_allclose(law.slope(PRESSURES), complex_step(law, PRESSURES), rtol=1e-12)
    assert not Incompressible(880.0).slope(PRESSURES).any()
    np.testing.assert_array_equal(Incompressible(880.0)(PRESSURES), 880.0)


def test_barus_decades():
    """Viscosity increases tenfold every ln(10)/alpha."""
    law = Barus(0.05, 20e-9)
    np.testing.assert_allclose(
        law(np.array([0.0, 1.0, 2.0]) * np.log(10.0) / 20e-9), [0.05, 0.5, 5.0], rtol=1e-12
    )


def test_roelands_law_agrees_with_the_textbook_formula():
    """eta = eta0 exp((ln eta0 + 9.67) (-1 + (1 + 5.1e-9 p)^z)), Hamrock, Fundamentals of fluid film
    lubrication.
    """
    z, eta0 = 0.6, 0.04
    law = Roelands(eta0, z * 5.1e-9 * (np.log(eta0) + 9.67), 1.0 / 5.1e-9)
    assert law.exponent == pytest.approx(z, rel=1e-12)
    printed = eta0 * np.exp((np.log(eta0) + 9.67) * (-1.0 + (1.0 + 5.1e-9 * PRESSURES) ** z))
    np.testing.assert_allclose(law(PRESSURES), printed, rtol=1e-12)


def test_density_saturates_a_third_higher():
    """Dowson and Higginson (1966): at most 0.6/1.7 = 35 % denser, 22 % at 1 GPa."""
    density = DowsonHigginson(1.0)(np.array([0.0, 1e9, 1e15]))
    np.testing.assert_allclose(density, [1.0, 1.0 + 0.6 / 2.7, 1.0 + 6.0 / 17.0], rtol=1e-5)


@pytest.mark.parametrize(
    ("build", "message"),
    [
        (lambda: Barus(0.0, 1e-8), "viscosity eta0 must be positive"),
        (lambda: Barus(0.1, -1e-8), "alpha must be positive and finite, got -1e-08"),
        (lambda: Roelands(0.1, 1e-8, 0.0), "p0 must be positive"),
        (lambda: Roelands(float("nan"), 1e-8), "eta0"),
        (lambda: DowsonHigginson(-880.0), "density rho0"),
        (lambda: Incompressible(float("inf")), "density rho0"),
    ],
)
def test_an_invalid_oil_is_refused(build, message):
    with pytest.raises(BadInput, match=message):
        build()
