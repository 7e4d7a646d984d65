"""What workers do with recordings: a series or a folder read, judged and made small enough to be drawn."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from asperity.app.contact_jobs import Ticket
from asperity.case import Case
from asperity.core.arrays import Field
from asperity.core.errors import BadInput
from asperity.monitoring import (
    Track,
    TrackedRecording,
    TrackSettings,
    WatchSettings,
    track_recordings,
    watch_folder,
)

MOST_LINES = 600  # of a spectrum that is drawn
MOST_ROWS = 400  # recordings of a waterfall
SETTLE_S = 2.0  # for which a file must have stayed as it is
FIELDS = {
    "give rate_hz": "give the sampling rate",
    "give case or band_hz": "give the band",
    "give scale": "give the scale",
}


class Stated(NamedTuple):
    """What was typed about the recordings; None leaves it to the files."""

    rate_hz: float | None = None
    unit: str | None = None
    channel: str | None = None
    band_hz: tuple[float, float] | None = None


class Ear(NamedTuple):
    """A recording's spectrum as it is drawn: frequencies [Hz], density, the fitted curve (empty without one)."""

    frequency: Field
    density: Field
    curve: Field
    unit: str


@dataclass(frozen=True, kw_only=True, eq=False)
class Heard:
    """A series of recordings as the page shows it.

    `rows` as `asperity track --json` has them. `levels` [dB over the recording's median], shape
    (recordings, lines) at `frequency` [Hz]; `ears` a spectrum each, None for a file without one.
    `split` and its interval, in units of x, are None where no stage was told.
    """

    verdict: str
    alarm: str
    rows: tuple[dict[str, Any], ...]
    x_name: str
    band_hz: tuple[float, float]
    full_load_crf_hz: float | None
    split: float | None
    interval: tuple[float, float] | None
    frequency: Field
    levels: Field
    ears: tuple[Ear | None, ...]
    notes: tuple[str, ...]
    waiting: int = 0


def hear_files(ticket: Ticket, paths: Sequence[Path], stated: Stated, case: Case | None) -> Heard:  # noqa: ARG001
    """Recordings that were dropped, judged as one series."""
    try:
        track = track_recordings(
            paths,
            TrackSettings(**stated._asdict()),
            case=case,
        )
    except BadInput as refusal:
        raise BadInput(_on_the_page(str(refusal))) from None
    return heard_of(track)


def hear_folder(
    ticket: Ticket,  # noqa: ARG001
    folder: Path,
    memory: Path,
    stated: Stated,
    case: Case | None,
) -> Heard | None:
    """A folder as it is now, what was read before kept in `memory`; None as long as nothing of it can be read."""
    looks = watch_folder(
        folder,
        memory,
        TrackSettings(**stated._asdict()),
        WatchSettings(once=True, settle_time_s=SETTLE_S),
        case=case,
    )
    try:
        update = next(looks)
    except BadInput as refusal:
        raise BadInput(_on_the_page(str(refusal))) from None
    return None if update.track is None else heard_of(update.track, update.waiting)


def _on_the_page(sentence: str) -> str:
    for asked, field in FIELDS.items():
        sentence = sentence.replace(asked, field)
    return sentence


def heard_of(track: Track, waiting: int = 0) -> Heard:
    """A track as the page shows it."""
    stages = track.stages
    found = stages is not None and stages.found
    ears = tuple(map(_ear, track.recordings))
    frequency, levels = _waterfall(ears)
    return Heard(
        verdict=track.verdict(),
        alarm=track.alarm.state,
        rows=tuple(
            recording.row() | {"file": Path(recording.file).name} for recording in track.recordings
        ),
        x_name=track.x_name,
        band_hz=track.target.band_hz,
        full_load_crf_hz=track.target.full_load_crf_hz,
        split=float(stages.split) if found and stages is not None else None,
        interval=stages.interval if found and stages is not None else None,
        frequency=frequency,
        levels=levels,
        ears=ears,
        notes=tuple(map(_on_the_page, (*track.problems, *track.notes))),
        waiting=waiting,
    )


def _ear(recording: TrackedRecording) -> Ear | None:
    """A recording's spectrum, the means of neighbours where it has more lines than are seen."""
    spectrum = recording.reading.spectrum if recording.clean is None else recording.clean.spectrum
    if spectrum is None:
        return None
    together = -(-spectrum.density.size // MOST_LINES)
    frequency, density = (
        _means(values, together) for values in (spectrum.frequency_hz, spectrum.density)
    )
    resonance = recording.resonance
    low, high = resonance.band_hz
    inside = (frequency >= low) & (frequency <= high)
    fitted = resonance.found and np.isfinite(resonance.damping_ratio)
    curve = np.where(inside, resonance.curve(frequency), np.nan) if fitted else np.empty(0)
    return Ear(frequency, density, curve, spectrum.unit)


def _means(values: Field, together: int) -> Field:
    return np.asarray(
        values[: values.size // together * together].reshape(-1, together).mean(axis=1)
    )


def _waterfall(ears: Sequence[Ear | None]) -> tuple[Field, Field]:
    """Frequencies [Hz] and levels over each recording's median [dB], on the first spectrum's frequencies."""
    first = next((ear for ear in ears if ear is not None), None)
    if first is None:
        return np.empty(0), np.empty((0, 0))
    every = -(-len(ears) // MOST_ROWS)
    rows = []
    for ear in ears[::every]:
        if ear is None:
            rows.append(np.full(first.frequency.size, np.nan))
            continue
        density = np.interp(first.frequency, ear.frequency, ear.density)
        typical = float(np.median(density[density > 0.0])) if (density > 0.0).any() else 1.0
        rows.append(10.0 * np.log10(np.maximum(density / typical, 1e-6)))
    return first.frequency, np.array(rows, dtype=np.float32)
