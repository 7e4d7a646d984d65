"""A vibration (or profile) sampled in time, and its spectrum: where measured and simulated data meet.

Knows neither machines nor contacts. Finding a resonance in a spectrum is left to `asperity.wear`.
"""

from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np
import scipy

from asperity.core.arrays import Field, Mask
from asperity.core.errors import BadInput, require_positive

SAMPLES_AT_ONCE = 1 << 18  # of a record, transformed together: what stays in a processor's cache
SAMPLES_A_BLOCK = 1 << 15  # filtered together


@dataclass(frozen=True, slots=True)
class Signal:
    """Uniformly sampled values.

    `values` shape (samples,) in `unit` (an SI unit as pint writes it, such as "m/s^2"), `rate_hz`
    samples a second.
    """

    values: Field
    rate_hz: float
    unit: str

    def __post_init__(self) -> None:
        require_positive("sampling rate", self.rate_hz, "Hz")
        if self.values.ndim != 1 or self.values.size < 2:
            raise BadInput(
                f"a signal is one row of at least 2 samples, got an array of shape {self.values.shape}"
            )

    @property
    def duration_s(self) -> float:
        """Length of the record [s]."""
        return self.values.size / self.rate_hz


@dataclass(frozen=True, slots=True, kw_only=True)
class Spectrum:
    """One-sided power spectral density, with all that its figures depend on.

    Parameters
    ----------
    frequency_hz, density : shape (lines,), evenly spaced from 0 to half the sampling rate; density in `unit`
    unit : such as "(m/s^2)^2/Hz"
    duration_s : length of the record behind it [s]
    segment : samples in each averaged piece (all of them: a periodogram)
    window : taper of each piece, as scipy.signal.get_window names it
    resolution_hz : equivalent noise bandwidth of a line [Hz]
    averages : independent periodogram ordinates that each line is worth. 1 for a periodogram without taper, 0.51 for
        one with a Hann taper (neighbouring lines share what they know), about the number of pieces for an average
    smoothing_passes : how often `smooth` ran over it; a smoothed spectrum has no simple statistics any more
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


def power_spectrum(signal: Signal, *, segment: int | None = None, window: str = "hann") -> Spectrum:
    """Power spectral density by Welch's method: means removed, pieces overlapping by half (not at all for a boxcar).

    A piece has `segment` samples; None takes the record whole (the raw periodogram when `window`
    is "boxcar"). `window` is its taper, as scipy.signal.get_window names it. Raises BadInput for
    values that are not finite, a piece longer than the record or shorter than 8 samples, an
    unknown window.
    """
    samples = signal.values.size
    length = samples if segment is None else segment
    if not 8 <= length <= samples:
        raise BadInput(
            f"a spectrum's segment must have 8 to {samples} samples (the record), got {length}; change it"
        )
    if not np.isfinite(signal.values).all():
        bad = int(np.count_nonzero(~np.isfinite(signal.values)))
        raise BadInput(
            f"a spectrum needs finite values, got {bad} of {samples} that are not; cut or repair the record"
        )
    return averaged_spectrum(
        [signal.values], signal.rate_hz, signal.unit, segment=length, window=window
    )


def averaged_spectrum(
    blocks: Iterable[Field], rate_hz: float, unit: str, *, segment: int, window: str = "hann"
) -> Spectrum:
    """The same of a record that comes block by block, each of any length, and need never be in memory whole.

    Pieces with a value that is not finite, such as a gap marked by NaN, are left out. Raises
    BadInput for a record without a single whole piece, a piece shorter than 8 samples, an unknown
    window.
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

    step = segment if window == "boxcar" else segment - segment // 2
    total, complete, samples = _summed_periodograms(blocks, weights, step)
    if not complete.any():
        gaps = " without a gap" if complete.size else ""
        raise BadInput(
            f"a spectrum needs at least one piece of {segment} samples{gaps}, the record has {samples}; "
            "shorten the segment"
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
    """Sum over the pieces of |rfft|^2, which of the pieces were whole, and how many samples there were."""
    segment = weights.size
    many = max(1, SAMPLES_AT_ONCE // segment)
    work = np.empty(
        (many, segment)
    )  # used again and again: fresh memory costs more than the arithmetic
    total = np.zeros(segment // 2 + 1)
    kept: list[Mask] = [np.zeros(0, bool)]
    samples = 0
    waiting: Field = np.empty(0)
    for block in blocks:
        samples += block.size
        waiting = np.concatenate([waiting, block]) if waiting.size else block
        whole = (waiting.size - segment) // step + 1 if waiting.size >= segment else 0
        pieces = (
            np.lib.stride_tricks.sliding_window_view(waiting, segment)[::step]
            if whole
            else waiting[:0, None]
        )
        for first in range(0, whole, many):
            group = pieces[first : min(first + many, whole)]
            means = group.mean(axis=1, keepdims=True)
            finite = np.isfinite(means[:, 0])
            if not finite.all():
                group, means = group[finite], means[finite]
            tapered = np.subtract(group, means, out=work[: group.shape[0]])
            tapered *= weights
            lines = scipy.fft.rfft(tapered, axis=1)
            total += np.einsum("ij,ij->j", lines.real, lines.real) + np.einsum(
                "ij,ij->j", lines.imag, lines.imag
            )
            kept.append(finite)
        waiting = waiting[whole * step :]
    return total, np.concatenate(kept), samples


def _averages(weights: Field, kept: Mask, step: int) -> float:
    """How many independent ordinates a line is worth: 1 / (n sum w_t^2), w_t the share of sample t in the estimate.

    Var of integral(phi P_hat) = rate integral(phi^2 P^2) sum w_t^2 for a smooth phi, whatever
    pieces and taper. The sum runs over pairs of pieces that overlap: those `apart` steps from each
    other share taper_t^2 taper_(t+apart)^2.
    """
    energy = weights**2 / np.sum(weights**2)
    pieces = np.count_nonzero(kept)
    shared = pieces * float(energy @ energy)
    for apart in range(1, -(-weights.size // step)):
        pairs = np.count_nonzero(kept[apart:] & kept[:-apart])
        shared += 2.0 * pairs * float(energy[apart * step :] @ energy[: -apart * step])
    return float(pieces**2 / (weights.size * shared))


def taper(window: str, samples: int) -> Field:
    """The window of a piece, as scipy.signal.get_window names it, which is only loaded for a rarer one."""
    if window == "boxcar":
        return np.ones(samples)
    if window == "hann":
        return np.asarray(0.5 - 0.5 * np.cos(2.0 * np.pi / samples * np.arange(samples)))
    return np.asarray(scipy.signal.get_window(window, samples))


def recursion(numerator: Field, denominator: Field, values: Field) -> Field:
    """What a recursive filter makes of `values`, from rest: a0 y_n + a1 y_(n-1) + ... = b0 x_n + b1 x_(n-1) + ...

    scipy.signal.lfilter, by LAPACK's banded triangles block by block: scipy.signal takes longer to
    load than a record.
    """
    driven: Field = np.convolve(values, numerator)[: values.size] / denominator[0]
    back = denominator[1:] / denominator[0]
    for first in range(0, driven.size, SAMPLES_A_BLOCK):
        block = driven[first : first + SAMPLES_A_BLOCK]
        for ago, weight in enumerate(back if first else (), 1):
            block[:ago] -= weight * driven[first - ago : first][: block.size]
        bands = np.empty((back.size + 1, block.size), order="F")
        bands[:] = np.append(1.0, back)[:, None]
        block[:], _ = scipy.linalg.lapack.dtbtrs(bands, block, uplo="L", diag="U")
    return driven


def smooth(spectrum: Spectrum, passes: int) -> Spectrum:
    """The five-point cubic (Savitzky-Golay 5, 3) run `passes` times over the density; three are the paper's.

    Raises BadInput for fewer than one pass or fewer than 5 lines.
    """
    if passes < 1:
        raise BadInput(f"smoothing needs at least 1 pass, got {passes}; leave it out for none")
    if spectrum.density.size < 5:
        raise BadInput(
            f"five-point smoothing needs at least 5 lines, got {spectrum.density.size}; lengthen the record"
        )
    density, reach = spectrum.density, np.ones(1)
    for _ in range(passes):
        density = scipy.signal.savgol_filter(density, 5, 3, mode="interp")
        reach = np.convolve(reach, scipy.signal.savgol_coeffs(5, 3))
    return replace(
        spectrum,
        density=density,
        resolution_hz=spectrum.resolution_hz / float(np.sum(reach**2)),
        smoothing_passes=spectrum.smoothing_passes + passes,
    )
