"""The command line: parses, calls, prints. No physics.

The first line of the output is the verdict; `--json` prints one object and nothing else; progress goes to stderr.
Exit codes: 0 done, 2 bad input or usage, 1 anything else.
"""

import json
import sys
import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from asperity.errors import AsperityError, BadInput

if TYPE_CHECKING:
    from asperity.case import Case
    from asperity.ehl.solution import Iteration
    from asperity.run import Run
    from asperity.surface import SurfaceDescription

DEMO_SQ = ("0.5 um", "1.5 um", "3 um")
INTERRUPTED = 130  # what typer makes of Ctrl-C
SILENT_FOR = 2.0  # seconds without a step of the solver, after which its compilation is announced

app = typer.Typer(
    help="Hears how a lubricated contact wears: film, load sharing of asperities and oil, contact resonance.",
    epilog="Exit codes: 0 done, 2 bad input or usage, 1 anything else.",
    add_completion=False,
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
)

AsJson = Annotated[bool, typer.Option("--json", help="Print one JSON object and nothing else.")]
Quiet = Annotated[bool, typer.Option("--quiet", "-q", help="Print the verdict only, and no progress.")]


def main(arguments: Sequence[str] | None = None) -> None:
    """Run a command and exit with its code; what asperity refuses is one line on stderr."""
    try:
        code = app(args=arguments, prog_name="asperity", standalone_mode=False)
        if code == INTERRUPTED:
            code = _complain("interrupted; nothing half written was left behind", 1)
    except BadInput as error:
        code = _complain(str(error), 2)
    except AsperityError as error:
        code = _complain(str(error), 1)
    except typer.TyperException as error:  # usage
        code = _complain(f"{error.format_message().rstrip('.')}; asperity --help says what there is", error.exit_code)
    sys.exit(code)


def _complain(sentence: str, code: int) -> int:
    print(f"error: {sentence}", file=sys.stderr)
    return code


def _show_version(wanted: bool) -> None:
    if wanted:
        from asperity import __version__

        print(f"asperity {__version__}")
        raise typer.Exit


@app.callback()
def _asperity(
    _version: Annotated[
        bool, typer.Option("--version", callback=_show_version, is_eager=True, help="Print the version.")
    ] = False,
) -> None:
    pass


@app.command()
def demo(
    out: Annotated[Path, typer.Option(help="Folder for the case, the runs and the report.")] = Path("asperity-demo"),
    as_json: AsJson = False,
    quiet: Quiet = False,
) -> None:
    """Solve the paper's contact at a few roughness levels, from case file to report."""
    from importlib.resources import files

    from asperity.case import load_case

    _make_folder(out)
    case_file, report_file = out / "paper.toml", out / "report.html"
    _write_text(case_file, files("asperity").joinpath("paper.toml").read_text("utf-8"))
    case = load_case(case_file)
    runs = []
    for sq in DEMO_SQ:
        run = _solve(case.with_overrides({"surface.sq": sq}), label=f"Sq {sq}", quiet=quiet)
        run.save(out / f"run-sq-{sq.replace(' ', '')}.nc")
        runs.append(run)
    _write_report(runs, report_file)
    first, last = runs[0], runs[-1]
    less, more = (f"{100 * run.state.clr:.0f} %" for run in (first, last))
    verdict = (
        f"From Sq {DEMO_SQ[0]} to {DEMO_SQ[-1]} the asperities' share of the load goes from {less} to {more}: "
        f"{first.resonance_in_words()} at first, {last.resonance_in_words()} at last."
    )
    unfinished = [sq for sq, run in zip(DEMO_SQ, runs, strict=True) if not run.solution.convergence.converged]
    if unfinished:
        verdict = f"NOT CONVERGED at Sq {', '.join(unfinished)}, do not use: {verdict}"
    if as_json:
        _print_json({"verdict": verdict, "report": str(report_file), "runs": [run.scalars() for run in runs]})
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
        _require_output(out, ".nc")
    run = _solve(_case(case, surface, override or []), label=case.name, quiet=quiet)
    if out is not None:
        run.save(out)
    if as_json:
        _print_json(run.scalars())
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
    chosen = _case(case, None, [*overrides, *(override or [])]) if case is not None else None
    if figures is not None:
        _make_folder(figures)
    if table1:
        _table1(preset or "paper", records, figures, as_json=as_json, quiet=quiet)
    elif chosen is not None:
        _vibrate(chosen, figures, as_json=as_json, quiet=quiet)


def _vibrate(case: "Case", figures: Path | None, *, as_json: bool, quiet: bool) -> None:
    from asperity.run import vibrate_case, vibration_scalars, vibration_verdict

    with _progress(case.source, quiet=quiet) as report_step:
        heard, state = vibrate_case(case, progress=report_step)
    scalars = vibration_scalars(heard, state, case)
    drawn: list[Path] = []
    if figures is not None and heard.oscillator is not None and case.vibration is not None:
        from asperity.report.vibration_figures import excitation_figure, response_figure, write_png

        drawn = [
            write_png(excitation_figure(heard, case.vibration), figures / "excitation.png"),
            write_png(response_figure(heard, case.vibration), figures / "response.png"),
        ]
    if as_json:
        _print_json(scalars | {"figures": [str(path) for path in drawn]})
        return
    print(vibration_verdict(heard, state, case))
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
    _print_rows(rows)
    for path in drawn:
        print(f"  Figure: {path}")


def _table1(preset: str, records: int | None, figures: Path | None, *, as_json: bool, quiet: bool) -> None:
    from dataclasses import asdict

    from rich.console import Console

    from asperity.coupling import VibrationModel
    from asperity.table1 import DAMPING_RATIO, MASS, table1

    console = Console(stderr=True)
    shown = console.is_terminal and not quiet
    with console.status("Table 1: riding over the records ...") if shown else _nothing():
        rows = table1(preset=preset, records=records)
    inside, farthest = sum(row.within for row in rows), max(abs(row.crf_off) for row in rows)
    verdict = (
        f"Table 1, preset {preset}: CRF within {100 * farthest:.2f} % of the printed ones, {inside} of {len(rows)} "
        "printed CRFAs inside our 5 to 95 % range."
    )
    drawn: list[Path] = []
    if figures is not None:
        from asperity.report.vibration_figures import load_trend_figure, table1_figure, write_png

        model = VibrationModel.preset(preset, mass=MASS, damping_ratio=DAMPING_RATIO)
        drawn = [
            write_png(table1_figure(rows), figures / "table1.png"),
            write_png(load_trend_figure(model), figures / "load-trend.png"),
        ]
    if as_json:
        rows_json = [asdict(row) for row in rows]
        _print_json({"verdict": verdict, "rows": rows_json, "figures": [str(path) for path in drawn]})
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


@app.command()
def surface(
    files: Annotated[list[Path], typer.Argument(metavar="FILE...", help="Measured surfaces.")],
    out: Annotated[
        Path | None,
        typer.Option(metavar="PNG", help="Draw one surface: map, profile, bearing curve, spectra, lay."),
    ] = None,
    unit: Annotated[str | None, typer.Option(help="Unit of the heights, for a file that names none.")] = None,
    lateral_unit: Annotated[str | None, typer.Option(help="Unit of x and y, for a file that names none.")] = None,
    pixel: Annotated[
        str | None, typer.Option(metavar="LENGTH", help="Distance of the heights of a bare matrix: '1.6 um'.")
    ] = None,
    form: Annotated[
        str, typer.Option(help="Remove none, a plane, quadratic, cubic, quartic or cylinder form.")
    ] = "quadratic",
    turn: Annotated[bool, typer.Option("--turn", help="Turn by 90 degrees: x of the file becomes y.")] = False,
    outliers: Annotated[str, typer.Option(help="Keep or remove heights far off their neighbours.")] = "keep",
    s_filter: Annotated[
        str | None, typer.Option(metavar="LENGTH", help="Remove shorter waves (ISO 16610 Gaussian): '5 um'.")
    ] = None,
    l_filter: Annotated[
        str | None, typer.Option(metavar="LENGTH", help="Remove longer waves (ISO 16610 Gaussian): '0.25 mm'.")
    ] = None,
    as_json: AsJson = False,
    quiet: Quiet = False,
) -> None:
    """Say what a surface file holds: size, pixel, missing data, what was done to it, parameters."""
    if out is not None:
        _require_output(out, ".png")
        if len(files) > 1:
            raise BadInput(f"--out {out} holds one map, got {len(files)} surfaces; draw them one by one")
    from asperity.surface import describe_surface

    lengths = {"pixel": pixel, "s_filter": s_filter, "l_filter": l_filter}
    options: dict[str, Any] = {name: _length(name, text) for name, text in lengths.items() if text is not None}
    options |= {"unit": unit, "lateral_unit": lateral_unit, "form": form, "turn": turn, "outliers": outliers}
    described = [describe_surface(file, **options) for file in files]
    if out is not None:
        from asperity.report.figures import surface_map

        surface_map(described[0], out)
    if as_json:
        _print_json({"files": [description.scalars() for description in described]})
        return
    for number, description in enumerate(described):
        if number and not quiet:
            print()
        print(_surface_verdict(description))
        if not quiet:
            _print_surface(description)
    if out is not None and not quiet:
        print(f"\nMap: {out}")


@app.command()
def report(
    runs: Annotated[list[Path], typer.Argument(metavar="RUN...", help="Runs kept by asperity solve --out.")],
    out: Annotated[Path | None, typer.Option(metavar="OUT.html", help="The page; by default beside the run.")] = None,
    as_json: AsJson = False,
    quiet: Quiet = False,
) -> None:
    """Make one self-contained HTML page of one run or several."""
    out = out or (runs[0].with_suffix(".html") if len(runs) == 1 else Path("report.html"))
    _require_output(out, ".html")
    from asperity.run import load_run

    loaded = [load_run(path) for path in runs]
    _write_report(loaded, out)
    if as_json:
        _print_json({"report": str(out), "runs": [run.scalars() for run in loaded]})
        return
    for run in loaded:
        print(run.verdict())
    if not quiet:
        print(f"\nReport: {out}")


def _case(path: Path, surface: Path | None, overrides: list[str]) -> "Case":
    from asperity.case import load_case, relative_to
    from asperity.run import load_run

    case = load_run(path).case if path.suffix == ".nc" else load_case(path)
    if surface is not None:
        if not surface.is_file():
            raise BadInput(f"--surface {surface} does not exist; check its name")
        case = case.with_overrides({"surface": {"file": relative_to(surface, case.folder)}})
    wanted = {}
    for override in overrides:
        key, equals, value = override.partition("=")
        if not (equals and key.strip() and value.strip()):
            raise BadInput(f"--set takes KEY=VALUE such as contact.load='400 N', got {override!r}")
        wanted[key.strip()] = value.strip()
    return case.with_overrides(wanted) if wanted else case


def _length(name: str, text: str) -> float:
    from asperity.case import read_length

    return read_length(f"--{name.replace('_', '-')}", text)


def _make_folder(path: Path) -> None:
    if path.exists() and not path.is_dir():
        raise BadInput(f"cannot write into {path}: it is a file; name a folder")
    try:
        path.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise BadInput(f"cannot make the folder {path}: {error.strerror}; choose another") from None


def _require_output(path: Path, suffix: str) -> None:
    from asperity.ehl.storage import require_writable

    if path.suffix != suffix:
        raise BadInput(f"--out must be a file that ends in {suffix}, got {path}")
    require_writable(path)


def _write_text(path: Path, text: str) -> None:
    from asperity.ehl.storage import whole_file

    with whole_file(path) as part:
        part.write_text(text, "utf-8")


def _write_report(runs: "Sequence[Run]", path: Path) -> None:
    from asperity.report import write_report

    write_report(runs, path)


def _solve(case: "Case", *, label: str, quiet: bool) -> "Run":
    from asperity.run import solve_case

    case.surface()  # made or read here: it may take seconds, which are not the solver's
    with _progress(label, quiet=quiet) as report_step:
        return solve_case(case, progress=report_step, strict=False)


@contextmanager
def _progress(label: str, *, quiet: bool) -> "Iterator[Callable[[Iteration], None] | None]":
    """Show the solver's steps on a terminal; announce the compilation that makes the first solve ever slow."""
    if quiet:
        yield None
        return
    from rich.console import Console

    console = Console(stderr=True)
    announcement = threading.Timer(
        SILENT_FOR,
        console.print,
        [f"{label}: no step yet; the first solve after installation compiles the solver, up to a minute ..."],
        {"soft_wrap": True, "highlight": False},
    )
    announcement.daemon = True
    announcement.start()
    try:
        with console.status(f"{label}: setting up ...") if console.is_terminal else _nothing() as status:

            def report_step(step: "Iteration") -> None:
                announcement.cancel()
                if status is not None:
                    nx, ny = step.cells
                    status.update(f"{label}: {nx} x {ny} cells, step {step.number}, residual {step.residual:.1e}")

            yield report_step
    finally:
        announcement.cancel()


@contextmanager
def _nothing() -> Iterator[None]:
    yield None


def _print_json(values: dict[str, Any]) -> None:
    print(json.dumps(values, indent=2, allow_nan=False))


def _print_rows(rows: Sequence[tuple[str, str]]) -> None:
    width = max(len(name) for name, _ in rows)
    for name, value in rows:
        print(f"  {name:{width}}  {value}")


def _print_run(run: "Run") -> None:
    state, convergence = run.state, run.solution.convergence
    lambda_ratio = "-" if state.lambda_ratio is None else f"{state.lambda_ratio:.3f}"
    rows = [
        ("CLR, load on asperities", f"{100 * state.clr:.2f} %"),
        ("load on oil at the pressure cap, not in CLR", f"{100 * state.capped_oil_load_ratio:.2f} %"),
        ("CAR, contact in the Hertz zone", f"{100 * state.car:.2f} %"),
        ("CAR of the domain, over the Hertz area", f"{100 * state.car_domain:.2f} %"),
        ("asperities count as touching below", f"{1e9 * run.solution.options.contact_film:g} nm"),
        ("Sq, composite roughness", f"{1e6 * state.sq:.3f} um"),
        (
            "film: least, central, mean",
            f"{1e6 * state.h_min:.3f}, {1e6 * state.h_central:.3f}, {1e6 * state.h_mean:.3f} um",
        ),
        ("lambda, smooth-contact film over Sq", lambda_ratio),
        ("largest pressure", f"{1e-9 * state.p_max:.3f} GPa"),
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
    _print_rows(rows)
    for note in run.notes:
        print(f"  note: {note}")


def _surface_verdict(description: "SurfaceDescription") -> str:
    measured, parameters = description.measured, description.parameters
    (nx, ny), (dx, dy) = measured.grid.cells, measured.grid.spacing
    what = f"Sq {1e6 * parameters.sq:.3g} um, {nx} x {ny} cells of {1e6 * dx:.4g} x {1e6 * dy:.4g} um"
    if measured.uniform is not None:
        what = f"profile, Rq {1e6 * parameters.sq:.3g} um, {nx} points every {1e6 * dx:.4g} um"
    return f"{description.path}: {what}, {100 * measured.missing:.2g} % missing."


def _print_surface(description: "SurfaceDescription") -> None:
    measured = description.measured
    width, height = measured.grid.extent
    size = f"{1e6 * width:.4g} um" if measured.uniform is not None else f"{1e6 * width:.4g} x {1e6 * height:.4g} um"
    rows = [("format", measured.format), ("size", size)]
    rows += _areal_rows(description) if description.profile is None else _profile_rows(description)
    print()
    _print_rows(rows)
    for step in (*description.steps, *measured.notes):
        print(f"  note: {step}")


def _areal_rows(description: "SurfaceDescription") -> list[tuple[str, str]]:
    found = description.parameters
    bound = " (at most: the lay outlasts half the map)" if found.str_bounded else ""
    return [
        ("Sa, Sq", f"{1e6 * found.sa:.4g}, {1e6 * found.sq:.4g} um"),
        ("Ssk, Sku", f"{found.ssk:.3g}, {found.sku:.3g}"),
        ("Sp, Sv, Sz", f"{1e6 * found.sp:.4g}, {1e6 * found.sv:.4g}, {1e6 * found.sz:.4g} um"),
        ("Sdq, Sdr", f"{found.sdq:.3g}, {100 * found.sdr:.3g} %"),
        ("Sal, Str", f"{1e6 * found.sal:.3g} um, {found.str_:.3g}{bound}"),
        ("Sk, Spk, Svk", f"{1e6 * found.sk:.4g}, {1e6 * found.spk:.4g}, {1e6 * found.svk:.4g} um"),
        ("Smr1, Smr2", f"{100 * found.smr1:.3g}, {100 * found.smr2:.3g} %"),
    ]


def _profile_rows(description: "SurfaceDescription") -> list[tuple[str, str]]:
    found = description.profile
    assert found is not None
    return [
        ("Ra, Rq", f"{1e6 * found.ra:.4g}, {1e6 * found.rq:.4g} um"),
        ("Rsk, Rku", f"{found.rsk:.3g}, {found.rku:.3g}"),
        (
            "Rp, Rv, Rz, Rt",
            f"{1e6 * found.rp:.4g}, {1e6 * found.rv:.4g}, {1e6 * found.rz:.4g}, {1e6 * found.rt:.4g} um",
        ),
        ("Rsm, Rdq", f"{'-' if found.rsm != found.rsm else f'{1e6 * found.rsm:.4g} um'}, {found.rdq:.3g}"),
        ("Rk, Rpk, Rvk", f"{1e6 * found.rk:.4g}, {1e6 * found.rpk:.4g}, {1e6 * found.rvk:.4g} um"),
        ("Rmr1, Rmr2", f"{100 * found.rmr1:.3g}, {100 * found.rmr2:.3g} %"),
    ]
