"""`asperity new`: write a commented template of a case file."""

from pathlib import Path
from typing import Annotated

import typer

from asperity import case
from asperity.cli.app import app
from asperity.core import files
from asperity.core.errors import BadInput, require_choice

NEXT = {"wear": "wear {} --hours 1"}  # next command by kind of case; default: solve


@app.command()
def new(
    kind: Annotated[
        str,
        typer.Argument(
            metavar="KIND",
            help="line, point, elliptic, roller, dry, measured, motion, study or wear.",
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
    files.write_text(path, case.case_template(kind))
    following = NEXT.get(kind, "solve {}").format(path)
    print(f"{path}: template of a case. Try next: asperity {following}")
