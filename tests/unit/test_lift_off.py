"""Lift-off speed: search on load shares in closed form, and of small running contacts."""

import json
import math
from functools import cache

import numpy as np
import pytest
from scipy.special import ndtr, ndtri

from asperity.core.errors import NotConverged
from asperity.core.quantities import quantity
from asperity.report.wear.page import render_wear_page
from asperity.simulation import (
    LiftOff,
    LiftOffChange,
    SearchSettings,
    SpeedShare,
    find_lift_off,
    lift_off_speed,
    run_wear,
)
from asperity.simulation.wear import lift_off
from support.wearing import worn_case

LIMITS = (1e-3, 1e2)
CROSSING = 0.37  # m/s
SMALL = {
    "contact.roughness": "running",
    "grid.cells": [24, 12],
    "surface.sq": "0.4 um",
    "thermal.inlet_heating": False,
}


def probit_line(speed, slope=1.0, half_width=0.0):
    """Return a load share whose probit is linear in ln(speed), 1 % at `CROSSING`."""
    share = float(ndtr(ndtri(0.01) - slope * math.log(speed / CROSSING)))
    return SpeedShare(share, half_width * share)


# Search


@pytest.mark.parametrize("slope", [0.5, 1.0, 3.0])
@pytest.mark.parametrize("start", [LIMITS[0], 0.05, CROSSING, 4.0, LIMITS[1]])
def test_a_linear_probit_is_crossed_exactly(start, slope):
    found = find_lift_off(lambda speed: probit_line(speed, slope), start, LIMITS)
    assert found.speed == pytest.approx(CROSSING, rel=1e-9)
    assert found.low <= CROSSING * (1.0 + 1e-9)
    assert found.high >= CROSSING * (1.0 - 1e-9)


def test_six_solves_suffice_if_the_start_is_close():
    for start in (0.1, 0.2, CROSSING, 0.8, 1.6):
        assert len(find_lift_off(probit_line, start, LIMITS).shares) <= 6


@pytest.mark.parametrize("start", [0.01, 0.3, 20.0])
@pytest.mark.parametrize("power", [1.0, 2.0, 6.0])
def test_the_interval_covers_a_crossing_of_another_law(start, power):
    def share(speed):
        return SpeedShare(0.01 ** ((speed / CROSSING) ** (power / 4.0)), 0.0)

    found = find_lift_off(share, start, LIMITS)
    assert found.low <= CROSSING <= found.high
    assert found.high / found.low < 1.16  # the bracket
    assert found.speed == pytest.approx(CROSSING, rel=0.01)


def test_a_share_that_vanishes_at_once_is_bracketed():
    found = find_lift_off(
        lambda speed: SpeedShare(0.05 if speed < CROSSING else 0.0, 0.0), 3.0, LIMITS
    )
    assert found.low <= CROSSING <= found.high
    assert found.high / found.low < 1.16


def test_the_interval_by_finite_time_is_that_of_the_share_over_the_slope():
    slope, relative = 2.0, 0.4
    found = find_lift_off(lambda speed: probit_line(speed, slope, relative), 0.3, LIMITS)
    density = math.exp(-0.5 * float(ndtri(0.01)) ** 2) / math.sqrt(2.0 * math.pi)
    time = relative * 0.01 / density / slope
    lowest = max(speed for speed, share in found.shares.items() if share.touches)
    assert found.below == pytest.approx(math.hypot(time, math.log(found.speed / lowest)), rel=1e-6)
    assert time < found.above < time + SearchSettings().bracket


def test_the_interval_covers_the_crossing_in_ninety_of_a_hundred_samples():
    rng, deviation, covered = np.random.default_rng(3), 0.3, 0

    def scattered(factor):
        def share(speed):
            clr = factor * probit_line(speed).clr
            return SpeedShare(clr, 1.645 * deviation * clr)

        return share

    for factor in np.exp(rng.normal(0.0, deviation, 300)):
        found = find_lift_off(scattered(factor), 0.5, LIMITS)
        covered += found.low <= CROSSING <= found.high
    assert 0.86 <= covered / 300 <= 0.97


def test_an_unknown_scatter_gives_the_limits_of_the_search():
    found = find_lift_off(lambda speed: SpeedShare(probit_line(speed).clr, 1.0), 0.5, LIMITS)
    assert (found.low, found.high) == pytest.approx(LIMITS, rel=1e-9)


@pytest.mark.parametrize(
    ("share", "words"),
    [
        (0.3, "at least 1 % of the load at the highest speed solved, 100 m/s"),
        (0.002, "less than 1 % of the load at the lowest speed solved, 0.001 m/s"),
        (0.0, "less than 1 % of the load at the lowest speed solved, 0.001 m/s"),
    ],
)
def test_a_contact_that_never_or_always_lifts_off_has_no_speed(share, words):
    found = find_lift_off(lambda _: SpeedShare(share, 0.0), 0.5, LIMITS)
    assert (found.speed, found.low, found.high) == (None, None, None)
    assert words in found.reason
    assert "not determined" in found.verdict()


def test_speeds_that_do_not_converge_are_passed_over_or_named():
    def share(speed):
        if speed > 1.2 * CROSSING:
            raise NotConverged(None, "too fast.")
        return probit_line(speed)

    assert find_lift_off(share, 5.0, LIMITS).speed == pytest.approx(CROSSING, rel=1e-9)

    def touching_only(speed):
        if speed > 0.8 * CROSSING:
            raise NotConverged(None, "too fast.")
        return probit_line(speed)

    found = find_lift_off(touching_only, 0.1, LIMITS)
    assert found.speed is None
    assert "at the highest speed solved" in found.reason
    assert found.reason.endswith("m/s: too fast")

    def nowhere(_):
        raise NotConverged(None, "never.")

    assert "no speed was solved; at 0.5 m/s: never" in find_lift_off(nowhere, 0.5, LIMITS).reason


# Change by wear


def test_the_ratio_combines_both_intervals():
    before = LiftOff(speed=2.0, below=0.1, above=0.2)
    after = LiftOff(speed=0.5, below=0.3, above=0.15)
    change = LiftOffChange(before=before, after=after)
    assert change.ratio.value == 0.25
    assert math.log(0.25 / change.ratio.low) == pytest.approx(math.hypot(0.3, 0.2))
    assert math.log(change.ratio.high / 0.25) == pytest.approx(math.hypot(0.15, 0.1))
    assert math.log(before.speed / before.low) == pytest.approx(0.1)
    assert "by -75 % (-83 to -70 %)" in change.verdict()
    assert len(change.verdict().split()) <= 30
    scalars = json.loads(json.dumps(change.scalars()))
    assert scalars["lift_off_speed_m_s"] == [2.0, 0.5]
    assert scalars["lift_off_reasons"] == [None, None]
    assert all(quantity(key) for key in scalars if key.endswith(("m_s", "ratio")))


def test_a_change_without_a_speed_states_the_reason():
    unknown = LiftOff(reason="the contact is dry")
    known = LiftOff(speed=2.0, below=0.1, above=0.2)
    change = LiftOffChange(before=known, after=unknown)
    assert change.ratio is None
    assert change.scalars()["lift_off_ratio"] is None
    assert "after wear is not determined (before: 2 m/s (1.81 to 2.44 m/s))" in change.verdict()
    assert "before wear is not determined: the contact is dry." in (
        LiftOffChange(before=unknown, after=unknown).verdict()
    )


# Running contacts


@pytest.fixture
def short(monkeypatch):
    """Average load shares over four passages."""
    monkeypatch.setattr(lift_off, "PASSAGES", 4)


@cache
def small_speed(sq="0.4 um", viscosity="0.096 Pa s"):
    """Return the lift-off speed of a small contact [m/s]."""
    law = {"law": "barus", "eta0": viscosity, "alpha": "18.2 1/GPa"}
    case = worn_case(SMALL | {"surface.sq": sq, "lubricant.viscosity": law})
    found = lift_off_speed(case, case.moving_surfaces())
    assert found.reason == ""
    assert len(found.shares) <= 8
    return found.speed


@pytest.mark.usefixtures("short")
def test_the_lift_off_speed_is_inverse_to_the_viscosity():
    # an isothermal contact depends on viscosity times speed only; 3 %: tolerance of the time steps
    assert small_speed(viscosity="0.048 Pa s") == pytest.approx(2.0 * small_speed(), rel=0.03)


@pytest.mark.usefixtures("short")
def test_a_smoother_surface_lifts_off_at_a_much_lower_speed():
    # stiff asperities: film and Sq in proportion, exponent 1/0.7 to 1/0.6; flatter ones of the same
    # length also flatten more under the pressure, so that the exponent is larger
    exponent = math.log(small_speed() / small_speed(sq="0.3 um")) / math.log(0.4 / 0.3)
    assert 1.0 / 0.7 < exponent < 6.0


@pytest.mark.usefixtures("short")
def test_wear_lowers_the_lift_off_speed():
    case = worn_case(
        SMALL
        | {"contact.entrainment_speed": "0.4 m/s", "wear.patches": 2, "wear.step": 0.2}
        | {"wear.k": "1e-15 1/Pa"}
    )
    history = run_wear(case, hours=0.2)
    solved = []
    change = history.lift_off(lambda speed, share: solved.append((speed, share.clr)))
    assert change.ratio.high < 1.0
    assert len(solved) == len(change.before.shares) + len(change.after.shares)
    page = render_wear_page(history, change)
    assert "The lift-off speed changes from" in page
    assert "lift-off" not in render_wear_page(history)


@pytest.mark.parametrize(
    ("overrides", "words"),
    [
        ({"contact.roughness": "standing"}, "needs running roughness"),
        ({"lubricant": "none", "material.hardness": "none"}, "the contact is dry"),
    ],
)
def test_standing_and_dry_contacts_have_no_lift_off_speed(overrides, words):
    case = worn_case(SMALL | overrides)
    found = lift_off_speed(case, case.moving_surfaces())
    assert found.speed is None
    assert words in found.reason
