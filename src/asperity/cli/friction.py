"""`asperity stribeck` and `asperity traction`: friction over speed and slide-to-roll ratio."""

from collections.abc import Callable
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from asperity import report, results
from asperity.cli.app import app
from asperity.cli.options import (
    AsJson,
    CaseOrRun,
    OutPicture,
    Overrides,
    Quiet,
    Roughness,
    StandingRoughness,
    chosen_case,
    require_output,
)
from asperity.cli.output import Block, columns, show, solver_progress, text, written
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
    out: OutPicture = None,
    as_json: AsJson = False,
    quiet: Quiet = False,
) -> None:
    """Compute friction over speed, from boundary lubrication to full film."""

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
    out: OutPicture = None,
    as_json: AsJson = False,
    quiet: Quiet = False,
) -> None:
    """Compute friction over the slide-to-roll ratio, from pure rolling."""

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
    out: Path | None,
    *,
    as_json: bool,
    quiet: bool,
) -> None:
    require_output(out, ".png")
    curves = []
    for chosen in cases:
        label = f"{chosen.source}, Sq {text('sq_m', chosen.surface().sq)}"
        with solver_progress(label, quiet=quiet) as step:
            curves.append(curve(chosen, step))
    if out is not None:
        report.write_figure(report.friction_figure(curves), out)
    verdicts = [drawn.verdict() for drawn in curves]
    hints = {drawn.hint() for drawn in curves} - {None}
    show(
        verdicts,
        lambda: {
            "verdict": " ".join(verdicts),
            "curves": [drawn.scalars() for drawn in curves],
            "figures": [] if out is None else [str(out)],
        },
        *([f"  note: {hint}"] for hint in hints),
        written("  Figure", out),
        *(_points(drawn) for drawn in curves),
        as_json=as_json,
        quiet=quiet,
    )
    unfinished = sum(not point.converged for drawn in curves for point in drawn.points)
    if unfinished:
        raise AsperityError(f"not converged at {unfinished} marked points; do not use them")


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
