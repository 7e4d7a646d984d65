import numpy as np
import pytest

from asperity.core.errors import BadInput
from asperity.core.signals import Signal, Spectrum, power_spectrum, smooth
from asperity.resonance import ExcitationShape, contact_resonance
from asperity.resonance.band_fit import _free_excitation_model
from asperity.resonance.resonance import line_and_slopes, line_shape
from asperity.vibration import ContactOscillator, FilteredNoise, acceleration

BAND = (2500.0, 4000.0)
FREQUENCY = np.arange(0.0, 10_000.0, 1.25)


def random_periodogram(density, seed) -> Spectrum:
    """Ideal 0.8 s periodogram: independent exponential ordinates around `density`."""
    drawn = density * np.random.default_rng(seed).exponential(size=density.size)
    return Spectrum(
        frequency_hz=FREQUENCY,
        density=drawn,
        unit="(m/s^2)^2/Hz",
        duration_s=0.8,
        segment=16_000,
        window="boxcar",
        resolution_hz=1.25,
        averages=1.0,
    )


def test_the_line_is_the_oscillators_response_to_white_base_acceleration():
    oscillator = ContactOscillator(mass=0.1, stiffness=4.3765e7, damping_ratio=0.07)
    f0 = oscillator.natural_frequency_hz
    f = np.linspace(100.0, 9000.0, 50)
    transmissibility = oscillator.gain(f) / f**4 / (oscillator.gain(np.array(f0)) / f0**4)
    assert line_shape(f, f0, 0.07) == pytest.approx(transmissibility, rel=1e-10)


def test_stated_line_slopes_are_its_derivatives():
    f = np.linspace(2000.0, 5000.0, 40)
    _, by_f0, by_damping = line_and_slopes(f, 3300.0, 0.03)
    d = 1e-6
    assert by_f0 == pytest.approx(
        (line_shape(f, 3300.0 * np.exp(d), 0.03) - line_shape(f, 3300.0 * np.exp(-d), 0.03))
        / (2 * d),
        abs=1e-6,
    )
    assert by_damping == pytest.approx(
        (line_shape(f, 3300.0, 0.03 * np.exp(d)) - line_shape(f, 3300.0, 0.03 * np.exp(-d)))
        / (2 * d),
        abs=1e-6,
    )


def test_without_scatter_the_fit_returns_its_inputs():
    floor = 0.02 + 0.03 * (FREQUENCY - BAND[0]) / (BAND[1] - BAND[0])
    clean = random_periodogram(np.ones(FREQUENCY.size), 0)
    clean = Spectrum(
        frequency_hz=FREQUENCY,
        density=0.7 * line_shape(FREQUENCY, 3210.0, 0.025) + floor,
        unit=clean.unit,
        duration_s=0.8,
        segment=16_000,
        window="boxcar",
        resolution_hz=1.25,
        averages=1.0,
    )
    found = contact_resonance(clean, band_hz=BAND)
    assert found.found
    assert found.crf_hz == pytest.approx(3210.0, rel=1e-6)
    assert found.crfa == pytest.approx(0.7, rel=1e-4)
    assert found.damping_ratio == pytest.approx(0.025, rel=1e-4)
    assert found.floor == pytest.approx((0.02, 0.05), rel=1e-3)
    inside = np.abs(FREQUENCY - np.mean(BAND)) < np.ptp(BAND) / 2
    assert found.curve(FREQUENCY[inside]) == pytest.approx(clean.density[inside], rel=1e-4)


def test_the_fit_corrects_for_the_blur_of_a_short_hann_window():
    """The mean Welch spectrum is the density convolved with |W|^2, on a grid 100 times finer."""
    rate, segment, finer = 20e3, 500, 100
    frequency = np.fft.fftfreq(segment * finer, 1 / rate)
    density = 0.7 * line_shape(np.abs(frequency), 3210.0, 0.02)
    kernel = np.abs(np.fft.fft(np.hanning(segment + 1)[:-1], segment * finer)) ** 2
    blurred = np.fft.ifft(np.fft.fft(density) * np.fft.fft(kernel / kernel.sum())).real[
        : segment * finer // 2 : finer
    ]
    spectrum = Spectrum(
        frequency_hz=np.arange(blurred.size) * rate / segment,
        density=blurred,
        unit="(m/s^2)^2/Hz",
        duration_s=10.0,
        segment=segment,
        window="hann",
        resolution_hz=1.5 * rate / segment,
        averages=380.0,
    )
    fit = contact_resonance(spectrum, band_hz=BAND)
    assert fit.crf_hz == pytest.approx(3210.0, rel=3e-4)
    assert fit.crfa == pytest.approx(
        0.7, rel=0.002
    )  # a fit that mistakes blur for damping is 1.7 % low
    assert fit.damping_ratio == pytest.approx(0.02, rel=0.002)


@pytest.mark.parametrize("damping_ratio", [0.01, 0.02, 0.05])
def test_the_fit_is_unbiased_and_scatters_as_stated(damping_ratio):
    density = line_shape(FREQUENCY, 3200.0, damping_ratio) + 0.02
    fits = [
        contact_resonance(random_periodogram(density, seed), band_hz=BAND) for seed in range(150)
    ]
    assert all(fit.found for fit in fits)
    pulls = {
        "crf": np.array([(fit.crf_hz - 3200.0) / fit.crf_std for fit in fits]),
        "crfa": np.array([(np.log(fit.crfa)) / (fit.crfa_std / fit.crfa) for fit in fits]),
        "damping": np.array(
            [
                np.log(fit.damping_ratio / damping_ratio)
                * fit.damping_ratio
                / fit.damping_ratio_std
                for fit in fits
            ]
        ),
    }
    for name, pull in pulls.items():
        assert np.std(pull) == pytest.approx(1.0, abs=0.2), name
        assert abs(np.mean(pull)) < 0.35, name


def test_the_stated_deviation_is_the_cramer_rao_bound_of_a_lone_line():
    """sd(f0) = sqrt(zeta f0 / (2 pi T)) for a line without floor in a band much wider than it."""
    density = line_shape(FREQUENCY, 3200.0, 0.01)
    stated = [
        contact_resonance(random_periodogram(density, s), band_hz=(1500.0, 6500.0)).crf_std
        for s in range(20)
    ]
    assert np.median(stated) == pytest.approx(np.sqrt(0.01 * 3200.0 / (2 * np.pi * 0.8)), rel=0.1)


@pytest.mark.parametrize(("window", "segment"), [("boxcar", None), ("hann", None), ("hann", 2000)])
def test_noise_has_no_resonance_and_the_reason_is_given(window, segment):
    false = 0
    for seed in range(20):
        noise = Signal(np.random.default_rng(seed).standard_normal(16_000), 20e3, "m/s^2")
        resonance = contact_resonance(
            power_spectrum(noise, segment=segment, window=window), band_hz=BAND
        )
        false += resonance.found
        assert resonance.found or "stands out" in resonance.reason
    assert false == 0


def test_an_undetected_resonance_has_no_values_but_a_floor():
    resonance = contact_resonance(random_periodogram(np.full(FREQUENCY.size, 3.0), 1), band_hz=BAND)
    assert not resonance.found
    assert np.isnan([resonance.crf_hz, resonance.crfa, resonance.crf_std, resonance.crfa_std]).all()
    assert resonance.curve(np.array([3000.0])) == pytest.approx(3.0, rel=0.1)


@pytest.mark.parametrize("f0", [2300.0, 4200.0])
def test_a_line_outside_the_band_is_not_detected_inside(f0):
    density = line_shape(FREQUENCY, f0, 0.03) + 1e-3
    resonance = contact_resonance(random_periodogram(density, 3), band_hz=BAND)
    assert not resonance.found
    assert "edge" in resonance.reason


def test_a_tone_is_not_a_resonance():
    time = np.arange(16_000) / 20e3
    values = np.random.default_rng(0).standard_normal(16_000) + 3.0 * np.sin(
        2 * np.pi * 3000.7 * time
    )
    resonance = contact_resonance(power_spectrum(Signal(values, 20e3, "m/s^2")), band_hz=BAND)
    assert not resonance.found
    assert "tone" in resonance.reason


def test_the_papers_peak_is_the_highest_smoothed_point():
    spectrum = random_periodogram(line_shape(FREQUENCY, 3200.0, 0.02) + 0.01, 4)
    resonance = contact_resonance(spectrum, band_hz=BAND, method="peak")
    smoothed = smooth(spectrum, 3).density
    inside = np.flatnonzero(np.abs(FREQUENCY - np.mean(BAND)) <= np.ptp(BAND) / 2)
    at = inside[np.argmax(smoothed[inside])]
    assert (resonance.crf_hz, resonance.crfa) == (FREQUENCY[at], smoothed[at])
    assert np.isnan([resonance.crf_std, resonance.crfa_std, resonance.damping_ratio]).all()
    assert np.isnan(resonance.curve(FREQUENCY)).all()


def test_invalid_input_is_named():
    spectrum = random_periodogram(np.ones(FREQUENCY.size), 0)
    with pytest.raises(BadInput, match="likelihood, modes, peak"):
        contact_resonance(spectrum, band_hz=BAND, method="kurtosis")
    for band in ((0.0, 100.0), (3000.0, 2000.0), (3000.0, 20e3)):
        with pytest.raises(BadInput, match=r"band must lie between 0 and 9998\.75 Hz"):
            contact_resonance(spectrum, band_hz=band)
    with pytest.raises(BadInput, match="holds 9 spectral lines"):
        contact_resonance(spectrum, band_hz=(3000.0, 3010.0))
    with pytest.raises(BadInput, match="smoothed 2 times"):
        contact_resonance(smooth(spectrum, 2), band_hz=BAND)


def several(lines, seed):
    density = np.full(FREQUENCY.size, 0.02) + sum(
        a * line_shape(FREQUENCY, f, z) for a, f, z in lines
    )
    return random_periodogram(density, seed)


def test_the_strongest_of_several_lines_is_found_and_scatters_as_stated():
    """0.8 s of three lines; the single-line fit merges them into one wide line or fails."""
    lines = [(1.0, 3200.0, 0.02), (0.6, 2800.0, 0.008), (0.5, 3650.0, 0.006)]
    fits = [
        contact_resonance(several(lines, seed), band_hz=BAND, method="modes") for seed in range(25)
    ]
    assert all(fit.found for fit in fits)
    pulls = np.array(
        [
            [(fit.crf_hz - 3200.0) / fit.crf_std, np.log(fit.crfa) * fit.crfa / fit.crfa_std]
            for fit in fits
        ]
    )
    assert np.std(pulls, axis=0) == pytest.approx([1.0, 1.0], abs=0.35)
    assert np.abs(np.mean(pulls, axis=0)) == pytest.approx([0.0, 0.0], abs=0.6)
    inside = np.abs(FREQUENCY - np.mean(BAND)) < np.ptp(BAND) / 2
    truth = sum(a * line_shape(FREQUENCY, f, z) for a, f, z in lines) + 0.02
    assert np.mean(np.abs(fits[0].curve(FREQUENCY[inside]) / truth[inside] - 1.0)) < 0.15


def test_equally_strong_lines_are_not_resolved():
    resonance = contact_resonance(
        several([(1.0, 3200.0, 0.02), (1.0, 2800.0, 0.02)], 0), band_hz=BAND, method="modes"
    )
    assert not resonance.found
    assert "cannot tell" in resonance.reason


def test_both_methods_agree_on_one_line_and_find_none_in_noise():
    spectrum = several([(1.0, 3200.0, 0.02)], 3)
    modes, likelihood = (
        contact_resonance(spectrum, band_hz=BAND, method=method)
        for method in ("modes", "likelihood")
    )
    assert modes.crf_hz == pytest.approx(likelihood.crf_hz, abs=0.2 * likelihood.crf_std)
    assert modes.crf_std == pytest.approx(likelihood.crf_std, rel=0.05)
    noise = [
        contact_resonance(several([], seed), band_hz=BAND, method="modes") for seed in range(25)
    ]
    assert not any(resonance.found for resonance in noise)
    assert "no line stands out" in noise[0].reason


def test_the_sampling_factor_applies_to_the_fit_only():
    spectrum = Spectrum(
        frequency_hz=np.arange(0.0, 5e3, 2.0),
        density=np.ones(2500),
        unit="1/Hz",
        duration_s=1.0,
        segment=5000,
        window="boxcar",
        resolution_hz=2.0,
        averages=1.0,
    )
    with pytest.raises(BadInput, match="to the method likelihood only, got 'peak'"):
        contact_resonance(
            spectrum,
            band_hz=(1e3, 3e3),
            method="peak",
            sampling_factor=lambda f, f0_hz, damping_ratio: f / f,  # noqa: ARG005
        )


def white_in_displacement(seed, *, damping=0.03):
    density = line_shape(FREQUENCY, 3210.0, damping) * (FREQUENCY / 3210.0) ** 4
    return random_periodogram(density, seed)


def behind_a_bilinear_filter(seed, *, damping=0.03):
    spring = ContactOscillator(
        mass=0.1, stiffness=0.1 * (2.0 * np.pi * 3210.0) ** 2, damping_ratio=damping
    )
    noise = FilteredNoise(height=1e-6, cutoff_hz=30.0, filter="bilinear")
    profile = noise.profile(80_000, rate_hz=10e3, seed=seed)
    return power_spectrum(acceleration(spring, profile), segment=5000)


@pytest.mark.parametrize("record", [white_in_displacement, behind_a_bilinear_filter])
def test_an_excitation_that_does_not_fall_with_the_fourth_power_is_fitted(record):
    """With f^-4 assumed, the mean errors are 5.9 deviations (27 Hz high) and -23 (33 Hz low)."""
    found = [contact_resonance(record(seed), band_hz=BAND) for seed in range(6)]
    deviations = [(resonance.crf_hz - 3210.0) / resonance.crf_std for resonance in found]
    assert abs(np.mean(deviations)) < 1.0
    assert np.abs(deviations).max() < 4.0
    assert all("not as f^-4, and was fitted" in resonance.reason for resonance in found)


def test_a_known_excitation_is_stated_and_a_white_one_is_not_fitted():
    stated = contact_resonance(
        white_in_displacement(1), band_hz=BAND, sampling_factor=ExcitationShape((4.0,))
    )
    fitted = contact_resonance(white_in_displacement(1), band_hz=BAND)
    assert stated.crf_hz == pytest.approx(3210.0, abs=3.0 * stated.crf_std)
    assert stated.crf_std < fitted.crf_std
    assert "f^-4" not in stated.reason
    white = [
        contact_resonance(
            random_periodogram(0.05 + line_shape(FREQUENCY, 3210.0, 0.03), seed), band_hz=BAND
        )
        for seed in range(12)
    ]
    assert not any("f^-4" in resonance.reason for resonance in white)


def test_the_slopes_of_a_line_under_a_free_excitation_are_its_derivatives():
    f = np.linspace(2000.0, 5000.0, 40)
    model = _free_excitation_model(f, np.ones((40, 2)), np.ones(1))
    theta = np.array([0.3, np.log(3300.0), np.log(0.03), 2.0, -5.0, 3.0, 0.1, 0.2])
    _, slopes = model(theta)
    for index in range(theta.size):
        step = 1e-6 * (np.arange(theta.size) == index)
        difference = (model(theta + step)[0] - model(theta - step)[0]) / 2e-6
        assert slopes[:, index] == pytest.approx(difference, rel=1e-5, abs=1e-7)
