from dataclasses import dataclass, fields
from importlib.resources import files
from typing import Annotated

import pytest

from asperity.core.quantities import (
    NO_VALUE,
    Parameter,
    catalogue,
    parameters,
    quantity,
    select,
    with_deviation,
)
from asperity.surface import ProfileParameters, SurfaceParameters

SCALED = (
    "F",
    "ohm",
    "1",
    "m",
    "m/s",
    "N m",
    "m3",
    "Pa",
    "s",
    "Hz",
    "J",
    "N m-1",
    "m-1",
    "m s-1",
    "m2 s-1",
    "Pa s",
    "Pa-1",
    "rad",
)  # quantities displayed in other units


def test_a_key_is_defined_once():
    keys = [
        line.split(",")[0]
        for line in files("asperity.core")
        .joinpath("quantities.csv")
        .read_text("utf-8")
        .splitlines()
    ]
    assert len(keys) == len(set(keys))


def test_every_line_is_complete():
    for key, entry in catalogue().items():
        assert entry.name
        assert entry.unit, key
        assert entry.deviation == "" or entry.deviation in catalogue(), key
        assert entry.factor == 1.0 or entry.unit in SCALED, key


@pytest.mark.parametrize(
    ("value", "deviation", "form", "text"),
    [
        (84.04, 2.4, ".1f", "84.0 ± 2.4"),
        (84.04, 12.4, ".1f", "84 ± 12"),
        (84.04, 0.01, ".1f", "84.0"),
        (84.04, None, ".1f", "84.0"),
        (-0.25, None, ".2f", "−0.25"),
        (3724.54, 2.04, ".1f", "3724.5 ± 2.0"),
        (0.000013, None, ".1e", "1.3×10⁻⁵"),
        (0.0, None, ".1e", "0.0"),
        (0.0003172, 0.00002114, ".4g", "(3.17 ± 0.21)×10⁻⁴"),
        (0.02361, 0.00113, ".4g", "0.0236 ± 0.0011"),
        (12.0, float("nan"), ".4g", "12"),
    ],
)
def test_a_value_is_rounded_to_its_deviation(value, deviation, form, text):
    assert with_deviation(value, deviation, form) == text


def test_a_stored_number_is_shown_in_its_display_unit():
    assert quantity("clr").text(0.8404, 0.024) == "84.0 ± 2.4 %"
    assert quantity("h_min_m").text_in({"h_min_m": 1.5e-7, "h_min_error_m": None}) == "0.150 µm"
    assert quantity("p_max_pa").number(2e9) == "2.000"
    assert quantity("converged").text(False) == "NO"
    assert quantity("crf_hz").text(None) == NO_VALUE
    assert quantity("iterations").text(31) == "31"


def test_intervals_stay_within_physical_bounds():
    assert quantity("car").text_in({"car": 0.002, "car_error": 0.069}) == "0.2 % (0.0 to 7.1 %)"
    assert quantity("car").text_in({"car": 0.97, "car_error": 0.05}) == "97.0 % (92.0 to 100.0 %)"
    assert quantity("car").text_in({"car": 0.2, "car_error": 0.069}) == "20.0 ± 6.9 %"
    film = quantity("h_central_m").text_in({"h_central_m": 1e-8, "h_central_error_m": 4e-8})
    assert film == "0.010 µm (0.000 to 0.050 µm)"
    assert (
        quantity("car_domain").clipped_interval(1.2, 0.05) is None
    )  # relative to the Hertz area; real contact may extend beyond it
    assert quantity("crfa").number(1.0, 2.0) == "1.0 ± 2.0"  # scatter only, not a share


def test_a_presets_resonance_is_an_alias_of_the_plain_key():
    assert quantity("crf_sound_hz").label == "CRF, sound [Hz]"
    assert quantity("crf_sound_hz").deviation == "crf_std_sound_hz"
    with pytest.raises(KeyError, match="catalogue of quantities"):
        quantity("clrr")


def test_short_tables_omit_details_and_deviations():
    keys = [entry.key for entry in select("load")]
    assert {"clr", "car", "car_domain"} <= set(keys)
    assert "clr_error" not in keys
    assert "load_at_floor" in [entry.key for entry in select("sharing", detail=True)]


def test_a_laws_parameters_state_unit_and_symbol():
    @dataclass
    class Law:
        eta0: Annotated[float, Parameter("Pa s", "η₀")]
        z: float

    assert dict(parameters(Law)) == {"eta0": Parameter("Pa s", "η₀"), "z": Parameter()}


def test_every_parameter_of_a_surface_is_in_the_catalogue():
    for kind, group in ((SurfaceParameters, "surface"), (ProfileParameters, "profile")):
        names = {entry.name.rstrip("_") for entry in fields(kind)} - {
            "sq"
        }  # including the Sq of the contact
        keys = {entry.key.removesuffix("_m") for entry in select(group, detail=True)} - {
            "pixel",
            "size",
        }
        assert names == keys
