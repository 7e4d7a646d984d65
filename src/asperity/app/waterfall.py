"""Spectra of a series of recordings as colours, with the search band."""

import numpy as np
from bokeh.models import ColorBar, ColumnDataSource, LinearColorMapper, Range1d, Span
from bokeh.palettes import Viridis256

from asperity.app.figures import TYPE, plain_figure
from asperity.app.recording_jobs import RecordingSeries

MIN_LEVEL, MAX_LEVEL = -5.0, 30.0  # dB over the median, ends of the colours


class Waterfall:
    """Levels of all spectra of a series over their medians."""

    def __init__(self) -> None:
        self.figure = plain_figure(
            "",
            "frequency_hz",
            label="Spectra over the series",
            title="Spectra; dashed: search band",
            height=320,
        )
        self.figure.xaxis.axis_label = "recording"
        mapper = LinearColorMapper(
            palette=Viridis256, low=MIN_LEVEL, high=MAX_LEVEL, nan_color="#00000000"
        )
        self._source = ColumnDataSource({"image": [], "x": [], "y": [], "dw": [], "dh": []})
        self.figure.image("image", "x", "y", "dw", "dh", source=self._source, color_mapper=mapper)
        self._edges = [
            Span(dimension="width", line_color="white", line_dash="dashed") for _ in range(2)
        ]
        bar = ColorBar(
            color_mapper=mapper,
            title="level over the median [dB]",
            height=8,
            padding=2,
            location=(0, 0),
            title_text_color=TYPE,
            major_label_text_color=TYPE,
            background_fill_alpha=0,
        )
        for edge in self._edges:
            self.figure.add_layout(edge)
        self.figure.add_layout(bar, "below")
        self.figure.x_range, self.figure.y_range = Range1d(0, 1), Range1d(0, 1)

    def show(self, series: RecordingSeries) -> None:
        """Draw the spectra of a series."""
        if not series.levels.size:
            self._source.data = {"image": [], "x": [], "y": [], "dw": [], "dh": []}
            return
        count = len(series.rows)
        (low, high) = series.band_hz
        low_hz = float(series.frequency[0])
        high_hz = float(series.frequency[-1])
        rectangle = {"x": [0.5], "y": [low_hz], "dw": [count], "dh": [high_hz - low_hz]}
        self._source.data = {"image": [np.ascontiguousarray(series.levels.T)], **rectangle}
        self.figure.x_range.update(start=0.5, end=count + 0.5)
        self.figure.y_range.update(start=low_hz, end=min(high_hz, 1.6 * high))
        for edge, end in zip(self._edges, (low, high), strict=True):
            edge.location = end
