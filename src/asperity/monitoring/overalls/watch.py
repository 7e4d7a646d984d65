"""Watch of a table of overall values that grows: judgement and notifications at each change."""

import json
from collections.abc import Iterator
from dataclasses import dataclass, field
from datetime import UTC, datetime
from functools import partial
from pathlib import Path
from time import sleep, time
from typing import cast
from uuid import uuid4

from asperity.core.documents import JsonObject
from asperity.core.errors import AsperityError
from asperity.core.files import make_folder, write_text
from asperity.core.troubles import RetryDelay, Troubles, failure_reason
from asperity.monitoring.notify import COMMAND_S, NETWORK_S, RETRY_S, within
from asperity.monitoring.overalls.acknowledged import rows_until
from asperity.monitoring.overalls.judge import OverallTrack, judge_overalls, track_overalls
from asperity.monitoring.overalls.table import read_overalls
from asperity.monitoring.settings import Notifier, WatchSettings

DEFAULTS = WatchSettings()


@dataclass(frozen=True, slots=True, kw_only=True)
class OverallUpdate:
    """Judged table after a change (None if it could not be read), and sentences on failures."""

    track: OverallTrack | None
    failed: tuple[str, ...] = ()


@dataclass
class _Memory:
    """Memory for a later watch: the acknowledged time stamp, and what recipients know."""

    path: Path
    acknowledged: str | None = None
    known: dict[str, JsonObject] = field(default_factory=dict)

    @classmethod
    def load(cls, path: Path) -> "_Memory":
        """Return the stored memory; empty if there is none, or it is damaged."""
        try:
            stored = json.loads(path.read_text("utf-8"))
            stamp = stored["acknowledged"]
            known = {
                str(name): {"state": of["state"], "causes": [*of["causes"]]}
                for name, of in dict(stored["known"]).items()
            }
            return cls(path, None if stamp is None else str(stamp), known)
        except (OSError, ValueError, KeyError, TypeError):
            return cls(path)

    def save(self) -> None:
        """Store the memory."""
        make_folder(self.path.parent)
        content = {"acknowledged": self.acknowledged, "known": self.known}
        write_text(self.path, json.dumps(content))


def watch_overalls(
    path: str | Path,
    out: str | Path,
    watching: WatchSettings = DEFAULTS,
    *,
    acknowledge: str | None = None,
) -> Iterator[OverallUpdate]:
    """Yield an update at the start, when the table has changed, and when something fails.

    Parameters
    ----------
    path : table, as `read_overalls`; may be replaced or grow
    out : folder of the memory, made if need be
    watching : recipients, names and timing
    acknowledge : as `track_overalls`; stored

    Raises
    ------
    BadInput
        for a table that cannot be read at the start.
    AsperityError
        in a single run, if the memory cannot be written.
    """
    watch = _Watch(Path(path), Path(out), watching, acknowledge)
    while True:
        watch.notify()
        update = watch.update()
        if update is not None:
            yield update
        if watching.once:
            return
        sleep(watching.poll_interval_s)
        watch.read()


class _Watch:
    """State of the watch of a table."""

    def __init__(
        self, path: Path, out: Path, watching: WatchSettings, acknowledge: str | None
    ) -> None:
        self.path, self.watching = path, watching
        self.memory = _Memory.load(out / f"{path.name}.json")
        self.troubles, self.retry = Troubles(), RetryDelay(RETRY_S)
        self.version = _version(path)
        if acknowledge is None:
            self.track = self._judged()
        else:
            self.track = track_overalls(path, acknowledge=acknowledge)
            self.memory.acknowledged = self.track.acknowledged_place
        self.changed = True

    def read(self) -> None:
        """Judge the table again if it has changed and is not being written."""
        version = _version(self.path)
        age = time() - 1e-9 * version[1]
        if version == self.version or 0.0 <= age < self.watching.settle_time_s:
            return
        try:
            self.track = self._judged()
        except AsperityError as error:
            reason = failure_reason(error)
            self.troubles.begin("table", f"{reason}; the last evaluation stands, retrying")
            return
        self.troubles.end("table", f"{self.path.name} can be read again")
        self.version, self.changed = version, True

    def _judged(self) -> OverallTrack:
        """Judge the table after the acknowledged row, which may have left it."""
        overalls = read_overalls(self.path)
        return judge_overalls(overalls, rows_until(overalls, self.memory.acknowledged))

    def update(self) -> OverallUpdate | None:
        """Store the memory and return what is new; None if nothing is."""
        try:
            self.memory.save()
            self.troubles.end("memory", "the memory of the watch is stored again")
        except AsperityError as error:
            if self.watching.once:
                raise
            reason = failure_reason(error)
            self.troubles.begin("memory", f"{reason}; the watch continues without, retrying")
        failed, changed = self.troubles.take(), self.changed
        self.changed = False
        if not (changed or failed):
            return None
        return OverallUpdate(track=self.track if changed else None, failed=failed)

    def notify(self) -> None:
        """Notify the recipients that do not know the state or one of its causes."""
        if self.retry.waiting:
            return
        failed = False
        for notifier in self.watching.notifiers:
            known = self.memory.known.get(notifier.name)
            notification = self._notification(None if known is None else str(known["state"]))
            if known is None or not _covers(known, notification):
                before, state = notification["before"], notification["state"]
                if {before, state} & {*self.watching.notify_states}:
                    failed |= not self._sent(notifier, notification)
                else:
                    self._remember(notifier, notification)
        self.retry.record(failed=failed)

    def _sent(self, notifier: Notifier, notification: JsonObject) -> bool:
        """Send a notification; return whether it was delivered."""
        try:
            within(COMMAND_S + NETWORK_S, partial(notifier.send, notification))
        except Exception as error:  # noqa: BLE001 (program or network of the user)
            sentence = f"{notifier.name} could not be notified ({failure_reason(error)}); retrying"
            self.troubles.begin(notifier.name, sentence)
            return False
        self.troubles.end(notifier.name, f"{notifier.name} was notified")
        self._remember(notifier, notification)
        return True

    def _remember(self, notifier: Notifier, notification: JsonObject) -> None:
        self.memory.known[notifier.name] = {
            "state": notification["state"],
            "causes": notification["causes"],
        }

    def _notification(self, before: str | None) -> JsonObject:
        """Return the notification of the present state."""
        scalars, watching = self.track.scalars(rows=False), self.watching
        return {
            "id": str(uuid4()),
            "time": datetime.now(UTC).isoformat(timespec="seconds"),
            "machine": watching.machine or self.path.resolve().parent.name,
            "point": watching.point or self.path.stem,
            "sensor": watching.sensor or "overall",
            "before": before,
            **cast("JsonObject", scalars["alarm"]),
            "verdict": scalars["verdict"],
            "recording": self.track.last_place,
        }


def _covers(known: JsonObject, notification: JsonObject) -> bool:
    """Return whether a recipient knows the state and all its causes."""
    causes = [{*cast("list[str]", of["causes"])} for of in (known, notification)]
    return known["state"] == notification["state"] and causes[1] <= causes[0]


def _version(path: Path) -> tuple[int, int]:
    """Return size and time of change of a file; zeros if it is missing."""
    try:
        status = path.stat()
    except OSError:
        return 0, 0
    return status.st_size, status.st_mtime_ns
