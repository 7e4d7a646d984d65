"""Some of the benchmark's rough, lubricated ellipses and rollers: all are solved and carry their
load, and none tilts in the wrong direction. `python -m benchmarks bounded` runs all three hundred.
"""

from itertools import islice

import pytest
from benchmarks.bounded import OIL, ellipses, rollers

from asperity.ehl import solve_contact
from asperity.solution import axial_distribution, contact_state

CONTACTS = {
    f"{c.geometry} {number}": (c, s)
    for number, c, s in [*islice(ellipses(), 6), *islice(rollers(), 2, 6)]
}


@pytest.mark.parametrize("name", CONTACTS)
def test_a_bounded_rough_contact_is_solved(name):
    conditions, surface = CONTACTS[name]
    solution = solve_contact(conditions, OIL, surface, strict=False)
    state = contact_state(solution)
    assert solution.convergence.converged
    assert abs(state.load_error) < 1e-4
    assert solution.pressure[:, [0, -1]].max() == 0.0
    assert solution.p_cap is None or state.p_max <= solution.p_cap * (1.0 + 1e-9)
    along = axial_distribution(solution)
    if along is not None and conditions.roller.tilt != 0.0:
        assert along.load_centre * conditions.roller.tilt < 0.0
