"""Output of commands: a verdict with tables and notes, or one JSON object; and progress."""

import json
import sys
import threading
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager, nullcontext
from pathlib import Path
from textwrap import wrap
from typing import TYPE_CHECKING, Protocol

from asperity.cli.options import with_options
from asperity.core.documents import Table
from asperity.core.quantities import catalogue, quantity, select
from asperity.core.third_party import printable

if TYPE_CHECKING:
    from asperity.ehl import Iteration

NOTICE_DELAY_S = 2.0  # without a solver step, after which compilation is announced
TITLE = 12  # characters of a column's title, above which it is wrapped

Block = Iterable[str]  # lines, evaluated only when printed
Row = tuple[str, str]


def show(
    verdict: str | Sequence[str],
    values: Callable[[], Table],
    *blocks: Block,
    as_json: bool,
    quiet: bool,
    a_line: bool = False,
) -> None:
    """Print the values as one JSON object, or verdicts and, unless quiet, blocks after empty lines.

    `a_line` prints the object on one line and flushes it, for a command that prints one after
    another. Nan or infinity in the object is an internal error.
    """
    if as_json:
        print(json.dumps(values(), indent=None if a_line else 2, allow_nan=False), flush=a_line)
        return
    for sentence in [verdict] if isinstance(verdict, str) else verdict:
        print(printable(with_options(sentence)), flush=a_line)
    if quiet:
        return
    for block in blocks:
        for number, line in enumerate(block):
            print("" if number else "\n", printable(with_options(line)), sep="", flush=a_line)


def table(rows: Iterable[Row], notes: Iterable[str] = ()) -> Block:
    """Format names and values in two columns, with notes below."""
    pairs = list(rows)
    width = max((len(name) for name, _ in pairs), default=0)
    yield from (f"  {name:{width}}  {value}" for name, value in pairs)
    yield from (f"  note: {note}" for note in notes)


def columns(titles: Sequence[str], rows: Iterable[Sequence[str]], *, left: int = 0) -> Block:
    """Format a table; the first `left` columns and untitled ones are flush left."""
    cells = [list(row) for row in rows]
    widths = [max(map(len, column), default=1) for column in zip(*cells, strict=True)] or [1] * len(
        titles
    )
    headings = [wrap(title, max(TITLE, width)) for title, width in zip(titles, widths, strict=True)]
    widths = [
        max(width, *map(len, heading), 1) for width, heading in zip(widths, headings, strict=True)
    ]
    height = max(map(len, headings))
    stacked = zip(*([""] * (height - len(heading)) + heading for heading in headings), strict=True)
    for line in (*stacked, *cells):
        aligned = (
            f"{cell:<{width}}" if number < left or not title else f"{cell:>{width}}"
            for number, (title, cell, width) in enumerate(zip(titles, line, widths, strict=True))
        )
        yield f"  {'  '.join(aligned)}".rstrip()


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


class Display(Protocol):
    """Progress display: a text, and a number of completed items of a total."""

    def __call__(self, doing: str, done: int | None = None, total: int | None = None) -> None:
        """Update the display."""


@contextmanager
def progress(
    label: str, doing: str = "", *, quiet: bool, compiles: bool = False
) -> Iterator[Display]:
    """Show progress on a terminal.

    With `compiles`, the compilation at the first solve after installation is announced after a
    delay, also if stderr is not a terminal.
    """
    if quiet or not (compiles or sys.stderr.isatty()):
        yield _unseen
        return
    label = printable(label)
    notice = (
        f"{label}: no iteration yet; the first solve after installation compiles the solver, "
        "up to a minute ..."
    )
    if not sys.stderr.isatty():
        announcement = threading.Timer(
            NOTICE_DELAY_S, print, [notice], {"file": sys.stderr, "flush": True}
        )
        with _announced(announcement):
            yield lambda *_, **__: announcement.cancel()
        return
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

    console = Console(stderr=True)
    announcement = threading.Timer(
        NOTICE_DELAY_S, console.print, [notice], {"soft_wrap": True, "highlight": False}
    )
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
    with _announced(announcement) if compiles else nullcontext(), bar:
        task = bar.add_task(label, total=None, doing=doing)

        def show_progress(doing: str, done: int | None = None, total: int | None = None) -> None:
            announcement.cancel()
            bar.update(task, doing=doing, completed=done, total=total)

        yield show_progress


@contextmanager
def _announced(announcement: threading.Timer) -> Iterator[None]:
    """Run the announcement unless it is cancelled or the work ends."""
    announcement.daemon = True
    announcement.start()
    try:
        yield
    finally:
        announcement.cancel()


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
