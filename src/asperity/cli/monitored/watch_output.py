"""Output of `asperity watch`: a line per update, and reports that are written at intervals."""

import os
import signal
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from time import monotonic
from typing import TYPE_CHECKING, Any

from asperity import monitoring, report
from asperity.cli.output import Block, show
from asperity.core.errors import AsperityError
from asperity.core.quantities import quantity
from asperity.core.troubles import RetryDelay, Troubles, failure_reason

if TYPE_CHECKING:
    from types import FrameType

    from asperity.monitoring import Reading, Track, Update

PAGE = "report.html"
TABLES = ("track.csv", "track.nc")
DUE = ".report-due"  # marks a page that is older than the last evaluation
INTERVAL_S, TREE_INTERVAL_S = 3600.0, 86_400.0  # between reports, of a folder and of a tree [s]
END_S = 20.0  # time for reports at the end of a watch [s]
REPORT_RETRY_S = 5.0  # first delay before a failed report is written again [s]


def write_track(
    tracked: "Track", out: Sequence[Path], page: Path | None, figures: Path | None = None
) -> list[Path]:
    """Write tables, page and figures of a track; return their paths."""
    saved = [tracked.save(path) for path in out]
    if page is not None:
        saved.append(report.write_track_report(tracked, page))
    if figures is not None:
        report.write_exhibits(report.track_exhibits(tracked), figures)
        saved.append(figures)
    return saved


class WatchReports:
    """Tables and page of a watched folder.

    They are written at the first update, when the alarm's state changes, every `interval_s`, and
    at the end. With `once` a failure is raised; otherwise it is stated and retried. With `brief`
    an evaluation is not held in memory until its report is due; the next one is written.
    """

    def __init__(
        self, results: Path, interval_s: float, *, once: bool, brief: bool = False
    ) -> None:
        self.results, self.interval_s, self.once = results, interval_s, once
        self.brief = brief
        self.troubles = Troubles()
        self._delay = RetryDelay(REPORT_RETRY_S)
        self._track: Track | None = None  # not written yet
        self._state = ""
        self._next_s = 0.0

    @property
    def current(self) -> bool:
        """True if the page shows the last evaluation."""
        return (self.results / PAGE).is_file() and not (self.results / DUE).exists()

    def add(self, track: "Track") -> None:
        """Take over a new evaluation, and write it if that is due."""
        if self._track is None:
            with suppress(OSError):
                (self.results / DUE).touch()
        self._track = track
        if track.alarm.state != self._state:
            self._state, self._next_s = track.alarm.state, 0.0
        self.write_due()
        if self.brief and self._delay.failures == 0:
            self._track = None

    def write_due(self) -> None:
        """Write the last evaluation if it is due."""
        if self._track is not None and not self._delay.waiting and monotonic() >= self._next_s:
            self.write()

    def write(self) -> None:
        """Write the last evaluation, unless that has been done."""
        if self._track is None:
            return
        try:
            write_track(self._track, [self.results / name for name in TABLES], self.results / PAGE)
            (self.results / DUE).unlink(missing_ok=True)
        except Exception as error:
            if self.once:
                raise
            self._delay.record(failed=True)
            reason = failure_reason(error)
            self.troubles.begin(
                "report",
                f"the report in {self.results} could not be written ({reason}); "
                "the watch continues and retries",
            )
        else:
            self._track, self._next_s = None, monotonic() + self.interval_s
            self._delay.record(failed=False)
            self.troubles.end("report", f"the report in {self.results} is written again")
        print_sentences(self.troubles.take())


def print_sentences(sentences: Sequence[str]) -> None:
    """Print sentences on stderr; one that cannot be written is left out."""
    with suppress(OSError):
        for sentence in sentences:
            print(sentence, file=sys.stderr, flush=True)


class WatchDisplay:
    """Output of a watch: lines on stdout, and reports in the folder of results.

    In a tree, each place has a folder of reports and one line when its state changes.
    """

    def __init__(
        self, results: Path, *, once: bool, tree: bool, report_every_s: float | None
    ) -> None:
        self.results, self.once, self.tree = results, once, tree
        self.interval_s = report_every_s or (TREE_INTERVAL_S if tree else INTERVAL_S)
        self.as_json = self.quiet = self.without_lines = False
        self.telemetry = monitoring.Telemetry()
        self._reports: dict[str, WatchReports] = {}
        self._states: dict[str, str] = {}  # of the alarm, by place

    @property
    def state(self) -> str:
        """Most severe state of all places."""
        return min(self._states.values(), key=monitoring.SEVERITY.index, default="cannot-tell")

    def reports(self, place: str = "") -> WatchReports:
        """Return the reports of a place."""
        if place not in self._reports:
            folder = self.results / place
            if place and self.results.is_dir():
                with suppress(OSError):
                    folder.mkdir(parents=True, exist_ok=True)
            self._reports[place] = WatchReports(
                folder, self.interval_s, once=self.once, brief=self.tree
            )
        return self._reports[place]

    def show(self, update: "Update") -> None:
        """Write and show an update. With `--json` it is one JSON object on one line."""
        if update.notice:
            print_sentences(update.failed)
            return
        self.telemetry.add(update)
        reports = self.reports(update.place)
        judgement = update.judgement or (None if update.track is None else update.track.scalars())
        if update.track is not None:
            reports.add(update.track)
        changed = True
        if judgement is not None:
            state = str(judgement["alarm"]["state"])
            changed = self._states.get(update.place) != state
            self._states[update.place] = state
        try:
            if not self.without_lines and (changed or self.as_json or not self.tree):
                self._print(update, judgement, reports.results)
        except OSError as error:  # such as a log file on a full disk
            if self.once or isinstance(error, BrokenPipeError):
                raise
        print_sentences(update.failed)

    def _print(self, update: "Update", judgement: Mapping[str, Any] | None, results: Path) -> None:
        """Print the verdict of an update and what has arrived."""
        verdict = "No recording has arrived yet." if judgement is None else judgement["verdict"]
        if update.waiting:
            verdict += (
                f" {update.waiting} more wait: they may still be written, "
                "or are not in the table yet."
            )
        values = dict(judgement or {"verdict": verdict})
        arrived = [*dict.fromkeys(recording.file for recording in update.new)]
        extra = {"new": arrived, "waiting": update.waiting, "results": str(results)}
        show(
            f"{update.place}: {verdict}" if update.place else verdict,
            lambda: {**values, **extra} | ({"place": update.place} if update.place else {}),
            []
            if judgement is None or self.tree
            else _arrived(update.new, values["recordings"], results),
            as_json=self.as_json,
            quiet=self.quiet,
            a_line=True,
        )

    def check(self) -> None:
        """Write reports and telemetry that are due."""
        self.telemetry.check()
        print_sentences(self.telemetry.troubles.take())
        for reports in self._reports.values():
            reports.write_due()

    def finish(self) -> None:
        """Write the last evaluations that are in memory, for at most `END_S`."""
        end_s = monotonic() + END_S
        for reports in self._reports.values():
            if monotonic() < end_s:
                reports.write()
        try:
            self.telemetry.finish()
        except AsperityError as error:
            print_sentences([str(error)])


def _arrived(new: "Sequence[Reading]", recordings: list[dict[str, Any]], results: Path) -> Block:
    rows = {part["file"]: row for row in recordings for part in (row, *row["sensors"].values())}
    selected = [quantity(key) for key in ("crf_hz", "severe_probability")]
    for arrived in {reading.file: reading for reading in new}.values():
        row = rows.get(arrived.file)
        if row is None:
            outcome = arrived.reason
        elif not row["found"]:
            outcome = f"no contact resonance: {row['reason']}"
        else:
            outcome = ", ".join(
                f"{entry.short} {entry.text_in(row)}"
                for entry in selected
                if row[entry.key] is not None
            )
        yield f"  {Path(arrived.file).name}: {outcome}"
    yield f"  {len(recordings)} recordings so far; results in {results}"


@contextmanager
def termination() -> Iterator[None]:
    """End on SIGTERM as on Ctrl-C, with reports and store complete, and then by the signal."""
    terminated = False

    def interrupt(_number: int, _frame: "FrameType | None") -> None:
        nonlocal terminated
        terminated = True
        raise KeyboardInterrupt

    previous: Callable[..., object] | int | None = None
    with suppress(ValueError):  # not in the main thread
        previous = signal.signal(signal.SIGTERM, interrupt)
    try:
        yield
    finally:
        if previous is not None:
            signal.signal(signal.SIGTERM, previous)
        if terminated:
            os.kill(os.getpid(), signal.SIGTERM)
