"""`asperity benchmark`: compare a solver with certified values, and asperity with measurements."""

from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from asperity import benchmark as certified
from asperity import report
from asperity.cli.app import app
from asperity.cli.options import AsJson, OutFiles, Quiet, require_output
from asperity.cli.output import Block, columns, progress, show, written
from asperity.core.errors import BadInput

if TYPE_CHECKING:
    from asperity.benchmark import BenchmarkResult, ExperimentResult


class Against(StrEnum):
    """Values that a solver is compared with."""

    CERTIFIED = "certified"
    EXPERIMENT = "experiment"


@app.command()
def benchmark(
    solver: Annotated[
        str,
        typer.Option(
            metavar="NAME", help="asperity, tamaas, contactmechanics, or package.module:object."
        ),
    ] = "asperity",
    cells: Annotated[
        list[int] | None,
        typer.Option(metavar="N", help="Cells along x (repeatable; default: 64 and 128)."),
    ] = None,
    cases: Annotated[
        Path | None,
        typer.Option(metavar="DIR", help="Folder of cases (default: those of asperity)."),
    ] = None,
    against: Annotated[
        Against,
        typer.Option(help="Values to compare with; `experiment`: measured films and resonances."),
    ] = Against.CERTIFIED,
    out: OutFiles = None,
    as_json: AsJson = False,
    quiet: Quiet = False,
) -> None:
    """Compare a solver with certified or measured values."""
    for path in out or ():
        require_output(path, ".csv", ".png", ".pdf")
    if against is Against.EXPERIMENT:
        if cells or solver != "asperity":
            raise BadInput(
                "--against experiment compares asperity alone; leave out --solver and --cells"
            )
        _compare_with_experiments(cases, out or [], as_json=as_json, quiet=quiet)
        return
    chosen = certified.solver_named(solver)
    with progress(
        "benchmark", "solving ...", quiet=quiet, compiles=solver == "asperity"
    ) as display:
        result = certified.run_benchmark(
            chosen, folder=cases, cells=cells or (64, 128), progress=display
        )
    saved = [
        result.save(path)
        if path.suffix.lower() == ".csv"
        else report.write_figure(report.benchmark_figure(result), path)
        for path in out or ()
    ]
    show(
        result.verdict(),
        lambda: result.scalars() | {"written": [str(path) for path in saved]},
        _rows(result),
        [f"  left out: {case}: {reason}" for case, reason in result.left_out],
        written("Written", *saved) if saved else [],
        as_json=as_json,
        quiet=quiet,
    )


def _compare_with_experiments(
    folder: Path | None, out: list[Path], *, as_json: bool, quiet: bool
) -> None:
    with progress("benchmark", "solving ...", quiet=quiet, compiles=True) as display:
        result = certified.compare_experiments(folder=folder, progress=display)
    saved = [
        result.save(path)
        if path.suffix.lower() == ".csv"
        else report.write_figure(report.experiment_figure(result), path)
        for path in out
    ]
    show(
        result.verdict(),
        lambda: result.scalars() | {"written": [str(path) for path in saved]},
        _set_rows(result),
        _profile_rows(result),
        written("Written", *saved) if saved else [],
        as_json=as_json,
        quiet=quiet,
    )


def _set_rows(result: "ExperimentResult") -> Block:
    """Return a row per set of measurements."""
    rows = [
        [
            entry.experiment.title,
            str(len(entry.points)),
            f"{entry.mean:.3f}" if entry.fitted_viscosity is None else "1, fitted",
            f"{100.0 * entry.scatter:.1f}",
            f"{100.0 * entry.isothermal_scatter:.1f}",
            "" if (ends := entry.mean_interval) is None else f"{ends[0]:.2f} to {ends[1]:.2f}",
        ]
        for entry in result.comparisons
    ]
    heads = [
        "measurements",
        "points",
        "mean ratio",
        "scatter [%]",
        "isothermal [%]",
        "interval of the mean",
    ]
    yield from columns(heads, rows, left=1)


def _profile_rows(result: "ExperimentResult") -> Block:
    """Return a row per profile of a dimple; nothing without any."""
    rows = [
        [
            f"{entry.run}, profile {entry.number}",
            f"{100.0 * entry.from_measured:.1f}",
            f"{100.0 * entry.from_simulated:.1f}",
            f"{100.0 * entry.simulated_from_measured:.1f}",
            "" if (ratio := entry.upstream_ratio) is None else f"{ratio:.3f}",
        ]
        for entry in result.profiles
    ]
    heads = [
        "film over a dimple",
        "from the measured [%]",
        "from the simulated [%]",
        "simulated from measured [%]",
        "upstream ratio",
    ]
    if rows:
        yield from columns(heads, rows, left=1)


def _rows(result: "BenchmarkResult") -> Block:
    """Return a row per value on the finest grid."""
    finest = max((row.cells for row in result.rows), default=0)
    rows = [
        [
            row.case,
            row.quantity,
            f"{row.certified:.5g}",
            f"{row.found:.5g}",
            f"{100.0 * row.error:+.3f}",
            f"{100.0 * row.uncertainty / abs(row.certified):.2g}",
            f"{row.seconds:.2f}",
        ]
        for row in result.rows
        if row.cells == finest
    ]
    heads = [
        "case",
        "quantity",
        "certified",
        f"on {finest} cells",
        "error [%]",
        "uncertainty [%]",
        "time [s]",
    ]
    yield from columns(heads, rows, left=2)
