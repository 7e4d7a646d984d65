"""`asperity machine`: gears, bearings, discs and cams to their contacts, each solved; goes on where it was stopped."""

import json
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from asperity import case, files, study
from asperity.cli.app import app
from asperity.cli.options import AsJson, OutFolder, Overrides, Quiet, Workers, read_overrides
from asperity.cli.show import Block, Row, columns, show, table
from asperity.cli.study import study_progress
from asperity.errors import AsperityError
from asperity.quantities import quantity

if TYPE_CHECKING:
    from asperity.study import MachineResult

RESULT = "machine.json"
CONDITIONS = (  # key of a row, and of the quantity that says how it is shown
    ("load_n", "load_n"),
    ("line_load_n_m", "line_load_n_per_m"),
    ("entrainment_m_s", "entrainment_speed_m_s"),
    ("slide_to_roll", "slide_to_roll"),
    ("p_hertz_pa", "hertz_pressure_pa"),
)
SOLVED = ("h_central_m", "lambda_ratio", "clr", "car", "friction_coefficient", "flash_temperature_max_k", "crf_hz")


@app.command("machine")
def machine_command(
    path: Annotated[Path, typer.Argument(metavar="CASE.toml", help="A case with a [machine] in place of [contact].")],
    out: OutFolder = None,
    workers: Workers = None,
    overrides: Overrides = None,
    dry_run: Annotated[bool, typer.Option("--dry-run", help="Say the contacts' conditions; solve nothing.")] = False,
    as_json: AsJson = False,
    quiet: Quiet = False,
) -> None:
    """Solve every contact of a machine: film, load sharing, friction, temperature, and which is worst."""
    chosen = case.load_machine(path)
    replaced = read_overrides(overrides)
    chosen = chosen.with_overrides(replaced) if replaced else chosen
    if dry_run:
        result = study.machine_conditions(chosen)
    else:
        with study_progress(path.name, quiet=quiet) as step:
            result = study.solve_machine(chosen, out=out, workers=workers, progress=step)
        if out is not None:
            files.write_text(out / RESULT, json.dumps(result.scalars(), indent=2, allow_nan=False))
    show(
        result.verdict(),
        result.scalars,
        _contacts(result),
        table(_frequencies(result), [*chosen.notes, *_unsolved(result)]),
        [] if out is None or dry_run else [f"Kept in {out}; the same command goes on where it was stopped"],
        as_json=as_json,
        quiet=quiet,
    )
    if result.failures:
        raise AsperityError(
            f"{len(result.failures)} of {len(result.rows)} contacts were not solved; the first: "
            f"{result.failures[0]['name']}: {result.failures[0]['reason']}"
        )


def _contacts(result: "MachineResult") -> Block:
    """A row a contact; those of both sides of a load zone are all there."""
    shown = [(key, quantity(name)) for key, name in CONDITIONS]
    if result.solved:
        kept = [key for key in SOLVED if any(row[key] is not None for row in result.rows)]
        shown += [(key, quantity(key)) for key in kept]
    return columns(
        ["contact", *(entry.label for _, entry in shown)],
        ([row["name"], *(entry.number(row[key]) for key, entry in shown)] for row in result.rows),
        left=1,
    )


def _frequencies(result: "MachineResult") -> list[Row]:
    found: dict[str, Any] = result.case.machine.frequencies
    return [(key.removesuffix("_hz").replace("_", " "), f"{value:.4g} Hz") for key, value in found.items()]


def _unsolved(result: "MachineResult") -> Sequence[str]:
    return [f"{row['name']} was not solved: {row['reason']}" for row in result.failures]
