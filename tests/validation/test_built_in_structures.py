"""Built-in structures: their data sheets, their modes, and the paper's frequencies."""

import math
from pathlib import Path

import numpy as np
import pytest

from asperity.case import load_case
from asperity.core.errors import BadInput
from asperity.coupling import VibrationModel, dry_full_load, oscillator
from asperity.paper import papers_contact
from asperity.results import contact_spring, observe_contact, solve_case, solve_course
from asperity.structure import (
    coupled_modes,
    load_structure,
    machine_structures,
    structure_of_bodies,
)

EXAMPLE = Path(__file__).parents[2] / "examples" / "paper.toml"
PAPER_HZ = 2921.93, 3811.88  # at Sq 0.54 and 3.49 um, 500 N
TWO = {
    "bodies": {"a": 2.0, "b": 3.0},
    "springs": [
        {"between": ["a", "ground"], "stiffness": 1e6, "damping": 7.0},
        {"between": ["b", {"a": 0.5}], "stiffness": 4e6},
    ],
    "contact": {"a": 1.0, "b": -1.0},
    "sensor": {"b": 1.0},
    "stiffness_damping": 1e-6,
}


def test_bodies_and_springs_become_matrices():
    structure = structure_of_bodies(TWO)
    np.testing.assert_array_equal(structure.mass, np.diag([2.0, 3.0]))
    np.testing.assert_array_equal(structure.stiffness, [[1e6 + 1e6, -2e6], [-2e6, 4e6]])
    np.testing.assert_allclose(structure.damping, [[8.0, -2.0], [-2.0, 4.0]])
    np.testing.assert_array_equal(structure.contact, [1.0, -1.0])
    np.testing.assert_array_equal(structure.sensor, [0.0, 1.0])


@pytest.mark.parametrize(
    ("changed", "message"),
    [
        ({"contact": {"c": 1.0}}, "contact names 'c', not one of the bodies a, b"),
        ({"springs": [{"between": ["a"], "stiffness": 1.0}]}, "spring 1 must be between two"),
        ({"springs": [{"between": ["a", "b"], "rate": 1.0}]}, "unknown key 'rate' in spring 1"),
        ({"springs": 1.0}, "springs must be tables"),
        ({"bodies": {"a": "2 kg"}}, r"bodies\.a must be a number in SI units, got '2 kg'"),
        ({"bodies": [1.0]}, "bodies must be a table of numbers by body"),
    ],
)
def test_unusable_bodies_are_refused_in_one_sentence(changed, message):
    with pytest.raises(BadInput, match=message):
        structure_of_bodies({**TWO, **changed})


def test_gears_by_their_data_sheet():
    """Free teeth turn against each other: the mesh mode of two inertias, shafts neglected."""
    named = load_structure("fzg-gears")
    assert named.name == "an FZG gear pair"
    k = 3.4e8
    mesh = 1.0 / (1.0 / k + 2.0 / 5.6e8)
    pinion, wheel = 1.0 / (1.0 / 0.26 + 1.0 / 1.4), 1.0 / (1.0 / 0.61 + 1.0 / 2.0)
    reduced = pinion * wheel / (pinion + wheel)
    expected = math.sqrt(mesh / reduced) / (2.0 * math.pi)
    mode = max(
        (m for m in coupled_modes(named.structure, k) if m.frequency_hz < 2e4),
        key=lambda m: m.contact_share,
    )
    # the rest of the shares lies in shafts and bearings
    assert mode.frequency_hz == pytest.approx(expected, rel=0.05)
    assert mode.contact_share == pytest.approx(mesh / k, rel=0.1)
    assert all(
        m.contact_share < 0.02 for m in coupled_modes(named.structure, k) if m.frequency_hz < 3e3
    )


@pytest.mark.parametrize("name", machine_structures())
def test_shares_of_the_strain_energy_are_complete(name):
    """Shares of the contact and the springs add up to 1 in every mode."""
    structure = load_structure(name).structure
    k = 3.4e8
    both = k * np.outer(structure.contact, structure.contact)
    for mode in coupled_modes(structure, k):
        assert 0.0 <= mode.contact_share <= 1.0
        assert mode.damping_ratio < 0.5
    trace = np.trace(np.linalg.solve(structure.stiffness + both, both))
    assert trace == pytest.approx(
        sum(
            m.contact_shape**2 * k / (2 * math.pi * m.frequency_hz) ** 2
            for m in coupled_modes(structure, k)
        ),
        rel=1e-6,
    )


def test_the_papers_frequencies_need_a_load_share_on_a_sphere():
    """0.1 kg on a sphere of 5.4 mm: CRF follows the sixth root of the load share."""
    conditions = papers_contact(500.0)
    model = VibrationModel(mass=0.1, damping_ratio=0.02)
    full = oscillator(dry_full_load(conditions, 1e-6), conditions, model).natural_frequency_hz
    shares = [(frequency_hz / full) ** 6 for frequency_hz in PAPER_HZ]
    assert shares == pytest.approx([0.183, 0.901], abs=0.002)


def test_no_single_mass_on_the_solved_contact_gives_both_of_the_papers_frequencies():
    """The stiffness would have to rise by 70 %; film and asperities together change by 1 %."""
    case = load_case(EXAMPLE).with_written(
        {"contact.roughness": "standing", "solver.surfaces": 1, "grid.cells": [128, 128]}
    )
    stiffness = []
    for sq, frequency_hz in zip(("0.54 um", "3.49 um"), PAPER_HZ, strict=True):
        run = solve_case(case.with_written({"surface.sq": sq}), groups=())
        stiffness.append(contact_spring(run)(frequency_hz)[0])
    assert stiffness == pytest.approx([340e6, 337e6], rel=0.02)
    assert abs(stiffness[1] / stiffness[0] - 1.0) < 0.03
    assert (PAPER_HZ[1] / PAPER_HZ[0]) ** 2 == pytest.approx(1.70, abs=0.005)
    masses = [k / (2.0 * math.pi * f) ** 2 for k, f in zip(stiffness, PAPER_HZ, strict=True)]
    assert masses == pytest.approx([1.01, 0.59], abs=0.02)


def test_one_course_serves_for_all_structures_and_is_drawn():
    case = load_case(EXAMPLE).with_overrides({"grid.cells": [64, 64]})
    course = solve_course(case)
    view = observe_contact(course, load_structure("twin-disc"))
    single = observe_contact(case)
    assert view.clr == single.clr
    frequencies_hz = np.array([200.0, view.modes[0].mode.frequency_hz])
    responses = view.response(frequencies_hz)
    assert responses.shape == (3, 2)
    assert (responses[:, 1] > 10.0 * responses[:, 0]).all()
    axes = view.plot()
    assert len(axes.lines) == 3
    assert axes.get_title("left") == "Share of the contact in the modes\nof a twin-disc rig"
    shares = {text.get_text() for text in axes.texts}
    assert f"{100.0 * view.modes[-1].mode.contact_share:.2g} %" in shares


def test_an_unknown_structure_is_refused_with_the_built_in_names():
    names = "fzg-gears, paper-rig, roller-bearing, twin-disc"
    assert ", ".join(machine_structures()) == names
    with pytest.raises(BadInput, match=f"structure 'lathe' is not built in; use {names}"):
        load_structure("lathe")
