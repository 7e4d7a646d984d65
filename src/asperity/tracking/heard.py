"""What was heard becomes the recordings of a track: on one sensor, or on several at one time.

Which line is the contact's is said by `asperity.wear`; what the recordings say together, by `track`.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from datetime import timedelta
from itertools import combinations
from pathlib import Path
from typing import NamedTuple

import numpy as np

from asperity.arrays import Mask
from asperity.errors import BadInput
from asperity.signals import Spectrum
from asperity.tracking.alike import COPIED, on_one_grid, spectrum_of, without_silence
from asperity.tracking.files import Place, in_their_places
from asperity.tracking.operating import operating_of
from asperity.tracking.reading import Reading
from asperity.tracking.recorded import OnSensor, TrackedRecording
from asperity.tracking.target import Target
from asperity.wear import (
    FEWEST_RECORDINGS,
    CleanSpectrum,
    Resonance,
    damping_objection,
    no_resonance,
    remove_lines,
    resonances_of_sensors,
)


def recording_of(reading: Reading, place: Place, clean: CleanSpectrum | None, resonance: Resonance) -> TrackedRecording:
    """A recording of a track; how far its clock may be off widens the interval of its CRF."""
    clocked = float(np.hypot(resonance.crf_std, reading.rate_doubt * resonance.crf_hz))  # a rate off is a CRF off
    resonance = replace(resonance, crf_std=clocked)
    return TrackedRecording(
        file=reading.file,
        x=place.x,
        x_std=place.x_std or 0.0,
        reading=reading,
        clean=clean,
        resonance=resonance,
        damping_reason=resonance.reason if clean is None else _damping_reason(resonance, clean),
        operating=operating_of(reading, place),
    )


def _damping_reason(resonance: Resonance, clean: CleanSpectrum) -> str:
    """Why its damping is not determined, or nothing. The joint separation knows which lines are missing."""
    spectrum, half = clean.spectrum, resonance.damping_ratio * resonance.crf_hz
    within = np.abs(spectrum.frequency_hz - resonance.crf_hz) <= half
    missing = float(np.mean(~clean.kept[within])) if within.any() and resonance.method != "joint" else 0.0
    return damping_objection(resonance, spectrum.resolution_hz, taken_out=missing) or ""


class Instant(NamedTuple):
    """What several sensors heard at one time, by sensor, and where that stands."""

    place: Place
    readings: dict[str, Reading]


def heard_together(
    readings: Sequence[Reading],
    target: Target,
    places: Mapping[str, Place] | None,
    x_name: str,
    shaft_hz: Sequence[float] | None,
) -> tuple[list[TrackedRecording], str, list[str]]:
    """Recordings of several sensors as those of one machine, by x; what x is; and what has to be said of them.

    Raises
    ------
    BadInput
        where recordings of different sensors cannot be laid beside one another, or are copies.
    """
    found, x_name = _instants(readings, places, x_name)
    names = list(dict.fromkeys(reading.sensor for reading in readings))
    made = without_silence([one.readings[name] for one in found for name in names if name in one.readings])
    made, notes = on_one_grid(made)
    by_key = {(reading.file, reading.sensor): reading for reading in made}
    found = [Instant(one.place, {name: by_key[old.file, name] for name, old in one.readings.items()}) for one in found]
    usable = {name: sum(name in one.readings and one.readings[name].usable for one in found) for name in names}
    names.sort(key=lambda name: -usable[name])  # stable: the first named of equals leads
    _require_no_copies(names, found)
    cleaned = [
        {
            name: remove_lines(spectrum_of(reading), shaft_hz=shaft_hz)
            for name, reading in one.readings.items()
            if reading.usable
        }
        for one in found
    ]
    if usable[names[0]] < FEWEST_RECORDINGS:
        reason = f"the joint separation needs {FEWEST_RECORDINGS} recordings of a sensor, and has {usable[names[0]]}"
        lines = [no_resonance(reason, target.band_hz, "joint")] * len(found)
        heard_on: Sequence[tuple[str, ...]] = [()] * len(found)
        alone: Mapping[str, Sequence[Resonance | None]] = {name: [None] * len(found) for name in names}
    else:
        spectra: dict[str, list[Spectrum | None]] = {}
        kept: dict[str, list[Mask | None]] = {}
        for name in names:
            every = [clean.get(name) for clean in cleaned]
            spectra[name] = [None if one is None else one.spectrum for one in every]
            kept[name] = [None if one is None else one.kept for one in every]
        told = resonances_of_sensors(spectra, band_hz=target.band_hz, kept=kept)
        lines, heard_on, alone = list(told.resonances), told.heard_on, told.alone
        if np.isfinite(told.common):
            notes.append(
                f"Of the errors of a line, sensors have {100 * told.common:.0f} % in common: intervals are no narrower "
                "than the rest allows."
            )
    tracked = []
    for number, one in enumerate(found):
        first = next((name for name in names if name in cleaned[number]), next(iter(one.readings)))
        recording = recording_of(one.readings[first], one.place, cleaned[number].get(first), lines[number])
        on_sensors = {
            name: OnSensor(reading=reading, alone=alone[name][number], hears=name in heard_on[number])
            for name, reading in one.readings.items()
        }
        tracked.append(replace(recording, on_sensors=on_sensors))
    return tracked, x_name, notes


def _instants(
    readings: Sequence[Reading], places: Mapping[str, Place] | None, x_name: str
) -> tuple[list[Instant], str]:
    """Recordings laid beside one another: of one file, at one x, at one time, or each sensor's so-manieth."""
    by_sensor: dict[str, list[Reading]] = {}
    for reading in readings:
        by_sensor.setdefault(reading.sensor, []).append(reading)
    if (
        len({reading.file for reading in readings})
        == len(by_sensor[readings[0].sensor])
        == min(map(len, by_sensor.values()))
    ):  # channels of the same files
        files = [reading.file for reading in by_sensor[readings[0].sensor]]
        keys: dict[tuple[str, str], tuple[float, int]] = {}
        times = [reading.time for reading in by_sensor[readings[0].sensor]]
        heard = [any(not one[number].refused for one in by_sensor.values()) for number in range(len(files))]
        stand, x_name = in_their_places(files, times, heard, places, x_name)
        keys = {(one.file, one.sensor): (stand[one.file].x, files.index(one.file)) for one in readings}
    elif x_name and places is not None:
        stand, keys = dict(places), {}
        for name, every in by_sensor.items():
            seen: dict[float, int] = {}
            for one in every:
                x = stand[one.file].x
                keys[one.file, name] = (x, seen.setdefault(x, 0))
                seen[x] += 1
    elif all(one.time is not None for one in readings if not one.refused):
        stand, keys, x_name = *_by_time(readings, places), "time_h"
    else:
        counts = {name: len(every) for name, every in by_sensor.items()}
        if len({*counts.values()}) > 1:
            said = ", ".join(f"{count} of {name or 'no sensor'}" for name, count in counts.items())
            raise BadInput(
                f"recordings of different sensors are laid beside one another by number, and there are {said}; say "
                "when they began, or where they stand in a table"
            )
        stand, x_name, keys = {}, "recording", {}
        for name, every in by_sensor.items():
            for number, one in enumerate(every, 1):
                stand[one.file] = replace((places or {}).get(one.file, Place(x=number)), x=float(number))
                keys[one.file, name] = (float(number), 0)
    found: dict[tuple[float, int], Instant] = {}
    for one in readings:
        instant = found.setdefault(keys[one.file, one.sensor], Instant(stand[one.file], {}))
        instant.readings[one.sensor] = one
    return [found[key] for key in sorted(found)], x_name


def _by_time(
    readings: Sequence[Reading], places: Mapping[str, Place] | None
) -> tuple[dict[str, Place], dict[tuple[str, str], tuple[float, int]]]:
    """Places in hours since the first; recordings that overlap in time are one."""
    known = [(one.time, number, one) for number, one in enumerate(readings) if one.time is not None]
    timed = sorted(known, key=lambda one: one[:2])
    stand: dict[str, Place] = {}
    keys: dict[tuple[str, str], tuple[float, int]] = {}
    began = until = timed[0][0]
    taken: set[str] = set()
    count = -1
    for time, _, one in timed:
        if count < 0 or time >= until or one.sensor in taken:
            began, taken, count = time, set(), count + 1
            until = time + timedelta(seconds=one.quality.duration_s if one.quality is not None else 0.0)
        taken.add(one.sensor)
        x = (began - timed[0][0]).total_seconds() / 3600.0
        stand[one.file] = replace((places or {}).get(one.file, Place(x=x)), x=x)
        keys[one.file, one.sensor] = (x, count)
    for one in readings:  # what was refused takes no place: it stands at the end
        if one.time is None:
            count += 1
            x = max(place.x for place in stand.values())
            stand[one.file], keys[one.file, one.sensor] = Place(x=x), (x, count)
    return stand, keys


def _require_no_copies(names: Sequence[str], found: Sequence[Instant]) -> None:
    """BadInput where two sensors hold the same samples: they would agree on everything."""
    for one in found:
        for first, second in combinations([name for name in names if name in one.readings], 2):
            spectra = [one.readings[name].spectrum for name in (first, second)]
            if any(spectrum is None for spectrum in spectra):
                continue
            here, there = (spectrum.density for spectrum in spectra if spectrum is not None)
            if here.shape == there.shape and bool(np.all(np.abs(here - there)[1:] <= COPIED * there[1:])):
                name = Path(one.readings[first].file).name
                raise BadInput(f"sensors {first} and {second} hold the same samples in {name}; leave one of them out")
