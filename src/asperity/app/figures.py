"""Figures of a contact that follow its answers: maps, a cut along rolling, the spectrum, the trail of what was tried.

Axes are named by the catalogue; colours of lines and marks are those of the report's figures. What
is paper and what is ink comes from the page's style sheet, so that light and dark need no figure
redrawn.
"""

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from bokeh.events import Tap
from bokeh.models import (
    BoxAnnotation,
    ColorBar,
    ColumnDataSource,
    CrosshairTool,
    HoverTool,
    LinearColorMapper,
    Range1d,
    Span,
)
from bokeh.palettes import Inferno256, RdBu11, Viridis256, interp_palette
from bokeh.plotting import figure

from asperity.app.contact_result import RUPTURED, TOUCHING, Picture, Sound
from asperity.app.session import Tried
from asperity.core.quantities import quantity

BLUE, VERMILION, GREEN, GREY = "#2b8fd0", "#d55e00", "#00a577", "#808893"
FILMS = Viridis256[:208]  # without its yellow, which is that of contact
CHANGES = interp_palette(RdBu11, 256)  # thinner is blue, thicker red
CONTACT, CAVITY = (0xF7, 0xDC, 0x4A), (0x5B, 0x6B, 0x86)
# of keys and colour bars, which take no ink from the style sheet: legible on light and on dark
TYPE = "#74818f"
HEIGHT, CUT_HEIGHT, SPECTRUM_HEIGHT, TRAIL_HEIGHT = 300, 250, 480, 240
SHAPES, BESIDE = (
    (0.9, 2.0),
    0.8,
)  # widths of maps over their heights; of that, what axes and colour bar leave


def shown(key: str, values: Any) -> Any:
    """Stored values of a quantity in its display unit."""
    return np.asarray(values) * quantity(key).factor


def plain_figure(
    x: str, y: str, *, label: str, height: int = HEIGHT, tapped: bool = False, **settings: Any
) -> Any:
    """An empty figure whose axes are named by the catalogue; `label` is what a screen reader calls it.

    `tapped`: marks in it may be clicked.
    """
    made = figure(
        height=height,
        sizing_mode="stretch_width",
        x_axis_label=quantity(x).axis if x else "",
        y_axis_label=quantity(y).label if y else "",
        tools=f"pan,wheel_zoom,box_zoom,reset,save{',tap' if tapped else ''}",
        active_scroll=None,
        html_attributes={"role": "img", "aria-label": label},
        min_border=2,
        **settings,
    )
    made.toolbar.logo = None
    made.toolbar.autohide = True
    return made


def _key_above(made: Any) -> Any:
    """Move a figure's key above it, where it hides nothing; its last entry, which is not always shown."""
    key = made.legend[0]
    made.center.remove(key)
    made.add_layout(key, "above")
    key.update(
        orientation="horizontal",
        location="left",
        border_line_alpha=0,
        background_fill_alpha=0,
        padding=0,
        label_text_color=TYPE,
    )
    key.items[-1].visible = False
    return key.items[-1]


class Maps:
    """Film and pressure of a contact on the same axes, with linked cursors, and where the cut runs."""

    def __init__(self, cut_at: Callable[[float], None]) -> None:
        self._cut_at = cut_at
        self.x, self.y = Range1d(), Range1d()
        self.across, self.along = (
            Span(dimension=way, line_dash="dotted") for way in ("width", "height")
        )
        self.film = self._map("Film thickness, contact and cavitation", FILMS, "gap")
        self.pressure = self._map("Pressure", Inferno256, "pressure")
        self.change: Any = None  # until something is pinned
        self.compares = False

    def _map(self, title: str, palette: Sequence[str], key: str) -> Any:
        made = plain_figure(
            "x_m",
            "y_m",
            label=title,
            title=title,
            x_range=self.x,
            y_range=self.y,
            min_height=HEIGHT,
        )
        made.update(sizing_mode="scale_width", aspect_ratio=SHAPES[1])
        made.add_tools(CrosshairTool(overlay=[self.across, self.along]))
        mapper = LinearColorMapper(
            palette=palette, low=0.0, high=1.0
        )  # with numbers, for which the bar takes room
        source = ColumnDataSource({"image": [], "x": [], "y": [], "dw": [], "dh": []})
        image = made.image("image", "x", "y", "dw", "dh", source=source, color_mapper=mapper)
        over = ColumnDataSource({"image": [], "x": [], "y": [], "dw": [], "dh": []})
        made.image_rgba("image", "x", "y", "dw", "dh", source=over)
        zone = ColumnDataSource({"x": [], "y": []})
        made.line("x", "y", source=zone, color="white", line_dash="dashed")
        cut = Span(dimension="width", line_color="white", line_dash="dotdash", line_width=1)
        made.add_layout(cut)
        bar = ColorBar(
            color_mapper=mapper,
            title=quantity(key).label,
            height=8,
            padding=2,
            location=(0, 0),
            title_text_color=TYPE,
            major_label_text_color=TYPE,
            background_fill_alpha=0,
        )
        made.add_layout(bar, "below")
        unit = quantity(key).display
        made.add_tools(
            HoverTool(
                renderers=[image], tooltips=[(quantity(key).short, f"@image{{0.000}} {unit}")]
            )
        )
        made.on_event(Tap, lambda event: self._cut_at(event.y))
        made.tags = [{"mapper": mapper, "source": source, "over": over, "zone": zone, "cut": cut}]
        return made

    def show(self, answer: Picture, pinned: Picture | None) -> None:
        """Draw an answer, and how its film differs from a pinned one if that is on the same cells: `compares`."""
        (x0, x1), (y0, y1) = ((shown("x_m", end) for end in ends) for ends in answer.extent)
        self.x.update(start=x0, end=x1, reset_start=x0, reset_end=x1)
        self.y.update(start=y0, end=y1, reset_start=y0, reset_end=y1)
        self.compares = pinned is not None and pinned.gap.shape == answer.gap.shape
        if self.compares and self.change is None:
            self.change = self._map("Film less the pinned film", CHANGES, "gap")
        shape = BESIDE * min(max(float((x1 - x0) / (y1 - y0)), SHAPES[0]), SHAPES[1])
        for made in self._made():
            made.aspect_ratio = shape
        place = {"x": [x0], "y": [y0], "dw": [x1 - x0], "dh": [y1 - y0]}
        marks = _marks(answer)
        self._fill(
            self.film,
            shown("gap", answer.gap),
            (0.0, shown("gap", answer.gap_top) or 1.0),
            place,
            marks,
        )
        largest = max(float(answer.pressure.max()), answer.hertz_pressure)
        self._fill(
            self.pressure,
            shown("pressure", answer.pressure),
            (0.0, shown("pressure", largest)),
            place,
            None,
        )
        zone = _hertz_outline(answer, (y0, y1))
        for made in self._made():
            made.tags[0]["zone"].data = zone
        if self.compares and pinned is not None:
            change = shown("gap", answer.gap - pinned.gap)
            reach = float(np.percentile(np.abs(change), 98.0)) or 1.0
            self._fill(self.change, change, (-reach, reach), place, None)

    def _made(self) -> list[Any]:
        return [self.film, self.pressure, *([] if self.change is None else [self.change])]

    def cut(self, y: float) -> None:
        """Mark where the cut runs [m]."""
        for made in self._made():
            made.tags[0]["cut"].location = float(shown("y_m", y))

    @staticmethod
    def _fill(
        made: Any, values: Any, ends: tuple[float, float], place: dict[str, Any], marks: Any
    ) -> None:
        parts = made.tags[0]
        parts["mapper"].update(low=float(ends[0]), high=float(ends[1]))
        parts["source"].data = {"image": [np.ascontiguousarray(values.T, np.float32)], **place}
        if marks is not None:
            parts["over"].data = {"image": [marks], **place}


def _marks(answer: Picture) -> Any:
    """Contact and cavitation as colours over the film, shape (ny, nx)."""
    colours = np.zeros((*answer.cells.T.shape, 4), np.uint8)
    cells = answer.cells.T
    colours[cells == TOUCHING] = (*CONTACT, 255)
    ruptured = cells == RUPTURED
    i, j = np.indices(cells.shape, sparse=True)
    colours[ruptured] = (*CAVITY, 150)
    colours[ruptured & ((i + j) % 6 < 2)] = (*CAVITY, 235)
    return colours.view(np.uint32).reshape(cells.shape)


def _hertz_outline(answer: Picture, ends: tuple[float, float]) -> dict[str, Any]:
    """The outline of the smooth, dry contact, in the maps' unit."""
    a, b = (shown("x_m", half) for half in answer.half_widths)
    if answer.endless:
        return {"x": [-a, -a, np.nan, a, a], "y": [ends[0], ends[1], np.nan, ends[0], ends[1]]}
    turn = np.linspace(0.0, 2.0 * np.pi, 200)
    return {"x": a * np.cos(turn), "y": b * np.sin(turn)}


class Cut:
    """Pressure and film along rolling, with Hertz's pressure, and those of a pinned contact."""

    def __init__(self, maps: Maps) -> None:
        label = "Cut along rolling: pressure with Hertz's pressure"
        self.pressure = plain_figure(
            "", "pressure", label=label, title="Cut", height=CUT_HEIGHT, x_range=maps.x
        )
        self.film = plain_figure(
            "x_m",
            "gap",
            label="Cut along rolling: film",
            title="Film in the cut",
            height=CUT_HEIGHT,
            x_range=maps.x,
        )
        for made in (self.pressure, self.film):
            made.add_tools(
                CrosshairTool(overlay=[Span(dimension="width", line_dash="dotted"), maps.along])
            )
            made.y_range = Range1d(0.0, 1.0)
        self.now, self.then = (
            ColumnDataSource({"x": [], "p": [], "hertz": [], "h": [], "touch": []}) for _ in "ab"
        )
        self.pressure.line("x", "p", source=self.now, color=BLUE, legend_label="pressure")
        self.pressure.line(
            "x", "hertz", source=self.now, color=GREY, line_dash="dashed", legend_label="Hertz"
        )
        self.pressure.line(
            "x", "p", source=self.then, color=VERMILION, line_dash="dotted", legend_label="pinned"
        )
        self.film.line("x", "h", source=self.now, color=GREEN, legend_label="film")
        self.film.scatter(
            "x",
            "touch",
            source=self.now,
            marker="square",
            size=5,
            color="#c9a400",
            legend_label="contact",
        )
        self.film.line(
            "x", "h", source=self.then, color=VERMILION, line_dash="dotted", legend_label="pinned"
        )
        self._pinned = [_key_above(made) for made in (self.pressure, self.film)]

    def show(self, answer: Picture, pinned: Picture | None, y: float) -> None:
        """Draw the cut at y [m]."""
        row = answer.line(y)
        self.pressure.title.text = (
            f"Cut along rolling at y = {quantity('y_m').text(float(answer.y[row]))}"
        )
        self.now.data = self._line(answer, row)
        self.then.data = (
            self._line(pinned, pinned.line(y))
            if pinned is not None
            else {key: [] for key in self.now.data}
        )
        for item in self._pinned:
            item.visible = pinned is not None
        pressures = [answer.pressure[:, row].max(), answer.hertz_pressure]
        self.pressure.y_range.update(start=0.0, end=1.12 * float(shown("pressure", max(pressures))))
        inside = np.abs(answer.x) <= 1.2 * answer.half_widths[0]
        top = float(answer.gap[inside, row].max()) if inside.any() else float(answer.gap.max())
        self.film.y_range.update(start=0.0, end=1.2 * float(shown("gap", top)) or 1.0)

    @staticmethod
    def _line(answer: Picture, row: int) -> dict[str, Any]:
        touching = np.where(answer.cells[:, row] == TOUCHING, 0.0, np.nan)
        return {
            "x": shown("x_m", answer.x),
            "p": shown("pressure", answer.pressure[:, row]),
            "hertz": shown("pressure", answer.hertz(row)),
            "h": shown("gap", answer.gap[:, row]),
            "touch": touching,
        }


class Spectrum:
    """The spectrum about the searched band with the fitted resonance, and a pinned contact's."""

    def __init__(self) -> None:
        self.figure = plain_figure(
            "frequency_hz",
            "acceleration_density",
            label="Spectrum with the fitted resonance",
            title="Spectrum",
            y_axis_type="log",
            height=SPECTRUM_HEIGHT,
        )
        self.band = BoxAnnotation(left=0, right=0, fill_alpha=0.12, fill_color=BLUE, line_alpha=0)
        self.deviation = BoxAnnotation(
            left=0, right=0, fill_alpha=0.35, fill_color=BLUE, line_alpha=0, visible=False
        )
        self.crf = Span(dimension="height", line_color=BLUE, line_dash="dashed", visible=False)
        self.full_load = Span(
            dimension="height", line_color=GREY, line_dash="dotted", visible=False
        )
        for mark in (self.band, self.deviation, self.crf, self.full_load):
            self.figure.add_layout(mark)
        empty: dict[str, Any] = {"f": [], "s": []}
        self.now, self.fit, self.then = (ColumnDataSource(dict(empty)) for _ in range(3))
        self.figure.line("f", "s", source=self.now, color=GREY, legend_label="spectrum")
        self.figure.line(
            "f",
            "s",
            source=self.fit,
            color=VERMILION,
            line_width=2,
            legend_label="fitted resonance",
        )
        self.figure.line(
            "f",
            "s",
            source=self.then,
            color=GREEN,
            line_dash="dotted",
            legend_label="pinned, fitted",
        )
        self._pinned = _key_above(self.figure)

    def show(self, sound: Sound | None, pinned: Sound | None, words: str) -> None:
        """Draw a spectrum, or say why there is none."""
        self.figure.title.text = words
        if sound is None or not sound.frequency.size:
            self.now.data = self.fit.data = {"f": [], "s": []}
            self.crf.visible = self.deviation.visible = self.full_load.visible = False
        else:
            self.now.data = {"f": sound.frequency, "s": sound.density}
            self.fit.data = (
                {"f": sound.frequency, "s": sound.curve} if sound.curve.size else {"f": [], "s": []}
            )
            self.band.update(left=sound.band_hz[0], right=sound.band_hz[1])
            self.full_load.update(location=sound.full_load_crf_hz, visible=True)
            self.crf.visible = sound.crf_hz is not None
            self.deviation.visible = sound.crf_std_hz is not None
            if sound.crf_hz is not None:
                self.crf.location = sound.crf_hz
                reach = 2.0 * (sound.crf_std_hz or 0.0)
                self.deviation.update(left=sound.crf_hz - reach, right=sound.crf_hz + reach)
        has = pinned is not None and pinned.curve.size
        self.then.data = (
            {"f": pinned.frequency, "s": pinned.curve} if has and pinned else {"f": [], "s": []}
        )
        self._pinned.visible = bool(has)


class Trail:
    """What was tried, in the planes of roughness, load share and resonance; the last setting stands out."""

    def __init__(self, chosen: Callable[[int], None]) -> None:
        self.source = ColumnDataSource({"sq": [], "clr": [], "crf": [], "alpha": []})
        self.last = ColumnDataSource({"sq": [], "clr": [], "crf": []})
        self.share = self._plane("sq_m", "clr", "sq", "clr", "Load share over roughness")
        self.pitch = self._plane("sq_m", "crf_hz", "sq", "crf", "Resonance over roughness")
        self.source.selected.on_change(
            "indices", lambda _name, _old, new: chosen(new[0]) if new else None
        )

    def _plane(self, x: str, y: str, across: str, up: str, label: str) -> Any:
        made = plain_figure(x, y, label=label, title=label, height=TRAIL_HEIGHT, tapped=True)
        made.scatter(across, up, source=self.source, size=10, color=BLUE, alpha="alpha")
        made.scatter(
            across, up, source=self.last, size=15, line_color=VERMILION, fill_alpha=0, line_width=2
        )
        return made

    def show(self, trail: Sequence[Tried]) -> None:
        """Draw all that was tried."""
        rows = {
            "sq": [float(shown("sq_m", tried.sq)) for tried in trail],
            "clr": [float(shown("clr", tried.clr)) for tried in trail],
            "crf": [np.nan if tried.crf_hz is None else tried.crf_hz for tried in trail],
        }
        self.source.data = {**rows, "alpha": [0.9 if tried.determined else 0.35 for tried in trail]}
        self.last.data = {key: values[-1:] for key, values in rows.items()}
