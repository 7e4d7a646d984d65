"""Cycles of load and speeds: squeeze, start-up, reversal, time steps, the moving contact."""

import math
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from asperity.case import load_case
from asperity.contact.conditions import ContactConditions, ElasticPair
from asperity.contact.cycle import OperatingCycle
from asperity.contact.grid import Grid
from asperity.ehl import Options, solve_contact
from asperity.lubricant import Barus, DowsonHigginson, Incompressible, Lubricant, Newtonian
from asperity.results import solve_case
from asperity.simulation import solve_cycle
from asperity.simulation.cycle.film import (
    FILM_TOLERANCE,
    SmoothContact,
    cycle_grid,
    film_course,
    steady_films,
)
from asperity.simulation.cycle.instants import InstantJob, solve_instant
from asperity.surface import MovingSurfaces, flat_surface
from asperity.transient import cycle_contact, moving_contact

EXAMPLES = Path(__file__).parents[2] / "examples"
STEEL = ElasticPair((206e9, 206e9), (0.3, 0.3))
RIGID = ElasticPair((2e14, 2e14), (0.3, 0.3))
ISOVISCOUS = Lubricant(
    viscosity=Barus(eta0=0.1, alpha=1e-13), density=Incompressible(870.0), rheology=Newtonian()
)
OIL = Lubricant(
    viscosity=Barus(eta0=0.05, alpha=18e-9), density=DowsonHigginson(870.0), rheology=Newtonian()
)
RADIUS, ETA = 0.01, 0.1


def line(load=2000.0, pair=STEEL, speed=1.0):
    return ContactConditions(
        pair=pair,
        geometry="line",
        radius=RADIUS,
        length=0.01,
        load=load,
        surface_speeds=(speed, speed),
    )


def ball(load=20.0, pair=STEEL):
    return ContactConditions(
        pair=pair, geometry="point", radius=RADIUS, load=load, surface_speeds=(1.0, 1.0)
    )


def smooth(grid):
    flat = flat_surface(grid)
    return MovingSurfaces(flat, flat, (0.0, 0.0), grid)


def cam_like(load=1000.0, rows=329):
    """Load, radius and speeds vary by factors of 9, 3 and 20; oil turns round twice."""
    phase = np.linspace(0.0, 2.0 * math.pi, rows)
    speeds = np.c_[2.0 + 3.0 * np.cos(phase), -0.2 + np.cos(2.0 * phase)]
    return OperatingCycle(
        times=phase / (2.0 * math.pi) * 0.03,
        loads=load * (1.0 + 0.8 * np.cos(phase)),
        speeds=speeds,
        radii=0.012 + 0.006 * np.cos(phase),
    )


def course_of(cycle, contact, **settings):
    return film_course(SmoothContact(cycle, contact, OIL, **settings))


def at_rest(load, duration):
    return OperatingCycle(
        times=[0.0, duration], loads=[load] * 2, speeds=[(0.0, 0.0)] * 2, radii=[RADIUS] * 2
    )


def test_a_rigid_cylinder_sinks_as_the_closed_form():
    """Without motion F/L = 3 sqrt(2) π η V (R/h)^(3/2), hence h^(-1/2) grows linearly."""
    contact, first = line(10.0, RIGID), 20e-6
    grid = Grid((256, 8), (-5e-3, 0.0), (5e-3, 1e-3), periodic=(False, True))
    cycle = at_rest(10.0, 2e-3)
    steps = [
        *cycle_contact(
            cycle, contact, ISOVISCOUS, smooth(grid), np.linspace(0.0, 2e-3, 201), start=first
        )
    ]
    growth = (10.0 / 0.01) / (6.0 * math.sqrt(2.0) * math.pi * ETA * RADIUS**1.5)
    for step in steps:
        exact = (first**-0.5 + growth * step.time) ** -2
        assert step.solution.convergence.converged
        assert step.state.h_min == pytest.approx(exact, rel=3e-3)
    assert steps[-1].state.h_min < 0.1 * first


def test_a_rigid_ball_sinks_exponentially():
    """Without motion F = 6 π η R² V/h; the domain holds all but 0.6 % of the first pressure."""
    contact, first, load = ball(10.0, RIGID), 5e-6, 10.0
    time = 6.0 * math.pi * ETA * RADIUS**2 / load
    grid = Grid((160, 160), (-4e-3, -4e-3), (4e-3, 4e-3), periodic=(False, False))
    times = np.linspace(0.0, time, 41)
    steps = [
        *cycle_contact(at_rest(load, time), contact, ISOVISCOUS, smooth(grid), times, start=first)
    ]
    ratios = [step.state.h_min / (first * math.exp(-step.time / time)) for step in steps]
    assert len(steps) == 40
    assert max(abs(ratio - 1.0) for ratio in ratios) < 0.015


@pytest.mark.parametrize("contact", [line(), ball()], ids=["line", "ball"])
def test_a_film_starts_up_as_the_published_equation(contact):
    """The film that enters at the inlet travels downstream unchanged, at the entrainment speed:
    J. Sugimura et al., Tribology International 32 (1999) 117, who confirm it by measurement.
    """
    a = contact.hertz.half_widths[0]
    grid = (
        Grid((256, 8), (-4.0 * a, 0.0), (2.0 * a, 1e-4), periodic=(False, True))
        if contact.endless
        else Grid((96, 64), (-4.0 * a, -2.0 * a), (1.6 * a, 2.0 * a), periodic=(False, False))
    )
    rise = 3.0 * 2.0 * a / 0.6  # of the speed: three passages of the contact
    cycle = OperatingCycle(
        times=[0.0, rise, 1.5 * rise],
        loads=[contact.load] * 3,
        speeds=[(0.2, 0.2), (1.0, 1.0), (1.0, 1.0)],
        radii=[RADIUS] * 3,
    )
    middle = int(np.argmin(np.abs(grid.x))), grid.cells[1] // 2
    speeds = np.geomspace(0.2, 1.0, 6)
    steady = [
        solve_contact(replace(contact, surface_speeds=(u, u)), OIL, flat_surface(grid)).gap[middle]
        for u in speeds
    ]
    times = np.linspace(0.0, 1.5 * rise, 31)
    earlier = np.linspace(-5.0 * rise, 1.5 * rise, 20001)
    entrained = np.interp(earlier, cycle.times, np.mean(cycle.speeds, axis=1))
    path = np.concatenate(
        [[0.0], np.cumsum(np.diff(earlier) * 0.5 * (entrained[1:] + entrained[:-1]))]
    )
    lagged = 0
    for step in cycle_contact(cycle, contact, OIL, smooth(grid), times, film_tolerance=0.002):
        if step.time not in times:
            continue
        entered = np.interp(np.interp(step.time, earlier, path) - a, path, earlier)
        speed = np.interp(entered, earlier, entrained)
        published = np.exp(np.interp(np.log(speed), np.log(speeds), np.log(steady)))
        assert step.solution.gap[middle] == pytest.approx(published, rel=0.1)
        present = np.exp(
            np.interp(
                math.log(cycle.state(step.time).entrainment_speed), np.log(speeds), np.log(steady)
            )
        )
        lagged += step.solution.gap[middle] < 0.75 * present
    assert lagged >= 5  # the steady film at the speed of the moment would be far off


def test_a_constant_cycle_is_the_moving_contact():
    case = load_case(EXAMPLES / "paper.toml").with_overrides(
        {"grid.cells": [48, 24], "grid.x": [-2.5, 1.5], "grid.y": [-1.0, 1.0]}
    )
    conditions = case.conditions
    surfaces = case.moving_surfaces(4)
    options = replace(case.options, tolerance=1e-5)
    cell = surfaces.grid.spacing[0] / conditions.entrainment_speed
    times = 2.0 * cell * np.arange(7)
    cycle = OperatingCycle(
        times=[0.0, times[-1]],
        loads=[conditions.load] * 2,
        speeds=[conditions.surface_speeds] * 2,
        radii=[conditions.radius_along_rolling] * 2,
    )
    steps = cycle_contact(cycle, conditions, case.lubricant, surfaces, times, options=options)
    others = moving_contact(conditions, case.lubricant, surfaces, time_step=2.0, options=options)
    for step, other in zip(steps, others, strict=False):
        assert step.time == pytest.approx(other.time, rel=1e-12, abs=0.0)
        np.testing.assert_allclose(step.solution.gap, other.solution.gap, rtol=2e-4, atol=1e-12)
        assert step.state.clr == pytest.approx(other.state.clr, rel=2e-4)
        if step.number:
            last = step.state.clr
    assert 0.05 < last < 0.95


def test_a_constant_smooth_cycle_keeps_the_steady_film():
    contact = line()
    cycle = OperatingCycle(
        times=[0.0, 0.01], loads=[2000.0] * 2, speeds=[(1.0, 1.0)] * 2, radii=[RADIUS] * 2
    )
    course = course_of(cycle, contact)
    steady = steady_films(SmoothContact(cycle, contact, OIL), course.grid, np.array([0.0]))[0]
    assert course.h_min == pytest.approx(np.full(2, steady[1]), rel=1e-4)
    assert course.periods == 1
    assert course.failed == 0


def test_a_cam_of_329_angles_balances_its_load_and_twice_the_time_step_changes_little(monkeypatch):
    monkeypatch.setattr("asperity.simulation.cycle.film.MAX_LINE_CELLS", 120)
    cycle, contact = cam_like(), line()
    course = course_of(cycle, contact)
    assert len(course.times) == 329
    assert (course.failed, course.periods) == (0, 1)
    assert course.load_error < 1e-3
    coarser = course_of(cycle, contact, film_tolerance=4.0 * FILM_TOLERANCE)
    assert course.steps > 1.3 * coarser.steps  # the steps are of second order
    for name in ("h_min", "h_central"):
        change = getattr(coarser, name) / getattr(course, name) - 1.0
        assert np.max(np.abs(change)) < 0.02
    # squeeze carries the contact through the reversal, where the steady film vanishes
    turns = int(np.argmin(np.abs(np.mean(cycle.speeds, axis=1))))
    steady = steady_films(
        SmoothContact(cycle, contact, OIL), course.grid, np.asarray(cycle.times)[[turns]]
    )[0]
    assert course.h_min[turns] > 1.5 * steady[1]


def test_both_halves_of_an_oscillation_are_mirror_images(monkeypatch):
    monkeypatch.setattr("asperity.simulation.cycle.film.MAX_LINE_CELLS", 240)
    phase = np.linspace(0.0, 2.0 * math.pi, 81)
    cycle = OperatingCycle(
        times=0.02 * phase / (2.0 * math.pi),
        loads=[500.0] * 81,
        speeds=np.outer(np.cos(phase), (1.2, 0.8)),
        radii=[RADIUS] * 81,
    )
    assert cycle.repeats
    assert cycle.reverses
    course = course_of(cycle, line(500.0))
    half = course.h_min[:41], course.h_min[40:]
    assert half[0] == pytest.approx(half[1], rel=0.02)
    assert course.closure < 0.01
    # thinnest after the turn, where the constriction of the outlet meets the inlet
    assert course.times[np.argmin(course.h_min)] % 0.01 > 0.005


def test_the_film_stays_where_it_is_while_oil_turns_round():
    """x then points the other way: the gap of one step is that of the next, mirrored."""
    cycle = OperatingCycle(
        times=[0.0, 2e-3],
        loads=[500.0] * 2,
        speeds=[(0.2, 0.1), (-0.2, -0.1)],
        radii=[RADIUS] * 2,
    )
    contact = line(500.0)
    grid = cycle_grid(cycle, contact, OIL)
    times = np.concatenate([np.linspace(0.0, 0.98e-3, 20), np.linspace(0.99e-3, 1.11e-3, 61)])
    gaps = [step.solution.gap for step in cycle_contact(cycle, contact, OIL, smooth(grid), times)]
    zone = np.abs(grid.x) < contact.hertz.half_widths[0]
    turned = [np.max(np.abs(after[::-1] / before - 1.0)[zone]) for before, after in pairwise(gaps)]
    kept = [np.max(np.abs(after / before - 1.0)[zone]) for before, after in pairwise(gaps)]
    turn = int(np.argmin(turned[20:])) + 20
    assert turned[turn] < 0.01
    assert kept[turn] > 0.1  # the outlet's constriction is now at the inlet
    assert max(change for number, change in enumerate(kept[20:], 20) if number != turn) < 0.03


def test_roughness_is_mirrored_with_the_oil():
    case = load_case(EXAMPLES / "paper.toml").with_overrides(
        {"grid.cells": [48, 24], "grid.x": [-2.0, 2.0], "grid.y": [-1.0, 1.0]}
    )
    surfaces = case.moving_surfaces(4)
    cycle = OperatingCycle(
        times=[0.0, 1e-3], loads=[500.0] * 2, speeds=[(1.0, 0.5), (-1.0, -0.5)], radii=[5.4e-3] * 2
    )
    times = np.array([0.0, 1e-5, 0.5e-3, 0.6e-3])
    options = replace(case.options, tolerance=0.09)
    steps = [
        *cycle_contact(cycle, case.conditions, case.lubricant, surfaces, times, options=options)
    ]
    for step, turned in zip(steps, (False, False, False, True), strict=True):
        heights = surfaces.composite_displaced(cycle.travelled(step.time)).heights
        expected = heights[::-1] if turned else heights
        np.testing.assert_allclose(step.solution.surface.heights, expected, atol=1e-15)


def test_the_grid_of_a_cycle_does_not_decide_its_film(monkeypatch):
    cycle, contact, coarser = cam_like(rows=31), line(), 9.0 * FILM_TOLERANCE
    fine = course_of(cycle, contact, film_tolerance=coarser)
    monkeypatch.setattr("asperity.simulation.cycle.film.MAX_LINE_CELLS", 360)
    coarse = course_of(cycle, contact, film_tolerance=coarser)
    assert coarse.grid.cells[0] == cycle_grid(cycle, contact, OIL).cells[0] == 360
    assert fine.grid.cells[0] == 720
    assert np.median(np.abs(coarse.h_min / fine.h_min - 1.0)) < 0.01
    assert np.max(np.abs(coarse.h_min / fine.h_min - 1.0)) < 0.12  # while oil turns round


@pytest.fixture(scope="module")
def paper():
    return load_case(EXAMPLES / "paper.toml").with_overrides({"solver.running_cells": 400})


def test_a_constant_cycle_has_the_load_share_of_the_running_contact(paper):
    conditions = paper.conditions
    cycle = OperatingCycle(
        times=[0.0, 0.02],
        loads=[conditions.load] * 2,
        speeds=[conditions.surface_speeds] * 2,
        radii=[conditions.radius_along_rolling] * 2,
    )
    result = solve_cycle(paper, cycle, instants=[0.0, 0.012], workers=1)
    running = solve_case(paper)
    for instant in result.solved:
        low, high = instant.interval("clr")
        assert low < running.state.clr < high
        assert high - low < 0.6
    assert len(result.solved) == 2
    friction = result.solved[0].numbers["friction_coefficient"]
    slid = conditions.sliding_speed * conditions.load * 0.02
    assert result.friction_energy.value == pytest.approx(friction * slid, rel=0.15)


@pytest.mark.parametrize("time", [0.0, 0.0095])
def test_the_load_share_of_an_instant_hardly_depends_on_the_steps(paper, time, monkeypatch):
    """At full speed and just after oil turned round, where the bodies slide fast."""
    job = InstantJob(paper, cam_like(400.0), time, 0, coarse=True, start="steady")
    usual = solve_instant(job)
    monkeypatch.setattr("asperity.simulation.cycle.instants.CELLS", 1.0)
    monkeypatch.setattr("asperity.simulation.cycle.instants.SLIDING_CELLS", 0.5)
    monkeypatch.setattr("asperity.simulation.cycle.instants.STEPS_PER_PERIOD", 400)
    monkeypatch.setattr("asperity.simulation.cycle.instants.MAX_STEPS", 160)
    fine = solve_instant(job)
    assert fine.steps > 1.3 * usual.steps
    assert usual.numbers["clr"] == pytest.approx(fine.numbers["clr"], abs=0.1)
    assert usual.numbers["friction_coefficient"] == pytest.approx(
        fine.numbers["friction_coefficient"], abs=0.01
    )


def test_an_instant_forgets_how_its_simulation_began(paper, monkeypatch):
    job = InstantJob(paper, cam_like(400.0), 0.004, 0, coarse=False, start="steady")
    usual = solve_instant(job)
    monkeypatch.setattr("asperity.simulation.cycle.instants.LEAD", 3.0)
    longer = solve_instant(job)
    assert longer.steps > 1.25 * usual.steps
    assert usual.numbers["clr"] == pytest.approx(longer.numbers["clr"], abs=0.05)


def test_conserved_oil_passes_a_cycle_without_reversal(monkeypatch):
    monkeypatch.setattr("asperity.simulation.cycle.film.MAX_LINE_CELLS", 240)
    phase = np.linspace(0.0, 2.0 * math.pi, 61)
    cycle = OperatingCycle(
        times=0.02 * phase / (2.0 * math.pi),
        loads=500.0 + 200.0 * np.cos(phase),
        speeds=np.outer(1.0 + 0.5 * np.cos(phase), (1.0, 1.0)),
        radii=[RADIUS] * 61,
    )
    contact = line(500.0)
    usual = course_of(cycle, contact)
    conserving = course_of(cycle, contact, options=Options(model="conserving"))
    assert conserving.failed == 0
    assert conserving.h_min == pytest.approx(usual.h_min, rel=0.05)  # its wedge: first order
