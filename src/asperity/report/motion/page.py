"""One HTML page of a history: what moving did to the contact, maps that move, curves over time, numbers, limits.

The maps are small pictures in the page, shown one after the other by a few lines of script.
"""

from dataclasses import replace
from pathlib import Path

from asperity.core.errors import BadInput
from asperity.core.quantities import in_print, quantity
from asperity.report import animated_maps as moving
from asperity.report.base import render, tile, write_page
from asperity.report.motion import exhibits
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
    history: History, path: str | Path, *, vibration: HistoryVibration | None = None
) -> Path:
    """Write one self-contained HTML page about a history, whole or not at all; with what a mass on it does.

    Raises
    ------
    BadInput
        for a history without a kept map, or a path that cannot be written to.
    """
    if not history.frames:
        raise BadInput(
            "a report needs at least one map of the history, got none; run the case into a new folder"
        )
    return write_page(path, lambda: render_motion_page(history, vibration))


def render_motion_page(history: History, vibration: HistoryVibration | None = None) -> str:
    """The page as HTML text."""
    reach = moving.ranges(history.case, history.frames)
    over_time = exhibits.curves(history)
    figure = over_time.figure()
    box = figure.axes[0].get_position()
    motion, rows, values = history.case.motion, history.settled, history.scalars()
    pass_by_pass = motion.flattening and len(history.by_pass()) >= 2
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
        maps=[moving.moving_map(history.case, kind, reach) for kind in moving.KINDS],
        curves=over_time.picture_of(figure),
        running_in=exhibits.running_in(history).picture() if pass_by_pass else None,
        motion=motion,
        numbers=[quantity(key) for key in NUMBERS],
        values=values,
        settled_from=int(rows["step"].iloc[0]),
        model=history.case.contents.model,
        imbalance=quantity("mass_flux_imbalance").text(rows["mass_flux_imbalance"].mean()),
        script=moving.SCRIPT,
        script_data=_script_data(history, reach, (100.0 * box.x0, 100.0 * box.x1)),
    )


def _script_data(history: History, reach: moving.Ranges, ends: tuple[float, float]) -> str:
    """What the page's script shows of each kept step, and where that is along the curves over time."""
    last = float(history.table["time_s"].iloc[-1])
    words = [_in_words(history, frame.number) for frame in history.frames]
    place = [frame.time / last if last else 0.0 for frame in history.frames]
    return moving.script_data(history.frames, words, reach, ends=ends, place=place)


def _in_words(history: History, number: int) -> str:
    row = history.table[history.table["step"] == number].iloc[0]
    values = [quantity(key).named(row[key]) for key in ("clr", "car")]
    friction = quantity("friction_coefficient").number(row["friction_coefficient"])
    time = quantity("time_s").text(row["time_s"])
    return in_print(
        f"step {number} of {history.steps}, {time}: {', '.join(values)}, friction {friction}"
    )
