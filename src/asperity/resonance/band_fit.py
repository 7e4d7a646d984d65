"""Fits of a floor and oscillator lines to the search band of one spectrum."""

import math
from collections.abc import Callable
from functools import partial
from typing import NamedTuple

import numpy as np
import scipy

from asperity.core.arrays import Field, Mask
from asperity.core.errors import BadInput
from asperity.core.signals import Spectrum, taper
from asperity.resonance.likelihood_fit import (
    Data,
    DensityModel,
    ParameterBounds,
    SpectrumFit,
    fit_spectrum,
)
from asperity.resonance.resonance import ExcitationShape, SamplingFactor, line_and_slopes

MAX_MODES = 8
START_DAMPINGS = (0.002, 0.007, 0.02, 0.06)
SAMPLING_FACTOR_ITERATIONS = 3  # each reduces the remaining error tenfold
MAX_START_BLOCKS = 512  # of the search for initial guesses
SMALLEST_DAMPING, LARGEST_DAMPING = 1e-5, 0.7  # above 0.7 an oscillator has no peak
MAX_COEFFICIENTS, MAX_COEFFICIENT = 4, 1e3  # of an excitation's shape
# of twice ln likelihood by a further coefficient: a bias below two deviations is not noticed
REFINEMENT_GAIN = 4.0
# BIC difference, "very strong": Kass and Raftery, J. Am. Stat. Assoc. 90 (1995)
STRONG_EVIDENCE = 10.0


class BandData(NamedTuple):
    """Input of a fit: ordinates over their mean, frequencies, and the floor's two columns."""

    data: Data
    scale: float
    frequency: Field
    floors: Field
    floor_only: SpectrumFit

    @property
    def scales(self) -> Field:
        """Factors from fitted to physical height, f0 and damping ratio."""
        return np.array([self.scale, 1.0, 1.0])

    @property
    def bic_penalty(self) -> float:
        """BIC penalty of the three parameters of a line."""
        return 3.0 * float(np.log(max(self.data.weight * self.frequency.size, math.e)))

    def evidence(self, fit: SpectrumFit, cost_without: float) -> float:
        """Return the BIC gained by a line, from -ln likelihood without it."""
        return 2.0 * (cost_without - fit.cost) - self.bic_penalty

    def floor_at_ends(self, floor: Field) -> tuple[float, float]:
        """Return the density of a fitted floor at both ends of the band."""
        return self.scale * float(floor[0]), self.scale * float(floor[1])

    def block_averaged(self, size: int) -> "BandData":
        """Return the band averaged in blocks of `size` lines; the floor fit is not updated."""
        count = self.frequency.size // size

        def mean(values: Field) -> Field:
            return np.asarray(
                values[: count * size].reshape(count, size, *values.shape[1:]).mean(axis=1)
            )

        data = Data(mean(self.data.density), self.data.weight * size)
        return self._replace(data=data, frequency=mean(self.frequency), floors=mean(self.floors))


def band_data(spectrum: Spectrum, inside: Mask, band_hz: tuple[float, float]) -> BandData | None:
    """Return the band's data with the fitted floor; None for a band without vibration."""
    if spectrum.smoothing_passes:
        raise BadInput(
            "the likelihood fit needs an unsmoothed spectrum, got one smoothed "
            f"{spectrum.smoothing_passes} times; pass the spectrum itself or use method='peak'"
        )
    low, high = band_hz
    frequency = spectrum.frequency_hz[inside]
    scale = float(np.mean(spectrum.density[inside]))
    if scale <= 0.0:
        return None
    data = Data(spectrum.density[inside] / scale, spectrum.averages)
    share = (frequency - low) / (high - low)
    floors = np.stack([1.0 - share, share], axis=1)
    return BandData(data, scale, frequency, floors, fit_floor(floors, data, np.ones(2)))


def fit_floor(floors: Field, data: Data, start: Field) -> SpectrumFit:
    """Fit the floor alone."""
    any_floor = ParameterBounds(np.zeros(2), np.full(2, np.inf))
    return fit_spectrum(lambda theta: (floors @ theta, floors), start, any_floor, data)


def fit_line(
    band: BandData,
    spectrum: Spectrum,
    band_hz: tuple[float, float],
    sampling_factor: SamplingFactor | None,
) -> SpectrumFit:
    """Fit a line and floor, started from block averages of several widths.

    The likelihood has a local maximum at every peak of the scatter.
    """
    bounds = _bounds(1, band_hz)
    blocks = band.block_averaged(-(-band.frequency.size // MAX_START_BLOCKS))
    model = _lines_model(blocks.frequency, blocks.floors, np.ones(1))
    starts = _starts(blocks.frequency, blocks.data.density)
    best = min(
        (fit_spectrum(model, start, bounds, blocks.data) for start in starts),
        key=lambda fit: fit.cost,
    )
    leakage = window_leakage(spectrum)
    if sampling_factor is None:
        return fit_spectrum(
            _lines_model(band.frequency, band.floors, leakage), best.parameters, bounds, band.data
        )
    for _ in range(SAMPLING_FACTOR_ITERATIONS):
        at_f0, at_zeta = (float(value) for value in np.exp(best.parameters[1:3]))
        factor = partial(sampling_factor, f0_hz=at_f0, damping_ratio=at_zeta)
        best = fit_spectrum(
            _lines_model(band.frequency, band.floors, leakage, factor),
            best.parameters,
            bounds,
            band.data,
        )
    return best


def fit_line_and_excitation(
    band: BandData, spectrum: Spectrum, band_hz: tuple[float, float], start: SpectrumFit
) -> SpectrumFit:
    """Refit a line and floor under a free excitation, with as many coefficients as BIC supports.

    The parameters are those of the line, the coefficients of `ExcitationShape`, and the floor;
    `start` itself is returned where the excitation is white in acceleration.
    """
    bounds, leakage = _bounds(1, band_hz), window_leakage(spectrum)
    penalty = band.bic_penalty / 3.0
    best = start
    for count in range(1, MAX_COEFFICIENTS + 1):
        if best.parameters.size < count + 3:  # neither of the last two orders helped
            break
        free = np.full(count, MAX_COEFFICIENT)
        missing = count + 5 - best.parameters.size
        trial = fit_spectrum(
            _free_excitation_model(band.frequency, band.floors, leakage),
            np.concatenate([best.parameters[:-2], np.zeros(missing), best.parameters[-2:]]),
            ParameterBounds(np.insert(bounds.lower, 3, -free), np.insert(bounds.upper, 3, free)),
            band.data,
        )
        needed = (
            REFINEMENT_GAIN * missing if best is not start else penalty * missing + STRONG_EVIDENCE
        )
        if trial.converged and 2.0 * (best.cost - trial.cost) > needed:
            best = trial
    return best


def fit_modes(band: BandData, band_hz: tuple[float, float], leakage: Field) -> SpectrumFit:
    """Add lines one by one at the largest excess and refit all of them, while BIC improves."""
    best = band.floor_only
    model = _lines_model(band.frequency, band.floors, leakage)
    for count in range(1, MAX_MODES + 1):
        expected = model(best.parameters)[0]
        trials = []
        for zeta in START_DAMPINGS:
            added = _largest_excess(band, expected, 0.5 * sum(band_hz), zeta)
            start = np.concatenate([best.parameters[:-2], added, best.parameters[-2:]])
            trials.append(fit_spectrum(model, start, _bounds(count, band_hz), band.data))
        trial = min(trials, key=lambda fit: fit.cost)
        if 2.0 * (best.cost - trial.cost) < band.bic_penalty + STRONG_EVIDENCE:
            break
        best = trial
    return best


def _largest_excess(band: BandData, expected: Field, middle_hz: float, zeta: float) -> Field:
    """Return the initial guess of a line where the density most exceeds the expected one."""
    spacing = (band.frequency[-1] - band.frequency[0]) / (band.frequency.size - 1)
    width = min(max(1, round(2.0 * zeta * middle_hz / spacing)), band.frequency.size // 4)
    ratio = scipy.ndimage.uniform_filter1d(band.data.density / expected, width, mode="nearest")
    excess = ratio - 1.0
    highest = int(np.argmax(excess * np.sqrt(width)))
    level = max(float(excess[highest] * expected[highest]), 1e-3)
    return np.array([np.log(level), np.log(band.frequency[highest]), np.log(zeta)])


def _starts(frequency: Field, density: Field) -> list[Field]:
    """Return initial guesses: the highest points of the spectrum averaged over several widths."""
    spacing = (frequency[-1] - frequency[0]) / (frequency.size - 1)
    starts = []
    for zeta in START_DAMPINGS:
        width = max(1, round(2.0 * zeta * float(np.mean(frequency)) / spacing))
        smoothed = scipy.ndimage.uniform_filter1d(
            density, min(width, density.size // 4), mode="nearest"
        )
        floor = float(np.quantile(smoothed, 0.2)) / 2.0
        highest = int(np.argmax(smoothed))
        level = np.log(max(smoothed[highest] - floor, 1e-3))
        starts.append(np.array([level, np.log(frequency[highest]), np.log(zeta), floor, floor]))
    return starts


def _bounds(lines: int, band_hz: tuple[float, float]) -> ParameterBounds:
    """Return bounds of (ln level, ln f0, ln ζ) of each line, and of the floor at both ends."""
    low, high = band_hz
    return ParameterBounds(
        np.array([-30.0, np.log(0.9 * low), np.log(SMALLEST_DAMPING)] * lines + [0.0, 0.0]),
        np.array([30.0, np.log(1.1 * high), np.log(LARGEST_DAMPING)] * lines + [np.inf, np.inf]),
    )


def _lines_model(
    frequency: Field, floors: Field, leakage: Field, factor: Callable[[Field], Field] | None = None
) -> DensityModel:
    """Return a model of the expected density and slopes of any number of lines over the floor.

    Lines are smeared by the window's `leakage`; `factor`, a function of frequency, multiplies them
    and is held constant.
    """
    half_width = leakage.size // 2
    extended = _extended(frequency, half_width)
    factors = None if factor is None else factor(extended)

    def model(theta: Field) -> tuple[Field, Field]:
        level, f0, zeta = np.exp(theta[:-2].reshape(-1, 3, 1)).transpose(1, 0, 2)
        parts = level[:, None] * np.stack(
            line_and_slopes(extended, f0, zeta), axis=1
        )  # (lines, 3, frequencies)
        if factors is not None:
            parts = parts * factors
        if half_width:
            blurred = [
                np.convolve(part, leakage, "valid") for part in parts.reshape(-1, extended.size)
            ]
            parts = np.reshape(blurred, (*parts.shape[:2], frequency.size))
        expected = parts[:, 0].sum(axis=0) + floors @ theta[-2:]
        return expected, np.concatenate([parts.reshape(-1, frequency.size), floors.T]).T

    return model


def _free_excitation_model(frequency: Field, floors: Field, leakage: Field) -> DensityModel:
    """Return a model of a line under an excitation of free slope and curvature, over the floor."""
    extended = _extended(frequency, leakage.size // 2)

    def model(theta: Field) -> tuple[Field, Field]:
        level, f0, zeta = np.exp(theta[:3])
        shape = ExcitationShape(tuple(theta[3:-2]))
        log = np.log(extended / f0)
        line, by_f0, by_zeta = (
            level * shape(extended, f0, zeta) * part for part in line_and_slopes(extended, f0, zeta)
        )
        by_f0 = by_f0 - shape.steepness(log) * line
        powers = [log ** (order + 1) * line for order in range(theta.size - 5)]
        parts = [line, by_f0, by_zeta, *powers]
        if leakage.size > 1:
            parts = [np.convolve(part, leakage, "valid") for part in parts]
        return parts[0] + floors @ theta[-2:], np.concatenate([parts, floors.T]).T

    return model


def _extended(frequency: Field, lines: int) -> Field:
    """Return the frequencies with `lines` more at both ends."""
    spacing = (frequency[-1] - frequency[0]) / (frequency.size - 1)
    return np.asarray(frequency[0] + spacing * np.arange(-lines, frequency.size + lines))


def window_leakage(spectrum: Spectrum) -> Field:
    """Return the window's response on the lines around a tone, normalised to sum 1.

    Exact for a spectrum that is smooth between lines.
    """
    if spectrum.window == "boxcar":
        return np.ones(1)
    weights = taper(spectrum.window, spectrum.segment)
    half = min(8, (spectrum.segment - 1) // 2)
    power = np.abs(scipy.fft.rfft(weights)[: half + 1]) ** 2
    response = np.concatenate([power[:0:-1], power]) / (
        weights.size * float(weights @ weights)
    )  # Parseval
    half_width = int(np.flatnonzero(response[half:] > 1e-4)[-1])
    response = response[half - half_width : half + half_width + 1]
    return np.asarray(response / response.sum())
