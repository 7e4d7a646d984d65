"""Inlet shear heating: a twin that resolves the film's thickness, energy balance, limits."""

import math
from dataclasses import replace

import numpy as np
import pytest

from asperity.benchmark import load_experiments
from asperity.case import case_template, load_case
from asperity.contact.conditions import ContactConditions, ElasticPair
from asperity.contact.grid import Grid
from asperity.core.errors import AsperityError, BadInput, NotConverged
from asperity.ehl import inlet_heating_factor, solve_contact
from asperity.lubricant import (
    Barus,
    ExponentialWarmth,
    Incompressible,
    Lubricant,
    Newtonian,
    ReeEyring,
    Solid,
    Thermal,
)
from asperity.results import solve_case
from asperity.solution import (
    friction,
    friction_and_heat,
    heats_inlet,
    inlet,
    inlet_heating,
    inlet_viscosity_factor,
    solve_thermal_contact,
)
from asperity.solution.film_transport import FilmTransport
from asperity.solution.inlet import HEAT_CAPACITY
from asperity.surface import flat_surface
from support.inlet import inlet_film_factor

STEEL = Solid()
COLD = Solid(conductivity=1e9)  # surfaces that stay at ambient temperature
OIL = Lubricant(viscosity=Barus(0.1, 20e-9), density=Incompressible(870.0), rheology=Newtonian())
BETA, CONDUCTIVITY = 0.05, 0.14
FILM = next(entry.case for entry in load_experiments() if entry.name == "fva3-25c")
THERMAL = Thermal(warmth=ExponentialWarmth(BETA), oil_conductivity=CONDUCTIVITY)


def rolling(loading, *, eta0=0.1, load=1000.0, slip=0.0, geometry="line"):
    """Return a contact with a thermal loading parameter L = η₀ β u²/k."""
    speed = math.sqrt(loading * CONDUCTIVITY / (eta0 * BETA))
    return ContactConditions(
        pair=ElasticPair((206e9, 206e9), (0.3, 0.3)),
        geometry=geometry,
        radius=0.01,
        load=load,
        surface_speeds=(speed * (1.0 + slip / 2.0), speed * (1.0 - slip / 2.0)),
        **({"length": 0.01} if geometry == "line" else {}),
    )


def grid_of(conditions, reach=8.0, cells=160):
    a = conditions.hertz.half_widths[0]
    if conditions.geometry == "line":
        return Grid((cells, 8), (-reach * a, -a), (2.0 * a, a))
    return Grid((cells, cells), (-reach * a, -5.0 * a), (2.0 * a, 5.0 * a), (False, False))


@pytest.mark.parametrize(
    ("eta0", "load", "loading"),
    [
        (0.1, 1000.0, 0.02),
        (0.1, 1000.0, 0.2),
        *((eta0, 5000.0, loading) for eta0 in (0.1, 0.4) for loading in (0.02, 0.2, 1.0, 3.0)),
    ],
)
def test_the_film_follows_a_twin_that_resolves_its_thickness(eta0, load, loading):
    """Within 15 % of the loss of film, up to a third of the film."""
    conditions = rolling(loading, eta0=eta0, load=load)
    oil = replace(OIL, viscosity=Barus(eta0, 20e-9))
    heat = inlet_heating(
        conditions, oil, grid_of(conditions), replace(THERMAL, solids=(COLD, COLD))
    )
    twin = inlet_film_factor(
        speed=conditions.entrainment_speed,
        eta0=eta0,
        alpha=20e-9,
        beta=BETA,
        conductivity=CONDUCTIVITY,
        capacity=HEAT_CAPACITY * 870.0,
        expansion=0.7 / 870.0 * THERMAL.ambient,
        half_width=conditions.hertz.half_widths[0],
        radius=0.01,
        reach=8.0,
    )
    assert twin < 1.0
    assert 1.0 - heat.film_factor == pytest.approx(1.0 - twin, rel=0.15, abs=1e-3)


@pytest.mark.parametrize("slip", [0.0, 0.5])
@pytest.mark.parametrize("geometry", ["line", "point"])
def test_the_energy_balance_of_the_inlet_closes(geometry, slip):
    conditions = rolling(
        0.5, load=50.0 if geometry == "point" else 1000.0, slip=slip, geometry=geometry
    )
    heat = inlet_heating(conditions, OIL, grid_of(conditions), THERMAL)
    assert heat.generated_w > 0.0
    assert heat.walls_w > 0.5 * heat.generated_w
    assert heat.carried_w > 1e-3 * heat.generated_w  # the balance is not that of the walls alone
    assert heat.walls_w + heat.carried_w == pytest.approx(heat.generated_w, rel=1e-4)


def test_the_heat_is_the_power_of_the_flow():
    """∫ u (h - h_c) dp of a line contact in pure rolling, and u h_c ε T p up to the Hertz zone."""
    conditions = rolling(0.02)
    heat = inlet_heating(conditions, OIL, grid_of(conditions), THERMAL)
    solution = solve_contact(conditions, OIL, flat_surface(heat.grid))
    half = heat.grid.x < 0.0
    pressure, gap = solution.pressure[half, 0], solution.gap[half, 0]
    central = gap[-1]
    flow = float(np.sum((0.5 * (gap[1:] + gap[:-1]) - central) * np.diff(pressure)))
    edge = pressure[heat.grid.x[half] < -conditions.hertz.half_widths[0]][-1]
    compression = 0.7 / 870.0 * THERMAL.ambient * central * edge
    power = conditions.entrainment_speed * (flow + compression) * conditions.length
    assert heat.generated_w == pytest.approx(power, rel=0.03)


def test_sliding_adds_its_power_before_the_hertz_zone():
    """The sum of τ Δu there; with thermal feedback it belongs to the temperature of the film."""
    contacts = [rolling(0.1, slip=slip) for slip in (0.0, 0.5)]
    grid = grid_of(contacts[0])
    without, with_sliding = (inlet_heating(contact, OIL, grid, THERMAL) for contact in contacts)
    fed = inlet_heating(contacts[1], OIL, grid, replace(THERMAL, feedback=True))
    solution = solve_contact(contacts[1], OIL, flat_surface(without.grid))
    before = without.grid.x < -contacts[1].hertz.half_widths[0]
    stress = np.abs(friction(solution, thermal=THERMAL).shear[before, 0])
    speed = contacts[1].sliding_speed
    power = stress.sum() * speed * without.grid.spacing[0] * contacts[1].length
    assert power > 0.05 * without.generated_w
    added = with_sliding.generated_w - without.generated_w
    assert added == pytest.approx(power, rel=0.1)
    assert fed.generated_w == pytest.approx(without.generated_w, rel=0.02)


def test_with_feedback_the_inlet_is_that_of_oil_at_the_temperature_of_the_bodies():
    """The film of warm bodies is that of a warm supply, with or without inlet shear heating."""
    conditions = rolling(0.5)
    grid, warm = grid_of(conditions), 40.0
    bulk = (THERMAL.ambient + warm,) * 2
    fed = replace(THERMAL, feedback=True, bulk=bulk)
    supplied = replace(OIL, viscosity=Barus(0.1 * math.exp(-BETA * warm), 20e-9))
    found = inlet_heating(conditions, OIL, grid, fed).film_factor
    expected = inlet_heating(conditions, supplied, grid, THERMAL).film_factor
    assert found == pytest.approx(expected, abs=2e-3)
    assert inlet_heating(conditions, OIL, grid, THERMAL).film_factor < expected - 0.05


def test_friction_keeps_the_warm_inlet_beside_a_film_temperature():
    conditions = rolling(0.5, slip=0.02)
    surface = flat_surface(grid_of(conditions))
    heated = solve_thermal_contact(
        conditions, OIL, surface, thermal=replace(THERMAL, inlet_heating=True)
    )
    below = [
        friction_and_heat(heated, thermal=replace(THERMAL, inlet_heating=flag))[0].heat_below
        for flag in (True, False)
    ]
    cold = solve_contact(conditions, OIL, surface)
    reference = friction_and_heat(cold, thermal=THERMAL)[0].heat_below
    assert below[0] == pytest.approx(reference, rel=0.3)
    assert below[1] < 0.97 * below[0]


def test_slow_contacts_keep_their_film():
    """The loss is proportional to L at small L, and vanishes with the speed."""
    losses = []
    for loading in (1e-2, 1e-3, 1e-4):
        conditions = rolling(loading)
        losses.append(
            1.0 - inlet_heating(conditions, OIL, grid_of(conditions), THERMAL).film_factor
        )
    assert 0.0 <= losses[2] < 2e-4
    assert losses[0] < 0.01
    case = FILM.with_overrides({"contact.entrainment_speed": "0.02 m/s", "grid.cells": [96, 96]})
    films = [
        solve_case(case.with_overrides({"thermal.inlet_heating": heats})).summary()["h_central_m"]
        for heats in (True, False)
    ]
    assert films[0] == pytest.approx(films[1], rel=3e-4)


def test_sliding_and_warm_surfaces_thin_the_film_further():
    conditions = rolling(0.3)
    grid = grid_of(conditions)
    cold, steel = (
        inlet_heating(conditions, OIL, grid, replace(THERMAL, solids=(solid, solid))).film_factor
        for solid in (COLD, STEEL)
    )
    glass = Solid(conductivity=1.1, density=2500.0, heat_capacity=840.0)
    disc = inlet_heating(conditions, OIL, grid, replace(THERMAL, solids=(STEEL, glass))).film_factor
    sliding = inlet_heating(rolling(0.3, slip=0.5), OIL, grid, THERMAL).film_factor
    assert 1.0 > cold > steel > disc
    assert 1.0 - sliding > 1.08 * (1.0 - steel)  # without heat of sliding 1.01 times
    thinning = replace(OIL, rheology=ReeEyring(1e5))
    assert inlet_heating(rolling(0.3, slip=0.5), thinning, grid, THERMAL).film_factor > sliding


def test_published_fits_are_of_the_same_size():
    """Fit of Gupta et al. for steel: twice the solved loss at small L, 1.1 times it at L = 2."""
    for loading, least, most in ((0.1, 0.45, 0.75), (2.0, 0.8, 1.0)):
        conditions = rolling(loading, load=5000.0)
        solved = inlet_heating(conditions, OIL, grid_of(conditions), THERMAL).film_factor
        fit = inlet_heating_factor(conditions, OIL, THERMAL)
        assert least < (1.0 - solved) / (1.0 - fit) < most


def test_a_finer_grid_changes_little(monkeypatch):
    conditions = rolling(0.5, load=50.0, geometry="point")
    grid = grid_of(conditions, cells=144)
    coarse = inlet_heating(conditions, OIL, grid, THERMAL)
    assert coarse.grid.cells == (72, 72)
    monkeypatch.setattr(inlet, "LEAST_CELLS", 144)
    inlet.inlet_heating.cache_clear()
    fine = inlet.inlet_heating(conditions, OIL, grid, THERMAL)
    inlet.inlet_heating.cache_clear()
    assert fine.grid.cells == (144, 144)
    assert coarse.film_factor == pytest.approx(fine.film_factor, abs=0.005)
    moved = coarse.factor_on(grid)
    assert moved.shape == grid.cells
    assert np.mean(np.abs(np.log(moved) - np.log(fine.viscosity_factor))) < 0.01


def test_it_is_computed_where_it_matters_or_as_stated():
    slow, fast = rolling(0.01), rolling(1.0)
    assert not heats_inlet(slow, OIL, THERMAL)
    assert heats_inlet(fast, OIL, THERMAL)
    assert heats_inlet(slow, OIL, replace(THERMAL, inlet_heating=True))
    assert not heats_inlet(fast, OIL, replace(THERMAL, inlet_heating=False))
    assert not heats_inlet(fast, None, replace(THERMAL, inlet_heating=True))
    assert inlet_viscosity_factor(slow, OIL, grid_of(slow), THERMAL) is None
    factor = inlet_viscosity_factor(fast, OIL, grid_of(fast), THERMAL)
    assert 0.3 < factor.min() < 0.9
    assert factor.max() <= 1.0 + 1e-9


def test_heat_without_an_end_is_an_error(monkeypatch):
    monkeypatch.setattr(inlet, "MAX_SOLVES", 1)
    conditions = rolling(1.1)
    with pytest.raises(AsperityError, match=r"thermal\.inlet_heating=false"):
        inlet_heating(conditions, OIL, grid_of(conditions), THERMAL)


def test_smooth_bodies_that_do_not_converge_are_an_error_with_a_remedy(monkeypatch):
    """It carries no solution: that of smooth bodies on a coarse grid would pass for the contact."""
    conditions = rolling(1.2)
    few = inlet.Options(tolerance=inlet.CONVERGED, max_iterations=1)
    monkeypatch.setattr(inlet, "Options", lambda **_: few)
    with pytest.raises(AsperityError, match=r"smooth bodies.*inlet_heating=false") as refused:
        inlet_heating(conditions, OIL, grid_of(conditions), THERMAL)
    assert not isinstance(refused.value, NotConverged)


class TestTransport:
    def test_uniform_flow_cools_exponentially(self):
        """With conduction G and flow W, T falls by exp(-G x/W); upwind to first order."""
        grid = Grid((400, 8), (0.0, 0.0), (1.0, 1.0))
        conduction = np.full(grid.cells, 5.0)
        transport = FilmTransport(grid, np.full((401, 8), 2.0), np.zeros((400, 9)))
        source = np.zeros(grid.cells)
        source[0] = 1.0 / grid.spacing[0]
        found = transport.solver(conduction)(source)
        expected = 0.5 * np.exp(-2.5 * (grid.x - grid.x[0]))
        np.testing.assert_allclose(found[:, 0], expected, atol=0.01)
        np.testing.assert_allclose(transport.apply(found) + 5.0 * found, source, atol=1e-9)
        assert transport.leaving(found) == pytest.approx(2.0 * found[-1, 0])

    @pytest.mark.parametrize("periodic", [False, True])
    def test_heat_is_conserved_in_any_flow(self, periodic):
        grid = Grid((24, 16), (0.0, 0.0), (2.0, 1.0), (False, periodic))
        random = np.random.default_rng(1)
        along, across = random.normal(size=(25, 16)), random.normal(size=(24, 17))
        if periodic:
            across[:, -1] = across[:, 0]
        heat = random.normal(size=grid.cells)
        conduction = random.uniform(0.5, 1.0, grid.cells)
        transport = FilmTransport(grid, along, across)
        found = transport.solver(conduction)(np.abs(heat))
        assert found.min() >= 0.0
        area = math.prod(grid.spacing)
        lost = (conduction * found).sum() * area + transport.leaving(found)
        assert lost == pytest.approx(np.abs(heat).sum() * area, rel=1e-10)


def test_the_card_states_the_effect_on_the_film():
    case = FILM.with_overrides({"contact.entrainment_speed": "2 m/s", "grid.cells": [96, 96]})
    heated, cold = (
        solve_case(case.with_overrides({"thermal.inlet_heating": heats})) for heats in (True, False)
    )
    card = heated.summary()["regime_card"]
    assert 0.5 < card["inlet_heating_factor"] < 1.0
    assert card["inlet_temperature_rise_k"] > 0.5
    films = [run.summary()["h_central_m"] for run in (heated, cold)]
    assert films[0] / films[1] == pytest.approx(card["inlet_heating_factor"], abs=0.01)
    row = dict(heated.card.rows())["inlet shear heating"]
    assert row.startswith("factor of inlet shear heating 0.")
    assert "fitted" in row
    plain = cold.summary()["regime_card"]
    assert plain["inlet_heating_factor"] is None
    assert plain["inlet_heating_fit"] == card["inlet_heating_fit"]
    assert dict(cold.card.rows())["inlet shear heating"].startswith("not computed")


def test_a_running_contact_is_heated_too():
    case = load_case(case_template("line"))
    case = case.with_overrides({"solver.running_cells": 48, "thermal.inlet_heating": True})
    heated = solve_case(case)
    assert heated.running is not None
    assert heated.solution.viscosity_factor is not None
    assert 0.9 < heated.solution.viscosity_factor.min() < 0.995
    with pytest.raises(BadInput):
        case.with_overrides({"thermal.inlet_heating": "sometimes"})
