"""Figure of a benchmark: error of each certified value over computing time."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from asperity.benchmark import BenchmarkResult
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
    for case, quantity in dict.fromkeys((row.case, row.quantity) for row in result.rows):
        rows = [row for row in result.rows if (row.case, row.quantity) == (case, quantity)]
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
