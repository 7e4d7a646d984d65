"""Report opened in the browser with `--open`."""

import sys
import webbrowser
from pathlib import Path

from asperity.cli.options import require_output
from asperity.core.errors import BadInput


def require_page(page: Path | None, *, requested: bool) -> None:
    """Raise BadInput for a page of `--report` that cannot be written or opened."""
    require_opened(page, requested=requested)
    require_output(page, ".html", option="--report")


def require_opened(
    page: Path | None, *, requested: bool, option: str = "--report OUT.html"
) -> None:
    """Raise BadInput if a report that is not written is to be opened."""
    if requested and page is None:
        raise BadInput(f"--open opens the report that is written; add {option}")


def open_page(page: Path | None, *, requested: bool) -> None:
    """Open a written page in the browser; without a browser, state its address on stderr."""
    if page is None or not requested:
        return
    address = page.resolve().as_uri()
    if not webbrowser.open(address):
        print(f"no browser was found; open {address}", file=sys.stderr)
