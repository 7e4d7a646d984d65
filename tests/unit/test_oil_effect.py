"""Effect of an estimated pressure-viscosity coefficient on film and load share."""

import math
from pathlib import Path

import pytest

from asperity.benchmark import load_experiments
from asperity.case import load_case
from asperity.results import solve_case, uncertainty_rows

FILM = next(entry.case for entry in load_experiments() if entry.name == "fva3-25c").with_overrides(
    {
        "contact.entrainment_speed": "0.3 m/s",
        "grid.cells": [96, 96],
        "thermal.inlet_heating": False,
    }
)
ROUGH = load_case(Path(__file__).parents[2] / "examples" / "data-sheet-oil.toml").with_overrides(
    {"contact.roughness": "standing", "grid.cells": [96, 32], "vibration": "none"}
)


def test_the_film_of_a_smooth_contact_scales_with_about_the_root_of_alpha():
    run = solve_case(FILM)
    effect = run.alpha_effect
    error = FILM.lubricant.alpha_error
    assert effect.error == error == pytest.approx(0.1645, abs=1e-3)  # 90 % of ± 20 % at two sigma
    low, high = (math.log(ratio) for ratio in effect.films["h_central_m"])
    exponents = low / math.log(1.0 - error), high / math.log(1.0 + error)
    # 0.53 by Hamrock and Dowson; Roelands' law thickens faster than its slope
    assert exponents == pytest.approx((0.6, 0.6), abs=0.1)
    assert effect.clr == (0.0, 0.0)
    given = {"lubricant.alpha": (1.0 + error) * FILM.lubricant.viscosity.alpha}
    thicker = solve_case(FILM.with_overrides(given))
    assert thicker.alpha_effect is None
    assert effect.ends(run.scalars())["h_central_m"][1] == pytest.approx(
        thicker.state.h_central, rel=1e-3
    )


def test_a_thinner_film_carries_less_of_the_load():
    run = solve_case(ROUGH)
    summary = run.summary()["alpha_effect"]
    assert set(summary) == {"alpha_error", "h_central_m", "h_mean_m", "h_min_m", "clr"}
    low, high = summary["clr"]
    assert 0.0 <= high < run.state.clr < low <= 1.0
    note = run.alpha_effect.note(run.scalars())
    assert note.startswith("Alpha is estimated, ± 16 %: at the ends")
    assert note.endswith("A measured alpha (± 10 %) would reduce these ranges to 61 %.")


def test_the_intervals_contain_the_effect():
    """Film and load share at both ends of alpha's interval lie within those of the result."""
    run = solve_case(ROUGH)
    ends, numbers = run.alpha_effect.ends(run.scalars()), run.scalars()
    for key, low, high in (
        ("clr", "clr_low", "clr_high"),
        ("h_central_m", "h_central_low_m", "h_central_high_m"),
        ("h_min_m", "h_min_low_m", "h_min_high_m"),
    ):
        assert numbers[low] <= min(ends[key]) <= max(ends[key]) <= numbers[high], key
    given = {"lubricant.alpha": ROUGH.lubricant.viscosity.alpha}
    stated = solve_case(ROUGH.with_overrides(given)).scalars()
    assert stated["clr"] == pytest.approx(numbers["clr"], rel=1e-6)
    below, above = numbers["clr"] - numbers["clr_low"], numbers["clr_high"] - numbers["clr"]
    share = ends["clr"]
    assert below == pytest.approx(
        math.hypot(stated["clr"] - stated["clr_low"], numbers["clr"] - share[1]), rel=1e-6
    )
    assert above == pytest.approx(
        math.hypot(stated["clr_high"] - stated["clr"], share[0] - numbers["clr"]), rel=1e-6
    )


def test_an_interval_without_the_effect_is_not_determined(monkeypatch):
    monkeypatch.setattr("asperity.results.run.alpha_effect", lambda *_: None)
    numbers = solve_case(ROUGH).scalars()
    assert numbers["clr_low"] is numbers["h_central_high_m"] is None
    assert "pressure-viscosity coefficient" in solve_case(ROUGH).verdict()


def test_the_resonance_follows_from_the_load_share():
    run = solve_case(ROUGH.with_overrides({"vibration": {"mass": "0.1 kg", "damping_ratio": 0.02}}))
    below, above = run.error.crf_hz.oil
    assert below > 0.0 < above
    assert run.state.error.crf_hz.oil == (0.0, 0.0)
    rows = dict(uncertainty_rows(run.error))
    assert rows["CRF, pressure-viscosity coefficient"].endswith(" Hz")


def test_a_given_alpha_and_a_dry_contact_have_no_effect():
    given = ROUGH.with_overrides({"lubricant.alpha": "20 1/GPa"})
    assert "alpha_effect" not in solve_case(given).summary()
    dry = solve_case(ROUGH.with_overrides({"lubricant": "none"}))
    assert dry.alpha_effect is None
    assert "oil" not in dry.summary()
