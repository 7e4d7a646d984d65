"""Half of a symmetric contact up to Y = 0: its solution equals that on the full grid."""

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

LINES = (24, 25)  # symmetry plane between two lines of cells, and through the middle line
CONDITIONS, UNIT = ball(20, 10)


def surface(cells, across=3.0):
    a = CONDITIONS.hertz.half_widths[0]
    return flat_surface(
        Grid(cells, (-4.5 * a, -across * a), (1.5 * a, 3.0 * a), periodic=(False, False))
    )


def problem_with(lines, **options):
    return contact_problem(CONDITIONS, BARUS, surface((26, lines)), Options(**options))


def perturbed_pressures(problem, *, floor=0.0):
    """Return a perturbed Hertz pressure, symmetric in y, on the full and on the half grid."""
    pressure, approach = first_guess(
        problem, CONDITIONS, BARUS, Scales.from_conditions(CONDITIONS, BARUS)
    )
    half = -(-problem.cells[1] // 2)
    noise = np.random.default_rng(3).uniform(0.8, 1.2, (problem.cells[0], half))
    part = np.maximum(pressure[:, :half] * noise + 0.02 * noise, floor)
    part[:, 0] = 0.0
    full_state = mirror_field(part, problem.cells[1])
    return Pressures(full_state, full_state, approach), Pressures(part, part, approach)


@pytest.mark.parametrize("lines", LINES)
@pytest.mark.parametrize("precision", [float, np.float32])
def test_deflection_on_the_half_includes_the_mirrored_pressure(lines, precision):
    half = -(-lines // 2)
    pressure = np.random.default_rng(1).random((26, half)).astype(precision)
    spacing, rtol = (0.1, 0.13), 1e-13 if precision is float else 2e-6
    whole = deflection((26, lines), spacing, 0.7, False)
    part = deflection((26, half), spacing, 0.7, False, 1 + lines % 2)
    expected = whole(mirror_field(pressure.astype(float), lines))[:, :half]
    assert part(pressure).dtype == precision
    np.testing.assert_allclose(part(pressure), expected, rtol=rtol)
    np.testing.assert_array_equal(part.local_compliance, whole.local_compliance)


@pytest.mark.parametrize("lines", LINES)
@pytest.mark.parametrize("model", ["mixed", "conserving", "paper"])
def test_residuals_on_the_half_equal_those_on_the_full_grid(lines, model):
    problem = problem_with(lines, model=model)
    part = reduced_problem(problem)
    assert part.mirror == 1 + lines % 2
    assert part.all_cells == problem.cells
    full_state, half_state = perturbed_pressures(problem)
    half = part.cells[1]
    if model == "paper":
        whole, reduced = (
            posed_problem.evaluate(at.total, at.approach)
            for posed_problem, at in ((problem, full_state), (part, half_state))
        )
        np.testing.assert_allclose(
            reduced.residual, whole.residual[:, :half], rtol=1e-9, atol=1e-12
        )
    else:
        whole, reduced = (
            evaluate(posed_problem, at, second_order=False)
            for posed_problem, at in ((problem, full_state), (part, half_state))
        )
        np.testing.assert_allclose(
            reduced.oil_residual, whole.oil_residual[:, :half], rtol=1e-9, atol=1e-12
        )
        np.testing.assert_allclose(
            reduced.outflow[:, 1:], whole.outflow[:, 1:half], rtol=1e-9, atol=1e-9
        )
    assert reduced.load_error == pytest.approx(whole.load_error, rel=1e-12)


@pytest.mark.parametrize("lines", LINES)
@pytest.mark.parametrize("accurate", [True, False])
def test_the_linearisation_on_the_half_equals_that_on_the_full_grid(lines, accurate):
    """Includes stencils: the last line adds the couplings across the symmetry plane to its own."""
    problem = replace(problem_with(lines), accurate=accurate)
    part = reduced_problem(problem)
    full_state, half_state = perturbed_pressures(problem)
    whole, reduced = (
        MixedLinear(evaluate(posed_problem, at, second_order=False), dtype=float)
        for posed_problem, at in ((problem, full_state), (part, half_state))
    )
    half = part.cells[1]
    step = np.random.default_rng(4).standard_normal(part.cells)
    step[:, 0] = 0.0
    expected = whole.product(mirror_field(step, lines), mirror_field(step, lines), 0.3)
    found = reduced.product(step, step, 0.3)
    for on_half, on_full in zip(found, expected, strict=True):
        np.testing.assert_allclose(on_half, on_full[:, :half], rtol=1e-9, atol=1e-9)

    (full_stencil, _), (stencil, _) = whole._stencil(), reduced._stencil()
    np.testing.assert_allclose(stencil.west, full_stencil.west[:, :half], rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(
        stencil.centre[:, :-1], full_stencil.centre[:, : half - 1], rtol=1e-9, atol=1e-12
    )
    assert not np.any(stencil.north[:, -1])
    rows = [
        sum(
            np.sum(coupling[:, half - 1])
            for coupling in (matrix.centre, matrix.north, matrix.south)
        )
        for matrix in (full_stencil, stencil)
    ]
    assert rows[1] == pytest.approx(rows[0], rel=1e-9)


@pytest.mark.parametrize("lines", [24, 25, 26, 27])
def test_coarser_grids_keep_the_symmetry_plane(lines):
    part = reduced_problem(problem_with(lines))
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


def test_asymmetric_problems_keep_the_full_grid():
    assert reduced_problem(problem_with(24)).mirror
    shifted = contact_problem(CONDITIONS, BARUS, surface((26, 24), across=2.9), Options())
    factor = np.ones((26, 24))
    factor[:, 3] = 0.9
    heated = contact_problem(CONDITIONS, BARUS, surface((26, 24)), Options(), factor)
    rough = replace(problem_with(24), roughness=np.full((26, 24), 1e-3))
    for problem in (shifted, heated, rough):
        assert reduced_problem(problem) is problem
    even = contact_problem(
        CONDITIONS, BARUS, surface((26, 24)), Options(), 0.5 * (factor + factor[:, ::-1])
    )
    assert reduced_problem(even).mirror


@pytest.mark.parametrize("cells", [(64, 64), (65, 65)])
@pytest.mark.parametrize("model", ["mixed", "conserving", "paper"])
def test_the_solution_on_the_half_equals_that_on_the_full_grid(cells, model, monkeypatch):
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


def test_grid_levels_of_the_half_match_those_of_the_full_grid():
    for cells in ((256, 256), (257, 257), (152, 104)):
        problem = contact_problem(CONDITIONS, BARUS, surface(cells), Options())
        full, halves = grid_levels(problem), grid_levels(reduced_problem(problem))
        assert [level.cells for level in full] == [level.all_cells for level in halves]
