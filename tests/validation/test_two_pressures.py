"""The mixed model with separate pressures of oil and asperities: its limits and its independence of
the start.
"""

import tracemalloc
from dataclasses import replace
from itertools import islice
from pathlib import Path

import numpy as np
import pytest
from benchmarks.chosen_grids import samples

from asperity.case import load_case
from asperity.contact.grid import Grid
from asperity.ehl import Options, solve_contact
from asperity.ehl import solve as solving
from asperity.ehl.controls import DRY, PRECONDITIONER, RESIDUALS
from asperity.ehl.grid_design import auto_grid
from asperity.ehl.linear_solvers.mixed import MixedLinear, extend_lubrication, is_firm
from asperity.ehl.load_shares import carried_share
from asperity.ehl.models import plastic_dry as dry
from asperity.ehl.models.mixed import Pressures, evaluate
from asperity.ehl.models.plastic_dry import dry_contact
from asperity.ehl.newton import mixed as mixed_iterate
from asperity.ehl.newton.mixed import newton
from asperity.ehl.problem_setup import contact_problem, first_guess, grid_levels
from asperity.ehl.scales import Scales
from asperity.ehl.strategies import initial_guess as starts
from asperity.ehl.strategies.cold_start import STRATEGIES, solve_from_dry
from asperity.ehl.strategies.initial_guess import dry_start
from asperity.ehl.strategies.mixed_search import MixedSearch
from asperity.ehl.strategies.one_grid import march_in_time, solve_again
from asperity.kernels.reynolds import CAPPED, LUBRICATED, RUPTURED, TOUCHING
from asperity.lubricant import Roelands
from asperity.solution import contact_state
from asperity.solution.state import balance_of
from asperity.surface import flat_surface, gaussian_surface
from support.paper import barus, contact, grid, rough

PAPER = Path(__file__).parents[2] / "examples" / "paper.toml"
COARSE = grid((64, 64))
MIXED = Options(model="mixed")


def clr(solution):
    return contact_state(solution).clr


def ball(*, speed, hardness):
    return contact(
        geometry="point", radius=10e-3, load=15.0, length=None, speed=speed, hardness=hardness
    )


@pytest.mark.parametrize("hardness", [0.7e9, 2e9, 7e9])
@pytest.mark.parametrize("sq", [0.5e-6, 2.5e-6])
def test_a_line_contact_without_speed_is_dry(sq, hardness):
    slow = contact(speed=1e-4, hardness=hardness)
    assert clr(solve_contact(slow, barus(), rough(COARSE, sq), options=MIXED)) > 0.999


@pytest.mark.parametrize("hardness", [2e9, 7e9])
def test_a_ball_without_speed_is_dry(hardness):
    slow = ball(speed=1e-4, hardness=hardness)
    a = slow.hertz.half_widths[0]
    on = Grid((64, 64), (-2.5 * a, -2.0 * a), (1.5 * a, 2.0 * a), periodic=(False, False))
    surface = gaussian_surface(
        on, sq=0.3e-6, correlation_length=20e-6, rng=np.random.default_rng(1)
    )
    assert clr(solve_contact(slow, barus(), surface, options=MIXED)) > 0.999


@pytest.fixture
def arithmetic_faces(monkeypatch):
    """Let `solve_contact` end with arithmetic mean mobilities, its initial guess otherwise."""
    monkeypatch.setattr(
        solving, "contact_problem", lambda *given: replace(contact_problem(*given), exact=False)
    )


@pytest.mark.usefixtures("arithmetic_faces")
def test_the_load_share_of_the_paper_contact_agrees_with_an_independent_program():
    """The independent program of the same equations gives 0.750 on this grid."""
    case = load_case(PAPER).with_overrides({"grid.cells": "[64, 64]", "model": "mixed"})
    solution = solve_contact(case.conditions, case.lubricant, case.surface(), options=case.options)
    assert clr(solution) == pytest.approx(0.7499, abs=0.005)


def test_a_solve_holds_the_fields_of_few_newton_steps():
    """A Newton step has some 30 fields; with earlier iterates and grids kept they were 152."""
    case = load_case(PAPER).with_overrides({"grid.cells": "[128, 128]", "model": "mixed"})
    surface = case.surface()

    def solve():
        solve_contact(case.conditions, case.lubricant, surface, options=case.options)

    solve()  # loads compiled kernels
    tracemalloc.start()
    try:
        solve()
        _, most = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    assert most < 115 * surface.heights.nbytes


def test_two_starts_give_the_same_solution():
    """All load on the asperities, or all in the oil."""
    conditions, oil, surface = contact(hardness=2e9), barus(), rough(COARSE, 1e-6, seed=7)
    problem, scales = (
        contact_problem(conditions, oil, surface, MIXED),
        Scales.from_conditions(conditions, oil),
    )

    problem = replace(problem, exact=False)
    dry, hertz = MixedSearch(MIXED, scales.gap, None), MixedSearch(MIXED, scales.gap, None)
    solve_from_dry(dry, [problem])
    STRATEGIES[1].solve(
        hertz, grid_levels(problem), lambda level: first_guess(level, conditions, oil, scales)
    )
    for search in (dry, hertz):
        assert search.converged(MIXED.tolerance)
        solve_again(search, search.solved)
        assert search.converged(MIXED.tolerance)
    assert dry.figures[-1].clr == pytest.approx(hertz.figures[-1].clr, abs=0.002)


@pytest.mark.parametrize("seed", [7, 8])
def test_corrections_of_the_coarse_grid_start_the_finer_one(seed):
    """The same solution in two thirds of the iterations on the fine grid; a limit of twelve steps
    after the change of grid is too low for the second surface.
    """
    conditions, oil, surface = (
        contact(hardness=2e9),
        barus(),
        rough(grid((192, 192)), 2.5e-6, seed=seed),
    )
    levels, scales = (
        grid_levels(replace(contact_problem(conditions, oil, surface, MIXED), exact=False)),
        Scales.from_conditions(conditions, oil),
    )
    searches = {number: MixedSearch(MIXED, scales.gap, None) for number in (1, len(levels))}
    steps = {}
    for number, search in searches.items():
        solve_from_dry(search, levels[:number])
        assert search.converged(MIXED.tolerance)
        steps[number] = sum(step.cells == (192, 192) for step in search.history)
    assert steps[len(levels)] < 0.7 * steps[1]
    direct, nested = (search.figures[-1].clr for search in searches.values())
    assert nested == pytest.approx(direct, abs=0.002)


@pytest.mark.parametrize("sq", [1e-6, 4e-6])
def test_a_dry_start_follows_from_the_coarser_grids(sq, monkeypatch):
    """The solution from Hertz's pressure, without conjugate gradients, which fail when most cells
    are at the cap.
    """
    fine, coarse = grid_levels(
        contact_problem(contact(hardness=2e9), barus(), rough(grid((96, 96)), sq), MIXED)
    )[:2]
    alone = dry_start(fine)
    total, approach = dry_start(coarse)
    monkeypatch.setattr(starts, "dry_contact", None)
    followed = dry_start(
        fine, Pressures(np.zeros_like(total), total, approach + coarse.contact_gap)
    )
    assert followed[1] == pytest.approx(alone[1], abs=0.01)
    assert np.sqrt(np.mean((followed[0] - alone[0]) ** 2)) < 0.02 * np.sqrt(np.mean(alone[0] ** 2))


@pytest.mark.parametrize("sq", [1e-6, 4e-6])
def test_a_dry_start_by_active_sets_agrees_with_newton(sq, monkeypatch):
    """From Hertz's pressure and from the coarser grid; in single precision, without Newton
    iterations.
    """
    levels = grid_levels(
        contact_problem(contact(hardness=2e9), barus(), rough(grid((96, 96)), sq), MIXED)
    )
    monkeypatch.setattr(starts, "RESIDUALS", replace(RESIDUALS, rough_solution=1e-5))
    with monkeypatch.context() as newton_only:
        newton_only.setattr(starts, "active_set_dry", lambda _, *start: (*start[:2], False))
        expected = [dry_start(level) for level in levels]
    monkeypatch.setattr(starts, "newton", None)
    monkeypatch.setattr(starts, "dry_contact", None)
    coarser = None
    for level, (pressure, approach) in reversed(list(zip(levels, expected, strict=True))):
        total, distance = dry_start(level, coarser)
        np.testing.assert_allclose(total, pressure, atol=0.01 * level.p_cap)
        assert distance == pytest.approx(approach, abs=1e-3)
        assert total.max() == level.p_cap
        coarser = Pressures(np.zeros_like(total), total, distance + level.contact_gap)


def test_a_dry_start_falls_back_on_newton_if_active_sets_fail(monkeypatch):
    problem = contact_problem(contact(hardness=2e9), barus(), rough(grid((64, 64)), 1e-6), MIXED)
    expected = dry_start(problem)
    monkeypatch.setattr(dry, "DRY", replace(DRY, max_rounds=1))
    found = dry_start(problem)
    assert found[1] != expected[1]
    assert found[1] == pytest.approx(expected[1], abs=0.01)


def test_a_hard_dry_start_does_not_stagnate_at_the_cap(monkeypatch):
    """Newton's method from the coarser grid's pressures stagnated at a hundredth of p_h on this
    ellipse for seconds.
    """
    hard = contact(
        geometry="elliptic",
        radius=(19.5e-3, 0.233),
        load=9460.0,
        length=None,
        speed=0.03,
        hardness=6.3e9,
    )
    a, b = hard.hertz.half_widths
    on = Grid((528, 288), (-1.6 * a, -1.3 * b), (1.3 * a, 1.3 * b), periodic=(False, False))
    surface = gaussian_surface(
        on, sq=0.184e-6, correlation_length=(153e-6, 552e-6), rng=np.random.default_rng(2)
    )
    fine, coarse = grid_levels(contact_problem(hard, barus(), surface, MIXED))[2:4]
    total, approach = dry_start(coarse)
    monkeypatch.setattr(starts, "dry_contact", None)
    start = dry_start(fine, Pressures(np.zeros_like(total), total, approach + coarse.contact_gap))
    residual = replace(fine, lubricant=None, contact_gap=0.0).evaluate(*start)
    assert residual.residual_rms < 1e-3
    assert abs(residual.load_error) < 1e-3


def test_a_step_away_from_a_solution_is_shortened():
    """At least a sixteenth of the step is taken, and the full step far from a solution."""
    case = load_case(PAPER).with_overrides({"grid.cells": "[64, 64]", "model": "mixed"})
    surface = case.surface()
    solved = balance_of(
        solve_contact(case.conditions, case.lubricant, surface, options=case.options)
    )
    zero = np.zeros_like(solved.unknowns.total)
    for balance, share in (
        (solved, 0.0625),
        (replace(solved, oil_residual=solved.oil_residual + 1.0), 1.0),
    ):
        result = mixed_iterate._line_search(
            mixed_iterate._StepProposal(balance, Pressures(zero, zero, -0.2), 1.0),
            second_order=True,
        )
        assert solved.unknowns.approach - result.unknowns.approach == pytest.approx(0.2 * share)


@pytest.mark.usefixtures("arithmetic_faces")
def test_a_cell_in_deep_overlap_does_not_cycle():
    """One cell of this surface cycled between cap and oil for seventy iterations on the finest
    grid.
    """
    surface = gaussian_surface(
        grid((256, 256)), sq=0.5e-6, correlation_length=20e-6, rng=np.random.default_rng(1)
    )
    case = load_case(PAPER)
    solution = solve_contact(case.conditions, case.lubricant, surface, options=MIXED)
    assert sum(step.cells == (256, 256) for step in solution.convergence.history) < 30


def hard_ball():
    """Return a problem of a ball of through-hardened steel at a film ratio of 0.2, its dry start
    and a search.
    """
    hard = contact(
        geometry="point", radius=9.6e-3, load=45.0, length=None, speed=0.41, hardness=6.5e9
    )
    a = hard.hertz.half_widths[0]
    on = Grid((120, 80), (-2.0 * a, -1.4 * a), (1.4 * a, 1.4 * a), periodic=(False, False))
    surface = gaussian_surface(
        on, sq=0.25e-6, correlation_length=(38e-6, 56e-6), rng=np.random.default_rng(2)
    )
    oil = replace(barus(), viscosity=Roelands(14e-3, 20e-9))
    problem = replace(contact_problem(hard, oil, surface, MIXED), exact=False)
    scales = Scales.from_conditions(hard, oil)
    total, approach, _ = dry_contact(
        replace(problem, lubricant=None, contact_gap=0.0), hertz_pressure(problem)
    )
    dry = Pressures(np.zeros_like(total), total, approach + problem.contact_gap)
    return problem, dry, MixedSearch(MIXED, scales.gap, None)


def hertz_pressure(problem):
    across = problem.y / problem.form.aspect
    return np.sqrt(np.maximum(1.0 - (problem.x**2)[:, None] - across**2, 0.0))


def test_time_stepping_converges_where_newton_alone_does_not():
    """Hard steel: eighty Newton iterations from the dry contact cycle; pseudo-time stepping
    converges.
    """
    problem, dry, search = hard_ball()
    search.run(problem, newton(problem, dry, second_order=False), 1e-2, 80)
    assert not search.converged(1e-2)
    assert len(search.history) > 80

    search.history.clear()
    marched = march_in_time(search, problem, dry, 1.0, tolerance=1e-2)
    steady = search.run(
        problem, newton(problem, marched.balance.unknowns, second_order=False), 1e-4, 80
    )
    assert search.converged(1e-4)
    assert len(search.history) < 200
    # the last time step was long: its transient term is negligible
    shares = [
        carried_share(step.balance.pressure, step.balance.in_contact) for step in (marched, steady)
    ]
    assert shares[0] == pytest.approx(shares[1], abs=0.02)


def test_the_linearisation_includes_the_slope_limiter():
    """The linearised equations of an open, rough film are the derivatives of its outflow, including
    the second order.
    """
    problem = contact_problem(
        contact(load=500.0), barus(), rough(COARSE, 0.2e-6, correlation_length=80e-6), MIXED
    )
    rng, start = np.random.default_rng(3), 0.01 + hertz_pressure(problem)
    point = Pressures(start, start, 2.0)
    balance = evaluate(problem, point, second_order=True)
    assert balance.limiter.max() > 0.4
    assert balance.parted.all()
    change = rng.standard_normal(start.shape) * balance.solved
    wet, _ = MixedLinear(balance, float).product(change, change, 0.0)
    tiny = 1e-6
    outflows = [
        evaluate(
            problem,
            Pressures(start + signed_step * change, start + signed_step * change, 2.0),
            second_order=True,
        ).outflow
        for signed_step in (tiny, -tiny)
    ]
    slope = (outflows[0] - outflows[1]) / (2.0 * tiny) * balance.rows.fluid_scale
    np.testing.assert_allclose(
        wet[balance.solved], slope[balance.solved], atol=1e-6 * np.abs(wet).max()
    )


def test_oil_fills_a_streak_of_closed_cells_in_one_step():
    """Ruptured cells closed at the cap are filled in one step with the filling cells upstream, and
    no others.
    """
    problem = contact_problem(
        contact(speed=10.0, hardness=0.9e9), barus(), rough(COARSE, 2e-6, seed=7), MIXED
    )
    total, approach, _ = dry_contact(
        replace(problem, lubricant=None, contact_gap=0.0), hertz_pressure(problem)
    )
    oil = np.where(np.random.default_rng(5).random(total.shape) < 0.3, 0.3 * total, 0.0)
    before = evaluate(problem, Pressures(oil, total, approach), second_order=False)
    after = extend_lubrication(before)
    closed = (before.solid == CAPPED) & (before.gap <= 1.01 * problem.contact_gap)
    filling, expected = np.zeros(problem.cells[1], dtype=bool), np.zeros(problem.cells, dtype=bool)
    for i in range(problem.cells[0]):
        filling = closed[i] & (
            filling | ((before.rows.state[i] == LUBRICATED) & (before.oil_residual[i] < 0.0))
        )
        expected[i] = filling & (before.rows.state[i] == RUPTURED)
    assert expected.sum() > 20
    np.testing.assert_array_equal(after.rows.state != before.rows.state, expected)
    assert (after.rows.state[expected] == LUBRICATED).all()
    balanced = (before.outflow * before.rows.fluid_scale)[expected]
    np.testing.assert_array_equal(after.oil_residual[expected], balanced)
    np.testing.assert_array_equal(after.oil_residual[~expected], before.oil_residual[~expected])


def test_the_asperities_carry_the_remainder_of_the_pressure():
    """The oil pressure lies between zero and the total; only touching asperities carry load."""
    solution = solve_contact(
        contact(hardness=2e9), barus(), rough(COARSE, 1e-6, seed=7), options=MIXED
    )
    solid_pressure = solution.pressure - solution.oil.pressure
    assert solution.oil.pressure.min() >= 0.0
    assert solid_pressure.min() > -1e-3 * solution.pressure.max()
    np.testing.assert_allclose(
        solid_pressure[~solution.in_contact], 0.0, atol=1e-3 * solution.pressure.max()
    )


def test_the_residual_of_a_closed_cell_increases_with_its_pressure():
    """Scaled by the derivative of an open cell it would hardly change, and trapped oil would count
    as balanced.
    """
    fast = contact(speed=10.0, hardness=7e9)
    given = fast, barus(), rough(COARSE, 1e-6, seed=7), MIXED
    problem = replace(contact_problem(*given), exact=False)
    hertz = np.sqrt(np.maximum(1.0 - problem.x**2, 0.0))[:, None] * np.ones(problem.cells)
    total, approach, _ = dry_contact(replace(problem, lubricant=None, contact_gap=0.0), hertz)
    before = evaluate(problem, Pressures(0.3 * total, total, approach), second_order=False)
    closed = (
        (before.solid == TOUCHING)
        & (before.rows.state == LUBRICATED)
        & (before.gap < problem.contact_gap)
    )
    assert closed.sum() > 5
    for cell in list(zip(*np.nonzero(closed), strict=True))[:5]:
        oil = before.unknowns.oil.copy()
        oil[cell] += 1e-6
        after = evaluate(problem, before.unknowns._replace(oil=oil), second_order=False)

        assert after.oil_residual[cell] - before.oil_residual[cell] > 0.9e-6


def test_a_full_film_agrees_with_the_paper_model():
    """Smooth bodies: no cell touches, and both models solve the same equation."""
    flooded, surface = contact(speed=10.0), flat_surface(grid((128, 8)))
    mixed, paper = (
        contact_state(
            solve_contact(flooded, barus(), surface, options=Options(model=model, tolerance=1e-6))
        )
        for model in ("mixed", "paper")
    )
    assert mixed.clr == paper.clr == 0.0
    assert mixed.h_central == pytest.approx(paper.h_central, rel=1e-4)
    assert mixed.h_min == pytest.approx(paper.h_min, rel=1e-4)


def test_a_dry_contact_is_the_same_in_every_model():
    """Without oil there is only one pressure."""
    mixed, paper = (
        solve_contact(
            contact(hardness=2e9), None, rough(COARSE, 1e-6), options=Options(model=model)
        )
        for model in ("mixed", "paper")
    )
    np.testing.assert_array_equal(mixed.pressure, paper.pressure)


def test_the_imbalance_includes_lubricated_cells():
    """Slow, sharp and elastic: the imbalance of all cells in the Hertz zone, relative to the flow
    through it.
    """
    slow, surface = (
        contact(hardness=None, speed=0.05),
        rough(grid((96, 32)), 2.5e-6, correlation_length=30e-6),
    )
    solution = solve_contact(slow, barus(), surface, options=MIXED)
    balance = balance_of(solution)
    zone, (dx, dy) = balance.problem.zone(), balance.problem.spacing
    of_all, of_wet = (
        np.abs(balance.outflow[cells]).sum() * dx * dy
        for cells in (zone, zone & (balance.rows.state == LUBRICATED))
    )
    carried = balance.content[zone].mean() * solution.grid.cells[1] * dy
    assert of_wet > 5e-6 * carried
    assert contact_state(solution).mass_flux_imbalance == pytest.approx(of_all / carried)


def test_blocks_are_nested_for_firm_contacts_and_not_for_nearly_closed_films():
    """Hard steel on 192 x 144 cells with and without nesting: 192 and 176 iterations, on another
    processor 261 and 234.
    """
    case = load_case(PAPER).with_overrides({"grid.cells": "[128, 128]"})
    soft = solve_contact(case.conditions, case.lubricant, case.surface(), options=case.options)
    sample = next(islice(samples(6), 5, None))
    whole = auto_grid(sample.conditions, sample.oil, sample.texture)
    grid = replace(whole, cells=(whole.cells[0] // 2, whole.cells[1] // 2))
    surface = gaussian_surface(
        grid,
        sq=sample.texture.sq,
        correlation_length=sample.texture.lengths,
        rng=np.random.default_rng(sample.seed),
    )
    hard = solve_contact(sample.conditions, sample.oil, surface)
    assert min(*soft.grid.cells, *grid.cells) >= PRECONDITIONER.max_coarse_cells
    assert is_firm(balance_of(soft))
    assert not is_firm(balance_of(hard))
