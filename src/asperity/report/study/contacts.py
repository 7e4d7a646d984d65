"""Exhibits of selected contacts of a wear study (Figs 5 and 6 of the paper)."""

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from asperity.core.quantities import quantity
from asperity.report.base import Exhibit
from asperity.report.drawing import display, legend_below, panels_in_rows, panels_per_row
from asperity.report.maps import contact_colours, contact_keys, mark_hertz_zone, show_map
from asperity.report.style import Medium, Style
from asperity.results import Run
from asperity.solution import contact_state

SHARES = ("clr", "car", "car_domain")


def contact_maps(runs: Sequence[Run]) -> Exhibit:
    """Map the contact state of each run, with its CAR and CLR (Fig 6 of the paper)."""
    dry = all(run.solution.lubricant is None for run in runs)

    def draw(medium: Medium) -> Figure:
        figure, panels = _sheet(runs, medium, above=3.0, below=4.4)
        for run, axes, letter in zip(runs, panels, "abcdefgh", strict=False):
            show_map(axes, contact_colours(run.solution), run.solution)
            mark_hertz_zone(axes, run.solution, "black")
            clr, car, domain = _shares(run)
            axes.set_title(
                f"({letter}) {_sq(run)}: {clr}\n{car}\n{domain}",
                fontweight="normal",
                fontsize="small",
            )
        _label_outer(panels, panels_per_row(medium, len(runs)))
        keys = contact_keys(
            "asperity contact", *(("open gap",) if dry else ("oil film", "cavitated"))
        )
        legend_below(figure, panels_per_row(medium, max(len(runs), 2)), handles=keys)
        return figure

    values = "; ".join(f"{_sq(run)}: {', '.join(_shares(run))}" for run in runs)
    return Exhibit(
        "contact-maps",
        draw,
        "Contact state of one surface per level: asperity contact yellow, oil film blue, cavitated "
        "film striped; oil enters from the left. The shares are those of the map, at "
        "one instant if the roughness runs.",
        f"Contact maps. {values}.",
    )


def surface_maps(runs: Sequence[Run]) -> Exhibit:
    """Map the roughness of each run on a common colour scale (Fig 5 of the paper)."""

    def draw(medium: Medium) -> Figure:
        key = "surface_height"
        heights = [display(key, run.solution.surface.heights) for run in runs]
        limit = max(float(np.percentile(np.abs(field), 99.5)) for field in heights) or 1.0
        figure, panels = _sheet(runs, medium, above=1.4, below=5.4)
        for run, field, axes, letter in zip(runs, heights, panels, "abcdefgh", strict=False):
            image = show_map(axes, field, run.solution, cmap="cividis", vmin=-limit, vmax=limit)
            axes.set_title(f"({letter}) {_sq(run)}", fontweight="normal")
        _label_outer(panels, panels_per_row(medium, len(runs)))
        style: Style = {"location": "bottom", "shrink": 0.5, "aspect": 40, "extend": "both"}
        figure.colorbar(image, ax=panels, label=quantity(key).axis, **style)
        return figure

    return Exhibit(
        "surfaces",
        draw,
        "The same surfaces before deformation, on a common colour scale.",
        f"Maps of the surface heights at {', '.join(_sq(run) for run in runs)}.",
    )


def _sq(run: Run) -> str:
    return quantity("sq_m").named(run.state.sq)


def _shares(run: Run) -> list[str]:
    state = contact_state(run.solution)  # of the map; the run's may be a mean over time
    return [quantity(key).named(getattr(state, key)) for key in SHARES]


def _sheet(
    runs: Sequence[Run], medium: Medium, *, above: float, below: float
) -> tuple[Figure, list[Axes]]:
    """Create a figure of map panels, with `above` and `below` lines of text reserved."""
    columns = panels_per_row(medium, len(runs))
    rows = -(-len(runs) // columns)
    extent = runs[0].case.grid.extent
    line = medium.line_height
    width = medium.width(columns)
    panel = (width - 4.0 * line) / columns - 0.6 * line
    height = (
        rows * (panel * min(max(extent[1] / extent[0], 0.15), 1.4) + above * line) + below * line
    )
    figure = Figure(figsize=(width, height), layout="compressed")
    return figure, panels_in_rows(figure, len(runs), columns, sharex=True, sharey=True)


def _label_outer(panels: Sequence[Axes], columns: int) -> None:
    """Label only the leftmost and the lowest panels of each column; briefly in several rows."""
    across = quantity("y_m")
    label = across.axis if columns >= len(panels) else f"y [{across.display}]"
    for number, axes in enumerate(panels):
        lowest = number + columns >= len(panels)
        leftmost = number % columns == 0
        axes.set_xlabel(quantity("x_m").axis if lowest else "")
        axes.set_ylabel(label if leftmost else "")
        axes.tick_params(labelbottom=lowest, labelleft=leftmost)
