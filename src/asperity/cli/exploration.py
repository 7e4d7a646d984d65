"""`asperity sensitivity` and `asperity calibrate`: what a wear study hangs on, and what would meet what is known."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from asperity.cli.app import AsJson, Quiet, app
from asperity.cli.common import chosen_case, print_json, print_rows, write_text
from asperity.cli.study import shown_study
from asperity.errors import BadInput
from asperity.files import make_folder

if TYPE_CHECKING:
    from asperity.case import Case
    from asperity.study import Calibration, Sensitivity

CaseFile = Annotated[Path, typer.Argument(metavar="CASE.toml|RUN.nc", help="A case file, or a run.")]
Override = Annotated[
    list[str] | None,
    typer.Option("--set", metavar="KEY=VALUE", help="Replace a value of the case: contact.load='400 N'."),
]
Workers = Annotated[int | None, typer.Option(metavar="N", min=1, help="Processes; default: all processors.")]
Cells = Annotated[int, typer.Option(metavar="N", min=8, help="Cells along each axis of the widest domain.")]


@app.command()
def sensitivity(
    case: CaseFile,
    method: Annotated[str, typer.Option(help="morris: elementary effects; sobol: shares of variance.")] = "morris",
    vary: Annotated[
        list[str] | None,
        typer.Option(metavar="KEY=LOW..HIGH", help="A range; may be repeated. By default what the paper leaves open."),
    ] = None,
    trajectories: Annotated[int | None, typer.Option(metavar="N", help="Of morris; default 12.")] = None,
    samples: Annotated[int | None, typer.Option(metavar="N", help="Of sobol, a power of two; default 64.")] = None,
    sq: Annotated[
        list[str] | None,
        typer.Option(metavar="LENGTH", help="Read the curves there; may be repeated. Default 0.5, 1, 2.5, 4 um."),
    ] = None,
    levels: Annotated[int, typer.Option(metavar="N", min=0, help="Roughness levels, for the knee of CRF.")] = 8,
    cells: Cells = 128,
    seeds: Annotated[int, typer.Option(metavar="N", min=1, help="Surfaces that each point is the mean of.")] = 1,
    sample_seed: Annotated[int, typer.Option(metavar="SEED", min=0, help="Of sample and surfaces.")] = 0,
    override: Override = None,
    workers: Workers = None,
    out: Annotated[Path | None, typer.Option(metavar="DIR", help="Keep study and effects; goes on from it.")] = None,
    figure: Annotated[Path | None, typer.Option(metavar="PNG|PDF", help="Draw factors over outcomes.")] = None,
    as_json: AsJson = False,
    quiet: Quiet = False,
) -> None:
    """Find which open choices move CAR, CLR, CRF, CRFA and the knee of the curve over Sq most."""
    from asperity.case import read_length
    from asperity.study import SQ_LEVELS
    from asperity.study import sensitivity as find

    if method not in ("morris", "sobol"):
        raise BadInput(f"--method must be morris or sobol, got {method}")
    size, other = (trajectories, samples) if method == "morris" else (samples, trajectories)
    if other is not None:
        wrong, right = ("--samples", "--trajectories") if method == "morris" else ("--trajectories", "--samples")
        raise BadInput(f"{wrong} does not go with --method {method}; give {right}")
    chosen = chosen_case(case, None, override or [])
    _require_figure(figure)
    if out is not None:
        make_folder(out)
    with shown_study(chosen.source, quiet=quiet) as tell:
        found = find(
            chosen,
            vary=vary,
            method=method,  # type: ignore[arg-type]
            size=size,
            sq=[read_length("--sq", text) for text in sq] if sq else SQ_LEVELS,
            levels=levels,
            cells=cells,
            seeds=seeds,
            sample_seed=sample_seed,
            out=None if out is None else out / "study",
            workers=workers,
            progress=tell,
        )
    files = {}
    if out is not None:
        files["effects"] = out / "effects.csv"
        write_text(files["effects"], found.effects.to_csv(index=False))
    if figure is not None:
        from asperity.report import sensitivity_figure, write_figure

        files["figure"] = write_figure(sensitivity_figure(found), figure)
    named = {name: str(path) for name, path in files.items()}
    if as_json:
        print_json({**found.scalars(), **named})
        return
    print(found.verdict())
    if not quiet:
        _print_effects(found)
        if named:
            print()
            print_rows(list(named.items()))


@app.command()
def calibrate(
    case: CaseFile,
    anchors: Annotated[
        Path | None, typer.Option(metavar="ANCHORS.toml", help="What to meet; by default the paper's numbers.")
    ] = None,
    free: Annotated[
        list[str] | None,
        typer.Option(metavar="KEY=LOW..HIGH", help="A range to search; may be repeated. Default: see the docs."),
    ] = None,
    level: Annotated[
        list[str] | None,
        typer.Option(metavar="LENGTH", help="A roughness to solve at; may be repeated. By default the anchors'."),
    ] = None,
    cells: Cells = 128,
    seeds: Annotated[int, typer.Option(metavar="N", min=1, help="Surfaces a level.")] = 3,
    screened: Annotated[int, typer.Option(metavar="N", min=1, help="Sets of values tried to find starts.")] = 32,
    starts: Annotated[int, typer.Option(metavar="N", min=1, help="How many of the best to start from.")] = 2,
    sample_seed: Annotated[int, typer.Option(metavar="SEED", min=0, help="Of the sets tried.")] = 0,
    override: Override = None,
    workers: Workers = None,
    out: Annotated[
        Path | None, typer.Option(metavar="DIR", help="Keep calibrated.toml, tables, figure and every evaluation.")
    ] = None,
    as_json: AsJson = False,
    quiet: Quiet = False,
) -> None:
    """Find the free quantities with which the wear curve best meets anchors, and what that leaves open."""
    from asperity.case import read_length
    from asperity.paper import PAPER_ANCHORS, load_anchors
    from asperity.study import calibrate as find

    wanted = PAPER_ANCHORS if anchors is None else load_anchors(anchors)
    chosen = chosen_case(case, None, override or [])
    if out is not None:
        make_folder(out)
    with shown_study(chosen.source, quiet=quiet) as tell:
        found = find(
            chosen,
            wanted,
            free=free,
            levels=[read_length("--level", text) for text in level] if level else None,
            cells=cells,
            seeds=seeds,
            screened=screened,
            starts=starts,
            sample_seed=sample_seed,
            out=out,
            workers=workers,
            progress=tell,
        )
    files = {} if out is None else {name: str(path) for name, path in _keep(found, out).items()}
    if as_json:
        print_json({**found.scalars(), **files})
        return
    print(found.verdict())
    if not quiet:
        _print_calibration(found)
        print()
        if files:
            print_rows([*files.items(), ("try next", f"asperity study {files['calibrated']} --out DIR")])
        else:
            print("  Nothing is kept; --out DIR keeps the calibrated case, tables and figure.")


def _require_figure(path: Path | None) -> None:
    from asperity.files import require_writable

    if path is None:
        return
    if path.suffix not in (".png", ".pdf"):
        raise BadInput(f"--figure must be a file that ends in .png or .pdf, got {path}")
    require_writable(path)


def _print_effects(found: "Sensitivity") -> None:
    morris = found.method == "morris"
    if morris:
        print(
            "\n  mu*: mean size of the effect of crossing a factor's range, ± its 95 % half-width; mu: with its sign;"
        )
        print("  sigma: how much it varies with the other factors. CAR and CLR are shares, CRF in Hz, the knee in m.")
    else:
        print(
            "\n  S1: share of the variance that a factor has alone; ST: with all its interactions; ± 95 % half-widths."
        )
    width = max(len(name) for name in found.factors)
    for outcome in found.outcomes:
        low, high = found.spread(outcome.name)
        print(f"\n  {outcome.name}: {low:.4g} to {high:.4g} (5 to 95 %)")
        for row in found.ranking(outcome.name).to_dict("records"):
            if morris:
                size = f"mu* {row['mu_star']:9.3g} ± {row['mu_star_conf']:<8.2g}"
                text = f"{size} mu {row['mu']:+9.3g}  sigma {row['sigma']:.3g}"
            else:
                text = f"S1 {row['s1']:6.3f} ± {row['s1_conf']:<6.2g} ST {row['st']:6.3f} ± {row['st_conf']:.2g}"
            print(f"    {row['factor']:{width}}  {text}")
    print()
    rows = [(str(entry.key), f"{entry.low:g} to {entry.high:g} {entry.unit}".rstrip()) for entry in found.ranges]
    print_rows([*rows, ("contacts", f"{len(found.result.plan.cases)}, {found.result.failed} failed")])
    if found.left_out:
        print(f"  note: {found.left_out} of {len(found.values)} points are left out of some outcome: a contact failed")
    if found.silent > 0.0:
        print(
            f"  note: {100 * found.silent:.0f} % of the contacts run in full film, without a resonance; "
            "their CRF counts as that of CLR 1 %, their CRFA as the least heard"
        )
    if found.distinct == found.distinct:
        print(
            f"  note: {100 * found.distinct:.0f} % of the curves of CRF have a distinct stage; the knee is that of all"
        )


def _print_calibration(found: "Calibration") -> None:
    print("\n  found, with one standard deviation; learnt: how much of the range's variance the anchors took away")
    for one in found.parameters:
        unit = f" {one.range.unit}" if one.range.unit else ""
        start = "none" if one.start is None else f"{one.start:.4g}"
        text = f"{one.value:.4g}{unit} ({one.low:.4g} to {one.high:.4g}; was {start}), learnt {100 * one.learnt:.0f} %"
        print(f"    {one.range.key:28}  {text}{'' if one.identifiable else ', NOT DETERMINED'}")
    aimed = {anchor.name for anchor in found.aimed_at}
    print(f"\n  misfit {found.misfit:.3g} (was {found.start_misfit:.3g}): sum of squared misses in tolerances")
    print(f"    {'':42}  {'wanted':>10}  {'as given':>10}  {'fitted':>10}  checked (90 % over surfaces)")
    given, check = ({row["anchor"]: row for row in t.to_dict("records")} for t in (found.start, found.check))
    for row in found.fit.to_dict("records"):
        name = row["anchor"]
        if name in given and name in check:
            there = check[name]
            print(
                f"  {'*' if name in aimed else ' '} {name:42}  {row['printed']:10.4g}  {given[name]['ours']:10.4g}"
                f"  {row['ours']:10.4g}  {there['ours']:.4g} ({there['low']:.4g} to {there['high']:.4g})"
            )
    print("  * aimed at; checked: on the case's own cells, on surfaces that the fit has not seen")
    print("\n  directions in the ranges (shares of them), the best determined first")
    for direction in found.directions:
        parts = ", ".join(
            f"{weight:+.2f} {one.range.key}"
            for weight, one in zip(direction.weights, found.parameters, strict=True)
            if abs(weight) >= 0.2
        )
        known = f"± {direction.std:.2g} of a range" if direction.determined else "open"
        print(f"    {known:18}  {parts}")
    dearest = [trade for trade in found.trade_offs if trade.misfit - trade.without > 0.5]
    if dearest:
        print("\n  what the others would gain without an anchor, by slopes")
        for trade in dearest:
            print(
                f"    {trade.given_up}: misfit of the others {trade.misfit:.1f} to {trade.without:.1f}; "
                f"most {trade.relieved}, {trade.miss:+.1f} to {trade.miss_without:+.1f} tolerances"
            )
    print(
        f"\n  {found.evaluations} sets of values, {found.cases} contacts, {found.failed} failed, {found.seconds:.0f} s"
    )


def _keep(found: "Calibration", out: Path) -> dict[str, Path]:
    """Write the case, the tables and the figure."""
    from asperity.report import calibration_figure, write_figure

    tables = [("as given", found.start), ("fitted", found.fit), ("checked", found.check)]
    files = {name: out / f"{name}.{suffix}" for name, suffix in (("calibrated", "toml"), ("anchors", "csv"))}
    write_text(files["calibrated"], calibrated_text(found, out))
    import pandas

    write_text(files["anchors"], pandas.concat([t.assign(curve=name) for name, t in tables]).to_csv(index=False))
    files["figure"] = write_figure(calibration_figure(found), out / "calibration.png")
    return files


def calibrated_text(found: "Calibration", folder: Path) -> str:
    """The calibrated case as a file in `folder`, what it meets above it."""
    lines = [f"# {found.case.source}, calibrated by asperity. {found.verdict()}"]
    return "\n".join([*lines, "", _moved(found.calibrated, folder).text])


def _moved(case: "Case", folder: Path) -> "Case":
    """The case with its surface files named as seen from `folder`."""
    from asperity.case import relative_path
    from asperity.study import stated_value

    files = {key: stated_value(case, key) for key in ("surface.file", "surface.second.file")}
    moved = {key: relative_path(case.folder / name, folder) for key, name in files.items() if name is not None}
    return case.with_overrides(moved) if moved else case
