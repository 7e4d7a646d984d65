"""Thermal feedback on the film: its convergence and its effects."""

from dataclasses import replace

import numpy as np
import pytest

from asperity.core.errors import AsperityError, NotConverged
from asperity.ehl import solve_contact
from asperity.lubricant import ExponentialWarmth, EyringShear, NewtonianShear, Thermal
from asperity.solution import (
    contact_state,
    flash_temperature,
    friction,
    friction_and_heat,
    solve_thermal_contact,
)
from asperity.surface import flat_surface
from support.paper import barus, contact, grid, rough

WARM = Thermal(feedback=True, inlet_heating=False)
SMOOTH = flat_surface(grid((96, 8)))
ROUGH = rough(grid((64, 64)), 0.7e-6, correlation_length=30e-6)


def oil(law):
    return replace(barus(), friction=law)


@pytest.fixture(scope="module", params=["smooth", "rough"])
def pair(request):
    """Return the solutions of a contact without and with thermal feedback."""
    surface = SMOOTH if request.param == "smooth" else ROUGH
    given = (contact(hardness=2e9, surface_speeds=(2.9, 0.9)), oil(EyringShear(5e6)), surface)
    return solve_contact(*given), solve_thermal_contact(*given, thermal=WARM)


def test_friction_and_heat_are_consistent(pair):
    rubbing, heat = friction_and_heat(pair[1], thermal=WARM)
    recomputed = friction(pair[1], thermal=WARM, film_temperature=313.15 + heat.film)
    assert recomputed.coefficient == pytest.approx(rubbing.coefficient, rel=1e-3)
    assert flash_temperature(pair[1], recomputed, thermal=WARM).film_max_k == pytest.approx(
        heat.film_max_k, rel=2e-3
    )


def test_the_viscosity_of_the_film_is_that_of_its_temperature(pair):
    cold, warm = pair
    heat = friction_and_heat(warm, thermal=WARM)[1]
    assert cold.viscosity_factor is None
    solved_at = np.log(warm.viscosity_factor) / -0.037
    assert np.sqrt(np.mean((solved_at - heat.film) ** 2)) < 1e-3 * heat.film_max_k
    assert np.max(np.abs(solved_at - heat.film)) < 0.05 * heat.film_max_k
    assert warm.viscosity_factor.min() < 0.8
    assert contact_state(warm).reynolds_residual < 1e-4
    assert warm.convergence.converged
    assert len(warm.convergence.history) > len(
        cold.convergence.history
    )  # iterations of all rounds are recorded
    assert warm.convergence.iteration_error is not None
    assert warm.convergence.discretisation_error == cold.convergence.discretisation_error


def test_warm_oil_reduces_friction_and_film_thickness(pair):
    cold, warm = (contact_state(solution) for solution in pair)
    assert warm.h_mean < cold.h_mean
    assert warm.clr >= cold.clr
    isothermal, fed_back = (
        friction_and_heat(pair[0])[0],
        friction_and_heat(pair[1], thermal=WARM)[0],
    )
    assert fed_back.oil_part < 0.97 * isothermal.oil_part


def test_without_feedback_heat_does_not_change_the_film():
    given = (contact(surface_speeds=(2.9, 0.9)), barus(), SMOOTH)
    plain, thermal = (
        solve_contact(*given),
        solve_thermal_contact(*given, thermal=Thermal(inlet_heating=False)),
    )
    np.testing.assert_array_equal(plain.pressure, thermal.pressure)
    rolling = solve_thermal_contact(
        contact(surface_speeds=(1.91, 1.91)), barus(), SMOOTH, thermal=WARM
    )
    assert rolling.viscosity_factor is None


def test_feedback_limits_the_heat_of_a_newtonian_oil(monkeypatch):
    """Isothermal Newtonian oil at full Barus viscosity rises by thousands of kelvins; with feedback
    the heat reduces its viscosity.
    """
    cold = solve_contact(contact(), barus(), SMOOTH)
    unlimited = replace(cold, lubricant=oil(NewtonianShear()))
    isothermal, fed_back = friction_and_heat(unlimited), friction_and_heat(unlimited, thermal=WARM)
    assert isothermal[1].film_max_k > 1000.0
    assert 10.0 < fed_back[1].film_max_k < 300.0
    assert fed_back[0].coefficient < 0.5 * isothermal[0].coefficient
    sensitive = replace(WARM, warmth=ExponentialWarmth(50.0))
    assert (
        0.0 < friction_and_heat(unlimited, thermal=sensitive)[1].film_max_k < fed_back[1].film_max_k
    )
    monkeypatch.setattr("asperity.solution.thermal.MAX_ROUNDS", 2)
    with pytest.raises(AsperityError, match="did not converge"):
        friction_and_heat(unlimited, thermal=WARM)


def test_an_unsolved_thermal_contact_is_reported():
    from asperity.ehl import Options

    given = (contact(hardness=2e9), barus(), ROUGH)
    few = Options(max_iterations=2)
    with pytest.raises(NotConverged):
        solve_thermal_contact(*given, thermal=WARM, options=few)
    assert not solve_thermal_contact(
        *given, thermal=WARM, options=few, strict=False
    ).convergence.converged


def test_a_film_that_would_lose_its_viscosity_is_warmed_in_steps():
    """At 19 m/s and a rise of 238 K the viscosity decreases to a ten-thousandth; Newton's method
    diverges in a single step.
    """
    given = (
        contact(speed=19.1, hardness=2e9),
        barus(),
        rough(grid((48, 48)), 0.5e-6, correlation_length=30e-6),
    )
    warm = solve_thermal_contact(*given, thermal=WARM)
    assert friction_and_heat(warm, thermal=WARM)[1].film_max_k > 150.0
    assert warm.viscosity_factor.min() < 1e-2
    assert contact_state(warm).reynolds_residual < 1e-4
