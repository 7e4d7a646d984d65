"""What the commands share: cases from options, places to write to, progress, tables and JSON."""

import json
import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, nullcontext
from pathlib import Path
from typing import TYPE_CHECKING, Any

from asperity.errors import BadInput

if TYPE_CHECKING:
    from asperity.case import Case
    from asperity.ehl import Iteration
    from asperity.results import Run

SILENT_FOR = 2.0  # seconds without a step of the solver, after which its compilation is announced


def chosen_case(path: Path, surface: Path | None, overrides: list[str]) -> "Case":
    """The case of a case file or a run, with a measured surface and `--set KEY=VALUE` values put in."""
    from asperity.case import load_case, relative_path
    from asperity.results import load_run

    case = load_run(path).case if path.suffix == ".nc" else load_case(path)
    if surface is not None:
        if not surface.is_file():
            raise BadInput(f"--surface {surface} does not exist; check its name")
        case = case.with_overrides({"surface": {"file": relative_path(surface, case.folder)}})
    wanted = {}
    for override in overrides:
        key, equals, value = override.partition("=")
        if not (equals and key.strip() and value.strip()):
            raise BadInput(f"--set takes KEY=VALUE such as contact.load='400 N', got {override!r}")
        wanted[key.strip()] = value.strip()
    return case.with_overrides(wanted) if wanted else case


def read_option_length(name: str, text: str) -> float:
    """A length given as an option, such as `--pixel '1.6 um'` [m]."""
    from asperity.case import read_length

    return read_length(f"--{name.replace('_', '-')}", text)


def require_output(path: Path, suffix: str, option: str = "--out") -> None:
    """BadInput unless `path` ends in `suffix` and can be written to: asked before the work, not after."""
    from asperity.files import require_writable

    if path.suffix != suffix:
        raise BadInput(f"{option} must be a file that ends in {suffix}, got {path}")
    require_writable(path)


def write_text(path: Path, text: str) -> None:
    """Write a text file, whole or not at all."""
    from asperity.files import whole_file

    with whole_file(path) as part:
        part.write_text(text, "utf-8")


def save_report(runs: "Sequence[Run]", path: Path) -> None:
    """Write the HTML page of the runs."""
    from asperity.report import write_report

    write_report(runs, path)


def solve_shown(case: "Case", *, label: str, quiet: bool) -> "Run":
    """Solve a case with its steps shown; a run that did not converge comes back marked."""
    from asperity.results import solve_case

    case.surface()  # made or read here: it may take seconds, which are not the solver's
    with shown_progress(label, quiet=quiet) as report_step:
        return solve_case(case, progress=report_step, strict=False)


@contextmanager
def shown_progress(label: str, *, quiet: bool) -> "Iterator[Callable[[Iteration], None] | None]":
    """Show the solver's steps on a terminal; announce the compilation that makes the first solve ever slow."""
    if quiet:
        yield None
        return
    from rich.console import Console

    console = Console(stderr=True)
    announcement = threading.Timer(
        SILENT_FOR,
        console.print,
        [f"{label}: no step yet; the first solve after installation compiles the solver, up to a minute ..."],
        {"soft_wrap": True, "highlight": False},
    )
    announcement.daemon = True
    announcement.start()
    try:
        with console.status(f"{label}: setting up ...") if console.is_terminal else nullcontext() as status:

            def report_step(step: "Iteration") -> None:
                if step.number > 0:  # the start is known before all is compiled
                    announcement.cancel()
                if status is not None:
                    nx, ny = step.cells
                    status.update(f"{label}: {nx} x {ny} cells, step {step.number}, residual {step.residual:.1e}")

            yield report_step
    finally:
        announcement.cancel()


@contextmanager
def busy(text: str, *, quiet: bool) -> "Iterator[Callable[[str], None]]":
    """Show on a terminal what is being done; takes what is said of it."""
    from rich.console import Console

    console = Console(stderr=True)
    if quiet or not console.is_terminal:
        yield lambda _: None
        return
    with console.status(f"{text} ...") as status:
        yield lambda doing: status.update(f"{text}: {doing} ...")


def print_json(values: dict[str, Any]) -> None:
    """The one JSON object of `--json`; nan or infinity in it is a mistake of ours."""
    print(json.dumps(values, indent=2, allow_nan=False))


def with_error(scale: float, value: float, error: float | None, decimals: int) -> str:
    """A value times `scale`, with its error where one is known and shows."""
    shown = f"{scale * value:.{decimals}f}"
    known = error is not None and round(scale * error, decimals) > 0.0
    return f"{shown} ± {scale * (error or 0.0):.{decimals}f}" if known else shown


def print_rows(rows: Sequence[tuple[str, str]]) -> None:
    """Names and values in two columns."""
    width = max(len(name) for name, _ in rows)
    for name, value in rows:
        print(f"  {name:{width}}  {value}")
