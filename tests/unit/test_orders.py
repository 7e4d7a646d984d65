"""Orders of a shaft with varying speed and lines at rates and bands, against closed forms."""

import numpy as np
import pytest

from asperity.core.errors import BadInput
from asperity.monitoring.auxiliary_channels import bands, lines
from asperity.vibration import (
    Turning,
    resample_to_constant_speed,
    turning_by_pulses,
    turning_by_speed,
)

RATE, SECONDS = 20e3, 4.0
TIME = np.arange(round(RATE * SECONDS)) / RATE
ANGLE = 20.0 * TIME + 0.5 * 4.0 * TIME**2  # shaft angle [turns]; speed from 20 to 36 Hz
SPEED = 20.0 + 4.0 * TIME
MEAN = 28.0


def spectrum(values, rate):
    """One-sided power spectral density of a record, Hann window."""
    weights = np.hanning(values.size)
    density = 2.0 * np.abs(np.fft.rfft(values * weights)) ** 2 / (rate * np.sum(weights**2))
    return np.fft.rfftfreq(values.size, 1.0 / rate), density


@pytest.mark.parametrize("per_turn", [1, 4])
def test_the_angle_from_pulses_equals_the_shaft_angle(per_turn):
    noise = 0.01 * np.random.default_rng(1).standard_normal(TIME.size)
    pulses = np.exp(-200.0 * (((ANGLE * per_turn) % 1.0) - 0.5) ** 2) + noise
    turning = turning_by_pulses(pulses, RATE, per_turn)
    valid = np.isfinite(turning.turns)
    error = turning.turns[valid] - ANGLE[valid]
    assert valid.mean() > 0.95
    assert np.ptp(error) < 5e-3  # turns; the zero of the count is arbitrary
    assert turning.speed_hz == pytest.approx(MEAN, rel=0.01)


def test_tacho_noise_produces_no_pulses():
    noise = 0.1 * np.random.default_rng(1).standard_normal(TIME.size)
    assert turning_by_pulses(np.sin(2.0 * np.pi * ANGLE) + noise, RATE).speed_hz == pytest.approx(
        MEAN, rel=0.01
    )


def test_pulses_at_two_samples_per_turn_are_detected():
    pulses = 0.001 * np.random.default_rng(0).standard_normal(51_200)
    pulses[2559::2560] += 5.0
    pulses[2560::2560] += 5.0
    assert turning_by_pulses(pulses, 25_600.0).speed_hz == pytest.approx(10.0, rel=1e-3)


def test_edges_inconsistent_with_a_shaft_are_refused():
    with pytest.raises(BadInput, match="which no shaft produces; use another channel"):
        turning_by_pulses(np.random.default_rng(0).standard_normal(5_000), 25_600.0)


def test_the_angle_from_a_speed_channel_is_its_integral():
    turning = turning_by_speed(SPEED, RATE)
    assert turning.turns == pytest.approx(ANGLE, abs=1e-9)
    assert turning.speed_hz == pytest.approx(MEAN, rel=1e-4)


@pytest.mark.parametrize(
    "order", [3.58, 80.0, 200.0]
)  # up to 7200 Hz, a third of the sampling rate
def test_order_tracking_restores_a_single_line(order):
    values = np.sin(2.0 * np.pi * order * ANGLE)
    resampled, rate = resample_to_constant_speed(values, turning_by_speed(SPEED, RATE), RATE)
    amplitude = lines(*spectrum(resampled, rate), {"it": order * MEAN})["it"]
    assert amplitude == pytest.approx(np.sqrt(0.5), rel=0.01)
    frequency, density = spectrum(resampled, rate)
    assert frequency[np.argmax(density)] == pytest.approx(order * MEAN, rel=2e-3)
    assert (
        lines(*spectrum(values, RATE), {"it": order * MEAN})["it"] < 0.5 * amplitude
    )  # not resampled


def test_constant_speed_leaves_a_vibration_unchanged():
    values = np.random.default_rng(2).standard_normal(4000)
    smooth = np.convolve(values, np.ones(8) / 8.0, mode="same")
    resampled, rate = resample_to_constant_speed(
        smooth, turning_by_speed(np.full(4000, 25.0), RATE), RATE
    )
    assert rate == pytest.approx(RATE)
    assert resampled[100:3900] == pytest.approx(smooth[100:3900], abs=0.02)


def test_signals_without_rotation_are_refused():
    with pytest.raises(BadInput, match="has 0 pulses, but 4 are required"):
        turning_by_pulses(np.zeros(1000), RATE)
    with pytest.raises(BadInput, match="stops or reverses"):
        turning_by_speed(np.linspace(-1.0, 30.0, 1000), RATE)
    with pytest.raises(BadInput, match=r"less than 0\.25 of its mean speed"):
        resample_to_constant_speed(
            np.zeros(1000), turning_by_speed(np.geomspace(0.1, 30.0, 1000), RATE), RATE
        )
    with pytest.raises(BadInput, match="pulses per turn"):
        turning_by_pulses(np.zeros(10), RATE, 0.0)
    assert isinstance(turning_by_speed(np.ones(10), RATE), Turning)


def test_a_line_is_the_root_sum_square_of_its_harmonics():
    parts = [(1.0, 1), (0.5, 2), (0.25, 3), (3.0, 5)]  # the fifth harmonic is excluded
    values = sum(size * np.sin(2.0 * np.pi * 100.0 * number * TIME) for size, number in parts)
    amplitudes = lines(*spectrum(values, RATE), {"mesh": 100.0, "slow": 0.5, "fast": 11e3})
    assert amplitudes["mesh"] == pytest.approx(np.sqrt(0.5 * (1.0 + 0.25 + 0.0625)), rel=1e-3)
    assert np.isnan([amplitudes["slow"], amplitudes["fast"]]).all()


def test_bands_partition_the_signals_power():
    class OpenedRecording:
        facts = {}  # noqa: RUF012
        rate_hz = RATE

    frequency = np.arange(0.0, 10_001.0, 5.0)
    band_powers = bands(OpenedRecording, frequency, np.full(frequency.size, 2.0))
    expected = {"10 to 1000 Hz": 990.0, "1 to 5 kHz": 4000.0, "above 5 kHz": 3000.0}
    assert {name: value**2 for name, value in band_powers.items()} == pytest.approx(
        {name: 2.0 * width for name, width in expected.items()}, rel=1e-9
    )
