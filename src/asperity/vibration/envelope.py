"""Squared envelope of a frequency band, and its modulation depth at fault frequencies.

`machine` computes these frequencies; `trend` evaluates whether a depth grows.
"""

from collections.abc import Iterable, Iterator, Mapping, Sequence

import numpy as np
import scipy

from asperity.core.arrays import Field
from asperity.core.signals import taper
from asperity.vibration.harmonics import (
    HARMONICS,
    attributed_power,
    separable_harmonics,
    tolerance_hz,
)

CHUNK_S = 4.0  # length of a Fourier transform [s]: lines 0.25 Hz apart
BAND = (0.1, 0.4)  # of the sampling rate: above shafts and meshes, below the anti-alias filter
MIN_SAMPLES = 64  # of an envelope
MIN_LINES = 4.0  # spectral lines below a fault frequency


class Envelope:
    """Spectrum of the squared envelope, accumulated from blocks that pass through `watch`.

    The band is cut out of each chunk's Fourier transform and shifted to 0, so that the envelope
    needs no filter and no more samples than the band is wide. Chunks with a gap are skipped.
    """

    def __init__(self, rate_hz: float) -> None:
        self.rate_hz = rate_hz
        self.chunk = round(CHUNK_S * rate_hz)
        self.total: Field = np.zeros(0)
        self.squares = 0.0
        self.mean = 0.0
        self.chunks = 0
        self.spacing_hz = rate_hz / self.chunk
        self._waiting: list[Field] = []

    def watch(self, blocks: Iterable[Field]) -> Iterator[Field]:
        """Accumulate the blocks and yield them unchanged."""
        for block in blocks:
            self._waiting.append(block)
            self._take(self.chunk)
            yield block
        if self.chunks == 0:
            self._take(1)  # a record shorter than a chunk

    def _take(self, min_size: int) -> None:
        available = sum(block.size for block in self._waiting)
        if available < min_size:
            return
        values = np.concatenate(self._waiting)
        size = self.chunk if available >= self.chunk else available
        count = values.size // size
        for chunk in values[: count * size].reshape(count, size):
            self._add(chunk)
        self._waiting = [values[count * size :]]

    def _add(self, chunk: Field) -> None:
        if not np.isfinite(chunk).all():
            return
        lines = scipy.fft.rfft(chunk - chunk.mean())
        low, high = (round(end * chunk.size) for end in BAND)
        squared = np.abs(scipy.fft.ifft(lines[low:high])) ** 2
        if squared.size < MIN_SAMPLES:
            return
        weights = taper("hann", squared.size)
        spectrum = np.abs(scipy.fft.rfft((squared - squared.mean()) * weights)) ** 2
        self.spacing_hz = self.rate_hz / chunk.size
        self.total = spectrum if self.chunks == 0 else self.total + spectrum
        self.mean += float(squared.mean())
        self.squares = float(np.sum(weights) ** 2)
        self.chunks += 1

    def range_hz(self, samples: int) -> tuple[float, float]:
        """Return the frequency range [Hz] that the envelope resolves for a number of samples."""
        size = min(samples, self.chunk)
        if (BAND[1] - BAND[0]) * size < MIN_SAMPLES:
            return np.inf, 0.0
        return MIN_LINES * self.rate_hz / size, 0.5 * (BAND[1] - BAND[0]) * self.rate_hz

    def depths(self, rates_hz: Mapping[str, float]) -> dict[str, float]:
        """Return the modulation depth (rms over mean) at each frequency [Hz] and its harmonics.

        A harmonic shared by several frequencies counts for the one whose own lines are present. nan
        if the record is too short or the band too narrow for the frequency.
        """
        separable = separable_harmonics(rates_hz, self.spacing_hz)
        return {name: self._depth(rate, separable[name]) for name, rate in rates_hz.items()}

    def _depth(self, rate_hz: float, separable: Sequence[int]) -> float:
        if self.chunks == 0 or rate_hz < MIN_LINES * self.spacing_hz:
            return float("nan")
        powers = [self._power(number * rate_hz) for number in range(1, HARMONICS + 1)]
        mean = self.mean / self.chunks
        if np.isnan(powers[0]) or not mean > 0.0:
            return float("nan")
        power = attributed_power(np.nan_to_num(powers).tolist(), separable)
        return float(np.sqrt(power) / mean)

    def _power(self, frequency_hz: float) -> float:
        """Return the power of the highest line near a frequency; nan beyond the spectrum."""
        centre = frequency_hz / self.spacing_hz
        reach = tolerance_hz(frequency_hz, self.spacing_hz) / self.spacing_hz
        lines = self.total[max(int(np.ceil(centre - reach)), 2) : int(centre + reach) + 1]
        return 2.0 * float(lines.max()) / self.chunks / self.squares if lines.size else np.nan
