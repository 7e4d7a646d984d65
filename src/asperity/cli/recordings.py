"""`asperity track` and `watch`: measured recordings, from files to a verdict."""

import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, cast

import typer

from asperity import monitoring, recording, report, trend
from asperity.cli.app import app
from asperity.cli.forecast import series_forecaster
from asperity.cli.options import (
    Acknowledge,
    AsJson,
    Band,
    Channel,
    Contact,
    EmulatorFolder,
    FalseAlarms,
    ForecastLimit,
    Machine,
    Method,
    Mqtt,
    OnAlarm,
    Page,
    Point,
    Quiet,
    Rate,
    RecordingFiles,
    Scale,
    SensorName,
    Shaft,
    StagesFrom,
    StoreFile,
    Table,
    Tell,
    Unit,
    WebHook,
    Workers,
    Worn,
    contact_at,
    require_output,
)
from asperity.cli.output import Block, Row, columns, progress, show, span, table, written
from asperity.cli.series import end_with, track_series
from asperity.core import files, processes
from asperity.core.errors import BadInput
from asperity.core.quantities import NO_VALUE, quantity

if TYPE_CHECKING:
    from asperity.monitoring import Reading, Track, TrackSettings, Update
    from asperity.recording import ReadOptions
    from asperity.resonance import SeriesMethod
    from asperity.trend import AlarmState, StageSource

PAGE = "report.html"


DataFiles = Annotated[
    list[Path] | None,
    typer.Option(
        metavar="FILE", help="Write the table (.csv, .parquet) or all data (.nc); repeatable."
    ),
]
SeriesTable = Annotated[
    Path | None,
    typer.Option(
        metavar="FILE",
        help="Judge a table of time stamps and overall values (.csv, .parquet, .jsonl) instead.",
    ),
]
WatchedFolder = Annotated[
    Path, typer.Argument(metavar="DIR", help="Folder where recordings arrive.")
]
ResultFolder = Annotated[
    Path | None, typer.Option(metavar="DIR", help="Folder of results; default: DIR/asperity-watch.")
]
Once = Annotated[
    bool, typer.Option("--once", help="Process the present recordings and end, for cron.")
]
PollInterval = Annotated[
    float, typer.Option(metavar="SECONDS", min=0.05, help="Interval between checks of the folder.")
]
SettleTime = Annotated[
    float, typer.Option(metavar="SECONDS", min=0.0, help="Time for which a file must be unchanged.")
]
ExpectedInterval = Annotated[
    float | None,
    typer.Option(
        metavar="SECONDS",
        min=0.0,
        help="Report blind without a recording for this time; default: 5 usual intervals.",
    ),
]


@app.command()
def track(
    paths: RecordingFiles = None,
    series: SeriesTable = None,
    rate: Rate = None,
    unit: Unit = None,
    channel: Channel = None,
    scale: Scale = None,
    case_file: Contact = None,
    band: Band = None,
    table_file: Table = None,
    shaft: Shaft = None,
    method: Method = None,
    stages_from: StagesFrom = "crf",
    false_alarms: FalseAlarms = 1e-3,
    acknowledge: Acknowledge = None,
    forecast: ForecastLimit = None,
    worn: Worn = None,
    emulator: EmulatorFolder = None,
    store: StoreFile = None,
    machine: Machine = None,
    point: Point = None,
    sensor: SensorName = None,
    page: Page = None,
    out: DataFiles = None,
    workers: Workers = None,
    as_json: AsJson = False,
    quiet: Quiet = False,
) -> None:
    """Track the contact resonance through recordings: stage of wear, alarm and forecast."""
    _require_outputs(out or (), page, store)
    if series is not None:
        track_series(series, paths, page, out or (), acknowledge, as_json=as_json, quiet=quiet)
        return
    read = recording.ReadOptions(rate_hz=rate, unit=unit, channel=channel, scale=scale)
    settings = _track_settings(
        read, workers, band, shaft, method, stages_from, false_alarms, acknowledge
    )
    forecaster = series_forecaster(
        forecast, case_file, worn, emulator, workers=settings.workers, quiet=quiet
    )
    with _reading_progress("reading recordings ...", quiet=quiet) as step:
        tracked = monitoring.track_recordings(
            _given(paths),
            settings,
            case=contact_at(case_file),
            table=table_file,
            forecaster=forecaster,
            progress=step,
        )
    if store is not None:
        tracked = monitoring.keep_track(
            tracked,
            store,
            settings.read_options,
            machine=machine,
            point=point,
            sensor=sensor,
            acknowledge=acknowledge,
        )
    saved = _write(tracked, out or (), page)
    _show_track(tracked, page, saved, store, as_json=as_json, quiet=quiet)
    end_with(tracked.alarm.state)


@app.command()
def watch(
    folder: WatchedFolder,
    out: ResultFolder = None,
    once: Once = False,
    every: PollInterval = 5.0,
    settle: SettleTime = 2.0,
    expect: ExpectedInterval = None,
    workers: Workers = None,
    rate: Rate = None,
    unit: Unit = None,
    channel: Channel = None,
    scale: Scale = None,
    case_file: Contact = None,
    band: Band = None,
    table_file: Table = None,
    shaft: Shaft = None,
    method: Method = None,
    stages_from: StagesFrom = "crf",
    false_alarms: FalseAlarms = 1e-3,
    acknowledge: Acknowledge = None,
    forecast: ForecastLimit = None,
    worn: Worn = None,
    emulator: EmulatorFolder = None,
    store: StoreFile = None,
    machine: Machine = None,
    point: Point = None,
    sensor: SensorName = None,
    on_alarm: OnAlarm = None,
    webhook: WebHook = None,
    mqtt: Mqtt = None,
    tell: Tell = None,
    as_json: AsJson = False,
    quiet: Quiet = False,
) -> None:
    """Track recordings as they arrive in a folder, until Ctrl-C; a later watch continues it."""
    results = out or folder / "asperity-watch"
    read = recording.ReadOptions(rate_hz=rate, unit=unit, channel=channel, scale=scale)
    settings = _track_settings(
        read, workers, band, shaft, method, stages_from, false_alarms, acknowledge
    )
    watching = monitoring.WatchSettings(
        store=store,
        machine=machine,
        point=point,
        sensor=sensor,
        notifiers=monitoring.notifiers(command=on_alarm, webhook=webhook, mqtt=mqtt),
        notify_states=_states(tell),
        reuse_judgement=(results / PAGE).is_file(),
        once=once,
        poll_interval_s=every,
        settle_time_s=settle,
        overdue_after_s=expect,
    )
    forecaster = series_forecaster(
        forecast, case_file, worn, emulator, workers=settings.workers, quiet=quiet
    )
    watch_series = partial(monitoring.watch_folder, folder, results, settings, watching)
    updates = partial(
        watch_series, case=contact_at(case_file), table=table_file, forecaster=forecaster
    )
    end_with(_show_updates(updates, results, once=once, as_json=as_json, quiet=quiet))


def _given(paths: list[Path] | None) -> list[Path]:
    """Return the recordings; raise BadInput without any."""
    if not paths:
        raise BadInput("no recordings are given; name files or folders, or a table with --series")
    return paths


def _require_outputs(out: "Sequence[Path]", page: Path | None, store: Path | None) -> None:
    """Raise BadInput for an output that cannot be written."""
    for path in (page, store):
        if path is not None:
            files.require_writable(path)
    for path in out:
        require_output(path, ".csv", ".parquet", ".nc")


def _track_settings(
    read: "ReadOptions",
    workers: int | None,
    band: tuple[float, float] | None,
    shaft: list[float] | None,
    method: str | None,
    stages_from: str,
    false_alarms: float,
    acknowledge: str | None,
) -> "TrackSettings":
    """Build the settings of `track` and `watch` from the options that both commands share."""
    return monitoring.TrackSettings(
        rate_hz=read.rate_hz,
        unit=read.unit,
        channel=read.channel,
        scale=read.scale,
        band_hz=band,
        shaft_hz=shaft or None,
        method=cast("SeriesMethod | None", method),
        stages_from=cast("StageSource", stages_from),
        false_alarm_rate=false_alarms,
        acknowledge=acknowledge,
        workers=workers or processes.cores(),
    )


def _show_track(
    tracked: "Track",
    page: Path | None,
    saved: list[Path],
    store: Path | None,
    *,
    as_json: bool,
    quiet: bool,
) -> None:
    """Show the verdict of a track, its series and what was written."""
    paths_written = saved if store is None else [*saved, store]
    hint = ["  Add --report track.html for the page, --out track.csv for the table."]
    show(
        tracked.verdict(),
        lambda: (
            tracked.scalars()
            | {
                "report": None if page is None else str(page),
                "written": [str(path) for path in paths_written],
            }
        ),
        _series(tracked),
        _searched(tracked),
        written("  Written", *paths_written) if paths_written else hint,
        as_json=as_json,
        quiet=quiet,
    )


def _show_updates(
    updates: "Callable[..., Iterator[Update]]",
    results: Path,
    *,
    once: bool,
    as_json: bool,
    quiet: bool,
) -> str:
    """Write and show every update until Ctrl-C; return the state of the last."""
    state = "cannot-tell"
    with _reading_progress("watching ...", quiet=quiet) as step:
        try:
            for update in updates(progress=step):
                state = _show_update(update, results, as_json=as_json, quiet=quiet) or state
        except KeyboardInterrupt:
            if once:
                raise
            print(
                f"stopped; results are in {results}, and the next watch continues", file=sys.stderr
            )
    return state


def _states(tell: str | None) -> "Sequence[AlarmState]":
    """Return the states of `--tell`, all by default."""
    return trend.ALARM_STATES if tell is None else cast("Sequence[AlarmState]", tell.split(","))


def _show_update(update: "Update", results: Path, *, as_json: bool, quiet: bool) -> str | None:
    """Write and show an update; return the alarm's state, None without any recording.

    With `--json` each update is one JSON object on one line.
    """
    judgement = update.judgement or (None if update.track is None else update.track.scalars())
    if update.track is not None:
        _write(update.track, [results / "track.csv", results / "track.nc"], results / PAGE)
    verdict = "No recording has arrived yet." if judgement is None else judgement["verdict"]
    if update.waiting:
        verdict += (
            f" {update.waiting} more wait: they may still be written, or are not in the table yet."
        )
    values: dict[str, Any] = {"verdict": verdict} if judgement is None else dict(judgement)
    arrived = [*dict.fromkeys(recording.file for recording in update.new)]
    show(
        verdict,
        lambda: {**values, "new": arrived, "waiting": update.waiting, "results": str(results)},
        [] if judgement is None else _arrived(update.new, values["recordings"], results),
        as_json=as_json,
        quiet=quiet,
        a_line=True,
    )
    for sentence in update.failed:
        print(sentence, file=sys.stderr)
    return None if judgement is None else str(judgement["alarm"]["state"])


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


def _write(tracked: "Track", out: Sequence[Path], page: Path | None) -> list[Path]:
    saved = [tracked.save(path) for path in out]
    return saved if page is None else [*saved, report.write_track_report(tracked, page)]


def _series(tracked: "Track") -> Block:
    """Yield one row per recording, in the order of x."""
    selected = [quantity(key) for key in ("crf_hz", "crfa", "damping_ratio", "severe_probability")]
    rows = [
        [
            Path(row["file"]).name,
            NO_VALUE if row["x"] is None else f"{row['x']:.4g}",
            *(entry.number_in(row) if row["found"] else NO_VALUE for entry in selected),
            "" if row["found"] else f"not found: {row['reason']}",
        ]
        for row in tracked.scalars()["recordings"]
    ]
    titles = ["recording", tracked.x_name, *(entry.label for entry in selected), ""]
    yield from columns(titles, rows, left=1)


def _searched(tracked: "Track") -> Block:
    rows: list[Row] = [
        (quantity("band_hz").title, span("band_hz", tracked.target.band_hz)),
        ("method", tracked.method),
        *tracked.stage_rows(),
        ("alarm", tracked.alarm.verdict),
        *_states_rows(tracked),
        ("severity, last recording", tracked.recordings[-1].severity()),
    ]
    yield from table(rows, (*tracked.problems, *tracked.notes))


def _states_rows(tracked: "Track") -> list[Row]:
    """Return rows of the states of contact, level and sensor."""
    scalars = tracked.scalars(all_sources=False)
    return [
        (name, ": ".join(filter(None, (scalars[name]["state"], scalars[name]["reason"]))))
        for name in ("contact", "level", "sensor")
    ]


@contextmanager
def _reading_progress(activity: str, *, quiet: bool) -> "Iterator[Callable[[Reading], None]]":
    """Show the count of files on a terminal as they are read."""
    count = 0
    with progress("recordings", activity, quiet=quiet) as display:

        def step(recording: "Reading") -> None:
            nonlocal count
            count += 1
            display(f"{count} read, last {Path(recording.file).name}")

        yield step
