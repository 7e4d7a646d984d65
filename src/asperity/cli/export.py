"""`asperity export`: fields of a saved run for other programs."""

from pathlib import Path
from typing import Annotated

import typer

from asperity import results
from asperity.cli.app import app
from asperity.cli.options import AsJson, Quiet, require_output
from asperity.cli.output import show


@app.command("export")
def export_command(
    path: Annotated[Path, typer.Argument(metavar="RUN.nc", help="Run saved by asperity solve.")],
    out: Annotated[
        Path, typer.Argument(metavar="OUT.csv|OUT.vti", help="Table, or VTK image for ParaView.")
    ],
    as_json: AsJson = False,
    quiet: Quiet = False,
) -> None:
    """Write the fields of a saved run as a table or VTK image."""
    require_output(out, *results.FIELD_SUFFIXES, option="OUT")
    run = results.load_run(path)
    results.write_fields(run, out)
    show(
        f"{run.solution.grid.cells[0] * run.solution.grid.cells[1]} cells of {path} are in {out}.",
        lambda: {"fields": str(out)},
        as_json=as_json,
        quiet=quiet,
    )
