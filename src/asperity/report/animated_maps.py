"""Animated maps: one empty figure with axes, and one small image per frame laid over it.

The images have one pixel per cell; a short script in the page shows them in turn.
"""

import json
from base64 import b64encode
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from importlib import resources
from io import BytesIO
from typing import Literal, NamedTuple, Protocol, get_args

import matplotlib
import numpy as np
import numpy.typing as npt
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Colormap, Normalize, to_rgb
from matplotlib.figure import Figure
from matplotlib.patches import Patch
from PIL import Image

from asperity.case import Case
from asperity.core.arrays import Field, Mask
from asperity.ehl import hertz_zone
from asperity.report.base import Exhibit, Picture
from asperity.report.drawing import display, name_axes
from asperity.report.maps import colour_bar, map_figure
from asperity.report.style import (
    CAVITY_COLOUR,
    CONTACT_COLOUR,
    FILM_COLOURS,
    OIL_COLOUR,
    STRESS_COLOURS,
    Medium,
)

SCRIPT = resources.files("asperity.report").joinpath("moving.js").read_text("utf-8")
SHADES = 56  # colours of a map: few enough for small files, enough to look continuous
MAX_PIXELS = 160  # along each axis of a map
Kind = Literal["gap", "pressure", "contact"]
KINDS: tuple[Kind, ...] = get_args(Kind)  # in their order within the image of a frame
TEXTS: Mapping[Kind, tuple[str, str]] = {  # title and caption
    "gap": (
        "Film thickness",
        "Gap between the deformed surfaces; colours end at the 99th percentile in the Hertz zone.",
    ),
    "pressure": ("Pressure", "Total pressure of oil and asperities."),
    "contact": ("Asperity contact", "Contact state: asperity contact, oil film, cavitated film."),
}
COLOURS: dict[str, str | Colormap] = {"gap": FILM_COLOURS, "pressure": STRESS_COLOURS}
CLASSES = {"oil film": OIL_COLOUR, "cavitated": CAVITY_COLOUR, "asperity contact": CONTACT_COLOUR}


@dataclass(frozen=True, slots=True)
class Ranges:
    """Upper ends of the colour scales: gap [m] (99th percentile, Hertz zone), pressure [Pa]."""

    gap: float
    pressure: float


class Frame(Protocol):
    """Maps of a contact at one time, on its grid."""

    @property
    def gap(self) -> Field:
        """Film thickness [m]."""
        ...

    @property
    def pressure(self) -> Field:
        """Total pressure of oil and asperities [Pa]."""
        ...

    @property
    def in_contact(self) -> Mask:
        """Mask of the cells in contact."""
        ...


class AnimatedMap(NamedTuple):
    """An empty map, and the position of its frames in per cent of the figure."""

    picture: Picture
    left: float
    top: float
    width: float
    height: float
    zone: tuple[float, ...]  # positions of the Hertz zone's edges, for a line contact


def ranges(case: Case, frames: Sequence[Frame]) -> Ranges:
    """Return the ends of the colour scales, common to all frames."""
    zone = hertz_zone(case.conditions, case.grid)
    gap = max(float(np.percentile(frame.gap[zone], 99.0)) for frame in frames)
    return Ranges(gap or 1e-6, max(float(frame.pressure.max()) for frame in frames) or 1e9)


def animated_maps(case: Case, scale: Ranges) -> list[AnimatedMap]:
    """Draw the empty maps of all kinds."""
    return [_animated_map(case, kind, scale) for kind in KINDS]


def _animated_map(case: Case, kind: Kind, scale: Ranges) -> AnimatedMap:
    """Draw an empty map and compute the position of its frames."""
    exhibit = empty_map(case, kind, scale)
    figure = exhibit.figure()
    box = figure.axes[0].get_position()
    left, top, width, height = (
        100.0 * share for share in (box.x0, 1.0 - box.y1, box.width, box.height)
    )
    grid = case.grid
    a = case.conditions.hertz.half_widths[0]
    sides = (-a, a) if case.conditions.endless else ()
    zone = tuple(left + width * (side - grid.lower[0]) / grid.extent[0] for side in sides)
    return AnimatedMap(exhibit.embed(figure), left, top, width, height, zone)


def script_data(
    frames: Sequence[Frame], captions: Sequence[str], scale: Ranges, **extra: Sequence[float]
) -> str:
    """Return the data of the page's script as JSON: images and captions of the frames."""
    images = [encode_frame(frame, scale) for frame in frames]
    data = {
        "frames": ["data:image/png;base64," + b64encode(png).decode() for png, _ in images],
        "size": images[0][1],
        "captions": list(captions),
    }
    return json.dumps(data | extra).replace("<", "\\u003c")  # must not close the script element


def empty_map(case: Case, kind: Kind, scale: Ranges) -> Exhibit:
    """Draw axes and legend of a map without data; oil enters from the left."""
    grid = case.grid
    (title, caption) = TEXTS[kind]

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
                Normalize(0.0, display(kind, getattr(scale, kind))), COLOURS[kind]
            )
            colour_bar(figure, axes, shades, kind, extend="max" if kind == "gap" else "neither")
        return figure

    return Exhibit(f"map-{kind}", draw, caption, f"Animated map: {caption}")


def encode_frame(frame: Frame, scale: Ranges) -> tuple[bytes, tuple[int, int]]:
    """Encode gap, pressure and contact, stacked, as a PNG; return it and the size of a map."""
    stride = [max(1, -(-count // MAX_PIXELS)) for count in frame.gap.shape]
    sample = (slice(None, None, stride[0]), slice(None, None, stride[1]))
    touching = frame.in_contact[sample]
    classes = np.where(touching, 2, np.where(frame.pressure[sample] <= 0.0, 1, 0)).astype(np.uint8)
    parts = [
        _quantise(frame.gap[sample], scale.gap),
        SHADES + _quantise(frame.pressure[sample], scale.pressure),
        2 * SHADES + classes,
    ]
    pixels = np.concatenate([part.T[::-1] for part in parts])  # y points up, image rows down
    image = Image.fromarray(pixels)
    image.putpalette(_palette())
    png = BytesIO()
    image.save(png, format="PNG", optimize=True)
    width, height = touching.shape
    return png.getvalue(), (width, height)


def _quantise(values: Field, top: float) -> npt.NDArray[np.uint8]:
    shades: Field = np.clip(np.rint(values / top * (SHADES - 1)), 0, SHADES - 1)
    return shades.astype(np.uint8)


def _palette() -> bytes:
    shades = np.linspace(0.0, 1.0, SHADES)
    colours = [matplotlib.colormaps.get_cmap(name)(shades)[:, :3] for name in COLOURS.values()]
    colours.append(np.array([to_rgb(colour) for colour in CLASSES.values()]))
    return np.rint(255.0 * np.concatenate(colours)).astype(np.uint8).tobytes()
