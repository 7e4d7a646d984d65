"""`asperity new`: write a commented template of a case file."""

from pathlib import Path
from typing import Annotated

import typer

from asperity import case
from asperity.cli.app import app
from asperity.core.errors import BadInput, require_choice


@app.command()
def new(
    kind: Annotated[
        str,
        typer.Argument(
            metavar="KIND",
            help="A contact: line, point, elliptic, roller, dry, measured. A machine: gear, "
            "bearing, cam. A task: motion, study, wear, track, infer.",
        ),
    ],
    out: Annotated[
        Path | None, typer.Option(metavar="CASE.toml", help="File to write; default: KIND.toml.")
    ] = None,
) -> None:
    """Write a commented template of a case."""
    require_choice("kind of case", kind, case.KINDS)
    path = out or Path(f"{kind}.toml")
    if path.exists():
        raise BadInput(f"{path} exists already; name another file with --out")
    for written in case.write_template(kind, path):
        print(f"Wrote {written}")
    print("Try next:")
    for command in case.COMMANDS[kind]:
        print(f"  asperity {command.format(case=path, name=path.stem)}")
