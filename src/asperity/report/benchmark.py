"""Figures of a benchmark: error of each certified value over computing time; measurements."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.figure import Figure, SubFigure
from matplotlib.ticker import FormatStrFormatter, LogLocator, NullFormatter

from asperity.benchmark import (
    BenchmarkResult,
    Comparison,
    DimpleProfile,
    ExperimentResult,
    NotComputed,
)
from asperity.core.errors import BadInput
from asperity.core.quantities import quantity
from asperity.report.style import BLUE, GREEN, GREY, ON_PAGE, SPLIT_COLOUR, VERMILION

FAMILIES = (
    ("dry", BLUE, "o"),
    ("ehl", VERMILION, "s"),
    ("mixed", SPLIT_COLOUR, "D"),
    ("conserving", GREEN, "v"),
    ("moving", "black", "P"),
    ("cavity", GREEN, "^"),
)
SMALLEST_ERROR = 1e-8  # smaller errors are drawn at this value


@ON_PAGE.drawing()
def benchmark_figure(*results: BenchmarkResult) -> Figure:
    """Draw relative error over CPU time, one panel per solver, one line per value."""
    figure = Figure(
        figsize=(ON_PAGE.single, 4.2 if len(results) == 1 else 3.2 * len(results)),
        layout="constrained",
    )
    rows = figure.subplots(len(results), squeeze=False, sharex=True, sharey=True)[:, 0]
    for axes, result in zip(rows, results, strict=True):
        _panel(axes, result)
    rows[-1].set_xlabel("CPU time of the case [s]")
    return figure


def _panel(axes: Axes, result: BenchmarkResult) -> None:
    labelled: set[str] = set()
    for case, key in dict.fromkeys((row.case, row.quantity) for row in result.rows):
        rows = [row for row in result.rows if (row.case, row.quantity) == (case, key)]
        family = case.partition("-")[0]
        colour, marker = next(((c, m) for name, c, m in FAMILIES if name == family), (GREY, "D"))
        axes.loglog(
            [max(row.seconds, 1e-4) for row in rows],
            [max(abs(row.error), SMALLEST_ERROR) for row in rows],
            marker=marker,
            color=colour,
            linewidth=0.6,
            markersize=4,
            alpha=0.8,
            label=None if family in labelled else family,
        )
        labelled.add(family)
    axes.axhline(0.01, color=GREY, linewidth=0.8, linestyle=(0, (1, 2)))
    axes.set_ylabel("relative error")
    cells = ", ".join(str(count) for count in np.unique([row.cells for row in result.rows]))
    axes.set_title(f"{result.solver}: error over computing time, {cells} cells")
    if labelled:
        axes.legend(ncols=2)


@ON_PAGE.drawing()
def experiment_figure(result: ExperimentResult) -> Figure:
    """Draw every set in a row: measured and computed values, and their ratio.

    Rows of profiles over a dimple and of what is not computed follow.
    """
    shown = [entry for entry in result.comparisons if len(entry.points) > 1]
    runs = dict.fromkeys(profile.run for profile in result.profiles)
    heights = [2.6] * len(shown) + [2.0] * len(runs) + [2.2] * len(result.not_computed)
    if not heights:
        raise BadInput("a figure needs a set of two or more measured values; write a .csv")
    figure = Figure(figsize=(ON_PAGE.double, sum(heights)), layout="constrained")
    column = figure.subfigures(len(heights), 1, height_ratios=heights, squeeze=False)
    rows = iter(column[:, 0])
    for entry, row in zip(shown, rows, strict=False):
        values, ratios = row.subplots(1, 2, sharex=True)
        _values_panel(values, entry)
        _ratio_panel(ratios, entry)
    for run, row in zip(runs, rows, strict=False):
        row.suptitle(f"Dimple, {run}", fontsize="medium")
        _profile_panels(row, [profile for profile in result.profiles if profile.run == run])
    for missing, row in zip(result.not_computed, rows, strict=False):
        _measured_panel(row.subplots(), missing)
    return figure


def _profile_panels(row: SubFigure, profiles: list[DimpleProfile]) -> None:
    panels = row.subplots(1, len(profiles), sharex=True, sharey=True, squeeze=False)[0]
    for axes, profile in zip(panels, profiles, strict=True):
        _profile_panel(axes, profile)
    panels[0].set_ylabel("film [µm]")
    panels[0].legend(fontsize="x-small")


def _profile_panel(axes: Axes, profile: DimpleProfile) -> None:
    """Draw the measured, the simulated and the computed film on the axis at a moment."""
    for (x, film), style, colour, name in (
        (profile.measured, ".", VERMILION, "measured"),
        (profile.simulated, "--", GREY, "simulated"),
        ((profile.x, profile.beside_measured), "-", BLUE, "computed"),
    ):
        axes.plot(1e6 * x, 1e6 * film, style, color=colour, label=name, markersize=2)
    half = 1e6 * profile.half_width
    axes.set_xlim(-half, half)
    axes.set_ylim(0.0, 1.3e6 * float(np.percentile(profile.measured[1], 90)))
    axes.set_xlabel("x [µm]")


def _measured_panel(axes: Axes, missing: NotComputed) -> None:
    """Draw measured values that cannot be computed."""
    kind, points = quantity(missing.key), missing.points
    axes.errorbar(
        [point.swept for point in points],
        [point.value * kind.factor for point in points],
        [(point.deviation or 0.0) * kind.factor for point in points],
        fmt="o",
        color=VERMILION,
        markersize=3,
    )
    axes.set_ylim(0.0)
    axes.set_xlabel(missing.swept)
    axes.set_ylabel(kind.label)
    axes.set_title(f"{missing.title}: not computed")


def _values_panel(axes: Axes, entry: Comparison) -> None:
    """Draw measured values with the deviation of repeats, and computed ones with their limits."""
    kind = quantity(entry.experiment.key)
    x = [point.swept for point in entry.points]
    measured, computed = (
        [getattr(point, name) * kind.factor for point in entry.points]
        for name in ("measured", "computed")
    )
    axes.loglog(x, computed, color=BLUE, label="computed")
    if entry.mean_interval is not None:
        low, high = (
            [getattr(point, name) * kind.factor for point in entry.points]
            for name in ("low", "high")
        )
        axes.fill_between(x, low, high, color=BLUE, alpha=0.2, linewidth=0)
    deviations = [(point.deviation or 0.0) * kind.factor for point in entry.points]
    axes.errorbar(x, measured, deviations, fmt="o", color=VERMILION, markersize=3, label="measured")
    axes.set_ylabel(kind.label)
    _set_plain_ticks(axes.yaxis)
    axes.set_title(entry.experiment.title)
    axes.legend()
    _label_swept(axes, entry)


def _ratio_panel(axes: Axes, entry: Comparison) -> None:
    x = [point.swept for point in entry.points]
    axes.semilogx(x, [point.ratio for point in entry.points], "o-", color=BLUE, markersize=3)
    isothermal = [point.isothermal_ratio for point in entry.points]
    axes.semilogx(x, isothermal, ":", color=GREEN, label="without inlet shear heating")
    axes.legend()
    axes.axhline(1.0, color=GREY, linewidth=0.8)
    axes.set_ylabel("computed / measured")
    fitted = ", viscosity fitted" if entry.fitted_viscosity is not None else ""
    axes.set_title(f"mean {entry.mean:.3f}, scatter {100.0 * entry.scatter:.1f} %{fitted}")
    _label_swept(axes, entry)


def _label_swept(axes: Axes, entry: Comparison) -> None:
    key, _, unit = entry.experiment.swept.partition(" ")
    _set_plain_ticks(axes.xaxis)
    axes.set_xlabel(f"{key.rpartition('.')[2].replace('_', ' ')} {unit}")


def _set_plain_ticks(axis: Axis) -> None:
    """Label 1, 2 and 5 of every decade as plain numbers."""
    axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    axis.set_major_formatter(FormatStrFormatter("%g"))
    axis.set_minor_formatter(NullFormatter())
