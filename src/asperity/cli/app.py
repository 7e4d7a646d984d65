"""The application: its commands are in the modules beside this one; what asperity refuses becomes an exit code here."""

import sys
from collections.abc import Sequence
from typing import Annotated

import typer

from asperity.cli.flags import with_flags
from asperity.errors import AsperityError, BadInput

INTERRUPTED = 130  # what typer makes of Ctrl-C

app = typer.Typer(
    help="Hears how a lubricated contact wears: film, load sharing of asperities and oil, contact resonance.",
    epilog="Exit codes: 0 done, 2 bad input or usage, 3 done with an alarm, 1 anything else.",
    add_completion=False,
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
)

AsJson = Annotated[bool, typer.Option("--json", help="Print one JSON object and nothing else.")]
Quiet = Annotated[bool, typer.Option("--quiet", "-q", help="Print the verdict only, and no progress.")]


def main(arguments: Sequence[str] | None = None) -> None:
    """Run a command and exit with its code; what asperity refuses is one line on stderr."""
    try:
        code = app(args=arguments, prog_name="asperity", standalone_mode=False)
        if code == INTERRUPTED:
            code = _complain("interrupted; nothing half written was left behind", 1)
    except BadInput as error:
        code = _complain(with_flags(str(error)), 2)
    except AsperityError as error:
        code = _complain(str(error), 1)
    except typer.TyperException as error:  # usage
        code = _complain(f"{error.format_message().rstrip('.')}; asperity --help says what there is", error.exit_code)
    sys.exit(code)


def _complain(sentence: str, code: int) -> int:
    print(f"error: {sentence}", file=sys.stderr)
    return code


def _show_version(wanted: bool) -> None:
    if wanted:
        from asperity import __version__

        print(f"asperity {__version__}")
        raise typer.Exit


@app.callback()
def _asperity(
    _version: Annotated[
        bool, typer.Option("--version", callback=_show_version, is_eager=True, help="Print the version.")
    ] = False,
) -> None:
    pass
