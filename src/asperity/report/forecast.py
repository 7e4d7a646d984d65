"""What is foretold of a series, as pages of recordings and of an inference show it."""

from matplotlib.axes import Axes

from asperity.core.quantities import quantity
from asperity.monitoring import Bands
from asperity.report.base import Exhibit
from asperity.report.drawing import display, name_axes, one_panel
from asperity.report.style import BLUE, DASHED, VERMILION


def ahead(bands: Bands, x_label: str) -> Exhibit:
    """The limit's quantity over the series and ahead, with the limit."""
    entry, x = quantity(bands.key), bands.x
    low, middle, high = display(bands.key, bands.ends)

    @one_panel(3.2, key=3)
    def draw(axes: Axes) -> None:
        for here, colour, name in (
            (x <= bands.last, BLUE, "as heard"),
            (x >= bands.last, VERMILION, "foretold"),
        ):
            axes.fill_between(
                x[here], low[here], high[here], color=colour, alpha=0.25, linewidth=0, label=name
            )
            axes.plot(x[here], middle[here], color=colour)
        axes.axhline(
            display(bands.key, bands.limit), color="black", linestyle=DASHED, label="limit"
        )
        name_axes(axes, y=bands.key, xlabel=x_label)

    return Exhibit(
        "ahead",
        draw,
        "What possible contacts do, 90 % and median: up to the last recording as each was known then, and behind it as "
        "their drift goes on, restless as it was.",
        f"{entry.name} over the series of recordings, and its forecast with the limit",
    )
