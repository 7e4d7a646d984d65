"""How figures look: colours, media, axes named by the catalogue, maps of a contact; and figures written to disk.

A page gets titles and wide type; paper gets the column widths of journals, and leaves the words to a caption.
"""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from io import StringIO
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from matplotlib.image import AxesImage
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from asperity.arrays import Field, Mask
from asperity.ehl import ContactSolution
from asperity.errors import BadInput
from asperity.files import whole_file
from asperity.quantities import quantity

# Okabe and Ito's colours, told apart with any colour vision; every line also has its own stroke or marker.
BLUE, VERMILION, GREEN, GREY = "#0072b2", "#d55e00", "#009e73", "#6b7280"
# The paper's Fig 6 has oil in red and asperities in yellow. These differ in lightness too, for grey printers.
CONTACT_COLOUR, OIL_COLOUR, CAVITY_COLOUR, CAVITY_STRIPE = "#f7dc4a", "#c8452f", "#33415c", "#8b9cb8"
GAP_COLOUR = "#e5e7eb"  # of a dry contact
SPLIT_COLOUR, SPLIT_STRIP, BAND_COLOUR = "#8a5a00", "#f2e3c6", "#e8eef4"
DASHED: Any = (0, (4, 3))
FORMATS = (".png", ".pdf")
ACROSS = 4  # panels in a row

STYLE: Any = {
    "svg.hashsalt": "asperity",  # the same run gives the same bytes
    "svg.fonttype": "none",  # text stays text: smaller, and legible at any zoom
    "pdf.fonttype": 42,  # type that can be searched and edited, as publishers ask
    "font.size": 9.5,
    "axes.titlesize": 10,
    "axes.titleweight": "bold",
    "axes.titlelocation": "left",
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.linewidth": 0.8,
    "lines.linewidth": 1.4,
    "legend.fontsize": 8.5,
    "legend.frameon": False,
    "figure.facecolor": "white",
    "hatch.linewidth": 0.5,
}


@dataclass(frozen=True)
class Medium:
    """Where a figure is looked at: widths of one and of two columns [inches], whether it says its own title."""

    single: float
    double: float
    titled: bool
    style: dict[str, Any] = field(default_factory=dict)

    def width(self, panels: int) -> float:
        """Of a figure with so many panels in a row [inches]."""
        return self.double if panels > 2 else self.single

    @property
    def line_height(self) -> float:
        """Of a line of type [inches]."""
        return float({**STYLE, **self.style}["font.size"]) / 72.0 * 1.35

    @contextmanager
    def drawing(self) -> Iterator[None]:
        """The look of figures made or written inside."""
        look: dict[Any, Any] = {**STYLE, **self.style}
        with matplotlib.rc_context(look):
            yield

    def panel(self, height: float) -> tuple[Figure, Axes]:
        """A figure of one column with one panel, so high [inches]."""
        figure = Figure(figsize=(self.single, height), layout="constrained")
        return figure, figure.add_subplot()

    def title(self, axes: Axes, text: str, letter: str = "") -> None:
        """A title; on paper its letter alone, which the caption refers to."""
        axes.set_title(text if self.titled else letter)


ON_PAGE = Medium(4.8, 9.6, titled=True)  # two stand side by side, and one alone is readable on a telephone
ON_PAPER = Medium(
    84.0 / 25.4,
    174.0 / 25.4,
    titled=False,
    style={
        "font.size": 8.0,
        "axes.titlesize": 8.0,
        "xtick.labelsize": 7.5,
        "ytick.labelsize": 7.5,
        "legend.fontsize": 7.5,
        "legend.handlelength": 1.7,
        "legend.columnspacing": 1.2,
        "axes.linewidth": 0.6,
        "xtick.major.width": 0.6,
        "ytick.major.width": 0.6,
        "lines.linewidth": 1.1,
        "hatch.linewidth": 0.4,
    },
)


def svg(figure: Figure) -> str:
    """The figure as SVG text, the same bytes for the same figure."""
    text = StringIO()
    with ON_PAGE.drawing():
        figure.savefig(text, format="svg", dpi=220, metadata={"Date": None, "Creator": None})
    return text.getvalue()


def write_figure(figure: Figure, path: Path, *, medium: Medium = ON_PAGE, dpi: int = 160) -> Path:
    """Write the figure as PNG or PDF, by its name, whole or not at all; BadInput for another ending."""
    if path.suffix.lower() not in FORMATS:
        raise BadInput(f"a figure must end in {' or '.join(FORMATS)}, got {path}")
    kind = path.suffix.lower()[1:]
    about: dict[str, Any] = {"Software": None} if kind == "png" else {"CreationDate": None}
    with whole_file(path) as part, medium.drawing():
        figure.savefig(part, format=kind, dpi=dpi, metadata=about)
    return path


# Axes ----------------------------------------------------------------------------------------------------------------


def display(key: str, values: Any) -> Any:
    """Stored values of a quantity in its display unit."""
    return values * quantity(key).factor


def name_axes(axes: Axes, x: str = "", y: str = "", **settings: Any) -> None:
    """Label the axes by the keys of what they show."""
    labels = {"xlabel": x, "ylabel": y}
    axes.set(**{side: quantity(key).axis for side, key in labels.items() if key}, **settings)


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


def mean_of_neighbours(values: Field, together: int) -> Field:
    """Means of so many values at a time; a rest is left out."""
    return np.asarray(_grouped(values, together).mean(axis=1))


def largest_of_neighbours(values: Field, together: int) -> Field:
    """The largest of so many values at a time; a rest is left out."""
    return np.asarray(_grouped(values, together).max(axis=1))


def _grouped(values: Field, together: int) -> Field:
    return values[: values.size // together * together].reshape(-1, together)


# Maps of a contact ---------------------------------------------------------------------------------------------------


def map_figure(medium: Medium, extent: tuple[float, float]) -> tuple[Figure, Axes]:
    """A figure with a map of that extent, all maps of a contact in the same place, and room for a key below."""
    width, below, above = medium.single - 0.85, 1.0, 0.32
    height = width * min(max(extent[1] / extent[0], 0.15), 1.4)
    total = below + height + above
    figure = Figure(figsize=(medium.single, total))
    return figure, figure.add_axes((0.64 / medium.single, below / total, width / medium.single, height / total))


def show_map(axes: Axes, values: Field, solution: ContactSolution, **style: Any) -> AxesImage:
    """Draw values of shape (nx, ny) or colours of shape (nx, ny, 3) over the contact, oil coming from the left."""
    (x0, y0), (x1, y1) = solution.grid.lower, solution.grid.upper
    corners = (*display("x_m", np.array([x0, x1])), *display("y_m", np.array([y0, y1])))
    image = axes.imshow(
        np.swapaxes(values, 0, 1), origin="lower", extent=corners, interpolation="none", aspect="equal", **style
    )
    name_axes(axes, "x_m", "y_m")
    axes.spines[:].set_visible(False)
    return image


def draw_map(
    medium: Medium,
    solution: ContactSolution,
    key: str,
    values: Field,
    title: str,
    *,
    extend: str = "neither",
    ticks: Sequence[float] | None = None,
    **style: Any,
) -> Figure:
    """The map of a quantity, stored values of shape (nx, ny), with the Hertz zone and a key to the colours."""
    figure, axes = map_figure(medium, solution.grid.extent)
    image = show_map(axes, display(key, values), solution, **style)
    mark_hertz_zone(axes, solution, "white")
    axes.set_title(title)
    figure.colorbar(
        image, cax=colour_bar_axes(figure, axes), orientation="horizontal", label=quantity(key).axis, extend=extend,
        ticks=ticks,
    )  # fmt: skip
    return figure


def colour_bar_axes(figure: Figure, axes: Axes) -> Axes:
    """Where the key to the colours of a map lies, below it."""
    box, total = axes.get_position(), figure.get_size_inches()[1]
    return figure.add_axes((box.x0, 0.42 / total, box.width, 0.11 / total))


def mark_hertz_zone(axes: Axes, solution: ContactSolution, colour: str) -> None:
    """The outline of the smooth, dry contact, dashed."""
    a, b = (display("x_m", half_width) for half_width in solution.conditions.hertz.half_widths)
    style: dict[str, Any] = {"color": colour, "linestyle": DASHED, "linewidth": 1.0}
    if solution.conditions.geometry == "line":
        for side in (-a, a):
            axes.axvline(side, **style)
    else:
        turn = np.linspace(0.0, 2.0 * np.pi, 200)
        axes.plot(a * np.cos(turn), b * np.sin(turn), **style)


def contact_colours(solution: ContactSolution) -> Field:
    """Red, green and blue of every cell, shape (nx, ny, 3): asperity contact, oil, ruptured oil; an open gap if dry."""
    colours = np.empty((*solution.grid.cells, 3))
    colours[:] = to_rgb(GAP_COLOUR if solution.lubricant is None else OIL_COLOUR)
    colours[solution.cavitated] = to_rgb(CAVITY_COLOUR)
    colours[solution.cavitated & _stripes(solution.grid.cells)] = to_rgb(CAVITY_STRIPE)
    colours[solution.in_contact] = to_rgb(CONTACT_COLOUR)
    return colours


def contact_keys(contact: str, rest: str, cavitated: str = "") -> list[Patch | Line2D]:
    """The key to `contact_colours`; without a name for ruptured oil the rest is an open gap."""
    keys: list[Patch | Line2D] = [Patch(color=CONTACT_COLOUR, label=contact)]
    if cavitated:
        keys.append(Patch(color=OIL_COLOUR, label=rest))
        keys.append(Patch(facecolor=CAVITY_COLOUR, edgecolor=CAVITY_STRIPE, hatch="////", label=cavitated))
    else:
        keys.append(Patch(color=GAP_COLOUR, label=rest))
    keys.append(Line2D([], [], color="black", linestyle=DASHED, linewidth=1.0, label="Hertz zone"))
    return keys


def _stripes(cells: tuple[int, int]) -> Mask:
    """Diagonal lines, one part in five wide, about twenty across the map."""
    period = max(cells[0] // 20, 5)
    i, j = np.ogrid[: cells[0], : cells[1]]
    return np.asarray((i + j) % period < max(period // 5, 1))
