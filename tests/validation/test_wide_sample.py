"""Contacts of the benchmark's wide sample that need the solver's measures for difficult cases."""

import pytest
from benchmarks.robustness import OIL, contacts, overlap, prepared

from asperity.ehl import Options, solve_contact
from asperity.ehl.outcome import SolveStrategy


@pytest.mark.parametrize(
    "number",
    [
        342,  # two cells alternate: needs another step method
        375,  # iterations cycle: needs time steps
    ],
)
def test_difficult_contacts_are_solved_at_the_first_attempt(number):
    conditions, surface = prepared(contacts()[number], 128)
    solution = solve_contact(conditions, OIL, surface, options=Options(model="paper"))
    assert solution.convergence.attempt == SolveStrategy.COARSE_TO_FINE
    assert overlap(solution) < 0.1e-9


@pytest.mark.parametrize(
    ("number", "cells"),
    [
        (8, 64),  # fronts of ruptured oil moved through closed cells without end
        (24, 64),  # the wedge switched on and off as the gap crossed the contact film
        (118, 64),  # the same, next to flooded cells
        (118, 128),  # takes 84 steps on exact faces; after 80, all other strategies failed
        (224, 64),  # cells flooded at the cap were treated as lifted by oil
        # as 8, and lifted cells took the missing film of the overlap from their neighbours
        (372, 64),
    ],
)
def test_the_mixed_model_solves_contacts_that_used_to_cycle(number, cells):
    conditions, surface = prepared(contacts()[number], cells)
    solution = solve_contact(conditions, OIL, surface)
    assert solution.convergence.attempt in (SolveStrategy.COARSE_TO_FINE, SolveStrategy.FROM_DRY)
    assert solution.convergence.iterations < 200
