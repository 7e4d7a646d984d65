"""What was heard becomes the recordings of a track: on one sensor, or on several at one time.

Which line is the contact's is said by `asperity.wear`; what the recordings say together, by
`track`.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import combinations
from math import nan
from pathlib import Path
from typing import NamedTuple

import numpy as np

from asperity.core.errors import BadInput
from asperity.core.signals import Spectrum
from asperity.monitoring.files import Place, in_their_places
from asperity.monitoring.harmonize import COPIED, on_one_grid, spectrum_of, without_silence
from asperity.monitoring.operating_point import operating_of
from asperity.monitoring.reading import Reading
from asperity.monitoring.recording import OnSensor, TrackedRecording
from asperity.monitoring.series_state import Learned, Together
from asperity.monitoring.simultaneous import Heard, Placed, by_place, by_time
from asperity.monitoring.target import Target
from asperity.resonance import (
    FEWEST_RECORDINGS,
    CleanSpectrum,
    Resonance,
    damping_objection,
    no_resonance,
)


def recording_of(
    reading: Reading,
    place: Place,
    clean: CleanSpectrum | None,
    resonance: Resonance,
    *,
    on_sensors: Mapping[str, OnSensor] | None = None,
    remounted: str | None = None,
) -> TrackedRecording:
    """A recording of a track; how far its clock may be off widens the interval of its CRF, and repeats share it."""
    clock = reading.rate_doubt * resonance.crf_hz  # a rate off is a CRF off
    if resonance.found and clock > 0.0:
        whole, shared = (
            float(np.hypot(std, clock)) for std in (resonance.crf_std, resonance.crf_shared_std)
        )
        resonance = replace(resonance, crf_std=whole, crf_shared_std=shared)
    return TrackedRecording(
        file=reading.file,
        x=place.x,
        x_std=place.x_std or 0.0,
        reading=reading,
        clean=clean,
        resonance=resonance,
        damping_reason=resonance.reason if clean is None else _damping_reason(resonance, clean),
        operating=operating_of(reading, place),
        on_sensors=on_sensors or {},
        remounted=remounted,
    )


def _damping_reason(resonance: Resonance, clean: CleanSpectrum) -> str:
    """Why its damping is not determined, or nothing. The joint separation knows which lines are missing."""
    spectrum, missing = clean.spectrum, 0.0
    if resonance.method != "joint":
        within = (
            np.abs(spectrum.frequency_hz - resonance.crf_hz)
            <= resonance.damping_ratio * resonance.crf_hz
        )
        missing = float(np.mean(~clean.kept[within])) if within.any() else 0.0
    return damping_objection(resonance, spectrum.resolution_hz, taken_out=missing) or ""


class Instant(NamedTuple):
    """What several sensors heard at one time, by sensor, and where that stands."""

    place: Place
    readings: dict[str, Reading]

    def holds(self, file: str, sensor: str) -> bool:
        """Whether a sensor's recording is of it."""
        return sensor in self.readings and self.readings[sensor].file == file


def heard_together(
    readings: Sequence[Reading],
    target: Target,
    places: Mapping[str, Place] | None,
    x_name: str,
    shaft_hz: Sequence[float] | None,
    learned: Learned | None = None,
) -> tuple[list[TrackedRecording], str, list[str]]:
    """Recordings of several sensors as those of one machine, by x; what x is; and what has to be said of them.

    With `learned`, further recordings are judged beside what it holds.

    Raises
    ------
    BadInput
        where recordings of different sensors cannot be laid beside one another, or are copies.
    """
    found, x_name = _instants(readings, places, x_name)
    names = list(dict.fromkeys(reading.sensor for reading in readings if reading.sensor))
    made = without_silence(
        [one.readings[name] for one in found for name in names if name in one.readings]
    )
    made, notes = on_one_grid(made)
    notes += _apart(found, names)
    by_key = {(reading.file, reading.sensor): reading for reading in made}
    found = [
        Instant(one.place, {name: by_key[old.file, name] for name, old in one.readings.items()})
        for one in found
    ]
    usable = {
        name: sum(name in one.readings and one.readings[name].usable for one in found)
        for name in names
    }
    memory = Learned() if learned is None else learned
    led = memory.lead if usable.get(memory.lead, 0) >= FEWEST_RECORDINGS else ""
    names.sort(
        key=lambda name: (name != led, -usable[name])
    )  # stable: of equals the first named leads
    found = _without_copies(names, found, refused=learned is None)
    cleaned = [
        {
            name: memory.clean((reading.file, name), spectrum_of(reading), shaft_hz)
            for name, reading in one.readings.items()
            if reading.usable
        }
        for one in found
    ]
    if usable[names[0]] < FEWEST_RECORDINGS:
        reason = f"the joint separation needs {FEWEST_RECORDINGS} recordings of a sensor, and has {usable[names[0]]}"
        nothing = Together(no_resonance(reason, target.band_hz, "joint"), (), dict.fromkeys(names))
        told = [nothing] * len(found)
    else:
        keys = [
            tuple((one.readings[name].file, name) for name in clean)
            for one, clean in zip(found, cleaned, strict=True)
        ]
        every = {name: [clean.get(name) for clean in cleaned] for name in names}
        spectra = {
            name: [None if one is None else one.spectrum for one in heard]
            for name, heard in every.items()
        }
        kept = {
            name: [None if one is None else one.kept for one in heard]
            for name, heard in every.items()
        }
        told = memory.lines(keys, spectra, kept, target.band_hz)
        if np.isfinite(memory.common):
            notes.append(
                f"Of the errors of a line, sensors have {100 * memory.common:.0f} % in common: intervals are no "
                "narrower than the rest allows."
            )
    tracked = [
        _together(one, clean, line, names, memory)
        for one, clean, line in zip(found, cleaned, told, strict=True)
    ]
    return tracked, x_name, notes


def _together(
    one: Instant,
    cleaned: Mapping[str, CleanSpectrum],
    line: Together,
    names: Sequence[str],
    memory: Learned,
) -> TrackedRecording:
    """What sensors heard at one time as one recording, with the reading of the first whose spectrum counts."""
    first = next((name for name in names if name in cleaned), next(iter(one.readings)))
    return recording_of(
        one.readings[first],
        one.place,
        cleaned.get(first),
        line.resonance,
        on_sensors={
            name: OnSensor(
                reading=reading, alone=line.alone.get(name), hears=name in line.detected_on
            )
            for name, reading in one.readings.items()
        },
        remounted=next((name for file, name in memory.moved if one.holds(file, name)), None),
    )


def _instants(
    readings: Sequence[Reading], places: Mapping[str, Place] | None, x_name: str
) -> tuple[list[Instant], str]:
    """Recordings laid beside one another: of one file, at one x, at one time, or each sensor's so-manieth."""
    by_sensor: dict[str, list[Reading]] = {}
    for reading in readings:
        if reading.sensor:
            by_sensor.setdefault(reading.sensor, []).append(reading)
    lead = next(iter(by_sensor))  # by which is shown what nobody knows the sensor of
    keys: dict[tuple[str, str], tuple[float, ...]] = {}
    if (
        len({reading.file for reading in readings})
        == len(by_sensor[lead])
        == min(map(len, by_sensor.values()))
    ):  # channels of the same files
        files = [reading.file for reading in by_sensor[lead]]
        times = [reading.time for reading in by_sensor[lead]]
        heard = [
            any(not one[number].refused for one in by_sensor.values())
            for number in range(len(files))
        ]
        stand, x_name = in_their_places(files, times, heard, places, x_name)
        keys = {
            (one.file, one.sensor): (stand[one.file].x, files.index(one.file)) for one in readings
        }
    elif x_name and places is not None:
        stand = dict(places)
        stated = [Placed(one.sensor, places[one.file].x, _duration(one)) for one in readings]
        for one, there in zip(readings, by_place(stated, x_name), strict=True):
            stand[one.file] = replace(places[one.file], x=there.x)
            keys[one.file, one.sensor] = there
    elif all(one.time is not None for one in readings if not one.refused):
        x_name, stand = "time_h", {}
        laid = [Heard(one.file, one.sensor, one.time, _duration(one)) for one in readings]
        for (file, sensor, *_), there in zip(laid, by_time(laid), strict=True):
            stand[file] = replace((places or {}).get(file, Place(x=there.x)), x=there.x)
            keys[file, sensor] = there
    else:
        counts = {name: len(every) for name, every in by_sensor.items()}
        if len({*counts.values()}) > 1:
            said = ", ".join(f"{count} of {name}" for name, count in counts.items())
            raise BadInput(
                f"recordings of different sensors are laid beside one another by number, and there are {said}; say "
                "when they began, or where they stand in a table"
            )
        stand, x_name = {}, "recording"
        numbers = dict.fromkeys(by_sensor, 0)
        for place, one in enumerate(readings, 1):
            if one.sensor:
                numbers[one.sensor] += 1
            number = numbers.get(
                one.sensor, numbers[lead]
            )  # what nobody knows stands alone at that of the one before
            stand[one.file] = replace(
                (places or {}).get(one.file, Place(x=number)), x=float(number)
            )
            keys[one.file, one.sensor] = (float(number), 0 if one.sensor else place)
    found: dict[tuple[float, ...], Instant] = {}
    for one in readings:
        instant = found.setdefault(keys[one.file, one.sensor], Instant(stand[one.file], {}))
        instant.readings[one.sensor or lead] = one if one.sensor else replace(one, sensor=lead)
    return [found[key] for key in sorted(found)], x_name


def _apart(found: Sequence[Instant], names: Sequence[str]) -> list[str]:
    """A sentence where sensors that have recordings of their own were mostly not heard together."""
    together = sum(len(one.readings) > 1 for one in found)
    possible = sorted(sum(name in one.readings for one in found) for name in names)[-2]
    if 2 * together >= possible:
        return []
    many = f"Only {together} of {possible}" if together else "No"
    return [
        f"{many} recordings of two sensors stand at one x; elsewhere no other sensor confirms a line. Sensors are laid "
        "beside one another where their x or times agree."
    ]


def _duration(reading: Reading) -> float:
    return nan if reading.quality is None else reading.quality.duration_s


def _without_copies(
    names: Sequence[str], found: Sequence[Instant], *, refused: bool
) -> list[Instant]:
    """Sensors that hold the same samples would agree on everything: BadInput, or the second of them does not count."""
    told = []
    for one in found:
        readings = dict(one.readings)
        usable = [name for name in names if name in readings and readings[name].usable]
        for first, second in combinations(
            usable, 2
        ):  # sensors that are off are alike, and no copies
            here, there = (readings[name].spectrum for name in (first, second))
            if here is None or there is None or not _alike(here, there):
                continue
            if refused:
                name = Path(readings[first].file).name
                raise BadInput(
                    f"sensors {first} and {second} hold the same samples in {name}; leave one of them out"
                )
            readings[second] = replace(
                readings[second], reason=f"it holds the same samples as {first}"
            )
        told.append(one._replace(readings=readings))
    return told


def _alike(one: Spectrum, other: Spectrum) -> bool:
    if one.density.shape != other.density.shape:
        return False
    last, of_other = float(one.density[-1]), float(other.density[-1])
    if (
        abs(last - of_other) > COPIED * of_other
    ):  # nearly all that are not are told by one of their values
        return False
    return bool(np.all(np.abs(one.density - other.density)[1:] <= COPIED * other.density[1:]))
