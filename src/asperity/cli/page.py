"""`asperity page`: the live page, until interrupted."""

from pathlib import Path
from typing import Annotated

import typer

from asperity import report
from asperity.cli.app import app
from asperity.core.errors import BadInput

PageSource = Annotated[
    Path | None,
    typer.Argument(
        metavar="[CASE.toml|RUN.nc|STUDY|FOLDER]",
        help="Case, run, or folder of a study, history or recordings (default: paper's contact).",
    ),
]
Port = Annotated[
    int,
    typer.Option(metavar="N", min=0, max=65535, help="Port of the page; 0: any free port."),
]
Listen = Annotated[
    str,
    typer.Option(
        metavar="ADDRESS",
        help="Address for other hosts, which need the password in ASPERITY_PAGE_PASSWORD.",
    ),
]


@app.command("page")
def page_command(
    source: PageSource = None, port: Port = 5006, listen: Listen = "127.0.0.1"
) -> None:
    """Serve a page to explore a contact, or to view recordings, a study or a history."""
    try:
        from asperity.app import open_page, serve_page

        opened = open_page(source)
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
