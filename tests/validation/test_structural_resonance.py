"""Mode of a structure that follows the contact: closed forms, recordings through it, refusals."""

import json
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from asperity.case import load_case
from asperity.core.errors import BadInput
from asperity.coupling import VibrationModel, search_band, structural_resonance
from asperity.inference import Observation, ObservedSeries, infer_series, inference_setting
from asperity.inference.structure_input import on_single_mass
from asperity.monitoring import TrackSettings, read_table, track_recordings
from asperity.monitoring.target import search_target
from asperity.paper import Disturbance, RigSettings, papers_contact, simulate_rig, write_rig
from asperity.results import load_run, solve_case
from asperity.structure import (
    NamedStructure,
    Receptances,
    Structure,
    contact_mode,
    coupled_modes,
    load_structure,
    sensor_response,
)
from support.emulated import formula_emulator, formula_setting

EXAMPLE = Path(__file__).parents[2] / "examples" / "paper.toml"
# on a stiff support, so that the contact has 2 % of the strain energy
STIFF = """
name = "a stiff arm"
mass = [[20.0]]
stiffness = [[2e10]]
damping = [[9000.0]]
contact = [1.0]
sensor = [1.0]
"""

HOLDER = STIFF.replace("20.0", "2.0").replace("2e10", "2e8").replace("9000.0", "200.0")


def line_contact(folder, structure=None):
    """Load the paper's contact, standing and on a small grid, from a file in a folder."""
    changed = {
        "grid.cells": [64, 48],
        "contact.roughness": "standing",
        "vibration.stiffness_law": "hertz-line",
    }
    named = "" if structure is None else f'structure = "{structure}"\n'
    text = load_case(EXAMPLE).with_written(changed).text
    (folder / "case.toml").write_text(named + text, "utf-8")
    return load_case(folder / "case.toml")


def test_a_mass_on_a_support_and_the_contact():
    """ω² = (K + k)/m, share k/(K + k), damping (C + c)/(2 m ω)."""
    structure = Structure(
        mass=[[0.5]], stiffness=[[8e7]], damping=[[40.0]], contact=[1.0], sensor=[1.0]
    )
    mode = contact_mode(structure, 1e6, 2e8)
    for k in (1e6, 3.7e6, 5e7, 1.9e8):
        angular = math.sqrt((8e7 + k) / 0.5)
        assert np.exp(mode.log_frequency(math.log(k))) == pytest.approx(
            angular / (2.0 * math.pi), rel=1e-6
        )
        assert mode.log_slope(math.log(k)) == pytest.approx(0.5 * k / (8e7 + k), rel=2e-3)
        expected = (40.0 + 25.0) / (2.0 * 0.5 * angular)
        assert mode.total_damping(math.log(k), 25.0) == pytest.approx(expected, rel=1e-4)
        assert mode.stiffness_at(angular / (2.0 * math.pi)) == pytest.approx(k, rel=2e-3)


def test_the_mode_of_receptances_is_that_of_their_structure():
    structure = Structure(
        mass=np.diag([0.5, 3.0]),
        stiffness=[[8e7, -6e7], [-6e7, 3e8]],
        damping=np.diag([40.0, 90.0]),
        contact=[1.0, -0.3],
        sensor=[0.0, 1.0],
    )
    frequencies_hz = np.arange(100.0, 6000.0)
    angular = 2.0 * np.pi * frequencies_hz[:, None, None]
    flexible = np.linalg.inv(
        structure.stiffness + 1j * angular * structure.damping - angular**2 * structure.mass
    )
    measured = Receptances(
        frequencies_hz=frequencies_hz,
        approach=structure.contact @ flexible @ structure.contact,
        transfer=structure.sensor @ flexible @ structure.contact,
    )
    expected, found = (contact_mode(entry, 1e7, 3e8) for entry in (structure, measured))
    np.testing.assert_allclose(found.frequency_hz, expected.frequency_hz, rtol=1e-4)
    np.testing.assert_allclose(found.damping_ratio, expected.damping_ratio, rtol=0.02)


def test_the_mode_with_the_largest_share_is_followed():
    """A light roller on its contact beside a heavy frame."""
    structure = Structure(
        mass=np.diag([0.2, 30.0]),
        stiffness=np.diag([1e5, 4e8]),
        damping=np.zeros((2, 2)),
        contact=[1.0, -1.0],
        sensor=[1.0, 0.0],
    )
    mode = contact_mode(structure, 1e8, 3e8)
    upper = [coupled_modes(structure, k)[1].frequency_hz for k in (1e8, 3e8)]
    assert mode.frequency_hz[[0, -1]] == pytest.approx(upper, rel=1e-9)
    with pytest.raises(BadInput, match="no mode from 50 to 20000 Hz that can be followed"):
        contact_mode(Structure.single_mass(1e6), 1e5, 1e6)


def test_a_single_mass_in_a_structure_is_the_vibration_model():
    conditions = papers_contact(500.0)
    model = VibrationModel(mass=0.1, damping_ratio=0.02)
    named = NamedStructure(name="a mass", structure=Structure.single_mass(0.1))
    resonance = structural_resonance(named, conditions, model)
    assert resonance.band_hz == pytest.approx(search_band(conditions, model), rel=1e-6)
    assert resonance.contact_share == pytest.approx(1.0, rel=1e-6)
    assert resonance.damping_ratio == pytest.approx(0.02, rel=1e-6)
    assert resonance.on_single_mass(3000.0) == pytest.approx(3000.0, rel=1e-6)
    assert resonance.single_mass_slope(3000.0) == pytest.approx(1.0, rel=1e-6)
    full = resonance.full_load_hz
    assert resonance.load_share(0.8 * full) == pytest.approx(0.8**6, rel=1e-3)


@pytest.mark.parametrize("name", ["twin-disc", "fzg-gears"])
def test_the_damping_of_the_followed_mode_is_that_of_the_coupled_mode(name):
    """Whatever the sign of its eigenvectors at neighbouring stiffnesses."""
    structure = load_structure(name).structure
    mode = contact_mode(structure, 3e7, 5e8)
    for k in np.geomspace(4e7, 4.5e8, 23):
        frequency_hz = float(np.exp(mode.log_frequency(np.log(k))))
        exact = min(
            coupled_modes(structure, float(k), 300.0),
            key=lambda m: abs(m.frequency_hz - frequency_hz),
        )
        assert frequency_hz == pytest.approx(exact.frequency_hz, rel=1e-5)
        assert mode.total_damping(np.log(k), 300.0) == pytest.approx(exact.damping_ratio, rel=0.01)


def test_a_line_contact_on_the_spring_of_a_sphere_is_refused_in_a_structure():
    named = load_structure("twin-disc")
    case = load_case(EXAMPLE)
    with pytest.raises(BadInput, match="'hertz-point' is that of a sphere, far softer than this"):
        structural_resonance(named, case.conditions, case.vibration)


def rig(tmp_path, structure, **settings):
    case = line_contact(tmp_path, structure)
    return case, simulate_rig(
        RigSettings(samples=4, repeats=2, duration_s=5.0, rate_hz=30e3, **settings),
        disturbance=Disturbance(modes=0, snr_db=25.0),
        case=case,
    )


def test_recordings_through_a_structure_show_its_modes(tmp_path):
    """The record's density is |x_s/w|² ω⁴ times the excitation; its mode is found again."""
    (tmp_path / "holder.toml").write_text(HOLDER, "utf-8")
    case, simulated = rig(tmp_path, "holder.toml")
    first = simulated.recordings[0]
    structure, model = case.structure.structure, case.vibration
    resonance = structural_resonance(case.structure, case.conditions, model)
    assert resonance.band_hz == simulated.band_hz
    rings = np.array([entry.crf_hz for entry in simulated.recordings]).reshape(4, 2)
    assert 3.0 < np.sqrt(np.mean(np.diff(rings, axis=1) ** 2) / 2.0) < 45.0  # 15 Hz stated
    k = float(resonance.mode.stiffness_at(first.crf_hz))
    frequencies_hz = np.array([0.9, 1.0, 1.1]) * first.crf_hz
    spring = math.sqrt(k * 0.1) * 2.0 * 0.02
    shape = np.abs(sensor_response(structure, k, spring, frequencies_hz)) ** 2
    ratio = np.interp(frequencies_hz, first.frequency_hz, first.contact_density) / shape
    assert ratio / ratio[1] == pytest.approx([1.0, 1.0, 1.0], rel=0.02)  # excitation f^-4 times f^4
    paths = write_rig(simulated, tmp_path / "rig")
    track = track_recordings(
        paths, TrackSettings(), case=case, table=read_table(tmp_path / "rig" / "table.csv")
    )
    for recording, true in zip(track.recordings, simulated.recordings, strict=True):
        error = recording.resonance.crf_hz - true.crf_hz
        assert abs(error) < 4.0 * recording.resonance.crf_std
        # the structure's frequencies are known to 5 %: nearly nothing of the load share
        low, high = recording.clr_interval
        assert low <= true.clr <= high
        assert high - low > 0.5


def test_a_mode_with_little_of_the_contact_gives_no_stage(tmp_path):
    (tmp_path / "stiff.toml").write_text(STIFF, "utf-8")
    case, simulated = rig(tmp_path, "stiff.toml")
    resonance = structural_resonance(case.structure, case.conditions, case.vibration)
    assert resonance.contact_share == pytest.approx(0.014, abs=0.003)
    paths = write_rig(simulated, tmp_path / "rig")
    track = track_recordings(
        paths, TrackSettings(), case=case, table=read_table(tmp_path / "rig" / "table.csv")
    )
    assert track.stages is None
    assert all(math.isnan(recording.clr) for recording in track.recordings)
    note = "No wear stage is determined: the contact has 1."
    assert any(entry.startswith(note) for entry in track.notes)


def test_the_load_share_on_the_spring_of_a_line_contact_is_by_its_own_law(tmp_path):
    """Without a structure: the ends of the search band are CLR 0.01 and 1, 5 % wider."""
    case = line_contact(tmp_path)
    target = search_target(case)
    low, high = target.band_hz[0] / 0.95, target.band_hz[1] / 1.05
    share = target.load_share(np.array([low, high, np.nan]), np.array([0.1, 0.1, 0.0]))
    assert share.clr == pytest.approx([0.01, 1.0, np.nan], rel=0.02, nan_ok=True)
    assert share.interval[0][1] < 1.0


def test_a_relative_structure_follows_the_case_into_other_folders(tmp_path):
    (tmp_path / "holder.toml").write_text(HOLDER, "utf-8")
    case, simulated = rig(tmp_path, "holder.toml")
    write_rig(simulated, tmp_path / "rig")
    assert load_case(tmp_path / "rig" / "rig.toml").structure.name == "a stiff arm"
    (tmp_path / "runs").mkdir()
    smooth = case.with_written({"surface": "flat", "vibration": "none"})
    saved = solve_case(smooth, groups=()).save(tmp_path / "runs" / "run.nc")
    assert load_run(saved).case.contents.structure == "holder.toml"


def test_the_mass_of_the_inference_is_as_uncertain_as_the_structure(inference_case):
    """An error of the mode's frequency is one of the mass's over the share, twice."""
    setting = with_structure(formula_setting(), inference_case, "holder.toml")
    found = inference_setting(setting.case)
    case = setting.case
    resonance = structural_resonance(case.structure, case.conditions, case.vibration)
    (mass,) = (unknown for unknown in found.unknowns if unknown.key == "mass_kg")
    assert mass.std / mass.mean == pytest.approx(2.0 * 0.05 / resonance.contact_share, rel=1e-6)
    assert mass.std / mass.mean > 0.1


@pytest.fixture(scope="module")
def inference_case(tmp_path_factory):
    folder = tmp_path_factory.mktemp("structure")
    (folder / "holder.toml").write_text(HOLDER, "utf-8")
    (folder / "stiff.toml").write_text(STIFF, "utf-8")
    return folder


def with_structure(setting, folder, name):
    line = {"structure": name, "vibration.stiffness_law": "hertz-line"}
    case = replace(setting.case, folder=folder).with_written(line)
    return replace(setting, case=case)


def test_a_resonance_in_a_structure_is_that_of_the_mass_on_the_contact(inference_case):
    """One mass on a support: k = (2πf)² m - K, ζ of 0.1 kg on k from c = (2 ζ m ω - C)."""
    setting = with_structure(formula_setting(), inference_case, "holder.toml")
    f, zeta = 2400.0, 0.012
    measured = Observation(
        load_n=500.0,
        entrainment_m_s=2.0,
        crf_hz=f,
        crf_std_hz=2.0,
        damping_ratio=zeta,
        damping_std=0.001,
        name="a.h5",
    )
    (found,) = on_single_mass(setting, ObservedSeries(observations=(measured,))).observations
    mass = setting.case.vibration.mass
    angular = 2.0 * math.pi * f
    k, c = angular**2 * 2.0 - 2e8, 2.0 * zeta * angular * 2.0 - 200.0
    assert found.crf_hz == pytest.approx(math.sqrt(k / mass) / (2.0 * math.pi), rel=1e-4)
    slope = 2.0 * angular**2 / k * found.crf_hz / f
    assert found.crf_std_hz == pytest.approx(2.0 * slope, rel=0.01)
    assert found.damping_ratio == pytest.approx(c / (2.0 * math.sqrt(k * mass)), rel=0.01)
    assert math.isnan(found.crfa)


def test_the_inference_refuses_a_mode_with_little_of_the_contact(inference_case):
    plain = formula_setting()
    setting = with_structure(plain, inference_case, "stiff.toml")
    measured = Observation(
        load_n=500.0, entrainment_m_s=2.0, crf_hz=7200.0, crf_std_hz=2.0, name="a.h5"
    )
    found = infer_series(setting, formula_emulator(plain), ObservedSeries(observations=(measured,)))
    assert not found.identifiable
    ((name, reason),) = found.excluded
    assert name == "a.h5"
    assert reason.startswith("the contact has")
    assert reason.endswith("% of the strain energy of its mode, less than 5 %")
    assert json.loads(json.dumps(found.scalars()))["observations"] == 0
    holder = with_structure(plain, inference_case, "holder.toml")
    series = on_single_mass(holder, ObservedSeries(observations=(measured,)))
    assert "no stiffness of the contact gives 7200 Hz" in series.excluded[0][1]


def test_a_case_names_its_structure(tmp_path):
    assert line_contact(tmp_path, "paper-rig").structure.name == "the paper's rig"
    assert load_case(EXAMPLE).structure is None
    with pytest.raises(BadInput, match="structure 'paper-ring' is not built in; use fzg-gears"):
        line_contact(tmp_path, "paper-ring")
