"""Contacts of the benchmark's wide sample that take what the solver does for the stubborn ones."""

import pytest
from benchmarks.robustness import OIL, contacts, overlap, prepared

from asperity.ehl import Options, solve_contact
from asperity.ehl.outcome import ATTEMPTS, FROM_DRY


@pytest.mark.parametrize(
    "number",
    [
        342,  # two cells flip to and fro: needs another manner of stepping
        375,  # goes round in circles: needs time steps
    ],
)
def test_stubborn_contacts_are_solved_at_the_first_attempt(number):
    conditions, surface = prepared(contacts()[number], 128)
    solution = solve_contact(conditions, OIL, surface, options=Options(model="paper"))
    assert solution.convergence.attempt == ATTEMPTS[0]
    assert overlap(solution) < 0.1e-9


@pytest.mark.parametrize(
    "number",
    [
        8,  # fronts of ruptured oil ran through closed cells and never came to rest
        24,  # cells whose wedge was switched on and off as their gap crossed the contact film
        118,  # the same, beside cells that the oil floods
        224,  # cells that oil at the cap had flooded, taken for lifted
        372,  # as 8, and lifted cells asked their neighbours for the film that overlap lacks
    ],
)
def test_two_pressures_solve_what_once_went_round_in_circles(number):
    conditions, surface = prepared(contacts()[number], 64)
    solution = solve_contact(conditions, OIL, surface)
    assert solution.convergence.attempt in ATTEMPTS[:1] or solution.convergence.attempt == FROM_DRY
    assert solution.convergence.iterations < 200
