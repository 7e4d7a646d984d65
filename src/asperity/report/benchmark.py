"""The benchmark's figure: error of every certified value over the time that its case took."""

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
LEAST = 1e-8  # below which an error is drawn at it


@ON_PAGE.drawing()
def benchmark_figure(*results: BenchmarkResult) -> Figure:
    """Relative error over processor time, a panel a solver, a line for each value from coarse to fine."""
    figure = Figure(
        figsize=(ON_PAGE.single, 4.2 if len(results) == 1 else 3.2 * len(results)),
        layout="constrained",
    )
    rows = figure.subplots(len(results), squeeze=False, sharex=True, sharey=True)[:, 0]
    for axes, result in zip(rows, results, strict=True):
        _panel(axes, result)
    rows[-1].set_xlabel("processor time of the case [s]")
    return figure


def _panel(axes: Axes, result: BenchmarkResult) -> None:
    named: set[str] = set()
    for case, quantity in dict.fromkeys((row.case, row.quantity) for row in result.rows):
        rows = [row for row in result.rows if (row.case, row.quantity) == (case, quantity)]
        family = case.partition("-")[0]
        colour, marker = next(((c, m) for name, c, m in FAMILIES if name == family), (GREY, "D"))
        axes.loglog(
            [max(row.seconds, 1e-4) for row in rows],
            [max(abs(row.error), LEAST) for row in rows],
            marker=marker,
            color=colour,
            linewidth=0.6,
            markersize=4,
            alpha=0.8,
            label=None if family in named else family,
        )
        named.add(family)
    axes.axhline(0.01, color=GREY, linewidth=0.8, linestyle=(0, (1, 2)))
    axes.set_ylabel("error over certified value")
    cells = ", ".join(str(count) for count in np.unique([row.cells for row in result.rows]))
    axes.set_title(f"{result.solver}: error over time on {cells} cells")
    if named:
        axes.legend(ncols=2)
