"""`asperity demo` and `asperity solve`: single contacts, from case file to numbers."""

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from asperity import case, paper, report, results
from asperity.cli.app import app
from asperity.cli.options import (
    Accuracy,
    AsJson,
    CaseOrRun,
    OpenPage,
    Overrides,
    Quiet,
    StandingRoughness,
    SurfaceFile,
    chosen_case,
    require_output,
)
from asperity.cli.output import Block, Row, SolverSteps, known_rows, progress, show, table, text
from asperity.cli.terminal.browser import open_page
from asperity.core import files, processes
from asperity.core.coverage import PERCENT
from asperity.core.documents import Table
from asperity.core.errors import AsperityError
from asperity.core.quantities import mark_rolling, quantity

if TYPE_CHECKING:
    from asperity.case import Case
    from asperity.results import Run

DEMO_SQ = ("0.5 um", "1.5 um", "3 um")
MAIN = (  # quantities that `solve` prints without --all
    *("clr", "car", "sq_m", "h_min_m", "h_mean_m", "lambda_ratio", "p_max_pa"),
    *("friction_coefficient", "flash_temperature_max_k", "von_mises_max_pa", "crf_hz", "crfa"),
)
CONVERGENCE = ("converged", "iterations")  # stated by the row of the solver
INTERVAL = f", {PERCENT} interval"  # of a number whose own row states it


@app.command()
def demo(
    out: Annotated[Path, typer.Option(help="Folder for the case, the runs and the report.")] = Path(
        "asperity-demo"
    ),
    opened: OpenPage = False,
    as_json: AsJson = False,
    quiet: Quiet = False,
) -> None:
    """Solve the paper's contact at three roughness levels."""
    files.make_folder(out)
    case_file = out / "paper.toml"
    page = out / "report.html"
    files.write_text(case_file, paper.papers_text())
    chosen = case.load_case(case_file)
    runs = {}
    for sq in DEMO_SQ:
        runs[sq] = _solve(chosen.with_written({"surface.sq": sq}), label=f"Sq {sq}", quiet=quiet)
        runs[sq].save(out / f"run-sq-{sq.replace(' ', '')}.nc")
    report.write_report(list(runs.values()), page)
    verdict = results.levels_verdict(runs)
    show(
        verdict,
        lambda: {
            "verdict": verdict,
            "report": str(page),
            "runs": [run.summary() for run in runs.values()],
        },
        table((f"Sq {sq}", run.verdict()) for sq, run in runs.items()),
        [f"Report: {page}", f"Try next: asperity solve {case_file} --set contact.load='400 N'"],
        as_json=as_json,
        quiet=quiet,
    )
    open_page(page, requested=opened)
    unfinished = results.not_converged(runs)
    if unfinished:
        raise AsperityError(
            f"not converged at Sq {', '.join(unfinished)}; the unfinished states are in {out}"
        )


SurfacesOption = Annotated[
    int | None,
    typer.Option(
        metavar="N",
        min=1,
        help="Surfaces to average (default: 5; fine grids: 3), or running tracks "
        "(default: 1; measured: 3).",
    ),
]
DynamicOption = Annotated[
    bool, typer.Option("--dynamic", help="Compute frequency-dependent stiffness and damping.")
]
RunOption = Annotated[
    Path | None, typer.Option(metavar="RUN.nc", help="File for the run, with its case.")
]
EverythingOption = Annotated[
    bool, typer.Option("--all", help="Print all quantities and the notes in full.")
]


@app.command()
def solve(
    path: CaseOrRun,
    surface: SurfaceFile = None,
    overrides: Overrides = None,
    surfaces: SurfacesOption = None,
    accuracy: Accuracy = None,
    snapshot: StandingRoughness = False,
    dynamic: DynamicOption = False,
    out: RunOption = None,
    everything: EverythingOption = False,
    as_json: AsJson = False,
    quiet: Quiet = False,
) -> None:
    """Solve one contact: film, load sharing, contact resonance."""
    require_output(out, ".nc")
    chosen = chosen_case(path, overrides, surface, accuracy, snapshot=snapshot)
    if surfaces is not None:
        chosen = chosen.with_written({"solver.surfaces": surfaces})
    if dynamic and not chosen.contents.solver.dynamic:
        chosen = chosen.with_written({"solver.dynamic": results.FREQUENCIES})
    displayed = () if quiet else results.SHORT_GROUPS
    groups = displayed if out is None and not as_json else results.RUN_GROUPS
    run = _solve(chosen, label=path.name, quiet=quiet, surfaces=None, groups=groups)
    if out is not None:
        run.save(out)
    saved = [] if out is None else [f"Saved in {out}; asperity report {out} writes a page of it"]
    rows = run_table(run) if everything else short_table(run)
    show(run.verdict(), run.summary, rows, saved, as_json=as_json, quiet=quiet)
    if not run.converged:
        location = f"; the unfinished state is in {out}" if out is not None else ""
        raise AsperityError(f"not converged: {run.convergence_text}{location}")


def _solve(
    chosen: "Case",
    *,
    label: str,
    quiet: bool,
    surfaces: int | None = 1,
    groups: tuple[str, ...] | None = None,
) -> "Run":
    """Solve a case; the run is marked if it did not converge."""
    chosen.surface()  # before the progress display of the solver
    with progress(label, "setting up ...", quiet=quiet, compiles=True) as display:
        steps = SolverSteps(display)
        return results.solve_case(
            chosen,
            surfaces=surfaces,
            workers=processes.cores(),
            progress=steps.step,
            surface_progress=steps.time_step if chosen.is_running else steps.surface,
            strict=False,
            groups=results.RUN_GROUPS if groups is None else groups,
        )


def short_table(run: "Run") -> Block:
    """Return the main numbers of a run, and the first sentence of each note."""
    values = _printed(run)
    main = [quantity(key) for key in MAIN if values.get(key) is not None]
    rows = [(entry.title, entry.text_in(values)) for entry in main]
    notes = [f"{note.partition('. ')[0].rstrip('.')}." for note in _notes(run)]
    yield from table(rows, notes)
    yield "  --all prints all quantities, the parts of the intervals and the notes in full."


def _printed(run: "Run") -> Table:
    """Return the numbers of a run; of pure rolling, a text in place of friction and heat."""
    rolling = run.solution.conditions.sliding_speed == 0.0
    return mark_rolling(run.scalars(), rolling=rolling)


def _notes(run: "Run") -> list[str]:
    failure = [] if run.friction_failure is None else [f"no friction: {run.friction_failure}"]
    return [*run.remarks, *failure]


def _numbers(run: "Run") -> Iterator[Row]:
    """Yield the numbers of the catalogue; the central film of standing roughness is one spot.

    The solver's steps have a row of their own.
    """
    central = quantity("h_central_m").title
    spot = run.running is None and run.state.sq > 0.0 and run.solution.lubricant is not None
    values = {key: value for key, value in _printed(run).items() if key not in CONVERGENCE}
    for title, value in known_rows(values):
        yield (
            title,
            f"{value}, at one spot of the roughness" if spot and title == central else value,
        )


def run_table(run: "Run") -> Block:
    """Return the rows of a run: numbers of the catalogue, solver status, and notes."""
    touching = 0.0 if run.solution.lubricant is None else run.solution.options.contact_film
    rows = [
        *_numbers(run),
        *(
            row
            for row in results.uncertainty_rows(run.error, run.friction_interval)
            if not row[0].endswith(INTERVAL)
        ),
        (quantity("contact_film_m").title, text("contact_film_m", touching)),
        ("cells", " x ".join(map(str, run.solution.grid.cells))),
        *run.card.rows(),
        ("solver", run.convergence_text),
    ]
    yield from table(rows, _notes(run))
