"""Results of a machine: worst contact, verdict, and the contacts of its study."""

from dataclasses import replace
from pathlib import Path

import pytest

from asperity.case import load_machine
from asperity.core.errors import BadInput
from asperity.machines import MachineResult, machine_conditions, solve_machine
from asperity.machines import solve as machine

EXAMPLES = Path(__file__).parents[2] / "examples"


@pytest.fixture(scope="module")
def gears():
    return load_machine(EXAMPLES / "fzg-c.toml")


def solved(gears, **changed):
    """Return a result with given values: name=(CLR, film ratio, central film)."""
    rows = []
    for row in machine_conditions(gears).rows:
        clr, film_ratio, film = changed.get(row["name"], (0.0, 2.0, 1e-6))
        numbers = {
            "clr": clr,
            "lambda_ratio": film_ratio,
            "h_central_m": film,
            "h_min_m": film,
            "determined": True,
        }
        reason = "did not converge" if clr is None else ""
        rows.append({**row, **numbers, "flash_temperature_max_k": 12.5, "reason": reason})
    return MachineResult(gears, tuple(rows), True, 1.0)


def test_the_worst_contact_has_the_highest_clr(gears):
    found = solved(gears, A=(0.3, 0.9, 1e-7), D=(0.4, 1.1, 2e-7), E=(0.2, 0.2, 1e-8))
    assert found.worst["name"] == "D"
    assert (
        found.verdict()
        == "Spur gear pair 16/24, contact ratio 1.44: mixed lubrication at 3 of 7 contacts; worst"
        " is D, where asperities carry 40.0 % of the load on a film of 0.200 µm, Λ 1.10, maximum"
        " flash temperature 12.5 K; rated λGF 0.256 at A."
    )


def test_the_verdict_gives_the_interval(gears):
    found = solved(gears, D=(0.4, 1.1, 2e-7))
    found.worst.update(clr_low=0.31, clr_high=0.52)
    assert "asperities carry 40.0 % (31 to 52 %) of the load" in found.verdict()


def test_the_verdict_mentions_possible_mixed_lubrication(gears):
    found = solved(gears, A=(0.0, 0.5, 1e-7))
    assert ": full film; worst" in found.verdict()
    found.worst.update(clr_low=0.0, clr_high=0.05)
    assert ": full film, or mixed lubrication at 1 of 7 contacts; worst is A" in found.verdict()


def test_in_full_film_the_worst_contact_has_the_lowest_film_ratio(gears):
    assert solved(gears, A=(0.009, 1.9, 1e-6), E=(0.0, 1.7, 1e-6)).worst["name"] == "E"
    smooth = {row["name"]: (0.0, None, 1e-6) for row in machine_conditions(gears).rows}
    found = solved(gears, **smooth | {"DE": (0.0, None, 4e-7)})
    assert found.worst["name"] == "DE"
    assert (
        ": full film; worst is DE, where solid contact carries 0.0 % of the load on a film of 0.400"
        in found.verdict()
    )


def test_unsolved_the_worst_contact_has_the_highest_pressure(gears):
    found = machine_conditions(gears)
    assert found.worst["p_hertz_pa"] == max(row["p_hertz_pa"] for row in found.rows)
    assert found.verdict().endswith(
        "the highest Hertz pressure is 1.6671 GPa at B, slide-to-roll ratio −46 %; not solved."
    )


def test_failed_contacts_are_in_the_verdict(gears):
    partly_failed = solved(gears, B=(None, None, None))
    assert [row["name"] for row in partly_failed.failures] == ["B"]
    assert partly_failed.worst["name"] != "B"
    assert partly_failed.verdict().endswith(
        "; rated λGF 0.256 at A; 1 of 7 contacts were NOT SOLVED."
    )
    all_failed = {row["name"]: (None, None, None) for row in partly_failed.rows}
    assert "NOT SOLVED, 7 of 7 contacts failed" in solved(gears, **all_failed).verdict()


def test_chosen_grids_shrink_to_the_limit_of_cells(gears, monkeypatch):
    def cells(case):
        plan, _ = machine._plan(case, case.contacts)
        return [plan.case.with_overrides(point).grid.cells for point in plan.points]

    unlimited = cells(gears)
    monkeypatch.setattr(machine, "ALL_CELLS", 7 * 12_000)
    limited = cells(gears)
    assert max(nx * ny for nx, ny in limited) <= 12_000 < max(nx * ny for nx, ny in unlimited)
    assert [a for a, b in zip(limited, unlimited, strict=True) if b[0] * b[1] <= 12_000] == [
        b for b in unlimited if b[0] * b[1] <= 12_000
    ]
    stated = gears.with_overrides({"grid.accuracy": 0.01})
    assert max(nx * ny for nx, ny in cells(stated)) > 12_000  # a stated accuracy is kept


def test_overrides_do_not_change_the_original_machine(gears):
    gears.with_overrides({"surface.sq": "0.1 um", "machine.torque": "10 N m"})
    assert gears.case(gears.contacts[0]).surface().sq == pytest.approx(0.5e-6, rel=1e-6)
    assert gears.with_overrides({}).machine.torque == 265.1


def test_both_sides_of_a_load_zone_share_one_point():
    bearing = load_machine(EXAMPLES / "nu206.toml")
    plan, indices = machine._plan(bearing, bearing.contacts)
    assert (len(bearing.contacts), len(plan.points)) == (10, 6)
    assert indices["roller 2, outer ring"] == indices["roller 11, outer ring"]
    for contact in bearing.contacts:
        stated = plan.case.with_overrides(plan.points[indices[contact.name]]).conditions
        assert stated.load == pytest.approx(contact.load, rel=1e-9)
        assert stated.radius == pytest.approx(contact.radius, rel=1e-9)


def test_a_contact_without_entrainment_states_the_reason(gears, monkeypatch):
    first, second, *_ = gears.contacts
    opposed = replace(second, surface_speeds=(1.0, -1.0))
    flat = gears.with_overrides({"surface": "flat", "grid.cells": [48, 24]})
    monkeypatch.setitem(vars(flat), "contacts", (first, opposed))
    found = solve_machine(flat, workers=1)
    assert found.rows[0]["h_central_m"] > 0.0
    assert found.rows[1]["slide_to_roll"] is None
    assert "entrain no oil" in found.rows[1]["reason"]
    monkeypatch.setitem(vars(flat), "contacts", (opposed,))
    with pytest.raises(BadInput, match="no contact entrains oil"):
        solve_machine(flat)


def stressed(gears, *, pressure, stress, **changes):
    """Return the notes on strength, with a maximum pressure and a von Mises stress [Pa] at B."""
    gears = gears.with_overrides(changes)
    rows = [
        {**row, "p_max_pa": 1e9, "von_mises_core_pa": 0.5e9, "reason": ""}
        for row in machine_conditions(gears).rows
    ]
    rows[2] |= {"p_max_pa": pressure, "von_mises_core_pa": stress}
    notes = MachineResult(gears, tuple(rows), True, 1.0).notes
    return [note for note in notes if "maximum pressure" in note or "von Mises" in note]


def test_stresses_above_the_strength_of_steel_are_noted(gears):
    """The yield stress is a third of the hardness (Tabor): 2.27 GPa of 6.8 GPa."""
    assert stressed(gears, pressure=6.8e9, stress=2.2e9) == []
    (yielding,) = stressed(gears, pressure=6.8e9, stress=2.3e9)
    assert "2.300 GPa below the surface at B is above 2.267 GPa" in yielding
    elastic = {"material": {"youngs_modulus": "206 GPa", "poisson_ratio": 0.3, "hardness": "none"}}
    (above,) = stressed(gears, pressure=8e9, stress=1e9, **elastic)
    assert "8.000 GPa at B is above 6.800 GPa, the hardness of case-hardened steel" in above
    ceramic = {"material": {"name": "silicon nitride", "hardness": "none"}}
    assert stressed(gears, pressure=9e9, stress=4e9, **ceramic) == []
