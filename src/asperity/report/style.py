"""How figures look, and figures written to disk.

A page gets titles and wide type; paper gets the column widths of journals, and leaves the words to
a caption.
"""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from io import StringIO
from pathlib import Path
from textwrap import wrap
from typing import Any

import matplotlib
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.text import Text
from matplotlib.transforms import Bbox

from asperity.core.errors import BadInput
from asperity.core.files import atomic_write

# Okabe and Ito's colours, told apart with any colour vision; every line also has its own stroke or
# marker.
BLUE, VERMILION, GREEN, GREY = "#0072b2", "#d55e00", "#009e73", "#6b7280"
# The paper's Fig 6 has oil in red and asperities in yellow. These differ in lightness too, for grey
# printers.
CONTACT_COLOUR, OIL_COLOUR, CAVITY_COLOUR, CAVITY_STRIPE = (
    "#f7dc4a",
    "#c8452f",
    "#33415c",
    "#8b9cb8",
)
GAP_COLOUR = "#e5e7eb"  # of a dry contact
SPLIT_COLOUR, SPLIT_STRIP, BAND_COLOUR = "#8a5a00", "#f2e3c6", "#e8eef4"
DASHED: Any = (0, (4, 3))
FORMATS = (".png", ".pdf")
_SMALLEST_TITLE = 8.0  # points
_SURELY = 0.6  # of the width of its column, that any title may have
_MARGIN = 0.01  # of the figure's width, beside a title: readers' type may be wider than ours

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


ON_PAGE = Medium(
    4.8, 9.6, titled=True
)  # two stand side by side, and one alone is readable on a telephone
ON_TELEPHONE = Medium(4.8, 4.8, titled=True)
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


def fit_titles(figure: Figure) -> None:
    """Move titles that leave their figure, or run into the next panel, to the left; print smaller what is too long.

    What is still too long is broken into lines.
    """
    if all(_short(axes, title) for axes in figure.axes for title in _titles(axes)):
        return  # to lay a figure out takes as long as to draw it
    figure.draw_without_rendering()
    boxes = {axes: axes.get_tightbbox(for_layout_only=True) for axes in figure.axes}
    margin = _MARGIN * figure.bbox.width
    for axes in figure.axes:
        for title in _titles(axes):
            own = title.get_window_extent()
            beside = [
                box
                for other, box in boxes.items()
                if other is not axes and box and _level(box, own)
            ]
            left = max([box.x1 for box in beside if box.x1 <= own.x0], default=0.0)
            right = min([box.x0 for box in beside if box.x0 > own.x0], default=figure.bbox.width)
            _fit_title(axes, title, left + margin, right - margin)


def _titles(axes: Axes) -> list[Text]:
    both: tuple[Text, ...] = (axes.title, axes._left_title)  # type: ignore[attr-defined]
    return [title for title in both if title.get_text()]


def _short(axes: Axes, title: Text) -> bool:
    """Whether a title has room wherever in its column it begins, but far to the right."""
    place = axes.get_subplotspec()
    column = axes.figure.bbox.width / (place.get_gridspec().ncols if place is not None else 1)
    return bool(title.get_window_extent().width < _SURELY * column)


def _level(box: Bbox, title: Bbox) -> bool:
    """Whether a panel lies beside a title, and not below or above it."""
    return bool(box.y0 < title.y1 + title.height and title.y0 - title.height < box.y1)


def _fit_title(axes: Axes, title: Text, left: float, right: float) -> None:
    words, size = title.get_text(), float(title.get_fontsize())
    while title.get_window_extent().width > right - left and size > _SMALLEST_TITLE:
        size -= 0.5
        title.set_fontsize(size)
    for across in range(len(words), 8, -1):
        if title.get_window_extent().width <= right - left:
            break
        title.set_text("\n".join(wrap(words, across)))
    over = title.get_window_extent().x1 - right
    if over > 0.0:
        x, y = map(float, title.get_position())
        title.set_position((x - over / axes.get_window_extent().width, y))


def svg(figure: Figure) -> str:
    """The figure as SVG text, the same bytes for the same figure."""
    text = StringIO()
    with ON_PAGE.drawing():
        fit_titles(figure)
        figure.savefig(text, format="svg", dpi=220, metadata={"Date": None, "Creator": None})
    return text.getvalue()


def write_figure(figure: Figure, path: Path, *, medium: Medium = ON_PAGE, dpi: int = 160) -> Path:
    """Write the figure as PNG or PDF, by its name, whole or not at all; BadInput for another ending."""
    if path.suffix.lower() not in FORMATS:
        raise BadInput(f"a figure must end in {' or '.join(FORMATS)}, got {path}")
    kind = path.suffix.lower()[1:]
    about: dict[str, Any] = {"Software": None} if kind == "png" else {"CreationDate": None}
    with atomic_write(path) as part, medium.drawing():
        fit_titles(figure)
        figure.savefig(part, format=kind, dpi=dpi, metadata=about)
    return path
