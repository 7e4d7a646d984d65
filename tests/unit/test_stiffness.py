"""Tangent stiffness of solved contacts against closed forms."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from asperity.case import load_case
from asperity.contact.conditions import ContactConditions, ElasticPair
from asperity.contact.grid import Grid
from asperity.contact.hertz import point_contact, point_stiffness
from asperity.core.errors import BadInput
from asperity.coupling import VibrationModel, contact_vibration, excitation
from asperity.ehl import Options, solve_contact
from asperity.solution import contact_state, roller_depth, tangent_stiffness
from asperity.surface import Surface, flat_surface

STEEL = ContactConditions(
    pair=ElasticPair((200e9, 200e9), (0.3, 0.3)),
    geometry="line",
    radius=5.4e-3,
    load=500.0,
    surface_speeds=(2.10, 1.72),
    length=10e-3,
)
PAPER = Path(__file__).parents[2] / "examples" / "paper.toml"


@pytest.mark.parametrize("load", [100.0, 500.0])
@pytest.mark.parametrize("depth", [2e-3, 20e-3])
def test_a_smooth_dry_line_contact_has_johnsons_stiffness(load, depth):
    """dδ/dP' of δ = (P'/πE*) (2 ln(2d/a) + 1) by hand: (2/πE*) ln(2d/a)."""
    conditions = replace(STEEL, load=load)
    a = conditions.hertz.half_widths[0]
    smooth = solve_contact(
        conditions, None, flat_surface(Grid((96, 8), (-1.5 * a, -a / 2), (1.5 * a, a / 2)))
    )
    stiffness = tangent_stiffness(smooth, reference_depth=depth)
    compliance = 2.0 * np.log(2.0 * depth / a) / (np.pi * STEEL.pair.reduced_modulus * STEEL.length)
    assert stiffness.total == pytest.approx(1.0 / compliance, rel=5e-3)
    assert stiffness.film == pytest.approx(0.0, abs=1e-3 * stiffness.total)
    assert abs(stiffness.step_change) < 2e-3


@pytest.mark.parametrize("radius", [5.4e-3, (5.4e-3, 10.8e-3), (10.8e-3, 5.4e-3)], ids=str)
def test_a_smooth_dry_point_contact_has_hertzs_stiffness(radius):
    """δ ~ F^(2/3), so S = 1.5 F/δ; for a sphere Eq 3 of the paper."""
    geometry = "elliptic" if isinstance(radius, tuple) else "point"
    conditions = replace(STEEL, geometry=geometry, radius=radius, length=None, load=200.0)
    a, b = conditions.hertz.half_widths
    grid = Grid((64, 64), (-1.5 * a, -1.5 * b), (1.5 * a, 1.5 * b), (False, False))
    stiffness = tangent_stiffness(solve_contact(conditions, None, flat_surface(grid)))
    assert stiffness.total == pytest.approx(1.5 * 200.0 / conditions.hertz.approach, rel=0.01)
    if geometry == "point":
        assert stiffness.total == pytest.approx(
            point_stiffness(200.0, 5.4e-3, STEEL.pair.reduced_modulus), rel=0.01
        )
    assert stiffness.reference_depth is None


@pytest.mark.parametrize("load", [50.0, 200.0])
def test_a_row_of_point_contacts_has_hertzs_stiffness(load):
    """One sphere per period L, as roughness on a line contact: Eq 3 of the paper within 2 %. The
    other spheres of the row and the reference of the line add F (2/L) (γ + ln(d/2L)) / πE* to each
    approach, which vanishes for d = 2L e^-γ: the limit of Σ 1/|r - nL| against the line potential
    -(2/L) ln r.
    """
    radius, modulus = STEEL.radius_along_rolling, STEEL.pair.reduced_modulus
    a = point_contact(load, radius, modulus).half_widths[0]
    period = 6.0 * a
    conditions = replace(STEEL, load=load, length=period)
    half = max(1.3 * a, 1.25 * conditions.hertz.half_widths[0])
    grid = Grid((96, 96), (-half, -period / 2.0), (half, period / 2.0))
    spheres = Surface(np.repeat(-(grid.y**2)[None, :] / (2.0 * radius), 96, axis=0), grid)
    solved = solve_contact(conditions, None, spheres, options=Options(tolerance=1e-5))
    assert solved.pressure.max() == pytest.approx(
        point_contact(load, radius, modulus).p_max, rel=0.01
    )
    stiffness = tangent_stiffness(solved, reference_depth=2.0 * period * np.exp(-np.euler_gamma))
    assert stiffness.total == pytest.approx(point_stiffness(load, radius, modulus), rel=0.01)


def test_a_point_contact_resonates_at_its_tangent_stiffness():
    conditions = replace(STEEL, geometry="point", length=None, load=200.0)
    a = conditions.hertz.half_widths[0]
    solved = solve_contact(
        conditions,
        None,
        flat_surface(Grid((64, 64), (-1.5 * a, -1.5 * a), (1.5 * a, 1.5 * a), (False, False))),
    )
    model = VibrationModel(mass=0.1, damping_ratio=0.02, stiffness_law="tangent")
    vibration = contact_vibration(
        replace(contact_state(solved), sq=1e-6), conditions, model, solution=solved
    )
    assert vibration.full_load_crf_hz == pytest.approx(
        3292.0, abs=1.0
    )  # docs/paper.md: 200 N, E* 109.89 GPa
    assert vibration.resonance.crf_hz == pytest.approx(3292.0, rel=0.005)


@pytest.fixture(scope="module")
def mixed():
    """The paper's contact at Sq 1 um on a small grid."""
    case = load_case(PAPER).with_overrides(
        {"grid.cells": [64, 64], "surface.correlation_length": "30 um"}
    )
    return solve_contact(case.conditions, case.lubricant, case.surface(), options=case.options)


def test_a_mixed_contact_is_softer_than_a_smooth_one_and_its_parts_add_up(mixed):
    stiffness = tangent_stiffness(mixed)
    depth, a = roller_depth(mixed.conditions), mixed.conditions.hertz.half_widths[0]
    smooth = np.pi * mixed.conditions.pair.reduced_modulus * 10e-3 / (2.0 * np.log(2.0 * depth / a))
    assert stiffness.reference_depth == depth
    assert 0.5 * smooth < stiffness.total < smooth
    assert stiffness.asperity > 0.0
    assert stiffness.film > 0.0
    assert stiffness.asperity + stiffness.film == stiffness.total
    assert abs(stiffness.step_change) < 0.05


def test_a_contact_resonates_at_its_own_stiffness_on_its_own_surface(mixed):
    model = VibrationModel(
        mass=0.1,
        damping_ratio=0.02,
        stiffness_law="tangent",
        excitation="surface",
        patch="line",
        rate_hz=200e3,
        duration_s=1.0,
        # the fit assumes white base acceleration, which this surface does not have
        method="peak",
    )
    vibration = contact_vibration(contact_state(mixed), mixed.conditions, model, solution=mixed)
    expected = np.sqrt(tangent_stiffness(mixed).total / 0.1) / (2.0 * np.pi)
    assert vibration.oscillator.natural_frequency_hz == pytest.approx(expected, rel=1e-9)
    assert vibration.resonance.found
    assert vibration.resonance.crf_hz == pytest.approx(expected, rel=0.02)
    track = excitation(contact_state(mixed), mixed.conditions, model, solution=mixed).source
    assert track.speed == pytest.approx(0.2 * 1.91)


def test_invalid_input_is_refused_by_name(mixed):
    with pytest.raises(BadInput, match="load step"):
        tangent_stiffness(mixed, step=0.5)
    with pytest.raises(BadInput, match="half-width"):
        tangent_stiffness(mixed, reference_depth=1e-6)
