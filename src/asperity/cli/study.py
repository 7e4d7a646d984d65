"""The command that sweeps a case: in processes here, on dask's workers, or shard by shard; resumes by itself."""

import re
from collections.abc import Callable, Iterator
from contextlib import contextmanager, nullcontext
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from asperity.cli.app import AsJson, Quiet, app
from asperity.cli.common import busy, chosen_case, print_json, print_rows, require_output
from asperity.errors import AsperityError, BadInput

if TYPE_CHECKING:
    from asperity.study import StudyCost, StudyPlan, StudyProgress, StudyResult

SHOWN_FAILURES = 5


@app.command()
def study(
    case: Annotated[Path, typer.Argument(metavar="CASE.toml", help="A case with a [study].")],
    out: Annotated[Path | None, typer.Option(metavar="DIR", help="Folder of the study; what it holds is kept.")] = None,
    workers: Annotated[int | None, typer.Option(metavar="N", min=1, help="Processes; default: all processors.")] = None,
    executor: Annotated[
        str | None, typer.Option(metavar="dask:ADDRESS", help="Compute on a dask scheduler's workers.")
    ] = None,
    shard: Annotated[str, typer.Option(metavar="k/N", help="Compute the k-th of N equal shares.")] = "1/1",
    retry_failed: Annotated[bool, typer.Option("--retry-failed", help="Compute failed cases again.")] = False,
    merge: Annotated[
        list[Path] | None, typer.Option(metavar="DIR", help="Take over the cases of another folder of this study.")
    ] = None,
    fields: Annotated[
        str | None, typer.Option(metavar="NAMES", help="Maps to keep: pressure,gap,in_contact,surface_height.")
    ] = None,
    override: Annotated[
        list[str] | None,
        typer.Option("--set", metavar="KEY=VALUE", help="Replace a value of the case: study.seeds=10."),
    ] = None,
    dry_run: Annotated[bool, typer.Option("--dry-run", help="Say what it would cost; keep nothing.")] = False,
    report: Annotated[Path | None, typer.Option(metavar="OUT.html", help="Make the page of the study too.")] = None,
    figures: Annotated[
        Path | None, typer.Option(metavar="DIR", help="Write the figures as PDF and PNG and the tables as csv too.")
    ] = None,
    as_json: AsJson = False,
    quiet: Quiet = False,
) -> None:
    """Sweep a case: every point of its [study], several surfaces each; goes on where it was stopped."""
    from asperity.study import estimate_study, plan_study, run_study

    part = _shard(shard)
    if out is None and not dry_run:
        raise BadInput("study needs a folder to keep its cases in; give --out DIR")
    if report is not None and not _in_folder_to_come(report, out):
        require_output(report, ".html", "--report")
    plan = plan_study(chosen_case(case, None, override or []))
    if dry_run:
        _print_estimate(plan, estimate_study(plan, out=out, workers=workers, shard=part), as_json=as_json)
        return
    with _executor(executor) as chosen, shown_study(case.name, quiet=quiet) as tell:
        result = run_study(
            plan,
            out=out,
            executor=chosen,
            workers=workers,
            shard=part,
            retry_failed=retry_failed,
            fields=tuple(name.strip() for name in (fields or "").split(",") if name.strip()),
            merge_from=merge or (),
            progress=tell,
        )
    made = _make_page(result, report, figures, quiet=quiet)
    if as_json:
        print_json({**study_scalars(result), **made})
    else:
        print(study_verdict(result))
        if not quiet:
            _print_study(result, made)
    share = sum(one.number % part[1] == part[0] - 1 for one in plan.cases)
    if result.failed:
        raise AsperityError(
            f"{result.failed} of {len(result.table)} cases failed; the first: {result.failures['reason'].iloc[0]}; "
            "--retry-failed computes them again"
        )
    if len(result.table) < share:
        raise AsperityError(f"{share - len(result.table)} cases are missing; run the study again")


def study_verdict(result: "StudyResult") -> str:
    """One sentence: how much of the study there is, and what it says."""
    from asperity.study import curve_of, is_wear_study

    planned, there = len(result.plan.cases), len(result.table)
    share = f"{there} cases" if there == planned else f"{there} of {planned} cases"
    sentence = f"{share}, {result.failed or 'none'} failed"
    if result.computed:
        sentence += f"; {result.computed} computed in {_time(result.seconds)}"
    if there == planned and is_wear_study(result) and there > result.failed:
        sentence += f". {curve_of(result).verdict()}"
    return f"{sentence.rstrip('.')}."


def study_scalars(result: "StudyResult") -> dict[str, Any]:
    """A study as `--json` prints it."""
    from asperity.study import curve_of, is_wear_study

    scalars: dict[str, Any] = {
        "verdict": study_verdict(result),
        "cases": len(result.table),
        "planned": len(result.plan.cases),
        "computed": result.computed,
        "failed": result.failed,
        "seconds": result.seconds,
        "table": None if result.path is None else str(result.path),
        "axes": list(result.plan.axes),
        "seeds": result.plan.realisations,
    }
    complete = len(result.table) == len(result.plan.cases)
    if complete and is_wear_study(result) and len(result.table) > result.failed:
        stages = curve_of(result).stages
        scalars["stages"] = {
            name: {
                "kind": found.kind,
                "split_um": found.split if found.found else None,
                "interval_um": list(found.interval) if found.found else None,
                "verdict": found.verdict,
            }
            for name, found in stages.items()
        }
    return scalars


@contextmanager
def shown_study(label: str, *, quiet: bool) -> "Iterator[Callable[[StudyProgress], None] | None]":
    """Show cases done, rate, failures and time left on a terminal."""
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, TextColumn, TimeElapsedColumn
    from rich.progress import Progress as Bar

    console = Console(stderr=True)
    if quiet or not console.is_terminal:
        yield None
        return
    text = TextColumn("{task.fields[rate]}  {task.fields[failed]}  {task.fields[left]}")
    with Bar(
        TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), text, TimeElapsedColumn(), console=console
    ) as bar:
        task = bar.add_task(label, total=None, rate="starting workers ...", failed="", left="")

        def tell(progress: "StudyProgress") -> None:
            left = progress.seconds_left
            bar.update(
                task,
                total=progress.total,
                completed=progress.kept + progress.done,
                rate=f"{progress.rate:.2g} cases/s" if progress.done else "starting workers ...",
                failed=f"{progress.failed} failed",
                left="" if left is None else f"{_time(left)} left",
            )

        yield tell


def _executor(name: str | None) -> Any:
    from asperity.study import dask_executor

    if name is None:
        return nullcontext()
    kind, _, address = name.partition(":")
    if kind != "dask" or not address:
        raise BadInput(f"--executor must be dask:ADDRESS such as dask:tcp://127.0.0.1:8786, got {name}")
    return dask_executor(address)


def _shard(text: str) -> tuple[int, int]:
    written = re.fullmatch(r"(\d+)/(\d+)", text)
    if written is None or not 1 <= int(written[1]) <= int(written[2]):
        raise BadInput(f"--shard must be k/N with 1 <= k <= N, such as 1/3, got {text}")
    return int(written[1]), int(written[2])


def _in_folder_to_come(report: Path, out: Path | None) -> bool:
    """Whether a page is to lie in the study's folder, which the study makes."""
    return (
        out is not None and not out.exists() and report.suffix == ".html" and report.resolve().parent == out.resolve()
    )


def _make_page(result: "StudyResult", report: Path | None, figures: Path | None, *, quiet: bool) -> dict[str, str]:
    if report is None and figures is None:
        return {}
    from asperity.report import write_study_report

    assert result.folder is not None
    page = report or result.folder / "report.html"
    with busy("drawing the report", quiet=quiet) as tell:
        write_study_report(result, page, figures=figures, progress=tell)
    return {"report": str(page), **({} if figures is None else {"figures": str(figures)})}


def _print_study(result: "StudyResult", made: dict[str, str]) -> None:
    from asperity.study import as_written, curve_of, is_wear_study

    print()
    if is_wear_study(result) and len(result.table) > result.failed:
        _print_curve(curve_of(result).summary())
    for _, row in result.failures.head(SHOWN_FAILURES).iterrows():
        chosen = result.plan.cases[row["number"]].overrides
        where = ", ".join(f"{key} = {as_written(chosen[key])}" for key in result.plan.axes if key in chosen)
        print(f"  failed: {where}, realisation {row['realisation']}: {row['reason']}")
    if result.failed > SHOWN_FAILURES:
        print(f"  ... and {result.failed - SHOWN_FAILURES} more; column reason of the table")
    rows = [("table", f"{result.path}")]
    rows += list(made.items())
    if not made:
        rows.append(("its page", f"asperity report {result.folder}"))
    print_rows(rows)


def _print_curve(levels: Any) -> None:
    from rich.console import Console
    from rich.table import Table

    table = Table(box=None, pad_edge=False, header_style="")
    shown = [
        ("Sq um", "sq_um", 1.0, 2),
        ("CAR %", "car", 100.0, 1),
        ("CAR domain %", "car_domain", 100.0, 1),
        ("CLR %", "clr", 100.0, 1),
        ("CRF Hz", "crf_sound_hz", 1.0, 0),
        ("CRFA", "crfa_sound", 1.0, 4),
    ]
    shown = [entry for entry in shown if entry[1] in levels]
    for title, *_ in shown:
        table.add_column(title, justify="right")
    for _, row in levels.iterrows():
        cells = []
        for _, name, scale, digits in shown:
            std = row.get(f"{name}_std")
            spread = f" ± {scale * std:.{digits}f}" if std is not None and std == std else ""
            cells.append(f"{scale * row[name]:.{digits}f}{spread}")
        table.add_row(*cells)
    Console(highlight=False, width=110).print(table)
    print("  mean ± standard deviation over the surfaces of a level; CRFA in (m/s^2)^2/Hz\n")


def _print_estimate(plan: "StudyPlan", cost: "StudyCost", *, as_json: bool) -> None:
    verdict = (
        f"{cost.cases} cases, {cost.kept} of them kept already: about {_time(cost.seconds)} on {cost.workers} "
        f"{'worker' if cost.workers == 1 else 'workers'}"
    )
    if as_json:
        print_json(
            {
                "verdict": f"{verdict}.",
                "cases": cost.cases,
                "kept": cost.kept,
                "points": len(plan.points),
                "seeds": plan.realisations,
                "seconds_a_case": cost.case_s,
                "seconds": cost.seconds,
                "workers": cost.workers,
            }
        )
        return
    print(f"{verdict}.")
    print()
    print_rows(
        [
            ("points", f"{len(plan.points)}, over {', '.join(plan.axes) or 'seeds alone'}"),
            ("surfaces a point", str(plan.realisations)),
            ("a case takes", f"{cost.case_s:.3g} s on one worker, mean of {cost.tried} tried"),
        ]
    )


def _time(seconds: float) -> str:
    if seconds < 100:
        return f"{seconds:.0f} s" if seconds >= 10 else f"{seconds:.1f} s"
    return f"{seconds / 60:.0f} min" if seconds < 5400 else f"{seconds / 3600:.1f} h"
