"""`asperity sensitivity` and `asperity calibrate`: effect of open choices, and fit to anchors."""

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
    Seed,
    Surfaces,
    Workers,
    chosen_case,
    lengths,
)
from asperity.cli.output import Block, columns, show, table
from asperity.cli.study import study_progress
from asperity.core import files
from asperity.core.coverage import PERCENT
from asperity.core.errors import BadInput
from asperity.core.quantities import NO_VALUE

if TYPE_CHECKING:
    from asperity.study import Calibration, Sensitivity

MIN_GAIN = 0.5  # in misfit without an anchor, for a row
MIN_WEIGHT = 0.2  # of a quantity in a direction, to be shown
MORRIS = (
    "  mu*: mean absolute effect over a factor's range, ± its 95 % half-width; mu: mean effect;",
    "  sigma: its standard deviation over the other factors. SI units; CAR and CLR are fractions.",
)
SOBOL = (
    "  S1: first-order share of the variance; ST: total, with interactions; ± 95 % half-widths.",
)


MethodOption = Annotated[
    str, typer.Option(help="morris (elementary effects) or sobol (shares of variance).")
]
VaryOption = Annotated[
    list[str] | None,
    typer.Option(
        metavar="KEY=LOW..HIGH",
        help="Range of a factor (repeatable; default: what the paper leaves open).",
    ),
]
TrajectoriesOption = Annotated[
    int | None, typer.Option(metavar="N", help="Trajectories for morris (default: 12).")
]
SamplesOption = Annotated[
    int | None,
    typer.Option(metavar="N", help="Samples for sobol, a power of two (default: 64)."),
]
SqOption = Annotated[
    list[str] | None,
    typer.Option(
        metavar="LENGTH",
        help="Roughness at which outcomes are read (repeatable; default: 0.5, 1, 2.5, 4 um).",
    ),
]
LevelsOption = Annotated[
    int, typer.Option(metavar="N", min=0, help="Roughness levels, for the knee of CRF.")
]


@app.command()
def sensitivity(
    path: CaseOrRun,
    method: MethodOption = "morris",
    vary: VaryOption = None,
    trajectories: TrajectoriesOption = None,
    samples: SamplesOption = None,
    sq: SqOption = None,
    levels: LevelsOption = 8,
    cells: Cells = 128,
    surfaces: Surfaces = 1,
    seed: Seed = 0,
    overrides: Overrides = None,
    workers: Workers = None,
    out: OutFolder = None,
    as_json: AsJson = False,
    quiet: Quiet = False,
) -> None:
    """Rank inputs by their effect on CAR, CLR, CRF and CRFA."""
    size = _sample_size(method, trajectories, samples)
    chosen = chosen_case(path, overrides)
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
                seeds=surfaces,
                sample_seed=seed,
            ),
            out=None if out is None else out / "study",
            workers=workers,
            progress=step,
        )
    saved: dict[str, str] = {}
    if out is not None:
        files.write_csv(out / "effects.csv", result.effects)
        figure = report.write_figure(report.sensitivity_figure(result), out / "effects.png")
        saved = {"effects": str(out / "effects.csv"), "figure": str(figure)}
    show(
        result.verdict(),
        lambda: {**result.scalars(), **saved},
        _effects(result),
        _ranges(result),
        table(saved.items()),
        as_json=as_json,
        quiet=quiet,
    )


def _sample_size(method: str, trajectories: int | None, samples: int | None) -> int | None:
    if method not in ("morris", "sobol"):
        raise BadInput(f"--method must be morris or sobol, got {method}")
    size, other = (trajectories, samples) if method == "morris" else (samples, trajectories)
    if other is not None:
        refused, usable = (
            ("--samples", "--trajectories")
            if method == "morris"
            else ("--trajectories", "--samples")
        )
        raise BadInput(f"{refused} does not apply to --method {method}; use {usable}")
    return size


def _effects(result: "Sensitivity") -> Block:
    """Return the factors of each outcome, the largest effect first."""
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
                first = f"S1 {row['s1']:6.3f} ± {row['s1_conf']:<6.2g}"
                line = f"{first} ST {row['st']:6.3f} ± {row['st_conf']:.2g}"
            yield f"    {row['factor']:{width}}  {line}"


def _ranges(result: "Sensitivity") -> Block:
    """Return the ranges of the factors, and notes on the effects."""
    values = result.scalars()
    rows = [
        (factor["key"], f"{factor['low']:g} to {factor['high']:g} {factor['unit']}".rstrip())
        for factor in values["factors"]
    ]
    notes = []
    if values["left_out"]:
        points = f"{values['left_out']} of {values['points']} points"
        notes.append(f"{points} are missing from some outcomes: a contact failed")
    if values["silent"] > 0.0:
        notes.append(
            f"{100 * values['silent']:.0f} % of the contacts run in full film, without a "
            "resonance; they count with the CRF of CLR 1 % and the smallest observed CRFA"
        )
    if values["distinct"] is not None:
        share = f"{100 * values['distinct']:.0f} %"
        notes.append(f"{share} of the curves of CRF have a distinct stage; the knee uses all")
    yield from table([*rows, ("contacts", f"{values['cases']}, {values['failed']} failed")], notes)


AnchorsOption = Annotated[
    Path | None,
    typer.Option(metavar="ANCHORS.toml", help="Target values (default: the paper's)."),
]
FreeOption = Annotated[
    list[str] | None,
    typer.Option(
        metavar="KEY=LOW..HIGH",
        help="Search range of a free quantity (repeatable; default: see the docs).",
    ),
]
LevelOption = Annotated[
    list[str] | None,
    typer.Option(
        metavar="LENGTH",
        help="Roughness to solve at (repeatable; default: the anchors').",
    ),
]
ScreenedOption = Annotated[
    int, typer.Option(metavar="N", min=1, help="Parameter sets to screen for starting points.")
]
StartsOption = Annotated[int, typer.Option(metavar="N", min=1, help="Number of starting points.")]


@app.command()
def calibrate(
    path: CaseOrRun,
    anchors: AnchorsOption = None,
    free: FreeOption = None,
    level: LevelOption = None,
    cells: Cells = 128,
    surfaces: Surfaces = 3,
    screened: ScreenedOption = 32,
    starts: StartsOption = 2,
    seed: Seed = 0,
    overrides: Overrides = None,
    workers: Workers = None,
    out: OutFolder = None,
    as_json: AsJson = False,
    quiet: Quiet = False,
) -> None:
    """Fit free quantities so that the wear curve meets anchors."""
    targets = paper.PAPER_ANCHORS if anchors is None else paper.load_anchors(anchors)
    chosen = chosen_case(path, overrides)
    if out is not None:
        files.make_folder(out)
    with study_progress(chosen.source, quiet=quiet) as step:
        result = study.calibrate(
            chosen,
            targets,
            settings=study.CalibrationSettings(
                free=free,
                levels=lengths("--level", level),
                cells=cells,
                seeds=surfaces,
                screened=screened,
                starts=starts,
                sample_seed=seed,
            ),
            out=out,
            workers=workers,
            progress=step,
        )
    saved = {} if out is None else _save(result, out)
    after = (
        [*saved.items(), ("try next", f"asperity study {saved['calibrated']} --out DIR")]
        if saved
        else []
    )
    show(
        result.verdict(),
        lambda: {**result.scalars(), **saved},
        _parameters(result),
        _anchors(result),
        _directions(result),
        _trade_offs(result),
        _effort(result),
        table(after)
        if after
        else ["Nothing is saved; --out DIR saves the calibrated case, tables and figure."],
        as_json=as_json,
        quiet=quiet,
    )


def _save(result: "Calibration", out: Path) -> dict[str, str]:
    """Write the case, the table and the figure."""
    paths = {"calibrated": out / "calibrated.toml", "anchors": out / "anchors.csv"}
    files.write_text(paths["calibrated"], study.calibrated_text(result, out))
    files.write_csv(paths["anchors"], study.anchor_table(result))
    paths["figure"] = report.write_figure(
        report.calibration_figure(result), out / "calibration.png"
    )
    return {name: str(saved) for name, saved in paths.items()}


def _parameters(result: "Calibration") -> Block:
    yield "  fitted, with one standard deviation; learnt: reduction of the range's variance"
    for row in result.scalars()["parameters"]:
        start = "none" if row["start"] is None else f"{row['start']:.4g}"
        value = f"{row['value']:.4g} {row['unit']}".rstrip()
        interval = (
            f"({row['low']:.4g} to {row['high']:.4g}; was {start}), "
            f"learnt {100 * row['learnt']:.0f} %"
        )
        undetermined = "" if row["identifiable"] else ", NOT DETERMINED"
        yield f"    {row['key']:28}  {value} {interval}{undetermined}"


def _anchors(result: "Calibration") -> Block:
    """Return target values, and those of the case as given, of the fit and of its check."""
    values = result.scalars()
    original, check = ({row["anchor"]: row for row in values[name]} for name in ("start", "check"))
    fitted = {anchor.name for anchor in result.aimed_at}
    yield (
        f"  misfit {values['misfit']:.3g} (was {values['start_misfit']:.3g}): "
        "sum of squared deviations in tolerances"
    )
    rows = []
    for row in values["fit"]:
        name = row["anchor"]
        if name in original and name in check:
            mean, low, high = (_number(check[name][key]) for key in ("ours", "low", "high"))
            numbers = [
                _number(value) for value in (row["printed"], original[name]["ours"], row["ours"])
            ]
            rows.append(
                ["*" if name in fitted else "", name, *numbers, f"{mean} ({low} to {high})"]
            )
    titles = ["", "", "target", "as given", "fitted", f"checked ({PERCENT} over surfaces)"]
    yield from columns(titles, rows, left=2)
    yield "  * fitted; checked: on the case's own grid, on surfaces not used in the fit"


def _number(value: float | None) -> str:
    return NO_VALUE if value is None else f"{value:.4g}"


def _directions(result: "Calibration") -> Block:
    yield "  directions in parameter space (fractions of the ranges), best determined first"
    for direction in result.scalars()["directions"]:
        parts = [
            f"{weight:+.2f} {key}"
            for key, weight in direction["weights"].items()
            if abs(weight) >= MIN_WEIGHT
        ]
        deviation = f"± {direction['std']:.2g} of a range" if direction["determined"] else "open"
        yield f"    {deviation:18}  {', '.join(parts)}"


def _trade_offs(result: "Calibration") -> Block:
    improving = [trade for trade in result.trade_offs if trade.misfit - trade.without > MIN_GAIN]
    if improving:
        yield "  improvement of the other anchors without one of them, linearised"
    for trade in improving:
        yield (
            f"    without {trade.given_up}: misfit of the others from {trade.misfit:.1f} to "
            f"{trade.without:.1f}; deviation of {trade.relieved} from {trade.miss:+.1f} to "
            f"{trade.miss_without:+.1f} tolerances"
        )


def _effort(result: "Calibration") -> Block:
    contacts = f"{result.cases} contacts, {result.failed} failed"
    duration = study.duration_text(result.seconds)
    yield f"  {result.evaluations} parameter sets, {contacts}, {duration}"
