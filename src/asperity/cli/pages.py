"""`asperity report`: HTML pages of saved runs, studies, histories or wear."""

from pathlib import Path
from typing import Annotated, Literal

import typer

from asperity import paper, report, results, simulation, study
from asperity.cli.app import app
from asperity.cli.options import AsJson, Quiet, StudyFigures, require_output
from asperity.cli.output import progress, show, written
from asperity.core.errors import BadInput


@app.command("report")
def report_command(
    paths: Annotated[
        list[Path],
        typer.Argument(
            metavar="RUN...|DIR",
            help="Runs saved by asperity solve --out, or the folder of a study, history or wear.",
        ),
    ],
    out: Annotated[
        Path | None,
        typer.Option(
            metavar="OUT.html", help="Page to write (default: beside the run, or in the folder)."
        ),
    ] = None,
    figures: StudyFigures = None,
    anchors: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE.toml", help="Reference values for a study (default: the paper's)."
        ),
    ] = None,
    as_json: AsJson = False,
    quiet: Quiet = False,
) -> None:
    """Write a self-contained HTML page of runs, a study, a history or wear."""
    folders = [path for path in paths if path.is_dir()]
    if folders and len(paths) > 1:
        raise BadInput(
            f"a folder's page has no other contents, got {len(paths)} paths; name {folders[0]} only"
        )
    kind = _kind(folders)
    if kind != "study" and (figures is not None or anchors is not None):
        option = "--figures" if figures is not None else "--anchors"
        raise BadInput(f"{option} applies to a study's folder, got {paths[0]}; name that folder")
    if out is None:
        alone = paths[0].with_suffix(".html") if len(paths) == 1 else Path("report.html")
        out = folders[0] / "report.html" if folders else alone
    require_output(out, ".html")
    if kind == "study":
        _report_study(folders[0], out, figures, anchors, as_json=as_json, quiet=quiet)
    elif kind == "wear":
        _report_wear(folders[0], out, as_json=as_json, quiet=quiet)
    elif kind == "history":
        _report_history(folders[0], out, as_json=as_json, quiet=quiet)
    else:
        _report_runs(paths, out, as_json=as_json, quiet=quiet)


def _kind(folders: list[Path]) -> Literal["runs", "study", "wear", "history"]:
    """Return what a folder holds; "runs" without a folder."""
    if not folders:
        return "runs"
    if simulation.is_wear_folder(folders[0]):
        return "wear"
    return "history" if simulation.is_history_folder(folders[0]) else "study"


def _report_runs(paths: list[Path], out: Path, *, as_json: bool, quiet: bool) -> None:
    runs = [results.load_run(path) for path in paths]
    report.write_report(runs, out)
    show(
        [run.verdict() for run in runs],
        lambda: {"report": str(out), "runs": [run.summary() for run in runs]},
        written("Report", out),
        as_json=as_json,
        quiet=quiet,
    )


def _report_history(folder: Path, out: Path, *, as_json: bool, quiet: bool) -> None:
    history = simulation.load_history(folder)
    report.write_motion_report(history, out)
    show(
        history.verdict(),
        lambda: {"report": str(out), "history": history.scalars()},
        written("Report", out),
        as_json=as_json,
        quiet=quiet,
    )


def _report_wear(folder: Path, out: Path, *, as_json: bool, quiet: bool) -> None:
    history = simulation.load_wear(folder)
    report.write_wear_report(history, out)
    show(
        history.verdict(),
        lambda: {"report": str(out), "wear": history.scalars()},
        written("Report", out),
        as_json=as_json,
        quiet=quiet,
    )


def _report_study(
    folder: Path,
    out: Path,
    figures: Path | None,
    anchors: Path | None,
    *,
    as_json: bool,
    quiet: bool,
) -> None:
    chosen = None if anchors is None else paper.load_anchors(anchors)
    result = study.load_study(folder)
    with progress("the study's page", quiet=quiet) as display:
        report.write_study_report(result, out, figures=figures, anchors=chosen, progress=display)
    paths = {"report": str(out), "figures": None if figures is None else str(figures)}
    show(
        study.study_verdict(result),
        lambda: {**study.study_scalars(result), **paths},
        [*written("Report", out), *written("Figures and tables", figures)],
        as_json=as_json,
        quiet=quiet,
    )
