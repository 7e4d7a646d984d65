"""Smooth bodies need few iterations per grid: the approximate inverse, local refinement of the
worst cells and the start of a roller.
"""

from dataclasses import replace

import numpy as np
import pytest
from benchmarks import rollers
from benchmarks.films import BARUS, NO_FLOOR, REFERENCE, ROELANDS, ball, line_case

from asperity.contact.grid import Grid
from asperity.contact.rollers import RollerShape
from asperity.ehl import Options, Scales, solve_contact
from asperity.ehl.linear_solvers import mixed as mixed_linear
from asperity.ehl.models.mixed import Pressures, evaluate
from asperity.ehl.newton.mixed import newton
from asperity.ehl.problem_setup import contact_problem
from asperity.ehl.strategies.local_refinement import refine_locally
from asperity.surface import flat_surface

OPTIONS = Options(contact_film=NO_FLOOR)


def on_a_grid(conditions, cells):
    a, b = conditions.hertz.half_widths
    return flat_surface(
        Grid((cells, cells), (-4.5 * a, -3.0 * b), (1.5 * a, 3.0 * b), periodic=(False, False))
    )


@pytest.fixture(scope="module")
def solved():
    """Return the problem of a ball with a sharp pressure spike and its converged solution."""
    conditions, _ = ball(20, 10)
    surface = on_a_grid(conditions, 65)
    problem = contact_problem(conditions, BARUS, surface, OPTIONS)
    solution = solve_contact(conditions, BARUS, surface, options=replace(OPTIONS, tolerance=1e-7))
    scales = Scales.from_conditions(conditions, BARUS)
    pressure = solution.pressure / scales.pressure
    return problem, Pressures(pressure, pressure, solution.rigid_approach / scales.gap)


def dented(problem, unknowns):
    """Return the solution with the pressure spike reduced by a tenth in a few cells."""
    x, y = np.meshgrid(problem.x, problem.y, indexing="ij")
    spike = (np.abs(x - 0.5) < 0.15) & (np.abs(y) < 0.3)
    total = np.where(spike, 0.9, 1.0) * unknowns.total
    return spike, Pressures(total, total, unknowns.approach)


def test_local_refinement_solves_the_worst_cells_alone(solved):
    """The box takes the solution of the whole contact, and no cell outside it changes."""
    problem, exact = solved
    spike, start = dented(problem, exact)
    found = refine_locally(problem, start)
    assert found.approach == exact.approach
    deviation = np.abs(start.total - exact.total).max()
    assert deviation > 0.1
    assert np.abs(found.total - exact.total).max() < 0.15 * deviation
    far = (np.abs(problem.x - 0.5) > 1.6)[:, None] | (np.abs(problem.y) > 1.6)
    np.testing.assert_array_equal(found.total[far], exact.total[far])
    assert not np.any(spike & far)
    before, after = (
        evaluate(problem, unknowns, second_order=False).residual_rms for unknowns in (start, found)
    )
    assert after < 0.15 * before


def test_local_refinement_skips_small_or_widespread_residuals(solved):
    problem, exact = solved
    np.testing.assert_array_equal(refine_locally(problem, exact).total, exact.total)
    noise = exact.total * (1.0 + 0.05 * np.random.default_rng(3).standard_normal(problem.cells))
    np.testing.assert_array_equal(
        refine_locally(problem, Pressures(noise, noise, exact.approach)).total, noise
    )


def test_fixed_cells_and_approach_do_not_change(solved):
    problem, exact = solved
    _, start = dented(problem, exact)
    fixed = np.broadcast_to(np.abs(problem.y) > 0.5, problem.cells)
    for step in newton(replace(problem, fixed=fixed), start, second_order=False):
        if step.number == 3:
            break
    assert step.approach == exact.approach
    np.testing.assert_array_equal(step.balance.unknowns.total[fixed], start.total[fixed])
    assert not np.any(step.balance.oil_residual[fixed])
    assert np.abs(step.balance.unknowns.total - start.total)[~fixed].max() > 0.05


@pytest.mark.parametrize(
    ("load_number", "oil_number", "oil", "most"),
    [
        (20, 10, BARUS, 5),
        (100, 5, BARUS, 3),
        (500, 10, ROELANDS, 4),
        (20, 2, BARUS, 3),
        (100, 15, ROELANDS, 5),
    ],
)
def test_few_iterations_per_grid_and_few_vectors_per_iteration(
    monkeypatch, load_number, oil_number, oil, most
):
    """On the finest grid. Earlier solvers needed up to 10 iterations (14 on 257 x 257) of 12 to 20
    vectors.
    """
    vectors, gmres = [], mixed_linear.gmres

    def counted(product, precondition, rhs, **options):
        vectors.append(0)

        def counting(vector):
            vectors[-1] += 1
            return product(vector)

        return gmres(counting, precondition, rhs, **options)

    monkeypatch.setattr(mixed_linear, "gmres", counted)
    conditions, unit = ball(load_number, oil_number)
    solution = solve_contact(conditions, oil, on_a_grid(conditions, 129), options=OPTIONS)
    finest = [step for step in solution.convergence.history if step.cells == (129, 129)]
    assert solution.convergence.attempt == "coarse to fine"
    assert len(finest) - 1 <= most
    assert max(vectors) <= 18
    assert np.mean(vectors) < 9.0
    found = np.interp(0.0, solution.grid.x, solution.gap[:, 64]) / unit, solution.gap.min() / unit
    key = (load_number, oil_number, oil.viscosity.__class__.__name__)
    if key in REFERENCE:
        assert found == pytest.approx(REFERENCE[key], rel=0.015)


def test_a_fine_line_uses_the_narrow_inverse():
    """Lines of five diverge on a single line of many cells: M 300 needed 68 iterations, and pivots
    vanished.
    """
    conditions, oil, unit = line_case(300, 10, "Roelands")
    a = conditions.hertz.half_widths[0]
    surface = flat_surface(Grid((1024, 8), (-2.5 * a, -a), (1.4 * a, a)))
    solution = solve_contact(conditions, oil, surface, options=OPTIONS)
    assert solution.convergence.attempt == "coarse to fine"
    assert solution.convergence.iterations <= 8
    assert solution.gap.min() / unit == pytest.approx(2.666, rel=1e-3)


@pytest.mark.parametrize("shape", ["straight", "lundberg"])
def test_a_roller_starts_from_its_dry_contact(shape):
    """No coarser grid predicts the load on sharp ends. A straight roller once needed 345 iterations
    and 25 times the time.
    """
    contact = rollers.conditions(RollerShape() if shape == "straight" else rollers.lundberg(1.0))
    wide = contact.sliced_load.peak**0.5
    surface = flat_surface(rollers.between(contact, (96, 192), (-4.5 * wide, 1.5 * wide)))
    solution = solve_contact(contact, rollers.OIL, surface)
    assert solution.convergence.attempt == "coarse to fine"
    assert solution.convergence.iterations <= 24
    tight = solve_contact(
        contact, rollers.OIL, surface, start=solution, options=Options(tolerance=1e-6)
    )
    np.testing.assert_allclose(tight.gap, solution.gap, rtol=1e-3)
