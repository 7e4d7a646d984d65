"""Output of `asperity track`: verdict, a row per recording, search, stages and states."""

from pathlib import Path
from typing import TYPE_CHECKING

from asperity.cli.output import Block, Row, columns, show, span, table, written
from asperity.cli.terminal.browser import open_page
from asperity.core.quantities import NO_VALUE, quantity

if TYPE_CHECKING:
    from asperity.monitoring import Track


def show_track(
    tracked: "Track",
    page: Path | None,
    saved: list[Path],
    store: Path | None,
    *,
    opened: bool,
    as_json: bool,
    quiet: bool,
) -> None:
    """Show the verdict of a track, its series and what was written."""
    paths_written = saved if store is None else [*saved, store]
    hint = ["Add --report track.html for the page, --out track.csv for the table."]
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
        written("Written", *paths_written) if paths_written else hint,
        as_json=as_json,
        quiet=quiet,
    )
    open_page(page, requested=opened)


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
        *_fault_rows(tracked),
        *_states_rows(tracked),
        ("severity, last recording", tracked.recordings[-1].severity()),
    ]
    yield from table(rows, (*tracked.problems, *tracked.notes))


def _fault_rows(tracked: "Track") -> list[Row]:
    """Return a row of the fault that an alert or alarm indicates; none without one."""
    sentence = tracked.fault_sentence()
    return [("fault", sentence)] if sentence else []


def _states_rows(tracked: "Track") -> list[Row]:
    """Return rows of the states of contact, level and sensor."""
    scalars = tracked.scalars(all_sources=False)
    return [
        (name, ": ".join(filter(None, (scalars[name]["state"], scalars[name]["reason"]))))
        for name in ("contact", "level", "sensor")
    ]
