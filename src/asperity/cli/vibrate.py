"""`asperity vibrate`: the vibration model alone, and the paper's Table 1."""

from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from asperity import coupling, paper, report, results
from asperity.cli.app import app
from asperity.cli.options import AsJson, Overrides, Quiet, chosen_case
from asperity.cli.output import (
    Block,
    columns,
    known_rows,
    progress,
    show,
    solver_progress,
    span,
    table,
    written,
)
from asperity.core import files
from asperity.core.errors import BadInput
from asperity.core.quantities import quantity

if TYPE_CHECKING:
    from asperity.case import Case
    from asperity.paper import Table1Row

TABLE1 = (
    "cutoff_hz",
    "sq_m",
    "load_n",
    "crf_hz",
    "paper_crf_hz",
    "crfa",
    "crfa_low",
    "crfa_high",
    "paper_crfa",
)


@app.command()
def vibrate(
    path: Annotated[
        Path | None,
        typer.Argument(
            metavar="CASE.toml", help="Case file with [vibration]; not needed for --table1."
        ),
    ] = None,
    preset: Annotated[
        str | None,
        typer.Option(help="sound or paper (default: the case's; paper for --table1)."),
    ] = None,
    table1: Annotated[
        bool, typer.Option("--table1", help="Reproduce the paper's Table 1.")
    ] = False,
    records: Annotated[
        int | None, typer.Option(help="Simulated records per row of the table.")
    ] = None,
    overrides: Overrides = None,
    figures: Annotated[
        Path | None,
        typer.Option(
            metavar="DIR", help="Folder for the paper's Figs 3 and 4, or the table, as PNG."
        ),
    ] = None,
    as_json: AsJson = False,
    quiet: Quiet = False,
) -> None:
    """Run the vibration model alone, or the paper's Table 1.

    The contact is dry, with all load on asperities.
    """
    if path is None and not table1:
        raise BadInput(
            "a case is missing; asperity vibrate CASE.toml, or asperity vibrate --table1"
        )
    if records is not None and not table1:
        raise BadInput(
            f"--records {records} applies to --table1 only; add it, or leave --records out"
        )
    first = [f"vibration.preset={preset}"] if preset is not None else []
    chosen = chosen_case(path, [*first, *(overrides or [])]) if path is not None else None
    if figures is not None:
        files.make_folder(figures)
    if table1:
        _table1(preset or "paper", records, figures, as_json=as_json, quiet=quiet)
    elif chosen is not None:
        _vibrate(chosen, figures, as_json=as_json, quiet=quiet)


def _vibrate(chosen: "Case", figures: Path | None, *, as_json: bool, quiet: bool) -> None:
    with solver_progress(chosen.source, quiet=quiet) as step:
        vibrated = results.vibrate_case(chosen, progress=step)
    vibration = vibrated.vibration
    scalars = vibrated.scalars()
    drawn: list[Path] = []
    if figures is not None and vibration.oscillator is not None and chosen.vibration is not None:
        drawn = [
            report.write_figure(
                report.excitation_figure(vibration, chosen.vibration), figures / "excitation.png"
            ),
            report.write_figure(
                report.response_figure(vibration, chosen.vibration), figures / "response.png"
            ),
        ]
    rows = [
        ("resonance", vibration.resonance.reason),
        *known_rows(scalars, "vibration"),
        (quantity("band_hz").title, span("band_hz", vibration.band_hz)),
    ]
    show(
        vibrated.verdict(),
        lambda: scalars | {"figures": [str(figure) for figure in drawn]},
        table(rows),
        written("Figure", *drawn),
        as_json=as_json,
        quiet=quiet,
    )


def _table1(
    preset: str, records: int | None, figures: Path | None, *, as_json: bool, quiet: bool
) -> None:
    with progress("Table 1", "simulating the records ...", quiet=quiet):
        rows = paper.reproduce_table1(preset=preset, records=records)
    drawn: list[Path] = []
    if figures is not None:
        model = coupling.VibrationModel.preset(
            preset, mass=paper.MASS, damping_ratio=paper.DAMPING_RATIO
        )
        drawn = [
            report.write_figure(report.table1_figure(rows), figures / "table1.png"),
            report.write_figure(report.trend_over_load_figure(model), figures / "load-trend.png"),
        ]
    verdict = paper.table1_verdict(rows, preset)
    show(
        verdict,
        lambda: {
            "verdict": verdict,
            "rows": [asdict(row) for row in rows],
            "figures": [str(figure) for figure in drawn],
        },
        _printed_and_ours(rows),
        written("Figure", *drawn),
        as_json=as_json,
        quiet=quiet,
    )


def _printed_and_ours(rows: "Sequence[Table1Row]") -> Block:
    selected = [quantity(key) for key in TABLE1]
    values = [{**asdict(row), "sq_m": row.height_m} for row in rows]
    yield from columns(
        [entry.label for entry in selected],
        ([entry.number_in(row) for entry in selected] for row in values),
    )
    yield "  medians over records; E 207 GPa, R 5.4 mm, m 0.1 kg, independent of the case"
