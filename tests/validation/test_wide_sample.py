"""Contacts of the benchmark's wide sample that take what the solver does for the stubborn ones."""

import pytest
from benchmarks.robustness import OIL, contacts, overlap, prepared

from asperity.ehl import solve_contact
from asperity.ehl.outcome import ATTEMPTS


@pytest.mark.parametrize(
    "number",
    [
        342,  # two cells flip to and fro: needs another manner of stepping
        375,  # goes round in circles: needs time steps
    ],
)
def test_stubborn_contacts_are_solved_at_the_first_attempt(number):
    conditions, surface = prepared(contacts()[number], 128)
    solution = solve_contact(conditions, OIL, surface)
    assert solution.convergence.attempt == ATTEMPTS[0]
    assert overlap(solution) < 0.1e-9
