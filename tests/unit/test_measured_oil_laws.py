"""Laws of measured oils: Tait, Doolittle, Yasutomi and Carreau."""

import numpy as np
import pytest

from asperity.case import load_case
from asperity.core.errors import BadInput
from asperity.lubricant import Carreau, CarreauShear, Doolittle, ShearedFilm, Tait, Yasutomi
from asperity.results import load_run, solve_case
from asperity.solution import regime_card

SQUALANE = Doolittle(0.0157, b=4.71, r0=0.6568, k0=1.192e9, k0_prime=11.29)
GLASS = {"temperature": 313.15, "glass_temperature": 190.0, "a1": 190.0, "a2": 0.72e-9}
YASUTOMI = Yasutomi(**GLASS, b1=5e-9, b2=-0.5, c1=11.0, c2=27.0, eta_glass=1e7)
PRESSURES = np.linspace(0.0, 2e9, 41)
CASE = """
surface = { kind = "flat" }
[contact]
geometry = "point"
radius = "10 mm"
load = "20 N"
entrainment_speed = "1 m/s"
slip = 0.1
[material]
youngs_modulus = ["206 GPa", "206 GPa"]
poisson_ratio = [0.3, 0.3]
hardness = "none"
[lubricant]
viscosity = { law = "doolittle", eta0 = "15.7 mPa s", b = 4.71, r0 = 0.6568, k0 = "1.192 GPa", \
k0_prime = 11.29 }
density = { law = "tait", rho0 = "795 kg/m^3", k0 = "1.192 GPa", k0_prime = 11.29 }
rheology = { law = "carreau", stress = "6 MPa", n = 0.5 }
friction = { law = "carreau", stress = "6 MPa", n = 0.5, limit = 0.075 }
"""


def test_squalane_has_its_published_isoviscous_pressure():
    """18.1 1/GPa at 40 °C (Bair 2006, from memory): 1/α* is the integral of η₀/η over p."""
    pressure = np.linspace(0.0, 3e9, 100_001)
    ratio = SQUALANE.eta0 / SQUALANE(pressure)
    assert 1e9 / np.trapezoid(ratio, pressure) == pytest.approx(18.1, rel=0.005)


def test_taits_bulk_modulus_and_its_slope_are_the_constants():
    oil, step = Tait(795.0, k0=1.192e9, k0_prime=11.29), 1e4
    pressure = np.array([0.0, step, 2.0 * step])
    modulus = oil(pressure) / oil.slope(pressure)
    assert modulus[0] == pytest.approx(1.192e9, rel=1e-9)
    assert (modulus[2] - modulus[0]) / (2.0 * step) == pytest.approx(11.29, rel=1e-3)
    assert oil(np.zeros(1)) == 795.0


@pytest.mark.parametrize("law", [SQUALANE, YASUTOMI])
def test_log_slopes_are_derivatives(law):
    step = 1e4
    finite = (np.log(law(PRESSURES + step)) - np.log(law(PRESSURES))) / step
    np.testing.assert_allclose(law.log_slope(PRESSURES + 0.5 * step), finite, rtol=1e-4)
    assert np.all(law.log_slope(PRESSURES) > 0.0)


def test_density_slopes_are_derivatives():
    oil, step = Tait(795.0, k0=1.192e9, k0_prime=11.29), 1e4
    finite = (oil(PRESSURES + step) - oil(PRESSURES)) / step
    np.testing.assert_allclose(oil.slope(PRESSURES + 0.5 * step), finite, rtol=1e-4)


def test_yasutomis_law_at_the_glass_transition_and_at_ambient_pressure():
    glassy = (np.exp((313.15 - 190.0) / 190.0) - 1.0) / 0.72e-9
    assert YASUTOMI(np.array([glassy]))[0] == pytest.approx(1e7, rel=1e-9)
    above = 313.15 - 190.0
    assert YASUTOMI.eta0 == pytest.approx(1e7 * 10.0 ** (-11.0 * above / (27.0 + above)), rel=1e-9)


@pytest.mark.parametrize("law", [SQUALANE, YASUTOMI])
def test_the_viscosity_of_glassy_oil_is_finite(law):
    extreme = np.array([5e9, 2e10, 1e12])
    with np.errstate(all="raise"):
        assert np.all(np.isfinite(law(extreme)))
        assert np.all(np.isfinite(law.log_slope(extreme)))


def test_carreaus_law_between_newtonian_and_power_law():
    law = Carreau(6e6, 0.5)
    shear = np.array([1.0, 6e6, 1e12])
    factor, slope = law.thinning(shear)
    np.testing.assert_allclose(factor, [1.0, 2.0**-0.25, (1e12 / 6e6) ** -0.5], rtol=1e-6)
    np.testing.assert_allclose(slope, [0.0, -0.25, -0.5], atol=1e-6)
    np.testing.assert_allclose(Carreau(6e6, 1.0).thinning(shear)[0], 1.0)


def test_carreaus_friction_ends_at_the_limit():
    pressure = np.array([[0.0, 1e8, 1e9, 1e9]])
    rate = np.array([[1e3, 1e3, 1e3, 1e9]])
    film = ShearedFilm(
        rate=rate,
        viscosity=np.full((1, 4), 10.0),
        pressure=pressure,
        temperature=np.full((1, 4), 313.15),
        transit=1e-6,
    )
    stress = CarreauShear(6e6, 0.5, limit=0.075)(film)
    expected = 1e4 * (1.0 + (1e4 / 6e6) ** 2) ** -0.25
    np.testing.assert_allclose(stress, [[0.0, expected, expected, 7.5e7]], rtol=1e-9)
    assert CarreauShear(6e6, 0.5)(film)[0, 3] > 7.5e7


def test_a_case_with_these_laws_is_solved_and_stored(tmp_path):
    """The film is that by Hamrock and Dowson with α* within 6 %, thinner than with the slope."""
    run = solve_case(load_case(CASE))
    again = load_run(run.save(tmp_path / "run.nc"))
    assert again.solution.lubricant == run.case.lubricant
    assert 0.01 < run.friction.coefficient < 0.075
    film = next(fit for fit in regime_card(run.solution).fits if fit.source.startswith("Hamrock"))
    with_star = film.film * (18.07 / 22.03) ** 0.53
    assert film.solved / with_star == pytest.approx(1.0, abs=0.06)
    assert film.solved < 0.97 * film.film


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"lubricant.viscosity.r0": 1.2}, "r0 must be below 1"),
        ({"lubricant.density.k0": "-1 GPa"}, "k0 must be positive"),
        ({"lubricant.rheology.n": 1.5}, "n of Carreau's law must be at most 1"),
        ({"lubricant.friction.stress": "0 Pa"}, "stress must be positive"),
    ],
)
def test_impossible_constants_are_refused(change, message):
    with pytest.raises(BadInput, match=message):
        load_case(CASE).with_overrides(change).lubricant  # noqa: B018


def test_a_glass_temperature_above_the_temperature_is_refused():
    with pytest.raises(BadInput, match="temperature must be above glass_temperature"):
        Yasutomi(**{**GLASS, "glass_temperature": 320.0}, b1=5e-9, b2=-0.5)
