"""`asperity track --series`: a table of time stamps and overall values; exit codes of states."""

import sys
from collections.abc import Mapping, Sequence
from contextlib import suppress
from os import environ
from types import SimpleNamespace
from typing import TYPE_CHECKING

import typer

from asperity import monitoring
from asperity.cli.output import Block, columns, show, table, written
from asperity.core.errors import BadInput
from asperity.core.quantities import NO_VALUE

if TYPE_CHECKING:
    from asperity.monitoring import OverallTrack, OverallUpdate
    from asperity.trend import AlarmState

EXIT_CODES = {"alarm": 3, "cannot-tell": 4, "blind": 5}  # by state of the alarm; otherwise 0
LAST_ROWS = 10  # that are shown
# options that only recordings use, with the name and default of each
WITHOUT_RECORDINGS: dict[str, tuple[str, object]] = {
    "--rate": ("rate", None),
    "--unit": ("unit", None),
    "--channel": ("channel", None),
    "--scale": ("scale", None),
    "--case": ("case_file", None),
    "--band": ("band", None),
    "--table": ("table_file", None),
    "--shaft": ("shaft", None),
    "--method": ("method", None),
    "--stages-from": ("stages_from", "crf"),
    "--false-alarms": ("false_alarms", 1e-3),
    "--forecast": ("forecast", None),
    "--worn": ("worn", None),
    "--emulator": ("emulator", None),
    "--store": ("store", None),
    "--workers": ("workers", None),
    "--figures": ("figures", None),
}
ONLY_OF_WATCH: dict[str, tuple[str, object]] = {
    "--machine": ("machine", None),
    "--point": ("point", None),
    "--sensor": ("sensor", None),
}
ONLY_OF_FOLDERS: dict[str, tuple[str, object]] = {
    "--tree": ("tree", False),
    "--expect": ("expect", None),
    "--report-every": ("report_every", None),
    "--keep": ("keep", None),
    "--line-protocol": ("line_protocol", None),
    "--prometheus": ("prometheus", None),
}


def end_with(state: str) -> None:
    """End with the exit code of the alarm's state."""
    if state in EXIT_CODES:
        raise typer.Exit(EXIT_CODES[state])


def track_series(options: SimpleNamespace) -> None:
    """Judge a table of overall values and end with the exit code of its state."""
    if options.paths or options.page is not None:
        extra = "recordings" if options.paths else "--report"
        raise BadInput(f"--series judges a table by itself, got {extra} too; leave one out")
    _refuse_others(options, WITHOUT_RECORDINGS | ONLY_OF_WATCH)
    judged = monitoring.track_overalls(options.series, acknowledge=options.acknowledge)
    saved = [judged.save(path) for path in options.out or ()]
    show(
        judged.verdict(),
        lambda: judged.scalars() | {"written": [str(path) for path in saved]},
        _overall_rows(judged),
        written("Written", *saved) if saved else ["Add --out judged.csv for all rows."],
        as_json=options.as_json,
        quiet=options.quiet,
    )
    end_with(judged.state)


def _refuse_others(options: SimpleNamespace, unused: Mapping[str, tuple[str, object]]) -> None:
    """Raise BadInput for an option that overall values do not use and that is not its default."""
    for option, (name, default) in unused.items():
        value = getattr(options, name, default)
        if value not in (default, []) and value != environ.get(f"ASPERITY_{name.upper()}"):
            raise BadInput(f"{option} does not apply to a table of overall values; leave it out")


def watch_series(options: SimpleNamespace, notify_states: "Sequence[AlarmState]") -> None:
    """Judge a table of overall values at each change, and end with the code of its last state."""
    _refuse_others(options, WITHOUT_RECORDINGS | ONLY_OF_FOLDERS)
    watching = monitoring.WatchSettings(
        machine=options.machine,
        point=options.point,
        sensor=options.sensor,
        notifiers=monitoring.notifiers(
            command=options.on_alarm, webhook=options.webhook, mqtt=options.mqtt
        ),
        notify_states=notify_states,
        once=options.once,
        poll_interval_s=options.every,
        settle_time_s=options.settle,
    )
    out = options.out or options.folder.parent / "asperity-watch"
    state = "cannot-tell"
    with suppress(KeyboardInterrupt):
        for update in monitoring.watch_overalls(
            options.folder, out, watching, acknowledge=options.acknowledge
        ):
            state = _show_overall_update(update, options) or state
    end_with(state)


def _show_overall_update(update: "OverallUpdate", options: SimpleNamespace) -> str | None:
    """Show an update; return the state, None if the table has not changed."""
    for sentence in update.failed:
        print(sentence, file=sys.stderr)
    track = update.track
    if track is None:
        return None
    show(
        track.verdict(),
        lambda: track.scalars(rows=False),
        [],
        as_json=options.as_json,
        quiet=options.quiet,
        a_line=True,
    )
    return track.state


def _overall_rows(judged: "OverallTrack") -> Block:
    """Yield the last rows of a judged table, and its notes."""
    overalls, rows = judged.overalls, judged.rows(LAST_ROWS)
    titles = ["time" if overalls.times else overalls.x_unit or "x"]
    titles += [
        f"{name} [{overalls.units[name]}]" if overalls.units[name] else name
        for name in overalls.values
    ]
    numbers = [
        [
            str(row["time"] or f"{row['x']:.6g}"),
            *(
                NO_VALUE if (value := row[name]) is None else f"{value:.4g}"
                for name in overalls.values
            ),
            str(row["state"]),
        ]
        for row in rows
    ]
    if len(rows) < len(judged.states):
        yield f"  the last {len(rows)} of {len(judged.states)} rows"
    yield from columns([*titles, "state"], numbers, left=1)
    yield from table([("level", judged.level.reason)], judged.notes)
