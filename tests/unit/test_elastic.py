"""The dry elastic contact by its own solver: beside Newton's steps, which share nothing with it but
the equations.
"""

from dataclasses import replace

import numpy as np
import pytest

from asperity.ehl import Options, solve_contact
from asperity.ehl import solve as solving
from asperity.ehl.controls import ELASTIC_DRY
from asperity.ehl.models import elastic_dry as elastic
from asperity.ehl.strategies.grid_continuation import Search
from support.paper import contact, grid, rough

TIGHT = Options(tolerance=1e-9)


def by_newton(conditions, surface, monkeypatch):
    with monkeypatch.context() as alone:
        alone.setattr(solving, "ElasticSearch", Search)
        return solve_contact(conditions, None, surface, options=TIGHT)


@pytest.mark.parametrize("sq", [0.2e-6, 1e-6, 4e-6])  # the last touches far outside the Hertz zone
def test_it_is_newtons_contact_and_one_step_of_newtons_says_so(sq, monkeypatch):
    surface = rough(grid((96, 80)), sq)
    found, expected = (
        solve_contact(contact(), None, surface, options=TIGHT),
        by_newton(contact(), surface, monkeypatch),
    )
    np.testing.assert_array_equal(found.in_contact, expected.in_contact)
    np.testing.assert_allclose(
        found.pressure, expected.pressure, atol=1e-7 * expected.pressure.max()
    )
    assert found.rigid_approach == pytest.approx(expected.rigid_approach, rel=1e-8)
    assert found.convergence.iterations == 1 < expected.convergence.iterations


def test_only_lines_that_can_touch_take_part(monkeypatch):
    windows = []
    around = elastic._ContactLines.window

    def seen(self, touching):
        windows.append(around(self, touching)[0].undeformed.shape[0] / self.undeformed.shape[0])
        return around(self, touching)

    monkeypatch.setattr(elastic._ContactLines, "window", seen)
    solve_contact(contact(), None, rough(grid((96, 80)), 0.2e-6), options=TIGHT)
    assert windows
    assert max(windows) < 0.6


def test_yielding_bodies_and_gradients_out_of_steps_are_left_to_newton(monkeypatch):
    surface = rough(grid((96, 80)), 1e-6)
    expected = by_newton(contact(), surface, monkeypatch)
    asked = []
    exact = solving.elastic_contact
    monkeypatch.setattr(
        solving, "elastic_contact", lambda *given: asked.append(given) or exact(*given)
    )
    solve_contact(contact(hardness=2e9), None, surface)
    assert asked == []
    monkeypatch.setattr(elastic, "ELASTIC_DRY", replace(ELASTIC_DRY, max_krylov_steps=3))
    found = solve_contact(contact(), None, surface, options=TIGHT)
    assert len(asked) == 1
    np.testing.assert_array_equal(found.pressure, expected.pressure)
