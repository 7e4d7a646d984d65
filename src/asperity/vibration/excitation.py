"""Excitation under a contact: rough heights in time, as a record and as a spectrum.

There are two sources, filtered noise (the paper's section 2.2) and a surface's spectrum traversed
at a speed, and the average of either over the contact patch. `asperity.coupling` chooses among
them.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Literal, Protocol, TypeAlias, get_args

import numpy as np
import scipy

from asperity.core.arrays import Field
from asperity.core.errors import BadInput, require_choice, require_positive
from asperity.core.signals import Signal, recursion
from asperity.surface import Surface

FilterName: TypeAlias = Literal["continuous", "bilinear"]
HeightAs: TypeAlias = Literal["rms", "ra"]
HeightOf: TypeAlias = Literal["process", "record", "noise"]
PatchShape: TypeAlias = Literal["line", "point"]
RA_TO_RMS = float(np.sqrt(np.pi / 2.0))  # of Gaussian heights
MAX_ORDER = 8


class Excitation(Protocol):
    """Spectrum and records of a profile."""

    def density(self, frequency_hz: Field, rate_hz: float) -> Field:
        """Return the expected one-sided spectrum of records of that sampling rate [m^2/Hz]."""

    def profile(self, samples: int, rate_hz: float, seed: int) -> Signal:
        """Return one record [m], reproducible by its seed."""


@dataclass(frozen=True, kw_only=True)
class NoiseFilter:
    """Butterworth low pass, and the definition of the noise's height.

    Parameters
    ----------
    filter : "continuous", the process sampled without error; "bilinear", the digital filter of the
        same name, started from rest, which the paper must have used. It has no power at rate/2, so
        that a resonance near there is hardly excited
    filter_order : not stated in the paper; 2 reproduces its Table 1
    height_as : "rms" or "ra", the mean absolute height
    height_of : what has that height. "process": the filtered noise on average, so that single
        records scatter about it. "record": this very record is scaled to it, so that the scatter of
        its few slow waves passes to all other frequencies. "noise": the noise before the filter,
        sample by sample; the height behind the filter depends on the rate

    Raises
    ------
    BadInput
        for an order out of range or an unknown name.
    """

    filter: FilterName = "continuous"
    filter_order: int = 2
    height_as: HeightAs = "rms"
    height_of: HeightOf = "process"

    def __post_init__(self) -> None:
        if not 1 <= self.filter_order <= MAX_ORDER:
            raise BadInput(
                f"filter order must be between 1 and {MAX_ORDER}, got {self.filter_order}; the "
                "default is 2"
            )
        require_choice("filter", self.filter, get_args(FilterName))
        require_choice("height_as", self.height_as, get_args(HeightAs))
        require_choice("height_of", self.height_of, get_args(HeightOf))


@dataclass(frozen=True, kw_only=True)
class FilteredNoise(NoiseFilter):
    """Gaussian white noise behind a Butterworth low pass of `cutoff_hz`, with `height` [m].

    `reference_cutoff_hz` is the cut-off [Hz] at which the noise coefficient is set to give that
    height, and then kept: spectra at the resonance grow as cut-off^4 (order 2). None: readjusted at
    each cut-off, ^3. Raises BadInput for a quantity out of range.

    Examples
    --------
    >>> from asperity.vibration import FilteredNoise
    >>> noise = FilteredNoise(height=0.5e-6, cutoff_hz=100.0)
    >>> profile = noise.profile(100_000, rate_hz=10_000.0, seed=1)
    >>> f"rms {profile.values.std() * 1e6:.2f} um"
    'rms 0.49 um'
    """

    height: float
    cutoff_hz: float
    reference_cutoff_hz: float | None = None

    def __post_init__(self) -> None:
        require_positive("profile height", self.height, "m")
        require_positive("profile cut-off", self.cutoff_hz, "Hz")
        if self.reference_cutoff_hz is not None:
            require_positive("reference cut-off", self.reference_cutoff_hz, "Hz")
        super().__post_init__()

    def density(self, frequency_hz: Field, rate_hz: float) -> Field:
        """Return white noise times |H|^2 [m^2/Hz], exact unless records are rescaled.

        |H|^2 = 1 / (1 + (f/fc)^2n), with tan(π f/rate) for f, likewise fc, if bilinear.
        """
        frequency = np.asarray(frequency_hz)
        cutoff = self.cutoff_hz
        if self.filter == "bilinear":
            _require_below_half(cutoff, rate_hz)
            warped = np.tan(np.pi * np.minimum(frequency / rate_hz, 0.5))
            corner = np.tan(np.pi * cutoff / rate_hz)
        else:
            warped, corner = frequency, cutoff
        return np.asarray(
            self._white_density(rate_hz) / (1.0 + (warped / corner) ** (2 * self.filter_order))
        )

    def profile(self, samples: int, rate_hz: float, seed: int) -> Signal:
        """Return a record of `samples` heights [m].

        Raises
        ------
        BadInput
            for a cut-off above rate/2 (bilinear) or rate/10 (continuous), or a record shorter than
            one of its periods.
        """
        for cutoff in {self.cutoff_hz, self.reference_cutoff_hz or self.cutoff_hz}:
            upper_hz = rate_hz / (10.0 if self.filter == "continuous" else 2.0)
            if not rate_hz / samples <= cutoff < upper_hz:
                raise BadInput(
                    f"profile cut-off must be between 1/duration ({rate_hz / samples:g} Hz) and "
                    f"{upper_hz:g} Hz at a sampling rate of {rate_hz:g} Hz, got {cutoff:g} Hz; "
                    "change cut-off law, duration or rate"
                )
        heights = self._filtered(self.cutoff_hz, samples, rate_hz, seed)
        if self.height_of == "record":
            reference = self.reference_cutoff_hz
            scaled_record = (
                heights if reference is None else self._filtered(reference, samples, rate_hz, seed)
            )
            height = (
                np.std(scaled_record)
                if self.height_as == "rms"
                else np.mean(np.abs(scaled_record - np.mean(scaled_record)))
            )
            heights *= self.height / float(height)
        return Signal(heights, rate_hz, "m")

    @property
    def _rms(self) -> float:
        return self.height * (RA_TO_RMS if self.height_as == "ra" else 1.0)

    def _white_density(self, rate_hz: float) -> float:
        """Return the one-sided density of the noise before the filter [m^2/Hz]."""
        if self.height_of == "noise":
            return self._rms**2 * 2.0 / rate_hz
        return self._rms**2 / self._noise_bandwidth(
            self.reference_cutoff_hz or self.cutoff_hz, rate_hz
        )

    def _noise_bandwidth(self, cutoff: float, rate_hz: float) -> float:
        """Return ∫|H|^2 df [Hz]: fc (π/2n) / sin(π/2n), or over the warped axis."""
        quarter = np.pi / (2.0 * self.filter_order)
        if self.filter == "continuous":
            return float(cutoff * quarter / np.sin(quarter))
        _require_below_half(cutoff, rate_hz)
        corner = np.tan(np.pi * cutoff / rate_hz)

        def integrand(t: float) -> float:  # t = tan(π f/rate) over the corner's
            return float(1.0 / ((1.0 + (t * corner) ** 2) * (1.0 + t ** (2 * self.filter_order))))

        quad = scipy.integrate.quad
        area = quad(integrand, 0.0, 1.0)[0] + quad(lambda u: integrand(1.0 / u) / u**2, 0.0, 1.0)[0]
        return float(rate_hz / np.pi * corner * area)

    def _filtered(self, cutoff: float, samples: int, rate_hz: float, seed: int) -> Field:
        """Return noise behind the filter at `cutoff`, before any rescaling of the record."""
        white_density = self._white_density(rate_hz)
        if self.filter == "bilinear":
            sections = scipy.signal.butter(self.filter_order, cutoff, fs=rate_hz, output="sos")
            white = white_noise(samples, seed) * np.sqrt(white_density * rate_hz / 2.0)
            return np.asarray(scipy.signal.sosfilt(sections, white))
        if self.filter_order == 2:
            rms = float(np.sqrt(white_density * self._noise_bandwidth(cutoff, rate_hz)))
            return _butterworth_noise(samples, cutoff / rate_hz, rms, seed)
        source = replace(
            self, cutoff_hz=cutoff, reference_cutoff_hz=self.reference_cutoff_hz or self.cutoff_hz
        )
        return synthesise(source, samples, rate_hz, seed)


def white_noise(samples: int, seed: int) -> Field:
    """Return independent Gaussian samples of variance 1, as in the paper's Fig 3a.

    Examples
    --------
    >>> from asperity.vibration import white_noise
    >>> round(float(white_noise(100_000, seed=1).std()), 1)
    1.0
    """
    return np.random.default_rng(seed).standard_normal(samples)


def _require_below_half(cutoff: float, rate_hz: float) -> None:
    if cutoff >= rate_hz / 2.0:
        raise BadInput(
            f"a digital filter's cut-off must be below rate/2, {rate_hz / 2.0:g} Hz, got "
            f"{cutoff:g} Hz"
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class SurfaceTrack:
    """Profile of a surface traversed at a speed: S(f) = Φ(f/v)/v.

    `wavenumber` [cycles/m] evenly spaced from 0 and `spectrum` Φ [m^3], one-sided, both of shape
    (lines,); `speed` v [m/s]. Φ is linear between the lines and 0 above the last, since the map
    contains nothing shorter than two pixels. Records are Gaussian and of any length; they have the
    surface's spectrum, not its shapes.
    """

    wavenumber: Field
    spectrum: Field
    speed: float

    def __post_init__(self) -> None:
        require_positive("speed at which the surface passes", self.speed, "m/s")

    @classmethod
    def from_surface(cls, surface: Surface, speed: float) -> "SurfaceTrack":
        """Return the track with the mean spectrum of the surface's profiles along rolling.

        Hann-tapered: line width 1.5 over the length.
        """
        if surface.sq == 0.0:
            raise BadInput(
                "a flat surface excites no vibration; give it a roughness or use filtered noise"
            )
        heights = surface.heights - np.mean(surface.heights)
        spacing = surface.grid.spacing[0]
        wavenumber, spectra = scipy.signal.periodogram(
            heights, 1.0 / spacing, "hann", detrend=False, axis=0
        )
        return cls(wavenumber=wavenumber, spectrum=np.mean(spectra, axis=1), speed=speed)

    def density(self, frequency_hz: Field, rate_hz: float) -> Field:  # noqa: ARG002 - the same at any rate
        """Return Φ(f/v)/v [m^2/Hz]."""
        wavenumbers = np.asarray(frequency_hz) / self.speed
        return np.asarray(
            np.interp(wavenumbers, self.wavenumber, self.spectrum, right=0.0) / self.speed
        )

    def profile(self, samples: int, rate_hz: float, seed: int) -> Signal:
        """Return a Gaussian record with that spectrum [m]."""
        return Signal(synthesise(self, samples, rate_hz, seed), rate_hz, "m")


@dataclass(frozen=True, slots=True, kw_only=True)
class PatchAverage:
    """Excitation averaged over the contact patch, weighted by Hertz's pressure.

    Waves of k = 2π f/v pass the patch of half-width a [m]: their height shrinks by 2 J1(ka)/(ka) in
    a line contact (`shape` "line"), by 3 (sin ka - ka cos ka)/(ka)^3 in a round one ("point").
    """

    source: Excitation
    shape: PatchShape
    half_width: float
    speed: float

    def __post_init__(self) -> None:
        require_positive("half-width of the contact patch", self.half_width, "m")
        require_positive("speed at which the surface passes", self.speed, "m/s")
        require_choice("contact patch", self.shape, PATCHES)

    def weight(self, frequency_hz: Field) -> Field:
        """Return the factor on a wave's height, 1 at 0 Hz, with its sign."""
        ka = 2.0 * np.pi * np.asarray(frequency_hz) * self.half_width / self.speed
        return np.asarray(PATCHES[self.shape](np.maximum(ka, 1e-6)))

    def density(self, frequency_hz: Field, rate_hz: float) -> Field:
        """Return the density of the source times the weight squared [m^2/Hz]."""
        return np.asarray(
            self.source.density(frequency_hz, rate_hz) * self.weight(frequency_hz) ** 2
        )

    def profile(self, samples: int, rate_hz: float, seed: int) -> Signal:
        """Return the averaged record of the source [m]."""
        # margin at both ends, longer than the patch
        reach = int(np.ceil(4.0 * self.half_width / self.speed * rate_hz)) + 64
        heights = self.source.profile(samples + 2 * reach, rate_hz, seed).values
        length = scipy.fft.next_fast_len(heights.size, real=True)
        weight = self.weight(scipy.fft.rfftfreq(length, 1.0 / rate_hz))
        averaged = scipy.fft.irfft(scipy.fft.rfft(heights, length) * weight, length)
        return Signal(np.ascontiguousarray(averaged[reach : reach + samples]), rate_hz, "m")


# factor on a wave's height for ka > 0
PATCHES: dict[PatchShape, Callable[[Field], Field]] = {
    "line": lambda ka: 2.0 * scipy.special.j1(ka) / ka,
    "point": lambda ka: 3.0 * scipy.special.spherical_jn(1, ka) / ka,
}


def synthesise(source: Excitation, samples: int, rate_hz: float, seed: int) -> Field:
    """Return Gaussian heights with the source's spectrum.

    Random waves on the lines of a record a quarter longer, cut off: the result is not periodic, as
    no real record is. Power above rate/2 is omitted, not folded.
    """
    length = scipy.fft.next_fast_len(samples + samples // 4, real=True)
    frequency = scipy.fft.rfftfreq(length, 1.0 / rate_hz)
    density = source.density(frequency, rate_hz)
    waves = white_noise(2 * frequency.size, seed).view(complex)
    waves *= np.sqrt(density * (rate_hz * length / 4.0))
    waves[0] = 0.0
    return np.ascontiguousarray(scipy.fft.irfft(waves, length, overwrite_x=True)[:samples])


def _butterworth_noise(samples: int, cutoff: float, rms: float, seed: int) -> Field:
    """Return samples of y'' + √2 ω y' + ω^2 y = white noise with standard deviation `rms`.

    `cutoff` is in cycles per sample.
    """
    omega = 2.0 * np.pi * cutoff
    numerator, denominator = _butterworth_recursion(omega)
    # 12 time constants: the initial state has decayed to e^-12
    settling = int(np.ceil(12.0 * np.sqrt(2.0) / omega))
    white = white_noise(settling + samples, seed)
    # unit white noise would give the variance 1 / (2 √2 ω^3)
    to_rms = rms * np.sqrt(2.0 * np.sqrt(2.0) * omega**3)
    return np.asarray(to_rms * recursion(numerator, denominator, white)[settling:])


def _butterworth_recursion(omega: float) -> tuple[Field, Field]:
    """Return the ARMA(2, 1) series of one white noise that samples y'' + √2 ω y' + ω^2 y.

    State x = (y, y') obeys x⁺ = A x + e with cov e = Q (Van Loan 1978).
    """
    drift = np.array([[0.0, 1.0], [-(omega**2), -np.sqrt(2.0) * omega]])
    exponential = scipy.linalg.expm(
        np.block([[-drift, np.diag([0.0, 1.0])], [np.zeros((2, 2)), drift.T]])
    )
    step = exponential[2:, 2:].T
    noise = step @ exponential[:2, 2:]
    # y_n - tr(A) y_(n-1) + det(A) y_(n-2) = e1_(n-1) + (A12 e2 - A22 e1)_(n-2): its variance and
    # neighbour covariance ...
    back = np.array([-step[1, 1], step[0, 1]])
    variance = noise[0, 0] + back @ noise @ back
    neighbour = back @ noise[:, 0]
    # ... equal those of b0 w_n + b1 w_(n-1)
    plus = np.sqrt(variance + 2.0 * neighbour)
    minus = np.sqrt(variance - 2.0 * neighbour)
    return np.array([plus + minus, plus - minus]) / 2.0, np.array(
        [1.0, -np.trace(step), np.linalg.det(step)]
    )
