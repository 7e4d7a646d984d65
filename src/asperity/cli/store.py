"""`asperity store`: overview, export and acknowledgement of a store of monitored machines."""

from pathlib import Path
from typing import Annotated

import typer

from asperity import monitoring
from asperity.cli.app import app
from asperity.cli.monitored.series import EXIT_CODES
from asperity.cli.options import AsJson, Quiet, require_output
from asperity.cli.output import columns, show, written
from asperity.core.quantities import NO_VALUE


@app.command()
def store(
    file: Annotated[
        Path,
        typer.Argument(metavar="DB", help="Store of watch or track, such as asperity.db."),
    ],
    out: Annotated[
        list[Path] | None,
        typer.Option(
            metavar="FILE", help="File for all recordings as rows (.parquet, .csv); repeatable."
        ),
    ] = None,
    acknowledge: Annotated[
        str | None,
        typer.Option(metavar="MACHINE/POINT/SENSOR", help="Acknowledge this sensor's alarm."),
    ] = None,
    as_json: AsJson = False,
    quiet: Quiet = False,
) -> None:
    """Show the state of every sensor in a store.

    The most severe state sets the exit code.
    """
    for path in out or ():
        require_output(path, ".csv", ".parquet")
    if acknowledge is not None:
        monitoring.acknowledge_in(file, acknowledge)
    overview = monitoring.store_overview(file)
    exported = [overview.export(path) for path in out or ()]
    rows = [
        [
            *(row[name] for name in ("machine", "point", "sensor")),
            str(row["recordings"]),
            row["state"],
            NO_VALUE if row["since"] is None else Path(row["since"]).name,
            row["reason"],
        ]
        for row in overview.rows
    ]
    show(
        overview.verdict(),
        lambda: overview.scalars() | {"written": [str(path) for path in exported]},
        columns(
            ["machine", "point", "sensor", "recordings", "state", "since", "reason"], rows, left=3
        )
        if rows
        else [],
        written("Written", *exported),
        as_json=as_json,
        quiet=quiet,
    )
    if overview.state in EXIT_CODES:
        raise typer.Exit(EXIT_CODES[overview.state])
