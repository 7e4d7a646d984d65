"""Exhibits of a machine's contacts along the path of contact or around the load zone."""

import math
from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from asperity.core.arrays import Field
from asperity.core.coverage import PERCENT
from asperity.core.quantities import Quantity, quantity
from asperity.machines import DangVan, MachineResult, Rating
from asperity.report.base import Exhibit, Numbers
from asperity.report.drawing import display, legend_below, name_axes, panels_in_rows
from asperity.report.style import BLUE, DASHED, GREEN, GREY, VERMILION, Medium

SOLVED = (  # key of a row, and of the quantity that formats it
    ("h_central_m", "h_central_m"),
    ("lambda_ratio", "lambda_ratio"),
    ("clr", "clr"),
    ("car", "car"),
    ("friction_coefficient", "friction_coefficient"),
    ("friction_power_w", "friction_power_w"),
    ("flash_temperature_max_k", "flash_temperature_max_k"),
    ("p_max_pa", "p_max_pa"),
    ("von_mises_core_pa", "von_mises_core_pa"),
    ("crf_hz", "crf_hz"),
)
CONDITIONS_ONLY = (  # for a machine that is not solved
    ("load_n", "load_n"),
    ("p_hertz_pa", "hertz_pressure_pa"),
    ("entrainment_m_s", "entrainment_speed_m_s"),
    ("slide_to_roll", "slide_to_roll"),
)
RATED = {"flash_temperature_max_k": "rated_flash_k"}  # ratings drawn with solved quantities
RATING = "rating"
STYLES = ((BLUE, "-", "o"), (VERMILION, "--", "s"), (GREEN, "-.", "^"), (GREY, ":", "v"))
MAX_NAMED = 9  # contacts of one path whose names fit below an axis


def along_path(result: MachineResult) -> Exhibit:
    """Draw every quantity over the position of the contact, with intervals and ratings."""
    quantities = SOLVED if result.solved else CONDITIONS_ONLY
    keys = [
        (key, name)
        for key, name in quantities
        if any(row.get(key) or key == "clr" for row in result.rows)
    ]
    rated = any(
        rating.key in RATED.values() and _is_by_contact(rating) for rating in result.ratings
    )

    def draw(medium: Medium) -> Figure:
        rows = -(-len(keys) // 4)
        figure = Figure(figsize=(medium.double, 2.3 * rows + 0.5), layout="constrained")
        panels = panels_in_rows(figure, len(keys), sharex=True)
        for (key, name), axes in zip(keys, panels, strict=True):
            _panel(axes, result, key, name)
        _add_legend(figure, rated=rated)
        return figure

    place = quantity(result.case.machine.place)
    subject = "Solved quantities" if result.solved else "Conditions of the contacts"
    dotted = " Dotted: rating of the standard, with its own roughness factor." if rated else ""
    return Exhibit(
        "path",
        draw,
        f"{subject} over the {place.name}, {place.meaning}.{_bars_note(result)}{dotted}",
        f"{len(keys)} panels over the {place.name}: "
        f"{', '.join(quantity(name).name for _, name in keys)}.",
    )


def _add_legend(figure: Figure, *, rated: bool) -> None:
    handles, labels = figure.axes[0].get_legend_handles_labels()
    if rated:
        handles.append(Line2D([], [], color=GREY, linestyle=":"))
        labels.append(RATING)
    if len(labels) > 1:
        legend_below(figure, 3, handles=handles, labels=labels)


def _is_by_contact(rating: Rating) -> bool:
    return "" not in rating.values


def _bars_note(result: MachineResult) -> str:
    low, high = quantity("clr").ends
    drawn = any(row.get(low) is not None and row.get(high) is not None for row in result.rows)
    return f" Bars: {PERCENT} intervals." if drawn else ""


def _series(result: MachineResult) -> dict[str, list[Numbers]]:
    """Group the rows by series, sorted by position: each ring of a bearing is one series."""
    series: dict[str, list[Numbers]] = {}
    rings = result.rows[0]["name"].endswith("ring")
    for row in result.rows:
        series.setdefault(row["bodies"][0] if rings else "contact", []).append(row)
    return {
        name: sorted(rows, key=lambda row: _position(result, row)) for name, rows in series.items()
    }


def _position(result: MachineResult, row: Numbers) -> float:
    """Return the position of a contact; angles from -180 to 180 degrees keep a load zone whole."""
    position = float(row["position"])
    is_angle = result.case.machine.place == "cycle_angle"
    return position - math.tau if is_angle and position > math.pi else position


def _panel(axes: Axes, result: MachineResult, key: str, name: str) -> None:
    """Draw a quantity of every series over the position, with intervals and rating."""
    entry = quantity(name)
    place = result.case.machine.place
    series = _series(result)
    for (label, rows), (colour, line_style, marker) in zip(series.items(), STYLES, strict=False):
        x = _positions(result, rows)
        y = display(name, _numbers(rows, key))
        axes.plot(x, y, line_style, color=colour, marker=marker, markersize=4, label=label)
        _draw_bars(axes, x, rows, entry, colour)
    _draw_rating(axes, result, key)
    axes.tick_params(labelbottom=True)
    axes.set_title(entry.label, fontweight="normal", fontsize="small")
    if len(series) == 1 and 1 < len(result.rows) <= MAX_NAMED and place == "path_position_m":
        rows = next(iter(series.values()))
        names = [row["name"] for row in rows]
        axes.set_xticks(_positions(result, rows), names, fontsize="small")
    else:
        name_axes(axes, place)
    low, high = axes.get_ylim()
    axes.set_ylim(min(0.0, low), high + 0.05 * (high - min(0.0, low)))


def _draw_bars(axes: Axes, x: Field, rows: Sequence[Numbers], entry: Quantity, colour: str) -> None:
    """Draw the intervals of a quantity that the rows have."""
    low, high = (display(entry.key, _numbers(rows, end)) for end in entry.ends)
    finite = np.isfinite(low) & np.isfinite(high)
    if finite.any():
        axes.vlines(x[finite], low[finite], high[finite], color=colour, linewidth=1.0)


def _draw_rating(axes: Axes, result: MachineResult, key: str) -> None:
    """Draw the rating of this panel's quantity, if there is one."""
    for rating in result.ratings:
        if rating.key == RATED.get(key) and _is_by_contact(rating):
            rows = [row for row in result.rows if row["name"] in rating.values]
            values = np.array([rating.values[row["name"]] for row in rows], dtype=float)
            axes.plot(_positions(result, rows), display(rating.key, values), ":", color=GREY)


def _positions(result: MachineResult, rows: Sequence[Numbers]) -> Field:
    """Return the positions of contacts in the display unit."""
    positions = np.array([_position(result, row) for row in rows])
    return np.asarray(display(result.case.machine.place, positions))


def _numbers(rows: Sequence[Numbers], key: str) -> Field:
    return np.array([np.nan if row.get(key) is None else row[key] for row in rows], dtype=float)


def fatigue_over_depth(fatigue: DangVan) -> Exhibit:
    """Draw Dang Van's criterion over depth for the rough and the smooth contact, with its limit."""

    def draw(medium: Medium) -> Figure:
        figure, axes = medium.panel(3.4)
        depths = display("depth_m", fatigue.depths)
        for values, label, (colour, line_style, marker) in zip(
            (fatigue.solved, fatigue.smooth),
            ("solved, rough", "smooth, same friction"),
            STYLES,
            strict=True,
        ):
            axes.plot(
                display("dang_van_pa", values),
                depths,
                line_style,
                color=colour,
                marker=marker,
                markersize=3,
                label=label,
            )
        axes.axvline(
            display("dang_van_pa", fatigue.limit),
            color="black",
            linestyle=DASHED,
            linewidth=1.0,
            label="limit",
        )
        axes.axhspan(0.0, display("depth_m", fatigue.core_depth), color="#eef1f5", zorder=0)
        axes.set(
            xlabel=f"Dang Van equivalent stress [{quantity('dang_van_pa').display}]",
            ylabel=quantity("depth_m").axis,
        )
        axes.set_ylim(depths[-1], 0.0)
        axes.set_xlim(left=0.0)
        medium.title(axes, "Fatigue below the worst contact")
        legend_below(figure, 3)
        return figure

    return Exhibit(
        "fatigue",
        draw,
        f"τ + a σ_h with a = {fatigue.slope:.3g}, maximum over all lines along rolling as material "
        "passes below the asperities. In the grey layer it grows with grid refinement.",
        "Dang Van equivalent stress over depth.",
    )
