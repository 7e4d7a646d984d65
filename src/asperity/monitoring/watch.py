"""A folder watched: each recording is read once as it arrives, and the series judged anew.

What was read and said is kept in a store, so that a watch can stop at any moment and go on later.
Of a long series the first recordings and the latest are judged; the others stand in the store as
they were judged.
"""

import json
import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import closing, suppress
from dataclasses import dataclass
from functools import partial
from hashlib import sha256
from pathlib import Path
from time import monotonic, sleep, time
from typing import Any, NamedTuple

from asperity.case import Case, MachineCase
from asperity.core.errors import BadInput, require_choice, require_positive
from asperity.core.files import make_folder
from asperity.monitoring.alarm import LAST
from asperity.monitoring.files import Table, may_be_recording, natural, read_table, utf8
from asperity.monitoring.forecast import Ahead, Foreteller
from asperity.monitoring.notify import Caller, deliver
from asperity.monitoring.ordering import Order, file_name, longest, ordered, unacknowledged, window
from asperity.monitoring.reading import Reading, common_spacing, read_channels
from asperity.monitoring.sensors import Sensors, opened
from asperity.monitoring.series_state import Before, Learned
from asperity.monitoring.silence import silence
from asperity.monitoring.store import STORE, Version
from asperity.monitoring.target import Target, search_target
from asperity.monitoring.track import judge
from asperity.monitoring.track_result import Track
from asperity.recording import ReadOptions, sidecar_names
from asperity.resonance import SeriesMethod
from asperity.trend import ALARM_STATES, FALSE_ALARM_RATE, AlarmState, Detector, StageSource

SUFFIXES = (".toml", ".json")  # of sidecars
STRIDE = 80  # recordings that are judged together where many arrive at once


@dataclass(frozen=True, slots=True, kw_only=True)
class Update:
    """What is new: files just read, and the series with them; None as long as there is none.

    `failed` are sentences on calls that have not worked, and on files that could not be taken or
    have to wait. `waiting` files may still be written, or have no row in the table yet. Where
    nothing was new, `said` is the last judgement, as `Track.scalars` gave it, and `track` None,
    but for a sensor that has fallen silent.
    """

    new: tuple[Reading, ...]
    track: Track | None
    waiting: int = 0
    failed: tuple[str, ...] = ()
    said: Mapping[str, Any] | None = None


def watch_folder(
    folder: str | Path,
    out: str | Path,
    *,
    case: Case | MachineCase | None = None,
    band_hz: tuple[float, float] | None = None,
    rate_hz: float | None = None,
    unit: str | None = None,
    channel: str | None = None,
    scale: float | None = None,
    table: str | Path | None = None,
    shaft_hz: Sequence[float] | None = None,
    method: SeriesMethod | None = None,
    detector: Detector = "bayesian",
    stages_from: StageSource = "crf",
    false_alarm_rate: float = FALSE_ALARM_RATE,
    acknowledge: str | None = None,
    store: str | Path | None = None,
    machine: str | None = None,
    point: str | None = None,
    sensor: str | None = None,
    foreteller: Foreteller | None = None,
    call: Sequence[Caller] = (),
    tell: Sequence[AlarmState] = ALARM_STATES,
    recall: bool = False,
    once: bool = False,
    every_s: float = 5.0,
    settle_s: float = 2.0,
    expect_s: float | None = None,
    workers: int = 1,
    progress: Callable[[Reading], None] | None = None,
) -> Iterator[Update]:
    """Yield an update at the start and whenever recordings have arrived; for ever, unless `once`.

    Parameters
    ----------
    folder : where recordings arrive
    out : folder for the store; made if need be. A later watch with the same store goes on from there
    every_s : seconds between two looks
    settle_s : seconds for which a file must have stayed unchanged before it is read: it may still be written
    expect_s : time without a recording [s] from which on the sensor is blind; by default five times what is usual, once
        recordings have come nine times
    acknowledge : as `track_recordings`; kept in the store, and every judgement with it: an alarm stands until then
    store : SQLite file for what was read and said, asperity.db in `out` by default; several watches may share one
    machine, point, sensor : whose recordings these are, in the store; by default the folder above, the folder, and
        what names the sensor: table, sidecar or channel. Several sensors are judged as one, each kept by its own name
    foreteller : who foretells the series behind the last acknowledged recording; asked when a judgement has been kept
        and told, as often as takes no more than a tenth of the time. Its alarm is kept and told as any other
    call : who is told, as `callers` makes them, when the state is another than last; a call that fails is made again
    tell : states of which they are told, and of their end
    recall : at the start give the last judgement, where neither recordings nor question have changed since
    others : as `track_recordings`; a recording that is not in `table` yet waits until it is

    Raises
    ------
    BadInput
        for a folder that is none, a time that is not positive, or other settings than those the store was begun with.
    """
    if expect_s is not None:
        require_positive("the time without a recording (--expect)", expect_s, "s")
    folder, out = _folders(folder, out, tell)
    target = search_target(case, band_hz)
    options = ReadOptions(rate_hz=rate_hz, unit=unit, channel=channel, scale=scale)
    sensors = opened(store or out / STORE, folder, (machine, point, sensor), target, options)
    sensors.tells = tell
    memory = _Memory(sensors, target, options, call, Ahead(foreteller))
    asked: dict[str, Any] = {"shaft_hz": shaft_hz, "method": method, "detector": detector}
    asked |= {"stages_from": stages_from, "false_alarm_rate": false_alarm_rate}
    pace = _Pace(recall, once, every_s, settle_s, expect_s)
    return _looks(
        memory, folder, table, acknowledge, asked, pace, partial(memory.read, workers, progress)
    )


def _folders(folder: str | Path, out: str | Path, tell: Sequence[AlarmState]) -> tuple[Path, Path]:
    """Both folders as they are, once all is known to make sense."""
    folder, out = Path(folder).resolve(), Path(out)
    for state in tell:
        require_choice("tell", state, ALARM_STATES)
    if not folder.is_dir():
        raise BadInput(f"{folder} is not a folder; name the folder where recordings arrive")
    make_folder(out)
    return folder, out


class _Pace(NamedTuple):
    """How often a folder is looked into, and whether the first look may give what was said last."""

    recall: bool
    once: bool
    every_s: float
    settle_s: float
    expect_s: float | None


def _looks(
    memory: "_Memory",
    folder: Path,
    table: str | Path | None,
    acknowledge: str | None,
    asked: Mapping[str, Any],
    pace: _Pace,
    read: Callable[[list[Version], Table | None], tuple[Reading, ...]],
) -> Iterator[Update]:
    """An update at the start and whenever recordings have arrived."""
    with closing(memory.sensors.store):
        first, told = True, ""
        while True:
            unread = memory.unread(folder)
            arrived = memory.settled(unread, pace)
            named = (
                None
                if table is None or not (arrived or memory.sensors.by_name)
                else read_table(table)
            )
            if named is not None:
                arrived = [key for key in arrived if named.row(Path(key.file)) is not None]
            new = read(arrived, named)
            known = sorted(memory.sensors.series(), key=lambda key: natural(file_name(key)))
            waiting = len(unread) - len(arrived)
            reason = (
                ""
                if new or (acknowledge and first)
                else silence(memory.sensors.arrivals(), pace.expect_s)
            )
            said = memory.sensors.fell_silent(reason, memory.who) if reason else None
            if said is not None:
                failed = deliver(memory.sensors, memory.call, now=first)
                if not told:
                    track = memory.silent(
                        partial(judge, **asked), ordered(known, named, memory.sensors), reason
                    )
                    yield Update(new=(), track=track, waiting=waiting, said=said, failed=failed)
            elif new or first:
                question = _digest({**asked, **memory.ahead.asked}, named, known, memory.target)
                recalled = first and pace.recall and not new and acknowledge is None
                said = memory.said(question) if recalled else None
                if said is not None:
                    memory.sensors.tell(memory.who, said)
                    failed = deliver(memory.sensors, memory.call, now=True)
                    yield Update(new=(), track=None, waiting=waiting, said=said, failed=failed)
                else:
                    order = ordered(known, named, memory.sensors)
                    judging = partial(judge, **asked)
                    track = memory.judged(
                        judging, order, len(new), question, acknowledge if first else None
                    )
                    failed = (
                        *memory.left_out(),
                        *order.waits,
                        *deliver(memory.sensors, memory.call, now=first),
                    )
                    ahead = memory.foretold()
                    failed += deliver(memory.sensors, memory.call) if ahead is not None else ()
                    yield Update(new=new, track=ahead or track, waiting=waiting, failed=failed)
            elif (ahead := memory.foretold()) is not None:
                failed = deliver(memory.sensors, memory.call)
                yield Update(new=(), track=ahead, waiting=waiting, failed=failed)
            else:
                deliver(memory.sensors, memory.call)
            if pace.once:
                return
            first, told = False, reason
            sleep(pace.every_s)


def version_of(path: Path) -> Version:
    """Which version of a file, and of what stands beside it, is there now."""
    stamps = []
    beside = next(
        (
            path.with_name(name)
            for name in sidecar_names(path.name)
            if path.with_name(name).is_file()
        ),
        None,
    )
    for one in (path, beside):
        if one is not None:
            status = one.stat()
            stamps.append(f"{status.st_size} {status.st_mtime_ns}")
    return Version(str(path), " ".join(stamps))


def _digest(
    asked: Mapping[str, Any], table: Table | None, known: Sequence[Version], target: Target
) -> str:
    """What a judgement depends on, besides what the store holds."""
    told = json.dumps([asked, repr(table), target.full_load_crf_hz], default=str)
    return sha256("\n".join([told, *map("\0".join, known)]).encode(errors="replace")).hexdigest()


class _Memory:
    """What a watch knows of its sensors: the store, and what of it this run has needed, at hand."""

    def __init__(
        self,
        sensors: Sensors,
        target: Target,
        options: ReadOptions,
        call: Sequence[Caller],
        ahead: Ahead,
    ) -> None:
        self.sensors, self.target, self.options, self.call, self.ahead = (
            sensors,
            target,
            options,
            call,
            ahead,
        )
        self._unforetold: tuple[Track, Order, str] | None = (
            None  # the last judgement, while its forecast is due
        )
        self._readings: dict[Version, list[Reading]] = {}
        self._learned: Learned | None = None
        self.unnamed: set[str] = set()
        self._ahead: dict[
            Version, float
        ] = {}  # files of a clock that is ahead, and when they were first seen

    @property
    def who(self) -> list[str]:
        """Names of all who are called."""
        return [caller.name for caller in self.call]

    def unread(self, folder: Path) -> list[Version]:
        """Recordings in the folder that have not been read as they are now, by name with numbers in their order."""
        versions, stamps = [], {}
        with os.scandir(folder) as entries:
            for entry in entries:
                with suppress(OSError):  # gone, or a link to nothing
                    status = entry.stat()
                    stamps[entry.name] = (entry, f"{status.st_size} {status.st_mtime_ns}")
        sidecars = {name for name in stamps if name.endswith(SUFFIXES)}
        for entry, stamp in stamps.values():
            if not utf8(entry.name):
                self.unnamed.add(entry.name)
                continue
            beside = (
                next((name for name in sidecar_names(entry.name) if name in sidecars), None)
                if sidecars
                else None
            )
            key = Version(entry.path, stamp if beside is None else f"{stamp} {stamps[beside][1]}")
            versions.append(key)
        new = [key for key in self.sensors.unread(versions) if may_be_recording(Path(key.file))]
        return sorted(new, key=lambda key: natural(file_name(key)))

    def left_out(self) -> Iterator[str]:
        """A sentence on each file that cannot be entered."""
        for name in sorted(self.unnamed):
            shown = name.encode(errors="surrogateescape").decode(errors="replace")
            yield f"{shown} is left out: its name is not UTF-8; rename it"

    def settled(self, keys: list[Version], pace: _Pace) -> list[Version]:
        """Those that have stayed as they are long enough; of a clock that is ahead, since they were first seen."""
        settled, ahead = [], []
        for key in keys:
            size, changed = map(int, key.version.split()[:2])
            age = time() - 1e-9 * changed
            if size > 0 and age >= pace.settle_s:
                settled.append(key)
            elif size > 0 and age < 0.0:
                ahead.append(key)
        seen = {key: self._ahead.get(key, monotonic()) for key in ahead}
        if pace.once and ahead and not self._ahead:
            sleep(pace.settle_s)
        self._ahead = seen
        return settled + [
            key for key in ahead if monotonic() - seen[key] >= pace.settle_s and _unchanged(key)
        ]

    def read(
        self,
        workers: int,
        progress: Callable[[Reading], None] | None,
        keys: list[Version],
        table: Table | None,
    ) -> tuple[Reading, ...]:
        """Read files, and keep what each gave as soon as it is there."""
        if not keys:
            return ()
        paths = [Path(key.file) for key in keys]
        if self.sensors.spacing_hz is None:
            self.sensors.settle_spacing(common_spacing(paths, self.options, self.target))
        assert self.sensors.spacing_hz is not None  # just settled
        stated = {} if table is None else table.placed(paths)
        reader = read_channels(
            paths,
            self.options,
            self.target,
            self.sensors.spacing_hz,
            places=stated,
            workers=workers,
            progress=progress,
        )
        heard: dict[Version, list[Reading]] = {key: [] for key in keys}
        for number, reading in reader:
            self.sensors.keep(keys[number], reading)
            heard[keys[number]].append(reading)
        self._readings |= heard
        return tuple(reading for every in heard.values() for reading in every)

    def said(self, question: str) -> dict[str, Any] | None:
        """The last judgement, where it was of the same question."""
        return self.sensors.said() if self.sensors.asked == question else None

    def judged(
        self,
        judging: Callable[..., Track],
        order: Order,
        new: int,
        question: str,
        acknowledge: str | None,
    ) -> Track | None:
        """A judgement as the store leaves it, an acknowledgement taken first; of many new ones, one after another.

        None where there is nothing to judge.
        """
        self.sensors.look_up()
        again, count = acknowledge is not None, len(order.instants)
        if not count:
            return None
        if acknowledge is not None:
            self.sensors.acknowledge(_named(acknowledge, order.keys))
        unjudged = self.sensors.unjudged()
        begins = (
            number
            for number, keys in enumerate(order.instants)
            if keys[0] in unjudged and unjudged.issuperset(keys)
        )
        first = max(next(begins, count) + STRIDE, longest())
        for end in range(first, count, STRIDE):
            self._judged(judging, order, end, 0, "", again=again, who=())
        answers = (
            question if self.ahead.foreteller is None else ""
        )  # not answered before its forecast is made
        track = self._judged(judging, order, count, new, answers, again=again, who=self.who)
        self._unforetold = (track, order, question)
        return track

    def foretold(self) -> Track | None:
        """The last judgement with its forecast, kept; None where there is none to make, or none yet."""
        if self._unforetold is None or not self.ahead.due:
            return None
        (track, order, question), self._unforetold = self._unforetold, None
        acknowledged = self.sensors.acknowledged
        every = [row | {"x": order.x[row["file"]]} for row in self.sensors.rows(order.instants)]
        rows = unacknowledged(every, acknowledged)
        made = self.ahead.make(
            rows, order.x_name, comparable=track.comparable, acknowledged=acknowledged
        )
        return self.sensors.judged(
            track.foretold(made),
            {key.file: key for key in order.keys},
            0,
            question,
            self._learned,
            self.who,
        )

    def _judged(
        self,
        judging: Callable[..., Track],
        order: Order,
        end: int,
        new: int,
        question: str,
        *,
        again: bool,
        who: Sequence[str],
    ) -> Track:
        """A judgement of the series up to an end, kept."""
        track, keys = self._looked_at(judging, order, end, again=again)
        return self.sensors.judged(
            track, {key.file: key for key in keys}, new, question, self._learned, who
        )

    def silent(self, judging: Callable[..., Track], order: Order, reason: str) -> Track | None:
        """The series as it is when no recording comes any more; nothing of it is kept. None where none is known."""
        if not order.instants:
            return None
        return self._looked_at(judging, order, len(order.instants), again=False)[0].silent(reason)

    def _looked_at(
        self, judging: Callable[..., Track], order: Order, end: int, *, again: bool
    ) -> tuple[Track, list[Version]]:
        """The series up to an end as it is judged beside what was said, and what of it was looked at."""
        chosen = window(order, end, self.sensors)
        self._readings = {
            key: self._readings.get(key) or self.sensors.readings(key) for key in chosen
        }
        said = (
            {}
            if again
            else {
                key.file: state for key in chosen if (state := self.sensors.state(key)) is not None
            }
        )
        standing = self.sensors.standing
        before = (
            Before(said) if standing is None else Before(said, standing.reason, standing.raised_by)
        )
        if self._learned is None:
            self._learned = self.sensors.learned()
        names = {file_name(key) for key in self._readings}
        acknowledged = self.sensors.acknowledged
        track: Track = judging(
            [reading for every in self._readings.values() for reading in every],
            self.target,
            {key.file: order.place(key.file) for key in chosen},
            order.x_name,
            acknowledge=acknowledged if acknowledged in names else None,
            learned=self._learned,
            before=before,
        )
        last = self.ahead.standing(acknowledged)
        return track if last is None else track.foretold(last), chosen


def _named(acknowledge: str, keys: Sequence[Version]) -> str:
    """The name of the recording up to which somebody has looked."""
    if acknowledge == LAST:
        return file_name(keys[-1])
    for key in keys:
        if acknowledge in (key.file, file_name(key)):
            return file_name(key)
    raise BadInput(
        f"{acknowledge} is not among the {len(keys)} recordings; acknowledge one of them, or {LAST}"
    )


def _unchanged(key: Version) -> bool:
    try:
        status = Path(key.file).stat()
    except OSError:
        return False  # taken away meanwhile
    return key.version.startswith(f"{status.st_size} {status.st_mtime_ns}")
