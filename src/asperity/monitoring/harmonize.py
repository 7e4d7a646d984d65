"""Readings made alike before they are judged: who is silent, on which lines, which are copies.

Reading is left to `reading`, judging to `track`.
"""

from collections import Counter
from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np

from asperity.core.signals import Spectrum
from asperity.monitoring.reading import Reading

QUIET_SHARE = 0.05  # rms over the usual one, below which the machine was off
USUAL = (
    8  # recordings, the first, whose median rms is the usual one: later ones may be louder by wear
)
# of a line, by which the highest lines of two spectra may differ and still be laid on one another
SAME_LINES = 0.25
COPIED = 1e-4  # of a density, within which it is another's


def without_silence(series: list[Reading]) -> list[Reading]:
    """Recordings far quieter than the first ones are off: of a machine at rest an accelerometer still hears the hall.

    Counted from the first, so that a machine which grows loud does not make its own past look
    silent.
    """
    by_unit: dict[tuple[str, str], list[float]] = {}
    for reading in series:
        if reading.quality is not None and not reading.quality.off:
            by_unit.setdefault((reading.sensor, reading.unit), []).append(reading.quality.rms)
    usual = {whose: float(np.median(levels[:USUAL])) for whose, levels in by_unit.items()}
    judged = []
    for reading in series:
        quality = reading.quality
        if (
            quality is not None
            and not quality.off
            and quality.rms < QUIET_SHARE * usual[reading.sensor, reading.unit]
        ):
            share = 100.0 * quality.rms / usual[reading.sensor, reading.unit]
            reason = f"the machine was off, or the sensor disconnected: rms is {share:.1g} % of what it was at first"
            reading = replace(reading, reason=reason, quality=replace(quality, off=True))
        judged.append(reading)
    return judged


def on_one_grid(series: list[Reading]) -> tuple[list[Reading], list[str]]:
    """All usable spectra on the frequencies that most of them have; the others are left out, with the reason."""
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
        apart = abs(spectrum.frequency_hz[-1] - first.frequency_hz[-1]) if same else np.inf
        if same and np.array_equal(spectrum.frequency_hz, first.frequency_hz):
            continue  # as nearly all are
        if apart <= SAME_LINES * first.spacing_hz:
            on_it = replace(spectrum, frequency_hz=first.frequency_hz)
            aligned[number] = replace(aligned[number], spectrum=on_it)
        else:
            rate = aligned[number].rate_hz
            reason = f"sampled at {rate:g} Hz where the series has {common[1]:g} Hz; track it apart"
            aligned[number] = replace(aligned[number], reason=reason)
            left_out += 1
    notes = [
        f"{left_out} of {len(series)} recordings have another sampling rate and were left out."
    ]
    return aligned, notes if left_out else []


def spectrum_of(reading: Reading) -> Spectrum:
    """The spectrum of a usable recording."""
    assert reading.spectrum is not None
    return reading.spectrum


def copies(readings: Sequence[Reading]) -> list[str]:
    """A sentence for each recording whose spectrum is another's: one of them is a copy."""
    sampled = []
    for reading in readings:
        if reading.spectrum is not None:
            density = reading.spectrum.density
            few = density[:: max(1, density.size // 16)][1:]
            sampled.append((float(few.sum()), few, reading))
    sampled.sort(key=lambda one: one[0])
    return [
        f"{_named(one)} and {_named(other)} hold the same samples; leave one of them out."
        for (_, first, one), (_, second, other) in pairwise(sampled)
        if first.shape == second.shape and bool(np.all(np.abs(first - second) <= COPIED * second))
    ]


def _named(reading: Reading) -> str:
    """Its file's name, and its sensor's if it has one."""
    return Path(reading.file).name + (f" ({reading.sensor})" if reading.sensor else "")
