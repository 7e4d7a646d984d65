"""`asperity sensitivity` and `asperity calibrate`: what a wear study hangs on, and what would meet what is known."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from asperity import paper, report, study
from asperity.cli.app import app
from asperity.cli.options import (
    AsJson,
    CaseOrRun,
    Cells,
    OutFolder,
    Overrides,
    Quiet,
    SampleSeed,
    Seeds,
    Workers,
    chosen_case,
    lengths,
    require_output,
)
from asperity.cli.output import Block, columns, show, table
from asperity.cli.study import study_progress
from asperity.core import files
from asperity.core.errors import BadInput
from asperity.core.quantities import NO_VALUE

if TYPE_CHECKING:
    from asperity.study import Calibration, Sensitivity

WORTH_A_LINE = 0.5  # gain in misfit from which giving an anchor up is
PART = 0.2  # weight from which a quantity has a part in a direction
MORRIS = (
    "  mu*: mean size of the effect of crossing a factor's range, ± its 95 % half-width; mu: with its sign;",
    "  sigma: how much it varies with the other factors. SI: CAR and CLR are shares.",
)
SOBOL = (
    "  S1: share of the variance that a factor has alone; ST: with all its interactions; ± 95 % half-widths.",
)


@app.command()
def sensitivity(
    path: CaseOrRun,
    method: Annotated[
        str, typer.Option(help="morris: elementary effects; sobol: shares of variance.")
    ] = "morris",
    vary: Annotated[
        list[str] | None,
        typer.Option(
            metavar="KEY=LOW..HIGH",
            help="A range; may be repeated. By default what the paper leaves open.",
        ),
    ] = None,
    trajectories: Annotated[
        int | None, typer.Option(metavar="N", help="Of morris; default 12.")
    ] = None,
    samples: Annotated[
        int | None, typer.Option(metavar="N", help="Of sobol, a power of two; default 64.")
    ] = None,
    sq: Annotated[
        list[str] | None,
        typer.Option(
            metavar="LENGTH",
            help="Read the curves there; may be repeated. Default 0.5, 1, 2.5, 4 um.",
        ),
    ] = None,
    levels: Annotated[
        int, typer.Option(metavar="N", min=0, help="Roughness levels, for the knee of CRF.")
    ] = 8,
    cells: Cells = 128,
    seeds: Seeds = 1,
    sample_seed: SampleSeed = 0,
    overrides: Overrides = None,
    workers: Workers = None,
    out: OutFolder = None,
    figure: Annotated[
        Path | None, typer.Option(metavar="PNG|PDF", help="Draw factors over outcomes.")
    ] = None,
    as_json: AsJson = False,
    quiet: Quiet = False,
) -> None:
    """Find which open choices move CAR, CLR, CRF, CRFA and the knee of the curve over Sq most."""
    size = _sample_size(method, trajectories, samples)
    chosen = chosen_case(path, overrides)
    require_output(figure, ".png", ".pdf", option="--figure")
    if out is not None:
        files.make_folder(out)
    with study_progress(chosen.source, quiet=quiet) as step:
        result = study.sensitivity(
            chosen,
            settings=study.SensitivitySettings(
                vary=vary,
                method=method,  # type: ignore[arg-type]
                size=size,
                sq=lengths("--sq", sq) or study.SQ_LEVELS,
                levels=levels,
                cells=cells,
                seeds=seeds,
                sample_seed=sample_seed,
            ),
            out=None if out is None else out / "study",
            workers=workers,
            progress=step,
        )
    kept: dict[str, str] = {}
    if out is not None:
        kept["effects"] = str(out / "effects.csv")
        files.write_csv(out / "effects.csv", result.effects)
    if figure is not None:
        kept["figure"] = str(report.write_figure(report.sensitivity_figure(result), figure))
    show(
        result.verdict(),
        lambda: {**result.scalars(), **kept},
        _effects(result),
        _ranges(result),
        table(kept.items()),
        as_json=as_json,
        quiet=quiet,
    )


def _sample_size(method: str, trajectories: int | None, samples: int | None) -> int | None:
    if method not in ("morris", "sobol"):
        raise BadInput(f"--method must be morris or sobol, got {method}")
    size, other = (trajectories, samples) if method == "morris" else (samples, trajectories)
    if other is not None:
        wrong, right = (
            ("--samples", "--trajectories")
            if method == "morris"
            else ("--trajectories", "--samples")
        )
        raise BadInput(f"{wrong} does not go with --method {method}; give {right}")
    return size


def _effects(result: "Sensitivity") -> Block:
    """The factors of each outcome, what moves it most first."""
    values = result.scalars()
    morris = values["method"] == "morris"
    yield from MORRIS if morris else SOBOL
    width = max(
        len(effect["factor"]) for outcome in values["outcomes"] for effect in outcome["effects"]
    )
    for outcome in values["outcomes"]:
        yield f"\n  {outcome['outcome']}: {outcome['p05']:.4g} to {outcome['p95']:.4g} (5 to 95 %)"
        for effect in outcome["effects"]:
            row = {key: float("nan") if value is None else value for key, value in effect.items()}
            if morris:
                size = f"mu* {row['mu_star']:9.3g} ± {row['mu_star_conf']:<8.2g}"
                line = f"{size} mu {row['mu']:+9.3g}  sigma {row['sigma']:.3g}"
            else:
                line = f"S1 {row['s1']:6.3f} ± {row['s1_conf']:<6.2g} ST {row['st']:6.3f} ± {row['st_conf']:.2g}"
            yield f"    {row['factor']:{width}}  {line}"


def _ranges(result: "Sensitivity") -> Block:
    """What was varied, from where to where, and what to know of the effects."""
    values = result.scalars()
    rows = [
        (factor["key"], f"{factor['low']:g} to {factor['high']:g} {factor['unit']}".rstrip())
        for factor in values["factors"]
    ]
    notes = []
    if values["left_out"]:
        points = f"{values['left_out']} of {values['points']} points"
        notes.append(f"{points} are left out of some outcome: a contact failed")
    if values["silent"] > 0.0:
        notes.append(
            f"{100 * values['silent']:.0f} % of the contacts run in full film, without a resonance; "
            "their CRF counts as that of CLR 1 %, their CRFA as the least heard"
        )
    if values["distinct"] is not None:
        share = f"{100 * values['distinct']:.0f} %"
        notes.append(f"{share} of the curves of CRF have a distinct stage; the knee is that of all")
    yield from table([*rows, ("contacts", f"{values['cases']}, {values['failed']} failed")], notes)


@app.command()
def calibrate(
    path: CaseOrRun,
    anchors: Annotated[
        Path | None,
        typer.Option(metavar="ANCHORS.toml", help="What to meet; by default the paper's numbers."),
    ] = None,
    free: Annotated[
        list[str] | None,
        typer.Option(
            metavar="KEY=LOW..HIGH",
            help="A range to search; may be repeated. Default: see the docs.",
        ),
    ] = None,
    level: Annotated[
        list[str] | None,
        typer.Option(
            metavar="LENGTH",
            help="A roughness to solve at; may be repeated. By default the anchors'.",
        ),
    ] = None,
    cells: Cells = 128,
    seeds: Seeds = 3,
    screened: Annotated[
        int, typer.Option(metavar="N", min=1, help="Sets of values tried to find starts.")
    ] = 32,
    starts: Annotated[
        int, typer.Option(metavar="N", min=1, help="How many of the best to start from.")
    ] = 2,
    sample_seed: SampleSeed = 0,
    overrides: Overrides = None,
    workers: Workers = None,
    out: OutFolder = None,
    as_json: AsJson = False,
    quiet: Quiet = False,
) -> None:
    """Find the free quantities with which the wear curve best meets anchors, and what that leaves open."""
    aims = paper.PAPER_ANCHORS if anchors is None else paper.load_anchors(anchors)
    chosen = chosen_case(path, overrides)
    if out is not None:
        files.make_folder(out)
    with study_progress(chosen.source, quiet=quiet) as step:
        result = study.calibrate(
            chosen,
            aims,
            settings=study.CalibrationSettings(
                free=free,
                levels=lengths("--level", level),
                cells=cells,
                seeds=seeds,
                screened=screened,
                starts=starts,
                sample_seed=sample_seed,
            ),
            out=out,
            workers=workers,
            progress=step,
        )
    kept = {} if out is None else _keep(result, out)
    after = (
        [*kept.items(), ("try next", f"asperity study {kept['calibrated']} --out DIR")]
        if kept
        else []
    )
    show(
        result.verdict(),
        lambda: {**result.scalars(), **kept},
        _parameters(result),
        _anchors(result),
        _directions(result),
        _trade_offs(result),
        _effort(result),
        table(after)
        if after
        else ["  Nothing is kept; --out DIR keeps the calibrated case, tables and figure."],
        as_json=as_json,
        quiet=quiet,
    )


def _keep(result: "Calibration", out: Path) -> dict[str, str]:
    """Write the case, the table and the figure."""
    paths = {"calibrated": out / "calibrated.toml", "anchors": out / "anchors.csv"}
    files.write_text(paths["calibrated"], study.calibrated_text(result, out))
    files.write_csv(paths["anchors"], study.anchor_table(result))
    paths["figure"] = report.write_figure(
        report.calibration_figure(result), out / "calibration.png"
    )
    return {name: str(kept) for name, kept in paths.items()}


def _parameters(result: "Calibration") -> Block:
    yield "  found, with one standard deviation; learnt: how much of the range's variance the anchors took away"
    for row in result.scalars()["parameters"]:
        start = "none" if row["start"] is None else f"{row['start']:.4g}"
        value = f"{row['value']:.4g} {row['unit']}".rstrip()
        known = f"({row['low']:.4g} to {row['high']:.4g}; was {start}), learnt {100 * row['learnt']:.0f} %"
        yield f"    {row['key']:28}  {value} {known}{'' if row['identifiable'] else ', NOT DETERMINED'}"


def _anchors(result: "Calibration") -> Block:
    """What was wanted, and what the case as given, the fit and its check have."""
    values = result.scalars()
    given, check = ({row["anchor"]: row for row in values[name]} for name in ("start", "check"))
    aimed = {anchor.name for anchor in result.aimed_at}
    yield f"  misfit {values['misfit']:.3g} (was {values['start_misfit']:.3g}): sum of squared misses in tolerances"
    rows = []
    for row in values["fit"]:
        name = row["anchor"]
        if name in given and name in check:
            mean, low, high = (_number(check[name][key]) for key in ("ours", "low", "high"))
            numbers = [
                _number(value) for value in (row["printed"], given[name]["ours"], row["ours"])
            ]
            rows.append(["*" if name in aimed else "", name, *numbers, f"{mean} ({low} to {high})"])
    titles = ["", "", "wanted", "as given", "fitted", "checked (90 % over surfaces)"]
    yield from columns(titles, rows, left=2)
    yield "  * aimed at; checked: on the case's own cells, on surfaces that the fit has not seen"


def _number(value: float | None) -> str:
    return NO_VALUE if value is None else f"{value:.4g}"


def _directions(result: "Calibration") -> Block:
    yield "  directions in the ranges (shares of them), the best determined first"
    for direction in result.scalars()["directions"]:
        parts = [
            f"{weight:+.2f} {key}"
            for key, weight in direction["weights"].items()
            if abs(weight) >= PART
        ]
        known = f"± {direction['std']:.2g} of a range" if direction["determined"] else "open"
        yield f"    {known:18}  {', '.join(parts)}"


def _trade_offs(result: "Calibration") -> Block:
    dearest = [trade for trade in result.trade_offs if trade.misfit - trade.without > WORTH_A_LINE]
    if dearest:
        yield "  what the others would gain without an anchor, by slopes"
    for trade in dearest:
        yield (
            f"    {trade.given_up}: misfit of the others {trade.misfit:.1f} to {trade.without:.1f}; "
            f"most {trade.relieved}, {trade.miss:+.1f} to {trade.miss_without:+.1f} tolerances"
        )


def _effort(result: "Calibration") -> Block:
    contacts = f"{result.cases} contacts, {result.failed} failed"
    yield f"  {result.evaluations} sets of values, {contacts}, {study.duration_text(result.seconds)}"
