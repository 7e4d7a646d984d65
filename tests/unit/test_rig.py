import csv
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from asperity.case import load_case
from asperity.core.errors import BadInput
from asperity.core.signals import power_spectrum
from asperity.coupling import VibrationModel
from asperity.ehl import solve_contact
from asperity.paper import (
    SAMPLES_SQ_UM,
    Disturbance,
    RigRecording,
    RigSettings,
    Tones,
    simulate_rig,
    write_rig,
)
from asperity.resonance import contact_resonance, remove_lines
from asperity.solution import dynamic_stiffness
from asperity.vibration import FilteredNoise, acceleration

SMALL = {"samples": 2, "repeats": 1, "duration_s": 20.0}


def powers(recording: RigRecording, band):
    """Mean squares within the band, of the contact line and of the rest."""
    in_band = (recording.frequency_hz >= band[0]) & (recording.frequency_hz <= band[1])
    tonal = (recording.tones.frequency_hz >= band[0]) & (recording.tones.frequency_hz <= band[1])
    step = recording.frequency_hz[1]
    other = (
        np.sum(recording.other_density[in_band]) * step
        + np.sum(recording.tones.amplitude[tonal] ** 2) / 2
    )
    return np.sum(recording.contact_density[in_band]) * step, other


def test_the_rig_reproduces_the_papers_samples():
    rig = simulate_rig(RigSettings(repeat_std_hz=0.0, duration_s=1.0))
    assert len(rig.recordings) == 60
    assert [recording.sq_m * 1e6 for recording in rig.recordings[::5]] == pytest.approx(
        SAMPLES_SQ_UM
    )
    assert rig.full_load_crf_hz == pytest.approx(3879.0, abs=1.0)
    for recording in rig.recordings:
        knee = np.interp(recording.true_sq_m * 1e6, [0.54, 1.8, 3.49], [2921.93, 3640.0, 3811.88])
        if 0.54 < recording.true_sq_m * 1e6 < 3.49:
            assert recording.crf_hz == pytest.approx(knee, abs=0.01)
        assert recording.clr == pytest.approx(
            (recording.crf_hz / rig.full_load_crf_hz) ** 6, rel=1e-9
        )


def test_measured_roughness_has_the_stated_error():
    normalised_errors = [
        (recording.true_sq_m - recording.sq_m) / recording.sq_std_m
        for seed in range(20)
        for recording in simulate_rig(RigSettings(repeats=1, duration_s=0.1, seed=seed)).recordings
    ]
    assert np.std(normalised_errors) == pytest.approx(1.0, abs=0.12)


@pytest.mark.parametrize("snr_db", [20.0, 0.0])
def test_the_signal_to_noise_ratio_is_as_requested(snr_db):
    rig = simulate_rig(RigSettings(duration_s=1.0), disturbance=Disturbance(snr_db=snr_db))
    ratios_db = []
    for recording in rig.recordings:
        contact, other = powers(recording, rig.band_hz)
        ratios_db.append(10 * np.log10(contact / other))
        assert recording.snr_db == pytest.approx(ratios_db[-1], abs=0.01)
    assert np.mean(ratios_db) == pytest.approx(snr_db, abs=0.6)
    assert np.std(ratios_db) == pytest.approx(1.0, abs=0.3)


def test_the_contact_line_equals_the_oscillators_response():
    """Reference: the finely sampled profile through the exact response in time."""
    recording = simulate_rig(RigSettings(**SMALL)).recordings[0]
    model = VibrationModel(mass=0.1, damping_ratio=0.02)
    spring = replace(_spring(recording.crf_hz), damping_ratio=recording.damping_ratio)
    profile = FilteredNoise(
        height=recording.true_sq_m, cutoff_hz=model.excitation.cutoff_reference_hz
    ).profile(4_000_000, 100e3, 3)
    measured = power_spectrum(acceleration(spring, profile), segment=20_000)
    in_band = (measured.frequency_hz > 2500) & (measured.frequency_hz < 3700)
    ratio = measured.density[in_band] / np.interp(
        measured.frequency_hz[in_band], recording.frequency_hz, recording.contact_density
    )
    # linear interpolation between samples loses 1.5 % at 100 kHz, the accelerometer adds 1 %; the
    # rest is random
    assert np.mean(ratio) == pytest.approx(0.98, abs=0.02)
    assert np.std(ratio) < 0.2


def _spring(f0):
    from asperity.vibration import ContactOscillator

    return ContactOscillator(mass=0.1, stiffness=0.1 * (2 * np.pi * f0) ** 2, damping_ratio=0.02)


def test_a_drawn_spectrum_scatters_like_spectra_of_records():
    recording = simulate_rig(
        RigSettings(samples=1, repeats=1, duration_s=40.0), disturbance=Disturbance(modes=0)
    ).recordings[0]
    recording = replace(
        recording, tones=Tones(np.array([2718.3]), np.array([0.02 * np.sqrt(recording.crfa)]))
    )
    expected = np.interp(
        np.arange(0, 10e3, 0.5),
        recording.frequency_hz,
        recording.contact_density + recording.other_density,
    )
    scatters = {}
    for kind in ("drawn", "record"):
        ratios = []
        for seed in range(6):
            sample = replace(recording, seed=seed)
            spectrum = (
                sample.spectrum(40_000)
                if kind == "drawn"
                else power_spectrum(sample.signal(), segment=40_000)
            )
            ratios.append(spectrum.density[200:-400] / expected[200 : spectrum.density.size - 400])
        clean = np.delete(np.array(ratios), np.arange(5230, 5245), axis=1)
        at_tone = np.array(ratios)[:, 5230:5245]
        flat = clean - np.mean(clean)
        scatters[kind] = (
            np.mean(clean),
            np.std(clean),
            np.mean(flat[:, 1:] * flat[:, :-1]) / np.var(clean),
            np.mean(flat**3) / np.std(clean) ** 3,
            np.mean(np.sum(at_tone, axis=1)),
        )
        assert spectrum.averages == pytest.approx(
            power_spectrum(recording.signal(), segment=40_000).averages
        )
    assert scatters["drawn"][0] == pytest.approx(1.0, abs=0.01)
    assert scatters["record"][0] == pytest.approx(1.0, abs=0.01)
    assert scatters["drawn"][1] == pytest.approx(scatters["record"][1], rel=0.03)
    assert scatters["drawn"][2] == pytest.approx(scatters["record"][2], abs=0.03)
    assert scatters["drawn"][3] == pytest.approx(scatters["record"][3], rel=0.2)
    assert scatters["drawn"][4] == pytest.approx(scatters["record"][4], rel=0.1)


def test_a_quiet_recording_returns_its_true_values():
    rig = simulate_rig(RigSettings(**SMALL), disturbance=Disturbance(snr_db=40.0))
    for recording in rig.recordings:
        clean = remove_lines(
            power_spectrum(recording.signal(), segment=40_000), shaft_hz=rig.shaft_hz
        )
        resonance = contact_resonance(clean.spectrum, band_hz=rig.band_hz)
        assert resonance.crf_hz == pytest.approx(recording.crf_hz, abs=4 * resonance.crf_std)
        assert resonance.crfa == pytest.approx(
            recording.crfa, rel=4 * resonance.crfa_std / resonance.crfa
        )


def test_a_seed_reproduces_a_rig():
    first, repeated, other = (simulate_rig(RigSettings(**SMALL, seed=seed)) for seed in (3, 3, 4))
    assert np.array_equal(
        first.recordings[1].signal().values, repeated.recordings[1].signal().values
    )
    assert not np.array_equal(first.recordings[1].other_density, other.recordings[1].other_density)


@pytest.mark.parametrize(
    ("trend", "knee"), [("knee", 1.8e-6), ("smooth", None), ("constant", None)]
)
def test_trends(trend, knee):
    rig = simulate_rig(RigSettings(repeat_std_hz=0.0, duration_s=0.1, trend=trend))
    assert rig.split_sq_m == knee
    crf = [recording.crf_hz for recording in rig.recordings]
    assert np.ptp(crf) < 1e-6 if trend == "constant" else np.ptp(crf) > 500.0


def test_a_case_determines_the_load_shares():
    case = load_case(
        (Path(__file__).parents[2] / "examples" / "paper.toml")
        .read_text("utf-8")
        .replace("[256, 256]", "[64, 64]")
    )
    rig = simulate_rig(
        RigSettings(samples=2, repeats=1, duration_s=1.0, repeat_std_hz=0.0), case=case
    )
    smooth, rough = rig.recordings
    assert smooth.clr < rough.clr
    assert rough.crf_hz == pytest.approx(rig.full_load_crf_hz * rough.clr ** (1 / 6), rel=1e-6)
    assert rig.full_load_crf_hz == pytest.approx(3834.0, abs=1.0)  # E 200 GPa
    assert rig.split_sq_m is None


def test_a_case_determines_the_damping_and_a_track_recovers_it():
    """0.02 plus the solved contact's damping at the line's frequency, as fitted in quiet
    records.
    """
    case = load_case(Path(__file__).parents[2] / "examples" / "paper.toml").with_overrides(
        {"grid.cells": [64, 64], "vibration.damping_law": "contact"}
    )
    quiet = Disturbance(snr_db=40.0, modes=0)
    rig = simulate_rig(
        RigSettings(samples=3, repeats=1, duration_s=10.0, repeat_std_hz=0.0),
        case=case,
        disturbance=quiet,
    )
    damped = [recording.damping_ratio for recording in rig.recordings]
    assert damped == sorted(damped, reverse=True)  # less oil, less damping
    for recording in rig.recordings:
        worn_case = case.with_overrides({"surface.sq": f"{recording.true_sq_m * 1e6!r} um"})
        solved = solve_contact(
            worn_case.conditions,
            worn_case.lubricant,
            worn_case.surface(),
            options=worn_case.options,
        )
        own_damping = dynamic_stiffness(solved, recording.crf_hz).damping_ratio
        assert recording.damping_ratio == pytest.approx(0.02 + own_damping, rel=1e-3)
        fitted = contact_resonance(
            power_spectrum(recording.signal(), segment=40_000), band_hz=rig.band_hz
        )
        assert fitted.damping_ratio == pytest.approx(
            recording.damping_ratio, abs=4 * fitted.damping_ratio_std
        )


@pytest.mark.parametrize("file_format", ["h5", "wav"])
def test_written_recordings_can_be_read(tmp_path, file_format):
    rig = simulate_rig(RigSettings(samples=2, repeats=2, duration_s=0.5))
    steps = []
    paths = write_rig(
        rig, tmp_path / "rig", file_format=file_format, progress=lambda *step: steps.append(step)
    )
    assert [path.name for path in paths] == [
        f"sample-0{s}-test-{r}.{file_format}" for s in (1, 2) for r in (1, 2)
    ]
    assert steps[-1] == (4, 4)
    from asperity.recording import read_recording

    unit = None if file_format == "h5" else "m/s^2"
    read = read_recording(paths[2], unit=unit)
    assert (read.rate_hz, read.unit) == (20e3, "m/s^2")
    assert read.values == pytest.approx(rig.recordings[2].signal().values, rel=1e-6, abs=1e-7)
    with (tmp_path / "rig" / "truth.csv").open() as file:
        truth = list(csv.DictReader(file))
    assert [float(row["crf_hz"]) for row in truth] == pytest.approx(
        [recording.crf_hz for recording in rig.recordings], rel=1e-5
    )
    with (tmp_path / "rig" / "table.csv").open() as file:
        assert [float(row["sq_um"]) for row in csv.DictReader(file)] == pytest.approx(
            [0.54, 0.54, 3.49, 3.49]
        )
    assert load_case(tmp_path / "rig" / "rig.toml").conditions.load == 500.0
    with pytest.raises(BadInput, match="not empty"):
        write_rig(rig, tmp_path / "rig")


@pytest.mark.parametrize(
    ("arguments", "named"),
    [
        ({"samples": 0}, "at least 1 sample"),
        ({"trend": "wavy"}, "knee, smooth, constant"),
        ({"duration_s": -1.0}, "duration"),
        ({"duration_s": 0.01}, "1000 samples"),
        ({"rate_hz": 8e3}, "at least 3 times"),
        ({"repeat_std_hz": -1.0}, "between repeats"),
        ({"seed": -1}, "seed"),
    ],
)
def test_an_impossible_rig_is_refused(arguments, named):
    with pytest.raises(BadInput, match=named):
        simulate_rig(RigSettings(**{**SMALL, **arguments}))


@pytest.mark.parametrize("arguments", [{"snr_db": 99.0}, {"modes": -1}, {"gain_db": -1.0}])
def test_impossible_disturbances_are_refused(arguments):
    with pytest.raises(BadInput):
        Disturbance(**arguments)
