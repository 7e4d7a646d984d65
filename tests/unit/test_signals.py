import numpy as np
import pytest
from scipy.signal import get_window, lfilter, welch

from asperity.core.errors import BadInput
from asperity.core.signals import (
    FILTER_BLOCK_SAMPLES,
    Signal,
    Spectrum,
    averaged_spectrum,
    power_spectrum,
    recursion,
    smooth,
    taper,
)


def white(samples: int, seed: int = 0) -> Signal:
    return Signal(np.random.default_rng(seed).standard_normal(samples), 1000.0, "m/s^2")


def impulse_spectrum(index: int, lines: int = 12) -> Spectrum:
    density = np.zeros(lines)
    density[index] = 1.0
    frequency = np.arange(lines, dtype=float)
    return Spectrum(
        frequency_hz=frequency,
        density=density,
        unit="m^2/Hz",
        duration_s=1.0,
        segment=2 * lines - 2,
        window="boxcar",
        resolution_hz=1.0,
        averages=1.0,
    )


@pytest.mark.parametrize(
    ("segment", "window"), [(None, "boxcar"), (None, "hann"), (256, "hann"), (500, "boxcar")]
)
def test_the_spectrum_integrates_to_the_variance(segment, window):
    signal = white(200_000)
    spectrum = power_spectrum(signal, segment=segment, window=window)
    assert np.sum(spectrum.density) * spectrum.spacing_hz == pytest.approx(
        np.var(signal.values), rel=0.02
    )


def test_a_periodogram_obeys_parseval_to_rounding():
    signal = white(4096)
    spectrum = power_spectrum(signal, window="boxcar")
    assert np.sum(spectrum.density) * spectrum.spacing_hz == pytest.approx(
        np.var(signal.values), rel=1e-12
    )
    assert spectrum.averages == pytest.approx(1.0)
    assert spectrum.resolution_hz == pytest.approx(1.0 / signal.duration_s)


def test_a_sine_on_a_line_shows_its_power_over_the_resolution():
    time = np.arange(1000) / 1000.0
    spectrum = power_spectrum(
        Signal(3.0 * np.sin(2 * np.pi * 100.0 * time), 1000.0, "g"), window="hann"
    )
    peak = int(np.argmax(spectrum.density))
    assert spectrum.frequency_hz[peak] == pytest.approx(100.0)
    assert spectrum.density[peak] * spectrum.resolution_hz == pytest.approx(4.5, rel=1e-9)
    assert spectrum.resolution_hz == pytest.approx(1.5)  # the Hann window's 1.5 lines
    assert spectrum.unit == "g^2/Hz"


def test_the_unit_is_squared_as_a_whole():
    assert power_spectrum(white(100)).unit == "(m/s^2)^2/Hz"


@pytest.mark.parametrize(
    ("segment", "window"), [(None, "boxcar"), (None, "hann"), (200, "hann"), (200, "boxcar")]
)
def test_averages_state_the_scatter_of_a_sum_over_lines(segment, window):
    """Mean of n lines of unit white noise has variance 1 / (n averages); 1500 records."""
    means = []
    for seed in range(1500):
        spectrum = power_spectrum(white(2000, seed), segment=segment, window=window)
        inner = spectrum.density[5:-5] / 2e-3
        means.append(np.mean(inner))
    predicted = 1.0 / np.sqrt(inner.size * spectrum.averages)
    assert np.std(means) == pytest.approx(predicted, rel=0.1)


def test_known_averages_of_hann_windows():
    assert power_spectrum(white(4000), window="hann").averages == pytest.approx(
        18.0 / 35.0, rel=1e-3
    )
    many = power_spectrum(white(400_000), segment=1000, window="hann")
    assert many.averages == pytest.approx(
        18.0 / 19.0 * 400, rel=0.01
    )  # half overlap gives 94.7 % of the maximum


ROWS = {
    0: np.array([69, 4, -6, 4, -1]) / 70,
    1: np.array([2, 27, 12, -8, 2]) / 35,
    2: np.array([-3, 12, 17, 12, -3]) / 35,
}


@pytest.mark.parametrize("row", [0, 1, 2])
def test_smoothing_has_the_five_point_cubic_coefficients_to_the_ends(row):
    for column in range(5):
        start = smooth(impulse_spectrum(column), 1).density
        end = smooth(impulse_spectrum(11 - column), 1).density
        assert start[row] == pytest.approx(ROWS[row][column], abs=1e-12)
        assert end[11 - row] == pytest.approx(ROWS[row][column], abs=1e-12)


def test_three_passes_are_applied_in_turn_and_counted():
    spectrum = power_spectrum(white(2000))
    smoothed = smooth(spectrum, 3)
    assert np.array_equal(smoothed.density, smooth(smooth(smooth(spectrum, 1), 1), 1).density)
    assert smoothed.smoothing_passes == 3
    assert smooth(spectrum, 1).resolution_hz == pytest.approx(spectrum.resolution_hz * 35 / 17)


def test_invalid_input_is_refused_by_name():
    with pytest.raises(BadInput, match="8 to 100 samples"):
        power_spectrum(white(100), segment=101)
    with pytest.raises(BadInput, match="'parabola'"):
        power_spectrum(white(100), window="parabola")
    with pytest.raises(BadInput, match="1 of 100"):
        power_spectrum(Signal(np.where(np.arange(100) == 7, np.nan, 1.0), 1.0, "m"))
    with pytest.raises(BadInput, match="at least 1 pass"):
        smooth(power_spectrum(white(100)), 0)


@pytest.mark.parametrize(
    ("samples", "segment", "window"),
    [(1000, 100, "hann"), (1001, 101, "hann"), (999, 64, "boxcar")],
)
def test_a_record_in_blocks_has_the_spectrum_of_the_whole(samples, segment, window):
    values = np.random.default_rng(3).standard_normal(samples) + 5.0
    blocks = [values[:13], values[13:200], values[200:200], values[200:]]
    spectrum = averaged_spectrum(blocks, 10.0, "m", segment=segment, window=window)
    complete = power_spectrum(Signal(values, 10.0, "m"), segment=segment, window=window)
    assert np.allclose(spectrum.density, complete.density, rtol=1e-12)
    overlap = 0 if window == "boxcar" else segment // 2
    frequency, density = welch(values, 10.0, window, segment, overlap)
    assert np.allclose(spectrum.density[1:], density[1:], rtol=1e-12)
    assert np.allclose(spectrum.frequency_hz, frequency, rtol=1e-15)
    assert (spectrum.duration_s, spectrum.averages) == (complete.duration_s, complete.averages)


def test_segments_with_a_gap_are_excluded_from_a_spectrum():
    values = np.random.default_rng(4).standard_normal(1000)
    holed = values.copy()
    holed[310:330] = np.nan
    spectrum = averaged_spectrum([holed], 1.0, "m", segment=100, window="boxcar")
    valid = np.delete(values.reshape(10, 100), 3, axis=0).ravel()
    expected = averaged_spectrum([valid], 1.0, "m", segment=100, window="boxcar")
    assert np.allclose(spectrum.density, expected.density, rtol=1e-12)
    assert spectrum.averages == pytest.approx(9.0)
    with pytest.raises(BadInput, match="without a gap"):
        averaged_spectrum([np.full(500, np.nan)], 1.0, "m", segment=100)


def test_averages_count_the_overlap_of_segments_around_a_gap():
    """1 / (n sum w_t^2), with the weight of each sample summed segment by segment."""
    values = np.random.default_rng(5).standard_normal(1000)
    values[310:330] = np.nan
    spectrum = averaged_spectrum([values], 1.0, "m", segment=100)
    starts = [
        start for start in range(0, 901, 50) if np.isfinite(values[start : start + 100]).all()
    ]
    weight = np.zeros(1000)
    taper = get_window("hann", 100)
    for start in starts:
        weight[start : start + 100] += taper**2 / np.sum(taper**2) / len(starts)
    assert spectrum.averages == pytest.approx(1.0 / (100 * np.sum(weight**2)), rel=1e-12)


@pytest.mark.parametrize(
    "samples", [1, 2, FILTER_BLOCK_SAMPLES - 1, FILTER_BLOCK_SAMPLES, 2 * FILTER_BLOCK_SAMPLES + 1]
)
@pytest.mark.parametrize(
    "filter_", [([0.3], [1.0]), ([0.1, 0.2], [2.0, -1.9]), ([1.0, 0.5, 0.1], [1.0, -1.9, 0.95])]
)
def test_recursion_equals_lfilter(samples, filter_):
    numerator, denominator = map(np.array, filter_)
    values = np.random.default_rng(3).standard_normal(samples)
    expected = lfilter(numerator, denominator, values)
    computed = recursion(numerator, denominator, values)
    np.testing.assert_allclose(
        computed, expected, rtol=1e-10, atol=1e-12 * np.max(np.abs(expected))
    )


@pytest.mark.parametrize("samples", [8, 9, 1000])
def test_tapers_equal_scipys(samples):
    for window in ("hann", "boxcar", "hamming"):
        np.testing.assert_allclose(
            taper(window, samples), get_window(window, samples), rtol=1e-12, atol=1e-15
        )
