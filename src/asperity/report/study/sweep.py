"""Exhibits of any study: each output against each swept quantity, and maps over two of them.

Swept quantities are shown in the unit they were written in.
"""

from collections.abc import Iterator
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import LogLocator

from asperity.core.arrays import Field
from asperity.core.quantities import quantity
from asperity.report.base import Exhibit
from asperity.report.drawing import ACROSS, display, draw_intervals, legend_below, panels_in_rows
from asperity.report.study.curve import stay_near
from asperity.report.study.quantity_names import axis_label, place_in_words
from asperity.report.style import BLUE, GREY, Medium
from asperity.study import (
    GROUPS,
    MEAN_CONFIDENCE,
    StudyOverview,
    SweptAxis,
    group_means,
    pair_means,
)

MOST_DRAWN = 1500  # dots as drawings; more are a picture
MOST_WRITTEN = 8  # values a side of a map whose cells hold their number


def sweep_exhibits(study: StudyOverview) -> Iterator[Exhibit]:
    """Every output against each swept quantity, and over a pair of them."""
    if not study.outputs:
        return
    for axis in study.axes:
        yield against(study, axis)
    if len(study.axes) == 2 and not any(axis.binned for axis in study.axes):
        yield over_two(study, study.axes[0], study.axes[1])


def against(study: StudyOverview, axis: SweptAxis) -> Exhibit:
    """Every output against one swept quantity: each case, and means with their intervals."""

    def draw(medium: Medium) -> Figure:
        figure, panels = _sheet(len(study.outputs), medium, shape=0.85, key=1.6)
        for key, axes in zip(study.outputs, panels, strict=True):
            _draw_against(axes, axis, display(key, study.used[key].to_numpy(dtype=float)))
            axes.set_title(quantity(key).label, fontweight="normal", fontsize="small")
        for axes in panels[-min(ACROSS, len(panels)) :]:
            axes.set_xlabel(axis_label(axis))
        mean: Any = {"color": BLUE, "marker": "o", "markersize": 3.5}
        interval = f"mean, {100 * MEAN_CONFIDENCE:.0f} % interval"
        keys = [
            Line2D([], [], color=GREY, marker=".", linestyle="none", alpha=0.7, label="case"),
            Line2D([], [], label=interval, **mean),
        ]
        legend_below(figure, handles=keys)
        return figure

    others = " over all values of the other swept quantities" if len(study.axes) > 1 else ""
    means = f"means of {GROUPS} groups of neighbours" if axis.binned else "means at each value"
    return Exhibit(
        f"against-{_file_name(axis)}",
        draw,
        f"Every output against {axis.key}: cases as dots, and {means}{others}, with the 90 % interval of each mean.",
        f"Outputs of the study against {axis.key}.",
    )


def _file_name(axis: SweptAxis) -> str:
    return axis.key.replace(".", "-").replace("_", "-")


def _draw_against(axes: Axes, axis: SweptAxis, values: Field) -> None:
    known = np.isfinite(values)
    dots: Any = {"color": GREY, "alpha": 0.6, "markersize": 4.5, "markeredgewidth": 0}
    axes.plot(axis.values[known], values[known], ".", rasterized=values.size > MOST_DRAWN, **dots)
    x, mean, low, high = group_means(axis.values[known], values[known], binned=axis.binned)
    style: Any = {"linestyle": "none" if axis.names else "-", "color": BLUE, "markersize": 3.5}
    draw_intervals(axes, x, mean, [mean - low, high - mean], "o", **style)
    stay_near(axes, values[known])
    _scale(axes, axis)


def _scale(axes: Axes, axis: SweptAxis) -> None:
    if axis.names:
        places = np.arange(len(axis.names))
        axes.set_xticks(places, axis.names, rotation=30 if max(map(len, axis.names)) > 6 else 0)
        axes.set_xlim(-0.5, places[-1] + 0.5)
    elif axis.logarithmic:
        axes.set_xscale("log")
        axes.xaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
        axes.xaxis.set_major_formatter(lambda value, _: f"{value:g}")
        axes.set_xticks([], minor=True)


def _sheet(count: int, medium: Medium, *, shape: float, key: float) -> tuple[Figure, list[Axes]]:
    """So many equal panels, in rows."""
    across = min(ACROSS, count)
    down = -(-count // across)
    line, width = medium.line_height, medium.width(across)
    height = down * (width / across * shape + 1.0 * line) + (2.0 + key) * line
    figure = Figure(figsize=(width, height), layout="constrained")
    return figure, panels_in_rows(figure, count)


def over_two(study: StudyOverview, across: SweptAxis, up: SweptAxis) -> Exhibit:
    """Means over two swept quantities as maps, a colour scale for each output; what has no value is hatched."""

    def draw(medium: Medium) -> Figure:
        figure, panels = _sheet(len(study.outputs), medium, shape=1.15, key=1.0)
        for key, axes in zip(study.outputs, panels, strict=True):
            cells = pair_means(display(key, study.used[key].to_numpy(dtype=float)), across, up)
            axes.patch.set(hatch="////", edgecolor="#9ca3af", facecolor="white")
            image = axes.imshow(
                cells, origin="lower", cmap="cividis", aspect="auto", interpolation="none"
            )
            if max(cells.shape) <= MOST_WRITTEN:
                _write_cells(axes, cells, image.norm(cells))
            _tick(axes.xaxis, across)
            _tick(axes.yaxis, up)
            axes.spines[:].set_visible(False)
            axes.set_title(quantity(key).label, fontweight="normal", fontsize="small")
            figure.colorbar(image, ax=axes, location="bottom", aspect=18, pad=0.04)
        figure.supxlabel(axis_label(across), fontsize="medium")
        figure.supylabel(axis_label(up), fontsize="medium")
        return figure

    return Exhibit(
        f"over-{_file_name(across)}-and-{_file_name(up)}",
        draw,
        f"Means over seeds at each pair of {across.key} and {up.key}. Hatched: no case that may be used.",
        f"Outputs of the study over {across.key} and {up.key}.",
    )


def _write_cells(axes: Axes, cells: Field, shade: Any) -> None:
    spread = float(np.nanmax(cells) - np.nanmin(cells))
    decimals = max(0, 1 - int(np.floor(np.log10(spread)))) if spread > 0.0 else 0
    for (j, i), value in np.ndenumerate(cells):
        if np.isfinite(value):
            axes.text(
                i,
                j,
                f"{value:.{decimals}f}",
                ha="center",
                va="center",
                fontsize="x-small",
                color="black" if shade[j, i] > 0.5 else "white",
            )


def _tick(side: Any, axis: SweptAxis) -> None:
    """The values at cell centres, thinned out where they are many."""
    places = axis.distinct
    step = -(-places.size // 6)
    side.set_ticks(
        np.arange(places.size)[::step], [place_in_words(axis, value) for value in places[::step]]
    )
