"""Fields of viscosity factors: the oil is warmer in some cells than in others."""

from dataclasses import replace

import numpy as np
import pytest

from asperity.core.errors import BadInput
from asperity.ehl import Options, solve_contact
from asperity.ehl.problem_setup import contact_problem
from asperity.lubricant import Barus, ReeEyring
from asperity.solution import contact_state, load_solution
from support.paper import barus, contact, grid, rough

COARSE = grid((64, 32))


def oil(eta0):
    return replace(barus(), viscosity=Barus(eta0, 18.2e-9), rheology=ReeEyring(5e6))


def test_a_uniform_factor_is_equivalent_to_a_thinner_oil():
    surface, rng = rough(COARSE, 1e-6), np.random.default_rng(3)
    factor = np.full(COARSE.cells, 0.5)
    warm = contact_problem(contact(), oil(0.096), surface, Options(), factor)
    thin = contact_problem(contact(), oil(0.048), surface, Options())
    pressure = rng.random(COARSE.cells)
    with_factor, with_thin_oil = warm.evaluate(pressure, 1.0), thin.evaluate(pressure, 1.0)
    np.testing.assert_allclose(with_factor.outflow, with_thin_oil.outflow, rtol=1e-12)
    np.testing.assert_allclose(
        with_factor.film.log_mobility_by_pressure,
        with_thin_oil.film.log_mobility_by_pressure,
        rtol=1e-12,
    )
    np.testing.assert_allclose(warm.coarsened((48, 32)).viscosity_factor, 0.5)


def test_a_solution_stores_its_viscosity_factor(tmp_path):
    factor = np.linspace(0.4, 1.0, COARSE.cells[0])[:, None] * np.ones(COARSE.cells)
    solution = solve_contact(contact(), barus(), rough(COARSE, 1e-6), viscosity_factor=factor)
    assert contact_state(solution).reynolds_residual < 1e-4
    loaded = load_solution(solution.save(tmp_path / "warm.nc"))
    assert loaded.viscosity_factor.tobytes() == factor.tobytes()
    assert contact_state(loaded) == contact_state(solution)
    cold = replace(solution, viscosity_factor=None)
    assert contact_state(cold).reynolds_residual > 1e-3


@pytest.mark.parametrize(
    "factor", [np.ones((8, 8)), np.zeros(COARSE.cells), np.full(COARSE.cells, np.nan)]
)
def test_invalid_factors_are_refused(factor):
    with pytest.raises(BadInput, match="viscosity_factor must be positive"):
        solve_contact(contact(), barus(), rough(COARSE, 1e-6), viscosity_factor=factor)
