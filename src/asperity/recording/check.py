"""Whether a recording can be used: length, gaps, clipping, offset, a machine that stood still.

Sample statistics only, gathered while the blocks go by to the spectrum; what the spectrum says is
left to others.
"""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from math import ceil

import numpy as np
from numpy.typing import NDArray

from asperity.core.arrays import Field, Mask
from asperity.recording.model import UNKNOWN, OpenRecording

QUIET = 0.01  # m/s^2 rms: the noise of an accelerometer, not a machine
STEPS_OF_NOISE = (
    1.5  # standard deviation in steps of the converter, below which only its last digit moves
)
CLIPPED_RUN = 3  # equal extreme samples in a row that make clipping
CLIPPED_SHARE = 1e-3  # from which CRFA is off
HEIGHTS = 1024  # steps in which heights are counted
TOP, BELOW = 0.95, 0.85  # of the largest value: from there on, and from there to the first
PILED = 1.5  # times as dense at the top as below it: what is not cut off falls towards its extremes
FEWEST_AT_TOP = 50  # samples
STUCK = 50  # equal samples in a row that make a stuck stretch
MOST_STUCK = 0.5  # of the samples, from which the rest is no recording
OFFSET = 3.0  # mean over standard deviation, from which the offset eats the converter's range
PIECES = 16  # half-power widths that a record must hold in time for its line to be told from chance
USABLE_BAND = 0.4  # of the sampling rate: above, the anti-alias filter has cut


@dataclass(frozen=True, slots=True, kw_only=True)
class Quality:
    """What the samples of a recording are like.

    `rms` (about the mean), `peak` (from the mean), `offset` in the recording's unit; `kurtosis` is
    3 for Gaussian noise; `missing`, `clipped`, `stuck` shares of the samples, 0 to 1. `faults` are
    sentences for which it must not be used, `remarks` such that a reader of its numbers has to
    know.
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
        """Whether nothing of the machine is heard: it is off, or the sensor stands still."""
        return self.off or self.stuck > MOST_STUCK

    @property
    def crest(self) -> float:
        """Peak over rms; nan where nothing moves."""
        return self.peak / self.rms if self.rms > 0.0 else np.nan

    @property
    def usable(self) -> bool:
        """Whether its spectrum means anything."""
        return not self.faults


class Gauge:
    """Gathers statistics of blocks as they pass through `watch`."""

    def __init__(self) -> None:
        self.samples = self.finite = self.gaps = self.clipped_low = self.clipped_high = (
            self.stuck
        ) = 0
        self.mean = self.squares = self.cubes = self.fourths = 0.0  # sums of powers about the mean
        self.low, self.high = np.inf, -np.inf
        self.step: float | None = None
        self._heights: NDArray[np.int64] = np.zeros((2, HEIGHTS), dtype=np.int64)
        self._top = 0.0
        self._centre: float | None = None
        self._last = np.zeros(0)
        self._in_gap = False
        self._run = 0

    def watch(self, blocks: Iterable[Field]) -> Iterator[Field]:
        """Pass the blocks on."""
        for block in blocks:
            if block.size:
                self._take(block)
            yield block

    def _take(self, block: Field) -> None:
        self.samples += block.size
        mean = float(block.mean())
        if np.isfinite(mean):
            values, begins = block, 0
            self._in_gap = False
        else:
            known = np.isfinite(block)
            edges = np.flatnonzero(known[:-1] & ~known[1:]).size
            begins = edges + (not known[0] and not self._in_gap)
            self._in_gap = not bool(known[-1])
            values = block[known]
            mean = float(values.mean()) if values.size else 0.0
        self.gaps += begins
        if not values.size:
            return
        self._moments(values, mean)
        self._extremes(values)
        self._count_heights(values, mean)
        self._stand_still(values)
        if self.step is None:
            self.step = _converter_step(values[: 1 << 16])

    def _moments(self, values: Field, mean: float) -> None:
        """Joins the block's central moments to those before (Pébay, Sandia report SAND2008-6212)."""
        centred = values - mean
        square = centred**2
        squares, cubes, fourths = (  # BLAS would wake its threads
            float(np.einsum("i,i->", *pair))
            for pair in ((centred, centred), (square, centred), (square, square))
        )
        before, here = self.finite, values.size
        both, apart = before + here, mean - self.mean
        self.fourths += (
            fourths
            + apart**4 * before * here * (before**2 - before * here + here**2) / both**3
            + 6.0 * apart**2 * (before**2 * squares + here**2 * self.squares) / both**2
            + 4.0 * apart * (before * cubes - here * self.cubes) / both
        )
        self.cubes += (
            cubes
            + apart**3 * before * here * (before - here) / both**2
            + 3.0 * apart * (before * squares - here * self.squares) / both
        )
        self.squares += squares + apart**2 * before * here / both
        self.mean += apart * here / both
        self.finite = both

    def _extremes(self, values: Field) -> None:
        low, high = float(values.min()), float(values.max())
        if low < self.low:
            self.low, self.clipped_low = low, 0
        if high > self.high:
            self.high, self.clipped_high = high, 0
        if low == self.low:
            self.clipped_low += _in_runs(values == low)
        if high == self.high:
            self.clipped_high += _in_runs(values == high)

    def _count_heights(self, values: Field, mean: float) -> None:
        """Counts heights above and below the first mean, in steps that grow with the largest one."""
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
                step = np.minimum((over * (HEIGHTS / self._top)).astype(np.int64), HEIGHTS - 1)
                self._heights[side] += np.bincount(step, minlength=HEIGHTS)

    @property
    def piled(self) -> bool:
        """Whether values pile up below the largest or the least: a range that is left softly, or a tone alone."""
        return any(_piled(side) for side in self._heights)

    def without_stuck(self, blocks: Iterable[Field]) -> Iterator[Field]:
        """Pass the blocks on with stretches that stand still as missing: samples were lost there, and held or filled.

        A box of held values raises the spectrum below the inverse of its length, and boxes in
        turns make lines. What stands still for most of the time is left as it is, and refused by
        `quality`.
        """
        for block in blocks:
            hit = _stuck(block)
            yield block if hit is None or hit.mean() > MOST_STUCK else np.where(hit, np.nan, block)

    def _stand_still(self, values: Field) -> None:
        """Counts samples that equal `STUCK` neighbours in a row; compared at a distance first, which is rare."""
        hit = _stuck(values)
        if hit is not None:
            self.stuck += int(hit.sum())

    def quality(
        self,
        recording: OpenRecording,
        *,
        width_hz: float | None,
        band_hz: tuple[float, float] | None,
    ) -> Quality:
        """What was gathered, judged for a resonance `width_hz` wide (half power) somewhere in `band_hz`."""
        rms = float(np.sqrt(self.squares / self.finite)) if self.finite else 0.0
        duration = self.samples / recording.rate_hz
        clipped = (self.clipped_low + self.clipped_high) / max(self.finite, 1)
        if self.high == self.low:
            clipped = 0.0
        unit = recording.unit if recording.unit != UNKNOWN else "(unit unknown)"
        off = _off(rms, self.step, comparable=recording.comparable) if self.finite else False
        faults: list[str] = []
        remarks = list(recording.notes)
        if self.finite < 2:
            faults.append(f"it holds {self.finite} values")
        elif off:
            faults.append(f"the machine was off, or the sensor disconnected: rms {rms:.2g} {unit}")
        if width_hz is not None and duration * width_hz < PIECES and self.finite >= 2:
            faults.append(
                f"too short: {duration:.3g} s, where a resonance {width_hz:.0f} Hz wide needs {PIECES / width_hz:.2g} s"
            )
        if band_hz is not None and band_hz[1] > USABLE_BAND * recording.rate_hz:
            faults.append(
                f"sampled too slowly: {recording.rate_hz:g} Hz, where a band up to {band_hz[1]:.0f} Hz needs "
                f"{ceil(band_hz[1] / USABLE_BAND)} Hz"
            )
        if not off and self.stuck > MOST_STUCK * self.finite:
            faults.append(
                f"it stands still for {100 * self.stuck / self.finite:.4g} % of the time: a dead sensor?"
            )
        missing = (self.samples - self.finite) / max(self.samples, 1)
        if missing > 0.5 and self.finite >= 2:
            faults.append(f"{100 * missing:.0f} % of its samples are missing")
        elif self.gaps:
            remarks.append(
                f"{self.gaps} {'gap' if self.gaps == 1 else 'gaps'}, {100 * missing:.2g} % of the samples missing"
            )
        if not off:
            if clipped > 0.0:
                worth = "CRFA is too low" if clipped > CLIPPED_SHARE else "hardly matters"
                remarks.append(
                    f"clipped at its extremes: {100 * clipped:.2g} % of the samples, {worth}"
                )
            elif self.piled:
                remarks.append(
                    "values pile up below the largest: soft clipping, which makes CRFA too low, or a tone alone"
                )
            if 0 < self.stuck <= MOST_STUCK * self.finite:
                remarks.append(
                    f"stands still for {100 * self.stuck / self.finite:.2g} % of the time: samples lost? Left out"
                )
            if rms > 0.0 and abs(self.mean) > OFFSET * rms:
                remarks.append(
                    f"offset of {self.mean:.3g} {unit}, {abs(self.mean) / rms:.1f} times the rms; it is removed"
                )
        if not recording.comparable:
            what = (
                "are of unknown unit"
                if recording.unit == UNKNOWN
                else f"in {unit} are no accelerations"
            )
            remarks.append(f"amplitudes {what}: CRF can be used, CRFA is not comparable")
        return Quality(
            samples=self.samples,
            duration_s=duration,
            rms=rms,
            peak=max(self.high - self.mean, self.mean - self.low) if self.finite else 0.0,
            offset=self.mean,
            kurtosis=self.finite * self.fourths / self.squares**2 if self.squares > 0.0 else np.nan,
            missing=missing,
            gaps=self.gaps,
            clipped=clipped,
            stuck=self.stuck / max(self.finite, 1),
            off=off,
            faults=tuple(faults),
            remarks=tuple(dict.fromkeys(remarks)),
        )


def check_recording(
    recording: OpenRecording,
    *,
    width_hz: float | None = None,
    band_hz: tuple[float, float] | None = None,
) -> Quality:
    """Read a recording to its end and say what it is like.

    Parameters
    ----------
    width_hz : half-power width of the resonance that it is to show [Hz], for which it may be too short
    band_hz : where that resonance may lie [Hz], for which it may be sampled too slowly
    """
    gauge = Gauge()
    for _ in gauge.watch(recording.blocks()):
        pass
    return gauge.quality(recording, width_hz=width_hz, band_hz=band_hz)


def _piled(heights: NDArray[np.int64]) -> bool:
    """Whether counts of heights are denser at their top than below it."""
    held = np.flatnonzero(heights)
    if not held.size:
        return False
    edge = int(held[-1]) + 1
    top, below = round(TOP * edge), round(BELOW * edge)
    at_top, beneath = int(heights[top:edge].sum()), int(heights[below:top].sum())
    if at_top < FEWEST_AT_TOP or not below < top < edge:
        return False
    return at_top / (edge - top) > PILED * beneath / (top - below)


def _off(rms: float, step: float | None, *, comparable: bool) -> bool:
    """Nothing moves but the converter's last digit, or less than any machine."""
    return (
        rms == 0.0
        or (step is not None and rms < STEPS_OF_NOISE * step)
        or (comparable and rms < QUIET)
    )


def _converter_step(values: Field) -> float | None:
    """The least difference of neighbouring levels, where values keep to few of them; None for a continuous signal."""
    levels = np.unique(values)
    if levels.size < 2 or levels.size > values.size / 16:
        return None
    return float(np.diff(levels).min())


def _stuck(values: Field) -> Mask | None:
    """Which samples follow an equal one in a stretch of `STUCK` or more; None, at once, where there is none."""
    if values.size <= STUCK or not (values[:-STUCK:STUCK] == values[STUCK::STUCK]).any():
        return None
    edges = np.diff(np.concatenate([[False], np.diff(values) == 0.0, [False]]).astype(np.int8))
    starts, ends = np.flatnonzero(edges == 1), np.flatnonzero(edges == -1)
    hit = np.zeros(values.size, dtype=bool)
    for start, end in zip(starts, ends, strict=True):
        if end - start >= STUCK:
            hit[start + 1 : end + 1] = True
    return hit


def _in_runs(hit: Field, shortest: int = CLIPPED_RUN) -> int:
    """How many of the true ones stand in runs of at least `shortest`."""
    edges = np.diff(np.concatenate([[False], hit, [False]]).astype(np.int8))
    lengths = np.flatnonzero(edges == -1) - np.flatnonzero(edges == 1)
    return int(lengths[lengths >= shortest].sum())
