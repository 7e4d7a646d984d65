"""`asperity track --series`: a table of time stamps and overall values; exit codes of states."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from asperity import monitoring
from asperity.cli.output import Block, columns, show, table, written
from asperity.core.errors import BadInput
from asperity.core.quantities import NO_VALUE

if TYPE_CHECKING:
    from asperity.monitoring import OverallTrack

EXIT_CODES = {"alarm": 3, "cannot-tell": 4, "blind": 5}  # by state of the alarm; otherwise 0
LAST_ROWS = 10  # that are shown


def end_with(state: str) -> None:
    """End with the exit code of the alarm's state."""
    if state in EXIT_CODES:
        raise typer.Exit(EXIT_CODES[state])


def track_series(
    series: Path,
    paths: list[Path] | None,
    page: Path | None,
    out: Sequence[Path],
    acknowledge: str | None,
    *,
    as_json: bool,
    quiet: bool,
) -> None:
    """Judge a table of overall values and end with the exit code of its state."""
    if paths or page is not None:
        extra = "recordings" if paths else "--report"
        raise BadInput(f"--series judges a table by itself, got {extra} too; leave one out")
    judged = monitoring.track_overalls(series, acknowledge=acknowledge)
    saved = [judged.save(path) for path in out]
    show(
        judged.verdict(),
        lambda: judged.scalars() | {"written": [str(path) for path in saved]},
        _overall_rows(judged),
        written("  Written", *saved) if saved else ["  Add --out judged.csv for all rows."],
        as_json=as_json,
        quiet=quiet,
    )
    end_with(judged.state)


def _overall_rows(judged: "OverallTrack") -> Block:
    """Yield the last rows of a judged table, and its notes."""
    overalls, rows = judged.overalls, judged.rows()[-LAST_ROWS:]
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
    yield from table([("level", judged.level.reason)], overalls.notes)
