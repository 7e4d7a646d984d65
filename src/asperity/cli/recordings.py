"""`asperity check`, `track` and `watch`: measured recordings, from files to a verdict."""

import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, cast

import typer

from asperity.cli.app import AsJson, Quiet, app
from asperity.cli.common import print_json, print_rows
from asperity.cli.flags import with_flags
from asperity.errors import BadInput
from asperity.files import make_folder

if TYPE_CHECKING:
    from asperity.case import Case
    from asperity.recording import OpenRecording, Quality
    from asperity.tracking import Reading, Track
    from asperity.wear import Resonance, SeriesMethod

ALARM = 3
IN_FULL = 4  # recordings that `check` shows with every fact


def _hertz(text: str) -> float:
    """A frequency as a bare number of hertz, or with its unit."""
    from asperity.case import read_amount

    try:
        return float(text)
    except ValueError:
        return read_amount("a frequency", "Hz", text)


Rate = Annotated[
    float | None,
    typer.Option(metavar="HZ", parser=_hertz, help="Sampling rate, for files that do not state it."),
]
Unit = Annotated[str | None, typer.Option(help="Unit of the values, such as g, for files that do not state it.")]
Channel = Annotated[str | None, typer.Option(help="Name or number of the channel, where files have several.")]
Scale = Annotated[
    float | None, typer.Option(help="What a stored 1 stands for, in the unit: g at full scale of a wav, g per volt.")
]
CaseFile = Annotated[
    Path | None, typer.Option("--case", metavar="CASE.toml", help="The contact: where to look, and load shares.")
]
Band = Annotated[
    tuple[float, float] | None, typer.Option(metavar="LOW HIGH", help="Where to look [Hz], instead of the case's band.")
]
Table = Annotated[
    Path | None, typer.Option(metavar="CSV", help="Columns file, x (such as sq_um), sq_um_std, load_n, speed_hz.")
]
Shaft = Annotated[
    list[float] | None, typer.Option(metavar="HZ", help="Shaft speed whose harmonics to remove; found if not given.")
]
Workers = Annotated[int | None, typer.Option(min=1, help="Processes that read at once, else all.")]
Method = Annotated[str | None, typer.Option(help="joint, modes, likelihood or peak (the paper's).")]


@app.command()
def check(
    files: Annotated[list[Path], typer.Argument(metavar="FILE...", help="Recordings, or folders of them.")],
    rate: Rate = None,
    unit: Unit = None,
    channel: Channel = None,
    scale: Scale = None,
    case_file: CaseFile = None,
    band: Band = None,
    as_json: AsJson = False,
    quiet: Quiet = False,
) -> None:
    """Say what recordings hold: rate, unit, length, channels, gaps, clipping, offset, machine off, too short."""
    from asperity.recording import check_recording, open_channels
    from asperity.tracking import recordings_in, search_target

    target = search_target(_case(case_file), band)
    checked: list[tuple[OpenRecording, Quality]] = []
    refused: list[tuple[Path, str]] = []
    paths = recordings_in([file for file in files if file.exists()]) if any(file.exists() for file in files) else []
    for path in [*paths, *(file for file in files if not file.exists())]:
        try:
            channels = open_channels(path, rate_hz=rate, unit=unit, channel=channel, scale=scale)
            checked += [
                (one, check_recording(one, width_hz=target.width_hz, band_hz=target.band_hz)) for one in channels
            ]
        except BadInput as error:
            refused.append((path, str(error)))
    if as_json:
        recordings = [_check_row(one, quality) for one, quality in checked]
        print_json(
            {
                "verdict": _check_verdict(checked, refused),
                "recordings": recordings,
                "refused": [{"file": str(path), "reason": reason} for path, reason in refused],
                "band_hz": list(target.band_hz),
                "width_hz": target.width_hz,
            }
        )
    elif checked:
        print(_check_verdict(checked, refused))
        if not quiet:
            print(f"  for a resonance {target.width_hz:.0f} Hz wide in {with_flags(target.source)}")
            _print_checks(checked)
    if refused:
        raise BadInput("; ".join(dict.fromkeys(reason for _, reason in refused)))


def _check_verdict(checked: "Sequence[tuple[OpenRecording, Quality]]", refused: Sequence[Any]) -> str:
    good = sum(quality.usable for _, quality in checked)
    total = len(checked) + len(refused)
    if total == 1 and checked:
        one, quality = checked[0]
        return f"{one.path.name}: " + ("can be used." if quality.usable else f"cannot be used: {quality.faults[0]}.")
    things = "channels" if len({one.path for one, _ in checked}) < len(checked) else "recordings"
    sentence = f"{good} of {total} {things} can be used"
    reasons = dict.fromkeys(quality.faults[0].partition(":")[0] for _, quality in checked if not quality.usable)
    return f"{sentence}{': ' if reasons else ''}{'; '.join(reasons)}."


def _check_row(one: "OpenRecording", quality: "Quality") -> dict[str, Any]:
    return {
        "file": str(one.path),
        "channel": one.channel.name,
        "usable": quality.usable,
        "off": quality.off,
        "rate_hz": one.rate_hz,
        "unit": one.unit,
        "samples": quality.samples,
        "duration_s": quality.duration_s,
        "rms": quality.rms,
        "peak": quality.peak,
        "offset": quality.offset,
        "missing": quality.missing,
        "gaps": quality.gaps,
        "clipped": quality.clipped,
        "stuck": quality.stuck,
        "crfa_comparable": one.comparable,
        "facts": {name: {"value": str(fact.value), "source": fact.source} for name, fact in one.facts.items()},
        "faults": list(quality.faults),
        "remarks": list(quality.remarks),
    }


def _print_checks(checked: "Sequence[tuple[OpenRecording, Quality]]") -> None:
    """Few recordings in full; many a line each, and what was found wrong once."""
    if len(checked) <= IN_FULL:
        for one, quality in checked:
            print(f"\n{one.path}, channel {one.channel.name}: {'usable' if quality.usable else 'NOT USABLE'}")
            print_rows(_check_rows(one, quality))
            for sentence in (*quality.faults, *quality.remarks):
                print(f"  {'fault' if sentence in quality.faults else 'note'}: {sentence}")
        return
    print()
    names = [f"{one.path.name}, {one.channel.name}" for one, _ in checked]
    width = max(map(len, names))
    said: dict[str, list[str]] = {}
    for name, (one, quality) in zip(names, checked, strict=True):
        state = "usable" if quality.usable else "NOT USABLE"
        print(f"  {name:{width}}  {one.rate_hz:9g} Hz  {quality.duration_s:9.4g} s  rms {quality.rms:9.3g}  {state}")
        for sentence in (*quality.faults, *quality.remarks):
            said.setdefault(sentence, []).append(name)
    for sentence, holders in said.items():
        where = "all" if len(holders) == len(checked) else "; ".join(holders[:3])
        print(
            f"  note: {sentence} ({where}{f' and {len(holders) - 3} more' if 3 < len(holders) < len(checked) else ''})"
        )


def _check_rows(one: "OpenRecording", quality: "Quality") -> list[tuple[str, str]]:
    facts = one.facts
    rows = [
        ("format", str(facts["format"].value)),
        ("rate", f"{one.rate_hz:g} Hz, stated by {facts['rate'].source}"),
        ("unit", f"{facts['unit'].value}, stated by {facts['unit'].source}"),
        *([("scale", f"{facts['scale'].value:g}, stated by {facts['scale'].source}")] if "scale" in facts else []),
        ("length", f"{quality.duration_s:.4g} s, {quality.samples} samples"),
        ("rms, peak, offset", f"{quality.rms:.4g}, {quality.peak:.4g}, {quality.offset:.4g}; unit: {one.unit}"),
    ]
    if one.started is not None:
        rows.insert(3, ("started", f"{one.started}, stated by {facts['started'].source}"))
    return rows


@app.command()
def track(
    files: Annotated[list[Path], typer.Argument(metavar="FILE...", help="Recordings, or folders of them.")],
    rate: Rate = None,
    unit: Unit = None,
    channel: Channel = None,
    scale: Scale = None,
    case_file: CaseFile = None,
    band: Band = None,
    table: Table = None,
    shaft: Shaft = None,
    method: Method = None,
    report: Annotated[Path | None, typer.Option(metavar="OUT.html", help="Write one self-contained page.")] = None,
    out: Annotated[
        list[Path] | None, typer.Option(metavar="FILE", help="Write the table (.csv, .parquet) or all (.nc); repeat.")
    ] = None,
    workers: Workers = None,
    as_json: AsJson = False,
    quiet: Quiet = False,
) -> None:
    """Follow the contact resonance through a series of recordings: normal wear, severe wear, or no way to tell."""
    from asperity.files import require_writable
    from asperity.processes import cores
    from asperity.tracking import track_recordings

    for path in (*(out or ()), *([report] if report is not None else [])):
        require_writable(path)
    for path in out or ():
        if path.suffix.lower() not in (".csv", ".parquet", ".nc"):
            raise BadInput(f"--out must end in .csv, .parquet or .nc, got {path}; the page goes to --report")
    with _shown_files(quiet=quiet) as told:
        tracked = track_recordings(
            files,
            case=_case(case_file),
            band_hz=band,
            rate_hz=rate,
            unit=unit,
            channel=channel,
            scale=scale,
            table=table,
            shaft_hz=shaft or None,
            method=cast("SeriesMethod | None", method),
            workers=workers or cores(),
            progress=told,
        )
    written = _write(tracked, out or (), report)
    if as_json:
        page = None if report is None else str(report)
        print_json(tracked.scalars() | {"report": page, "written": [str(path) for path in written]})
    else:
        print(tracked.verdict())
        if not quiet:
            _print_track(tracked)
            for path in written:
                print(f"  Written: {path}")
            if not written:
                print("  Add --report track.html for the page, --out track.csv for the table.")
    if tracked.alarmed:
        raise typer.Exit(ALARM)


@app.command()
def watch(
    folder: Annotated[Path, typer.Argument(metavar="DIR", help="Folder where recordings arrive.")],
    out: Annotated[Path | None, typer.Option(metavar="DIR", help="Folder of results, else DIR/asperity-watch.")] = None,
    once: Annotated[bool, typer.Option("--once", help="Take what is there, and end: for cron.")] = False,
    every: Annotated[float, typer.Option(metavar="SECONDS", min=0.05, help="Time between two looks.")] = 5.0,
    settle: Annotated[
        float, typer.Option(metavar="SECONDS", min=0.0, help="How long a file must have stayed as it is.")
    ] = 2.0,
    workers: Workers = None,
    rate: Rate = None,
    unit: Unit = None,
    channel: Channel = None,
    scale: Scale = None,
    case_file: CaseFile = None,
    band: Band = None,
    table: Table = None,
    shaft: Shaft = None,
    method: Method = None,
    as_json: AsJson = False,
    quiet: Quiet = False,
) -> None:
    """Track recordings as they arrive in a folder, each read once; goes on where it was stopped. Ctrl-C ends it."""
    from asperity.processes import cores
    from asperity.tracking import watch_folder

    results = out if out is not None else folder / "asperity-watch"
    if not folder.is_dir():
        raise BadInput(f"{folder} is not a folder; name the folder where recordings arrive")
    make_folder(results)
    alarmed = False
    with _shown_files(quiet=quiet, waiting="watching ...") as told:
        updates = watch_folder(
            folder,
            results,
            case=_case(case_file),
            band_hz=band,
            rate_hz=rate,
            unit=unit,
            channel=channel,
            scale=scale,
            table=table,
            shaft_hz=shaft or None,
            method=cast("SeriesMethod | None", method),
            once=once,
            every_s=every,
            settle_s=settle,
            workers=workers or cores(),
            progress=told,
        )
        try:
            for update in updates:
                alarmed = update.track is not None and update.track.alarmed
                if update.track is not None:
                    _write(update.track, [results / "track.csv", results / "track.nc"], results / "report.html")
                _tell(update.new, update.track, update.waiting, results, as_json=as_json, quiet=quiet)
        except KeyboardInterrupt:
            if once:
                raise
            print(f"stopped; what was heard is in {results}, and the next watch goes on from there", file=sys.stderr)
    if alarmed:
        raise typer.Exit(ALARM)


def _tell(
    new: "Sequence[Reading]", tracked: "Track | None", waiting: int, results: Path, *, as_json: bool, quiet: bool
) -> None:
    """One update of a watch: a JSON object a line, or a verdict with what is new."""
    import json

    verdict = "Nothing to judge yet: no recording has arrived." if tracked is None else tracked.verdict()
    if waiting:
        verdict += f" {waiting} more may still be written and wait for the next look."
    if as_json:
        told: dict[str, Any] = {"verdict": verdict} if tracked is None else tracked.scalars()
        told |= {"new": [one.file for one in new], "waiting": waiting, "results": str(results)}
        print(json.dumps(told, allow_nan=False), flush=True)
        return
    print(verdict, flush=True)
    if quiet or tracked is None:
        return
    rows = {one.file: one for one in tracked.recordings}
    for one in new:
        print(f"  {Path(one.file).name}: {_found(rows[one.file]) if one.file in rows else one.reason}", flush=True)
    print(f"  {len(tracked.recordings)} recordings so far; results in {results}", flush=True)


def _write(tracked: "Track", out: Sequence[Path], report: Path | None) -> list[Path]:
    written = [tracked.save(path) for path in out]
    if report is not None:
        from asperity.report import write_track_report

        written.append(write_track_report(tracked, report))
    return written


def _print_track(tracked: "Track") -> None:
    print()
    name = max(10, *(len(Path(one.file).name) for one in tracked.recordings))
    print(f"  {'recording':{name}}  {tracked.x_name:>10}  {'CRF [Hz]':>16}  {'CRFA':>9}  {'severe':>6}")
    for one in tracked.recordings:
        probability = "" if one.severe_probability != one.severe_probability else f"{one.severe_probability:.2f}"
        amplitude = f"{one.resonance.crfa:.3g}" if one.resonance.found else ""
        shown = _with_deviation(one.resonance) if one.resonance.found else "not found"
        reason = "" if one.resonance.found else f"  {one.resonance.reason}"
        print(f"  {Path(one.file).name:{name}}  {one.x:10.4g}  {shown:>16}  {amplitude:>9}  {probability:>6}{reason}")
    print()
    low, high = tracked.target.band_hz
    rows = [("searched", f"{low:.0f} to {high:.0f} Hz"), ("method", tracked.method), ("alarm", tracked.alarm.verdict)]
    print_rows(rows)
    for sentence in (*tracked.problems, *tracked.notes):
        print(f"  note: {with_flags(sentence)}")


def _found(one: Any) -> str:
    resonance = one.resonance
    if not resonance.found:
        return f"no contact resonance: {resonance.reason}"
    stage = (
        ""
        if one.severe_probability != one.severe_probability
        else f", severe with probability {one.severe_probability:.2f}"
    )
    return f"CRF {_with_deviation(resonance)} Hz{stage}"


def _with_deviation(resonance: "Resonance") -> str:
    deviation = "" if resonance.crf_std != resonance.crf_std else f" ± {resonance.crf_std:.1f}"
    return f"{resonance.crf_hz:.1f}{deviation}"


def _case(path: Path | None) -> "Case | None":
    from asperity.case import load_case

    return None if path is None else load_case(path)


@contextmanager
def _shown_files(
    *, quiet: bool, waiting: str = "reading recordings ..."
) -> "Iterator[Callable[[Reading], None] | None]":
    """Count files on a terminal as they are read."""
    from rich.console import Console

    console = Console(stderr=True)
    if quiet or not console.is_terminal:
        yield None
        return
    count = 0
    with console.status(waiting) as status:

        def told(heard: "Reading") -> None:
            nonlocal count
            count += 1
            status.update(f"{count} read, last {Path(heard.file).name}")

        yield told
