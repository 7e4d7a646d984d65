"""Named materials: table, case keys that they determine, and defaults of machines."""

import pytest

from asperity.case import case_template, load_case, load_machine
from asperity.contact.materials import material, materials
from asperity.core.errors import BadInput

LINE = case_template("line")
GEARS = """
[machine]
kind = "spur-gear"
module = "3 mm"
teeth = [17, 51]
profile_shift = [0.35, 0.1]
face_width = "28 mm"
torque = "180 N m"
speed = "1450 rpm"
"""


def case(name, **more):
    return load_case(LINE).with_overrides({"material.name": name, **more})


@pytest.mark.parametrize("name", materials())
def test_every_material_is_possible_and_has_a_source(name):
    body = material(name)
    assert 1e9 < body.youngs_modulus < 1e12
    assert 0.0 < body.poisson_ratio < 0.5
    # indentation hardness of metals, glasses and polymers over E (M. F. Ashby, chart of E and H)
    assert 1e-3 < body.hardness / body.youngs_modulus < 0.1
    assert 1000.0 < body.density < 20000.0
    # volumetric heat capacity of solids: 1 to 4.5 MJ/m^3/K (Dulong and Petit)
    assert 1e6 < body.density * body.heat_capacity < 4.5e6
    assert 0.1 < body.conductivity < 400.0
    assert body.source


@pytest.mark.parametrize(
    ("hrc", "hv", "name"),
    [
        (62, 746, "through-hardened bearing steel"),
        (60, 697, "case-hardened steel"),
        (50, 513, "quenched 45 steel"),
        (31, 310, "quenched and tempered steel"),
    ],
)
def test_hardness_of_steel_is_that_of_its_rockwell_number(hrc, hv, name):
    """ISO 18265, table A.1; 1 HV is 9.807 MPa."""
    assert material(name).hardness == pytest.approx(9.807e6 * hv, rel=0.02)
    assert f"{hrc} HRC" in material(name).source


def test_a_name_determines_elasticity_hardness_and_heat():
    named = case(["BK7 glass", "through-hardened bearing steel"])
    assert named.conditions.pair.youngs_moduli == (82e9, 206e9)
    assert named.conditions.pair.poisson_ratios == (0.206, 0.3)
    assert named.conditions.hardness == 6e9  # of the softer body
    glass, steel = named.thermal.solids
    assert (glass.conductivity, glass.density, glass.heat_capacity) == (1.114, 2510.0, 858.0)
    assert (steel.conductivity, steel.density, steel.heat_capacity) == (46.0, 7830.0, 475.0)


def test_stated_values_go_before_those_of_a_name():
    table = '[material]\nname = "case-hardened steel"\nhardness = "5 GPa"\n'
    thermal = '[thermal]\nconductivity = "30 W/m/K"\n'
    start, rest = LINE.split("[material]")
    text = f"{start}{table}[lubricant]{rest.split('[lubricant]')[1]}\n{thermal}"
    stated = load_case(text)
    assert stated.conditions.hardness == 5e9
    assert stated.conditions.pair.youngs_moduli == (206e9, 206e9)
    assert {solid.conductivity for solid in stated.thermal.solids} == {30.0}
    assert {solid.heat_capacity for solid in stated.thermal.solids} == {460.0}


@pytest.mark.parametrize("more", [{}, {"material.hardness": "none"}])
def test_a_named_case_is_equal_after_writing_and_reading(more):
    written = case("silicon nitride", **more)
    assert load_case(written.text).contents == written.contents
    again = written.with_overrides({"material.name": "tin bronze"})
    assert again.conditions.pair.youngs_moduli == (95e9, 95e9)
    assert again.conditions.hardness == 0.9e9
    assert again.thermal.solids[0].conductivity == 55.0


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("bronze", r'material\.name must be a named material, got "bronze"; did you mean "tin'),
        ("unobtainium", r'got "unobtainium"; known are through-hardened bearing steel, case-'),
        (["PEEK", "PEEK", "PEEK"], "must be one name for both bodies or a list of two"),
    ],
)
def test_an_unknown_name_is_refused(name, message):
    with pytest.raises(BadInput, match=message):
        case(name)


def test_a_machine_without_material_has_hardened_steel_with_a_note(tmp_path):
    (tmp_path / "gears.toml").write_text(GEARS, "utf-8")
    gears = load_machine(tmp_path / "gears.toml")
    assert gears.hardness == 6.8e9
    assumed = "assumed to be case-hardened steel: E 206 GPa, ν 0.3, hardness 6.8 GPa."
    assert sum(assumed in note for note in gears.notes) == 1
    bronze = gears.with_overrides({"material.name": ["case-hardened steel", "tin bronze"]})
    assert (bronze.hardness, bronze.pair.youngs_moduli) == (0.9e9, (206e9, 95e9))
    assert not any("assumed" in note for note in bronze.notes)
    elastic = gears.with_overrides({"material.name": "45 steel", "material.hardness": "none"})
    assert elastic.hardness is None
