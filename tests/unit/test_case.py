import copy
import math
import pickle
import re
import tomllib
from contextlib import suppress
from decimal import Decimal
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from asperity.case import load_case
from asperity.case import units as amounts
from asperity.core.errors import BadInput, UnreadableFile
from asperity.coupling import VibrationModel
from asperity.ehl import Options
from asperity.lubricant import Barus, DowsonHigginson, Roelands
from asperity.surface import Surface

EXAMPLES = Path(__file__).parents[2] / "examples"


@pytest.fixture(scope="module")
def paper():
    return load_case(EXAMPLES / "paper.toml")


def test_the_papers_table_2_is_converted_to_si(paper):
    conditions, oil = paper.conditions, paper.lubricant
    assert (conditions.geometry, conditions.radius, conditions.length, conditions.load) == (
        "line",
        0.0054,
        0.010,
        500.0,
    )
    assert conditions.pair.effective_modulus == pytest.approx(
        219.78e9, rel=1e-5
    )  # printed in Table 2
    assert conditions.entrainment_speed == pytest.approx(1.91, rel=1e-15)
    assert conditions.slide_to_roll == pytest.approx(0.2, rel=1e-14)
    assert oil.viscosity == Barus(0.096, 18.2e-9)
    assert oil.density == DowsonHigginson(880.0)
    assert paper.vibration == VibrationModel(mass=0.1, damping_ratio=0.02)
    assert paper.options == Options()


def test_grid_limits_are_in_hertz_half_widths(paper):
    a = math.sqrt(8.0 * 5e4 * 0.0054 / (math.pi * 219.78e9))  # physics: a = sqrt(8 w' R/(pi E'))
    assert paper.grid.lower == pytest.approx((-4.5 * a, -1.6 * a), rel=1e-5)
    assert paper.grid.upper == pytest.approx((1.9 * a, 1.6 * a), rel=1e-5)


def test_the_packaged_case_equals_the_example():
    packaged = Path(__file__).parents[2] / "src" / "asperity" / "paper" / "paper.toml"
    assert packaged.read_bytes() == (EXAMPLES / "paper.toml").read_bytes()


def test_a_short_inlet_reports_the_film_deficit(paper):
    """Films in docs/case-file.md for alpha 20 1/GPa: 0.448 um from -1.9, 0.722 um from -4.5."""
    printed = load_case(EXAMPLES / "paper-as-printed.toml")
    assert printed.with_overrides({"grid.x": [-4.5, 1.9], "model": "mixed"}) == paper
    for case, film in ((printed, 0.448), (paper, 0.722)):
        case = case.with_overrides({"lubricant.viscosity.alpha": "20 1/GPa"})
        deficit = float(re.search(r"the film is about ([\d.]+) % too thin", case.notes[0])[1])
        assert deficit == pytest.approx(
            100.0 * (1.0 - film / 0.772), rel=0.25
        )  # 0.772: 0.763 um from -8 is 1.2 % thin
    assert paper.with_overrides({"grid.x": [-12, 3]}).notes == ()


@pytest.mark.parametrize(
    "overrides",
    [
        {},
        {"lubricant": "none"},
        {"material.hardness": "none", "vibration": "none"},
        {"surface": "flat"},
        {"surface": {"file": 'quo"te\\ü/ring.x3p', "sq": "0.8 um", "fit": "tile"}},
        {
            "surface": {
                "kind": "self-affine",
                "sq": "1 um",
                "hurst": 0.8,
                "cutoffs": ["2 um", "80 um"],
            }
        },
        {
            "lubricant.viscosity.law": "roelands",
            "solver.contact_film": "2 nm",
            "solver.tolerance": 1e-6,
        },
        {"study.sq": {"from": "0.5 um", "to": "4 um", "step": "0.1 um"}, "study.seeds": 5},
    ],
)
def test_the_text_of_a_case_loads_to_an_equal_case(paper, overrides):
    case = paper.with_overrides(overrides)
    again = load_case(case.text)
    assert again == case
    assert again.text == case.text
    assert (again.conditions, again.lubricant, again.grid, again.options, again.vibration) == (
        case.conditions,
        case.lubricant,
        case.grid,
        case.options,
        case.vibration,
    )


COPIES = {
    "copy": copy.copy,
    "deepcopy": copy.deepcopy,
    "pickle": lambda value: pickle.loads(pickle.dumps(value)),
}


@pytest.mark.parametrize("method", COPIES)
def test_a_case_and_its_contents_can_be_copied_and_sent_to_another_process(method):
    copied = 0
    for path in sorted(EXAMPLES.glob("*.toml")):
        if "machine" in tomllib.loads(path.read_text("utf-8")):
            continue
        case, copied = load_case(path), copied + 1
        again, contents = COPIES[method](case), COPIES[method](case.contents)
        assert again == case
        assert again.text == case.text
        assert again.folder == case.folder
        assert contents == case.contents
        assert contents.contact.load.text == case.contents.contact.load.text
        assert contents.material is case.contents.material or method != "copy"
    assert copied > 3


@settings(deadline=None)  # the first read imports the parser, which takes 0.25 s on a busy machine
@given(
    st.floats(1e-3, 1e6), st.sampled_from([("mm", 1e-3), ("um", 1e-6), ("m", 1.0), ("nm", 1e-9)])
)
def test_lengths_in_any_unit_are_the_same_length(value, unit):
    text, factor = unit
    case = load_case(EXAMPLES / "paper.toml").with_overrides(
        {"contact.length": f"{value!r} {text}"}
    )
    assert case.conditions.length == pytest.approx(value * factor, rel=1e-15)


def test_overrides_read_toml_and_text_without_its_quotes(paper):
    case = paper.with_overrides(
        {"contact.load": "400 N", "grid.cells": "[64, 32]", "surface.seed": "3"}
    )
    assert case.conditions.load == 400.0
    assert case.grid.cells == (64, 32)
    assert case == paper.with_overrides(
        {"contact.load": '"400 N"', "grid.cells": [64, 32], "surface.seed": 3}
    )


def test_roelands_takes_its_own_reference_pressure(paper):
    case = paper.with_overrides({"lubricant.viscosity.law": "roelands"})
    assert case.lubricant.viscosity == Roelands(0.096, 18.2e-9, 1.96e8)


def test_one_seed_gives_one_surface_at_any_roughness(paper):
    coarse = paper.with_overrides({"grid.cells": [64, 64]})
    rougher = coarse.with_overrides({"surface.sq": "2 um"})
    assert coarse.surface().sq == pytest.approx(1e-6, rel=1e-12)
    np.testing.assert_allclose(
        rougher.surface().heights, 2.0 * coarse.surface().heights, rtol=1e-12
    )
    other = coarse.with_overrides({"surface.seed": 8}).surface()
    assert not np.allclose(other.heights, coarse.surface().heights)


def test_stored_roughness_is_reused_until_surface_or_grid_change(paper):
    small = paper.with_overrides({"grid.cells": [64, 64]})
    stored = Surface(np.full((64, 64), 1e-7), small.grid)
    case = load_case(small.text, stored=stored)
    assert case.with_overrides({"contact.entrainment_speed": "1 m/s"}).surface() is stored
    assert case.with_overrides({"surface.seed": 9}).surface() is not stored
    assert case.with_overrides({"contact.load": "400 N"}).surface().grid.extent < stored.grid.extent


BAD = [
    ("contact.laod", "400 N", "contact.laod is not a known key; did you mean load?"),
    ("contcat.load", "400 N", "contcat is not a known key; did you mean contact?"),
    ("vibration.rate_hz", "50 kHz", "vibration.rate_hz is not a known key; did you mean rate?"),
    ("surface.hurst", "0.8", "surface.hurst is not a known key"),
    ("grid.x", [1, 2, 3], "grid.x must have 2 values at most, got [1, 2, 3]"),
    ("sensing.permittivity", 80.0, "permittivity must be 1 to 5, got 80"),
    ("sensing.resistivity", "-1 ohm m", "sensing.resistivity[0] must be positive and finite"),
    ("sensing.ultrasonic_frequency", "5 m", "must be a frequency such as"),
    (
        "lubricant.viscosity.law",
        "baruss",
        "viscosity.law must be one of barus, roelands, doolittle, yasutomi, "
        'got "baruss"; did you mean "barus"?',
    ),
    ("lubricant.viscosity.p0", "1 MPa", "lubricant.viscosity.p0 is not a known key"),
    ("surface.kind", "gausian", 'did you mean "gaussian"?'),
    ("contact.load", "500 m", 'contact.load must be a force such as "500 N", got "500 m"'),
    ("contact.load", "500 newtons of force", "contact.load must be a force"),
    ("contact.load", "500 n", "units are case-sensitive"),
    ("contact.load", "500", 'must be a force such as "500 N", got the bare number 500'),
    ("contact.load", "0 N", 'contact.load must be positive and finite, got "0 N"'),
    ("contact.load", "nan N", "contact.load must be a force"),
    ("contact.load", "1e400 N", "contact.load must be positive and finite"),
    ("contact.length", "-10 mm", 'contact.length must be positive and finite, got "-10 mm"'),
    ("contact.slip", "nan", "contact.slip"),
    ("contact.slip", True, "contact.slip"),
    ("contact.geometry", "point", "length belongs to a line contact"),
    ("contact.radius", ["5 mm", "9 mm", "2 mm"], "contact.radius must be one length or a pair"),
    ("contact.radius", ["5 mm", "9 mm"], "radius of a line contact is one number"),
    ("contact.geometry", "lien", "contact.geometry"),
    ("material.youngs_modulus", ["200 GPa"], "material.youngs_modulus"),
    ("material.poisson_ratio", 0.7, "Poisson's ratio must lie above -1"),
    ("grid.cells", [3, 3], "at least 8 cells along x, got 3"),
    ("grid.cells", [64.5, 64], "grid.cells[0]"),
    ("grid.cells", 64, "grid.cells must be a list of two such as [256, 128]"),
    ("grid.x", [1.9, -4.5], "upper x beyond its lower one"),
    ("grid.x", [-0.5, 1.9], "x must reach beyond the contact"),
    ("solver.tolerance", 3, "tolerance must lie between 0 and 0.1"),
    ("vibration.damping_ratio", -0.1, "damping ratio"),
    ("vibration.rate", "3000 rpm", "not in hertz"),
    ("lubricant", "water", "lubricant"),
    ("surface.file", "ring.x3p", "both kind and file"),
    ("study", {"sq": {"from": "1 um"}}, "study.sq.to is missing"),
    ("model", "lossy", "model must be"),
]


@pytest.mark.parametrize(("key", "value", "sentence"), BAD)
def test_an_invalid_value_raises_one_sentence(paper, key, value, sentence):
    with pytest.raises(BadInput) as error:
        paper.with_overrides({key: value})
    message = str(error.value)
    assert sentence in message
    assert message.startswith(paper.source)
    assert "\n" not in message


@pytest.mark.parametrize("section", ["contact", "material", "lubricant", "surface"])
def test_a_missing_section_is_named(section):
    text = (
        (EXAMPLES / "paper.toml").read_text("utf-8").replace(f"[{section}]", f"[study.{section}]")
    )
    with pytest.raises(BadInput):
        load_case(text)
    tables = text.split(f"[study.{section}]")
    after = tables[1].split("\n[", 1)
    with pytest.raises(BadInput, match=f"{section} is missing"):
        load_case(tables[0] + "\n[" + after[1])


@settings(deadline=None)  # the first rare unit loads pint's registry
@given(st.text(max_size=12))
def test_any_text_for_a_unit_is_a_force_or_refused(text):
    paper = load_case(EXAMPLES / "paper.toml")
    with suppress(BadInput):
        case = paper.with_overrides({"contact.load": f"1 {text}"})
        assert case.conditions.load > 0.0
        assert load_case(case.text) == case


def test_unreadable_files_are_named(tmp_path):
    (tmp_path / "binary.toml").write_bytes(b"\x89HDF\r\n\x1a\n\xff\xfe")
    (tmp_path / "broken.toml").write_text("[contact\n")
    for name in ("absent.toml", "binary.toml", "broken.toml", "."):
        with pytest.raises(
            UnreadableFile, match=name.replace(".", r"\.") if name != "." else str(tmp_path)
        ):
            load_case(tmp_path / name)


def test_grids_of_point_and_elliptic_contacts_use_their_own_half_widths(paper):
    ball = paper.with_overrides(
        {
            "contact.geometry": "point",
            "contact.length": "none",
            "contact.load": "20 N",
            "grid.y": [-3, 3],
        }
    )
    a = ball.conditions.hertz.half_widths[0]
    assert ball.grid.periodic == (False, False)
    assert ball.grid.extent == pytest.approx((6.4 * a, 6.0 * a))
    barrel = ball.with_overrides(
        {"contact.geometry": "elliptic", "contact.radius": ["5.4 mm", "20 mm"]}
    )
    a, b = barrel.conditions.hertz.half_widths
    assert b > 1.5 * a
    assert barrel.grid.extent == pytest.approx((6.4 * a, 6.0 * b))
    assert load_case(barrel.text) == barrel
    with pytest.raises(BadInput, match="y must reach beyond the contact on both sides"):
        barrel.with_overrides({"grid.y": [-0.9, 0.9]})


@pytest.mark.parametrize("text", amounts._COMMON)
@pytest.mark.parametrize("number", ["1", "5.4", "1e-3", "219.78"])
def test_a_common_unit_converts_as_in_pint(text, number):
    amount = amounts._units().Quantity(Decimal(number), text)
    for unit, expected in (
        (None, amount.to_base_units()),
        (amounts._COMMON[text][0], amount.to(amounts._COMMON[text][0])),
    ):
        assert str(amounts._convert(number, text, unit)) == str(expected.magnitude)


def test_a_common_unit_converts_to_another():
    assert amounts._convert("5", "nm", "um") == Decimal("0.005")
    with pytest.raises(ValueError, match="another quantity"):
        amounts._convert("5", "nm", "s")


def test_numbers_from_python_are_in_si():
    paper = load_case(EXAMPLES / "paper.toml")
    plain = {"grid.cells": [64, 48], "contact.slip": 0.3}
    case = paper.with_overrides(
        {**plain, "contact.load": 400, "surface.sq": 1e-6, "lubricant.viscosity.eta0": 0.05}
    )
    texts = {"contact.load": "400 N", "surface.sq": "1e-06 m"}
    assert case == paper.with_overrides({**plain, **texts, "lubricant.viscosity.eta0": "0.05 Pa s"})
    assert load_case(case.text) == case
    for number in (np.int64(400), np.float32(400.0), 400):
        assert paper.with_overrides({"contact.load": number}).conditions.load == 400.0
    for wrong in (-3.0, 10**400, float("nan")):
        with pytest.raises(BadInput, match="must be"):
            paper.with_overrides({"contact.load": wrong})
    with pytest.raises(BadInput, match="got the bare number 400"):
        paper.with_written({"contact.load": 400})
