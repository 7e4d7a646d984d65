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
    usual = {
        key: float(np.median(levels[:REFERENCE_RECORDINGS])) for key, levels in by_unit.items()
    }
    judged = []
    for reading in series:
        quality = reading.quality
        if (
            quality is not None
            and not quality.off
            and quality.rms < OFF_LEVEL * usual[reading.sensor, reading.unit]
        ):
            share = 100.0 * quality.rms / usual[reading.sensor, reading.unit]
            reason = (
                f"the machine was off, or the sensor disconnected: rms is {share:.1g} % of that of "
                "the first recordings"
            )
            reading = replace(reading, reason=reason, quality=replace(quality, off=True))
        judged.append(reading)
    return judged


def on_common_grid(series: list[Reading]) -> tuple[list[Reading], list[str]]:
    """Bring usable spectra to their most frequent grid; exclude the others, with the reason."""
    spectra = {
        number: spectrum_of(reading) for number, reading in enumerate(series) if reading.usable
    }
    if not spectra:
        return series, []
    grids = [
        (spectrum.segment, round(series[number].rate_hz)) for number, spectrum in spectra.items()
    ]
    (common, _), *_ = Counter(grids).most_common(1)
    first = [*spectra.values()][grids.index(common)]
    aligned = list(series)
    left_out = 0
    for number, spectrum in spectra.items():
        same = spectrum.frequency_hz.shape == first.frequency_hz.shape
        difference = abs(spectrum.frequency_hz[-1] - first.frequency_hz[-1]) if same else np.inf
        if same and np.array_equal(spectrum.frequency_hz, first.frequency_hz):
            continue  # as nearly all are
        if difference <= GRID_TOLERANCE * first.spacing_hz:
            spectrum = replace(spectrum, frequency_hz=first.frequency_hz)
            aligned[number] = replace(aligned[number], spectrum=spectrum)
        else:
            rate = aligned[number].rate_hz
            reason = (
                f"sampled at {rate:g} Hz where the series has {common[1]:g} Hz; track it separately"
            )
            aligned[number] = replace(aligned[number], reason=reason)
            left_out += 1
    notes = [
        f"{left_out} of {len(series)} recordings have another sampling rate and were left out."
    ]
    return aligned, notes if left_out else []


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
