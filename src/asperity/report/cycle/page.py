"""HTML report of a cycle: verdict, curves over time, instants, totals and limits."""

from pathlib import Path

from asperity.core.documents import JsonObject
from asperity.core.quantities import quantity
from asperity.report.base import render, tile, write_page
from asperity.report.cycle.exhibits import over_cycle
from asperity.simulation import CycleResult

COLUMNS = (
    *("load_n", "entrainment_speed_m_s", "sliding_speed_m_s"),
    *("h_min_smooth_m", "h_min_steady_m", "clr", "car", "friction_coefficient"),
    *("flash_temperature_max_k",),
)
TILES = ("h_min_m", "h_min_steady_m", "clr_max", "clr", "friction_energy_j")


def write_cycle_report(result: CycleResult, path: str | Path) -> Path:
    """Write a self-contained HTML report of a cycle, atomically; return its path.

    Raises
    ------
    BadInput
        for a path that is not writable.
    """
    return write_page(path, lambda: render_cycle_page(result))


def render_cycle_page(result: CycleResult) -> str:
    """Render the page as HTML text."""
    values, place = result.scalars(), result.cycle.place
    rows = result.instant_rows()
    keys = [key for key in COLUMNS if any(row.get(key) is not None for row in rows)]
    keys = [*([place] if place else []), *keys]
    return render(
        "cycle/page.html.j2",
        title="A contact over a cycle",
        result=result,
        tiles=[tile(quantity(key), values) for key in TILES if values[key] is not None],
        curves=over_cycle(result).responsive_picture(),
        heads=[quantity("cycle_time_s"), *(quantity(key) for key in keys)],
        rows=[[quantity("cycle_time_s").number(row["time_s"]), *_row(row, keys)] for row in rows],
        notes=result.notes,
        case_text=result.case.text,
    )


def _row(row: JsonObject, keys: list[str]) -> list[str]:
    """Return the texts of an instant's row."""
    return [
        quantity(key).number_in(row) if key == "clr" else quantity(key).number(row.get(key))
        for key in keys
    ]
