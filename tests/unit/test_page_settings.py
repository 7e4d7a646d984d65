"""Knobs of cases and the settings they make: in the case file's words, back from an address,
nothing let through.
"""

import tomllib
from functools import reduce
from pathlib import Path

import pytest

from asperity.app.inputs import INPUT_SPECS, case_inputs, overrides
from asperity.app.settings import RejectedValue, Settings, surface_key
from asperity.case import load_case
from asperity.core.quantities import catalogue
from asperity.lubricant import Roelands
from asperity.paper import papers_case

EXAMPLES = Path(__file__).parents[2] / "examples"
CONTACTS = ("paper", "ball-on-disc", "data-sheet-oil", "roller")
HOSTILE = [  # addresses: none of this may be turned, run, or shown as anything but text
    "surface.file=/etc/passwd",
    "surface=%7Bfile%3D%22/etc/passwd%22%7D",
    "contact.load=%7Bfile%3D%22/etc/passwd%22%7D",
    "contact.load=500%20N%22%0Amodel%3D%22paper",
    "contact.load=__import__('os').system('touch%20pwned')",
    "contact.load=%3Cscript%3Ealert(1)%3C/script%3E",
    "%3Cimg%20src=x%20onerror=alert(1)%3E=1",
    "material.__class__=1",
    "grid.cells=%5B100000,100000%5D",
    f"contact.load={'9' * 5000}%20N",
]


@pytest.fixture(scope="module")
def settings():
    return Settings(papers_case())


def test_every_knob_is_in_the_catalogue():
    assert {turned.quantity for turned in INPUT_SPECS.values() if not turned.title} <= set(
        catalogue()
    )


@pytest.mark.parametrize("name", CONTACTS)
def test_a_case_has_the_knobs_that_its_own_tables_have(name):
    case = load_case(EXAMPLES / f"{name}.toml")
    inputs = case_inputs(case)
    assert {"contact.load", "contact.entrainment_speed", "contact.slip", "grid.cells"} <= set(
        inputs
    )
    assert ("lubricant.temperature" in inputs) == (name == "data-sheet-oil")
    assert ("surface.sq" in inputs) == (name != "roller")
    assert ("vibration.mass" in inputs) == (name != "roller")


@pytest.mark.parametrize("name", CONTACTS)
def test_every_position_of_every_slider_is_a_value_of_its_knob(name):
    case = load_case(EXAMPLES / f"{name}.toml")
    for key, case_input in case_inputs(case).items():
        if case_input.choices:
            continue
        first, last = case_input.positions
        for position in range(first, last + 1):
            assert case_input.position(case_input.value_text(position)) == position, (key, position)
        turned = case.with_overrides(
            overrides(case, {key: case_input.value_text(case_input.position(case_input.text))})
        )
        assert turned.conditions == case.conditions, key


def test_a_slider_goes_a_decade_up_and_down_from_the_cases_own_value(settings):
    load = settings.inputs["contact.load"]
    assert [load.value_text(place) for place in (load.positions[0], 0, load.positions[1])] == [
        "50 N",
        "500 N",
        "5000 N",
    ]
    assert load.position("5 kN") == load.positions[1]
    assert load.position("1 MN") == load.positions[1]
    assert load.position("5 m") is None
    assert load.position("many") is None


def test_one_entry_of_a_pair_is_turned_and_the_other_stays(settings):
    turned = settings.with_value("surface.correlation_length.1", "40 um")
    assert turned.case.contents.surface.correlation_length == (20e-6, 40e-6)


def test_cells_are_typed_as_people_write_them(settings):
    assert settings.with_value("grid.cells", "96 x 64").case.grid.cells == (96, 64)
    assert settings.with_value("grid.cells", "96 × 64").case.grid.cells == (96, 64)


@pytest.mark.parametrize(
    ("key", "text", "says"),
    [
        (
            "contact.load",
            "800",
            'contact.load must be a force such as "500 N", got the bare number 800',
        ),
        ("contact.load", "-5 N", "contact.load must be positive and finite"),
        ("surface.sq", "2 mm2", "surface.sq must be a length"),
        ("surface.correlation_length.0", "x", "surface.correlation_length[0] must be a length"),
        (
            "material.boundary_friction",
            "5",
            "material.boundary_friction must be less than or equal to 2, got 5",
        ),
        ("grid.cells", "1024 x 1024", "grid.cells must be at most 262144 in all on this page"),
        ("contact.load", "1" * 300, "value of 300 characters"),
    ],
)
def test_a_wrong_value_is_refused_in_the_case_files_own_sentence(settings, key, text, says):
    refusal = settings.with_value(key, text)
    assert isinstance(refusal, RejectedValue)
    assert refusal.key == key
    assert says in refusal.message


def test_an_address_brings_the_settings_back(settings):
    turned = settings
    for key, text in {
        "contact.load": "0.8 kN",
        "surface.correlation_length.0": "30 um",
        "contact.slip": "-0.5",
        "surface.seed": "3",
    }.items():
        turned = turned.with_value(key, text)
    back, notes = settings.from_address(turned.address)
    assert notes == []
    assert back.changes == turned.changes
    assert back.case.text == turned.case.text


def test_a_knob_that_is_turned_back_leaves_the_address(settings):
    turned = settings.with_value("contact.load", "800 N").with_value("contact.load", "500 N")
    assert turned.address == ""
    assert turned.case is settings.opened


def test_a_link_of_another_case_says_so(settings):
    other = Settings(load_case(EXAMPLES / "ball-on-disc.toml")).with_value("contact.load", "20 N")
    back, notes = settings.from_address(other.address)
    assert back.case.conditions.load == 20.0
    assert notes == ["The link was made with another case; its changes are applied here."]


def test_a_link_of_a_dropped_surface_is_of_one_that_is_held(settings):
    dropped = Settings(settings.opened, dropped="ring.x3p", held="0" * 32)
    _, notes = settings.from_address(dropped.address)
    assert notes == [
        "The link uses the dropped surface ring.x3p, which is no longer stored; drop it again."
    ]
    _, notes = settings.from_address("dropped=x&held=../../../etc")
    assert notes == [
        "The link uses the dropped surface x, which is no longer stored; drop it again."
    ]
    back, notes = dropped.from_address(dropped.with_value("contact.load", "700 N").address)
    assert notes == []
    assert (back.dropped, back.held, back.changes) == (
        "ring.x3p",
        "0" * 32,
        {"contact.load": "700 N"},
    )
    for text in ("../../etc", "0" * 31, "G" * 32, "%00" * 32, "0" * 33):
        assert surface_key(f"held={text}") == ""


@pytest.mark.parametrize("name", CONTACTS)
def test_every_law_that_is_offered_can_be_had_and_taken_back(name):
    settings = Settings(load_case(EXAMPLES / f"{name}.toml"))
    chosen = {key: case_input for key, case_input in settings.inputs.items() if case_input.names}
    assert chosen["model"].names == ("mixed", "conserving", "paper")
    for key, case_input in chosen.items():
        assert case_input.text in case_input.choices
        for law in case_input.names:
            turned = settings.with_value(key, law)
            assert isinstance(turned, Settings), (key, law)
            assert reduce(dict.get, key.split("."), tomllib.loads(turned.case.text)) == law
            assert turned.with_value(key, case_input.text).address == ""


def test_a_law_takes_the_parameters_along_that_it_knows(settings):
    turned = settings.with_value("lubricant.viscosity.law", "roelands").with_value(
        "lubricant.viscosity.eta0", "0.2 Pa s"
    )
    assert turned.case.lubricant.viscosity == Roelands(eta0=0.2, alpha=18.2e-9)
    newtonian = settings.with_value("lubricant.friction.law", "newtonian")
    assert (
        "floor"
        not in newtonian.case.text.partition("[lubricant.friction]")[2].partition("[surface]")[0]
    )
    assert (
        "lubricant.rheology.law" not in settings.inputs
    )  # Ree and Eyring's needs a stress that this case has not


def test_both_rough_bodies_have_knobs():
    second = {
        "kind": "gaussian",
        "sq": "0.4 um",
        "correlation_length": ["30 um", "10 um"],
        "seed": 4,
    }
    settings = Settings(papers_case().with_overrides({"surface.second": second}))
    turned = settings.with_value("surface.second.sq", "0.6 um").with_value(
        "surface.second.correlation_length.1", "20 um"
    )
    assert turned.case.contents.surface.second.sq == 0.6e-6
    assert turned.case.contents.surface.second.correlation_length == (30e-6, 20e-6)
    assert turned.case.contents.surface.sq == settings.case.contents.surface.sq
    assert settings.inputs["surface.second.sq"].title == "Second body: composite roughness, Sq"
    titles = [case_input.title for case_input in settings.inputs.values()]
    assert len(set(titles)) == len(titles)


@pytest.mark.parametrize("query", HOSTILE)
def test_nothing_but_values_of_knobs_comes_in_by_an_address(settings, query):
    back, notes = settings.from_address(query)
    assert back.case is settings.opened
    assert len(notes) == 1
    assert len(notes[0]) < 400


def test_an_address_may_be_as_long_as_anybody_likes(settings):
    back, notes = settings.from_address(
        "&".join(f"contact.load={load} N" for load in range(1, 5000))
    )
    assert notes == []
    assert back.case.conditions.load == 100.0
