"""[lubricant] given by a data sheet: case, run, study and page."""

import json
import pickle
from pathlib import Path

import pytest

from asperity.case import load_case
from asperity.core.errors import BadInput
from asperity.lubricant import (
    ESTIMATORS,
    ExponentialWarmth,
    Newtonian,
    OilSheet,
    RoelandsWarmth,
    measured_oils,
)
from asperity.report import write_report
from asperity.results import load_run, solve_case
from asperity.study import plan_study

EXAMPLE = load_case(Path(__file__).parents[2] / "examples" / "data-sheet-oil.toml")
PAPER = load_case(Path(__file__).parents[2] / "examples" / "paper.toml")
BARE = {"lubricant": {"grade": "VG 100", "temperature": "70 degC"}}


def test_a_data_sheet_is_converted_to_si_and_restated():
    sheet = OilSheet(grade="VG 100", viscosity_100=11.2e-6, density_15=885.0)
    assert EXAMPLE.lubricant == sheet.lubricant(343.15)
    assert load_case(EXAMPLE.text) == EXAMPLE
    assert "ambient" not in EXAMPLE.text  # the default temperature would differ from the oil's
    assert pickle.loads(pickle.dumps(EXAMPLE)) == EXAMPLE
    overrides = {
        "viscosity_40": "98 cSt",
        "viscosity_100": "1.12e-5 m^2/s",
        "viscosity_index": 100,
        "density_15": "0.88 g/cm^3",
        "base": "polyglycol",
        "alpha": "15 1/GPa",
        "temperature": "343.15 K",
        "thickening": "barus",
        "rheology": {"law": "ree-eyring", "tau0": "5 MPa"},
        "friction": "newtonian",
    }
    case = PAPER.with_overrides({"lubricant": overrides})
    assert case.lubricant.viscosity.eta0 == pytest.approx(
        OilSheet(viscosity_40=98e-6, viscosity_100=11.2e-6, density_15=880.0).viscosity(343.15),
        rel=1e-12,
    )
    assert case.lubricant.viscosity.alpha == pytest.approx(15e-9)
    assert type(case.lubricant.viscosity).__name__ == "Barus"
    assert case.lubricant.rheology.tau0 == 5e6
    assert load_case(case.text) == case
    assert (
        case.with_overrides({"lubricant.rheology": "newtonian"}).lubricant.rheology == Newtonian()
    )


def test_single_values_can_be_overridden_and_removed():
    case = EXAMPLE.with_overrides(
        {"lubricant.grade": "none", "lubricant.viscosity_40": "150 mm^2/s"}
    )
    assert case.lubricant == OilSheet(
        viscosity_40=150e-6, viscosity_100=11.2e-6, density_15=885.0
    ).lubricant(343.15)
    assert EXAMPLE.with_overrides(
        {"lubricant.alpha": "20 1/GPa"}
    ).lubricant.viscosity.alpha == pytest.approx(20e-9)
    gold = EXAMPLE.with_overrides({"lubricant.alpha_estimate": "gold"}).lubricant.viscosity.alpha
    sheet = EXAMPLE.contents.lubricant.sheet
    assert gold == pytest.approx(ESTIMATORS["gold"].law(sheet, 343.15) / 0.75)


@pytest.mark.parametrize("celsius", [50, 90])
def test_heat_takes_temperature_and_slope_from_the_sheet(celsius):
    """Also for a case whose [thermal] was restated with every default."""
    case = PAPER.with_overrides(BARE).with_overrides({"lubricant.temperature": f"{celsius} degC"})
    kelvin = celsius + 273.15
    assert case.thermal.ambient == pytest.approx(kelvin)
    assert case.thermal.warmth == ExponentialWarmth(
        OilSheet(grade="VG 100").walther.thinning(case.thermal.ambient)
    )
    warmer = OilSheet(grade="VG 100").viscosity(kelvin + 1.0) / OilSheet(grade="VG 100").viscosity(
        kelvin
    )
    assert case.thermal.warmth.beta == pytest.approx(1.0 - warmer, rel=0.03)
    assert case.with_overrides({"thermal.ambient": f"{kelvin} K"}).thermal.ambient == pytest.approx(
        kelvin
    )
    restated = case.with_overrides({"thermal.warmth": {"law": "roelands", "s0": 1.1}})
    assert restated.thermal.warmth == RoelandsWarmth(1.1)
    assert load_case(restated.text) == restated


def test_viscosity_laws_without_a_data_sheet_are_unchanged():
    assert PAPER.thermal.ambient == pytest.approx(313.15)
    assert PAPER.oil_facts == ()
    assert "[thermal]\nambient" in PAPER.text
    assert not any("Oil" in note for note in PAPER.notes)


def test_a_measured_oil_is_selected_by_name():
    case = PAPER.with_overrides({"lubricant": {"oil": "spindle low-VI", "temperature": "60 degC"}})
    assert case.lubricant.viscosity.eta0 == pytest.approx(8.6e-3, rel=1e-9)
    assert case.lubricant.viscosity.alpha == pytest.approx(20.3e-9, rel=1e-9)
    assert "Stachowiak and Batchelor, Engineering Tribology, table 2.3" in case.notes[1]
    assert all(
        PAPER.with_overrides({"lubricant": {"oil": name, "temperature": "80 degC"}}).lubricant
        for name in measured_oils()
    )


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (
            {"lubricant.viscosity": "barus"},
            r"lubricant has both viscosity \(a law\) and grade \(of a data sheet\); keep",
        ),
        (
            {"lubricant.density": {"law": "incompressible", "rho0": "1 g/cm^3"}},
            r"has both density \(a law\) and",
        ),
        ({"lubricant": {"grade": "VG 100"}}, "lubricant.temperature is missing; add it"),
        (
            {"lubricant.temperature": "70"},
            'temperature must be a temperature such as "40 degC"',
        ),
        (
            {"lubricant.viscosity_100": "9 mPa s"},
            'a kinematic viscosity such as "100 mm.2/s", got "9 mPa s", which is',
        ),
        ({"lubricant.grad": "VG 68"}, "lubricant.grad is not a known key; did you mean grade"),
        (
            {"lubricant.temperature": "151 degC"},
            "lubricant: temperature must lie between -20 and 150 degC",
        ),
        ({"lubricant.base": "pao"}, "lubricant: alpha is missing and is required for base pao"),
        (
            {"lubricant.thickening": "bar"},
            'lubricant.thickening must be "roelands" or "barus", got "bar"',
        ),
        (
            {"lubricant.oil": "cylinder low-VI"},
            "lubricant: has both oil and grade; use oil alone for a measured oil",
        ),
        (
            {"lubricant": {"oil": "olive", "temperature": "40 degC"}},
            'oil must be one of the measured .* got "olive"',
        ),
        (
            {"lubricant": {"oil": "spindle low-VI", "base": "pao", "temperature": "40 degC"}},
            "lubricant: has both oil and base",
        ),
        (
            {"thermal.ambient": "40 degC"},
            "thermal: ambient is 40 degC, but lubricant.temperature is 70 degC",
        ),
        ({"lubricant": "nun"}, "lubricant must be a table"),
    ],
)
def test_a_mistake_is_reported_in_one_sentence(change, message):
    with pytest.raises(BadInput, match=message) as caught:
        EXAMPLE.with_overrides(change)
    assert "\n" not in str(caught.value)


def test_a_data_sheet_together_with_laws_is_refused():
    with pytest.raises(
        BadInput, match=r"has both viscosity \(a law\) and grade \(of a data sheet\)"
    ):
        PAPER.with_overrides({"lubricant.grade": "VG 100"})


def test_a_run_and_its_page_report_estimated_oil_properties(tmp_path):
    small = {"grid.cells": [48, 16], "surface": "flat", "vibration": "none"}
    run = solve_case(PAPER.with_overrides(BARE | small))
    loaded = load_run(run.save(tmp_path / "run.nc"))
    assert loaded.case == run.case
    assert loaded.solution.lubricant == run.case.lubricant
    summary = json.loads(json.dumps(loaded.summary()))
    assert summary["oil"]["oil_viscosity_pa_s"] == pytest.approx(
        OilSheet(grade="VG 100").viscosity(343.15)
    )
    assert summary["oil"]["origins"]["oil_alpha_1_pa"].startswith(
        "estimated: Roelands with Z 0.65, ± 20 %"
    )
    assert summary["oil"]["origins"].keys() == summary["oil"].keys() - {"origins"}
    assert summary["notes"][0].startswith("Oil by its data sheet, given: ")
    assert summary["notes"][1].startswith("Oil by its data sheet, estimated: viscosity index 95")
    page = write_report([loaded], tmp_path / "page.html").read_text("utf-8")
    assert "Oil, estimated" in page
    assert "(mid-point of VG 100)" in page
    assert "oil" not in solve_case(PAPER.with_overrides(small)).summary()


def test_a_study_varies_the_temperature_of_an_oil():
    plan = plan_study(EXAMPLE.with_overrides({"study": {"temperature": ["40 degC", "90 degC"]}}))
    cool, warm = (EXAMPLE.with_overrides(point) for point in plan.points)
    assert cool.lubricant.viscosity.eta0 == pytest.approx(
        OilSheet(grade="VG 100", density_15=885.0).viscosity(313.15)
    )
    assert warm.lubricant.viscosity.eta0 < 0.2 * cool.lubricant.viscosity.eta0
    assert warm.thermal.ambient == pytest.approx(363.15)
