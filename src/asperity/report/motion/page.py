"""HTML report of a history: verdict, animated maps, curves over time, numbers and limits."""

from dataclasses import replace
from pathlib import Path

from asperity.core.errors import BadInput
from asperity.core.quantities import in_print, quantity
from asperity.report import animated_maps
from asperity.report.base import Exhibit, render, tile, write_exhibits, write_page
from asperity.report.motion import exhibits
from asperity.report.oil_balance import DRY, oil_limit
from asperity.simulation import History, HistoryVibration

NUMBERS = (
    "clr",
    "car",
    "car_domain",
    "contact_force_n",
    "h_min_m",
    "h_central_m",
    "h_mean_m",
    "p_max_pa",
    "friction_coefficient",
    "friction_power_w",
    "flow_power_w",
    "resonance_hz",
    "mass_flux_imbalance",
)
TILES = ("clr", "car", "h_mean_m", "friction_coefficient", "resonance_hz")


def write_motion_report(
    history: History,
    path: str | Path,
    *,
    vibration: HistoryVibration | None = None,
    figures: str | Path | None = None,
) -> Path:
    """Write a self-contained HTML report of a history, atomically.

    Parameters
    ----------
    history : with at least one stored map
    path : file to write; its folder must exist
    vibration : response of a mass on the contact, if computed
    figures : folder for each figure as PDF (85 and 175 mm wide) and `captions.md`

    Raises
    ------
    BadInput
        for a history without a stored map, or a path that is not writable.
    """
    if not history.frames:
        raise BadInput(
            "a report needs at least one stored map, got none; run the case into a new folder"
        )
    page = write_page(path, lambda: render_motion_page(history, vibration))
    if figures is not None:
        write_exhibits(history_exhibits(history), figures)
    return page


def history_exhibits(history: History) -> list[Exhibit]:
    """Return the exhibits of a report: curves over time and, with flattening, over passes."""
    over_time = [exhibits.curves(history)]
    return [*over_time, exhibits.running_in(history)] if _has_passes(history) else over_time


def _has_passes(history: History) -> bool:
    return history.case.motion.flattening and len(history.by_pass()) >= 2


def render_motion_page(history: History, vibration: HistoryVibration | None = None) -> str:
    """Render the page as HTML text."""
    scale = animated_maps.ranges(history.case, history.frames)
    over_time = exhibits.curves(history)
    figure = over_time.figure()
    box = figure.axes[0].get_position()
    motion = history.case.motion
    rows = history.settled
    values = history.scalars()
    return render(
        "motion/page.html.j2",
        title="A contact in motion",
        history=history,
        vibration=vibration,
        tiles=[
            tile(replace(quantity(key), deviation=f"{key}_std"), values)
            for key in TILES
            if values[key] is not None
        ],
        maps=animated_maps.animated_maps(history.case, scale),
        curves=over_time.embed(figure),
        running_in=exhibits.running_in(history).picture() if _has_passes(history) else None,
        motion=motion,
        numbers=[quantity(key) for key in NUMBERS],
        values=values,
        settled_from=int(rows["step"].iloc[0]),
        oil_limit=oil_limit(
            history.case.contents.model if history.case.lubricant else DRY,
            quantity("mass_flux_imbalance").text(rows["mass_flux_imbalance"].mean()),
        ),
        case_text=history.case.text,
        script=animated_maps.SCRIPT,
        script_data=_script_data(history, scale, (100.0 * box.x0, 100.0 * box.x1)),
    )


def _script_data(history: History, scale: animated_maps.Ranges, ends: tuple[float, float]) -> str:
    """Return the data of the page's script: frames, captions and positions on the time axis."""
    last = float(history.table["time_s"].iloc[-1])
    captions = [_caption(history, frame.number) for frame in history.frames]
    positions = [frame.time / last if last else 0.0 for frame in history.frames]
    return animated_maps.script_data(history.frames, captions, scale, ends=ends, place=positions)


def _caption(history: History, number: int) -> str:
    """Describe a step: number, time, CLR, CAR and friction."""
    table = history.table
    row = table[table["step"] == number].to_dict("records")[0]
    values = [quantity(key).named(row[key]) for key in ("clr", "car")]
    friction = quantity("friction_coefficient").number_in({str(key): row[key] for key in row})
    time = quantity("time_s").text(row["time_s"])
    return in_print(
        f"step {number} of {history.steps}, {time}: {', '.join(values)}, friction {friction}"
    )
