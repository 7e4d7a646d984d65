"""Recordings made comparable: machine off, common frequency grid, copies."""

from collections import Counter
from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np

from asperity.core.signals import Spectrum
from asperity.monitoring.reading import Reading

OFF_LEVEL = 0.05  # rms over the usual one below which the machine was off
# first recordings, whose median rms is the usual one: wear makes later ones louder
REFERENCE_RECORDINGS = 8
GRID_TOLERANCE = 0.25  # of the line spacing: difference of the highest lines of equal grids
COPY_TOLERANCE = 1e-4  # relative difference of the densities of copies


def exclude_machine_off(series: list[Reading]) -> list[Reading]:
    """Mark recordings far quieter than the first ones as taken with the machine off.

    Of a machine at rest an accelerometer still records its surroundings. The reference is the first
    recordings, so that a machine growing loud does not make its own past look off.
    """
    by_unit: dict[tuple[str, str], list[float]] = {}
    for reading in series:
        if reading.quality is not None and not reading.quality.off:
            by_unit.setdefault((reading.sensor, reading.unit), []).append(reading.quality.rms)
    usual_rms = {
        key: float(np.median(levels[:REFERENCE_RECORDINGS])) for key, levels in by_unit.items()
    }
    judged = []
    for reading in series:
        quality = reading.quality
        if (
            quality is not None
            and not quality.off
            and quality.rms < OFF_LEVEL * usual_rms[reading.sensor, reading.unit]
        ):
            share = 100.0 * quality.rms / usual_rms[reading.sensor, reading.unit]
            reason = (
                f"the machine was off, or the sensor disconnected: rms is {share:.1g} % of that of "
                "the first recordings"
            )
            reading = replace(reading, reason=reason, quality=replace(quality, off=True))
        judged.append(reading)
    return judged


def on_common_grid(series: list[Reading]) -> tuple[list[Reading], list[str]]:
    """Bring usable spectra to their most frequent grid; exclude the others, with the reason."""
    usable = [reading for reading in series if reading.usable]
    if not usable:
        return series, []
    grids = [(spectrum_of(reading).segment, round(reading.rate_hz)) for reading in usable]
    (common, _), *_ = Counter(grids).most_common(1)
    grid = spectrum_of(usable[grids.index(common)])
    aligned = [
        _on_grid(reading, grid, common[1]) if reading.usable else reading for reading in series
    ]
    left_out = len(usable) - sum(reading.usable for reading in aligned)
    notes = [
        f"{left_out} of {len(series)} recordings have another sampling rate and were left out."
    ]
    return aligned, notes if left_out else []


def _on_grid(reading: Reading, grid: Spectrum, rate_hz: int) -> Reading:
    """Bring a usable spectrum to a grid, or exclude it with the reason."""
    spectrum = spectrum_of(reading)
    frequency_hz = grid.frequency_hz
    if spectrum.frequency_hz.shape == frequency_hz.shape:
        if np.array_equal(spectrum.frequency_hz, frequency_hz):
            return reading  # nearly all have the same grid
        if abs(spectrum.frequency_hz[-1] - frequency_hz[-1]) <= GRID_TOLERANCE * grid.spacing_hz:
            return replace(reading, spectrum=replace(spectrum, frequency_hz=frequency_hz))
    reason = (
        f"sampled at {reading.rate_hz:g} Hz where the series has {rate_hz:g} Hz; "
        "track it separately"
    )
    return replace(reading, reason=reason)


def spectrum_of(reading: Reading) -> Spectrum:
    """Return the spectrum of a usable recording."""
    assert reading.spectrum is not None
    return reading.spectrum


def copies(readings: Sequence[Reading]) -> list[str]:
    """Return a sentence for each pair of recordings with equal spectra: one of them is a copy."""
    sampled = []
    for reading in readings:
        if reading.spectrum is not None:
            density = reading.spectrum.density
            sample = density[:: max(1, density.size // 16)][1:]
            sampled.append((float(sample.sum()), sample, reading))
    sampled.sort(key=lambda entry: entry[0])
    return [
        f"{_label(earlier)} and {_label(later)} hold the same samples; leave one of them out."
        for (_, first, earlier), (_, second, later) in pairwise(sampled)
        if first.shape == second.shape
        and bool(np.all(np.abs(first - second) <= COPY_TOLERANCE * second))
    ]


def _label(reading: Reading) -> str:
    """Return the file's name, with the sensor's if known."""
    return Path(reading.file).name + (f" ({reading.sensor})" if reading.sensor else "")
