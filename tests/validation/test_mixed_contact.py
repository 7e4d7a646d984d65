"""Rough, lubricated contact: properties of every solution, checked from pressure and gap alone."""

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
def converged(request):
    on, model = request.param
    return solved(rough(on, SQ), tolerance=1e-6, model=model)


def flowing(solution):
    """Return the pressure of the oil, and the cells where Reynolds' equation determines it,
    including touching cells if oil flows there.
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


def test_the_load_is_carried(converged):
    assert converged.pressure.mean() * converged.grid.extent[0] == pytest.approx(50e3, rel=1e-6)


def test_pressure_gap_and_contact_are_within_their_bounds(converged):
    """0 <= p <= cap, h >= the contact film; contact cells below the cap have that film."""
    assert converged.pressure.min() >= 0.0
    assert converged.pressure.max() <= CAP
    assert converged.gap.min() >= FLOOR * (1.0 - 1e-12)
    assert 0.02 < converged.in_contact.mean() < 0.5
    np.testing.assert_allclose(converged.gap[converged.in_contact], FLOOR, atol=0.1e-9)
    assert converged.gap[~converged.in_contact].min() >= FLOOR
    assert (converged.pressure[converged.in_contact] > 0.0).all()
    assert not (converged.cavitated & converged.in_contact).any()
    assert not converged.pressure[converged.cavitated].any()


def test_the_gap_is_the_surface_deflected_by_the_pressure(converged):
    """h = h0 + x^2/(2R) + deflection - roughness in every cell below the cap."""
    problem = contact_problem(
        converged.conditions, converged.lubricant, converged.surface, converged.options
    )
    deflection = problem.deflection(converged.pressure / P_H) * A**2 / RADIUS
    rigid = (converged.grid.x**2 / (2.0 * RADIUS))[:, None] - converged.surface.heights
    elastic = converged.pressure < CAP
    np.testing.assert_allclose(
        converged.gap[elastic],
        (converged.rigid_approach + rigid + deflection)[elastic],
        atol=0.1e-9,
    )


def test_lubricated_cells_conserve_oil(converged):
    """Net mass outflow of each cell, in SI units and plain NumPy, relative to the flow that the
    surfaces entrain.
    """
    _, wet = flowing(converged)
    assert wet.mean() > 0.3
    entrained = 880.0 * 1.91 * converged.gap[np.abs(converged.grid.x) < A].mean()
    lost = mass_outflow(converged) * converged.grid.spacing[0] / entrained
    assert np.sqrt(np.mean(lost[wet] ** 2)) < 1e-5
    assert np.abs(lost[wet]).max() < 1e-3


def test_ruptured_cells_only_gain_oil(converged):
    """p = 0 holds where a full film would need tension: the outflow exceeds the inflow."""
    entrained = 880.0 * 1.91 * converged.gap[np.abs(converged.grid.x) < A].mean()
    oil, _ = flowing(converged)
    ruptured = (oil <= 0.0) & (converged.cavitated | (converged.oil is not None))
    assert mass_outflow(converged)[ruptured].min() * converged.grid.spacing[0] > -1e-4 * entrained


def test_the_equations_are_the_physical_ones(converged):
    """The solver's net outflow in physical units: rho u h - rho h^3/(12 eta) dp/dx on each face."""
    problem = contact_problem(
        converged.conditions, converged.lubricant, converged.surface, converged.options
    )
    approach = converged.rigid_approach * RADIUS / A**2
    if converged.oil is None:
        balance = problem.evaluate(converged.pressure / P_H, approach)
    else:
        unknowns = Pressures(converged.oil.pressure / P_H, converged.pressure / P_H, approach)
        balance = evaluate(problem, unknowns, second_order=True)
    expected = mass_outflow(converged) * RADIUS / (880.0 * 1.91 * A)
    np.testing.assert_allclose(
        balance.outflow, expected, rtol=1e-9, atol=1e-9 * np.abs(expected).max()
    )


def test_the_stated_imbalance_is_the_oil_gained_or_lost_in_non_lubricated_cells(converged):
    oil, wet = flowing(converged)
    zone = np.abs(converged.grid.x) <= A
    lost = np.abs(mass_outflow(converged))[zone][~wet[zone]].sum() * np.prod(converged.grid.spacing)
    film = (converged.lubricant.density(oil) * converged.gap)[zone].mean()
    state = contact_state(converged)
    assert state.mass_flux_imbalance == pytest.approx(
        lost / (1.91 * film * converged.grid.extent[1]), rel=1e-3
    )


def test_a_hundred_times_tighter_tolerance_changes_the_load_share_by_less_than_two_thousandths(
    usual,
):
    assert clr(usual) == pytest.approx(clr(solved(usual.surface, tolerance=1e-6)), abs=5e-4)


def test_the_solution_does_not_depend_on_the_start(usual):
    other = solved(rough(FINE, 0.7 * SQ))
    assert abs(clr(other) - clr(usual)) > 0.05
    restarted = solved(usual.surface, start=other)
    assert clr(restarted) == pytest.approx(clr(usual), abs=5e-4)
    assert np.sqrt(np.mean((restarted.pressure - usual.pressure) ** 2)) < 1e-3 * P_H


def test_a_mirrored_or_shifted_surface_has_the_mirrored_or_shifted_solution(usual):
    for there in (lambda field: field[:, ::-1], lambda field: np.roll(field, 11, axis=1)):
        moved = solved(Surface(there(usual.surface.heights).copy(), FINE))
        assert clr(moved) == pytest.approx(clr(usual), abs=5e-4)
        assert np.sqrt(np.mean((moved.pressure - there(usual.pressure)) ** 2)) < 1e-3 * P_H


def test_a_wider_strip_of_the_same_surface_is_the_same_contact():
    """Two periods next to each other: the domain is periodic in y, so the solution is unchanged."""
    surface = rough(grid((64, 32), y=(-0.8, 0.8)), SQ)
    once = solved(surface, tolerance=1e-5)
    twice = solved(Surface(np.tile(surface.heights, (1, 2)), COARSE), tolerance=1e-5)
    np.testing.assert_allclose(twice.pressure, np.tile(once.pressure, (1, 2)), atol=2e-3 * P_H)
    assert clr(twice) == pytest.approx(clr(once), abs=1e-4)


def test_the_solution_is_invariant_under_scaling():
    """All lengths and the viscosity doubled, load fourfold: the same pressures, gaps doubled."""
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


def test_asperities_of_a_rougher_surface_carry_more_load():
    shares = [
        np.mean([clr(solved(rough(COARSE, sq, seed))) for seed in (1, 2, 3)])
        for sq in (0.3e-6, 0.5e-6, 1e-6, 2e-6)
    ]
    assert np.all(np.diff(shares) > 0.05)
    assert shares[0] < 0.1
    assert shares[-1] > 0.6


def test_asperities_of_a_faster_surface_carry_less_load():
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
def test_a_rough_contact_with_hardly_any_oil_is_dry(model):
    """At very low speed isoviscous oil leaves the contact; with a single pressure for oil and
    solids CLR would remain near 0.5.
    """
    surface = rough(COARSE, SQ)
    options = Options(contact_film=0.1e-9, model=model)
    crawl = solve_contact(
        contact(hardness=CAP, speed=1e-7), barus(alpha=1e-11), surface, options=options
    )
    assert clr(crawl) > 0.999


def test_a_thick_film_has_no_contact():
    assert clr(solved(rough(COARSE, 0.2e-6, correlation_length=40e-6), speed=20.0)) == 0.0


@pytest.mark.parametrize("sq", [0.5e-6, 1e-6, 2e-6])
def test_a_purely_elastic_contact_is_solved(sq):
    solution = solved(rough(COARSE, sq, correlation_length=40e-6), hardness=None)
    assert solution.convergence.converged
    assert solution.pressure.max() > 1.3 * P_H
    assert solution.pressure.mean() * COARSE.extent[0] == pytest.approx(50e3, rel=1e-4)
    if solution.in_contact.any():
        np.testing.assert_allclose(solution.gap[solution.in_contact], FLOOR, atol=1e-9)


def test_an_unfinished_solve_raises_with_its_last_solution():
    surface = rough(COARSE, SQ)
    few = Options(max_iterations=3)
    with pytest.raises(
        NotConverged, match=r"not solved: out of iterations.* after \d+ steps"
    ) as caught:
        solve_contact(contact(hardness=CAP), barus(), surface, options=few)
    unfinished = caught.value.solution
    assert unfinished.convergence.status is SolveStatus.OUT_OF_ITERATIONS
    assert not unfinished.convergence.converged
    assert unfinished.pressure.shape == COARSE.cells
    not_strict = solve_contact(contact(hardness=CAP), barus(), surface, options=few, strict=False)
    np.testing.assert_array_equal(not_strict.pressure, unfinished.pressure)
    assert contact_state(not_strict).reynolds_residual > 1e-4


def test_iterations_from_a_coarser_grid_are_not_restarted():
    """Once with arithmetic mean mobilities, and once more with exact ones."""
    numbers = [
        step.number
        for step in solved(rough(FINE, SQ)).convergence.history
        if step.cells == (128, 128)
    ]
    first = numbers.index(0, 1)
    assert numbers == [*range(first), *range(len(numbers) - first)]
    assert first > 4


def test_progress_receives_every_iteration_from_coarse_to_fine():
    reported = []
    solution = solved(rough(FINE, 0.5 * SQ), progress=reported.append)
    assert tuple(reported) == solution.convergence.history
    assert list(dict.fromkeys(step.cells for step in reported)) == [(64, 64), (128, 128)]
    last = reported[-1]
    assert max(last.residual, last.load_error, last.change) < 1e-4


@pytest.mark.parametrize(
    ("on", "message"),
    [
        (grid((64, 16), (-1.0, 2.0)), "at least 1.2 Hertz half-widths"),
        (grid((16, 16), (-4.5, 1.9)), "use more cells"),
        (Grid((64, 16), (-4 * A, -A), (2 * A, A), (False, False)), "a line contact needs a grid"),
    ],
)
def test_a_grid_that_does_not_contain_the_contact_is_refused(on, message):
    with pytest.raises(BadInput, match=message):
        solve_contact(contact(), barus(), flat_surface(on))


def test_a_load_above_the_capacity_of_the_grid_is_refused():
    mean_pressure = contact().load / (contact().line_length * COARSE.extent[0])
    with pytest.raises(BadInput, match="carries at most 495 N, less than the load of 500 N"):
        solved(flat_surface(COARSE), hardness=0.99 * mean_pressure)


def test_a_start_or_grid_that_does_not_fit_is_refused(usual):
    with pytest.raises(BadInput, match="a point contact needs a grid"):
        solve_contact(contact(geometry="point", length=None), barus(), flat_surface(COARSE))
    with pytest.raises(BadInput, match="solve without start"):
        solved(rough(COARSE, SQ), start=usual)


def test_a_smooth_contact_too_slow_for_a_film_is_nearly_dry():
    """At 10 um/s the oil film would be far below the contact film: the solids carry the load, as in
    the dry contact.

    The load share is slightly below 1, because contact cells at the rim press oil into their
    neighbours (see the dry limit above).
    """
    slow = contact(surface_speeds=(1e-5, 1e-5))
    state = contact_state(solve_contact(slow, barus(), flat_surface(grid((128, 8)))))
    assert state.clr > 0.85
    assert state.car > 0.85
    assert state.p_max == pytest.approx(slow.hertz.p_max, rel=0.02)
