"""Maps that move: axes and key once, and what is in them as small pictures that a few lines of script lay over them.

A map is drawn in two parts: axes and key as a figure with an empty field, and what is in the field
as a small picture of one pixel a cell, a frame each.
"""

import json
from base64 import b64encode
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from importlib import resources
from io import BytesIO
from typing import Any, Literal, NamedTuple, Protocol, get_args

import matplotlib
import numpy as np
import numpy.typing as npt
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize, to_rgb
from matplotlib.figure import Figure
from matplotlib.patches import Patch
from PIL import Image

from asperity.case import Case
from asperity.core.arrays import Field, Mask
from asperity.ehl import hertz_zone
from asperity.report.base import Exhibit, Picture
from asperity.report.drawing import display, name_axes
from asperity.report.maps import colour_bar, map_figure
from asperity.report.style import CAVITY_COLOUR, CONTACT_COLOUR, OIL_COLOUR, Medium

SCRIPT = resources.files("asperity.report").joinpath("moving.js").read_text("utf-8")
SHADES = 56  # of a map: few enough for small files, fine enough for the eye
MOST_PIXELS = 160  # along an axis of a map
Kind = Literal["gap", "pressure", "contact"]
KINDS: tuple[Kind, ...] = get_args(Kind)  # as they stand below one another in a frame's picture
TEXTS: Mapping[Kind, tuple[str, str]] = {  # title and caption
    "gap": (
        "Film thickness",
        "Gap between the deformed surfaces; colours end where 99 % of the Hertz zone's gaps do.",
    ),
    "pressure": ("Pressure", "Pressure of oil and asperities together."),
    "contact": (
        "Asperity contact",
        "Where asperities touch, where oil fills the gap, where it has ruptured.",
    ),
}
COLOURS = {"gap": "viridis", "pressure": "inferno"}
CLASSES = {"oil film": OIL_COLOUR, "cavitated": CAVITY_COLOUR, "asperity contact": CONTACT_COLOUR}


@dataclass(frozen=True, slots=True)
class Ranges:
    """What the colours of all frames reach to: gap [m] (99 % of the Hertz zone), pressure [Pa]."""

    gap: float
    pressure: float


class Frame(Protocol):
    """What is shown at a time: maps on the contact's grid, film [m], pressure [Pa], where bodies touch."""

    @property
    def gap(self) -> Field:
        """Film thickness [m]."""
        ...

    @property
    def pressure(self) -> Field:
        """Of oil and asperities together [Pa]."""
        ...

    @property
    def in_contact(self) -> Mask:
        """Where bodies touch."""
        ...


class MovingMap(NamedTuple):
    """A map of a page: its axes, and where the pictures are laid over them, in per cent of the figure."""

    picture: Picture
    left: float
    top: float
    width: float
    height: float
    zone: tuple[float, ...]  # where lines mark the Hertz zone of a line contact


def ranges(case: Case, frames: Sequence[Frame]) -> Ranges:
    """The ends of the colours, the same for all frames."""
    zone = hertz_zone(case.conditions, case.grid)
    gap = max(float(np.percentile(frame.gap[zone], 99.0)) for frame in frames)
    return Ranges(gap or 1e-6, max(float(frame.pressure.max()) for frame in frames) or 1e9)


def moving_map(case: Case, kind: Kind, reach: Ranges) -> MovingMap:
    """A map's axes and key, and where its pictures lie."""
    exhibit = empty_map(case, kind, reach)
    figure = exhibit.figure()
    box = figure.axes[0].get_position()
    left, top, width, height = (
        100.0 * share for share in (box.x0, 1.0 - box.y1, box.width, box.height)
    )
    grid, a = case.grid, case.conditions.hertz.half_widths[0]
    sides = (-a, a) if case.conditions.endless else ()
    zone = tuple(left + width * (side - grid.lower[0]) / grid.extent[0] for side in sides)
    return MovingMap(exhibit.picture_of(figure), left, top, width, height, zone)


def script_data(frames: Sequence[Frame], words: Sequence[str], reach: Ranges, **more: Any) -> str:
    """What the page's script shows of each frame: its maps, its numbers in words; and what else it is told."""
    pictures = [frame_picture(frame, reach) for frame in frames]
    held = {
        "frames": ["data:image/png;base64," + b64encode(packed).decode() for packed, _ in pictures],
        "size": pictures[0][1],
        "words": list(words),
    }
    return json.dumps(held | more).replace("<", "\\u003c")  # nothing in it ends the script


def empty_map(case: Case, kind: Kind, reach: Ranges) -> Exhibit:
    """Axes and key of the map of that kind, oil coming from the left."""
    grid, (title, caption) = case.grid, TEXTS[kind]

    def draw(medium: Medium) -> Figure:
        figure, axes = map_figure(medium, grid.extent)
        corners = display("x_m", np.array([grid.lower, grid.upper])).T
        name_axes(axes, "x_m", "y_m", xlim=corners[0], ylim=corners[1], aspect="auto", title=title)
        axes.spines[:].set_visible(False)
        if kind == "contact":
            keys = [Patch(color=colour, label=name) for name, colour in CLASSES.items()]
            figure.legend(handles=keys, loc="lower center", ncols=3, borderaxespad=0.2)
        else:
            shades = ScalarMappable(
                Normalize(0.0, display(kind, getattr(reach, kind))), COLOURS[kind]
            )
            colour_bar(figure, axes, shades, kind, extend="max" if kind == "gap" else "neither")
        return figure

    return Exhibit(f"map-{kind}", draw, caption, f"Moving map: {caption}")


def frame_picture(frame: Frame, reach: Ranges) -> tuple[bytes, tuple[int, int]]:
    """Gap, pressure and contact of a frame below one another, as a PNG of few colours; and the size of each."""
    stride = [max(1, -(-count // MOST_PIXELS)) for count in frame.gap.shape]
    thin = (slice(None, None, stride[0]), slice(None, None, stride[1]))
    touching = frame.in_contact[thin]
    classes = np.where(touching, 2, np.where(frame.pressure[thin] <= 0.0, 1, 0)).astype(np.uint8)
    parts = [
        _shaded(frame.gap[thin], reach.gap),
        SHADES + _shaded(frame.pressure[thin], reach.pressure),
        2 * SHADES + classes,
    ]
    pixels = np.concatenate([part.T[::-1] for part in parts])  # y points up, rows of a picture down
    image = Image.fromarray(pixels)
    image.putpalette(_palette())
    packed = BytesIO()
    image.save(packed, format="PNG", optimize=True)
    width, height = touching.shape
    return packed.getvalue(), (width, height)


def _shaded(values: Field, top: float) -> npt.NDArray[np.uint8]:
    shades: Field = np.clip(np.rint(values / top * (SHADES - 1)), 0, SHADES - 1)
    return shades.astype(np.uint8)


def _palette() -> bytes:
    shades = np.linspace(0.0, 1.0, SHADES)
    colours = [matplotlib.colormaps[name](shades)[:, :3] for name in COLOURS.values()]
    colours.append(np.array([to_rgb(colour) for colour in CLASSES.values()]))
    return np.rint(255.0 * np.concatenate(colours)).astype(np.uint8).tobytes()
