"""Page of a history of motion or wear: maps with a slider, and curves over time."""

from collections.abc import Callable
from pathlib import Path

from bokeh.models import Column, ColumnDataSource, Range1d, Slider, Span

from asperity.app.contact_jobs import JobFailure
from asperity.app.figures import BLUE, VERMILION, plain_figure, to_display
from asperity.app.folder_jobs import HistoryData, open_history
from asperity.app.jobs import JobQueue, VisitPool
from asperity.app.map_images import MapImages
from asperity.app.widgets import BAR, LOOK, Layout, PageBlock, button, notes, sentences, text_block
from asperity.core.quantities import quantity


class HistoryView:
    """History of one visitor with its widgets."""

    def __init__(
        self, folder: Path, worker_pool: VisitPool, deliver: Callable[[Callable[[], None]], None]
    ) -> None:
        self._folder = folder
        self._queue = JobQueue(worker_pool, deliver)
        self.history: HistoryData | None = None
        self.playing = False
        self.status, self.verdict, self.notes = (text_block() for _ in range(3))
        self.step = Slider(
            title="",
            start=0,
            end=1,
            step=1,
            value=0,
            bar_color=BAR,
            sizing_mode="stretch_width",
            show_value=False,
            stylesheets=[LOOK],
            margin=(0, 12, 6, 12),
            tags=["Step", "0"],
        )
        self.step.on_change("value", lambda _name, _old, new: self._show(int(new)))
        self.play = button("Play", self._toggle)
        self.maps = MapImages()
        self.curves = Column(sizing_mode="stretch_width")
        self._now: list[Span] = []

    def begin(self) -> None:
        """Start reading the history."""
        self.status.text = sentences(["Reading the history ..."], "soft")
        self._queue.submit((open_history, (self._folder,)), self._read)

    def close(self) -> None:
        """Release the resources of the visit."""
        self._queue.close()
        self.history = None

    def advance(self) -> None:
        """Advance by one frame while playing, in a loop."""
        if self.playing and self.history is not None and self.history.maps:
            self.step.value = (int(self.step.value) + 1) % len(self.history.maps)

    def _toggle(self) -> None:
        self.playing = not self.playing
        self.play.label = "Stop" if self.playing else "Play"

    def _read(self, result: object) -> None:
        if isinstance(result, JobFailure):
            self.status.text = sentences([result.message], "alarm")
            return
        assert isinstance(result, HistoryData)
        self.history = history = result
        self.verdict.text, self.notes.text = sentences([history.verdict]), notes(history.notes)
        self._draw_curves(history)
        if not history.maps:
            self.status.text = sentences(["This history has no stored maps."], "soft")
            return
        self.step.update(start=0, end=max(1, len(history.maps) - 1))
        self._show(0)

    def _draw_curves(self, history: HistoryData) -> None:
        clock = quantity(history.clock)
        time = history.time * clock.factor
        time_range = Range1d(float(time[0]), float(time[-1]) or 1.0)
        figures = []
        for key, values in history.curves.items():
            plot = plain_figure(
                "", key, label=f"{quantity(key).title} over time", height=170, x_range=time_range
            )
            plot.line(
                "x",
                "y",
                source=ColumnDataSource({"x": time, "y": to_display(key, values)}),
                color=BLUE,
            )
            self._now.append(
                Span(dimension="height", line_color=VERMILION, line_dash="dashed", location=0.0)
            )
            plot.add_layout(self._now[-1])
            figures.append(plot)
        if figures:
            figures[-1].xaxis.axis_label = clock.axis
        self.curves.children = figures

    def _show(self, number: int) -> None:
        """Draw the maps of a frame."""
        history = self.history
        if history is None or not 0 <= number < len(history.maps):
            return
        clock = quantity(history.clock)
        time = history.times[number] * clock.factor
        position = f"map {number + 1} of {len(history.maps)}"
        caption = f"{history.names[number]}, {time:.4g} {clock.display}, {position}"
        self.step.tags = ["Step", history.names[number]]
        self.maps.make()
        self.maps.show(history.maps[number])
        for mark in self._now:
            mark.location = time
        self.status.text = sentences([caption], "soft")


def layout(view: HistoryView) -> Layout:
    """Return the parts of the page by name, and the sections that contain them."""
    parts = {
        "step": view.step,
        "play": view.play,
        "status": view.status,
        "verdict": view.verdict,
        "film": view.maps.film,
        "pressure": view.maps.pressure,
        "cutpressure": view.maps.cut_pressure,
        "cutfilm": view.maps.cut_film,
        "curves": view.curves,
        "notes": view.notes,
    }
    key = (("touching", "asperity contact"), ("cavitated", "no pressure"), ("hertz", "Hertz zone"))
    results: list[PageBlock] = [
        {"names": ["verdict"], "first": True},
        {"names": ["status"], "live": True, "first": True},
        {"names": ["film", "pressure"], "key": key, "first": True},
        {"names": ["cutpressure", "cutfilm"]},
        {"names": ["curves"], "heading": "Over time"},
        {"names": ["notes"]},
    ]
    return parts, [
        {
            "kind": "inputs",
            "label": "Steps",
            "blocks": [{"names": ["step"], "heading": "Steps"}, {"names": ["play"]}],
        },
        {"kind": "results", "label": "History", "blocks": results},
    ]
