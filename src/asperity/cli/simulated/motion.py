"""`asperity run`: simulate the moving roughness of a case; resumable."""

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from asperity import report, simulation
from asperity.cli.app import app
from asperity.cli.options import (
    AsJson,
    OpenPage,
    OutFolder,
    Overrides,
    Page,
    Quiet,
    SurfaceFile,
    chosen_case,
)
from asperity.cli.output import Block, Row, progress, show, table, text, written
from asperity.cli.terminal.browser import open_page, require_page
from asperity.core.coverage import PERCENT
from asperity.core.errors import AsperityError, BadInput, NotConverged
from asperity.core.quantities import catalogue, quantity

if TYPE_CHECKING:
    from asperity.simulation import History, HistoryProgress


PathArgument = Annotated[
    Path, typer.Argument(metavar="CASE.toml", help="Case, with [motion] for how it moves.")
]
StepsOption = Annotated[
    int | None,
    typer.Option(metavar="N", help="Number of the last step (default: the case's)."),
]
PassesOption = Annotated[
    float | None,
    typer.Option(metavar="P", help="Passes of the rough surface's track, instead of --steps."),
]
EveryOption = Annotated[
    int | None,
    typer.Option(metavar="K", help="Save maps every K steps (default: about 40 in all)."),
]
KeepGoingOption = Annotated[
    bool,
    typer.Option("--keep-going", help="Mark steps that do not converge, and continue."),
]
ListenOption = Annotated[
    bool,
    typer.Option("--listen", help="Integrate the vibrating mass over the stored history."),
]


@app.command()
def run(
    path: PathArgument,
    steps: StepsOption = None,
    passes: PassesOption = None,
    surface: SurfaceFile = None,
    overrides: Overrides = None,
    out: OutFolder = None,
    every: EveryOption = None,
    keep_going: KeepGoingOption = False,
    listen: ListenOption = False,
    page: Page = None,
    opened: OpenPage = False,
    as_json: AsJson = False,
    quiet: Quiet = False,
) -> None:
    """Simulate the moving roughness step by step; resumable."""
    require_page(page, requested=opened)
    chosen = chosen_case(path, overrides, surface)
    if steps is not None and passes is not None:
        raise BadInput(
            f"--steps {steps} and --passes {passes:g} both set the length; leave one out"
        )
    failure = None
    try:
        with _steps_shown(path.name, quiet=quiet) as step:
            moved = simulation.run_history(
                chosen,
                steps=steps,
                passes=passes,
                out=out,
                every=every,
                strict=not keep_going,
                progress=step,
            )
    except NotConverged as unfinished:
        if not isinstance(unfinished.solution, simulation.History):  # the start failed
            raise
        moved = unfinished.solution
        failure = str(unfinished)
    vibration = simulation.history_vibration(moved) if listen and failure is None else None
    if page is not None:
        report.write_motion_report(moved, page, vibration=vibration)
    added = {} if vibration is None else vibration.scalars()
    show(
        moved.verdict(),
        lambda: {**moved.scalars(), **added, "report": None if page is None else str(page)},
        _history_table(moved),
        [] if vibration is None else [vibration.verdict()],
        _saved(moved, page),
        as_json=as_json,
        quiet=quiet,
    )
    open_page(page, requested=opened)
    if failure is not None:
        raise AsperityError(failure)


@contextmanager
def _steps_shown(label: str, *, quiet: bool) -> "Iterator[Callable[[HistoryProgress], None]]":
    """Show completed steps and the load share on a terminal."""
    clr = quantity("clr")
    with progress(label, "the start ...", quiet=quiet, compiles=True) as display:

        def step(state: "HistoryProgress") -> None:
            share = f"{clr.short} {clr.text(state.row['clr'])}"
            display(f"step {state.number} of {state.steps}, {share}", state.number, state.steps)

        yield step


def _saved(moved: "History", page: Path | None) -> Block:
    if moved.folder is not None:
        yield f"Saved in {moved.folder}; asperity run with the same folder resumes it"
    yield from written("Report", page)


def _means(values: Mapping[str, object]) -> Iterator[Row]:
    """Yield means with deviations over time and initial values, and the interval of friction."""
    for entry in catalogue().values():
        if f"{entry.key}_std" not in values or f"{entry.key}_start" not in values:
            continue
        mean = replace(entry, deviation=f"{entry.key}_std").text_in(
            {key: value for key, value in values.items() if key not in entry.ends}
        )
        yield entry.title, f"{mean} (start {entry.number(values[f'{entry.key}_start'])})"
        if entry.ends[0] in values:
            yield f"{entry.short}, {PERCENT} interval by the oil", entry.text_in(values)


def _history_table(moved: "History") -> Block:
    """Return means over the settled steps with their deviations, and initial values."""
    values = moved.scalars()
    motion = moved.case.motion
    yield from table(
        [
            ("steps", f"{moved.steps}, start {motion.start}"),
            ("computed by this call", f"{moved.computed} in {text('seconds', moved.seconds)}"),
            (quantity("step_s").title, text("step_s", values["step_s"])),
            ("time step over the oil's time per cell", f"{motion.time_step:g}"),
        ]
    )
    yield ""
    yield f"  Means and standard deviations from step {values['settled_from_step']} on:"
    rows = list(_means(values))
    passes = values.get("passes", [])
    for lap in passes[:: max(1, len(passes) - 1)]:
        selected = [quantity(key) for key in ("clr", "car", "track_sq_m")]
        rows.append(
            (
                f"pass {lap['pass']}",
                ", ".join(f"{entry.short} {entry.text_in(lap)}" for entry in selected),
            )
        )
    if values["crf_hz"] is not None:
        rows.append(
            (f"{quantity('crf_hz').short} of the mean contact", text("crf_hz", values["crf_hz"]))
        )
    yield from table(rows, moved.notes)
