"""`asperity wear`: a case let wear for hours; goes on where it was stopped."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from asperity import ageing, report
from asperity.cli.app import app
from asperity.cli.options import (
    AsJson,
    OutFolder,
    Overrides,
    Page,
    Quiet,
    SurfaceFile,
    Workers,
    chosen_case,
    require_output,
)
from asperity.cli.show import Block, columns, progress, show, table, written
from asperity.processes import cores
from asperity.quantities import quantity

if TYPE_CHECKING:
    from asperity.ageing import WearHistory, WearProgress

STARTS = "the start; after installation the first solve compiles the solver, up to a minute ..."
CONTACT = (
    "sq_m", "ssk", "spk_m", "svk_m", "clr", "solid_load_ratio", "car", "h_mean_m", "friction_coefficient",
    "flash_temperature_max_k", "crf_hz", "crfa",
)  # fmt: skip
OF_BODIES = ("overrollings", "worn_depth_m", "worn_depth_max_m", "worn_volume_m3", "sq_m", "spk_m", "svk_m")


@app.command()
def wear(
    path: Annotated[Path, typer.Argument(metavar="CASE.toml", help="A case; its [wear] says how it wears.")],
    hours: Annotated[float, typer.Option(metavar="H", help="Hours of running.")],
    surface: SurfaceFile = None,
    overrides: Overrides = None,
    out: OutFolder = None,
    workers: Workers = None,
    page: Page = None,
    as_json: AsJson = False,
    quiet: Quiet = False,
) -> None:
    """Let the contact wear: surfaces, load sharing, film and resonance over hours."""
    require_output(page, ".html", option="--report")
    chosen = chosen_case(path, overrides, surface)
    with progress(path.name, STARTS, quiet=quiet) as display:

        def jump(taken: "WearProgress") -> None:
            row = taken.row
            told = ", ".join(quantity(key).named(row[key]) for key in ("sq_m", "clr"))
            display(
                f"{taken.hours:.4g} of {taken.of_hours:.4g} h, {told}",
                round(1000.0 * taken.hours / taken.of_hours),
                1000,
            )

        worn = ageing.run_wear(chosen, hours=hours, out=out, workers=workers or cores(), progress=jump)
    if page is not None:
        report.write_wear_report(worn, page)
    show(
        worn.verdict(),
        lambda: {**worn.scalars(), "report": None if page is None else str(page)},
        _contact(worn),
        _bodies(worn),
        table([], worn.notes),
        written("kept in", worn.folder),
        written("report", page),
        as_json=as_json,
        quiet=quiet,
    )


def _contact(worn: "WearHistory") -> Block:
    """Both surfaces together, and the contact, at first and at the end."""
    first, last = worn.table.iloc[0], worn.numbers_at_end
    rows = [
        (quantity(key).title, quantity(key).number(first[key]), quantity(key).number_in(last), quantity(key).display)
        for key in CONTACT
    ]
    return columns(["", "new", f"after {worn.hours:.4g} h", ""], rows, left=1)


def _bodies(worn: "WearHistory") -> Block:
    """What each body has come to."""
    last = worn.table.iloc[-1]
    rows = []
    for key in OF_BODIES:
        entry = quantity(key)
        ends = [entry.number(last[ageing.of_body(key, body)]) for body in (0, 1)]
        rows.append((entry.title, *ends, entry.display))
    return columns(["", "body 1", "body 2", ""], rows, left=1)
