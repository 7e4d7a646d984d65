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
from asperity.monitoring.fleet.tree_watch import TreeWatch
from asperity.monitoring.forecast import Forecaster, ForecastSchedule
from asperity.monitoring.reading import Reading
from asperity.monitoring.settings import TrackSettings, WatchSettings
from asperity.monitoring.store.database import STORE, Store, StoreUnavailable
from asperity.monitoring.store.sensor_lookup import open_sensors
from asperity.monitoring.target import search_target
from asperity.monitoring.watching.folder_watch import FolderWatch
from asperity.monitoring.watching.watch_state import Update, WatchState
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
    folder = _checked(folder, watching)
    return _updates(
        open_watch(
            folder,
            _open_store(Path(out), watching),
            settings,
            watching,
            case=case,
            table=table,
            forecaster=forecaster,
            progress=progress,
        )
    )


def watch_tree(
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
    """Yield updates of all subfolders that contain recordings, each a measuring point.

    The first level of folders names the machine, the others the point. All are stored in one file.
    A failure of one does not stop the others; an update names its `place`.

    Parameters
    ----------
    folder : root of the tree; folders that appear later are watched, too
    out, settings, watching, case, table, forecaster, progress : as `watch_folder`

    Raises
    ------
    BadInput
        as `watch_folder`, or if machine or point are named.
    AsperityError
        at the end of a single run, if a folder could not be evaluated.
    """
    if watching.machine is not None or watching.point is not None:
        raise BadInput(
            f"folders name machine and point in a tree, got {watching.machine or watching.point}; "
            "omit it, or watch a single folder"
        )
    folder = _checked(folder, watching)
    open_place = partial(
        open_watch,
        settings=settings,
        case=case,
        table=table,
        forecaster=forecaster,
        progress=progress,
    )
    store = _open_store(Path(out), watching)
    return _tree_updates(TreeWatch(folder, Path(out), store, watching, open_place))


def _open_store(out: Path, watching: WatchSettings) -> Store:
    """Return the store of a watch, which may be written later, such as after a full disk."""
    make_folder(out)
    return Store(watching.store or out / STORE, allow_unavailable=not watching.once)


def _checked(folder: str | Path, watching: WatchSettings) -> Path:
    """Return the folder in full; raise BadInput if it does not exist, or for a wrong setting."""
    if watching.overdue_after_s is not None:
        require_positive(
            "the time without a recording (`overdue_after_s`)", watching.overdue_after_s, "s"
        )
    if watching.keep_s is not None:
        require_positive("the age of recordings to keep (`keep_s`)", watching.keep_s, "s")
    for alarm_state in watching.notify_states:
        require_choice("tell", alarm_state, ALARM_STATES)
    if not Path(folder).is_dir():
        raise BadInput(f"{folder} is not a folder; name the folder where recordings arrive")
    return Path(folder).resolve()


def open_watch(
    folder: Path,
    store: Store,
    settings: TrackSettings,
    watching: WatchSettings,
    *,
    case: Case | MachineCase | None = None,
    table: str | Path | None = None,
    forecaster: Forecaster | None = None,
    progress: Callable[[Reading], None] | None = None,
) -> FolderWatch:
    """Return the watch of one folder; other arguments as of `watch_folder`."""
    target = search_target(case, settings.band_hz)
    reopen = partial(
        open_sensors,
        folder=folder,
        names=(watching.machine, watching.point, watching.sensor),
        target=target,
        options=settings.read_options,
    )
    try:
        sensors = reopen(store)
    except StoreUnavailable:  # a new sensor, on a full disk
        if watching.once:
            raise
        sensors = reopen(Store(store.path, in_memory=True))
    sensors.notifications.notify_states = watching.notify_states
    state = WatchState(sensors, target, settings, watching, ForecastSchedule(forecaster))
    return FolderWatch(state, store, folder, table, progress, reopen)


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


def _tree_updates(tree: TreeWatch) -> Generator[Update]:
    """Yield the updates of all places, in turn."""
    watching = tree.watching
    with closing(tree):
        while True:
            yield from tree.check()
            if watching.on_check is not None:
                watching.on_check()
            if watching.once:
                tree.require_complete()
                return
            sleep(watching.poll_interval_s)
