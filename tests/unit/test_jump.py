"""Length of a wear jump and the wear within it, for synthetic contacts without a solver."""

import math
from dataclasses import fields, replace

import numpy as np
import pandas
import pytest

from asperity import BadInput
from asperity.ehl import ContactState
from asperity.simulation.wear.contact import SolvedPosition
from asperity.simulation.wear.history import WearHistory
from asperity.simulation.wear.jump import WearingContact
from asperity.simulation.wear.notes import few_jumps_note, grooves_note, radii_note, standing_note
from asperity.simulation.wear.rows import body_column, contact_row, roughness
from asperity.simulation.wear.run import _row
from asperity.simulation.wear.state import WearState
from asperity.solution import Friction, Observables, Sensing
from asperity.surface import Surface
from asperity.wear import TrackPosition
from asperity.wear.laws import GAS_CONSTANT
from support.wearing import DRY, FEW, POINT, worn_case

STATE = ContactState(
    clr=0.5,
    car=0.1,
    car_domain=0.1,
    capped_oil_load_ratio=0.0,
    h_min=0.0,
    h_central=0.0,
    h_mean=0.0,
    p_max=1e9,
    contact_slope=None,
    sq=1e-6,
    lambda_ratio=None,
    reynolds_residual=0.0,
    load_error=0.0,
    mass_flux_imbalance=0.0,
)


OBSERVABLES = Observables(
    capacitance=1e-10,
    zone_capacitance=5e-11,
    contact_resistance=None,
    interface_stiffness=1e16,
    impedances=(4.6e7, 4.6e7),
    sensing=Sensing(),
)


def wearing_contact(overrides: dict[str, object] | None = None) -> WearingContact:
    case = worn_case({**FEW, "wear.k": "1e-14 1/Pa", **(overrides or {})})
    assert case.wear is not None
    return WearingContact(case, case.wear, case.moving_surfaces())


def loaded_position(
    model: WearingContact, temperature_rise: float = 0.0, asperity_share: float = 1.0
) -> list[tuple[TrackPosition, SolvedPosition]]:
    """Return one position under Hertz pressure, a share of it carried by asperities."""
    grid, hertz = model.case.grid, model.case.conditions.hertz
    half_widths = [*hertz.half_widths, math.inf][:2]
    off = (grid.x[:, None] / half_widths[0]) ** 2 + (grid.y / half_widths[1]) ** 2
    pressure = hertz.p_max * np.sqrt(np.maximum(1.0 - off, 0.0))
    solved = SolvedPosition(
        pressure=pressure,
        asperity_pressure=asperity_share * pressure,
        shear=model.case.boundary_friction * pressure,
        film=np.full(grid.cells, 1e-7),
        overlap=None,
        temperatures=(np.full(grid.cells, temperature_rise), np.full(grid.cells, temperature_rise)),
        state=STATE,
        friction=Friction(**{field.name: 0.1 for field in fields(Friction)}),
        flash_temperature=temperature_rise,
        observables=OBSERVABLES,
        at_edge=False,
    )
    return [(TrackPosition(0, 0), solved)]


def test_observables_are_means_over_the_positions():
    model = wearing_contact()
    ((_, solved),) = loaded_position(model)
    touching = replace(OBSERVABLES, capacitance=3e-10, contact_resistance=2e-3)
    other = replace(solved, observables=touching)
    row = contact_row(model.case, [solved, other], 1e-6)
    assert row["capacitance_f"] == pytest.approx(2e-10, abs=0.0)
    assert row["contact_resistance_ohm"] == pytest.approx(2e-3)
    assert math.isnan(contact_row(model.case, [solved], 1e-6)["contact_resistance_ohm"])
    assert 0.0 < row["ultrasonic_reflection"] < 1.0


def test_the_effective_coefficient_limits_the_jump():
    """Fully bare metal follows Archard's law; a share ψ of defects takes 1/ψ times as long."""
    defects = {"wear.law": {"law": "film-defect", "heat": "49 kJ/mol"}}
    archard, film = wearing_contact(), wearing_contact(defects)
    new = WearState.unworn(film.surfaces)
    bare = archard.seconds(new, loaded_position(archard))
    assert film.seconds(new, loaded_position(film, temperature_rise=1e9)) == pytest.approx(
        bare, rel=1e-9, abs=0.0
    )
    conditions = film.case.conditions
    crossing = 3e-10 / (3e-12 * conditions.sliding_speed)
    hot_temperature = 4.9e4 / (
        GAS_CONSTANT * math.log(crossing / 1e-5)
    )  # temperature at which 1e-5 of the sites are bare
    temperature_rise = hot_temperature - film.case.thermal.ambient
    assert film.seconds(new, loaded_position(film, temperature_rise)) == pytest.approx(
        1e5 * bare, rel=1e-4, abs=0.0
    )
    cold = film.exposures()[0].k / 1e-14
    assert cold == pytest.approx(
        crossing * math.exp(-4.9e4 / GAS_CONSTANT / film.case.thermal.ambient), rel=1e-4
    )


def test_wear_is_distributed_by_the_effective_coefficient():
    """A cold film wears a hundred-thousandth of bare metal, so hardly any material is spread."""
    film = wearing_contact({"wear.law": {"law": "film-defect", "heat": "49 kJ/mol"}})
    new, at = WearState.unworn(film.surfaces), loaded_position(film, 0.0)
    seconds = 1e-3 * film.seconds(new, at)
    worn_depth = film.after_jump(new, at, seconds).worn[0]
    np.testing.assert_allclose(
        worn_depth, film.rate(new, at, 0) * seconds, rtol=0.0, atol=1e-3 * worn_depth.max()
    )


BALL = {**DRY, "contact.load": "10 N", "wear.k": "1e-14 1/Pa", "wear.patches": 1}


def ball(overrides: dict[str, object], half_width: float = 1.8, cells: int = 24) -> WearingContact:
    grid = {"grid.x": [-1.8, 1.8], "grid.y": [-half_width, half_width], "grid.cells": [24, cells]}
    case = worn_case(BALL | grid | overrides, POINT)
    assert case.wear is not None
    return WearingContact(case, case.wear, case.moving_surfaces())


def test_a_balls_track_has_the_width_of_its_contact_on_any_grid():
    """Worn depth is the volume per Hertz width and circumference; Sq ignores the rest."""
    rows = []
    for half_width, cells in ((1.8, 24), (3.6, 48)):
        model = ball({"surface": "flat"}, half_width, cells)
        new, at = WearState.unworn(model.surfaces), loaded_position(model)
        worn = model.after_jump(new, at, model.seconds(new, at))
        rows.append(_row(model, worn, loaded_position(model), 0))
        for body in (0, 1):
            width = 2.0 * model.case.conditions.hertz.half_widths[1]
            over_all = model.volume(worn.worn[body], body) / model.perimeter(body) / width
            assert rows[-1][body_column("worn_depth_m", body)] == pytest.approx(
                over_all, rel=0.15, abs=0.0
            )
            assert model.levelled(worn)[body].grid.extent[1] == pytest.approx(
                width, rel=0.15, abs=0.0
            )
    assert rows[0]["worn_depth_1_m"] == pytest.approx(rows[1]["worn_depth_1_m"], rel=2e-3, abs=0.0)
    assert rows[0]["worn_depth_max_2_m"] == pytest.approx(
        rows[1]["worn_depth_max_2_m"], rel=2e-3, abs=0.0
    )


def test_a_track_wider_than_the_hertz_zone_counts_entirely():
    model = ball({"surface": "flat"}, 3.6, 48)
    new = WearState.unworn(model.surfaces)
    y, a = model.surfaces.grid.y, model.case.conditions.hertz.half_widths[1]
    groove = np.broadcast_to(
        1e-6 * np.maximum(1.0 - (y / (2.0 * a)) ** 2, 0.0), model.surfaces.first.grid.cells
    )
    for worn in (
        replace(new, worn=(groove, new.worn[1])),
        replace(new, worn=(new.worn[0], groove)),
    ):
        for body in (0, 1):
            along, across = model.track(worn, body)
            assert along == slice(None)
            np.testing.assert_array_equal(
                np.abs(y) < 2.0 * a, np.isin(np.arange(48), np.arange(48)[across])
            )


def test_the_scar_of_a_standing_body_does_not_count_as_roughness():
    """A smooth ball at rest, worn flat: Sq is 0; the mean depth is that of the cap over its
    bounding square.
    """
    model = ball({"surface": "flat", "contact.slip": 2.0})
    (standing,) = (body for body in (0, 1) if model.bodies[body].speed == 0.0)
    new, grid = WearState.unworn(model.surfaces), model.surfaces.grid
    a = model.case.conditions.hertz.half_widths[0]
    cap = 2e-6 * np.maximum(1.0 - (grid.x[:, None] / a) ** 2 - (grid.y / a) ** 2, 0.0)
    maps = [0.0 * cap, 0.0 * cap]
    maps[standing] = cap
    worn = replace(new, worn=(maps[0], maps[1]))
    row = _row(model, worn, loaded_position(model), 0)
    assert row[body_column("sq_m", standing)] == 0.0
    assert row["sq_m"] == 0.0
    assert row[body_column("worn_depth_m", standing)] == pytest.approx(
        2e-6 * math.pi / 8.0, rel=0.1, abs=0.0
    )


@pytest.mark.parametrize("geometry", ["ball", "roller"])
def test_sq_of_a_rough_standing_body_excludes_a_much_deeper_scar(geometry):
    overrides = {"contact.slip": 2.0, "motion.rough": "second"}
    model = (
        ball(overrides | {"grid.cells": [96, 96]})
        if geometry == "ball"
        else wearing_contact(overrides)
    )
    (standing,) = (body for body in (0, 1) if model.bodies[body].speed == 0.0)
    assert model.surfaces.rough[standing]
    new, grid, half_widths = (
        WearState.unworn(model.surfaces),
        model.surfaces.grid,
        model.case.conditions.hertz.half_widths,
    )
    across = (grid.y / half_widths[1]) ** 2 if geometry == "ball" else 0.0 * grid.y
    cap = 5e-6 * np.maximum(1.0 - (grid.x[:, None] / half_widths[0]) ** 2 - across, 0.0)
    maps = [0.0 * cap, 0.0 * cap]
    maps[standing] = cap
    before = model.levelled(new)[standing].sq
    assert model.levelled(replace(new, worn=(maps[0], maps[1])))[standing].sq == pytest.approx(
        before, rel=0.05, abs=0.0
    )


@pytest.mark.parametrize("asperity_share", [1.0, 0.6])
def test_the_energy_law_uses_the_friction_work_of_asperities(asperity_share):
    """V = α f_b F_a s."""
    model = wearing_contact({"wear.law": "energy", "wear.k": "1e-13 1/Pa"})
    at, conditions = loaded_position(model, asperity_share=asperity_share), model.case.conditions
    (dx, dy), (_, solved) = model.surfaces.grid.spacing, at[0]
    load = solved.pressure.sum() * dx * dy * model.width / model.surfaces.grid.extent[1]
    assert load == pytest.approx(500.0, rel=0.02)
    expected = 1e-13 * 0.15 * asperity_share * load * conditions.sliding_speed
    new = WearState.unworn(model.surfaces)
    assert model.booked_rate(at, 0) == pytest.approx(expected, rel=1e-9, abs=0.0)
    assert model.volume(model.rate(new, at, 0), 0) == pytest.approx(expected, rel=1e-9, abs=0.0)


def test_grooves_of_a_smooth_body_are_noted_as_those_of_the_track():
    model = wearing_contact({"motion.rough": "second"})
    note = grooves_note(model)
    tracks = model.perimeter(1) / model.surfaces.second.grid.extent[0]
    assert tracks > 100.0
    assert note is not None
    assert f"one of {tracks:.0f} around its partner" in note
    for other in (
        wearing_contact({"motion.rough": "both"}),
        wearing_contact({"surface": "flat"}),
        wearing_contact({"motion.rough": "second", "wear.k": ["0 1/Pa", "1e-16 1/Pa"]}),
        wearing_contact({"motion.rough": "second", "contact.slip": -2.0}),
        ball({"motion.rough": "second"}),
    ):
        assert grooves_note(other) is None


def test_overrolling_rates_inconsistent_with_the_radius_are_noted():
    """A roller of 12 mm on a ring of 108 mm at the speeds of the example, and the swapped pair."""
    radii, speeds = (6e-3, 54e-3), wearing_contact().case.conditions.surface_speeds
    assert 1.0 / (1.0 / radii[0] + 1.0 / radii[1]) == pytest.approx(5.4e-3)
    rates = [speed / (2.0 * math.pi * radius) for speed, radius in zip(speeds, radii, strict=True)]
    right, wrong = ([f"{rate!r} Hz" for rate in order] for order in (rates, rates[::-1]))
    assert radii_note(wearing_contact({"wear.overrolling": right})) is None
    note = radii_note(wearing_contact({"wear.overrolling": wrong}))
    assert note is not None
    assert "which do not give the contact's 5.4 mm" in note
    assert radii_note(wearing_contact({"wear.overrolling": "none"})) is None
    assert radii_note(wearing_contact({"contact.slip": 2.0})) is None


def test_a_body_shorter_than_the_contact_is_refused():
    with pytest.raises(
        BadInput,
        match=r"overrolling of 1e\+07 Hz at .* implies a circumference of .* less than the contact",
    ):
        wearing_contact({"wear.overrolling": "1e7 Hz"})


def test_a_standing_body_is_noted_as_free_of_fatigue():
    pits = {"wear.fatigue": {"law": "von-mises", "limit": "700 MPa"}}
    note = standing_note(wearing_contact(pits | {"contact.slip": 2.0}))
    assert note is not None
    assert note.endswith("not over-rolled: no fatigue acts on it.")
    assert standing_note(wearing_contact(pits)) is None
    assert standing_note(wearing_contact({"contact.slip": 2.0})) is None


def test_few_jumps_are_noted():
    model = wearing_contact()
    new = WearState.unworn(model.surfaces)
    assert few_jumps_note(model, 5, new) is None
    note = few_jumps_note(model, 4, new)
    assert note is not None
    assert note.startswith("In 4 jumps of 4 positions")
    assert few_jumps_note(wearing_contact({"surface": "flat"}), 4, new) is None


def test_a_surface_smooth_to_rounding_has_no_skewness():
    model = wearing_contact({"surface": "flat"})
    grid = model.surfaces.first.grid
    noise = np.random.default_rng(1).standard_normal(grid.cells)
    row = roughness((Surface(1e-20 * noise, grid), Surface(1e-8 * noise, grid)))
    assert math.isnan(row["ssk_1"])
    assert math.isnan(row["sku_1"])
    assert row["sku_2"] == pytest.approx(3.0, rel=0.3)


def test_a_jump_is_shortened_when_the_rates_change_too_much():
    """Wear moves to another place: Sq after two jumps differs from Sq after one combined jump."""
    model = wearing_contact({"wear.step": 0.5})
    new = WearState.unworn(model.surfaces)
    at = loaded_position(model)
    assert model.seconds(new, at) == pytest.approx(
        0.5 * 10.0 * wearing_contact().seconds(new, at) / 0.5, rel=1e-9, abs=0.0
    )
    other = [(TrackPosition(20, 20), at[0][1])]
    free = model.seconds(replace(new, number=1), other) / 0.5
    after = model.after_jump(new, at, model.seconds(new, at))
    longest = model.seconds(after, other)
    assert longest < 0.99 * free
    assert (
        model.after_jump(after, other, longest).error
        <= 1e-3
        < model.after_jump(after, other, free).error
    )


def test_the_energy_law_without_friction_is_refused():
    with pytest.raises(BadInput, match="boundary friction of 0"):
        wearing_contact({"wear.law": "energy", "material.boundary_friction": 0.0})


def drifting_history(
    slope: float,
    curvature: float = 0.0,
    scatter: float = 0.0,
    seed: int = 0,
    k_scatter: float = 0.5,
) -> WearHistory:
    """Return a synthetic history of ten hours with a linear drift of CLR."""
    model = wearing_contact({"wear.scatter": k_scatter})
    hours = np.linspace(0.0, 10.0, 41)
    clr = (
        0.7
        + slope * hours
        + curvature * hours**2
        + scatter * np.random.default_rng(seed).standard_normal(hours.size)
    )
    table = pandas.DataFrame({"hours": hours, "clr": clr})
    return WearHistory(contact=model, table=table, worn=WearState.unworn(model.surfaces))


def test_the_drift_of_a_line_is_its_slope_with_the_interval_of_k():
    history = drifting_history(-0.01)
    slow, fast = history.k_interval
    assert history.drift("clr") == pytest.approx((-0.01, -0.01 * fast, -0.01 * slow), rel=1e-9)
    assert drifting_history(-0.01, k_scatter=0.0).drift("clr", 2.0, 4.0) == pytest.approx(
        (-0.01, -0.01, -0.01), rel=1e-9
    )
    with pytest.raises(
        BadInput, match=r"a drift of clr needs 4 rows with a value, got fewer from 3 to 3\.4 h"
    ):
        history.drift("clr", 3.0, 3.4)
    with pytest.raises(BadInput, match="has no column clear; it has hours, clr"):
        history.drift("clear")


def test_a_factor_on_k_rescales_the_time_of_the_drift():
    """For a parabola between 2 and 4 h, a factor on k scales both the time and the rate."""
    history = drifting_history(-0.01, 0.0005)
    slow, fast = history.k_interval
    at = {factor: factor * (-0.01 + 0.001 * 3.0 * factor) for factor in (slow, 1.0, fast)}
    drift = history.drift("clr", 2.0, 4.0)
    assert drift.per_hour == pytest.approx(at[1.0], rel=1e-6)
    assert drift.low == pytest.approx(min(at.values()), rel=0.1)
    assert drift.high == pytest.approx(max(at.values()), rel=0.1)


def test_the_interval_of_a_drift_covers_90_per_cent():
    covered = 0
    for seed in range(300):
        drift = drifting_history(-0.01, scatter=0.02, seed=seed, k_scatter=0.0).drift("clr")
        covered += drift.low <= -0.01 <= drift.high
    assert 0.86 < covered / 300 < 0.94


def test_the_mean_over_positions_has_students_t_interval():
    """Four values: mean 0.5, deviation 0.1291, t(3, 95 %) = 2.353 from a table: 0.5 ± 0.1519."""
    model = wearing_contact()
    solved = loaded_position(model)[0][1]
    shares = (0.35, 0.45, 0.55, 0.65)
    row = contact_row(
        model.case, [replace(solved, state=replace(STATE, clr=share)) for share in shares], 1e-6
    )
    assert row["clr"] == pytest.approx(0.5)
    assert (row["clr_mean_low"], row["clr_mean_high"]) == pytest.approx(
        (0.5 - 0.1519, 0.5 + 0.1519), abs=1e-4
    )
    assert row["crf_mean_low_hz"] < row["crf_hz"] < row["crf_mean_high_hz"]
    alone = contact_row(model.case, [solved], 1e-6)
    assert math.isnan(alone["clr_mean_low"])
