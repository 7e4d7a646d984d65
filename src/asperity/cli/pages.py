"""`asperity report`: HTML pages of saved runs, studies, histories or wear."""

from pathlib import Path
from typing import Annotated, Literal

import typer

from asperity import paper, report, results, simulation, study
from asperity.cli.app import app
from asperity.cli.options import AsJson, Figures, OpenPage, Quiet, require_output
from asperity.cli.output import progress, show, written
from asperity.cli.terminal.browser import open_page
from asperity.core import files
from asperity.core.errors import BadInput


@app.command("report")
def report_command(
    paths: Annotated[
        list[Path],
        typer.Argument(
            metavar="RUN|DIR",
            help="Runs saved by asperity solve --out, or the folder of a study, history or wear.",
        ),
    ],
    out: Annotated[
        Path | None,
        typer.Option(
            metavar="OUT.html",
            help="File for the page (default: beside the run, or in the folder).",
        ),
    ] = None,
    figures: Figures = None,
    anchors: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE.toml", help="Reference values for a study (default: the paper's)."
        ),
    ] = None,
    opened: OpenPage = False,
    as_json: AsJson = False,
    quiet: Quiet = False,
) -> None:
    """Write an HTML page of runs, a study, a history or wear."""
    folders = [path for path in paths if path.is_dir()]
    if folders and len(paths) > 1:
        raise BadInput(
            f"a folder's page has no other contents, got {len(paths)} paths; name {folders[0]} only"
        )
    kind = _kind(folders)
    if kind != "study" and anchors is not None:
        raise BadInput(f"--anchors applies to a study's folder, got {paths[0]}; name that folder")
    if out is None:
        alone = paths[0].with_suffix(".html") if len(paths) == 1 else Path("report.html")
        out = folders[0] / "report.html" if folders else alone
    require_output(out, ".html")
    if kind == "study":
        _report_study(folders[0], out, figures, anchors, as_json=as_json, quiet=quiet)
    elif kind == "wear":
        _report_wear(folders[0], out, figures, as_json=as_json, quiet=quiet)
    elif kind == "history":
        _report_history(folders[0], out, figures, as_json=as_json, quiet=quiet)
    else:
        _report_runs(paths, out, figures, as_json=as_json, quiet=quiet)
    open_page(out, requested=opened)


def _kind(folders: list[Path]) -> Literal["runs", "study", "wear", "history"]:
    """Return what a folder holds; "runs" without a folder."""
    if not folders:
        return "runs"
    if simulation.is_wear_folder(folders[0]):
        return "wear"
    return "history" if simulation.is_history_folder(folders[0]) else "study"


def _report_runs(
    paths: list[Path], out: Path, figures: Path | None, *, as_json: bool, quiet: bool
) -> None:
    for path in paths:
        _require_run(path)
    runs = [results.load_run(path) for path in paths]
    report.write_report(runs, out, figures=figures)
    show(
        [run.verdict() for run in runs],
        lambda: {**_paths(out, figures), "runs": [run.summary() for run in runs]},
        [*written("Report", out), *written("Figures", figures)],
        as_json=as_json,
        quiet=quiet,
    )


def _require_run(path: Path) -> None:
    """Raise BadInput for a file that is not a saved run by its ending."""
    files.require_file(path)
    if path.suffix == ".toml":
        raise BadInput(
            f"{path} is a case, not a saved run; solve it first: "
            f"asperity solve {path} --out {path.with_suffix('.nc')}"
        )
    if path.suffix != ".nc":
        raise BadInput(
            f"{path} is not a saved run; name a file RUN.nc of asperity solve --out, or the "
            "folder of a study, history or wear"
        )


def _report_history(
    folder: Path, out: Path, figures: Path | None, *, as_json: bool, quiet: bool
) -> None:
    history = simulation.load_history(folder)
    report.write_motion_report(history, out, figures=figures)
    show(
        history.verdict(),
        lambda: {**_paths(out, figures), "history": history.scalars()},
        [*written("Report", out), *written("Figures", figures)],
        as_json=as_json,
        quiet=quiet,
    )


def _report_wear(
    folder: Path, out: Path, figures: Path | None, *, as_json: bool, quiet: bool
) -> None:
    history = simulation.load_wear(folder)
    report.write_wear_report(history, out, figures=figures)
    show(
        history.verdict(),
        lambda: {**_paths(out, figures), "wear": history.scalars()},
        [*written("Report", out), *written("Figures", figures)],
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
    show(
        study.study_verdict(result),
        lambda: {**study.study_scalars(result), **_paths(out, figures)},
        [*written("Report", out), *written("Figures and tables", figures)],
        as_json=as_json,
        quiet=quiet,
    )


def _paths(out: Path, figures: Path | None) -> dict[str, str | None]:
    return {"report": str(out), "figures": None if figures is None else str(figures)}
