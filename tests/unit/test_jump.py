"""What bounds a jump and what is worn in it, of contacts made up: nothing is solved."""

import math
from dataclasses import replace

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


def ageing(overrides: dict[str, object] | None = None) -> WearingContact:
    case = worn_case({**FEW, "wear.k": "1e-14 1/Pa", **(overrides or {})})
    assert case.wear is not None
    return WearingContact(case, case.wear, case.moving_surfaces())


def rubbed(
    model: WearingContact, rise: float = 0.0, touching: float = 1.0
) -> list[tuple[TrackPosition, SolvedPosition]]:
    """Hertz's pressure at one position, borne by asperities to a share, on surfaces hotter than
    ambient by `rise`.
    """
    grid, hertz = model.case.grid, model.case.conditions.hertz
    half_widths = [*hertz.half_widths, math.inf][:2]
    off = (grid.x[:, None] / half_widths[0]) ** 2 + (grid.y / half_widths[1]) ** 2
    pressure = hertz.p_max * np.sqrt(np.maximum(1.0 - off, 0.0))
    solved = SolvedPosition(
        pressure=pressure,
        asperity_pressure=touching * pressure,
        shear=model.case.boundary_friction * pressure,
        film=np.full(grid.cells, 1e-7),
        overlap=None,
        temperatures=(np.full(grid.cells, rise), np.full(grid.cells, rise)),
        state=STATE,
        friction_coefficient=0.1,
        flash_temperature=rise,
        at_edge=False,
    )
    return [(TrackPosition(0, 0), solved)]


def test_a_jump_is_as_long_as_the_coefficient_that_acts_allows():
    """Bare metal all over wears as by Archard; with a share ψ of defects all takes 1/ψ as long."""
    defects = {"wear.law": {"law": "film-defect", "heat": "49 kJ/mol"}}
    archard, film = ageing(), ageing(defects)
    new = WearState.unworn(film.surfaces)
    bare = archard.seconds(new, rubbed(archard))
    assert film.seconds(new, rubbed(film, rise=1e9)) == pytest.approx(bare, rel=1e-9, abs=0.0)
    conditions = film.case.conditions
    crossing = 3e-10 / (3e-12 * conditions.sliding_speed)
    hot = 4.9e4 / (GAS_CONSTANT * math.log(crossing / 1e-5))  # where 1e-5 of the sites are bare
    rise = hot - film.case.thermal.ambient
    assert film.seconds(new, rubbed(film, rise)) == pytest.approx(1e5 * bare, rel=1e-4, abs=0.0)
    cold = film.exposures()[0].k / 1e-14
    assert cold == pytest.approx(
        crossing * math.exp(-4.9e4 / GAS_CONSTANT / film.case.thermal.ambient), rel=1e-4
    )


def test_what_a_jump_takes_off_is_spread_by_the_coefficient_that_acts():
    """A cold film wears a hundred thousandth, and z with it: next to nothing is spread, where bare
    metal would be.
    """
    film = ageing({"wear.law": {"law": "film-defect", "heat": "49 kJ/mol"}})
    new, at = WearState.unworn(film.surfaces), rubbed(film, 0.0)
    seconds = 1e-3 * film.seconds(new, at)
    lost = film.after_jump(new, at, seconds).worn[0]
    np.testing.assert_allclose(
        lost, film.rate(new, at, 0) * seconds, rtol=0.0, atol=1e-3 * lost.max()
    )


BALL = {**DRY, "contact.load": "10 N", "wear.k": "1e-14 1/Pa", "wear.patches": 1}


def ball(overrides: dict[str, object], wide: float = 1.8, cells: int = 24) -> WearingContact:
    grid = {"grid.x": [-1.8, 1.8], "grid.y": [-wide, wide], "grid.cells": [24, cells]}
    case = worn_case(BALL | grid | overrides, POINT)
    assert case.wear is not None
    return WearingContact(case, case.wear, case.moving_surfaces())


def test_a_balls_track_is_as_wide_as_its_contact_whatever_the_grid():
    """Worn depth is the volume over the Hertz zone's width and the way round; beside it nothing
    counts for Sq.
    """
    rows = []
    for wide, cells in ((1.8, 24), (3.6, 48)):
        model = ball({"surface": "flat"}, wide, cells)
        new, at = WearState.unworn(model.surfaces), rubbed(model)
        worn = model.after_jump(new, at, model.seconds(new, at))
        rows.append(_row(model, worn, rubbed(model), 0))
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


def test_a_track_that_has_grown_beyond_the_hertz_zone_counts_whole():
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


def test_a_standing_bodys_scar_is_no_roughness():
    """A smooth ball at rest, worn to a flat: its Sq is 0; its mean depth is the cap's over the
    square about it.
    """
    model = ball({"surface": "flat", "contact.slip": 2.0})
    (still,) = (body for body in (0, 1) if model.bodies[body].speed == 0.0)
    new, grid = WearState.unworn(model.surfaces), model.surfaces.grid
    a = model.case.conditions.hertz.half_widths[0]
    cap = 2e-6 * np.maximum(1.0 - (grid.x[:, None] / a) ** 2 - (grid.y / a) ** 2, 0.0)
    maps = [0.0 * cap, 0.0 * cap]
    maps[still] = cap
    worn = replace(new, worn=(maps[0], maps[1]))
    row = _row(model, worn, rubbed(model), 0)
    assert row[body_column("sq_m", still)] == 0.0
    assert row["sq_m"] == 0.0
    assert row[body_column("worn_depth_m", still)] == pytest.approx(
        2e-6 * math.pi / 8.0, rel=0.1, abs=0.0
    )


@pytest.mark.parametrize("geometry", ["ball", "roller"])
def test_a_rough_standing_body_keeps_its_sq_below_a_scar_many_times_deeper(geometry):
    standing = {"contact.slip": 2.0, "motion.rough": "second"}
    model = ball(standing | {"grid.cells": [96, 96]}) if geometry == "ball" else ageing(standing)
    (still,) = (body for body in (0, 1) if model.bodies[body].speed == 0.0)
    assert model.surfaces.rough[still]
    new, grid, half_widths = (
        WearState.unworn(model.surfaces),
        model.surfaces.grid,
        model.case.conditions.hertz.half_widths,
    )
    across = (grid.y / half_widths[1]) ** 2 if geometry == "ball" else 0.0 * grid.y
    cap = 5e-6 * np.maximum(1.0 - (grid.x[:, None] / half_widths[0]) ** 2 - across, 0.0)
    maps = [0.0 * cap, 0.0 * cap]
    maps[still] = cap
    before = model.levelled(new)[still].sq
    assert model.levelled(replace(new, worn=(maps[0], maps[1])))[still].sq == pytest.approx(
        before, rel=0.05, abs=0.0
    )


@pytest.mark.parametrize("touching", [1.0, 0.6])
def test_the_energy_law_counts_the_friction_work_where_bodies_touch(touching):
    """V = α f_b F_a s."""
    model = ageing({"wear.law": "energy", "wear.k": "1e-13 1/Pa"})
    at, conditions = rubbed(model, touching=touching), model.case.conditions
    (dx, dy), (_, solved) = model.surfaces.grid.spacing, at[0]
    load = solved.pressure.sum() * dx * dy * model.width / model.surfaces.grid.extent[1]
    assert load == pytest.approx(500.0, rel=0.02)
    expected = 1e-13 * 0.15 * touching * load * conditions.sliding_speed
    new = WearState.unworn(model.surfaces)
    assert model.booked_rate(at, 0) == pytest.approx(expected, rel=1e-9, abs=0.0)
    assert model.volume(model.rate(new, at, 0), 0) == pytest.approx(expected, rel=1e-9, abs=0.0)


def test_a_smooth_bodys_grooves_are_said_to_be_the_tracks():
    model = ageing({"motion.rough": "second"})
    said = grooves_note(model)
    tracks = model.perimeter(1) / model.surfaces.second.grid.extent[0]
    assert tracks > 100.0
    assert said is not None
    assert f"one of {tracks:.0f} around its partner" in said
    for other in (
        ageing({"motion.rough": "both"}),
        ageing({"surface": "flat"}),
        ageing({"motion.rough": "second", "wear.k": ["0 1/Pa", "1e-16 1/Pa"]}),
        ageing({"motion.rough": "second", "contact.slip": -2.0}),
        ball({"motion.rough": "second"}),
    ):
        assert grooves_note(other) is None


def test_rates_that_make_other_bodies_than_the_contacts_are_said():
    """A roller of 12 mm on a ring of 108 mm turning as the example's do, and the pair the wrong way
    round.
    """
    radii, speeds = (6e-3, 54e-3), ageing().case.conditions.surface_speeds
    assert 1.0 / (1.0 / radii[0] + 1.0 / radii[1]) == pytest.approx(5.4e-3)
    rates = [speed / (2.0 * math.pi * radius) for speed, radius in zip(speeds, radii, strict=True)]
    right, wrong = ([f"{rate!r} Hz" for rate in order] for order in (rates, rates[::-1]))
    assert radii_note(ageing({"wear.overrolling": right})) is None
    said = radii_note(ageing({"wear.overrolling": wrong}))
    assert said is not None
    assert "which do not give the contact's 5.4 mm" in said
    assert radii_note(ageing({"wear.overrolling": "none"})) is None
    assert radii_note(ageing({"contact.slip": 2.0})) is None


def test_a_body_shorter_than_the_contact_is_refused():
    with pytest.raises(
        BadInput,
        match=r"overrolling of 1e\+07 Hz at .* implies a circumference of .* less than the contact",
    ):
        ageing({"wear.overrolling": "1e7 Hz"})


def test_a_standing_body_is_said_to_be_spared():
    pits = {"wear.fatigue": {"law": "von-mises", "limit": "700 MPa"}}
    said = standing_note(ageing(pits | {"contact.slip": 2.0}))
    assert said is not None
    assert said.endswith("not over-rolled: no fatigue acts on it.")
    assert standing_note(ageing(pits)) is None
    assert standing_note(ageing({"contact.slip": 2.0})) is None


def test_few_jumps_are_said():
    model = ageing()
    new = WearState.unworn(model.surfaces)
    assert few_jumps_note(model, 5, new) is None
    said = few_jumps_note(model, 4, new)
    assert said is not None
    assert said.startswith("In 4 jumps of 4 positions")
    assert few_jumps_note(ageing({"surface": "flat"}), 4, new) is None


def test_what_is_smooth_to_rounding_has_no_shape():
    model = ageing({"surface": "flat"})
    grid = model.surfaces.first.grid
    noise = np.random.default_rng(1).standard_normal(grid.cells)
    row = roughness((Surface(1e-20 * noise, grid), Surface(1e-8 * noise, grid)))
    assert math.isnan(row["ssk_1"])
    assert math.isnan(row["sku_1"])
    assert row["sku_2"] == pytest.approx(3.0, rel=0.3)


def test_a_jump_that_differs_too_much_from_the_one_before_going_on_is_shortened():
    """Of rates that jump from one place to another, Sq of two jumps and of one of both together
    differ.
    """
    model = ageing({"wear.step": 0.5})
    new = WearState.unworn(model.surfaces)
    at = rubbed(model)
    assert model.seconds(new, at) == pytest.approx(
        0.5 * 10.0 * ageing().seconds(new, at) / 0.5, rel=1e-9, abs=0.0
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


def test_a_law_of_friction_without_friction_is_refused():
    with pytest.raises(BadInput, match="boundary friction of 0"):
        ageing({"wear.law": "energy", "material.boundary_friction": 0.0})


def fallen(
    slope: float, curve: float = 0.0, scatter: float = 0.0, seed: int = 0, scaled: float = 0.5
) -> WearHistory:
    """A history, made up, of a CLR that falls by so much an hour, over ten hours."""
    model = ageing({"wear.scatter": scaled})
    hours = np.linspace(0.0, 10.0, 41)
    clr = (
        0.7
        + slope * hours
        + curve * hours**2
        + scatter * np.random.default_rng(seed).standard_normal(hours.size)
    )
    table = pandas.DataFrame({"hours": hours, "clr": clr})
    return WearHistory(contact=model, table=table, worn=WearState.unworn(model.surfaces))


def test_the_drift_of_a_line_is_its_slope_with_the_interval_of_k():
    history = fallen(-0.01)
    slow, fast = history.k_interval
    assert history.drift("clr") == pytest.approx((-0.01, -0.01 * fast, -0.01 * slow), rel=1e-9)
    assert fallen(-0.01, scaled=0.0).drift("clr", 2.0, 4.0) == pytest.approx(
        (-0.01, -0.01, -0.01), rel=1e-9
    )
    with pytest.raises(
        BadInput, match=r"a drift of clr needs 4 rows with a value, got fewer from 3 to 3\.4 h"
    ):
        history.drift("clr", 3.0, 3.4)
    with pytest.raises(BadInput, match="has no column clear; it has hours, clr"):
        history.drift("clear")


def test_the_drift_with_another_k_is_that_of_another_time():
    """Of a parabola, read from 2 to 4 h, k so much larger is the slope so much later, and so much
    faster.
    """
    history = fallen(-0.01, 0.0005)
    slow, fast = history.k_interval
    at = {factor: factor * (-0.01 + 0.001 * 3.0 * factor) for factor in (slow, 1.0, fast)}
    drift = history.drift("clr", 2.0, 4.0)
    assert drift.per_hour == pytest.approx(at[1.0], rel=1e-6)
    assert drift.low == pytest.approx(min(at.values()), rel=0.1)
    assert drift.high == pytest.approx(max(at.values()), rel=0.1)


def test_the_interval_of_a_drift_holds_nine_times_in_ten():
    held = 0
    for seed in range(300):
        drift = fallen(-0.01, scatter=0.02, seed=seed, scaled=0.0).drift("clr")
        held += drift.low <= -0.01 <= drift.high
    assert 0.86 < held / 300 < 0.94


def test_the_mean_over_positions_has_students_interval():
    """Four shares: mean .5, deviation .1291, t(3, 95 %) = 2.353 from a printed table: .5 ±
    .1519.
    """
    model = ageing()
    solved = rubbed(model)[0][1]
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
