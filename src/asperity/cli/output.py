"""Output of commands: a verdict with tables and notes, or one JSON object; and progress."""

import json
import re
import sys
import threading
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from time import monotonic
from typing import TYPE_CHECKING, Protocol

from asperity.cli.options import with_options
from asperity.cli.terminal.layout import fitted, layout, terminal_width
from asperity.core.documents import Table
from asperity.core.quantities import catalogue, quantity, select
from asperity.core.third_party import printable

if TYPE_CHECKING:
    from asperity.ehl import Iteration

FIRST_LINE_S, MAX_LINE_DELAY_S = 5.0, 600.0  # between lines of progress without a terminal

# the u of a unit, except in a quoted value
MICRO = re.compile(r"(?:(?<=\d )|(?<=per ))u(?=[ms]\b(?![\"']))")

Block = Iterable[str]  # lines, evaluated only when printed
Row = tuple[str, str]


_pending: dict[str, object] = {}  # the JSON object of the command, until it ends


def show(
    verdict: str | Sequence[str],
    values: Callable[[], Table],
    *blocks: Block,
    as_json: bool,
    quiet: bool,
    a_line: bool = False,
) -> None:
    """Take the values as the JSON object, or print verdicts and, unless quiet, blocks of lines.

    An empty line precedes each block. `print_object` prints the object when the command ends.
    `a_line` prints it at once, on one line, for a command that prints one after another.
    """
    sentences = [verdict] if isinstance(verdict, str) else verdict
    if as_json:
        taken = {"verdict": " ".join(map(with_options, sentences)), **values()}
        taken["verdict"] = MICRO.sub("µ", str(taken["verdict"]))  # as it is printed
        if a_line:
            print(_json(taken, indent=None), flush=True)
        else:
            _pending.update(taken)
        return
    for sentence in sentences:
        print_line(sentence, flush=a_line)
    if quiet:
        return
    for block in blocks:
        for number, line in enumerate(block):
            if not number:
                print(flush=a_line)
            print_line(line, flush=a_line)


def print_line(line: str, *, flush: bool = False) -> None:
    """Print a line, continued on further lines where it is wider than the terminal."""
    for part in fitted(MICRO.sub("µ", printable(with_options(line))), terminal_width()):
        print(part, flush=flush)


def discard_object() -> None:
    """Forget the JSON object of an earlier command of this process."""
    _pending.clear()


def print_object(error: Mapping[str, object]) -> None:
    """Print the command's JSON object, completed by its error; nothing without either."""
    if _pending or error:
        print(_json({**_pending, **error}, indent=2))
    discard_object()


def _json(values: Mapping[str, object], *, indent: int | None) -> str:
    """Return the text of an object; nan or infinity in it is an internal error."""
    return json.dumps(values, indent=indent, allow_nan=False)


def table(rows: Iterable[Row], notes: Iterable[str] = ()) -> Block:
    """Format names and values in two columns, with notes below."""
    pairs = list(rows)
    width = max((len(name) for name, _ in pairs), default=0)
    yield from (f"  {name:{width}}  {value}" for name, value in pairs)
    yield from (f"  note: {note}" for note in notes)


def columns(titles: Sequence[str], rows: Iterable[Sequence[str]], *, left: int = 0) -> Block:
    """Format a table; the first `left` columns and untitled ones are flush left."""
    yield from layout(titles, [list(row) for row in rows], left=left, width=terminal_width())


def known_rows(values: Table, *groups: str) -> list[Row]:
    """Return the numbers of `values` that the catalogue shows, of some of its groups or of all."""
    groups = groups or tuple({entry.group for entry in catalogue().values()})
    return [
        (entry.title, entry.text_in(values)) for entry in select(*groups) if entry.key in values
    ]


def text(key: str, value: float | str | None) -> str:
    """Return a value as the catalogue shows it, with its unit."""
    return quantity(key).text(value)


def span(key: str, limits: Sequence[float]) -> str:
    """Return a range of a quantity, with its unit."""
    low, high = limits
    return f"{quantity(key).number(low)} to {text(key, high)}"


def written(name: str, *paths: Path | None) -> Block:
    """Return the paths of written files by name; none for None."""
    return [f"{name}: {path}" for path in paths if path is not None]


def named_path(key: str, path: Path | None) -> dict[str, str]:
    """Return a written path for `--json`; nothing for None."""
    return {} if path is None else {key: str(path)}


class Display(Protocol):
    """Progress display: a text, and a number of completed items of a total."""

    def __call__(self, doing: str, done: int | None = None, total: int | None = None) -> None:
        """Update the display."""


@contextmanager
def _log(label: str, doing: str) -> Iterator[Display]:
    """Show progress as lines of a log."""
    start_s = monotonic()
    ended = threading.Event()
    state = doing or "working ..."

    def print_lines() -> None:
        delay_s = FIRST_LINE_S
        while not ended.wait(delay_s):
            elapsed = f"{monotonic() - start_s:.0f} s so far"
            print(f"{label}: {state} ({elapsed})", file=sys.stderr, flush=True)
            delay_s = min(2.0 * delay_s, MAX_LINE_DELAY_S)

    def take(doing: str, *_: object, **__: object) -> None:
        nonlocal state
        state = doing

    threading.Thread(target=print_lines, daemon=True).start()
    try:
        yield take
    finally:
        ended.set()


@contextmanager
def progress(
    label: str, doing: str = "", *, quiet: bool, compiles: bool = False, log: bool = True
) -> Iterator[Display]:
    """Show progress on a terminal, otherwise (with `log`) as lines at growing intervals.

    With `compiles`, the solver is compiled first, if it is the first solve after installation.
    """
    with _shown(label, doing, quiet=quiet, log=log) as display:
        if compiles:
            from asperity.kernels.ahead import compile_ahead

            compile_ahead(partial(display, "compiling the solver, once after installation ..."))
        yield display


@contextmanager
def _shown(label: str, doing: str, *, quiet: bool, log: bool) -> Iterator[Display]:
    terminal = sys.stderr.isatty()
    if quiet or not (terminal or log):
        yield _unseen
        return
    label = printable(label)
    if not terminal:
        with _log(label, doing) as display:
            yield display
        return
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

    console = Console(stderr=True)
    label_column, doing_column = (
        TextColumn(f"{{task.{name}}}", markup=False) for name in ("description", "fields[doing]")
    )
    bar = Progress(
        *(label_column, BarColumn(20), doing_column, TimeElapsedColumn()),
        console=console,
        transient=True,
        disable=not console.is_terminal,  # such as with TERM=dumb
        redirect_stdout=sys.stdout.isatty(),  # output to a file must not be captured
    )
    with bar:
        task = bar.add_task(label, total=None, doing=doing)

        def show_progress(doing: str, done: int | None = None, total: int | None = None) -> None:
            bar.update(task, doing=doing, completed=done, total=total)

        yield show_progress


def _unseen(doing: str, done: int | None = None, total: int | None = None) -> None:
    """Ignore progress."""


class SolverSteps:
    """Progress of the solver's iterations, and of completed surfaces."""

    def __init__(self, display: Display) -> None:
        self.display = display
        self.done: int | None = None
        self.total: int | None = None

    def step(self, iteration: "Iteration") -> None:
        """Show a Newton iteration; not the start, which precedes compilation."""
        if iteration.number > 0:
            nx, ny = iteration.cells
            text = f"{nx} x {ny} cells, step {iteration.number}, residual {iteration.residual:.1e}"
            self.display(text, self.done, self.total)

    def surface(self, done: int, total: int) -> None:
        """Show a completed surface."""
        self.done, self.total = done, total
        self.display(f"{done} of {total} surfaces", done, total)

    def time_step(self, done: int, total: int) -> None:
        """Show a time step of a running contact."""
        self.display(f"time step {done} of {total}", done, total)


@contextmanager
def solver_progress(label: str, *, quiet: bool) -> "Iterator[Callable[[Iteration], None]]":
    """Show the solver's iterations."""
    with progress(label, "setting up ...", quiet=quiet, compiles=True) as display:
        yield SolverSteps(display).step
