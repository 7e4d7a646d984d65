"""Shear stress of the film under each law, and thermal effects on the oil, against closed forms."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from asperity.core.errors import BadInput
from asperity.kernels import shear_stress
from asperity.lubricant import (
    BairWiner,
    Barus,
    ExponentialWarmth,
    EyringShear,
    LinearBairWiner,
    NewtonianShear,
    Roelands,
    RoelandsWarmth,
    ShearedFilm,
    Solid,
    Thermal,
)

X = np.linspace(-1.5, 1.5, 96)
PRESSURE = 0.57e9 * np.sqrt(np.maximum(1.0 - X**2, 0.0))
VISCOSITY = 0.096 * np.exp(18.2e-9 * PRESSURE)
A = 56e-6


def film(
    rate,
    viscosity=VISCOSITY,
    pressure=PRESSURE,
    temperature=313.15,
    transit=(X[1] - X[0]) * A / 1.91,
):
    columns = [
        np.broadcast_to(f, X.shape)[:, None] * np.ones(2)
        for f in (rate, viscosity, pressure, temperature)
    ]
    return ShearedFilm(
        rate=columns[0],
        viscosity=columns[1],
        pressure=columns[2],
        temperature=columns[3],
        transit=transit,
    )


def test_newton_and_eyring_match_hand_calculations():
    sheared = film(1e4)
    np.testing.assert_allclose(NewtonianShear()(sheared)[:, 0], VISCOSITY * 1e4)
    stress = EyringShear(5e6)(sheared)
    np.testing.assert_allclose(
        5e6 * np.sinh(stress[:, 1] / 5e6), VISCOSITY * 1e4
    )  # the law inverted for the rate
    np.testing.assert_allclose(EyringShear(5e6)(film(1.0)), NewtonianShear()(film(1.0)), rtol=1e-6)


def test_dysons_limits_match_hand_calculations():
    limit, modulus = BairWiner().limits(
        np.array([1e9, 0.5e9, 0.2e9]), np.array([313.15, 373.15, 313.15])
    )
    by_hand = [1.2e9 / 3.48 - 1e8, 0.6e9 / 4.92 - 1e8, 8e6]
    np.testing.assert_allclose(modulus, by_hand)
    np.testing.assert_allclose(limit, 0.25 * modulus)


def test_a_measured_limit_matches_hand_calculations():
    limit, modulus = LinearBairWiner(2e6, 0.05, 0.01, ratio=0.2).limits(
        np.array([1e9]), np.array([333.15])
    )
    np.testing.assert_allclose(limit, 52e6 * np.exp(-0.2))
    np.testing.assert_allclose(modulus, 5.0 * limit)
    cold, _ = LinearBairWiner(2e6, 0.05).limits(np.array([1e9]), np.array([333.15]))
    np.testing.assert_allclose(cold, 52e6)


@pytest.mark.parametrize("rate", [1e3, 1e5, 1e7])
def test_rigid_oil_follows_its_flow_law(rate):
    """For G → ∞, τ satisfies γ' = -(τ_L/η) ln(1 - τ/τ_L), independent of history."""
    law = LinearBairWiner(2e6, 0.05, ratio=1e-9)
    stress, limit = law(film(rate))[:, 0], 2e6 + 0.05 * PRESSURE
    reference = [
        (
            brentq(
                lambda t, top=top, eta=eta: rate + top / eta * np.log1p(-t / top),
                0.0,
                top * (1.0 - 1e-15),
            )
            if rate * eta < 30.0 * top
            else top
        )
        for top, eta in zip(limit, VISCOSITY, strict=True)
    ]
    np.testing.assert_allclose(stress, reference, rtol=1e-7)


def test_stiff_oil_far_below_its_limit_is_a_spring():
    """For η and τ_L → ∞, τ grows by G times the strain."""
    law = LinearBairWiner(1e12, 1e-9, ratio=1e12 / 50e6)  # G = 50 MPa
    stress = law(film(1e3, viscosity=np.where(np.arange(X.size) == 0, 1e-3, 1e15), transit=1e-7))[
        :, 0
    ]
    np.testing.assert_allclose(np.diff(stress[1:]), 50e6 * 1e3 * 1e-7, rtol=1e-6)


@pytest.mark.parametrize("rate", [3e3, 2e4])
def test_convected_oil_follows_the_maxwell_equation(rate):
    """Maxwell model through the paper's contact, against an ODE solver on interpolated fields."""
    law, speed = BairWiner(), 1.91
    limit, modulus = law.limits(PRESSURE, np.full(X.size, 313.15))

    def slope(t, stress):
        x = X[0] + t * speed / A
        top, g = np.interp(x, X, limit), np.interp(x, X, modulus)
        eta = np.exp(np.interp(x, X, np.log(VISCOSITY)))
        return g * (rate + top / eta * np.log1p(-np.minimum(stress / top, 1.0 - 1e-12)))

    times = (X - X[0]) * A / speed
    exact = solve_ivp(
        slope, (0.0, times[-1]), [VISCOSITY[0] * rate], "LSODA", times, rtol=1e-9, atol=1.0
    ).y[0]
    stress = law(film(rate))[:, 0]
    steady = -limit * np.expm1(-VISCOSITY * rate / limit)
    assert np.max(np.abs(steady - exact)) > 0.2 * exact.max()  # the history matters here,
    assert np.max(np.abs(stress - exact)) < 0.03 * exact.max()
    assert stress.mean() == pytest.approx(
        exact.mean(), rel=0.005
    )  # and friction includes it to 0.5 %


def test_the_kernel_agrees_with_its_reference_implementation():
    rng = np.random.default_rng(1)
    rate, limit, modulus = (10.0 ** rng.uniform(low, low + 1.5, (12, 3)) for low in (4, 6, 7))
    viscosity = 10.0 ** rng.uniform(-2, 4, (12, 3))
    transit, out = 1e-6, np.empty((12, 3))
    shear_stress.march_shear_stress(rate, viscosity, limit, modulus, transit, out)
    for j in range(3):
        stress = limit[0, j] * (1.0 - np.exp(-viscosity[0, j] * rate[0, j] / limit[0, j]))
        for i in range(1, 12):
            thickest = max(viscosity[i, j], viscosity[i - 1, j])
            steps = (
                1
                if modulus[i, j] * transit > shear_stress.STIFF * thickest
                else shear_stress.SUBSTEPS
            )
            for share in np.arange(1, steps + 1) / steps:
                eta = viscosity[i - 1, j] ** (1.0 - share) * viscosity[i, j] ** share
                top, g, gamma = (
                    (1.0 - share) * f[i - 1, j] + share * f[i, j] for f in (limit, modulus, rate)
                )
                dt, before = transit / steps, stress
                after = brentq(
                    lambda s, top=top, g=g, gamma=gamma, eta=eta, dt=dt, before=before: (
                        before - top * -np.expm1(-s) + g * dt * (gamma - top / eta * s)
                    ),
                    0.0,
                    1e6,
                    xtol=1e-14,
                    rtol=1e-14,
                )
                stress = -top * np.expm1(-after)
            assert out[i, j] == pytest.approx(stress, rel=1e-9)


def test_heated_oil_matches_hand_calculations():
    viscosity = np.array([0.096, 3.0])
    halved = ExponentialWarmth(0.037).factor(
        viscosity, np.array([313.15 + np.log(2.0) / 0.037] * 2), 313.15
    )
    np.testing.assert_allclose(halved, 0.5)
    assert 100.0 * ExponentialWarmth().factor(np.ones(1), np.array([373.15]), 313.15)[
        0
    ] == pytest.approx(11.0, rel=0.02)


def test_roelands_thermal_factor_matches_his_law_at_another_temperature():
    """η = η0 exp((ln η0 + 9.67)((1 + p/p0)^z ((T - 138)/(T0 - 138))^-S0 - 1)) in explicit form."""
    law, pressure, temperature = (
        Roelands(0.096, 18.2e-9),
        np.array([0.0, 0.3e9, 1e9]),
        np.array([340.0, 400.0, 330.0]),
    )
    warm = law(pressure) * RoelandsWarmth(1.2).factor(law(pressure), temperature, 313.15)
    scale = np.log(0.096) + 9.67
    warmer = ((temperature - 138.0) / (313.15 - 138.0)) ** -1.2
    np.testing.assert_allclose(
        warm, 0.096 * np.exp(scale * ((1 + pressure / law.p0) ** law.exponent * warmer - 1))
    )
    assert np.all(RoelandsWarmth(1.2).factor(Barus(0.1, 2e-8)(pressure), temperature, 313.15) < 1.0)


@pytest.mark.parametrize(
    "wrong",
    [
        lambda: EyringShear(-1.0),
        lambda: BairWiner(floor=0.0),
        lambda: LinearBairWiner(2e6, 0.05, softening=-1.0),
        lambda: ExponentialWarmth(0.0),
        lambda: RoelandsWarmth(np.nan),
        lambda: Solid(conductivity=-46.0),
        lambda: Thermal(ambient=40.0),
        lambda: Thermal(oil_conductivity=0.0),
    ],
)
def test_invalid_parameters_are_refused(wrong):
    with pytest.raises(BadInput, match="must"):
        wrong()
