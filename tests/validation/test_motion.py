"""Moving roughness: published amplitudes of waviness, orders, what stays when nothing moves, where
the power goes.
"""

from itertools import islice, pairwise

import numpy as np
import pytest
from benchmarks.motion import VENNER, contact, waves

from asperity.core.errors import BadInput
from asperity.ehl import Options, Scales, solve_contact
from asperity.ehl.problem_setup import contact_problem
from asperity.lubricant import Barus, Incompressible, Lubricant, Newtonian
from asperity.solution import contact_state, friction
from asperity.surface import MovingSurfaces, Surface, flat_surface
from asperity.transient import moving_contact
from support import paper

CELLS = {4.0: 64, 2.0: 64, 1.0: 64, 0.5: 64, 0.25: 128, 0.125: 64}  # a half-width


@pytest.mark.parametrize(
    "wavelength",
    [
        *(wavelength for wavelength in VENNER if wavelength > 0.125),
        pytest.param(
            0.125,
            marks=pytest.mark.xfail(
                strict=True,
                reason=(
                    "0.917 here, 0.882 in the limit, 5.1 % above the number as it came;"
                    " docs/theory/motion.md"
                ),
            ),
        ),
    ],
)
def test_amplitude_of_moving_waviness_is_venners_within_5_percent(wavelength):
    assert waves(wavelength, CELLS[wavelength]).central == pytest.approx(
        VENNER[wavelength], rel=0.05
    )


def test_waves_do_not_care_how_high_they_are_below_the_film():
    """The same paper: below the film's thickness the ratio depends on nothing but the
    wavelength.
    """
    low, high = waves(1.0, 32).central, waves(1.0, 32, share=0.4).central
    assert low == pytest.approx(high, rel=0.03)


def test_a_wave_on_eight_cells_is_carried_and_not_smeared():
    """In the middle oil hardly flows by pressure: what is there was carried there."""
    wave = waves(0.125, 64)
    assert abs(wave.at(0.0)) == pytest.approx(abs(wave.at(-0.4)), rel=0.02)
    assert wave.central > 0.8  # 0.1 with time and wedge differenced apart


def test_cell_and_step_together_converge():
    """Towards second order: 1.6 on these grids."""
    coarse, middle, fine = (waves(1.0, cells).at(0.0) for cells in (32, 64, 128))
    assert abs(fine - middle) < abs(middle - coarse) / 2.5


def test_steps_alone_converge_at_second_order():
    long, half, quarter = (waves(1.0, 16, time_step).at(0.0) for time_step in (0.5, 0.25, 0.125))
    assert np.log2(abs(half - long) / abs(quarter - half)) == pytest.approx(2.0, abs=0.15)


def standing(surface):
    return MovingSurfaces.one_rough(surface, (0.0, 0.0))


@pytest.mark.parametrize("time_step", [1.0, 0.5])
def test_where_nothing_moves_the_snapshot_stays(time_step):
    on = paper.grid((64, 64))
    conditions, tight = paper.contact(hardness=2e9), Options(tolerance=1e-7)
    surface = paper.rough(on, 1e-6)
    taken = moving_contact(
        conditions, paper.barus(), standing(surface), options=tight, time_step=time_step
    )
    start, *_, last = islice(taken, 9)
    snapshot = solve_contact(conditions, paper.barus(), surface, options=tight)
    for one in (start, last):
        np.testing.assert_allclose(
            one.solution.pressure, snapshot.pressure, atol=1e-5 * conditions.hertz.p_max
        )
        assert one.state.clr == pytest.approx(contact_state(snapshot).clr, abs=1e-5)


def test_a_smooth_contact_stays_as_it_is_though_its_surfaces_run():
    on = paper.grid((128, 8))
    taken = moving_contact(
        paper.contact(),
        paper.barus(),
        MovingSurfaces.one_rough(flat_surface(on), paper.contact().surface_speeds),
    )
    start, *_, last = islice(taken, 101)
    np.testing.assert_allclose(last.solution.gap, start.solution.gap, rtol=1e-5)


@pytest.mark.parametrize("time_step", [1.0, 2.0])
def test_a_contact_at_rest_fills_until_it_is_the_steady_one(time_step):
    """Whatever it began with, oil that crosses a smooth contact leaves nothing behind."""
    on, conditions = paper.grid((96, 8)), paper.contact(hardness=2e9)
    surfaces = MovingSurfaces.one_rough(flat_surface(on), conditions.surface_speeds)
    taken = moving_contact(
        conditions, paper.barus(), surfaces, start="stationary", time_step=time_step
    )
    start, *_, last = islice(taken, int(192 / time_step) + 1)
    steady = contact_state(solve_contact(conditions, paper.barus(), flat_surface(on)))
    assert start.state.clr > 0.99
    assert start.state.h_central < 0.02 * steady.h_central
    assert last.state.clr == 0.0
    assert last.state.h_min == pytest.approx(steady.h_min, rel=1e-3)
    assert last.state.h_central == pytest.approx(steady.h_central, rel=1e-3)


@pytest.fixture(scope="module")
def full_film():
    """Waves in an oil that is not compressed, over a film thick enough to part the bodies;
    sliding.
    """
    conditions = paper.contact()
    on = paper.grid((384, 8))
    oil = Lubricant(
        viscosity=Barus(paper.ETA0, 12e-9), density=Incompressible(880.0), rheology=Newtonian()
    )
    length = on.extent[0] / 12.0
    profile = 0.05e-6 * np.cos(2.0 * np.pi * on.x / length)
    surface = Surface(np.repeat(profile[:, None], 8, axis=1), on)
    surfaces = MovingSurfaces.one_rough(surface, conditions.surface_speeds)
    taken = moving_contact(
        conditions, oil, surfaces, options=Options(tolerance=1e-6), time_step=0.5
    )
    return conditions, oil, list(islice(taken, 13))[-3:]


def test_what_walls_do_on_the_oil_is_what_its_flow_turns_to_heat(full_film):
    """∫ p (∂h/∂t + u ∂h/∂x) = -∫ h³/(12 η) |∂p/∂x|²: both sides by differences of the fields
    alone.
    """
    conditions, oil, (before, now, after) = full_film
    on, length = now.solution.grid, conditions.length
    pressure, gap = now.solution.pressure[:, 0], now.solution.gap[:, 0]
    squeezed = (after.solution.gap[:, 0] - before.solution.gap[:, 0]) / (after.time - before.time)
    drawn = conditions.entrainment_speed * np.gradient(gap, on.x)
    work = -np.sum(pressure * (squeezed + drawn)) * on.spacing[0] * length
    flow = gap**3 / (12.0 * oil.viscosity(pressure)) * np.gradient(pressure, on.x) ** 2
    assert now.flow_power == pytest.approx(np.sum(flow) * on.spacing[0] * length, rel=0.03)
    assert now.flow_power == pytest.approx(work, rel=0.03)
    assert abs(np.sum(pressure * squeezed)) > 0.02 * abs(
        np.sum(pressure * drawn)
    )  # the squeeze has its part in it


def test_elastic_energy_changes_by_the_work_of_pressure_on_the_deflection(full_film):
    """dE = ∫ p dV: the half-space answers alike both ways. V is gap less shape, approach and
    roughness.
    """
    conditions, _, (before, now, after) = full_film
    on = now.solution.grid

    def deflection(one):
        shape = on.x**2 / (2.0 * conditions.radius) + one.solution.rigid_approach
        return one.solution.gap[:, 0] - shape + one.solution.surface.heights[:, 0]

    work = np.sum(now.solution.pressure[:, 0] * (deflection(after) - deflection(before)))
    work *= on.spacing[0] * conditions.length
    assert after.elastic_energy - before.elastic_energy == pytest.approx(work, rel=0.02)


def test_friction_is_the_shear_of_the_film_and_heats_by_sliding(full_film):
    conditions, oil, (_, now, _) = full_film
    solution = now.solution
    rubbing = friction(solution)
    rate = conditions.sliding_speed / solution.gap[:, 0]
    stress = np.where(
        solution.pressure[:, 0] > 0.0, oil.viscosity(solution.pressure[:, 0]) * rate, 0.0
    )
    lost = (
        np.sum(np.where(rate > 0.0, stress * rate * solution.gap[:, 0], 0.0))
        * solution.grid.spacing[0]
    )
    limited = rubbing.power < lost * conditions.length  # Bair and Winer's limit may only take away
    assert limited
    assert rubbing.power == pytest.approx(
        rubbing.coefficient * conditions.load * conditions.sliding_speed
    )


def test_moving_asperities_carry_the_load_at_every_step():
    on, conditions = paper.grid((64, 64)), paper.contact(hardness=2e9)
    surfaces = MovingSurfaces.one_rough(paper.rough(on, 1e-6), conditions.surface_speeds)
    taken = list(islice(moving_contact(conditions, paper.barus(), surfaces), 25))
    for one in taken:
        solution = one.solution
        assert solution.convergence.converged
        carried = (
            solution.pressure.sum()
            * on.spacing[0]
            * on.spacing[1]
            * conditions.length
            / on.extent[1]
        )
        assert carried == pytest.approx(conditions.load, rel=1e-4)
        assert solution.pressure.max() <= conditions.hardness * (1.0 + 1e-12)
        assert solution.gap.min() >= solution.options.contact_film * (1.0 - 1e-12)
        asperities = friction(solution, boundary_friction=0.15).asperity_part
        assert asperities == pytest.approx(0.15 * one.state.clr)
    assert all(after.time > before.time for before, after in pairwise(taken))
    assert np.std([one.state.clr for one in taken]) > 0.005


def test_going_on_from_a_snapshot_is_as_if_there_had_been_no_stop():
    on, conditions = paper.grid((48, 48)), paper.contact(hardness=2e9)
    surfaces = MovingSurfaces.one_rough(
        paper.rough(on, 1e-6, correlation_length=40e-6), conditions.surface_speeds
    )
    through = list(islice(moving_contact(conditions, paper.barus(), surfaces), 7))
    memory = {name: values.copy() for name, values in through[3].memory.items()}
    again = list(islice(moving_contact(conditions, paper.barus(), surfaces, resume=memory), 3))
    for one, other in zip(through[4:], again, strict=True):
        assert one.number == other.number
        assert np.array_equal(one.solution.pressure, other.solution.pressure)
        assert np.array_equal(one.solution.gap, other.solution.gap)


@pytest.fixture(scope="module")
def run_in():
    """Two passes of a rough surface that is flattened as it passes, in pure rolling."""
    conditions = paper.contact(hardness=0.7e9, surface_speeds=(1.91, 1.91))
    on = paper.grid((48, 48), x=(-3.0, 1.8))
    surfaces = MovingSurfaces.one_rough(
        paper.rough(on, 1e-6, correlation_length=40e-6), conditions.surface_speeds
    )
    return surfaces, list(
        islice(moving_contact(conditions, paper.barus(), surfaces, flattening=True), 97)
    )


def overlap(one):
    """How deep the bodies overlap [m], from pressure and roughness alone."""
    solution = one.solution
    scales = Scales.from_conditions(solution.conditions, solution.lubricant)
    posed = contact_problem(
        solution.conditions, solution.lubricant, solution.surface, solution.options
    )
    bent = posed.undeformed + posed.deflection(solution.pressure / scales.pressure)
    gap = bent * scales.gap + solution.rigid_approach
    return np.maximum(solution.options.contact_film - gap, 0.0) * (
        solution.pressure == solution.conditions.hardness
    )


def test_tracks_lose_what_overlapped_and_nothing_else(run_in):
    surfaces, taken = run_in
    lost = np.cumsum([overlap(one).sum() for one in taken])
    np.testing.assert_allclose(
        [one.memory["lowered_first"].sum() for one in taken], lost, rtol=1e-9
    )
    np.testing.assert_allclose(
        [one.flattened for one in taken], lost / surfaces.first.heights.size, rtol=1e-9
    )
    assert not np.any(taken[-1].memory["lowered_second"])  # it is smooth
    last, before = taken[-1].solution.surface.heights, taken[-2].memory["lowered_first"]
    np.testing.assert_allclose(
        last, np.roll(surfaces.first.heights - before, 96, axis=0), atol=1e-15
    )


def test_what_is_flat_stays_flat(run_in):
    """Asperities that have been through once carry the load on more area: the second pass takes off
    less.
    """
    _, taken = run_in
    first, second = (
        taken[48].flattened - taken[0].flattened,
        taken[96].flattened - taken[48].flattened,
    )
    assert 0.0 < second < 0.5 * first
    assert taken[96].track_sq < taken[0].track_sq


def test_an_elastic_surface_is_never_flattened():
    on, conditions = paper.grid((48, 48), x=(-3.0, 1.8)), paper.contact()
    surfaces = MovingSurfaces.one_rough(
        paper.rough(on, 0.5e-6, correlation_length=60e-6), conditions.surface_speeds
    )
    *_, last = islice(moving_contact(conditions, paper.barus(), surfaces, flattening=True), 4)
    assert last.flattened == 0.0


@pytest.mark.parametrize(
    ("wrong", "said"),
    [
        ({"time_step": 0.0}, "positive"),
        ({"time_step": 9.0}, "at most 8"),
        ({"start": "no"}, "steady"),
    ],
)
def test_steps_that_cannot_be_meant_are_refused(wrong, said):
    on = paper.grid((64, 8))
    surfaces = MovingSurfaces.one_rough(flat_surface(on), (1.0, 1.0))
    with pytest.raises(BadInput, match=said):
        next(moving_contact(paper.contact(), paper.barus(), surfaces, **wrong))


def test_moess_numbers_are_what_they_are_said_to_be():
    conditions = contact(100.0, 11.0)
    modulus, radius = conditions.pair.effective_modulus, conditions.radius
    twice_u = 2.0 * 0.04 * conditions.entrainment_speed / (modulus * radius)
    assert conditions.line_load / (modulus * radius) / np.sqrt(twice_u) == pytest.approx(100.0)
    assert 2.2e-8 * modulus * twice_u**0.25 == pytest.approx(11.0)
