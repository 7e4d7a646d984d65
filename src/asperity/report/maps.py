"""Maps of a contact: a quantity in colours, the contact state, the Hertz zone.

All maps of a contact have the same position in their figures.
"""

from collections.abc import Callable, Sequence
from typing import Any, Literal

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from matplotlib.image import AxesImage
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from asperity.core.arrays import Field
from asperity.core.quantities import quantity
from asperity.ehl import ContactSolution
from asperity.report.drawing import display, name_axes
from asperity.report.style import (
    CAVITY_COLOUR,
    CAVITY_STRIPE,
    CONTACT_COLOUR,
    DASHED,
    GAP_COLOUR,
    OIL_COLOUR,
    Medium,
    Style,
)


def map_figure(medium: Medium, extent: tuple[float, float]) -> tuple[Figure, Axes]:
    """Create a figure for a map of this extent, with room for a legend below."""
    left = 0.76  # for numbers of four characters and the label beside them
    width = medium.single - left - 0.21
    below = 1.0
    above = 0.32
    height = width * min(max(extent[1] / extent[0], 0.15), 1.4)
    total = below + height + above
    figure = Figure(figsize=(medium.single, total))
    return figure, figure.add_axes(
        (left / medium.single, below / total, width / medium.single, height / total)
    )


def show_map(axes: Axes, values: Field, solution: ContactSolution, **style: Any) -> AxesImage:
    """Draw values (nx, ny) or colours (nx, ny, 3) over the contact; oil enters from the left."""
    (x0, y0) = solution.grid.lower
    (x1, y1) = solution.grid.upper
    corners = (*display("x_m", np.array([x0, x1])), *display("y_m", np.array([y0, y1])))
    roller = solution.conditions.geometry == "roller"
    aspect: Literal["auto", "equal"] = (
        "auto" if roller else "equal"
    )  # a roller is too long to be drawn to scale
    image = axes.imshow(
        np.swapaxes(values, 0, 1),
        origin="lower",
        extent=corners,
        interpolation="none",
        aspect=aspect,
        **style,
    )
    name_axes(axes, "x_m", "y_m")
    axes.spines[:].set_visible(False)
    if roller:
        axes.tick_params(
            axis="y", labelrotation=90
        )  # numbers of four digits do not fit horizontally
    return image


def map_drawer(
    solution: ContactSolution,
    key: str,
    values: Field,
    title: str,
    *,
    extend: str = "neither",
    ticks: Sequence[float] | None = None,
    **style: Any,
) -> Callable[[Medium], Figure]:
    """Return a function that draws the map of a quantity.

    `values` of shape (nx, ny) are in the stored unit; the map has the Hertz zone and a colour bar.
    """

    def draw(medium: Medium) -> Figure:
        figure, axes = map_figure(medium, solution.grid.extent)
        image = show_map(axes, display(key, values), solution, **style)
        mark_hertz_zone(axes, solution, "white")
        axes.set_title(title)
        colour_bar(figure, axes, image, key, extend=extend, ticks=ticks)
        return figure

    return draw


def colour_bar(
    figure: Figure, axes: Axes, image: ScalarMappable, key: str, **settings: Any
) -> None:
    """Add the colour bar of a quantity below its map."""
    box = axes.get_position()
    total = figure.get_size_inches()[1]
    bar_axes = figure.add_axes((box.x0, 0.42 / total, box.width, 0.11 / total))
    figure.colorbar(
        image, cax=bar_axes, orientation="horizontal", label=quantity(key).axis, **settings
    )


def mark_hertz_zone(axes: Axes, solution: ContactSolution, colour: str) -> None:
    """Draw the outline of the smooth, dry contact as a dashed line."""
    a, b = (display("x_m", half_width) for half_width in solution.conditions.hertz.half_widths)
    style: Style = {"color": colour, "linestyle": DASHED, "linewidth": 1.0}
    if solution.conditions.endless:
        for side in (-a, a):
            axes.axvline(side, **style)
    elif solution.conditions.long:
        sliced = solution.conditions.sliced_load
        loaded = sliced.line_load > 0.0
        y = display("y_m", sliced.y[loaded])
        side = a * np.sqrt(sliced.line_load[loaded] / sliced.line_load.mean())
        axes.plot(np.concatenate([side, -side[::-1]]), np.concatenate([y, y[::-1]]), **style)
    else:
        angle = np.linspace(0.0, 2.0 * np.pi, 200)
        axes.plot(a * np.cos(angle), b * np.sin(angle), **style)


def contact_colours(solution: ContactSolution) -> Field:
    """Return the RGB colour of each cell by its state, shape (nx, ny, 3).

    States are asperity contact, oil film and cavitated film; in a dry contact, open gap.
    """
    colours = np.empty((*solution.grid.cells, 3))
    colours[:] = to_rgb(GAP_COLOUR if solution.lubricant is None else OIL_COLOUR)
    colours[solution.cavitated] = to_rgb(CAVITY_COLOUR)
    period = max(
        solution.grid.cells[0] // 20, 5
    )  # of the diagonal stripes: about twenty across, each a fifth of the period wide
    i, j = np.indices(solution.grid.cells, sparse=True)
    colours[solution.cavitated & ((i + j) % period < max(period // 5, 1))] = to_rgb(CAVITY_STRIPE)
    colours[solution.in_contact] = to_rgb(CONTACT_COLOUR)
    return colours


def contact_keys(contact: str, rest: str, cavitated: str = "") -> list[Patch | Line2D]:
    """Return the legend of `contact_colours`; without `cavitated`, `rest` is an open gap."""
    keys: list[Patch | Line2D] = [Patch(color=CONTACT_COLOUR, label=contact)]
    if cavitated:
        keys.append(Patch(color=OIL_COLOUR, label=rest))
        keys.append(
            Patch(facecolor=CAVITY_COLOUR, edgecolor=CAVITY_STRIPE, hatch="////", label=cavitated)
        )
    else:
        keys.append(Patch(color=GAP_COLOUR, label=rest))
    keys.append(Line2D([], [], color="black", linestyle=DASHED, linewidth=1.0, label="Hertz zone"))
    return keys
