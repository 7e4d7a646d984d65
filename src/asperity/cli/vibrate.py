"""`asperity vibrate`: the vibration model alone, and the paper's Table 1."""

from contextlib import nullcontext
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from asperity.cli.app import AsJson, Quiet, app
from asperity.cli.common import chosen_case, print_json, print_rows, shown_progress
from asperity.errors import BadInput
from asperity.files import make_folder

if TYPE_CHECKING:
    from asperity.case import Case


@app.command()
def vibrate(
    case: Annotated[
        Path | None, typer.Argument(metavar="CASE.toml", help="A case file with [vibration]; --table1 needs none.")
    ] = None,
    preset: Annotated[
        str | None, typer.Option(help="sound or paper, in place of the case's; --table1 takes paper by default.")
    ] = None,
    table1: Annotated[bool, typer.Option("--table1", help="The paper's Table 1, printed and ours.")] = False,
    records: Annotated[int | None, typer.Option(help="Records behind each row of the table.")] = None,
    override: Annotated[
        list[str] | None,
        typer.Option("--set", metavar="KEY=VALUE", help="Replace a value of the case: vibration.response=nonlinear."),
    ] = None,
    figures: Annotated[
        Path | None, typer.Option(metavar="DIR", help="Draw the paper's Figs 3 and 4, or the table, as PNG.")
    ] = None,
    as_json: AsJson = False,
    quiet: Quiet = False,
) -> None:
    """Run the vibration model alone: dry, all load on asperities; or make the paper's Table 1."""
    if case is None and not table1:
        raise BadInput("a case is missing; asperity vibrate CASE.toml, or asperity vibrate --table1")
    if records is not None and not table1:
        raise BadInput(f"--records {records} belongs to --table1; add it, or leave --records out")
    overrides = [f"vibration.preset={preset}"] if preset is not None else []
    chosen = chosen_case(case, None, [*overrides, *(override or [])]) if case is not None else None
    if figures is not None:
        make_folder(figures)
    if table1:
        _table1(preset or "paper", records, figures, as_json=as_json, quiet=quiet)
    elif chosen is not None:
        _vibrate(chosen, figures, as_json=as_json, quiet=quiet)


def _vibrate(case: "Case", figures: Path | None, *, as_json: bool, quiet: bool) -> None:
    from asperity.results import vibrate_case

    with shown_progress(case.source, quiet=quiet) as report_step:
        vibrated = vibrate_case(case, progress=report_step)
    heard = vibrated.vibration
    drawn: list[Path] = []
    if figures is not None and heard.oscillator is not None and case.vibration is not None:
        from asperity.report import excitation_figure, response_figure, write_figure

        drawn = [
            write_figure(excitation_figure(heard, case.vibration), figures / "excitation.png"),
            write_figure(response_figure(heard, case.vibration), figures / "response.png"),
        ]
    if as_json:
        print_json(vibrated.scalars() | {"figures": [str(path) for path in drawn]})
        return
    print(vibrated.verdict())
    if quiet:
        return
    print()
    rows = [("resonance", heard.resonance.reason)]
    if heard.oscillator is not None:
        spring = heard.oscillator
        rows += [
            ("contact stiffness", f"{1e-6 * spring.stiffness:.4g} N/um"),
            ("natural frequency", f"{spring.natural_frequency_hz:.2f} Hz"),
            ("damping ratio", f"{spring.damping_ratio:.4g}"),
            ("CRFA expected, continuous motion", f"{heard.expected_crfa:.3g} (m/s^2)^2/Hz"),
            ("rms dynamic force over the load", f"{100 * (heard.dynamic_load or 0.0):.3g} %"),
            ("out of contact", f"{100 * (heard.contact_loss or 0.0):.3g} % of the time"),
        ]
    low, high = heard.band_hz
    rows += [
        ("searched", f"{low:.0f} to {high:.0f} Hz"),
        ("all load on asperities", f"{heard.full_load_crf_hz:.1f} Hz"),
    ]
    print_rows(rows)
    for path in drawn:
        print(f"  Figure: {path}")


def _table1(preset: str, records: int | None, figures: Path | None, *, as_json: bool, quiet: bool) -> None:
    from dataclasses import asdict

    from rich.console import Console

    from asperity.coupling import VibrationModel
    from asperity.paper import DAMPING_RATIO, MASS, reproduce_table1

    console = Console(stderr=True)
    shown = console.is_terminal and not quiet
    with console.status("Table 1: riding over the records ...") if shown else nullcontext():
        rows = reproduce_table1(preset=preset, records=records)
    inside, farthest = sum(row.within for row in rows), max(abs(row.crf_off) for row in rows)
    verdict = (
        f"Table 1, preset {preset}: CRF within {100 * farthest:.2f} % of the printed ones, {inside} of {len(rows)} "
        "printed CRFAs inside our 5 to 95 % range."
    )
    drawn: list[Path] = []
    if figures is not None:
        from asperity.report import load_trend_figure, table1_figure, write_figure

        model = VibrationModel.preset(preset, mass=MASS, damping_ratio=DAMPING_RATIO)
        drawn = [
            write_figure(table1_figure(rows), figures / "table1.png"),
            write_figure(load_trend_figure(model), figures / "load-trend.png"),
        ]
    if as_json:
        rows_json = [asdict(row) for row in rows]
        print_json({"verdict": verdict, "rows": rows_json, "figures": [str(path) for path in drawn]})
        return
    print(verdict)
    if quiet:
        return
    print("\n  cut-off  height  load       CRF  printed    CRFA  5 to 95 %       printed")
    for row in rows:
        spread = f"[{row.crfa_low:.3f}, {row.crfa_high:.3f}]"
        print(
            f"  {row.cutoff_hz:4.0f} Hz  {1e6 * row.height_m:3.0f} um {row.load_n:4.0f} N  {row.crf_hz:8.2f}  "
            f"{row.paper_crf_hz:7.2f}  {row.crfa:6.3f}  {spread:14}  {row.paper_crfa:7.2f}"
        )
    print(
        "  CRF in Hz, CRFA in (m/s^2)^2/Hz; medians of single records. E 207 GPa, R 5.4 mm, m 0.1 kg, not the case's."
    )
    for path in drawn:
        print(f"  Figure: {path}")
