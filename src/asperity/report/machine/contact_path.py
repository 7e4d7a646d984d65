"""What a machine's contacts have along the path of contact, or round the load zone."""

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from asperity.core.arrays import Field
from asperity.core.quantities import quantity
from asperity.machines import DangVan, MachineResult
from asperity.report.base import Exhibit
from asperity.report.drawing import display, legend_below, name_axes, panels_in_rows
from asperity.report.style import BLUE, DASHED, GREY, VERMILION, Medium

SHOWN = (  # key of a row, and of the quantity that says how it is shown
    ("h_central_m", "h_central_m"),
    ("lambda_ratio", "lambda_ratio"),
    ("clr", "clr"),
    ("car", "car"),
    ("friction_coefficient", "friction_coefficient"),
    ("friction_power_w", "friction_power_w"),
    ("flash_temperature_max_k", "flash_temperature_max_k"),
    ("von_mises_core_pa", "von_mises_core_pa"),
    ("crf_hz", "crf_hz"),
)
STATED = (  # of a machine that is not solved
    ("load_n", "load_n"),
    ("p_hertz_pa", "hertz_pressure_pa"),
    ("entrainment_m_s", "entrainment_speed_m_s"),
    ("slide_to_roll", "slide_to_roll"),
)
RATED = {"flash_temperature_max_k": "rated_flash_k"}  # drawn beside what was solved
RATING = "rating"
STROKES = ((BLUE, "-", "o"), (VERMILION, "--", "s"))
NAMED = 9  # contacts of one path whose names fit below an axis


def along_path(result: MachineResult) -> Exhibit:
    """Every solved number over the place of the contact, with its interval where there is one, and ratings beside."""
    wanted = SHOWN if result.solved else STATED
    keys = [
        (key, name)
        for key, name in wanted
        if any(row.get(key) or key == "clr" for row in result.rows)
    ]
    series = _series(result)
    rated = any(
        rating.key in RATED.values() and "" not in rating.values for rating in result.ratings
    )

    def draw(medium: Medium) -> Figure:
        down = -(-len(keys) // 4)
        figure = Figure(figsize=(medium.double, 2.3 * down + 0.5), layout="constrained")
        for (key, name), axes in zip(
            keys, panels_in_rows(figure, len(keys), sharex=True), strict=True
        ):
            _panel(axes, result, series, key, name)
        handles, labels = figure.axes[0].get_legend_handles_labels()
        if rated:
            handles.append(Line2D([], [], color=GREY, linestyle=":"))
            labels.append(RATING)
        if len(labels) > 1:
            legend_below(figure, 3, handles=handles, labels=labels)
        return figure

    place = quantity(result.case.machine.place)
    low, high = quantity("clr").ends
    whole = any(row.get(low) is not None and row.get(high) is not None for row in result.rows)
    bars = " Bars are 90 % intervals, from surfaces, grid and iteration." if whole else ""
    what = "What was solved" if result.solved else "What the contacts are given"
    beside = (
        " Dotted: the standard's rating, which counts roughness in its own way." if rated else ""
    )
    return Exhibit(
        "path",
        draw,
        f"{what} over the {place.name}, {place.meaning}.{bars}{beside}",
        f"{len(keys)} panels over the {place.name}: {', '.join(quantity(name).name for _, name in keys)}.",
    )


def _series(result: MachineResult) -> dict[str, list[dict[str, Any]]]:
    """Rows by what they lie on: both rings of a bearing apart, each round its load zone."""
    found: dict[str, list[dict[str, Any]]] = {}
    rings = result.rows[0]["name"].endswith("ring")
    for row in result.rows:
        found.setdefault(row["bodies"][0] if rings else "contact", []).append(row)
    return {name: sorted(rows, key=lambda row: _place(result, row)) for name, rows in found.items()}


def _place(result: MachineResult, row: dict[str, Any]) -> float:
    """Where a contact is; angles run from -180 to 180 degrees, as both sides of a load zone belong together."""
    place = float(row["position"])
    turned = result.case.machine.place == "cycle_angle" and place > math.pi
    return place - math.tau if turned else place


def _panel(
    axes: Axes, result: MachineResult, series: dict[str, list[dict[str, Any]]], key: str, name: str
) -> None:
    entry, place = quantity(name), result.case.machine.place
    for (label, rows), (colour, stroke, marker) in zip(series.items(), STROKES, strict=False):
        x = display(place, np.array([_place(result, row) for row in rows]))
        y = display(name, _numbers(rows, key))
        axes.plot(x, y, stroke, color=colour, marker=marker, markersize=4, label=label)
        low, high = (display(name, _numbers(rows, end)) for end in entry.ends)
        known = np.isfinite(low) & np.isfinite(high)
        if known.any():
            axes.vlines(x[known], low[known], high[known], color=colour, linewidth=1.0)
    _draw_rating(axes, result, key)
    axes.tick_params(labelbottom=True)
    axes.set_title(entry.label, fontweight="normal", fontsize="small")
    if len(series) == 1 and 1 < len(result.rows) <= NAMED and place == "path_position_m":
        rows = next(iter(series.values()))
        x = display(place, np.array([_place(result, row) for row in rows]))
        axes.set_xticks(x, [row["name"] for row in rows], fontsize="small")
    else:
        name_axes(axes, place)
    low, high = axes.get_ylim()
    axes.set_ylim(min(0.0, low), high + 0.05 * (high - min(0.0, low)))


def _draw_rating(axes: Axes, result: MachineResult, key: str) -> None:
    """What a rating has in this panel's unit, where one has."""
    for rating in result.ratings:
        if rating.key == RATED.get(key) and "" not in rating.values:
            rows = [row for row in result.rows if row["name"] in rating.values]
            x = display(result.case.machine.place, np.array([_place(result, row) for row in rows]))
            y = display(
                rating.key, np.array([rating.values[row["name"]] for row in rows], dtype=float)
            )
            axes.plot(x, y, ":", color=GREY)


def _numbers(rows: Sequence[dict[str, Any]], key: str) -> Field:
    return np.array([np.nan if row.get(key) is None else row[key] for row in rows], dtype=float)


def fatigue_over_depth(found: DangVan) -> Exhibit:
    """Dang Van's measure over depth, of the solved contact and of the smooth one, and the material's limit."""

    def draw(medium: Medium) -> Figure:
        figure, axes = medium.panel(3.4)
        depths = display("depth_m", found.depths)
        for values, label, (colour, stroke, marker) in zip(
            (found.solved, found.smooth),
            ("solved, rough", "smooth, same friction"),
            STROKES,
            strict=True,
        ):
            axes.plot(
                display("dang_van_pa", values),
                depths,
                stroke,
                color=colour,
                marker=marker,
                markersize=3,
                label=label,
            )
        axes.axvline(
            display("dang_van_pa", found.limit),
            color="black",
            linestyle=DASHED,
            linewidth=1.0,
            label="limit",
        )
        axes.axhspan(0.0, display("depth_m", found.core_depth), color="#eef1f5", zorder=0)
        axes.set(
            xlabel=f"Dang Van's measure [{quantity('dang_van_pa').display}]",
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
        f"τ + a σ_h with a = {found.slope:.3g}, the largest of all lines along rolling, as material passes below the "
        "pattern of asperities. In the grey layer it grows as cells get finer, and is no property of the contact.",
        "Dang Van's measure over depth.",
    )
