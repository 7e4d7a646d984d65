"""State of a watched folder: what the store holds and what this run has read of it."""

import json
import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from hashlib import sha256
from itertools import pairwise
from pathlib import Path
from time import monotonic, sleep, time
from typing import Any

from asperity.core.errors import BadInput
from asperity.core.troubles import Troubles
from asperity.monitoring.alarm import LAST
from asperity.monitoring.files import RecordingTable, is_utf8, may_be_recording, natural_order
from asperity.monitoring.forecast import ForecastSchedule
from asperity.monitoring.judgement import judge
from asperity.monitoring.notify import deliver
from asperity.monitoring.ordering import (
    Order,
    file_name,
    judged_window,
    max_window,
    order_recordings,
    unacknowledged,
)
from asperity.monitoring.reading import Reading, common_spacing, read_channels
from asperity.monitoring.series_state import PreviousStates, SeriesMemory
from asperity.monitoring.settings import TrackSettings, WatchSettings
from asperity.monitoring.store.database import FileVersion
from asperity.monitoring.store.sensors import Sensors
from asperity.monitoring.target import Target
from asperity.monitoring.track_result import Track
from asperity.recording import sidecar_names

SUFFIXES = (".toml", ".json")  # of sidecars
CACHE_FACTOR = 16  # memory of a watch over that of its spectra's densities, as measured
STRIDE = 80  # recordings per judgement where many arrive at once


@dataclass(frozen=True, slots=True, kw_only=True)
class Update:
    """New files and the series with them.

    `track` is None as long as there is no recording, and where `judgement` is the stored last
    judgement, as `Track.scalars` returned it. An overdue sensor has both. `failed` are sentences on
    failures that begin or end, and on files that are left out or have to wait; a `notice` has only
    these. `address` names machine, point and sensor; `place` the first two in a tree of folders.
    `waiting` files may still be
    written, or are not in the table yet.
    """

    new: tuple[Reading, ...]
    track: Track | None
    waiting: int = 0
    failed: tuple[str, ...] = ()
    judgement: Mapping[str, Any] | None = None
    notice: bool = False
    place: str = ""
    address: tuple[str, str, str] = ("", "", "")


def version_of(path: Path) -> FileVersion:
    """Return the present version of a file and of its sidecar."""
    stamps = []
    sidecar = next(
        (
            path.with_name(name)
            for name in sidecar_names(path.name)
            if path.with_name(name).is_file()
        ),
        None,
    )
    for file in (path, sidecar):
        if file is not None:
            status = file.stat()
            stamps.append(f"{status.st_size} {status.st_mtime_ns}")
    return FileVersion(str(path), " ".join(stamps))


def _digest(
    question: Mapping[str, object],
    table: RecordingTable | None,
    series: Sequence[FileVersion],
    target: Target,
) -> str:
    """Return a digest of all on which a judgement depends, besides the content of the store."""
    inputs = json.dumps([question, repr(table), target.full_load_crf_hz], default=str)
    return sha256("\n".join([inputs, *map("\0".join, series)]).encode(errors="replace")).hexdigest()


class WatchState:
    """Sensors of a watch: the store, and in memory what this run has read of it."""

    def __init__(
        self,
        sensors: Sensors,
        target: Target,
        settings: TrackSettings,
        watching: WatchSettings,
        schedule: ForecastSchedule,
    ) -> None:
        self.sensors, self.target = sensors, target
        self.settings, self.watching, self.schedule = settings, watching, schedule
        # the last judgement, while its forecast is due
        self._awaiting_forecast: tuple[Track, Order, str] | None = None
        self._readings: dict[FileVersion, list[Reading]] = {}
        self._memory: SeriesMemory | None = None
        self._not_utf8: set[str] = set()
        self.unreported: list[Reading] = []  # read, and not in an update yet
        self.present: set[str] = set()  # files of the folder when it was last read
        self.troubles = Troubles()
        self._unreached: set[str] = set()  # recipients whose notification failed
        # files with a time of change in the future, and when they were first seen
        self._future: dict[FileVersion, float] = {}

    @property
    def cached_bytes(self) -> int:
        """Memory for the spectra of the window, with cleaned and fitted ones [bytes]."""
        return CACHE_FACTOR * sum(
            reading.spectrum.density.nbytes
            for of_file in self._readings.values()
            for reading in of_file
            if reading.spectrum is not None
        )

    def release(self) -> None:
        """Release the spectra; the next judgement reads them from the store."""
        self._readings = {}
        self._memory = None

    @property
    def recipients(self) -> list[str]:
        """Names of all recipients of notifications."""
        return [notifier.name for notifier in self.watching.notifiers]

    def unread(self, folder: Path) -> list[FileVersion]:
        """Return recordings of the folder not read in their present version, in natural order."""
        versions, stamps = [], {}
        with os.scandir(folder) as entries:
            for entry in entries:
                with suppress(OSError):  # removed, or a broken link
                    status = entry.stat()
                    stamps[entry.name] = (entry, f"{status.st_size} {status.st_mtime_ns}")
        sidecars = {name for name in stamps if name.endswith(SUFFIXES)}
        for entry, stamp in stamps.values():
            if not is_utf8(entry.name):
                self._not_utf8.add(entry.name)
                continue
            sidecar = (
                next((name for name in sidecar_names(entry.name) if name in sidecars), None)
                if sidecars
                else None
            )
            key = FileVersion(
                entry.path, stamp if sidecar is None else f"{stamp} {stamps[sidecar][1]}"
            )
            versions.append(key)
        self.present = {key.file for key in versions}
        new = [key for key in self.sensors.unread(versions) if may_be_recording(Path(key.file))]
        return sorted(new, key=lambda key: natural_order(file_name(key)))

    def left_out(self) -> Iterator[str]:
        """Yield a sentence on each file that the store cannot hold."""
        for name in sorted(self._not_utf8):
            displayed = name.encode(errors="surrogateescape").decode(errors="replace")
            yield f"{displayed} is left out: its name is not UTF-8; rename it"

    def unchanged(self, keys: list[FileVersion]) -> list[FileVersion]:
        """Return files unchanged for the settling time; with a future time, since first seen."""
        settle_s = self.watching.settle_time_s
        ready, future = [], []
        for key in keys:
            size, changed = map(int, key.version.split()[:2])
            age = time() - 1e-9 * changed
            if size > 0 and age >= settle_s:
                ready.append(key)
            elif size > 0 and age < 0.0:
                future.append(key)
        first_seen = {key: self._future.get(key, monotonic()) for key in future}
        if self.watching.once and future and not self._future:
            sleep(settle_s)
        self._future = first_seen
        return ready + [
            key for key in future if monotonic() - first_seen[key] >= settle_s and _is_current(key)
        ]

    def read(
        self,
        keys: list[FileVersion],
        table: RecordingTable | None,
        progress: Callable[[Reading], None] | None,
    ) -> None:
        """Read files, store each reading at once, and add it to `unreported`."""
        if not keys:
            return
        paths = [Path(key.file) for key in keys]
        options = self.settings.read_options
        if self.sensors.spacing_hz is None:
            self.sensors.set_spacing(common_spacing(paths, options, self.target))
        assert self.sensors.spacing_hz is not None  # just set
        numbered_readings = read_channels(
            paths,
            options,
            self.target,
            self.sensors.spacing_hz,
            places={} if table is None else table.places_of(paths),
            workers=self.settings.workers,
            progress=progress,
        )
        readings: dict[FileVersion, list[Reading]] = {key: [] for key in keys}
        for number, reading in numbered_readings:
            if reading.refused and not _is_current(keys[number]):
                continue  # removed, or its folder lost, while it was read
            stored = self.sensors.add(keys[number], reading)
            readings[keys[number]].append(stored)
            self.unreported.append(stored)
        self._readings |= readings

    def update(
        self,
        series: Sequence[FileVersion],
        table: RecordingTable | None,
        new: tuple[Reading, ...],
        *,
        first: bool,
    ) -> Update:
        """Judge the series, or take the stored judgement if it is up to date, and notify."""
        acknowledge = self.settings.acknowledge
        question = _digest(
            {**self.settings.judgement(), **self.schedule.question}, table, series, self.target
        )
        reuse = first and self.watching.reuse_judgement and not new and acknowledge is None
        judgement = (
            self.sensors.last_judgement()
            if reuse and self.sensors.last_question == question
            else None
        )
        if judgement is not None:
            self.sensors.queue_notifications(self.recipients, judgement)
            self.deliver(now=True)
            return Update(new=(), track=None, judgement=judgement)
        order = order_recordings(series, table, self.sensors)
        track = self.judge(order, len(new), question, acknowledge if first else None)
        self.deliver(now=first)
        forecast = self.with_forecast()
        if forecast is not None:
            self.deliver()
        failed = (*self.left_out(), *order.waits)
        return Update(new=new, track=forecast or track, failed=failed)

    def deliver(self, *, now: bool = False) -> None:
        """Send notifications that are due, or with `now` all; state failures that begin or end."""
        failed = deliver(self.sensors, self.watching.notifiers, now=now)
        for name in self.recipients:
            sentence = next((text for text in failed if text.startswith(f"{name} ")), "")
            if sentence:
                self.troubles.begin(name, sentence)
                self._unreached.add(name)
            elif name in self._unreached and not self.sensors.pending_notifications(name):
                self.troubles.end(name, f"{name} has been notified")
                self._unreached.remove(name)

    def judge(self, order: Order, new: int, question: str, acknowledge: str | None) -> Track | None:
        """Judge the series and store the judgement, after an acknowledgement; None if it is empty.

        Many new recordings are judged in steps of `STRIDE`.
        """
        self.sensors.refresh()
        afresh = acknowledge is not None
        count = len(order.instants)
        if not count:
            return None
        if acknowledge is not None:
            self.sensors.acknowledge(_acknowledged_name(acknowledge, order.keys))
        unjudged = self.sensors.unjudged()
        first_unjudged = next(
            (
                number
                for number, keys in enumerate(order.instants)
                if keys[0] in unjudged and unjudged.issuperset(keys)
            ),
            count,
        )
        for end in range(max(first_unjudged + STRIDE, max_window()), count, STRIDE):
            self._judge_and_store(order, end, 0, "", afresh=afresh, recipients=())
        # not answered before its forecast is made
        answered = question if self.schedule.forecaster is None else ""
        track = self._judge_and_store(
            order, count, new, answered, afresh=afresh, recipients=self.recipients
        )
        if self.schedule.forecaster is not None:
            self._awaiting_forecast = (track, order, question)
        return track

    def with_forecast(self) -> Track | None:
        """Return the last judgement with its forecast, stored; None if none is due."""
        if self._awaiting_forecast is None or not self.schedule.due:
            return None
        (track, order, question), self._awaiting_forecast = self._awaiting_forecast, None
        acknowledged = self.sensors.acknowledged
        rows = unacknowledged(
            [row | {"x": order.x[str(row["file"])]} for row in self.sensors.rows(order.instants)],
            acknowledged,
        )
        forecast = self.schedule.make(
            rows, order.x_name, comparable=track.comparable, acknowledged=acknowledged
        )
        return self.sensors.record_judgement(
            track.with_forecast(forecast),
            {key.file: key for key in order.keys},
            0,
            question,
            self._memory,
            self.recipients,
        )

    def _judge_and_store(
        self,
        order: Order,
        end: int,
        new: int,
        question: str,
        *,
        afresh: bool,
        recipients: Sequence[str],
    ) -> Track:
        """Judge the series up to an end and store the judgement."""
        track, keys = self._judged_part(order, end, afresh=afresh)
        return self.sensors.record_judgement(
            track, {key.file: key for key in keys}, new, question, self._memory, recipients
        )

    def overdue(self, order: Order, reason: str) -> Track | None:
        """Return the series as blind without storing it; None if it is empty."""
        if not order.instants:
            return None
        return self._judged_part(order, len(order.instants), afresh=False)[0].overdue(reason)

    def _judged_part(
        self, order: Order, end: int, *, afresh: bool
    ) -> tuple[Track, list[FileVersion]]:
        """Judge the window of the series up to an end, with previous states unless `afresh`."""
        window = judged_window(order, end, self.sensors)
        self._readings = {
            key: self._readings.get(key) or self.sensors.readings(key) for key in window
        }
        states = (
            {}
            if afresh
            else {
                key.file: state for key in window if (state := self.sensors.state(key)) is not None
            }
        )
        standing = self.sensors.standing
        reason, raised_by = ("", "") if standing is None else standing[1:]
        levels = None if afresh else self.sensors.levels()
        before_gap = "" if levels is not None else _before_gap(order, window)
        previous = PreviousStates(states, reason, raised_by, levels, before_gap)
        if self._memory is None:
            self._memory = self.sensors.series_memory()
        names = {file_name(key) for key in self._readings}
        acknowledged = self.sensors.acknowledged
        track = judge(
            [reading for of_file in self._readings.values() for reading in of_file],
            self.target,
            replace(self.settings, acknowledge=acknowledged if acknowledged in names else None),
            places={key.file: order.place(key.file) for key in window},
            x_name=order.x_name,
            memory=self._memory,
            previous=previous,
        )
        forecast = self.schedule.standing(acknowledged)
        return track if forecast is None else track.with_forecast(forecast), window


def _before_gap(order: Order, window: Sequence[FileVersion]) -> str:
    """Return the last file before the recordings that a window leaves out; "" without any."""
    numbers = {key: number for number, key in enumerate(order.keys)}
    for before, after in pairwise(window):
        if numbers[after] > numbers[before] + 1:
            return before.file
    return ""


def _acknowledged_name(acknowledge: str, keys: Sequence[FileVersion]) -> str:
    """Return the file name of the recording up to which alarms are acknowledged."""
    if acknowledge == LAST:
        return file_name(keys[-1])
    for key in keys:
        if acknowledge in (key.file, file_name(key)):
            return file_name(key)
    raise BadInput(
        f"{acknowledge} is not among the {len(keys)} recordings; acknowledge one of "
        f"them, or {LAST!r} for the newest"
    )


def _is_current(key: FileVersion) -> bool:
    try:
        status = Path(key.file).stat()
    except OSError:
        return False  # removed meanwhile
    return key.version.startswith(f"{status.st_size} {status.st_mtime_ns}")
