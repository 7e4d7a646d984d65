"""Which contact of a machine is worst, what is said of it, and which contacts a study of it has."""

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
    """A result with numbers of one's own: name=(CLR, film ratio, central film)."""
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
        why = "did not converge" if clr is None else ""
        rows.append({**row, **numbers, "flash_temperature_max_k": 12.5, "reason": why})
    return MachineResult(gears, tuple(rows), True, 1.0)


def test_the_worst_is_where_asperities_carry_most(gears):
    found = solved(gears, A=(0.3, 0.9, 1e-7), D=(0.4, 1.1, 2e-7), E=(0.2, 0.2, 1e-8))
    assert found.worst["name"] == "D"
    assert (
        found.verdict()
        == "Spur gear pair 16/24, contact ratio 1.44: mixed lubrication at 3 of 7 contacts; worst"
        " is D, where asperities carry 40.0 % of the load on a film of 0.200 µm, Λ 1.10, maximum"
        " flash temperature 12.5 K; rated λGF 0.256 at A."
    )


def test_an_interval_is_in_the_verdict(gears):
    found = solved(gears, D=(0.4, 1.1, 2e-7))
    found.worst.update(clr_low=0.31, clr_high=0.52)
    assert "asperities carry 40.0 % (31 to 52 %) of the load" in found.verdict()


def test_a_full_film_that_may_be_none_says_so(gears):
    found = solved(gears, A=(0.0, 0.5, 1e-7))
    assert ": full film; worst" in found.verdict()
    found.worst.update(clr_low=0.0, clr_high=0.05)
    assert ": full film, or mixed lubrication at 1 of 7 contacts; worst is A" in found.verdict()


def test_in_full_film_the_worst_has_the_least_film(gears):
    assert solved(gears, A=(0.009, 1.9, 1e-6), E=(0.0, 1.7, 1e-6)).worst["name"] == "E"
    smooth = {row["name"]: (0.0, None, 1e-6) for row in machine_conditions(gears).rows}
    found = solved(gears, **smooth | {"DE": (0.0, None, 4e-7)})
    assert found.worst["name"] == "DE"
    assert (
        ": full film; worst is DE, where asperities carry 0.0 % of the load on a film of 0.400"
        in found.verdict()
    )


def test_not_solved_the_worst_is_pressed_hardest(gears):
    found = machine_conditions(gears)
    assert found.worst["p_hertz_pa"] == max(row["p_hertz_pa"] for row in found.rows)
    assert found.verdict().endswith(
        "the highest Hertz pressure is 1.6671 GPa at B, slide-to-roll ratio −46 %; not solved."
    )


def test_what_failed_is_in_the_verdict(gears):
    some = solved(gears, B=(None, None, None))
    assert [row["name"] for row in some.failures] == ["B"]
    assert some.worst["name"] != "B"
    assert some.verdict().endswith("; rated λGF 0.256 at A; 1 of 7 contacts were NOT SOLVED.")
    all_of_them = {row["name"]: (None, None, None) for row in some.rows}
    assert "NOT SOLVED, 7 of 7 contacts failed" in solved(gears, **all_of_them).verdict()


def test_a_chosen_grid_is_made_smaller_where_all_are_too_many(gears, monkeypatch):
    def cells(case):
        plan, _ = machine._plan(case, case.contacts)
        return [plan.case.with_overrides(point).grid.cells for point in plan.points]

    free = cells(gears)
    monkeypatch.setattr(machine, "ALL_CELLS", 7 * 12_000)
    few = cells(gears)
    assert max(nx * ny for nx, ny in few) <= 12_000 < max(nx * ny for nx, ny in free)
    assert [a for a, b in zip(few, free, strict=True) if b[0] * b[1] <= 12_000] == [
        b for b in free if b[0] * b[1] <= 12_000
    ]
    asked = gears.with_overrides({"grid.accuracy": 0.01})
    assert max(nx * ny for nx, ny in cells(asked)) > 12_000  # what is asked for stands


def test_a_changed_machine_leaves_the_first_as_it_was(gears):
    gears.with_overrides({"surface.sq": "0.1 um", "machine.torque": "10 N m"})
    assert gears.case(gears.contacts[0]).surface().sq == pytest.approx(0.5e-6, rel=1e-6)
    assert gears.with_overrides({}).machine.torque == 265.1


def test_both_sides_of_a_load_zone_are_one_point():
    bearing = load_machine(EXAMPLES / "nu206.toml")
    plan, places = machine._plan(bearing, bearing.contacts)
    assert (len(bearing.contacts), len(plan.points)) == (10, 6)
    assert places["roller 2, outer ring"] == places["roller 11, outer ring"]
    for contact in bearing.contacts:
        stated = plan.case.with_overrides(plan.points[places[contact.name]]).conditions
        assert stated.load == pytest.approx(contact.load, rel=1e-9)
        assert stated.radius == pytest.approx(contact.radius, rel=1e-9)


def test_a_contact_that_draws_no_oil_in_has_its_reason(gears, monkeypatch):
    first, second, *_ = gears.contacts
    against = replace(second, surface_speeds=(1.0, -1.0))
    flat = gears.with_overrides({"surface": "flat", "grid.cells": [48, 24]})
    monkeypatch.setitem(vars(flat), "contacts", (first, against))
    found = solve_machine(flat, workers=1)
    assert found.rows[0]["h_central_m"] > 0.0
    assert found.rows[1]["slide_to_roll"] is None
    assert "entrain no oil" in found.rows[1]["reason"]
    monkeypatch.setitem(vars(flat), "contacts", (against,))
    with pytest.raises(BadInput, match="no contact entrains oil"):
        solve_machine(flat)
