"""Exhibit of a forecast, shared by the reports of tracking and inference."""

from matplotlib.axes import Axes

from asperity.core.coverage import PERCENT
from asperity.core.quantities import quantity
from asperity.monitoring import Bands
from asperity.report.base import Exhibit
from asperity.report.drawing import display, name_axes, one_panel
from asperity.report.style import BLUE, DASHED, VERMILION


def forecast_exhibit(bands: Bands, x_label: str) -> Exhibit:
    """Draw the limited quantity over the series, its forecast and the limit."""
    entry, x = quantity(bands.key), bands.x
    low, middle, high = display(bands.key, bands.ends)

    @one_panel(3.2, legend_columns=3)
    def draw(axes: Axes) -> None:
        for part, colour, name in (
            (x <= bands.last, BLUE, "observed"),
            (x >= bands.last, VERMILION, "forecast"),
        ):
            axes.fill_between(
                x[part], low[part], high[part], color=colour, alpha=0.25, linewidth=0, label=name
            )
            axes.plot(x[part], middle[part], color=colour)
        axes.axhline(
            display(bands.key, bands.limit), color="black", linestyle=DASHED, label="limit"
        )
        name_axes(axes, y=bands.key, xlabel=x_label)

    return Exhibit(
        "ahead",
        draw,
        f"Median and {PERCENT} interval. Up to the last recording: the state inferred at each "
        "time. After it: the forecast, with the drift and its scatter continuing as observed.",
        f"{entry.name} over the series of recordings, its forecast and the limit",
    )
