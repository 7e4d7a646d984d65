"""Friction of whole contacts against closed forms, quadrature and the dry limit."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import quad, solve_ivp
from scipy.special import iv, modstruve

from asperity.contact.hertz import line_pressure
from asperity.core.errors import BadInput
from asperity.ehl import solve_contact
from asperity.lubricant import BairWiner, EyringShear, LinearBairWiner, NewtonianShear
from asperity.solution import contact_state, friction
from support.paper import ETA0, barus, contact, grid, rough
from support.sampled import sampled

A, P_H = contact().hertz.half_widths[0], contact().hertz.p_max
ALPHA, GAP, WIDE = 18.2e-9, 0.7e-6, 1.0  # m; WIDE is so large that the shear stress vanishes
FINE = grid((2048, 8), x=(-1.6, 1.6))
SLIDING = contact().sliding_speed


def hertz_film(law, conditions=None):
    """Return Hertz's pressure on a film of uniform thickness inside the contact."""
    pressure = line_pressure(FINE.x, A, P_H)[:, None]
    oil = replace(barus(ALPHA), friction=law)
    return sampled(
        conditions or contact(),
        oil,
        FINE,
        pressure,
        np.where(np.abs(FINE.x) < A, GAP, WIDE)[:, None],
    )


def test_newtonian_traction_of_a_line_contact():
    """∫ η0 exp(α p) Δu/h dx = η0 Δu a/h * π (I1(α p_h) + L-1(α p_h)), modified Bessel and Struve
    functions.
    """
    beta = ALPHA * P_H
    force = ETA0 * SLIDING / GAP * A * np.pi * (iv(1, beta) + modstruve(-1, beta))
    found = friction(hertz_film(NewtonianShear()))
    assert found.coefficient == pytest.approx(force / contact().line_load, rel=1e-3)
    # friction slows body 1, the faster one
    assert found.shear_force == pytest.approx(-found.coefficient * 500.0)
    assert found.power == pytest.approx(-found.shear_force * SLIDING)


def test_eyring_traction_of_a_line_contact():
    """Far above τ0 the stress is τ0 (ln(2 η0 Δu/(τ0 h)) + α p), so its mean depends only on Hertz's
    mean pressure.
    """
    tau0 = 2e3
    mean = tau0 * (np.log(2.0 * ETA0 * SLIDING / (tau0 * GAP)) + ALPHA * np.pi / 4.0 * P_H)
    found = friction(hertz_film(EyringShear(tau0)))
    assert found.coefficient == pytest.approx(mean * 2.0 * A / contact().line_load, rel=1e-3)


def test_bair_winer_traction_without_elasticity_agrees_with_quadrature():
    law = LinearBairWiner(2e6, 0.05, ratio=1e-9)

    def stress(x):
        pressure = P_H * np.sqrt(1.0 - (x / A) ** 2)
        limit = 2e6 + 0.05 * pressure
        return -limit * np.expm1(-ETA0 * np.exp(ALPHA * pressure) * SLIDING / (GAP * limit))

    force = quad(stress, -A, A, epsrel=1e-9)[0]
    assert friction(hertz_film(law)).coefficient == pytest.approx(
        force / contact().line_load, rel=1e-3
    )


def test_bair_winer_traction_with_elasticity_agrees_with_an_ode_solver():
    """The paper's Eq 14, with dτ/dt of oil that moves at the mean speed, by an ODE solver on the
    continuous fields.
    """
    law, slow = BairWiner(), contact(surface_speeds=(1.915, 1.905))

    def slope(x, stress):
        pressure = P_H * np.sqrt(max(1.0 - (x / A) ** 2, 0.0))
        limit, modulus = law.limits(np.array(pressure), np.array(313.15))
        eta = ETA0 * np.exp(ALPHA * pressure)
        return modulus / 1.91 * (0.01 / GAP + limit / eta * np.log1p(-stress / limit))

    x = np.linspace(-A, A, 4001)
    stress = solve_ivp(slope, (-A, A), [ETA0 * 0.01 / GAP], "LSODA", x, rtol=1e-8, atol=10.0).y[0]
    found = friction(hertz_film(law, slow)).coefficient
    assert found == pytest.approx(np.trapezoid(stress, x) / contact().line_load, rel=2e-3)
    rigid = LinearBairWiner(2e6, 0.05, ratio=1e-9)
    assert friction(hertz_film(rigid, slow)).coefficient > 1.1 * found  # no build-up time


def test_traction_at_fast_sliding_is_the_limiting_stress():
    law = LinearBairWiner(2e6, 0.05)
    fast = contact(surface_speeds=(101.0, -99.0))
    mean_limit = 2e6 * 2.0 * A / contact().line_load + 0.05
    assert friction(hertz_film(law, fast)).coefficient == pytest.approx(mean_limit, rel=2e-3)


def test_a_dry_contact_has_boundary_friction():
    dry = solve_contact(
        contact(hardness=2e9), None, rough(grid((64, 64)), 1e-6, correlation_length=30e-6)
    )
    found = friction(dry, boundary_friction=0.15)
    assert found.coefficient == pytest.approx(0.15, abs=1e-3 * 0.15)
    assert found.asperity_part == pytest.approx(found.coefficient)
    assert found.oil_part == 0.0


def test_only_asperity_friction_remains_at_low_speed():
    """The oil's part vanishes with the speed; the remainder is f_b times the load share (the
    model's valleys carry the rest).
    """
    surface = rough(grid((64, 64)), 1e-6, correlation_length=30e-6)
    solved = [
        solve_contact(contact(speed=speed, hardness=2e9), barus(), surface)
        for speed in (1.0, 1e-2, 1e-5)
    ]
    found = [friction(solution, boundary_friction=0.12) for solution in solved]
    assert found[0].coefficient < found[1].coefficient < found[2].coefficient
    assert found[0].oil_part > 0.005
    assert found[2].oil_part < 1e-6
    assert found[2].coefficient == pytest.approx(0.12 * contact_state(solved[2]).clr, rel=1e-5)


def test_signs_and_pure_rolling():
    forward, backward = (
        friction(hertz_film(BairWiner(), contact(surface_speeds=s)))
        for s in ((2.1, 1.7), (1.7, 2.1))
    )
    np.testing.assert_allclose(forward.shear, -backward.shear)
    assert forward.shear.min() < 0.0
    rolling = friction(hertz_film(BairWiner(), contact(surface_speeds=(1.9, 1.9))))
    assert (rolling.coefficient, rolling.power, np.abs(rolling.shear).max()) == (0.0, 0.0, 0.0)


def test_ruptured_oil_is_not_sheared():
    solution = hertz_film(NewtonianShear())
    outside = solution.pressure <= 0.0
    assert np.all(friction(solution).shear[outside] == 0.0)


def test_warm_oil_is_easier_to_shear():
    solution = hertz_film(NewtonianShear())
    cold, warm = (
        friction(solution, film_temperature=np.full(FINE.cells, temperature))
        for temperature in (313.15, 323.15)
    )
    assert friction(solution).coefficient == cold.coefficient
    assert warm.coefficient / cold.coefficient == pytest.approx(np.exp(-0.37), rel=1e-6)
    softer = replace(solution, viscosity_factor=np.full(FINE.cells, 0.5))
    assert friction(softer).coefficient == pytest.approx(0.5 * cold.coefficient)


@pytest.mark.parametrize(
    "wrong", [{"boundary_friction": -0.1}, {"film_temperature": np.ones((3, 3))}]
)
def test_invalid_input_is_refused(wrong):
    with pytest.raises(BadInput):
        friction(hertz_film(BairWiner()), **wrong)
