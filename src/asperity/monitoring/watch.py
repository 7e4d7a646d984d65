"""Monitoring of a folder: each recording is read once, and the series is judged again.

Readings and judgements are kept in a store, so that a watch can stop at any moment and continue
later. Of a long series the first and the latest recordings are judged; the others keep their
judgement in the store.
"""

from collections.abc import Callable, Generator
from contextlib import closing
from functools import partial
from pathlib import Path
from time import sleep

from asperity.case import Case, MachineCase
from asperity.core.errors import BadInput, require_choice, require_positive
from asperity.core.files import make_folder
from asperity.monitoring.folder_watch import FolderWatch
from asperity.monitoring.forecast import Forecaster, ForecastSchedule
from asperity.monitoring.reading import Reading
from asperity.monitoring.settings import TrackSettings, WatchSettings
from asperity.monitoring.store.database import STORE
from asperity.monitoring.store.sensor_lookup import open_sensors
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
) -> Generator[Update]:
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
    if watching.keep_s is not None:
        require_positive("the age of recordings to keep (`keep_s`)", watching.keep_s, "s")
    for alarm_state in watching.notify_states:
        require_choice("tell", alarm_state, ALARM_STATES)
    folder, out = Path(folder).resolve(), Path(out)
    if not folder.is_dir():
        raise BadInput(f"{folder} is not a folder; name the folder where recordings arrive")
    return _updates(
        open_watch(
            folder,
            out,
            settings,
            watching,
            case=case,
            table=table,
            forecaster=forecaster,
            progress=progress,
        )
    )


def open_watch(
    folder: Path,
    out: Path,
    settings: TrackSettings,
    watching: WatchSettings,
    *,
    case: Case | MachineCase | None = None,
    table: str | Path | None = None,
    forecaster: Forecaster | None = None,
    progress: Callable[[Reading], None] | None = None,
) -> FolderWatch:
    """Return the watch of one folder; arguments as of `watch_folder`."""
    make_folder(out)
    target = search_target(case, settings.band_hz)
    reopen = partial(
        open_sensors,
        folder=folder,
        names=(watching.machine, watching.point, watching.sensor),
        target=target,
        options=settings.read_options,
    )
    sensors = reopen(watching.store or out / STORE)
    sensors.notifications.notify_states = watching.notify_states
    state = WatchState(sensors, target, settings, watching, ForecastSchedule(forecaster))
    return FolderWatch(state, folder, table, progress, reopen)


def _updates(watch: FolderWatch) -> Generator[Update]:
    """Yield an update at the start and whenever recordings have arrived or are overdue."""
    watching = watch.state.watching
    with closing(watch):
        while True:
            update = watch.check()
            if update is not None:
                yield update
            if watching.on_check is not None:
                watching.on_check()
            if watching.once:
                return
            sleep(watching.poll_interval_s)
