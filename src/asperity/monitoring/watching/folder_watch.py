"""Checks of one watched folder; they continue through full disks, lost folders and failures."""

import math
from collections.abc import Callable
from dataclasses import replace
from datetime import UTC, datetime, timedelta
from pathlib import Path
from time import monotonic

from asperity.core.errors import AsperityError, BadInput
from asperity.core.troubles import RetryDelay, failure_reason
from asperity.monitoring.files import RecordingTable, natural_order, read_table
from asperity.monitoring.ordering import file_name, order_recordings
from asperity.monitoring.reading import Reading
from asperity.monitoring.states import overdue_reason
from asperity.monitoring.store.database import FileVersion, Store, StoreUnavailable
from asperity.monitoring.store.memory_copy import MemoryCopy
from asperity.monitoring.store.retention import thin_store
from asperity.monitoring.store.sensors import Sensors
from asperity.monitoring.watching.watch_state import Update, WatchState

THIN_AFTER = 32  # recordings after which the store is thinned again
FOLDER, STORE, CHECK = "folder", "store", "check"  # causes of failures


class FolderWatch:
    """Checks of one folder.

    While its store cannot be written, the watch continues on a copy in memory, and merges it
    later. With `once` a failure is raised.

    Parameters
    ----------
    state : of the folder; with sensors in memory as long as the store cannot be written
    store : of its sensors
    folder, table_file, progress : as `watch_folder`
    reopen : returns the sensors of a store anew
    """

    def __init__(
        self,
        state: WatchState,
        store: Store,
        folder: Path,
        table_file: str | Path | None,
        progress: Callable[[Reading], None] | None,
        reopen: Callable[[Store], Sensors],
    ) -> None:
        self.state, self.store, self.folder, self.table_file = state, store, folder, table_file
        self.progress, self.reopen = progress, reopen
        self.troubles = state.troubles
        self._copy: MemoryCopy | None = None
        self._repairs = store.repairs
        if state.sensors.store is not store:
            self._continue_in_memory()
        self._lost = folder  # the folder, or the first of its ancestors that was missing
        self._delay = RetryDelay(state.watching.poll_interval_s)
        self._first, self._unjudged, self._overdue = True, False, ""
        self._unthinned = THIN_AFTER  # recordings since the store was thinned
        # last arrival in the store, and by a clock that cannot be set [s]
        self._last_arrival: tuple[datetime, float] | None = None
        self._arrived_s = -math.inf  # last arrival of this run

    def check(self) -> Update | None:
        """Return an update at first, and if recordings have arrived or are overdue.

        A failure that begins or ends is an update, too, with sentences in `failed` only.

        Raises
        ------
        BadInput
            at first, for options that do not suit the recordings.
        AsperityError
            for any failure, if the folder is watched once.
        """
        if self._delay.waiting:
            return None
        update = None
        try:
            self._use_store()
            update = self._check()
            self._thin()
        except StoreUnavailable as error:
            evaluated_again = self._check_in_memory(error)
            update = update or evaluated_again
        except Exception as error:
            if self.state.watching.once or (self._first and isinstance(error, BadInput)):
                raise
            self._record_failure(error)
        else:
            self._record_success()
        sentences = (*self.store.take_remarks(), *self.troubles.take())
        if update is None:
            return Update(new=(), track=None, failed=sentences, notice=True) if sentences else None
        failed = (*update.failed, *sentences)
        return replace(update, failed=failed, address=(*self.state.sensors.address,))

    def close(self) -> None:
        """Merge a copy in memory into the store and close it; raises as `finish`."""
        try:
            self.finish()
        finally:
            self.store.close()

    def finish(self) -> None:
        """Merge a copy in memory into the store.

        Raises
        ------
        AsperityError
            if the store cannot be written.
        """
        try:
            self._merge_copy()
        except StoreUnavailable as error:
            raise AsperityError(
                f"{failure_reason(error)}; what has arrived since is not stored and will be read "
                "again from its files"
            ) from error

    def _cause(self, kind: str) -> str:
        """Return the name of a cause in this folder."""
        return f"{kind} {self.folder}"

    def _record_success(self) -> None:
        """Record a check without failure."""
        self._delay.record(failed=False)
        self.troubles.end(self._cause(CHECK), f"{self.folder} is checked again")

    def _record_failure(self, error: Exception) -> None:
        """Record a failed check: recordings that it has read are judged by the next one."""
        self._unjudged = True
        self._delay.record(failed=True)
        reason = failure_reason(error)
        self.troubles.begin(
            self._cause(CHECK),
            f"{self.folder} could not be checked ({reason}); the watch continues and retries",
        )

    # Store
    # ----------------------------------------------------------------------------------------------

    def _use_store(self) -> None:
        """Return from a copy in memory to the store, as soon as it can be written."""
        if self._copy is None:
            self.store.require_present()
            self.store.check_changes()
            if self.store.repairs != self._repairs:
                self._reopen()
            return
        try:
            self._merge_copy()
        except (AsperityError, OSError) as error:
            self._state_unavailable(error)
            return
        self._unjudged = True
        self.troubles.end(STORE, f"{self.store.path} is written again; nothing was lost")

    def _merge_copy(self) -> None:
        """Merge a copy in memory into the store, and continue with the sensors of the store."""
        if self._copy is None:
            return
        self.store.recover()
        self._copy.merge(self.store)
        memory = self.state.sensors.store
        self._reopen()
        memory.close()
        self._copy = None

    def _reopen(self) -> None:
        """Read the sensors of the store again; they are judged again."""
        sensors = self.reopen(self.store)
        sensors.notifications.notify_states = self.state.sensors.notifications.notify_states
        self.state.release()
        self.state.sensors, self._repairs, self._unjudged = sensors, self.store.repairs, True

    def _state_unavailable(self, error: Exception) -> None:
        """State, once, that the store cannot be used."""
        self.troubles.begin(
            STORE,
            f"{failure_reason(error)}; the watch continues in memory and writes it later",
        )

    def _continue_in_memory(self) -> None:
        """Continue with a copy of the sensors in memory."""
        self._copy = MemoryCopy(self.state.sensors)
        self.state.sensors = self._copy.sensors

    def _check_in_memory(self, error: StoreUnavailable) -> Update | None:
        """Check the folder on a copy in memory, as the store cannot be used."""
        if self.state.watching.once:
            raise error
        self._unjudged = True
        self._state_unavailable(error)
        try:
            if self._copy is None:
                self._continue_in_memory()
            update = self._check()
        except Exception as failure:  # noqa: BLE001 (a watch continues)
            self._record_failure(failure)
            return None
        self._record_success()
        return update

    # Checks
    # ----------------------------------------------------------------------------------------------

    def _check(self) -> Update | None:
        """Return an update at first, and if recordings have arrived or are overdue."""
        state, watching = self.state, self.state.watching
        arrived, table, waiting = self._arrivals()
        count = len(state.unreported)
        state.read(arrived, table, self.progress)
        new = tuple(sorted(state.unreported, key=lambda reading: natural_order(reading.file)))
        if len(new) > count:
            self._arrived_s = monotonic()
        overdue = (
            ""
            if new or (self._first and state.settings.acknowledge)
            else self._overdue_reason(watching.overdue_after_s)
        )
        judgement = state.sensors.record_overdue(overdue, state.recipients) if overdue else None
        if judgement is None:
            update = self._update(table, new)
        else:
            state.deliver(now=self._first)
            update = None
            if not self._overdue:
                order = order_recordings(_series(state.sensors), table, state.sensors)
                track = state.overdue(order, overdue)
                update = Update(new=(), track=track, judgement=judgement)
        self._first, self._overdue = False, overdue
        self._unthinned += len(new)
        return None if update is None else replace(update, waiting=waiting)

    def _thin(self) -> None:
        """Delete spectra and old recordings that are not needed; not of a copy in memory."""
        watching, sensors = self.state.watching, self.state.sensors
        due = self._unthinned >= THIN_AFTER or watching.once
        if due and self._copy is None and sensors.by_name:
            table = None if self.table_file is None else read_table(self.table_file)
            order = order_recordings(_series(sensors), table, sensors)
            keep_s = watching.keep_s
            self._unthinned = 0  # also if it fails: not again at the next check
            thin_store(sensors, order.instants, self.state.present, keep_s)

    def _arrivals(self) -> tuple[list[FileVersion], RecordingTable | None, int]:
        """Return complete new files that the table contains, the table, and how many wait."""
        state = self.state
        try:
            unread = state.unread(self.folder)
        except OSError as error:
            ancestors = (*reversed(self.folder.parents), self.folder)
            lost = next((folder for folder in ancestors if not folder.exists()), self.folder)
            reason = f"{lost} cannot be read ({error.strerror or error})"
            if state.watching.once:
                raise AsperityError(f"{reason}; restore the folder, and retry") from error
            self._lost = lost  # of a tree with many folders, their common ancestor is stated
            self.troubles.begin(f"{FOLDER} {lost}", f"{reason}; the watch continues and retries")
            return [], None, 0
        self.troubles.end(f"{FOLDER} {self._lost}", f"{self._lost} is read again")
        arrived = state.unchanged(unread)
        table = None
        if self.table_file is not None and (arrived or state.sensors.by_name):
            table = read_table(self.table_file)
            arrived = [key for key in arrived if table.row(Path(key.file)) is not None]
        return arrived, table, len(unread) - len(arrived)

    def _overdue_reason(self, limit_s: float | None) -> str:
        """Return why recordings are overdue; jumps of the system's clock have no effect."""
        arrivals = self.state.sensors.arrivals()
        if not arrivals:
            return ""
        last = self._last_arrival
        if last is None or last[0] != arrivals[-1]:
            before_s = max((datetime.now(UTC) - arrivals[-1]).total_seconds(), 0.0)
            arrived_s = max(monotonic() - before_s, self._arrived_s)
            last = self._last_arrival = arrivals[-1], arrived_s
        elapsed = timedelta(seconds=monotonic() - last[1])
        return overdue_reason(arrivals, limit_s, arrivals[-1] + elapsed)

    def _update(self, table: RecordingTable | None, new: tuple[Reading, ...]) -> Update | None:
        """Judge new recordings, or make a forecast that is due; send notifications that are due."""
        state = self.state
        if new or self._first or self._unjudged:
            update = state.update(_series(state.sensors), table, new, first=self._first)
            self._unjudged = False
            state.unreported.clear()
            return update
        forecast = state.with_forecast()
        state.deliver()
        return None if forecast is None else Update(new=(), track=forecast)


def _series(sensors: Sensors) -> list[FileVersion]:
    """Return the files of all recordings, in natural order of their names."""
    return sorted(sensors.series(), key=lambda key: natural_order(file_name(key)))
