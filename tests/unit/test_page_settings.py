"""Controls of cases and their settings: case-file values, links, and rejection of invalid input."""

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
HOSTILE = [  # values in links that must neither be set, run, nor shown as anything but text
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


def test_every_control_is_in_the_catalogue():
    assert {spec.quantity for spec in INPUT_SPECS.values() if not spec.title} <= set(catalogue())


@pytest.mark.parametrize("name", CONTACTS)
def test_a_case_has_the_controls_of_its_own_tables(name):
    case = load_case(EXAMPLES / f"{name}.toml")
    inputs = case_inputs(case)
    assert {"contact.load", "contact.entrainment_speed", "contact.slip", "grid.cells"} <= set(
        inputs
    )
    assert ("lubricant.temperature" in inputs) == (name == "data-sheet-oil")
    assert ("surface.sq" in inputs) == (name != "roller")
    assert ("vibration.mass" in inputs) == (name != "roller")


@pytest.mark.parametrize("name", CONTACTS)
def test_every_slider_position_is_a_valid_value(name):
    case = load_case(EXAMPLES / f"{name}.toml")
    for key, case_input in case_inputs(case).items():
        if case_input.choices:
            continue
        first, last = case_input.positions
        for position in range(first, last + 1):
            assert case_input.position(case_input.value_text(position)) == position, (key, position)
        changed = case.with_overrides(
            overrides(case, {key: case_input.value_text(case_input.position(case_input.text))})
        )
        assert changed.conditions == case.conditions, key


def test_a_slider_spans_a_decade_either_side_of_the_cases_value(settings):
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


def test_changing_one_entry_of_a_pair_keeps_the_other(settings):
    changed = settings.with_value("surface.correlation_length.1", "40 um")
    assert changed.case.contents.surface.correlation_length == (20e-6, 40e-6)


def test_cells_are_accepted_in_usual_notations(settings):
    assert settings.with_value("grid.cells", "96 x 64").case.grid.cells == (96, 64)
    assert settings.with_value("grid.cells", "96 × 64").case.grid.cells == (96, 64)


@pytest.mark.parametrize(
    ("key", "text", "message"),
    [
        (
            "contact.load",
            "800",
            'Normal load, F must be a force such as "500 N", got the bare number 800',
        ),
        ("contact.load", "-5 N", "Normal load, F must be positive and finite"),
        ("surface.sq", "2 mm2", "Composite roughness, Sq must be a length"),
        ("surface.correlation_length.0", "x", "Correlation length along rolling must be a length"),
        (
            "material.boundary_friction",
            "5",
            "Boundary friction coefficient must be less than or equal to 2, got 5",
        ),
        ("grid.cells", "1024 x 1024", "Grid cells must be at most 262144 in all on this page"),
        ("contact.load", "1" * 300, "value of 300 characters"),
    ],
)
def test_an_invalid_value_is_refused_with_the_name_of_its_input(settings, key, text, message):
    refusal = settings.with_value(key, text)
    assert isinstance(refusal, RejectedValue)
    assert refusal.key == key
    assert message in refusal.message


def test_a_link_restores_the_settings(settings):
    changed = settings
    for key, text in {
        "contact.load": "0.8 kN",
        "surface.correlation_length.0": "30 um",
        "contact.slip": "-0.5",
        "surface.seed": "3",
    }.items():
        changed = changed.with_value(key, text)
    restored, notes = settings.from_address(changed.address)
    assert notes == []
    assert restored.changes == changed.changes
    assert restored.case.text == changed.case.text


def test_a_control_set_back_leaves_the_link(settings):
    changed = settings.with_value("contact.load", "800 N").with_value("contact.load", "500 N")
    assert changed.address == ""
    assert changed.case is settings.opened


def test_a_link_of_another_case_is_reported(settings):
    other = Settings(load_case(EXAMPLES / "ball-on-disc.toml")).with_value("contact.load", "20 N")
    restored, notes = settings.from_address(other.address)
    assert restored.case.conditions.load == 20.0
    assert notes == ["The link was made with another case; its changes are applied here."]


def test_a_link_with_a_dropped_surface_needs_that_surface(settings):
    dropped = Settings(settings.opened, dropped="ring.x3p", held="0" * 32)
    _, notes = settings.from_address(dropped.address)
    assert notes == [
        "The link uses the dropped surface ring.x3p, which is no longer stored; drop it again."
    ]
    _, notes = settings.from_address("dropped=x&held=../../../etc")
    assert notes == [
        "The link uses the dropped surface x, which is no longer stored; drop it again."
    ]
    restored, notes = dropped.from_address(dropped.with_value("contact.load", "700 N").address)
    assert notes == []
    assert (restored.dropped, restored.held, restored.changes) == (
        "ring.x3p",
        "0" * 32,
        {"contact.load": "700 N"},
    )
    for text in ("../../etc", "0" * 31, "G" * 32, "%00" * 32, "0" * 33):
        assert surface_key(f"held={text}") == ""


@pytest.mark.parametrize("name", CONTACTS)
def test_every_offered_law_can_be_selected_and_undone(name):
    settings = Settings(load_case(EXAMPLES / f"{name}.toml"))
    chosen = {key: case_input for key, case_input in settings.inputs.items() if case_input.names}
    assert chosen["model"].names == ("mixed", "conserving", "paper")
    for key, case_input in chosen.items():
        assert case_input.text in case_input.choices
        for law in case_input.names:
            changed = settings.with_value(key, law)
            assert isinstance(changed, Settings), (key, law)
            assert reduce(dict.get, key.split("."), tomllib.loads(changed.case.text)) == law
            assert changed.with_value(key, case_input.text).address == ""


def test_a_law_keeps_the_parameters_it_shares(settings):
    changed = settings.with_value("lubricant.viscosity.law", "roelands").with_value(
        "lubricant.viscosity.eta0", "0.2 Pa s"
    )
    assert changed.case.lubricant.viscosity == Roelands(eta0=0.2, alpha=18.2e-9)
    newtonian = settings.with_value("lubricant.friction.law", "newtonian")
    assert (
        "floor"
        not in newtonian.case.text.partition("[lubricant.friction]")[2].partition("[surface]")[0]
    )
    assert (
        "lubricant.rheology.law" not in settings.inputs
    )  # the Ree-Eyring law needs a stress that this case lacks


def test_both_rough_bodies_have_controls():
    second = {
        "kind": "gaussian",
        "sq": "0.4 um",
        "correlation_length": ["30 um", "10 um"],
        "seed": 4,
    }
    settings = Settings(papers_case().with_overrides({"surface.second": second}))
    changed = settings.with_value("surface.second.sq", "0.6 um").with_value(
        "surface.second.correlation_length.1", "20 um"
    )
    assert changed.case.contents.surface.second.sq == 0.6e-6
    assert changed.case.contents.surface.second.correlation_length == (30e-6, 20e-6)
    assert changed.case.contents.surface.sq == settings.case.contents.surface.sq
    assert settings.inputs["surface.second.sq"].title == "Second body: composite roughness, Sq"
    titles = [case_input.title for case_input in settings.inputs.values()]
    assert len(set(titles)) == len(titles)


@pytest.mark.parametrize("query", HOSTILE)
def test_links_set_only_valid_values_of_controls(settings, query):
    restored, notes = settings.from_address(query)
    assert restored.case is settings.opened
    assert len(notes) == 1
    assert len(notes[0]) < 400


def test_a_link_of_any_length_is_read(settings):
    restored, notes = settings.from_address(
        "&".join(f"contact.load={load} N" for load in range(1, 5000))
    )
    assert notes == []
    assert restored.case.conditions.load == 100.0
