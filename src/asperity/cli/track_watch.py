"""`asperity track` and `watch`: measured recordings, from files to a verdict.

A new option: `cli.options`, both commands and `_track_settings` here, `monitoring.settings`, and
`WITHOUT_RECORDINGS` of `cli.monitored.series` if tables do not use it.
"""

from collections.abc import Callable, Generator, Iterator, Sequence
from contextlib import ExitStack, closing, contextmanager
from functools import partial
from pathlib import Path
from types import SimpleNamespace
from typing import TYPE_CHECKING, Annotated, cast

import typer

from asperity import monitoring, recording, trend
from asperity.cli.app import app
from asperity.cli.forecast import series_forecaster
from asperity.cli.monitored.series import end_with, track_series, watch_series
from asperity.cli.monitored.track_output import show_track
from asperity.cli.monitored.watch_output import (
    WatchDisplay,
    print_sentences,
    termination,
    write_track,
)
from asperity.cli.options import (
    Acknowledge,
    AsJson,
    Band,
    Channel,
    Contact,
    EmulatorFolder,
    FalseAlarms,
    Figures,
    ForecastLimit,
    Machine,
    Method,
    Mqtt,
    OnAlarm,
    OpenPage,
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
    duration,
    require_output,
)
from asperity.cli.output import progress
from asperity.cli.terminal.browser import require_opened
from asperity.core import files, processes
from asperity.core.errors import BadInput

if TYPE_CHECKING:
    from asperity.monitoring import Reading, TrackSettings, Update, WatchSettings
    from asperity.recording import ReadOptions
    from asperity.resonance import SeriesMethod
    from asperity.trend import AlarmState, StageSource


DataFiles = Annotated[
    list[Path] | None,
    typer.Option(
        metavar="FILE", help="File for the table (.csv, .parquet) or all data (.nc); repeatable."
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
    Path, typer.Argument(metavar="DIR", help="Folder where recordings arrive, or a table.")
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
KeptAge = Annotated[
    float | None,
    typer.Option(
        metavar="AGE",
        parser=duration("--keep"),
        help="Thin out recordings older than this, such as 90d, to one a day (default: keep all).",
    ),
]
Tree = Annotated[
    bool,
    typer.Option(
        "--tree", help="Watch every subfolder as a measuring point (default: if DIR has only such)."
    ),
]
LineProtocol = Annotated[
    str | None,
    typer.Option(
        metavar="FILE|-|URL",
        envvar="ASPERITY_LINE_PROTOCOL",
        help="Write measurements by the InfluxDB line protocol: to a file, stdout or an address.",
    ),
]
Prometheus = Annotated[
    Path | None,
    typer.Option(metavar="FILE.prom", help="Write the latest values for a Prometheus exporter."),
]
ReportInterval = Annotated[
    float | None,
    typer.Option(
        metavar="AGE",
        parser=duration("--report-every"),
        help="Interval between reports (default: 1h, of a tree 1d); "
        "also written when the state changes.",
    ),
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
    figures: Figures = None,
    opened: OpenPage = False,
    out: DataFiles = None,
    workers: Workers = None,
    as_json: AsJson = False,
    quiet: Quiet = False,
) -> None:
    """Evaluate recordings: wear stage, alarm and forecast."""
    _require_outputs(out or (), page, store, opened=opened)
    if series is not None:
        track_series(SimpleNamespace(**locals()))
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
    saved = write_track(tracked, out or (), page, figures)
    show_track(tracked, page, saved, store, opened=opened, as_json=as_json, quiet=quiet)
    end_with(tracked.alarm.state)


@app.command()
def watch(
    folder: WatchedFolder,
    out: ResultFolder = None,
    once: Once = False,
    tree: Tree = False,
    every: PollInterval = 5.0,
    settle: SettleTime = 2.0,
    expect: ExpectedInterval = None,
    report_every: ReportInterval = None,
    keep: KeptAge = None,
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
    line_protocol: LineProtocol = None,
    prometheus: Prometheus = None,
    as_json: AsJson = False,
    quiet: Quiet = False,
) -> None:
    """Evaluate recordings as they arrive in a folder.

    It ends with Ctrl-C; a later watch continues it.
    """
    options = SimpleNamespace(**locals())
    if folder.is_file() and folder.suffix.lower() in monitoring.SERIES_SUFFIXES:
        watch_series(options, _states(tell))
        return
    options.results = results = out or folder / "asperity-watch"
    settings = _watched_settings(options)
    options.tree = tree or monitoring.is_tree(folder, results)
    options.display = display = _watch_display(options)
    forecaster = series_forecaster(
        forecast, case_file, worn, emulator, workers=settings.workers, quiet=quiet
    )
    updates = partial(
        monitoring.watch_tree if options.tree else monitoring.watch_folder,
        *(folder, results, settings, _watch_settings(options)),
        case=contact_at(case_file),
        table=table_file,
        forecaster=forecaster,
    )
    _show_updates(updates, display, mqtt=mqtt, quiet=quiet)
    end_with(display.state)


def _watched_settings(options: SimpleNamespace) -> "TrackSettings":
    """Build the settings of a series from the options of `watch`."""
    read = recording.ReadOptions(
        rate_hz=options.rate, unit=options.unit, channel=options.channel, scale=options.scale
    )
    return _track_settings(
        read,
        options.workers,
        options.band,
        options.shaft,
        options.method,
        options.stages_from,
        options.false_alarms,
        options.acknowledge,
    )


def _watch_display(options: SimpleNamespace) -> WatchDisplay:
    """Build the display of `watch` from its options."""
    display = WatchDisplay(
        options.results,
        once=options.once,
        tree=options.tree,
        report_every_s=options.report_every,
    )
    display.as_json, display.quiet = options.as_json, options.quiet
    display.telemetry = monitoring.Telemetry(options.line_protocol, options.prometheus)
    display.without_lines = options.line_protocol == "-"
    return display


def _watch_settings(options: SimpleNamespace) -> "WatchSettings":
    """Build the settings of `watch` from its options and display."""
    display: WatchDisplay = options.display
    return monitoring.WatchSettings(
        store=options.store,
        machine=options.machine,
        point=options.point,
        sensor=options.sensor,
        notifiers=monitoring.notifiers(
            command=options.on_alarm, webhook=options.webhook, mqtt=options.mqtt
        ),
        notify_states=_states(options.tell),
        reuse_judgement=options.once and (options.tree or display.reports().current),
        once=options.once,
        poll_interval_s=options.every,
        settle_time_s=options.settle,
        overdue_after_s=options.expect,
        keep_s=options.keep,
        on_check=display.check,
    )


def _given(paths: list[Path] | None) -> list[Path]:
    """Return the recordings; raise BadInput without any."""
    if not paths:
        raise BadInput("no recordings are given; name files or folders, or a table with --series")
    return paths


def _require_outputs(
    out: "Sequence[Path]", page: Path | None, store: Path | None, *, opened: bool
) -> None:
    """Raise BadInput for an output that cannot be written or opened."""
    require_opened(page, requested=opened)
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


def _show_updates(
    updates: "Callable[..., Generator[Update]]",
    display: WatchDisplay,
    *,
    mqtt: str | None,
    quiet: bool,
) -> None:
    """Write and show every update until Ctrl-C."""
    presence = None if mqtt is None or display.once else monitoring.Presence(mqtt)
    with ExitStack() as stack:
        step = stack.enter_context(_reading_progress("watching ...", quiet=quiet, log=False))
        stack.enter_context(termination())
        if presence is not None:
            stack.callback(presence.close)
        try:
            with closing(updates(progress=step)) as running:
                for update in running:
                    display.show(update)
            display.telemetry.finish()
        except KeyboardInterrupt:
            if display.once:
                raise
            display.finish()
            print_sentences(
                [f"stopped; results are in {display.results}, and the next watch continues"]
            )


def _states(tell: str | None) -> "Sequence[AlarmState]":
    """Return the states of `--tell`, all by default."""
    return trend.ALARM_STATES if tell is None else cast("Sequence[AlarmState]", tell.split(","))


@contextmanager
def _reading_progress(
    activity: str, *, quiet: bool, log: bool = True
) -> "Iterator[Callable[[Reading], None]]":
    """Show the count of files on a terminal as they are read."""
    count = 0
    with progress("recordings", activity, quiet=quiet, log=log) as display:

        def step(recording: "Reading") -> None:
            nonlocal count
            count += 1
            display(f"{count} read, last {Path(recording.file).name}")

        yield step
