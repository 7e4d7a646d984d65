"""`asperity check`, `track` and `watch`: measured recordings, from files to a verdict."""

import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, cast

import typer

from asperity import monitoring, recording, report, trend
from asperity.cli import options
from asperity.cli.app import app
from asperity.cli.forecast import follower
from asperity.cli.options import AsJson, Quiet, contact_at, require_output
from asperity.cli.output import Block, Row, columns, progress, show, span, table, text, written
from asperity.core import files, processes
from asperity.core.errors import BadInput
from asperity.core.quantities import NO_VALUE, quantity

if TYPE_CHECKING:
    from asperity.monitoring import CheckedRecording, Reading, RecordingChecks, Track, Update
    from asperity.resonance import SeriesMethod
    from asperity.trend import AlarmState, StageSource

EXIT_CODES = {
    "alarm": 3,
    "cannot-tell": 4,
    "blind": 5,
}  # of the alarm's state; the others end with 0
PAGE = "report.html"
IN_FULL = 4  # recordings that `check` shows with every fact


@app.command()
def check(
    paths: Annotated[
        list[Path] | None, typer.Argument(metavar="FILE...", help="Recordings, or folders of them.")
    ] = None,
    data_set: Annotated[
        Path | None,
        typer.Option(
            "--set",
            metavar="DIR",
            help="Say whether a folder is a set of data that others can use.",
        ),
    ] = None,
    rate: options.Rate = None,
    unit: options.Unit = None,
    channel: options.Channel = None,
    scale: options.Scale = None,
    case_file: options.Contact = None,
    band: options.Band = None,
    as_json: AsJson = False,
    quiet: Quiet = False,
) -> None:
    """Say what recordings hold: rate, unit, length, channels, gaps, clipping, offset, machine off, too short."""
    if data_set is not None:
        if paths:
            raise BadInput(
                f"--set {data_set} takes no recordings beside it; its {monitoring.STATED} names them"
            )
        _show_set(data_set, as_json=as_json, quiet=quiet)
        return
    if not paths:
        raise BadInput("check takes recordings, or --set and the folder of a set of data; name one")
    checks = monitoring.check_recordings(
        paths,
        case=contact_at(case_file),
        band_hz=band,
        rate_hz=rate,
        unit=unit,
        channel=channel,
        scale=scale,
    )
    if checks.checked or as_json:
        in_full = (
            [_in_full(checked) for checked in checks.checked]
            if len(checks.checked) <= IN_FULL
            else []
        )
        show(
            checks.verdict(),
            checks.scalars,
            [
                f"  for a resonance {text('width_hz', checks.target.width_hz)} wide in {checks.target.source}"
            ],
            *(in_full or [_in_lines(checks)]),
            as_json=as_json,
            quiet=quiet,
        )
    if checks.refused:
        raise BadInput("; ".join(dict.fromkeys(reason for _, reason in checks.refused)))


def _show_set(folder: Path, *, as_json: bool, quiet: bool) -> None:
    """What a folder lacks of a set, a line each; exit code 2 unless it is one."""
    found = monitoring.check_set(folder)
    lines = [f"  missing: {sentence}" for sentence in found.missing]
    show(found.verdict(), lambda: found.scalars(), lines, as_json=as_json, quiet=quiet)
    if not found.whole:
        raise typer.Exit(2)


def _in_full(checked: "CheckedRecording") -> Block:
    """Every fact of a recording, and who states it."""
    recording, quality = checked
    facts, state = recording.facts, "usable" if quality.usable else "NOT USABLE"
    values = checked.scalars()
    level = ", ".join(quantity(key).number_in(values) for key in ("rms", "peak", "offset"))
    rows = [
        ("format", str(facts["format"].value)),
        (
            quantity("rate_hz").title,
            f"{text('rate_hz', recording.rate_hz)}, stated by {facts['rate'].source}",
        ),
        *(
            (name, f"{facts[name].value}, stated by {facts[name].source}")
            for name in ("unit", "scale", "started")
            if name in facts
        ),
        (
            quantity("duration_s").title,
            f"{text('duration_s', quality.duration_s)}, {quality.samples} samples",
        ),
        ("rms, peak, offset", f"{level}; unit: {recording.unit}"),
    ]
    yield f"{recording.path}, channel {recording.channel.name}: {state}"
    yield from table(rows, quality.remarks)
    yield from (f"  fault: {fault}" for fault in quality.faults)


def _in_lines(checks: "RecordingChecks") -> Block:
    """A line a recording, and what was found wrong once."""
    selected = [quantity(key) for key in ("rate_hz", "duration_s", "rms")]
    rows: list[list[str]] = []
    holders: dict[str, list[str]] = {}
    for checked in checks.checked:
        values, quality = checked.scalars(), checked.quality
        name = f"{checked.recording.path.name}, {values['channel']}"
        state = "usable" if quality.usable else "NOT USABLE"
        rows.append([name, *(entry.number_in(values) for entry in selected), values["unit"], state])
        for sentence in (*quality.faults, *quality.remarks):
            holders.setdefault(sentence, []).append(name)
    yield from columns(
        ["recording", *(entry.label for entry in selected), "unit", ""], rows, left=1
    )
    for sentence, names in holders.items():
        everywhere = len(names) == len(checks.checked)
        more = f" and {len(names) - 3} more" if len(names) > 3 else ""
        yield f"  note: {sentence} ({'all' if everywhere else '; '.join(names[:3]) + more})"


@app.command()
def track(
    paths: options.RecordingFiles,
    rate: options.Rate = None,
    unit: options.Unit = None,
    channel: options.Channel = None,
    scale: options.Scale = None,
    case_file: options.Contact = None,
    band: options.Band = None,
    table_file: options.Table = None,
    shaft: options.Shaft = None,
    method: options.Method = None,
    stages_from: options.StagesFrom = "crf",
    false_alarms: options.FalseAlarms = 1e-3,
    acknowledge: options.Acknowledge = None,
    forecast: options.ForecastLimit = None,
    worn: options.Worn = None,
    emulator: options.EmulatorFolder = None,
    store: options.StoreFile = None,
    machine: options.Machine = None,
    point: options.Point = None,
    sensor: options.SensorName = None,
    page: options.Page = None,
    out: Annotated[
        list[Path] | None,
        typer.Option(metavar="FILE", help="Write the table (.csv, .parquet) or all (.nc); repeat."),
    ] = None,
    workers: options.Workers = None,
    as_json: AsJson = False,
    quiet: Quiet = False,
) -> None:
    """Follow the contact resonance through a series of recordings: normal wear, severe wear, or no way to tell."""
    for path in (page, store):
        if path is not None:
            files.require_writable(path)
    for path in out or ():
        require_output(path, ".csv", ".parquet", ".nc")
    count, stated = workers or processes.cores(), _as_read(rate, unit, channel, scale)
    ahead = follower(forecast, case_file, worn, emulator, workers=count, quiet=quiet)
    with _files_read("reading recordings ...", quiet=quiet) as step:
        tracked = monitoring.track_recordings(
            paths,
            case=contact_at(case_file),
            band_hz=band,
            **stated,
            table=table_file,
            shaft_hz=shaft or None,
            method=cast("SeriesMethod | None", method),
            stages_from=cast("StageSource", stages_from),
            false_alarm_rate=false_alarms,
            acknowledge=acknowledge,
            foreteller=ahead,
            workers=count,
            progress=step,
        )
    if store is not None:
        read, names = (
            recording.ReadOptions(**stated),
            {"machine": machine, "point": point, "sensor": sensor},
        )
        tracked = monitoring.keep_track(tracked, store, read, acknowledge=acknowledge, **names)
    kept = [*_write(tracked, out or (), page), *([] if store is None else [store])]
    hint = ["  Add --report track.html for the page, --out track.csv for the table."]
    show(
        tracked.verdict(),
        lambda: (
            tracked.scalars()
            | {
                "report": None if page is None else str(page),
                "written": [str(path) for path in kept],
            }
        ),
        _series(tracked),
        _searched(tracked),
        written("  Written", *kept) if kept else hint,
        as_json=as_json,
        quiet=quiet,
    )
    _end(tracked.alarm.state)


@app.command()
def watch(
    folder: Annotated[Path, typer.Argument(metavar="DIR", help="Folder where recordings arrive.")],
    out: Annotated[
        Path | None, typer.Option(metavar="DIR", help="Folder of results, else DIR/asperity-watch.")
    ] = None,
    once: Annotated[
        bool, typer.Option("--once", help="Take what is there, and end: for cron.")
    ] = False,
    every: Annotated[
        float, typer.Option(metavar="SECONDS", min=0.05, help="Time between two looks.")
    ] = 5.0,
    settle: Annotated[
        float,
        typer.Option(metavar="SECONDS", min=0.0, help="How long a file must have stayed as it is."),
    ] = 2.0,
    expect: Annotated[
        float | None,
        typer.Option(
            metavar="SECONDS",
            min=0.0,
            help="Blind, if none comes for so long; else 5 times the usual.",
        ),
    ] = None,
    workers: options.Workers = None,
    rate: options.Rate = None,
    unit: options.Unit = None,
    channel: options.Channel = None,
    scale: options.Scale = None,
    case_file: options.Contact = None,
    band: options.Band = None,
    table_file: options.Table = None,
    shaft: options.Shaft = None,
    method: options.Method = None,
    stages_from: options.StagesFrom = "crf",
    false_alarms: options.FalseAlarms = 1e-3,
    acknowledge: options.Acknowledge = None,
    forecast: options.ForecastLimit = None,
    worn: options.Worn = None,
    emulator: options.EmulatorFolder = None,
    store: options.StoreFile = None,
    machine: options.Machine = None,
    point: options.Point = None,
    sensor: options.SensorName = None,
    on_alarm: options.OnAlarm = None,
    webhook: options.WebHook = None,
    mqtt: options.Mqtt = None,
    tell: options.Tell = None,
    as_json: AsJson = False,
    quiet: Quiet = False,
) -> None:
    """Track recordings as they arrive in a folder, each read once; goes on where it was stopped. Ctrl-C ends it."""
    kept = out if out is not None else folder / "asperity-watch"
    count, stated = workers or processes.cores(), _as_read(rate, unit, channel, scale)
    names: dict[str, Any] = {"store": store, "machine": machine, "point": point, "sensor": sensor}
    pace: dict[str, Any] = {"once": once, "every_s": every, "settle_s": settle, "expect_s": expect}
    ahead = follower(forecast, case_file, worn, emulator, workers=count, quiet=quiet)
    with _files_read("watching ...", quiet=quiet) as step:
        updates = monitoring.watch_folder(
            folder,
            kept,
            case=contact_at(case_file),
            band_hz=band,
            **stated,
            table=table_file,
            shaft_hz=shaft or None,
            method=cast("SeriesMethod | None", method),
            stages_from=cast("StageSource", stages_from),
            false_alarm_rate=false_alarms,
            acknowledge=acknowledge,
            foreteller=ahead,
            **names,
            tell=_states(tell),
            call=monitoring.callers(command=on_alarm, webhook=webhook, mqtt=mqtt),
            recall=(kept / PAGE).is_file(),
            **pace,
            workers=count,
            progress=step,
        )
        state = _followed(updates, kept, once=once, as_json=as_json, quiet=quiet)
    _end(state)


def _followed(
    updates: "Iterator[Update]", kept: Path, *, once: bool, as_json: bool, quiet: bool
) -> str:
    """Write and show every update until Ctrl-C; the state of the last."""
    state = "cannot-tell"
    try:
        for update in updates:
            state = _written_and_shown(update, kept, as_json=as_json, quiet=quiet) or state
    except KeyboardInterrupt:
        if once:
            raise
        print(
            f"stopped; what was heard is in {kept}, and the next watch goes on from there",
            file=sys.stderr,
        )
    return state


def _as_read(
    rate: float | None, unit: str | None, channel: str | None, scale: float | None
) -> dict[str, Any]:
    """How recordings are read, by the names of the library."""
    return {"rate_hz": rate, "unit": unit, "channel": channel, "scale": scale}


def _states(tell: str | None) -> "Sequence[AlarmState]":
    """States of which somebody is told."""
    return trend.ALARM_STATES if tell is None else cast("Sequence[AlarmState]", tell.split(","))


def _end(state: str) -> None:
    """End with the code that the alarm's state has."""
    if state in EXIT_CODES:
        raise typer.Exit(EXIT_CODES[state])


def _written_and_shown(update: "Update", kept: Path, *, as_json: bool, quiet: bool) -> str | None:
    """Write and show what an update says; the alarm's state, None without any recording."""
    said = update.said or (None if update.track is None else update.track.scalars())
    if update.track is not None:
        _write(update.track, [kept / "track.csv", kept / "track.nc"], kept / PAGE)
    _show_update(update.new, said, update.waiting, kept, as_json=as_json, quiet=quiet)
    for sentence in update.failed:
        print(sentence, file=sys.stderr)
    return None if said is None else str(said["alarm"]["state"])


def _show_update(
    new: "Sequence[Reading]",
    said: Mapping[str, Any] | None,
    waiting: int,
    results: Path,
    *,
    as_json: bool,
    quiet: bool,
) -> None:
    """One update of a watch: a JSON object a line, or a verdict with what is new."""
    verdict = "Nothing to judge yet: no recording has arrived." if said is None else said["verdict"]
    if waiting:
        verdict += f" {waiting} more wait for the next look: they may still be written, or are not in the table yet."
    values: dict[str, Any] = {"verdict": verdict} if said is None else dict(said)
    arrived = [*dict.fromkeys(recording.file for recording in new)]
    show(
        verdict,
        lambda: {**values, "new": arrived, "waiting": waiting, "results": str(results)},
        [] if said is None else _arrived(new, values["recordings"], results),
        as_json=as_json,
        quiet=quiet,
        a_line=True,
    )


def _arrived(new: "Sequence[Reading]", recordings: list[dict[str, Any]], results: Path) -> Block:
    rows = {one["file"]: row for row in recordings for one in (row, *row["sensors"].values())}
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
    kept = [tracked.save(path) for path in out]
    return kept if page is None else [*kept, report.write_track_report(tracked, page)]


def _series(tracked: "Track") -> Block:
    """A row a recording, in the order of x."""
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
        ("severity, last recording", tracked.recordings[-1].severity()),
    ]
    yield from table(rows, (*tracked.problems, *tracked.notes))


@contextmanager
def _files_read(doing: str, *, quiet: bool) -> "Iterator[Callable[[Reading], None]]":
    """Count files on a terminal as they are read."""
    count = 0
    with progress("recordings", doing, quiet=quiet) as display:

        def step(recording: "Reading") -> None:
            nonlocal count
            count += 1
            display(f"{count} read, last {Path(recording.file).name}")

        yield step
