"""The figures of a history: curves over its steps, and maps of which a page shows one step after the other.

A map is drawn in two parts: axes and key once, as a figure with an empty field, and what is in the field as a small
picture of one pixel a cell, a step each, which the page lays over it.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from io import BytesIO

import matplotlib
import numpy as np
import numpy.typing as npt
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize, to_rgb
from matplotlib.figure import Figure
from matplotlib.patches import Patch
from matplotlib.ticker import MaxNLocator

from asperity.arrays import Field
from asperity.ehl import hertz_zone
from asperity.history import Frame, History
from asperity.report.figures import (
    BLUE,
    CAVITY_COLOUR,
    CONTACT_COLOUR,
    GIGA,
    GREEN,
    GREY,
    MICRO,
    OIL_COLOUR,
    VERMILION,
    map_figure,
    styled,
)

SHADES = 56  # of a map: few enough for small files, fine enough for the eye
MOST_PIXELS = 160  # along an axis of a map
FILM, PRESSURE, CONTACT = "film", "pressure", "contact"
KINDS = (FILM, PRESSURE, CONTACT)
COLOURS = {FILM: "viridis", PRESSURE: "inferno"}
_CLASSES = (OIL_COLOUR, CAVITY_COLOUR, CONTACT_COLOUR)
_STROKES = ("-", "--", ":")


@dataclass(frozen=True, slots=True)
class Field2D:
    """A map without what changes: its figure, and where in it the field lies, as shares from the left and the top."""

    figure: Figure
    left: float
    top: float
    width: float
    height: float


@dataclass(frozen=True, slots=True)
class Ranges:
    """What the colours of all steps reach to: film [m] (99 % of the Hertz zone), pressure [Pa]."""

    film: float
    pressure: float


def ranges(history: History) -> Ranges:
    """The ends of the colours, the same for all steps."""
    zone = hertz_zone(history.case.conditions, history.case.grid)
    film = max(float(np.percentile(frame.gap[zone], 99.0)) for frame in history.frames)
    return Ranges(film or 1e-6, max(float(frame.pressure.max()) for frame in history.frames) or 1e9)


@styled()
def empty_map(history: History, kind: str, reach: Ranges) -> Field2D:
    """Axes and key of the map of that kind, oil coming from the left."""
    grid = history.case.grid
    figure, axes = map_figure(grid.extent)
    (x0, y0), (x1, y1) = grid.lower, grid.upper
    axes.set(xlim=(x0 * MICRO, x1 * MICRO), ylim=(y0 * MICRO, y1 * MICRO), aspect="auto")
    axes.set(xlabel="x along rolling [µm]", ylabel="y [µm]")
    axes.spines[:].set_visible(False)
    axes.set_title({FILM: "Film thickness", PRESSURE: "Pressure", CONTACT: "Asperity contact"}[kind])
    box, total = axes.get_position(), figure.get_size_inches()[1]
    if kind == CONTACT:
        names = ("oil film", "cavitated", "asperity contact")
        keys = [Patch(color=colour, label=name) for colour, name in zip(_CLASSES, names, strict=True)]
        figure.legend(handles=keys, loc="lower center", ncols=3, borderaxespad=0.2)
    else:
        top = reach.film * MICRO if kind == FILM else reach.pressure * GIGA
        place = figure.add_axes((box.x0, 0.42 / total, box.width, 0.11 / total))
        label = "film thickness [µm]" if kind == FILM else "pressure [GPa]"
        shades = ScalarMappable(Normalize(0.0, top), COLOURS[kind])
        extend = "max" if kind == FILM else "neither"
        figure.colorbar(shades, cax=place, orientation="horizontal", label=label, extend=extend)
    return Field2D(figure, box.x0, 1.0 - box.y1, box.width, box.height)


def frame_picture(frame: Frame, reach: Ranges) -> tuple[bytes, tuple[int, int]]:
    """Film, pressure and contact of a step below one another, as a PNG of few colours; and the size of each."""
    from PIL import Image

    stride = [max(1, -(-count // MOST_PIXELS)) for count in frame.gap.shape]
    thin = (slice(None, None, stride[0]), slice(None, None, stride[1]))
    touching = frame.in_contact[thin]
    classes = np.where(touching, 2, np.where(frame.pressure[thin] <= 0.0, 1, 0)).astype(np.uint8)
    parts = [
        _shaded(frame.gap[thin], reach.film),
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
    colours = [matplotlib.colormaps[COLOURS[kind]](shades)[:, :3] for kind in (FILM, PRESSURE)]
    colours.append(np.array([to_rgb(colour) for colour in _CLASSES]))
    return np.rint(255.0 * np.concatenate(colours)).astype(np.uint8).tobytes()


@dataclass(frozen=True, slots=True)
class Curves:
    """A figure of curves over time, and where its time axis begins and ends, as shares from the left."""

    figure: Figure
    begins: float
    ends: float


@styled()
def curves(history: History) -> Curves:
    """Load and area shares, film, friction, heat and resonance over time; the steps that count shaded."""
    table = history.table
    heard = bool(table["resonance_hz"].notna().any())
    panels: list[tuple[str, Sequence[tuple[str, str, float]]]] = [
        ("share [%]", [("clr", "CLR, load on asperities", 100.0), ("car", "CAR, Hertz zone", 100.0)]),
        ("film [µm]", [("h_mean_m", "mean", MICRO), ("h_central_m", "central", MICRO), ("h_min_m", "least", MICRO)]),
        (
            "friction",
            [
                ("friction_coefficient", "coefficient", 1.0),
                ("friction_asperity_part", "asperities", 1.0),
                ("friction_oil_part", "oil", 1.0),
            ],
        ),
        ("heat [W]", [("friction_power_w", "friction", 1.0), ("flow_power_w", "pressure-driven flow", 1.0)]),
    ]
    if heard:
        panels.append(("resonance [Hz]", [("resonance_hz", "by load share", 1.0)]))
    figure = Figure(figsize=(9.6, 1.55 * len(panels) + 0.5))
    every = figure.subplots(len(panels), 1, sharex=True, squeeze=False)[:, 0]
    figure.subplots_adjust(left=0.09, right=0.985, top=0.985, bottom=0.5 / figure.get_size_inches()[1], hspace=0.12)
    time = table["time_s"].to_numpy() * MICRO
    counts = float(history.settled["time_s"].iloc[0]) * MICRO
    for axes, (label, lines) in zip(every, panels, strict=True):
        _draw(axes, time, [(table[name].to_numpy() * scale, said) for name, said, scale in lines])
        axes.axvspan(counts, time[-1], color=GREY, alpha=0.08, linewidth=0.0)
        axes.set_ylabel(label)
    every[-1].set_xlabel("time [µs]")
    box = every[0].get_position()
    return Curves(figure, box.x0, box.x1)


@styled()
def running_in(history: History) -> Figure:
    """Load and area shares, Sq of the tracks, how far they are pressed down, and resonance, pass by pass."""
    table = history.by_pass()
    passes = table["pass"].to_numpy()
    shares = [("clr", "CLR, load on asperities", 100.0), ("car", "CAR, Hertz zone", 100.0)]
    panels = [
        ("share [%]", shares),
        ("Sq of the tracks [µm]", [("track_sq_m", "", MICRO)]),
        ("pressed down, mean [nm]", [("flattened_m", "", 1e9)]),
    ]
    if bool(table["resonance_hz"].notna().any()):
        panels.append(("resonance [Hz]", [("resonance_hz", "", 1.0)]))
    figure = Figure(figsize=(9.6, 2.4 * -(-len(panels) // 2)), layout="constrained")
    for number, (label, lines) in enumerate(panels, 1):
        axes = figure.add_subplot(-(-len(panels) // 2), 2, number)
        for (name, said, scale), colour, marker in zip(lines, (BLUE, VERMILION), "os", strict=False):
            axes.plot(passes, scale * table[name].to_numpy(), marker=marker, markersize=3.5, color=colour, label=said)
        if len(lines) > 1:
            axes.set_ylim(bottom=0.0)
            axes.legend(loc="upper right")
        axes.set(ylabel=label, xlabel="pass")
        axes.xaxis.set_major_locator(MaxNLocator(integer=True))
    return figure


def _draw(axes: Axes, time: Field, lines: Sequence[tuple[Field, str]]) -> None:
    for (values, said), colour, stroke in zip(lines, (BLUE, VERMILION, GREEN), _STROKES, strict=False):
        axes.plot(time, values, stroke, color=colour, label=said)
    axes.set_xlim(0.0, float(time[-1]) or 1.0)
    low, high = axes.get_ylim()
    low = 0.0 if min(float(np.nanmin(values)) for values, _ in lines) >= 0.0 and low < 0.4 * high else low
    axes.set_ylim(low, high + 0.28 * (high - low))  # room for the key
    axes.legend(loc="upper right", ncols=3)
