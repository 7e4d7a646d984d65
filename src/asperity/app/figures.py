"""Figures of a contact: maps, a section along rolling, the spectrum, earlier results.

Axis labels come from the catalogue; colours match the report. Background and text colours come from
the style sheet, so that switching between light and dark redraws nothing.
"""

from collections.abc import Callable, Sequence
from typing import Any, TypeAlias

import numpy as np
from bokeh.events import Tap
from bokeh.models import (
    BoxAnnotation,
    ColorBar,
    ColumnDataSource,
    CrosshairTool,
    HoverTool,
    LegendItem,
    LinearColorMapper,
    Range1d,
    Span,
)
from bokeh.palettes import Inferno256, RdBu11, Viridis256, interp_palette
from bokeh.plotting import figure
from numpy.typing import ArrayLike

from asperity.app.contact_result import CAVITATED, TOUCHING, ContactMaps, ResonanceSpectrum
from asperity.app.session import Trial
from asperity.core.quantities import quantity

BLUE, VERMILION, GREEN, GREY = "#2b8fd0", "#d55e00", "#00a577", "#808893"
# `FILM_COLOURS` of `report.style`, without yellow, the colour of contact
FILMS = Viridis256[:208]
CHANGES = interp_palette(RdBu11, 256)  # thinner: blue, thicker: red
CONTACT = (0xF7, 0xDC, 0x4A)
CAVITY = (0x5B, 0x6B, 0x86)
# text of legends and colour bars, which ignore the style sheet: legible on light and dark
TYPE = "#74818f"
HEIGHT = 300
SECTION_HEIGHT = 250
SPECTRUM_HEIGHT = 480
TRIALS_HEIGHT = 240
Plot: TypeAlias = Any  # a figure of Bokeh, whose types lack the attributes that are set here
Array: TypeAlias = Any  # numbers of any shape
Source: TypeAlias = dict[str, Any]  # columns of a data source by name
ASPECT_RANGE = (0.9, 2.0)  # of maps, width over height
FILM_TITLE, PRESSURE_TITLE = "Film thickness, contact and cavitation", "Pressure"
MAP_SHARE = 0.8  # of a figure's width, the rest being axes


def to_display(key: str, values: ArrayLike) -> Array:
    """Convert stored values of a quantity to its display unit."""
    return np.asarray(values) * quantity(key).factor


def plain_figure(
    x: str, y: str, *, label: str, height: int = HEIGHT, tapped: bool = False, **settings: object
) -> Plot:
    """Create an empty figure with axis labels from the catalogue.

    `label` is its name for screen readers; `tapped` makes its markers clickable.
    """
    plot = figure(
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
    plot.toolbar.logo = None
    plot.toolbar.autohide = True
    return plot


def legend_above(plot: Plot) -> Plot:
    """Move the legend above the figure; return it."""
    legend = plot.legend[0]
    plot.center.remove(legend)
    plot.add_layout(legend, "above")
    legend.update(
        orientation="horizontal",
        location="left",
        border_line_alpha=0,
        background_fill_alpha=0,
        padding=0,
        label_text_color=TYPE,
    )
    return legend


def _key_above(plot: Plot) -> LegendItem:
    """Move the legend above the figure; hide and return its last entry."""
    item = legend_above(plot).items[-1]
    item.visible = False
    return item


class MapFigures:
    """Maps of film and pressure with common axes, linked cursors and the line of the section."""

    def __init__(self, cut_at: Callable[[float], None]) -> None:
        self._cut_at = cut_at
        self.x, self.y = Range1d(), Range1d()
        self.across, self.along = (
            Span(dimension=dimension, line_dash="dotted") for dimension in ("width", "height")
        )
        self.film = self._map(FILM_TITLE, FILMS, "gap")
        self.pressure = self._map(PRESSURE_TITLE, Inferno256, "pressure")
        self.change: Plot | None = None  # created when a contact is pinned
        self.compares = False

    def _map(self, title: str, palette: Sequence[str], key: str) -> Plot:
        plot = plain_figure(
            "x_m",
            "y_m",
            label=title,
            title=title,
            x_range=self.x,
            y_range=self.y,
            min_height=HEIGHT,
        )
        plot.update(sizing_mode="scale_width", aspect_ratio=ASPECT_RANGE[1])
        plot.add_tools(CrosshairTool(overlay=[self.across, self.along]))
        mapper = LinearColorMapper(
            palette=palette, low=0.0, high=1.0
        )  # initial range, which reserves space for the labels
        source = ColumnDataSource({"image": [], "x": [], "y": [], "dw": [], "dh": []})
        image = plot.image("image", "x", "y", "dw", "dh", source=source, color_mapper=mapper)
        overlay = ColumnDataSource({"image": [], "x": [], "y": [], "dw": [], "dh": []})
        plot.image_rgba("image", "x", "y", "dw", "dh", source=overlay)
        zone = ColumnDataSource({"x": [], "y": []})
        plot.line("x", "y", source=zone, color="white", line_dash="dashed")
        cut = Span(dimension="width", line_color="white", line_dash="dotdash", line_width=1)
        plot.add_layout(cut)
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
        plot.add_layout(bar, "below")
        unit = quantity(key).display
        plot.add_tools(
            HoverTool(
                renderers=[image], tooltips=[(quantity(key).short, f"@image{{0.000}} {unit}")]
            )
        )
        plot.on_event(Tap, lambda event: self._cut_at(event.y))
        plot.tags = [
            {"mapper": mapper, "source": source, "overlay": overlay, "zone": zone, "cut": cut}
        ]
        return plot

    def show(self, result: ContactMaps, pinned: ContactMaps | None) -> None:
        """Draw a result, and its film minus a pinned one on the same cells (`compares`)."""
        (x0, x1), (y0, y1) = ((to_display("x_m", end) for end in axis) for axis in result.extent)
        self.compares = pinned is not None and result.has_cells_of(pinned)
        if self.compares and self.change is None:
            self.change = self._map("Film minus pinned film", CHANGES, "gap")
        self._set_extent((x0, x1), (y0, y1))
        self._set_titles(result.instant_area)
        box = {"x": [x0], "y": [y0], "dw": [x1 - x0], "dh": [y1 - y0]}
        gap = to_display("gap", result.gap)
        top = to_display("gap", result.gap_top) or 1.0
        self._fill(self.film, gap, (0.0, top), box, _state_colours(result))
        largest = max(float(result.pressure.max()), result.hertz_pressure)
        pressure = to_display("pressure", result.pressure)
        top = to_display("pressure", largest)
        self._fill(self.pressure, pressure, (0.0, top), box, None)
        zone = _hertz_outline(result, (y0, y1))
        for plot in self._figures():
            plot.tags[0]["zone"].data = zone
        if self.compares and pinned is not None:
            self._fill_change(to_display("gap", result.gap - pinned.gap), box)

    def _set_titles(self, area: float | None) -> None:
        """Set the titles: one instant, with its contact area, or the solution of the numbers."""
        film, pressure = FILM_TITLE, PRESSURE_TITLE
        if area is not None:
            film = f"Film at one instant, {quantity('car').named(area)}"
            pressure = "Pressure at the same instant"
        self.film.title.text, self.pressure.title.text = film, pressure

    def _fill_change(self, change: Array, box: Source) -> None:
        limit = float(np.percentile(np.abs(change), 98.0)) or 1.0
        self._fill(self.change, change, (-limit, limit), box, None)

    def _set_extent(self, x: tuple[float, float], y: tuple[float, float]) -> None:
        """Set ends and shape of all maps, in the display unit."""
        (x0, x1), (y0, y1) = x, y
        self.x.update(start=x0, end=x1, reset_start=x0, reset_end=x1)
        self.y.update(start=y0, end=y1, reset_start=y0, reset_end=y1)
        low, high = ASPECT_RANGE
        shape = MAP_SHARE * min(max(float((x1 - x0) / (y1 - y0)), low), high)
        for plot in self._figures():
            plot.aspect_ratio = shape

    def _figures(self) -> list[Plot]:
        return [self.film, self.pressure, *([] if self.change is None else [self.change])]

    def cut(self, y: float) -> None:
        """Mark the line of the section at y [m]."""
        for plot in self._figures():
            plot.tags[0]["cut"].location = float(to_display("y_m", y))

    @staticmethod
    def _fill(
        plot: Plot, values: Array, ends: tuple[float, float], box: Source, marks: Array | None
    ) -> None:
        parts = plot.tags[0]
        parts["mapper"].update(low=float(ends[0]), high=float(ends[1]))
        parts["source"].data = {"image": [np.ascontiguousarray(values.T, np.float32)], **box}
        if marks is not None:
            parts["overlay"].data = {"image": [marks], **box}


def _state_colours(result: ContactMaps) -> Array:
    """Return contact and cavitation as colours over the film, shape (ny, nx)."""
    colours = np.zeros((*result.cells.T.shape, 4), np.uint8)
    cells = result.cells.T
    colours[cells == TOUCHING] = (*CONTACT, 255)
    cavitated = cells == CAVITATED
    rows, columns = cells.shape
    i, j = np.indices((rows, columns), sparse=True)
    colours[cavitated] = (*CAVITY, 150)
    colours[cavitated & ((i + j) % 6 < 2)] = (*CAVITY, 235)
    return colours.view(np.uint32).reshape(cells.shape)


def _hertz_outline(result: ContactMaps, y: tuple[float, float]) -> Source:
    """Return the outline of the smooth, dry contact in the display unit."""
    a, b = (to_display("x_m", half) for half in result.half_widths)
    if result.endless:
        return {"x": [-a, -a, np.nan, a, a], "y": [y[0], y[1], np.nan, y[0], y[1]]}
    angle = np.linspace(0.0, 2.0 * np.pi, 200)
    return {"x": a * np.cos(angle), "y": b * np.sin(angle)}


class SectionFigures:
    """Section along rolling: pressure, Hertz pressure and film, with those of a pinned contact."""

    def __init__(self, maps: MapFigures) -> None:
        label = "Section along rolling: pressure and Hertz pressure"
        self.pressure = plain_figure(
            "", "pressure", label=label, title="Section", height=SECTION_HEIGHT, x_range=maps.x
        )
        self.film = plain_figure(
            "x_m",
            "gap",
            label="Section along rolling: film",
            title="Film thickness in the section",
            height=SECTION_HEIGHT,
            x_range=maps.x,
        )
        for plot in (self.pressure, self.film):
            plot.add_tools(
                CrosshairTool(overlay=[Span(dimension="width", line_dash="dotted"), maps.along])
            )
            plot.y_range = Range1d(0.0, 1.0)
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
        self._pinned = [_key_above(plot) for plot in (self.pressure, self.film)]

    def show(self, result: ContactMaps, pinned: ContactMaps | None, y: float) -> None:
        """Draw the section at y [m]."""
        row = result.nearest_row(y)
        self.pressure.title.text = (
            f"Section along rolling, y = {quantity('y_m').text(float(result.y[row]))}"
        )
        self.now.data = self._line(result, row)
        self.then.data = (
            self._line(pinned, pinned.nearest_row(y))
            if pinned is not None
            else {key: [] for key in self.now.data}
        )
        for item in self._pinned:
            item.visible = pinned is not None
        pressures = [result.pressure[:, row].max(), result.hertz_pressure]
        self.pressure.y_range.update(
            start=0.0, end=1.12 * float(to_display("pressure", max(pressures)))
        )
        inside = np.abs(result.x) <= 1.2 * result.half_widths[0]
        top = float(result.gap[inside, row].max()) if inside.any() else float(result.gap.max())
        self.film.y_range.update(start=0.0, end=1.2 * float(to_display("gap", top)) or 1.0)

    @staticmethod
    def _line(result: ContactMaps, row: int) -> Source:
        touching = np.where(result.cells[:, row] == TOUCHING, 0.0, np.nan)
        return {
            "x": to_display("x_m", result.x),
            "p": to_display("pressure", result.pressure[:, row]),
            "hertz": to_display("pressure", result.hertz(row)),
            "h": to_display("gap", result.gap[:, row]),
            "touch": touching,
        }


class SpectrumFigure:
    """Spectrum around the search band with the fitted resonance, and a pinned contact's."""

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
        self.now, self.fit, self.then = (ColumnDataSource({"f": [], "s": []}) for _ in range(3))
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
            legend_label="pinned",
        )
        self._pinned = _key_above(self.figure)

    def show(
        self, spectrum: ResonanceSpectrum | None, pinned: ResonanceSpectrum | None, title: str
    ) -> None:
        """Draw a spectrum; the title states the resonance or why there is none."""
        self.figure.title.text = title
        if spectrum is None or not spectrum.frequency.size:
            self.now.data = self.fit.data = {"f": [], "s": []}
            self.crf.visible = self.deviation.visible = self.full_load.visible = False
        else:
            self.now.data = {"f": spectrum.frequency, "s": spectrum.density}
            self.fit.data = (
                {"f": spectrum.frequency, "s": spectrum.curve}
                if spectrum.curve.size
                else {"f": [], "s": []}
            )
            self.band.update(left=spectrum.band_hz[0], right=spectrum.band_hz[1])
            self.full_load.update(location=spectrum.full_load_crf_hz, visible=True)
            self.crf.visible = spectrum.crf_hz is not None
            self.deviation.visible = spectrum.crf_std_hz is not None
            if spectrum.crf_hz is not None:
                self.crf.location = spectrum.crf_hz
                half_width = 2.0 * (spectrum.crf_std_hz or 0.0)
                self.deviation.update(
                    left=spectrum.crf_hz - half_width, right=spectrum.crf_hz + half_width
                )
        has_curve = pinned is not None and pinned.curve.size
        self.then.data = (
            {"f": pinned.frequency, "s": pinned.curve}
            if has_curve and pinned
            else {"f": [], "s": []}
        )
        self._pinned.visible = bool(has_curve)


class TrialFigures:
    """Earlier results: load share and resonance over roughness; the latest is highlighted."""

    def __init__(self, chosen: Callable[[int], None]) -> None:
        self.source = ColumnDataSource({"sq": [], "clr": [], "crf": [], "alpha": []})
        self.last = ColumnDataSource({"sq": [], "clr": [], "crf": []})
        self.share = self._plane("sq_m", "clr", "sq", "clr", "Load share over roughness")
        self.crf = self._plane("sq_m", "crf_hz", "sq", "crf", "Resonance over roughness")
        self.source.selected.on_change(
            "indices", lambda _name, _old, new: chosen(new[0]) if new else None
        )

    def _plane(self, x: str, y: str, x_column: str, y_column: str, label: str) -> Plot:
        plot = plain_figure(x, y, label=label, title=label, height=TRIALS_HEIGHT, tapped=True)
        plot.scatter(x_column, y_column, source=self.source, size=10, color=BLUE, alpha="alpha")
        highlight: Source = {"line_color": VERMILION, "fill_alpha": 0, "line_width": 2}
        plot.scatter(x_column, y_column, source=self.last, size=15, **highlight)
        return plot

    def show(self, trials: Sequence[Trial]) -> None:
        """Draw all earlier results."""
        rows = {
            "sq": [float(to_display("sq_m", trial.sq)) for trial in trials],
            "clr": [float(to_display("clr", trial.clr)) for trial in trials],
            "crf": [np.nan if trial.crf_hz is None else trial.crf_hz for trial in trials],
        }
        alpha = [0.9 if trial.determined else 0.35 for trial in trials]
        self.source.data = {**rows, "alpha": alpha}
        self.last.data = {key: values[-1:] for key, values in rows.items()}
