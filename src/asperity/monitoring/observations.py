"""Recordings of a track, from readings of one sensor or of several sensors at one time.

`asperity.resonance` attributes a line to the contact; `judgement` judges the series.
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
from asperity.monitoring.files import RecordingPlace, locate_recordings
from asperity.monitoring.harmonize import (
    COPY_TOLERANCE,
    exclude_machine_off,
    on_common_grid,
    spectrum_of,
)
from asperity.monitoring.operating_point import operating_point
from asperity.monitoring.reading import Reading
from asperity.monitoring.recording import OnSensor, TrackedRecording
from asperity.monitoring.series_state import SensorLine, SeriesMemory
from asperity.monitoring.simultaneous import (
    PlacedRecording,
    TimedRecording,
    match_places,
    match_times,
)
from asperity.monitoring.target import Target
from asperity.resonance import (
    FEWEST_RECORDINGS,
    CleanSpectrum,
    Resonance,
    damping_objection,
    no_resonance,
)


def tracked_recording(
    reading: Reading,
    place: RecordingPlace,
    clean: CleanSpectrum | None,
    resonance: Resonance,
    *,
    on_sensors: Mapping[str, OnSensor] | None = None,
    remounted: str | None = None,
) -> TrackedRecording:
    """Build a recording of a track; the uncertainty of its clock widens the interval of CRF."""
    clock_std = reading.rate_doubt * resonance.crf_hz  # relative errors of rate and CRF are equal
    if resonance.found and clock_std > 0.0:
        # repeats share the error of the clock
        total_std, shared_std = (
            float(np.hypot(std, clock_std)) for std in (resonance.crf_std, resonance.crf_shared_std)
        )
        resonance = replace(resonance, crf_std=total_std, crf_shared_std=shared_std)
    return TrackedRecording(
        file=reading.file,
        x=place.x,
        x_std=place.x_std or 0.0,
        reading=reading,
        clean=clean,
        resonance=resonance,
        damping_reason=resonance.reason if clean is None else _damping_reason(resonance, clean),
        operating=operating_point(reading, place),
        on_sensors=on_sensors or {},
        remounted=remounted,
    )


def _damping_reason(resonance: Resonance, clean: CleanSpectrum) -> str:
    """Return why damping is not determined, or nothing."""
    spectrum, missing = clean.spectrum, 0.0
    if resonance.method != "joint":  # the joint separation takes removed lines into account
        inside = (
            np.abs(spectrum.frequency_hz - resonance.crf_hz)
            <= resonance.damping_ratio * resonance.crf_hz
        )
        missing = float(np.mean(~clean.kept[inside])) if inside.any() else 0.0
    return damping_objection(resonance, spectrum.resolution_hz, taken_out=missing) or ""


class Instant(NamedTuple):
    """Simultaneous readings by sensor, and their place in the series."""

    place: RecordingPlace
    readings: dict[str, Reading]

    def contains(self, file: str, sensor: str) -> bool:
        """Tell whether a sensor's recording is part of it."""
        return sensor in self.readings and self.readings[sensor].file == file


def combine_sensors(
    readings: Sequence[Reading],
    target: Target,
    shaft_hz: Sequence[float] | None,
    *,
    places: Mapping[str, RecordingPlace] | None,
    x_name: str,
    memory: SeriesMemory | None = None,
) -> tuple[list[TrackedRecording], str, list[str]]:
    """Combine recordings of several sensors; return them by x, the name of x, and notes.

    Raises
    ------
    BadInput
        if recordings of different sensors cannot be matched, or are copies.
    """
    instants, x_name = _match_instants(readings, places, x_name)
    names = list(dict.fromkeys(reading.sensor for reading in readings if reading.sensor))
    instants, notes = _harmonized(instants, names)
    state = SeriesMemory() if memory is None else memory
    usable = _usable_by_sensor(instants, names, state.lead)
    names = list(usable)
    instants = _without_copies(names, instants, refused=memory is None)
    cleaned = [
        {
            name: state.clean((reading.file, name), spectrum_of(reading), shaft_hz)
            for name, reading in instant.readings.items()
            if reading.usable
        }
        for instant in instants
    ]
    lines = _joint_lines(instants, cleaned, usable, state, target.band_hz)
    if usable[names[0]] >= FEWEST_RECORDINGS and np.isfinite(state.common):
        notes.append(
            f"Sensors share {100 * state.common:.0f} % of the error of a line; intervals "
            "include the shared part in full."
        )
    tracked = [
        _combined(instant, clean, line, names, state)
        for instant, clean, line in zip(instants, cleaned, lines, strict=True)
    ]
    return tracked, x_name, notes


def _usable_by_sensor(
    instants: Sequence[Instant], names: Sequence[str], lead: str
) -> dict[str, int]:
    """Return the number of usable recordings of each sensor, the leading sensor first.

    `lead` leads while it has enough of them, otherwise the sensor with most.
    """
    usable = {
        name: sum(
            name in instant.readings and instant.readings[name].usable for instant in instants
        )
        for name in names
    }
    leads = usable.get(lead, 0) >= FEWEST_RECORDINGS
    # stable: of equals the first named leads
    ranked = sorted(names, key=lambda name: (not leads or name != lead, -usable[name]))
    return {name: usable[name] for name in ranked}


def _joint_lines(
    instants: Sequence[Instant],
    cleaned: Sequence[Mapping[str, CleanSpectrum]],
    usable: Mapping[str, int],
    memory: SeriesMemory,
    band_hz: tuple[float, float],
) -> list[SensorLine]:
    """Return the line of each instant by joint separation, if there are enough recordings."""
    most = max(usable.values())
    if most < FEWEST_RECORDINGS:
        reason = (
            f"the joint separation needs {FEWEST_RECORDINGS} recordings of a sensor and has {most}"
        )
        no_line = no_resonance(reason, band_hz, "joint")
        return [SensorLine(no_line, (), dict.fromkeys(usable))] * len(instants)
    keys = [
        tuple((instant.readings[name].file, name) for name in clean)
        for instant, clean in zip(instants, cleaned, strict=True)
    ]
    series = {name: [clean.get(name) for clean in cleaned] for name in usable}
    spectra = {
        name: [None if clean is None else clean.spectrum for clean in of_sensor]
        for name, of_sensor in series.items()
    }
    kept = {
        name: [None if clean is None else clean.kept for clean in of_sensor]
        for name, of_sensor in series.items()
    }
    return memory.lines(keys, spectra, kept, band_hz)


def _harmonized(
    instants: Sequence[Instant], names: Sequence[str]
) -> tuple[list[Instant], list[str]]:
    """Bring readings to one grid, without those of a machine at rest; return notes too."""
    readings, notes = on_common_grid(
        exclude_machine_off(
            [
                instant.readings[name]
                for instant in instants
                for name in names
                if name in instant.readings
            ]
        )
    )
    notes += _rarely_simultaneous(instants, names)
    by_key = {(reading.file, reading.sensor): reading for reading in readings}
    return [
        Instant(
            instant.place,
            {name: by_key[old.file, name] for name, old in instant.readings.items()},
        )
        for instant in instants
    ], notes


def _combined(
    instant: Instant,
    cleaned: Mapping[str, CleanSpectrum],
    line: SensorLine,
    names: Sequence[str],
    memory: SeriesMemory,
) -> TrackedRecording:
    """Combine simultaneous readings, with the first usable sensor as the leading one."""
    first = next((name for name in names if name in cleaned), next(iter(instant.readings)))
    return tracked_recording(
        instant.readings[first],
        instant.place,
        cleaned.get(first),
        line.resonance,
        on_sensors={
            name: OnSensor(
                reading=reading, alone=line.alone.get(name), detects=name in line.detected_by
            )
            for name, reading in instant.readings.items()
        },
        remounted=next((name for file, name in memory.moved if instant.contains(file, name)), None),
    )


def _match_instants(
    readings: Sequence[Reading], places: Mapping[str, RecordingPlace] | None, x_name: str
) -> tuple[list[Instant], str]:
    """Match recordings of several sensors by file, x, time or number; return the name of x too."""
    by_sensor = _by_sensor(readings)
    lead = next(iter(by_sensor))  # recordings of an unknown sensor are shown under this name
    if (
        len({reading.file for reading in readings})
        == len(by_sensor[lead])
        == min(map(len, by_sensor.values()))
    ):
        keys, located, x_name = _match_channels(readings, by_sensor, places, x_name)
    elif x_name and places is not None:
        keys, located = _match_stated(readings, places, x_name)
    elif all(reading.time is not None for reading in readings if not reading.refused):
        x_name = "time_h"
        keys, located = _match_started(readings, places or {})
    else:
        x_name = "recording"
        keys, located = _match_numbers(readings, by_sensor, places or {})
    instants: dict[_SlotKey, Instant] = {}
    for reading in readings:
        key = keys[reading.file, reading.sensor]
        instant = instants.setdefault(key, Instant(located[reading.file], {}))
        instant.readings[reading.sensor or lead] = (
            reading if reading.sensor else replace(reading, sensor=lead)
        )
    return [instants[key] for key in sorted(instants)], x_name


def _by_sensor(readings: Sequence[Reading]) -> dict[str, list[Reading]]:
    by_sensor: dict[str, list[Reading]] = {}
    for reading in readings:
        if reading.sensor:
            by_sensor.setdefault(reading.sensor, []).append(reading)
    return by_sensor


_SlotKey = tuple[float, ...]  # equal for simultaneous recordings
_Keys = dict[tuple[str, str], _SlotKey]  # by file and sensor


def _match_channels(
    readings: Sequence[Reading],
    by_sensor: Mapping[str, Sequence[Reading]],
    places: Mapping[str, RecordingPlace] | None,
    x_name: str,
) -> tuple[_Keys, dict[str, RecordingPlace], str]:
    """Match channels of the same files."""
    leading = next(iter(by_sensor.values()))
    files = [reading.file for reading in leading]
    readable = [
        any(not series[number].refused for series in by_sensor.values())
        for number in range(len(files))
    ]
    located, x_name = locate_recordings(
        files, [reading.time for reading in leading], readable, places, x_name
    )
    keys: _Keys = {
        (reading.file, reading.sensor): (located[reading.file].x, files.index(reading.file))
        for reading in readings
    }
    return keys, located, x_name


def _match_stated(
    readings: Sequence[Reading], places: Mapping[str, RecordingPlace], x_name: str
) -> tuple[_Keys, dict[str, RecordingPlace]]:
    """Match recordings by their stated x."""
    keys: _Keys = {}
    located = dict(places)
    placed = [
        PlacedRecording(reading.sensor, places[reading.file].x, _duration(reading))
        for reading in readings
    ]
    for reading, slot in zip(readings, match_places(placed, x_name), strict=True):
        located[reading.file] = replace(places[reading.file], x=slot.x)
        keys[reading.file, reading.sensor] = slot
    return keys, located


def _match_started(
    readings: Sequence[Reading], places: Mapping[str, RecordingPlace]
) -> tuple[_Keys, dict[str, RecordingPlace]]:
    """Match recordings by the time of their start."""
    keys: _Keys = {}
    located: dict[str, RecordingPlace] = {}
    timed = [
        TimedRecording(reading.file, reading.sensor, reading.time, _duration(reading))
        for reading in readings
    ]
    for recording, slot in zip(timed, match_times(timed), strict=True):
        place = places.get(recording.file, RecordingPlace(x=slot.x))
        located[recording.file] = replace(place, x=slot.x)
        keys[recording.file, recording.sensor] = slot
    return keys, located


def _match_numbers(
    readings: Sequence[Reading],
    by_sensor: Mapping[str, Sequence[Reading]],
    places: Mapping[str, RecordingPlace],
) -> tuple[_Keys, dict[str, RecordingPlace]]:
    """Match the n-th recordings of all sensors."""
    counts = {name: len(series) for name, series in by_sensor.items()}
    if len({*counts.values()}) > 1:
        counts_text = ", ".join(f"{count} of {name}" for name, count in counts.items())
        raise BadInput(
            f"recordings of different sensors are matched by number, but their numbers differ: "
            f"{counts_text}; state their start, or their places in a table"
        )
    keys: _Keys = {}
    located: dict[str, RecordingPlace] = {}
    numbers = dict.fromkeys(by_sensor, 0)
    lead = next(iter(by_sensor))
    for order, reading in enumerate(readings, 1):
        if reading.sensor:
            numbers[reading.sensor] += 1
        # a recording of an unknown sensor has the x of the recording before and no match
        number = numbers.get(reading.sensor, numbers[lead])
        located[reading.file] = replace(
            places.get(reading.file, RecordingPlace(x=number)), x=float(number)
        )
        keys[reading.file, reading.sensor] = (float(number), 0 if reading.sensor else order)
    return keys, located


def _rarely_simultaneous(instants: Sequence[Instant], names: Sequence[str]) -> list[str]:
    """Return a note if few recordings of different sensors are simultaneous."""
    number = sum(len(instant.readings) > 1 for instant in instants)
    counts = sorted(sum(name in instant.readings for instant in instants) for name in names)
    possible = counts[-2]
    if 2 * number >= possible:
        return []
    count = f"Only {number} of {possible}" if number else "No"
    return [
        f"{count} recordings of two sensors have the same x; elsewhere no second sensor confirms a "
        "line. Sensors are matched by x or time."
    ]


def _duration(reading: Reading) -> float:
    return nan if reading.quality is None else reading.quality.duration_s


def _without_copies(
    names: Sequence[str], instants: Sequence[Instant], *, refused: bool
) -> list[Instant]:
    """Exclude identical samples on two sensors, or raise BadInput if `refused`.

    Copies would agree in everything and confirm each other.
    """
    distinct = []
    for instant in instants:
        readings = dict(instant.readings)
        # sensors that are off are equal without being copies
        usable = [name for name in names if name in readings and readings[name].usable]
        for first, second in combinations(usable, 2):
            spectrum, other = (readings[name].spectrum for name in (first, second))
            if spectrum is None or other is None or not _equal(spectrum, other):
                continue
            if refused:
                name = Path(readings[first].file).name
                raise BadInput(
                    f"sensors {first} and {second} hold the same samples in {name}; "
                    "leave one of them out"
                )
            readings[second] = replace(
                readings[second], reason=f"it holds the same samples as {first}"
            )
        distinct.append(instant._replace(readings=readings))
    return distinct


def _equal(spectrum: Spectrum, other: Spectrum) -> bool:
    if spectrum.density.shape != other.density.shape:
        return False
    last = float(spectrum.density[-1])
    of_other = float(other.density[-1])
    if abs(last - of_other) > COPY_TOLERANCE * of_other:  # a single value excludes nearly all
        return False
    difference = np.abs(spectrum.density - other.density)
    return bool(np.all(difference[1:] <= COPY_TOLERANCE * other.density[1:]))
