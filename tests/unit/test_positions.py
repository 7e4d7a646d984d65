"""Contact solutions at track positions, solved coarsely first; grids too coarse for roughness."""

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
from asperity.transient import solve_passage
from asperity.wear import TrackPosition, combined_roughness
from support.wearing import worn_case

ROUGH: dict[str, object] = {
    "surface.correlation_length": "30 um",
    "grid.cells": [96, 32],
    "grid.y": [-1.0, 1.0],
    "contact.roughness": "standing",
}


def solver_of(case: Case) -> PositionSolver:
    return PositionSolver.from_case(case, flattening=False)


def solved(case: Case) -> SolvedPosition:
    position = solver_of(case)(case.moving_surfaces())
    assert isinstance(position, SolvedPosition)
    return position


def test_a_position_equals_the_contact_with_its_interval():
    case = worn_case(ROUGH)
    reference = solution.contact_state(
        ehl.solve_contact(case.conditions, case.lubricant, case.surface(), options=case.options)
    )
    state = solved(case).state
    assert 0.1 < reference.clr < 0.95
    assert state.clr == pytest.approx(reference.clr, rel=0.0, abs=2e-3)
    assert state.reynolds_residual < case.options.tolerance
    assert state.error is not None
    assert reference.error is not None
    assert state.error.clr.grid == pytest.approx(
        reference.error.clr.grid, rel=0.1
    )  # the coarse grid's estimate is stored


def test_a_position_of_running_roughness_is_reached_after_a_passage():
    case = worn_case({**ROUGH, "contact.roughness": "running"})
    solved_after = solve_passage(
        case.conditions, case.lubricant, case.moving_surfaces(), options=case.options
    )
    np.testing.assert_array_equal(solved(case).pressure, solved_after.pressure)
    standing = solved(worn_case(ROUGH)).state.clr
    assert solved(case).state.clr > standing + 0.05


def test_a_failed_warm_start_is_retried_from_scratch(monkeypatch):
    case, attempts = worn_case(ROUGH), []
    reference = ehl.solve_contact(
        case.conditions, case.lubricant, case.surface(), options=case.options
    )
    monkeypatch.setattr(contact, "START_ITERATIONS", 1)
    thermal = solution.solve_thermal_contact

    def count_attempts(*arguments, **options):
        attempts.append((options["options"], options["start"] is None))
        return thermal(*arguments, **options)

    monkeypatch.setattr(contact, "solve_thermal_contact", count_attempts)
    np.testing.assert_array_equal(solved(case).pressure, reference.pressure)
    few = replace(case.options, max_iterations=1)
    assert attempts == [(few, False), (few, False), (case.options, True)]


def test_wear_acts_on_the_load_of_touching_cells():
    """CLR counts the whole load of touching cells, as their film share alone is meaningless."""
    position = solved(worn_case(ROUGH))
    share = position.asperity_pressure.sum() / position.pressure.sum()
    assert share == pytest.approx(position.state.clr, rel=1e-12)
    separated = position.asperity_pressure == 0.0
    assert 0.1 < separated.mean() < 0.99
    np.testing.assert_array_equal(
        position.asperity_pressure[~separated], position.pressure[~separated]
    )


def wear_model(overrides: dict[str, object]) -> WearingContact:
    case = worn_case(overrides)
    assert case.wear is not None
    return WearingContact(case, case.wear, case.moving_surfaces())


@pytest.mark.parametrize(("cells", "noted"), [([64, 64], True), ([160, 64], False)])
def test_too_few_cells_for_the_roughness_are_noted_with_a_sufficient_number(cells, noted):
    fine = {"surface.correlation_length": "20 um", "grid.y": [-1.0, 1.0]}
    model = wear_model({**fine, "grid.cells": cells})
    composite = combined_roughness(model.surfaces, TrackPosition(0, 0))
    lengths, grid = correlation_lengths(composite), composite.grid
    lengths_in_cells = [length / step for length, step in zip(lengths, grid.spacing, strict=True)]
    note = cells_note(model)
    assert (note is not None) is noted is (min(lengths_in_cells) < ENOUGH_CELLS * RECOMMENDED_CELLS)
    if note is not None:
        assert note.startswith(
            f"The roughness has {lengths_in_cells[0]:.2g} by {lengths_in_cells[1]:.2g} cells along"
            " its correlation"
        )
        recommended = [
            int(number) for number in note.split("grid.cells = [")[1].split("]")[0].split(", ")
        ]
        assert recommended[0] > cells[0]
        assert cells_note(wear_model({**fine, "grid.cells": recommended})) is None


def test_smooth_bodies_require_no_cells():
    assert cells_note(wear_model({"surface": "flat"})) is None


def test_recommended_cells_are_those_of_a_chosen_grid():
    assert RECOMMENDED_CELLS == gridding.CELLS_IN_CORRELATION
