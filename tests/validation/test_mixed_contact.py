"""Rough, lubricated contact: what must hold whatever the surface, checked from pressure and gap
alone.
"""

import numpy as np
import pytest

from asperity.contact.grid import Grid
from asperity.contact.hertz import line_pressure
from asperity.core.errors import BadInput, NotConverged
from asperity.ehl import Options, SolveStatus, solve_contact
from asperity.ehl.models.mixed import Pressures, evaluate
from asperity.ehl.problem_setup import contact_problem
from asperity.solution import contact_state
from asperity.surface import Surface, flat_surface
from support.paper import RADIUS, barus, contact, grid, rough
from support.reynolds import mass_outflow

CAP, SQ, FLOOR = 2e9, 1e-6, 5e-9
A, P_H = contact().hertz.half_widths[0], contact().hertz.p_max
COARSE, FINE = grid((64, 64)), grid((128, 128))


def solved(surface, *, tolerance=1e-4, speed=1.91, hardness=CAP, model="mixed", **more):
    options = Options(tolerance=tolerance, contact_film=FLOOR, model=model)
    return solve_contact(
        contact(hardness=hardness, speed=speed), barus(), surface, options=options, **more
    )


def clr(solution):
    return contact_state(solution).clr


@pytest.fixture(
    scope="module",
    params=[(COARSE, "mixed"), (FINE, "mixed"), (COARSE, "paper"), (FINE, "paper")],
    ids=["64", "128", "64-paper", "128-paper"],
)
def tight(request):
    on, model = request.param
    return solved(rough(on, SQ), tolerance=1e-6, model=model)


def flowing(solution):
    """Pressure of the oil, and the cells in which Reynolds' equation decides it: touching ones too
    if it can.
    """
    if solution.oil is None:
        return solution.pressure, (solution.pressure > 0.0) & (
            solution.pressure < CAP
        ) & ~solution.in_contact
    oil = solution.oil.pressure
    return oil, (oil > 0.0) & (oil < CAP)


@pytest.fixture(scope="module")
def usual():
    return solved(rough(FINE, SQ))


def test_the_load_is_carried(tight):
    assert tight.pressure.mean() * tight.grid.extent[0] == pytest.approx(50e3, rel=1e-6)


def test_pressure_gap_and_contact_keep_their_bounds(tight):
    """0 <= p <= cap, h >= the contact film, and where p is below the cap a contact cell is closed
    to that film.
    """
    assert tight.pressure.min() >= 0.0
    assert tight.pressure.max() <= CAP
    assert tight.gap.min() >= FLOOR * (1.0 - 1e-12)
    assert 0.02 < tight.in_contact.mean() < 0.5
    np.testing.assert_allclose(tight.gap[tight.in_contact], FLOOR, atol=0.1e-9)
    assert tight.gap[~tight.in_contact].min() >= FLOOR
    assert (tight.pressure[tight.in_contact] > 0.0).all()
    assert not (tight.cavitated & tight.in_contact).any()
    assert not tight.pressure[tight.cavitated].any()


def test_the_gap_is_the_surface_bent_by_the_pressure(tight):
    """h = h0 + x^2/(2R) + deflection - roughness in every cell that no cap flattens."""
    problem = contact_problem(tight.conditions, tight.lubricant, tight.surface, tight.options)
    bent = problem.deflection(tight.pressure / P_H) * A**2 / RADIUS
    rigid = (tight.grid.x**2 / (2.0 * RADIUS))[:, None] - tight.surface.heights
    elastic = tight.pressure < CAP
    np.testing.assert_allclose(
        tight.gap[elastic], (tight.rigid_approach + rigid + bent)[elastic], atol=0.1e-9
    )


def test_lubricated_cells_conserve_oil(tight):
    """Net mass outflow of each, in SI and by plain NumPy, against what the surfaces drag through
    the contact.
    """
    _, wet = flowing(tight)
    assert wet.mean() > 0.3
    dragged = 880.0 * 1.91 * tight.gap[np.abs(tight.grid.x) < A].mean()
    lost = mass_outflow(tight) * tight.grid.spacing[0] / dragged
    assert np.sqrt(np.mean(lost[wet] ** 2)) < 1e-5
    assert np.abs(lost[wet]).max() < 1e-3


def test_ruptured_cells_only_let_oil_appear(tight):
    """p = 0 holds where a full film would need tension: more would leave than enters."""
    dragged = 880.0 * 1.91 * tight.gap[np.abs(tight.grid.x) < A].mean()
    oil, _ = flowing(tight)
    ruptured = (oil <= 0.0) & (tight.cavitated | (tight.oil is not None))
    assert mass_outflow(tight)[ruptured].min() * tight.grid.spacing[0] > -1e-4 * dragged


def test_the_equations_are_the_physical_ones(tight):
    """The solver's own net outflow, made dimensional, is rho u h - rho h^3/(12 eta) dp/dx face by
    face.
    """
    problem = contact_problem(tight.conditions, tight.lubricant, tight.surface, tight.options)
    approach = tight.rigid_approach * RADIUS / A**2
    if tight.oil is None:
        balance = problem.evaluate(tight.pressure / P_H, approach)
    else:
        unknowns = Pressures(tight.oil.pressure / P_H, tight.pressure / P_H, approach)
        balance = evaluate(problem, unknowns, second_order=True)
    expected = mass_outflow(tight) * RADIUS / (880.0 * 1.91 * A)
    np.testing.assert_allclose(
        balance.outflow, expected, rtol=1e-9, atol=1e-9 * np.abs(expected).max()
    )


def test_the_stated_imbalance_is_the_oil_that_non_lubricated_cells_make_or_lose(tight):
    oil, wet = flowing(tight)
    zone = np.abs(tight.grid.x) <= A
    lost = np.abs(mass_outflow(tight))[zone][~wet[zone]].sum() * np.prod(tight.grid.spacing)
    film = (tight.lubricant.density(oil) * tight.gap)[zone].mean()
    state = contact_state(tight)
    assert state.mass_flux_imbalance == pytest.approx(
        lost / (1.91 * film * tight.grid.extent[1]), rel=1e-3
    )


def test_a_hundred_times_tighter_changes_the_load_share_by_less_than_two_thousandths(usual):
    assert clr(usual) == pytest.approx(clr(solved(usual.surface, tolerance=1e-6)), abs=5e-4)


def test_the_solution_does_not_remember_where_it_started(usual):
    other = solved(rough(FINE, 0.7 * SQ))
    assert abs(clr(other) - clr(usual)) > 0.05
    again = solved(usual.surface, start=other)
    assert clr(again) == pytest.approx(clr(usual), abs=5e-4)
    assert np.sqrt(np.mean((again.pressure - usual.pressure) ** 2)) < 1e-3 * P_H


def test_a_mirrored_or_shifted_surface_has_the_mirrored_or_shifted_solution(usual):
    for there in (lambda field: field[:, ::-1], lambda field: np.roll(field, 11, axis=1)):
        moved = solved(Surface(there(usual.surface.heights).copy(), FINE))
        assert clr(moved) == pytest.approx(clr(usual), abs=5e-4)
        assert np.sqrt(np.mean((moved.pressure - there(usual.pressure)) ** 2)) < 1e-3 * P_H


def test_a_wider_strip_of_the_same_surface_is_the_same_contact():
    """Two periods side by side: the y axis repeats, so nothing may change."""
    surface = rough(grid((64, 32), y=(-0.8, 0.8)), SQ)
    once = solved(surface, tolerance=1e-5)
    twice = solved(Surface(np.tile(surface.heights, (1, 2)), COARSE), tolerance=1e-5)
    np.testing.assert_allclose(twice.pressure, np.tile(once.pressure, (1, 2)), atol=2e-3 * P_H)
    assert clr(twice) == pytest.approx(clr(once), abs=1e-4)


def test_units_do_not_matter():
    """Everything twice as long, loads fourfold, viscosity twofold: the same pressures, gaps twice
    as wide.
    """
    surface = rough(COARSE, SQ)
    larger_grid = Grid(
        COARSE.cells, *(tuple(2.0 * c for c in corner) for corner in (COARSE.lower, COARSE.upper))
    )
    larger = contact(hardness=CAP, radius=2.0 * RADIUS, load=2000.0, length=0.02, speed=2.0 * 1.91)
    once = solved(surface, tolerance=1e-5)
    twice = solve_contact(
        larger,
        barus(),
        Surface(2.0 * surface.heights, larger_grid),
        options=Options(tolerance=1e-5, contact_film=2.0 * FLOOR),
    )
    np.testing.assert_allclose(twice.pressure, once.pressure, atol=1e-6 * P_H)
    np.testing.assert_allclose(twice.gap, 2.0 * once.gap, atol=1e-12)


def test_a_rougher_surface_carries_more_on_its_asperities():
    shares = [
        np.mean([clr(solved(rough(COARSE, sq, seed))) for seed in (1, 2, 3)])
        for sq in (0.3e-6, 0.5e-6, 1e-6, 2e-6)
    ]
    assert np.all(np.diff(shares) > 0.05)
    assert shares[0] < 0.1
    assert shares[-1] > 0.6


def test_a_faster_surface_carries_more_on_its_oil():
    shares = [
        np.mean([clr(solved(rough(COARSE, 0.8e-6, seed), speed=u)) for seed in (1, 2)])
        for u in (0.5, 1.0, 2.0, 4.0)
    ]
    assert np.all(np.diff(shares) < -0.05)


def test_a_thin_film_on_a_smooth_surface_is_nearly_hertz():
    crawl = solved(flat_surface(grid((256, 8), (-2.0, 2.0))), speed=0.01, hardness=None)
    hertz = line_pressure(crawl.grid.x, A, P_H)
    assert 5e-9 < crawl.gap.min() < 30e-9
    assert np.linalg.norm(crawl.pressure[:, 0] - hertz) < 0.05 * np.linalg.norm(hertz)


@pytest.mark.parametrize("model", ["mixed", "conserving"])
def test_hardly_any_oil_on_a_rough_surface_is_the_dry_contact(model):
    """At a crawl an oil that does not thicken leaves the contact; one pressure for both would keep
    CLR near 0.5.
    """
    surface = rough(COARSE, SQ)
    options = Options(contact_film=0.1e-9, model=model)
    crawl = solve_contact(
        contact(hardness=CAP, speed=1e-7), barus(alpha=1e-11), surface, options=options
    )
    assert clr(crawl) > 0.999


def test_a_flood_is_no_contact():
    assert clr(solved(rough(COARSE, 0.2e-6, correlation_length=40e-6), speed=20.0)) == 0.0


@pytest.mark.parametrize("sq", [0.5e-6, 1e-6, 2e-6])
def test_a_purely_elastic_contact_is_solved_too(sq):
    solution = solved(rough(COARSE, sq, correlation_length=40e-6), hardness=None)
    assert solution.convergence.converged
    assert solution.pressure.max() > 1.3 * P_H
    assert solution.pressure.mean() * COARSE.extent[0] == pytest.approx(50e3, rel=1e-4)
    if solution.in_contact.any():
        np.testing.assert_allclose(solution.gap[solution.in_contact], FLOOR, atol=1e-9)


def test_an_unfinished_solve_is_loud_and_hands_over_what_it_has():
    surface = rough(COARSE, SQ)
    hurried = Options(max_iterations=3)
    with pytest.raises(
        NotConverged, match=r"not solved: out of iterations.* after \d+ steps"
    ) as caught:
        solve_contact(contact(hardness=CAP), barus(), surface, options=hurried)
    unfinished = caught.value.solution
    assert unfinished.convergence.status is SolveStatus.OUT_OF_ITERATIONS
    assert not unfinished.convergence.converged
    assert unfinished.pressure.shape == COARSE.cells
    quiet = solve_contact(contact(hardness=CAP), barus(), surface, options=hurried, strict=False)
    np.testing.assert_array_equal(quiet.pressure, unfinished.pressure)
    assert contact_state(quiet).reynolds_residual > 1e-4


def test_steps_from_a_coarser_grid_are_not_begun_anew_for_the_last_decimals():
    numbers = [
        step.number
        for step in solved(rough(FINE, SQ)).convergence.history
        if step.cells == (128, 128)
    ]
    assert numbers == list(range(len(numbers)))
    assert numbers[-1] > 3


def test_progress_hears_of_every_step_from_coarse_to_fine():
    heard = []
    solution = solved(rough(FINE, 0.5 * SQ), progress=heard.append)
    assert tuple(heard) == solution.convergence.history
    assert list(dict.fromkeys(step.cells for step in heard)) == [(64, 64), (128, 128)]
    last = heard[-1]
    assert max(last.residual, last.load_error, last.change) < 1e-4


@pytest.mark.parametrize(
    ("on", "said"),
    [
        (grid((64, 16), (-1.0, 2.0)), "at least 1.2 Hertz half-widths"),
        (grid((16, 16), (-4.5, 1.9)), "use more cells"),
        (Grid((64, 16), (-4 * A, -A), (2 * A, A), (False, False)), "a line contact needs a grid"),
    ],
)
def test_a_grid_that_does_not_hold_the_contact_is_refused(on, said):
    with pytest.raises(BadInput, match=said):
        solve_contact(contact(), barus(), flat_surface(on))


def test_a_load_beyond_what_the_cap_bears_on_the_grid_is_refused():
    bears = contact().load / (
        contact().line_length * COARSE.extent[0]
    )  # the mean pressure over the grid
    with pytest.raises(BadInput, match="carries at most 495 N, less than the load of 500 N"):
        solved(flat_surface(COARSE), hardness=0.99 * bears)


def test_a_start_or_grid_that_does_not_fit_says_so(usual):
    with pytest.raises(BadInput, match="a point contact needs a grid"):
        solve_contact(contact(geometry="point", length=None), barus(), flat_surface(COARSE))
    with pytest.raises(BadInput, match="solve without start"):
        solved(rough(COARSE, SQ), start=usual)


def test_a_smooth_contact_too_slow_for_a_film_is_nearly_all_contact():
    """At 10 um/s the oil's own film would be far below the contact film: the solids carry the load,
    as when dry.

    Not quite all of it: contact cells at the rim press oil into their neighbours (see the dry
    limit above).
    """
    slow = contact(surface_speeds=(1e-5, 1e-5))
    state = contact_state(solve_contact(slow, barus(), flat_surface(grid((128, 8)))))
    assert state.clr > 0.85
    assert state.car > 0.85
    assert state.p_max == pytest.approx(slow.hertz.p_max, rel=0.02)
