"""`asperity machine`: solve the contacts of gears, bearings, discs and cams; resumable."""

import json
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from asperity import case, machines, report
from asperity.cli.app import app
from asperity.cli.options import (
    AsJson,
    Figures,
    OpenPage,
    OutFolder,
    Overrides,
    Quiet,
    StandingRoughness,
    Workers,
    read_overrides,
)
from asperity.cli.output import Block, Row, columns, named_path, progress, show, table, written
from asperity.cli.study import study_progress
from asperity.cli.terminal.browser import open_page, require_opened
from asperity.core import files
from asperity.core.coverage import PERCENT
from asperity.core.documents import Table
from asperity.core.errors import AsperityError
from asperity.core.quantities import NO_VALUE, UNKNOWN, mark_rolling, quantity

if TYPE_CHECKING:
    from asperity.case import MachineCase
    from asperity.core.quantities import Quantity
    from asperity.machines import MachineResult

RESULT = "machine.json"
PAGE = "machine.html"
WORST_PAGE = "worst.html"
CONDITIONS = (  # key of a row, and of the quantity that formats it
    ("load_n", "load_n"),
    ("line_load_n_m", "line_load_n_per_m"),
    ("entrainment_m_s", "entrainment_speed_m_s"),
    ("slide_to_roll", "slide_to_roll"),
    ("p_hertz_pa", "hertz_pressure_pa"),
)
UNSOLVED_ONLY = ("line_load_n_m", "entrainment_m_s")  # conditions printed without a solution
STIFFNESSES = (
    ("radial", ("N/µm", 1e-6)),
    ("axial", ("N/µm", 1e-6)),
    ("tilt", ("N m/mrad", 1e-3)),
)
SOLVED = (
    "h_central_m",
    "lambda_ratio",
    "clr",
    "friction_coefficient",
    "flash_temperature_max_k",
    "crf_hz",
)

StiffnessOption = Annotated[
    Path | None,
    typer.Option(
        "--stiffness",
        metavar="FILE.csv",
        help="Write stiffness and damping at every point of [study] for rotor dynamics, instead of "
        "solving the machine.",
    ),
]


@app.command("machine")
def machine_command(
    path: Annotated[
        Path,
        typer.Argument(metavar="CASE.toml", help="Case with a [machine] in place of [contact]."),
    ],
    out: OutFolder = None,
    workers: Workers = None,
    overrides: Overrides = None,
    snapshot: StandingRoughness = False,
    dry_run: Annotated[
        bool, typer.Option("--dry-run", help="Print the contacts' conditions without solving.")
    ] = False,
    stiffness: StiffnessOption = None,
    figures: Figures = None,
    opened: OpenPage = False,
    as_json: AsJson = False,
    quiet: Quiet = False,
) -> None:
    """Solve every contact of a gear pair, bearing, discs or cam."""
    page = None if out is None or dry_run else out / PAGE
    require_opened(page, requested=opened, option="--out DIR, without --dry-run")
    chosen = case.load_machine(path, read_overrides(overrides, snapshot=snapshot))
    if stiffness is not None:
        _tabulate(chosen, stiffness, as_json=as_json, quiet=quiet)
        return
    if dry_run:
        result = machines.machine_conditions(chosen)
    else:
        with study_progress(path.name, quiet=quiet) as step:
            result = machines.solve_machine(chosen, out=out, workers=workers, progress=step)
        if out is not None:
            _save(result, out, quiet=quiet)
    _show(result, page, (out, figures), as_json=as_json, quiet=quiet)
    open_page(page, requested=opened)
    if result.failures:
        raise AsperityError(
            f"{len(result.failures)} of {len(result.rows)} contacts were not solved; the first: "
            f"{result.failures[0]['name']}: {result.failures[0]['reason']}"
        )


def _show(
    result: "MachineResult",
    page: Path | None,
    outputs: tuple[Path | None, Path | None],
    *,
    as_json: bool,
    quiet: bool,
) -> None:
    """Print verdict and tables, and write the figures."""
    out, figures = outputs
    _draw(result, figures)
    show(
        result.verdict(),
        lambda: result.scalars() | named_path("figures", figures),
        _contacts(result),
        table([*_ratings(result), *_stiffness(result)]),
        table(_frequencies(result), [*result.notes, *_unsolved(result)]),
        _written(page, out, figures),
        as_json=as_json,
        quiet=quiet,
    )


def _tabulate(chosen: "MachineCase", path: Path, *, as_json: bool, quiet: bool) -> None:
    """Write the table of stiffness and damping."""
    files.require_writable(path)
    with progress("stiffness", "solving ...", quiet=quiet) as display:
        result = machines.stiffness_table(
            chosen,
            progress=lambda done, total: display(f"{done} of {total} contacts", done, total),
        )
    result.save(path)
    show(
        result.verdict(),
        lambda: result.scalars() | {"table": str(path)},
        written("Table", path),
        as_json=as_json,
        quiet=quiet,
    )


def _save(result: "MachineResult", out: Path, *, quiet: bool) -> None:
    """Write the machine's numbers and page, and the page of its worst contact."""
    files.write_text(out / RESULT, json.dumps(result.scalars(), indent=2, allow_nan=False))
    with progress("the machine's page", quiet=quiet):
        if result.run is not None:
            report.write_report(
                [result.run], out / WORST_PAGE, title=f"{result.worst['name']}: the worst contact"
            )
        report.write_machine_report(
            result, out / PAGE, opened=None if result.run is None else WORST_PAGE
        )


def _draw(result: "MachineResult", figures: Path | None) -> None:
    """Write the figures, if a folder for them is given."""
    if figures is not None:
        report.write_exhibits(report.machine_exhibits(result), figures)


def _written(page: Path | None, out: Path | None, figures: Path | None) -> Block:
    """Yield what was written, and where."""
    yield from (*written("Report", page), *written("Figures", figures))
    if page is not None:
        yield f"Saved in {out}; the same command resumes it"


def _ratings(result: "MachineResult") -> Iterator[Row]:
    """Return the ratings of the machine; ranges for those along the path of contact."""
    missing: dict[str, list[str]] = {}  # names by reason
    for rating in result.ratings:
        entry = quantity(rating.key)
        values = [value for value in rating.values.values() if value is not None]
        outside = f"; outside its range: {rating.beyond}" if rating.beyond else ""
        if rating.reason:
            missing.setdefault(rating.reason, []).append(entry.short)
        elif rating.machine_value is not None:
            yield entry.title, f"{entry.text(rating.machine_value)}  ({rating.standard}{outside})"
        else:
            yield (
                entry.title,
                f"{entry.number(min(values))} to {entry.text(max(values))}  "
                f"({rating.standard}{outside})",
            )
    for reason, names in missing.items():
        yield "not rated", f"{', '.join(names)}: {reason}"


def _contacts(result: "MachineResult") -> Block:
    """Return a row per contact, one for both sides of a load zone; all numbers are in JSON."""
    heads = [(key, quantity(name)) for key, name in CONDITIONS]
    if result.solved:
        heads = [head for head in heads if head[0] not in UNSOLVED_ONLY]
        heads += [(key, quantity(key)) for key in SOLVED]
    heads = [head for head in heads if result.has_values(head[0])]
    marked = [
        mark_rolling(row, rolling=row["slide_to_roll"] == 0.0, mark=NO_VALUE) for row in result.rows
    ]
    rows = [(str(row["name"]), [_number(row, *head) for head in heads]) for row in marked]
    yield from columns(
        ["contact", *(entry.label for _, entry in heads)],
        ([name, *rows[equal[0]][1]] for name, equal in machines.merge_symmetric(rows)),
        left=1,
    )
    yield from table([], _contact_notes(result))


def _contact_notes(result: "MachineResult") -> Iterator[str]:
    """Yield what the table of contacts leaves out, and why."""
    rolling = [row for row in result.rows if row["slide_to_roll"] == 0.0]
    if rolling:
        count = f"{len(rolling)} of {len(result.rows)}"
        yield f"{count} contacts roll without sliding: no sliding friction, no flash temperature."
    if any(row.get("clr") is not None and row.get("clr_low") is None for row in result.rows):
        yield f"The {PERCENT} intervals of CLR that are missing in the table are not determined."
    if result.solved:
        yield "--json and the page of --out DIR have all quantities and intervals."


def _number(row: Table, key: str, entry: "Quantity") -> str:
    """Return the number; that of CLR with its interval, if it is determined."""
    number = entry.number_in(row) if key == "clr" else entry.number(row[key])
    return number.removesuffix(f" ({UNKNOWN})")


def _stiffness(result: "MachineResult") -> Iterator[Row]:
    """Yield the diagonal of a bearing's stiffness matrix."""
    for row, (name, unit) in enumerate(STIFFNESSES[: len(result.stiffness_matrix or [])]):
        assert result.stiffness_matrix is not None
        value = result.stiffness_matrix[row][row]
        yield f"{name} stiffness of the bearing", f"{value * unit[1]:.4g} {unit[0]}"


def _frequencies(result: "MachineResult") -> list[Row]:
    return [
        (key.removesuffix("_hz").replace("_", " "), f"{value:.4g} Hz")
        for key, value in result.case.machine.frequencies.items()
    ]


def _unsolved(result: "MachineResult") -> Sequence[str]:
    return [f"{row['name']} was not solved: {row['reason']}" for row in result.failures]
