"""Figures of a sensitivity study and of a calibration."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from asperity.core.arrays import Field
from asperity.core.quantities import in_print, quantity
from asperity.report.drawing import display, name_axes
from asperity.report.study.quantity_names import NAMES
from asperity.report.style import BLUE, GREEN, GREY, ON_PAGE, STYLE, VERMILION, Style
from asperity.study import CalibratedParameter, Calibration, Sensitivity, SensitivityOutcome

DARK = 0.55  # share above which a cell's number is white
MAX_DEVIATION = 8.0  # tolerances; larger deviations are drawn at the edge with an arrow
OUTCOMES = ("car", "clr", "crf_hz", "log10_crfa", "knee_m")


@ON_PAGE.drawing()
def sensitivity_figure(result: Sensitivity) -> Figure:
    """Draw the effect of each factor on each outcome; dark cells are the largest shares."""
    overall = result.overall()
    outcomes = result.outcomes
    order = [str(name) for name in overall.index]
    figure = Figure(
        figsize=(2.6 + 0.52 * len(outcomes), 1.55 + 0.34 * len(order)), layout="constrained"
    )
    axes, side = figure.subplots(1, 2, width_ratios=(0.52 * len(outcomes), 1.3), sharey=True)
    _draw_effects(axes, result, order)
    side.barh(
        range(len(order)),
        [display("share", overall[name]) for name in order],
        color=BLUE,
        height=0.7,
    )
    side.tick_params(left=False, labelleft=False)
    side.set(xlabel=f"mean {quantity('share').label}")
    morris = result.method == "morris"
    measure = "mean effect over the range (Morris' μ*)" if morris else "total Sobol index"
    title: Style = {"fontsize": STYLE["axes.titlesize"], "fontweight": "bold"}
    figure.suptitle(f"Sensitivity of the curves: {measure}", x=0.01, ha="left", **title)
    return figure


def _draw_effects(axes: Axes, result: Sensitivity, order: list[str]) -> None:
    outcomes = result.outcomes
    share, measure = (_effects(result, order, column) for column in ("share", result.measure))
    top = max(0.7, float(share.max()))
    axes.imshow(share, cmap="Blues", vmin=0.0, vmax=top, aspect="auto")
    for (row, column), dark in np.ndenumerate(share > DARK * top):
        effect = measure[row, column]
        number = quantity(outcomes[column].quantity).number
        text = f"{effect:.2f}" if result.method == "sobol" else number(effect)
        style: Style = {"fontsize": 8, "color": "white" if dark else "black"}
        axes.text(column, row, text, ha="center", va="center", **style)
    axes.set_yticks(range(len(order)), [NAMES.get(name, name) for name in order])
    levels = [display("sq_m", outcome.sq) for outcome in outcomes]
    axes.set_xticks(range(len(outcomes)), [f"{sq:g}" if np.isfinite(sq) else "" for sq in levels])
    axes.tick_params(length=0)
    axes.spines[:].set_visible(False)
    axes.set_xlabel(quantity("sq_m").label)
    _draw_column_heads(axes, outcomes)


def _effects(result: Sensitivity, order: list[str], column: str) -> Field:
    """Return a column of the effects as an array, shape (factors, outcomes)."""
    effects = result.effects
    labels = zip(effects["factor"], effects["outcome"], strict=True)
    values = dict(zip(labels, effects[column], strict=True))
    return np.array([[values[name, outcome.name] for outcome in result.outcomes] for name in order])


def _draw_column_heads(axes: Axes, outcomes: tuple[SensitivityOutcome, ...]) -> None:
    """Write the names of the quantities above their columns, separated by white lines."""
    for key in OUTCOMES:
        columns = [column for column, outcome in enumerate(outcomes) if outcome.quantity == key]
        if columns:
            middle = (columns[0] + columns[-1]) / 2.0
            first = columns[0]
            axes.annotate(
                quantity(key).label,
                (middle, 1.0),
                xycoords=("data", "axes fraction"),
                xytext=(0, 4),
                textcoords="offset points",
                ha="center",
                fontsize=8.5,
            )
            if first:
                axes.axvline(first - 0.5, color="white", linewidth=3)


@ON_PAGE.drawing()
def calibration_figure(result: Calibration) -> Figure:
    """Draw deviations from the anchors, parameters in their ranges and calibrated curves."""
    figure = Figure(figsize=(11.2, 4.3), layout="constrained")
    left, middle, right = figure.subplots(1, 3, width_ratios=(1.0, 1.05, 1.1))
    _draw_deviations(left, result)
    _draw_ranges(middle, result)
    _draw_curves(right, result)
    return figure


def _draw_deviations(axes: Axes, result: Calibration) -> None:
    names = [anchor.name for anchor in result.aimed_at]
    axes.axvspan(-1.0, 1.0, color="#dbeafe", linewidth=0)
    tables = (
        ("initial", result.start, GREY, "x"),
        ("calibrated", result.fit, BLUE, "o"),
        ("validated", result.check, VERMILION, "s"),
    )
    for number, (_, table, colour, marker) in enumerate(tables):
        deviations = dict(zip(table["anchor"], table["miss"] / table["tolerance"], strict=True))
        for row, name in enumerate(names):
            y = row + 0.2 * (number - 1)
            if np.isfinite(deviations[name]):
                _mark_deviation(axes, deviations[name], y, colour, marker)
    axes.axvline(0.0, color="black", linewidth=0.8)
    axes.set(xlim=(-1.1 * MAX_DEVIATION, 1.1 * MAX_DEVIATION), ylim=(len(names) - 0.5, -0.5))
    axes.set(xlabel="deviation [tolerances]", title="Anchors")
    axes.set_yticks(range(len(names)), [_wrapped(name) for name in names], fontsize=8)
    handles = [
        Line2D([], [], linestyle="", color=c, marker=m, markersize=5, label=label)
        for label, _, c, m in tables
    ]
    axes.legend(
        handles=handles, loc="lower center", bbox_to_anchor=(0.3, -0.34), ncols=3, columnspacing=1.0
    )


def _mark_deviation(axes: Axes, deviation: float, y: float, colour: str, marker: str) -> None:
    """Mark a deviation; one beyond the axis becomes an arrow at its end, with its value."""
    outside = abs(deviation) > MAX_DEVIATION
    side = float(np.sign(deviation))
    symbol = (">" if side > 0 else "<") if outside else marker
    x = side * MAX_DEVIATION if outside else deviation
    axes.plot(x, y, symbol, color=colour, markersize=5)
    if outside:
        axes.annotate(
            f"{deviation:.0f}",
            (x, y),
            xytext=(-7 * side, 0),
            textcoords="offset points",
            ha="right" if side > 0 else "left",
            va="center",
            fontsize=7.5,
            color=colour,
        )


def _draw_ranges(axes: Axes, result: Calibration) -> None:
    for row, parameter in enumerate(result.parameters):
        colour = BLUE if parameter.identifiable else GREY
        share = parameter.range.share(parameter.value)
        axes.plot((0.0, 1.0), (row, row), color="#e5e7eb", linewidth=9, solid_capstyle="butt")
        limits = [parameter.range.share(end) for end in (parameter.low, parameter.high)]
        axes.plot(limits, (row, row), color=colour, linewidth=3, solid_capstyle="butt")
        axes.plot(share, row, "o", color=colour, markersize=6)
        axes.annotate(
            _in_words(parameter),
            (0.0, row),
            xytext=(0, 8),
            textcoords="offset points",
            fontsize=8.5,
            color="black",
        )
        for end, value, align in (
            (0.0, parameter.range.low, "left"),
            (1.0, parameter.range.high, "right"),
        ):
            axes.annotate(
                f"{value:g}",
                (end, row),
                xytext=(0, -13),
                textcoords="offset points",
                ha=align,
                fontsize=7.5,
                color=GREY,
            )
    axes.set(
        xlim=(-0.02, 1.02),
        ylim=(len(result.parameters) - 0.4, -0.7),
        title="Free parameters in their ranges",
    )
    axes.set_yticks([])
    axes.set_xticks([])
    axes.spines[:].set_visible(False)
    axes.annotate(
        "bar: one standard deviation; grey: not determined",
        (0.0, -0.02),
        xycoords="axes fraction",
        va="top",
        fontsize=8,
        color=GREY,
    )


def _in_words(parameter: CalibratedParameter) -> str:
    unit = f" {parameter.range.unit}" if parameter.range.unit else ""
    text = f"{NAMES.get(parameter.range.key, parameter.range.key)}: {parameter.value:.3g}{unit}"
    return f"{text}, {quantity('share').text(parameter.learnt)} learnt"


def _draw_curves(axes: Axes, result: Calibration) -> None:
    sq = display("sq_m", result.check_curve.sq)
    start = display("sq_m", result.start_curve.sq)
    for key, colour, line_style, marker in (
        ("car_domain", BLUE, "-", "o"),
        ("clr", VERMILION, "--", "s"),
    ):
        style: Style = {
            "color": colour,
            "marker": marker,
            "markersize": 4,
            "label": quantity(key).short,
        }
        low, high = display(key, result.check_curve.interval(key)).T
        axes.fill_between(sq, low, high, color=colour, alpha=0.15, linewidth=0)
        axes.plot(sq, display(key, result.check_curve.mean(key)), line_style, **style)
        axes.plot(
            start, display(key, result.start_curve.mean(key)), ":", color=colour, linewidth=1.0
        )
        for anchor in result.anchors:
            if anchor.quantity == key and anchor.since is None and anchor.sq is not None:
                value, tolerance = (
                    display(key, number) for number in (anchor.value, anchor.tolerance)
                )
                at_sq = display("sq_m", anchor.sq)
                axes.errorbar(
                    at_sq, value, tolerance, fmt="D", color=GREEN, markersize=4, capsize=2, zorder=5
                )
    axes.plot([], [], ":", color=GREY, linewidth=1.0, label="initial")
    axes.plot([], [], "D", color=GREEN, markersize=4, label="anchors")
    name_axes(axes, "sq_m", "share", ylim=(0.0, 105.0), title="Validated on other surfaces")
    axes.legend(loc="lower center", bbox_to_anchor=(0.45, -0.34), ncols=4, columnspacing=1.0)


def _wrapped(name: str) -> str:
    """Break a name into two lines of about equal length."""
    words = in_print(name).split(" ")
    cut = min(range(1, len(words) + 1), key=lambda i: abs(len(" ".join(words[:i])) - len(name) / 2))
    return "\n".join(part for part in (" ".join(words[:cut]), " ".join(words[cut:])) if part)
