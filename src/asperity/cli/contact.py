"""`asperity demo`, `solve` and `report`: contacts from case file to page."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from asperity.cli.app import AsJson, Quiet, app
from asperity.cli.common import (
    busy,
    chosen_case,
    print_json,
    print_rows,
    require_output,
    save_report,
    solve_shown,
    with_error,
    write_text,
)
from asperity.errors import AsperityError, BadInput
from asperity.files import make_folder

if TYPE_CHECKING:
    from asperity.results import Run

DEMO_SQ = ("0.5 um", "1.5 um", "3 um")


@app.command()
def demo(
    out: Annotated[Path, typer.Option(help="Folder for the case, the runs and the report.")] = Path("asperity-demo"),
    as_json: AsJson = False,
    quiet: Quiet = False,
) -> None:
    """Solve the paper's contact at a few roughness levels, from case file to report."""
    from importlib.resources import files

    from asperity.case import load_case

    make_folder(out)
    case_file, report_file = out / "paper.toml", out / "report.html"
    write_text(case_file, files("asperity.paper").joinpath("paper.toml").read_text("utf-8"))
    case = load_case(case_file)
    runs = []
    for sq in DEMO_SQ:
        run = solve_shown(case.with_overrides({"surface.sq": sq}), label=f"Sq {sq}", quiet=quiet)
        run.save(out / f"run-sq-{sq.replace(' ', '')}.nc")
        runs.append(run)
    save_report(runs, report_file)
    first, last = runs[0], runs[-1]
    less, more = (f"{100 * run.state.clr:.0f} %" for run in (first, last))
    at_last = last.resonance_in_words().removeprefix("contact resonance ")
    verdict = (
        f"From Sq {DEMO_SQ[0]} to {DEMO_SQ[-1]} the asperities' share of the load goes from {less} to {more}: "
        f"{first.resonance_in_words()} at first, {at_last} at last."
    )
    unfinished = [sq for sq, run in zip(DEMO_SQ, runs, strict=True) if not run.solution.convergence.converged]
    if unfinished:
        verdict = f"NOT CONVERGED at Sq {', '.join(unfinished)}, do not use: {verdict}"
    if as_json:
        print_json({"verdict": verdict, "report": str(report_file), "runs": [run.scalars() for run in runs]})
    else:
        print(verdict)
        if not quiet:
            print()
            for sq, run in zip(DEMO_SQ, runs, strict=True):
                print(f"  Sq {sq:7}{run.verdict()}")
            print()
            print(f"Report: {report_file}")
            print(f"Try next: asperity solve {case_file} --set contact.load='400 N'")
    if unfinished:
        raise AsperityError(f"not converged at Sq {', '.join(unfinished)}; the unfinished states are in {out}")


@app.command()
def solve(
    case: Annotated[Path, typer.Argument(metavar="CASE.toml|RUN.nc", help="A case file, or a run to solve again.")],
    surface: Annotated[
        Path | None, typer.Option(metavar="FILE", help="A measured surface in place of the case's own.")
    ] = None,
    override: Annotated[
        list[str] | None,
        typer.Option("--set", metavar="KEY=VALUE", help="Replace a value of the case: contact.load='400 N'."),
    ] = None,
    out: Annotated[Path | None, typer.Option(metavar="RUN.nc", help="Keep the run, with its case.")] = None,
    as_json: AsJson = False,
    quiet: Quiet = False,
) -> None:
    """Solve one contact: film, load sharing, contact resonance."""
    if out is not None:
        require_output(out, ".nc")
    run = solve_shown(chosen_case(case, surface, override or []), label=case.name, quiet=quiet)
    if out is not None:
        run.save(out)
    if as_json:
        print_json(run.scalars())
    else:
        print(run.verdict())
        if not quiet:
            _print_run(run)
            if out is not None:
                print(f"\nKept in {out}; asperity report {out} makes a page of it")
    if not run.solution.convergence.converged:
        where = f"; the unfinished state is in {out}" if out is not None else ""
        raise AsperityError(f"not converged: {run.solution.convergence.explain()}{where}")


@app.command()
def report(
    runs: Annotated[
        list[Path],
        typer.Argument(
            metavar="RUN...|DIR", help="Runs kept by asperity solve --out, or the folder of a study or history."
        ),
    ],
    out: Annotated[
        Path | None, typer.Option(metavar="OUT.html", help="The page; by default beside the run, or in the study.")
    ] = None,
    figures: Annotated[
        Path | None,
        typer.Option(metavar="DIR", help="Of a study: write its figures as PDF and PNG and its tables as csv too."),
    ] = None,
    anchors: Annotated[
        Path | None, typer.Option(metavar="FILE.toml", help="Of a study: numbers that it should meet, not the paper's.")
    ] = None,
    as_json: AsJson = False,
    quiet: Quiet = False,
) -> None:
    """Make one self-contained HTML page of one run, of several, of a study or of a history."""
    studies = [path for path in runs if path.is_dir()]
    if studies:
        if len(runs) > 1:
            raise BadInput(f"a study's page holds nothing else, got {len(runs)} paths; name {studies[0]} alone")
        from asperity.history import is_history

        if is_history(studies[0]):
            _report_history(studies[0], out, as_json=as_json, quiet=quiet)
            return
        _report_study(studies[0], out, figures, anchors, as_json=as_json, quiet=quiet)
        return
    if figures is not None or anchors is not None:
        option = "--figures" if figures is not None else "--anchors"
        raise BadInput(f"{option} is for a study's folder, got {runs[0]}; name the folder")
    out = out or (runs[0].with_suffix(".html") if len(runs) == 1 else Path("report.html"))
    require_output(out, ".html")
    from asperity.results import load_run

    loaded = [load_run(path) for path in runs]
    save_report(loaded, out)
    if as_json:
        print_json({"report": str(out), "runs": [run.scalars() for run in loaded]})
        return
    for run in loaded:
        print(run.verdict())
    if not quiet:
        print(f"\nReport: {out}")


def _report_history(folder: Path, out: Path | None, *, as_json: bool, quiet: bool) -> None:
    out = out or folder / "report.html"
    require_output(out, ".html")
    from asperity.history import load_history
    from asperity.report import write_motion_report

    history = load_history(folder)
    write_motion_report(history, out)
    if as_json:
        print_json({"report": str(out), "history": history.scalars()})
        return
    print(history.verdict())
    if not quiet:
        print(f"\nReport: {out}")


def _report_study(
    folder: Path, out: Path | None, figures: Path | None, anchors: Path | None, *, as_json: bool, quiet: bool
) -> None:
    out = out or folder / "report.html"
    require_output(out, ".html")
    from asperity.cli.study import study_scalars
    from asperity.paper import load_anchors
    from asperity.report import write_study_report
    from asperity.study import load_study

    wanted = None if anchors is None else load_anchors(anchors)
    result = load_study(folder)
    with busy("the study's page", quiet=quiet) as tell:
        write_study_report(result, out, figures=figures, anchors=wanted, progress=tell)
    scalars = study_scalars(result)
    if as_json:
        print_json({**scalars, "report": str(out), "figures": None if figures is None else str(figures)})
        return
    print(scalars["verdict"])
    if not quiet:
        print(f"\nReport: {out}")
        if figures is not None:
            print(f"Figures and tables: {figures}")


def _print_run(run: "Run") -> None:
    state, convergence = run.state, run.solution.convergence
    peak, core = run.stress.peak, run.stress.core

    def off(name: str) -> float | None:
        return None if convergence.error is None else float(getattr(convergence.error, name))

    touching_below = 0.0 if run.solution.lubricant is None else run.solution.options.contact_film
    lambda_ratio = "-" if state.lambda_ratio is None else f"{state.lambda_ratio:.3f}"
    rows = [
        ("CLR, load on asperities", f"{with_error(100, state.clr, off('clr'), 2)} %"),
        ("load on oil at the pressure cap, not in CLR", f"{100 * state.capped_oil_load_ratio:.2f} %"),
        ("CAR, contact in the Hertz zone", f"{with_error(100, state.car, off('car'), 2)} %"),
        ("CAR of the domain, over the Hertz area", f"{100 * state.car_domain:.2f} %"),
        ("asperities count as touching below", f"{1e9 * touching_below:g} nm"),
        ("Sq, composite roughness", f"{1e6 * state.sq:.3f} um"),
        (
            "film: least, central, mean",
            f"{with_error(1e6, state.h_min, off('h_min'), 3)}, "
            f"{with_error(1e6, state.h_central, off('h_central'), 3)}, {1e6 * state.h_mean:.3f} um",
        ),
        ("lambda, smooth-contact film over Sq", lambda_ratio),
        ("largest pressure", f"{1e-9 * state.p_max:.3f} GPa"),
        *_friction_rows(run),
        ("von Mises stress in body 1, largest", f"{1e-9 * peak.value:.3f} GPa, {1e6 * peak.depth:.2f} um deep"),
        ("... below a tenth of the half-width", f"{1e-9 * core.value:.3f} GPa, {1e6 * core.depth:.2f} um deep"),
    ]
    resonance = None if run.vibration is None else run.vibration.resonance
    if resonance is not None and resonance.found:
        rows += [
            ("CRF, contact resonance", f"{resonance.crf_hz:.1f} ± {resonance.crf_std_hz:.1f} Hz"),
            ("CRFA, its spectral height", f"{resonance.crfa:.3g} ± {resonance.crfa_std:.2g} (m/s^2)^2/Hz"),
        ]
    rows += [
        ("oil lost or re-created, over oil carried", f"{100 * state.mass_flux_imbalance:.1f} %"),
        ("load error, Reynolds residual", f"{state.load_error:.1e}, {state.reynolds_residual:.1e}"),
        ("solver", convergence.explain()),
    ]
    print()
    print_rows(rows)
    for note in run.remarks:
        print(f"  note: {note}")


def _friction_rows(run: "Run") -> list[tuple[str, str]]:
    rubbing, heat = run.friction, run.heat
    if rubbing is None or heat is None:
        return [("friction", f"not found: {run.friction_failure}")]
    parts = f"asperities {rubbing.asperity_part:.4f}, oil {rubbing.oil_part:.4f}"
    hottest = f"surfaces {heat.max_k:.1f} K, film {heat.film_max_k:.1f} K"
    return [
        ("friction coefficient", f"{rubbing.coefficient:.4f} ({parts})"),
        ("heat of friction, largest rise", f"{rubbing.power:.3g} W, {hottest}"),
    ]
