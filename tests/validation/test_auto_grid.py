"""The grid that a contact is given: films within 1 % on it; and grids given by hand judged as their
errors are.

The films are those of an own one-dimensional solver on non-uniform nodes (E' 219.78 GPa, R 5.4 mm,
eta0 0.04 Pa s, alpha 22 1/GPa, Dowson and Higginson's density; -4.5..1.9 a, of M 5 -10..3), and
the errors those of the unified model on uniform grids of that domain, before grids were chosen.
One least film is not as it was given, 3.54: the twin in `support.line` comes to 3.456, 3.481 and
3.487 on 801, 1601 and 2401 nodes, and the package to 3.495 on 4096 cells.
"""

from pathlib import Path

import numpy as np
import pytest
from benchmarks.films import line_case

from asperity import load_case, solve_case
from asperity.contact.grid import Grid
from asperity.core.errors import BadInput
from asperity.ehl import Texture, auto_grid, film_fits, grid_shortfalls, solve_contact
from asperity.lubricant import Barus, DowsonHigginson, Lubricant, Newtonian, Roelands
from asperity.solution import contact_state, regime_card
from asperity.surface import flat_surface, gaussian_surface
from support.paper import barus, contact

CASES = Path(__file__).parents[1] / "cases"
FILMS = [  # M, L, law, H_c, H_min, and the error of the centre [%] at 64, 128, 256, 512, 1024 cells
    (5, 10, "Barus", 5.447, 4.577, (-2.1, -0.6, -0.15, None, 0.0)),
    (5, 10, "Roelands", 5.301, 4.441, (-2.3, -0.6, -0.15, None, 0.0)),
    (50, 10, "Barus", 3.909, 3.495, (-12, -3.6, -1.0, -0.25, -0.06)),
    (50, 10, "Roelands", 3.783, 3.376, (-14, -4.1, -1.1, -0.27, -0.06)),
    (100, 10, "Roelands", 3.409, 3.094, (-34, -10, -3.0, -0.8, -0.2)),
    (100, 5, "Roelands", 2.332, 2.051, (-50, -15, -4.1, -1.0, -0.2)),
    (300, 5, "Roelands", 1.937, 1.758, (-100, -55, -20, -5.6, None)),
    (500, 10, "Roelands", 2.688, 2.522, (-100, -82, -25, -7.5, -2.1)),
]
NAMES = [f"M {m} L {l} {law}" for m, l, law, *_ in FILMS]  # noqa: E741


def films(solution):
    """At x = 0 and least."""
    middle = slice(solution.grid.cells[1] // 2 - 1, solution.grid.cells[1] // 2 + 1)
    along = solution.gap[:, middle].mean(axis=1)
    return float(np.interp(0.0, solution.grid.x, along)), float(solution.gap.min())


@pytest.mark.parametrize("row", FILMS, ids=NAMES)
def test_smooth_lines_have_their_film_within_one_per_cent_or_their_own_bar(row):
    m, l, law, central, least, _ = row  # noqa: E741
    conditions, oil, unit = line_case(m, l, law)
    solution = solve_contact(conditions, oil, flat_surface(auto_grid(conditions, oil)))
    error = solution.convergence.error
    found = films(solution)
    assert found[0] / unit == pytest.approx(central, rel=max(0.01, error.h_central / found[0]))
    assert found[1] / unit == pytest.approx(least, rel=max(0.01, error.h_min / found[1]))
    assert abs(found[0] / unit / central - 1.0) < 0.012
    assert not solution.in_contact.any()
    assert grid_shortfalls(conditions, oil, solution.surface) == ()
    assert solution.grid.cells[0] < 2048
    assert solution.convergence.iterations < 100


@pytest.mark.parametrize("row", FILMS, ids=NAMES)
def test_a_grid_given_by_hand_is_too_coarse_where_its_film_is_off_by_one_per_cent(row):
    m, l, law, *_, errors = row  # noqa: E741
    conditions, oil, _ = line_case(m, l, law)
    a = conditions.hertz.half_widths[0]
    left, right = (-10.0, 3.0) if m == 5 else (-4.5, 1.9)
    for cells, error in zip((64, 128, 256, 512, 1024), errors, strict=True):
        if error is not None:
            grid = Grid((cells, 8), (left * a, -a), (right * a, a))
            assert bool(grid_shortfalls(conditions, oil, flat_surface(grid))) == (
                abs(error) > 0.9
            ), cells


@pytest.mark.parametrize(("m", "l"), [(2.4, 17), (0.47, 17), (0.15, 17), (2.4, 5), (0.47, 5)])
def test_light_contacts_are_flooded(m, l):  # noqa: E741
    """Within 1 % of -30 a, where -4.5 a takes 2 to 69 % off."""
    conditions, oil, _ = line_case(m, l, "Roelands")
    a = conditions.hertz.half_widths[0]
    far = solve_contact(
        conditions, oil, flat_surface(Grid((1024, 8), (-30.0 * a, -a), (8.0 * a, a)))
    )
    near = solve_contact(conditions, oil, flat_surface(auto_grid(conditions, oil)))
    assert films(near) == pytest.approx(films(far), rel=0.01)


def test_a_soft_ball_has_the_film_of_the_soft_fit_and_no_contact():
    """Hamrock and Dowson (1978); at 64 cells a hand-made grid had a load share of 89 %."""
    case = load_case(SOFT)
    run = solve_case(case.with_overrides({"surface": "flat"}))
    solution = run.solution
    assert (
        run.determined
    )  # though the next coarser grid, which shows 2 cells of the inlet, has a load share of 24 %
    fits = {
        fit.place: fit
        for fit in regime_card(solution).fits
        if fit.source == "Hamrock and Dowson, soft (1978)"
    }
    assert abs(fits["central"].deviation) < 0.05
    assert abs(fits["least"].deviation) < 0.05
    assert not solution.in_contact.any()


SOFT = """
[contact]
geometry = "point"
radius = "10 mm"
load = "1 N"
entrainment_speed = "0.1 m/s"
[material]
youngs_modulus = ["5 MPa", "70 GPa"]
poisson_ratio = [0.49, 0.22]
[lubricant]
viscosity = { law = "barus", eta0 = "0.1 Pa s", alpha = "1 1/GPa" }
density = { law = "incompressible", rho0 = "1000 kg/m^3" }
rheology = "newtonian"
[surface]
kind = "gaussian"
sq = "0.5 um"
correlation_length = "200 um"
"""
BEARING = """
[contact]
geometry = "elliptic"
radius = ["5.11 mm", "165 mm"]
load = "4944 N"
entrainment_speed = "0.3 m/s"
[material]
youngs_modulus = "200.2 GPa"
poisson_ratio = 0.3
hardness = "7 GPa"
[lubricant]
viscosity = { law = "roelands", eta0 = "0.04 Pa s", alpha = "23 1/GPa" }
density = { law = "dowson-higginson", rho0 = "870 kg/m^3" }
rheology = "newtonian"
[surface]
kind = "gaussian"
sq = "0.11 um"
correlation_length = ["60 um", "120 um"]
seed = 1
"""


def test_the_film_ratio_of_a_soft_contact_is_made_of_the_soft_fit():
    case = load_case(SOFT).with_overrides(
        {"grid.cells": [64, 64], "grid.x": [-2, 1.5], "grid.y": [-2, 2]}
    )
    state = contact_state(solve_contact(case.conditions, case.lubricant, case.surface()))
    assert state.lambda_ratio == pytest.approx(
        2.98e-6 / 0.5e-6, rel=0.01
    )  # 0.10 by the hard piezoviscous fit


@pytest.mark.parametrize("cells", [(128, 128), (192, 128), (256, 192)])
def test_a_ball_bearing_on_grids_that_give_three_load_shares_is_not_determined(cells):
    """87, 46 and 2 % where 0.02 % is true: the inlet of 11 um has 0.8 to 1.6 cells."""
    case = load_case(BEARING).with_overrides(
        {"grid.cells": list(cells), "grid.x": [-4.5, 1.5], "grid.y": [-1.4, 1.4]}
    )
    shortfalls = grid_shortfalls(case.conditions, case.lubricant, case.surface())
    assert "cells across the inlet" in shortfalls[0]
    chosen = load_case(BEARING)
    assert grid_shortfalls(chosen.conditions, chosen.lubricant, chosen.surface()) == ()


def test_the_verdict_says_that_the_grid_is_too_coarse():
    case = load_case(BEARING).with_overrides(
        {
            "contact": {
                "geometry": "point",
                "radius": "10 mm",
                "load": "50 N",
                "entrainment_speed": "0.01 m/s",
            }
        }
        | {"surface": "flat", "grid.cells": [32, 32], "grid.x": [-4.5, 1.5], "grid.y": [-3, 3]}
    )
    run = solve_case(case, strict=False)
    assert run.determined is False
    assert "CLR not determined (" in run.verdict()
    assert run.summary()["determined"] is False
    fine = solve_case(case.with_overrides({"grid": {}, "contact.entrainment_speed": "1 m/s"}))
    assert fine.determined is True
    assert fine.verdict().startswith("Full film")


def test_a_chosen_grid_of_few_cells_still_has_a_coarser_one_that_tells_its_error():
    """Long waves in a dry contact ask for few cells; CLR was called determined without an interval
    there.
    """
    case = load_case(SOFT).with_overrides({"lubricant": "none", "grid": {"accuracy": 0.05}})
    run = solve_case(case)
    assert case.grid.cells == (96, 64)
    assert run.error.clr.numerical is not None
    assert run.determined
    coarse = solve_case(case.with_overrides({"grid": {"cells": [64, 64], "accuracy": None}}))
    assert coarse.error.clr.numerical is None
    assert coarse.determined is False
    assert "no coarser grid is available to estimate its error" in coarse.verdict()


def test_films_that_carry_nothing_need_no_inlet():
    """Towards no speed the inlet vanishes, and CLR is 1 on any grid."""
    surface = gaussian_surface(
        Grid((128, 128), (-250e-6, -90e-6), (107e-6, 90e-6)),
        sq=1e-6,
        correlation_length=20e-6,
        rng=np.random.default_rng(1),
    )
    assert grid_shortfalls(contact(speed=1e-4), barus(), surface) == ()
    assert (
        grid_shortfalls(contact(speed=5e-3, hardness=2e9), barus(), flat_surface(surface.grid))
        != ()
    )


def test_roughness_moves_the_edges_and_the_cells():
    conditions, oil = contact(), barus()
    a = conditions.hertz.half_widths[0]
    smooth = auto_grid(conditions, oil)
    rough = auto_grid(conditions, oil, Texture(sq=3e-6, lengths=(20e-6, 30e-6)))
    assert rough.upper[0] > 4.0 * a > 2.0 * a > smooth.upper[0]
    assert rough.spacing[0] < 20.001e-6 / 8.0
    assert rough.spacing[1] < 30.001e-6 / 8.0
    assert rough.extent[1] == pytest.approx(300e-6)
    finer = auto_grid(conditions, oil, Texture(sq=3e-6, lengths=(20e-6, 30e-6)), accuracy=0.0025)
    assert finer.spacing[0] == pytest.approx(rough.spacing[0] / 2.0, rel=0.05)
    short = auto_grid(
        conditions, oil, Texture(sq=3e-6, lengths=(20e-6, 30e-6), most=(200e-6, 100e-6))
    )
    assert short.extent == pytest.approx((200e-6, 100e-6))
    with pytest.raises(BadInput, match=r"accuracy must lie between 0.0001 and 0.2, got 0.5"):
        auto_grid(conditions, oil, accuracy=0.5)


def test_a_contact_has_its_asperities_inside_the_chosen_grid():
    """The paper's contact at Sq 1.5 um touches out to the outlet of the printed domain, and not of
    this one.
    """
    case = load_case(BEARING).with_overrides(
        {"contact": {"geometry": "line", "radius": "5.4 mm", "length": "10 mm", "load": "500 N"}}
        | {
            "contact.entrainment_speed": "0.001 m/s",
            "lubricant": "none",
            "material.hardness": "2 GPa",
        }
        | {"surface.sq": "1.5 um", "surface.correlation_length": "20 um"}
    )
    run = solve_case(case, strict=False)
    assert not any("runs into" in note for note in run.notes)
    touching = np.flatnonzero(run.solution.in_contact.any(axis=1))
    a = case.conditions.hertz.half_widths[0]
    assert run.solution.grid.x[touching[-1]] > 1.9 * a


def test_every_fit_that_holds_is_met_by_the_solved_film():
    """Hard, soft and rigid: least films of published fits and central ones, on the chosen grid."""
    oils = {
        "hard": Lubricant(
            viscosity=Roelands(0.04, 22e-9), density=DowsonHigginson(870.0), rheology=Newtonian()
        ),
        "thin": Lubricant(
            viscosity=Barus(0.1, 1e-12), density=DowsonHigginson(870.0), rheology=Newtonian()
        ),
    }
    for conditions, oil, regime in [
        (contact(load=5000.0, speed=1.0), oils["hard"], "piezoviscous-elastic"),
        (contact(load=5000.0, speed=1.0), oils["thin"], "isoviscous-elastic"),
        (contact(load=20.0, speed=1.0), oils["thin"], "isoviscous-rigid"),
    ]:
        assert film_fits(conditions, oil)
        a = conditions.hertz.half_widths[0]
        inlet = (
            (-200.0 * a, 30.0 * a) if regime == "isoviscous-rigid" else None
        )  # farther than a grid is chosen
        solution = solve_contact(conditions, oil, flat_surface(auto_grid(conditions, oil, x=inlet)))
        assert regime_card(solution).regime == regime
        for fit in regime_card(solution).fits:
            assert abs(fit.deviation) < 0.15, (fit, fit.deviation)
