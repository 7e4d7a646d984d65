import numpy as np
import pytest

from asperity.errors import BadInput
from asperity.signals import Signal, power_spectrum
from asperity.vibration import ContactOscillator, acceleration, expected_spectrum

STEEL = ContactOscillator(mass=0.1, stiffness=4.3765e7, damping_ratio=0.02)


def test_frequency_and_damping_are_those_worked_out_by_hand():
    assert STEEL.natural_frequency_hz == pytest.approx(3329.5, rel=1e-4)
    assert STEEL.damping == pytest.approx(0.04 * np.sqrt(4.3765e7 * 0.1), rel=1e-12)  # 2 zeta sqrt(S m)


@pytest.mark.parametrize("damping_ratio", [0.005, 0.02, 0.3])
@pytest.mark.parametrize("rate", [20e3, 50e3, 400e3])
def test_response_to_kinks_is_the_closed_form(damping_ratio, rate):
    """After a change of slope d at rest, r = d e^(-zeta w t) sin(w_d t)/w_d and m y'' = S r + C r'."""
    oscillator = ContactOscillator(mass=0.1, stiffness=4.3765e7, damping_ratio=damping_ratio)
    omega = np.sqrt(oscillator.stiffness / oscillator.mass)
    damped = omega * np.sqrt(1 - damping_ratio**2)
    time = np.arange(2000) / rate
    heights = np.zeros(time.size)
    expected = np.zeros(time.size)
    for kink, slope in ((10, 1e-3), (137, -4e-3), (600, 2.5e-3)):
        t = np.maximum(time - time[kink], 0.0)
        heights += slope * t
        decay = slope * np.exp(-damping_ratio * omega * t)
        r = decay * np.sin(damped * t) / damped
        r_rate = decay * (np.cos(damped * t) - damping_ratio * omega / damped * np.sin(damped * t))
        after = np.where(np.arange(time.size) > kink, 1.0, np.where(np.arange(time.size) == kink, 0.5, 0.0))
        expected += after * (omega**2 * r + 2 * damping_ratio * omega * r_rate)
    response = acceleration(oscillator, Signal(heights, rate, "m"))
    assert np.max(np.abs(response.values - expected)) < 1e-9 * np.max(np.abs(expected))


def test_a_steady_slope_shakes_nothing():
    response = acceleration(STEEL, Signal(1e-3 * np.arange(500), 50e3, "m")).values
    assert np.max(np.abs(response)) < 1e-9 * 1e-3 * 50e3 * STEEL.angular_frequency


@pytest.mark.parametrize("frequency", [400.0, 3000.0, 3329.5, 5000.0])
def test_response_to_a_sine_is_the_closed_form_of_its_straight_lines(frequency):
    """A sampled sine joined by lines is sum_k sinc^2(f_k/rate) e^(i 2 pi f_k t), f_k = f + k rate."""
    rate, samples = 50e3, 40_000
    time = np.arange(samples) / rate
    response = acceleration(STEEL, Signal(1e-6 * np.sin(2 * np.pi * frequency * time), rate, "m")).values
    f = frequency + rate * np.arange(-400_000, 400_001)
    w = 2j * np.pi * f
    transfer = w**2 * (STEEL.stiffness + w * STEEL.damping) / (0.1 * w**2 + w * STEEL.damping + STEEL.stiffness)
    phasor = 1e-6 * np.sum(np.sinc(f / rate) ** 2 * transfer)
    expected = np.imag(phasor * np.exp(2j * np.pi * frequency * time))
    steady = slice(samples // 2, samples - 1)
    assert np.max(np.abs(response[steady] - expected[steady])) < 1e-7 * np.abs(phasor)


@pytest.mark.parametrize("rate", [50e3, 100e3])
def test_straight_lines_weaken_the_resonance_by_sinc_to_the_fourth(rate):
    f0 = STEEL.natural_frequency_hz
    time = np.arange(20_000) / rate
    response = acceleration(STEEL, Signal(1e-6 * np.sin(2 * np.pi * f0 * time), rate, "m")).values
    steady = response[-1001:-1]
    basis = np.exp(2j * np.pi * f0 * time[-1001:-1])
    (amplitude, _), *_ = np.linalg.lstsq(np.column_stack([basis, basis.conj()]), steady.astype(complex), rcond=None)
    power = abs(2 * amplitude) ** 2
    assert power == pytest.approx(1e-12 * float(STEEL.gain(np.array(f0))) * np.sinc(f0 / rate) ** 4, rel=1e-4)


def test_gain_is_the_transfer_function_squared():
    f = np.array([0.0, 10.0, 3000.0, 3329.5, 9000.0])
    w = 2j * np.pi * f
    transfer = w**2 * (STEEL.stiffness + w * STEEL.damping) / (0.1 * w**2 + w * STEEL.damping + STEEL.stiffness)
    assert STEEL.gain(f) == pytest.approx(np.abs(transfer) ** 2, rel=1e-10)


def test_spectrum_of_a_long_response_is_the_expected_spectrum_of_its_profile():
    rate = 200e3
    heights = np.cumsum(np.cumsum(np.random.default_rng(5).standard_normal(2_000_000)))  # white acceleration
    profile = Signal(1e-9 * (heights - np.linspace(heights[0], heights[-1], heights.size)), rate, "m")
    measured = power_spectrum(acceleration(STEEL, profile), segment=8000)
    band = (measured.frequency_hz > 2000) & (measured.frequency_hz < 5000)
    f = measured.frequency_hz[band]
    # second differences of the heights are white: S_y = 2/rate / |2 - 2 cos|^2
    theta = 2 * np.pi * f / rate
    white_profile = 1e-18 * 2 / rate / (2 - 2 * np.cos(theta)) ** 2
    expected = STEEL.gain(f) * white_profile * np.sinc(f / rate) ** 4
    ratio = measured.density[band] / expected
    assert np.mean(ratio) == pytest.approx(1.0, abs=4.0 / np.sqrt(ratio.size * measured.averages) + 5e-3)
    assert np.std(ratio) == pytest.approx(1.0 / np.sqrt(measured.averages), rel=0.3)


def test_expected_spectrum_multiplies_by_the_gain_and_changes_the_unit():
    heights = power_spectrum(Signal(np.random.default_rng(1).standard_normal(5000), 50e3, "m"))
    spectrum = expected_spectrum(STEEL, heights)
    assert spectrum.unit == "(m/s^2)^2/Hz"
    assert spectrum.density == pytest.approx(STEEL.gain(heights.frequency_hz) * heights.density)
    with pytest.raises(BadInput, match="m\\^2/Hz"):
        expected_spectrum(STEEL, spectrum)


def test_bad_input_is_named():
    with pytest.raises(BadInput, match="exact"):
        acceleration(STEEL, Signal(np.zeros(10), 1e4, "m"), method="rk5")
    with pytest.raises(BadInput, match="'m/s\\^2'"):
        acceleration(STEEL, Signal(np.zeros(10), 1e4, "m/s^2"))
    with pytest.raises(BadInput, match="finite"):
        acceleration(STEEL, Signal(np.array([0.0, np.nan, 0.0]), 1e4, "m"))
    for fields in ({"mass": -0.1}, {"stiffness": 0.0}, {"damping_ratio": 0.0}, {"damping_ratio": 1.0}):
        ((name, value),) = fields.items()
        with pytest.raises(BadInput, match=f"{name.replace('_', ' ')} must .* got {value:g}"):
            ContactOscillator(**{"mass": 0.1, "stiffness": 1e7, "damping_ratio": 0.02, **fields})
