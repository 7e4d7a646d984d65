"""`asperity stribeck` and `asperity traction`: friction over speed and slide-to-roll ratio."""

import csv
from collections.abc import Callable
from dataclasses import asdict
from io import StringIO
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from asperity import report, results
from asperity.cli.app import app
from asperity.cli.options import (
    AsJson,
    CaseOrRun,
    OutFiles,
    Overrides,
    Quiet,
    Roughness,
    StandingRoughness,
    chosen_case,
    require_output,
)
from asperity.cli.output import Block, columns, show, solver_progress, text, written
from asperity.core import files
from asperity.core.errors import AsperityError
from asperity.core.quantities import quantity

if TYPE_CHECKING:
    from asperity.case import Case
    from asperity.results import FrictionCurve, SolverProgress


@app.command()
def stribeck(
    path: CaseOrRun,
    speed: Annotated[
        list[float] | None,
        typer.Option(
            metavar="M/S",
            help="Entrainment speed (repeatable; default: 13 around the case's).",
        ),
    ] = None,
    sq: Roughness = None,
    overrides: Overrides = None,
    snapshot: StandingRoughness = False,
    out: OutFiles = None,
    as_json: AsJson = False,
    quiet: Quiet = False,
) -> None:
    """Compute friction over speed, up to full film."""

    def curve(chosen: "Case", step: "SolverProgress") -> "FrictionCurve":
        return results.stribeck_curve(chosen, speeds=speed, progress=step)

    _friction_command(
        curve, _cases(path, sq, overrides, snapshot=snapshot), out, as_json=as_json, quiet=quiet
    )


@app.command()
def traction(
    path: CaseOrRun,
    slip: Annotated[
        list[float] | None,
        typer.Option(
            metavar="RATIO",
            help="Slide-to-roll ratio (repeatable; default: 15 from 0 to 0.5).",
        ),
    ] = None,
    sq: Roughness = None,
    overrides: Overrides = None,
    snapshot: StandingRoughness = False,
    out: OutFiles = None,
    as_json: AsJson = False,
    quiet: Quiet = False,
) -> None:
    """Compute friction over the slide-to-roll ratio."""

    def curve(chosen: "Case", step: "SolverProgress") -> "FrictionCurve":
        return results.traction_curve(chosen, slips=slip, progress=step)

    _friction_command(
        curve, _cases(path, sq, overrides, snapshot=snapshot), out, as_json=as_json, quiet=quiet
    )


def _cases(
    path: Path, roughness: list[str] | None, overrides: list[str] | None, *, snapshot: bool
) -> "list[Case]":
    chosen = chosen_case(path, overrides, snapshot=snapshot)
    return [chosen.with_written({"surface.sq": sq}) for sq in roughness] if roughness else [chosen]


def _friction_command(
    curve: "Callable[[Case, SolverProgress], FrictionCurve]",
    cases: "list[Case]",
    out: list[Path] | None,
    *,
    as_json: bool,
    quiet: bool,
) -> None:
    for path in out or ():
        require_output(path, ".csv", ".png", ".pdf")
    curves = []
    for chosen in cases:
        label = f"{chosen.source}, Sq {text('sq_m', chosen.surface().sq)}"
        with solver_progress(label, quiet=quiet) as step:
            curves.append(curve(chosen, step))
    figures = [path for path in out or () if path.suffix.lower() != ".csv"]
    tables = [path for path in out or () if path not in figures]
    for path in figures:
        report.write_figure(report.friction_figure(curves), path)
    for path in tables:
        files.write_text(path, _points_csv(curves))
    verdicts = [drawn.verdict() for drawn in curves]
    hints = {drawn.hint() for drawn in curves} - {None}
    show(
        verdicts,
        lambda: {
            "verdict": " ".join(verdicts),
            "curves": [drawn.scalars() for drawn in curves],
            "figures": [str(path) for path in figures],
            "tables": [str(path) for path in tables],
        },
        *([f"  note: {hint}"] for hint in hints),
        written("Written", *figures, *tables),
        *(_points(drawn) for drawn in curves),
        as_json=as_json,
        quiet=quiet,
    )
    unfinished = sum(not point.converged for drawn in curves for point in drawn.points)
    if unfinished:
        raise AsperityError(f"not converged at {unfinished} marked points; do not use them")


def _points_csv(curves: "list[FrictionCurve]") -> str:
    """Return a csv row per point of all curves, in SI."""
    rows = [{"sq_m": curve.sq, **asdict(point)} for curve in curves for point in curve.points]
    buffer = StringIO()
    writer = csv.DictWriter(buffer, list(rows[0]), lineterminator="\n")
    writer.writeheader()
    writer.writerows({key: _shortest(value) for key, value in row.items()} for row in rows)
    return buffer.getvalue()


def _shortest(value: object) -> object:
    """Return a float without the rounding errors of its last digits."""
    return float(f"{value:.12g}") if isinstance(value, float) else value


def _points(curve: "FrictionCurve") -> Block:
    """Return a row per point, in the catalogue's units."""
    rows = [asdict(point) for point in curve.points]
    ends = [end for key in ("clr", "friction_coefficient") for end in quantity(key).ends]
    hidden = ("converged", "roughness", *ends)  # intervals stand beside their numbers
    selected = [quantity(key) for key in rows[0] if key not in hidden]
    yield f"  Sq {text('sq_m', curve.sq)}{', with thermal feedback' if curve.feedback else ''}"
    yield from columns(
        [*(entry.label for entry in selected), ""],
        (
            [
                *(entry.number_in(row) for entry in selected),
                row["roughness"] if row["converged"] else "NOT CONVERGED",
            ]
            for row in rows
        ),
    )
