"""`asperity stribeck` and `asperity traction`: friction over speed and over the slide-to-roll ratio."""

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from asperity.cli.app import AsJson, Quiet, app
from asperity.cli.common import chosen_case, print_json, require_output, shown_progress
from asperity.errors import AsperityError

if TYPE_CHECKING:
    from asperity.case import Case
    from asperity.results import FrictionCurve, SolverProgress

CaseFile = Annotated[Path, typer.Argument(metavar="CASE.toml|RUN.nc", help="A case file, or a run.")]
Override = Annotated[
    list[str] | None,
    typer.Option("--set", metavar="KEY=VALUE", help="Replace a value of the case: thermal.feedback=true."),
]
Roughness = Annotated[
    list[str] | None, typer.Option("--sq", metavar="LENGTH", help="One curve for this roughness; may be repeated.")
]
Picture = Annotated[Path | None, typer.Option("--out", metavar="PNG", help="Draw the curves.")]


@app.command()
def stribeck(
    case: CaseFile,
    speed: Annotated[
        list[float] | None,
        typer.Option(metavar="M/S", help="An entrainment speed; may be repeated. By default 13 around the case's."),
    ] = None,
    sq: Roughness = None,
    override: Override = None,
    out: Picture = None,
    as_json: AsJson = False,
    quiet: Quiet = False,
) -> None:
    """Friction over speed, from boundary lubrication to full film."""
    from asperity.results import stribeck_curve

    def curve(chosen: "Case", progress: "SolverProgress | None") -> "FrictionCurve":
        return stribeck_curve(chosen, speeds=speed, progress=progress)

    _show(curve, _cases(case, sq, override), out, as_json=as_json, quiet=quiet)


@app.command()
def traction(
    case: CaseFile,
    slip: Annotated[
        list[float] | None,
        typer.Option(metavar="RATIO", help="A slide-to-roll ratio; may be repeated. By default 15 from 0 to 0.5."),
    ] = None,
    sq: Roughness = None,
    override: Override = None,
    out: Picture = None,
    as_json: AsJson = False,
    quiet: Quiet = False,
) -> None:
    """Friction over the slide-to-roll ratio, from pure rolling on."""
    from asperity.results import traction_curve

    def curve(chosen: "Case", progress: "SolverProgress | None") -> "FrictionCurve":
        return traction_curve(chosen, slips=slip, progress=progress)

    _show(curve, _cases(case, sq, override), out, as_json=as_json, quiet=quiet)


def _cases(path: Path, roughness: Sequence[str] | None, override: Sequence[str] | None) -> "list[Case]":
    case = chosen_case(path, None, list(override or []))
    return [case.with_overrides({"surface.sq": sq}) for sq in roughness] if roughness else [case]


def _show(
    curve: "Callable[[Case, SolverProgress | None], FrictionCurve]",
    cases: "Sequence[Case]",
    out: Path | None,
    *,
    as_json: bool,
    quiet: bool,
) -> None:
    if out is not None:
        require_output(out, ".png")
    curves = []
    for case in cases:
        with shown_progress(f"{case.source}, Sq {1e6 * case.surface().sq:.3g} um", quiet=quiet) as report_step:
            curves.append(curve(case, report_step))
    if out is not None:
        from asperity.report import friction_figure, write_figure

        write_figure(friction_figure(curves), out)
    if as_json:
        figures = [] if out is None else [str(out)]
        print_json(
            {
                "verdict": " ".join(found.verdict() for found in curves),
                "curves": [found.scalars() for found in curves],
                "figures": figures,
            }
        )
    else:
        for found in curves:
            print(found.verdict())
        if not quiet:
            for found in curves:
                _print_table(found)
            for hint in {found.hint() for found in curves} - {None}:
                print(f"\n  note: {hint}")
            if out is not None:
                print(f"\n  Figure: {out}")
    unfinished = sum(not point.converged for found in curves for point in found.points)
    if unfinished:
        raise AsperityError(f"not converged at {unfinished} points, which are marked; do not use them")


def _print_table(curve: "FrictionCurve") -> None:
    print(f"\n  Sq {1e6 * curve.sq:.3g} um{', heat fed back' if curve.feedback else ''}")
    print("   u [m/s]  slip [%]  friction  asperities     oil   CLR [%]  film [um]  lambda  surface [K]  film [K]")
    for point in curve.points:
        ratio = "-" if point.lambda_ratio is None else f"{point.lambda_ratio:.3f}"
        print(
            f"  {point.entrainment_speed_m_s:8.4g}  {100 * point.slide_to_roll:8.4g}  {point.friction_coefficient:8.4f}"
            f"  {point.asperity_part:10.4f}  {point.oil_part:6.4f}  {100 * point.clr:8.2f}  {1e6 * point.h_mean_m:9.3f}"
            f"  {ratio:>6}  {point.flash_temperature_max_k:11.2f}  {point.film_temperature_max_k:8.2f}"
            + ("" if point.converged else "  NOT CONVERGED")
        )
