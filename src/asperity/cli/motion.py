"""`asperity run`: a case's roughness let move, step after step; goes on where it was stopped."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager, nullcontext
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from asperity.cli.app import AsJson, Quiet, app
from asperity.cli.common import chosen_case, print_json, print_rows, require_output
from asperity.errors import AsperityError, BadInput, NotConverged

if TYPE_CHECKING:
    from asperity.history import History, HistoryProgress, HistoryVibration


@app.command("run")
def run_case(
    case: Annotated[Path, typer.Argument(metavar="CASE.toml", help="A case; its [motion] says how it moves.")],
    steps: Annotated[
        int | None, typer.Option(metavar="N", help="Number of the last step; by default the case's.")
    ] = None,
    passes: Annotated[
        float | None, typer.Option(metavar="P", help="In place of --steps: how often the rough surface runs its track.")
    ] = None,
    surface: Annotated[
        Path | None, typer.Option(metavar="FILE", help="A measured surface in place of the case's own.")
    ] = None,
    override: Annotated[
        list[str] | None,
        typer.Option("--set", metavar="KEY=VALUE", help="Replace a value of the case: motion.start=stationary."),
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option(metavar="DIR", help="Folder of the history; what it holds is kept."),
    ] = None,
    every: Annotated[
        int | None, typer.Option(metavar="K", help="Keep maps of every K steps; by default about 40 in all.")
    ] = None,
    keep_going: Annotated[
        bool, typer.Option("--keep-going", help="Mark a step that does not converge, and go on from it.")
    ] = False,
    listen: Annotated[
        bool, typer.Option("--listen", help="Let the mass ride on the history, by the contact's own stiffness.")
    ] = False,
    report: Annotated[Path | None, typer.Option(metavar="OUT.html", help="Make the page of the history too.")] = None,
    as_json: AsJson = False,
    quiet: Quiet = False,
) -> None:
    """Let the roughness move: film, load sharing, friction and resonance step after step."""
    from asperity.history import run_history

    if report is not None:
        require_output(report, ".html")
    chosen = chosen_case(case, surface, override or [])
    if steps is not None and passes is not None:
        raise BadInput(f"--steps {steps} and --passes {passes:g} both say how long to run; leave one out")
    failure = None
    try:
        with shown_history(case.name, quiet=quiet) as tell:
            history = run_history(
                chosen, steps=steps, passes=passes, out=out, every=every, strict=not keep_going, progress=tell
            )
    except NotConverged as unfinished:
        from asperity.history import History

        if not isinstance(unfinished.solution, History):  # there was no snapshot to start from
            raise
        history, failure = unfinished.solution, str(unfinished)
    heard = _listened(history) if listen and failure is None else None
    if report is not None:
        from asperity.report import write_motion_report

        write_motion_report(history, report, vibration=heard)
    if as_json:
        said = history.scalars() if heard is None else {**history.scalars(), **heard.scalars()}
        print_json({**said, "report": None if report is None else str(report)})
    else:
        print(history.verdict())
        if not quiet:
            _print_history(history, heard, report)
    if failure is not None:
        raise AsperityError(failure)


@contextmanager
def shown_history(label: str, *, quiet: bool) -> "Iterator[Callable[[HistoryProgress], None] | None]":
    """Show the steps on a terminal."""
    if quiet:
        yield None
        return
    from rich.console import Console

    console = Console(stderr=True)
    first = f"{label}: the start; after installation the first solve compiles the solver, up to a minute ..."
    with console.status(first) if console.is_terminal else nullcontext() as status:

        def tell(step: "HistoryProgress") -> None:
            if status is not None:
                clr = 100.0 * float(step.row["clr"])
                status.update(f"{label}: step {step.number} of {step.steps}, {clr:.1f} % of the load on asperities")

        yield tell


def _listened(history: "History") -> "HistoryVibration":
    from asperity.history import history_vibration

    return history_vibration(history)


def _print_history(history: "History", heard: "HistoryVibration | None", report: Path | None) -> None:
    said = history.scalars()

    def shown(name: str, scale: float, form: str) -> str:
        if said[name] is None:
            return "-"
        start = "-" if said[f"{name}_start"] is None else f"{scale * said[f'{name}_start']:{form}}"
        return f"{scale * said[name]:{form}} ± {scale * said[f'{name}_std']:{form}} (start {start})"

    motion, each = history.case.motion, 1e6 * (said["step_s"] or 0.0)
    rows = [
        ("steps, of which computed now", f"{history.steps}, {history.computed} in {history.seconds:.1f} s"),
        ("a step", f"{each:.4g} us, {motion.time_step:g} of the oil's way from cell to cell; start {motion.start}"),
        (f"means and deviations, from step {said['settled_from_step']}", ""),
        ("CLR, load on asperities", f"{shown('clr', 100, '.2f')} %"),
        ("CAR, contact in the Hertz zone", f"{shown('car', 100, '.2f')} %"),
        ("film: least", f"{shown('h_min_m', 1e6, '.3f')} um"),
        ("film: central", f"{shown('h_central_m', 1e6, '.3f')} um"),
        ("film: mean", f"{shown('h_mean_m', 1e6, '.3f')} um"),
        ("largest pressure", f"{shown('p_max_pa', 1e-9, '.3f')} GPa"),
        ("friction coefficient", shown("friction_coefficient", 1, ".4f")),
        ("heat of friction", f"{shown('friction_power_w', 1, '.4g')} W"),
        ("heat of pressure-driven flow", f"{shown('flow_power_w', 1, '.4g')} W"),
        ("contact resonance by load share", f"{shown('resonance_hz', 1, '.1f')} Hz"),
        ("oil lost or re-created, over oil carried", f"{shown('mass_flux_imbalance', 100, '.1f')} %"),
    ]
    for one in said.get("passes", [])[:: max(1, len(said.get("passes", [])) - 1)]:
        shares = f"CLR {100 * one['clr']:.1f} %, CAR {100 * one['car']:.2f} %"
        rows.append((f"pass {one['pass']}", f"{shares}, Sq of the tracks {1e6 * one['track_sq_m']:.3f} um"))
    if said["crf_hz"] is not None:
        rows.append(("CRF of the mean contact", f"{said['crf_hz']:.1f} Hz"))
    print()
    print_rows(rows)
    for note in history.notes:
        print(f"  note: {note}")
    if heard is not None:
        print(f"\n{heard.verdict()}")
    if history.folder is not None:
        print(f"\nKept in {history.folder}; asperity run with the same folder and more steps goes on")
    if report is not None:
        print(f"Report: {report}")
