"""`asperity page`: the live page, until interrupted."""

from functools import partial
from pathlib import Path
from typing import Annotated

import typer

from asperity import report
from asperity.cli.app import app
from asperity.core.errors import BadInput, install_text

PageSource = Annotated[
    Path | None,
    typer.Argument(
        metavar="CASE.toml|RUN.nc|STUDY|FOLDER",
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
    """Explore a contact, recordings or a study in the browser."""
    try:
        from asperity.app import ReportTools, open_page, serve_page

        opened = open_page(source)
        tools = ReportTools(report.write_report, report.machine_drawing)
        serve_page(
            opened, port=port, listen=listen, ready=partial(_print_address, listen), tools=tools
        )
    except ModuleNotFoundError as missing:
        if (missing.name or "").partition(".")[0] not in (
            "panel",
            "bokeh",
            "tornado",
            "markupsafe",
        ):
            raise
        raise BadInput(f"the live page needs Panel; {install_text('page')}") from None


def _print_address(listen: str, address: str) -> None:
    print(f"The live page is at {address} until Ctrl-C.", flush=True)
    if listen not in ("127.0.0.1", "::1", "localhost"):
        print(
            "Others open the address of this machine and its port, and enter the password.",
            flush=True,
        )
