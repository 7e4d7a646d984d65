"""Check of a recording: length, gaps, clipping, offset, and a machine that was off.

Only sample statistics are used, gathered while blocks pass to the spectrum.
"""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from math import ceil

import numpy as np
from numpy.typing import NDArray

from asperity.core.arrays import Field, Mask
from asperity.recording.model import UNKNOWN, OpenRecording

QUIET = 0.01  # m/s^2 rms: an accelerometer's noise
QUIET_STEPS = 1.5  # standard deviation in converter steps below which only the last digit changes
CLIPPED_RUN = 3  # equal extreme samples in a row that count as clipping
CLIPPED_SHARE = 1e-3  # above which CRFA is too low
HEIGHT_BINS = 1024  # bins of the histogram of heights
TOP_FROM, COMPARED_FROM = (
    0.95,
    0.85,
)  # of the largest value: the top bins, and those compared with them
PILED_DENSITY_RATIO = (
    1.5  # density at the top over that below it; unclipped signals are sparser at the top
)
FEWEST_TOP_SAMPLES = 50  # samples
STUCK_RUN = 50  # equal samples in a row that count as stuck
LARGEST_STUCK_SHARE = 0.5  # of the samples, above which the recording is refused
OFFSET_RATIO = 3.0  # mean over rms above which the offset takes up the converter's range
FEWEST_WIDTHS = 16  # duration times half-power width that the detection of a line needs
USABLE_BAND = 0.4  # of the sampling rate; the anti-alias filter cuts above


@dataclass(frozen=True, slots=True, kw_only=True)
class Quality:
    """Sample statistics of a recording, and its faults.

    `rms` (about the mean), `peak` (from the mean), `offset` in the recording's unit; `kurtosis` is
    3 for Gaussian noise; `missing`, `clipped`, `stuck` are shares of the samples, 0 to 1. `faults`
    are sentences that exclude the recording from use, `remarks` sentences that qualify its numbers.
    """

    samples: int
    duration_s: float
    rms: float
    peak: float
    offset: float
    kurtosis: float
    missing: float
    gaps: int
    clipped: float
    stuck: float
    off: bool
    faults: tuple[str, ...]
    remarks: tuple[str, ...]

    @property
    def dead(self) -> bool:
        """True where the machine was off or the sensor is stuck."""
        return self.off or self.stuck > LARGEST_STUCK_SHARE

    @property
    def crest(self) -> float:
        """Peak over rms; nan for a constant signal."""
        return self.peak / self.rms if self.rms > 0.0 else np.nan

    @property
    def usable(self) -> bool:
        """True where no fault excludes the recording."""
        return not self.faults


def _central_sums(values: Field, mean: float) -> Iterator[float]:
    """Yield the sums of the second to fourth powers about the mean."""
    centred = values - mean
    square = centred**2
    for pair in ((centred, centred), (square, centred), (square, square)):
        yield float(np.einsum("i,i->", *pair))  # not by BLAS, which would start its threads


class SampleStatistics:
    """Statistics of blocks, gathered as they pass through `pass_through`."""

    def __init__(self) -> None:
        self.samples = self.finite = self.gaps = self.clipped_low = self.clipped_high = (
            self.stuck
        ) = 0
        self.mean = self.squares = self.cubes = self.fourths = 0.0  # sums of powers about the mean
        self.low, self.high = np.inf, -np.inf
        self.step: float | None = None
        self._heights: NDArray[np.int64] = np.zeros((2, HEIGHT_BINS), dtype=np.int64)
        self._top = 0.0
        self._centre: float | None = None
        self._last = np.zeros(0)
        self._in_gap = False
        self._run = 0

    def pass_through(self, blocks: Iterable[Field]) -> Iterator[Field]:
        """Yield the blocks unchanged and add them to the statistics."""
        for block in blocks:
            if block.size:
                self._add(block)
            yield block

    def _add(self, block: Field) -> None:
        self.samples += block.size
        mean = float(block.mean())
        if np.isfinite(mean):
            values, new_gaps = block, 0
            self._in_gap = False
        else:
            finite = np.isfinite(block)
            edges = np.flatnonzero(finite[:-1] & ~finite[1:]).size
            new_gaps = edges + (not finite[0] and not self._in_gap)
            self._in_gap = not bool(finite[-1])
            values = block[finite]
            mean = float(values.mean()) if values.size else 0.0
        self.gaps += new_gaps
        if not values.size:
            return
        self._add_moments(values, mean)
        self._update_extremes(values)
        self._count_heights(values, mean)
        self._count_stuck(values)
        if self.step is None:
            self.step = _converter_step(values[: 1 << 16])

    def _add_moments(self, values: Field, mean: float) -> None:
        """Merge the block's central moments (Pébay, Sandia report SAND2008-6212)."""
        squares, cubes, fourths = _central_sums(values, mean)
        before, added = self.finite, values.size
        total = before + added
        distance = mean - self.mean
        self.fourths += (
            fourths
            + distance**4 * before * added * (before**2 - before * added + added**2) / total**3
            + 6.0 * distance**2 * (before**2 * squares + added**2 * self.squares) / total**2
            + 4.0 * distance * (before * cubes - added * self.cubes) / total
        )
        self.cubes += (
            cubes
            + distance**3 * before * added * (before - added) / total**2
            + 3.0 * distance * (before * squares - added * self.squares) / total
        )
        self.squares += squares + distance**2 * before * added / total
        self.mean += distance * added / total
        self.finite = total

    def _update_extremes(self, values: Field) -> None:
        low = float(values.min())
        high = float(values.max())
        if low < self.low:
            self.low, self.clipped_low = low, 0
        if high > self.high:
            self.high, self.clipped_high = high, 0
        if low == self.low:
            self.clipped_low += _samples_in_runs(values == low)
        if high == self.high:
            self.clipped_high += _samples_in_runs(values == high)

    def _count_heights(self, values: Field, mean: float) -> None:
        """Count heights above and below the first mean, in bins that grow with the largest one."""
        if self._centre is None:
            self._centre = mean
        heights = values - self._centre
        highest = float(np.abs(heights).max())
        self._top = self._top or highest
        while highest > self._top > 0.0:
            halves = self._heights.reshape(2, -1, 2).sum(axis=2)
            self._heights = np.concatenate([halves, np.zeros_like(halves)], axis=1)
            self._top *= 2.0
        if self._top > 0.0:
            for side, over in enumerate((heights[heights > 0.0], -heights[heights < 0.0])):
                step = np.minimum(
                    (over * (HEIGHT_BINS / self._top)).astype(np.int64), HEIGHT_BINS - 1
                )
                self._heights[side] += np.bincount(step, minlength=HEIGHT_BINS)

    @property
    def piled(self) -> bool:
        """True if amplitudes accumulate near an extreme: soft clipping, or a pure tone."""
        return any(_is_piled(side) for side in self._heights)

    def without_stuck(self, blocks: Iterable[Field]) -> Iterator[Field]:
        """Yield the blocks with stuck stretches as missing: samples were lost, and held or filled.

        Held values raise the spectrum below the inverse of their length, and regular ones cause
        lines. A block that is mostly stuck is passed unchanged and refused by `quality`.
        """
        for block in blocks:
            stuck_mask = _stuck_samples(block)
            yield (
                block
                if stuck_mask is None or stuck_mask.mean() > LARGEST_STUCK_SHARE
                else np.where(stuck_mask, np.nan, block)
            )

    def _count_stuck(self, values: Field) -> None:
        """Count the samples of stuck stretches."""
        stuck_mask = _stuck_samples(values)
        if stuck_mask is not None:
            self.stuck += int(stuck_mask.sum())

    def quality(
        self,
        recording: OpenRecording,
        *,
        width_hz: float | None,
        band_hz: tuple[float, float] | None,
    ) -> Quality:
        """Judge the statistics for a resonance `width_hz` wide (half power) within `band_hz`."""
        off = _off(self._rms, self.step, comparable=recording.comparable) if self.finite else False
        missing = (self.samples - self.finite) / max(self.samples, 1)
        return Quality(
            samples=self.samples,
            duration_s=self.samples / recording.rate_hz,
            rms=self._rms,
            peak=max(self.high - self.mean, self.mean - self.low) if self.finite else 0.0,
            offset=self.mean,
            kurtosis=self.finite * self.fourths / self.squares**2 if self.squares > 0.0 else np.nan,
            missing=missing,
            gaps=self.gaps,
            clipped=self._clipped,
            stuck=self.stuck / max(self.finite, 1),
            off=off,
            faults=tuple(self._faults(recording, off, missing, width_hz, band_hz)),
            remarks=tuple(dict.fromkeys(self._remarks(recording, off, missing))),
        )

    @property
    def _rms(self) -> float:
        return float(np.sqrt(self.squares / self.finite)) if self.finite else 0.0

    @property
    def _clipped(self) -> float:
        if self.high == self.low:
            return 0.0
        return (self.clipped_low + self.clipped_high) / max(self.finite, 1)

    def _faults(
        self,
        recording: OpenRecording,
        off: bool,
        missing: float,
        width_hz: float | None,
        band_hz: tuple[float, float] | None,
    ) -> Iterator[str]:
        """Yield the reasons why the recording cannot be used."""
        duration = self.samples / recording.rate_hz
        if self.finite < 2:
            yield f"it contains {self.finite} values"
        elif off:
            unit = _unit_in_words(recording)
            yield f"the machine was off, or the sensor disconnected: rms {self._rms:.2g} {unit}"
        if width_hz is not None and duration * width_hz < FEWEST_WIDTHS and self.finite >= 2:
            yield (
                f"too short: {duration:.3g} s; a resonance {width_hz:.0f} Hz wide needs "
                f"{FEWEST_WIDTHS / width_hz:.2g} s"
            )
        if band_hz is not None and band_hz[1] > USABLE_BAND * recording.rate_hz:
            yield (
                f"sampled too slowly: {recording.rate_hz:g} Hz; a band up to {band_hz[1]:.0f} Hz "
                f"needs {ceil(band_hz[1] / USABLE_BAND)} Hz"
            )
        if not off and self.stuck > LARGEST_STUCK_SHARE * self.finite:
            yield f"constant for {100 * self.stuck / self.finite:.4g} % of the time: a dead sensor?"
        if missing > 0.5 and self.finite >= 2:
            yield f"{100 * missing:.0f} % of its samples are missing"

    def _remarks(self, recording: OpenRecording, off: bool, missing: float) -> Iterator[str]:
        """Yield sentences that qualify the recording's numbers."""
        yield from recording.notes
        if self.gaps and not (missing > 0.5 and self.finite >= 2):
            gaps = "1 gap" if self.gaps == 1 else f"{self.gaps} gaps"
            yield f"{gaps}, {100 * missing:.2g} % of the samples missing"
        if not off:
            yield from self._remarks_on_values(_unit_in_words(recording))
        if not recording.comparable:
            why = (
                "are of unknown unit"
                if recording.unit == UNKNOWN
                else f"in {recording.unit} are not accelerations"
            )
            yield f"amplitudes {why}: CRF can be used, CRFA is not comparable"

    def _remarks_on_values(self, unit: str) -> Iterator[str]:
        if self._clipped > 0.0:
            effect = "CRFA is too low" if self._clipped > CLIPPED_SHARE else "a negligible share"
            yield f"clipped at its extremes: {100 * self._clipped:.2g} % of the samples, {effect}"
        elif self.piled:
            yield (
                "amplitudes accumulate near the extremes: soft clipping, which makes CRFA too low, "
                "or a pure tone"
            )
        if 0 < self.stuck <= LARGEST_STUCK_SHARE * self.finite:
            yield (
                f"constant for {100 * self.stuck / self.finite:.2g} % of the time: lost samples? "
                "Excluded from the spectrum"
            )
        if self._rms > 0.0 and abs(self.mean) > OFFSET_RATIO * self._rms:
            ratio = abs(self.mean) / self._rms
            yield f"offset of {self.mean:.3g} {unit}, {ratio:.1f} times the rms; removed"


def check_recording(
    recording: OpenRecording,
    *,
    width_hz: float | None = None,
    band_hz: tuple[float, float] | None = None,
) -> Quality:
    """Read a recording to its end and return its quality.

    Parameters
    ----------
    width_hz : half-power width of the expected resonance [Hz], for which the recording may be too
        short
    band_hz : search band of that resonance [Hz], for which the sampling rate may be too low
    """
    gauge = SampleStatistics()
    for _ in gauge.pass_through(recording.blocks()):
        pass
    return gauge.quality(recording, width_hz=width_hz, band_hz=band_hz)


def _unit_in_words(recording: OpenRecording) -> str:
    return recording.unit if recording.unit != UNKNOWN else "(unit unknown)"


def _is_piled(heights: NDArray[np.int64]) -> bool:
    """Return whether the counts of heights are denser at their top than below it."""
    occupied = np.flatnonzero(heights)
    if not occupied.size:
        return False
    edge = int(occupied[-1]) + 1
    top = round(TOP_FROM * edge)
    below = round(COMPARED_FROM * edge)
    at_top = int(heights[top:edge].sum())
    beneath = int(heights[below:top].sum())
    if at_top < FEWEST_TOP_SAMPLES or not below < top < edge:
        return False
    return at_top / (edge - top) > PILED_DENSITY_RATIO * beneath / (top - below)


def _off(rms: float, step: float | None, *, comparable: bool) -> bool:
    """Return whether the signal is the converter's last digit only, or below any machine's."""
    return (
        rms == 0.0
        or (step is not None and rms < QUIET_STEPS * step)
        or (comparable and rms < QUIET)
    )


def _converter_step(values: Field) -> float | None:
    """Return the smallest difference of levels, or None for a continuous signal."""
    levels = np.unique(values)
    if levels.size < 2 or levels.size > values.size / 16:
        return None
    return float(np.diff(levels).min())


def _stuck_samples(values: Field) -> Mask | None:
    """Return the mask of samples in stuck stretches, except each first one; None for none.

    Samples are first compared at a distance, which rules out nearly all blocks.
    """
    if (
        values.size <= STUCK_RUN
        or not (values[:-STUCK_RUN:STUCK_RUN] == values[STUCK_RUN::STUCK_RUN]).any()
    ):
        return None
    edges = np.diff(np.concatenate([[False], np.diff(values) == 0.0, [False]]).astype(np.int8))
    starts = np.flatnonzero(edges == 1)
    ends = np.flatnonzero(edges == -1)
    stuck_mask = np.zeros(values.size, dtype=bool)
    for start, end in zip(starts, ends, strict=True):
        if end - start >= STUCK_RUN:
            stuck_mask[start + 1 : end + 1] = True
    return stuck_mask


def _samples_in_runs(stuck_mask: Field, shortest: int = CLIPPED_RUN) -> int:
    """Return the number of true samples in runs of at least `shortest`."""
    edges = np.diff(np.concatenate([[False], stuck_mask, [False]]).astype(np.int8))
    lengths = np.flatnonzero(edges == -1) - np.flatnonzero(edges == 1)
    return int(lengths[lengths >= shortest].sum())
