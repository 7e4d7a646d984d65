"""A series of recordings, from files to stages and alarm."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from itertools import count
from pathlib import Path

from asperity.case import Case, MachineCase
from asperity.core.arrays import usual_float_errors
from asperity.core.errors import BadInput
from asperity.core.notebook import notebook_progress
from asperity.monitoring.files import RecordingPlace, RecordingTable, read_table, recordings_in
from asperity.monitoring.forecast import Forecaster
from asperity.monitoring.judgement import judge
from asperity.monitoring.ordering import unacknowledged
from asperity.monitoring.reading import (
    Reading,
    channels_in,
    common_spacing,
    read_channels,
    require_readable,
)
from asperity.monitoring.settings import TrackSettings
from asperity.monitoring.target import Target, search_target
from asperity.monitoring.track_result import Track
from asperity.recording import name_order_remark

DEFAULTS = TrackSettings()
MOST_NAMES = 4  # of folders in a note


@usual_float_errors
def track_recordings(
    paths: Sequence[str | Path],
    settings: TrackSettings = DEFAULTS,
    *,
    case: Case | MachineCase | None = None,
    x: Sequence[float] | None = None,
    table: str | Path | RecordingTable | None = None,
    forecaster: Forecaster | None = None,
    progress: Callable[[Reading], None] | None = None,
) -> Track:
    """Read recordings, find their contact resonances and judge trend, stages and alarm.

    Parameters
    ----------
    paths : files, and folders of files
    settings : how recordings are read and judged
    case : its contact model gives the search band and the load share that belongs to a CRF; that
        of a machine also gives the mesh and fault frequencies. Without case and band the paper's
        contact is assumed, and `notes` say so
    x : place of each recording in the series, shape (recordings,); alternatively `table`, a csv
        file for `read_table` or its result. Default: hours since the first recording if all
        state their start, otherwise their number
    forecaster : forecasts the series after the last acknowledged recording; may raise the alarm
    progress : called with each file that was read

    Raises
    ------
    BadInput
        if no recording can be read, or arguments do not fit the recordings.
    """
    target = search_target(case, settings.band_hz)
    files = recordings_in(paths)
    parsed = table if isinstance(table, RecordingTable) or table is None else read_table(table)
    x_name, places = _stated_places(files, x, parsed)
    progress = progress or _notebook_progress(len(files))
    readings = require_readable(_read_files(files, settings, target, places, progress))
    track = judge(readings, target, settings, places=places, x_name=x_name)
    track = replace(track, notes=(*track.notes, *_several_folders(files)))
    if track.x_name == "recording" and (remark := name_order_remark(files)):
        track = replace(track, notes=(*track.notes, f"{remark[:1].upper()}{remark[1:]}."))
    if forecaster is None:
        return track
    rows = unacknowledged([recording.row() for recording in track.recordings], settings.acknowledge)
    return track.with_forecast(forecaster(rows, track.x_name, comparable=track.comparable))


def _notebook_progress(files: int) -> Callable[[Reading], None] | None:
    """Return a callback that counts the readings; None outside of notebooks."""
    numbers = count(1)
    return notebook_progress(
        "Reading",
        lambda _: (min((number := next(numbers)) / files, 1.0), f"{number} of {files} recordings"),
    )


def _several_folders(files: Sequence[Path]) -> list[str]:
    """Return a note on recordings of several folders, perhaps of several machines."""
    folders = [*dict.fromkeys(file.parent.name for file in files)]
    if len({file.parent for file in files}) < 2:
        return []
    names = ", ".join(folders[:MOST_NAMES]) + (", ..." if len(folders) > MOST_NAMES else "")
    return [
        f"Recordings of several folders ({names}) are judged as one series; if these are different "
        "machines, track each folder by itself, or watch the tree."
    ]


def _read_files(
    files: Sequence[Path],
    settings: TrackSettings,
    target: Target,
    places: Mapping[str, RecordingPlace] | None,
    progress: Callable[[Reading], None] | None,
) -> list[Reading]:
    """Read every requested channel, file by file."""
    options = settings.read_options
    channels = channels_in(options.channel)
    spacing = common_spacing(files, options, target)
    numbered_readings = [
        *read_channels(
            files,
            options,
            target,
            spacing,
            places=places,
            workers=settings.workers,
            progress=progress,
        )
    ]
    readings: list[Reading] = []
    for number, channel in enumerate(channels):
        by_number = dict(numbered_readings[number * len(files) : (number + 1) * len(files)])
        of_channel = [by_number[index] for index in range(len(files))]
        if len(channels) > 1 and all(reading.refused for reading in of_channel):
            raise BadInput(
                f"channel {channel} cannot be read in any recording: {of_channel[0].reason}"
            )
        readings += of_channel
    return readings


def _stated_places(
    files: Sequence[Path], x: Sequence[float] | None, table: RecordingTable | None
) -> tuple[str, dict[str, RecordingPlace] | None]:
    """Return the name of x and the place of each file, where the caller states them."""
    if x is not None and table is not None:
        raise BadInput("x and table both state the places of recordings; give one of them")
    if x is not None:
        if len(x) != len(files):
            raise BadInput(f"x needs one value for each of {len(files)} recordings, got {len(x)}")
        return "x", {
            str(file): RecordingPlace(x=float(value)) for file, value in zip(files, x, strict=True)
        }
    if table is not None:
        return table.x_name, table.places_of(files)
    return "", None
