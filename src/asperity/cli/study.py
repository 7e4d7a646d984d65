"""`asperity study`: sweep a case, in local processes, on dask workers, or in shards; resumable."""

import re
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager, nullcontext
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from asperity import case, machines, report, study
from asperity.cli.app import app
from asperity.cli.options import (
    AsJson,
    Figures,
    OpenPage,
    OutFolder,
    Overrides,
    Page,
    Quiet,
    StandingRoughness,
    Workers,
    chosen_case,
    read_overrides,
    require_output,
)
from asperity.cli.output import Block, columns, progress, show, table, text
from asperity.cli.terminal.browser import open_page, require_opened
from asperity.core.errors import AsperityError, BadInput
from asperity.core.quantities import quantity

if TYPE_CHECKING:
    from concurrent.futures import Executor

    from asperity.study import StudyCost, StudyPlan, StudyProgress, StudyResult, WearCurve

SHOWN_FAILURES = 5
NOT_OF_MACHINES = (
    *("--report", "--figures", "--merge", "--executor", "--fields", "--retry-failed"),
    "--shard",
)
CURVE = ("car", "car_domain", "clr", "crf_sound_hz", "crfa_sound")


StudyArgument = Annotated[Path, typer.Argument(metavar="CASE.toml", help="Case with a [study].")]
ExecutorOption = Annotated[
    str | None,
    typer.Option(metavar="dask:ADDRESS", help="Compute on the workers of a dask scheduler."),
]
ShardOption = Annotated[
    str, typer.Option(metavar="k/N", help="Compute the k-th of N equal shares.")
]
RetryOption = Annotated[bool, typer.Option("--retry-failed", help="Repeat failed cases.")]
MergeOption = Annotated[
    list[Path] | None,
    typer.Option(
        metavar="DIR", help="Include the cases of another folder of this study (repeatable)."
    ),
]
FieldsOption = Annotated[
    str | None,
    typer.Option(
        metavar="NAMES",
        help="Fields to save: pressure,gap,in_contact,surface_height,run.",
    ),
]
DryRunOption = Annotated[
    bool, typer.Option("--dry-run", help="Estimate the cost without computing.")
]


@app.command("study")
def study_command(
    path: StudyArgument,
    out: OutFolder = None,
    workers: Workers = None,
    executor: ExecutorOption = None,
    shard: ShardOption = "1/1",
    retry_failed: RetryOption = False,
    merge: MergeOption = None,
    fields: FieldsOption = None,
    overrides: Overrides = None,
    snapshot: StandingRoughness = False,
    dry_run: DryRunOption = False,
    page: Page = None,
    opened: OpenPage = False,
    figures: Figures = None,
    as_json: AsJson = False,
    quiet: Quiet = False,
) -> None:
    """Sweep quantities of a case, on several surfaces; resumable."""
    part = _shard(shard)
    _require_places(out, page, dry_run=dry_run)
    require_opened(page, requested=opened)
    if _has_machine(path):
        _refuse_for_machine(page, figures, merge, executor, fields, retry_failed, part != (1, 1))
        replaced = read_overrides(overrides, snapshot=snapshot)
        return _sweep_machine(path, replaced, out, workers, (dry_run, as_json, quiet))
    plan = study.plan_study(chosen_case(path, overrides, snapshot=snapshot))
    if dry_run:
        cost = study.estimate_study(plan, out=out, workers=workers, shard=part)
        return _show_estimate(plan, cost, as_json=as_json, quiet=quiet)
    with _executor(executor) as pool, study_progress(path.name, quiet=quiet) as step:
        if merge:
            assert out is not None
            study.merge_studies(plan, merge, out=out, shard=part)
        result = study.run_study(
            plan,
            out=out,
            executor=pool,
            workers=workers,
            shard=part,
            retry_failed=retry_failed,
            fields=_fields(fields),
            progress=step,
        )
    page_rows = _make_page(result, page, figures, quiet=quiet)
    _show_result(result, page_rows, as_json=as_json, quiet=quiet)
    open_page(page, requested=opened)
    return _require_whole(result, part)


def _has_machine(path: Path) -> bool:
    return path.suffix != ".nc" and case.has_machine(path)


def _fields(names: str | None) -> tuple[str, ...]:
    return tuple(name.strip() for name in (names or "").split(",") if name.strip())


def _refuse_for_machine(*values: object) -> None:
    """Raise BadInput for an option that does not apply to the study of a machine."""
    for name, value in zip(NOT_OF_MACHINES, values, strict=True):
        if value:
            raise BadInput(f"{name} does not apply to the study of a machine; leave it out")


def _require_places(out: Path | None, page: Path | None, *, dry_run: bool) -> None:
    """Raise BadInput without a folder, or for a page that cannot be written."""
    if out is None and not dry_run:
        raise BadInput("asperity study needs a folder for its cases; state --out DIR")
    if page is not None and not _in_new_folder(page, out):
        require_output(page, ".html", option="--report")


def _show_result(
    result: "StudyResult", page_rows: dict[str, str], *, as_json: bool, quiet: bool
) -> None:
    show(
        study.study_verdict(result),
        lambda: {**study.study_scalars(result), **page_rows},
        _curve(study.finished_curve(result)),
        _failures_and_files(result, page_rows),
        as_json=as_json,
        quiet=quiet,
    )


def _sweep_machine(
    path: Path,
    overrides: dict[str, object],
    out: Path | None,
    workers: int | None,
    flags: tuple[bool, bool, bool],
) -> None:
    """Sweep a machine, or list its points; `flags` are those of a dry run, JSON and quiet."""
    dry_run, as_json, quiet = flags
    chosen = case.load_machine(path, overrides)
    if dry_run:
        points = machines.sweep_points(chosen)
        show(
            f"{len(points)} machines of {len(chosen.contacts)} contacts each.",
            lambda: {"points": points},
            as_json=as_json,
            quiet=quiet,
        )
        return
    with study_progress(chosen.source, quiet=quiet) as step:
        swept = machines.sweep_machine(chosen, out=out, workers=workers, progress=step)
    keys = ("clr", "lambda_ratio", "h_min_m", "friction_coefficient", "flash_temperature_max_k")
    entries = [quantity(key) for key in keys]
    show(
        swept.verdict(),
        swept.scalars,
        columns(
            [*(key.rpartition(".")[2] for key in swept.axes), "worst contact"]
            + [entry.label for entry in entries],
            (
                [*(str(row[key]) for key in swept.axes), str(row["worst"])]
                + [entry.number_in(row) for entry in entries]
                for row in swept.rows
            ),
            left=len(swept.axes) + 1,
        ),
        [f"Table: {swept.scalars()['table']}"],
        as_json=as_json,
        quiet=quiet,
    )
    if failed := sum(bool(row["failed"]) for row in swept.rows):
        raise AsperityError(f"contacts of {failed} machines were not solved; see {out}")


def _require_whole(result: "StudyResult", part: tuple[int, int]) -> None:
    """Raise AsperityError if cases of this share failed or are missing."""
    if result.failed:
        raise AsperityError(
            f"{result.failed} of {len(result.table)} cases failed; the first: "
            f"{result.failures['reason'].iloc[0]}; --retry-failed repeats them"
        )
    missing = sum(case.number % part[1] == part[0] - 1 for case in result.plan.cases) - len(
        result.table
    )
    if missing > 0:
        raise AsperityError(f"{missing} cases are missing; run the study again")


@contextmanager
def study_progress(label: str, *, quiet: bool) -> "Iterator[Callable[[StudyProgress], None]]":
    """Show completed cases, rate, failures and remaining time on a terminal."""
    with progress(label, "starting workers ...", quiet=quiet) as display:

        def step(state: "StudyProgress") -> None:
            eta = (
                ""
                if state.seconds_left is None
                else f", {study.duration_text(state.seconds_left)} left"
            )
            rate = f"{state.rate:.2g} cases/s" if state.done else "starting workers ..."
            done = state.kept + state.done
            display(f"{done}/{state.total}, {rate}, {state.failed} failed{eta}", done, state.total)

        yield step


def _executor(name: str | None) -> AbstractContextManager["Executor | None"]:
    if name is None:
        return nullcontext()
    kind, _, address = name.partition(":")
    if kind != "dask" or not address:
        raise BadInput(
            f"--executor must be dask:ADDRESS such as dask:tcp://127.0.0.1:8786, got {name}"
        )
    return study.dask_executor(address)


def _shard(text: str) -> tuple[int, int]:
    parts = re.fullmatch(r"(\d+)/(\d+)", text)
    if parts is None or not 1 <= int(parts[1]) <= int(parts[2]):
        raise BadInput(f"--shard must be k/N with 1 <= k <= N, such as 1/3, got {text}")
    return int(parts[1]), int(parts[2])


def _in_new_folder(page: Path, out: Path | None) -> bool:
    """Return True if the page goes into the study's folder, which does not exist yet."""
    return (
        out is not None
        and not out.exists()
        and page.suffix == ".html"
        and page.resolve().parent == out.resolve()
    )


def _make_page(
    result: "StudyResult", page: Path | None, figures: Path | None, *, quiet: bool
) -> dict[str, str]:
    if page is None and figures is None:
        return {}
    assert result.folder is not None
    page = page or result.folder / "report.html"
    with progress("the study's page", "drawing ...", quiet=quiet) as display:
        report.write_study_report(result, page, figures=figures, progress=display)
    return {"report": str(page), **({} if figures is None else {"figures": str(figures)})}


def _curve(curve: "WearCurve | None") -> Block:
    """Return a row per level: means over its surfaces, with their deviations."""
    if curve is None:
        return
    sq = quantity("sq_m")
    selected = [quantity(key) for key in CURVE if key in curve.table]
    means = [(entry, curve.mean(entry.key), curve.std(entry.key)) for entry in selected]
    yield from columns(
        [entry.label for entry in (sq, *selected)],
        (
            [
                sq.number(level),
                *(entry.number(mean[index], deviation[index]) for entry, mean, deviation in means),
            ]
            for index, level in enumerate(curve.sq)
        ),
    )
    yield "  mean ± standard deviation over the surfaces of a level"


def _failures_and_files(result: "StudyResult", page_rows: dict[str, str]) -> Block:
    for _, row in result.failures.head(SHOWN_FAILURES).iterrows():
        chosen = result.plan.cases[row["number"]].overrides
        point = ", ".join(
            f"{key} = {study.as_written(chosen[key])}" for key in result.plan.axes if key in chosen
        )
        yield f"  failed: {point}, realisation {row['realisation']}: {row['reason']}"
    if result.failed > SHOWN_FAILURES:
        yield f"  ... and {result.failed - SHOWN_FAILURES} more; column reason of the table"
    yield from table(
        [
            ("table", str(result.path)),
            *(page_rows or {"report": f"asperity report {result.folder}"}).items(),
        ]
    )


def _show_estimate(plan: "StudyPlan", cost: "StudyCost", *, as_json: bool, quiet: bool) -> None:
    rows = [
        ("points", f"{len(plan.points)}, over {', '.join(plan.axes) or 'seeds alone'}"),
        ("surfaces per point", str(plan.realisations)),
        (
            "time per case",
            f"{text('seconds', cost.case_s)} on one worker, mean of {cost.tried} samples",
        ),
    ]
    show(
        study.estimate_verdict(cost),
        lambda: study.estimate_scalars(plan, cost),
        table(rows),
        as_json=as_json,
        quiet=quiet,
    )
