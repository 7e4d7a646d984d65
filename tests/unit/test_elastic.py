"""Dry elastic contact by its own solver, compared with Newton's method on the same equations."""

from dataclasses import replace

import numpy as np
import pytest

from asperity.ehl import Options, solve_contact
from asperity.ehl import solve as solving
from asperity.ehl.controls import DRY
from asperity.ehl.models import elastic_dry as elastic
from asperity.ehl.strategies.grid_continuation import Search
from support.paper import contact, grid, rough

TIGHT = Options(tolerance=1e-9)


def newton_solution(conditions, surface, monkeypatch):
    with monkeypatch.context() as patch:
        patch.setattr(solving, "ElasticSearch", Search)
        return solve_contact(conditions, None, surface, options=TIGHT)


@pytest.mark.parametrize(
    "sq", [0.2e-6, 1e-6, 4e-6]
)  # the last one has contact far outside the Hertz zone
def test_the_elastic_solver_agrees_with_newton_to_one_iteration(sq, monkeypatch):
    surface = rough(grid((96, 80)), sq)
    found, expected = (
        solve_contact(contact(), None, surface, options=TIGHT),
        newton_solution(contact(), surface, monkeypatch),
    )
    np.testing.assert_array_equal(found.in_contact, expected.in_contact)
    np.testing.assert_allclose(
        found.pressure, expected.pressure, atol=1e-7 * expected.pressure.max()
    )
    assert found.rigid_approach == pytest.approx(expected.rigid_approach, rel=1e-8)
    assert found.convergence.iterations == 1 < expected.convergence.iterations


def test_only_rows_that_can_touch_are_solved(monkeypatch):
    windows = []
    original = elastic._ContactLines.window

    def recorded_window(self, touching):
        windows.append(original(self, touching)[0].undeformed.shape[0] / self.undeformed.shape[0])
        return original(self, touching)

    monkeypatch.setattr(elastic._ContactLines, "window", recorded_window)
    solve_contact(contact(), None, rough(grid((96, 80)), 0.2e-6), options=TIGHT)
    assert windows
    assert max(windows) < 0.6


def test_plastic_contacts_and_failed_conjugate_gradients_fall_back_to_newton(monkeypatch):
    surface = rough(grid((96, 80)), 1e-6)
    expected = newton_solution(contact(), surface, monkeypatch)
    calls = []
    exact = solving.elastic_contact
    monkeypatch.setattr(
        solving, "elastic_contact", lambda *arguments: calls.append(arguments) or exact(*arguments)
    )
    solve_contact(contact(hardness=2e9), None, surface)
    assert calls == []
    monkeypatch.setattr(elastic, "DRY", replace(DRY, max_krylov_steps=3))
    found = solve_contact(contact(), None, surface, options=TIGHT)
    assert len(calls) == 1
    np.testing.assert_array_equal(found.pressure, expected.pressure)
