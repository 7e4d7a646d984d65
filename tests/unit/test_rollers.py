"""Roller profiles: closed forms, refusals, slices, case and file."""

import json
import math
from dataclasses import replace

import numpy as np
import pytest

import asperity as asp
from asperity.case import load_case
from asperity.contact.hertz import line_contact
from asperity.contact.rollers import RollerShape, sliced_load
from asperity.ehl import auto_grid, hertz_zone
from asperity.solution import axial_distribution, plausibility_notes, solution_notes

STEEL = asp.ElasticPair((206e9, 206e9), (0.3, 0.3))
RADIUS, LENGTH, LOAD = 3.629e-3, 10e-3, 2000.0
ISO = RollerShape.iso(9e-3, LENGTH)


def roller(shape: RollerShape | None = None, load: float = LOAD, **given) -> asp.ContactConditions:
    return asp.ContactConditions(
        pair=STEEL,
        geometry="roller",
        **{
            "radius": RADIUS,
            "length": LENGTH,
            "load": load,
            "surface_speeds": (3.5, 3.5),
            "shape": shape,
            **given,
        },
    )


def case_text(**changes: str) -> str:
    contact = {
        "geometry": '"roller"',
        "radius": '"3.629 mm"',
        "length": '"10 mm"',
        "load": '"2000 N"',
        "entrainment_speed": '"3.5 m/s"',
        **changes,
    }
    lines = [f"{key} = {value}" for key, value in contact.items() if value]
    return "\n".join(
        [
            'lubricant = "none"',
            'surface = "flat"',
            "[contact]",
            *lines,
            "[material]",
            'youngs_modulus = "206 GPa"',
            "poisson_ratio = 0.3",
            "[grid]",
            "cells = [32, 66]",
            "",
        ]
    )


def test_johns_and_gohars_drop_equals_the_reference():
    """w'/(pi E*) 0.56245 um, end drop 2.9284 um at 2000 N on 10 mm."""
    shape = RollerShape.johns_gohar(LOAD, LENGTH, RADIUS, STEEL.reduced_modulus)
    assert shape.amplitude == pytest.approx(0.56245e-6, rel=1e-5)
    assert shape.end_drop == pytest.approx(2.9284e-6, rel=2e-5)
    ends = shape.drop(np.array([-0.5, 0.0, 0.5]) * LENGTH, LENGTH)
    assert ends == pytest.approx([shape.end_drop, 0.0, shape.end_drop], abs=1e-15)
    assert math.exp(-0.5) / 2.0 == pytest.approx(0.3033, abs=5e-5)


def test_isos_profile_equals_the_printed_formula():
    y = np.array([0.0, 1e-3, -3e-3, 4.5e-3])
    assert ISO.drop(y, LENGTH) == pytest.approx(
        0.00035 * 9e-3 * np.log(1.0 / (1.0 - (2.0 * y / LENGTH) ** 2))
    )
    long = RollerShape.iso(3e-3, LENGTH)
    relative_excess = np.maximum(2.0 * np.abs(y) - (LENGTH - 7.5e-3), 0.0) / 7.5e-3
    assert long.drop(y, LENGTH) == pytest.approx(
        0.0005 * 3e-3 * np.log(1.0 / (1.0 - relative_excess**2))
    )


def test_crown_flat_chamfer_and_tilt_add_up():
    shape = RollerShape(crown_radius=2.0, flat=2e-3, chamfer=0.5e-3, chamfer_angle=0.1, tilt=1e-3)
    y = np.array([0.0, 0.9e-3, 3e-3, -4.8e-3])
    crown = np.array([0.0, 0.0, (2e-3) ** 2 / 4.0, (3.5e-3) ** 2 / 4.0])
    bevel = np.array([0.0, 0.0, 0.0, 0.3e-3 * math.tan(0.1)])
    assert shape.drop(y, LENGTH) == pytest.approx(crown + bevel + 1e-3 * y)
    assert roller(replace(shape, chamfer_angle=0.8)).end == pytest.approx(4.5e-3)
    assert roller(replace(shape, chamfer_angle=0.05)).end == pytest.approx(5e-3)
    assert roller(shape).line_load == pytest.approx(LOAD / 9e-3)
    hertz = line_contact(LOAD, 9e-3, RADIUS, STEEL.reduced_modulus)
    assert roller(shape).hertz.p_max == pytest.approx(hertz.p_max)


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"amplitude": -1e-6}, "amplitude must be 0 m or more"),
        ({"end_drop": 1e-6}, "belongs to a logarithm"),
        ({"crown_radius": 0.0}, "crown_radius must be positive"),
        ({"tilt": 0.1}, "tilt must lie between -0.05 and 0.05 rad, got 0.1"),
        (
            {"chamfer": 1e-3, "chamfer_angle": 2.0},
            "chamfer_angle must lie between 0 and 90 degrees",
        ),
    ],
)
def test_an_impossible_shape_is_refused(given, message):
    with pytest.raises(asp.BadInput, match=message):
        RollerShape(**given)


def test_inconsistent_conditions_are_refused():
    with pytest.raises(asp.BadInput, match="a roller contact needs its length"):
        roller(length=None)
    with pytest.raises(asp.BadInput, match="no room for chamfers"):
        roller(RollerShape(chamfer=6e-3))
    with pytest.raises(
        asp.BadInput, match="shape belongs to a roller contact, got one for a line contact"
    ):
        replace(roller(ISO), geometry="line")


@pytest.mark.parametrize(
    ("given", "load", "message"),
    [
        (
            {"length": 10e-6},
            1649.0,
            r"0.01 mm is shorter than its contact is wide, 5.19 mm under 1649 N; lower the load",
        ),
        (
            {},
            1.0,
            (
                r"load of 1 N is carried by a film of 30.5 um over 333 um, .* half-width of 2.02"
                r" um: .* raise"
            ),
        ),
    ],
)
def test_contacts_other_than_rollers_are_refused_before_solving(given, load, message):
    oil = asp.Lubricant(
        viscosity=asp.Roelands(0.04, 20e-9),
        density=asp.DowsonHigginson(870.0),
        rheology=asp.Newtonian(),
    )
    conditions = roller(None, load, **given)
    with pytest.raises(asp.BadInput, match=message):
        asp.solve_contact(conditions, oil, asp.flat_surface(auto_grid(conditions, oil)))


def test_slices_share_the_load_approximately_as_in_iso():
    """ISO's slices: w'max/w'mean 1.3318 on 0.955 of the length; the half-space differs by a few
    %.
    """
    load = sliced_load(ISO, LENGTH, LOAD, RADIUS, STEEL.reduced_modulus)
    assert load.line_load.mean() * LENGTH == pytest.approx(LOAD)
    assert load.peak == pytest.approx(1.3318, rel=0.03)
    assert (load.ends[1] - load.ends[0]) / LENGTH == pytest.approx(0.955, abs=0.02)
    tilted = sliced_load(ISO.tilted(1e-3), LENGTH, LOAD, RADIUS, STEEL.reduced_modulus)
    assert (tilted.line_load * tilted.y).sum() < 0.0  # the gap opens towards +y
    straight = sliced_load(RollerShape(), LENGTH, LOAD, RADIUS, STEEL.reduced_modulus)
    assert straight.peak == pytest.approx(1.0)


def test_the_chosen_grid_ends_beyond_the_roller_or_its_loaded_part():
    """The end coincides with a cell border of the coarser grids, too, where cells suffice."""
    automatic = auto_grid(roller(ISO), None)
    with_cells = auto_grid(roller(ISO), None, cells=(32, 64))
    assert with_cells.y[[1, -2]] == pytest.approx(
        np.array([-0.5, 0.5]) * (LENGTH - with_cells.spacing[1])
    )
    assert automatic.y[[4, -5]] == pytest.approx(
        np.array([-0.5, 0.5]) * (LENGTH - automatic.spacing[1])
    )
    assert automatic.periodic == (False, False)
    crowned_roller = roller(RollerShape(crown_radius=0.1), load=50.0)
    part = auto_grid(crowned_roller, None)
    assert part.upper[1] < 0.4 * LENGTH
    assert part.upper[1] > crowned_roller.sliced_load.ends[1]
    assert part.lower[1] == pytest.approx(-part.upper[1], rel=1e-9)  # as the crown is symmetric
    tilted = auto_grid(roller(ISO.tilted(5e-3)), None)
    assert tilted.upper[1] < 0.3 * LENGTH
    assert tilted.y[3] < -0.5 * LENGTH < tilted.y[4]


@pytest.mark.parametrize("accuracy", [-0.5, 0.0, 0.9e-4, 0.21, 1.0])
def test_an_accuracy_out_of_range_is_refused(accuracy):
    with pytest.raises(asp.BadInput, match=r"accuracy must lie between 0\.0001 and 0\.2"):
        auto_grid(roller(ISO), None, accuracy=accuracy)


def test_a_grid_that_cuts_the_load_off_is_refused():
    surface = asp.flat_surface(asp.Grid((32, 64), (-2e-4, -4e-3), (2e-4, 4e-3), (False, False)))
    with pytest.raises(
        asp.BadInput, match=r"outermost cells along y lie at -3.938 and 3.938 mm, .* widen the grid"
    ):
        asp.solve_contact(roller(ISO), None, surface)


def test_a_roller_in_a_case_is_stored_with_its_run(tmp_path):
    shape = '{ design_load = "2000 N", tilt = "-0.2 mrad" }'
    case = load_case(case_text(shape=shape), name="case")
    expected = RollerShape.johns_gohar(LOAD, LENGTH, RADIUS, STEEL.reduced_modulus).tilted(-0.2e-3)
    assert case.conditions == roller(expected)
    assert load_case(case.text, name="restated").conditions == case.conditions
    assert case.with_overrides({"contact.shape.tilt": "0 mrad"}).conditions.roller.tilt == 0.0
    run = asp.solve_case(case)
    loaded = asp.load_run(run.save(tmp_path / "run.nc"))
    assert loaded.summary() == run.summary()
    summary = json.loads(json.dumps(run.summary()))
    assert summary["load_centre_m"] > 0.1e-3
    assert summary["tilting_moment_n_m"] == pytest.approx(summary["load_centre_m"] * LOAD, rel=1e-6)
    assert (
        "; edge pressure not determined, mid-length pressure 1.4" in run.verdict()
    )  # too few lines to resolve its ends
    assert summary["edge_pressure_pa"] is summary["edge_pressure_error_pa"] is None
    assert any(
        note.startswith("The edge pressure is not determined: the lines of cells")
        for note in summary["notes"]
    )


def test_a_determined_edge_pressure_is_reported_with_its_error():
    run = asp.solve_case(
        load_case(case_text(shape='{ iso_diameter = "9 mm" }'), name="case").with_overrides(
            {"grid": {"cells": [48, 128]}}
        )
    )
    assert "times that of a uniform load, loaded length " in run.verdict()
    numbers = run.summary()
    assert (
        0.0
        < numbers["edge_pressure_error_pa"]
        < numbers["edge_pressure_pa"]
        < numbers["middle_pressure_pa"]
    )
    value = run.verdict().partition("; edge pressure ")[2].partition(" GPa, ")[0]
    assert float(value.partition(" ± ")[0]) == pytest.approx(
        1e-9 * numbers["edge_pressure_pa"], abs=0.01
    )
    assert float(value.partition(" ± ")[2]) == pytest.approx(
        1e-9 * numbers["edge_pressure_error_pa"], rel=0.1
    )


def test_other_contacts_report_no_end_effects():
    case = load_case(case_text(geometry='"line"'), name="case").with_overrides(
        {"grid": {"cells": [32, 8]}}
    )
    run = asp.solve_case(case)
    assert "edge_pressure_pa" not in run.summary()
    assert "edge pressure" not in run.verdict()


@pytest.mark.parametrize(
    ("shape", "message"),
    [
        (
            '{ design_load = "1 N", amplitude = "1 um" }',
            "contact.shape has design_load and amplitude, which both define",
        ),
        ('{ end_drop = "1 um" }', "contact.shape has an end_drop without an amplitude"),
        (
            '{ iso_diameter = "3 mm", flat = "1 mm" }',
            "contact.shape has a flat and an iso_diameter",
        ),
        ('{ tilt = "1 um" }', 'contact.shape.tilt must be an angle such as "20 deg"'),
        (
            '{ chamfers = "1 mm" }',
            "contact.shape.chamfers is not a known key; did you mean chamfer",
        ),
        ('{ tilt = "6 deg" }', "contact and material: tilt must lie between -0.05 and 0.05 rad"),
    ],
)
def test_an_impossible_shape_in_a_case_is_refused(shape, message):
    with pytest.raises(asp.BadInput, match=message):
        load_case(case_text(shape=shape), name="case")


def test_sharp_ends_and_an_uneven_load_are_noted():
    def notes(shape: RollerShape) -> str:
        return " ".join(plausibility_notes(roller(shape), None))

    assert "is singular there. Use more crown" in notes(RollerShape())
    assert "free end surface of a real roller, which is softer, is not modelled" in notes(
        RollerShape()
    )
    assert "free surface" not in notes(ISO)
    assert "relieves the ends too little" not in notes(ISO)
    assert "By slices, " in notes(ISO.tilted(1e-3))
    assert "By slices" not in notes(ISO)


def test_the_axial_distribution_of_a_known_pressure_is_correct():
    """Pressure ~ (1 + y/L): centre, moment and edge are computed by hand."""
    conditions = roller(RollerShape(chamfer=0.5e-3))
    grid = asp.Grid((32, 92), (-2e-4, -4.6e-3), (2e-4, 4.6e-3), (False, False))
    solution = asp.solve_contact(conditions, None, asp.flat_surface(grid))
    on_roller = np.abs(grid.y) < 4.5e-3
    pressure = np.where(on_roller, 1.0 + grid.y / 9e-3, 0.0) * np.ones((32, 1)) * 1e9
    distribution = axial_distribution(replace(solution, pressure=pressure))
    assert distribution.y.size == 90
    assert distribution.load_centre == pytest.approx(9e-3 / 12.0, rel=1e-3)
    assert distribution.moment == pytest.approx(1e9 * 4e-4 * (9e-3) ** 2 / 12.0, rel=1e-3)
    assert distribution.largest_line_load == pytest.approx(1.5e9 * 4e-4, rel=0.01)
    assert distribution.edge_pressure.on_grid == pytest.approx(1.5e9, rel=0.01)
    assert distribution.middle_pressure == pytest.approx(1e9)
    assert distribution.loaded_share == pytest.approx(1.0)
    short = axial_distribution(
        replace(solution, pressure=np.where(np.abs(grid.y) < 0.44 * 9e-3, pressure, 0.0))
    )
    assert (short.edge_pressure.on_grid, short.loaded_share) == (0.0, pytest.approx(0.88, abs=0.01))
    longer = axial_distribution(
        replace(solution, pressure=np.where(np.abs(grid.y) < 0.47 * 9e-3, pressure, 0.0))
    )
    assert longer.edge_pressure.on_grid > 1.4e9
    assert (
        axial_distribution(
            replace(solution, conditions=replace(conditions, geometry="line", shape=None))
        )
        is None
    )
    assert not any("sides" in note for note in solution_notes(solution))
    assert hertz_zone(conditions, grid)[:, on_roller].any(axis=0).all()
    assert not hertz_zone(conditions, grid)[:, ~on_roller].any()
