"""Ratings of a machine: each standard gets the machine's values and reports missing inputs."""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from asperity.case import load_machine
from asperity.core.quantities import catalogue
from asperity.lubricant import ESTIMATORS, OilSheet
from asperity.machines import fatigue_ratings, gear_ratings, machine_conditions
from asperity.machines import ratings as rated
from asperity.machines.rating_facts import FACTS
from asperity.rating import GearOil, Mesh, MeshPoint, life_factor, specific_film
from asperity.results import solve_case

EXAMPLES = Path(__file__).parents[2] / "examples"
LIMITS = {"rating.fatigue_limits": ["350 MPa", "600 MPa"]}


def by_key(case):
    return {rating.key: rating for rating in rated.machine_ratings(case)}


def test_every_rating_is_a_quantity_and_states_its_source():
    assert set(FACTS) == {key for key, entry in catalogue().items() if entry.group == "rating"}
    for facts in FACTS.values():
        assert all(facts)


def test_a_roller_bearings_viscosity_ratio_and_life():
    case = load_machine(EXAMPLES / "nu206.toml")
    incomplete = by_key(case)
    assert incomplete["viscosity_ratio"].machine_value == pytest.approx(
        1.648, rel=1e-3
    )  # VG 68 of index 95 at 70 degC, 3000 r/min
    assert incomplete["reference_viscosity_m2_s"].machine_value * 1e6 == pytest.approx(
        12.048, rel=1e-4
    )
    assert incomplete["life_factor"].machine_value is None
    assert incomplete["life_factor"].reason == "[rating] has no dynamic_load_rating"
    complete = {
        "dynamic_load_rating": "44 kN",
        "fatigue_load_limit": "4.5 kN",
        "contamination": 0.5,
    }
    found = by_key(case.with_overrides({"rating": complete}))
    assert found["equivalent_load_n"].machine_value == pytest.approx(
        4000.0, rel=0.12
    )  # half a load zone would give 4000 N
    factor = found["life_factor"].machine_value
    turns = found["reference_life"].machine_value * factor
    assert found["modified_life_s"].machine_value == pytest.approx(turns / 50.0, rel=1e-9)
    assert by_key(case.with_overrides({"rating": complete | {"contamination": 0.0}}))[
        "life_factor"
    ].machine_value == pytest.approx(0.1)
    missing = by_key(case.with_overrides({"rating": {"dynamic_load_rating": "44 kN"}}))[
        "life_factor"
    ]
    assert missing.reason == "[rating] has no fatigue_load_limit and no contamination"
    slow = by_key(case.with_overrides({"rating": complete, "machine.speed": "10 r/min"}))
    assert "below 0.1" in slow["life_factor"].reason
    assert slow["modified_life_s"].machine_value is None


def test_the_life_of_a_ball_bearing_agrees_with_a_commercial_program():
    """Z = 7, D = 11.5 mm, d_m = 43.5 mm, C = 23.4 kN under 1 kN: 13 163 million turns."""
    case = load_machine(EXAMPLES / "6206.toml").with_overrides(
        {
            "machine": {
                "kind": "ball-bearing",
                "balls": 7,
                "ball_diameter": "11.5 mm",
                "pitch_diameter": "43.5 mm",
                "radial_load": "1 kN",
                "speed": "1000 r/min",
            },
            "material": {"youngs_modulus": "210 GPa", "poisson_ratio": 0.3},
            "rating": {"dynamic_load_rating": "23.4 kN"},
        }
    )
    assert by_key(case)["reference_life"].machine_value == pytest.approx(13163.0e6, rel=2e-4)


def test_gears_are_rated_with_their_own_values():
    """Compared with direct calls of the formulas, with Ra and bulk temperature given or derived."""
    case = load_machine(EXAMPLES / "fzg-c.toml")
    given = case.with_overrides(
        {"rating": {"roughness_ra": "0.5 um", "bulk_temperature": "100 degC"}}
    )
    found = by_key(given)
    assert found["rated_bulk_k"].machine_value == 373.15
    sheet = OilSheet(grade="VG 220")
    oil = GearOil(
        lambda kelvin: sheet.walther(kelvin) * sheet.density(kelvin),
        lambda kelvin: ESTIMATORS["iso"].law(sheet, kelvin),
        "mineral",
    )
    friction = 0.045 * (265.1 / 33.8289e-3 / 14.0 / (6.3492 * 8.3820)) ** 0.2
    friction *= (1e3 * sheet.viscosity(363.15)) ** -0.05 * 2.2 * (0.5 / 8.3820) ** 0.25
    assert found["mesh_friction"].machine_value == pytest.approx(friction, rel=1e-4)
    effusivity = math.sqrt(46.0 * 7800.0 * 460.0)
    mesh = Mesh(0.5e-6, case.pair.effective_modulus, (effusivity, effusivity))
    contact = next(entry for entry in case.contacts if entry.name == "D")
    hertz = contact.hertz(case.pair)
    point = MeshPoint(
        contact.radius, hertz.p_max, contact.line_load, hertz.half_widths[0], contact.surface_speeds
    )
    film, rise = specific_film(point, mesh, oil, found["mesh_friction"].machine_value, 373.15)
    assert found["rated_film"].values["D"] == pytest.approx(film, rel=1e-9)
    assert found["rated_flash_k"].values["D"] == pytest.approx(rise, rel=1e-9)
    assert found["rated_flash_k"].values["C"] == pytest.approx(0.0, abs=1e-9)
    assert found["rated_film"].machine_value is None
    smoother = by_key(case.with_overrides({"surface.sq": "0.25 um"}))["rated_film"].values["A"]
    assert smoother > 2.0 * by_key(case)["rated_film"].values["A"]  # due to Ra and to a cooler mesh


def test_ra_of_both_flanks():
    case = load_machine(EXAMPLES / "fzg-c.toml")
    composite = case.case(case.contacts[0])
    assert gear_ratings._mean_ra(composite) == pytest.approx(0.5e-6 / math.sqrt(math.pi), rel=1e-6)
    kind = {"kind": "gaussian", "correlation_length": "30 um"}
    two_surfaces = composite.with_overrides(
        {"surface": kind | {"sq": "0.6 um", "second": kind | {"sq": "0.2 um"}}}
    )
    assert gear_ratings._mean_ra(two_surfaces) == pytest.approx(
        math.sqrt(2.0 / math.pi) * 0.4e-6, rel=1e-6
    )


def test_limits_of_gears_are_given_or_missing():
    case = load_machine(EXAMPLES / "fzg-c.toml")
    without = by_key(case)
    assert without["scuffing_margin_k"].reason.startswith("[rating] has no scuffing_stage")
    assert without["micropitting_safety"].reason.startswith("[rating] has no permissible_film")
    found = by_key(case.with_overrides({"rating": {"scuffing_stage": 12, "permissible_film": 0.5}}))
    films = found["rated_film"].values
    assert found["micropitting_safety"].machine_value == pytest.approx(min(films.values()) / 0.5)
    hottest = found["rated_bulk_k"].machine_value + max(found["rated_flash_k"].values.values())
    assert found["scuffing_margin_k"].machine_value == pytest.approx(
        found["scuffing_limit_k"].machine_value - hottest
    )
    assert found["scuffing_limit_k"].machine_value - 353.15 == pytest.approx(
        2.25 * (1e3 * OilSheet(grade="VG 220").viscosity(363.15)) ** -0.05 * 144.0, rel=1e-9
    )


@pytest.mark.parametrize(
    ("changed", "reason"),
    [
        (
            {
                "lubricant": {
                    "viscosity": {"law": "barus", "eta0": "0.05 Pa s", "alpha": "15 1/GPa"},
                    "density": {"law": "incompressible", "rho0": "0.85 g/cm^3"},
                    "rheology": "newtonian",
                }
            },
            "not by a data sheet",
        ),
        ({"surface": {"kind": "flat"}}, "the flanks are smooth"),
        (
            {
                "lubricant.base": "ester",
                "lubricant.alpha": "15 1/GPa",
                "lubricant.density_15": "0.95 g/cm^3",
                "lubricant.viscosity_100": "20 mm^2/s",
            },
            "mineral or pao, got ester",
        ),
    ],
)
def test_gears_that_cannot_be_rated_state_the_reason(changed, reason):
    found = rated.machine_ratings(load_machine(EXAMPLES / "fzg-c.toml").with_overrides(changed))
    assert [rating.key for rating in found] == list(gear_ratings.GEAR_KEYS)
    assert all(reason in rating.reason for rating in found)
    assert all(rating.to_dict()["value"] is None for rating in found)


@pytest.mark.parametrize("grade", ["VG 32", "VG 46", "VG 68"])
def test_gears_in_thin_oil_are_rated(grade):
    """The standard uses alpha at 38 °C, whatever viscosity the flash temperature gives."""
    case = load_machine(EXAMPLES / "fzg-c.toml", {"lubricant.grade": grade})
    found = by_key(case)
    assert not any(found[key].reason for key in gear_ratings.GEAR_KEYS)
    films = found["rated_film"].values
    assert min(films, key=films.get) == "A"
    assert 0.02 < films["A"] < 0.25  # 0.256 with VG 220
    assert machine_conditions(case).scalars()["ratings"]


def test_a_flash_temperature_beyond_the_estimate_of_alpha_is_reported():
    hot = {"machine.torque": "900 N m", "machine.speed": "12000 r/min", "surface.sq": "2 um"}
    found = by_key(load_machine(EXAMPLES / "fzg-c.toml", hot | {"rating.permissible_film": 0.2}))
    assert found["rated_flash_k"].values["A"] > 300.0
    assert found["rated_film"].values["A"] is None
    assert "the limit of the estimate of α" in found["rated_film"].reason
    assert "not known along the whole path" in found["micropitting_safety"].reason


@pytest.mark.parametrize(
    ("changed", "beyond"),
    [
        ({}, ""),
        (
            {"machine.speed": "500 r/min"},
            "a pitch-line speed of 1.92 m/s (2 to 80); a Peclet number of 0.83 (1 or more)",
        ),
        (
            {"machine.speed": "1 r/min"},
            "a pitch-line speed of 0.00383 m/s (2 to 80); a Peclet number of 0.0017 (1 or more)",
        ),
    ],
)
def test_values_outside_the_range_of_a_standard_are_reported(changed, beyond):
    case = load_machine(EXAMPLES / "fzg-c.toml", changed)
    found = by_key(case)
    assert found["rated_flash_k"].beyond == beyond
    assert found["mesh_friction"].beyond == beyond.partition("; ")[0]
    assert ("rated λGF" in machine_conditions(case)._rated()) == (beyond == "")


def test_the_life_factor_of_rollers_uses_at_least_the_bearing_load():
    """NJ 208 under 10 kN: slices and clearance lower the equivalent load, but no stress."""
    case = load_machine(EXAMPLES / "nu206.toml").with_overrides(
        {
            "machine": {
                "kind": "cylindrical-roller-bearing",
                "rollers": 14,
                "roller_diameter": "11 mm",
                "roller_length": "10.2 mm",
                "pitch_diameter": "60 mm",
                "clearance": "35 um",
                "profile": "iso",
                "radial_load": "10 kN",
                "speed": "1500 r/min",
            },
            "rating": {
                "dynamic_load_rating": "62 kN",
                "fatigue_load_limit": "6.7 kN",
                "contamination": 0.5,
            },
        }
    )
    found = by_key(case)
    assert found["equivalent_load_n"].machine_value == pytest.approx(7590.0, rel=1e-3)
    expected = life_factor("roller", found["viscosity_ratio"].machine_value, 0.5 * 6.7 / 10.0)
    assert found["life_factor"].machine_value == pytest.approx(expected)


def test_teeth_warmer_than_their_oil_are_noted():
    """fzg-c: 390 K against 363 K, where VG 220 with index 95 keeps 0.47 of its viscosity."""
    case = load_machine(EXAMPLES / "fzg-c.toml")
    (warning,) = [note for note in machine_conditions(case).notes if "bulk temperature" in note]
    assert "supply temperature of 90 degC" in warning
    assert "of 117 degC it has 0.47 of that viscosity" in warning
    cold = load_machine(EXAMPLES / "fzg-c.toml", {"rating.bulk_temperature": "90 degC"})
    assert not any("bulk temperature" in note for note in machine_conditions(cold).notes)


def test_a_pressure_above_the_static_limit_is_noted():
    case = load_machine(EXAMPLES / "6206.toml", {"machine.clearance": "-450 um"})
    assert any(
        "above 4.2000 GPa, the static limit" in note for note in machine_conditions(case).notes
    )
    assert not any(
        "static limit" in note
        for note in machine_conditions(load_machine(EXAMPLES / "6206.toml")).notes
    )


def test_machines_without_a_standard_have_no_ratings():
    case = load_machine(EXAMPLES / "fzg-c.toml")
    discs = {"kind": "twin-disc", "radii": ["20 mm", "30 mm"], "speeds": ["900 r/min", "500 r/min"]}
    other = case.with_overrides({"machine": discs | {"load": "500 N", "length": "5 mm"}})
    assert rated.machine_ratings(other) == ()
    assert machine_conditions(other).scalars()["ratings"] == []


def test_fatigue_below_a_smooth_contact_agrees_with_hertz():
    """The solved smooth, dry contact agrees with Hertz; at a = 0 both give the quarter of a line
    contact.
    """
    case = load_machine(EXAMPLES / "nu206.toml").with_overrides(LIMITS)
    dry = {"surface": "flat", "lubricant": "none", "grid.cells": [192, 24], "grid.x": [-3.0, 3.0]}
    run = solve_case(case.case(case.contacts[0]).with_overrides(dry))
    found = fatigue_ratings.dang_van_below(run, (350e6, 600e6))
    core = found.depths >= found.core_depth
    assert found.solved[core] == pytest.approx(found.smooth[core], rel=0.02)
    assert found.slope == pytest.approx(0.25)
    p_max = run.solution.conditions.hertz.p_max
    assert found.smooth.max() / p_max == pytest.approx(
        0.182, rel=0.03
    )  # between 0.1935 (a 0.2) and 0.1702 (a 0.3)
    ratings = {rating.key: rating.machine_value for rating in found.ratings()}
    assert ratings["dang_van_safety"] == pytest.approx(350e6 / found.solved[core].max())
    result = replace(machine_conditions(case), run=run)
    assert result.dang_van is not None
    assert "dang_van_pa" in [rating.key for rating in result.ratings]


def test_asperities_raise_the_fatigue_measure():
    case = load_machine(EXAMPLES / "nu206.toml").with_overrides(LIMITS | {"surface.sq": "0.4 um"})
    rough = {"grid.cells": [96, 48], "solver.surfaces": 1}
    run = solve_case(case.case(case.contacts[0]).with_overrides(rough))
    found = fatigue_ratings.dang_van_below(run, (350e6, 600e6))
    assert found.solved.max() > 1.3 * found.smooth.max()
    assert np.argmax(found.solved) < np.argmax(found.smooth)  # and nearer to the surface
