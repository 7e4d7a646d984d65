"""Squared envelope of a frequency band, and its modulation depth at the fault rates of a machine.

`machine` computes these rates; `wear` evaluates whether a depth grows.
"""

from collections.abc import Iterable, Iterator, Mapping

import numpy as np
import scipy

from asperity.core.arrays import Field
from asperity.core.signals import taper

CHUNK_S = 4.0  # length of a Fourier transform [s]: lines 0.25 Hz apart
BAND = (0.1, 0.4)  # of the sampling rate: above shafts and meshes, below the anti-alias filter
HARMONICS = 3
SLIP = 0.015  # relative tolerance of a rate: rolling elements slip by 1 to 2 %
MIN_SAMPLES = 64  # of an envelope


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

    def depths(self, rates_hz: Mapping[str, float]) -> dict[str, float]:
        """Return the modulation depth (rms over mean) at each rate [Hz] with its first harmonics.

        nan if the record is too short or the band too narrow for the rate.
        """
        return {name: self._depth(rate) for name, rate in rates_hz.items()}

    def _depth(self, rate_hz: float) -> float:
        if self.chunks == 0 or rate_hz < 4.0 * self.spacing_hz:
            return float("nan")
        power = 0.0
        for harmonic in range(1, HARMONICS + 1):
            centre = harmonic * rate_hz / self.spacing_hz
            reach = max(SLIP * harmonic * rate_hz / self.spacing_hz, 1.0)
            lines = self.total[max(int(np.ceil(centre - reach)), 2) : int(centre + reach) + 1]
            if harmonic == 1 and not lines.size:
                return float("nan")
            if lines.size:
                power += 2.0 * float(lines.max()) / self.chunks / self.squares
        mean = self.mean / self.chunks
        return float(np.sqrt(power) / mean) if mean > 0.0 else float("nan")
