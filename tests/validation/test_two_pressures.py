"""The mixed contact with a pressure each for oil and asperities: its limits, and one answer
whatever the start.
"""

from dataclasses import replace
from itertools import islice
from pathlib import Path

import numpy as np
import pytest
from benchmarks.chosen_grids import samples

from asperity.case import load_case
from asperity.contact.grid import Grid
from asperity.ehl import Options, solve_contact
from asperity.ehl.controls import GUESS, MIXED_SOLVER, PLASTIC_DRY
from asperity.ehl.grid_design import auto_grid
from asperity.ehl.linear_solvers.mixed import MixedLinear, extend_streaks, is_firm
from asperity.ehl.load_shares import carried_share
from asperity.ehl.models import plastic_dry as dry
from asperity.ehl.models.mixed import Pressures, evaluate
from asperity.ehl.models.plastic_dry import dry_contact
from asperity.ehl.newton import mixed as mixed_iterate
from asperity.ehl.newton.mixed import newton
from asperity.ehl.problem_setup import contact_problem, first_guess, grid_levels
from asperity.ehl.scales import Scales
from asperity.ehl.strategies import initial_guess as starts
from asperity.ehl.strategies.initial_guess import dry_start
from asperity.ehl.strategies.mixed_search import MixedSearch
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


def test_the_papers_contact_has_the_trials_load_share():
    """An independent program of the same equations found 0.750 on this grid."""
    case = load_case(PAPER).with_overrides({"grid.cells": "[64, 64]", "model": "mixed"})
    solution = solve_contact(case.conditions, case.lubricant, case.surface(), options=case.options)
    assert clr(solution) == pytest.approx(0.7499, abs=0.005)


def test_one_answer_from_two_starts():
    """All load on the asperities, and all of it in the oil."""
    conditions, oil, surface = contact(hardness=2e9), barus(), rough(COARSE, 1e-6, seed=7)
    problem, scales = (
        contact_problem(conditions, oil, surface, MIXED),
        Scales.from_conditions(conditions, oil),
    )

    dry, hertz = MixedSearch(MIXED, scales.gap, None), MixedSearch(MIXED, scales.gap, None)
    dry.from_dry([problem])
    hertz.coarse_to_fine(
        grid_levels(problem), lambda level: first_guess(level, conditions, oil, scales)
    )
    assert dry.converged(MIXED.tolerance)
    assert hertz.converged(MIXED.tolerance)
    assert dry.figures[-1].clr == pytest.approx(hertz.figures[-1].clr, abs=0.002)


def test_what_oil_changed_on_a_coarse_grid_is_granted_to_the_finer_one():
    """The same answer in two thirds of the steps on the fine grid."""
    conditions, oil, surface = (
        contact(hardness=2e9),
        barus(),
        rough(grid((192, 192)), 2.5e-6, seed=7),
    )
    levels, scales = (
        grid_levels(contact_problem(conditions, oil, surface, MIXED)),
        Scales.from_conditions(conditions, oil),
    )
    searches = {number: MixedSearch(MIXED, scales.gap, None) for number in (1, len(levels))}
    steps = {}
    for number, search in searches.items():
        search.from_dry(levels[:number])
        assert search.converged(MIXED.tolerance)
        steps[number] = sum(step.cells == (192, 192) for step in search.history)
    assert steps[len(levels)] < 0.7 * steps[1]
    at_once, climbed = (search.figures[-1].clr for search in searches.values())
    assert climbed == pytest.approx(at_once, abs=0.002)


@pytest.mark.parametrize("sq", [1e-6, 4e-6])
def test_a_dry_start_follows_from_the_coarser_grids(sq, monkeypatch):
    """The answer from Hertz's pressure, without its conjugate gradients, which a cap that holds
    most cells defeats.
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
def test_a_dry_start_by_sets_of_cells_is_newtons(sq, monkeypatch):
    """From Hertz's pressure and from the coarser grid; in single precision and on its own, without
    Newton's steps.
    """
    levels = grid_levels(
        contact_problem(contact(hardness=2e9), barus(), rough(grid((96, 96)), sq), MIXED)
    )
    monkeypatch.setattr(starts, "GUESS", replace(GUESS, dry_tolerance=1e-5))
    with monkeypatch.context() as before:
        before.setattr(starts, "active_set_dry", lambda _, *start: (*start[:2], False))
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


def test_a_dry_start_that_sets_of_cells_do_not_find_is_found_all_the_same(monkeypatch):
    problem = contact_problem(contact(hardness=2e9), barus(), rough(grid((64, 64)), 1e-6), MIXED)
    expected = dry_start(problem)
    monkeypatch.setattr(dry, "PLASTIC_DRY", replace(PLASTIC_DRY, max_active_sets=1))
    found = dry_start(problem)
    assert found[1] != expected[1]
    assert found[1] == pytest.approx(expected[1], abs=0.01)


def test_a_hard_dry_start_needs_no_steps_that_bear_the_cap(monkeypatch):
    """Newton's from the coarser grid's pressures stood still at a hundredth of p_h on this ellipse,
    for seconds.
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
    left = replace(fine, lubricant=None, contact_gap=0.0).evaluate(*start)
    assert left.residual_rms < 1e-3
    assert abs(left.load_error) < 1e-3


def test_a_step_that_leads_away_from_a_solution_is_cut_short():
    """A sixteenth of it at least is taken, and all of it from afar."""
    case = load_case(PAPER).with_overrides({"grid.cells": "[64, 64]", "model": "mixed"})
    surface = case.surface()
    solved = balance_of(
        solve_contact(case.conditions, case.lubricant, surface, options=case.options)
    )
    still = np.zeros_like(solved.unknowns.total)
    for balance, share in (
        (solved, 0.0625),
        (replace(solved, oil_residual=solved.oil_residual + 1.0), 1.0),
    ):
        led = mixed_iterate._line_search(
            mixed_iterate._StepProposal(balance, Pressures(still, still, -0.2), 1.0),
            second_order=True,
        )
        assert solved.unknowns.approach - led.unknowns.approach == pytest.approx(0.2 * share)


def test_a_cell_in_deep_overlap_is_not_freed_again_and_again():
    """One cell of this surface went round between the cap and the oil, for seventy steps on the
    finest grid.
    """
    surface = gaussian_surface(
        grid((256, 256)), sq=0.5e-6, correlation_length=20e-6, rng=np.random.default_rng(1)
    )
    case = load_case(PAPER)
    solution = solve_contact(case.conditions, case.lubricant, surface, options=MIXED)
    assert sum(step.cells == (256, 256) for step in solution.convergence.history) < 30


def hard_ball():
    """A ball of through-hardened steel at a film ratio of 0.2, its problem and the dry start."""
    hard = contact(
        geometry="point", radius=9.6e-3, load=45.0, length=None, speed=0.41, hardness=6.5e9
    )
    a = hard.hertz.half_widths[0]
    on = Grid((120, 80), (-2.0 * a, -1.4 * a), (1.4 * a, 1.4 * a), periodic=(False, False))
    surface = gaussian_surface(
        on, sq=0.25e-6, correlation_length=(38e-6, 56e-6), rng=np.random.default_rng(2)
    )
    oil = replace(barus(), viscosity=Roelands(14e-3, 20e-9))
    problem, scales = contact_problem(hard, oil, surface, MIXED), Scales.from_conditions(hard, oil)
    total, approach, _ = dry_contact(
        replace(problem, lubricant=None, contact_gap=0.0), hertz_pressure(problem)
    )
    dry = Pressures(np.zeros_like(total), total, approach + problem.contact_gap)
    return problem, dry, MixedSearch(MIXED, scales.gap, None)


def hertz_pressure(problem):
    across = problem.y / problem.form.aspect
    return np.sqrt(np.maximum(1.0 - (problem.x**2)[:, None] - across**2, 0.0))


def test_steps_of_time_lead_where_newtons_steps_alone_do_not():
    """Hard steel: eighty of Newton's steps from the dry contact go round, the film that builds up
    in time arrives.
    """
    problem, dry, search = hard_ball()
    search.run(problem, newton(problem, dry, second_order=False), 1e-2, 80)
    assert not search.converged(1e-2)
    assert len(search.history) > 80

    search.history.clear()
    arrived = search.march_in_time(problem, dry, 1.0, tolerance=1e-2)
    still = search.run(
        problem, newton(problem, arrived.balance.unknowns, second_order=False), 1e-4, 80
    )
    assert search.converged(1e-4)
    assert len(search.history) < 200
    # the last step of time was long: the oil that it still had from before is hardly to be seen
    shares = [
        carried_share(one.balance.pressure, one.balance.in_contact) for one in (arrived, still)
    ]
    assert shares[0] == pytest.approx(shares[1], abs=0.02)


def test_newtons_steps_know_how_the_wedge_leans():
    """The linearised equations of an open, rough film are its outflow's slopes, second order
    too.
    """
    problem = contact_problem(
        contact(load=500.0), barus(), rough(COARSE, 0.2e-6, correlation_length=80e-6), MIXED
    )
    rng, start = np.random.default_rng(3), 0.01 + hertz_pressure(problem)
    at = Pressures(start, start, 2.0)
    balance = evaluate(problem, at, second_order=True)
    assert balance.limiter.max() > 0.4
    assert balance.parted.all()
    change = rng.standard_normal(start.shape) * balance.solved
    wet, _ = MixedLinear(balance, float).product(change, change, 0.0)
    tiny = 1e-6
    outflows = [
        evaluate(
            problem, Pressures(start + way * change, start + way * change, 2.0), second_order=True
        ).outflow
        for way in (tiny, -tiny)
    ]
    slope = (outflows[0] - outflows[1]) / (2.0 * tiny) * balance.rows.fluid_scale
    np.testing.assert_allclose(
        wet[balance.solved], slope[balance.solved], atol=1e-6 * np.abs(wet).max()
    )


def test_newtons_steps_know_how_the_wedge_opens_where_the_gap_has_settled():
    """Cells that open by half a contact film lean over: the outflow's slopes, but for what has not
    settled.
    """
    surface = rough(COARSE, 1e-6, correlation_length=20e-6)
    problem = contact_problem(contact(load=500.0), barus(), surface, Options(contact_film=0.1e-6))
    start = 0.01 + 0.1 * hertz_pressure(problem)  # so that no mobility is the least one
    shape = evaluate(problem, Pressures(start, start, 0.0), second_order=True).gap
    at = Pressures(start, start, float(1.01 * problem.contact_gap - shape.min()))
    balance = evaluate(problem, at, second_order=True)
    opening = balance.gap < 1.5 * problem.contact_gap
    assert balance.parted.all()
    assert opening.sum() > 2
    change = np.random.default_rng(3).standard_normal(start.shape) * balance.solved
    tiny, scale = 1e-7, balance.rows.fluid_scale
    outflows = [
        evaluate(
            problem, Pressures(*(start + way * change,) * 2, at.approach), second_order=True
        ).outflow
        for way in (tiny, -tiny)
    ]
    slope = ((outflows[0] - outflows[1]) / (2.0 * tiny) * scale)[balance.solved]
    fixed, told = (
        MixedLinear(balance, float, settled).product(change, change, 0.0)[0][balance.solved]
        for settled in (None, np.ones(start.shape, dtype=bool))
    )
    np.testing.assert_allclose(told, slope, atol=1e-4)
    assert np.abs(fixed - slope).max() > 0.05


def test_oil_that_fills_a_streak_of_closed_cells_goes_on_in_one_step():
    """Ruptured cells that the cap holds closed are solved with those that fill, downstream and no
    farther.
    """
    problem = contact_problem(
        contact(speed=10.0, hardness=0.9e9), barus(), rough(COARSE, 2e-6, seed=7), MIXED
    )
    total, approach, _ = dry_contact(
        replace(problem, lubricant=None, contact_gap=0.0), hertz_pressure(problem)
    )
    oil = np.where(np.random.default_rng(5).random(total.shape) < 0.3, 0.3 * total, 0.0)
    before = evaluate(problem, Pressures(oil, total, approach), second_order=False)
    after = extend_streaks(before)
    closed = (before.solid == CAPPED) & (before.gap <= 1.01 * problem.contact_gap)
    fills, expected = np.zeros(problem.cells[1], dtype=bool), np.zeros(problem.cells, dtype=bool)
    for i in range(problem.cells[0]):
        fills = closed[i] & (
            fills | ((before.rows.state[i] == LUBRICATED) & (before.oil_residual[i] < 0.0))
        )
        expected[i] = fills & (before.rows.state[i] == RUPTURED)
    assert expected.sum() > 20
    np.testing.assert_array_equal(after.rows.state != before.rows.state, expected)
    assert (after.rows.state[expected] == LUBRICATED).all()
    balanced = (before.outflow * before.rows.fluid_scale)[expected]
    np.testing.assert_array_equal(after.oil_residual[expected], balanced)
    np.testing.assert_array_equal(after.oil_residual[~expected], before.oil_residual[~expected])


def test_the_asperities_bear_what_the_oil_does_not():
    """Oil bears no tension and never more than all; asperities bear only where they touch."""
    solution = solve_contact(
        contact(hardness=2e9), barus(), rough(COARSE, 1e-6, seed=7), options=MIXED
    )
    borne = solution.pressure - solution.oil.pressure
    assert solution.oil.pressure.min() >= 0.0
    assert borne.min() > -1e-3 * solution.pressure.max()
    np.testing.assert_allclose(
        borne[~solution.in_contact], 0.0, atol=1e-3 * solution.pressure.max()
    )


def test_a_closed_cells_equation_grows_with_its_own_pressure():
    """Scaled by an open cell's derivative it would hardly move, and shut-in oil would count as
    balanced.
    """
    fast = contact(speed=10.0, hardness=7e9)
    problem = contact_problem(fast, barus(), rough(COARSE, 1e-6, seed=7), MIXED)
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


def test_a_full_film_is_the_papers_models():
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
    """Without oil there is one pressure."""
    mixed, paper = (
        solve_contact(
            contact(hardness=2e9), None, rough(COARSE, 1e-6), options=Options(model=model)
        )
        for model in ("mixed", "paper")
    )
    np.testing.assert_array_equal(mixed.pressure, paper.pressure)


def test_the_oil_that_lubricated_cells_lose_is_counted():
    """Slow, sharp and elastic: all that any cell of the Hertz zone is left with, of the oil that is
    carried there.
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
    assert of_wet > 1e-4 * carried
    assert contact_state(solution).mass_flux_imbalance == pytest.approx(of_all / carried)


def test_blocks_are_nested_where_bodies_touch_firmly_and_not_where_films_are_nearly_closed():
    """Hard steel on 192 x 144 cells, nested and not: 192 and 176 steps, on another processor 261
    and 234.
    """
    case = load_case(PAPER).with_overrides({"grid.cells": "[128, 128]"})
    soft = solve_contact(case.conditions, case.lubricant, case.surface(), options=case.options)
    sample = next(islice(samples(6), 5, None))
    grid = auto_grid(sample.conditions, sample.oil, sample.texture)
    surface = gaussian_surface(
        grid,
        sq=sample.texture.sq,
        correlation_length=sample.texture.lengths,
        rng=np.random.default_rng(sample.seed),
    )
    hard = solve_contact(sample.conditions, sample.oil, surface)
    assert min(*soft.grid.cells, *grid.cells) >= MIXED_SOLVER.min_multigrid_cells
    assert is_firm(balance_of(soft))
    assert not is_firm(balance_of(hard))
