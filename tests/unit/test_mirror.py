"""The half of a smooth contact up to Y = 0: what is solved on it is what is solved on all cells."""

from dataclasses import replace

import numpy as np
import pytest
from benchmarks.films import BARUS, ROELANDS, ball

from asperity.contact.grid import Grid
from asperity.ehl import Options, Scales, solve_contact
from asperity.ehl.deflection import deflection
from asperity.ehl.grid_transfer import mirror_field
from asperity.ehl.linear_solvers.mixed import MixedLinear
from asperity.ehl.models.mixed import Pressures, evaluate
from asperity.ehl.models.single_pressure import Problem
from asperity.ehl.problem_setup import contact_problem, first_guess, grid_levels, reduced_problem
from asperity.surface import flat_surface

LINES = (24, 25)  # a mirror between two lines of cells, and one through the middle one
CONDITIONS, UNIT = ball(20, 10)


def surface(cells, across=3.0):
    a = CONDITIONS.hertz.half_widths[0]
    return flat_surface(
        Grid(cells, (-4.5 * a, -across * a), (1.5 * a, 3.0 * a), periodic=(False, False))
    )


def posed(lines, **options):
    return contact_problem(CONDITIONS, BARUS, surface((26, lines)), Options(**options))


def pressed(problem, *, least=0.0):
    """Hertz's pressure and some that is no solution, symmetric in y; and the half of it."""
    pressure, approach = first_guess(
        problem, CONDITIONS, BARUS, Scales.from_conditions(CONDITIONS, BARUS)
    )
    half = -(-problem.cells[1] // 2)
    noise = np.random.default_rng(3).uniform(0.8, 1.2, (problem.cells[0], half))
    part = np.maximum(pressure[:, :half] * noise + 0.02 * noise, least)
    part[:, 0] = 0.0
    everywhere = mirror_field(part, problem.cells[1])
    return Pressures(everywhere, everywhere, approach), Pressures(part, part, approach)


@pytest.mark.parametrize("lines", LINES)
@pytest.mark.parametrize("precision", [float, np.float32])
def test_what_lies_behind_the_mirror_presses_too(lines, precision):
    half = -(-lines // 2)
    pressure = np.random.default_rng(1).random((26, half)).astype(precision)
    spacing, close = (0.1, 0.13), 1e-13 if precision is float else 2e-6
    whole = deflection((26, lines), spacing, 0.7, False)
    part = deflection((26, half), spacing, 0.7, False, 1 + lines % 2)
    expected = whole(mirror_field(pressure.astype(float), lines))[:, :half]
    assert part(pressure).dtype == precision
    np.testing.assert_allclose(part(pressure), expected, rtol=close)
    np.testing.assert_array_equal(part.local_compliance, whole.local_compliance)


@pytest.mark.parametrize("lines", LINES)
@pytest.mark.parametrize("model", ["mixed", "conserving", "paper"])
def test_each_cell_leaves_what_it_leaves_on_all_cells(lines, model):
    problem = posed(lines, model=model)
    part = reduced_problem(problem)
    assert part.mirror == 1 + lines % 2
    assert part.all_cells == problem.cells
    everywhere, here = pressed(problem)
    half = part.cells[1]
    if model == "paper":
        whole, some = (
            each.evaluate(at.total, at.approach)
            for each, at in ((problem, everywhere), (part, here))
        )
        np.testing.assert_allclose(some.residual, whole.residual[:, :half], rtol=1e-9, atol=1e-12)
    else:
        whole, some = (
            evaluate(each, at, second_order=False)
            for each, at in ((problem, everywhere), (part, here))
        )
        np.testing.assert_allclose(
            some.oil_residual, whole.oil_residual[:, :half], rtol=1e-9, atol=1e-12
        )
        np.testing.assert_allclose(
            some.outflow[:, 1:], whole.outflow[:, 1:half], rtol=1e-9, atol=1e-9
        )
    assert some.load_error == pytest.approx(whole.load_error, rel=1e-12)


@pytest.mark.parametrize("lines", LINES)
@pytest.mark.parametrize("accurate", [True, False])
def test_its_linearisation_is_that_of_all_cells(lines, accurate):
    """Stencils too: on the last line they have the couplings behind the mirror on their side
    of it.
    """
    problem = replace(posed(lines), accurate=accurate)
    part = reduced_problem(problem)
    everywhere, here = pressed(problem)
    whole, some = (
        MixedLinear(evaluate(each, at, second_order=False), dtype=float)
        for each, at in ((problem, everywhere), (part, here))
    )
    half = part.cells[1]
    step = np.random.default_rng(4).standard_normal(part.cells)
    step[:, 0] = 0.0
    expected = whole.product(mirror_field(step, lines), mirror_field(step, lines), 0.3)
    found = some.product(step, step, 0.3)
    for one, all_of_them in zip(found, expected, strict=True):
        np.testing.assert_allclose(one, all_of_them[:, :half], rtol=1e-9, atol=1e-9)

    (of_all, _), (stencil, _) = whole._stencil(), some._stencil()
    np.testing.assert_allclose(stencil.west, of_all.west[:, :half], rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(
        stencil.centre[:, :-1], of_all.centre[:, : half - 1], rtol=1e-9, atol=1e-12
    )
    assert not np.any(stencil.north[:, -1])
    rows = [
        sum(np.sum(coupling[:, half - 1]) for coupling in (each.centre, each.north, each.south))
        for each in (of_all, stencil)
    ]
    assert rows[1] == pytest.approx(rows[0], rel=1e-9)


@pytest.mark.parametrize("lines", [24, 25, 26, 27])
def test_coarser_grids_have_their_mirror_in_the_same_place(lines):
    part = reduced_problem(posed(lines))
    coarse = part.coarsened((13, (lines + 1) // 2))
    assert coarse.mirror == part.mirror
    assert coarse.y[-1] == pytest.approx(0.0 if lines % 2 else -0.5 * coarse.spacing[1], abs=1e-12)
    assert coarse.lower == part.lower
    assert coarse.all_cells[1] * coarse.spacing[1] == pytest.approx(lines * part.spacing[1])
    parabola = np.broadcast_to(9.0 - coarse.y**2, coarse.cells)
    inside = (part.y > coarse.y[1]) & (part.y < 0.0)
    expected = np.broadcast_to(9.0 - part.y**2, part.cells)
    np.testing.assert_allclose(
        part.interpolate(parabola, cubic=True)[:, inside], expected[:, inside], atol=1e-12
    )


def test_what_is_not_the_same_on_both_sides_keeps_all_its_cells():
    assert reduced_problem(posed(24)).mirror
    aside = contact_problem(CONDITIONS, BARUS, surface((26, 24), across=2.9), Options())
    warm = np.ones((26, 24))
    warm[:, 3] = 0.9
    heated = contact_problem(CONDITIONS, BARUS, surface((26, 24)), Options(), warm)
    rough = replace(posed(24), roughness=np.full((26, 24), 1e-3))
    for problem in (aside, heated, rough):
        assert reduced_problem(problem) is problem
    even = contact_problem(
        CONDITIONS, BARUS, surface((26, 24)), Options(), 0.5 * (warm + warm[:, ::-1])
    )
    assert reduced_problem(even).mirror


@pytest.mark.parametrize("cells", [(64, 64), (65, 65)])
@pytest.mark.parametrize("model", ["mixed", "conserving", "paper"])
def test_both_sides_are_solved_as_one_is(cells, model, monkeypatch):
    flat, options = surface(cells), Options(tolerance=1e-6, model=model)
    half = solve_contact(CONDITIONS, ROELANDS, flat, options=options)
    again = solve_contact(CONDITIONS, ROELANDS, flat, options=options, start=half)
    assert again.convergence.iterations <= 2
    monkeypatch.setattr(Problem, "symmetric", False)
    whole = solve_contact(CONDITIONS, ROELANDS, flat, options=options)
    assert half.pressure.shape == cells
    assert half.convergence.history[-1].cells == cells
    p_max = CONDITIONS.hertz.p_max
    np.testing.assert_array_equal(half.pressure, half.pressure[:, ::-1])
    np.testing.assert_allclose(half.pressure, whole.pressure, atol=1e-4 * p_max)
    np.testing.assert_allclose(half.gap, whole.gap, rtol=1e-4)


def test_levels_of_a_half_are_halves_of_the_levels():
    for cells in ((256, 256), (257, 257), (152, 104)):
        problem = contact_problem(CONDITIONS, BARUS, surface(cells), Options())
        wholes, parts = grid_levels(problem), grid_levels(reduced_problem(problem))
        assert [each.cells for each in wholes] == [each.all_cells for each in parts]
