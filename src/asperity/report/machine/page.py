"""HTML report of a machine: verdict, drawing, contacts, ratings and the worst contact."""

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

from asperity.core.documents import Table
from asperity.core.quantities import NO_VALUE, Quantity, mark_rolling, quantity
from asperity.machines import MachineResult, Rating, merge_symmetric
from asperity.report.base import Exhibit, heading, render, tile, write_page
from asperity.report.machine.contact_path import SOLVED, along_path, fatigue_over_depth
from asperity.report.machine.sketch import machine_sketch
from asperity.report.run import contact, friction_maps
from asperity.results import Run

CONDITIONS = (
    ("load_n", "load_n"),
    ("line_load_n_m", "line_load_n_per_m"),
    ("u1_m_s", "surface_speed_m_s"),
    ("u2_m_s", "surface_speed_m_s"),
    ("slide_to_roll", "slide_to_roll"),
    ("p_hertz_pa", "hertz_pressure_pa"),
)
DRAWN = "friction_power_w"  # in the figure, but not in the table, which would be too wide
HEADS = {  # shorter than the names of the catalogue
    "u1_m_s": "u₁",
    "u2_m_s": "u₂",
    "line_load_n_m": "line load",
    "slide_to_roll": "slide-to-roll",
    "p_hertz_pa": "p Hertz",
    "flash_temperature_max_k": "flash",
    "von_mises_core_pa": "core von Mises",
}
TILES = (
    "clr",
    "h_central_m",
    "lambda_ratio",
    "car",
    "friction_coefficient",
    "flash_temperature_max_k",
    "crf_hz",
)


def write_machine_report(
    result: MachineResult, path: str | Path, *, opened: str | None = None
) -> Path:
    """Write a self-contained HTML report of a machine, atomically.

    Parameters
    ----------
    result : from `solve_machine` or `machine_conditions`
    path : file to write; its folder must exist
    opened : file name of the report of the worst contact in the same folder; None if there is none

    Returns
    -------
    Path
        File written. The same result and asperity version give the same bytes.

    Raises
    ------
    BadInput
        for a path that is not writable.
    """
    return write_page(path, lambda: _page(result, opened))


def machine_exhibits(result: MachineResult) -> list[Exhibit]:
    """Return the figures of the page: drawing, path of contact and worst contact."""
    path = [along_path(result)] if len(result.rows) > 1 else []
    return [machine_sketch(result), *path, *_worst(result)]


def _page(result: MachineResult, opened: str | None) -> str:
    keys = [
        (key, quantity(name))
        for key, name in (*CONDITIONS, *SOLVED)
        if key != DRAWN and result.has_values(key)
    ]
    worst = mark_rolling(result.worst, rolling=result.worst["slide_to_roll"] == 0.0)
    return render(
        "machine/page.html.j2",
        title=result.case.machine.title(),
        result=result,
        standing=result.run is not None and result.run.is_snapshot,
        failures=result.failures,
        tiles=[tile(quantity(key), worst) for key in TILES if worst.get(key) is not None],
        sketch=machine_sketch(result).picture(),
        path=along_path(result).picture() if len(result.rows) > 1 else None,
        heads=[(_head(key, entry), entry.display) for key, entry in keys],
        rows=_table(result, keys),
        rolling=sum(row["slide_to_roll"] == 0.0 for row in result.rows),
        ratings=[_rating_view(rating) for rating in result.ratings],
        worst=[exhibit.picture() for exhibit in _worst(result)],
        run=result.run,
        opened=opened,
        frequencies=[
            (name.removesuffix("_hz").replace("_", " "), quantity("frequency_hz").text(value))
            for name, value in result.case.machine.frequencies.items()
        ],
    )


def _head(key: str, entry: Quantity) -> str:
    return HEADS.get(key, entry.short)


class _Line(NamedTuple):
    """A row of the table of contacts, for one contact or for several equal ones."""

    name: str
    cells: Sequence[str]
    reason: str
    worst: bool


def _table(result: MachineResult, keys: Sequence[tuple[str, Quantity]]) -> list[_Line]:
    """Return a row per contact, one for those that are equal by symmetry."""
    table = []
    for row in result.rows:
        marked = mark_rolling(row, rolling=row["slide_to_roll"] == 0.0, mark=NO_VALUE)
        cells = [_cell(marked, *key) for key in keys]
        table.append((str(row["name"]), [*cells, str(row.get("reason") or "")]))
    worst = [row["name"] for row in result.rows].index(result.worst["name"])
    return [
        _Line(name, table[rows[0]][1][:-1], table[rows[0]][1][-1], worst in rows)
        for name, rows in merge_symmetric(table)
    ]


def _cell(row: Table, key: str, entry: Quantity) -> str:
    """Return a number with its interval, if the row has one."""
    return entry.number_in(row) if key == entry.key else entry.number(row.get(key))


class _RatingView(NamedTuple):
    """Values of a rating for the template."""

    name: str
    meaning: str
    value: str
    rating: Rating


def _rating_view(rating: Rating) -> _RatingView:
    entry = quantity(rating.key)
    if rating.reason:
        value = f"not rated: {rating.reason}"
    elif rating.machine_value is not None:
        value = entry.text(rating.machine_value)
    else:
        determined = {name: number for name, number in rating.values.items() if number is not None}
        value = (
            "; ".join(f"{name} {entry.number(number)}" for name, number in determined.items())
            or NO_VALUE
        )
        value = f"{value} {entry.display}".rstrip()
    return _RatingView(heading(entry), entry.meaning, value, rating)


def _worst(result: MachineResult) -> Iterator[Exhibit]:
    """Yield maps of the worst contact and the fatigue of the material below."""
    if result.run is None:
        return
    yield from _maps(result.run)
    if result.dang_van is not None:
        yield fatigue_over_depth(result.dang_van)


def _maps(run: Run) -> Iterator[Exhibit]:
    yield contact.contact_map(run)
    yield contact.film_map(run)
    yield contact.pressure_map(run)
    yield contact.centre_line(run)
    if (
        run.friction is not None
        and run.heat is not None
        and run.solution.conditions.sliding_speed != 0.0
    ):
        yield friction_maps.temperature_map(run, run.friction, run.heat)
    yield friction_maps.stress_section(run)
