"""Finite rollers: dry against reference solutions, the moment against the energy, the middle
against a line contact, a strong crown against a point contact, and extreme operating conditions.

Reference pressures: an independent half-space solver and tamaas, not periodic, which agree within
2e-8 of Hertz's pressure; 48 x 1024 cells over 3.2 half-widths and the length, values at cell
centres.
"""

from dataclasses import replace

import numpy as np
import pytest

import asperity as asp
from asperity.contact.rollers import RollerShape
from asperity.ehl import auto_grid
from asperity.ehl.models.mixed import Pressures
from asperity.ehl.outcome import SolveStrategy
from asperity.ehl.problem_setup import contact_problem
from asperity.ehl.strategies import cold_start
from asperity.ehl.strategies.cold_start import CoarseToFine
from asperity.solution import axial_distribution, dynamic_stiffness, tangent_stiffness
from asperity.surface import gaussian_surface

STEEL = asp.ElasticPair((206e9, 206e9), (0.3, 0.3))
RADIUS, LENGTH, LOAD = 3.629e-3, 10e-3, 2000.0
OIL = asp.Lubricant(
    viscosity=asp.Roelands(0.04, 20e-9),
    density=asp.DowsonHigginson(870.0),
    rheology=asp.Newtonian(),
)
ISO = RollerShape.iso(9e-3, LENGTH)
SECOND = SolveStrategy.SECOND_ORDER


def lundberg(load: float) -> RollerShape:
    return RollerShape.johns_gohar(load, LENGTH, RADIUS, STEEL.reduced_modulus)


def roller(shape: RollerShape | None = None, load: float = LOAD, **given) -> asp.ContactConditions:
    stated = {
        "radius": RADIUS,
        "length": LENGTH,
        "surface_speeds": (3.5, 3.5),
        "pair": STEEL,
        **given,
    }
    return asp.ContactConditions(geometry="roller", load=load, shape=shape, **stated)


def solved(conditions, oil=None, *, cells, reach=1.6, past=1, **options):
    """Solve with `past` lines of cells beyond each end."""
    nx, ny = cells
    a, end = conditions.hertz.half_widths[0], 0.5 * conditions.length * (1.0 + 2.0 * past / ny)
    x = (-reach * a, reach * a) if oil is None else (-4.5 * a, 1.5 * a)
    surface = asp.flat_surface(
        asp.Grid((nx, ny + 2 * past), (x[0], -end), (x[1], end), (False, False))
    )
    return asp.solve_contact(conditions, oil, surface, options=asp.Options(**options))


@pytest.mark.parametrize(
    ("shape", "load", "largest", "position", "middle", "line_load"),
    [
        (lundberg(LOAD), LOAD, 1.131, 0.4985, 0.9994, 1.022),
        (lundberg(LOAD), 1000.0, 1.0371, 0.0, 1.0371, None),
        (ISO, LOAD, 1.1528, 0.0, 1.1528, 1.3288),
        (ISO.tilted(0.5e-3), LOAD, 1.2000, -0.222, 1.1444, 1.4399),
        (ISO.tilted(1e-3), LOAD, 1.3032, -0.331, 1.1177, 1.6961),
        (ISO, 500.0, 1.3760, 0.0, 1.3760, None),
        (ISO, 1000.0, 1.2524, 0.0, 1.2524, None),
        (ISO, 4000.0, 1.0771, 0.0, 1.0771, None),
    ],
)
def test_a_dry_roller_has_the_reference_pressure(shape, load, largest, position, middle, line_load):
    conditions = roller(shape, load)
    solution = solved(conditions, cells=(48, 1024))
    pressure, y = solution.pressure / conditions.hertz.p_max, solution.grid.y
    assert pressure.max() == pytest.approx(largest, rel=5e-4)
    place = y[np.argmax(pressure.max(axis=0))] / LENGTH
    assert (abs(place) if position >= 0.0 else place) == pytest.approx(position, abs=2e-3)
    assert np.interp(0.0, y, pressure.max(axis=0)) == pytest.approx(middle, rel=1e-3)
    if line_load is not None:
        along = axial_distribution(solution)
        assert along.largest_line_load * LENGTH / load == pytest.approx(line_load, rel=5e-4)


def test_lundbergs_profile_is_loaded_throughout_and_uniform_except_at_the_ends():
    solution = solved(roller(lundberg(LOAD)), cells=(48, 1024))
    along = axial_distribution(solution)
    relative_pressure = (
        np.interp(0.45 * LENGTH, along.y, along.pressure) / solution.conditions.hertz.p_max
    )
    assert relative_pressure == pytest.approx(1.0029, abs=1e-3)
    assert along.loaded_share == pytest.approx(1.0)
    assert along.edge_pressure.on_grid == pytest.approx(
        1.131 * solution.conditions.hertz.p_max, rel=5e-4
    )
    iso = axial_distribution(solved(roller(ISO), cells=(48, 1024)))
    assert iso.loaded_share == pytest.approx(0.918, abs=0.004)


@pytest.mark.parametrize("oil", [None, OIL])
def test_cells_beyond_the_ends_do_not_change_the_solution(oil):
    """Three more lines of cells beyond each end: no pressure there, and the same pressure on the
    roller.
    """
    conditions = roller(lundberg(1.2 * LOAD))
    narrow = solved(conditions, oil, cells=(64, 64))
    (x0, y0), (x1, y1), (_, dy) = narrow.grid.lower, narrow.grid.upper, narrow.grid.spacing
    wider = asp.Grid((64, 72), (x0, y0 - 3.0 * dy), (x1, y1 + 3.0 * dy), (False, False))
    wide = asp.solve_contact(conditions, oil, asp.flat_surface(wider))
    assert wide.pressure[:, :4].max() == wide.pressure[:, -4:].max() == 0.0
    assert wide.pressure[:, 4:-4] == pytest.approx(
        narrow.pressure[:, 1:-1], abs=2e-3 * narrow.pressure.max()
    )
    films = [axial_distribution(solution).end_film.on_grid for solution in (wide, narrow)]
    assert films[0] == pytest.approx(films[1], rel=2e-3, abs=1e-12)


def test_an_untilted_roller_is_symmetric_to_rounding():
    solution = solved(roller(ISO), cells=(48, 128), tolerance=1e-8)
    pressure = solution.pressure
    assert np.abs(pressure - pressure[:, ::-1]).max() < 1e-9 * pressure.max()
    assert abs(axial_distribution(solution).load_centre) < 1e-9 * LENGTH
    here, there = (
        solved(roller(ISO.tilted(tilt)), cells=(48, 128), tolerance=1e-8) for tilt in (3e-4, -3e-4)
    )
    assert np.abs(here.pressure - there.pressure[:, ::-1]).max() < 1e-8 * pressure.max()


def test_the_moment_is_the_derivative_of_the_energy_by_tilt():
    """The moment is the derivative by tilt of the integral of p V/2 + p (x²/2R + drop + tilt y),
    the minimum at given load.
    """

    def energy(tilt: float) -> float:
        solution = solved(roller(ISO.tilted(tilt)), cells=(48, 128), tolerance=1e-7)
        problem = contact_problem(solution.conditions, None, solution.surface, solution.options)
        a, p_max = solution.conditions.hertz.half_widths[0], solution.conditions.hertz.p_max
        rigid_gap = np.where(problem.rim, 0.0, problem.form.gap(problem.x, problem.y))
        work = (
            solution.pressure
            * (0.5 * problem.deflection(solution.pressure / p_max) + rigid_gap)
            * a**2
            / RADIUS
        )
        dx, dy = solution.grid.spacing
        return float(work.sum()) * dx * dy

    tilt, step = 0.5e-3, 2e-5
    along = axial_distribution(solved(roller(ISO.tilted(tilt)), cells=(48, 128), tolerance=1e-7))
    assert along.moment == pytest.approx(
        (energy(tilt + step) - energy(tilt - step)) / (2.0 * step), rel=1e-3
    )
    assert along.moment < -1.0  # opposite to the side where the gap opens
    assert along.load == pytest.approx(LOAD, rel=1e-6)


def test_the_most_uniform_pressure_is_close_to_lundbergs_profile():
    def largest(share: float, tilt: float = 0.0) -> float:
        solution = solved(roller(lundberg(share * LOAD).tilted(tilt)), cells=(48, 256))
        return float(solution.pressure.max() / solution.conditions.hertz.p_max)

    level = {share: largest(share) for share in (0.5, 1.2, 4.0)}
    assert level[1.2] == pytest.approx(1.008, abs=0.005)
    assert level[0.5] > 1.5
    assert level[4.0] > 1.08
    tilted = {share: largest(share, 0.5e-3) for share in (1.2, 3.0, 8.0)}
    assert min(tilted, key=tilted.get) == 3.0  # a tilted roller needs more relief


@pytest.mark.parametrize("oil", [None, OIL])
def test_the_middle_of_a_long_roller_is_a_line_contact(oil):
    conditions = roller(lundberg(1.2 * LOAD))
    solution = solved(conditions, oil, cells=(192, 96))
    (nx, ny), grid = solution.grid.cells, solution.grid
    middle = slice(ny // 2 - 1, ny // 2 + 1)
    carried = solution.pressure[:, middle].sum(axis=0).mean() * grid.spacing[0]
    assert carried == pytest.approx(LOAD / LENGTH, rel=0.02)
    line = replace(conditions, geometry="line", shape=None, load=carried * LENGTH)
    lower, upper = (grid.lower[0], -1e-4), (grid.upper[0], 1e-4)
    infinite = asp.solve_contact(line, oil, asp.flat_surface(asp.Grid((nx, 8), lower, upper)))
    inner = np.abs(grid.x) < 0.7 * conditions.hertz.half_widths[0]  # upstream of the spike
    pressure, gap = (
        solution.pressure[inner, middle].mean(axis=1),
        solution.gap[inner, middle].mean(axis=1),
    )
    assert (
        np.abs(pressure - infinite.pressure[inner, 0]).max() < 5e-3 * infinite.pressure[inner].max()
    )
    if oil is not None:
        assert gap == pytest.approx(infinite.gap[inner, 0], rel=5e-3)
        assert solution.gap[:, middle].min() == pytest.approx(infinite.gap.min(), rel=5e-3)


def test_the_middle_of_a_straight_roller_is_the_line_contact_of_its_own_load():
    solution = solved(roller(), cells=(64, 256))
    along = axial_distribution(solution)
    middle = along.y.size // 2
    line = replace(roller(), geometry="line", load=along.line_load[middle] * LENGTH)
    assert along.pressure[middle] == pytest.approx(line.hertz.p_max, rel=5e-3)
    finer = axial_distribution(solved(roller(), cells=(64, 512)))
    assert (
        finer.edge_pressure.on_grid > 1.2 * along.edge_pressure.on_grid
    )  # the pressure at the edge is singular
    assert along.middle_pressure == pytest.approx(along.pressure[middle], rel=1e-6)
    for distribution in (along, finer):
        assert distribution.edge_pressure.value is distribution.edge_pressure.bar is None
        assert distribution.undetermined[0].startswith(
            "The edge pressure is not determined: the profile relieves the ends too"
        )


def edge_pressures(shape, oil, *grids):
    """Return the edge pressure on each grid and its error bar, relative to Hertz's pressure."""
    conditions = roller(shape)
    found = [
        axial_distribution(solved(conditions, oil, cells=(nx, ny - 8), past=4)).edge_pressure
        for nx, ny in grids
    ]
    return [
        tuple(x and x / conditions.hertz.p_max for x in (edge.value, edge.bar)) for edge in found
    ]


@pytest.mark.parametrize(
    "shape", [lundberg(LOAD), lundberg(1.2 * LOAD), lundberg(1.5 * LOAD), ISO, ISO.tilted(1e-3)]
)
def test_the_dry_edge_pressure_of_finer_grids_lies_within_the_bar(shape):
    *coarser, (finest, _) = edge_pressures(shape, None, (48, 256), (48, 512), (48, 1024))
    for value, bar in coarser:
        assert abs(value - finest) < bar < 0.2


def test_the_bar_covers_the_reference_edge_pressure():
    ((value, bar),) = edge_pressures(lundberg(LOAD), None, (48, 512))
    assert abs(value - 1.131) < bar < 0.1


@pytest.mark.parametrize("shape", [lundberg(1.5 * LOAD), ISO.tilted(1e-3)])
def test_the_lubricated_edge_pressure_does_not_depend_on_the_grid_or_the_spike(shape):
    """The spike grows by up to a tenth from 96 to 192 cells along x, the pressure before it not."""
    (coarse, bar), (across, _), (along, _) = edge_pressures(
        shape, OIL, (96, 256), (192, 256), (96, 512)
    )
    assert across == pytest.approx(coarse, rel=1e-3)
    assert along == pytest.approx(coarse, rel=3e-3)
    assert max(abs(across - coarse), abs(along - coarse)) < bar
    ((dry, _),) = edge_pressures(shape, None, (48, 512))
    assert coarse == pytest.approx(dry, rel=0.02)


def test_an_unconverged_edge_pressure_is_not_determined():
    """A circular profile with a drop of 5 um at the ends has 0.5 of the mean load per length there,
    and 1.1 to 2.4 GPa on 128 to 1024 cells.
    """
    circle = RollerShape(crown_radius=LENGTH**2 / 8.0 / 5e-6)
    for oil in (None, OIL):
        assert edge_pressures(circle, oil, (48 if oil is None else 96, 256)) == [(None, None)]
    along = axial_distribution(solved(roller(circle), cells=(48, 120), past=4))
    assert (
        "are 0.92 half-widths apart, but loaded ends require 0.5; use 237 cells"
        in along.undetermined[0]
    )


def test_the_edge_pressure_at_a_capped_end_is_the_cap():
    along = axial_distribution(solved(roller(hardness=2e9), cells=(48, 248), past=4))
    assert along.edge_pressure.value == pytest.approx(2e9)
    assert (
        axial_distribution(
            solved(roller(hardness=20e9), cells=(48, 248), past=4)
        ).edge_pressure.value
        is None
    )


def test_the_film_at_loaded_ends_needs_closely_spaced_cells():
    few, many, finest = (
        axial_distribution(solved(roller(lundberg(1.5 * LOAD)), OIL, cells=(96, ny - 8), past=4))
        for ny in (256, 1024, 1536)
    )
    assert few.end_film.value is None
    assert any(
        "minimum film thickness at the ends is not determined: the lines of cells are 0.45"
        in message
        for message in few.undetermined
    )
    assert (
        abs(many.end_film.value - finest.end_film.value)
        < many.end_film.bar
        < 0.5 * many.end_film.value
    )


@pytest.mark.parametrize("oil", [None, OIL])
def test_a_roller_with_a_strong_crown_is_a_point_contact(oil):
    speeds = (3.85, 3.15)
    ball = asp.ContactConditions(
        pair=STEEL, geometry="point", radius=RADIUS, load=20.0, surface_speeds=speeds
    )
    a = ball.hertz.half_widths[0]
    grid = asp.Grid((96, 96), (-4.5 * a, -2.5 * a), (1.5 * a, 2.5 * a), (False, False))
    crowned = roller(RollerShape(crown_radius=RADIUS), 20.0, length=2e-3, surface_speeds=speeds)
    crowned_solution, ball_solution = (
        asp.solve_contact(conditions, oil, asp.flat_surface(grid)) for conditions in (crowned, ball)
    )
    assert crowned_solution.pressure == pytest.approx(
        ball_solution.pressure, abs=1e-3 * ball_solution.pressure.max()
    )
    assert crowned_solution.gap.min() == pytest.approx(ball_solution.gap.min(), rel=1e-3, abs=1e-12)
    if oil is None:
        assert crowned_solution.pressure.max() == pytest.approx(ball.hertz.p_max, rel=0.01)


def test_oil_leaves_at_the_ends_and_the_film_there_is_thin():
    solution = solved(roller(lundberg(1.5 * LOAD)), OIL, cells=(96, 128))
    state, along = asp.contact_state(solution), axial_distribution(solution)
    assert solution.pressure[:, [0, -1]].max() == 0.0
    assert along.end_film.on_grid == state.h_min
    assert 0.3 * state.h_central < along.end_film.on_grid < 0.9 * state.h_central
    assert abs(along.load_centre) < 1e-4 * LENGTH


def test_the_end_film_of_smooth_bodies_equals_that_of_almost_smooth_bodies():
    """Rough bodies have another wedge and other means of the mobility, but not across the ends."""
    smooth = solved(roller(lundberg(LOAD)), OIL, cells=(96, 96))
    heights = 1e-11 * np.random.default_rng(2).standard_normal(smooth.grid.cells)
    rough = asp.solve_contact(
        smooth.conditions, OIL, asp.Surface(heights - heights.mean(), smooth.grid)
    )
    ends = [axial_distribution(solution).end_film.on_grid for solution in (smooth, rough)]
    assert ends[1] == pytest.approx(ends[0], rel=0.1)


def test_a_roller_is_as_stiff_as_a_strip_of_its_length():
    """π E* L/(2 ln(2L/a)), at the middle of a strip on a half-space; the dynamic stiffness at zero
    frequency is the tangent stiffness.
    """
    conditions = roller(lundberg(1.2 * LOAD))
    solution = solved(conditions, OIL, cells=(64, 64))
    a, modulus = conditions.hertz.half_widths[0], STEEL.reduced_modulus
    strip = np.pi * modulus * LENGTH / (2.0 * np.log(2.0 * LENGTH / a))
    tangent = tangent_stiffness(solution).total
    assert tangent == pytest.approx(strip, rel=0.1)
    assert dynamic_stiffness(solution, 0.0).stiffness == pytest.approx(tangent, rel=0.01)


def test_models_agree_in_a_full_film():
    """The paper's and the mixed model agree. The mass-conserving model has a wedge of first order
    and films some per cent thicker.
    """
    conditions = roller(ISO.tilted(0.3e-3))
    mixed, paper, conserving = (
        asp.contact_state(solved(conditions, OIL, cells=(96, 96), model=model))
        for model in ("mixed", "paper", "conserving")
    )
    assert paper.h_central == pytest.approx(mixed.h_central, rel=1e-3)
    assert paper.p_max == pytest.approx(mixed.p_max, rel=1e-3)
    assert mixed.h_central < conserving.h_central < 1.1 * mixed.h_central
    assert mixed.clr == paper.clr == conserving.clr == 0.0


@pytest.mark.parametrize(
    ("given", "load"),
    [
        ({"pair": asp.ElasticPair((1e12, 1e12), (0.2, 0.2))}, LOAD),
        ({"surface_speeds": (30.0, 30.0)}, LOAD),
        ({}, 100.0),
        ({"length": 1e-3}, 200.0),
        ({"length": 50e-3}, 5000.0),
    ],
)
def test_extreme_conditions_are_solved(given, load):
    conditions = roller(None, load, **given)
    shape = RollerShape.johns_gohar(
        1.3 * load, conditions.length, RADIUS, conditions.pair.reduced_modulus
    )
    conditions = replace(conditions, shape=shape)
    grid = auto_grid(conditions, OIL, accuracy=0.1)
    solution = asp.solve_contact(conditions, OIL, asp.flat_surface(grid))
    state = asp.contact_state(solution)
    assert abs(state.load_error) < 1e-4
    assert 0.0 < state.h_min < state.h_central


@pytest.mark.parametrize("shape", [ISO, RollerShape()])
def test_a_smooth_roller_at_very_low_speed_is_dry(shape):
    """The oil film would be thinner than a few molecules. A start from the dry contact needs about
    twelve iterations.
    """
    conditions = roller(shape, surface_speeds=(1e-3, 1e-3))
    slow, dry = (solved(conditions, oil, cells=(96, 120), past=4) for oil in (OIL, None))
    assert slow.convergence.iterations < 40
    assert asp.contact_state(slow).clr > 0.99
    middle = slice(10, -10)
    expected = np.interp(slow.grid.x, dry.grid.x, dry.pressure[:, 64])
    assert np.abs(slow.pressure[:, 64] - expected).max() < 0.05 * dry.pressure[:, middle].max()


def test_a_straight_roller_starts_from_its_dry_contact():
    """The sharp ends touch; the film in the middle is that of the line contact of its own load."""
    solution = solved(roller(), OIL, cells=(128, 120), past=4)
    assert solution.convergence.attempt == "coarse to fine"  # continued with the second-order wedge
    assert solution.convergence.iterations < 200
    along = axial_distribution(solution)
    middle = along.y.size // 2
    line = replace(roller(), geometry="line", load=float(along.line_load[middle]) * LENGTH)
    lower, upper = (solution.grid.lower[0], -1e-4), (solution.grid.upper[0], 1e-4)
    infinite = asp.solve_contact(line, OIL, asp.flat_surface(asp.Grid((128, 8), lower, upper)))
    assert asp.contact_state(solution).h_central == pytest.approx(
        asp.contact_state(infinite).h_central, rel=5e-3
    )


def test_without_speed_a_rough_roller_is_dry():
    conditions = roller(lundberg(1.5 * LOAD), surface_speeds=(1e-4, 1e-4), hardness=4e9)
    grid = auto_grid(conditions, OIL, cells=(64, 128))
    rough = gaussian_surface(
        grid, sq=0.5e-6, correlation_length=(40e-6, 400e-6), rng=np.random.default_rng(1)
    )
    slow, dry = (asp.solve_contact(conditions, oil, rough) for oil in (OIL, None))
    assert asp.contact_state(slow).clr > 0.999
    assert slow.pressure == pytest.approx(dry.pressure, abs=0.02 * dry.pressure.max())


def test_a_roller_solved_by_the_second_order_wedge_is_refined_to_the_third(monkeypatch):
    """The minimum film thickness of the second-order wedge differs by more than 0.1 %."""
    usual = solved(roller(ISO), OIL, cells=(96, 64))
    solve = CoarseToFine.solve

    def failing_at_third(strategy, search, levels, guess):
        if not strategy.third_order:
            return solve(strategy, search, levels, guess)
        pressure, approach = guess(levels[0])
        return search.steps(levels[0], Pressures(pressure, pressure, approach), 1e-9, 0)

    monkeypatch.setattr(CoarseToFine, "solve", failing_at_third)
    refined = solved(roller(ISO), OIL, cells=(96, 64))
    assert refined.convergence.attempt == usual.convergence.attempt == SolveStrategy.COARSE_TO_FINE
    assert refined.gap.min() == pytest.approx(usual.gap.min(), rel=1e-3)

    monkeypatch.setattr(cold_start, "_refine_third_order", lambda _, __, step: (SECOND, step))
    rough = solved(roller(ISO), OIL, cells=(96, 64))
    assert rough.convergence.attempt == SECOND
    assert abs(rough.gap.min() / usual.gap.min() - 1.0) > 1e-3
