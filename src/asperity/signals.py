"""A vibration (or profile) sampled in time, and its spectrum: where measured and simulated data meet.

Knows neither machines nor contacts. Finding a resonance in a spectrum is left to `asperity.wear`.
"""

from dataclasses import dataclass, replace

import numpy as np

from asperity.arrays import Field
from asperity.errors import BadInput, require_positive


@dataclass(frozen=True, slots=True)
class Signal:
    """Uniformly sampled values.

    `values` shape (samples,) in `unit` (an SI unit as pint writes it, such as "m/s^2"), `rate_hz` samples a second.
    """

    values: Field
    rate_hz: float
    unit: str

    def __post_init__(self) -> None:
        require_positive("sampling rate", self.rate_hz, "Hz")
        if self.values.ndim != 1 or self.values.size < 2:
            raise BadInput(f"a signal is one row of at least 2 samples, got an array of shape {self.values.shape}")

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

    Parameters
    ----------
    segment : samples in each piece; None takes the record whole (the raw periodogram when `window` is "boxcar")
    window : taper, as scipy.signal.get_window names it

    Raises
    ------
    BadInput
        for values that are not finite, a piece longer than the record or shorter than 8 samples, an unknown window.
    """
    from scipy.signal import get_window, welch

    samples = signal.values.size
    length = samples if segment is None else segment
    if not 8 <= length <= samples:
        raise BadInput(f"a spectrum's segment must have 8 to {samples} samples (the record), got {length}; change it")
    if not np.isfinite(signal.values).all():
        bad = int(np.count_nonzero(~np.isfinite(signal.values)))
        raise BadInput(f"a spectrum needs finite values, got {bad} of {samples} that are not; cut or repair the record")
    try:
        taper = get_window(window, length)
    except ValueError as error:
        raise BadInput(f"spectrum window {window!r} is unknown ({error}); try hann or boxcar") from None

    overlap = 0 if window == "boxcar" else length // 2
    frequency, density = welch(signal.values, signal.rate_hz, window, length, overlap)  # removes each piece's mean
    unit = signal.unit if signal.unit.isalpha() else f"({signal.unit})"
    return Spectrum(
        frequency_hz=frequency,
        density=density,
        unit=f"{unit}^2/Hz",
        duration_s=signal.duration_s,
        segment=length,
        window=window,
        resolution_hz=float(signal.rate_hz * np.sum(taper**2) / np.sum(taper) ** 2),
        averages=_averages(taper, samples, length - overlap),
    )


def _averages(taper: Field, samples: int, step: int) -> float:
    """How many independent ordinates a line is worth: 1 / (n sum w_t^2), w_t the share of sample t in the estimate.

    Var of integral(phi P_hat) = rate integral(phi^2 P^2) sum w_t^2 for a smooth phi, whatever pieces and taper.
    """
    length = taper.size
    energy = taper**2 / np.sum(taper**2)
    starts = np.arange(0, samples - length + 1, step)
    share = np.zeros(samples)
    for start in starts:
        share[start : start + length] += energy / starts.size
    return float(1.0 / (length * np.sum(share**2)))


def smooth(spectrum: Spectrum, passes: int) -> Spectrum:
    """The five-point cubic (Savitzky-Golay 5, 3) run `passes` times over the density; three are the paper's.

    Raises BadInput for fewer than one pass or fewer than 5 lines.
    """
    from scipy.signal import savgol_coeffs, savgol_filter

    if passes < 1:
        raise BadInput(f"smoothing needs at least 1 pass, got {passes}; leave it out for none")
    if spectrum.density.size < 5:
        raise BadInput(f"five-point smoothing needs at least 5 lines, got {spectrum.density.size}; lengthen the record")
    density = spectrum.density
    reach = np.ones(1)
    for _ in range(passes):
        density = savgol_filter(density, 5, 3, mode="interp")
        reach = np.convolve(reach, savgol_coeffs(5, 3))
    return replace(
        spectrum,
        density=density,
        resolution_hz=spectrum.resolution_hz / float(np.sum(reach**2)),
        smoothing_passes=spectrum.smoothing_passes + passes,
    )
