"""Sampled signals and their power spectra, common to measured and simulated data.

`asperity.resonance` finds resonances in the spectra.
"""

from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np
import scipy

from asperity.core.arrays import Field, Mask, usual_float_errors
from asperity.core.displayed import Brief, Displayed
from asperity.core.errors import BadInput, require_positive

OVERLAP = 0.5  # of successive segments, over their length; a boxcar has none
FFT_BATCH_SAMPLES = 1 << 18  # transformed together, so that they fit the processor's cache
FILTER_BLOCK_SAMPLES = 1 << 15  # filtered together


@dataclass(frozen=True, slots=True, repr=False)
class Signal(Brief):
    """Uniformly sampled values.

    `values` has shape (samples,), in `unit` (an SI unit in pint's notation, such as "m/s^2");
    `rate_hz` is the sampling rate [Hz].

    Examples
    --------
    >>> import numpy as np
    >>> from asperity.core.signals import Signal
    >>> time = np.arange(1000) / 1000.0
    >>> signal = Signal(np.sin(2.0 * np.pi * 50.0 * time), rate_hz=1000.0, unit="m/s^2")
    >>> f"{signal.duration_s} s, rms {signal.values.std():.3f} {signal.unit}"
    '1.0 s, rms 0.707 m/s^2'
    """

    values: Field
    rate_hz: float
    unit: str

    def __post_init__(self) -> None:
        require_positive("sampling rate", self.rate_hz, "Hz")
        if self.values.ndim != 1 or self.values.size < 2:
            raise BadInput(
                "a signal is one row of at least 2 samples, got an array of shape "
                f"{self.values.shape}"
            )

    @property
    def duration_s(self) -> float:
        """Length of the record [s]."""
        return self.values.size / self.rate_hz


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class Spectrum(Displayed):
    """One-sided power spectral density and its estimation settings.

    Parameters
    ----------
    frequency_hz, density : shape (lines,), evenly spaced from 0 to half the sampling rate; density
        in `unit`
    unit : such as "(m/s^2)^2/Hz"
    duration_s : length of the record [s]
    segment : samples of an averaged segment (the whole record: a periodogram)
    window : taper of a segment, by its name in scipy.signal.get_window
    resolution_hz : equivalent noise bandwidth of a line [Hz]
    averages : equivalent number of independent periodogram ordinates per line: 1 for a periodogram
        without taper, 0.51 with a Hann taper (neighbouring lines are correlated), about the number
        of segments for an average
    smoothing_passes : passes of `smooth`; lines of a smoothed spectrum are correlated
    """

    frequency_hz: Field
    density: Field
    unit: str
    duration_s: float
    segment: int
    window: str
    resolution_hz: float
    averages: float
    smoothing_passes: int = 0

    @property
    def spacing_hz(self) -> float:
        """Distance between neighbouring lines [Hz]."""
        return float(self.frequency_hz[1] - self.frequency_hz[0])


@usual_float_errors
def power_spectrum(signal: Signal, *, segment: int | None = None, window: str = "hann") -> Spectrum:
    """Estimate the power spectral density by Welch's method.

    The mean of each segment is removed; segments overlap by half (not at all for a boxcar).

    Parameters
    ----------
    signal : finite values
    segment : samples of a segment; None: the whole record
    window : taper by its name in scipy.signal.get_window; "boxcar" without `segment` gives the raw
        periodogram

    Raises
    ------
    BadInput
        Values are not finite, the segment is longer than the record or shorter than 8 samples, or
        the window is unknown.

    Examples
    --------
    >>> import numpy as np
    >>> from asperity.core.signals import Signal, power_spectrum
    >>> noise = np.random.default_rng(1).standard_normal(20_000)
    >>> spectrum = power_spectrum(Signal(noise, rate_hz=2000.0, unit="m/s^2"), segment=500)
    >>> f"resolution {spectrum.resolution_hz:.1f} Hz, mean {spectrum.density.mean() * 1e3:.2f}e-3"
    'resolution 6.0 Hz, mean 0.99e-3'
    """
    samples = signal.values.size
    length = samples if segment is None else segment
    if not 8 <= length <= samples:
        raise BadInput(
            f"a spectrum's segment must have 8 to {samples} samples (the record), got {length}; "
            "change it"
        )
    if not np.isfinite(signal.values).all():
        bad = int(np.count_nonzero(~np.isfinite(signal.values)))
        raise BadInput(
            f"a spectrum needs finite values, got {bad} of {samples} that are not; cut or repair "
            "the record"
        )
    return averaged_spectrum(
        [signal.values], signal.rate_hz, signal.unit, segment=length, window=window
    )


def averaged_spectrum(
    blocks: Iterable[Field], rate_hz: float, unit: str, *, segment: int, window: str = "hann"
) -> Spectrum:
    """Estimate the power spectral density of a record read in blocks of any length.

    Segments with a value that is not finite, such as a gap marked by nan, are skipped. Raises
    BadInput for a record without a complete segment, a segment shorter than 8 samples or an
    unknown window.

    Examples
    --------
    >>> import numpy as np
    >>> from asperity.core.signals import averaged_spectrum
    >>> blocks = np.random.default_rng(1).standard_normal((4, 1000))
    >>> spectrum = averaged_spectrum(blocks, rate_hz=1000.0, unit="m/s^2", segment=500)
    >>> f"{spectrum.averages:.1f} independent segments"
    '7.1 independent segments'
    """
    require_positive("sampling rate", rate_hz, "Hz")
    if segment < 8:
        raise BadInput(
            f"a spectrum's segment must have at least 8 samples, got {segment}; change it"
        )
    try:
        weights = taper(window, segment)
    except ValueError as error:
        raise BadInput(
            f"spectrum window {window!r} is unknown ({error}); try hann or boxcar"
        ) from None

    step = segment if window == "boxcar" else segment - int(OVERLAP * segment)
    total, complete, samples = _summed_periodograms(blocks, weights, step)
    if not complete.any():
        gaps = " without a gap" if complete.size else ""
        raise BadInput(
            f"a spectrum needs at least one segment of {segment} samples{gaps}, the record has "
            f"{samples}; shorten the segment"
        )
    density = 2.0 * total / (np.count_nonzero(complete) * rate_hz * np.sum(weights**2))
    density[0] /= 2.0
    if segment % 2 == 0:
        density[-1] /= 2.0
    return Spectrum(
        frequency_hz=np.arange(segment // 2 + 1) * (rate_hz / segment),
        density=density,
        unit=f"{unit if unit.isalpha() else f'({unit})'}^2/Hz",
        duration_s=samples / rate_hz,
        segment=segment,
        window=window,
        resolution_hz=float(rate_hz * np.sum(weights**2) / np.sum(weights) ** 2),
        averages=_averages(weights, complete, step),
    )


def _summed_periodograms(
    blocks: Iterable[Field], weights: Field, step: int
) -> tuple[Field, Mask, int]:
    """Return the sum of |rfft|^2 over the segments, the mask of complete ones and the samples."""
    segment = weights.size
    batch = max(1, FFT_BATCH_SAMPLES // segment)
    work = np.empty((batch, segment))  # reused: allocation costs more than the arithmetic
    total = np.zeros(segment // 2 + 1)
    complete: list[Mask] = [np.zeros(0, bool)]
    samples = 0
    pending: Field = np.empty(0)
    for block in blocks:
        samples += block.size
        pending = np.concatenate([pending, block]) if pending.size else block
        count = (pending.size - segment) // step + 1 if pending.size >= segment else 0
        segments = (
            np.lib.stride_tricks.sliding_window_view(pending, segment)[::step]
            if count
            else pending[:0, None]
        )
        for first in range(0, count, batch):
            group = segments[first : min(first + batch, count)]
            power, finite = _batch_periodogram(group, weights, work)
            total += power
            complete.append(finite)
        pending = pending[count * step :]
    return total, np.concatenate(complete), samples


def _batch_periodogram(segments: Field, weights: Field, work: Field) -> tuple[Field, Mask]:
    """Return the sum of |rfft|^2 over complete segments, and their mask; overwrites `work`."""
    means = segments.mean(axis=1, keepdims=True)
    finite = np.isfinite(means[:, 0])
    if not finite.all():
        segments, means = segments[finite], means[finite]
    tapered = np.subtract(segments, means, out=work[: segments.shape[0]])
    tapered *= weights
    lines = scipy.fft.rfft(tapered, axis=1)
    real, imaginary = (np.einsum("ij,ij->j", part, part) for part in (lines.real, lines.imag))
    return real + imaginary, finite


def _averages(weights: Field, complete: Mask, step: int) -> float:
    """Return the equivalent number of independent ordinates per line, 1 / (n sum w_t^2).

    w_t is the weight of sample t in the estimate. Var of integral(phi P_hat) =
    rate integral(phi^2 P^2) sum w_t^2 for a smooth phi, for any segments and taper. The sum runs
    over pairs of overlapping segments: those `lag` steps apart contribute
    taper_t^2 taper_(t+lag)^2.
    """
    energy = weights**2 / np.sum(weights**2)
    segments = np.count_nonzero(complete)
    overlap = segments * float(energy @ energy)
    for lag in range(1, -(-weights.size // step)):
        pairs = np.count_nonzero(complete[lag:] & complete[:-lag])
        overlap += 2.0 * pairs * float(energy[lag * step :] @ energy[: -lag * step])
    return float(segments**2 / (weights.size * overlap))


def taper(window: str, samples: int) -> Field:
    """Return the window of a segment, by its name in scipy.signal.get_window (a slow import).

    Examples
    --------
    >>> from asperity.core.signals import taper
    >>> taper("hann", 4)
    array([0. , 0.5, 1. , 0.5])
    """
    if window == "boxcar":
        return np.ones(samples)
    if window == "hann":
        return np.asarray(0.5 - 0.5 * np.cos(2.0 * np.pi / samples * np.arange(samples)))
    return np.asarray(scipy.signal.get_window(window, samples))


def recursion(numerator: Field, denominator: Field, values: Field) -> Field:
    """Apply a recursive filter from rest: a0 y_n + a1 y_(n-1) + ... = b0 x_n + b1 x_(n-1) + ...

    Equals scipy.signal.lfilter, solved by LAPACK's banded triangular solver block by block, because
    importing scipy.signal takes longer than filtering a record.

    Examples
    --------
    >>> import numpy as np
    >>> from asperity.core.signals import recursion
    >>> recursion(np.array([1.0]), np.array([1.0, -0.5]), np.array([1.0, 0.0, 0.0]))
    array([1.  , 0.5 , 0.25])
    """
    driven: Field = np.convolve(values, numerator)[: values.size] / denominator[0]
    feedback = denominator[1:] / denominator[0]
    for first in range(0, driven.size, FILTER_BLOCK_SAMPLES):
        block = driven[first : first + FILTER_BLOCK_SAMPLES]
        for lag, weight in enumerate(feedback if first else (), 1):
            block[:lag] -= weight * driven[first - lag : first][: block.size]
        bands = np.empty((feedback.size + 1, block.size), order="F")
        bands[:] = np.append(1.0, feedback)[:, None]
        block[:], _ = scipy.linalg.lapack.dtbtrs(bands, block, uplo="L", diag="U")
    return driven


def smooth(spectrum: Spectrum, passes: int) -> Spectrum:
    """Smooth the density `passes` times with the five-point cubic filter (Savitzky-Golay 5, 3).

    The paper uses three passes. Raises BadInput for fewer than one pass or fewer than 5 lines.

    Examples
    --------
    >>> import numpy as np
    >>> from asperity.core.signals import Signal, power_spectrum, smooth
    >>> noise = np.random.default_rng(1).standard_normal(20_000)
    >>> spectrum = power_spectrum(Signal(noise, rate_hz=2000.0, unit="m/s^2"), segment=500)
    >>> smooth(spectrum, passes=3).smoothing_passes
    3
    """
    if passes < 1:
        raise BadInput(f"smoothing needs at least 1 pass, got {passes}; leave it out for none")
    if spectrum.density.size < 5:
        raise BadInput(
            f"five-point smoothing needs at least 5 lines, got {spectrum.density.size}; use a "
            "longer record"
        )
    density = spectrum.density
    response = np.ones(1)
    for _ in range(passes):
        density = scipy.signal.savgol_filter(density, 5, 3, mode="interp")
        response = np.convolve(response, scipy.signal.savgol_coeffs(5, 3))
    return replace(
        spectrum,
        density=density,
        resolution_hz=spectrum.resolution_hz / float(np.sum(response**2)),
        smoothing_passes=spectrum.smoothing_passes + passes,
    )
