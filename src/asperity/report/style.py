"""Style of figures and figure files.

Figures on a page have titles and large type; figures for a paper have journal column widths and
leave titles to the caption.
"""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from io import StringIO
from pathlib import Path
from textwrap import wrap
from typing import Any, TypeAlias

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import ListedColormap
from matplotlib.figure import Figure
from matplotlib.text import Text
from matplotlib.transforms import Bbox

from asperity.core.errors import BadInput
from asperity.core.files import atomic_write

# Colours of Okabe and Ito, distinguishable with any colour vision; lines also differ by style or
# marker.
BLUE, VERMILION, GREEN, GREY = "#0072b2", "#d55e00", "#009e73", "#6b7280"
# One colour, one meaning: red is an alarm and yellow is asperity contact, so no film is drawn in
# either. The colours of the contact state differ in lightness too, for grey printers.
CONTACT_COLOUR, OIL_COLOUR, CAVITY_COLOUR, CAVITY_STRIPE = (
    "#f7dc4a",
    "#4a8db7",
    "#33415c",
    "#8b9cb8",
)
# maps of even lightness steps; `app.figures` has its own copy of that of the film
FILM_COLOURS = ListedColormap(
    matplotlib.colormaps["viridis"](np.linspace(0.0, 207.0 / 255.0, 256)), name="film"
)
STRESS_COLOURS, HEAT_COLOURS, HEIGHT_COLOURS = "magma", "inferno", "cividis"
GAP_COLOUR = "#e5e7eb"  # open gap of a dry contact
SPLIT_COLOUR, SPLIT_STRIP, BAND_COLOUR = "#8a5a00", "#f2e3c6", "#e8eef4"
Style: TypeAlias = dict[str, Any]  # keyword arguments of matplotlib
DASHED = (0.0, (4.0, 3.0))
FORMATS = (".png", ".pdf")
_MIN_TITLE_SIZE = 8.0  # points
_SAFE_WIDTH = 0.6  # of the column: titles up to this width need no fitting
_MARGIN = 0.01  # of the figure width beside a title: the reader's font may be wider

STYLE: Style = {
    "svg.hashsalt": "asperity",  # the same run gives the same bytes
    "svg.fonttype": "none",  # keep text as text: smaller, and sharp at any zoom
    "pdf.fonttype": 42,  # searchable and editable text, as publishers require
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
    """Output medium: widths of one and two columns [inches], and whether figures have titles."""

    single: float
    double: float
    titled: bool
    style: Style = field(default_factory=dict)

    def width(self, panels: int) -> float:
        """Return the width of a figure with this number of panels in a row [inches]."""
        return self.double if panels > 2 else self.single

    @property
    def line_height(self) -> float:
        """Height of a line of text [inches]."""
        return float({**STYLE, **self.style}["font.size"]) / 72.0 * 1.35

    @contextmanager
    def drawing(self) -> Iterator[None]:
        """Apply the style to figures drawn or saved inside the context."""
        settings: dict[Any, Any] = {**STYLE, **self.style}
        with matplotlib.rc_context(settings):
            yield

    def panel(self, height: float) -> tuple[Figure, Axes]:
        """Create a one-column figure with one panel; `height` in inches."""
        figure = Figure(figsize=(self.single, height), layout="constrained")
        return figure, figure.add_subplot()

    def title(self, axes: Axes, text: str, letter: str = "") -> None:
        """Set a title; on paper only the panel letter, which the caption refers to."""
        axes.set_title(text if self.titled else letter)


ON_PAGE = Medium(4.8, 9.6, titled=True)  # two fit side by side; one alone is readable on a phone
ON_PHONE = Medium(4.8, 4.8, titled=True)
_PRINT: Style = {
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
}
COLUMN_MM, PAGE_MM = 85.0, 175.0  # widths of a journal's column and of its page
ON_PAPER = Medium(COLUMN_MM / 25.4, PAGE_MM / 25.4, titled=False, style=_PRINT)
IN_COLUMN, ACROSS_PAGE = (
    Medium(width / 25.4, width / 25.4, titled=False, style=_PRINT) for width in (COLUMN_MM, PAGE_MM)
)


def for_paper(figure: Figure) -> Figure:
    """Remove the title of a figure and of its only panel, and fit legends into its width.

    Letters and titles of several panels remain, because they name what each shows.
    """
    figure.suptitle("")
    titled = [axes for axes in figure.axes if _titles(axes)]
    if len(titled) == 1:
        for title in _titles(titled[0]):
            title.set_text("")
    if figure.legends:
        figure.draw_without_rendering()
    for first in list(figure.legends):
        legend = first
        columns = legend._ncols  # type: ignore[attr-defined]
        names = [text.get_text() for text in legend.get_texts()]
        while columns > 1 and legend.get_window_extent().width > figure.bbox.width:
            columns -= 1
            handles = [*filter(None, legend.legend_handles)]
            legend.remove()
            legend = figure.legend(handles, names, loc="outside lower center", ncols=columns)
            figure.draw_without_rendering()
    return figure


def fit_titles(figure: Figure) -> None:
    """Fit titles that leave the figure or overlap the next panel.

    A long title is set in smaller type, then wrapped, then moved to the left.
    """
    if all(_is_short(axes, title) for axes in figure.axes for title in _titles(axes)):
        return  # the layout below takes as long as drawing
    figure.draw_without_rendering()
    boxes = {axes: axes.get_tightbbox(for_layout_only=True) for axes in figure.axes}
    margin = _MARGIN * figure.bbox.width
    for axes in figure.axes:
        for title in _titles(axes):
            extent = title.get_window_extent()
            adjacent = [
                box
                for other, box in boxes.items()
                if other is not axes and box and _is_beside(box, extent)
            ]
            left = max([box.x1 for box in adjacent if box.x1 <= extent.x0], default=0.0)
            right = min(
                [box.x0 for box in adjacent if box.x0 > extent.x0], default=figure.bbox.width
            )
            _fit_title(axes, title, left + margin, right - margin)


def _titles(axes: Axes) -> list[Text]:
    titles: tuple[Text, ...] = (axes.title, axes._left_title)  # type: ignore[attr-defined]
    return [title for title in titles if title.get_text()]


def _is_short(axes: Axes, title: Text) -> bool:
    """Return True if a title certainly fits into its column."""
    spec = axes.get_subplotspec()
    column = axes.figure.bbox.width / (spec.get_gridspec().ncols if spec is not None else 1)
    return bool(title.get_window_extent().width < _SAFE_WIDTH * column)


def _is_beside(box: Bbox, title: Bbox) -> bool:
    """Return True if a panel lies beside a title, not above or below it."""
    return bool(box.y0 < title.y1 + title.height and title.y0 - title.height < box.y1)


def _fit_title(axes: Axes, title: Text, left: float, right: float) -> None:
    text = title.get_text()
    size = float(title.get_fontsize())
    while title.get_window_extent().width > right - left and size > _MIN_TITLE_SIZE:
        size -= 0.5
        title.set_fontsize(size)
    for line_length in range(len(text), 8, -1):
        if title.get_window_extent().width <= right - left:
            break
        title.set_text("\n".join(wrap(text, line_length)))
    excess = title.get_window_extent().x1 - right
    if excess > 0.0:
        x, y = map(float, title.get_position())
        title.set_position((x - excess / axes.get_window_extent().width, y))


def svg(figure: Figure) -> str:
    """Return the figure as SVG text; the same figure gives the same bytes."""
    text = StringIO()
    with ON_PAGE.drawing():
        fit_titles(figure)
        figure.savefig(text, format="svg", dpi=220, metadata={"Date": None, "Creator": None})
    return text.getvalue()


def write_figure(figure: Figure, path: Path, *, medium: Medium = ON_PAGE, dpi: int = 160) -> Path:
    """Write the figure atomically as PNG or PDF by its suffix; raise BadInput for another."""
    if path.suffix.lower() not in FORMATS:
        raise BadInput(f"a figure must end in {' or '.join(FORMATS)}, got {path}")
    kind = path.suffix.lower()[1:]
    metadata: dict[str, None] = {"Software": None} if kind == "png" else {"CreationDate": None}
    with atomic_write(path) as part, medium.drawing():
        fit_titles(figure)
        figure.savefig(part, format=kind, dpi=dpi, metadata=metadata)
    return path
