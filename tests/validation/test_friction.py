"""Friction of whole contacts against closed forms, quadrature and the dry limit."""

from dataclasses import replace

import numpy as np
import pytest
from benchmarks.films import line_case
from scipy.integrate import quad, solve_ivp
from scipy.special import iv, modstruve

from asperity.contact.conditions import ContactConditions, ElasticPair
from asperity.contact.grid import Grid
from asperity.contact.hertz import line_pressure
from asperity.core.errors import BadInput
from asperity.ehl import film_numbers, solve_contact
from asperity.lubricant import (
    BairWiner,
    Barus,
    EyringShear,
    Incompressible,
    LinearBairWiner,
    Lubricant,
    Newtonian,
    NewtonianShear,
)
from asperity.solution import contact_state, friction
from asperity.surface import flat_surface
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


RUBBER = ElasticPair((5e6, 70e9), (0.49, 0.22))
BALL = 10e-3  # radius [m]
THIN = Lubricant(viscosity=Barus(0.1, 1e-12), density=Incompressible(1000.0), rheology=Newtonian())


def soft_ball(load, speed, *, inlet=1.0, cells=(128, 128)):
    """Return a smooth ball on rubber in pure rolling, flooded up to a distance in ball radii."""
    conditions = ContactConditions(
        pair=RUBBER, geometry="point", radius=BALL, load=load, surface_speeds=(speed, speed)
    )
    a = conditions.hertz.half_widths[0]
    side, outlet = inlet * BALL, max(2.0 * a, 0.3 * inlet * BALL)
    square = Grid(cells, (-side, -side), (outlet, side), periodic=(False, False))
    return solve_contact(conditions, THIN, flat_surface(square))


@pytest.mark.parametrize(("load", "speed"), [(5.0, 1.0), (1.0, 1.0), (0.5, 0.3), (5.0, 5.0)])
def test_rolling_friction_of_soft_balls_agrees_with_a_published_fit(load, speed):
    """1.46 U^0.65 W^-0.70 for the Poiseuille friction of one body: de Vicente, Stokes and Spikes,
    Tribol. Lett. 20 (2005) 273, quoted from memory. Their E' is 2/((1-ν₁²)/E₁ + (1-ν₂²)/E₂); the
    fit depends on it to the power 0.05. U from 2e-7 to 4e-6: 0.93 to 1.07 of the fit, with an inlet
    of one ball radius. Below U = 1e-7 the solved friction falls with U^0.8 and leaves the fit.
    """
    solution = soft_ball(load, speed)
    numbers = film_numbers(solution.conditions, THIN)
    found = friction(solution)
    law = 1.46 * numbers.speed**0.65 * numbers.load**-0.70
    assert found.rolling_coefficient == pytest.approx(law, rel=0.25)
    assert found.coefficient == found.power == 0.0


def test_rolling_friction_of_a_hard_line_contact_agrees_with_a_published_fit():
    """4.318 (G U)^0.658 W^0.0126 R/α per length: Goksem and Hargreaves (1978), as used by Aramaki,
    Cheng and Zhu (1992); quoted from memory. Here 0.97 to 1.11 of it, by the inlet's length.
    """
    conditions, oil, _ = line_case(50, 10, "Barus")
    a, radius = conditions.hertz.half_widths[0], conditions.radius_along_rolling
    grid_along = Grid((384, 8), (-5.0 * a, -a), (1.5 * a, a))
    found = friction(solve_contact(conditions, oil, flat_surface(grid_along)))
    numbers = film_numbers(conditions, oil)
    fit = 4.318 * (numbers.material * numbers.speed) ** 0.658 * numbers.load**0.0126
    force = fit * radius * conditions.length * conditions.pair.effective_modulus / numbers.material
    assert found.rolling_force == pytest.approx(force, rel=0.15)


def test_rolling_friction_balances_the_pressure_and_feeds_the_flow():
    """Forces on the film: the shear on both bodies, sum of h dp/dx, and the horizontal component of
    the pressure, sum of p dh/dx, add up to zero. As the deflection's share of the latter vanishes,
    the coefficient is the distance of the load's centre from the contact's over 2 R. Power: what
    the bodies supply equals the dissipation h³ |grad p|²/(12 η) of the pressure-driven flow.
    """
    solution = soft_ball(1.0, 1.0)
    found = friction(solution)
    along, pressure, gap = solution.grid.x[:, None], solution.pressure, solution.gap
    cell = np.prod(solution.grid.spacing)
    horizontal = (pressure * np.gradient(gap, solution.grid.spacing[0], axis=0)).sum() * cell
    assert 2.0 * found.rolling_force == pytest.approx(-horizontal, rel=1e-3)
    centre = -(pressure * along).sum() / pressure.sum()
    assert found.rolling_coefficient == pytest.approx(centre / (2.0 * BALL), rel=1e-3)
    steepness = sum(slope**2 for slope in np.gradient(pressure, *solution.grid.spacing))
    assert found.rolling_power == pytest.approx(2.0 * found.rolling_force)  # at 1 m/s
    flow = (gap**3 * steepness).sum() * cell / (12.0 * 0.1)
    assert found.rolling_power == pytest.approx(flow, rel=0.05)


def test_a_longer_inlet_adds_the_friction_of_a_ball_far_from_its_contact():
    """Far from the contact p = -(12/5) η u x/h² (Kapitza 1955) and h = r²/2R, so the inlet from r1
    to r2 adds 12 π/5 η u R ln(r2/r1).
    """
    short, long = (
        friction(soft_ball(1.0, 1.0, inlet=inlet, cells=(cells, cells))).rolling_force
        for inlet, cells in ((1.0, 96), (2.0, 192))
    )
    added = 12.0 * np.pi / 5.0 * 0.1 * 1.0 * BALL * np.log(2.0)
    assert long - short == pytest.approx(added, rel=0.1)


def test_rolling_friction_counts_the_oil_of_the_film_only():
    """A ramp of pressure over the film; touching cells carry another pressure."""
    touching = np.zeros(FINE.cells, bool)
    touching[700:900] = True
    ramp = np.linspace(0.0, 1e6, FINE.cells[0])[:, None]
    shape = np.broadcast_to(ramp, FINE.cells).copy()
    full = friction(sampled(contact(), barus(ALPHA), FINE, shape, GAP))
    # the ends of the grid are at ambient pressure
    assert full.rolling_force == pytest.approx(0.0, abs=1e-9)
    part = friction(
        sampled(
            contact(), barus(ALPHA), FINE, np.where(touching, 1e9, shape), GAP, in_contact=touching
        )
    )
    lost = GAP / 2.0 * (ramp[900, 0] - ramp[699, 0])  # the jumps at the touching cells' edges
    dry = friction(sampled(contact(), None, FINE, shape, GAP))
    assert dry.rolling_force == dry.rolling_power == 0.0
    weight = np.where(touching, 1e9, shape).mean() * (FINE.upper[0] - FINE.lower[0])
    assert part.rolling_coefficient == pytest.approx(-lost / weight, rel=1e-9)
