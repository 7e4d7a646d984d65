"""The benchmark's figure: error of every certified value over the time that its case took."""

import numpy as np
from matplotlib.figure import Figure

from asperity.benchmark import BenchmarkResult
from asperity.report.style import BLUE, GREEN, GREY, ON_PAGE, VERMILION

FAMILIES = (("dry", BLUE, "o"), ("ehl", VERMILION, "s"), ("cavity", GREEN, "^"))
LEAST = 1e-8  # below which an error is drawn at it


@ON_PAGE.drawing()
def benchmark_figure(result: BenchmarkResult) -> Figure:
    """Relative error over processor time, a line for each value from coarse to fine, by family of cases."""
    figure = Figure(figsize=(ON_PAGE.single, 4.2), layout="constrained")
    axes = figure.subplots()
    named: set[str] = set()
    for case, quantity in dict.fromkeys((row.case, row.quantity) for row in result.rows):
        rows = [row for row in result.rows if (row.case, row.quantity) == (case, quantity)]
        family = case.partition("-")[0]
        colour, marker = next(((c, m) for name, c, m in FAMILIES if name == family), (GREY, "D"))
        axes.loglog(
            [max(row.seconds, 1e-4) for row in rows],
            [max(abs(row.error), LEAST) for row in rows],
            marker=marker, color=colour, linewidth=0.6, markersize=4, alpha=0.8,
            label=None if family in named else family,
        )  # fmt: skip
        named.add(family)
    axes.axhline(0.01, color=GREY, linewidth=0.8, linestyle=(0, (1, 2)))
    axes.set(xlabel="processor time of the case [s]", ylabel="error over certified value")
    cells = ", ".join(str(count) for count in np.unique([row.cells for row in result.rows]))
    axes.set_title(f"{result.solver}: error over time on {cells} cells")
    if named:
        axes.legend()
    return figure
