"""Jobs of worker processes: track dropped recordings or a watched folder for the page."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from asperity.app.contact_jobs import Ticket
from asperity.app.contact_result import group_means
from asperity.case import Case, MachineCase, load_case
from asperity.core.arrays import Field
from asperity.core.errors import BadInput
from asperity.core.quantities import column_label
from asperity.monitoring import (
    Track,
    TrackedRecording,
    TrackSettings,
    WatchSettings,
    track_recordings,
    watch_folder,
)
from asperity.paper import RigSettings, simulate_rig, write_rig

MAX_LINES = 600  # of a spectrum
MAX_ROWS = 400  # recordings of a waterfall
SETTLE_S = 2.0  # time for which a file must not have changed
EXAMPLE_SAMPLES, EXAMPLE_S = 12, 4.0  # recordings of the example, and their duration
FIELDS = {  # of the page, by arguments as messages of the library name them
    "`rate_hz`": "the sampling rate",
    "`case` or `band_hz`": "the band",
    "`scale`": "the scale",
}


class RecordingContext(NamedTuple):
    """Contact and table of a series.

    `case` gives the search band and the load share of a CRF, `table` the places of the recordings;
    None: the contact of the paper, and the order of the recordings.
    """

    case: Case | MachineCase | None = None
    table: Path | None = None


class RecordingInputs(NamedTuple):
    """Typed properties of the recordings; None: as stated by the files."""

    rate_hz: float | None = None
    unit: str | None = None
    channel: str | None = None
    band_hz: tuple[float, float] | None = None


class RecordingSpectrum(NamedTuple):
    """Spectrum of a recording: frequencies [Hz], density and fitted curve (empty without fit)."""

    frequency: Field
    density: Field
    curve: Field
    unit: str


@dataclass(frozen=True, kw_only=True, eq=False)
class RecordingSeries:
    """A series of recordings as the page shows it.

    `rows` are those of `asperity track --json`; `levels` [dB over the recording's median], shape
    (recordings, lines) at `frequency` [Hz]; `spectra` one per recording, None for a file without.
    `split` and its interval, in units of x, are None without a split.
    """

    verdict: str
    alarm: str
    rows: tuple[dict[str, Any], ...]
    x_name: str
    x_label: str
    band_hz: tuple[float, float]
    full_load_crf_hz: float | None
    split: float | None
    interval: tuple[float, float] | None
    frequency: Field
    levels: Field
    spectra: tuple[RecordingSpectrum | None, ...]
    notes: tuple[str, ...]
    waiting: int = 0


def track_files(
    ticket: Ticket,  # noqa: ARG001
    paths: Sequence[Path],
    inputs: RecordingInputs,
    context: RecordingContext,
) -> RecordingSeries:
    """Track dropped recordings as one series."""
    try:
        track = track_recordings(
            paths,
            TrackSettings(**inputs._asdict()),
            case=context.case,
            table=context.table,
        )
    except BadInput as error:
        raise BadInput(_name_page_fields(str(error))) from None
    return series_of_track(track)


def simulate_example(ticket: Ticket, folder: Path) -> RecordingContext:  # noqa: ARG001
    """Simulate the paper's wear test into a folder: recordings, table and case."""
    rig = simulate_rig(RigSettings(samples=EXAMPLE_SAMPLES, repeats=1, duration_s=EXAMPLE_S))
    write_rig(rig, folder)
    return RecordingContext(load_case(folder / "rig.toml"), folder / "table.csv")


def track_folder(
    ticket: Ticket,  # noqa: ARG001
    folder: Path,
    memory: Path,
    inputs: RecordingInputs,
    context: RecordingContext,
) -> RecordingSeries | None:
    """Track a folder in its current state; None without readable recordings.

    `memory` is the folder that keeps what was read before.
    """
    updates = watch_folder(
        folder,
        memory,
        TrackSettings(**inputs._asdict()),
        WatchSettings(once=True, settle_time_s=SETTLE_S),
        case=context.case,
        table=context.table,
    )
    try:
        update = next(updates)
    except BadInput as error:
        raise BadInput(_name_page_fields(str(error))) from None
    return None if update.track is None else series_of_track(update.track, update.waiting)


def _name_page_fields(message: str) -> str:
    """Replace names of arguments in a message by names of fields of the page."""
    for argument, field in FIELDS.items():
        message = message.replace(argument, field)
    return message


def series_of_track(track: Track, waiting: int = 0) -> RecordingSeries:
    """Return a track as the page shows it."""
    stages = track.stages
    found = stages is not None and stages.found
    spectra = tuple(map(_spectrum, track.recordings))
    frequency, levels = _waterfall(spectra)
    return RecordingSeries(
        verdict=track.verdict(),
        alarm=track.alarm.state,
        rows=tuple(
            recording.row() | {"file": Path(recording.file).name} for recording in track.recordings
        ),
        x_name=track.x_name,
        x_label=column_label(track.x_name),
        band_hz=track.target.band_hz,
        full_load_crf_hz=track.target.full_load_crf_hz,
        split=float(stages.split) if found and stages is not None else None,
        interval=stages.interval if found and stages is not None else None,
        frequency=frequency,
        levels=levels,
        spectra=spectra,
        notes=tuple(map(_name_page_fields, (*track.problems, *track.notes))),
        waiting=waiting,
    )


def _spectrum(recording: TrackedRecording) -> RecordingSpectrum | None:
    """Return the spectrum of a recording, averaged over neighbouring lines if there are many."""
    spectrum = recording.reading.spectrum if recording.clean is None else recording.clean.spectrum
    if spectrum is None:
        return None
    group_size = -(-spectrum.density.size // MAX_LINES)
    frequency, density = (
        group_means(values, group_size) for values in (spectrum.frequency_hz, spectrum.density)
    )
    resonance = recording.resonance
    low, high = resonance.band_hz
    inside = (frequency >= low) & (frequency <= high)
    fitted = resonance.found and np.isfinite(resonance.damping_ratio)
    curve = np.where(inside, resonance.curve(frequency), np.nan) if fitted else np.empty(0)
    return RecordingSpectrum(frequency, density, curve, spectrum.unit)


def _waterfall(spectra: Sequence[RecordingSpectrum | None]) -> tuple[Field, Field]:
    """Return the first spectrum's frequencies [Hz] and levels over each median [dB]."""
    first = next((spectrum for spectrum in spectra if spectrum is not None), None)
    if first is None:
        return np.empty(0), np.empty((0, 0))
    stride = -(-len(spectra) // MAX_ROWS)
    rows = []
    for spectrum in spectra[::stride]:
        if spectrum is None:
            rows.append(np.full(first.frequency.size, np.nan))
            continue
        density = np.interp(first.frequency, spectrum.frequency, spectrum.density)
        median = float(np.median(density[density > 0.0])) if (density > 0.0).any() else 1.0
        rows.append(10.0 * np.log10(np.maximum(density / median, 1e-6)))
    return first.frequency, np.array(rows, dtype=np.float32)
