"""Exhibits of any study: each output over each swept quantity, and maps over two of them.

Swept quantities are shown in the unit in which they were given.
"""

from collections.abc import Iterator

import numpy as np
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import LogLocator

from asperity.core.arrays import Field
from asperity.core.coverage import COVERAGE, PERCENT
from asperity.core.quantities import quantity
from asperity.report.base import Exhibit
from asperity.report.drawing import (
    display,
    draw_intervals,
    legend_below,
    panels_in_rows,
    panels_per_row,
)
from asperity.report.study.curve import limit_to_data
from asperity.report.study.quantity_names import axis_label, value_label
from asperity.report.style import BLUE, GREY, Medium, Style
from asperity.study import GROUPS, StudyOverview, SweptAxis, group_means, pair_means

MAX_VECTOR_DOTS = 1500  # more dots are rasterised
MAX_LABELLED_CELLS = 8  # per side of a map; a larger map has no numbers in its cells


def sweep_exhibits(study: StudyOverview) -> Iterator[Exhibit]:
    """Yield every output over each swept quantity, and over a pair of them."""
    if not study.outputs:
        return
    for axis in study.axes:
        yield output_curves(study, axis)
    if len(study.axes) == 2 and not any(axis.binned for axis in study.axes):
        yield output_maps(study, study.axes[0], study.axes[1])


def output_curves(study: StudyOverview, axis: SweptAxis) -> Exhibit:
    """Draw every output over one swept quantity: each case, and means with intervals."""

    def draw(medium: Medium) -> Figure:
        figure, panels = _panel_figure(len(study.outputs), medium, shape=0.85, legend_lines=1.6)
        for key, axes in zip(study.outputs, panels, strict=True):
            _draw_output(axes, axis, key, study.used[key].to_numpy(dtype=float))
            axes.set_title(quantity(key).label, fontweight="normal", fontsize="small")
        for axes in panels[-panels_per_row(medium, len(panels)) :]:
            axes.set_xlabel(axis_label(axis))
        mean: Style = {"color": BLUE, "marker": "o", "markersize": 3.5}
        interval = f"mean, {100 * COVERAGE:.0f} % interval"
        keys = [
            Line2D([], [], color=GREY, marker=".", linestyle="none", alpha=0.7, label="case"),
            Line2D([], [], label=interval, **mean),
        ]
        legend_below(figure, handles=keys)
        return figure

    others = " over all values of the other swept quantities" if len(study.axes) > 1 else ""
    means = f"means of {GROUPS} bins" if axis.binned else "means at each value"
    return Exhibit(
        f"against-{_file_name(axis)}",
        draw,
        f"Outputs over {axis.key}: cases as dots, and {means}{others}, with {PERCENT} intervals of "
        "the mean.",
        f"Outputs of the study over {axis.key}.",
    )


def _file_name(axis: SweptAxis) -> str:
    return axis.key.replace(".", "-").replace("_", "-")


def _draw_output(axes: Axes, axis: SweptAxis, key: str, stored: Field) -> None:
    finite = np.isfinite(stored)
    values = display(key, stored)
    dots: Style = {"color": GREY, "alpha": 0.6, "markersize": 4.5, "markeredgewidth": 0}
    axes.plot(
        axis.values[finite], values[finite], ".", rasterized=values.size > MAX_VECTOR_DOTS, **dots
    )
    x, *means = group_means(key, axis.values[finite], stored[finite], binned=axis.binned)
    mean, low, high = (display(key, column) for column in means)
    style: Style = {"linestyle": "none" if axis.names else "-", "color": BLUE, "markersize": 3.5}
    draw_intervals(axes, x, mean, [mean - low, high - mean], "o", **style)
    limit_to_data(axes, values[finite])
    _scale(axes, axis)


def _scale(axes: Axes, axis: SweptAxis) -> None:
    if axis.names:
        positions = np.arange(len(axis.names))
        axes.set_xticks(positions, axis.names, rotation=30 if max(map(len, axis.names)) > 6 else 0)
        axes.set_xlim(-0.5, positions[-1] + 0.5)
    elif axis.logarithmic:
        axes.set_xscale("log")
        axes.xaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
        axes.xaxis.set_major_formatter(lambda value, _: f"{value:g}")
        axes.set_xticks([], minor=True)


def _panel_figure(
    count: int, medium: Medium, *, shape: float, legend_lines: float
) -> tuple[Figure, list[Axes]]:
    """Create a figure with `count` equal panels in rows."""
    columns = panels_per_row(medium, count)
    rows = -(-count // columns)
    line = medium.line_height
    width = medium.width(columns)
    height = rows * (width / columns * shape + 1.0 * line) + (2.0 + legend_lines) * line
    figure = Figure(figsize=(width, height), layout="constrained")
    return figure, panels_in_rows(figure, count, columns)


def output_maps(study: StudyOverview, x_axis: SweptAxis, y_axis: SweptAxis) -> Exhibit:
    """Map the mean of every output over two swept quantities; cells without values are hatched."""

    def draw(medium: Medium) -> Figure:
        figure, panels = _panel_figure(len(study.outputs), medium, shape=1.15, legend_lines=1.0)
        for key, axes in zip(study.outputs, panels, strict=True):
            values = display(key, study.used[key].to_numpy(dtype=float))
            cells = pair_means(values, x_axis, y_axis)
            axes.patch.set(hatch="////", edgecolor="#9ca3af", facecolor="white")
            image = axes.imshow(
                cells, origin="lower", cmap="cividis", aspect="auto", interpolation="none"
            )
            if max(cells.shape) <= MAX_LABELLED_CELLS:
                _label_cells(axes, cells, np.asarray(image.norm(cells)))
            _tick(axes.xaxis, x_axis)
            _tick(axes.yaxis, y_axis)
            axes.spines[:].set_visible(False)
            axes.set_title(quantity(key).label, fontweight="normal", fontsize="small")
            figure.colorbar(image, ax=axes, location="bottom", aspect=18, pad=0.04)
        figure.supxlabel(axis_label(x_axis), fontsize="medium")
        figure.supylabel(axis_label(y_axis), fontsize="medium")
        return figure

    return Exhibit(
        f"over-{_file_name(x_axis)}-and-{_file_name(y_axis)}",
        draw,
        f"Means over seeds at each pair of {x_axis.key} and {y_axis.key}. Hatched: no usable case.",
        f"Outputs of the study over {x_axis.key} and {y_axis.key}.",
    )


def _label_cells(axes: Axes, cells: Field, shade: Field) -> None:
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


def _tick(side: Axis, axis: SweptAxis) -> None:
    """Set tick labels at cell centres, at most about six."""
    values = axis.distinct
    step = -(-values.size // 6)
    side.set_ticks(
        np.arange(values.size)[::step], [value_label(axis, value) for value in values[::step]]
    )
