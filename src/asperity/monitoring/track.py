"""A series of recordings judged as one: indicators, trend, stages, alarm.

Reading is left to `reading`, the methods to `asperity.wear`; what is decided here is how they are
put together.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import get_args

import numpy as np

from asperity.case import Case, MachineCase
from asperity.core.arrays import Field
from asperity.core.errors import BadInput, require_choice
from asperity.monitoring.alarm import at_reference, raise_alarm, weighed
from asperity.monitoring.files import Place, Table, in_their_places, read_table, recordings_in
from asperity.monitoring.forecast import Foreteller
from asperity.monitoring.harmonize import copies, on_one_grid, spectrum_of, without_silence
from asperity.monitoring.observations import heard_together, recording_of
from asperity.monitoring.operating_point import response_of, unstated
from asperity.monitoring.ordering import unacknowledged
from asperity.monitoring.reading import (
    WINDOW,
    Reading,
    any_of,
    channels_in,
    common_spacing,
    read_channels,
)
from asperity.monitoring.recording import TrackedRecording
from asperity.monitoring.series_state import Before, Learned
from asperity.monitoring.target import Target, search_target
from asperity.monitoring.track_result import Track
from asperity.recording import ACCELERATION, ReadOptions
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
    FALSE_ALARM_RATE,
    Detector,
    RecordingFacts,
    StageErrors,
    Stages,
    StageSource,
    asperity_load_share,
    comparability,
    split_stages,
)

MOST_TOGETHER = (
    400  # recordings separated at once: memory grows with their square, time with their cube
)
ALONE: SeriesMethod = "modes"  # where there are too few recordings for the joint separation
X_UNITS = ("um", "mm", "nm", "m", "h", "s", "min", "d", "km", "cycles")


def track_recordings(
    paths: Sequence[str | Path],
    *,
    case: Case | MachineCase | None = None,
    band_hz: tuple[float, float] | None = None,
    rate_hz: float | None = None,
    unit: str | None = None,
    channel: str | None = None,
    scale: float | None = None,
    x: Sequence[float] | None = None,
    table: str | Path | Table | None = None,
    shaft_hz: Sequence[float] | None = None,
    method: SeriesMethod | None = None,
    detector: Detector = "bayesian",
    stages_from: StageSource = "crf",
    false_alarm_rate: float = FALSE_ALARM_RATE,
    acknowledge: str | None = None,
    foreteller: Foreteller | None = None,
    workers: int = 1,
    progress: Callable[[Reading], None] | None = None,
) -> Track:
    """From files to stages: read, check, spectrum, indicators, trend, stages, alarm.

    Parameters
    ----------
    paths : files, and folders of files
    case : its contact model says where the resonance may lie, and what load share a CRF stands for; a machine's also
        how often what passes or meshes
    band_hz : where to look instead; without either, the paper's contact stands in, and `notes` say so
    rate_hz, unit, channel, scale : as `read_recording` takes them, for all recordings alike; several channels, with
        commas between them, are sensors of one machine, as are recordings of which a table or sidecar says different
        sensors
    x : place of each recording in the series, shape (recordings,); or `table`, a csv as `read_table` takes it
        or what that read; else hours since the first, where all say when they began, or their number
    shaft_hz : speeds of shafts whose harmonics are removed; None finds them
    method : of `series_resonances`; None takes "joint" from 6 recordings on, and of fewer says that one spectrum
        cannot tell whose resonance it shows
    detector : of `split_stages`
    stages_from : what decides stage and alarm: "crf", "damping" or "both". The other two are told all the same
    false_alarm_rate : alarms a recording where nothing wears; 0.001 is one in 1000 recordings
    acknowledge : name of the recording up to which somebody has looked, or "last": what came before raises no alarm,
        and the baseline is learned anew behind it
    foreteller : who foretells the series behind it, and may raise the alarm
    workers : processes that read at the same time
    progress : called with each file that was read

    Raises
    ------
    BadInput
        where nothing can be read at all, or something given does not fit.
    """
    target = search_target(case, band_hz)
    files = recordings_in(paths)
    stated = table if isinstance(table, Table) or table is None else read_table(table)
    x_name, places = _stated_places(files, x, stated)
    options = ReadOptions(rate_hz=rate_hz, unit=unit, channel=channel, scale=scale)
    readings = any_of(_read(files, options, target, places, workers, progress))
    track = judge(
        readings,
        target,
        places,
        x_name,
        shaft_hz=shaft_hz,
        method=method,
        detector=detector,
        stages_from=stages_from,
        false_alarm_rate=false_alarm_rate,
        acknowledge=acknowledge,
    )
    return track if foreteller is None else _foretold(track, foreteller, acknowledge)


def _foretold(track: Track, foreteller: Foreteller, acknowledge: str | None) -> Track:
    rows = unacknowledged([one.row() for one in track.recordings], acknowledge)
    return track.foretold(foreteller(rows, track.x_name, comparable=track.comparable))


def _read(
    files: Sequence[Path],
    options: ReadOptions,
    target: Target,
    places: Mapping[str, Place] | None,
    workers: int,
    progress: Callable[[Reading], None] | None,
) -> list[Reading]:
    """What every channel that is asked for gave, file by file."""
    channels = channels_in(options.channel)
    spacing = common_spacing(files, options, target)
    every = [
        *read_channels(
            files, options, target, spacing, places=places, workers=workers, progress=progress
        )
    ]
    readings: list[Reading] = []
    for number, channel in enumerate(channels):
        numbered = dict(every[number * len(files) : (number + 1) * len(files)])
        of_files = [numbered[place] for place in range(len(files))]
        if len(channels) > 1 and all(reading.refused for reading in of_files):
            raise BadInput(
                f"channel {channel} cannot be read of any recording: {of_files[0].reason}"
            )
        readings += of_files
    return readings


def judge(
    readings: Sequence[Reading],
    target: Target,
    places: Mapping[str, Place] | None = None,
    x_name: str = "",
    *,
    shaft_hz: Sequence[float] | None = None,
    method: SeriesMethod | None = None,
    detector: Detector = "bayesian",
    stages_from: StageSource = "crf",
    false_alarm_rate: float = FALSE_ALARM_RATE,
    acknowledge: str | None = None,
    learned: Learned | None = None,
    before: Before | None = None,
) -> Track:
    """What recordings say together that have been read; otherwise as `track_recordings`.

    With `learned`, further recordings are judged beside what it holds; `before` is what was said
    of them before.
    """
    require_choice("source of stages", stages_from, get_args(StageSource))
    notes = [f"The band is {target.source}."] if target.assumed else []
    alarming = (false_alarm_rate, acknowledge, before)
    sensors = list(dict.fromkeys(one.sensor for one in readings if one.sensor or not one.refused))
    if len(sensors) > 1:
        _require_together(sensors, method)
        several, x_name, told = heard_together(readings, target, places, x_name, shaft_hz, learned)
        return _staged(
            several, x_name, target, "joint", (detector, stages_from), alarming, [*notes, *told]
        )
    names, times = [reading.file for reading in readings], [reading.time for reading in readings]
    places, x_name = in_their_places(
        names, times, [not reading.refused for reading in readings], places, x_name
    )
    order = np.argsort(np.array([places[reading.file].x for reading in readings]), kind="stable")
    series, left_out = on_one_grid(without_silence([readings[number] for number in order]))
    notes += left_out
    spectra = {
        number: spectrum_of(reading) for number, reading in enumerate(series) if reading.usable
    }
    keys = [(series[number].file, series[number].sensor) for number in spectra]
    memory = Learned() if learned is None else learned
    cleaned = [
        memory.clean(key, one, shaft_hz) for key, one in zip(keys, spectra.values(), strict=True)
    ]
    chosen = method or ("joint" if len(spectra) >= FEWEST_RECORDINGS else ALONE)
    if method is None and chosen != "joint" and spectra:
        notes.append(
            f"The joint separation, which tells the contact from the machine by what moves, needs {FEWEST_RECORDINGS} "
            f"recordings and has {len(spectra)}; method {chosen} takes for the contact's what stands out of each."
        )
    groups = -(-len(spectra) // MOST_TOGETHER) if chosen == "joint" else 1
    if groups > 1:
        notes.append(
            f"{len(spectra)} recordings were separated in {groups} groups, each spread over the whole series."
        )
    if learned is not None and chosen == "joint":
        resonances = learned.resonances(keys, cleaned, target.band_hz)
        moved = {keys.index(key) for key in learned.moved if key in keys}
    else:
        resonances, moved = _resonances(cleaned, target, chosen, groups)
    if method is None and chosen == ALONE:
        resonances = [_not_the_contacts(line) if line.found else line for line in resonances]
    used = dict(zip(spectra, zip(cleaned, resonances, strict=True), strict=True))
    first_behind = {number for place, number in enumerate(spectra) if place in moved}
    tracked = []
    for number, reading in enumerate(series):
        clean, found = used.get(number, (None, None))
        resonance = found or no_resonance(reading.reason, target.band_hz, chosen)
        remounted = reading.sensor if number in first_behind else None
        tracked.append(
            recording_of(reading, places[reading.file], clean, resonance, remounted=remounted)
        )
    return _staged(tracked, x_name, target, chosen, (detector, stages_from), alarming, notes)


def _staged(
    tracked: list[TrackedRecording],
    x_name: str,
    target: Target,
    method: SeriesMethod,
    staging: tuple[Detector, StageSource],
    alarming: tuple[float, str | None, Before | None],
    notes: list[str],
) -> Track:
    used = [recording for recording in tracked if recording.clean is not None]
    comparable = bool(used) and all(recording.reading.unit == ACCELERATION for recording in used)
    x = np.array([recording.x for recording in tracked])
    met = [recording.operating for recording in tracked]
    response = response_of(target.case, met)
    tracked = at_reference(tracked, response)
    remounted = _remounted(tracked)
    heights = comparable and not remounted
    stages_by = _Ways(tracked, staging[0], _unit_of(x_name), heights)
    stages = stages_by.get(staging[1])
    severe: Field = np.full(x.size, np.nan)
    labels: tuple[str, ...] = ("none",) * x.size
    if stages is not None:
        known = (
            [np.isfinite(recording.damping_reference) for recording in tracked]
            if staging[1] == "damping"
            else [np.isfinite(recording.crf_reference_hz) for recording in tracked]
        )
        severe = np.where(
            known, stages.probability * weighed(tracked, staging[1], response), np.nan
        )
        labels = stages.labels
    alarm = raise_alarm(
        tracked,
        staging[1],
        stages,
        lambda part: _Ways(part, staging[0], "", heights).get(staging[1]),
        false_alarm_rate=alarming[0],
        acknowledge=alarming[1],
        before=alarming[2],
        unit=_unit_of(x_name),
        response=response,
    )
    if target.full_load_crf_hz is not None:
        crf, crf_std = np.array(
            [(one.resonance.crf_hz, one.resonance.crf_std) for one in tracked]
        ).T
        share = asperity_load_share(
            crf, np.where(np.isfinite(crf_std), crf_std, 0.0), target.full_load_crf_hz
        )
        tracked = [
            replace(recording, clr=float(clr), clr_interval=(float(low), float(high)))
            for recording, clr, low, high in zip(tracked, share.clr, *share.interval, strict=True)
        ]
    if not comparable and used:
        units = ", ".join(sorted({recording.reading.unit for recording in used}))
        notes.append(
            f"CRFA is not comparable with other series: its unit is {units}, not m/s^2. CRF is."
        )
    copied = copies([one.reading for one in tracked])
    return Track(
        recordings=tuple(
            replace(recording, severe_probability=float(probability), label=label, state=state)
            for recording, probability, label, state in zip(
                tracked, severe, labels, alarm.states, strict=True
            )
        ),
        x_name=x_name,
        target=target,
        method=method,
        stages=stages,
        stages_by=stages_by,
        alarm=alarm,
        comparable=comparable,
        problems=comparability([_facts_of(recording) for recording in used]),
        notes=(
            *notes,
            *filter(None, [response.said]),
            *unstated(met),
            *_without_damping(tracked),
            *copied,
            *remounted,
        ),
    )


def _require_together(sensors: Sequence[str], method: SeriesMethod | None) -> None:
    """BadInput for several sensors where one is due."""
    if "" in sensors:
        raise BadInput(
            f"some recordings say of which sensor they are ({', '.join(filter(None, sensors))}) and others do not; say "
            "it of all"
        )
    if method not in (None, "joint"):
        raise BadInput(
            f"several sensors are judged together by method joint, got {method}; leave it out"
        )


def _facts_of(recording: TrackedRecording) -> RecordingFacts:
    """What makes a recording comparable with others."""
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


class _Ways(Mapping[StageSource, Stages]):
    """The stage as CRF, damping and both tell it, each worked out when it is asked for; none without a resonance."""

    def __init__(
        self, tracked: Sequence[TrackedRecording], detector: Detector, unit: str, comparable: bool
    ) -> None:
        self.tracked, self.detector, self.unit, self.comparable = (
            tracked,
            detector,
            unit,
            comparable,
        )
        found = any(recording.resonance.found for recording in tracked)
        self.sources: tuple[StageSource, ...] = get_args(StageSource) if found else ()
        self.known: dict[StageSource, Stages] = {}

    def __len__(self) -> int:
        return len(self.sources)

    def __iter__(self) -> Iterator[StageSource]:
        return iter(self.sources)

    def __getitem__(self, source: StageSource) -> Stages:
        if source not in self.sources:
            raise KeyError(source)
        if source not in self.known:
            resonances = [recording.resonance for recording in self.tracked]
            damping = [recording.damping_reference for recording in self.tracked]
            damping_std = [recording.damping[1] for recording in self.tracked]
            self.known[source] = split_stages(
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
        return self.known[source]


def _remounted(tracked: Sequence[TrackedRecording]) -> list[str]:
    """A sentence for each recording with which a sensor was moved."""
    return [
        f"{f'Sensor {one.remounted}' if one.remounted else 'The sensor'} or its mounting changed at x = {one.x:g} "
        f"({Path(one.file).name}): the line comes through another structure from there on. Both parts were separated "
        "by themselves, and stages do not compare CRFA between them."
        for one in tracked
        if one.remounted is not None
    ]


def _without_damping(tracked: Sequence[TrackedRecording]) -> list[str]:
    """A sentence on resonances whose damping is not determined."""
    reasons = [one.damping_reason for one in tracked if one.resonance.found and one.damping_reason]
    found = sum(one.resonance.found for one in tracked)
    if not reasons:
        return []
    many = f"{len(reasons)} of {found} resonances" if found > 1 else "the resonance"
    return [
        f"Damping is not determined of {many}: {reasons[0]}{', and so on' if len(reasons) > 1 else ''}."
    ]


def _stated_places(
    files: Sequence[Path], x: Sequence[float] | None, table: Table | None
) -> tuple[str, dict[str, Place] | None]:
    """The name of x, and the place of each file where the caller states it."""
    if x is not None and table is not None:
        raise BadInput("x and table both say where recordings stand; give one of them")
    if x is not None:
        if len(x) != len(files):
            raise BadInput(f"x needs one value for each of {len(files)} recordings, got {len(x)}")
        return "x", {str(file): Place(x=float(value)) for file, value in zip(files, x, strict=True)}
    if table is not None:
        return table.x_name, table.placed(files)
    return "", None


def _resonances(
    cleaned: list[CleanSpectrum], target: Target, method: SeriesMethod, groups: int
) -> tuple[list[Resonance], set[int]]:
    """One a spectrum, and with which of them the sensor was moved.

    Each group takes every so-manieth spectrum, so that all see the whole series.
    """
    resonances: dict[int, Resonance] = {}
    moved: list[int] = []
    for first in range(min(groups, len(cleaned))):
        group = cleaned[first::groups]
        spectra, kept = [clean.spectrum for clean in group], [clean.kept for clean in group]
        if method == "joint":
            found, _, behind = learn_series(spectra, band_hz=target.band_hz, kept=kept)
            moved += [first + groups * number for number in behind]
        else:
            found = series_resonances(spectra, band_hz=target.band_hz, method=method, kept=kept)
        resonances |= zip(range(first, len(cleaned), groups), found, strict=True)
    told = sorted(moved)  # groups tell one move within as many recordings as there are groups
    once = {
        number
        for number, before in zip(told, [-groups, *told], strict=False)
        if number - before >= groups
    }
    return [resonances[number] for number in range(len(cleaned))], once


def _not_the_contacts(resonance: Resonance) -> Resonance:
    """A line that stands out of one spectrum may as well be a structure's: on real bearings it mostly is."""
    reason = (
        f"a line at {resonance.crf_hz:.0f} Hz stands out, but one spectrum cannot tell whether it is the contact's or "
        "the machine's"
    )
    kept = {name: getattr(resonance, name) for name in ("floor", "evidence", "background")}
    return no_resonance(reason, resonance.band_hz, resonance.method, **kept)


def _unit_of(x_name: str) -> str:
    """The unit at the end of a heading such as sq_um."""
    name, _, unit = x_name.rpartition("_")
    return unit if name and unit in X_UNITS else ""
