"""[grid] of a case left out, whole or in part: what is chosen then, for every kind of surface, and
what is kept.
"""

import numpy as np
import pytest
import x3pio

from asperity.case import load_case
from asperity.core.errors import BadInput
from asperity.surface import correlation_lengths
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
def test_every_kind_of_surface_can_be_made_on_the_grid_that_is_chosen_and_is_resolved(surface):
    case = case_of(surface)
    made = case.surface()
    assert made.grid == case.grid
    assert load_case(case.text) == case
    assert load_case(case.text).grid == case.grid
    if made.sq > 0.0:
        cells = np.divide(correlation_lengths(made), case.grid.spacing)
        assert cells.min() > 6.0  # 8 are asked for, of the kind; one sample's length scatters


def test_what_is_given_is_obeyed():
    surface = SURFACES[1]
    whole = case_of(surface).grid
    some = case_of(surface, "[grid]\nx = [-4.5, 1.9]").grid
    assert (some.lower[0], some.upper[0]) == pytest.approx((-4.5 * A, 1.9 * A), rel=1e-5)
    assert (some.lower[1], some.upper[1]) == (whole.lower[1], whole.upper[1])
    assert some.spacing[0] == pytest.approx(whole.spacing[0], rel=0.05)
    given = case_of(surface, "[grid]\ncells = [64, 32]").grid
    assert given.cells == (64, 32)
    assert given.extent == whole.extent
    fine = case_of(surface, "[grid]\naccuracy = 0.0025").grid
    assert fine.spacing[0] == pytest.approx(whole.spacing[0] / 2.0, rel=0.05)


@pytest.mark.parametrize(
    ("grid", "said"),
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
def test_what_cannot_be_meant_is_refused(grid, said):
    with pytest.raises(BadInput) as refused:
        case_of(SURFACES[1], f"[grid]\n{grid}")
    assert said in str(refused.value)


def test_a_measured_map_limits_its_grid_and_is_resolved(tmp_path):
    """A map of 640 x 160 um whose hills are 16 um wide: the contact would ask for more of y than
    there is.
    """
    hills = np.kron(np.random.default_rng(3).standard_normal((40, 10)), np.ones((8, 8)))
    x3pio.write(tmp_path / "ring.x3p", 1e-6 * hills.T, x_scale=2e-6, y_scale=2e-6)
    text = f'{CONTACT}[surface]\nfile = "ring.x3p"\nsq = "0.8 um"\n'
    case = load_case(text, folder=tmp_path)
    assert case.surface().sq == pytest.approx(0.8e-6)
    assert case.grid.extent[0] <= 640e-6
    assert case.grid.extent[1] <= 160.001e-6
    assert case.grid.spacing[0] < 16e-6 / 8.0
    stored = load_case(text, folder=tmp_path / "elsewhere", stored=case.surface())
    assert stored.grid == case.grid  # of a run: the file is not asked for again


def test_a_flat_line_is_solved_on_as_few_lines_as_a_grid_has():
    case = case_of(SURFACES[-1])
    assert case.grid.cells[1] == 8
    assert not case.surface().heights.any()
