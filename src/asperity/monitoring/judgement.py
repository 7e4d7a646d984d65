"""Judgement of a series of recordings: indicators, trend, stages and alarm.

`asperity.resonance` and `asperity.trend` hold the methods; this module combines them.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple, get_args

import numpy as np

from asperity.core.errors import BadInput, require_choice
from asperity.monitoring.alarm import at_reference, raise_alarm, severe_stage_weight
from asperity.monitoring.files import RecordingPlace, locate_recordings
from asperity.monitoring.harmonize import copies, exclude_machine_off, on_common_grid, spectrum_of
from asperity.monitoring.observations import combine_sensors, tracked_recording
from asperity.monitoring.operating_point import Response, operating_response, unstated
from asperity.monitoring.reading import WINDOW, Reading
from asperity.monitoring.recording import TrackedRecording
from asperity.monitoring.series_state import PreviousStates, SeriesMemory
from asperity.monitoring.settings import TrackSettings
from asperity.monitoring.states import contact_evidence
from asperity.monitoring.target import Target
from asperity.monitoring.track_result import Track
from asperity.recording import ACCELERATION
from asperity.resonance import (
    FEWEST_RECORDINGS,
    CleanSpectrum,
    Resonance,
    SeriesMethod,
    learn_series,
    no_resonance,
    series_resonances,
)
from asperity.trend import (
    Alarm,
    Detector,
    RecordingFacts,
    StageErrors,
    Stages,
    StageSource,
    comparability,
    split_stages,
)

# largest group of the joint separation: memory grows with its square, time with its cube
MAX_GROUP = 400
FALLBACK: SeriesMethod = "modes"  # with too few recordings for the joint separation
X_UNITS = ("um", "mm", "nm", "m", "h", "s", "min", "d", "km", "cycles")
DEFAULTS = TrackSettings()


def judge(
    readings: Sequence[Reading],
    target: Target,
    settings: TrackSettings = DEFAULTS,
    *,
    places: Mapping[str, RecordingPlace] | None = None,
    x_name: str = "",
    memory: SeriesMemory | None = None,
    previous: PreviousStates | None = None,
) -> Track:
    """Judge recordings that have been read; see `track_recordings`.

    Parameters
    ----------
    memory : what the series has shown so far; further recordings are judged with it
    previous : states of the alarm from the judgement before
    """
    require_choice("source of stages", settings.stages_from, get_args(StageSource))
    sensors = list(
        dict.fromkeys(
            reading.sensor for reading in readings if reading.sensor or not reading.refused
        )
    )
    if len(sensors) > 1:
        _require_joint(sensors, settings.method)
        tracked, x_name, notes = combine_sensors(
            readings, target, settings.shaft_hz, places=places, x_name=x_name, memory=memory
        )
        series = _Series(tracked, x_name, "joint", notes)
    else:
        series = _single_sensor(readings, target, settings, places, x_name, memory)
    if target.assumed:
        series.notes.insert(0, f"The band is {target.source}.")
    if target.unresponsive:
        series.notes.insert(0, target.unresponsive)
    return _staged(series, target, settings, previous)


class _Series(NamedTuple):
    """Recordings with their resonances, before stages and alarm."""

    tracked: list[TrackedRecording]
    x_name: str
    method: SeriesMethod
    notes: list[str]

    @property
    def used(self) -> list[TrackedRecording]:
        """Recordings with a usable spectrum."""
        return [recording for recording in self.tracked if recording.clean is not None]


class _Line(NamedTuple):
    """Line of a usable spectrum; `moved` if the sensor was moved before it."""

    clean: CleanSpectrum
    resonance: Resonance
    moved: bool


def _single_sensor(
    readings: Sequence[Reading],
    target: Target,
    settings: TrackSettings,
    places: Mapping[str, RecordingPlace] | None,
    x_name: str,
    memory: SeriesMemory | None,
) -> _Series:
    """Find the resonances in the recordings of a single sensor."""
    names = [reading.file for reading in readings]
    times = [reading.time for reading in readings]
    places, x_name = locate_recordings(
        names, times, [not reading.refused for reading in readings], places, x_name
    )
    ordered = sorted(readings, key=lambda reading: places[reading.file].x)
    series, notes = on_common_grid(exclude_machine_off(ordered))
    usable = [reading for reading in series if reading.usable]
    method = settings.method or ("joint" if len(usable) >= FEWEST_RECORDINGS else FALLBACK)
    notes += _method_notes(len(usable), settings.method, method)
    lines = iter(_lines(usable, target, settings, method, memory))
    tracked = []
    for reading in series:
        place = places[reading.file]
        if reading.usable:
            clean, resonance, moved = next(lines)
            remounted = reading.sensor if moved else None
            tracked.append(tracked_recording(reading, place, clean, resonance, remounted=remounted))
        else:
            no_line = no_resonance(reading.reason, target.band_hz, method)
            tracked.append(tracked_recording(reading, place, None, no_line))
    return _Series(tracked, x_name, method, notes)


def _lines(
    usable: Sequence[Reading],
    target: Target,
    settings: TrackSettings,
    method: SeriesMethod,
    memory: SeriesMemory | None,
) -> list[_Line]:
    """Return the line of each usable recording of a single sensor."""
    state = SeriesMemory() if memory is None else memory
    keys = [(reading.file, reading.sensor) for reading in usable]
    cleaned = [
        state.clean(key, spectrum_of(reading), settings.shaft_hz)
        for key, reading in zip(keys, usable, strict=True)
    ]
    if memory is not None and method == "joint":
        resonances = memory.resonances(keys, cleaned, target.band_hz)
        moved = {keys.index(key) for key in memory.moved if key in keys}
    else:
        resonances, moved = _resonances(cleaned, target, method)
    if settings.method is None and method == FALLBACK:
        resonances = [_ambiguous(line) if line.found else line for line in resonances]
    return [
        _Line(clean, resonance, number in moved)
        for number, (clean, resonance) in enumerate(zip(cleaned, resonances, strict=True))
    ]


def _group_count(recordings: int, method: SeriesMethod) -> int:
    """Return the number of groups into which recordings are divided for their separation."""
    return -(-recordings // MAX_GROUP) if method == "joint" else 1


def _method_notes(count: int, requested: SeriesMethod | None, method: SeriesMethod) -> list[str]:
    """Return notes on the method for `count` usable recordings."""
    notes = []
    groups = _group_count(count, method)
    if requested is None and method != "joint" and count:
        notes.append(
            f"The joint separation of contact and structure needs {FEWEST_RECORDINGS} recordings, "
            f"got {count}; `method` {method} takes the most prominent line instead."
        )
    if groups > 1:
        notes.append(
            f"{count} recordings were separated into {groups} groups, each spread over the whole "
            "series."
        )
    return notes


def _staged(
    series: _Series, target: Target, settings: TrackSettings, previous: PreviousStates | None
) -> Track:
    """Add stages, alarm and load share to the recordings of a series."""
    tracked, x_name, method, notes = series
    units = {recording.reading.unit for recording in series.used}
    response = operating_response(target.case, [recording.operating for recording in tracked])
    tracked = at_reference(tracked, response)
    remounted = _remounted(tracked)
    heights = units == {ACCELERATION} and not remounted
    source = settings.stages_from
    unit = _unit_of(x_name)
    evidence = contact_evidence(tracked, target)
    stages_by: Mapping[StageSource, Stages] = (
        _StagesBySource(tracked, settings.detector, unit, heights) if evidence else {}
    )
    stages = stages_by.get(source)
    alarm = raise_alarm(
        tracked,
        settings,
        stages,
        lambda part: _StagesBySource(part, settings.detector, "", heights).get(source),
        previous=previous,
        unit=unit,
        response=response,
        of_contact=bool(evidence),
    )
    tracked = _with_load_share(_with_states(tracked, stages, source, response, alarm), target)
    return Track(
        recordings=tuple(tracked),
        x_name=x_name,
        target=target,
        method=method,
        stages=stages,
        stages_by=stages_by,
        alarm=alarm,
        evidence=evidence,
        comparable=units == {ACCELERATION},
        problems=comparability([_facts_of(recording) for recording in series.used]),
        notes=(*notes, *_notes(tracked, units, response), *remounted),
    )


def _notes(
    tracked: Sequence[TrackedRecording], units: set[str], response: Response
) -> Iterator[str]:
    """Yield notes on units, conditions, damping and copies."""
    yield from _incomparable_units(units)
    yield from filter(None, [response.note])
    yield from unstated([recording.operating for recording in tracked])
    yield from _without_damping(tracked)
    yield from copies([recording.reading for recording in tracked])


def _with_states(
    tracked: Sequence[TrackedRecording],
    stages: Stages | None,
    source: StageSource,
    response: Response,
    alarm: Alarm,
) -> list[TrackedRecording]:
    """Add probability of severe wear (nan if unknown), stage label and alarm state."""
    severe = np.full(len(tracked), np.nan)
    labels = ("none",) * len(tracked)
    if stages is not None:
        determined = [
            np.isfinite(
                recording.damping_reference if source == "damping" else recording.crf_reference_hz
            )
            for recording in tracked
        ]
        weight = severe_stage_weight(tracked, source, response)
        severe = np.where(determined, stages.probability * weight, np.nan)
        labels = stages.labels
    return [
        replace(recording, severe_probability=float(probability), label=label, state=state)
        for recording, probability, label, state in zip(
            tracked, severe, labels, alarm.states, strict=True
        )
    ]


def _incomparable_units(units: set[str]) -> list[str]:
    """Return a sentence if the spectra are not all of accelerations."""
    if units <= {ACCELERATION}:
        return []
    return [
        f"CRFA cannot be compared with other series: its unit is {', '.join(sorted(units))}, not "
        "m/s^2. CRF can."
    ]


def _with_load_share(tracked: list[TrackedRecording], target: Target) -> list[TrackedRecording]:
    """Add the asperities' load share and its interval, if the contact model reads CRF."""
    crf, crf_std = np.array(
        [(recording.resonance.crf_hz, recording.resonance.crf_std) for recording in tracked]
    ).T
    share = target.load_share(crf, np.where(np.isfinite(crf_std), crf_std, 0.0))
    if share is None:
        return tracked
    return [
        replace(recording, clr=float(clr), clr_interval=(float(low), float(high)))
        for recording, clr, low, high in zip(tracked, share.clr, *share.interval, strict=True)
    ]


def _require_joint(sensors: Sequence[str], method: SeriesMethod | None) -> None:
    """Raise BadInput for recordings without a sensor name, or a method for single sensors."""
    if "" in sensors:
        raise BadInput(
            "some recordings name their sensor "
            f"({', '.join(filter(None, sensors))}) and others do not; name the sensor of all"
        )
    if method not in (None, "joint"):
        raise BadInput(
            f"several sensors are judged together by method joint, got {method}; omit the method"
        )


def _facts_of(recording: TrackedRecording) -> RecordingFacts:
    """Return the facts by which recordings are compared."""
    spectrum = spectrum_of(recording.reading)
    return RecordingFacts(
        name=Path(recording.file).name,
        rate_hz=recording.reading.rate_hz,
        segment=spectrum.segment,
        window=WINDOW,
        unit=recording.reading.unit,
        duration_s=spectrum.duration_s,
        speed_hz=recording.operating.speed_hz,
        load_n=recording.operating.load_n,
    )


class _StagesBySource(Mapping[StageSource, Stages]):
    """Stages by CRF, damping and both, computed on access; empty without any resonance."""

    def __init__(
        self, tracked: Sequence[TrackedRecording], detector: Detector, unit: str, comparable: bool
    ) -> None:
        self.tracked, self.detector, self.unit, self.comparable = (
            tracked,
            detector,
            unit,
            comparable,
        )
        resonant = any(recording.resonance.found for recording in tracked)
        self.sources: tuple[StageSource, ...] = get_args(StageSource) if resonant else ()
        self.computed: dict[StageSource, Stages] = {}

    def __len__(self) -> int:
        return len(self.sources)

    def __iter__(self) -> Iterator[StageSource]:
        return iter(self.sources)

    def __getitem__(self, source: StageSource) -> Stages:
        if source not in self.sources:
            raise KeyError(source)
        if source not in self.computed:
            resonances = [recording.resonance for recording in self.tracked]
            damping = [recording.damping_reference for recording in self.tracked]
            damping_std = [recording.damping[1] for recording in self.tracked]
            self.computed[source] = split_stages(
                [recording.x for recording in self.tracked],
                [recording.crf_reference_hz for recording in self.tracked],
                [resonance.crfa for resonance in resonances] if self.comparable else None,
                damping_ratio=damping,
                errors=StageErrors(
                    crf_hz=[resonance.crf_std for resonance in resonances],
                    damping_ratio=damping_std,
                    x=[recording.x_std for recording in self.tracked],
                ),
                source=source,
                detector=self.detector,
                unit=self.unit,
            )
        return self.computed[source]


def _remounted(tracked: Sequence[TrackedRecording]) -> list[str]:
    """Return a sentence for each recording at which a sensor's mounting changed."""
    return [
        f"{f'Sensor {recording.remounted}' if recording.remounted else 'The sensor'} or its "
        f"mounting changed at x = {recording.x:g} ({Path(recording.file).name}): the parts before "
        "and after were separated independently, and their CRFA is not compared."
        for recording in tracked
        if recording.remounted is not None
    ]


def _without_damping(tracked: Sequence[TrackedRecording]) -> list[str]:
    """Return a sentence on resonances whose damping is not determined."""
    resonant = [recording for recording in tracked if recording.resonance.found]
    reasons = [recording.damping_reason for recording in resonant if recording.damping_reason]
    if not reasons:
        return []
    many = f"{len(reasons)} of {len(resonant)} resonances" if len(resonant) > 1 else "the resonance"
    return [
        f"Damping is not determined for {many}: {reasons[0]}"
        f"{', and other reasons' if len({*reasons}) > 1 else ''}."
    ]


def _resonances(
    cleaned: list[CleanSpectrum], target: Target, method: SeriesMethod
) -> tuple[list[Resonance], set[int]]:
    """Return the resonance of each spectrum, and the numbers at which the sensor was moved.

    Each group takes every n-th spectrum, so that all groups span the whole series.
    """
    resonances: dict[int, Resonance] = {}
    moved: list[int] = []
    groups = _group_count(len(cleaned), method)
    for first in range(min(groups, len(cleaned))):
        group = cleaned[first::groups]
        spectra = [clean.spectrum for clean in group]
        kept = [clean.kept for clean in group]
        if method == "joint":
            lines, _, changes = learn_series(spectra, band_hz=target.band_hz, kept=kept)
            moved += [first + groups * number for number in changes]
        else:
            lines = series_resonances(spectra, band_hz=target.band_hz, method=method, kept=kept)
        resonances |= zip(range(first, len(cleaned), groups), lines, strict=True)
    moved.sort()  # groups find the same move within as many recordings as there are groups
    distinct = {
        number
        for number, before in zip(moved, [-groups, *moved], strict=False)
        if number - before >= groups
    }
    return [resonances[number] for number in range(len(cleaned))], distinct


def _ambiguous(resonance: Resonance) -> Resonance:
    """Reject a line of a single spectrum: on real bearings it is mostly a structural resonance."""
    reason = (
        f"a line at {resonance.crf_hz:.0f} Hz stands out, but a single spectrum cannot separate "
        "contact from structure"
    )
    retained = {name: getattr(resonance, name) for name in ("floor", "evidence", "background")}
    return no_resonance(reason, resonance.band_hz, resonance.method, **retained)


def _unit_of(x_name: str) -> str:
    """Return the unit at the end of a heading such as sq_um."""
    name, _, unit = x_name.rpartition("_")
    return unit if name and unit in X_UNITS else ""
