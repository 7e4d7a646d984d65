"""Monitoring of a folder: each recording is read once, and the series is judged again.

Readings and judgements are kept in a store, so that a watch can stop at any moment and continue
later. Of a long series the first and the latest recordings are judged; the others keep their
judgement in the store.
"""

from collections.abc import Callable, Iterator
from contextlib import closing
from dataclasses import replace
from pathlib import Path
from time import sleep

from asperity.case import Case, MachineCase
from asperity.core.errors import BadInput, require_choice, require_positive
from asperity.core.files import make_folder
from asperity.monitoring.files import RecordingTable, natural_order, read_table
from asperity.monitoring.forecast import Forecaster, ForecastSchedule
from asperity.monitoring.notify import deliver
from asperity.monitoring.ordering import file_name, order_recordings
from asperity.monitoring.reading import Reading
from asperity.monitoring.settings import TrackSettings, WatchSettings
from asperity.monitoring.states import overdue_reason
from asperity.monitoring.store.database import STORE, FileVersion
from asperity.monitoring.store.sensor_lookup import open_sensors
from asperity.monitoring.store.sensors import Sensors
from asperity.monitoring.target import search_target
from asperity.monitoring.watch_state import Update, WatchState
from asperity.trend import ALARM_STATES

TRACK_DEFAULTS = TrackSettings()
WATCH_DEFAULTS = WatchSettings()


def watch_folder(
    folder: str | Path,
    out: str | Path,
    settings: TrackSettings = TRACK_DEFAULTS,
    watching: WatchSettings = WATCH_DEFAULTS,
    *,
    case: Case | MachineCase | None = None,
    table: str | Path | None = None,
    forecaster: Forecaster | None = None,
    progress: Callable[[Reading], None] | None = None,
) -> Iterator[Update]:
    """Yield an update at the start and whenever recordings have arrived.

    Parameters
    ----------
    folder : where recordings arrive
    out : folder of the store, made if need be; a later watch with the same store continues it
    settings : as `track_recordings`. `acknowledge` is stored: an alarm persists until then
    watching : store, sensor, notifications and timing
    case, table, progress : as `track_recordings`; a recording that is not in `table` yet waits
    forecaster : forecasts the series after the last acknowledged recording, when a judgement has
        been stored and sent, for at most a tenth of the time; may raise the alarm

    Raises
    ------
    BadInput
        if the folder does not exist, a time is not positive, or settings differ from those with
        which the store was begun.
    """
    if watching.overdue_after_s is not None:
        require_positive(
            "the time without a recording (`overdue_after_s`)", watching.overdue_after_s, "s"
        )
    for alarm_state in watching.notify_states:
        require_choice("tell", alarm_state, ALARM_STATES)
    folder, out = Path(folder).resolve(), Path(out)
    if not folder.is_dir():
        raise BadInput(f"{folder} is not a folder; name the folder where recordings arrive")
    make_folder(out)
    target = search_target(case, settings.band_hz)
    sensors = open_sensors(
        watching.store or out / STORE,
        folder,
        (watching.machine, watching.point, watching.sensor),
        target,
        settings.read_options,
    )
    sensors.notifications.notify_states = watching.notify_states
    state = WatchState(sensors, target, settings, watching, ForecastSchedule(forecaster))
    return _updates(state, folder, table, progress)


def _updates(
    state: WatchState,
    folder: Path,
    table_file: str | Path | None,
    progress: Callable[[Reading], None] | None,
) -> Iterator[Update]:
    """Yield an update at the start and whenever recordings have arrived or are overdue."""
    sensors = state.sensors
    watching = state.watching
    with closing(sensors.store):
        first, overdue_before = True, ""
        while True:
            arrived, table, waiting = _arrivals(state, folder, table_file)
            new = state.read(arrived, table, progress)
            overdue = (
                ""
                if new or (first and state.settings.acknowledge)
                else overdue_reason(sensors.arrivals(), watching.overdue_after_s)
            )
            judgement = sensors.record_overdue(overdue, state.recipients) if overdue else None
            if judgement is None:
                update = _update(state, table, new, first=first)
            else:
                failed = deliver(sensors, watching.notifiers, now=first)
                update = None
                if not overdue_before:
                    track = state.overdue(
                        order_recordings(_series(sensors), table, sensors), overdue
                    )
                    update = Update(new=(), track=track, judgement=judgement, failed=failed)
            if update is not None:
                yield replace(update, waiting=waiting)
            if watching.once:
                return
            first = False
            overdue_before = overdue
            sleep(watching.poll_interval_s)


def _arrivals(
    state: WatchState, folder: Path, table_file: str | Path | None
) -> tuple[list[FileVersion], RecordingTable | None, int]:
    """Return complete new files that the table contains, the table, and how many files wait."""
    unread = state.unread(folder)
    arrived = state.unchanged(unread)
    table = None
    if table_file is not None and (arrived or state.sensors.by_name):
        table = read_table(table_file)
        arrived = [key for key in arrived if table.row(Path(key.file)) is not None]
    return arrived, table, len(unread) - len(arrived)


def _update(
    state: WatchState, table: RecordingTable | None, new: tuple[Reading, ...], *, first: bool
) -> Update | None:
    """Judge new recordings, or make a forecast that is due; send notifications that are due."""
    if new or first:
        return state.update(_series(state.sensors), table, new, first=first)
    forecast = state.with_forecast()
    failed = deliver(state.sensors, state.watching.notifiers)
    return None if forecast is None else Update(new=(), track=forecast, failed=failed)


def _series(sensors: Sensors) -> list[FileVersion]:
    """Return the files of all recordings, in natural order of their names."""
    return sorted(sensors.series(), key=lambda key: natural_order(file_name(key)))
