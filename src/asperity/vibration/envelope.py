"""The squared envelope of a band, and how deep it is modulated at the rates at which faults of a machine pass.

What those rates are is left to `machine`; whether a depth grows to `wear`.
"""

from collections.abc import Iterable, Iterator, Mapping

import numpy as np
import scipy

from asperity.core.arrays import Field
from asperity.core.signals import taper

CHUNK_S = 4.0  # transformed together: lines a quarter of a hertz apart
BAND = (0.1, 0.4)  # of the sampling rate: above shafts and meshes, below the anti-alias filter
HARMONICS = 3
SLIP = 0.015  # of a rate: rolling elements slip by 1 to 2 %
FEWEST = 64  # samples of an envelope that tell anything


class Envelope:
    """Gathers the spectrum of the squared envelope from blocks as they pass through `watch`.

    The band is cut out of each chunk's Fourier transform and shifted to 0, so that the envelope
    needs no filter and no more samples than the band is wide. Chunks with a gap are left out.
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
        """Pass the blocks on."""
        for block in blocks:
            self._waiting.append(block)
            self._take(self.chunk)
            yield block
        if self.chunks == 0:
            self._take(1)  # a record shorter than a chunk: as long as it is

    def _take(self, least: int) -> None:
        held = sum(block.size for block in self._waiting)
        if held < least:
            return
        values = np.concatenate(self._waiting)
        size = self.chunk if held >= self.chunk else held
        whole = values.size // size
        for chunk in values[: whole * size].reshape(whole, size):
            self._add(chunk)
        self._waiting = [values[whole * size :]]

    def _add(self, chunk: Field) -> None:
        if not np.isfinite(chunk).all():
            return
        lines = scipy.fft.rfft(chunk - chunk.mean())
        low, high = (round(end * chunk.size) for end in BAND)
        squared = np.abs(scipy.fft.ifft(lines[low:high])) ** 2
        if squared.size < FEWEST:
            return
        weights = taper("hann", squared.size)
        spectrum = np.abs(scipy.fft.rfft((squared - squared.mean()) * weights)) ** 2
        self.spacing_hz = self.rate_hz / chunk.size
        self.total = spectrum if self.chunks == 0 else self.total + spectrum
        self.mean += float(squared.mean())
        self.squares = float(np.sum(weights) ** 2)
        self.chunks += 1

    def depths(self, rates_hz: Mapping[str, float]) -> dict[str, float]:
        """How deep the envelope is modulated at each rate [Hz] and its first harmonics: rms over the mean.

        nan where the record is too short or the band too narrow for the rate.
        """
        return {name: self._depth(rate) for name, rate in rates_hz.items()}

    def _depth(self, rate_hz: float) -> float:
        if self.chunks == 0 or rate_hz < 4.0 * self.spacing_hz:
            return float("nan")
        power = 0.0
        for harmonic in range(1, HARMONICS + 1):
            at, reach = (
                harmonic * rate_hz / self.spacing_hz,
                max(SLIP * harmonic * rate_hz / self.spacing_hz, 1.0),
            )
            near = self.total[max(int(np.ceil(at - reach)), 2) : int(at + reach) + 1]
            if harmonic == 1 and not near.size:
                return float("nan")
            if near.size:
                power += 2.0 * float(near.max()) / self.chunks / self.squares
        mean = self.mean / self.chunks
        return float(np.sqrt(power) / mean) if mean > 0.0 else float("nan")
