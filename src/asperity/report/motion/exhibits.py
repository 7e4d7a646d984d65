"""Exhibits of a history: curves over its steps, and maps of which a page shows one step after the other.

A map is drawn in two parts: axes and key once, as a figure with an empty field, and what is in the field as a small
picture of one pixel a cell, a step each, which the page lays over it.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from io import BytesIO
from typing import Any, Literal, get_args

import matplotlib
import numpy as np
import numpy.typing as npt
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize, to_rgb
from matplotlib.figure import Figure
from matplotlib.patches import Patch
from matplotlib.ticker import MaxNLocator
from PIL import Image

from asperity.arrays import Field
from asperity.ehl import hertz_zone
from asperity.history import Frame, History
from asperity.quantities import quantity
from asperity.report.base import Exhibit
from asperity.report.drawing import display, name_axes
from asperity.report.maps import colour_bar, map_figure
from asperity.report.style import BLUE, CAVITY_COLOUR, CONTACT_COLOUR, GREEN, GREY, OIL_COLOUR, VERMILION, Medium

SHADES = 56  # of a map: few enough for small files, fine enough for the eye
MOST_PIXELS = 160  # along an axis of a map
Kind = Literal["gap", "pressure", "contact"]
KINDS: tuple[Kind, ...] = get_args(Kind)  # as they stand below one another in a frame's picture
TEXTS: Mapping[Kind, tuple[str, str]] = {  # title and caption
    "gap": ("Film thickness", "Gap between the deformed surfaces; colours end where 99 % of the Hertz zone's gaps do."),
    "pressure": ("Pressure", "Pressure of oil and asperities together."),
    "contact": ("Asperity contact", "Where asperities touch, where oil fills the gap, where it has ruptured."),
}
COLOURS = {"gap": "viridis", "pressure": "inferno"}
CLASSES = {"oil film": OIL_COLOUR, "cavitated": CAVITY_COLOUR, "asperity contact": CONTACT_COLOUR}
STROKES = (("-", BLUE), ("--", VERMILION), (":", GREEN))


@dataclass(frozen=True, slots=True)
class Ranges:
    """What the colours of all steps reach to: gap [m] (99 % of the Hertz zone), pressure [Pa]."""

    gap: float
    pressure: float


def ranges(history: History) -> Ranges:
    """The ends of the colours, the same for all steps."""
    zone = hertz_zone(history.case.conditions, history.case.grid)
    gap = max(float(np.percentile(frame.gap[zone], 99.0)) for frame in history.frames)
    return Ranges(gap or 1e-6, max(float(frame.pressure.max()) for frame in history.frames) or 1e9)


def empty_map(history: History, kind: Kind, reach: Ranges) -> Exhibit:
    """Axes and key of the map of that kind, oil coming from the left."""
    grid, (title, caption) = history.case.grid, TEXTS[kind]

    def draw(medium: Medium) -> Figure:
        figure, axes = map_figure(medium, grid.extent)
        corners = display("x_m", np.array([grid.lower, grid.upper])).T
        name_axes(axes, "x_m", "y_m", xlim=corners[0], ylim=corners[1], aspect="auto", title=title)
        axes.spines[:].set_visible(False)
        if kind == "contact":
            keys = [Patch(color=colour, label=name) for name, colour in CLASSES.items()]
            figure.legend(handles=keys, loc="lower center", ncols=3, borderaxespad=0.2)
        else:
            shades = ScalarMappable(Normalize(0.0, display(kind, getattr(reach, kind))), COLOURS[kind])
            colour_bar(figure, axes, shades, kind, extend="max" if kind == "gap" else "neither")
        return figure

    return Exhibit(f"map-{kind}", draw, caption, f"Moving map: {caption}")


def frame_picture(frame: Frame, reach: Ranges) -> tuple[bytes, tuple[int, int]]:
    """Gap, pressure and contact of a step below one another, as a PNG of few colours; and the size of each."""
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


# Curves --------------------------------------------------------------------------------------------------------------

PANELS = (  # over time: what the axis is, unless a panel's one curve says so, and its curves
    ("share", ("clr", "car")),
    ("film_thickness_m", ("h_mean_m", "h_central_m", "h_min_m")),
    ("friction_coefficient", ("friction_coefficient", "friction_asperity_part", "friction_oil_part")),
    ("power_w", ("friction_power_w", "flow_power_w")),
    ("frequency_hz", ("resonance_hz",)),
)
PASSES = (
    ("share", ("clr", "car")),
    ("track_sq_m", ("track_sq_m",)),
    ("flattened_m", ("flattened_m",)),
    ("frequency_hz", ("resonance_hz",)),
)


def _known(panels: Sequence[tuple[str, tuple[str, ...]]], table: Any) -> list[tuple[str, tuple[str, ...]]]:
    """The panels that have a value to show."""
    return [panel for panel in panels if bool(table[panel[1][0]].notna().any())]


def curves(history: History) -> Exhibit:
    """Load and area shares, film, friction, heat and resonance over time; the steps that count shaded."""
    table = history.table

    def draw(medium: Medium) -> Figure:
        panels = _known(PANELS, table)
        figure = Figure(figsize=(medium.double, 1.55 * len(panels) + 0.5))
        every = figure.subplots(len(panels), 1, sharex=True, squeeze=False)[:, 0]
        bottom = 0.5 / figure.get_size_inches()[1]
        figure.subplots_adjust(left=0.09, right=0.985, top=0.985, bottom=bottom, hspace=0.12)
        time, counts = (display("time_s", rows["time_s"].to_numpy()) for rows in (table, history.settled))
        for axes, (side, keys) in zip(every, panels, strict=True):
            _draw_over_time(axes, time, {quantity(key).title: display(key, table[key].to_numpy()) for key in keys})
            axes.axvspan(float(counts[0]), time[-1], color=GREY, alpha=0.08, linewidth=0.0)
            axes.set_ylabel(quantity(side).label)
        name_axes(every[-1], "time_s")
        return figure

    return Exhibit(
        "over-time",
        draw,
        "Over time; the means and deviations above and below are of the shaded steps. The vertical line is the "
        "step that the maps show.",
        "Shares, film, friction, heat and resonance over time",
    )


def _draw_over_time(axes: Axes, time: Field, lines: Mapping[str, Field]) -> None:
    for (name, values), (stroke, colour) in zip(lines.items(), STROKES, strict=False):
        axes.plot(time, values, stroke, color=colour, label=name)
    axes.set_xlim(0.0, float(time[-1]) or 1.0)
    low, high = axes.get_ylim()
    low = 0.0 if min(float(np.nanmin(values)) for values in lines.values()) >= 0.0 and low < 0.4 * high else low
    axes.set_ylim(low, high + 0.28 * (high - low))  # room for the key
    axes.legend(loc="upper right", ncols=3)


def running_in(history: History) -> Exhibit:
    """Load and area shares, Sq of the tracks, how far they are pressed down, and resonance, pass by pass."""
    table = history.by_pass()

    def draw(medium: Medium) -> Figure:
        panels = _known(PASSES, table)
        rows = -(-len(panels) // 2)
        figure = Figure(figsize=(medium.double, 2.4 * rows), layout="constrained")
        for number, (side, keys) in enumerate(panels, 1):
            axes = figure.add_subplot(rows, 2, number)
            for key, (_, colour), marker in zip(keys, STROKES, "os", strict=False):
                values, title = display(key, table[key].to_numpy()), quantity(key).title
                axes.plot(table["pass"], values, marker=marker, markersize=3.5, color=colour, label=title)
            if len(keys) > 1:
                axes.set_ylim(0.0, 1.3 * axes.get_ylim()[1])  # room for the key
            if keys != (side,):  # else the axis says it
                axes.legend(loc="best")
            axes.set(ylabel=quantity(side).label, xlabel="pass")
            axes.xaxis.set_major_locator(MaxNLocator(integer=True))
        return figure

    return Exhibit(
        "passes",
        draw,
        "Running-in, a point a pass of the rough surface: shares and resonance are means over the pass, Sq and how far "
        "the tracks are pressed down stand as at its end. What is pressed down is taken to come up everywhere alike: "
        "the mean plane rises, which under a held load parts the bodies by as much and changes nothing else.",
        "Shares, Sq, flattening and resonance over passes",
    )
