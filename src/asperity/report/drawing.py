"""What figures are made of: axes named by the catalogue, panels, error bars, the key below."""

from collections.abc import Callable
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter

from asperity.core.arrays import Field
from asperity.core.quantities import quantity
from asperity.report.style import SPLIT_COLOUR, SPLIT_STRIP, Medium
from asperity.trend import Stages

ACROSS = 4  # panels in a row


def display(key: str, values: Any) -> Any:
    """Stored values of a quantity in its display unit."""
    return values * quantity(key).factor


def name_axes(axes: Axes, x: str = "", y: str = "", **settings: Any) -> None:
    """Label the axes by the keys of what they show."""
    labels = {"xlabel": x, "ylabel": y}
    axes.set(**{side: quantity(key).axis for side, key in labels.items() if key}, **settings)


def one_panel(
    height: float, *, key: int = 2
) -> Callable[[Callable[[Axes], None]], Callable[[Medium], Figure]]:
    """Make of what draws on axes a figure of one column, so high [inches], with its key below in so many columns."""

    def decorate(draw: Callable[[Axes], None]) -> Callable[[Medium], Figure]:
        def drawn(medium: Medium) -> Figure:
            figure, axes = medium.panel(height)
            draw(axes)
            if key:
                legend_below(figure, key)
            return figure

        return drawn

    return decorate


def panels_in_rows(figure: Figure, count: int, **sharing: Any) -> list[Axes]:
    """So many equal panels, `ACROSS` in a row."""
    across = min(ACROSS, count)
    panels = list(figure.subplots(-(-count // across), across, squeeze=False, **sharing).flat)
    for spare in panels[count:]:
        spare.remove()
    return panels[:count]


def legend_below(figure: Figure, columns: int = 2, **settings: Any) -> None:
    """The key of all panels, below them."""
    figure.legend(loc="outside lower center", ncols=columns, **settings)


def neighbours(values: Field, together: int) -> Field:
    """So many values at a time, a row each; a rest is left out."""
    return values[: values.size // together * together].reshape(-1, together)


def draw_intervals(axes: Axes, x: Any, values: Any, reach: Any, marker: str, **style: Any) -> None:
    """Values with the lengths of their error bars; no bar where there is no interval."""
    reach = None if reach is None else np.where(np.isfinite(reach), reach, 0.0)
    axes.errorbar(x, values, reach, fmt=marker, **{"capsize": 2, "elinewidth": 0.9, **style})


def plain_powers(axes: Axes) -> None:
    """A logarithmic ordinate in plain numbers, 0.02; of less than a decade with those between its powers of ten."""
    low, high = axes.get_ylim()
    axes.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    if high < 12.0 * low:
        axes.yaxis.set_minor_formatter(FuncFormatter(lambda value, _: f"{value:.3g}"))


def mark_split(axes: Axes, stages: Stages | None, name: str | None = None) -> None:
    """The split of a trend and the interval in which it lies with 90 %, where there is one."""
    if stages is not None and stages.found:
        axes.axvspan(*stages.interval, color=SPLIT_STRIP, linewidth=0, zorder=0, label=name)
        axes.axvline(stages.split, color=SPLIT_COLOUR, linewidth=1.0, zorder=0)
