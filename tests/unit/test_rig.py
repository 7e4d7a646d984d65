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
    """Mean squares within the band: of the contact's line, and of all else."""
    inside = (recording.frequency_hz >= band[0]) & (recording.frequency_hz <= band[1])
    tonal = (recording.tones.frequency_hz >= band[0]) & (recording.tones.frequency_hz <= band[1])
    step = recording.frequency_hz[1]
    other = (
        np.sum(recording.other_density[inside]) * step
        + np.sum(recording.tones.amplitude[tonal] ** 2) / 2
    )
    return np.sum(recording.contact_density[inside]) * step, other


def test_the_rig_is_the_papers():
    rig = simulate_rig(RigSettings(repeat_std_hz=0.0, duration_s=1.0))
    assert len(rig.recordings) == 60
    assert [one.sq_m * 1e6 for one in rig.recordings[::5]] == pytest.approx(SAMPLES_SQ_UM)
    assert rig.full_load_crf_hz == pytest.approx(3879.0, abs=1.0)
    for one in rig.recordings:
        knee = np.interp(one.true_sq_m * 1e6, [0.54, 1.8, 3.49], [2921.93, 3640.0, 3811.88])
        if 0.54 < one.true_sq_m * 1e6 < 3.49:
            assert one.crf_hz == pytest.approx(knee, abs=0.01)
        assert one.clr == pytest.approx((one.crf_hz / rig.full_load_crf_hz) ** 6, rel=1e-9)


def test_measured_roughness_has_the_stated_error():
    off = [
        (one.true_sq_m - one.sq_m) / one.sq_std_m
        for seed in range(20)
        for one in simulate_rig(RigSettings(repeats=1, duration_s=0.1, seed=seed)).recordings
    ]
    assert np.std(off) == pytest.approx(1.0, abs=0.12)


@pytest.mark.parametrize("snr_db", [20.0, 0.0])
def test_the_signal_to_noise_ratio_is_as_requested(snr_db):
    rig = simulate_rig(RigSettings(duration_s=1.0), disturbance=Disturbance(snr_db=snr_db))
    found = []
    for one in rig.recordings:
        contact, other = powers(one, rig.band_hz)
        found.append(10 * np.log10(contact / other))
        assert one.snr_db == pytest.approx(found[-1], abs=0.01)
    assert np.mean(found) == pytest.approx(snr_db, abs=0.6)
    assert np.std(found) == pytest.approx(1.0, abs=0.3)


def test_the_contact_line_is_the_oscillators_own_response():
    """Against a record by another way: the profile, finely sampled, through the exact response in
    time.
    """
    one = simulate_rig(RigSettings(**SMALL)).recordings[0]
    model = VibrationModel(mass=0.1, damping_ratio=0.02)
    spring = replace(_spring(one.crf_hz), damping_ratio=one.damping_ratio)
    ridden = FilteredNoise(
        height=one.true_sq_m, cutoff_hz=model.excitation.cutoff_reference_hz
    ).profile(4_000_000, 100e3, 3)
    seen = power_spectrum(acceleration(spring, ridden), segment=20_000)
    inside = (seen.frequency_hz > 2500) & (seen.frequency_hz < 3700)
    ratio = seen.density[inside] / np.interp(
        seen.frequency_hz[inside], one.frequency_hz, one.contact_density
    )
    # straight lines between samples cost 1.5 % at 100 kHz; the accelerometer adds 1 %; the rest is
    # chance
    assert np.mean(ratio) == pytest.approx(0.98, abs=0.02)
    assert np.std(ratio) < 0.2


def _spring(f0):
    from asperity.vibration import ContactOscillator

    return ContactOscillator(mass=0.1, stiffness=0.1 * (2 * np.pi * f0) ** 2, damping_ratio=0.02)


def test_a_drawn_spectrum_scatters_as_those_of_records():
    one = simulate_rig(
        RigSettings(samples=1, repeats=1, duration_s=40.0), disturbance=Disturbance(modes=0)
    ).recordings[0]
    one = replace(one, tones=Tones(np.array([2718.3]), np.array([0.02 * np.sqrt(one.crfa)])))
    expected = np.interp(
        np.arange(0, 10e3, 0.5), one.frequency_hz, one.contact_density + one.other_density
    )
    scatters = {}
    for kind in ("drawn", "record"):
        ratios = []
        for seed in range(6):
            again = replace(one, seed=seed)
            spectrum = (
                again.spectrum(40_000)
                if kind == "drawn"
                else power_spectrum(again.signal(), segment=40_000)
            )
            ratios.append(spectrum.density[200:-400] / expected[200 : spectrum.density.size - 400])
        clean = np.delete(np.array(ratios), np.arange(5230, 5245), axis=1)
        tone = np.array(ratios)[:, 5230:5245]
        flat = clean - np.mean(clean)
        scatters[kind] = (
            np.mean(clean),
            np.std(clean),
            np.mean(flat[:, 1:] * flat[:, :-1]) / np.var(clean),
            np.mean(flat**3) / np.std(clean) ** 3,
            np.mean(np.sum(tone, axis=1)),
        )
        assert spectrum.averages == pytest.approx(
            power_spectrum(one.signal(), segment=40_000).averages
        )
    assert scatters["drawn"][0] == pytest.approx(1.0, abs=0.01)
    assert scatters["record"][0] == pytest.approx(1.0, abs=0.01)
    assert scatters["drawn"][1] == pytest.approx(scatters["record"][1], rel=0.03)
    assert scatters["drawn"][2] == pytest.approx(scatters["record"][2], abs=0.03)
    assert scatters["drawn"][3] == pytest.approx(scatters["record"][3], rel=0.2)
    assert scatters["drawn"][4] == pytest.approx(scatters["record"][4], rel=0.1)


def test_a_quiet_recording_gives_its_truth_back():
    rig = simulate_rig(RigSettings(**SMALL), disturbance=Disturbance(snr_db=40.0))
    for one in rig.recordings:
        clean = remove_lines(power_spectrum(one.signal(), segment=40_000), shaft_hz=rig.shaft_hz)
        found = contact_resonance(clean.spectrum, band_hz=rig.band_hz)
        assert found.crf_hz == pytest.approx(one.crf_hz, abs=4 * found.crf_std)
        assert found.crfa == pytest.approx(one.crfa, rel=4 * found.crfa_std / found.crfa)


def test_a_seed_is_a_rig_and_another_seed_another():
    first, again, other = (simulate_rig(RigSettings(**SMALL, seed=seed)) for seed in (3, 3, 4))
    assert np.array_equal(first.recordings[1].signal().values, again.recordings[1].signal().values)
    assert not np.array_equal(first.recordings[1].other_density, other.recordings[1].other_density)


@pytest.mark.parametrize(
    ("trend", "knee"), [("knee", 1.8e-6), ("smooth", None), ("constant", None)]
)
def test_trends(trend, knee):
    rig = simulate_rig(RigSettings(repeat_std_hz=0.0, duration_s=0.1, trend=trend))
    assert rig.split_sq_m == knee
    crf = [one.crf_hz for one in rig.recordings]
    assert np.ptp(crf) < 1e-6 if trend == "constant" else np.ptp(crf) > 500.0


def test_a_case_gives_its_own_load_shares():
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


def test_a_case_gives_its_contacts_own_damping_and_a_track_finds_it_again():
    """Stated 0.02 and what the solved contact adds at the line's frequency; the fit of each quiet
    record returns it.
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
    damped = [one.damping_ratio for one in rig.recordings]
    assert damped == sorted(damped, reverse=True)  # less oil, less damping
    for one in rig.recordings:
        again = case.with_overrides({"surface.sq": f"{one.true_sq_m * 1e6!r} um"})
        solved = solve_contact(
            again.conditions, again.lubricant, again.surface(), options=again.options
        )
        own = dynamic_stiffness(solved, one.crf_hz).damping_ratio
        assert one.damping_ratio == pytest.approx(0.02 + own, rel=1e-3)
        found = contact_resonance(power_spectrum(one.signal(), segment=40_000), band_hz=rig.band_hz)
        assert found.damping_ratio == pytest.approx(
            one.damping_ratio, abs=4 * found.damping_ratio_std
        )


@pytest.mark.parametrize("file_format", ["h5", "wav"])
def test_written_recordings_can_be_read(tmp_path, file_format):
    rig = simulate_rig(RigSettings(samples=2, repeats=2, duration_s=0.5))
    told = []
    paths = write_rig(
        rig, tmp_path / "rig", file_format=file_format, progress=lambda *step: told.append(step)
    )
    assert [path.name for path in paths] == [
        f"sample-0{s}-test-{r}.{file_format}" for s in (1, 2) for r in (1, 2)
    ]
    assert told[-1] == (4, 4)
    from asperity.recording import read_recording

    unit = None if file_format == "h5" else "m/s^2"
    read = read_recording(paths[2], unit=unit)
    assert (read.rate_hz, read.unit) == (20e3, "m/s^2")
    assert read.values == pytest.approx(rig.recordings[2].signal().values, rel=1e-6, abs=1e-7)
    with (tmp_path / "rig" / "truth.csv").open() as file:
        truth = list(csv.DictReader(file))
    assert [float(row["crf_hz"]) for row in truth] == pytest.approx(
        [one.crf_hz for one in rig.recordings], rel=1e-5
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
def test_a_rig_that_cannot_be_is_refused(arguments, named):
    with pytest.raises(BadInput, match=named):
        simulate_rig(RigSettings(**{**SMALL, **arguments}))


@pytest.mark.parametrize("arguments", [{"snr_db": 99.0}, {"modes": -1}, {"gain_db": -1.0}])
def test_disturbances_that_cannot_be_are_refused(arguments):
    with pytest.raises(BadInput):
        Disturbance(**arguments)
