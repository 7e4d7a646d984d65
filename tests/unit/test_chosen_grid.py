"""Automatic grid when [grid] is missing or partial, for every kind of surface."""

import math
import re

import numpy as np
import pytest
import x3pio

from asperity.case import load_case
from asperity.core.errors import BadInput
from asperity.surface import area_text, correlation_lengths, length_text
from support.paper import contact

A = contact().hertz.half_widths[0]
CONTACT = """
[contact]
geometry = "line"
radius = "5.4 mm"
length = "10 mm"
load = "500 N"
entrainment_speed = "1.91 m/s"
[material]
youngs_modulus = "200 GPa"
poisson_ratio = 0.3
[lubricant]
viscosity = { law = "barus", eta0 = "0.096 Pa s", alpha = "18.2 1/GPa" }
density = { law = "dowson-higginson", rho0 = "880 kg/m^3" }
rheology = "newtonian"
"""
SURFACES = [
    'kind = "gaussian"\nsq = "1 um"\ncorrelation_length = ["20 um", "60 um"]\ndirection_deg = 30',
    (
        'kind = "non-gaussian"\nsq = "1 um"\nskewness = -0.5\nkurtosis = 4.0\ncorrelation_length ='
        ' "25 um"'
    ),
    'kind = "run-in"\nsq = "1 um"\ncorrelation_length = "25 um"\nplateau_share = 0.5',
    'kind = "self-affine"\nsq = "1 um"\nhurst = 0.8\ncutoffs = ["20 um", "200 um"]',
    (
        'kind = "ground"\nsq = "1 um"\ngroove_width = "20 um"\ngroove_length = "150'
        ' um"\ndirection_deg = 90'
    ),
    'kind = "sandblasted"\nsq = "1 um"\ncrater_radius = "20 um"',
    'kind = "flat"',
]


def case_of(surface, grid=""):
    return load_case(f"{CONTACT}[surface]\n{surface}\n{grid}")


@pytest.mark.parametrize("surface", SURFACES, ids=lambda text: text.split('"')[1])
def test_the_automatic_grid_resolves_every_kind_of_surface(surface):
    case = case_of(surface)
    surface_sample = case.surface()
    assert surface_sample.grid == case.grid
    assert load_case(case.text) == case
    assert load_case(case.text).grid == case.grid
    if surface_sample.sq > 0.0:
        cells = np.divide(correlation_lengths(surface_sample), case.grid.spacing)
        assert cells.min() > 6.0  # the target is 8 for the ensemble; one sample scatters


def test_given_grid_values_are_kept():
    surface = SURFACES[1]
    automatic = case_of(surface).grid
    partial = case_of(surface, "[grid]\nx = [-4.5, 1.9]").grid
    assert (partial.lower[0], partial.upper[0]) == pytest.approx((-4.5 * A, 1.9 * A), rel=1e-5)
    assert (partial.lower[1], partial.upper[1]) == (automatic.lower[1], automatic.upper[1])
    assert partial.spacing[0] == pytest.approx(automatic.spacing[0], rel=0.05)
    given = case_of(surface, "[grid]\ncells = [64, 32]").grid
    assert given.cells == (64, 32)
    assert given.extent == automatic.extent
    fine = case_of(surface, "[grid]\naccuracy = 0.0025").grid
    assert fine.spacing[0] == pytest.approx(automatic.spacing[0] / 2.0, rel=0.05)


@pytest.mark.parametrize(
    ("grid", "message"),
    [
        (
            "cells = [64, 64]\nx = [-4.5, 1.9]\ny = [-1, 1]\naccuracy = 0.01",
            "accuracy determines a grid",
        ),
        ("accuracy = 0.9", "grid.accuracy must be less than or equal to 0.2, got 0.9"),
        ('cells = "fine"', 'grid.cells must be a list of two such as [256, 128], or "auto", got'),
        ("x = [-0.5, 1.9]", "x must reach beyond the contact on both sides"),
    ],
)
def test_invalid_grids_are_refused(grid, message):
    with pytest.raises(BadInput) as error:
        case_of(SURFACES[1], f"[grid]\n{grid}")
    assert message in str(error.value)


def test_a_measured_map_limits_its_grid_and_is_resolved(tmp_path):
    """Hills 16 um wide on a map of 640 x 160 um; the contact needs a longer y than the map has."""
    hills = np.kron(np.random.default_rng(3).standard_normal((40, 10)), np.ones((8, 8)))
    x3pio.write(tmp_path / "ring.x3p", 1e-6 * hills.T, x_scale=2e-6, y_scale=2e-6)
    text = f'{CONTACT}[surface]\nfile = "ring.x3p"\nsq = "0.8 um"\n'
    case = load_case(text, folder=tmp_path)
    assert case.surface().sq == pytest.approx(0.8e-6)
    assert case.grid.extent[0] <= 640e-6
    assert case.grid.extent[1] <= 160.001e-6
    assert case.grid.spacing[0] < 16e-6 / 8.0
    stored = load_case(text, folder=tmp_path / "elsewhere", stored=case.surface())
    assert stored.grid == case.grid  # a stored run does not read the file again


def test_a_smooth_line_contact_uses_the_minimum_number_of_rows():
    case = case_of(SURFACES[-1])
    assert case.grid.cells[1] == 8
    assert not case.surface().heights.any()


FINE = [  # once reduced below the cells that their roughness needs
    'kind = "gaussian"\nsq = "20 nm"\ncorrelation_length = ["12 um", "18 um"]\ndirection_deg = 30',
    'kind = "self-affine"\nsq = "0.02 um"\nhurst = 0.8\ncutoffs = ["14 um", "70 um"]',
    'kind = "ground"\nsq = "0.02 um"\ngroove_width = "14 um"\ngroove_length = "80 um"',
    'kind = "sandblasted"\nsq = "0.02 um"\ncrater_radius = "12 um"',
]


def wide_contact(surface):
    """A contact of 4 by 3 mm, in the oil film of a light, fast ball of aluminium."""
    text = CONTACT.replace("line", "point").replace('length = "10 mm"\n', "")
    text = text.replace("5.4 mm", "56 mm").replace("1.91 m/s", "9 m/s").replace("200 GPa", "70 GPa")
    return text + f"[surface]\n{surface}\n"


@pytest.mark.parametrize("surface", FINE)
def test_the_chosen_grid_represents_its_roughness(tmp_path, surface):
    path = tmp_path / "wide.toml"
    path.write_text(wide_contact(surface))
    case = load_case(path)
    assert np.prod(case.grid.cells) > 150_000
    assert case.surface().sq == pytest.approx(2e-8, rel=1e-6)


@pytest.mark.parametrize("surface", FINE[:3])
def test_the_number_of_cells_in_a_refusal_is_enough(tmp_path, surface):
    path = tmp_path / "wide.toml"
    path.write_text(wide_contact(surface) + "[grid]\ncells = [128, 96]\n")
    with pytest.raises(BadInput, match=r"at least \d+ x \d+ cells") as refusal:
        load_case(path).surface()
    cells = re.search(r"at least (\d+) x (\d+) cells", str(refusal.value)).groups()
    path.write_text(path.read_text().replace("[128, 96]", f"[{cells[0]}, {cells[1]}]"))
    assert load_case(path).surface().sq == pytest.approx(2e-8, rel=1e-6)


def test_roughness_too_fine_for_a_chosen_grid_is_refused_with_a_remedy(tmp_path):
    """The factor and the cells of the message suffice."""

    def case(length, cells=""):
        surface = f'kind = "gaussian"\nsq = "2 nm"\ncorrelation_length = "{length} um"'
        (tmp_path / "wide.toml").write_text(wide_contact(surface) + cells)
        return load_case(tmp_path / "wide.toml")

    message = r"needs (\d+) x (\d+) cells, .* make its shortest length (\d\.\d+) times as long"
    with pytest.raises(BadInput, match=message) as refusal:
        case(2.0)
    nx, ny, factor = re.search(message, str(refusal.value)).groups()
    assert int(nx) * int(ny) > 2_000_000
    assert np.prod(case(2.0 * float(factor)).grid.cells) <= 2_000_000
    assert case(2.0, f"[grid]\ncells = [{nx}, {ny}]\n").grid.cells == (int(nx), int(ny))


def test_notes_on_long_correlation_lengths_hold_no_nan(tmp_path):
    """A sample whose autocorrelation does not decay within the domain has no correlation length."""
    path = tmp_path / "long.toml"
    surface = f'kind = "gaussian"\nsq = "1 um"\ncorrelation_length = "{0.45 * 10 * A} m"\nseed = 0'
    grid = "cells = [48, 48]\nx = [-5.0, 5.0]\ny = [-5.0, 5.0]"
    path.write_text(f"{CONTACT}[surface]\n{surface}\n[grid]\n{grid}\n")
    case = load_case(path)
    assert np.isnan(correlation_lengths(case.surface())).any()
    (note,) = (note for note in case.surface_notes if "correlation lengths" in note)
    assert "x unknown um" in note
    assert not re.search(r"\bnan\b", note)


def test_lengths_that_are_not_finite_are_named_in_words():
    assert length_text(math.nan) == "unknown"
    assert area_text((math.nan, 2e-6)) == "unknown x 2 um"
