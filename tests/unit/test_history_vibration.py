"""Vibration of a mass on a moving contact: periodic profile, steady response, and the paper's
model.
"""

import html
import json
from dataclasses import replace
from itertools import islice

import numpy as np
import pytest

from asperity.case import load_case
from asperity.cli import main
from asperity.core.errors import BadInput
from asperity.core.quantities import in_print
from asperity.core.signals import Signal, power_spectrum
from asperity.coupling import VibrationModel
from asperity.ehl import solve_contact
from asperity.resonance import contact_resonance
from asperity.simulation import history_vibration, load_history, run_history
from asperity.simulation.motion.vibration import repeating, resampled, steady_response
from asperity.solution import own_resonance, tangent_stiffness
from asperity.surface import MovingSurfaces, Surface, track_grid
from asperity.transient import moving_contact
from asperity.vibration import ContactOscillator

SMALL = {"grid.cells": "[48, 16]", "surface.correlation_length": "40 um", "grid.x": "[-3, 1.8]"}
SPRING = ContactOscillator(mass=0.1, stiffness=2.0e8, damping_ratio=0.02, load=500.0)


def case(**overrides):
    return load_case("examples/paper.toml").with_overrides(SMALL | overrides)


@pytest.fixture(scope="module")
def history(tmp_path_factory):
    return run_history(case(), steps=96, out=tmp_path_factory.mktemp("history") / "kept")


@pytest.fixture(scope="module")
def vibration(history):
    return history_vibration(history, moments=2)


def waves(period, numbers, samples, rate):
    time = np.arange(samples) / rate
    return sum(1e-9 * k * np.cos(2.0 * np.pi * k * time / period + k) for k in numbers)


# Periodic profile


def test_waves_are_recovered_for_a_non_integer_period():
    period, rate = 43.21e-6, 1e6
    time = np.arange(100) / rate
    profile, aperiodic_share, objection = repeating(
        time, 5e-7 + waves(period, (1, 3, 11), 100, rate), period
    )
    assert objection is None
    assert aperiodic_share < 1e-9
    assert profile.duration_s == pytest.approx(period, rel=1e-12)
    expected = waves(period, (1, 3, 11), profile.values.size, profile.rate_hz)
    np.testing.assert_allclose(profile.values, expected, atol=1e-16)


def test_the_aperiodic_share_is_reported():
    period, rate = 40e-6, 1e6
    steady = waves(period, (1, 3), 200, rate)
    drift = np.random.default_rng(1).standard_normal(200) * 0.5 * np.std(steady)
    profile, aperiodic_share, _ = repeating(np.arange(200) / rate, steady + drift, period)
    # noise of 0.5 relative to 1; the 33 periodic parameters of 200 values absorb their share of the
    # noise
    assert aperiodic_share == pytest.approx(np.sqrt(0.25 * (1 - 33 / 200) / 1.25), rel=0.1)
    assert np.std(profile.values - waves(period, (1, 3), 40, rate)) < np.std(drift)


def test_less_than_a_passage_reports_the_missing_steps():
    profile, _, objection = repeating(np.arange(30) * 1e-6, np.zeros(30), 41.5e-6)
    assert profile is None
    assert "by 12 steps" in objection


def test_resampling_preserves_the_waves():
    coarse = Signal(waves(50e-6, (1, 4, 9), 50, 1e6), 1e6, "m")
    fine = resampled(coarse, 7.3e6)
    assert fine.rate_hz >= 7.3e6
    assert fine.duration_s == pytest.approx(50e-6, rel=1e-12)
    np.testing.assert_allclose(
        fine.values, waves(50e-6, (1, 4, 9), fine.values.size, fine.rate_hz), atol=1e-16
    )


# Response of the mass


@pytest.mark.parametrize("ratio", [0.02, 0.5, 1.0, 2.0])
def test_the_response_to_a_sine_matches_the_closed_form(ratio):
    f = ratio * SPRING.natural_frequency_hz
    samples = round(400 / min(ratio, 1.0))  # kinks of the linear interpolation lie far above f0
    profile = Signal(1e-8 * np.cos(2.0 * np.pi * np.arange(samples) / samples), samples * f, "m")
    response = steady_response(SPRING, profile)
    m, c, s, w = 0.1, 2 * 0.02 * np.sqrt(2.0e8 * 0.1), 2.0e8, 2j * np.pi * f
    transfer = w**2 * (c * w + s) / (m * w**2 + c * w + s)
    expected = 1e-8 * np.real(transfer * np.exp(2j * np.pi * np.arange(samples) / samples))
    np.testing.assert_allclose(response.values, expected, atol=3e-4 * abs(1e-8 * transfer))


def test_the_mass_follows_a_slow_wave():
    f = SPRING.natural_frequency_hz / 100.0
    profile = Signal(1e-6 * np.cos(2.0 * np.pi * np.arange(20_000) / 20_000), 20_000 * f, "m")
    response = steady_response(SPRING, profile)
    followed = -((2.0 * np.pi * f) ** 2) * profile.values
    np.testing.assert_allclose(response.values, followed, atol=2e-4 * np.max(np.abs(followed)))


def test_the_response_is_linear():
    first, second = (
        Signal(waves(200e-6, numbers, 300, 1.5e6), 1.5e6, "m") for numbers in ((1, 2), (5,))
    )
    response_of_sum = steady_response(
        SPRING, replace(first, values=first.values + 3.0 * second.values)
    ).values
    sum_of_responses = (
        steady_response(SPRING, first).values + 3.0 * steady_response(SPRING, second).values
    )
    np.testing.assert_allclose(
        response_of_sum, sum_of_responses, rtol=1e-9, atol=1e-9 * np.max(np.abs(response_of_sum))
    )


def test_a_long_track_shows_the_resonance_within_its_stated_error():
    f0, samples, period = SPRING.natural_frequency_hz, 20_000, 0.05
    rng = np.random.default_rng(3)
    number = np.arange(1, samples // 2 + 1)
    lines = np.zeros(samples // 2 + 1, complex)
    lines[1:] = (
        rng.standard_normal(2 * number.size).view(complex) / number**2
    )  # white base acceleration
    profile = resampled(
        Signal(1e-3 * np.fft.irfft(lines, samples), samples / period, "m"), 60.0 * f0
    )
    spectrum = power_spectrum(steady_response(SPRING, profile), window="boxcar")
    assert spectrum.spacing_hz == pytest.approx(1.0 / period)
    found = contact_resonance(spectrum, band_hz=(f0 / 1.5, 1.5 * f0))
    deviation = np.sqrt(0.02 * f0 / (2.0 * np.pi * period))
    assert abs(found.crf_hz - f0) < 3.0 * deviation
    assert found.crf_std_hz == pytest.approx(deviation, rel=0.5)


# Contact


def test_the_approach_follows_a_wave_much_longer_than_the_contact():
    chosen = case(**{"contact.slip": 0.0})
    conditions, grid = chosen.conditions, chosen.grid
    track = track_grid(grid, 10)
    height = 20e-9 * np.cos(2.0 * np.pi * (track.x - track.lower[0]) / track.extent[0])
    surface = Surface(np.repeat(height[:, None], grid.cells[1], axis=1), track)
    surfaces = MovingSurfaces.one_rough(surface, conditions.surface_speeds, grid)
    snapshots = list(
        islice(
            moving_contact(conditions, chosen.lubricant, surfaces, options=chosen.options), 48 + 481
        )
    )
    rows = snapshots[49:]
    profile, aperiodic_share, objection = repeating(
        np.array([first.time for first in rows]),
        np.array([first.solution.rigid_approach for first in rows]),
        surfaces.passage_time(0),
    )
    assert objection is None
    assert aperiodic_share < 0.01
    line = np.fft.rfft(profile.values)[1] * 2.0 / profile.values.size
    offset = -grid.lower[0] / grid.extent[0] / 10  # position of x = 0 along the track
    expected = 20e-9 * np.exp(-2j * np.pi * offset)
    assert abs(line - expected) < 0.1 * 20e-9
    assert abs(line) == pytest.approx(20e-9, rel=0.04)


def test_vibration_uses_the_historys_own_approach_and_stiffness(history, vibration):
    chosen, rows = history.case, history.settled
    assert vibration.unsolved == ()
    number = vibration.moments[0]
    surface = chosen.moving_surfaces().composite_at(
        float(rows["time_s"][rows["step"] == number].iloc[0])
    )
    contact = solve_contact(chosen.conditions, chosen.lubricant, surface, options=chosen.options)
    assert vibration.stiffness[0] == pytest.approx(tangent_stiffness(contact).total, rel=1e-6)
    assert vibration.oscillator.stiffness == pytest.approx(np.mean(vibration.stiffness))
    assert vibration.oscillator.damping_ratio == chosen.vibration.damping_ratio
    assert vibration.not_periodic < 0.5
    assert np.std(vibration.profile.values) == pytest.approx(
        rows["rigid_approach_m"].std(ddof=0), rel=0.15
    )
    # power of the response: closed form applied to the lines of the profile
    lines = (
        np.abs(np.fft.rfft(vibration.profile.values)[1:] / vibration.profile.values.size) ** 2 * 2.0
    )
    frequency = np.arange(1, lines.size + 1) * vibration.spacing_hz
    inside = frequency < vibration.profile.rate_hz / 6.0
    power = np.sum(lines[inside] * vibration.oscillator.gain(frequency[inside]))
    assert np.var(vibration.response.values) == pytest.approx(power, rel=0.05)


def test_damping_matches_separately_solved_moments(history, vibration):
    chosen, rows = history.case, history.settled
    assert vibration.damping.shape == vibration.dynamic.shape == (2,)
    number = vibration.moments[1]
    surface = chosen.moving_surfaces().composite_at(
        float(rows["time_s"][rows["step"] == number].iloc[0])
    )
    contact = solve_contact(chosen.conditions, chosen.lubricant, surface, options=chosen.options)
    own = own_resonance(contact, chosen.vibration.mass).elastic
    assert vibration.damping[1] == pytest.approx(own.damping_ratio, rel=1e-3)
    assert vibration.dynamic[1] == pytest.approx(own.stiffness, rel=1e-4)
    scalars = vibration.scalars()
    assert scalars["history_damping_ratio"] == pytest.approx(np.mean(vibration.damping))
    assert scalars["history_damping_std"] == pytest.approx(np.std(vibration.damping))
    assert scalars["dynamic_stiffness_n_per_m"] == pytest.approx(np.mean(vibration.dynamic))
    assert "damping ratio of the oil film" in vibration.verdict()


def test_damping_is_undetermined_without_a_dynamic_model():
    conserving = run_history(case(model="conserving"), steps=3)
    vibration = history_vibration(conserving, moments=1)
    assert np.isfinite(vibration.stiffness).all()
    assert np.isnan(vibration.damping).all()
    assert "damping not determined (dynamic stiffness needs the model" in vibration.verdict()
    assert vibration.scalars()["history_damping_ratio"] is None


def test_a_track_as_short_as_the_contact_reports_no_resonance(history, vibration):
    speed, track = history.case.conditions.surface_speeds[0], history.case.grid.extent[0]
    assert vibration.spacing_hz == pytest.approx(speed / track)
    assert not vibration.resonance.found
    assert "motion.track" in vibration.resonance.reason


def test_the_papers_model_is_reported_too(history, vibration):
    assert vibration.coupled.oscillator == history.vibration.oscillator
    model = VibrationModel(mass=0.1, damping_ratio=0.02, stiffness_law="tangent", rate_hz=2e5)
    second = history_vibration(history, model, moments=1)
    assert second.coupled.oscillator.stiffness == pytest.approx(
        vibration.coupled.oscillator.stiffness
    )


def test_a_loaded_history_gives_the_same_vibration(history, vibration):
    again = history_vibration(load_history(history.folder), moments=2)
    np.testing.assert_allclose(again.response.values, vibration.response.values, rtol=1e-9)


def test_a_smooth_contact_has_no_vibration():
    flat = case(**{"surface": {"kind": "flat"}})
    vibration = history_vibration(run_history(flat, steps=3), moments=1)
    assert vibration.profile is None
    assert "smooth" in vibration.resonance.reason
    assert vibration.coupled.oscillator is None
    assert vibration.oscillator.natural_frequency_hz > 5000.0


def test_two_sliding_rough_surfaces_are_not_periodic():
    response_of_sum = run_history(case(**{"motion.rough": "both"}), steps=2)
    assert (
        "move at different speeds" in history_vibration(response_of_sum, moments=1).resonance.reason
    )


def test_vibration_uses_flattened_surfaces():
    chosen = case(**{"motion.flattening": True, "material.hardness": "0.7 GPa"})
    history = run_history(chosen, steps=4)
    first = history.surfaces().first
    assert first.heights.mean() == pytest.approx(-history.table["flattened_m"].iloc[-1], abs=1e-15)
    assert "extend the history by" in history_vibration(history, moments=1).resonance.reason


def test_without_a_model_or_moments_it_is_refused(history):
    with pytest.raises(BadInput, match="moments must be 1 or more"):
        history_vibration(history, moments=0)
    without_vibration = run_history(case(vibration="none"), steps=1)
    with pytest.raises(BadInput, match="vibration is missing"):
        history_vibration(without_vibration)


def test_the_command_computes_the_vibration(history, capsys, tmp_path, monkeypatch):
    arguments = [
        "run",
        "examples/paper.toml",
        "--out",
        str(history.folder),
        "--steps",
        "96",
        "--listen",
    ]
    for key, value in SMALL.items():
        arguments += ["--set", f"{key}={value}"]
    with pytest.raises(SystemExit) as exit_info:
        main([*arguments, "--json"])
    assert not exit_info.value.code
    scalars = json.loads(capsys.readouterr().out)
    vibration = history_vibration(history)
    assert scalars["computed"] == 0
    assert scalars["tangent_resonance_hz"] == pytest.approx(
        vibration.oscillator.natural_frequency_hz
    )
    assert scalars["coupled_crf_hz"] == pytest.approx(vibration.coupled.resonance.crf_hz)
    assert scalars["history_crf_hz"] is None
    assert "motion.track" in scalars["history_crf_reason"]
    monkeypatch.setattr("asperity.simulation.history_vibration", lambda _: vibration)
    with pytest.raises(SystemExit):
        main([*arguments, "--report", str(tmp_path / "page.html")])
    assert vibration.verdict() in capsys.readouterr().out
    assert in_print(vibration.verdict()) in html.unescape(
        (tmp_path / "page.html").read_text("utf-8")
    )
