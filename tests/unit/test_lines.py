from dataclasses import replace

import numpy as np
import pytest

from asperity.core.errors import BadInput
from asperity.core.signals import Signal, power_spectrum, smooth
from asperity.resonance import contact_resonance, remove_lines
from asperity.vibration import ContactOscillator, acceleration

RATE, SECONDS = 10e3, 40.0
TIME = np.arange(round(RATE * SECONDS)) / RATE
SHAFT = 29.37


def noise(seed=0):
    return np.random.default_rng(seed).standard_normal(TIME.size)


def tones(speed, orders, height):
    return sum(height * np.sin(2 * np.pi * speed * order * TIME + order) for order in orders)


def spectrum(values, segment=40_000, window="hann"):
    return power_spectrum(Signal(values, RATE, "m/s^2"), segment=segment, window=window)


def test_tones_are_removed_identified_and_measured():
    clean = remove_lines(
        spectrum(noise() + tones(SHAFT, range(1, 60, 3), 0.3) + tones(50.0, (1, 2, 3, 5, 7), 0.2))
    )
    assert len(clean.removed) == 25
    assert [line.frequency_hz for line in clean.removed] == sorted(
        line.frequency_hz for line in clean.removed
    )
    shaft = [line for line in clean.removed if "29.37" in line.source]
    assert [line.source.split()[0] for line in shaft] == [str(order) for order in range(1, 60, 3)]
    assert [line.frequency_hz for line in shaft] == pytest.approx(
        SHAFT * np.arange(1, 60, 3), abs=0.03
    )
    assert [line.mean_square for line in shaft] == pytest.approx(np.full(20, 0.3**2 / 2), rel=0.15)
    assert sum("50 Hz" in line.source for line in clean.removed) == 5
    assert clean.speeds_hz == pytest.approx((SHAFT, 50.0), abs=0.005)


def test_the_cleaned_spectrum_is_that_of_the_noise():
    before, clean = (
        spectrum(noise()),
        remove_lines(spectrum(noise() + tones(SHAFT, range(1, 60, 3), 0.3))),
    )
    assert np.array_equal(
        clean.spectrum.density[clean.kept],
        remove_lines(clean.spectrum).spectrum.density[clean.kept],
    )
    # Parseval: the power of the tones is removed
    power = [np.sum(entry.density) * entry.spacing_hz for entry in (before, clean.spectrum)]
    assert power[1] == pytest.approx(power[0], rel=0.005)
    distant = clean.kept & (
        np.abs(before.frequency_hz[:, None] - SHAFT * np.arange(1, 60, 3)).min(axis=1) > 5.0
    )
    assert clean.spectrum.density[distant] == pytest.approx(before.density[distant], rel=0.05)


def test_no_lines_are_removed_from_noise():
    for window, segment in (("hann", 40_000), ("hann", None), ("boxcar", None)):
        removed_count = sum(
            len(remove_lines(spectrum(noise(seed), segment, window)).removed) for seed in range(10)
        )
        assert removed_count <= 1  # 0.1 expected


@pytest.mark.parametrize("damping_ratio", [0.0005, 0.003])  # 8 and 48 spectral lines wide
def test_a_resonance_is_not_removed_as_a_tone(damping_ratio):
    spring = ContactOscillator(
        mass=0.1, stiffness=0.1 * (2 * np.pi * 2000.0) ** 2, damping_ratio=damping_ratio
    )
    response = acceleration(spring, Signal(np.cumsum(np.cumsum(noise())) * 1e-9, RATE, "m")).values
    response = response / np.std(response)
    measured = spectrum(response + 0.01 * noise(1) + tones(SHAFT, range(60, 76), 0.05))
    clean = remove_lines(measured, shaft_hz=[SHAFT])
    peak = np.abs(measured.frequency_hz - 2000.0) < 4.0  # no harmonic falls on the resonance peak
    assert np.all(clean.kept[peak])
    found = contact_resonance(clean.spectrum, band_hz=(1600.0, 2400.0))
    assert found.crf_hz == pytest.approx(2000.0, abs=4.0 * found.crf_std)


def test_a_known_speed_reveals_weaker_tones():
    values = noise() + tones(SHAFT, range(1, 90), 0.015)
    found, given = remove_lines(spectrum(values)), remove_lines(spectrum(values), shaft_hz=[29.36])
    assert len(given.removed) > 3 * len(found.removed)
    assert given.speeds_hz[0] == pytest.approx(SHAFT, abs=0.01)  # corrected
    false = [
        line
        for line in given.removed
        if abs(line.frequency_hz / SHAFT - round(line.frequency_hz / SHAFT)) > 0.02
    ]
    assert len(false) <= 1


def test_only_the_band_is_cleaned():
    measured = spectrum(noise() + tones(SHAFT, range(1, 60), 0.3))
    clean = remove_lines(measured, band_hz=(600.0, 1200.0))
    assert all(590.0 < line.frequency_hz < 1210.0 for line in clean.removed)
    outside = (measured.frequency_hz < 590.0) | (measured.frequency_hz > 1210.0)
    assert np.all(clean.kept[outside])
    assert clean.removed[0].source.startswith("21 x")  # the speed is estimated from all tones


@pytest.mark.parametrize(
    ("damage", "arguments", "message"),
    [
        (lambda valid: smooth(valid, 3), {}, "unsmoothed"),
        (lambda valid: valid, {"shaft_hz": [-1.0]}, "shaft speed"),
        (lambda valid: replace(valid, density=valid.density * np.nan), {}, "finite"),
        (lambda valid: replace(valid, density=valid.density[:30]), {}, "too short"),
    ],
)
def test_an_invalid_spectrum_or_speed_is_refused(damage, arguments, message):
    with pytest.raises(BadInput, match=message):
        remove_lines(damage(spectrum(noise())), **arguments)
