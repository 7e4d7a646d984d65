"""A position of the tracks, solved loosely first; and a grid that shows too little of the
roughness.
"""

from dataclasses import replace

import numpy as np
import pytest

from asperity import ehl, solution
from asperity.case import Case
from asperity.ehl import grid_design as gridding
from asperity.simulation.wear import contact
from asperity.simulation.wear.contact import PositionSolver, SolvedPosition
from asperity.simulation.wear.jump import WearingContact
from asperity.simulation.wear.notes import ENOUGH_CELLS, RECOMMENDED_CELLS, cells_note
from asperity.surface import correlation_lengths
from asperity.wear import TrackPosition, combined_roughness
from support.wearing import worn_case

ROUGH: dict[str, object] = {
    "surface.correlation_length": "30 um",
    "grid.cells": [96, 32],
    "grid.y": [-1.0, 1.0],
}


def solver_of(case: Case) -> PositionSolver:
    return PositionSolver.from_case(case, flattening=False)


def solved(case: Case) -> SolvedPosition:
    found = solver_of(case)(case.surface())
    assert isinstance(found, SolvedPosition)
    return found


def test_a_position_is_the_contact_itself_with_its_interval():
    case = worn_case(ROUGH)
    alone = solution.contact_state(
        ehl.solve_contact(case.conditions, case.lubricant, case.surface(), options=case.options)
    )
    here = solved(case).state
    assert 0.1 < alone.clr < 0.95
    assert here.clr == pytest.approx(alone.clr, rel=0.0, abs=2e-3)
    assert here.reynolds_residual < case.options.tolerance
    assert here.error is not None
    assert alone.error is not None
    assert here.error.clr.grid == pytest.approx(
        alone.error.clr.grid, rel=0.1
    )  # what the coarser grid told is kept


def test_what_leads_nowhere_at_once_is_solved_from_afar(monkeypatch):
    case, asked = worn_case(ROUGH), []
    alone = ehl.solve_contact(case.conditions, case.lubricant, case.surface(), options=case.options)
    monkeypatch.setattr(contact, "START_ITERATIONS", 1)
    thermal = solution.solve_thermal_contact

    def counted(*arguments, **how):
        asked.append((how["options"], how["start"] is None))
        return thermal(*arguments, **how)

    monkeypatch.setattr(contact, "solve_thermal_contact", counted)
    np.testing.assert_array_equal(solved(case).pressure, alone.pressure)
    few = replace(case.options, max_iterations=1)
    assert asked == [(few, False), (few, False), (case.options, True)]


def test_what_wears_is_the_load_of_touching_cells():
    """CLR's, as the film's own part in a touching cell has no meaning by itself; nothing
    elsewhere.
    """
    found = solved(worn_case(ROUGH))
    borne = found.asperity_pressure.sum() / found.pressure.sum()
    assert borne == pytest.approx(found.state.clr, rel=1e-12)
    parted = found.asperity_pressure == 0.0
    assert 0.1 < parted.mean() < 0.99
    np.testing.assert_array_equal(found.asperity_pressure[~parted], found.pressure[~parted])


def of(overrides: dict[str, object]) -> WearingContact:
    case = worn_case(overrides)
    assert case.wear is not None
    return WearingContact(case, case.wear, case.moving_surfaces())


@pytest.mark.parametrize(("cells", "told"), [([64, 64], True), ([160, 64], False)])
def test_too_few_cells_of_the_roughness_are_said_with_as_many_as_do(cells, told):
    fine = {"surface.correlation_length": "20 um", "grid.y": [-1.0, 1.0]}
    model = of({**fine, "grid.cells": cells})
    composite = combined_roughness(model.surfaces, TrackPosition(0, 0))
    lengths, grid = correlation_lengths(composite), composite.grid
    along = [length / step for length, step in zip(lengths, grid.spacing, strict=True)]
    said = cells_note(model)
    assert (said is not None) is told is (min(along) < ENOUGH_CELLS * RECOMMENDED_CELLS)
    if said is not None:
        assert said.startswith(
            f"The roughness has {along[0]:.2g} by {along[1]:.2g} cells along its correlation"
        )
        wanted = [
            int(number) for number in said.split("grid.cells = [")[1].split("]")[0].split(", ")
        ]
        assert wanted[0] > cells[0]
        assert cells_note(of({**fine, "grid.cells": wanted})) is None


def test_smooth_bodies_want_no_cells():
    assert cells_note(of({"surface": "flat"})) is None


def test_cells_that_are_wanted_are_those_of_a_chosen_grid():
    assert RECOMMENDED_CELLS == gridding.CELLS_IN_CORRELATION
