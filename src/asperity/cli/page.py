"""`asperity page`: the live page, until interrupted."""

from pathlib import Path
from typing import Annotated

import typer

from asperity import report
from asperity.cli.app import app
from asperity.core.errors import BadInput

What = Annotated[
    Path | None,
    typer.Argument(
        metavar="[CASE.toml|RUN.nc|STUDY|FOLDER]",
        help="A case, a kept run, the folder of a study, a history or recordings; by default the paper's contact.",
    ),
]
Port = Annotated[
    int,
    typer.Option(
        metavar="N", min=0, max=65535, help="Where the page is; 0 takes any that is free."
    ),
]
Listen = Annotated[
    str,
    typer.Option(
        metavar="ADDRESS",
        help="Let others on the network in too; they need the password in ASPERITY_PAGE_PASSWORD.",
    ),
]


@app.command("page")
def page_command(what: What = None, port: Port = 5006, listen: Listen = "127.0.0.1") -> None:
    """Open a page to turn a contact's knobs on, or to look at recordings, a study or a history."""
    try:
        from asperity.app import open_page, serve_page

        opened = open_page(what)
        serve_page(opened, port=port, listen=listen, ready=_ready, write_report=report.write_report)
    except ModuleNotFoundError as missing:
        if (missing.name or "").partition(".")[0] not in (
            "panel",
            "bokeh",
            "tornado",
            "markupsafe",
        ):
            raise
        raise BadInput("the live page needs Panel; pip install 'asperity[page]'") from None


def _ready(address: str) -> None:
    print(f"The live page is at {address} until Ctrl-C.", flush=True)
