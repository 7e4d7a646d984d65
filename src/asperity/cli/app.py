"""Application: creates the command line and converts errors to exit codes."""

import codecs
import os
import sys
import unicodedata
from collections.abc import Sequence
from io import TextIOWrapper
from typing import Annotated, TextIO

import typer

import asperity
from asperity.cli import output
from asperity.cli.options import with_options
from asperity.cli.terminal.groups import GroupedCommands
from asperity.core import quantities
from asperity.core.errors import AsperityError, BadInput
from asperity.core.processes import tune_memory_use
from asperity.core.third_party import printable

INTERRUPTED = 130  # typer's exit code for Ctrl-C
MAX_ERROR = 480  # characters of an error message
SUPERSCRIPTS = {chr(high): chr(low) for low, high in quantities.SUPERSCRIPTS.items()}
PLAIN = {"µ": "u", "−": "-", "–": "-", "±": "+-", "×": "x", "Λ": "lambda", "′": "'", **SUPERSCRIPTS}
PAGES = {  # how the page of a command without --report is written
    "solve": "; save the run with --out RUN.nc, then asperity report RUN.nc writes a page",
    "machine": "; --out DIR writes the result and its page",
    "demo": "; the page is always written, to the folder of --out DIR",
}

app = typer.Typer(
    cls=GroupedCommands,
    subcommand_metavar="COMMAND [ARGS]",
    help="Mixed lubrication, wear and vibration of rough contacts, and their condition monitoring.",
    epilog="Exit codes: 0 done, 2 bad input or usage, 1 anything else; of track and watch: "
    "3 alarm, 4 cannot tell, 5 sensor or machine off.",
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
)


def main(arguments: Sequence[str] | None = None) -> None:
    """Run a command and exit with its code; errors are one line on stderr."""
    tune_memory_use()
    codecs.register_error("plain", _plain)
    # a daemon may start with closed streams
    sys.stdout, sys.stderr = sys.stdout or _no_output(), sys.stderr or _no_output()
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, TextIOWrapper):
            stream.reconfigure(errors="plain")
    given_arguments = sys.argv[1:] if arguments is None else list(arguments)
    as_json = "--json" in given_arguments
    try:
        code = _run(given_arguments or ["--help"], as_json=as_json)
        sys.stdout.flush()
    except OSError as error:
        if error.filename is not None:
            raise
        code = _output_failed(error)
    sys.exit(code if given_arguments else 2)  # without a command, its list is shown


def _no_output() -> TextIO:
    return open(os.devnull, "w", encoding="utf-8")  # noqa: PTH123


def _run(arguments: list[str], *, as_json: bool) -> int:
    """Run a command and print its JSON object, with the error if there is one; return its code."""
    output.discard_object()
    code, sentence = _outcome(arguments)
    error = None if sentence is None else _shortened(sentence)
    if error is not None:
        print(f"error: {error}", file=sys.stderr)
    output.print_object(
        {"error": {"message": error, "exit_code": code}} if as_json and error is not None else {}
    )
    return code


def _outcome(arguments: list[str]) -> tuple[int, str | None]:
    """Run a command; return its exit code, and the sentence of its error if it failed."""
    try:
        code = app(args=arguments, prog_name="asperity", standalone_mode=False, obj=arguments)
    except BadInput as error:
        return 2, with_options(str(error))
    except AsperityError as error:
        return 1, with_options(str(error))
    except typer.Abort:  # raised by typer for an end of file in a library
        return 1, "a file ended unexpectedly; read or copy it again"
    except typer.TyperException as error:  # usage
        context = getattr(error, "ctx", None)
        command = "asperity" if context is None else context.command_path
        sentence = error.format_message().rstrip(".")
        if getattr(error, "option_name", None) == "--report":
            sentence += PAGES.get(command.rpartition(" ")[2], "")
        see = " See" if sentence.endswith("?") else "; see"
        return error.exit_code, f"{sentence}{see} {command} --help"
    if code == INTERRUPTED:
        return 1, "interrupted; no partial files were left"
    return int(code or 0), None


def _shortened(sentence: str) -> str:
    """Return a message of at most `MAX_ERROR` printable characters."""
    text = printable(sentence)
    return text if len(text) <= MAX_ERROR else f"{text[: MAX_ERROR - 3]}..."


def _output_failed(error: OSError) -> int:
    """Report that standard output could not be written, and discard further output."""
    sys.stdout = _no_output()  # for exit handlers
    if isinstance(error, BrokenPipeError):  # the reader closed the pipe
        return 1
    sentence = f"the output could not be written: {error.strerror}; files of --out are complete"
    print(f"error: {sentence}", file=sys.stderr)
    return 1


def _plain(error: UnicodeError) -> tuple[str, int]:
    """Replace characters that the terminal's encoding lacks."""
    if not isinstance(error, UnicodeEncodeError):
        raise error
    signs = error.object[error.start : error.end]
    power = "^" if signs[0] in SUPERSCRIPTS else ""
    return power + "".join(PLAIN.get(sign) or _name(sign) for sign in signs), error.end


def _name(sign: str) -> str:
    """Return the name of a Greek letter, or the decomposition of another character."""
    unicode_name = unicodedata.name(sign, "")
    if unicode_name.startswith("GREEK SMALL LETTER"):
        return unicode_name.split()[-1].lower()
    return unicodedata.normalize("NFKD", sign).encode("ascii", "ignore").decode() or "?"


def _show_version(context: typer.Context, requested: bool) -> None:
    """Print the version and exit before other options load their modules."""
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
        bool, typer.Option("--verbose", help="With --version: details for bug reports.")
    ] = False,
) -> None:
    pass
