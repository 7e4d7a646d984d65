"""Exhibits of a history: curves over time and over passes."""

from collections.abc import Mapping, Sequence

import numpy as np
import pandas
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from asperity.core.arrays import Field
from asperity.core.quantities import quantity
from asperity.report.base import Exhibit
from asperity.report.drawing import display, name_axes
from asperity.report.style import BLUE, GREEN, GREY, VERMILION, Medium
from asperity.simulation import History

STYLES = (("-", BLUE), ("--", VERMILION), (":", GREEN))
PANELS = (  # over time: quantity of the axis, and of its curves
    ("share", ("clr", "car")),
    ("film_thickness_m", ("h_mean_m", "h_central_m", "h_min_m")),
    (
        "friction_coefficient",
        ("friction_coefficient", "friction_asperity_part", "friction_oil_part"),
    ),
    ("power_w", ("friction_power_w", "flow_power_w")),
    ("frequency_hz", ("resonance_hz",)),
)
PASSES = (
    ("share", ("clr", "car")),
    ("track_sq_m", ("track_sq_m",)),
    ("flattened_m", ("flattened_m",)),
    ("frequency_hz", ("resonance_hz",)),
)


def _with_values(
    panels: Sequence[tuple[str, tuple[str, ...]]], table: pandas.DataFrame
) -> list[tuple[str, tuple[str, ...]]]:
    """Return the panels that have values."""
    return [panel for panel in panels if bool(table[panel[1][0]].notna().any())]


def curves(history: History) -> Exhibit:
    """Draw shares, film, friction, power and resonance over time; averaged steps are shaded."""
    table = history.table

    def draw(medium: Medium) -> Figure:
        panels = _with_values(PANELS, table)
        figure = Figure(figsize=(medium.double, 1.55 * len(panels) + 0.5))
        all_axes = figure.subplots(len(panels), 1, sharex=True, squeeze=False)[:, 0]
        bottom = 0.5 / figure.get_size_inches()[1]
        figure.subplots_adjust(left=0.09, right=0.985, top=0.985, bottom=bottom, hspace=0.12)
        time, averaged = (
            display("time_s", rows["time_s"].to_numpy()) for rows in (table, history.settled)
        )
        for axes, (side, keys) in zip(all_axes, panels, strict=True):
            _draw_over_time(
                axes,
                time,
                {quantity(key).title: display(key, table[key].to_numpy()) for key in keys},
            )
            axes.axvspan(float(averaged[0]), time[-1], color=GREY, alpha=0.08, linewidth=0.0)
            axes.set_ylabel(quantity(side).label)
        name_axes(all_axes[-1], "time_s")
        return figure

    return Exhibit(
        "over-time",
        draw,
        "History over time. Means and standard deviations are taken over the shaded steps. "
        "Vertical line: the step shown in the maps.",
        "Load and area shares, film, friction, power and resonance over time",
    )


def _draw_over_time(axes: Axes, time: Field, lines: Mapping[str, Field]) -> None:
    for (name, values), (line_style, colour) in zip(lines.items(), STYLES, strict=False):
        axes.plot(time, values, line_style, color=colour, label=name)
    axes.set_xlim(0.0, float(time[-1]) or 1.0)
    low, high = axes.get_ylim()
    low = (
        0.0
        if min(float(np.nanmin(values)) for values in lines.values()) >= 0.0 and low < 0.4 * high
        else low
    )
    axes.set_ylim(low, high + 0.28 * (high - low))  # room for the legend
    axes.legend(loc="upper right", ncols=3)


def running_in(history: History) -> Exhibit:
    """Draw shares, Sq and flattening of the tracks, and resonance over passes."""
    table = history.by_pass()

    def draw(medium: Medium) -> Figure:
        panels = _with_values(PASSES, table)
        rows = -(-len(panels) // 2)
        figure = Figure(figsize=(medium.double, 2.4 * rows), layout="constrained")
        for number, (side, keys) in enumerate(panels, 1):
            axes = figure.add_subplot(rows, 2, number)
            for key, (_, colour), marker in zip(keys, STYLES, "os", strict=False):
                values = display(key, table[key].to_numpy())
                title = quantity(key).title
                axes.plot(
                    table["pass"], values, marker=marker, markersize=3.5, color=colour, label=title
                )
            if len(keys) > 1:
                axes.set_ylim(0.0, 1.3 * axes.get_ylim()[1])  # room for the legend
            if keys != (side,):  # otherwise the axis label suffices
                axes.legend(loc="best")
            axes.set(ylabel=quantity(side).label, xlabel="pass")
            axes.xaxis.set_major_locator(MaxNLocator(integer=True))
        return figure

    return Exhibit(
        "passes",
        draw,
        "Running-in, one point per pass of the rough surface: load and area shares and resonance "
        "averaged over the pass, Sq and flattening at its end. Flattened volume is distributed "
        "uniformly: the mean plane rises, and at constant load the bodies separate equally.",
        "Load and area shares, Sq, flattening and resonance over passes",
    )
