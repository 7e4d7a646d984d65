"""Building blocks of figures: axis labels from the catalogue, panels, error bars, legends."""

from collections.abc import Callable
from typing import Any, TypeVar

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter
from numpy.typing import ArrayLike

from asperity.core.arrays import Field
from asperity.core.quantities import quantity
from asperity.report.style import SPLIT_COLOUR, SPLIT_STRIP, Medium
from asperity.trend import Stages

PANELS_PER_ROW = 4
NARROW = 5.0  # inches, up to which only two panels with titles fit side by side
Value = TypeVar("Value", float, Field)


def display(key: str, values: Value) -> Value:
    """Convert stored values of a quantity to its display unit."""
    return values * quantity(key).factor


def name_axes(axes: Axes, x: str = "", y: str = "", **settings: Any) -> None:
    """Label the axes with the quantities of these keys."""
    labels = {"xlabel": x, "ylabel": y}
    axes.set(**{side: quantity(key).axis for side, key in labels.items() if key}, **settings)


def one_panel(
    height: float, *, legend_columns: int = 2
) -> Callable[[Callable[[Axes], None]], Callable[[Medium], Figure]]:
    """Decorate a function that draws on axes: it then draws a one-column figure.

    `height` is in inches; the legend below has `legend_columns` columns (0: no legend).
    """

    def decorate(draw: Callable[[Axes], None]) -> Callable[[Medium], Figure]:
        def drawn(medium: Medium) -> Figure:
            figure, axes = medium.panel(height)
            draw(axes)
            if legend_columns:
                legend_below(figure, legend_columns)
            return figure

        return drawn

    return decorate


def panels_per_row(medium: Medium, count: int) -> int:
    """Return how many of `count` maps or curves with titles stand side by side."""
    return min(PANELS_PER_ROW if medium.double > NARROW else 2, count)


def panels_in_rows(
    figure: Figure, count: int, columns: int = PANELS_PER_ROW, **sharing: Any
) -> list[Axes]:
    """Add `count` equal panels in rows of `columns`."""
    columns = min(columns, count)
    panels = list(figure.subplots(-(-count // columns), columns, squeeze=False, **sharing).flat)
    for unused in panels[count:]:
        unused.remove()
    return panels[:count]


def legend_below(figure: Figure, columns: int = 2, **settings: Any) -> None:
    """Add one legend for all panels below them."""
    figure.legend(loc="outside lower center", ncols=columns, **settings)


def group_values(values: Field, size: int) -> Field:
    """Reshape values into rows of `size` neighbours; drop an incomplete last row."""
    return values[: values.size // size * size].reshape(-1, size)


def draw_intervals(
    axes: Axes, x: ArrayLike, values: ArrayLike, bars: ArrayLike | None, marker: str, **style: Any
) -> None:
    """Draw values with error bars of these lengths; omit bars that are not finite."""
    bars = None if bars is None else np.where(np.isfinite(bars), bars, 0.0)
    axes.errorbar(x, values, bars, fmt=marker, **{"capsize": 2, "elinewidth": 0.9, **style})


def plain_log_labels(axes: Axes) -> None:
    """Label a logarithmic y axis with plain numbers; below one decade, minor ticks too."""
    low, high = axes.get_ylim()
    axes.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    if high < 12.0 * low:
        axes.yaxis.set_minor_formatter(FuncFormatter(lambda value, _: f"{value:.3g}"))


def mark_split(axes: Axes, stages: Stages | None, name: str | None = None) -> None:
    """Mark the split of a trend and its interval, if there is one."""
    if stages is not None and stages.found:
        axes.axvspan(*stages.interval, color=SPLIT_STRIP, linewidth=0, zorder=0, label=name)
        axes.axvline(stages.split, color=SPLIT_COLOUR, linewidth=1.0, zorder=0)
