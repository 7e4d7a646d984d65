"""The application: its commands are in the modules beside this one; what asperity refuses becomes an exit code here."""

import codecs
import os
import sys
import unicodedata
from collections.abc import Sequence
from io import TextIOWrapper
from typing import Annotated

import typer

import asperity
from asperity.cli.options import with_flags
from asperity.core import quantities
from asperity.core.errors import AsperityError, BadInput
from asperity.core.processes import tune_memory_use
from asperity.core.third_party import printable

INTERRUPTED = 130  # what typer makes of Ctrl-C
LONGEST = 480  # characters of a complaint
SUPERSCRIPTS = {chr(high): chr(low) for low, high in quantities.SUPERSCRIPTS.items()}
PLAIN = {"µ": "u", "−": "-", "–": "-", "±": "+-", "×": "x", "Λ": "lambda", "′": "'", **SUPERSCRIPTS}

app = typer.Typer(
    help="Hears how a lubricated contact wears: film, load sharing of asperities and oil, contact resonance.",
    epilog="Exit codes: 0 done, 2 bad input or usage, 1 anything else; of track and watch: 3 alarm, 4 cannot tell, "
    "5 sensor or machine off.",
    add_completion=False,
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
)


def main(arguments: Sequence[str] | None = None) -> None:
    """Run a command and exit with its code; what asperity refuses is one line on stderr."""
    tune_memory_use()
    codecs.register_error("plain", _plain)
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, TextIOWrapper):
            stream.reconfigure(errors="plain")
    try:
        given = sys.argv[1:] if arguments is None else list(arguments)
        code = app(args=given, prog_name="asperity", standalone_mode=False, obj=given)
        sys.stdout.flush()
        if code == INTERRUPTED:
            code = _complain("interrupted; nothing half written was left behind", 1)
    except BadInput as error:
        code = _complain(with_flags(str(error)), 2)
    except AsperityError as error:
        code = _complain(str(error), 1)
    except typer.Abort:  # what typer makes of a library that met the end of a file
        code = _complain("a file ended before it should; read or copy it again", 1)
    except typer.TyperException as error:  # usage
        code = _complain(
            f"{error.format_message().rstrip('.')}; asperity --help says what there is",
            error.exit_code,
        )
    except OSError as error:
        if error.filename is not None:
            raise
        code = _unheard(error)
    sys.exit(code)


def _complain(sentence: str, code: int) -> int:
    shown = printable(sentence)
    print(
        f"error: {shown if len(shown) <= LONGEST else f'{shown[: LONGEST - 3]}...'}",
        file=sys.stderr,
    )
    return code


def _unheard(error: OSError) -> int:
    """Say that standard output could not be written, and drop what is left for it."""
    sys.stdout = open(os.devnull, "w", encoding="utf-8")  # noqa: PTH123, SIM115 - for what exits write
    if isinstance(error, BrokenPipeError):  # whoever listened has heard enough
        return 1
    return _complain(
        f"the output could not be written: {error.strerror}; what --out names is whole", 1
    )


def _plain(error: UnicodeError) -> tuple[str, int]:
    """What a terminal without our signs shows in their place."""
    if not isinstance(error, UnicodeEncodeError):
        raise error
    signs = error.object[error.start : error.end]
    power = "^" if signs[0] in SUPERSCRIPTS else ""
    return power + "".join(PLAIN.get(sign) or _name(sign) for sign in signs), error.end


def _name(sign: str) -> str:
    """A Greek letter by its name, another sign by what it is made of."""
    known = unicodedata.name(sign, "")
    if known.startswith("GREEK SMALL LETTER"):
        return known.split()[-1].lower()
    return unicodedata.normalize("NFKD", sign).encode("ascii", "ignore").decode() or "?"


def _show_version(context: typer.Context, requested: bool) -> None:
    """Print the version and end before any other option is read, which would load what reads them."""
    if requested:
        print(f"asperity {asperity.__version__}")
        if "--verbose" in context.obj:
            from asperity.cli.version_info import about

            print(*about(), sep="\n")
        raise typer.Exit


@app.callback()
def _asperity(
    _version: Annotated[
        bool,
        typer.Option("--version", callback=_show_version, is_eager=True, help="Print the version."),
    ] = False,
    _verbose: Annotated[
        bool, typer.Option("--verbose", help="With --version: what a bug report needs to know.")
    ] = False,
) -> None:
    pass
