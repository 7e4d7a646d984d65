"""`asperity cycle`: a contact over a cycle of load and speeds, in time."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from asperity import case, report, simulation
from asperity.cli.app import app
from asperity.cli.options import (
    AsJson,
    Figures,
    OpenPage,
    Overrides,
    Page,
    Quiet,
    Workers,
    chosen_case,
    read_overrides,
)
from asperity.cli.output import Block, Row, columns, named_path, progress, show, table, written
from asperity.cli.terminal.browser import open_page, require_page
from asperity.core.errors import AsperityError
from asperity.core.quantities import quantity

if TYPE_CHECKING:
    from asperity.simulation import CycleProgress, CycleResult

CONDITIONS = ("load_n", "entrainment_speed_m_s", "sliding_speed_m_s")
FILMS = ("h_min_smooth_m", "h_min_steady_m")
ROUGH = ("clr", "friction_coefficient", "flash_temperature_max_k")
TOTALS = ("friction_energy_j", "wear_volume_first_m3", "wear_volume_second_m3")


@app.command("cycle")
def cycle_command(
    path: Annotated[
        Path,
        typer.Argument(
            metavar="CASE.toml", help="Case with a [cycle], or with a [machine] that has one."
        ),
    ],
    instants: Annotated[
        int | None,
        typer.Option(
            metavar="N", help="Instants at which the rough contact is solved (default: 12)."
        ),
    ] = None,
    overrides: Overrides = None,
    workers: Workers = None,
    page: Page = None,
    figures: Figures = None,
    opened: OpenPage = False,
    as_json: AsJson = False,
    quiet: Quiet = False,
) -> None:
    """Solve a contact over a cycle of load and speeds, with squeeze.

    A cam's revolution, a tooth's passage, start and stop, oscillation: film in time, load share,
    friction, flash temperature and wear per cycle.
    """
    require_page(page, requested=opened)
    result = _solve(path, overrides, (instants, workers), quiet=quiet)
    if page is not None:
        report.write_cycle_report(result, page)
    if figures is not None:
        report.write_exhibits(report.cycle_exhibits(result), figures)
    outputs = {"report": None if page is None else str(page), **named_path("figures", figures)}
    show(
        result.verdict(),
        lambda: result.scalars() | outputs,
        _instants(result),
        table([*_totals(result)], [*result.notes, *_unsolved(result)]),
        [*written("Report", page), *written("Figures", figures)],
        as_json=as_json,
        quiet=quiet,
    )
    open_page(page, requested=opened)
    _require_solved(result)


def _solve(
    path: Path,
    overrides: list[str] | None,
    effort: tuple[int | None, int | None],
    *,
    quiet: bool,
) -> "CycleResult":
    """Solve the cycle of a contact's case or of a machine's, with instants and workers."""
    instants, workers = effort
    if case.has_machine(path):
        machine = case.load_machine(path, read_overrides(overrides))
        chosen, cycle = simulation.machine_contact_cycle(machine)
    else:
        chosen, cycle = chosen_case(path, overrides), None
    with _shown(path.name, quiet=quiet) as step:
        return simulation.solve_cycle(
            chosen, cycle, instants=instants, workers=workers, progress=step
        )


def _require_solved(result: "CycleResult") -> None:
    """Raise AsperityError unless every time step and every instant was solved."""
    if result.film.failed:
        raise AsperityError(
            f"{result.film.failed} of {result.film.steps} time steps did not converge; refine "
            "[grid], or raise solver.max_iterations"
        )
    if result.failures:
        raise AsperityError(
            f"{len(result.failures)} of {len(result.instants)} instants were not solved; the "
            f"first, at {result.failures[0].time:.4g} s: {result.failures[0].reason}"
        )


@contextmanager
def _shown(label: str, *, quiet: bool) -> "Iterator[Callable[[CycleProgress], None]]":
    """Show the progress of film and rough contacts."""
    with progress(label, "the film ...", quiet=quiet, compiles=True) as display:

        def step(state: "CycleProgress") -> None:
            if state.solved == 0:
                display(f"film of the smooth bodies, {100 * state.film:.0f} % of a cycle")
            else:
                display(f"rough contact {state.solved} of {state.total}", state.solved, state.total)

        yield step


def _instants(result: "CycleResult") -> Block:
    """Return a row per instant."""
    rows = result.instant_rows()
    time, place = quantity("cycle_time_s"), result.cycle.place
    keys = [
        key
        for key in (*CONDITIONS, *FILMS, *ROUGH)
        if any(row.get(key) is not None for row in rows)
    ]
    heads = [quantity(place).label] if place else []
    lines = []
    for row in rows:
        where = [quantity(place).number(row[place])] if place else []
        values = [
            quantity(key).number_in(row) if key == "clr" else quantity(key).number(row.get(key))
            for key in keys
        ]
        lines.append([time.number(row["time_s"]), *where, *values])
    yield from columns([time.label, *heads, *(quantity(key).label for key in keys)], lines)


def _totals(result: "CycleResult") -> Iterator[Row]:
    """Yield the totals of a cycle with their intervals."""
    values = result.scalars()
    for key in ("clr", *TOTALS):
        if values[key] is not None:
            entry = quantity(key)
            name = f"{entry.title}, mean over the cycle" if key == "clr" else entry.title
            yield name, entry.text_in(values)


def _unsolved(result: "CycleResult") -> Iterator[str]:
    for instant in result.failures:
        yield f"The rough contact at {instant.time:.4g} s was not solved: {instant.reason}."
