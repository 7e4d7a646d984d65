"""[thermal], lubricant.friction and material.boundary_friction in the case file."""

import pickle
from pathlib import Path

import numpy as np
import pytest

from asperity.case import load_case
from asperity.core.errors import BadInput
from asperity.lubricant import BairWiner, EyringShear, LinearBairWiner, RoelandsWarmth, Thermal
from asperity.results import load_run, solve_case

CASE = load_case(Path(__file__).parents[2] / "examples" / "paper.toml")


def test_default_friction_and_solids_are_those_of_the_paper():
    case = load_case(CASE.text.replace("boundary_friction = 0.15", ""))
    assert case.boundary_friction == 0.15
    assert case.thermal == Thermal()
    assert case.lubricant.friction == BairWiner()


def test_thermal_keys_are_converted_to_si_and_restated():
    case = CASE.with_overrides(
        {
            "thermal.ambient": "60 degC",
            "thermal.bulk": ["80 degC", "350 K"],
            "thermal.conductivity": ["30 W/m/K", "0.5 W/cm/K"],
            "thermal.warmth": {"law": "roelands", "s0": 1.1},
            "thermal.feedback": "true",
            "lubricant.friction": {
                "law": "bair-winer-linear",
                "tau_l0": "2 MPa",
                "slope": 0.05,
                "softening": "2 1/kK",
            },
            "material.boundary_friction": 0.1,
        }
    )
    assert case.thermal.ambient == pytest.approx(333.15)
    assert case.thermal.bulk == pytest.approx((353.15, 350.0))
    assert [solid.conductivity for solid in case.thermal.solids] == pytest.approx([30.0, 50.0])
    assert case.thermal.warmth == RoelandsWarmth(1.1)
    assert case.thermal.feedback
    assert case.lubricant.friction == LinearBairWiner(2e6, 0.05, 0.002)
    assert case.boundary_friction == 0.1
    assert load_case(case.text) == case
    assert pickle.loads(pickle.dumps(case)) == case
    assert case.with_overrides({"thermal.bulk": "none"}).thermal.bulk is None


@pytest.mark.parametrize(
    ("key", "value", "message"),
    [
        (
            "thermal.ambient",
            "60",
            'must be a temperature such as "40 degC", got the bare number 60',
        ),
        (
            "thermal.ambient",
            "1000 degC",
            "temperature must lie between -60 and 500 degC, .* got 1000 degC, 1273.15 K",
        ),
        (
            "thermal.ambient",
            "40 C",
            'got "40 C", which is another quantity; degrees Celsius are written degC or °C',
        ),
        (
            "thermal.ambient",
            "40 cSt",
            'must be a temperature such as "40 degC", got "40 cSt", which is another quantity$',
        ),
        ("surface.sq", "5 %", 'surface.sq must be a length such as "5.4 mm", got "5 %"$'),
        ("contact.slip", "20 %", 'got "20 %"; write a fraction, 0.05 for 5 %'),
        (
            "lubricant.viscosity.eta0",
            "100 cSt",
            "another quantity; multiply a kinematic viscosity by the density",
        ),
        ("thermal.warmth", "exponentiel", 'did you mean "exponential"'),
        ("thermal.feedbck", True, "did you mean feedback"),
        ("thermal.conductivity", "46 W", "a thermal conductivity"),
        ("lubricant.friction", "ree-eyring", "lubricant.friction.tau0 is missing"),
        (
            "material.boundary_friction",
            -0.1,
            "material.boundary_friction must be greater than or equal to 0",
        ),
    ],
)
def test_invalid_values_are_refused_in_one_sentence(key, value, message):
    with pytest.raises(BadInput, match=message):
        CASE.with_overrides({key: value})


@pytest.mark.parametrize("text", ["60 °C", "60°C", "60 degC"])
def test_degrees_celsius_are_read_in_common_spellings(text):
    case = CASE.with_overrides({"thermal.ambient": text})
    assert case.thermal.ambient == 333.15
    assert load_case(case.text) == case


def test_thermal_feedback_lowers_the_viscosity_and_survives_saving_and_loading(tmp_path):
    small = {"grid.cells": [64, 64], "surface.correlation_length": "30 um", "vibration": "none"}
    case = CASE.with_overrides(
        small | {"lubricant.friction": {"law": "ree-eyring", "tau0": "5 MPa"}}
    )
    cold = solve_case(case)
    warm = solve_case(case.with_overrides({"thermal.feedback": "true"}))
    assert cold.solution.viscosity_factor is None
    assert 0.2 < warm.solution.viscosity_factor.min() < 0.95
    loaded = load_run(warm.save(tmp_path / "warm.nc"))
    np.testing.assert_array_equal(loaded.solution.viscosity_factor, warm.solution.viscosity_factor)
    assert loaded.case == warm.case
    assert loaded.solution.lubricant.friction == EyringShear(5e6)
    assert loaded.state == warm.state
